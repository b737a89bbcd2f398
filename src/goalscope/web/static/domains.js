/** What the page says of domains: the server names their views, and describes them. */

const NOTHING = "Nothing has been done yet.";
const VIEWS = {
  basket: { state: "The basket", empty: "The basket is empty.", examples: ["I\u2019m making pancakes on Sunday.", "Please add a bag of apples.", "Do you have oat milk?"] },
  map: { state: "The room", empty: NOTHING, examples: ["Put the tomato into the fridge.", "I have friends coming for coffee.", "Where is the bread?"] },
  text: { state: "The state", empty: NOTHING, examples: [] },
};

/** What the state after a round is called, shown as while it is empty, and what one may say first. */
export function stateOf(episode) {
  return VIEWS[episode.view ?? "text"];
}

/** Whether the agent acts there: it does not where it tracks goals for another program. */
export function acts(episode) {
  return episode.view !== null;
}

/** Whether results are written for the page; elsewhere it names the task and each action, too. */
export function isDrawn(episode) {
  return episode.view === "basket" || episode.view === "map";
}

/** The domain of an episode among those that the server names. */
export function domainOf(episode, options) {
  const found = options.domains.find((domain) => domain.name === episode.domain);
  return found ?? { name: episode.domain, title: acts(episode) ? nameOfDomain(episode.domain) : "goal tracking", about: episode.task };
}

/** A short name; for a domain in a file, the file's name. */
export function nameOfDomain(name) {
  return name.split(/[\\/]/).at(-1);
}

/** Who talks in an episode. */
export function personOf(episode) {
  return acts(episode) ? (episode.profile ?? "you") : "a program's user";
}

/** Whether one can go on with it here. */
export function goesOn(episode, options) {
  return !episode.ended && !episode.profile && options.domains.some((domain) => domain.name === episode.domain);
}
