// Race tile: one planner's map in a race. A frame draws what has been added since the last one, never the whole map:
// cells into an image of a pixel a cell, lines of trees and paths onto a second canvas, the robot onto a third.

import { GOAL, LINES, START, THEMES, packed } from "./colours.js";
import { el, formatted } from "./make.js";
import { goalMark, robotMark, startMark } from "./marks.js";
import { swatch } from "./measures.js";
import { radiusOf } from "./shape.js";

/**
 * What the server says of a planner, and the order in which it expands cells (or the lines of its tree).
 * @typedef {{k: number, label: string, planner: string, outcome: string, sentence: string, kind: string, steps: number, field: number, jumps: number[][],
 *   note: string, expansions: number, cost: number | null, gap: number | null, any_angle: boolean, ms: number, path: number[][],
 *   t: number[], yaw: number[], units: string, order: Uint32Array, lines: Float32Array}} Racer
 */

/** Shades of cells that were expanded earlier and later. */
const SHADES = 24;
/** Share of the planner's colour in the first and in the last of them; of a field before its rings; of rings, and of single jump points. */
const TINT = { first: 0.22, last: 0.62, field: 0.34, strong: 0.85 };
/** What is added to these on dark ground, which is as light as some of the colours are to somebody who sees no green. */
const DARK_TINT = 0.2;
/** How far the colours go to white there. */
const LIGHTER = 0.5;
/** Pixels of the mark of a robot at least. */
const ROBOT_SIZE = 5;
/** Pixels from its base to its farthest vertex below which the shape of a footprint cannot be seen. */
const SEEN = 9;

export class Tile {
  /** @param {Racer} racer @param {Ground} ground @param {boolean} dark @param {import("./shape.js").Outline | null} outline the robot's footprint, cells; null: a disc @param {number} radius of the disc, cells */
  constructor(racer, ground, dark, outline, radius) {
    this.outline = outline;
    this.radius = radius;
    this.racer = racer;
    this.ground = ground;
    this.dark = dark;
    const [colour, dash] = LINES[racer.k % LINES.length];
    this.colour = colour;
    this.dash = dash;
    this.room = 0;
    this.cells = el("canvas", { width: ground.width, height: ground.height });
    // Not there until something is drawn on it: a canvas that is clear is mixed with what is beneath in each frame all the same.
    this.lines = el("canvas", { hidden: true, "aria-hidden": "true" });
    this.marks = { start: el("canvas", { class: "race-robot", "aria-hidden": "true" }), goal: el("canvas", { class: "race-robot", "aria-hidden": "true" }) };
    // A canvas of its own that is moved: drawing into a large one would have all of it put on the screen again.
    this.robot = el("canvas", { class: "race-robot", hidden: true, "aria-hidden": "true" });
    this.map = el("div", { class: "race-map", role: "img", "aria-label": `${racer.label} on the map` }, this.cells, this.lines, this.marks.start, this.marks.goal, this.robot);
    this.state = el("b", null, "");
    this.count = el("span", null, "");
    const found = racer.cost !== null;
    const facts = [
      found && `${racer.any_angle ? "length" : "cost"} ${formatted(racer.cost)} cells`, found && racer.gap !== null && `gap ${formatted(100 * racer.gap, 1)} %`,
      racer.outcome !== "refused" && `${formatted(racer.ms, 2)} ms`, found && arrival(racer),
    ].filter(Boolean).join(" · ");
    this.root = el("figure", { class: "race-tile" },
      el("figcaption", null, el("div", { class: "row" }, swatch(racer.k), el("b", { class: "grow", title: racer.planner }, racer.label), this.state),
        el("div", { class: "race-facts" }, this.count, facts && ` · ${facts}`),
        !found || racer.kind === "none" ? el("div", { class: "race-facts" }, found ? racer.note : racer.sentence) : null),
      this.map);
    this._pen = /** @type {CanvasRenderingContext2D} */ (this.cells.getContext("2d", { willReadFrequently: true }));
    this.scale = 1;
    this._said = "";
    /** Steps that are drawn; of a path whether it is. */
    this.drawn = 0;
    this._pathed = false;
    this._leg = 0;
    this.setDark(dark);
  }

