/** The reasons for a goal, and corrections of it. */

import { api } from "./api.js";
import { attempts, h, percent, signed } from "./dom.js";

const SLIGHT = 0.1;
const SPEAKS = 1;
const SPEAKS_STRONGLY = 4;
const COLUMNS = [
  ["Evidence", "for the goal (+) or against it (\u2212), relative to the mean of the others, in nats. Words in its favour can still make it less likely if another goal gains more."],
  ["Then", "how likely the goal was after these words, among the goals of today."],
  ["Without", "how likely it would be now had they not been said."],
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
  const [problem, attempt] = attempts();
  const act = (kind, text) => attempt(() => correct(kind, text));
  const form = wordsForm("In your words", goal.text, "Save", (text) => act("reword", text));
  const hint = h("p", { class: "soft" }, "Your words replace it, and I take them as confirmed: almost certainly what you want.");
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
      box.replaceChildren(...reasonsOf(id, goal, reasons, goesOn));
    } catch (error) {
      box.replaceChildren(h("p", { class: "problem" }, error.message));
    }
  };
  load();
  return box;
}

function reasonsOf(id, goal, reasons, goesOn) {
  const said = reasons.map((reason) => h("p", { class: "said" }, reason.utterance));
  const items = reasons.map(({ evidence, change }, place) =>
    h(
      "li",
      {},
      said[place],
      h("p", { class: leaning(evidence, SPEAKS) }, verdict(evidence)),
      change >= 0.01 ? h("p", { class: "soft" }, `You may have changed your mind before this (${percent(change)}), so earlier words count that much less.`) : null,
    ),
  );
  const rows = reasons.map((reason) => {
    const values = [signed(reason.evidence), percent(reason.probability), percent(reason.without)];
    return h("tr", {}, h("th", { scope: "row" }, String(reason.turn)), ...values.map((value) => h("td", { class: "number" }, value)));
  });
  const heads = ["Message", ...COLUMNS.map(([name]) => name)];
  const numbers = h(
    "details",
    {},
    h("summary", {}, "In numbers"),
    h(
      "table",
      { class: "reasons" },
      h("caption", { class: "unseen" }, `What each message says for: ${goal}`),
      h("thead", {}, h("tr", {}, ...heads.map((text, place) => h("th", { scope: "col", class: place ? "number" : null }, text)))),
      h("tbody", {}, ...rows),
    ),
    h("ul", { class: "meanings" }, ...COLUMNS.map(([name, meaning]) => h("li", {}, h("strong", {}, name), `: ${meaning}`))),
  );
  return [h("ol", { class: "said-list" }, ...items), ...(goesOn ? [wordByWord(id, goal, reasons, said)] : []), numbers];
}

/** What evidence says, without a number. */
export function verdict(nats) {
  if (Math.abs(nats) < SPEAKS) return "Says little about it.";
  return `Speaks ${Math.abs(nats) < SPEAKS_STRONGLY ? "" : "strongly "}${nats > 0 ? "for" : "against"} it.`;
}

function wordByWord(id, goal, reasons, said) {
  const note = h("span", { class: "soft", role: "status" });
  const load = async () => {
    button.disabled = true;
    try {
      for (const [place, reason] of reasons.entries()) {
        note.textContent = `Scoring the words, ${place + 1} of ${reasons.length}\u2026`;
        const { words } = await api.words(id, goal, reason.turn);
        said[place].replaceChildren(...words.map(([text, nats]) => coloured(text, nats)));
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

function leaning(nats, least = 0) {
  if (Math.abs(nats) < least) return "soft";
  return nats > 0 ? "for" : "against";
}
