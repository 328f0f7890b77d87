// Glowworm robots: their part of the panel Fleet, their run, and their picture: discs as bright as their luciferin, trails,
// sources, and how many robots are at each.

import { LayerPicture, drawCells } from "./cells.js";
import { LINES, THEMES } from "./colours.js";
import { ramp } from "./fleetdraw.js";
import { json, layerOf } from "./frames.js";
import { el, tell, formatted } from "./make.js";

/** Iterations of a trail. */
const TAIL = 12;
/** How much of the ground the signal colours: robots stand out from it. */
const VEIL = 0.4;
/** Milliseconds between two drawings of the trails, at the least. */
const OFTEN = 30;
/** Steps of brightness of the robots' pictures. */
const SHADES = 16;

/** @typedef {{head: Record<string, any>, xy: Float32Array[], sources: Float32Array[], held: Uint16Array[], bright: Uint8Array[], end: Record<string, any> | null}} SwarmRun */

export class SwarmPanel {
  /** @param {import("./fleet.js").Fleet} fleet */
  constructor(fleet) {
    this.fleet = fleet;
    this.on = false;
    /** @type {SwarmRun | null} */
    this.run = null;
    /** How it was asked for. @type {Record<string, any>} */
    this.asked = {};
    /** The signal at the beginning. @type {Layer | null} */
    this.signal = null;
    this._heat = new LayerPicture();
    this._tail = document.createElement("canvas");
    this._drawn = "";
    this._when = 0;
    /** @type {{key: string, all: HTMLCanvasElement[]}} */
    this._looks = { key: "", all: [] };
    const field = (/** @type {string} */ name, /** @type {string} */ id, /** @type {HTMLElement} */ control) => {
      control.id = `swarm-${id}`;
      return el("div", { class: "field" }, el("label", { for: control.id }, name), control);
    };
    this.sources = el("select", null, el("option", { value: "three-peaks" }, "three peaks"), el("option", { value: "drawn" }, "three at random"));
    this.method = el("select", null, el("option", { value: "gso" }, "glowworms"), el("option", { value: "gradient" }, "gradient"));
    this.iterations = el("input", { type: "number", min: 1, max: 2000, step: 1, value: 300 });
    this.noise = el("input", { type: "number", min: 0, max: 10, step: "any", value: 0 });
    this.sight = el("input", { type: "checkbox", checked: true });
    this.fields = el("div", { class: "stack swarm-own" }, field("Sources", "sources", this.sources), field("Method", "method", this.method),
      field("Iterations", "iterations", this.iterations), field("Noise of sensors", "noise", this.noise),
      el("label", { class: "row" }, this.sight, "walls block broadcasts"));
  }

  get last() {
    return Math.max(0, (this.run?.xy.length ?? 0) - 1);
  }

  /** What draws, if there is something. @returns {SwarmPanel | null} */
  get picture() {
    return this.run ? this : null;
  }

  drop() {
    this.run = this.signal = null;
  }

  /** Walls have changed: what is shown was simulated without them. */
  stale() {
    this.fleet.clock.pause();
    this.drop();
    this.fleet.clock.changed(0);
    tell(this.fleet.words, "The map has changed: simulate again.");
    this.fleet.seen.draw();
    this.fleet.page.map.refresh();
  }

  async simulate() {
    const { fleet } = this;
    const { map, page, clock } = fleet;
    if (!map) return;
    this.drop();
    clock.pause();
    clock.tick = 0;
    clock.changed(0);
    const settings = {
      iterations: Math.min(Math.max(Math.round(Number(this.iterations.value)) || 1, 1), 2000), noise: Math.max(0, Number(this.noise.value) || 0),
      method: this.method.value, line_of_sight: this.sight.checked,
    };
    tell(fleet.words, "simulating");
    /** @type {SwarmRun | null} */
    let run = null;
    const asked = { robots: fleet._robots(), seed: Math.max(0, Math.round(Number(fleet.seed.value)) || 0), sources: this.sources.value, settings };
    const heard = await fleet.job("/api/swarm", { scenario: fleet.scenario(map.cells), ...asked }, (kind, bytes) => {
      if (kind === "H") run = { head: json(bytes), xy: [], sources: [], held: [], bright: [], end: null };
      else if (kind === "L") this.signal = layerOf(bytes);
      else if (kind === "G" && run) add(bytes, run);
      else if (kind === "Z" && run) run.end = json(bytes);
    });
    if (!heard || !run) return;
    this.run = run;
    this.asked = asked;
    fleet.remember();
    const { end } = /** @type {SwarmRun} */ (run);
    tell(fleet.words, end?.sentence ?? "", !end?.found);
    this.theme();
    clock.changed(this.last);
    clock.start();
    fleet.seen.draw();
    page.tell("fleet");
    page.map.refresh();
  }

  /** The page's colours have changed. */
  theme() {
    // Strong is bright, as robots with much luciferin are, and as in pictures and films.
    if (this.signal) this._heat.put({ ...this.signal, values: this.signal.values.map((v) => v && 256 - v) }, this.fleet.page.dark);
  }

