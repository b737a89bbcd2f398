/** Stored episodes, round by round: one, or two side by side. */

import { api, pathOf } from "./api.js";
import { Bars, changesOf } from "./belief.js";
import { Log } from "./chat.js";
import { coloursOf } from "./colours.js";
import { count, h, localTime, setText } from "./dom.js";
import { domainOf, isDrawn, personOf } from "./domains.js";
import { Outcome } from "./outcome.js";
import { Ribbons } from "./ribbons.js";
import { itemsOf } from "./status.js";
import { details } from "./why.js";

const BEAT = 1600;

/**
 * @param {HTMLElement} main
 * @param {{id: string, options: object}} at
 * @param {AbortSignal} signal
 */
export async function replay(main, { id, options }, signal) {
  const state = await api.episode(id);
  if (signal.aborted) return;
  document.title = "Replay \u00b7 goalscope";
  const slider = new Slider(state.rounds.length, signal);
  const view = new View(state, options, coloursOf(beliefsOf(state)), (number) => slider.go(number));
  const head = h("header", { class: "replay-head" }, h("h1", {}, `Replay: ${domainOf(state.episode, options).title}`), links(state));
  main.replaceChildren(h("div", { class: "page replay" }, head, slider.element, view.element));
  slider.follow((number) => view.show(number));
  closeOnEscape([view], signal);
}

/**
 * @param {HTMLElement} main
 * @param {{first: string, second: string, options: object}} at
 * @param {AbortSignal} signal
 */
export async function compare(main, { first, second, options }, signal) {
  const states = await Promise.all([api.episode(first), api.episode(second)]);
  if (signal.aborted) return;
  document.title = "Compare \u00b7 goalscope";
  const slider = new Slider(Math.max(...states.map((state) => state.rounds.length)), signal);
  const colours = coloursOf(states.flatMap(beliefsOf));
  const views = states.map((state) => new View(state, options, colours, (number) => slider.go(number)));
  const columns = views.map((view, place) => {
    const { id } = states[place].episode;
    const name = place ? "Second" : "First";
    const link = h("a", { href: `#/replay/${id}` }, `${name}: ${id}`);
    return h("section", { class: "compared", "aria-label": name }, h("h2", {}, link), view.element);
  });
  main.replaceChildren(
    h("div", { class: "page replay" }, h("h1", {}, "Compare"), slider.element, h("div", { class: "side-by-side" }, ...columns)),
  );
  slider.follow((number) => views.forEach((view) => view.show(number)));
  closeOnEscape(views, signal);
}

function beliefsOf(state) {
  return state.rounds.map((round) => round.belief);
}

function closeOnEscape(views, signal) {
  const close = (event) => {
    if (event.key === "Escape") views.forEach((view) => view.bars.close());
  };
  document.addEventListener("keydown", close, { signal });
}

function links({ episode, live }) {
  return h(
    "div",
    { class: "buttons" },
    live ? h("a", { class: "button primary", href: `#/talk/${episode.id}` }, "Continue") : null,
    h("a", { class: "button", href: pathOf(episode.id, "/export.json"), download: "" }, "Save as JSON"),
  );
}

