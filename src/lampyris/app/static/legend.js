// Legend: what the marks on the map are, those that are there now; the colours of the way with their speeds.

import { GATE, GOAL, GOAL_ON_DARK, KINDS, LINES, OTHER_KIND, ROBOT, START, THEMES, speedColour } from "./colours.js";
import { brief } from "./charts.js";
import { el } from "./make.js";
import { gateMarks, goalMark, kindMark, robotMark, startMark } from "./marks.js";

const NAMES = /** @type {Record<string, string>} */ ({
  "random-walk": "random walker (W)", patrol: "patrol (P)", crossing: "crossing obstacle (X)", recorded: "recorded obstacle (R)",
});
/** As pictures name them. @type {Array<["path" | "gate" | "end", string]>} */
const GATES = [["path", "gate on the path"], ["gate", "gate"], ["end", "gate, dead end"]];
const SIDE = 18;

/** What stands on the map, in the order in which it is listed. @param {Page} page @returns {Array<[string, (pen: CanvasRenderingContext2D) => void]>} */
function marks(page) {
  const { ground, map, run, store } = page;
  const theme = THEMES[page.dark ? "dark" : "light"];
  const mid = SIDE / 2;
  /** @type {Array<[string, (pen: CanvasRenderingContext2D) => void]>} */
  const all = [];
  const cell = (/** @type {readonly number[]} */ [r, g, b]) => (/** @type {CanvasRenderingContext2D} */ pen) => {
    pen.fillStyle = `rgb(${r},${g},${b})`;
    pen.fillRect(2, 2, SIDE - 4, SIDE - 4);
    pen.strokeStyle = theme.faint;
    pen.strokeRect(2.5, 2.5, SIDE - 5, SIDE - 5);
  };
  if (store.scenario.start) all.push(["start", (pen) => startMark(pen, mid, mid, 7.5, START)]);
  if (store.scenario.goal) all.push(["goal", (pen) => goalMark(pen, mid, mid, 6.5, GOAL)]);
  if (run?.ticks) all.push(["robot", (pen) => robotMark(pen, mid, mid, 6.5, ROBOT)]);
  // Before a run those that wait for one.
  const kinds = new Set((run?.bodies ?? page.plan?.obstacle_specs ?? []).map((body) => body.kind));
  for (const kind of kinds) {
    const look = KINDS[kind] ?? OTHER_KIND;
    all.push([NAMES[kind] ?? kind, (pen) => kindMark(pen, look, SIDE, page.dark)]);
  }
  if (run?.ticks && !map.moment.others?.length) all.push(["remaining path, as driven", (pen) => dashes(pen, theme.ink)]);
  all.push(["wall", cell(theme.wall)]);
  if (ground?.cells.includes(2)) all.push(["unknown: counts as wall", cell(theme.unknown)]);
  if (run?.seen) all.push(["not yet seen", cell(theme.unseen)], ["range of the sensor", (pen) => circle(pen, theme.ink)]);
  if (ground?.terrain) all.push(["costly terrain", cell(theme.dear)]);
  if (map.contours && map.layer) all.push(["contour line of the layer", (pen) => dashes(pen, theme.ink, [])]);
  if (map.over.has("inflation")) {
    const { ink } = THEMES.light;
    all.push(["too close to a wall for the robot", (pen) => (cell(mixed(ink, 0.22, theme.free))(pen), stripes(pen, ink))]);
  }
  if (map.over.has("regions")) all.push(["reachable from the start", cell(mixed(START, 0.34, theme.free))], ["reachable from the goal", (pen) => stripes(pen, page.dark ? GOAL_ON_DARK : GOAL)]);
  if (map.beside) all.push(["optimal path (A*)", (pen) => dashes(pen, LINES[1][0], LINES[1][1])]);
  if (map.patrols.length) all.push(["path of a patrol", (pen) => dashes(pen, KINDS.patrol[1])]);
  for (const [look, name] of GATES) {
    if (map.gates.some((gate) => gate.look === look)) all.push([name, (pen) => gateMarks(pen, [[mid, mid]], 6, look, GATE)]);
  }
  return all;
}

/** A colour laid over another, as three numbers. @param {string} top @param {number} share @param {readonly number[]} low */
function mixed(top, share, low) {
  return [1, 3, 5].map((k, c) => Math.round(share * parseInt(top.slice(k, k + 2), 16) + (1 - share) * low[c]));
}

