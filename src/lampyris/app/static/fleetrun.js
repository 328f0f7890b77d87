// The run of a fleet: where every robot is at every tick, put together from plans, and what is counted of it; the clock of
// a fleet or a swarm, and its bar: play, pause, a slider over the ticks, speed.

import { el, icon } from "./make.js";
import { Clock, PACE, RATES } from "./play.js";

/** Steps as they are numbered in a frame: wait, x + 1, y + 1, x - 1, y - 1. */
const DX = [0, 1, 0, -1, 0];
const DY = [0, 0, 1, 0, -1];
/** In `behind`: the robot does not wait; it waits, and nobody is in the cell that it enters next. */
const DRIVES = -2;
const NOBODY = -1;

/** The paths of one plan. `xy`: x and y of each robot by tick. @typedef {{n: number, ticks: number, xy: Int16Array, goals: Int16Array, shortest: Int32Array, steps: Uint32Array}} Paths */

/** The paths of a frame. @param {Uint8Array} bytes @returns {Paths} */
export function pathsOf(bytes) {
  const n = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  const next = (/** @type {number} */ from, /** @type {number} */ size) => bytes.slice(from, from + size).buffer;
  const ends = new Int16Array(next(4, 8 * n));
  const steps = new Uint32Array(next(4 + 8 * n, 4 * n));
  const shortest = new Int32Array(next(4 + 12 * n, 4 * n));
  let [at, last] = [2 * (4 + 16 * n), 0];
  for (const many of steps) last = Math.max(last, many);
  const goals = new Int16Array(2 * n);
  const xy = new Int16Array(2 * n * (last + 1));
  for (let r = 0; r < n; r++) {
    let [x, y] = [ends[4 * r], ends[4 * r + 1]];
    goals[2 * r] = ends[4 * r + 2];
    goals[2 * r + 1] = ends[4 * r + 3];
    for (let t = 0; t <= last; t++) {
      xy[2 * (t * n + r)] = x;
      xy[2 * (t * n + r) + 1] = y;
      if (t >= steps[r]) continue;
      const step = (bytes[at >> 1] >> (at & 1 ? 4 : 0)) & 15;
      at++;
      x += DX[step];
      y += DY[step];
    }
  }
  if (at > 2 * bytes.length) throw new Error("the paths of the fleet are not whole");
  return { n, ticks: last + 1, xy, goals, shortest, steps };
}

export class FleetRun {
  /** @param {Paths} paths @param {number} width cells of the map @param {number} height */
  constructor(paths, width, height) {
    this.n = paths.n;
    this.width = width;
    this.height = height;
    /** Ticks that are known, the first one included. */
    this.ticks = paths.ticks;
    this.xy = paths.xy;
    /** The goals that the robots were given first: a wall may take one for a while. */
    this.goals = paths.goals;
    /** Robots whose goals are walled off, of the last plan. @type {Set<number>} */
    this.lost = new Set();
    /** What was painted: at which tick, and what came of it. @type {Array<{tick: number, wall: boolean, what: string}>} */
    this.cuts = [];
    /** The tick at which each robot is on its goal for good; -1: not within what is known. */
    this.arrival = new Int32Array(this.n);
    /** By tick: robots on their goals for good, robots that wait, and of those, those that another robot hinders. */
    this.arrived = new Uint16Array(0);
    this.waiting = new Uint16Array(0);
    this.hindered = new Uint16Array(0);
    /** For each tick and robot who is in the cell that it enters next. */
    this.behind = new Int16Array(0);
    /** Ticks that robots waited, by cell. */
    this.heat = new Uint32Array(width * height);
    this._count();
  }

  get last() {
    return this.ticks - 1;
  }

  /** Take off what comes after a tick. @param {number} tick */
  cut(tick) {
    this.ticks = Math.min(this.ticks, tick + 1);
    this.xy = this.xy.slice(0, 2 * this.n * this.ticks);
    this._count();
  }

  /** Go on from the last tick by another plan. @param {Paths} paths @param {number[]} lost */
  join(paths, lost) {
    const before = 2 * this.n * this.last;
    const xy = new Int16Array(before + paths.xy.length);
    xy.set(this.xy.subarray(0, before));
    xy.set(paths.xy, before);
    this.xy = xy;
    this.ticks += paths.ticks - 1;
    this.lost = new Set(lost);
    this._count();
  }

