/** The first page: choose a domain and begin. */

import { api } from "./api.js";
import { attempts, count, h, localTime } from "./dom.js";
import { domainOf, goesOn } from "./domains.js";
import { example } from "./example.js";

const RECENT = 20;
const SHOWN = 3;

/**
 * @param {HTMLElement} main
 * @param {{options: object}} at
 * @param {AbortSignal} signal
 */
export async function start(main, { options }, signal) {
  const goOn = h("div", {});
  main.replaceChildren(
    h(
      "div",
      { class: "page start" },
      h(
        "div",
        { class: "start-main" },
        h("h1", { class: "hero" }, "Say what you want. See what I understand."),
        h(
          "p",
          { class: "lead" },
          "I keep a list of what you may want, and of how likely each is. You see all of it, and can correct me.",
        ),
        beginForm(options),
        goOn,
      ),
      example(),
      h("p", { class: "soft small" }, `goalscope ${options.version}, with the model ${options.model}`),
    ),
  );
  const { episodes } = await api.episodes({ limit: RECENT });
  const open = episodes.filter((one) => goesOn(one, options)).slice(0, SHOWN);
  if (open.length && !signal.aborted) goOn.replaceChildren(...goingOn(open, options));
}

function goingOn(episodes, options) {
  const rows = episodes.map((one) =>
    h(
      "li",
      {},
      h("a", { href: `#/talk/${one.id}` }, domainOf(one, options).title),
      h("span", { class: "soft" }, ` ${localTime(one.created)}, ${count(one.rounds, "round")}`),
      one.first_words ? h("span", { class: "said" }, `\u201c${one.first_words}\u201d`) : null,
    ),
  );
  return [h("h2", {}, "Continue"), h("ul", { class: "plain" }, ...rows)];
}

function beginForm(options) {
  const scene = h("select", { id: "scene", name: "scene" });
  const method = h(
    "select",
    { id: "method", name: "method" },
    ...options.methods.map((one) => h("option", { value: one.name }, one.about)),
  );
  const sceneField = h("p", { class: "field" }, h("label", { for: "scene" }, "Scene"), scene);
  const [problem, attempt] = attempts();
  const button = h("button", { type: "submit", class: "primary large" }, "Begin");
  const cards = options.domains.map((domain, place) => domainCard(domain, place === 0, () => choose(domain)));

  const choose = (domain) => {
    sceneField.hidden = domain.scenes.length === 0;
    scene.replaceChildren(
      h("option", { value: "" }, "default"),
      ...domain.scenes.map((name) => h("option", { value: name }, name)),
    );
  };
  const begin = async (event) => {
    event.preventDefault();
    button.disabled = true;
    const domain = new FormData(event.target).get("domain");
    const wanted = { domain, method: method.value, ...(scene.value ? { scene: scene.value } : {}) };
    await attempt(async () => (location.hash = `#/talk/${(await api.begin(wanted)).id}`));
    button.disabled = problem.hidden;
  };
  choose(options.domains[0]);
  return h(
    "form",
    { class: "begin", onsubmit: begin },
    h("fieldset", { class: "domains" }, h("legend", {}, "What should I help with?"), ...cards),
    h(
      "details",
      { class: "more" },
      h("summary", {}, "More options"),
      sceneField,
      h("p", { class: "field" }, h("label", { for: "method" }, "The agent"), method),
    ),
    problem,
    button,
  );
}

function domainCard(domain, checked, choose) {
  return h(
    "label",
    { class: "domain choice" },
    h("input", { type: "radio", name: "domain", value: domain.name, checked, onchange: choose }),
    h("span", { class: "domain-text" }, h("strong", {}, domain.title), h("span", { class: "soft" }, domain.about)),
  );
}
