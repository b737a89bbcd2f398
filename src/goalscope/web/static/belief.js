/** The belief as moving bars, with details and corrections of each goal. */

import { arrange, calm, freshId, h, message, nameOf, percent, setText, unseen } from "./dom.js";

const SHOWN = 4;
const NOTABLE = 0.005;
const MOVE = { duration: 450, easing: "cubic-bezier(.2,.7,.2,1)" };

/**
 * @typedef {import("./api.js").Belief} Belief
 * @typedef {{belief: ?Belief, previous: ?Belief, colours: Map<string, string>, version: string,
 *   note?: string, silent?: boolean}} Shown `note`: of how the words were understood; `silent`: nothing
 *   was said yet, so that there is nothing to believe.
 */

export class Bars {
  /** @param {?((goal: string) => HTMLElement)} detailsOf The details under a goal; null for none. */
  constructor(detailsOf) {
    this.detailsOf = detailsOf;
    this.rows = new Map();
    this.open = null;
    this.all = false;
    this.shown = null;
    this.sureness = h("p", { class: "sureness" });
    this.note = h("p", { class: "soft small" });
    this.list = h("ol", { class: "bars" });
    this.legend = h("p", { class: "legend" });
    this.more = h("button", { type: "button", class: "quiet", onclick: () => this.#toggleRest() });
    this.element = h("div", { class: "belief" }, this.sureness, this.list, this.more, this.legend, this.note);
  }

  /** @param {Shown} shown */
  show(shown) {
    const before = this.#places();
    const fresh = shown.version !== this.shown?.version;
    this.shown = shown;
    const goals = shown.belief && !shown.belief.degenerate && !shown.silent ? shown.belief.goals : [];
    const kept = new Set(goals.map((goal) => goal.text));
    for (const text of [...this.rows.keys()]) if (!kept.has(text)) this.rows.delete(text);
    if (!kept.has(this.open)) this.open = null;
    goals.forEach((goal) => this.#update(goal, fresh));
    this.#list(goals);
    setText(this.sureness, shown.silent ? "Nothing has been said yet." : told(shown.belief));
    setText(this.note, shown.note ?? "");
    this.note.hidden = !shown.note;
    this.sureness.title = shown.belief && !shown.silent ? `Entropy: ${shown.belief.entropy.toFixed(2)} nats` : "";
    this.#legend(shown.belief, goals);
    this.#slide(before);
  }

  /** Closes the open details; returns whether there were any. */
  close() {
    if (!this.open) return false;
    const row = this.rows.get(this.open);
    this.#toggle(this.open);
    row?.button.focus();
    return true;
  }

  /** Moves the focus to a goal; returns whether it exists. */
  focus(text) {
    const row = this.rows.get(text);
    row?.button.focus();
    return Boolean(row);
  }

  #list(goals) {
    const rest = goals.slice(SHOWN).filter((goal) => goal.text !== this.open);
    const hidden = this.all ? [] : rest;
    const visible = goals.filter((goal) => !hidden.includes(goal));
    arrange(this.list, visible.map((goal) => this.rows.get(goal.text).element));
    this.more.hidden = rest.length === 0;
    setText(this.more, this.all ? "Show fewer" : `Show ${rest.length} more`);
  }

  #legend(belief, goals) {
    const marked = new Set(!goals.length || goals[0].unspecified ? [] : belief.set_90);
    this.legend.hidden = marked.size === 0;
    setText(
      this.legend,
      marked.size === 1
        ? "In nine talks of ten it is the marked one."
        : "In nine talks of ten it is among the marked ones.",
    );
    for (const [text, row] of this.rows) {
      row.element.classList.toggle("in-set", marked.has(text));
      setText(row.inSet, marked.has(text) ? ", among the likeliest with 90\u00a0%" : "");
    }
  }

  #update(goal, fresh) {
    const row = this.rows.get(goal.text) ?? this.#make(goal);
    const { previous, colours } = this.shown;
    const old = previous?.goals.find((one) => one.text === goal.text)?.probability;
    const change = old === undefined ? 0 : goal.probability - old;
    row.fill.style.setProperty("--share", String(goal.probability));
    row.bar.setAttribute("class", `bar ${goal.unspecified ? "unspecified" : colours.get(goal.text)}`);
    setText(row.percent, percent(goal.probability));
    setText(row.arrow, Math.abs(change) < NOTABLE ? "" : change > 0 ? "\u25b2" : "\u25bc");
    row.arrow.title = old === undefined ? "" : `before: ${percent(old)}`;
    setText(row.change, Math.abs(change) < NOTABLE ? "" : change > 0 ? ", up" : ", down");
    row.pin.hidden = !goal.pinned;
    row.isNew.hidden = !previous || old !== undefined || goal.pinned;
    if (this.open === goal.text && fresh) this.#fill(goal.text, row);
  }