  /** The number of a robot's cell. @param {number} tick @param {number} robot */
  cellAt(tick, robot) {
    const at = 2 * (Math.min(tick, this.last) * this.n + robot);
    return this.xy[at + 1] * this.width + this.xy[at];
  }

  /** Where every robot is and goes, four numbers each. @param {number} tick */
  agents(tick) {
    /** @type {number[]} */
    const out = [];
    for (let r = 0; r < this.n; r++) {
      const at = 2 * (tick * this.n + r);
      out.push(this.xy[at], this.xy[at + 1], this.goals[2 * r], this.goals[2 * r + 1]);
    }
    return out;
  }

  /** From the last tick to the first: when each arrives, who waits, and who is in the way. */
  _count() {
    const { n, ticks, goals, arrival, width } = this;
    this.arrived = new Uint16Array(ticks);
    this.waiting = new Uint16Array(ticks);
    this.hindered = new Uint16Array(ticks);
    this.behind = new Int16Array(ticks * n).fill(DRIVES);
    this.heat.fill(0);
    const next = new Int32Array(n).fill(-1);
    const who = new Int16Array(width * this.height).fill(-1);
    for (let r = 0; r < n; r++) {
      arrival[r] = this.cellAt(this.last, r) === goals[2 * r + 1] * width + goals[2 * r] ? 0 : -1;
    }
    for (let t = this.last - 1; t >= 0; t--) {
      for (let r = 0; r < n; r++) who[this.cellAt(t + 1, r)] = r;
      for (let r = 0; r < n; r++) {
        const [here, there] = [this.cellAt(t, r), this.cellAt(t + 1, r)];
        if (here !== there) {
          // What it enters here is what it waits for before.
          if (next[r] < 0 && arrival[r] === 0) arrival[r] = t + 1;
          next[r] = there;
        } else if (next[r] >= 0) {
          this.waiting[t]++;
          this.heat[here]++;
          const other = who[next[r]];
          this.behind[t * n + r] = other;
          if (other >= 0) this.hindered[t]++;
        } else if (arrival[r] < 0 && !this.lost.has(r)) {
          // It stands to the end, and not on its goal.
          this.behind[t * n + r] = NOBODY;
          this.waiting[t]++;
          this.heat[here]++;
        }
      }
      for (let r = 0; r < n; r++) who[this.cellAt(t + 1, r)] = -1;
    }
    for (let r = 0; r < n; r++) if (arrival[r] >= 0) this.arrived[arrival[r]]++;
    for (let t = 1; t < ticks; t++) this.arrived[t] += this.arrived[t - 1];
  }

  /** Sums over the run. `costs`: ticks until each robot is on its goal for good; robots that never are have none. */
  sums() {
    const { n, arrival } = this;
    let [costs, waits, hindered, on] = [0, 0, 0, 0];
    for (let r = 0; r < n; r++) {
      if (arrival[r] < 0) continue;
      costs += arrival[r];
      on++;
    }
    for (const many of this.waiting) waits += many;
    for (const many of this.hindered) hindered += many;
    return { costs, waits, hindered, arrived: on };
  }

  /** What one robot does. @param {number} robot */
  countsOf(robot) {
    let [steps, waits, hindered] = [0, 0, 0];
    for (let t = 0; t < this.last; t++) {
      const state = this.behind[t * this.n + robot];
      if (this.cellAt(t, robot) !== this.cellAt(t + 1, robot)) steps++;
      else if (state !== DRIVES) waits++;
      if (state >= 0) hindered++;
    }
    return { steps, waits, hindered };
  }

  /** What a robot is doing at a moment: 0 drives, 1 waits, 2 on its goal for good, 3 its goal is walled off and it stands. @param {number} tick @param {number} robot */
  stateAt(tick, robot) {
    if (this.arrival[robot] >= 0 && tick >= this.arrival[robot]) return 2;
    if (tick >= this.last) return this.lost.has(robot) ? 3 : 1;
    if (this.behind[tick * this.n + robot] !== DRIVES) return 1;
    return this.lost.has(robot) && this.cellAt(tick, robot) === this.cellAt(this.last, robot) && this.cellAt(tick + 1, robot) === this.cellAt(tick, robot) ? 3 : 0;
  }
}

