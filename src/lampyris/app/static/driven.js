// Driven: what is done with drives in continuous time, and what is said of them. It is loaded with the first drive.

import { Gone, ServerError } from "./api.js";
import { brief } from "./charts.js";
import { LINES } from "./colours.js";
import { addEvents, grown, json, newRun } from "./frames.js";
import { el, sentence } from "./make.js";
import { placeAt } from "./runs.js";

/** Measures of following a path: name, heading, digits. The names are those of lampyris.report.data.following. @type {Array<[string, string, number]>} */
const ROWS = [
  ["cross_track_max", "Off path, m", 3], ["cross_track_mean", "on average", 3], ["yaw_error_max", "Yaw error, rad", 2],
  ["yaw_error_mean", "on average", 2], ["jerk_mean", "Jerk, m/s³", 2], ["yaw_acceleration_mean", "Steering, rad/s²", 2],
  ["stops", "Stops", 0], ["contacts", "Contacts", 0],
];
/** What a heading means. @type {Record<string, string>} */
const ABOUT = {
  cross_track_max: "Maximum distance from the base to the nearest point of the path that it followed then", cross_track_mean: "The same distance, on average",
  yaw_error_max: "Greatest difference between the robot's yaw and that of the path",
  yaw_error_mean: "The same difference, on average", jerk_mean: "Changes of the acceleration, summed up, by the duration", yaw_acceleration_mean: "Changes of the yaw rate, summed up, by the duration: the steering effort",
  stops: "How often it came to rest before the end", contacts: "Contacts while it moved",
};

/** The table; null: nothing was driven along poses. @param {Run[]} runs @returns {HTMLElement | null} */
function resultsOf(runs) {
  const ended = runs.filter(({ end }) => end);
  if (!ended.some(({ end }) => end?.following) && ended.length < 2) return null;
  const row = (/** @type {string} */ title, /** @type {(end: Record<string, any>) => string} */ value, /** @type {string} */ about = "") => el("tr", null,
    el("th", { scope: "row", title: about }, title), ...ended.map(({ end }) => el("td", null, value(/** @type {Record<string, any>} */ (end)))));
  const filter = ended.find(({ end }) => end?.safety_filter)?.end?.safety_filter;
  const refused = ended.filter(({ end }) => end?.outcome === "refused");
  return el("div", { class: "stack" },
    el("table", { class: "data measures controllers" },
      el("caption", null, filter ? `How the path was followed; commands ${filter === "none" ? "not filtered" : "filtered by the braking rule"}` : "How the path was followed"),
      el("thead", null, el("tr", null, el("td", null), ...ended.map((run) => {
        const head = el("th", { scope: "col" }, el("i", { class: "swatch" }), run.label);
        /** @type {HTMLElement} */ (head.firstElementChild).style.background = LINES[runs.indexOf(run) % LINES.length][0];
        return head;
      }))),
      el("tbody", null,
        row("Outcome", (end) => String(end.outcome).replaceAll("_", " ")),
        row("Time, s", (end) => rounded(end.duration, 1)),
        ...ROWS.map(([key, title, digits]) => row(title, (end) => rounded(end.following?.[key], digits), ABOUT[key])))),
    ...refused.map((one) => el("p", { class: "hint bad" }, `${one.label}: ${one.end?.sentence}`)));
}

/**
 * Samples of a drive, put into the run.
 * @param {Uint8Array} bytes
 * @param {Run} run
 */
function addSamples(bytes, run) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const first = view.getUint32(0, true);
  const n = view.getUint16(4, true);
  const bodies = view.getUint16(6, true);
  const size = 8 + n * (21 + 8 * bodies);
  if (first !== run.ticks || bytes.length !== size) throw new Error(`${n} samples from ${first} on in ${bytes.length} bytes`);
  const last = first + n;
  let at = 8;
  /** @param {number} many */
  const next = (many) => new Float32Array(bytes.slice(at, (at += 4 * many)).buffer);
  /** @type {Float32Array} */
  const robot = run.robot instanceof Float32Array ? run.robot : new Float32Array(0);
  run.robot = grown(robot, 2 * last);
  run.yaw = grown(run.yaw, last);
  run.speed = grown(run.speed, last);
  run.cause = grown(run.cause, last);
  run.near = grown(run.near, last);
  run.robot.set(next(2 * n), 2 * first);
  run.yaw.set(next(n), first);
  run.speed.set(next(n), first);
  run.cause.set(bytes.subarray(at, (at += n)), first);
  const places = next(2 * n * bodies);
  for (let k = 0; k < n; k++) run.places.push(places.subarray(2 * bodies * k, 2 * bodies * (k + 1)));
  run.near.set(next(n), first);
  run.ticks = last;
}

/** The robot's heading on the screen at a moment of a drive. @param {Run} run @param {number} t */
function headingAt(run, t) {
  const last = Math.max(run.ticks - 1, 0);
  const k = Math.min(Math.floor(t), last);
  return run.yaw[k] + (k < last ? (t - k) * (run.yaw[k + 1] - run.yaw[k]) : 0);
}

