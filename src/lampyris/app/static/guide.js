// Guide: the numbers and the tables of the worked example, ours from the server and the dissertation's as they are printed.

import { ServerError } from "./api.js";
import { scenario, SIDE } from "./opening.js";
import { asked } from "./flow.js";
import { addEvents, addTicks, json, layerOf, newRun } from "./frames.js";
import { el, spelled, spoken } from "./make.js";
import { planned } from "./runs.js";
import { jumpTable } from "./steps.js";

/** @typedef {import("./steps.js").Jump} Jump */

/** A neighbour's place less the cell's, in the order in which ties fall. */
const ORDER = [[-1, -1], [1, -1], [-1, 1], [1, 1], [-1, 0], [1, 0], [0, -1], [0, 1]];

/**
 * Tables 4.2 to 4.6 as printed, numbers as their digits.
 * @typedef {{
 *   field: Array<[string, Cell | null]>,
 *   walk: Array<{table: string, current: Cell, next: Cell | null, accepted: Array<[number, number, string]>, path: Cell[]}>,
 *   whole: {iterations: string, gates: string, cost: string, table_cost: string},
 * }} Printed
 */

/**
 * Ours. `luciferin` and `cost` of each cell, NaN for walls; `parent`: index of the cell pointed to, or -1.
 * `avoided`: the same drive with somebody who steps onto its path. `fourth`: an iteration from (7,2), where the printed walk stands and ours does not.
 * @typedef {{
 *   luciferin: number[], cost: number[], parent: number[], jumps: Jump[], fourth: Jump, plan: Record<string, any>,
 *   layers: Record<string, Layer>, printed: Printed | null, avoided: Run,
 * }} Numbers
 */

/** Somebody who waits beside the path, steps onto it as the robot comes, and goes back. @type {Cell[]} */
const TRACK = [.../** @type {Cell[]} */ (Array(6).fill([4, 5])), [5, 4], [5, 4], [5, 4], [4, 5]];

/** All numbers of the tour. @param {Page} page @returns {Promise<Numbers>} */
export async function numbers(page) {
  const own = asked(scenario(), false);
  const ask = (/** @type {Partial<Scenario>} */ patch, layers = /** @type {string[]} */ ([])) =>
    planned(page, { scenario: { ...own, ...patch }, record: true, layers });
  const plan = await ask({}, ["gates"]);
  // A window as large as the map accepts every cell at once: so one question has the luciferin of all.
  const wide = await ask({ planner: { name: "ad-gso", settings: { nt: 10000, mvr: 50 } } });
  const fourth = await ask({ start: [7, 2] });
  const cost = await layer(page, own, "cost");
  const shine = await layer(page, own, "luciferin");
  const avoided = await driven(page, { ...own, obstacles: [{ kind: "recorded", track: TRACK }] });
  const luciferin = Array.from({ length: SIDE * SIDE }, () => NaN);
  const first = wide.jumps[0];
  luciferin[index(first.at)] = first.luciferin;
  for (const one of first.accepted) luciferin[index(one.cell)] = one.luciferin;
  // A layer has 255 steps; costs here are multiples of 0.2, which is coarser: they are had exactly.
  const exact = [...cost.values].map((v, k) => (v && !Number.isNaN(luciferin[k]) ? Math.round((cost.low + ((v - 1) / 254) * (cost.high - cost.low)) * 5) / 5 : NaN));
  return {
    luciferin, cost: exact, parent: exact.map((_, k) => parentOf(exact, k)), jumps: plan.jumps, fourth: fourth.jumps[0], plan,
    layers: { cost, luciferin: shine }, printed: await asPrinted(), avoided,
  };
}

/** A simulation, whole. @param {Page} page @param {Scenario} scenario @returns {Promise<Run>} */
async function driven(page, scenario) {
  let run = newRun({});
  for await (const { kind, bytes } of page.api.frames("/api/simulate", { scenario })) {
    if (kind === "X") throw new ServerError(200, json(bytes));
    else if (kind === "H") run = newRun(json(bytes));
    else if (kind === "T") addTicks(bytes, run);
    else if (kind === "E") addEvents(bytes, run);
  }
  return run;
}

/** @param {Page} page @param {Scenario} own @param {string} name */
async function layer(page, own, name) {
  const body = { scenario: own, layer: name, obstacle_cells: null, tick: 0 };
  for await (const { kind, bytes } of page.api.frames("/api/layer", body)) {
    if (kind === "L") return layerOf(bytes);
    if (kind === "X") throw new ServerError(200, json(bytes));
  }
  throw new Error(`no layer ${name}`);
}

/** The printed tables; null where they cannot be had: then only ours are shown. @returns {Promise<Printed | null>} */
async function asPrinted() {
  try {
    const answer = await fetch(new URL("printed.json", import.meta.url), { credentials: "omit", redirect: "error" });
    return answer.ok ? await answer.json() : null;
  } catch {
    return null;
  }
}

