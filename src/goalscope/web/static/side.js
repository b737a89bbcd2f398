/** The panels beside the chat: the belief, its history, and the outcome. */

import { Bars, changeList, changesOf } from "./belief.js";
import { coloursOf } from "./colours.js";
import { attempts, h, nameOf, percent, setText } from "./dom.js";
import { Outcome } from "./outcome.js";
import { Ribbons } from "./ribbons.js";
import { itemsOf, statusSummary } from "./status.js";
import { details, wordsForm } from "./why.js";

/**
 * @typedef {{correct: (kind: string, goal: string, text?: string) => Promise<void>,
 *   undo: () => Promise<void>, remove: (names: string[]) => void, marking: () => void}} Hands
 */

export class Side {
  /**
   * @param {import("./api.js").Episode} episode
   * @param {Hands} hands What the person can do about goals and basket.
   */
  constructor(episode, hands) {
    this.episode = episode;
    this.hands = hands;
    this.rounds = [];
    this.bars = new Bars((text) => this.#details(text));
    this.ribbons = new Ribbons();
    this.outcome = new Outcome(episode, hands);
    this.corrections = h("div", { class: "changes-slot" });
    this.changes = h("div", { class: "changes-slot" });
    this.undo = h("button", { type: "button", onclick: () => this.#undo() }, "Undo");
    this.told = h("p", { class: "unseen", role: "status" });
    this.add = this.#addForm();
    this.history = h(
      "section",
      { class: "panel", "aria-label": "History" },
      h("h2", {}, "How my guess moved"),
      this.ribbons.element,
      this.changes,
    );
    this.element = h(
      "aside",
      { class: "side", id: "side", "aria-label": "The belief", tabindex: 0 },
      h(
        "section",
        { class: "panel", "aria-label": "Goals" },
        h("h2", {}, "What I think you want"),
        this.told,
        this.bars.element,
        this.corrections,
        this.add,
      ),
      this.outcome.element,
      this.history,
    );
  }

  /**
   * @param {import("./api.js").Round[]} rounds
   * @param {?import("./api.js").Live} live
   */
  show(rounds, live) {
    this.rounds = rounds;
    this.live = live;
    const last = rounds.at(-1);
    const corrected = Boolean(live?.changes.length);
    const belief = live ? live.belief : (last?.belief ?? null);
    const previous = corrected ? last?.belief : rounds.at(-2)?.belief;
    const key = JSON.stringify([rounds.length, Boolean(live), belief, live?.changes, live?.can_undo]);
    if (key === this.key) return;
    this.key = key;
    const columns = rounds.map((round) => ({ label: String(round.number), belief: round.belief }));
    if (corrected && rounds.length) columns.push({ label: "now", belief });
    const colours = coloursOf([...columns.map((column) => column.belief), belief]);
    this.belief = belief;
    this.colours = colours;
    this.silent = !rounds.length && belief?.goals.length === 1 && belief.goals[0].unspecified;
    setText(this.told, this.silent ? "" : summaryOf(belief));
    const note = corrected ? "" : last?.belief_note;
    this.bars.show({ belief, previous: previous ?? null, colours, version: key, note, silent: this.silent });
    this.ribbons.show(columns, colours);
    this.history.hidden = !columns.some((column) => column.belief);
    this.add.hidden = !this.#correctable();
    this.#corrections(live);
    this.changes.replaceChildren(...changesOf(last));
    this.outcome.show(rounds.length, last?.status ?? "", itemsOf(rounds), Boolean(live));
  }

  /** Closes the open details; returns whether there were any. */
  close() {
    return this.bars.close();
  }

  /** Whether the agent accepts words now. */
  setReady(ready) {
    this.outcome.setReady(ready);
  }

  /** Whether items of the basket are crossed out that were not sent yet. */
  get marks() {
    return this.outcome.marks;
  }

  /** The basket's total. */
  get summary() {
    return statusSummary(this.rounds.at(-1)?.status ?? "");
  }

  #correctable() {
    return Boolean(this.live) && this.episode.method === "good";
  }

  #details(text) {
    const last = this.rounds.at(-1);
    const wasThere = last?.belief?.goals.some((goal) => goal.text === text);
    const correct = async (kind, words) => {
      await this.hands.correct(kind, text, words);
      if (!this.bars.focus(text)) this.undo.focus();
    };
    return details({
      id: this.episode.id,
      goal: this.belief.goals.find((goal) => goal.text === text),
      round: wasThere ? last.number : null,
      weighs: this.episode.method === "good",
      goesOn: Boolean(this.live),
      correct: this.#correctable() ? correct : null,
    });
  }

  async #undo() {
    await this.hands.undo();
    if (!this.undo.isConnected) this.bars.focus(this.belief?.goals[0].text);
  }

  #addForm() {
    const [problem, attempt] = attempts();
    const add = async (text) => {
      await this.hands.correct("pin", text);
      form.reset();
      box.open = false;
    };
    const form = wordsForm("What you want, in your words", "", "Add", (text) => attempt(() => add(text)));
    const hint = h("p", { class: "soft small" }, "I take it as confirmed: almost certainly what you want.");
    const box = h("details", { class: "add" }, h("summary", {}, "Add a goal"), form, hint, problem);
    return box;
  }

  #corrections(live) {
    const changes = live?.changes ?? [];
    this.corrections.replaceChildren(
      ...(changes.length ? [h("h3", {}, "What you changed"), changeList(changes)] : []),
      ...(live?.can_undo ? [this.undo] : []),
    );
  }
}

/** The announcement of a changed belief for screen readers. */
function summaryOf(belief) {
  const first = belief?.goals[0];
  if (!first) return "";
  return `Likeliest now: ${nameOf(first)}, ${percent(first.probability)}.`;
}

/** On a phone: the belief in one line, which opens the panels beside the chat. */
export class Strip {
  /** @param {HTMLElement} side */
  constructor(side) {
    this.side = side;
    this.mini = h("span", { class: "mini", "aria-hidden": "true" });
    this.text = h("span", { class: "strip-text" });
    this.sum = h("span", { class: "strip-sum" });
    this.element = h(
      "button",
      { type: "button", class: "strip", "aria-expanded": "false", "aria-controls": "side", onclick: () => this.#open(!this.isOpen) },
      this.mini,
      h("span", { class: "strip-line" }, this.text, this.sum),
    );
  }

  get isOpen() {
    return this.element.getAttribute("aria-expanded") === "true";
  }

  close() {
    if (this.isOpen) this.#open(false);
  }

  #open(yes) {
    this.element.setAttribute("aria-expanded", String(yes));
    this.side.classList.toggle("open", yes);
  }

  /** @param {Side} side */
  show(side) {
    const goals = (!side.silent && side.belief?.goals) || [];
    const [first] = goals;
    const none = side.silent ? "Nothing has been said yet" : "The belief";
    setText(this.text, first ? `${percent(first.probability)} ${nameOf(first)}` : none);
    setText(this.sum, side.summary);
    this.mini.replaceChildren(
      ...goals.map((goal) => {
        const part = h("span", { class: goal.unspecified ? "unspecified" : side.colours.get(goal.text) });
        part.style.setProperty("flex-grow", String(goal.probability));
        return part;
      }),
    );
  }
}
