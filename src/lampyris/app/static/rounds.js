// Rounds: where the planner `pad` searched with headings, round by round: spheres, tunnel, planned and tracking path.

import { el } from "./make.js";
import { drawLine } from "./marks.js";
import { THEMES } from "./colours.js";

/** As the server sends it. @typedef {{
 *   spheres: Array<{cell: Cell, radius_cells: number}>, tunnel_cells: number, planned_cells: Cell[], tracked_cells: Cell[],
 *   planned_m: number | null, tracked_m: number | null, lower_bound_m: number,
 *   low_expansions: number, high_expansions: number, tracking_expansions: number,
 * }} Round */

/** Colours of pictures: see lampyris.report.pictures.regions. */
const [SPHERE, TUNNEL] = ["#117733", "#44aa99"];
/** On light and on dark ground. */
const PLANNED = ["#332288", "#b9a6ff"];

/** @param {CanvasRenderingContext2D} pen @param {import("./view.js").View} view @param {{width: number, height: number}} ground @param {Round} round @param {boolean} dark */
function drawRound(pen, view, ground, round, dark) {
  const planned = round.planned_cells.flat();
  pen.save();
  pen.beginPath();
  pen.rect(view.x, view.y, ground.width * view.scale, ground.height * view.scale);
  pen.clip();
  pen.lineCap = pen.lineJoin = "round";
  if (planned.length) {
    pen.globalAlpha = 0.3;
    pen.strokeStyle = TUNNEL;
    pen.lineWidth = (2 * round.tunnel_cells + 1) * view.scale;
    drawLine(pen, view, planned, 0, planned.length / 2 - 1);
  }
  for (const { cell, radius_cells: radius } of round.spheres) {
    const [x, y] = view.pixel(cell[0], cell[1]);
    pen.beginPath();
    pen.arc(x, y, (radius + 0.5) * view.scale, 0, 2 * Math.PI);
    pen.globalAlpha = 0.2;
    pen.fillStyle = SPHERE;
    pen.fill();
    pen.globalAlpha = 1;
    pen.strokeStyle = SPHERE;
    pen.lineWidth = 1.3;
    pen.stroke();
  }
  pen.globalAlpha = 1;
  for (const [cells, colour, dash] of /** @type {Array<[Cell[], string, number[]]>} */ ([
    [round.planned_cells, PLANNED[Number(dark)], [6, 4]], [round.tracked_cells, THEMES[dark ? "dark" : "light"].ink, [2, 3]],
  ])) {
    if (!cells.length) continue;
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    pen.setLineDash(dash);
    drawLine(pen, view, cells.flat(), 0, cells.length - 1);
    pen.setLineDash([]);
  }
  pen.restore();
}

/** What a round did, in words. @param {Round} round @param {number} k @param {number} of */
function words(round, k, of) {
  const metres = (/** @type {number | null} */ v) => (v === null ? "none" : `${v.toFixed(2)} m`);
  const count = (/** @type {number} */ n) => n.toLocaleString("en");
  const n = round.spheres.length;
  return `Round ${k + 1} of ${of}: ${n === 1 ? "1 sphere" : `${n} spheres`}. Planned path (dashed): ${metres(round.planned_m)}, ${count(round.low_expansions)} cells and ${count(round.high_expansions)} poses expanded. `
    + `Tracking path (dotted): ${metres(round.tracked_m)}, ${count(round.tracking_expansions)} poses. No path costs less than ${metres(round.lower_bound_m)}.`;
}

/** The choice of rounds below the layers, from a plan that has some on. @param {Page} page @param {HTMLElement} element @param {Plan | null} first */
export function askRounds(page, element, first) {
  const on = el("input", { type: "checkbox", onchange: () => show() });
  const which = el("input", { type: "range", min: 1, max: 1, value: 1, "aria-label": "Round", oninput: () => show() });
  const about = el("p", { class: "hint", "aria-live": "polite" });
  const more = el("div", { hidden: true }, el("label", { class: "ly-order" }, el("span", { class: "hint" }, "Round"), which), about);
  const root = el("div", { hidden: true },
    el("label", { class: "ly-gates" }, on, el("span", {}, "Rounds of pad", el("span", { class: "hint" }, ": where headings were searched"))), more);
  element.append(root);
  /** @type {Round[]} */
  let rounds = [];
  /** The one that is drawn. @type {Round | null} */
  let shown = null;
  const show = () => {
    const k = Math.min(Number(which.value), rounds.length) - 1;
    const { map } = page;
    const round = on.checked && k >= 0 ? rounds[k] : null;
    map.round = round && ((pen, view, ground, dark) => drawRound(pen, view, ground, round, dark));
    more.hidden = !round;
    about.textContent = round ? words(round, k, rounds.length) : "";
    if (round !== shown) map.refresh();
    shown = round;
  };
  const renew = (/** @type {Plan | null} */ plan) => {
    rounds = plan?.rounds ?? [];
    root.hidden = !rounds.length;
    which.max = String(Math.max(rounds.length, 1));
    which.value = which.max;
    which.disabled = rounds.length < 2;
    show();
  };
  page.on("plan", renew);
  renew(first);
}
