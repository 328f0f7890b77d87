// Running: one simulation at a time, as it comes. One that broke off because the server went away is owed: it is made
// again, and goes on where it stood, once there is a server.

import { Gone, ServerError } from "./api.js";
import { addCaps } from "./bounds.js";
import { addEvents, addTicks, json, newRun } from "./frames.js";

/** @typedef {import("./types.js").Page} Page */
/** @typedef {import("./types.js").Run} Run */
/** @typedef {import("./types.js").Scenario} Scenario */

/** Runs: one at a time. */
export class Runs {
  /** @param {Page} page */
  constructor(page) {
    this._page = page;
    /** @type {AbortController | null} */
    this._abort = null;
    /** The run of the scenario on the screen; a comparison puts others in its place. @type {Run | null} */
    this.own = null;
    /** A run that there was no server for: the moment it broke off, and whether it played. @type {{tick: number, play: boolean} | null} */
    this._owed = null;
  }

  get busy() {
    return this._abort !== null;
  }

  stop() {
    if (this._abort) this._page.play.hold(false);
    this._abort?.abort();
    this._abort = null;
    this._page.tell("busy", false);
  }

  /** The run is no longer the scenario's. */
  clear() {
    this.stop();
    this.own = null;
    this._owed = null;
    if (!this._page.run) return;
    this._page.run = null;
    this._page.tell("run", { tick: 0, play: false });
  }

  /** There is a server again: what it owes is made, and goes on from the moment that is shown. */
  again() {
    const { play, run } = this._page;
    const owed = this._owed;
    if (!owed) return;
    // Whoever has moved to another moment meanwhile wants to look at that.
    const waits = !run || play.tick === owed.tick || play.tick >= run.ticks - 1;
    void this.begin({ tick: play.tick, play: play.playing || (owed.play && waits) });
  }

  /** @param {{tick?: number, play?: boolean}} how */
  async begin({ tick = 0, play = true }) {
    const page = this._page;
    const { start, goal } = page.store.scenario;
    if (!start || !goal) {
      page.say("First click a start and a goal on the map.");
      return;
    }
    this._abort?.abort();
    const abort = new AbortController();
    this._abort = abort;
    this._owed = null;
    page.tell("busy", true);
    // The old run may not go on past the moment from which the new one differs.
    if (tick > 0) page.play.hold(true);
    const scenario = page.asked();
    const run = newRun({ planner: scenario.planner.name, law: scenario.law?.name });
    /** Shown once it has come as far as what is shown now: until there both are the same. */
    let published = false;
    const before = { tick: page.play.tick, playing: page.play.playing };
    const publish = () => {
      published = true;
      page.play.hold(false);
      this.own = run;
      page.run = run;
      // What a hand has done to the clock since it was asked for counts more than what was asked.
      const { play: clock } = page;
      const at = tick > 0 && clock.tick !== before.tick ? clock.tick : tick;
      const plays = tick > 0 && clock.playing !== before.playing ? clock.playing : play;
      page.tell("run", { tick: Math.min(at, Math.max(0, run.ticks - 1)), play: plays });
    };
    try {
      for await (const { kind, bytes } of page.api.frames("/api/simulate", { scenario }, abort.signal)) {
        if (abort.signal.aborted) return;
        if (kind === "X") throw new ServerError(200, json(bytes));
        else if (kind === "H") Object.assign(run, headOf(json(bytes)));
        else if (kind === "T") addTicks(bytes, run);
        else if (kind === "E") addEvents(bytes, run);
        else if (kind === "C") addCaps(bytes, run);
        else if (kind === "Z") {
          run.end = json(bytes);
          run.done = true;
        }
        if (kind === "T" && published) page.tell("ticks");
        else if (run.ticks > tick && !published) publish();
      }
      if (!published) publish();
      run.done = true;
      page.tell("end");
    } catch (error) {
      if (abort.signal.aborted) return;
      run.done = true;
      page.play.hold(false);
      if (error instanceof Gone) {
        const plays = published ? page.play.playing : play;
        // The old run goes through what was painted.
        if (!published && page.play.playing) page.play.toggle();
        this._owed = { tick: page.play.tick, play: plays };
      }
      if (published) page.tell("end");
      page.fault(error);
    } finally {
      if (this._abort === abort) {
        this._abort = null;
        page.tell("busy", false);
      }
    }
  }
}

/** What a header says of a run. @param {any} head */
function headOf(head) {
  const { job, planner, law, units, causes, bodies, label } = head;
  return Object.fromEntries(Object.entries({ job, planner, law, units, causes, bodies, label }).filter(([, v]) => v !== undefined));
}