/** Which round is shown; plays through them. */
class Slider {
  constructor(most, signal) {
    this.most = most;
    this.timer = 0;
    this.input = h("input", {
      type: "range",
      min: 1,
      max: Math.max(most, 1),
      value: Math.max(most, 1),
      step: 1,
      id: "round",
      oninput: () => {
        this.#stop();
        this.#tell();
      },
    });
    this.label = h("output", { for: "round" });
    this.play = h("button", { type: "button", class: "play", onclick: () => this.#toggle() }, "Play");
    this.element = h(
      "div",
      { class: "slider", hidden: most === 0 },
      this.play,
      h("label", { for: "round" }, "Round"),
      this.input,
      this.label,
    );
    signal.addEventListener("abort", () => this.#stop());
  }

  /** @param {(number: number) => void} told Called with each round to show. */
  follow(told) {
    this.told = told;
    this.#tell();
  }

  go(number) {
    this.#stop();
    this.input.value = number;
    this.#tell();
  }

  #tell() {
    const number = Number(this.input.value);
    setText(this.label, `${number} of ${this.most}`);
    this.input.setAttribute("aria-valuetext", `Round ${number} of ${this.most}`);
    this.told(Math.min(number, this.most));
  }

  #toggle() {
    if (this.timer) {
      this.#stop();
      return;
    }
    if (Number(this.input.value) >= this.most) this.input.value = 1;
    else this.input.value = Number(this.input.value) + 1;
    this.#tell();
    this.timer = setInterval(() => this.#next(), BEAT);
    setText(this.play, "Pause");
  }

  #next() {
    if (Number(this.input.value) >= this.most) {
      this.#stop();
      return;
    }
    this.input.value = Number(this.input.value) + 1;
    this.#tell();
  }

  #stop() {
    clearInterval(this.timer);
    this.timer = 0;
    setText(this.play, "Play");
  }
}

/** One episode as it stood after a round. */
class View {
  /**
   * @param {{episode: import("./api.js").Episode, rounds: import("./api.js").Round[]}} state
   * @param {object} options
   * @param {Map<string, string>} colours
   * @param {(number: number) => void} go Shows another round.
   */
  constructor({ episode, rounds }, options, colours, go) {
    this.episode = episode;
    this.rounds = rounds;
    this.colours = colours;
    this.columns = rounds.map((round) => ({ label: String(round.number), belief: round.belief }));
    this.bars = new Bars((text) => this.#details(text));
    this.ribbons = new Ribbons((place) => go(place + 1));
    this.outcome = new Outcome(episode);
    this.log = new Log(episode);
    this.changes = h("div", { class: "changes-slot" });
    this.element = h("div", { class: "view" }, ...about(episode, options), ...this.#panels());
  }

  #panels() {
    if (!this.rounds.length) return [h("p", {}, "Nothing has been said yet.")];
    return [
      this.ribbons.element,
      h(
        "div",
        { class: "view-columns" },
        h("div", { class: "panel" }, this.log.element),
        h(
          "div",
          {},
          h("div", { class: "panel" }, h("h2", {}, "What I thought you want"), this.bars.element, this.changes),
          this.outcome.element,
        ),
      ),
    ];
  }

  /** @param {number} number The round; an episode with fewer stays at its last. */
  show(number) {
    const place = Math.min(number, this.rounds.length) - 1;
    const round = this.rounds[place];
    if (!round) return;
    this.number = round.number;
    this.belief = round.belief;
    const previous = this.rounds[place - 1]?.belief ?? null;
    this.bars.show({ belief: round.belief, previous, colours: this.colours, version: String(place), note: round.belief_note });
    this.ribbons.show(this.columns, this.colours, place);
    this.outcome.show(round.number, round.status, itemsOf(this.rounds.slice(0, place + 1)));
    this.log.show(this.rounds.slice(0, place + 1));
    this.log.scrollToEnd();
    this.changes.replaceChildren(...changesOf(round));
  }

  #details(text) {
    return details({
      id: this.episode.id,
      goal: this.belief.goals.find((goal) => goal.text === text),
      round: this.number,
      weighs: this.episode.method === "good",
      goesOn: false,
      correct: null,
    });
  }
}

function about(episode, options) {
  const facts = [
    localTime(episode.created),
    domainOf(episode, options).title,
    personOf(episode),
    options.methods.find((one) => one.name === episode.method)?.about ?? episode.method,
    episode.model,
    count(episode.rounds, "round"),
    episode.score === null ? "" : `score ${episode.score.toFixed(2)}`,
  ];
  return [
    ...(isDrawn(episode) ? [] : [h("p", { class: "text" }, episode.task)]),
    h("p", { class: "soft small" }, facts.filter(Boolean).join(" \u00b7 ")),
  ];
}