/** @type {number[][]} */
const NO_PATH = [];

/** The path that a drive follows at a moment. @param {Run} run @param {number} tick @returns {number[][]} */
function pathAt({ paths, step = 1 }, tick) {
  const over = paths.filter(({ t }) => t <= tick * step + 1e-9);
  return over.length ? over[over.length - 1].poses : NO_PATH;
}

/** What a drive follows, and what the drives of other controllers were. @param {Run} run @param {number[][]} path @returns {import("./marks.js").Way[]} */
function waysOf(run, path) {
  const cells = path.flatMap(([x, y]) => [x, y]);
  const others = run.rivals.map((one, k) => ({ cells: one.robot.subarray(0, 2 * one.ticks), colour: LINES[(k + 1) % LINES.length][0], wide: 2.5 }));
  return [{ cells, faint: true }, ...others];
}

/** What a drive measures beside the table of its controllers. @param {Record<string, any>} end @returns {Array<[string, string]>} */
function factsOf(end) {
  /** @type {Array<[string, string]>} */
  const rows = [];
  if (Number.isFinite(end.duration)) rows.push(["Took", `${brief(end.duration)} s${end.optimum ? `, ${(end.duration / end.optimum).toFixed(2)} x the optimum` : ""}`]);
  if (Number.isFinite(end.fastest)) rows.push(["Fastest", `${brief(end.fastest)} m/s`]);
  if (end.limited_by?.length) rows.push(["Limited by", end.limited_by.slice(0, 3).map((/** @type {[string, number]} */ [cause, share]) => `${cause} ${Math.round(100 * share)} %`).join(", ")]);
  return rows;
}

/** How a robot moves at a sample of a drive. @param {Run} run @param {number} tick @returns {"ahead" | "in reverse" | "turns"} */
function gearOf({ robot, yaw }, tick) {
  const from = Math.max(tick - 1, 0);
  const [dx, dy] = [robot[2 * tick] - robot[2 * from], robot[2 * tick + 1] - robot[2 * from + 1]];
  if (Math.abs(dx) + Math.abs(dy) < 1e-5) return Math.abs(yaw[tick] - yaw[from]) > 1e-5 ? "turns" : "ahead";
  // To the side is neither: an omnidirectional robot drives it as it drives ahead.
  return dx * Math.cos(yaw[tick]) - dy * Math.sin(yaw[tick]) < -0.7 * Math.hypot(dx, dy) ? "in reverse" : "ahead";
}

/** @param {number | null | undefined} value @param {number} digits */
function rounded(value, digits) {
  return Number.isFinite(value) ? String(Number(Number(value).toFixed(digits))) : "\u2013";
}

/** What the robot does where it does not drive ahead; empty: it does. @param {Run} run @param {number} tick */
function turned(run, tick) {
  if (!run.step || !(run.speed[tick] > 0)) return "";
  return { ahead: "", "in reverse": "The robot reverses.", turns: "The robot turns in place." }[gearOf(run, tick)];
}

/** Where the robots of other controllers are at a moment. @param {Run} run @param {number} t */
function othersAt(run, t) {
  return run.rivals.map((one, k) => ({ one, line: k + 1 })).filter(({ one }) => one.ticks > 0)
    .map(({ one, line }) => ({ robot: placeAt(one, t), line, heading: headingAt(one, t) }));
}

/** How far a drive is, in words; empty: that is not what was said. @param {{what: string, done?: number}} said */
function progressOf({ what, done }) {
  return what.startsWith("driving") ? `${what.replace("driving with ", "Driving, controller ")}${done ? `, ${done} s so far` : ""}\u2026` : "";
}

/**
 * The same drive by the other controllers, one after the other.
 * @param {Page} page @param {Run} run @param {Scenario} scenario @param {AbortSignal} signal @param {(what: string) => void} progress
 */
async function rivals(page, run, scenario, signal, progress) {
  for (const { name, settings } of page.store.scenario.controllers ?? []) {
    progress(`Driving, controller ${name}\u2026`);
    let rival = newRun({ controller: name });
    const drive = { ...scenario.drive, controller: name, controller_settings: settings };
    try {
      for await (const { kind, bytes } of page.api.frames("/api/drive", { scenario: { ...scenario, drive } }, signal)) {
        if (kind === "X") throw new ServerError(200, json(bytes));
        else if (kind === "H") rival = newRun(json(bytes));
        else if (kind === "D") addSamples(bytes, rival);
        else if (kind === "E") addEvents(bytes, rival);
        else if (kind === "P") progress(progressOf(json(bytes)) || page.driving);
        else if (kind === "Z") rival.end = json(bytes);
      }
    } catch (error) {
      if (signal.aborted || error instanceof Gone) throw error;
      // The others go on; the table says why this one has no numbers.
      rival.end = { outcome: "refused", sentence: sentence(error) };
      page.fault(error);
    }
    rival.done = true;
    run.rivals.push(rival);
    page.tell("end");
  }
}

export const driver = { addSamples, factsOf, headingAt, othersAt, pathAt, progressOf, resultsOf, rivals, turned, waysOf };
