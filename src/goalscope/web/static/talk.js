/** A running conversation: the chat, the belief, and the outcome. */

import { api, listen } from "./api.js";
import { Composer, Log } from "./chat.js";
import { count, h } from "./dom.js";
import { drafts } from "./drafts.js";
import { domainOf, stateOf } from "./domains.js";
import { itemsOf, statusSummary, statusView } from "./status.js";
import { Side, Strip } from "./side.js";

/**
 * @param {HTMLElement} main
 * @param {{id: string, options: object}} at
 * @param {AbortSignal} signal
 */
export async function talk(main, { id, options }, signal) {
  const state = await api.episode(id);
  if (signal.aborted) return;
  if (!state.live) {
    location.replace(`#/replay/${id}`);
    return;
  }
  new Talk(main, id, options, state, signal);
}

class Talk {
  constructor(main, id, options, state, signal) {
    this.id = id;
    this.state = { ...state, connected: true };
    this.pending = null;
    this.failed = null;
    this.problem = "";
    this.domain = domainOf(state.episode, options);
    this.signal = signal;
    this.log = new Log(state.episode);
    this.composer = new Composer((text) => this.say(text), drafts(`words of ${id}`));
    this.side = new Side(state.episode, {
      correct: (kind, goal, text) => this.correct(kind, goal, text),
      undo: () => this.undo(),
      remove: (names) => this.say(names.map((name) => `Remove the ${name}.`).join(" ")),
      marking: () => this.render(),
    });
    this.strip = new Strip(this.side.element);
    this.error = h("div", { class: "slot", role: "alert" });
    this.end = h("div", { class: "slot" });
    this.hint = h("p", { class: "hint" });
    this.examples = this.#examples();
    this.log.after.before(this.examples);
    main.replaceChildren(this.#page());
    this.composer.restore();
    this.render();
    this.composer.input.focus({ preventScroll: true });
    this.#listen();
  }

  #page() {
    const { title } = this.domain;
    document.title = `${title} \u00b7 goalscope`;
    const chat = h(
      "section",
      { class: "chat", "aria-label": title },
      h("header", { class: "chat-head" }, h("h1", {}, title)),
      this.log.element,
      h("div", { class: "foot" }, this.log.below, this.error, this.end, this.composer.element, this.hint),
    );
    return h("div", { class: "talk", "data-view": this.state.episode.view }, chat, this.strip.element, this.side.element);
  }

