// Ways: lines of cells with a casing, coloured by speed; and the trail, the way behind the robot, which grows with each frame.

import { ROBOT, THEMES, speedColour } from "./colours.js";

/** @typedef {CanvasRenderingContext2D} Pen */
/** @typedef {import("./view.js").View} View */

/**
 * A way on the map: nodes in cells, a colour or a value 0 to 1 for each, a dash.
 * `count`: only so many of the nodes; `faint`: something else matters more now; `version`: another one means that the
 * arrays hold another way.
 * @typedef {{cells: ArrayLike<number>, shares?: ArrayLike<number> | null, colour?: string, dash?: number[], wide?: number,
 *   count?: number, faint?: boolean, version?: number}} Way
 */

/** The ground it is drawn on: dark or light, and whether a layer lies on it. @typedef {{dark: boolean, layered: boolean}} On */

/** @param {Way} way @param {View} view */
function widthOf(way, view) {
  return way.wide ?? Math.min(Math.max(2.5, view.scale * 0.28), 9);
}

/** @param {Pen} pen @param {View} view @param {ArrayLike<number>} cells @param {number} from @param {number} to */
export function drawLine(pen, view, cells, from, to) {
  pen.beginPath();
  for (let k = from; k <= to; k++) {
    const x = view.x + (cells[2 * k] + 0.5) * view.scale;
    const y = view.y + (cells[2 * k + 1] + 0.5) * view.scale;
    if (k === from) pen.moveTo(x, y);
    else pen.lineTo(x, y);
  }
  pen.stroke();
}

/** @param {Pen} pen @param {View} view @param {Way} way @param {On} on */
export function drawWay(pen, view, way, on) {
  const last = (way.count ?? way.cells.length / 2) - 1;
  if (last < 1) return;
  const wide = widthOf(way, view);
  if (way.faint) {
    pen.lineCap = pen.lineJoin = "round";
    pen.globalAlpha = 0.6;
    pen.strokeStyle = THEMES[on.dark ? "dark" : "light"].ink;
    pen.lineWidth = Math.max(1.5, wide * 0.3);
    pen.setLineDash([6, 6]);
    drawLine(pen, view, way.cells, 0, last);
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    return;
  }
  casing(pen, view, way, 0, last, on);
  if (way.dash?.length) {
    pen.strokeStyle = "#fff";
    pen.lineWidth = wide;
    drawLine(pen, view, way.cells, 0, last);
    pen.setLineDash(way.dash);
  }
  colours(pen, view, way, 0, last);
  pen.setLineDash([]);
}

/** A casing first, so that the way is seen on any ground. @param {Pen} pen @param {View} view @param {Way} way @param {number} from @param {number} to @param {On} on */
function casing(pen, view, way, from, to, on) {
  pen.lineCap = pen.lineJoin = "round";
  // Slow and dark stretches would drown in dark ground; bright layers need the dark casing all the same.
  pen.strokeStyle = on.dark ? (on.layered ? "#000" : "#f4f5f7") : THEMES.light.ink;
  pen.lineWidth = widthOf(way, view) + 2;
  drawLine(pen, view, way.cells, from, to);
}

/** @param {Pen} pen @param {View} view @param {Way} way @param {number} from @param {number} to */
function colours(pen, view, way, from, to) {
  pen.lineWidth = widthOf(way, view);
  if (!way.shares) {
    pen.strokeStyle = way.colour ?? ROBOT;
    drawLine(pen, view, way.cells, from, to);
    return;
  }
  // Stretches of nearly one speed are one line.
  while (from < to) {
    const share = (way.shares[from] + way.shares[from + 1]) / 2;
    let end = from + 1;
    while (end < to && Math.abs((way.shares[end] + way.shares[end + 1]) / 2 - share) < 0.02) end++;
    pen.strokeStyle = speedColour(share);
    drawLine(pen, view, way.cells, from, end);
    from = end;
  }
}

/** Nodes that become part of the base at a time. */
const STRETCH = 32;

/**
 * The trail. What has been driven stays, so stretches of it are drawn into the base once; a frame draws the rest.
 * The whole of it in each frame took 2.1 ms of 4.9 at 4,000 nodes, software-drawn. Always the same stretches: the
 * picture is the same whether one came there by playing or by a leap.
 */
export class Trail {
  constructor() {
    /** Nodes that are in the base. */
    this._done = 0;
    /** @type {ArrayLike<number> | null} */
    this._cells = null;
    this._version = 0;
  }

  /** Whether what is in the base is a part of this trail. @param {Way | null} way */
  holds(way) {
    return this._done === 0 || (way !== null && way.cells === this._cells && (way.version ?? 0) === this._version && this._sure(way) >= this._done);
  }

  /** The base is a new one. */
  forget() {
    this._done = 0;
  }

  /** Nodes in whole stretches; the last one, where the robot is, may still move. @param {Way} way */
  _sure(way) {
    return STRETCH * Math.floor(Math.max(0, (way.count ?? way.cells.length / 2) - 2) / STRETCH);
  }

  /** What is sure, into the base. @param {Pen} pen @param {View} view @param {Way} way @param {On} on */
  settle(pen, view, way, on) {
    const sure = this._sure(way);
    for (let k = this._done; k < sure; k += STRETCH) stretch(pen, view, way, k, k + STRETCH, on);
    this._done = sure;
    this._cells = way.cells;
    this._version = way.version ?? 0;
  }

  /** The rest. @param {Pen} pen @param {View} view @param {Way} way @param {On} on */
  draw(pen, view, way, on) {
    const last = (way.count ?? way.cells.length / 2) - 1;
    if (last > this._done) stretch(pen, view, way, this._done, last, on);
  }
}

/** A part of a way; the end of the part before is coloured again, as the casing covers it. @param {Pen} pen @param {View} view @param {Way} way @param {number} from @param {number} to @param {On} on */
function stretch(pen, view, way, from, to, on) {
  casing(pen, view, way, from, to, on);
  let back = from;
  let far = (widthOf(way, view) + 4) / view.scale;
  const { cells } = way;
  while (back > 0 && far > 0) {
    far -= Math.max(Math.abs(cells[2 * back] - cells[2 * back - 2]), Math.abs(cells[2 * back + 1] - cells[2 * back - 1]));
    back--;
  }
  colours(pen, view, way, back, to);
}
