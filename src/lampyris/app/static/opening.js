// Opening: what is on the screen when the app is opened for the first time: an office of 12 by 7.5 m in 0.05 m cells,
// in which a robot drives in continuous time among people and brakes for one who crosses the corridor. And the worked
// example as a scenario, with the scenario that was there before its tour, which comes back even after the page was
// closed in the middle of it. The tour itself is loaded when somebody looks for it.

import { blank } from "./state.js";

const WIDTH = 240;
const HEIGHT = 150;
/** Seconds into the drive at which it is shown first: shortly before the robot brakes for somebody. */
const AT = 5;
/** Radius of a person, metres. */
const PERSON = 0.25;

/** Walls, then furniture: column, row, width and height of rectangles, cells. */
const BLOCKED = [
  [0, 0, 240, 2], [0, 148, 240, 2], [0, 0, 2, 150], [238, 0, 2, 150],
  [0, 52, 24, 2], [50, 52, 46, 2], [124, 52, 52, 2], [204, 52, 36, 2],
  [0, 98, 30, 2], [56, 98, 40, 2], [124, 98, 78, 2], [230, 98, 10, 2],
  [78, 0, 2, 54], [158, 0, 2, 54], [80, 98, 2, 52], [160, 98, 2, 52],
  [54, 8, 14, 28], [8, 8, 12, 30], [86, 8, 12, 30], [132, 14, 20, 16], [166, 8, 34, 14], [220, 20, 12, 24],
  [10, 122, 14, 22], [56, 116, 14, 24], [88, 122, 12, 22], [134, 116, 18, 24], [170, 116, 18, 24], [166, 142, 40, 6],
];

/** Where people walk to and fro. @type {Cell[][]} */
const PEOPLE = [
  [[110, 124], [110, 36]], [[190, 30], [190, 88]], [[43, 136], [43, 106]], [[130, 44], [152, 44]],
  [[126, 108], [154, 108]], [[12, 88], [12, 62]], [[212, 64], [230, 64]],
];

const ROBOT = { radius: 0.2, a_max: 0.8, d_max: 1.2 };
const DRIVE = { obstacle_speed: 0.9 };

/** What another map does not take over from this scene, as far as nobody has changed it. @param {Scenario} scenario @returns {Partial<Scenario>} */
export function dropped({ robot, drive }) {
  return { ...(robot === ROBOT ? { robot: {} } : {}), ...(drive === DRIVE ? { drive: undefined } : {}) };
}

/** The rows of the office. */
function office() {
  const cells = Array.from({ length: HEIGHT }, () => Array(WIDTH).fill("."));
  for (const [x, y, w, h] of BLOCKED) for (let j = y; j < y + h; j++) cells[j].fill("#", x, x + w);
  return cells.map((row) => row.join(""));
}

/** @returns {Scenario} */
function opening() {
  return {
    ...blank(), map: { rows: office(), name: "office", resolution: 0.05 }, start: [36, 40], goal: [216, 130],
    robot: ROBOT, drive: DRIVE,
    obstacles: PEOPLE.map((waypoints) => ({ kind: "patrol", waypoints, radius: PERSON })),
  };
}

/** Show it, driving; where the system asks for less motion it waits to be played. @param {Page} page */
export function open(page) {
  page.store.replace(opening(), false);
  const { scenario } = page.store;
  let begun = false;
  page.on("ground", () => {
    if (begun || !page.ground || page.store.scenario !== scenario) return;
    begun = true;
    page.tell("show-layer", "luciferin");
    const play = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (play) page.tell("opening");
    void page.simulate({ tick: Math.round(AT / 0.05), play });
  });
}

// ---- the worked example ----

const BEFORE = "lampyris-before-tour";

export const SIDE = 10;
export const START = /** @type {Cell} */ ([0, 9]);
export const GOAL = /** @type {Cell} */ ([7, 0]);

/** The worked example as a scenario. @returns {Scenario} */
export function scenario() {
  return { ...blank(), map: "guide", start: START, goal: GOAL, preset: "dissertation" };
}

/** A tour that was cut short by closing the page: what was there before it comes back. @param {Page} page */
export function begin(page) {
  const before = kept();
  if (!before) return;
  keep(null);
  if (!isGuide(page.store.scenario)) return;
  page.store.replace(before, false);
}

/** @param {Scenario} one */
function isGuide(one) {
  return JSON.stringify([one.map, one.start, one.goal]) === JSON.stringify(["guide", START, GOAL]);
}

/** What was there before the tour. @returns {Scenario | null} */
function kept() {
  try {
    const text = localStorage.getItem(BEFORE);
    return text ? JSON.parse(text) : null;
  } catch {
    return null;
  }
}

/** Keep it for after the tour; null: it is back. @param {Scenario | null} one */
export function keep(one) {
  try {
    if (one) localStorage.setItem(BEFORE, JSON.stringify(one));
    else localStorage.removeItem(BEFORE);
  } catch {
    // Undoing is left.
  }
}
