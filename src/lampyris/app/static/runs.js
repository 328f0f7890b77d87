// Runs: of a comparison, gathered from one stream (the first seed of each planner and law is kept to be played, of the
// others only how they ended); where robots and obstacles of a run are at a moment, and where they look.

import { ServerError } from "./api.js";
import { addCaps } from "./bounds.js";
import { addEvents, addSeen, addTicks, json, newRun } from "./frames.js";

/**
 * What a comparison gave. `summary`: as studies tell it, with intervals; null until it has come.
 * @typedef {{runs: Run[], ended: number, summary: Record<string, any> | null}} Gathered
 */

/**
 * Read a comparison's frames.
 * @param {AsyncIterable<import("./frames.js").Frame>} frames
 * @param {(gathered: Gathered) => void} more called after each run that began or ended
 * @returns {Promise<Gathered>}
 */
export async function gather(frames, more) {
  /** @type {Gathered} */
  const all = { runs: [], ended: 0, summary: null };
  /** @type {Run | null} */
  let run = null;
  for await (const { kind, bytes } of frames) {
    if (kind === "T") {
      if (run) addTicks(bytes, run);
      continue;
    }
    if (kind === "U") {
      if (run) addSeen(bytes, run);
      continue;
    }
    if (kind === "C") {
      if (run) addCaps(bytes, run);
      continue;
    }
    if (kind === "E") {
      if (run) addEvents(bytes, run);
      continue;
    }
    const said = json(bytes);
    if (kind === "H") {
      run = newRun(said);
      const { label } = run;
      if (all.runs.some((one) => one.label === label)) run = null;
      else all.runs.push(run);
      more(all);
    } else if (kind === "Z" && run && !run.done) {
      run.end = said;
      run.done = true;
      all.ended += 1;
      more(all);
    } else if (kind === "Z") {
      all.ended += 1;
      more(all);
    } else if (kind === "S") {
      all.summary = said;
    } else if (kind === "X") {
      throw new ServerError(200, said);
    }
  }
  return all;
}

/**
 * A plan with its record, however the server splits it into frames.
 * @param {Page} page @param {Record<string, any>} body
 */
export async function planned(page, body) {
  /** @type {Record<string, any>} */
  let plan = {};
  for await (const { kind, bytes } of page.api.frames("/api/plan", body)) {
    if (kind === "X") throw new ServerError(200, json(bytes));
    if (kind === "H" || kind === "Z") plan = { ...plan, ...json(bytes) };
  }
  return plan;
}

/** Where a run's robot is at a moment, between ticks too; at its end it stays. @param {Run} run @param {number} t @returns {[number, number]} */
export function placeAt(run, t) {
  const last = Math.max(run.ticks - 1, 0);
  const k = Math.min(Math.floor(t), last);
  const f = k < last ? t - k : 0;
  const { robot } = run;
  return [robot[2 * k] + (f ? f * (robot[2 * k + 2] - robot[2 * k]) : 0), robot[2 * k + 1] + (f ? f * (robot[2 * k + 3] - robot[2 * k + 1]) : 0)];
}

/** Where the goal of a run is at a moment, between ticks too; null: it stands still. @param {Run} run @param {number} t @returns {[number, number] | null} */
export function goalAt({ goals }, t) {
  if (!goals) return null;
  const k = Math.min(Math.floor(t), goals.length - 1);
  const f = k + 1 < goals.length ? t - k : 0;
  const next = goals[f ? k + 1 : k];
  return [goals[k][0] + f * (next[0] - goals[k][0]), goals[k][1] + f * (next[1] - goals[k][1])];
}

/** What a robot with a sensor has seen at a moment; null: the map is known. @param {Run} run @param {number} t @returns {import("./cells.js").Seen | null} */
export function seenAt(run, t) {
  return run.seen && { run, t };
}

/** Outlines of a run's obstacles that are polygons; null: a disc. @param {Run} run @returns {Array<import("./shape.js").Outline | null>} */
export function outlinesOf(run) {
  return run.bodies.map(({ outline }) => outline ?? null);
}

