/** The list of episodes, with search and a choice of the domain. */

import { api } from "./api.js";
import { count, h, localTime, setText, unseen } from "./dom.js";
import { goesOn, nameOfDomain, personOf } from "./domains.js";

const PAGE = 25;
const PAUSE = 250;
const ENDS = { terminated: "done", truncated: "out of rounds" };

/**
 * @param {HTMLElement} main
 * @param {{options: object, search: URLSearchParams}} at
 * @param {AbortSignal} signal
 */
export async function episodes(main, { options, search }, signal) {
  document.title = "Episodes \u00b7 goalscope";
  const list = new List(options, search, signal);
  main.replaceChildren(list.element);
  await list.load();
}

class List {
  constructor(options, search, signal) {
    this.options = options;
    this.signal = signal;
    this.text = search.get("text") ?? "";
    this.domain = search.get("domain");
    this.offset = Math.max(0, Number(search.get("offset")) || 0);
    this.chosen = [];
    this.asked = 0;
    this.found = h("p", { class: "soft", role: "status" });
    this.rows = h("tbody", {});
    this.table = h(
      "table",
      { class: "episodes" },
      h("caption", { class: "unseen" }, "Episodes, newest first"),
      h("thead", {}, h("tr", {}, ...headings())),
      this.rows,
    );
    this.select = h("select", { id: "domain", onchange: () => this.#chooseDomain() });
    this.domains = h("p", { class: "field", hidden: true }, h("label", { for: "domain" }, "Domain"), this.select);
    this.earlier = h("button", { type: "button", onclick: () => this.#turn(-PAGE) }, "Newer");
    this.later = h("button", { type: "button", onclick: () => this.#turn(PAGE) }, "Older");
    this.compare = h("div", { class: "compare-bar", role: "status" });
    this.element = h(
      "div",
      { class: "page" },
      h("h1", {}, "Episodes"),
      h("div", { class: "filters" }, this.#searchField(), this.domains),
      this.found,
      h("div", { class: "table-box" }, this.table),
      h("nav", { class: "buttons", "aria-label": "More episodes" }, this.earlier, this.later),
      this.compare,
    );
  }

  #searchField() {
    let timer = 0;
    const typed = (event) => {
      clearTimeout(timer);
      timer = setTimeout(() => {
        this.text = event.target.value.trim();
        this.offset = 0;
        this.load();
      }, PAUSE);
    };
    return h(
      "p",
      { class: "field" },
      h("label", { for: "search" }, "Search"),
      h("input", { type: "search", id: "search", value: this.text, oninput: typed, placeholder: "Words, a person, an id" }),
    );
  }

  #turn(by) {
    this.offset = Math.max(0, this.offset + by);
    this.load();
  }

  async load() {
    this.asked += 1;
    const asked = this.asked;
    this.#remember();
    try {
      const found = await api.episodes({ text: this.text, domain: this.domain, limit: PAGE, offset: this.offset });
      if (asked === this.asked && !this.signal.aborted) this.#show(found);
    } catch (error) {
      setText(this.found, error.message);
    }
  }

  /** Keeps the search in the address. */
  #remember() {
    const search = new URLSearchParams();
    if (this.text) search.set("text", this.text);
    if (this.domain) search.set("domain", this.domain);
    if (this.offset) search.set("offset", String(this.offset));
    const rest = search.size ? `?${search}` : "";
    history.replaceState(null, "", `#/episodes${rest}`);
  }

  #chooseDomain() {
    this.domain = this.select.value || null;
    this.offset = 0;
    this.load();
  }

  /** Offers the domains; there is a choice if there are several, or if one is chosen. */
  #offer(domains) {
    const all = [...new Set([...domains, ...(this.domain ? [this.domain] : [])])];
    if (all.join("\n") === this.offered) return;
    this.offered = all.join("\n");
    const options = all.map((name) => h("option", { value: name, selected: name === this.domain }, nameOfDomain(name)));
    this.select.replaceChildren(h("option", { value: "" }, "all"), ...options);
    this.domains.hidden = all.length < 2 && !this.domain;
  }

  #show({ episodes: found, total, domains }) {
    this.#offer(domains);
    const last = this.offset + found.length;
    const none = this.text || this.domain ? "No episodes found." : "There are no episodes yet. Talk begins one.";
    const all = total ? count(total, "episode") : none;
    setText(this.found, found.length === total ? all : `${this.offset + 1} to ${last} of ${count(total, "episode")}`);
    this.table.hidden = found.length === 0;
    this.rows.replaceChildren(...found.map((episode) => this.#row(episode)));
    this.earlier.parentElement.hidden = total <= PAGE;
    this.earlier.disabled = this.offset === 0;
    this.later.disabled = last >= total;
  }

  #row(episode) {
    const started = localTime(episode.created);
    const choose = (event) => this.#choose(episode.id, event.target.checked);
    const cells = [
      ["First words", episode.first_words],
      ["Id", episode.id],
      ["Domain", nameOfDomain(episode.domain)],
      ["Person", personOf(episode)],
      ["Method", episode.method],
      ["Rounds", String(episode.rounds)],
      ["Ended", ENDS[episode.ended] ?? "not ended"],
      ["Score", episode.score === null ? "" : episode.score.toFixed(2)],
    ];
    return h(
      "tr",
      {},
      h("th", { scope: "row" }, h("a", { href: `#/replay/${episode.id}` }, started)),
      ...cells.map(([name, text]) => h("td", { "data-name": name, class: classOf(name) }, text)),
      h(
        "td",
        {},
        h(
          "div",
          { class: "row-actions" },
          goesOn(episode, this.options) ? h("a", { href: `#/talk/${episode.id}` }, "Continue", unseen(` the one of ${started}`)) : null,
          h(
            "label",
            { class: "check" },
            h("input", { type: "checkbox", onchange: choose, checked: this.chosen.includes(episode.id) }),
            "Compare",
            unseen(` the one of ${started}`),
          ),
        ),
      ),
    );
  }

  #choose(id, yes) {
    this.chosen = this.chosen.filter((one) => one !== id);
    if (yes) this.chosen = [...this.chosen, id].slice(-2);
    for (const row of this.rows.children) this.#tick(row);
    const [first, second] = this.chosen;
    if (!first) this.compare.replaceChildren();
    else if (!second) this.compare.replaceChildren(h("p", {}, "Choose one more to compare."));
    else {
      this.compare.replaceChildren(
        h("a", { class: "button primary", href: `#/compare/${first}/${second}` }, "Compare the two"),
      );
    }
  }

  #tick(row) {
    const id = row.querySelector("th a").hash.split("/").at(-1);
    row.querySelector("input").checked = this.chosen.includes(id);
  }
}

function classOf(name) {
  if (name === "Id") return "id";
  if (name === "First words") return "said";
  return name === "Rounds" || name === "Score" ? "number" : null;
}

function headings() {
  const names = ["Started", "First words", "Id", "Domain", "Person", "Method", "Rounds", "Ended", "Score"];
  return [
    ...names.map((name) => h("th", { scope: "col", class: classOf(name) }, name)),
    h("td", {}),
  ];
}