  /** What one may say first, to click. */
  #examples() {
    const said = (text) => h("button", { type: "button", onclick: () => this.composer.send(text) }, text);
    const { examples } = stateOf(this.state.episode);
    return h("div", { class: "examples", role: "group", "aria-label": "Examples" }, h("p", {}, "You could say:"), ...examples.map(said));
  }

  #listen() {
    const handlers = {
      live: (live) => this.#live(live),
      round: (round) => this.#round(round),
      ended: (episode) => this.update({ episode, live: null }),
      connected: (connected) => this.update({ connected }),
      refused: () => this.reload(),
    };
    this.hangUp = listen(this.id, handlers, this.signal);
    const escape = (event) => {
      if (event.key === "Escape" && !this.side.close()) this.strip.close();
    };
    document.addEventListener("keydown", escape, { signal: this.signal });
  }

  #live(live) {
    if (this.state.episode.ended) return;
    if (live.round > this.state.rounds.length + 1) this.reload();
    if (live.utterance) this.pending = null;
    if (live.error) this.failed = live.utterance;
    this.update({ live });
  }

  #round(round) {
    this.pending = null;
    if (this.failed === round.utterance) this.failed = null;
    const rounds = this.state.rounds.filter((one) => one.number !== round.number);
    this.update({ rounds: [...rounds, round].sort((a, b) => a.number - b.number) });
  }

  /** Reloads the state from the server; if that fails, the status line says so. */
  async reload() {
    const found = await api.episode(this.id).catch(() => null);
    if (found) this.update(found);
  }

  /** @param {object} changed What is new in the state. */
  update(changed) {
    if (this.signal.aborted || (changed.live && this.#isOld(changed.live))) return;
    Object.assign(this.state, changed);
    this.render();
  }

  /** Whether a newer state came first, or the episode has ended. */
  #isOld(live) {
    return !this.state.live || live.version < this.state.live.version;
  }

  async say(text, confirmed) {
    this.pending = text;
    this.failed = null;
    this.#tell("");
    this.log.scrollToEnd();
    try {
      const said = { text, round: this.state.live.round, ...(confirmed ? { confirmed } : {}) };
      this.#live(await api.say(this.id, said));
    } catch (error) {
      this.pending = null;
      this.failed = confirmed ? null : text; // a confirmation is not repeated unseen
      this.#tell(error.message);
      if (error.status === 409) this.reload();
    }
  }

  async correct(kind, goal, text) {
    await this.#change(() => api.correct(this.id, { kind, goal, ...(text ? { text } : {}) }));
  }

  async undo() {
    await this.#change(() => api.undo(this.id)).catch((error) => this.#tell(error.message));
  }

  async #change(change) {
    try {
      this.update({ live: await change() });
    } catch (error) {
      if (error.status === 409) this.reload();
      throw error;
    }
  }

  #tell(problem) {
    this.problem = problem;
    this.render();
  }

  render() {
    const { episode, rounds, live, connected } = this.state;
    const round = live?.round ?? rounds.length + 1;
    const utterance = this.pending ?? live?.utterance ?? this.failed;
    this.log.show(rounds, live ? { round, query: live.query, utterance } : null);
    this.side.show(rounds, live);
    this.strip.show(this.side);
    this.#status(live, connected);
    this.#error(live);
    this.#confirm(live);
    this.#end(episode, rounds, live);
    const ready = Boolean(live && live.phase === "idle" && live.query && this.pending === null);
    this.examples.hidden = !ready || rounds.length > 0 || Boolean(this.failed) || !this.examples.querySelector("button");
    this.side.setReady(ready);
    this.composer.setReady(ready && !this.side.marks);
  }

  #status(live, connected) {
    const idle = this.side.marks ? "Removing the items that you crossed out\u2026" : "";
    const step = connected ? working(live, this.pending) || idle : "Connection lost. Trying again\u2026";
    const first = step && connected && !this.state.rounds.length && live?.utterance;
    this.log.tell(first ? `${step} The first answer takes longest.` : step);
  }

  #error(live) {
    const problem = this.problem || live?.error || "";
    const key = `${problem}|${this.failed}`;
    if (key === this.errorShown) return;
    this.errorShown = key;
    const failed = this.failed;
    const buttons = failed
      ? h(
          "div",
          { class: "buttons" },
          h("button", { type: "button", class: "primary", onclick: () => this.say(failed) }, "Try again"),
          h("button", { type: "button", onclick: () => this.composer.write(failed) }, "Edit the words"),
        )
      : h("div", { class: "buttons" }, h("button", { type: "button", onclick: () => this.#tell("") }, "Close"));
    this.error.replaceChildren(...(problem ? [h("div", { class: "card error" }, h("p", {}, problem), buttons)] : []));
  }

  #confirm(live) {
    const rests = live?.phase === "idle" && this.pending === null && !this.side.marks;
    const wanted = rests ? live.confirm : null;
    const shown = wanted && `${live.round}|${wanted.state}|${live.query}`;
    if (shown === this.confirmShown) return;
    this.confirmShown = shown;
    if (wanted) this.strip.close();
    this.log.put(wanted ? this.#confirmCard(wanted, live.query ?? "") : null);
  }

  /**
   * The question stands in the talk already, if the agent could ask it.
   * @param {NonNullable<import("./api.js").Live["confirm"]>} asked
   * @param {string} query
   */
  #confirmCard({ state, status, question, yes, no }, query) {
    const buys = this.state.episode.view === "basket";
    const about = buys ? "Your basket" : "This cannot be undone.";
    const items = itemsOf(this.state.rounds);
    const answer = (words, confirmed) => {
      this.say(words, confirmed);
      this.log.element.focus({ preventScroll: true });
    };
    const label = (words) => words.replace(/\.$/, ""); // a button says the words that it sends
    return h(
      "section",
      { class: "card confirm", "aria-label": "To confirm" },
      h("h2", {}, query.includes(question) ? about : question),
      buys ? statusView(status, items) : null,
      h(
        "div",
        { class: "buttons" },
        h("button", { type: "button", class: "primary", onclick: () => answer(yes, state) }, label(yes)),
        h("button", { type: "button", onclick: () => answer(no) }, label(no)),
      ),
    );
  }

  #end(episode, rounds, live) {
    this.composer.element.hidden = !live;
    this.hint.hidden = !live;
    if (live && this.hint.childElementCount === 0) {
      const phrase = live.completion_phrase;
      const write = () => this.composer.write(phrase);
      this.hint.append("To finish, say \u201c", h("button", { type: "button", class: "quiet", onclick: write }, phrase), "\u201d.");
    }
    if (live || this.end.childElementCount) return;
    this.hangUp?.();
    this.end.append(endCard(episode, statusSummary(rounds.at(-1)?.status ?? ""), this.composer.words));
    this.log.scrollToEnd();
  }
}

const STEPS = {
  reading: "Reading your words",
  "proposing goals": "Thinking of what you may want",
  "checking goals": "Checking these goals",
  planning: "Working out what to do",
  asking: "Thinking of what to ask",
};

/** What the agent does now, in words; empty while it is the person's turn. */
function working(live, pending) {
  if (!live) return "";
  if (live.phase === "idle" && pending === null) return "";
  const step = live.step || "reading";
  const scored = /^scoring (.*)$/.exec(step)?.[1];
  return `${scored ? `Weighing your words for ${scored}` : (STEPS[step] ?? step)}\u2026`;
}

function endCard(episode, total, unsent) {
  const rounds = count(episode.rounds, "round");
  const score = episode.score === null ? "" : ` Score: ${episode.score.toFixed(2)}.`;
  return h(
    "section",
    { class: "card ended", "aria-label": "The end" },
    h("h2", {}, episode.ended === "terminated" ? "Done" : "Out of rounds"),
    h("p", {}, `${total ? `${total}. ` : ""}It took ${rounds}.${score}`),
    unsent ? h("p", { class: "unsent" }, `Not sent: \u201c${unsent}\u201d`) : null,
    h(
      "div",
      { class: "buttons" },
      h("a", { class: "button primary", href: `#/replay/${episode.id}` }, "See how the belief moved"),
      h("a", { class: "button", href: "#/" }, "Begin another"),
    ),
  );
}
