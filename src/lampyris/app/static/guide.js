// Guide: the numbers of the worked example, ours from the server and the dissertation's as they are printed.

import { asked } from "./flow.js";
import { ServerError } from "./api.js";
import { SIDE, scenario } from "./example.js";
import { addEvents, addTicks, json, layerOf, newRun } from "./frames.js";
import { planned } from "./runs.js";

/** @typedef {import("./stagehand.js").Jump} Jump */

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
    const answer = await fetch("/static/printed.json", { credentials: "omit", redirect: "error" });
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
export function verdict(printed, ours, slack) {
  const digits = printed.includes(".") ? printed.length - printed.indexOf(".") - 1 : 0;
  const off = Math.abs(Number(printed) - ours);
  // Cut off or rounded, the last digit is at most one too low or half of one too high.
  if (off < 10 ** -digits - 1e-9 || off < 1e-9) return "same";
  return off < slack ? "near" : "other";
}

export const SIGNS = { same: "✓", near: "≈", other: "≠" };
