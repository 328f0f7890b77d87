// The clock of a run: which moment is shown. It fills the map's moment from the run, between ticks too.
//
// Nothing is allocated in a frame: places are written into arrays that are kept. Frames are asked for only while it
// plays; a seek draws one.

import { secondsOf } from "./frames.js";
import { goalAt, headingsAt, outlinesOf, robotHeading, seenAt } from "./runs.js";

/** Speeds of play; 1 is real time where ticks have a length. */
export const RATES = [0.25, 0.5, 1, 2, 5, 10, 20, 50];

/** Ticks a second at speed 1 where they have none. */
export const PACE = 8;

/** A simulation that lasts longer, in seconds, begins at a speed at which it is seen in this time. */
const SEEN = 30;

/** A frame that comes later than this was not late, the page was hidden: milliseconds. */
const LONGEST = 250;

/** What the clocks of one robot and of fleets have in common: frames are asked for while it plays and no hand holds it. */
export class Clock {
  constructor() {
    /** The shown moment; whole at a tick. @type {number} */
    this.tick = 0;
    this.playing = false;
    this.speed = 1;
    /** The hand is on the slider: time stands still until it lets go. */
    this.held = false;
    this._before = 0;
    this._asked = false;
    this._frame = (/** @type {number} */ now) => this._advance(now);
  }

  /** So many whole ticks on or back. @param {number} n */
  step(n) {
    this.pause();
    this.seek((n > 0 ? Math.floor(this.tick + 1e-6) : Math.ceil(this.tick - 1e-6)) + n);
  }

  /** Time stands still while the slider is held. @param {boolean} held */
  hold(held) {
    this.held = held;
    this._before = 0;
    this._ask();
  }

  _ask() {
    if (this._asked || !this.playing || this.held) return;
    this._asked = true;
    requestAnimationFrame(this._frame);
  }

  /** @param {number} now */
  _advance(now) {
    this._asked = false;
    if (!this.playing || this.held) return;
    const passed = this._before ? Math.min(now - this._before, LONGEST) : 0;
    this._before = now;
    this._go(passed / 1000);
  }

  /** The next moment, and another frame if there is more. @abstract @param {number} passed seconds since the frame before */
  _go(passed) {
    throw new Error(`_go(${passed})`);
  }

  /** Go to a moment. @abstract @param {number} t */
  seek(t) {
    throw new Error(`seek(${t})`);
  }

  /** @abstract */
  pause() {
    throw new Error("pause()");
  }
}

export class Player extends Clock {
  /** @param {Page} page */
  constructor(page) {
    super();
    this.page = page;
    this.tick = 0;
    /** Somebody has chosen the speed. */
    this._chosen = false;
    /** Bodies of the run that `kinds` and `radii` know, and the run. */
    this._known = 0;
    /** @type {Run | null} */
    this._run = null;
    /** @type {[number, number]} */
    this._robot = [0, 0];
    this._bodies = new Float32Array(0);
    /** Way driven so far, the last node between two ticks; its speeds, 0 to 1. */
    this._way = new Float32Array(0);
    this._shares = new Float32Array(0);
    this._copied = 0;
    this._fastest = 0;
    this._bent = -1;
    /** @type {import("./map.js").Way & {count: number, version: number}} */
    this._trail = { cells: this._way, shares: this._shares, count: 0, version: 0 };
    page.on("run", (detail) => this._begin(detail ?? {}));
    page.on("ticks", () => this._more());
    page.on("end", () => this._more());
    page.on("ground", () => (this._known = 0));
    page.on("plan", () => {
      if (page.run || page.map.moment.others?.length) return;
      this._wait();
      page.map.draw();
    });
  }

  /** The last tick there is so far. @returns {number} */
  get last() {
    return Math.max(0, (this.page.run?.ticks ?? 0) - 1);
  }

  /** @override @param {number} t */
  seek(t) {
    this.tick = this._within(t);
    this._show();
  }

  /** A moment before the end; while the run streams in, what is not there yet may be waited for. @param {number} t @returns {number} */
  _within(t) {
    const { run } = this.page;
    const last = run && !run.done ? Math.max(this.last, this.tick) : this.last;
    return Math.min(Math.max(Number.isFinite(t) ? t : 0, 0), last);
  }

  toggle() {
    if (this.page.driving && !this.page.run) this.page.stop();
    else if (this.playing) this.pause();
    else this.start();
  }

