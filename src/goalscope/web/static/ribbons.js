/** The history of the belief: a ribbon for each goal over the rounds, and the same as a table. */

import { h, nameOf, percent, svg } from "./dom.js";

const HEIGHT = 112;
const AXIS = 22;
const PLATEAU = 0.36;
const VISIBLE = 0.01;
const NAMED = 0.05;

/**
 * @typedef {{label: string, belief: ?import("./api.js").Belief}} Column
 * @typedef {{text: string, unspecified: boolean, values: number[]}} Series
 */

/** A figure that is redrawn when its width changes. */
export class Ribbons {
  /** @param {?((column: number) => void)} onSelect Called with the column that was clicked. */
  constructor(onSelect = null) {
    this.onSelect = onSelect;
    this.columns = [];
    this.colours = new Map();
    this.selected = null;
    this.picture = h("div", { class: "ribbons-picture" });
    this.key = h("ul", { class: "key", "aria-hidden": "true" });
    this.table = h("div", { class: "unseen" });
    this.element = h("figure", { class: "ribbons" }, this.picture, this.key, this.table);
    this.width = 0;
    new ResizeObserver(([entry]) => {
      const width = Math.round(entry.contentRect.width);
      if (width && width !== this.width) {
        this.width = width;
        this.#draw();
      }
    }).observe(this.picture);
  }

  /**
   * @param {Column[]} columns
   * @param {Map<string, string>} colours
   * @param {?number} selected The column that is marked.
   */
  show(columns, colours, selected = null) {
    this.columns = columns.filter((column) => column.belief);
    this.colours = colours;
    this.selected = selected;
    this.element.hidden = this.columns.length === 0;
    this.#draw();
    const all = seriesOf(this.columns);
    const named = all.filter((series) => Math.max(...series.values) >= NAMED);
    this.key.replaceChildren(...named.map((series) => h("li", { class: this.#classOf(series) }, nameOf(series))));
    this.table.replaceChildren(tableOf(this.columns, all));
  }

  #draw() {
    if (!this.width || !this.columns.length) return;
    const step = this.width / this.columns.length;
    const bands = stacked(seriesOf(this.columns));
    const wide = bands.filter((band) => band.series.values.some((value) => value >= VISIBLE));
    this.picture.replaceChildren(
      svg(
        "svg",
        {
          viewBox: `0 0 ${this.width} ${HEIGHT + AXIS}`,
          width: this.width,
          height: HEIGHT + AXIS,
          class: this.onSelect ? "selectable" : null,
          "aria-hidden": "true",
          onclick: (event) => this.#select(event, step),
        },
        ...wide.map((band) => this.#ribbon(band, step)),
        ...this.#axis(step),
      ),
    );
  }

  #select(event, step) {
    const place = Math.floor((event.clientX - this.picture.getBoundingClientRect().left) / step);
    if (place < this.columns.length) this.onSelect?.(place);
  }

  #classOf(series) {
    return series.unspecified ? "unspecified" : (this.colours.get(series.text) ?? "c0");
  }

  #ribbon(band, step) {
    const history = band.series.values.map((value) => percent(value)).join(" \u2192 ");
    const title = svg("title", {}, `${nameOf(band.series)}: ${history}`);
    return svg("path", { class: `ribbon ${this.#classOf(band.series)}`, d: outline(band, step) }, title);
  }

  #axis(step) {
    const every = Math.ceil(24 / step);
    return this.columns.flatMap((column, place) => [
      place % every === 0 || place === this.selected
        ? svg(
            "text",
            {
              class: place === this.selected ? "tick selected" : "tick",
              x: (place + 0.5) * step,
              y: HEIGHT + 16,
              "text-anchor": "middle",
            },
            column.label,
          )
        : null,
      place === this.selected
        ? svg("rect", { class: "cursor", x: place * step + 1, y: 0.75, width: step - 2, height: HEIGHT - 1.5, rx: 3 })
        : null,
    ]);
  }
}

/** The probabilities of each goal in each column; "None of these yet" comes last. */
function seriesOf(columns) {
  const found = new Map();
  columns.forEach((column, place) => {
    for (const goal of column.belief.goals) {
      if (!found.has(goal.text)) {
        const values = new Array(columns.length).fill(0);
        found.set(goal.text, { text: goal.text, unspecified: goal.unspecified, values });
      }
      found.get(goal.text).values[place] = goal.probability;
    }
  });
  const all = [...found.values()];
  return [...all.filter((one) => !one.unspecified), ...all.filter((one) => one.unspecified)];
}

function stacked(all) {
  const sums = new Array(all[0]?.values.length ?? 0).fill(0);
  return all.map((series) => {
    const tops = [...sums];
    series.values.forEach((value, place) => (sums[place] += value));
    return { series, tops, bottoms: [...sums] };
  });
}

/** Level in the middle of each column, and a curve to the next. */
function outline({ tops, bottoms }, step) {
  const half = (PLATEAU * step) / 2;
  const last = tops.length - 1;
  const ends = tops.map((_, place) => {
    const middle = (place + 0.5) * step;
    return [place === 0 ? 0 : middle - half, place === last ? step * (last + 1) : middle + half];
  });
  const y = (share) => (share * HEIGHT).toFixed(2);
  const curve = (x0, x1, from, to) => {
    const middle = ((x0 + x1) / 2).toFixed(1);
    return `C${middle} ${y(from)} ${middle} ${y(to)} ${x1.toFixed(1)} ${y(to)}`;
  };
  let path = `M${ends[0][0].toFixed(1)} ${y(tops[0])}H${ends[0][1].toFixed(1)}`;
  for (let place = 1; place <= last; place += 1) {
    path += curve(ends[place - 1][1], ends[place][0], tops[place - 1], tops[place]);
    path += `H${ends[place][1].toFixed(1)}`;
  }
  path += `V${y(bottoms[last])}H${ends[last][0].toFixed(1)}`;
  for (let place = last - 1; place >= 0; place -= 1) {
    path += curve(ends[place + 1][0], ends[place][1], bottoms[place + 1], bottoms[place]);
    path += `H${ends[place][0].toFixed(1)}`;
  }
  return `${path}Z`;
}

function tableOf(columns, all) {
  const head = columns.map((column) => h("th", { scope: "col" }, `Round ${column.label}`));
  const rows = all.map((series) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, nameOf(series)),
      ...series.values.map((value) => h("td", {}, percent(value))),
    ),
  );
  return h(
    "table",
    {},
    h("caption", {}, "How likely each goal was after each round"),
    h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Goal"), ...head)),
    h("tbody", {}, ...rows),
  );
}