/** @param {CanvasRenderingContext2D} pen @param {string} colour */
function stripes(pen, colour) {
  pen.strokeStyle = colour;
  pen.globalAlpha = 0.5;
  pen.lineWidth = 3;
  pen.beginPath();
  for (let k = 4; k < 2 * SIDE - 4; k += 7) {
    pen.moveTo(Math.max(2, k - SIDE + 4), Math.min(k, SIDE - 2));
    pen.lineTo(Math.min(k, SIDE - 2), Math.max(2, k - SIDE + 4));
  }
  pen.stroke();
  pen.globalAlpha = 1;
}

/** @param {CanvasRenderingContext2D} pen @param {string} colour */
function circle(pen, colour) {
  pen.strokeStyle = colour;
  pen.lineWidth = 1;
  pen.setLineDash([3, 3]);
  pen.beginPath();
  pen.arc(SIDE / 2, SIDE / 2, SIDE / 2 - 2, 0, 2 * Math.PI);
  pen.stroke();
  pen.setLineDash([]);
}

/** @param {CanvasRenderingContext2D} pen @param {string} colour @param {number[]} [dash] */
function dashes(pen, colour, dash = [4, 3]) {
  pen.strokeStyle = colour;
  pen.lineWidth = 1.8;
  pen.setLineDash(dash);
  pen.beginPath();
  pen.moveTo(1, SIDE / 2);
  pen.lineTo(SIDE - 1, SIDE / 2);
  pen.stroke();
  pen.setLineDash([]);
}

/** Maximum speed of what is shown, with its unit; null: no speeds. @param {Page} page @returns {[number, string] | null} */
function fastest(page) {
  const { run, plan } = page;
  // Ways of a comparison are coloured by their planner.
  if (page.map.moment.others?.length) return null;
  if (run?.ticks) {
    let most = 0;
    for (let k = 0; k < run.ticks; k++) most = Math.max(most, run.speed[k]);
    return most ? [most, run.units] : null;
  }
  const speed = /** @type {any} */ (plan?.speed);
  // As the way is coloured: a plan in metres by the robot's top speed.
  if (speed?.units?.startsWith("m/s")) return [Number(page.store.scenario.robot.v_max ?? 1), speed.units];
  const most = speed?.v?.length ? speed.v.reduce((/** @type {number} */ a, /** @type {number} */ b) => Math.max(a, b), 0) : 0;
  return most ? [most, speed.units] : null;
}

/** @param {Page} page @param {HTMLElement} element */
export function mount(page, element) {
  const ramp = el("canvas", { class: "ly-ramp", width: 100, height: 1, role: "img" });
  const slow = el("span", {});
  const fast = el("span", {});
  const speeds = el("div", { class: "lg-speeds", hidden: true }, el("p", { class: "hint" }, "Colour of the path: its speed"), ramp, el("div", { class: "ly-ends" }, slow, fast));
  const list = el("ul", { class: "lg-marks" });
  element.classList.add("lg");
  element.append(el("h2", {}, "Key"), list, speeds);
  let shown = "";
  let due = 0;

  const draw = () => {
    due = 0;
    const all = marks(page);
    const most = page.run || page.plan?.cost !== null ? fastest(page) : null;
    const key = JSON.stringify([page.dark, all.map(([name]) => name), most]);
    if (key === shown) return;
    shown = key;
    list.replaceChildren(...all.map(([name, paint]) => {
      const canvas = el("canvas", { width: 2 * SIDE, height: 2 * SIDE, "aria-hidden": "true" });
      const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
      pen.scale(2, 2);
      paint(pen);
      return el("li", {}, canvas, el("span", {}, name));
    }));
    speeds.hidden = !most;
    if (!most) return;
    const pen = /** @type {CanvasRenderingContext2D} */ (ramp.getContext("2d"));
    for (let k = 0; k < 100; k++) {
      pen.fillStyle = speedColour(k / 99);
      pen.fillRect(k, 0, 1, 1);
    }
    slow.textContent = `0 ${most[1]}`;
    fast.textContent = `${brief(most[0])} ${most[1]}`;
    ramp.setAttribute("aria-label", `Colour of the path: dark at ${slow.textContent}, bright at ${fast.textContent}`);
  };
  const soon = () => {
    if (!due) due = window.setTimeout(draw, 200);
  };
  for (const name of ["plan", "run", "ticks", "end", "ground", "theme", "layer-came", "gates"]) page.on(name, soon);
  page.store.listen(soon);
  draw();
}
