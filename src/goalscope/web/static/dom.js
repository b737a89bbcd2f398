/** Creates elements, and formats numbers and times. Text only ever becomes a text node. */

const SVG = "http://www.w3.org/2000/svg";
/** Marks that nobody sees and that can reorder a line; joiners and signs of numbers are none. */
const INVISIBLE = /(?![\u200c\u200d\u0600-\u0605\u06dd\u070f\u0890\u0891\u08e2])\p{Cf}/gu;
/** A web address, without the punctuation after it; brackets in it are closed in it. */
const ADDRESS = /(https?:\/\/(?:[^\s<>"()]|\([^\s<>"()]*\))*(?:[^\s<>"'().,;:!?]|\([^\s<>"()]*\)))/giu;

/**
 * An element. Functions become listeners ("onclick"); null and false omit an attribute.
 * @param {string} name
 * @param {Record<string, unknown>} attributes
 * @param {...(Node|string|null|undefined|false)} children
 * @returns {HTMLElement}
 */
export function h(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/** The same for SVG. */
export function svg(name, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, name), attributes, children);
}

function filled(element, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, "");
    else if (value !== null && value !== undefined && value !== false) {
      element.setAttribute(key, String(value));
    }
  }
  const shown = children.filter((child) => child !== null && child !== undefined && child !== false);
  element.append(...shown.map((child) => (child instanceof Node ? child : visible(child))));
  return element;
}

/** A text without invisible marks. */
function visible(text) {
  return String(text).replace(INVISIBLE, "");
}

/** Sets the text of an element if it differs. */
export function setText(element, text) {
  const shown = visible(text);
  if (element.textContent !== shown) element.textContent = shown;
}

/** Arranges the children of a parent; one in its place is not touched. */
export function arrange(parent, children) {
  children.forEach((child, place) => {
    if (parent.children[place] !== child) parent.insertBefore(child, parent.children[place] ?? null);
  });
  while (parent.children.length > children.length) parent.lastElementChild.remove();
}

/** The parts of a text; its web addresses are links. */
export function linked(text) {
  return text.split(ADDRESS).map((part, at) => (at % 2 ? h("a", { href: part }, part) : part));
}

/** Text for screen readers only. */
export function unseen(text) {
  return h("span", { class: "unseen" }, text);
}

const SIGNS = { done: "\u2713", pinned: "\u2713", added: "+", removed: "\u2212", guessed: "\u2248", asked: "?", refused: "!" };

/** What the assistant tells; its sign and its class, of several words, say of which kind it is. */
export function message(name, kind, ...children) {
  const sign = h("span", { class: "sign", "aria-hidden": "true" }, SIGNS[kind.split(" ").at(-1)]);
  return h(name, { class: `message ${kind}` }, sign, h("span", {}, ...children));
}

/** The name of a goal; that of "Unspecified" says what it stands for. */
export function nameOf(goal) {
  return goal.unspecified ? "None of these yet" : goal.text;
}

/** A probability in per cent. */
export function percent(probability) {
  if (probability > 0 && probability < 0.005) return "<1\u00a0%";
  if (probability < 1 && probability > 0.995) return ">99\u00a0%";
  return `${Math.round(100 * probability)}\u00a0%`;
}

/** A number with its sign. */
export function signed(value, digits = 2) {
  const text = Math.abs(value).toFixed(digits);
  return Number(text) === 0 ? text : (value > 0 ? "+" : "\u2212") + text;
}

/** "1 round", "2 rounds". */
export function count(number, noun) {
  return `${number} ${noun}${number === 1 ? "" : "s"}`;
}

/** A time in the browser's locale. */
export function localTime(iso) {
  const time = new Date(iso);
  return Number.isNaN(time.getTime())
    ? iso
    : time.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}

/** Whether the person asked for less motion. */
export function calm() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}

/** A line for what goes wrong, and a function that does something and says there why it failed. */
export function attempts() {
  const problem = h("p", { class: "problem", role: "alert", hidden: true });
  const attempt = async (work) => {
    problem.hidden = true;
    try {
      await work();
    } catch (error) {
      problem.textContent = error.message;
      problem.hidden = false;
    }
  };
  return [problem, attempt];
}

let lastId = 0;

/** An id that no other element of the page has. */
export function freshId(prefix) {
  lastId += 1;
  return `${prefix}-${lastId}`;
}
