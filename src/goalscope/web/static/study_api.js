/**
 * Requests to the server of a study, repeated until it answers.
 *
 * @typedef {{rating: ?number, explanation: string, revision: number}} Answer
 * @typedef {{task: string, possible: string[], profile: string, outcome: string,
 *   transcript: {query: string, utterance: string}[], answer: Answer}} Item
 * @typedef {{title: string, consent: string, instructions: string, question: string,
 *   scale: string[], min_explanation: number, answered: ?boolean[], thanks: string}} Study
 */

const PATH = `/api/studies/${location.pathname.split("/")[2]}`;
const FIRST_WAIT = 1000;
const LONGEST_WAIT = 15000;

/** The server's refusal; the message says why. */
export class RefusedError extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** The question was answered in another window; the message quotes that answer. */
export class ElsewhereError extends Error {}

async function ask(method, path, body, waiting = () => {}) {
  for (let wait = FIRST_WAIT; ; wait = Math.min(2 * wait, LONGEST_WAIT)) {
    const response = await fetch(PATH + path + location.search, {
      method,
      headers: body ? { "Content-Type": "application/json" } : {},
      body: body && JSON.stringify(body),
    }).catch(() => null);
    const said = await response?.json().catch(() => null);
    if (response?.ok && said) return said;
    if (response && response.status < 500 && !response.ok) {
      throw new RefusedError(said?.error ?? `The server answered ${response.status}.`, response.status);
    }
    waiting();
    await new Promise((resume) => {
      setTimeout(resume, wait);
      addEventListener("online", resume, { once: true });
    });
  }
}

export const api = {
  /** @returns {Promise<Study>} */
  study: (waiting) => ask("GET", "", undefined, waiting),
  /** @returns {Promise<Study>} */
  agree: (waiting) => ask("POST", "/consent", { agreed: true }, waiting),
  /** @returns {Promise<Item>} */
  item: (place, waiting) => ask("GET", `/items/${place}`, undefined, waiting),
};

/** Whether two answers are equal. */
export function same(one, other) {
  return one.rating === other.rating && one.explanation === other.explanation;
}

/**
 * Saves the answers to one question, one after the other. Each request may arrive
 * twice without harm, as it bears its revision.
 */
export class Keeper {
  #place;
  #sent = [];
  #wanted = null;
  #running = null;

  /** @param {number} place */
  constructor(place) {
    this.#place = place;
    /** @type {Answer} What the server has. */
    this.saved = { rating: null, explanation: "", revision: 0 };
  }

  /** @param {Answer} answer What the server says that it has. */
  know(answer) {
    if (answer.revision > this.saved.revision) this.saved = answer;
  }

  /**
   * @param {{rating: number, explanation: string}} answer
   * @param {() => void} waiting Is called when the server could not be reached.
   * @returns {Promise<void>} Fulfilled when the server has it, or a later one.
   */
  keep(answer, waiting) {
    this.#wanted = answer;
    this.#running ??= this.#run(waiting).finally(() => {
      this.#running = null;
    });
    return this.#running;
  }

  async #run(waiting) {
    while (this.#wanted) {
      const answer = this.#wanted;
      const given = { ...answer, revision: this.saved.revision + 1 };
      this.#sent.push(given);
      try {
        const { revision } = await ask("PUT", `/items/${this.#place}`, given, waiting);
        this.saved = { ...answer, revision };
        if (this.#wanted === answer) this.#wanted = null;
      } catch (error) {
        if (error.status === 409) await this.#learn(waiting);
        else {
          this.#wanted = null;
          throw error;
        }
      }
    }
  }

  /** Finds out whether the saved answer is ours, with a lost reply, or another window's. */
  async #learn(waiting) {
    this.know((await api.item(this.#place, waiting)).answer);
    if (this.#sent.some((mine) => same(mine, this.saved))) return;
    this.#wanted = null;
    throw new ElsewhereError(otherwise(this.saved));
  }
}

/** The message that another answer is saved than the one shown. */
export function otherwise({ rating, explanation }) {
  return `Another answer is saved: ${rating}, \u201c${explanation}\u201d. Saving this one replaces it.`;
}
