/** The reasons for a goal, and corrections of it. */

import { api } from "./api.js";
import { h, percent, signed } from "./dom.js";

const SLIGHT = 0.1;
const COLUMNS = [
  ["Evidence", "how much these words favour the goal (+) or count against it (\u2212), relative to the mean of the others, in nats. Words in its favour can still make it less likely if another goal gains more."],
  ["After it", "how likely the goal was then, among the current goals. If goals were added or removed since, that round showed a different belief, as the ribbons do."],
  ["If unsaid", "how likely it would be now without these words."],
];

/**
 * The details under a goal.
 * @param {{id: string, goal: import("./api.js").Goal, round: ?number, weighs: boolean,
 *   goesOn: boolean, correct: ?((kind: string, text?: string) => Promise<void>)}} of
 *   `round`: after which it is asked, null if the goal was not there yet; `weighs`: whether the
 *   method weighs evidence; `goesOn`: whether the model can still be asked about words;
 *   `correct`: null where nothing can be corrected.
 */
export function details({ id, goal, round, weighs, goesOn, correct }) {
  const box = h("div", { class: "why" });
  if (goal.unspecified) {
    const about = "How likely it is that your goal is not in the list yet. Files and the command line call it \u201cUnspecified\u201d.";
    box.append(h("p", { class: "soft" }, about));
  } else if (correct) {
    box.append(corrections(goal, correct));
  }
  if (weighs && round) box.append(evidence(id, goal.text, round, goesOn));
  else if (weighs) box.append(h("p", { class: "soft" }, "The reasons will appear after your next message."));
  return box;
}

function corrections(goal, correct) {
  const problem = h("p", { class: "problem", role: "alert", hidden: true });
  const act = async (kind, text) => {
    problem.hidden = true;
    try {
      await correct(kind, text);
    } catch (error) {
      problem.textContent = error.message;
      problem.hidden = false;
    }
  };
  const form = wordsForm("In your words", goal.text, "Save", (text) => act("reword", text));
  const hint = h("p", { class: "soft" }, "Your words replace it, and count as confirmed: almost certainly what you want.");
  const rewording = h("div", { class: "rewording", hidden: true }, form, hint);
  const reword = h(
    "button",
    {
      type: "button",
      "aria-expanded": "false",
      onclick: () => {
        rewording.hidden = !rewording.hidden;
        reword.setAttribute("aria-expanded", String(!rewording.hidden));
        if (!rewording.hidden) form.querySelector("input").focus();
      },
    },
    "Reword it",
  );
  const buttons = h(
    "div",
    { class: "buttons" },
    goal.pinned ? null : h("button", { type: "button", onclick: () => act("pin") }, "Yes, it is this"),
    h("button", { type: "button", onclick: () => act("veto") }, "No, rule it out"),
    reword,
  );
  return h("div", {}, buttons, rewording, problem);
}

/** A field for a goal's words, and a button. */
export function wordsForm(label, value, button, send) {
  const input = h("input", { type: "text", value, required: true, maxlength: 200, autocomplete: "off" });
  const submit = (event) => {
    event.preventDefault();
    if (input.value.trim()) send(input.value.trim());
  };
  return h(
    "form",
    { class: "words-form", onsubmit: submit },
    h("label", {}, h("span", {}, label), input),
    h("button", { type: "submit" }, button),
  );
}

function evidence(id, goal, round, goesOn) {
  const box = h("div", { class: "evidence", "aria-live": "polite" }, h("p", { class: "soft" }, "Loading the reasons\u2026"));
  const load = async () => {
    try {
      const { reasons } = await api.why(id, goal, round);
      box.replaceChildren(...reasonsTable(id, goal, reasons, goesOn));
    } catch (error) {
      box.replaceChildren(h("p", { class: "problem" }, error.message));
    }
  };
  load();
  return box;
}

function reasonsTable(id, goal, reasons, goesOn) {
  const cells = reasons.map((reason) => h("td", { class: "said" }, reason.utterance));
  const changes = reasons.filter((reason) => reason.change >= 0.01);
  const rows = reasons.map((reason, place) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, String(reason.turn)),
      cells[place],
      h("td", { class: `number ${leaning(reason.evidence)}` }, signed(reason.evidence)),
      h("td", { class: "number" }, percent(reason.probability)),
      h("td", { class: "number" }, percent(reason.without)),
    ),
  );
  const heads = [
    ["", "Turn"],
    ["Said", null],
    ...COLUMNS.map(([name]) => [name, null]),
  ];
  const table = h(
    "table",
    { class: "reasons" },
    h("caption", { class: "unseen" }, `What each sentence says for: ${goal}`),
    h(
      "thead",
      {},
      h("tr", {}, ...heads.map(([text, title]) => h("th", { scope: "col", title }, text || h("span", { class: "unseen" }, title)))),
    ),
    h("tbody", {}, ...rows),
  );
  const rest = goesOn ? [wordByWord(id, goal, reasons, cells)] : [];
  const meanings = COLUMNS.map(([name, meaning]) => h("li", {}, h("strong", {}, name), `: ${meaning}`));
  const told = changes.map((reason) =>
    h("p", { class: "soft" }, `You may have changed your mind before turn ${reason.turn} (${percent(reason.change)}), so earlier words count that much less.`),
  );
  return [table, ...told, ...rest, h("ul", { class: "meanings" }, ...meanings)];
}

function wordByWord(id, goal, reasons, cells) {
  const note = h("span", { class: "soft", role: "status" });
  const load = async () => {
    button.disabled = true;
    try {
      for (const [place, reason] of reasons.entries()) {
        note.textContent = `Scoring the words, ${place + 1} of ${reasons.length}\u2026`;
        const { words } = await api.words(id, goal, reason.turn);
        cells[place].replaceChildren(...words.map(([text, nats]) => coloured(text, nats)));
      }
      note.textContent = "Underlined words favour it; dashed ones count against it.";
      button.hidden = true;
    } catch (error) {
      note.textContent = error.message;
      button.disabled = false;
    }
  };
  const button = h("button", { type: "button", class: "quiet", onclick: load }, "Word by word");
  return h("p", { class: "word-by-word" }, button, note);
}

function coloured(text, nats) {
  if (Math.abs(nats) < SLIGHT) return h("span", {}, text);
  const [, space, word] = /^(\s*)([\s\S]*)$/.exec(text);
  const mark = h("mark", { class: leaning(nats), title: `${signed(nats)} nats` }, word);
  mark.style.setProperty("--weight", String(Math.min(1, Math.abs(nats) / 2)));
  return h("span", {}, space, mark, h("span", { class: "unseen" }, ` (${signed(nats, 1)})`));
}

function leaning(nats) {
  if (Math.abs(nats) < 0.005) return "neutral";
  return nats > 0 ? "for" : "against";
}