/** Headings of a run's obstacles at a moment, radians counterclockwise on the screen; 0 of discs. @param {Run} run @param {number} t @returns {number[]} */
export function headingsAt(run, t) {
  const seconds = t * (run.step ?? 1);
  return run.bodies.map(({ outline, turns }, b) => {
    if (!turns?.length) return outline ? bodyHeading(run, b, t) : 0;
    let [low, high] = [0, turns.length - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (turns[middle][0] < seconds) low = middle + 1;
      else high = middle;
    }
    const [t1, yaw1] = turns[low];
    const [t0, yaw0] = turns[Math.max(low - 1, 0)];
    if (t1 <= t0) return yaw1;
    return yaw0 + Math.min((seconds - t0) / (t1 - t0), 1) * (yaw1 - yaw0);
  });
}

/** Where a run's bodies are; not there: NaN. @param {Run} run @param {number} t @returns {Float32Array} */
export function bodiesAt(run, t) {
  const out = new Float32Array(2 * run.bodies.length).fill(NaN);
  const last = Math.max(run.ticks - 1, 0);
  const k = Math.min(Math.floor(t), last);
  const f = k < last ? t - k : 0;
  const here = run.places[k];
  const next = f ? run.places[k + 1] : here;
  if (!here) return out;
  for (let b = 0; b < Math.min(out.length, here.length); b += 2) {
    if (here[b] < 0) continue;
    out[b] = here[b] + f * (next[b] - here[b]);
    out[b + 1] = here[b + 1] + f * (next[b + 1] - here[b + 1]);
  }
  return out;
}

// ---- headings in simulations in ticks ----

/** Ticks that are looked back for the last step. */
const BACK = 500;

/** @param {number} dx @param {number} dy */
function direction(dx, dy) {
  return dx || dy ? Math.atan2(-dy, dx) : null;
}

/**
 * A heading at a moment. @param {(k: number) => [number, number] | null} at a place at a tick; null: not there
 * @param {number} last the last tick @param {number} t @param {number} first the heading before anything has moved
 */
function headingBy(at, last, t, first) {
  const step = (/** @type {number} */ k) => {
    const [a, b] = [at(k), at(k + 1)];
    return a && b ? direction(b[0] - a[0], b[1] - a[1]) : null;
  };
  const now = Math.max(0, Math.min(Math.floor(t), last));
  let before = first;
  for (let k = now - 1; k >= Math.max(0, now - BACK); k--) {
    const found = step(k);
    if (found === null) continue;
    before = found;
    break;
  }
  const share = now < last ? t - now : 0;
  const next = share > 0 ? step(now) : null;
  if (next === null) return before;
  const turn = next - before;
  return before + share * Math.atan2(Math.sin(turn), Math.cos(turn));
}

/** Of an obstacle of a simulation in ticks. @param {Run} run @param {number} b its number @param {number} t */
function bodyHeading(run, b, t) {
  const at = (/** @type {number} */ k) => {
    const places = run.places[k];
    return places && 2 * b + 1 < places.length && places[2 * b] >= -0.75 ? /** @type {[number, number]} */ ([places[2 * b], places[2 * b + 1]]) : null;
  };
  return headingBy(at, run.ticks - 1, t, run.bodies[b].yaw ?? 0);
}

/** Of the robot of a simulation in ticks; it begins in the direction of its first step. @param {Run} run @param {number} t */
export function robotHeading(run, t) {
  const { robot, ticks } = run;
  let first = 0;
  for (let k = 0; k + 1 < ticks; k++) {
    const found = direction(robot[2 * k + 2] - robot[2 * k], robot[2 * k + 3] - robot[2 * k + 1]);
    if (found === null) continue;
    first = found;
    break;
  }
  return headingBy((k) => [robot[2 * k], robot[2 * k + 1]], ticks - 1, t, first);
}