// ---- its clock ----

const ICONS = { play: "M6 4l10 6-10 6z", pause: "M7 4v12M13 4v12", back: "M14 5l-7 5 7 5zM5 5v10", on: "M6 5l7 5-7 5zM15 5v10" };

/** It takes the place of the player of a single robot while a fleet is shown. */
export class FleetClock extends Clock {
  /** @param {Page} page @param {() => void} show called whenever another moment is shown */
  constructor(page, show) {
    super();
    this.page = page;
    this.last = 0;
    /** Nothing is known behind the last tick yet, so that it is waited for. */
    this.more = false;
    this._show = show;

    this.main = el("button", { type: "button", class: "btn primary main", "aria-keyshortcuts": "Space", onclick: () => this.toggle() });
    const step = (/** @type {number} */ by) => el("button", { type: "button", class: "btn icon", "aria-label": by < 0 ? "One tick back" : "One tick on", title: by < 0 ? "One tick back (,)" : "One tick on (.)", onclick: () => this.step(by) }, icon(by < 0 ? ICONS.back : ICONS.on));
    this.slider = el("input", { type: "range", class: "grow", min: 0, max: 0, step: 1, value: 0, "aria-label": "Tick" });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.slider.addEventListener("pointerdown", () => this.hold(true));
    for (const name of ["pointerup", "pointercancel"]) this.slider.addEventListener(name, () => this.hold(false));
    this.where = el("output", { class: "tl-where" });
    this.rates = el("select", { "aria-label": "Speed of play", title: "Speed of play" }, ...RATES.map((rate) => el("option", { value: rate }, `${rate}\u00d7`)));
    this.rates.value = "1";
    this.rates.addEventListener("change", () => this.rate(Number(this.rates.value)));
    this.bar = el("div", { class: "tl" }, el("div", { class: "tl-buttons" }, step(-1), this.main, step(1)), this.slider, this.where, this.rates);
    this._said = "";
    this._button();
    this.changed(0);
  }

  /** Other ticks are known. @param {number} last @param {boolean} [more] others are on their way */
  changed(last, more = false) {
    this.last = last;
    this.more = more;
    this.slider.max = String(last);
    this.slider.disabled = !last;
    this.main.disabled = !last && !more;
    this.tick = Math.min(this.tick, last);
    this._now();
    this._ask();
  }

  /** @override @param {number} t */
  seek(t) {
    this.tick = Math.min(Math.max(Number.isFinite(t) ? t : 0, 0), this.last);
    this._now();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.start();
  }

  start() {
    if (!this.last) return;
    if (this.tick >= this.last && !this.more) this.tick = 0;
    this.playing = true;
    this._before = 0;
    this._button();
    this._ask();
  }

  /** @override */
  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.tick = Math.min(Math.round(this.tick), this.last);
    this._button();
    this._now();
  }

  /** @param {number} f */
  rate(f) {
    this.speed = Math.min(Math.max(f, RATES[0]), RATES[RATES.length - 1]);
    this.rates.value = String(this.speed);
  }

  /** @override @param {number} passed */
  _go(passed) {
    if (this.tick < this.last) {
      this.tick = Math.min(this.tick + passed * PACE * this.speed, this.last);
      this._now();
    }
    if (this.tick >= this.last && !this.more) this.pause();
    else this._ask();
  }

  /** The bar, seldom: each change costs the browser a drawing of it. */
  _now() {
    const said = `${Math.floor(this.tick + 1e-6)} / ${this.last}${this.more ? "+" : ""}`;
    if (said !== this._said) {
      this._said = said;
      this.where.textContent = this.last || this.more ? said : "not planned yet";
      this.slider.value = String(Math.floor(this.tick + 1e-6));
      this.slider.setAttribute("aria-valuetext", `tick ${this.slider.value} of ${this.last}`);
    }
    this._show();
  }

  _button() {
    const label = this.playing ? "Pause" : "Play";
    this.main.setAttribute("aria-label", label);
    this.main.replaceChildren(icon(this.playing ? ICONS.pause : ICONS.play), label);
    this.main.classList.toggle("filled", !this.playing);
  }
}
