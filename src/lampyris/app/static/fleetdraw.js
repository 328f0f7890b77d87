// The picture of a fleet: robots between two ticks, their trails, lines from waiting robots to those in their way, and the path of the chosen robot.
//
// Robots are small pictures that are copied; trails are rectangles along the rows and columns, put together on a canvas
// of their own once a tick. Both are many times as fast in a browser without a graphics card as strokes.

import { GOAL, START, THEMES, levels } from "./colours.js";
import { LayerPicture, drawCells, penOf } from "./cells.js";
import { goalMark, startMark } from "./marks.js";

/** @typedef {import("./view.js").View} View */
/** @typedef {CanvasRenderingContext2D} Pen */

/** Ticks of a trail. */
const TAIL = 9;
/** Parts of a trail that are drawn alike, from the oldest to the newest: how strong. */
const FADING = [0.16, 0.3, 0.5];
/** Milliseconds between two drawings of the trails, at the least. */
const OFTEN = 30;
/** Pixels from which on a robot that drives is a disc; below it is a square, which is drawn in half the time. */
const SHAPED = 6;
/** What a robot does, its colours for light and dark and its shape. @type {Array<{name: string, light: string, dark: string, shape: "disc" | "ring" | "square" | "cross"}>} */
export const STATES = [
  { name: "drives", light: "#0072b2", dark: "#5cb8ef", shape: "disc" },
  { name: "waits", light: "#d55e00", dark: "#ff9b4a", shape: "ring" },
  { name: "on its goal for good", light: "#00694a", dark: "#63d3a7", shape: "square" },
  { name: "goal walled off", light: "#b3261e", dark: "#ff9c92", shape: "cross" },
];

/** One robot's mark in the middle of a square. @param {Pen} pen @param {number} state @param {number} side @param {boolean} dark */
export function robotLook(pen, state, side, dark) {
  const { shape, light, dark: bright } = STATES[state];
  const mid = side / 2;
  const r = mid - Math.max(0.5, side * 0.06);
  pen.fillStyle = pen.strokeStyle = dark ? bright : light;
  if (shape === "cross") {
    pen.lineWidth = Math.max(1.5, side * 0.24);
    pen.beginPath();
    for (const [a, b] of [[-1, -1], [-1, 1]]) {
      pen.moveTo(mid + a * r * 0.75, mid + b * r * 0.75);
      pen.lineTo(mid - a * r * 0.75, mid - b * r * 0.75);
    }
    pen.stroke();
    return;
  }
  if (shape === "square") {
    pen.lineWidth = Math.max(1, side * 0.16);
    pen.strokeRect(mid - r * 0.62, mid - r * 0.62, r * 1.24, r * 1.24);
    return;
  }
  pen.beginPath();
  pen.arc(mid, mid, r * 0.92, 0, 2 * Math.PI);
  pen.fill();
  if (shape !== "ring") return;
  pen.fillStyle = dark ? "#16181d" : "#ffffff";
  pen.beginPath();
  pen.arc(mid, mid, r * 0.42, 0, 2 * Math.PI);
  pen.fill();
}

/** From little to much as layers of a fleet and a swarm show it, 16 pixels wide. @param {Pen} pen @param {boolean} dark @param {boolean} [bright] much is bright, not dark */
export function ramp(pen, dark, bright = dark) {
  const fade = pen.createLinearGradient(1, 0, 17, 0);
  levels("landscape", dark).forEach((tone, v) => v && fade.addColorStop(((bright ? 256 - v : v) - 1) / 254, `rgb(${tone & 255},${(tone >> 8) & 255},${(tone >> 16) & 255})`));
  pen.fillStyle = fade;
  pen.fillRect(1, 4, 16, 10);
}

/** Counts as the landscape's colours show them: many stand out from the ground, and few are seen beside very many. @param {Layer} layer @param {boolean} dark @returns {Layer} */
function shaded(layer, dark) {
  const shades = Uint8Array.from({ length: 256 }, (_, v) => (v ? 1 + Math.round(254 * (dark ? 1 - Math.sqrt((v - 1) / 254) : Math.sqrt((v - 1) / 254))) : 0));
  return { ...layer, values: layer.values.map((v) => shades[v]) };
}

export class FleetPicture {
  /** @param {Page} page @param {import("./fleetrun.js").FleetRun} run @param {{tick: number}} clock */
  constructor(page, run, clock) {
    this.page = page;
    this.run = run;
    this.clock = clock;
    /** @type {number | null} */
    this.chosen = null;
    /** What colours the ground. @type {Layer | null} */
    this.layer = null;
    this.trails = true;
    this.waits = true;
    this._heat = new LayerPicture();
    this._tail = document.createElement("canvas");
    this._drawn = "";
    this._when = 0;
    /** @type {{key: string, all: HTMLCanvasElement[]}} */
    this._sprites = { key: "", all: [] };
    /** Places of the robots in the last frame, pixels, and what each does. */
    this._x = new Float32Array(run.n);
    this._y = new Float32Array(run.n);
    this._state = new Uint8Array(run.n);
  }