  /** @param {Cell} cell */
  choose(cell) {
    const { run, fleet } = this;
    if (!run) return;
    const k = Math.min(Math.round(fleet.clock.tick), this.last);
    let [found, least] = [-1, 1.5];
    for (let r = 0; r < run.head.robots; r++) {
      const far = Math.hypot(run.xy[k][2 * r] - cell[0], run.xy[k][2 * r + 1] - cell[1]);
      if (far < least) [found, least] = [r, far];
    }
    if (found >= 0) fleet.page.say(`Robot ${found}: luciferin ${formatted(this._luciferin(k, found), 2)} at iteration ${k}.`);
  }

  /** @param {number} k @param {number} r */
  _luciferin(k, r) {
    const [low, high] = this.run?.head.luciferin ?? [0, 0];
    return low + ((high - low) * (this.run?.bright[k][r] ?? 0)) / 255;
  }

  // ---- what is shown beside the map --------------------

  /** @returns {HTMLElement[]} */
  summary() {
    const { run } = this;
    if (!run?.end) return [el("p", { class: "hint" }, "Nothing is simulated yet.")];
    const { end, head } = run;
    const rows = /** @type {Array<[string, string]>} */ (end.held.map((/** @type {number} */ many, /** @type {number} */ k) => [`Source ${k}`, `${formatted(many)}${end.held_from[k] === null ? ", not held" : `, held from iteration ${formatted(end.held_from[k])} on`}`]));
    rows.push(["Met another robot", `${formatted(end.encounters)} times`], ["Met a wall", `${formatted(end.wall_encounters)} times`]);
    return [
      el("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [el("dt", null, name), el("dd", null, value)])),
      el("p", { class: "hint" }, `Robots at the end within ${formatted(head.capture_radius, 2)} cells of each source; a robot counts for the nearest source. A source is captured by ${formatted(head.capture_robots)} or more robots.`),
      ...end.notes.map((/** @type {string} */ note) => el("p", { class: "hint" }, note)),
    ];
  }

  /** @param {number} tick @returns {Array<[string, string]>} */
  at(tick) {
    const { run } = this;
    if (!run || !this.last) return [];
    const k = Math.min(tick, this.last);
    return [["Iteration", formatted(k)], ...Array.from(run.held[k], (many, s) => /** @type {[string, string]} */ ([`At source ${s}`, formatted(many)]))];
  }

  /** @returns {Array<{label: string, values: ArrayLike<number>, colour: string, dash?: number[]}>} */
  lines() {
    const { run } = this;
    if (!run || !this.last) return [];
    return Array.from(run.held[0], (_, s) => ({ label: `at source ${s}`, values: run.held.map((row) => row[s]), colour: LINES[s % LINES.length][0], dash: LINES[s % LINES.length][1] }));
  }

  /** @returns {Array<[string, (pen: CanvasRenderingContext2D) => void]>} */
  key() {
    const { dark } = this.fleet.page;
    return [
      ["robot with little luciferin", (pen) => disc(pen, 9, 9, 7, 0, dark)], ["robot with much luciferin", (pen) => disc(pen, 9, 9, 7, 1, dark)],
      ["ground: the signal at the beginning, weak to strong", (pen) => {
        pen.globalAlpha = VEIL;
        ramp(pen, dark, true);
      }],
      ["source", (pen) => source(pen, 9, 9, "", dark)],
      ["within it a robot counts for the source", (pen) => {
        pen.strokeStyle = THEMES[dark ? "dark" : "light"].ink;
        pen.setLineDash([3, 3]);
        pen.beginPath();
        pen.arc(9, 9, 7, 0, 2 * Math.PI);
        pen.stroke();
      }],
    ];
  }

  // ---- the picture --------------------

  /** @param {CanvasRenderingContext2D} pen @param {import("./view.js").View} view */
  base(pen, view) {
    this._drawn = "";
    if (!this.signal || !this.run) return;
    pen.globalAlpha = VEIL;
    drawCells(pen, view, this._heat.canvas);
    pen.globalAlpha = 1;
  }

  /** @param {CanvasRenderingContext2D} pen @param {import("./view.js").View} view */
  draw(pen, view) {
    const { run, fleet } = this;
    if (!run || !this.last) return;
    const { dark, map } = fleet.page;
    const { tick } = fleet.clock;
    const k = Math.min(Math.floor(tick + 1e-6), this.last);
    const f = k < this.last ? tick - k : 0;
    const { head } = run;
    const n = /** @type {number} */ (head.robots);
    const s = view.scale;
    const place = (/** @type {Float32Array[]} */ all, /** @type {number} */ at) => all[k][at] + (f ? f * (all[k + 1][at] - all[k][at]) : 0);
    this._trails(run, view, k);
    const pixels = Math.max(6, Math.round(2 * head.radius * s * map.ratio));
    const looks = this._sprites(pixels, dark);
    pen.save();
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this._tail, 0, 0);
    for (let r = 0; r < n; r++) {
      const x = (view.x + (place(run.xy, 2 * r) + 0.5) * s) * map.ratio - pixels / 2;
      const y = (view.y + (place(run.xy, 2 * r + 1) + 0.5) * s) * map.ratio - pixels / 2;
      pen.drawImage(looks[run.bright[k][r] >> 4], Math.round(x), Math.round(y));
    }
    pen.restore();
    pen.strokeStyle = THEMES[dark ? "dark" : "light"].ink;
    for (let c = 0; 2 * c < run.sources[k].length; c++) {
      const [x, y] = view.pixel(place(run.sources, 2 * c), place(run.sources, 2 * c + 1));
      pen.lineWidth = 1.5;
      pen.setLineDash([5, 4]);
      pen.beginPath();
      pen.arc(x, y, head.capture_radius * s, 0, 2 * Math.PI);
      pen.stroke();
      pen.setLineDash([]);
      source(pen, x, y, String(c), dark);
    }
  }

