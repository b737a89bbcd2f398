/** What each domain is, for a person; the server's own words are written for a model. */

const KNOWN = {
  grocery: {
    about: "It fills a basket for you, and buys it once you say so.",
    state: "The basket",
    empty: "The basket is empty.",
  },
  house: {
    about: "It finds, moves and tidies things in a home that you see from above.",
    state: "The room",
    empty: "The robot has not done anything yet.",
  },
};
const OWN = { about: null, state: "The state", empty: "Nothing was done yet." };
const TRACKING = "tracking";

/** Whether what is done there speaks for itself; elsewhere the action must be named, too. */
export function isKnown(name) {
  return Object.hasOwn(KNOWN, name);
}

/** How the state after a round is called, and what is said of it while there is none. */
export function stateOf(name) {
  return isKnown(name) ? KNOWN[name] : OWN;
}

/** Whether the agent acts there: another program's, whose user's goals are tracked, does not. */
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

/** In a word or two; of a domain that is a file, the file's name. */
export function nameOfDomain(name) {
  return acts(name) ? name.split(/[\\/]/).at(-1) : "goal tracking";
}

/** Who talks in an episode. */
export function personOf(episode) {
  if (!acts(episode.domain)) return "a program's user";
  return episode.profile ?? (episode.mine ? "you" : "somebody");
}

/** Whether one can go on with it here. */
export function goesOn(episode) {
  return episode.mine && !episode.ended && !episode.profile && acts(episode.domain);
}
