// Colours. The landscape is cividis, made pale; speeds are the middle of inferno: both can be read with the
// common kinds of colour blindness. Whatever could be distinguished by colour alone differs in shape as well.

/** @typedef {[number, number, number]} Rgb */

/** @type {Record<"light" | "dark", {free: Rgb, wall: Rgb, unknown: Rgb, unseen: Rgb, dear: Rgb, paper: string, ink: string, faint: string, line: string}>} */
export const THEMES = {
  light: {
    free: [250, 249, 245], wall: [32, 36, 44], unknown: [178, 184, 194], unseen: [138, 158, 188], dear: [186, 150, 96],
    paper: "#e7e7e4", ink: "#20242c", faint: "#6b7280", line: "#c9ccd2",
  },
  dark: {
    free: [88, 94, 106], wall: [5, 6, 8], unknown: [46, 50, 58], unseen: [20, 30, 62], dear: [196, 150, 84],
    paper: "#16181d", ink: "#eceef2", faint: "#9aa3b2", line: "#3a404b",
  },
};

// Start green, goal red, robot blue, walkers purple; amber is the fast end of a path alone. Found by search: start, goal, robot,
// walkers, path and the second planner are at least 19 apart in CIELAB, with and without each kind of colour blindness.
export const ROBOT = "#0072b2";
export const START = "#04a560";
export const GOAL = "#b6101c";
export const GOAL_ON_DARK = "#ff8a8f";
export const GATE = "#7b2cbf";

/** What lies on a landscape that numbers are read on: its darkest under black ink, its brightest under white. */
export const VEIL = { light: { colour: "#ffffff", share: 0.36 }, dark: { colour: "#16181d", share: 0.64 } };

/** Shape, colour and letter of each kind of obstacle, as in films. @type {Record<string, [string, string, string]>} */
export const KINDS = {
  "random-walk": ["circle", "#961084", "W"],
  patrol: ["square", "#323e3e", "P"],
  crossing: ["triangle", "#4e3320", "X"],
  recorded: ["diamond", "#3d0bc8", "R"],
};
export const OTHER_KIND = /** @type {[string, string, string]} */ (["circle", "#6e6e6e", "?"]);

/** Colour of what binds a speed, as in the reports' charts. @type {Record<string, string>} */
export const CAUSES = {
  start: "#626262", goal: "#3c3c3c", limit: "#0072b2", acceleration: "#009e73", braking: "#d55e00",
  clearance: "#e69f00", curvature: "#56b4e9", "moving obstacle": "#cc79a7", zone: "#f0e442",
  uncertainty: "#2e002b", undecided: "#000571", "blind area": "#882af5", "three speeds": "#811d00",
  danger: "#004b69", approach: "#e236f5", turn: "#f5b5a7", wait: "#ee1540", jerk: "#c9efd2",
  "yaw rate": "#3a742e",
  "no data": "#000000", obstacle: "#8208bc", waiting: "#a7ba6e", "ring 1": "#e69f00", "ring 2": "#f0e442",
  angle: "#56b4e9",
};

// Those that would drown in a dark panel. Searched for by chance as the others were: each at least 3 to 1 against
// the panel, and any two causes at least 12 apart in CIELAB with and without each kind of colour blindness.
/** @type {Record<string, string>} */
const ON_DARK = {
  start: "#c0c0c0", goal: "#fcfcfc", uncertainty: "#5bf67b", undecided: "#ac1bfd", "blind area": "#91be6e",
  "three speeds": "#89e3f4", danger: "#7c9557", "no data": "#6c6c6c",
  obstacle: "#d718bb", waiting: "#9f4d8a", "yaw rate": "#8adb50",
};

/** Colour of what binds a speed. @param {string} cause @param {boolean} [dark] */
export function causeColour(cause, dark = false) {
  return (dark && ON_DARK[cause]) || CAUSES[cause] || (dark ? "#c98bb0" : "#882255");
}

