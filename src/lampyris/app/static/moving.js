// Moving: what is drawn anew in each frame: obstacles, robots, the brush and the cursor.

import { KINDS, LINES, OTHER_KIND, ROBOT } from "./colours.js";
import { kindMark, robotMark } from "./marks.js";
import { penOf } from "./cells.js";
import { traceOutline } from "./shape.js";

/** @typedef {import("./view.js").View} View */
/** @typedef {CanvasRenderingContext2D} Pen */

const FAINT = 0.45;

/**
 * What moves, at one moment. Places in cells, whole or between two. `still`: bodies that wait for a run to begin, faint.
 * `seen`: what a robot with a sensor has seen; `goal`: where a goal that moves is.
 * `heading`: of the robot of a drive, radians counterclockwise on the screen; `outlines`, `headings`: of the bodies, null for a disc.
 * @typedef {{
 *   robot: [number, number] | null, bodies: Float32Array | null, kinds: string[], radii: number[],
 *   outlines?: Array<import("./shape.js").Outline | null>, headings?: number[],
 *   trail: import("./marks.js").Way | null, still?: Float32Array | null, others?: Array<{robot: [number, number], line: number, heading?: number}>, heading?: number,
 *   seen?: import("./cells.js").Seen | null, goal?: [number, number] | null,
 * }} Moment
 */

/** @param {Pen} pen @param {View} view @param {Moment} moment @param {number} robotRadius cells @param {Sprites} sprites @param {import("./shape.js").Outline | null} outline the robot's footprint; null: a disc @param {number} [around] radius of the disc around it that its planner plans for, cells */
export function drawMoment(pen, view, moment, robotRadius, sprites, outline, around = 0) {
  if (moment.bodies) {
    pen.globalAlpha = moment.bodies === moment.still ? FAINT : 1;
    drawBodies(pen, view, moment, moment.bodies, sprites);
    pen.globalAlpha = 1;
  }
  const r = Math.max(6, view.scale * 0.42);
  for (const other of moment.others ?? []) {
    const colour = LINES[other.line % LINES.length][0];
    if (other.heading === undefined) robotMark(pen, ...view.pixel(other.robot[0], other.robot[1]), r, colour);
    else drawRobot(pen, view, other.robot, other.heading, robotRadius, outline, colour);
  }
  if (!moment.robot) return;
  if (moment.heading !== undefined) {
    if (around) disc(pen, ...view.pixel(moment.robot[0], moment.robot[1]), around * view.scale, ROBOT);
    drawRobot(pen, view, moment.robot, moment.heading, robotRadius, outline, ROBOT);
    return;
  }
  const [x, y] = view.pixel(moment.robot[0], moment.robot[1]);
  if (robotRadius * view.scale > 8) disc(pen, x, y, robotRadius * view.scale, ROBOT);
  robotMark(pen, x, y, r, ROBOT);
}

/** Sides of the least robot that is seen, pixels. */
const SEEN = 7;

/**
 * A robot to scale at its heading, with an arrow ahead. Where it would be too small to be seen, a mark with the arrow.
 * @param {Pen} pen @param {View} view @param {[number, number]} at @param {number} heading @param {number} radius cells
 * @param {import("./shape.js").Outline | null} outline @param {string} colour
 */
function drawRobot(pen, view, at, heading, radius, outline, colour) {
  const [x, y] = view.pixel(at[0], at[1]);
  const nose = Math.max(SEEN, view.scale * (outline ? Math.max(...outline.map(([ahead]) => ahead)) : radius));
  const wide = view.scale * (outline ? Math.max(...outline.map(([, left]) => Math.abs(left))) : radius);
  pen.lineJoin = "round";
  pen.fillStyle = colour;
  if (outline && wide > 2) traceOutline(pen, view, outline, at[0], at[1], heading);
  else {
    pen.beginPath();
    pen.arc(x, y, Math.max(SEEN, radius * view.scale), 0, 2 * Math.PI);
  }
  pen.strokeStyle = "#fff";
  pen.lineWidth = 3.5;
  pen.stroke();
  pen.strokeStyle = "#20242c";
  pen.lineWidth = 1.5;
  pen.fill();
  pen.stroke();
  // An arrow at its front.
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  const half = Math.min(0.6 * Math.max(wide, SEEN), 0.5 * nose);
  const back = Math.max(0.2 * nose, 0.85 * nose - 1.6 * half);
  pen.fillStyle = "#fff";
  pen.beginPath();
  for (const [ahead, left] of [[0.85 * nose, 0], [back, half], [back, -half]]) pen.lineTo(x + ahead * cos - left * sin, y - ahead * sin - left * cos);
  pen.fill();
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
    const colour = (KINDS[moment.kinds[b]] ?? OTHER_KIND)[1];
    const outline = moment.outlines?.[b];
    if (outline) polygon(pen, view, outline, cx, bodies[2 * b + 1], moment.headings?.[b] ?? 0, colour);
    else if (radius > side / 2) disc(pen, x, y, radius, colour);
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

/** An obstacle to scale. @param {Pen} pen @param {View} view @param {import("./shape.js").Outline} outline @param {number} cx @param {number} cy @param {number} heading @param {string} colour */
function polygon(pen, view, outline, cx, cy, heading, colour) {
  const whole = pen.globalAlpha;
  traceOutline(pen, view, outline, cx, cy, heading);
  pen.globalAlpha = 0.3 * whole;
  pen.fillStyle = colour;
  pen.fill();
  pen.globalAlpha = whole;
  pen.strokeStyle = colour;
  pen.lineWidth = 1.5;
  pen.stroke();
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
