// Measures of a comparison: how they are called, which way is better, and how to draw them. The names, words and
// senses are those of studies; a test holds them together.

import { el, fill, svg, formatted } from "./make.js";
import { LINES } from "./colours.js";

/** Name, title, better ("less", "more", ""), what it is multiplied with. @typedef {[string, string, string, number]} Measure */
/** @type {Measure[]} */
export const MEASURES = [
  ["arrived", "arrived (%)", "more", 100],
  ["found", "found (%)", "more", 100],
  ["collisions", "collisions", "less", 1],
  ["hits", "hits", "less", 1],
  ["near_misses", "near misses", "less", 1],
  ["near_m", "nearest obstacle (m)", "more", 1],
  ["cost", "cost (cells)", "less", 1],
  ["gap", "gap (%)", "less", 100],
  ["length_m", "length (m)", "less", 1],
  ["cost_to_go", "sum of cost-to-go", "", 1],
  ["ticks", "ticks", "less", 1],
  ["time_s", "arrival (s)", "less", 1],
  ["speed_mean", "mean speed moving", "more", 1],
  ["waits", "waits", "less", 1],
  ["turn_deg", "turning (deg)", "less", 1],
  ["clearance_least_m", "least clearance (m)", "more", 1],
  ["iterations", "iterations", "less", 1],
  ["expansions", "expansions", "less", 1],
  ["replans", "replans", "less", 1],
  ["path_switches", "path switches", "less", 1],
  ["plan_s", "planning (ms)", "less", 1000],
];

/**
 * One number of one entrant; `low` and `high` where there is an interval.
 * @typedef {{value: number, low: number | null, high: number | null}} Estimate
 */

/** What a comparison found: a name, and numbers by measure. @typedef {{label: string, outcome: string, estimates: Map<string, Estimate>}} Entrant */

/** Entrants of what was gathered. @param {import("./runs.js").Gathered} all @returns {Entrant[]} */
export function entrants(all) {
  return all.runs.map((run, k) => {
    const one = { ...run.end?.metrics, plan_s: planSeconds(run.end) };
    return { label: run.label, outcome: run.end?.outcome ?? "", estimates: numbersOf(one, entryOf(all.summary, run.label, k)?.own ?? {}) };
  });
}

/** Numbers of one run, or where there are means those. @param {Record<string, any>} one @param {Record<string, any>} own @returns {Map<string, Estimate>} */
export function numbersOf(one, own) {
  /** @type {Map<string, Estimate>} */
  const numbers = new Map();
  for (const [name, , , scale] of MEASURES) {
    const many = own[name];
    const value = many ? many.value : typeof one[name] === "boolean" ? Number(one[name]) : one[name];
    if (typeof value !== "number") continue;
    const spread = many && many.units > 1 && typeof many.low === "number" && many.low !== many.high;
    numbers.set(name, { value: scale * value, low: spread ? scale * many.low : null, high: spread ? scale * many.high : null });
  }
  // In a simulation both say the same.
  if (numbers.has("arrived")) numbers.delete("found");
  return numbers;
}

/** @param {Record<string, any> | null} summary @param {string} label @param {number} k */
function entryOf(summary, label, k) {
  const entries = (summary?.entries ?? []).filter((/** @type {any} */ one) => one.place === "");
  return entries.find((/** @type {any} */ one) => one.entrant === label) ?? entries[k];
}

/** @param {Record<string, any> | null | undefined} end */
function planSeconds(end) {
  const timing = end?.timing ?? {};
  return timing.plan_s ?? timing.planning_s ?? timing.planner_s;
}

/**
 * Who has the best number, and whether the runs tell them from the others: as the server says.
 * @typedef {Record<string, {who: string[], sure: boolean}>} Bests
 */

/** What each mark of the table says. @type {Record<string, string>} */
export const STARS = { "★": "best", "☆": "best number, not distinguishable" };

