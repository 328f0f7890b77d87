// Marks: the shapes of start, goal, robot and obstacles, on the map and in its legend. Each has a shape of its own, so
// that none is known by its colour alone: square, flag, ringed disc with a light middle; plain disc, square, triangle,
// diamond; gates are diamonds without a letter, hollow but for those on the path. Lines of cells with a casing, coloured
// by speed; and the trail behind the robot, which grows with each frame.

import { ROBOT, speedColour, THEMES } from "./colours.js";

/** @typedef {CanvasRenderingContext2D} Pen */

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function robotMark(pen, x, y, r, colour) {
  pen.fillStyle = colour;
  pen.strokeStyle = "#fff";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.arc(x, y, r, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
  pen.fillStyle = "#fff";
  pen.beginPath();
  pen.arc(x, y, r * 0.36, 0, 2 * Math.PI);
  pen.fill();
}

/** A square with an S. @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function startMark(pen, x, y, r, colour) {
  pen.fillStyle = colour;
  pen.strokeStyle = "#fff";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.rect(x - r * 0.85, y - r * 0.85, r * 1.7, r * 1.7);
  pen.fill();
  pen.stroke();
  pen.fillStyle = "#20242c";
  pen.font = `bold ${Math.round(r * 1.2)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText("S", x, y + 0.5);
}

/** A flag that stands on the cell. @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function goalMark(pen, x, y, r, colour) {
  pen.lineJoin = "round";
  for (const [edge, more] of /** @type {Array<[string, number]>} */ ([["#fff", 3.5], ["#20242c", 0]])) {
    pen.strokeStyle = pen.fillStyle = edge;
    pen.lineWidth = Math.max(1.8, r * 0.2) + more;
    pen.beginPath();
    pen.moveTo(x - r * 0.55, y + r);
    pen.lineTo(x - r * 0.55, y - r * 1.15);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(x - r * 0.55, y - r * 1.15);
    pen.lineTo(x + r * 0.95, y - r * 0.5);
    pen.lineTo(x - r * 0.55, y + r * 0.2);
    pen.closePath();
    if (more) pen.stroke();
    pen.fillStyle = more ? edge : colour;
    pen.fill();
  }
}

/** The outline of a gate. @param {Pen} pen @param {number} x @param {number} y @param {number} r */
export function gateOutline(pen, x, y, r) {
  pen.moveTo(x, y - r);
  pen.lineTo(x + r, y);
  pen.lineTo(x, y + r);
  pen.lineTo(x - r, y);
  pen.closePath();
}

/**
 * Gates as in pictures: diamonds, full on the path, hollow elsewhere, crossed out in dead ends. All in one stroke:
 * scattered maps have tens of thousands.
 * @param {Pen} pen @param {Array<[number, number]>} at pixels @param {number} r @param {"path" | "gate" | "end"} look @param {string} colour
 */
export function gateMarks(pen, at, r, look, colour) {
  pen.beginPath();
  for (const [x, y] of at) {
    gateOutline(pen, x, y, r);
    if (look !== "end") continue;
    const c = r * 0.42;
    pen.moveTo(x - c, y - c);
    pen.lineTo(x + c, y + c);
    pen.moveTo(x + c, y - c);
    pen.lineTo(x - c, y + c);
  }
  const wide = Math.max(1.4, r * 0.26);
  pen.lineJoin = "miter";
  pen.strokeStyle = "#fff";
  pen.lineWidth = wide + 1.6;
  pen.stroke();
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = wide;
  if (look === "path") pen.fill();
  pen.stroke();
}

/** An obstacle of a kind, filling a square of that side from the origin. @param {Pen} pen @param {[string, string, string]} look shape, colour, letter @param {number} side @param {boolean} dark @param {number} [seen] side on the screen, if it is another */
export function kindMark(pen, [shape, colour, letter], side, dark, seen = side) {
  const mid = side / 2;
  const r = mid - Math.max(1, side * 0.05);
  pen.fillStyle = colour;
  // An outline that differs from that of walls; small ones have little of it, so that their colour is seen.
  pen.strokeStyle = dark ? "#f4f6fa" : "#20242c";
  pen.lineWidth = Math.max(0.8, side * 0.06);
  pen.beginPath();
  if (shape === "circle") pen.arc(mid, mid, r * 0.88, 0, 2 * Math.PI);
  else if (shape === "square") pen.rect(mid - r * 0.8, mid - r * 0.8, r * 1.6, r * 1.6);
  else polygon(pen, mid, shape === "triangle" ? mid + r * 0.22 : mid, r * (shape === "triangle" ? 1.16 : 1), shape === "triangle" ? 3 : 4);
  pen.fill();
  pen.stroke();
  if (seen < 15) return;
  pen.fillStyle = "#fff";
  pen.font = `bold ${Math.round(side * 0.45)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(letter, mid, mid + (shape === "triangle" ? side * 0.1 : side * 0.03));
}

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {number} corners */
function polygon(pen, x, y, r, corners) {
  for (let k = 0; k < corners; k++) {
    const t = (2 * Math.PI * k) / corners - Math.PI / 2;
    if (k) pen.lineTo(x + r * Math.cos(t), y + r * Math.sin(t));
    else pen.moveTo(x + r * Math.cos(t), y + r * Math.sin(t));
  }
  pen.closePath();
}

// ---- lines ----

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
