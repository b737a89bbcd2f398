/** A study: consent, instructions, one question after the other, and thanks at the end. */

import "./keys.js";
import { h, linked } from "./dom.js";
import { drafts } from "./drafts.js";
import { statusView } from "./status.js";
import { api, Keeper, otherwise, same } from "./study_api.js";

const QUIET = 800;
const CHECK = "Please check the link, or ask the person who sent it to you.";
const OFFLINE = "No connection. Retrying automatically \u2026";

const main = document.getElementById("main");
let study = null;
let shown = 0;
const keepers = new Map();
/** Cleans up after the previous page. */
let leave = () => {};

/** A status line, and functions that set it. */
function statusLine() {
  const line = h("p", { class: "status", role: "status" });
  const tell = (text, kind = "") => {
    if (line.textContent !== text) line.textContent = text;
    line.className = `status ${kind}`;
  };
  return [line, tell, () => tell(OFFLINE)];
}

function paragraphs(text) {
  return text
    .trim()
    .split(/\n\s*\n/)
    .map((each) => h("p", { class: "text" }, ...linked(each)));
}

function page(title, ...children) {
  const heading = h("h1", { tabindex: "-1" }, title);
  main.replaceChildren(heading, ...children);
  main.removeAttribute("aria-busy");
  document.title = `${title} – ${study?.title ?? "Study"}`;
  scrollTo(0, 0);
  heading.focus({ preventScroll: true });
}

function go(to) {
  location.hash = `#/${to}`;
}

async function show() {
  leave();
  leave = () => {};
  shown += 1;
  const own = shown;
  const to = location.hash.slice(2);
  const [line, , later] = statusLine();
  const slow = setTimeout(() => main.append(line), QUIET);
  try {
    study ??= await api.study(later);
    const count = study.answered?.length ?? 0;
    const place = Number(to);
    if (!count && study.over) page(study.title, h("p", { class: "text" }, study.over));
    else if (!count) consent();
    else if (to === "instructions") instructions();
    else if (Number.isInteger(place) && place >= 1 && place <= count) {
      const item = await api.item(place, later);
      if (own === shown) question(place, item);
    } else if (to === "end") {
      study = await api.study(later);
      if (own === shown) end();
    } else {
      const next = study.answered.indexOf(false) + 1;
      location.replace(`#/${next || "end"}`);
    }
  } catch (error) {
    const remedy = error.status === 404 ? h("p", {}, CHECK) : "";
    if (own === shown) page("That did not work", h("p", { role: "alert" }, error.message), remedy);
  } finally {
    clearTimeout(slow);
  }
}

function consent() {
  const button = h("button", { type: "submit", class: "primary large" }, "Take part");
  const [line, tell, later] = statusLine();
  const agree = async (event) => {
    event.preventDefault();
    button.disabled = true;
    try {
      study = await api.agree(later);
      go("instructions");
    } catch (error) {
      tell(error.message, "problem");
      button.disabled = false;
    }
  };
  page(
    study.title,
    ...paragraphs(study.consent),
    h(
      "form",
      { class: "consent", onsubmit: agree },
      h(
        "label",
        { class: "agree" },
        h("input", { type: "checkbox", name: "agreed", required: true }),
        h("span", {}, "I have read this, and I agree to take part."),
      ),
      line,
      button,
    ),
  );
}

function instructions() {
  page(
    "What to do",
    ...paragraphs(study.instructions),
    h("p", {}, `There are ${study.answered.length} questions. Each answer is saved as you give it.`),
    h(
      "div",
      { class: "buttons" },
      h("a", { class: "button primary large", href: "#/" }, "Go to the questions"),
    ),
  );
}

