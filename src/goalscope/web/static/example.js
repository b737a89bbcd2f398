/** An example of a belief for the first page; it was inferred once. */

import { coloursOf } from "./colours.js";
import { h } from "./dom.js";
import { Ribbons } from "./ribbons.js";

const GOALS = ["bake a chocolate cake", "bake a gluten-free cake", "cook an Italian dinner", "buy snacks for a party", "Unspecified"];
const SAID = [
  ["I'd like to bake something for Sunday.", [60, 36, 0, 0, 3]],
  ["A cake, with lots of cocoa in it.", [85, 14, 0, 0, 1]],
  ["My sister can't eat gluten.", [35, 65, 0, 0, 0]],
];

export function example() {
  const columns = SAID.map(([, shares], place) => ({ label: String(place + 1), belief: beliefOf(shares) }));
  const ribbons = new Ribbons();
  ribbons.show(columns, coloursOf(columns.map((column) => column.belief)));
  return h(
    "section",
    { class: "example", "aria-labelledby": "example" },
    h("h2", { id: "example" }, "Three sentences, and what I make of them"),
    ribbons.element,
    h("ol", {}, ...SAID.map(([text]) => h("li", {}, `\u201c${text}\u201d`))),
  );
}

function beliefOf(shares) {
  const sum = shares.reduce((total, share) => total + share, 0);
  return {
    goals: GOALS.map((text, place) => ({ text, probability: shares[place] / sum, unspecified: text === "Unspecified" })),
  };
}