  /** @param {Layer | null} layer */
  setLayer(layer) {
    this.layer = layer;
    if (layer) this._heat.put(shaded(layer, this.page.dark), this.page.dark);
    this.page.map.refresh();
  }

  /** What changes seldom: it lies below. @param {Pen} pen @param {View} view */
  base(pen, view) {
    if (this.layer) drawCells(pen, view, this._heat.canvas);
    this._drawn = "";
    if (this.chosen !== null) this._path(pen, view, this.chosen);
  }

  /** @param {Pen} pen @param {View} view */
  draw(pen, view) {
    const { run, clock, page } = this;
    const { dark } = page;
    const k = Math.min(Math.floor(clock.tick + 1e-6), run.last);
    const f = k < run.last ? clock.tick - k : 0;
    const { n, xy } = run;
    const s = view.scale;
    for (let r = 0; r < n; r++) {
      const at = 2 * (k * n + r);
      const to = k < run.last ? at + 2 * n : at;
      this._x[r] = view.x + (xy[at] + f * (xy[to] - xy[at]) + 0.5) * s;
      this._y[r] = view.y + (xy[at + 1] + f * (xy[to + 1] - xy[at + 1]) + 0.5) * s;
      this._state[r] = run.stateAt(k, r);
    }
    if (this.trails) this._trails(pen, view, k);
    if (this.waits) this._hindered(pen, k);
    // Whole pixels at whole places: a copy, where fractions would be mixed for each pixel.
    const pixels = Math.round(Math.max(5, Math.min(s * 0.92, 44)) * page.map.ratio);
    const sprites = this._looks(pixels);
    const side = pixels / page.map.ratio;
    const half = side / 2;
    const ratio = page.map.ratio;
    pen.save();
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.imageSmoothingEnabled = false;
    const [right, below] = [view.width + half, view.height + half];
    for (const state of [2, 0, 1, 3]) {
      const look = sprites[state];
      pen.fillStyle = dark ? STATES[state].dark : STATES[state].light;
      for (let r = 0; r < n; r++) {
        if (this._state[r] !== state) continue;
        const [x, y] = [this._x[r], this._y[r]];
        if (x < -half || y < -half || x > right || y > below) continue;
        if (state === 0 && pixels < SHAPED) pen.fillRect(Math.round((x - half) * ratio), Math.round((y - half) * ratio), pixels, pixels);
        else pen.drawImage(look, Math.round((x - half) * ratio), Math.round((y - half) * ratio));
      }
    }
    pen.restore();
    if (this.chosen === null) return;
    const r = this.chosen;
    pen.lineWidth = 2.5;
    pen.strokeStyle = THEMES[page.dark ? "dark" : "light"].ink;
    pen.beginPath();
    pen.arc(this._x[r], this._y[r], half + 4, 0, 2 * Math.PI);
    pen.stroke();
  }

  /** The robot nearest to a cell at the shown moment; null: none is near. @param {Cell} cell */
  near(cell) {
    const { run, clock } = this;
    const k = Math.min(Math.round(clock.tick), run.last);
    let [found, least] = [/** @type {number | null} */ (null), Math.max(1, 9 / this.page.map.view.scale)];
    for (let r = 0; r < run.n; r++) {
      const at = 2 * (k * run.n + r);
      const far = Math.max(Math.abs(run.xy[at] - cell[0]), Math.abs(run.xy[at + 1] - cell[1]));
      if (far < least || (far === 0 && far <= least)) {
        least = far;
        found = r;
      }
    }
    return found;
  }

  /** Lines from robots that wait to those that are in the cells that they enter next. @param {Pen} pen @param {number} k */
  _hindered(pen, k) {
    const { run, page } = this;
    if (k >= run.last) return;
    pen.strokeStyle = page.dark ? STATES[1].dark : STATES[1].light;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (let r = 0; r < run.n; r++) {
      const other = run.behind[k * run.n + r];
      if (other < 0) continue;
      pen.moveTo(this._x[r], this._y[r]);
      pen.lineTo(this._x[other], this._y[other]);
    }
    pen.stroke();
  }

  /** @param {Pen} pen @param {View} view @param {number} k */
  _trails(pen, view, k) {
    const { map, dark } = this.page;
    const { canvas } = map;
    const key = `${k} ${view.x} ${view.y} ${view.scale} ${canvas.width} ${canvas.height} ${dark} ${this.run.ticks}`;
    const now = performance.now();
    const same = key === this._drawn;
    if (!same && (this._drawn === "" || now - this._when >= OFTEN)) {
      this._drawn = key;
      this._when = now;
      this._settle(view, k);
    }
    pen.save();
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(this._tail, 0, 0);
    pen.restore();
    // What has been driven of this tick.
    const { run } = this;
    const wide = Math.max(1.5, Math.min(view.scale * 0.26, 7));
    pen.fillStyle = dark ? STATES[0].dark : STATES[0].light;
    pen.globalAlpha = FADING[2];
    for (let r = 0; r < run.n; r++) {
      if (this._state[r] !== 0) continue;
      const at = 2 * (k * run.n + r);
      const x = view.x + (run.xy[at] + 0.5) * view.scale;
      const y = view.y + (run.xy[at + 1] + 0.5) * view.scale;
      pen.fillRect(Math.min(x, this._x[r]) - wide / 2, Math.min(y, this._y[r]) - wide / 2, Math.abs(this._x[r] - x) + wide, Math.abs(this._y[r] - y) + wide);
    }
    pen.globalAlpha = 1;
  }

