// Results: what the controllers of a drive achieved, a column each, as `lampyris drive --controller` prints it.

import { LINES } from "./colours.js";
import { el, told } from "./make.js";

/** Measures of following a path: name, heading, digits. The names are those of lampyris.report.data.following. @type {Array<[string, string, number]>} */
const ROWS = [
  ["cross_track_max", "Off path, m", 3], ["cross_track_mean", "on average", 3], ["yaw_error_max", "Yaw error, rad", 2],
  ["yaw_error_mean", "on average", 2], ["jerk_mean", "Jerk, m/s³", 2], ["yaw_acceleration_mean", "Steering, rad/s²", 2],
  ["stops", "Stops", 0], ["contacts", "Contacts", 0],
];
/** What a heading means. @type {Record<string, string>} */
const ABOUT = {
  cross_track_max: "Greatest distance from the base to the nearest point of the path that it followed then", cross_track_mean: "The same distance, on average",
  yaw_error_max: "Greatest difference between the robot's yaw and that of the path",
  yaw_error_mean: "The same difference, on average", jerk_mean: "Changes of the acceleration, summed up, by the duration", yaw_acceleration_mean: "Changes of the yaw rate, summed up, by the duration: the steering effort",
  stops: "How often it came to rest before the end", contacts: "Contacts while it moved",
};

/** The table; null: nothing was driven along poses. @param {Run[]} runs @returns {HTMLElement | null} */
export function resultsOf(runs) {
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
        row("Time, s", (end) => told(end.duration, 1)),
        ...ROWS.map(([key, title, digits]) => row(title, (end) => told(end.following?.[key], digits), ABOUT[key])))),
    ...refused.map((one) => el("p", { class: "hint bad" }, `${one.label}: ${one.end?.sentence}`)));
}