/** @param {ArrayLike<number>} cell */
export function index(cell) {
  return SIDE * cell[1] + cell[0];
}

/** @param {number} k @returns {Cell} */
export function cellOf(k) {
  return [k % SIDE, Math.floor(k / SIDE)];
}

/** The neighbour through which a cell's cost is reached, the first of several by the order. @param {number[]} cost @param {number} k */
function parentOf(cost, k) {
  const [x, y] = cellOf(k);
  if (!(cost[k] > 0)) return -1;
  for (const [dx, dy] of ORDER) {
    const [i, j] = [x + dx, y + dy];
    if (i < 0 || j < 0 || i >= SIDE || j >= SIDE) continue;
    if (Math.abs(cost[index([i, j])] + (dx && dy ? 1.4 : 1) - cost[k]) < 1e-6) return index([i, j]);
  }
  return -1;
}

/**
 * How a printed number and ours compare: "same" to the last printed digit, cut or rounded; "near", by what cutting
 * digits earlier on can do; "other".
 * @param {string} printed @param {number} ours @param {number} slack
 * @returns {"same" | "near" | "other"}
 */
function verdict(printed, ours, slack) {
  const digits = printed.includes(".") ? printed.length - printed.indexOf(".") - 1 : 0;
  const off = Math.abs(Number(printed) - ours);
  // Cut off or rounded, the last digit is at most one too low or half of one too high.
  if (off < 10 ** -digits - 1e-9 || off < 1e-9) return "same";
  return off < slack ? "near" : "other";
}

const SIGNS = { same: "✓", near: "≈", other: "≠" };

// ---- the dissertation's tables beside ours ----

/** @typedef {import("./make.js").Part} Part */

/** @param {Numbers} n */
export function wallsAgree(n) {
  const field = n.printed?.field ?? [];
  const same = field.filter(([text], k) => (text === "10000") === Number.isNaN(n.luciferin[k])).length;
  return `${same} of ${field.length} cells agree`;
}

/** Table 4.2: luciferin, cell by cell. @param {Numbers} n @returns {Part[]} */
export function fieldTable(n) {
  const count = { same: 0, near: 0, other: 0 };
  const rows = Array.from({ length: SIDE }, (_, y) => el("tr", null, el("th", { scope: "row" }, String(y)), ...Array.from({ length: SIDE }, (_, x) => {
    const k = SIDE * y + x;
    const ours = n.luciferin[k];
    if (Number.isNaN(ours)) return el("td", { class: "wall" }, el("span", { class: "unseen" }, "wall"));
    const said = n.printed?.field[k][0];
    if (said === undefined) return el("td", null, ours.toFixed(2));
    const how = verdict(said, ours, 0.003);
    count[how] += 1;
    return el("td", { class: how, title: `${spelled([x, y])}: ${ours.toFixed(4)}, printed ${said}` }, ours.toFixed(how === "same" ? 2 : 3), how === "same" ? null : ` ${SIGNS[how]}`);
  })));
  const others = n.printed ? n.printed.field.map(([text], k) => ({ text, k })).filter(({ text, k }) => !Number.isNaN(n.luciferin[k]) && verdict(text, n.luciferin[k], 0.003) !== "same") : [];
  return [
    n.printed && tally(count, "Table 4.2"),
    el("table", { class: "data field-table" }, el("caption", { class: "unseen" }, "Luciferin by column and row"),
      el("thead", null, el("tr", null, el("td", null), ...Array.from({ length: SIDE }, (_, x) => el("th", { scope: "col" }, String(x))))), el("tbody", null, ...rows)),
    others.length ? el("ul", { class: "hint plain" }, ...others.map(({ text, k }) => el("li", null, `${spelled(cellOf(k))}: ours ${n.luciferin[k].toFixed(4)}, printed ${text}`))) : null,
  ];
}

/** @param {Numbers} n @returns {Part[]} */
export function pointerTable(n) {
  if (!n.printed) return [];
  const rows = n.printed.field.map(([text, said], k) => ({ k, said, wall: text === "10000" })).filter(({ k, said, wall }) => !wall && said && n.parent[k] >= 0);
  const equal = rows.filter(({ k, said }) => index(/** @type {Cell} */ (said)) === n.parent[k]);
  const swapped = rows.filter(({ k, said }) => said && index(said) !== n.parent[k] && index([said[1], said[0]]) === n.parent[k]);
  const rest = rows.length - equal.length - swapped.length;
  return [el("p", { class: "tally" }, `Table 4.2: ${equal.length} of ${rows.length} pointers of free cells ${SIGNS.same}`,
    swapped.length ? `, ${swapped.length} with row and column the wrong way round` : "", rest ? `, ${rest} ${SIGNS.other}` : "", "."),
  swapped.length ? el("ul", { class: "hint plain" }, ...swapped.map(({ k, said }) => el("li", null, `${spelled(cellOf(k))}: ours ${spelled(cellOf(n.parent[k]))}, printed ${spelled(/** @type {Cell} */ (said))}`))) : null];
}

