/** What was done, and what it led to: actions, the basket, the room, or how else things stand. */

import { pathOf } from "./api.js";
import { count, h, setText, unseen } from "./dom.js";
import { acts, stateOf } from "./domains.js";
import { statusView } from "./status.js";

/**
 * The actions of a round, with what came of each; what was only looked up is folded.
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
    others.length ? h("ul", { class: "actions" }, ...others.map((action) => actionItem(action, named))) : null,
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
  return h(
    "li",
    { class: action.ok ? "done" : "failed", title: action.text },
    h("span", { class: "sign", "aria-hidden": "true" }, action.ok ? "\u2713" : "\u2717"),
    h(
      "span",
      {},
      unseen(action.ok ? "done: " : "failed: "),
      apart ? action.text : told(action),
      !apart ? null : h("span", { class: "reason" }, ` \u2013 ${first}`),
      action.irreversible && !action.observation.includes("cannot be undone") ? h("span", { class: "badge" }, "cannot be undone") : null,
    ),
  );
}

/** What an action that was done came to: a purchase first says so; else the last line does. */
function told({ text, observation, irreversible }) {
  return observation.trim().split("\n").at(irreversible ? 0 : -1) || text;
}

/** What stands in the end of a round: the basket, the room from above, or what a domain says. */
export class Outcome {
  /**
   * @param {import("./api.js").Episode} episode
   * @param {?((names: string[]) => void)} remove Has the agent take items out of the basket.
   */
  constructor(episode, remove = null) {
    this.episode = episode;
    this.remove = remove;
    this.marked = new Set();
    this.ready = false;
    this.house = episode.domain === "house";
    this.state = stateOf(episode.domain);
    this.shown = null;
    this.image = h("img", { class: "room", alt: "" });
    this.body = h("div", {});
    this.takeOut = h("button", { type: "button", class: "take-out", hidden: true, onclick: () => this.#send() });
    this.element = h(
      "div",
      { class: "panel", hidden: !acts(episode.domain) },
      h("h2", {}, this.state.state),
      this.house ? h("a", { class: "room-link", target: "_blank", rel: "noopener" }, this.image) : null,
      this.body,
      this.takeOut,
    );
  }

  get #removers() {
    return [...this.body.querySelectorAll(".remove")];
  }

  /** Whether the agent listens now; the button waits until then, and keeps the focus. */
  setReady(ready) {
    this.ready = ready;
    this.takeOut.setAttribute("aria-disabled", String(!ready));
  }

  #mark(name) {
    if (!this.marked.delete(name)) this.marked.add(name);
    this.#showMarks();
  }

  #send() {
    if (!this.ready) return;
    const names = [...this.marked];
    this.marked.clear();
    this.#showMarks();
    this.#removers[0]?.focus();
    this.remove(names);
  }

  #showMarks() {
    for (const button of this.#removers) {
      const isMarked = this.marked.has(button.value);
      button.setAttribute("aria-pressed", String(isMarked));
      button.closest("tr").classList.toggle("marked", isMarked);
    }
    this.takeOut.hidden = this.marked.size === 0;
    setText(this.takeOut, `Take out ${this.marked.size}`);
  }

  /**
   * @param {number} number The round; 0 is the start.
   * @param {string} status
   */
  show(number, status) {
    const key = `${number} ${status}`;
    if (key === this.shown) return;
    this.shown = key;
    const focused = this.#removers.indexOf(document.activeElement);
    this.body.replaceChildren(statusView(status || this.state.empty, this.remove && ((name) => this.#mark(name))));
    const there = this.#removers.map((button) => button.value);
    this.marked = new Set([...this.marked].filter((name) => there.includes(name)));
    this.#showMarks();
    if (focused >= 0) (this.#removers[focused] ?? this.#removers.at(-1))?.focus();
    if (!this.house) return;
    const picture = pathOf(this.episode.id, `/picture.svg?round=${number}`);
    this.image.src = picture;
    this.image.alt = `The room from above ${number ? `after round ${number}` : "at the start"}`;
    this.image.parentElement.href = picture;
  }
}