/**
 * What events are called, how they are marked on the timeline (a shape, and a colour for light and dark), and which
 * of them are worth a line of their own.
 * @type {Record<string, {shape: "bar" | "triangle" | "gate" | "cross" | "square" | "ring" | "star" | "tick", light: string, dark: string, label: string, tell: boolean}>}
 */
export const EVENTS = {
  appear: { shape: "tick", light: "#8b929c", dark: "#727b89", label: "obstacle appears", tell: false },
  wait: { shape: "bar", light: "#8b929c", dark: "#8b94a3", label: "waits", tell: false },
  replan: { shape: "triangle", light: "#7b2cbf", dark: "#c99cf5", label: "replans", tell: true },
  repair: { shape: "ring", light: "#00679f", dark: "#5cb8ef", label: "repairs the plan", tell: true },
  gate: { shape: "gate", light: "#7b2cbf", dark: "#c99cf5", label: "gate too narrow", tell: true },
  wall: { shape: "square", light: "#20242c", dark: "#eceef2", label: "wall painted", tell: true },
  opened: { shape: "square", light: "#b08a3c", dark: "#e3c27a", label: "wall erased", tell: true },
  hit: { shape: "cross", light: "#b3261e", dark: "#ff9c92", label: "hit", tell: true },
  contact: { shape: "cross", light: "#b3261e", dark: "#ff9c92", label: "collision", tell: true },
  fault: { shape: "cross", light: "#b3261e", dark: "#ff9c92", label: "fault", tell: true },
  arrive: { shape: "star", light: "#00694a", dark: "#63d3a7", label: "arrives", tell: true },
};

/** Colour and dash of the planners of a comparison, in their order. @type {Array<[string, number[]]>} */
export const LINES = [
  ["#0072b2", []], ["#d55e00", [8, 4]], ["#009e73", [2, 4]], ["#cc79a7", [10, 3, 2, 3]],
  ["#56b4e9", [6, 3]], ["#7a5c00", [3, 3]], ["#882af5", [12, 4]], ["#6b7280", [1, 3]],
];

// Corners of two perceptually uniform maps; what lies between is mixed. Measured against the full maps: at
// most 5 of 255 off in any channel.
const CIVIDIS = [
  [0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109], [112, 113, 115], [138, 134, 120],
  [165, 156, 116], [195, 179, 105], [225, 204, 85], [254, 232, 56],
];
const INFERNO = [
  [87, 16, 110], [120, 28, 109], [151, 39, 102], [181, 50, 90], [208, 66, 73], [229, 89, 52],
  [243, 120, 25], [251, 154, 6], [250, 193, 45],
];

/** @param {number[][]} corners @param {number} t 0 to 1 @returns {Rgb} */
function between(corners, t) {
  const at = Math.min(Math.max(t, 0), 1) * (corners.length - 1);
  const k = Math.min(Math.floor(at), corners.length - 2);
  const f = at - k;
  return /** @type {Rgb} */ (corners[k].map((v, i) => Math.round(v + (corners[k + 1][i] - v) * f)));
}

/**
 * A colour as one number of a canvas's pixels, for each of 256 levels; 0: nothing is drawn.
 * @param {"landscape" | "speed"} which
 * @param {boolean} dark
 */
export function levels(which, dark) {
  const table = new Uint32Array(256);
  for (let k = 1; k < 256; k++) {
    const t = (k - 1) / 254;
    let rgb = which === "speed" ? between(INFERNO, t) : between(CIVIDIS, 1 - (dark ? 0.88 : 0.92) * t);
    if (which === "landscape" && !dark) rgb = /** @type {Rgb} */ (rgb.map((v) => Math.round(0.72 * v + 71)));
    table[k] = packed(rgb);
  }
  return table;
}

/** @param {Rgb} rgb */
export function packed(rgb) {
  return ((255 << 24) | (rgb[2] << 16) | (rgb[1] << 8) | rgb[0]) >>> 0;
}

/** Colour of a speed, slow and dark to fast and bright. @param {number} share 0 to 1 */
export function speedColour(share) {
  const [r, g, b] = between(INFERNO, share);
  return `rgb(${r},${g},${b})`;
}