  /** Trails up to a whole tick, on their own canvas. @param {View} view @param {number} k */
  _settle(view, k) {
    const { run } = this;
    const { canvas, ratio } = this.page.map;
    const tail = this._tail;
    if (tail.width !== canvas.width || tail.height !== canvas.height) {
      tail.width = canvas.width;
      tail.height = canvas.height;
    }
    const pen = penOf(tail);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, tail.width, tail.height);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const s = view.scale;
    const wide = Math.max(1.5, Math.min(s * 0.26, 7));
    pen.fillStyle = this.page.dark ? STATES[0].dark : STATES[0].light;
    const first = Math.max(0, k - TAIL);
    for (let band = 0; band < FADING.length; band++) {
      const from = first + Math.floor(((k - first) * band) / FADING.length);
      const to = first + Math.floor(((k - first) * (band + 1)) / FADING.length);
      pen.globalAlpha = FADING[band];
      for (let r = 0; r < run.n; r++) this._lines(pen, view, r, from, to, wide);
    }
    pen.globalAlpha = 1;
  }

  /** A robot's path over some ticks, as a rectangle for each straight part. @param {Pen} pen @param {View} view @param {number} r @param {number} from @param {number} to @param {number} wide */
  _lines(pen, view, r, from, to, wide) {
    const { xy, n } = this.run;
    const s = view.scale;
    let [ax, ay] = [xy[2 * (from * n + r)], xy[2 * (from * n + r) + 1]];
    let [bx, by, dx, dy] = [ax, ay, 0, 0];
    for (let t = from + 1; t <= to + 1; t++) {
      const at = 2 * (t * n + r);
      const [x, y] = t > to ? [NaN, NaN] : [xy[at], xy[at + 1]];
      if (x === bx && y === by) continue;
      if ((ax !== bx || ay !== by) && (x - bx !== dx || y - by !== dy)) {
        pen.fillRect(view.x + (Math.min(ax, bx) + 0.5) * s - wide / 2, view.y + (Math.min(ay, by) + 0.5) * s - wide / 2, Math.abs(ax - bx) * s + wide, Math.abs(ay - by) * s + wide);
        [ax, ay] = [bx, by];
      }
      [dx, dy, bx, by] = [x - bx, y - by, x, y];
    }
  }

  /** The whole path of a robot, with rings where it waits. @param {Pen} pen @param {View} view @param {number} robot */
  _path(pen, view, robot) {
    const { run, page } = this;
    const { xy, n } = run;
    const pixel = (/** @type {number} */ t) => view.pixel(xy[2 * (t * n + robot)], xy[2 * (t * n + robot) + 1]);
    pen.lineJoin = "round";
    for (const [colour, wide] of /** @type {Array<[string, number]>} */ ([[THEMES[page.dark ? "dark" : "light"].paper, 5], [page.dark ? STATES[0].dark : STATES[0].light, 2.5]])) {
      pen.strokeStyle = colour;
      pen.lineWidth = wide;
      pen.beginPath();
      for (let t = 0; t <= run.last; t++) pen.lineTo(...pixel(t));
      pen.stroke();
    }
    pen.strokeStyle = page.dark ? STATES[1].dark : STATES[1].light;
    pen.lineWidth = 2;
    for (let t = 0; t < run.last; t++) {
      if (run.behind[t * n + robot] === -2) continue;
      let many = 1;
      while (t + many < run.last && run.behind[(t + many) * n + robot] !== -2) many++;
      pen.beginPath();
      pen.arc(...pixel(t), Math.min(4 + 1.5 * Math.sqrt(many), 14), 0, 2 * Math.PI);
      pen.stroke();
      t += many;
    }
    const r = Math.max(7, view.scale * 0.45);
    startMark(pen, ...pixel(0), r, START);
    goalMark(pen, ...view.pixel(run.goals[2 * robot], run.goals[2 * robot + 1]), r, GOAL);
  }

  /** Pictures of the robots at a size. @param {number} pixels */
  _looks(pixels) {
    const { dark } = this.page;
    const key = `${pixels} ${dark}`;
    if (this._sprites.key !== key) {
      this._sprites = { key, all: STATES.map((_, state) => {
        const canvas = document.createElement("canvas");
        canvas.width = canvas.height = pixels;
        robotLook(penOf(canvas), state, pixels, dark);
        return canvas;
      }) };
    }
    return this._sprites.all;
  }
}
