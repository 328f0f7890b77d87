// The map on its canvas: cells, layers, ways, obstacles and the robot.
//
// What changes seldom (cells, layer, ways) is put together once at the screen's size, the base; each frame copies
// it and draws what moves on top. Measured in a software-drawn browser, see docs: redrawing cells and layer in
// every frame instead takes several times as long.

import { CAUSES, GATE, GOAL, KINDS, LINES, OTHER_KIND, ROBOT, START, THEMES, levels, packed, speedColour } from "./colours.js";
import { goalMark, kindMark, robotMark, startMark } from "./marks.js";
import { View } from "./view.js";

/** @typedef {import("./types.js").Cell} Cell */
/** @typedef {import("./types.js").Ground} Ground */
/** @typedef {import("./types.js").Layer} Layer */

/**
 * A way on the map: nodes in cells, a colour or a value 0 to 1 for each, a dash.
 * `count`: only so many of the nodes; `faint`: something else matters more now.
 * @typedef {{cells: ArrayLike<number>, shares?: ArrayLike<number> | null, colour?: string, dash?: number[], wide?: number,
 *   count?: number, faint?: boolean}} Way
 */

/**
 * What moves, at one moment. Places in cells, whole or between two.
 * @typedef {{
 *   robot: [number, number] | null, bodies: Float32Array | null, kinds: string[], radii: number[],
 *   trail: Way | null, others?: Array<{robot: [number, number], line: number}>,
 * }} Moment
 */

/** Waypoints of a patrol; a draft is still being drawn. @typedef {{cells: Cell[], draft: boolean}} Patrol */

