// Nodes: the table of every node of the planned path: obstacles around it, its angle, and the velocity that each allows.

import { brief } from "./charts.js";
import { el } from "./make.js";

/** Rows that are drawn; longer tables are in the CSV and JSON files of `lampyris plan`. */
const ROWS = 500;
const HEAD = ["node", "cell", "ring 1", "ring 2", "by obstacles", "angle", "by angle", "speed", "limited by"];

/** @typedef {{ring1: number[], ring2: number[], obstacle_velocity: number[], angle_deg: Array<number | null>, angle_velocity: Array<number | null>}} Nodes */

/** What stands around a node and how the path bends there: name, value. @param {any} plan @param {number} k @returns {Array<[string, string]>} */
export function nodeFacts(plan, k) {
  const nodes = /** @type {Nodes | undefined} */ (plan.nodes);
  if (!nodes || k >= nodes.ring1.length) return [];
  const angle = nodes.angle_deg[k];
  /** @type {Array<[string, string]>} */
  const rows = [["Obstacles around", `${nodes.ring1[k]} in ring 1, ${nodes.ring2[k]} in ring 2`]];
  if (angle !== null) rows.push(["Angle", `${brief(angle)}\u00b0`]);
  return rows;
}

/** The table as a part that opens and closes. @param {Page} page */
export function nodesPart(page) {
  const body = el("div", { class: "wide", tabindex: 0, role: "group", "aria-label": "Nodes of the path" });
  const part = /** @type {HTMLDetailsElement} */ (el("details", { class: "more", hidden: true }, el("summary", {}, "Every node of the path"), body));
  /** The plan whose table is drawn. @type {any} */
  let drawn = null;
  const draw = () => {
    const { plan } = page;
    part.hidden = !(/** @type {any} */ (plan)?.nodes) || Boolean(page.run?.ticks);
    if (part.hidden || !part.open || plan === drawn) return;
    drawn = plan;
    body.replaceChildren(...table(plan));
  };
  part.addEventListener("toggle", draw);
  for (const name of ["plan", "run", "ticks", "ground"]) page.on(name, draw);
  return part;
}

/** @param {any} plan @returns {HTMLElement[]} */
function table(plan) {
  const nodes = /** @type {Nodes} */ (plan.nodes);
  const n = nodes.ring1.length;
  // Laws with nodes of their own (curves, waits) have speeds elsewhere than at the cells.
  const speed = plan.speed?.v?.length === n && !plan.speed.xy ? plan.speed : null;
  const cell = (/** @type {string | number} */ text) => el("td", null, String(text));
  const number = (/** @type {number | null} */ v) => cell(v === null ? "\u2013" : brief(v));
  const rows = Array.from({ length: Math.min(n, ROWS) }, (_, k) => el("tr", null,
    el("th", { scope: "row" }, String(k)), cell(`(${plan.cells[2 * k]}, ${plan.cells[2 * k + 1]})`), cell(nodes.ring1[k]), cell(nodes.ring2[k]), number(nodes.obstacle_velocity[k]),
    number(nodes.angle_deg[k]), number(nodes.angle_velocity[k]), number(speed ? speed.v[k] : null), cell(speed ? speed.why?.[k] ?? speed.cause[k] : "\u2013")));
  const shown = n > ROWS ? ` The first ${ROWS} of ${n} nodes; all are in the CSV file of the command plan.` : "";
  return [
    el("p", { class: "hint" }, `As Tables 4.12 to 4.17 of the dissertation have them: velocities by obstacles and by angle in its units; the speed by the law that is chosen${speed ? `, ${plan.speed.units}` : ""}.${shown}`),
    el("table", { class: "data" }, el("caption", { class: "unseen" }, "Every node of the path"),
      el("thead", null, el("tr", null, ...HEAD.map((word) => el("th", { scope: "col" }, word)))), el("tbody", null, ...rows)),
  ];
}
