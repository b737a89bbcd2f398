/** The map of the room, drawn for the width that there is. */

import { pathOf } from "./api.js";
import { h, setText } from "./dom.js";

const [NARROWEST, WIDEST, STEP] = [240, 560, 20];

export class Room {
  /** @param {string} id The episode's. */
  constructor(id) {
    this.id = id;
    this.round = null;
    this.path = "";
    this.map = h("img", { class: "map", hidden: true });
    this.problem = h("p", { class: "problem", role: "alert", hidden: true });
    this.link = h("a", { class: "small", target: "_blank", rel: "noopener" }, "Open the map in a new tab");
    this.element = h("div", {}, this.map, this.problem, h("p", {}, this.link));
    new ResizeObserver(() => this.#load()).observe(this.element);
  }

  /** @param {number} round 0 is the start. */
  show(round) {
    this.round = round;
    this.path = "";
    this.#load();
  }

  /** Loads the map if there is room for it; an answer that comes too late is dropped. */
  async #load() {
    const { round } = this;
    const there = STEP * Math.floor(this.element.clientWidth / STEP);
    const path = pathOf(this.id, `/picture.svg?round=${round}&width=${Math.min(WIDEST, Math.max(NARROWEST, there))}`);
    if (!there || round === null || path === this.path) return;
    this.path = path;
    this.link.href = path;
    let svg = "";
    try {
      const response = await fetch(path);
      if (response.ok) svg = await response.text();
    } catch {
      // reported below
    }
    if (path !== this.path) return;
    this.problem.hidden = svg !== "";
    setText(this.problem, svg ? "" : "The room could not be drawn.");
    this.map.hidden = !svg;
    if (!svg) return;
    const when = round ? `after round ${round}` : "at the start";
    // The page's policy forbids the style of the SVG in a document of its own.
    const unstyled = svg.replace(/<style>[^<]*<\/style>/, "");
    const words = new DOMParser().parseFromString(unstyled, "image/svg+xml").querySelector("desc");
    this.map.alt = `The room ${when}. ${words?.textContent ?? ""}`;
    this.map.src = path;
  }
}
