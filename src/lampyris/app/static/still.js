// Still: what stands on the ground and changes seldom: lines between cells, gates, marks, patrols.

import { GATE, KINDS, THEMES } from "./colours.js";
import { drawLine } from "./ways.js";

/** @typedef {import("./types.js").Cell} Cell */
/** @typedef {import("./view.js").View} View */
/** @typedef {CanvasRenderingContext2D} Pen */
/** A cell that is pointed out. @typedef {{at: Cell, text?: string, colour: string, fill?: number, ring?: boolean}} Mark */
/** Waypoints of a patrol; a draft is still being drawn. @typedef {{cells: Cell[], draft: boolean}} Patrol */

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

/** Crosses, all in one stroke: scattered maps have tens of thousands. @param {Pen} pen @param {View} view @param {Cell[]} gates */
export function drawGates(pen, view, gates) {
  const half = Math.max(3, view.scale * 0.4);
  pen.beginPath();
  for (const [cx, cy] of gates) {
    const x = view.x + (cx + 0.5) * view.scale;
    const y = view.y + (cy + 0.5) * view.scale;
    if (x < -half || y < -half || x > view.width + half || y > view.height + half) continue;
    pen.moveTo(x - half, y - half);
    pen.lineTo(x + half, y + half);
    pen.moveTo(x + half, y - half);
    pen.lineTo(x - half, y + half);
  }
  const wide = Math.max(1.5, view.scale * 0.12);
  pen.strokeStyle = "#fff";
  pen.lineWidth = wide + 1.5;
  pen.stroke();
  pen.strokeStyle = GATE;
  pen.lineWidth = wide;
  pen.stroke();
}

/** @param {Pen} pen @param {View} view @param {Patrol} patrol */
export function drawPatrol(pen, view, { cells, draft }) {
  const [, colour] = KINDS.patrol;
  pen.strokeStyle = colour;
  pen.lineWidth = 2;
  pen.setLineDash([5, 5]);
  drawLine(pen, view, cells.flat(), 0, cells.length - 1);
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
    pen.fillStyle = THEMES[dark ? "dark" : "light"].ink;
    pen.font = `${Math.round(Math.min(14, scale * 0.32))}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(mark.text, x, y, scale - 2);
  }
}
