/** The conversation: what was asked, said and done, round by round. */

import { arrange, h, message, setText, unseen } from "./dom.js";
import { isDrawn } from "./domains.js";
import { actionList } from "./outcome.js";
import { kindOf, namedIn } from "./status.js";

/** A log of exchanges; the open one becomes a round without being rendered again. */
export class Log {
  /** @param {import("./api.js").Episode} episode */
  constructor(episode) {
    this.named = !isDrawn(episode);
    this.exchanges = new Map();
    this.list = h("div", {});
    this.status = h("p", { class: "thinking", role: "status" });
    this.after = h("div", { class: "slot" });
    this.below = h("button", { type: "button", class: "quiet below", hidden: true, onclick: () => (this.element.scrollTop = this.element.scrollHeight) }, "More below");
    this.element = h("div", {
      class: "log",
      role: "log",
      "aria-live": "polite",
      "aria-label": "Conversation",
      tabindex: 0,
      onscroll: () => {
        if (this.element.clientHeight === this.height) this.atEnd = this.#isAtEnd();
        this.below.hidden = this.#isAtEnd(8);
      },
    });
    this.element.append(this.list, this.status, this.after);
    this.atEnd = true;
    new ResizeObserver(() => this.#resized()).observe(this.element);
  }

  /**
   * @param {import("./api.js").Round[]} rounds
   * @param {?{round: number, query: ?string, utterance: ?string}} open The exchange under way.
   */
  show(rounds, open = null) {
    const numbers = rounds.map((round) => round.number);
    rounds.forEach((round, place) => this.#exchange(round.number).settle(round, rounds[place - 1]?.notes));
    if (open && !numbers.includes(open.round)) {
      this.#exchange(open.round).say(open.query, open.utterance);
      numbers.push(open.round);
    }
    for (const number of [...this.exchanges.keys()]) {
      if (!numbers.includes(number)) this.exchanges.delete(number);
    }
    arrange(this.list, numbers.map((number) => this.exchanges.get(number).element));
    if (this.atEnd) this.scrollToEnd();
  }

  /** Says what the agent does now; "" while it is the person's turn. */
  tell(step) {
    this.status.classList.toggle("busy", Boolean(step));
    setText(this.status, step);
    if (step && this.atEnd) this.scrollToEnd();
  }

  /** Puts an element below the last words; null removes it. */
  put(element) {
    this.after.replaceChildren(...(element ? [element] : []));
    this.scrollToEnd();
  }

  /** Scrolls to the end, but keeps the last words in view above what was put below them. */
  scrollToEnd() {
    this.atEnd = true;
    this.element.scrollTop = this.element.scrollHeight;
    const words = this.after.hasChildNodes() && this.list.lastElementChild?.getBoundingClientRect();
    const above = words ? this.element.getBoundingClientRect().top - words.top : 0;
    if (above <= 0) return;
    this.element.scrollTop -= above;
    this.atEnd = false;
  }

  /** Keeps the last words in view if they were, whatever takes room below. */
  #resized() {
    this.height = this.element.clientHeight;
    if (this.atEnd) this.scrollToEnd();
    this.below.hidden = this.#isAtEnd(8);
  }

  #isAtEnd(slack = 80) {
    const { scrollHeight, scrollTop, clientHeight } = this.element;
    return scrollHeight - scrollTop - clientHeight < slack;
  }

  #exchange(number) {
    if (!this.exchanges.has(number)) this.exchanges.set(number, new Exchange(number, this.named));
    return this.exchanges.get(number);
  }
}

class Exchange {
  constructor(number, named) {
    this.named = named;
    this.settled = false;
    this.answer = h("p", { class: "text" });
    this.asked = h("span", {});
    this.query = h("div", { class: "bubble agent" }, unseen("Assistant: "), this.answer, message("p", "asked", this.asked));
    this.said = h("span", {});
    this.utterance = h("p", { class: "bubble person" }, unseen("You: "), this.said);
    this.read = h("p", { class: "read", hidden: true });
    this.done = h("div", { class: "done-list" });
    this.element = h(
      "div",
      { class: "exchange", "data-round": number },
      this.query,
      this.utterance,
      this.read,
      this.done,
    );
    this.say(null, null);
  }