  /** Where the robots were until an iteration, on a canvas of its own: drawn once an iteration, not in each frame. @param {SwarmRun} run @param {import("./view.js").View} view @param {number} k */
  _trails(run, view, k) {
    const { dark, map } = this.fleet.page;
    const { canvas, ratio } = map;
    const key = `${k} ${view.x} ${view.y} ${view.scale} ${canvas.width} ${canvas.height} ${dark}`;
    const now = performance.now();
    if (key === this._drawn || (this._drawn && now - this._when < OFTEN)) return;
    this._drawn = key;
    this._when = now;
    const tail = this._tail;
    tail.width = canvas.width;
    tail.height = canvas.height;
    const pen = /** @type {CanvasRenderingContext2D} */ (tail.getContext("2d"));
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = dark ? "#ffd166" : "#7a4b00";
    const wide = Math.max(1, Math.round(run.head.radius * view.scale * 0.6));
    const [ox, oy] = view.pixel(0, 0);
    for (let t = Math.max(0, k - TAIL); t <= k; t++) {
      pen.globalAlpha = 0.12 + (0.45 * (TAIL + t - k)) / TAIL;
      const xy = run.xy[t];
      const after = run.xy[Math.min(t + 1, k)];
      for (let at = 0; at < xy.length; at += 2) {
        // Who stands leaves none.
        if (xy[at] === after[at] && xy[at + 1] === after[at + 1]) continue;
        pen.fillRect(Math.round(ox + xy[at] * view.scale - wide / 2), Math.round(oy + xy[at + 1] * view.scale - wide / 2), wide, wide);
      }
    }
  }

  /** @param {number} pixels @param {boolean} dark */
  _sprites(pixels, dark) {
    const key = `${pixels} ${dark}`;
    if (this._looks.key !== key) {
      this._looks = { key, all: Array.from({ length: SHADES }, (_, shade) => {
        const canvas = document.createElement("canvas");
        canvas.width = canvas.height = pixels;
        disc(/** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")), pixels / 2, pixels / 2, pixels / 2 - 0.5, shade / (SHADES - 1), dark);
        return canvas;
      }) };
    }
    return this._looks.all;
  }
}

/** A robot as bright as its luciferin. @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {number} r @param {number} share 0 to 1 @param {boolean} dark */
function disc(pen, x, y, r, share, dark) {
  const mix = (/** @type {number} */ a, /** @type {number} */ b) => Math.round(a + share * (b - a));
  pen.fillStyle = `rgb(${mix(58, 255)},${mix(52, 214)},${mix(96, 10)})`;
  pen.strokeStyle = dark ? "#f4f6fa" : "#20242c";
  pen.lineWidth = Math.max(0.7, r * 0.14);
  pen.beginPath();
  pen.arc(x, y, Math.max(0.5, r - pen.lineWidth / 2), 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
}

/** A diamond with its number. @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {string} name @param {boolean} dark */
function source(pen, x, y, name, dark) {
  pen.fillStyle = dark ? "#f4f6fa" : "#20242c";
  pen.beginPath();
  for (const [dx, dy] of [[0, -8], [8, 0], [0, 8], [-8, 0]]) pen.lineTo(x + dx, y + dy);
  pen.fill();
  pen.fillStyle = dark ? "#20242c" : "#ffffff";
  pen.font = "bold 10px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(name, x, y + 0.5);
}

/** Iterations of a frame, put to the run. @param {Uint8Array} bytes @param {SwarmRun} run */
function add(bytes, run) {
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  const [n, robots, sources] = [view.getUint16(4, true), view.getUint16(6, true), view.getUint16(8, true)];
  let at = 10;
  const next = (/** @type {number} */ size) => bytes.slice(at, (at += size)).buffer;
  const xy = new Float32Array(next(8 * n * robots));
  const peaks = new Float32Array(next(8 * n * sources));
  const held = new Uint16Array(next(2 * n * sources));
  const bright = new Uint8Array(next(n * robots));
  for (let k = 0; k < n; k++) {
    run.xy.push(xy.subarray(2 * robots * k, 2 * robots * (k + 1)));
    run.sources.push(peaks.subarray(2 * sources * k, 2 * sources * (k + 1)));
    run.held.push(held.subarray(sources * k, sources * (k + 1)));
    run.bright.push(bright.subarray(robots * k, robots * (k + 1)));
  }
}
