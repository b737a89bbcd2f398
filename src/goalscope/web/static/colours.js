/** Colours of goals; a goal keeps its colour as long as the episode is shown. */

/** Number of goal colours in style.css: `.c0` and so on. */
export const COLOURS = 9;

/**
 * A colour for each goal, by the order in which they came up. Once all are taken, a goal takes the
 * one of a goal that is gone.
 * @param {Array<?import("./api.js").Belief>} beliefs Oldest first.
 * @returns {Map<string, string>} The class of each goal, by its text.
 */
export function coloursOf(beliefs) {
  const slots = new Map();
  for (const belief of beliefs) {
    const present = new Set(belief?.goals.map((goal) => goal.text));
    for (const goal of belief?.goals ?? []) {
      if (!goal.unspecified && !slots.has(goal.text)) slots.set(goal.text, freeSlot(slots, present));
    }
  }
  const classes = [...slots].map(([text, slot]) => [text, `c${slot}`]);
  return new Map(classes);
}

function freeSlot(slots, present) {
  const all = Array.from({ length: COLOURS }, (_, slot) => slot);
  const used = new Set(slots.values());
  const busy = new Set([...slots].filter(([text]) => present.has(text)).map(([, slot]) => slot));
  return (
    all.find((slot) => !used.has(slot)) ?? all.find((slot) => !busy.has(slot)) ?? slots.size % COLOURS
  );
}
