// Still: what stands on the ground and changes seldom: lines between cells, gates, marks, patrols.

import { GATE, KINDS, THEMES } from "./colours.js";
import { drawLine, gateMarks } from "./marks.js";

/** @typedef {import("./view.js").View} View */
/** @typedef {CanvasRenderingContext2D} Pen */
/** A cell that is pointed out. @typedef {{at: Cell, text?: string, colour: string, fill?: number, ring?: boolean}} Mark */
/** Waypoints of a patrol, and the lines it takes between them; a draft is still being drawn. @typedef {{cells: Cell[], draft: boolean, lines: Cell[][]}} Patrol */
/** A gate: on the path, a dead end, or neither. @typedef {{at: Cell, look: "path" | "gate" | "end"}} Gate */

/** Lines between cells. @param {Pen} pen @param {View} view @param {{width: number, height: number}} ground @param {string} colour */
export function drawLines(pen, view, ground, colour) {
  pen.strokeStyle = colour;
  pen.globalAlpha = 0.5;
  pen.lineWidth = 1;
  pen.beginPath();
  for (let x = 1; x < ground.width; x++) {
    const px = Math.round(view.x + x * view.scale) + 0.5;
    if (px < 0 || px > view.width) continue;
    pen.moveTo(px, Math.max(0, view.y));
    pen.lineTo(px, Math.min(view.height, view.y + ground.height * view.scale));
  }
  for (let y = 1; y < ground.height; y++) {
    const py = Math.round(view.y + y * view.scale) + 0.5;
    if (py < 0 || py > view.height) continue;
    pen.moveTo(Math.max(0, view.x), py);
    pen.lineTo(Math.min(view.width, view.x + ground.width * view.scale), py);
  }
  pen.stroke();
  pen.globalAlpha = 1;
}

/** @param {Pen} pen @param {View} view @param {Gate[]} gates */
export function drawGates(pen, view, gates) {
  const r = Math.max(3.5, Math.min(view.scale * 0.38, 13));
  // Those on the path lie over the others.
  for (const look of /** @type {const} */ (["end", "gate", "path"])) {
    /** @type {Array<[number, number]>} */
    const there = [];
    for (const gate of gates) {
      if (gate.look !== look) continue;
      const [x, y] = view.pixel(gate.at[0], gate.at[1]);
      if (x > -r && y > -r && x < view.width + r && y < view.height + r) there.push([x, y]);
    }
    if (there.length) gateMarks(pen, there, r, look, GATE);
  }
}

/** @param {Pen} pen @param {View} view @param {Patrol} patrol */
export function drawPatrol(pen, view, { cells, draft, lines }) {
  const [, colour] = KINDS.patrol;
  pen.strokeStyle = colour;
  pen.lineWidth = 2;
  pen.setLineDash([5, 5]);
  for (const line of lines) drawLine(pen, view, line.flat(), 0, line.length - 1);
  pen.setLineDash([]);
  const half = Math.max(4, Math.min(view.scale * 0.36, 11));
  cells.forEach((cell, k) => {
    const [x, y] = view.pixel(cell[0], cell[1]);
    pen.fillStyle = draft ? "#fff" : colour;
    pen.strokeStyle = draft ? colour : "#fff";
    pen.fillRect(x - half, y - half, 2 * half, 2 * half);
    pen.strokeRect(x - half, y - half, 2 * half, 2 * half);
    if (half < 7) return;
    pen.fillStyle = draft ? "#20242c" : "#fff";
    pen.font = `bold ${Math.round(half * 1.2)}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(String(k + 1), x, y + 0.5);
  });
}

/** @param {Pen} pen @param {View} view @param {Mark} mark @param {boolean} dark */
export function drawMark(pen, view, mark, dark) {
  const { scale } = view;
  const [x, y] = view.pixel(mark.at[0], mark.at[1]);
  pen.globalAlpha = mark.fill ?? 0.45;
  pen.fillStyle = mark.colour;
  pen.fillRect(x - scale / 2, y - scale / 2, scale, scale);
  pen.globalAlpha = 1;
  if (mark.ring) {
    pen.strokeStyle = mark.colour;
    pen.lineWidth = 3;
    pen.strokeRect(x - scale / 2 + 1.5, y - scale / 2 + 1.5, scale - 3, scale - 3);
  }
  if (mark.text && scale >= 22) {
    const { ink, paper } = THEMES[dark ? "dark" : "light"];
    pen.fillStyle = ink;
    pen.font = `${Math.round(Math.min(14, scale * 0.32))}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    // A line may cross it.
    pen.strokeStyle = paper;
    pen.lineWidth = 3;
    pen.lineJoin = "round";
    pen.globalAlpha = 0.75;
    pen.strokeText(mark.text, x, y, scale - 2);
    pen.globalAlpha = 1;
    pen.fillText(mark.text, x, y, scale - 2);
  }
}
