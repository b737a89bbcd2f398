/** The room from above, drawn for the width that there is. */

import { pathOf } from "./api.js";
import { h, setText } from "./dom.js";

const STEP = 40;
const NARROWEST = 240;
const WIDEST = 1200;
const PAUSE = 200;

/** The picture stands in a shadow tree, where its style and ids meet none of the page. */
export class Room {
  /** @param {string} id The episode's. */
  constructor(id) {
    this.id = id;
    this.round = null;
    this.width = 0;
    this.asked = 0;
    this.timer = 0;
    this.place = h("div", { class: "map" });
    this.tree = this.place.attachShadow({ mode: "open" });
    this.problem = h("p", { class: "problem", role: "alert", hidden: true });
    this.link = h("a", { class: "small", target: "_blank", rel: "noopener" }, "Open the picture in a new tab");
    this.element = h("div", {}, this.place, this.problem, h("p", {}, this.link));
    new ResizeObserver(() => this.#resized()).observe(this.place);
  }

  /** @param {number} round 0 is the start. */
  show(round) {
    this.round = round;
    if (this.width && !this.timer) this.#load();
  }

  #resized() {
    const room = Math.floor(this.place.clientWidth / STEP) * STEP;
    const width = Math.min(Math.max(room, NARROWEST), WIDEST);
    if (!room || width === this.width) return;
    const pause = this.width ? PAUSE : 0;
    this.width = width;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#load(), pause);
  }

  /** Loads the picture; an answer that came too late is dropped. */
  async #load() {
    this.timer = 0;
    if (this.round === null) return;
    this.asked += 1;
    const asked = this.asked;
    const path = pathOf(this.id, `/picture.svg?round=${this.round}&width=${this.width}`);
    this.link.href = path;
    let picture = null;
    try {
      const response = await fetch(path);
      if (response.ok) picture = await response.text();
    } catch {
      // said below
    }
    if (asked !== this.asked) return;
    this.problem.hidden = picture !== null;
    setText(this.problem, picture === null ? "The room could not be drawn." : "");
    if (picture !== null) this.#put(picture);
  }

  /** The page allows no style in its elements, so that of the picture becomes a sheet. */
  #put(picture) {
    const [before, style, after] = picture.split(/<style>([^<]*)<\/style>/);
    const drawn = new DOMParser().parseFromString(before + after, "image/svg+xml");
    const svg = document.importNode(drawn.documentElement, true);
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(`svg { display: block; width: 100%; height: auto } ${style}`);
    const when = this.round ? `after round ${this.round}` : "at the start";
    svg.setAttribute("role", "group");
    svg.removeAttribute("aria-labelledby");
    svg.setAttribute("aria-label", `The room from above ${when}`);
    svg.setAttribute("aria-describedby", "desc");
    const focused = this.tree.activeElement?.id;
    this.tree.adoptedStyleSheets = [sheet];
    this.tree.replaceChildren(svg);
    if (focused) this.tree.getElementById(focused)?.focus();
  }
}