function question(place, item) {
  const draft = drafts(`${location.pathname}${location.search}#${place}`);
  const keeper = keepers.get(place) ?? new Keeper(place);
  keepers.set(place, keeper);
  keeper.know(item.answer);
  const begun = draft.read();
  const before = begun ?? keeper.saved;
  const [line, tell, later] = statusLine();
  const [done, update] = progress();
  const ratings = study.scale.map((words, rating) => ratingField(rating, words, before.rating === rating));
  const why = h("textarea", { id: "why", name: "why", rows: 3, maxlength: 4000, required: true, "aria-describedby": "least" });
  why.value = before.explanation;
  const next = h("button", { type: "submit", class: "primary large" }, place === study.answered.length ? "Finish" : "Next");
  const form = h(
    "form",
    { class: "rating", novalidate: true },
    h("fieldset", { class: "scale" }, h("legend", {}, study.question), h("div", { class: "steps" }, ...ratings)),
    h(
      "p",
      { class: "why" },
      h("label", { for: "why" }, "Why?"),
      why,
      h("span", { id: "least", class: "soft small" }, `At least ${study.min_explanation} characters, not counting spaces.`),
    ),
    line,
    h(
      "div",
      { class: "buttons" },
      place > 1 && h("a", { class: "button large", href: `#/${place - 1}` }, "Back"),
      next,
    ),
  );

  const given = () => {
    const rating = new FormData(form).get("rating");
    return { rating: rating === null ? null : Number(rating), explanation: why.value.trim() };
  };
  const missing = ({ rating, explanation }) => {
    if (rating === null) return ["Please choose a rating.", ratings[0].querySelector("input")];
    if (explanation.replace(/\s/g, "").length < study.min_explanation) {
      return [`Please explain your rating in at least ${study.min_explanation} characters.`, why];
    }
    return null;
  };
  const unsaved = () => !same(given(), keeper.saved);
  const save = async () => {
    tell("Saving \u2026");
    try {
      await keeper.keep(given(), later);
    } catch (error) {
      tell(error.message, "problem");
      return;
    }
    study.answered[place - 1] = true;
    update();
    if (unsaved()) return;
    draft.drop();
    tell("Saved", "saved");
  };

  let timer = 0;
  const changed = () => {
    clearTimeout(timer);
    if (!unsaved()) return;
    draft.write({ ...given(), revision: keeper.saved.revision });
    tell("");
    if (!missing(given())) timer = setTimeout(save, QUIET);
  };
  form.addEventListener("input", changed);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    clearTimeout(timer);
    const lacks = missing(given());
    if (lacks) {
      tell(lacks[0], "problem");
      lacks[1].focus();
      return;
    }
    next.disabled = true;
    if (unsaved()) await save();
    next.disabled = false;
    if (!unsaved() && form.isConnected) go(place < study.answered.length ? place + 1 : "end");
  });
  const warn = (event) => {
    if (unsaved()) event.preventDefault();
  };
  addEventListener("beforeunload", warn);
  leave = () => {
    clearTimeout(timer);
    removeEventListener("beforeunload", warn);
    if (unsaved() && !missing(given())) save();
  };
  page(`Question ${place} of ${study.answered.length}`, done, ...about(item), form);
  if (keeper.saved.revision && !unsaved()) tell("Saved", "saved");
  else if (begun && begun.revision !== keeper.saved.revision) tell(otherwise(keeper.saved), "problem");
  else changed();
}

function ratingField(rating, words, checked) {
  return h(
    "label",
    { class: "step choice" },
    h("input", { type: "radio", name: "rating", value: rating, checked, required: true }),
    h("span", { class: "step-number" }, String(rating)),
    words && h("span", { class: "step-words" }, words),
  );
}

/** The progress bar, and a function that updates it. */
function progress() {
  const bar = h("progress", { max: study.answered.length, "aria-label": "Answered" });
  const label = h("span", { class: "soft small" });
  const update = () => {
    bar.value = study.answered.filter(Boolean).length;
    label.textContent = `${bar.value} of ${study.answered.length} answered`;
  };
  update();
  return [h("p", { class: "progress" }, bar, label), update];
}

function about(item) {
  return [
    item.profile && part("The person", h("p", { class: "text" }, item.profile)),
    part(
      "The assistant",
      h("p", { class: "text" }, item.task),
      h("p", { class: "soft small" }, `It can do this: ${item.possible.join(", ")}.`),
    ),
    item.transcript.length > 0 && part("The conversation", conversation(item.transcript)),
    part("Outcome", h("div", { class: "outcome" }, statusView(item.outcome))),
  ].filter(Boolean);
}

function part(title, ...children) {
  return h("section", { class: "part" }, h("h2", {}, title), ...children);
}

function conversation(turns) {
  const lines = turns.flatMap(({ query, utterance }) => [
    query && h("p", { class: "said" }, h("strong", {}, "Assistant: "), query),
    h("p", { class: "said" }, h("strong", {}, "Person: "), utterance),
  ]);
  return h("div", { class: "conversation", tabindex: "0", role: "region", "aria-label": "The conversation" }, ...lines);
}

function end() {
  const open = study.answered.flatMap((done, at) => (done ? [] : [at + 1]));
  if (open.length) {
    const links = open.map((place) => h("li", {}, h("a", { href: `#/${place}` }, `Question ${place}`)));
    page("Not quite done", h("p", {}, "These questions have no answer yet:"), h("ul", { class: "open" }, ...links));
    return;
  }
  page(
    "Thank you",
    progress()[0],
    h("p", {}, "All your answers are saved."),
    ...paragraphs(study.thanks),
    h("p", { class: "soft" }, h("a", { href: "#/1" }, "Look at your answers again"), ", and change them if you like."),
  );
}

addEventListener("hashchange", show);
show();