  start() {
    const { page } = this;
    if (!page.run) {
      void page.simulate({ tick: 0, play: true });
      return;
    }
    if (page.run.done && this.tick >= this.last) {
      // The rest could not be made: perhaps it can be now.
      if (page.run.cut) {
        void page.simulate({ tick: this.tick, play: true, cut: true });
        return;
      }
      this.tick = 0;
    }
    this.playing = true;
    this._before = 0;
    this._ask();
    page.tell("play", true);
  }

  /** @override */
  pause() {
    if (!this.playing) return;
    this.playing = false;
    // What is looked at is a moment with a number: its numbers, its link and a step from it are about the same.
    const whole = this._within(Math.round(this.tick));
    if (whole !== this.tick) {
      this.tick = whole;
      this._show();
    }
    this.page.tell("play", false);
  }

  /** @param {number} f 0.25 to 50 */
  rate(f) {
    this._chosen = true;
    this.speed = Math.min(Math.max(f, RATES[0]), RATES[RATES.length - 1]);
    this.page.tell("rate", this.speed);
  }

  /** @override @param {number} passed */
  _go(passed) {
    const { run } = this.page;
    if (!run) {
      this.pause();
      return;
    }
    // What has not been simulated yet is waited for, and the picture stands still.
    if (this.tick < this.last) {
      this.tick = Math.min(this.tick + passed * (secondsOf(run) ? 1 / secondsOf(run) : PACE) * this.speed, this.last);
      this._show();
    }
    if (run.done && this.tick >= this.last) this.pause();
    else this._ask();
  }

  /** Another run. @param {{tick?: number, play?: boolean}} how */
  _begin(how) {
    this._known = 0;
    this._copied = 0;
    this._fastest = 0;
    this._bent = -1;
    this._trail.version++;
    this._run = this.page.run;
    if (this._run && !this._run.step && !this._chosen) this._pace(this._run);
    this.tick = Math.max(0, how.tick ?? 0);
    const plays = Boolean(this._run) && (how.play ?? true);
    const changed = plays !== this.playing;
    this.playing = plays;
    this._before = 0;
    // A run made again after a wall was painted is the same up to this tick: the old picture stays until then.
    if (!this._run || this._run.ticks > this.tick) this._show();
    this._ask();
    if (changed) this.page.tell("play", plays);
  }

  /** A speed for a simulation that nobody has chosen one for, by how long it lasts or its plan does. @param {Run} run */
  _pace(run) {
    const speed = this.page.plan?.speed;
    const lasts = run.done ? run.ticks * secondsOf(run) : speed?.units === "m/s" && run.tick_s ? speed.t[speed.t.length - 1] : 0;
    this.speed = RATES.find((rate) => rate >= 1 && lasts / rate <= SEEN) ?? RATES[RATES.length - 1];
    this.page.tell("rate", this.speed);
  }

  _more() {
    const { run } = this.page;
    if (!run) return;
    if (run !== this._run) this._begin({ tick: this.tick, play: this.playing });
    this._copy(run);
    if (run.done && this.tick > this.last) this.tick = this.last;
    if (run.ticks > this.tick && !this.playing) this._show();
    this._ask();
  }

  /** Nodes and speeds of the way that have newly arrived. @param {Run} run */
  _copy(run) {
    if (run.ticks <= this._copied) return;
    if (2 * run.ticks > this._way.length) {
      const way = new Float32Array(Math.max(4 * run.ticks, 1024));
      way.set(this._way);
      this._way = way;
      const shares = new Float32Array(way.length / 2);
      shares.set(this._shares);
      this._shares = shares;
      this._trail.cells = way;
      this._trail.shares = run.rivals?.length ? null : shares;
    }
    let fastest = this._fastest;
    for (let k = this._copied; k < run.ticks; k++) {
      this._way[2 * k] = run.robot[2 * k];
      this._way[2 * k + 1] = run.robot[2 * k + 1];
      if (run.speed[k] > fastest) fastest = run.speed[k];
    }
    // A new fastest speed changes the colour of all.
    const from = fastest > this._fastest ? 0 : this._copied;
    if (fastest > this._fastest) this._trail.version++;
    this._fastest = fastest;
    for (let k = from; k < run.ticks; k++) this._shares[k] = fastest > 0 ? run.speed[k] / fastest : 0;
    this._copied = run.ticks;
  }

