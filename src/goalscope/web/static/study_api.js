/**
 * What the server of a study is asked, again and again until it has answered.
 *
 * @typedef {{rating: ?number, explanation: string, revision: number}} Answer
 * @typedef {{task: string, possible: string[], profile: string, outcome: string,
 *   transcript: {query: string, utterance: string}[], answer: Answer}} Item
 * @typedef {{title: string, consent: string, instructions: string, question: string,
 *   scale: string[], min_explanation: number, answered: ?boolean[],
 *   completion: ?{code: string, url: string}}} Study
 */

const PATH = `/api/studies/${location.pathname.split("/")[2]}`;
const FIRST_WAIT = 1000;
const LONGEST_WAIT = 15000;

/** The server said no; the message says why. */
export class RefusedError extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** The same question was answered otherwise elsewhere; the message tells how. */
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
    if (response && response.status < 500 && response.status !== 429 && !response.ok) {
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

/** Whether two answers say the same. */
export function same(one, other) {
  return one.rating === other.rating && one.explanation === other.explanation;
}

/**
 * A function that keeps an answer, and whose promise is fulfilled when the server has it. Requests
 * are made one after the other; each may be made twice without harm, as it bears its revision.
 * @param {number} place
 * @param {Answer} saved What the server has.
 * @param {() => void} waiting Is called when the server could not be reached.
 */
export function keeper(place, saved, waiting) {
  const sent = [];
  let wanted = null;
  let running = null;

  async function keep() {
    while (wanted && !same(wanted, saved)) {
      const given = { ...wanted, revision: saved.revision + 1 };
      sent.push(given);
      try {
        saved = await ask("PUT", `/items/${place}`, given, waiting);
      } catch (error) {
        if (error.status !== 409) throw error;
        saved = (await api.item(place, waiting)).answer;
        if (!sent.some((mine) => same(mine, saved))) {
          throw new ElsewhereError(
            `In another window you answered ${saved.rating}, “${saved.explanation}”. Saving again replaces that.`,
          );
        }
      }
    }
  }

  return (answer) => {
    wanted = answer;
    running ??= keep().finally(() => {
      running = null;
    });
    return running;
  };
}
