// Meeting: who was chosen to meet, for the comparison, for a study of it, and for the file of both.

/** @typedef {import("./types.js").Page} Page */
/** @typedef {import("./types.js").Who} Who */
/** @typedef {Who & {label: string}} Entry */
/** No law: the scenario's own. @typedef {{planners: Entry[], laws: Entry[], seeds: number}} Meeting */

const FIRST = ["ad-gso", "astar", "dstar-lite"];
const LONGEST = 64;

/** @type {WeakMap<Page, Meeting>} */
const known = new WeakMap();

/** Who was chosen, to be changed; at first some that are worth comparing. @param {Page} page @returns {Meeting} */
export function chosen(page) {
  let found = known.get(page);
  if (!found) {
    const names = page.hello.planners.map((/** @type {any} */ one) => one.name);
    found = { planners: FIRST.filter((name) => names.includes(name)).map((name) => ({ name, settings: {}, label: name })), laws: [], seeds: 1 };
    known.set(page, found);
  }
  return found;
}

/** Who meets, as the server takes it. @param {Page} page @returns {Meeting} */
export function meeting(page) {
  const { planners, laws, seeds } = chosen(page);
  const { law, preset } = page.store.scenario;
  const own = law ?? { name: preset === "dissertation" ? "dissertation" : "physical", settings: {} };
  return { planners, laws: laws.length ? laws : [{ ...own, label: labelOf(own) }], seeds };
}

/** What a list calls somebody with settings. @param {Who} who */
export function labelOf(who) {
  const settings = Object.entries(who.settings).map(([key, value]) => `${key}=${Array.isArray(value) ? value.join("/") : value}`);
  const words = [who.name, ...settings].join(" ");
  return words.length <= LONGEST ? words : `${words.slice(0, LONGEST - 3)}...`;
}
