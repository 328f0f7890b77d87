// Shape: footprints of robots, drawn along a path of poses and at its ends, and the handles that set the headings.

import { GOAL, ROBOT, START, THEMES } from "./colours.js";

/** @typedef {import("./view.js").View} View */
/** @typedef {CanvasRenderingContext2D} Pen */
/** Vertices in cells, x ahead and y to the left of the base. @typedef {Array<[number, number]>} Outline */
/** Start or goal with its heading, radians counterclockwise on the screen; null: any. @typedef {{end: "start" | "goal", at: Cell, heading: number | null}} End */
/** `poses`: x, y in cells, y down, the heading, and how the step to the next is driven: 1 ahead, -1 in reverse, 0 in place. `around`: radius of the disc around the robot that its planner plans for, cells. @typedef {{outline: Outline | null, poses: number[][], ends: End[], faint?: boolean, around?: number}} Shape */

/** Pixels from an end to its handle, at least; a handle keeps clear of the footprint. */
const ARM = 30;
/** Radius of a handle, pixels. */
export const HANDLE = 6;
/** Footprints of a path lie at least so many pixels apart. */
const APART = 26;

/** Whether the chosen planner plans poses. @param {Page} page */
export function plansPoses(page) {
  const { name } = page.store.scenario.planner;
  return page.hello.planners_of_poses.some((/** @type {any} */ row) => row.name === name);
}

/** Whether its plan says when the robot is where: drives follow these times, by no controller that steers. @param {Page} page */
export function plansTimes(page) {
  const { name } = page.store.scenario.planner;
  return page.hello.planners_of_poses.some((/** @type {any} */ row) => row.name === name && row.traits.sees_traffic);
}

/** The footprint of a scenario's robot; null: a disc. @param {Record<string, any>} robot @param {number} resolution @returns {Outline | null} */
export function outlineOf(robot, resolution) {
  const { rectangle, footprint } = robot;
  if (Array.isArray(rectangle) && rectangle.length === 2) return scaled(rectangleOf(rectangle[0], rectangle[1], rectangle[0] / 2), resolution);
  return Array.isArray(footprint) && footprint.length > 2 ? scaled(footprint, resolution) : null;
}

/** Distance from the base of an outline to its farthest vertex. @param {Outline} outline */
export function radiusOf(outline) {
  return Math.max(...outline.map(([x, y]) => Math.hypot(x, y)));
}

/** Vertices of a rectangle whose base is `rear` before its back edge. @param {number} length @param {number} width @param {number} rear @returns {Outline} */
export function rectangleOf(length, width, rear) {
  const half = width / 2;
  return [[length - rear, half], [-rear, half], [-rear, -half], [length - rear, -half]];
}

/** @param {Outline} vertices @param {number} resolution @returns {Outline} */
function scaled(vertices, resolution) {
  return vertices.map(([x, y]) => [x / resolution, y / resolution]);
}

/** Pixel of the handle of an end. @param {View} view @param {Shape} shape @param {End} end @returns {[number, number]} */
export function handleOf(view, shape, end) {
  const nose = Math.max(0, ...(shape.outline ?? []).map(([x]) => x)) * view.scale;
  const far = Math.max(ARM, nose + 12);
  const [x, y] = view.pixel(end.at[0], end.at[1]);
  const heading = end.heading ?? 0;
  return [x + far * Math.cos(heading), y - far * Math.sin(heading)];
}

/** @param {Pen} pen @param {View} view @param {Shape} shape @param {boolean} dark */
export function drawShape(pen, view, shape, dark) {
  const { outline, poses, ends, faint } = shape;
  if (outline) {
    pen.strokeStyle = THEMES[dark ? "dark" : "light"].ink;
    pen.fillStyle = ROBOT;
    pen.lineWidth = 1;
    let [px, py] = [Infinity, Infinity];
    for (const [cx, cy, heading] of poses) {
      const [x, y] = view.pixel(cx, cy);
      if (Math.hypot(x - px, y - py) < APART) continue;
      [px, py] = [x, y];
      traceOutline(pen, view, outline, cx, cy, heading);
      pen.globalAlpha = faint ? 0.05 : 0.12;
      pen.fill();
      pen.globalAlpha = faint ? 0.18 : 0.45;
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }
  if (!shape.around) drawReversals(pen, view, poses);
  for (const end of ends) {
    const colour = end.end === "start" ? START : GOAL;
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 2;
    if (outline && end.heading !== null) {
      traceOutline(pen, view, outline, end.at[0], end.at[1], end.heading);
      pen.stroke();
    }
    const [x, y] = view.pixel(end.at[0], end.at[1]);
    const [hx, hy] = handleOf(view, shape, end);
    if (end.heading === null) pen.setLineDash([3, 4]);
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(hx, hy);
    pen.stroke();
    pen.setLineDash([]);
    pen.beginPath();
    pen.arc(hx, hy, HANDLE, 0, 2 * Math.PI);
    if (end.heading === null) pen.fillStyle = THEMES[dark ? "dark" : "light"].paper;
    pen.fill();
    pen.stroke();
  }
}

/** What is driven in reverse, as a light dashed line on the path; where the robot changes direction, a diamond. @param {Pen} pen @param {View} view @param {number[][]} poses */
function drawReversals(pen, view, poses) {
  const places = poses.map(([x, y]) => view.pixel(x, y));
  for (const [colour, wide] of /** @type {const} */ ([["#20242c", 3], ["#fff", 1.8]])) {
    pen.strokeStyle = colour;
    pen.lineWidth = wide;
    pen.setLineDash([5, 5]);
    pen.beginPath();
    for (let k = 0; k + 1 < poses.length; k++) {
      if (poses[k][3] !== -1) continue;
      if (!k || poses[k - 1][3] !== -1) pen.moveTo(...places[k]);
      pen.lineTo(...places[k + 1]);
    }
    pen.stroke();
  }
  pen.setLineDash([]);
  pen.lineWidth = 1.5;
  let last = 0;
  poses.forEach(([, , , gear], k) => {
    if (gear && last && gear !== last) {
      const [x, y] = places[k];
      pen.beginPath();
      for (const [dx, dy] of [[0, -5.5], [5.5, 0], [0, 5.5], [-5.5, 0]]) pen.lineTo(x + dx, y + dy);
      pen.closePath();
      pen.fillStyle = "#fff";
      pen.strokeStyle = "#20242c";
      pen.fill();
      pen.stroke();
    }
    if (gear) last = gear;
  });
}

/** The path of an outline at a pose. @param {Pen} pen @param {View} view @param {Outline} outline @param {number} cx @param {number} cy @param {number} heading */
export function traceOutline(pen, view, outline, cx, cy, heading) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  pen.beginPath();
  for (const [x, y] of outline) pen.lineTo(...view.pixel(cx + x * cos - y * sin, cy - x * sin - y * cos));
  pen.closePath();
}
