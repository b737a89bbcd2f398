/** Descriptions of domains for people; the server's are written for a model. */

const KNOWN = {
  grocery: {
    about: "It fills a basket for you, and buys it once you confirm.",
    state: "The basket",
    empty: "The basket is empty.",
  },
  house: {
    about: "It finds, moves and tidies things in a home that you see from above.",
    state: "The room",
    empty: "The robot has not done anything yet.",
  },
};
const OWN = { about: null, state: "The state", empty: "Nothing has been done yet." };
const TRACKING = "tracking";

/** Whether observations name their actions there; elsewhere the page names them, too. */
export function isKnown(name) {
  return Object.hasOwn(KNOWN, name);
}

/** What the state after a round is called, and shown as while it is empty. */
export function stateOf(name) {
  return isKnown(name) ? KNOWN[name] : OWN;
}

/** Whether the agent acts there: it does not where it tracks goals for another program. */
export function acts(name) {
  return name !== TRACKING;
}

/** @param {{name: string, task: string}} domain */
export function aboutDomain(domain) {
  return stateOf(domain.name).about ?? domain.task;
}

/** The domain of an episode among those that the server names. */
export function domainOf(episode, options) {
  const found = options.domains.find((domain) => domain.name === episode.domain);
  return found ?? { name: episode.domain, title: nameOfDomain(episode.domain), task: episode.task };
}

/** A short name; for a domain in a file, the file's name. */
export function nameOfDomain(name) {
  return acts(name) ? name.split(/[\\/]/).at(-1) : "goal tracking";
}

/** Who talks in an episode. */
export function personOf(episode) {
  if (!acts(episode.domain)) return "a program's user";
  return episode.profile ?? "you";
}

/** Whether one can go on with it here. */
export function goesOn(episode) {
  return !episode.ended && !episode.profile && isKnown(episode.domain);
}