/** The table: measures down, entrants across. @param {Entrant[]} some @param {string} note @param {Bests} bests */
export function tableOf(some, note, bests) {
  const rows = MEASURES.map(([name, title]) => {
    const numbers = some.map((one) => one.estimates.get(name));
    if (numbers.every((one) => one === undefined)) return null;
    const { who, sure } = bests[name] ?? { who: [], sure: false };
    const star = sure ? "★" : "☆";
    return el("tr", null, el("th", { scope: "row" }, title), ...numbers.map((one, k) => el("td", sure && who.includes(some[k].label) ? { class: "best" } : null,
      formatted(one?.value), who.includes(some[k].label) ? el("span", { class: "star", title: STARS[star] }, ` ${star}`, el("span", { class: "unseen" }, ` ${STARS[star]}`)) : null,
      one && one.low !== null ? el("span", { class: "interval" }, `${brief(one.low)}–${brief(/** @type {number} */ (one.high))}`) : null)));
  });
  const heads = some.map((one, k) => el("th", { scope: "col" }, swatch(k), el("span", null, one.label)));
  const outcome = some.some((one) => one.outcome)
    ? el("tr", null, el("th", { scope: "row" }, "outcome"), ...some.map((one) => el("td", null, one.outcome.replaceAll("_", " ")))) : null;
  const made = el("table", { class: "data measures" }, el("caption", null, note),
    el("thead", null, el("tr", null, el("td", null), ...heads)), el("tbody", null));
  fill(made.tBodies[0], outcome, ...rows);
  return made;
}

/** An end of an interval: three digits say enough. @param {number} v */
function brief(v) {
  const size = Math.abs(v);
  return v.toLocaleString("en", { maximumFractionDigits: size >= 100 ? 0 : size >= 10 ? 1 : size >= 0.01 ? 2 : 4 });
}

/** A bit of an entrant's line: its colour and its dash. @param {number} k */
export function swatch(k) {
  const [colour, dash] = LINES[k % LINES.length];
  return svg("svg", { class: "stroke", viewBox: "0 0 26 8", width: 26, height: 8, "aria-hidden": "true" },
    svg("line", { x1: 1, y1: 4, x2: 25, y2: 4, stroke: colour, "stroke-width": 4, "stroke-dasharray": dash.length ? dash.map((d) => d * 0.8).join(" ") : null }));
}

/** The three bar charts of the dissertation: iterations, cost, time. */
const CHARTS = /** @type {Array<[string, Array<[string, string]>]>} */ ([
  ["Iterations", [["iterations", "iterations"]]],
  ["Path cost (cells)", [["cost", "cost of the path"], ["cost_to_go", "sum of cost-to-go, as printed for the baselines"]]],
  ["Time (ms of planning, this machine)", [["plan_s", "planning"]]],
]);

/** @param {Entrant[]} some */
export function charts(some) {
  return CHARTS.map(([title, columns]) => {
    const there = columns.filter(([name]) => some.some((one) => one.estimates.has(name)));
    return there.length ? bars(title, there, some) : null;
  });
}

const WIDE = 268;
const BAR = 13;

/** Bars, one beneath the other, on one axis from 0. @param {string} title @param {Array<[string, string]>} columns @param {Entrant[]} some */
function bars(title, columns, some) {
  const greatest = Math.max(1e-12, ...some.flatMap((one) => columns.map(([name]) => one.estimates.get(name)?.value ?? 0)));
  const room = WIDE - 52;
  const parts = [];
  const words = [];
  let y = 4;
  for (const [k, one] of some.entries()) {
    parts.push(svg("text", { x: 0, y: y + 10, class: "name" }, one.label));
    y += 14;
    for (const [c, [name, what]] of columns.entries()) {
      const number = one.estimates.get(name);
      const value = number?.value ?? 0;
      const width = Math.max(value ? 1 : 0, (room * value) / greatest);
      const colour = LINES[k % LINES.length][0];
      parts.push(svg("rect", { x: 0, y, width, height: BAR - 2, fill: c ? "none" : colour, stroke: colour, "stroke-width": c ? 1.5 : 0, "stroke-dasharray": c ? "3 2" : null }));
      let after = Math.min(width, room);
      if (number && number.low !== null && number.high !== null) {
        const [from, to] = [number.low, number.high].map((v) => Math.min(room, (room * Math.max(v, 0)) / greatest));
        after = Math.max(after, to);
        parts.push(svg("path", { class: "whisker", d: `M${from} ${y + 5.5}H${to}M${from} ${y + 2.5}v6M${to} ${y + 2.5}v6` }));
      }
      parts.push(svg("text", { x: after + 4, y: y + 9, class: "value" }, number ? formatted(value) : "–"));
      words.push(`${one.label}: ${what} ${number ? formatted(value) : "none"}`);
      y += BAR;
    }
    y += 4;
  }
  const legend = columns.length > 1 ? el("p", { class: "hint" }, `filled: ${columns[0][1]}; outlined: ${columns[1][1]}`) : null;
  return el("figure", { class: "bars" }, el("figcaption", null, title),
    svg("svg", { viewBox: `0 0 ${WIDE} ${y}`, role: "img", "aria-label": `${title}. ${words.join(". ")}.` }, ...parts), legend);
}