  /** @param {boolean} dark */
  setDark(dark) {
    this.dark = dark;
    const { ground, racer } = this;
    const theme = THEMES[dark ? "dark" : "light"];
    const tones = [packed(theme.free), packed(theme.wall), packed(theme.unknown)];
    this.base = new Uint32Array(ground.width * ground.height);
    for (let k = 0; k < this.base.length; k++) this.base[k] = tones[ground.cells[k]];
    // On dark ground the planner's colour is no brighter than the ground: so that it is told from it by lightness, too.
    const own = [1, 3, 5].map((k) => parseInt(this.colour.slice(k, k + 2), 16)).map((v) => (dark ? Math.round(v + LIGHTER * (255 - v)) : v));
    const mixed = (/** @type {number} */ share) => packed(/** @type {[number, number, number]} */ (theme.free.map((v, c) => Math.round(v + Math.min(1, share + (dark ? DARK_TINT : 0)) * (own[c] - v)))));
    this.branch = `rgb(${own})`;
    this.field = mixed(TINT.field);
    this.tones = Uint32Array.from({ length: SHADES }, (_, k) => mixed(TINT.first + ((TINT.last - TINT.first) * k) / (SHADES - 1)));
    if (racer.field || racer.kind === "jump points") this.tones.fill(mixed(TINT.strong));
    this.image = new ImageData(ground.width, ground.height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this._clear();
  }

  /** How large it is drawn: pixels of the page a cell, and of the tile. @param {number} scale @param {number} room */
  resize(scale, room) {
    this.scale = scale;
    this.room = room;
    this.root.style.width = `${room + 2}px`;
    const { width, height } = this.ground;
    const [w, h] = [Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale))];
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    for (const canvas of [this.cells, this.lines]) {
      canvas.style.width = `${w}px`;
      canvas.style.height = `${h}px`;
    }
    this.map.style.width = `${w}px`;
    this.map.style.height = `${h}px`;
    this.lines.width = w * ratio;
    this.lines.height = h * ratio;
    this.ratio = ratio;
    this._size = Math.max(ROBOT_SIZE, Math.max(this.radius, 0.4) * scale);
    const { outline } = this;
    const far = outline ? radiusOf(outline) * scale : 0;
    const shaped = outline && far >= SEEN;
    if (shaped) this._size = far;
    const side = 2 * Math.ceil(this._size + 2);
    this.robot.width = this.robot.height = side * ratio;
    this.robot.style.width = this.robot.style.height = `${side}px`;
    if (shaped) bodyMark(this._penOf(this.robot), side / 2, outline, scale, this.colour);
    else robotMark(this._penOf(this.robot), side / 2, side / 2, this._size, this.colour);
    this._turns = Boolean(shaped);
    this._clear();
  }

  /** Nothing is explored. */
  _clear() {
    this.pixels?.set(/** @type {Uint32Array} */ (this.base));
    if (this.image) this._pen.putImageData(this.image, 0, 0);
    this._penOf(this.lines).clearRect(0, 0, this.lines.width, this.lines.height);
    this.lines.hidden = true;
    this.drawn = 0;
    this._pathed = false;
    this.robot.hidden = true;
    this._leg = 0;
    this._ends();
  }

  /** A pen in pixels of the page. @param {HTMLCanvasElement} canvas */
  _penOf(canvas) {
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.setTransform(this.ratio ?? 1, 0, 0, this.ratio ?? 1, 0, 0);
    return pen;
  }

  /** Start and goal. */
  _ends() {
    const r = Math.min(Math.max(0.6 * this.scale, 6), 11);
    const half = Math.ceil(2.4 * r);
    for (const [name, cell] of /** @type {const} */ ([["start", this.start], ["goal", this.goal]])) {
      const mark = this.marks[name];
      mark.hidden = !cell;
      if (!cell) continue;
      mark.width = mark.height = 2 * half * (this.ratio ?? 1);
      mark.style.width = mark.style.height = `${2 * half}px`;
      const pen = this._penOf(mark);
      if (name === "start") startMark(pen, half, half, r, START);
      else goalMark(pen, half, half, r, GOAL);
      const [x, y] = this._at(cell[0], cell[1]);
      mark.style.transform = `translate(${(x - half).toFixed(1)}px, ${(y - half).toFixed(1)}px)`;
    }
  }

  /** @param {ArrayLike<number>} start @param {ArrayLike<number>} goal */
  setEnds(start, goal) {
    this.start = start;
    this.goal = goal;
    this._ends();
  }

  /** @param {number} x @param {number} y @returns {[number, number]} */
  _at(x, y) {
    return [(x + 0.5) * this.scale, (y + 0.5) * this.scale];
  }

  /**
   * A moment: so many steps explored, whether the search is over, and seconds driven; null: not yet.
   * @param {number} steps @param {boolean} over @param {number | null} driven
   */
  show(steps, over, driven) {
    const { racer } = this;
    const to = Math.min(Math.floor(steps), racer.steps);
    if (to < this.drawn || (this._pathed && !over)) this._clear();
    if (to > this.drawn) {
      if (racer.kind === "tree") this._branches(this.drawn, to);
      else this._expand(this.drawn, to);
      this._jump(this.drawn, to);
      this.drawn = to;
    }
    if (over && !this._pathed) this._path();
    this._drive(driven);
  }

  /** Cells from one step to another, into the image; only the part that has changed is put on the canvas. @param {number} from @param {number} to */
  _expand(from, to) {
    const { order, steps, field } = this.racer;
    const { width } = this.ground;
    const tones = /** @type {Uint32Array} */ (this.tones);
    const pixels = /** @type {Uint32Array} */ (this.pixels);
    let left = width;
    let right = -1;
    let top = this.ground.height;
    let bottom = -1;
    for (let k = from; k < to; k++) {
      const at = order[k];
      pixels[at] = k < field ? /** @type {number} */ (this.field) : this.ground.cells[at] ? pixels[at] : tones[Math.floor((k * SHADES) / steps)];
      const y = Math.floor(at / width);
      const x = at - y * width;
      if (x < left) left = x;
      if (x > right) right = x;
      if (y < top) top = y;
      if (y > bottom) bottom = y;
    }
    this._pen.putImageData(/** @type {ImageData} */ (this.image), 0, 0, left, top, right - left + 1, bottom - top + 1);
  }

  /** Lines of a tree. @param {number} from @param {number} to */
  _branches(from, to) {
    const pen = this._penOf(this.lines);
    const { lines } = this.racer;
    this.lines.hidden = false;
    pen.strokeStyle = this.branch;
    pen.globalAlpha = 0.75;
    pen.lineWidth = 1;
    pen.beginPath();
    for (let k = 4 * from; k < 4 * to; k += 4) {
      pen.moveTo(...this._at(lines[k], lines[k + 1]));
      pen.lineTo(...this._at(lines[k + 2], lines[k + 3]));
    }
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** Jumps of AD-GSO: a line to each cell that it jumped to. @param {number} from @param {number} to */
  _jump(from, to) {
    const { jumps } = this.racer;
    if (!jumps.length || !this.start) return;
    const pen = this._penOf(this.lines);
    pen.strokeStyle = THEMES[this.dark ? "dark" : "light"].ink;
    pen.fillStyle = pen.strokeStyle;
    pen.lineWidth = 1.5;
    for (const [k, [count, x, y]] of jumps.entries()) {
      if (count <= from || count > to) continue;
      const before = k ? jumps[k - 1].slice(1) : this.start;
      this.lines.hidden = false;
      pen.beginPath();
      pen.moveTo(...this._at(before[0], before[1]));
      pen.lineTo(...this._at(x, y));
      pen.stroke();
      pen.beginPath();
      pen.arc(...this._at(x, y), 2, 0, 2 * Math.PI);
      pen.fill();
    }
  }

  /** The path, in the planner's colour on a casing. */
  _path() {
    this._pathed = true;
    const { path } = this.racer;
    if (path.length < 2) return;
    this.lines.hidden = false;
    const pen = this._penOf(this.lines);
    pen.lineCap = pen.lineJoin = "round";
    pen.beginPath();
    path.forEach(([x, y], k) => (k ? pen.lineTo(...this._at(x, y)) : pen.moveTo(...this._at(x, y))));
    const wide = Math.min(Math.max(2.5, 0.25 * this.scale), 6);
    for (const [colour, more, dash] of /** @type {Array<[string, number, number[]]>} */ ([[this.dark ? "#f4f5f7" : "#20242c", 2.5, []], ["#ffffff", 0, []], [this.colour, 0, this.dash]])) {
      pen.strokeStyle = colour;
      pen.lineWidth = wide + more;
      pen.setLineDash(dash);
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  /** The robot where it is after so many seconds. @param {number | null} driven */
  _drive(driven) {
    const { path, t } = this.racer;
    this.robot.hidden = driven === null || path.length < 2;
    if (driven === null || path.length < 2) return;
    if (driven < t[this._leg]) this._leg = 0;
    while (this._leg < t.length - 2 && t[this._leg + 1] <= driven) this._leg++;
    const k = this._leg;
    const span = t[k + 1] - t[k];
    const share = span > 0 ? Math.min((driven - t[k]) / span, 1) : 1;
    const [x, y] = this._at(path[k][0] + share * (path[k + 1][0] - path[k][0]), path[k][1] + share * (path[k + 1][1] - path[k][1]));
    const half = Math.ceil(/** @type {number} */ (this._size) + 2);
    const turn = this._turns ? ` rotate(${(-this._heading(k, share)).toFixed(3)}rad)` : "";
    this.robot.style.transform = `translate(${(x - half).toFixed(1)}px, ${(y - half).toFixed(1)}px)${turn}`;
  }

  /** Where the robot looks on a leg, radians counterclockwise: along its path, if nothing says. @param {number} k @param {number} share of the leg */
  _heading(k, share) {
    const { path, yaw } = this.racer;
    if (yaw.length) return yaw[k] + share * (yaw[k + 1] - yaw[k]);
    return Math.atan2(path[k][1] - path[k + 1][1], path[k + 1][0] - path[k][0]);
  }

  /** What the caption says; written only when it changes. @param {string} state @param {string} count */
  say(state, count) {
    const said = `${state}|${count}`;
    if (said === this._said) return;
    this._said = said;
    this.state.textContent = state;
    this.count.textContent = count;
  }
}

/** A footprint that looks to the right, and a line from its base ahead. @param {CanvasRenderingContext2D} pen @param {number} at @param {import("./shape.js").Outline} outline @param {number} scale @param {string} colour */
function bodyMark(pen, at, outline, scale, colour) {
  pen.fillStyle = colour;
  pen.strokeStyle = "#fff";
  pen.lineWidth = 1.5;
  pen.beginPath();
  for (const [x, y] of outline) pen.lineTo(at + x * scale, at - y * scale);
  pen.closePath();
  pen.fill();
  pen.stroke();
  pen.beginPath();
  pen.moveTo(at, at);
  pen.lineTo(at + Math.max(...outline.map(([x]) => x)) * scale, at);
  pen.stroke();
}

/** @param {Racer} racer */
function arrival({ t, units }) {
  return t.length > 1 && `${formatted(t[t.length - 1], 1)} ${units.startsWith("m/s") ? "s drive" : "transfers"}`;
}
