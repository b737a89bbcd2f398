/** The status of an environment: the basket as a table, anything else as a list. */

import { h, unseen } from "./dom.js";

const ITEM = /^- (\d+) x (.*): (.*)$/;
const UNIT = / \([^()]*\)$/;
const MOVED = /^(add|remove) item: (.*?)(?: x\d+)?$/;
const GUESSED = "Guessed, not asked for: ";
const MENTIONED = "Because you mentioned it: ";
const GIVEN_UP = "Taken back, as it was a guess for another goal: ";
const TOTAL = /^Total: (.*)$/;

/** Whether a status is a basket with items in it. */
function isBasket(lines) {
  return lines.some((line) => ITEM.test(line));
}

/**
 * All items ever put into the basket, each with whether it was guessed and not asked for since.
 * @param {import("./api.js").Round[]} rounds
 * @returns {Map<string, boolean>}
 */
export function itemsOf(rounds) {
  const items = new Map();
  for (const { actions, notes } of rounds) {
    for (const action of actions) {
      const { name } = moveOf(action) ?? {};
      if (name && action.ok) items.set(name, notes.some((note) => names(note, GUESSED, name)));
    }
    for (const name of items.keys()) {
      if (notes.some((note) => note.endsWith(` x ${name} already.`))) items.set(name, false);
    }
  }
  return items;
}

/** What an action puts into the basket, or takes out of it; null for all others. */
export function moveOf({ text }) {
  const [, verb, name] = MOVED.exec(text) ?? [];
  return name ? { kind: verb === "add" ? "added" : "removed", name } : null;
}

/** Whether a note with this prefix, a list of things perhaps with the goals that they are for, names a thing. */
function names(note, prefix, thing) {
  const list = note.startsWith(prefix) ? `, ${note.slice(prefix.length, -1)},` : "";
  return [", ", "; "].some((before) => [",", ";", " (to "].some((after) => list.includes(before + thing + after)));
}

const KINDS = { [GUESSED]: "guessed", [MENTIONED]: "guessed", [GIVEN_UP]: "removed", "Taken back: ": "done", "As you confirmed: ": "done" };

/** Whether notes tell already that a thing was put into the basket, or taken out of it. */
export function namedIn(notes, action) {
  const { kind, name } = moveOf(action) ?? {};
  const prefixes = kind === "added" ? [GUESSED, MENTIONED] : [GIVEN_UP];
  return Boolean(kind) && notes.some((note) => prefixes.some((prefix) => names(note, prefix, name)));
}

/** Of which kind a note is: something guessed, removed, done, or else refused or doubted. */
export function kindOf(note) {
  return Object.entries(KINDS).find(([prefix]) => note.startsWith(prefix))?.[1] ?? "refused";
}

/** The name in a line of the basket, which may bear a unit. */
function nameIn(text, items) {
  return items.has(text) ? text : text.replace(UNIT, "");
}

/**
 * The status as a table of what is in the basket, or else as a list.
 * @param {string} status
 * @param {Map<string, boolean>} items As `itemsOf` says; what was guessed is marked so.
 * @param {?((name: string) => void)} mark Is told which item is to go, or to stay after all.
 */
export function statusView(status, items = new Map(), mark = null) {
  const lines = status.split("\n").filter((line) => line.trim());
  return isBasket(lines) ? basket(lines, items, mark) : listed(lines);
}

function basket(lines, known, hands) {
  const mark = isBought(lines) ? null : hands;
  const items = lines.map((line) => ITEM.exec(line)).filter(Boolean);
  const total = lines.map((line) => TOTAL.exec(line)).find(Boolean);
  const others = lines.slice(1).filter((line) => !ITEM.test(line) && !TOTAL.test(line));
  const cell = (name, text, attributes = {}) => h(name, attributes, text);
  const heads = ["Number", "Item", "Price", ...(mark ? ["Remove"] : [])];
  const button = (name) =>
    h(
      "button",
      { type: "button", class: "remove", value: name, onclick: () => mark(name) },
      unseen(`Remove ${name}`),
    );
  return h(
    "div",
    {},
    h(
      "table",
      { class: "basket" },
      h("caption", { class: "unseen" }, lines[0].replace(/:$/, "")),
      h(
        "thead",
        { class: "unseen" },
        h("tr", {}, ...heads.map((text) => cell("th", text, { scope: "col" }))),
      ),
      h(
        "tbody",
        {},
        ...items.map(([, number, text, price]) => {
          const name = nameIn(text, known);
          const unit = text.slice(name.length);
          return h(
            "tr",
            {},
            cell("td", `${number}\u00a0\u00d7`, { class: "quantity" }),
            h("td", {}, name, unit && h("span", { class: "soft" }, unit), ...(known.get(name) ? [" ", h("span", { class: "badge" }, "guessed")] : [])),
            cell("td", price, { class: "price" }),
            mark ? h("td", { class: "remove-cell" }, button(name)) : null,
          );
        }),
      ),
      total
        ? h("tfoot", {}, h("tr", {}, cell("th", isBought(lines) ? "Bought, total" : "Total", { scope: "row", colspan: 2 }), cell("td", total[1], { class: "price" }), mark ? h("td", {}) : null))
        : null,
    ),
    ...others.map((line) => h("p", {}, line)),
  );
}

function listed(lines) {
  const view = h("div", { class: "status-text" });
  for (const line of lines) {
    const item = line.startsWith("- ");
    if (!item) view.append(h("p", {}, line));
    else if (view.lastChild?.localName !== "ul") view.append(h("ul", {}));
    if (item) view.lastChild.append(h("li", {}, line.slice(2)));
  }
  return view;
}

function isBought(lines) {
  return lines[0] === "Purchased:";
}

/** The total in a few words, where there is little room. */
export function statusSummary(status) {
  const lines = status.split("\n");
  const total = lines.map((line) => TOTAL.exec(line)).find(Boolean)?.[1];
  return total ? `${isBought(lines) ? "Bought, total" : "Total"} ${total}` : "";
}