  #make(goal) {
    const id = freshId("goal");
    const row = {
      fill: h("span", { class: "fill" }),
      percent: h("span", { class: "percent" }),
      arrow: h("span", { class: "arrow", "aria-hidden": "true" }),
      change: unseen(""),
      inSet: unseen(""),
      pin: h("span", { class: "badge" }, "confirmed"),
      isNew: h("span", { class: "badge" }, "new"),
      details: h("div", { class: "details", id, hidden: true }),
    };
    row.bar = h("span", { class: "bar" }, row.fill);
    const name = h("span", { class: "goal-name" }, nameOf(goal));
    const face = [h("span", { class: "goal-line" }, name, row.isNew, row.pin, row.percent, row.arrow, row.change, row.inSet), row.bar];
    row.button = this.detailsOf
      ? h(
          "button",
          { type: "button", class: "goal", "aria-expanded": "false", "aria-controls": id, onclick: () => this.#toggle(goal.text) },
          ...face,
        )
      : h("div", { class: "goal" }, ...face);
    row.element = h("li", { class: goal.unspecified ? "row none" : "row" }, row.button, row.details);
    this.rows.set(goal.text, row);
    return row;
  }

  #toggle(text) {
    const was = this.open;
    this.open = was === text ? null : text;
    for (const one of [was, this.open]) {
      const row = this.rows.get(one);
      if (!row) continue;
      const open = one === this.open;
      row.button.setAttribute("aria-expanded", String(open));
      row.details.hidden = !open;
      if (open) this.#fill(one, row);
      else row.details.replaceChildren();
    }
  }

  #fill(text, row) {
    row.details.replaceChildren(this.detailsOf(text));
  }

  #toggleRest() {
    this.all = !this.all;
    this.#list(this.shown.belief.goals);
  }

  #places() {
    const rows = [...this.rows].filter(([, row]) => row.element.isConnected);
    return new Map(rows.map(([text, row]) => [text, row.element.offsetTop]));
  }

  /** Rows that changed places glide there. */
  #slide(before) {
    if (calm()) return;
    for (const [text, row] of this.rows) {
      const moved = (before.get(text) ?? row.element.offsetTop) - row.element.offsetTop;
      if (moved) row.element.animate([{ transform: `translateY(${moved}px)` }, { transform: "none" }], MOVE);
    }
  }
}

/** How sure the belief is, in words. */
function told(belief) {
  if (!belief) return "I keep no list of goals here.";
  if (belief.degenerate) return "No goal explains what was said.";
  if (belief.goals[0]?.unspecified) return "I am not sure yet what you want.";
  const number = Math.exp(belief.entropy);
  if (number < 1.15) return "I am nearly certain.";
  if (number < 1.8) return "I am quite sure.";
  return "I am not sure yet: it may be one of these, or something else.";
}

/** Numbers in a reason, which a person sees on demand. */
const NATS = / \([+-][\d.]+ nats\)/;

/** Goals that came, went or were confirmed, with the reasons. */
export function changeList(changes) {
  const items = changes.map(({ kind, goal, reason, final }) => {
    const told = h("span", { class: "reason", title: reason }, reason.replace(NATS, ""), final ? " (for good)" : "");
    return message("li", kind, unseen(`${kind === "pinned" ? "confirmed" : kind}: `), goal, " ", told);
  });
  return h("ul", { class: "messages" }, ...items);
}

/** The changes of goals in a round, with a heading; nothing if there are none. */
export function changesOf(round) {
  return round?.changes.length ? [h("h3", {}, `What changed in round ${round.number}`), changeList(round.changes)] : [];
}
