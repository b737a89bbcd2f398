/**
 * Requests to the server.
 *
 * @typedef {{text: string, probability: number, unspecified: boolean, pinned: boolean}} Goal
 * @typedef {{goals: Goal[], entropy: number, set_90: ?string[], degenerate: boolean}} Belief
 * @typedef {{kind: "added"|"removed"|"pinned", goal: string, reason: string, final: boolean}} Change
 * @typedef {{text: string, ok: boolean, observation: string, irreversible: boolean}} Action
 * @typedef {{id: string, created: string, domain: string, profile: ?string, method: string,
 *   model: string, task: string, ended: ?("terminated"|"truncated"), score: ?number,
 *   rounds: number, first_words: string, view: ?("basket"|"map"|"text")}} Episode
 * @typedef {{number: number, query: string, utterance: string, understood: string[], belief: ?Belief,
 *   belief_note: string, changes: Change[], actions: Action[], replans: number,
 *   status: string, notes: string[], question: string, state: string, terminated: boolean}} Round
 * @typedef {{phase: "idle"|"thinking", step: string, query: ?string,
 *   round: number, utterance: ?string, belief: ?Belief, changes: Change[], can_undo: boolean,
 *   confirm: ?{state: string, status: string, question: string, yes: string, no: string},
 *   completion_phrase: string, error: ?string}} Live
 */

/** The server's refusal; the message says what to do. */
export class ApiError extends Error {
  /**
   * @param {string} message
   * @param {number} status 0 where the server was not reached.
   */
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

async function request(method, path, body) {
  let response;
  try {
    response = await fetch(path, {
      method,
      headers: body === undefined ? {} : { "Content-Type": "application/json" },
      body: body === undefined ? undefined : JSON.stringify(body),
    });
  } catch {
    throw new ApiError("The server cannot be reached. Is it still running?", 0);
  }
  const said = await response.json().catch(() => null);
  if (!response.ok) {
    throw new ApiError(said?.error ?? `The server answered with status ${response.status}.`, response.status);
  }
  return said;
}

function query(values) {
  const given = Object.entries(values).filter(([, value]) => value !== undefined && value !== null);
  return new URLSearchParams(given.map(([key, value]) => [key, String(value)])).toString();
}

/** The path of an episode, or of a resource below it. */
export function pathOf(id, rest = "") {
  return `/api/episodes/${encodeURIComponent(id)}${rest}`;
}

export const api = {
  options: () => request("GET", "/api/options"),
  episodes: (wanted) => request("GET", `/api/episodes?${query(wanted)}`),
  begin: (wanted) => request("POST", "/api/episodes", wanted),
  /** @returns {Promise<{episode: Episode, rounds: Round[], live: ?Live}>} */
  episode: (id) => request("GET", pathOf(id)),
  /** @returns {Promise<Live>} */
  say: (id, said) => request("POST", pathOf(id, "/utterances"), said),
  /** @returns {Promise<Live>} */
  correct: (id, correction) => request("POST", pathOf(id, "/corrections"), correction),
  /** @returns {Promise<Live>} */
  undo: (id) => request("DELETE", pathOf(id, "/corrections")),
  why: (id, goal, round) => request("GET", pathOf(id, `/why?${query({ goal, round })}`)),
  words: (id, goal, turn) => request("GET", pathOf(id, `/words?${query({ goal, turn })}`)),
};

const FIRST_WAIT = 1000;
const LONGEST_WAIT = 15000;

/**
 * Receives an episode's events, and reconnects whenever the connection is lost.
 * @param {string} id
 * @param {{live: (live: Live) => void, round: (round: Round) => void,
 *   ended: (episode: Episode) => void, connected: (yes: boolean) => void,
 *   refused: () => void}} handlers `refused`: the server was reached, and refused.
 * @param {AbortSignal} signal Ends it.
 */
export function listen(id, handlers, signal) {
  let source = null;
  let timer = 0;
  let wait = FIRST_WAIT;
  const connect = () => {
    source = new EventSource(pathOf(id, "/events"));
    source.onopen = () => {
      wait = FIRST_WAIT;
      handlers.connected(true);
    };
    source.onerror = () => {
      handlers.connected(false);
      if (source.readyState !== EventSource.CLOSED) return;
      handlers.refused();
      timer = setTimeout(connect, wait);
      wait = Math.min(2 * wait, LONGEST_WAIT);
    };
    for (const name of ["live", "round", "ended"]) {
      source.addEventListener(name, (event) => handlers[name](JSON.parse(event.data)));
    }
  };
  const close = () => {
    clearTimeout(timer);
    source?.close();
  };
  signal.addEventListener("abort", close);
  if (!signal.aborted) connect();
  return close;
}
