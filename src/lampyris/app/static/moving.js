// Moving: what is drawn anew in each frame: obstacles, robots, the brush and the cursor.

import { KINDS, LINES, OTHER_KIND, ROBOT } from "./colours.js";
import { kindMark, robotMark } from "./marks.js";
import { penOf } from "./cells.js";

/** @typedef {import("./view.js").View} View */
/** @typedef {CanvasRenderingContext2D} Pen */

const FAINT = 0.45;

/**
 * What moves, at one moment. Places in cells, whole or between two. `still`: bodies that wait for a run to begin, faint.
 * @typedef {{
 *   robot: [number, number] | null, bodies: Float32Array | null, kinds: string[], radii: number[],
 *   trail: import("./ways.js").Way | null, still?: Float32Array | null, others?: Array<{robot: [number, number], line: number}>,
 * }} Moment
 */

/** @param {Pen} pen @param {View} view @param {Moment} moment @param {number} robotRadius cells @param {Sprites} sprites */
export function drawMoment(pen, view, moment, robotRadius, sprites) {
  if (moment.bodies) {
    pen.globalAlpha = moment.bodies === moment.still ? FAINT : 1;
    drawBodies(pen, view, moment, moment.bodies, sprites);
    pen.globalAlpha = 1;
  }
  const r = Math.max(6, view.scale * 0.42);
  for (const other of moment.others ?? []) {
    robotMark(pen, ...view.pixel(other.robot[0], other.robot[1]), r, LINES[other.line % LINES.length][0]);
  }
  if (!moment.robot) return;
  const [x, y] = view.pixel(moment.robot[0], moment.robot[1]);
  if (robotRadius * view.scale > 8) disc(pen, x, y, robotRadius * view.scale, ROBOT);
  robotMark(pen, x, y, r, ROBOT);
}

/** @param {Pen} pen @param {View} view @param {Moment} moment @param {Float32Array} bodies @param {Sprites} sprites */
function drawBodies(pen, view, moment, bodies, sprites) {
  const side = Math.max(12, Math.min(view.scale * 0.95, 40));
  for (let b = 0; b < moment.kinds.length; b++) {
    const cx = bodies[2 * b];
    if (Number.isNaN(cx)) continue;
    const x = view.x + (cx + 0.5) * view.scale;
    const y = view.y + (bodies[2 * b + 1] + 0.5) * view.scale;
    if (x < -side || y < -side || x > view.width + side || y > view.height + side) continue;
    const radius = moment.radii[b] * view.scale;
    if (radius > side / 2) disc(pen, x, y, radius, (KINDS[moment.kinds[b]] ?? OTHER_KIND)[1]);
    pen.drawImage(sprites.of(moment.kinds[b], side), x - side / 2, y - side / 2, side, side);
  }
}

/** @param {Pen} pen @param {number} x @param {number} y @param {number} radius @param {string} colour */
function disc(pen, x, y, radius, colour) {
  const whole = pen.globalAlpha;
  pen.globalAlpha = 0.2 * whole;
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
  pen.globalAlpha = whole;
}

/** The brush under the pointer. @param {Pen} pen @param {View} view @param {{at: Cell, size: number}} brush */
export function drawBrush(pen, view, { at, size }) {
  const low = -Math.floor((size - 1) / 2);
  const s = Math.max(size * view.scale, 4);
  pen.strokeStyle = "#fff";
  pen.lineWidth = 3;
  pen.strokeRect(view.x + (at[0] + low) * view.scale, view.y + (at[1] + low) * view.scale, s, s);
  pen.strokeStyle = "#20242c";
  pen.lineWidth = 1;
  pen.strokeRect(view.x + (at[0] + low) * view.scale, view.y + (at[1] + low) * view.scale, s, s);
}

/** The cell that keys act on. @param {Pen} pen @param {View} view @param {Cell} cell */
export function drawCursor(pen, view, [cx, cy]) {
  pen.strokeStyle = ROBOT;
  pen.lineWidth = 2;
  const s = Math.max(view.scale, 6);
  const [x, y] = view.pixel(cx, cy);
  pen.strokeRect(x - s / 2, y - s / 2, s, s);
}

/** Pictures of the kinds of obstacles, each drawn once a size. */
export class Sprites {
  constructor() {
    this.dark = false;
    this.ratio = 1;
    /** @type {Map<string, HTMLCanvasElement>} */
    this._made = new Map();
  }

  clear() {
    this._made.clear();
  }

  /** @param {string} kind @param {number} side */
  of(kind, side) {
    const pixels = Math.ceil(side * this.ratio);
    const key = `${kind} ${pixels}`;
    const known = this._made.get(key);
    if (known) return known;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = pixels;
    kindMark(penOf(canvas), KINDS[kind] ?? OTHER_KIND, pixels, this.dark, side);
    this._made.set(key, canvas);
    return canvas;
  }
}
