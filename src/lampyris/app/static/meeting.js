// Meeting: who was chosen to meet, for the comparison, for a study of it, and for the file of both.

import { fragment } from "./link.js";
import { plansPoses } from "./shape.js";

/** @typedef {Who & {label: string}} Entry */
/** No law: the scenario's own. @typedef {{planners: Entry[], laws: Entry[], seeds: number}} Meeting */
/** `first`: what the list was before anybody changed it. @typedef {Meeting & {first?: string}} Known */

/** Who is worth comparing, for a robot on cells and for one with headings. */
const FIRST = { cells: ["ad-gso", "astar", "dstar-lite"], poses: ["lattice", "hybrid-astar", "pose-rrt-connect"] };
const LONGEST = 64;

/** @type {WeakMap<Page, Known>} */
const known = new WeakMap();

/** Who was chosen, to be changed; at first those of the link, or some that are worth comparing. @param {Page} page @returns {Meeting} */
export function chosen(page) {
  if (!known.has(page)) linked(page);
  let found = known.get(page);
  if (!found) {
    found = { planners: firstOf(page), laws: [], seeds: 1 };
    found.first = namesOf(found.planners);
    known.set(page, found);
  }
  return found;
}

/** The planners of a race until the user selects others: of the same kind as the scenario's planner. @param {Page} page */
function firstOf(page) {
  const { hello, store } = page;
  const poses = plansPoses(page);
  const own = store.scenario.planner.name;
  const names = poses ? [own, ...FIRST.poses.filter((name) => name !== own)].slice(0, 3) : FIRST.cells;
  return names.filter((name) => isOne(poses ? hello.planners_of_poses : hello.planners, name)).map((name) => entry(page, [name, {}]));
}

/** Whatever their order: a comparison of drives puts the longest first. @param {Entry[]} planners */
function namesOf(planners) {
  return planners.map(({ name, settings }) => [name, ...Object.keys(settings)].join()).sort().join();
}

/** Update the list to the scenario's planner unless the user has changed it; returns whether the list changed. @param {Page} page */
export function followed(page) {
  const found = known.get(page);
  if (!found || found.first !== namesOf(found.planners)) return false;
  const planners = firstOf(page);
  const first = namesOf(planners);
  if (first === found.first) return false;
  Object.assign(found, { planners, first });
  return true;
}

/** @param {any[]} rows @param {unknown} name */
function isOne(rows, name) {
  return rows.some((one) => one.name === name);
}

/** @param {Page} page @param {[string, any]} who @returns {Entry} */
function entry(page, [name, settings]) {
  const who = { name, settings: settings ?? {} };
  return { ...who, label: labelOf(page, who) };
}

/**
 * Who meets as a part of the link, `c`; empty: nobody was chosen and nothing is shown. `look`: 1 overlaid, 2 side by
 * side, 0 not shown.
 * @param {Page} page @param {number} look
 */
export function textOf(page, look) {
  const { planners, laws, seeds, first: before } = /** @type {Known} */ (chosen(page));
  const [some, others] = [planners, laws].map((list) => list.map(({ name, settings }) => [name, settings]));
  const first = !look && !laws.length && seeds === 1 && namesOf(planners) === before;
  return first ? "" : JSON.stringify([some, others, seeds, look, look ? Math.floor(page.play.tick) : 0]);
}

/** Choose whom the address says; null: it says nothing new. @param {Page} page @returns {{look: number, tick: number} | null} */
export function linked(page) {
  const text = fragment().get("c") ?? "";
  if (!text || (known.has(page) && text === page.met())) return null;
  try {
    const [planners, laws, seeds, look, tick] = JSON.parse(text);
    const of = (/** @type {any[]} */ list, /** @type {any[]} */ rows) => list.filter(([name]) => isOne(rows, name)).slice(0, 8).map((who) => entry(page, who));
    known.set(page, { planners: of(planners, [...page.hello.planners, ...page.hello.planners_of_poses]), laws: of(laws, page.hello.laws), seeds: Math.min(Math.max(Math.round(seeds) || 1, 1), 50) });
    return { look, tick: Number(tick) || 0 };
  } catch {
    // Nothing that a page has written: as if it were not there.
    return null;
  }
}

/** Who meets, as the server takes it. @param {Page} page @returns {Meeting} */
export function meeting(page) {
  const { planners, laws, seeds } = chosen(page);
  const { law, preset } = page.store.scenario;
  const own = law ?? { name: preset === "dissertation" ? "dissertation" : "physical", settings: {} };
  return { planners, laws: laws.length ? laws : [{ ...own, label: labelOf(page, own) }], seeds };
}

/** What a list calls somebody with settings. @param {Page} page @param {Who} who */
export function labelOf(page, who) {
  const settings = Object.entries(who.settings).map(([key, value]) => `${key}=${Array.isArray(value) ? value.join("/") : value}`);
  const words = [page.titleOf(who.name), ...settings].join(" ");
  return words.length <= LONGEST ? words : `${words.slice(0, LONGEST - 3)}...`;
}
