/** Actions and their outcome: the basket, the room, or another state. */

import { count, h, message, unseen } from "./dom.js";
import { acts, stateOf } from "./domains.js";
import { Room } from "./room.js";
import { moveOf, statusView } from "./status.js";

/**
 * The actions of a round with their results; look-ups are folded.
 * @param {import("./api.js").Action[]} actions
 * @param {boolean} named Whether each action is named, also where it was done.
 */
export function actionList(actions, named) {
  const lookUps = actions.filter(isLookUp);
  const others = actions.filter((action) => !isLookUp(action));
  return h(
    "div",
    { class: "outcomes" },
    lookUps.length ? lookUpList(lookUps) : null,
    others.length ? h("ul", { class: "messages" }, ...others.map((action) => actionItem(action, named))) : null,
  );
}

function isLookUp(action) {
  return action.ok && !action.irreversible && action.observation.includes("\n");
}

function lookUpList(actions) {
  const items = actions.flatMap((action) => [h("dt", {}, action.text), h("dd", {}, action.observation)]);
  return h("details", {}, h("summary", {}, `Looked up ${count(actions.length, "thing")}`), h("dl", {}, ...items));
}

function actionItem(action, named) {
  const [first] = action.observation.split("\n");
  const apart = named || !action.ok;
  return message(
    "li",
    action.ok ? (moveOf(action)?.kind ?? "done") : "refused",
    unseen(action.ok ? "done: " : "failed: "),
    apart ? action.text : told(action),
    !apart ? null : h("span", { class: "reason" }, ` \u2013 ${first}`),
    action.irreversible && !action.observation.includes("cannot be undone") ? h("span", {}, " ", h("span", { class: "badge" }, "cannot be undone")) : null,
  );
}

/** The result of an action in a line: the first of a purchase, else the last. */
function told({ text, observation, irreversible }) {
  return observation.trim().split("\n").at(irreversible ? 0 : -1) || text;
}

/** Milliseconds to cross out further items, or to keep one after all. */
const MOMENT = 1500;

/** The state after a round: the basket, the room from above, or a domain's status. */
export class Outcome {
  /**
   * @param {import("./api.js").Episode} episode
   * @param {?{remove: (names: string[]) => void, marking: () => void}} hands `remove` has the agent
   *   take items out of the basket; `marking` is told when some are crossed out, or no longer.
   */
  constructor(episode, hands = null) {
    this.episode = episode;
    this.hands = hands;
    this.marked = new Set();
    this.sent = new Set();
    this.timer = 0;
    this.ready = false;
    this.state = stateOf(episode);
    this.shown = null;
    this.room = episode.view === "map" ? new Room(episode.id) : null;
    this.body = h("div", {});
    this.element = h(
      "section",
      { class: "panel", hidden: !acts(episode), "aria-label": this.state.state },
      h("h2", {}, this.state.state),
      this.room?.element,
      this.body,
    );
  }

  get #removers() {
    return [...this.body.querySelectorAll(".remove")];
  }

  /** Whether items are crossed out that were not sent yet. */
  get marks() {
    return this.marked.size > 0;
  }

  /** Whether the agent accepts words now; until then crossed out items wait. */
  setReady(ready) {
    this.ready = ready;
    if (!ready) return;
    this.sent.clear();
    this.#showMarks();
    if (this.marks) this.timer ||= setTimeout(() => this.#send());
  }

  #mark(name) {
    if (this.sent.has(name)) return;
    if (!this.marked.delete(name)) this.marked.add(name);
    this.#showMarks();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#send(), MOMENT);
    this.hands.marking();
  }

  #send() {
    this.timer = 0;
    if (!this.ready || !this.marks) return;
    this.sent = this.marked;
    this.marked = new Set();
    this.hands.remove([...this.sent]);
  }

  #showMarks() {
    for (const button of this.#removers) {
      const isMarked = this.marked.has(button.value) || this.sent.has(button.value);
      button.setAttribute("aria-pressed", String(isMarked));
      button.title = isMarked ? `Keep ${button.value}` : `Remove ${button.value}`;
      button.closest("tr").classList.toggle("marked", isMarked);
    }
  }

  /**
   * @param {number} number The round; 0 is the start.
   * @param {string} status
   * @param {Map<string, boolean>} [items] What was ever put into the basket; see `itemsOf`.
   * @param {boolean} [goesOn] Whether items can be taken out.
   */
  show(number, status, items, goesOn = false) {
    const key = `${number} ${status} ${goesOn}`;
    if (key === this.shown) return;
    this.shown = key;
    const focused = this.#removers.indexOf(document.activeElement);
    const mark = goesOn && this.hands ? (name) => this.#mark(name) : null;
    this.body.replaceChildren(statusView(status || this.state.empty, items, mark));
    const there = this.#removers.map((button) => button.value);
    this.marked = new Set([...this.marked].filter((name) => there.includes(name)));
    this.#showMarks();
    if (focused >= 0) (this.#removers[focused] ?? this.#removers.at(-1))?.focus();
    this.room?.show(number);
  }
}