  /** The moment as the map draws it. */
  _show() {
    const { page } = this;
    const { run } = page;
    const { moment } = page.map;
    if (!run || run.ticks === 0) {
      moment.robot = null;
      moment.heading = undefined;
      if (moment.others?.some(({ heading }) => heading !== undefined)) moment.others = [];
      this._wait();
      moment.trail = null;
      moment.seen = moment.goal = null;
    } else {
      this._copy(run);
      const t = Math.min(this.tick, run.ticks - 1);
      const k = Math.min(Math.floor(t), run.ticks - 1);
      const f = k + 1 < run.ticks ? t - k : 0;
      this._place(run, k, f);
      moment.robot = this._robot;
      this._turn(run, k, f);
      this._obstacles(run, k, f);
      moment.bodies = this._bodies;
      moment.trail = this._trail;
      moment.seen = seenAt(run, t);
      moment.goal = goalAt(run, t);
    }
    page.map.draw();
    page.tell("tick", this.tick);
  }

  /** Obstacles where a run would begin, as the plan says. */
  _wait() {
    const { map, plan, ground } = this.page;
    const bodies = plan?.obstacle_specs ?? [];
    this._known = 0;
    map.moment.outlines = bodies.map(({ outline }) => outline ?? null);
    map.moment.headings = bodies.map(({ yaw }) => yaw ?? 0);
    map.moment.kinds = bodies.map(({ kind }) => kind);
    map.moment.radii = bodies.map(({ radius }) => radius / (ground?.resolution || 1));
    map.moment.bodies = map.moment.still = bodies.length ? Float32Array.from(bodies.flatMap(({ at }) => at)) : null;
  }

  /** The robot, and the way behind it. @param {Run} run @param {number} k @param {number} f */
  _place(run, k, f) {
    const { robot } = run;
    const way = this._way;
    // The node that the last frame bent goes back to its cell.
    if (this._bent >= 0 && this._bent < run.ticks) {
      way[2 * this._bent] = robot[2 * this._bent];
      way[2 * this._bent + 1] = robot[2 * this._bent + 1];
    }
    const x = robot[2 * k] + (f ? f * (robot[2 * k + 2] - robot[2 * k]) : 0);
    const y = robot[2 * k + 1] + (f ? f * (robot[2 * k + 3] - robot[2 * k + 1]) : 0);
    this._robot[0] = x;
    this._robot[1] = y;
    this._bent = f ? k + 1 : -1;
    if (f) {
      way[2 * k + 2] = x;
      way[2 * k + 3] = y;
    }
    this._trail.count = k + (f ? 2 : 1);
  }

  /** Headings of a drive, and where those of other controllers are. @param {Run} run @param {number} k @param {number} f */
  _turn(run, k, f) {
    const { moment } = this.page.map;
    const { shape } = this.page.map;
    moment.heading = shape?.outline && !run.step ? robotHeading(run, k + f) : undefined;
    if (!run.step) return;
    moment.heading = this.page.driver?.headingAt(run, k + f);
    moment.others = this.page.driver?.othersAt(run, k + f);
    const shares = run.rivals?.length ? null : this._shares;
    if (this._trail.shares !== shares) this._trail.version++;
    this._trail.shares = shares;
  }

  /** Everybody else. @param {Run} run @param {number} k @param {number} f */
  _obstacles(run, k, f) {
    const { moment } = this.page.map;
    if (this._known !== run.bodies.length || moment.kinds.length !== run.bodies.length) {
      const cell = this.page.ground?.resolution || 1;
      moment.kinds = run.bodies.map((body) => body.kind);
      moment.radii = run.bodies.map((body) => body.radius / cell);
      moment.outlines = outlinesOf(run);
      this._known = run.bodies.length;
      if (this._bodies.length !== 2 * this._known) this._bodies = new Float32Array(2 * this._known);
    }
    if (moment.outlines?.some(Boolean)) moment.headings = headingsAt(run, k + f);
    const out = this._bodies;
    const here = run.places[k];
    const next = f ? run.places[k + 1] : here;
    for (let b = 0; b < out.length; b += 2) {
      // Off the map: not there. Whoever comes at the next tick is not seen before it.
      if (b >= here.length || here[b] < -0.75) {
        out[b] = out[b + 1] = NaN;
      } else {
        out[b] = here[b] + f * (next[b] - here[b]);
        out[b + 1] = here[b + 1] + f * (next[b + 1] - here[b + 1]);
      }
    }
  }
}

/** @param {Page} page */
export function mount(page) {
  page.play = new Player(page);
}