/** Accepted cells of one iteration beside the printed ones. @param {Numbers} n @param {number} k @param {Jump} jump @returns {Part[]} */
export function walkTable(n, k, jump) {
  const printed = n.printed?.walk[k];
  if (!printed) return [jumpTable(jump, 99, true)];
  const ours = new Map(jump.accepted.map((one) => [one.cell.join(), one]));
  const said = new Map(printed.accepted.map(([x, y, p]) => [`${x},${y}`, p]));
  const count = { same: 0, near: 0, other: 0 };
  const keys = [...said.keys(), ...[...ours.keys()].filter((key) => !said.has(key))];
  const rows = keys.map((key) => {
    const [mine, theirs] = [ours.get(key), said.get(key)];
    const how = theirs === undefined ? null : mine ? verdict(theirs, mine.probability, 0.001) : "other";
    if (how) count[how] += 1;
    const is = key === jump.chosen.join();
    return el("tr", is ? { class: "chosen" } : null, el("th", { scope: "row" }, `(${key})`, is ? " ◂" : null, is ? spoken(" chosen") : null), el("td", null, mine ? String(mine.ring) : "–"),
      el("td", null, mine ? mine.luciferin.toFixed(3) : "–"), el("td", null, mine ? mine.probability.toFixed(4) : "–"),
      el("td", null, theirs ?? "–"), el("td", how ? { class: how } : null, how ? SIGNS[how] : null));
  });
  const next = printed.next && `The next node is printed as ${spelled(printed.next)}${spelled(printed.next) === spelled(jump.chosen) ? ", as ours" : `; ours is ${spelled(jump.chosen)}`}.`;
  return [tally(count, `Table ${printed.table}`),
    el("table", { class: "data accepted" }, el("caption", { class: "unseen" }, `Accepted cells, ours and in Table ${printed.table}`),
      el("thead", null, el("tr", null, ...["cell", "ring", "luciferin", "ours", "printed", ""].map((word) => el("th", { scope: "col" }, word || el("span", { class: "unseen" }, "agrees"))))),
      el("tbody", null, ...rows)),
    next ? el("p", { class: "hint" }, next) : null];
}

/** @param {Record<"same" | "near" | "other", number>} count @param {string} where */
function tally(count, where) {
  const all = count.same + count.near + count.other;
  return el("p", { class: "tally" }, `${where}: ${count.same} of ${all} printed numbers ${SIGNS.same}`, count.near ? `, ${count.near} ${SIGNS.near} (digits cut off)` : "", count.other ? `, ${count.other} ${SIGNS.other}` : "", ".");
}

/** The nodes of the whole way. @param {Numbers} n @returns {Part[]} */
export function nodesTable(n) {
  return [el("table", { class: "data" }, el("caption", { class: "unseen" }, "The nodes"),
    el("thead", null, el("tr", null, ...["iteration", "from", "to", "passes"].map((word) => el("th", { scope: "col" }, word)))),
    el("tbody", null, ...n.jumps.map((jump, k) => el("tr", null, el("th", { scope: "row" }, String(k)), el("td", null, spelled(jump.at)),
      el("td", null, spelled(jump.chosen)), el("td", null, jump.subpath.slice(1, -1).map(spelled).join(" ") || "–")))))];
}

/** What happened while an obstacle was avoided. @param {Numbers} n */
export function avoidedTable({ avoided }) {
  return [el("table", { class: "data" }, el("caption", { class: "unseen" }, "Events"),
    el("thead", null, el("tr", null, ...["tick", "at", "what"].map((word) => el("th", { scope: "col" }, word)))),
    el("tbody", null, ...avoided.events.map(({ tick, cell, sentence }) => el("tr", null, el("th", { scope: "row" }, String(tick)), el("td", null, spelled(cell)), el("td", { class: "words" }, sentence)))))];
}

/** The velocity of each node, and what limits it. @param {Numbers} n */
export function velocityTable({ plan }) {
  const { nodes, speed } = plan;
  const shown = (/** @type {number | null} */ v) => (v === null || v === undefined ? "–" : String(Number(v.toFixed(1))));
  return [el("table", { class: "data" }, el("caption", { class: "unseen" }, "Velocities"),
    el("thead", null, el("tr", null, ...["cell", "ring 1, 2", "by obstacles", "angle", "by angle", "velocity", "limited by"].map((word) => el("th", { scope: "col" }, word)))),
    el("tbody", null, ...plan.cells.map((/** @type {Cell} */ cell, /** @type {number} */ k) => el("tr", null, el("th", { scope: "row" }, spelled(cell)), el("td", null, `${nodes.ring1[k]}, ${nodes.ring2[k]}`),
      el("td", null, shown(nodes.obstacle_velocity[k])), el("td", null, shown(nodes.angle_deg[k])), el("td", null, shown(nodes.angle_velocity[k])), el("td", null, shown(speed.v[k])), el("td", null, speed.cause[k])))))];
}