export class MapView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
    this.view = new View();
    /** @type {Ground | null} */
    this.ground = null;
    this.dark = false;
    /** @type {Layer | null} */
    this.layer = null;
    /** @type {Way[]} */
    this.ways = [];
    /** @type {Cell[]} */
    this.gates = [];
    /** @type {Array<{at: Cell, text?: string, colour: string, fill?: number, ring?: boolean}>} */
    this.marks = [];
    /** @type {Cell | null} */
    this.start = null;
    /** @type {Cell | null} */
    this.goal = null;
    /** @type {Cell | null} */
    this.cursor = null;
    /** @type {Moment} */
    this.moment = { robot: null, bodies: null, kinds: [], radii: [], trail: null };
    this.robotRadius = 0;
    /** Whether the whole map is shown; it stays so when the page's size changes. */
    this.fitted = true;
    /** A hand is on the map: it must not move below it, whatever else on the page grows or shrinks. */
    this.held = false;
    /** Pixels at each side that the map leaves free when it is fitted. */
    this.edge = { top: 16, right: 16, bottom: 16, left: 16 };
    /** @type {Patrol[]} */
    this.patrols = [];
    /** The brush under the pointer. @type {{at: Cell, size: number} | null} */
    this.brush = null;
    this._cells = document.createElement("canvas");
    this._heat = document.createElement("canvas");
    this._base = document.createElement("canvas");
    this._stale = true;
    this._asked = false;
    this._ratio = 1;
    /** @type {boolean | null} */
    this._toneDark = null;
    /** @type {Uint32Array | null} */
    this._tones = null;
    /** @type {ImageData | null} */
    this._heatImage = null;
    /** @type {Map<string, HTMLCanvasElement>} */
    this._sprites = new Map();
    /** Told after each frame with its milliseconds. @type {((ms: number) => void) | null} */
    this.onFrame = null;
    /** Told when the map is shown at another scale or place because its room has changed. @type {(() => void) | null} */
    this.onView = null;
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  /** Take the canvas's size on the page. */
  resize() {
    const box = this.canvas.getBoundingClientRect();
    this._ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(box.width * this._ratio));
    const height = Math.max(1, Math.round(box.height * this._ratio));
    if (width === this.canvas.width && height === this.canvas.height) return;
    for (const one of [this.canvas, this._base]) {
      one.width = width;
      one.height = height;
    }
    const whole = this.fitted || this.view.width <= 1;
    if (this.held) {
      this.view.width = box.width;
      this.view.height = box.height;
    } else {
      this.view.resize(box.width, box.height);
      if (whole) this.fit();
    }
    this.onView?.();
    this.refresh();
  }

  fit() {
    this.fitted = true;
    if (this.ground) this.view.fit(this.ground.width, this.ground.height, this.edge);
    this.refresh();
  }

  /** A place in cells in the middle, at a scale. @param {number} cx @param {number} cy @param {number} scale */
  look(cx, cy, scale) {
    const { view } = this;
    this.fitted = false;
    view.zoom(scale / view.scale, 0, 0);
    view.x = view.width / 2 - cx * view.scale;
    view.y = view.height / 2 - cy * view.scale;
    this.refresh();
    this.onView?.();
  }

  /** Show another map, or the same one in other colours. @param {Ground} ground */
  setGround(ground) {
    const other = !this.ground || this.ground.width !== ground.width || this.ground.height !== ground.height;
    this.ground = ground;
    this._cells.width = ground.width;
    this._cells.height = ground.height;
    this._paintAll();
    if (other) this.fit();
    this.refresh();
  }

  /** @param {boolean} dark */
  setDark(dark) {
    this.dark = dark;
    this._sprites.clear();
    if (this.ground) this._paintAll();
    this.setLayer(this.layer);
  }

  _paintAll() {
    const ground = /** @type {Ground} */ (this.ground);
    const theme = THEMES[this.dark ? "dark" : "light"];
    const tones = [packed(theme.free), packed(theme.wall), packed(theme.unknown)];
    const image = new ImageData(ground.width, ground.height);
    const pixels = new Uint32Array(image.data.buffer);
    const { cells, terrain } = ground;
    for (let k = 0; k < pixels.length; k++) pixels[k] = tones[cells[k]];
    if (terrain) {
      const dear = theme.free.map((v, c) => theme.dear[c] - v);
      for (let k = 0; k < pixels.length; k++) {
        if (cells[k] || !terrain[k]) continue;
        const share = 0.14 + (0.86 * terrain[k]) / 252;
        pixels[k] = packed(/** @type {[number, number, number]} */ (theme.free.map((v, c) => Math.round(v + share * dear[c]))));
      }
    }
    this._pen(this._cells).putImageData(image, 0, 0);
  }

  /** Cells that have just changed, drawn at once. @param {Iterable<Cell>} cells */
  repaint(cells) {
    if (!this.ground) return;
    const theme = THEMES[this.dark ? "dark" : "light"];
    const tones = [theme.free, theme.wall, theme.unknown].map(([r, g, b]) => `rgb(${r},${g},${b})`);
    const pen = this._pen(this._cells);
    for (const [x, y] of cells) {
      pen.fillStyle = tones[this.ground.cells[y * this.ground.width + x]];
      pen.fillRect(x, y, 1, 1);
    }
    this.refresh();
  }

  /** The layer beneath the ways; null: none. @param {Layer | null} layer */
  setLayer(layer) {
    this.layer = layer;
    if (layer) {
      if (this._heat.width !== layer.width || this._heat.height !== layer.height) {
        this._heat.width = layer.width;
        this._heat.height = layer.height;
        this._heatImage = new ImageData(layer.width, layer.height);
      }
      if (this._toneDark !== this.dark || !this._tones) {
        this._tones = levels("landscape", this.dark);
        this._toneDark = this.dark;
      }
      const image = /** @type {ImageData} */ (this._heatImage);
      const pixels = new Uint32Array(image.data.buffer);
      const { values } = layer;
      const tones = this._tones;
      for (let k = 0; k < pixels.length; k++) pixels[k] = tones[values[k]];
      this._pen(this._heat).putImageData(image, 0, 0);
    }
    this.refresh();
  }

  /** Draw the base anew in the next frame. */
  refresh() {
    this._stale = true;
    this.draw();
  }

  /** Draw once, in the next frame. */
  draw() {
    if (this._asked) return;
    this._asked = true;
    requestAnimationFrame(() => {
      this._asked = false;
      this.drawNow();
    });
  }

  drawNow() {
    const began = performance.now();
    if (this._stale) this._drawBase();
    const { pen } = this;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(this._base, 0, 0);
    pen.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    this._drawMoment(pen);
    if (this.onFrame) this.onFrame(performance.now() - began);
  }

  /** @param {HTMLCanvasElement} canvas */
  _pen(canvas) {
    return /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  }

  // ---- what changes seldom --------------------

  _drawBase() {
    this._stale = false;
    const pen = this._pen(this._base);
    const theme = THEMES[this.dark ? "dark" : "light"];
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = theme.paper;
    pen.fillRect(0, 0, this._base.width, this._base.height);
    const { ground, view } = this;
    if (!ground) return;
    pen.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    // Cells are squares; only where several share a pixel are they mixed.
    pen.imageSmoothingEnabled = view.scale * this._ratio < 1;
    this._image(pen, this._cells);
    if (this.layer) this._image(pen, this._heat);
    if (view.scale >= 14) this._lines(pen, theme.line);
    pen.strokeStyle = theme.ink;
    pen.lineWidth = 1;
    pen.strokeRect(view.x - 0.5, view.y - 0.5, ground.width * view.scale + 1, ground.height * view.scale + 1);
    if (this.gates.length) this._gates(pen);
    for (const way of this.ways) this._way(pen, way);
    for (const mark of this.marks) this._mark(pen, mark);
    for (const patrol of this.patrols) this._patrol(pen, patrol);
    const r = Math.max(7, view.scale * 0.45);
    if (this.start) startMark(pen, ...view.pixel(this.start[0], this.start[1]), r, START);
    if (this.goal) goalMark(pen, ...view.pixel(this.goal[0], this.goal[1]), r, GOAL);
  }

  /** The part of a picture of cells that is on the screen. @param {CanvasRenderingContext2D} pen @param {HTMLCanvasElement} image */
  _image(pen, image) {
    const { view } = this;
    const x0 = Math.max(0, Math.floor(-view.x / view.scale));
    const y0 = Math.max(0, Math.floor(-view.y / view.scale));
    const x1 = Math.min(image.width, Math.ceil((view.width - view.x) / view.scale));
    const y1 = Math.min(image.height, Math.ceil((view.height - view.y) / view.scale));
    if (x0 >= x1 || y0 >= y1) return;
    const s = view.scale;
    pen.drawImage(image, x0, y0, x1 - x0, y1 - y0, view.x + x0 * s, view.y + y0 * s, (x1 - x0) * s, (y1 - y0) * s);
  }

  /** @param {CanvasRenderingContext2D} pen @param {string} colour */
  _lines(pen, colour) {
    const { view } = this;
    const ground = /** @type {Ground} */ (this.ground);
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

  /** Crosses, all in one stroke: scattered maps have tens of thousands. @param {CanvasRenderingContext2D} pen */
  _gates(pen) {
    const { view } = this;
    const half = Math.max(3, view.scale * 0.4);
    pen.beginPath();
    for (const [cx, cy] of this.gates) {
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

  /** @param {CanvasRenderingContext2D} pen @param {Patrol} patrol */
  _patrol(pen, { cells, draft }) {
    const [, colour] = KINDS.patrol;
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.setLineDash([5, 5]);
    this._line(pen, cells.flat(), 0, cells.length - 1);
    pen.setLineDash([]);
    const half = Math.max(4, Math.min(this.view.scale * 0.36, 11));
    cells.forEach((cell, k) => {
      const [x, y] = this.view.pixel(cell[0], cell[1]);
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

  /** @param {CanvasRenderingContext2D} pen @param {Way} way */
  _way(pen, way) {
    const n = way.count ?? way.cells.length / 2;
    if (n < 2) return;
    const wide = way.wide ?? Math.min(Math.max(2.5, this.view.scale * 0.28), 9);
    const dark = THEMES[this.dark ? "dark" : "light"].ink;
    pen.lineCap = "round";
    pen.lineJoin = "round";
    if (way.faint) {
      pen.globalAlpha = 0.6;
      pen.strokeStyle = dark;
      pen.lineWidth = Math.max(1.5, wide * 0.3);
      pen.setLineDash([6, 6]);
      this._line(pen, way.cells, 0, n - 1);
      pen.setLineDash([]);
      pen.globalAlpha = 1;
      return;
    }
    // A casing first, so that the way is seen on any ground.
    // Slow and dark stretches would drown in dark ground; bright layers need the dark casing all the same.
    pen.strokeStyle = this.dark ? (this.layer ? "#000" : "#f4f5f7") : dark;
    pen.lineWidth = wide + 2;
    this._line(pen, way.cells, 0, n - 1);
    pen.setLineDash(way.dash ?? []);
    if (way.dash?.length) {
      pen.strokeStyle = "#fff";
      pen.setLineDash([]);
      pen.lineWidth = wide;
      this._line(pen, way.cells, 0, n - 1);
      pen.setLineDash(way.dash);
    }
    pen.lineWidth = wide;
    if (!way.shares) {
      pen.strokeStyle = way.colour ?? ROBOT;
      this._line(pen, way.cells, 0, n - 1);
    } else {
      // Stretches of nearly one speed are one line.
      let from = 0;
      while (from < n - 1) {
        const share = (way.shares[from] + way.shares[from + 1]) / 2;
        let to = from + 1;
        while (to < n - 1 && Math.abs((way.shares[to] + way.shares[to + 1]) / 2 - share) < 0.02) to++;
        pen.strokeStyle = speedColour(share);
        this._line(pen, way.cells, from, to);
        from = to;
      }
    }
    pen.setLineDash([]);
  }

  /** @param {CanvasRenderingContext2D} pen @param {ArrayLike<number>} cells @param {number} from @param {number} to */
  _line(pen, cells, from, to) {
    const { view } = this;
    pen.beginPath();
    for (let k = from; k <= to; k++) {
      const x = view.x + (cells[2 * k] + 0.5) * view.scale;
      const y = view.y + (cells[2 * k + 1] + 0.5) * view.scale;
      if (k === from) pen.moveTo(x, y);
      else pen.lineTo(x, y);
    }
    pen.stroke();
  }

  /** @param {CanvasRenderingContext2D} pen @param {{at: Cell, text?: string, colour: string, fill?: number, ring?: boolean}} mark */
  _mark(pen, mark) {
    const { scale } = this.view;
    const [x, y] = this.view.pixel(mark.at[0], mark.at[1]);
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
      pen.fillStyle = THEMES[this.dark ? "dark" : "light"].ink;
      pen.font = `${Math.round(Math.min(14, scale * 0.32))}px system-ui, sans-serif`;
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillText(mark.text, x, y, scale - 2);
    }
  }

  // ---- what moves --------------------

  /** @param {CanvasRenderingContext2D} pen */
  _drawMoment(pen) {
    const { moment, view } = this;
    if (moment.trail) this._way(pen, moment.trail);
    if (moment.bodies) {
      const side = Math.max(12, Math.min(view.scale * 0.95, 40));
      for (let b = 0; b < moment.kinds.length; b++) {
        const cx = moment.bodies[2 * b];
        if (Number.isNaN(cx)) continue;
        const x = view.x + (cx + 0.5) * view.scale;
        const y = view.y + (moment.bodies[2 * b + 1] + 0.5) * view.scale;
        if (x < -side || y < -side || x > view.width + side || y > view.height + side) continue;
        const radius = moment.radii[b] * view.scale;
        if (radius > side / 2) this._disc(pen, x, y, radius, (KINDS[moment.kinds[b]] ?? OTHER_KIND)[1]);
        const image = this._sprite(moment.kinds[b], side);
        pen.drawImage(image, x - side / 2, y - side / 2, side, side);
      }
    }
    for (const other of moment.others ?? []) {
      const [x, y] = view.pixel(other.robot[0], other.robot[1]);
      this._robot(pen, x, y, LINES[other.line % LINES.length][0]);
    }
    if (moment.robot) {
      const [x, y] = view.pixel(moment.robot[0], moment.robot[1]);
      if (this.robotRadius * view.scale > 8) this._disc(pen, x, y, this.robotRadius * view.scale, ROBOT);
      this._robot(pen, x, y, ROBOT);
    }
    if (this.brush) {
      const { at, size } = this.brush;
      const low = -Math.floor((size - 1) / 2);
      const s = Math.max(size * view.scale, 4);
      pen.strokeStyle = "#fff";
      pen.lineWidth = 3;
      pen.strokeRect(view.x + (at[0] + low) * view.scale, view.y + (at[1] + low) * view.scale, s, s);
      pen.strokeStyle = "#20242c";
      pen.lineWidth = 1;
      pen.strokeRect(view.x + (at[0] + low) * view.scale, view.y + (at[1] + low) * view.scale, s, s);
    }
    if (this.cursor) {
      const [cx, cy] = this.cursor;
      pen.strokeStyle = ROBOT;
      pen.lineWidth = 2;
      const s = Math.max(view.scale, 6);
      const [x, y] = view.pixel(cx, cy);
      pen.strokeRect(x - s / 2, y - s / 2, s, s);
    }
  }

  /** @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {string} colour */
  _robot(pen, x, y, colour) {
    robotMark(pen, x, y, Math.max(6, this.view.scale * 0.42), colour);
  }

  /** @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {number} radius @param {string} colour */
  _disc(pen, x, y, radius, colour) {
    pen.globalAlpha = 0.2;
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
    pen.globalAlpha = 1;
  }

  /** A kind's picture, drawn once a size. @param {string} kind @param {number} side */
  _sprite(kind, side) {
    const pixels = Math.ceil(side * this._ratio);
    const key = `${kind} ${pixels}`;
    const known = this._sprites.get(key);
    if (known) return known;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = pixels;
    kindMark(this._pen(canvas), KINDS[kind] ?? OTHER_KIND, pixels, this.dark, side);
    this._sprites.set(key, canvas);
    return canvas;
  }
}

/** Colour of what binds a speed. @param {string} cause */
export function causeColour(cause) {
  return CAUSES[cause] ?? CAUSES[cause.split(" ")[0]] ?? "#882255";
}
