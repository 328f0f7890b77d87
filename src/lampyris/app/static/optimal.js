// Optimal: a shortest path (A*) beside the planner's own, on the map in the second colour, with what it costs.

import { LINES } from "./colours.js";
import { planned } from "./runs.js";

/** Those pages that take it off with the next plan. @type {WeakSet<Page>} */
const known = new WeakSet();

/** The shortest path on the map, with what it costs beside the shown one; if it is there already, off again. @param {Page} page */
export async function askOptimal(page) {
  if (!known.has(page)) page.on("plan", () => show(page, null));
  known.add(page);
  if (page.map.beside) {
    show(page, null);
    return;
  }
  const { plan } = page;
  const found = await planned(page, { scenario: { ...page.asked(true), planner: { name: "astar", settings: {} } }, record: false, layers: [] });
  const { cells, cost, seconds } = found;
  // The scenario may have changed while it was searched for.
  if (!cells?.length || page.plan !== plan) return;
  const [colour, dash] = LINES[1];
  show(page, { cells: Int16Array.from(cells.flat()), colour, dash, wide: 3 });
  const own = page.plan?.cost ?? null;
  if (own !== null) page.say(`A* finds ${cost.toFixed(2)} cells${Number.isFinite(seconds) ? ` in ${(1000 * seconds).toFixed(2)} ms` : ""}; ${page.titleOf(page.store.scenario.planner.name)} ${own.toFixed(2)}, ${(100 * (own / cost - 1)).toFixed(1)} % more.`);
}

/** @param {Page} page @param {import("./marks.js").Way | null} way */
function show(page, way) {
  if (page.map.beside === way) return;
  page.map.beside = way;
  page.map.refresh();
  page.tell("gates");
}
