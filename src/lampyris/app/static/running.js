// Running: one simulation at a time, as it comes. One that broke off because the server went away is owed: it is made
// again, and goes on where it stood, once there is a server.

import { Gone, ServerError } from "./api.js";
import { addCaps } from "./bounds.js";
import { addEvents, addSeen, addTicks, json, newRun } from "./frames.js";
import { brought } from "./later.js";
import { sentence, tapped } from "./make.js";

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
    const rivals = this._abort !== null && this.own !== null && this.own.step !== undefined;
    this._abort?.abort();
    this._abort = null;
    this._progress("");
    if (this.own && (!this.own.done || rivals)) {
      this.own.done = true;
      this._page.tell("end");
    }
    this._page.busy("run", false);
  }

  /** What a drive is computed for. @param {string} what */
  _progress(what) {
    const page = this._page;
    if (page.driving === what) return;
    page.driving = what;
    page.tell("progress");
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

  /**
   * A wall was painted: what was driven stays, what came after the moment is no longer so and is never shown. Until
   * the rest has come, the clock waits for it as for any run that is still coming.
   * @param {number} ticks that stay
   */
  _cut(ticks) {
    const { own: run, _page: page } = this;
    if (!run) return;
    run.ticks = Math.min(run.ticks, ticks);
    run.places.length = run.ticks;
    run.events = run.events.filter(({ tick }) => tick < run.ticks);
    run.end = null;
    run.cut = true;
    run.done = false;
    if (page.run === run) page.tell("run", { tick: Math.min(page.play.tick, run.ticks - 1), play: page.play.playing });
  }

  /** There is a server again: what it owes is made, and goes on from the moment that is shown. */
  again() {
    const { play, run } = this._page;
    const owed = this._owed;
    if (!owed) return;
    // Whoever has moved to another moment meanwhile wants to look at that.
    const waits = !run || play.tick === owed.tick || play.tick >= run.ticks - 1;
    void this.begin({ tick: play.tick, play: play.playing || (owed.play && waits), cut: run?.cut });
  }

  /** @param {{tick?: number, play?: boolean, cut?: boolean}} how `cut`: the run on the screen holds only up to that tick */
  async begin({ tick = 0, play = true, cut = false }) {
    const page = this._page;
    const { start, goal } = page.store.scenario;
    if (!start || !goal) {
      page.say(tapped("First click a start and a goal on the map."));
      return;
    }
    this._abort?.abort();
    const abort = new AbortController();
    this._abort = abort;
    this._owed = null;
    page.busy("run", true);
    if (cut) this._cut(Math.ceil(tick) + 1);
    // The old run may not go on past the moment from which the new one differs.
    if (tick > 0) page.play.hold(true);
    const scenario = page.asked();
    const drives = page.drives();
    if (drives) this._progress("Driving\u2026");
    const who = { planner: scenario.planner.name, law: scenario.law?.name };
    let run = newRun(who);
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
      if (drives && !page.driver) page.driver = (await brought(page, "driven"))[0].driver;
      for await (const { kind, bytes } of page.api.frames(drives ? "/api/drive" : "/api/simulate", { scenario }, abort.signal)) {
        if (abort.signal.aborted) return;
        if (kind === "X") throw new ServerError(200, json(bytes));
        else if (kind === "H") run = newRun({ ...who, ...json(bytes) });
        else if (kind === "T") addTicks(bytes, run);
        else if (kind === "D") page.driver?.addSamples(bytes, run);
        else if (kind === "E") addEvents(bytes, run);
        else if (kind === "C") addCaps(bytes, run);
        else if (kind === "U") addSeen(bytes, run);
        else if (kind === "P" && drives) this._progress(page.driver?.progressOf(json(bytes)) || page.driving);
        else if (kind === "Z") {
          run.end = json(bytes);
          run.done = true;
        }
        if (kind === "T" && published) page.tell("ticks");
        // The first tick alone is no run yet: it may end there, for want of a path.
        else if (run.ticks > Math.max(tick, 1) && !published) publish();
      }
      if (!published && run.ticks <= 1 && run.end && run.end.outcome !== "arrived") {
        this.clear();
        page.say(`There is nothing to play. ${run.end.sentence}`, "bad");
        return;
      }
      if (!published) publish();
      run.done = true;
      page.tell("end");
      if (drives) await page.driver?.rivals(page, run, scenario, abort.signal, (what) => this._progress(what));
    } catch (error) {
      if (abort.signal.aborted) return;
      run.done = true;
      page.play.hold(false);
      const gone = error instanceof Gone;
      if (gone) this._owed = { tick: page.play.tick, play: published ? page.play.playing : play };
      if (published) page.tell("end");
      else if (cut && this.own) {
        this._cut(Math.floor(page.play.tick) + 1);
        this.own.done = true;
        this.own.end = { sentence: `The run ends here: since then a wall was painted, and ${gone ? "there is no server to make the rest" : `the rest could not be made: ${sentence(error)}`}.` };
        page.tell("end");
      } else if (!gone) this.clear();
      page.fault(error);
    } finally {
      if (this._abort === abort) {
        this._abort = null;
        this._progress("");
        page.busy("run", false);
      }
    }
  }
}
