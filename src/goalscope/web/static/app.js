/** Shows the page that the address names behind its #. */

import "./keys.js";
import { api } from "./api.js";
import { h } from "./dom.js";
import { episodes } from "./episodes.js";
import { compare, replay } from "./replay.js";
import { start } from "./start.js";
import { talk } from "./talk.js";

const ROUTES = [
  [/^\/?$/, "start", start, []],
  [/^\/talk\/([^/]+)$/, "start", talk, ["id"]],
  [/^\/episodes$/, "episodes", episodes, []],
  [/^\/replay\/([^/]+)$/, "episodes", replay, ["id"]],
  [/^\/compare\/([^/]+)\/([^/]+)$/, "episodes", compare, ["first", "second"]],
];

const main = document.getElementById("main");
let options = null;
let leaving = new AbortController();

async function show() {
  leaving.abort();
  leaving = new AbortController();
  const { signal } = leaving;
  const [path, search = ""] = location.hash.slice(1).split("?");
  const found = ROUTES.map((route) => [route, route[0].exec(path)]).find(([, match]) => match);
  document.title = "goalscope";
  mark(found?.[0][1]);
  if (!found) {
    problem("This page does not exist.");
    return;
  }
  const [[, , page, names], match] = found;
  const at = Object.fromEntries(names.map((name, place) => [name, decodeURIComponent(match[place + 1])]));
  try {
    options ??= await api.options();
    if (!signal.aborted) await page(main, { ...at, options, search: new URLSearchParams(search) }, signal);
  } catch (error) {
    if (!signal.aborted) problem(error.message);
  }
}

function mark(page) {
  for (const link of document.querySelectorAll("nav a")) {
    if (link.dataset.page === page) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
}

function problem(message) {
  main.replaceChildren(
    h(
      "div",
      { class: "page narrow" },
      h("h1", {}, "That did not work"),
      h("p", { role: "alert" }, message),
      h("div", { class: "buttons" }, h("button", { type: "button", class: "primary", onclick: show }, "Try again")),
    ),
  );
}

window.addEventListener("hashchange", async () => {
  await show();
  window.scrollTo(0, 0);
  if (!main.contains(document.activeElement)) main.focus({ preventScroll: true });
});
document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault();
  main.focus();
});
show();