  say(query, utterance) {
    const lines = (query ?? "").split("\n");
    this.query.hidden = !query;
    setText(this.asked, lines.pop());
    setText(this.answer, lines.join("\n"));
    this.utterance.hidden = !utterance;
    setText(this.said, utterance ?? "");
  }

  /**
   * @param {import("./api.js").Round} round
   * @param {string[]} before The notes of the round before; what they said already is told in small.
   */
  settle(round, before = []) {
    if (this.settled) return;
    this.settled = true;
    this.say(round.query, round.utterance);
    const actions = round.actions.filter((action) => !namedIn(round.notes, action)); // a note tells of it
    this.read.hidden = !round.understood.length;
    setText(this.read, `Understood: ${round.understood.join("; ")}`);
    this.done.replaceChildren(
      ...(actions.length ? [actionList(actions, this.named)] : []),
      ...round.notes.map((note) =>
        before.includes(note)
          ? h("p", { class: "note again" }, "As before: ", note)
          : message("p", `note ${kindOf(note)}`, unseen("Note: "), note),
      ),
    );
  }
}

const WAIT = "Not sent yet: the assistant is still busy. Your words stay here until you send them.";
const NOW = "Not sent yet. Press Enter or Send.";

/**
 * The input field. Enter sends, with Shift it begins a new line. While the agent works, words are
 * kept and nothing is sent: they might answer a question that the person has not seen.
 */
export class Composer {
  /**
   * @param {(text: string) => void} send
   * @param {ReturnType<typeof import("./drafts.js").drafts>} draft Keeps what was not sent.
   */
  constructor(send, draft) {
    this.send = send;
    this.draft = draft;
    this.ready = false;
    this.kept = false;
    this.input = h("textarea", {
      id: "utterance",
      rows: 1,
      maxlength: 2000,
      placeholder: "Say what you want",
      oninput: () => this.#typed(),
      onkeydown: (event) => {
        if (event.key !== "Enter" || event.shiftKey) return;
        event.preventDefault();
        this.#submit();
      },
    });
    this.button = h("button", { type: "submit", class: "primary", disabled: true }, "Send");
    const submit = (event) => {
      event.preventDefault();
      this.#submit();
    };
    this.note = h("p", { class: "kept", role: "status" });
    this.element = h(
      "form",
      { onsubmit: submit },
      h("label", { for: "utterance", class: "unseen" }, "Your words"),
      h("div", { class: "composer" }, this.input, this.button),
      this.note,
    );
  }

  /** Takes up what was typed and not sent before. */
  restore() {
    this.input.value = this.draft.read() ?? "";
    this.#changed();
  }

  /** Whether the agent accepts words now. */
  setReady(ready) {
    this.ready = ready;
    this.#changed();
  }

  /** Puts words into the field, below what was typed, to be edited or sent. */
  write(text) {
    if (!this.words.endsWith(text)) this.input.value = this.words ? `${this.words}\n${text}` : text;
    this.#typed();
    this.input.focus();
  }

  /** The words that were not sent. */
  get words() {
    return this.input.value.trim();
  }

  #typed() {
    this.draft.write(this.input.value);
    this.#changed();
  }

  #changed() {
    this.button.disabled = !this.words;
    this.button.setAttribute("aria-disabled", String(!this.ready || !this.words));
    if (!this.words) this.kept = false;
    setText(this.note, this.kept ? (this.ready ? NOW : WAIT) : "");
    this.input.style.setProperty("height", "auto");
    this.input.style.setProperty("height", `${Math.min(this.input.scrollHeight + 2, 160)}px`);
  }

  #submit() {
    const text = this.words;
    this.kept = !this.ready;
    if (!this.ready || !text) {
      this.#changed();
      return;
    }
    this.input.value = "";
    this.#typed();
    this.send(text);
  }
}
