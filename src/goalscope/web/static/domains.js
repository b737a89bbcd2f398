/** What each domain is, for a person; the server's own words are written for a model. */

const ABOUT = {
  grocery: "It fills a basket for you, and buys it once you say so.",
  house: "It finds, moves and tidies things in a home that you see from above.",
};

/** @param {{name: string, task: string}} domain */
export function aboutDomain(domain) {
  return ABOUT[domain.name] ?? domain.task;
}

/** The domain of an episode among those that the server names. */
export function domainOf(episode, options) {
  const found = options.domains.find((domain) => domain.name === episode.domain);
  return found ?? { name: episode.domain, title: episode.domain, task: episode.task };
}
