// Hover: what the cell under the pointer is, what it costs, and why the robot is as fast as it is there.

import { brief } from "./charts.js";
import { timeOf } from "./frames.js";
import { cheap, sourceOf } from "./layers.js";
import { el } from "./make.js";
import { nodeFacts } from "./nodes.js";

/** Milliseconds that the pointer rests before layers that are not shown are asked for. */
const REST = 250;
const GROUND = ["free", "wall", "unknown"];
const KIND = /** @type {Record<string, string>} */ ({ "random-walk": "random walker", patrol: "patrol", crossing: "crosser", recorded: "recorded body" });

/** Pieces of what is shown of a cell: name, value. @param {Page} page @param {Cell} cell @param {number} reach cells around it that count as it @returns {Array<[string, string]>} */
function facts(page, cell, reach = 0) {
  const { ground } = page;
  const [x, y] = cell;
  if (!ground || x < 0 || y < 0 || x >= ground.width || y >= ground.height) return [];
  const at = y * ground.width + x;
  /** @type {Array<[string, string]>} */
  const rows = [];
  const dear = ground.terrain?.[at] ? `, terrain ${brief((63 + ground.terrain[at]) / 63)}\u00d7` : "";
  rows.push([`${placeOf(ground, cell).map((v) => v.toFixed(2)).join(", ")} m`, GROUND[ground.cells[at]] + dear], ["Cell", `(${x}, ${y})`]);
  const source = sourceOf(page);
  for (const name of ["cost", "luciferin", "clearance", "expanded", "reach"]) {
    const layer = source.peek(name);
    const value = layer && layer.values.length > at ? layer.values[at] : 0;
    if (!layer || !value) continue;
    const v = layer.low + ((value - 1) / 254) * (layer.high - layer.low);
    if (name === "cost") rows.push(["Cost to the goal", `about ${brief(v)} cells, ${brief(v * ground.resolution)} m`]);
    else if (name === "luciferin") rows.push(["Luciferin", `about ${brief(v)}`]);
    else if (name === "clearance") rows.push(["Clearance", `about ${brief(v)} m`]);
    else if (name === "expanded") rows.push(["Expanded", `about number ${Math.round(v)}`]);
    else if (name === "reach") rows.push(["Reached", `in about ${Math.round(v)} ticks`]);
  }
  const body = bodyAt(page, x, y, reach);
  if (body) rows.push(["Obstacle", body]);
  rows.push(...(driven(page, x, y, reach) ?? node(page, x, y, reach) ?? []));
  return rows;
}

/** The middle of a cell in metres of the map frame, y up. @param {Ground} ground @param {Cell} cell @returns {[number, number]} */
function placeOf({ height, resolution, origin: [ox, oy, turn] }, [x, y]) {
  const [dx, dy] = [(x + 0.5) * resolution, (height - y - 0.5) * resolution];
  return [ox + dx * Math.cos(turn) - dy * Math.sin(turn), oy + dx * Math.sin(turn) + dy * Math.cos(turn)];
}

/** @param {Page} page @param {number} x @param {number} y @param {number} reach */
function bodyAt(page, x, y, reach) {
  const { bodies, kinds } = page.map.moment;
  if (!bodies) return "";
  for (let b = 0; b < kinds.length; b++) {
    // Not a number: not there. No comparison with it holds.
    if (!(Math.abs(bodies[2 * b] - x) <= reach + 0.5 && Math.abs(bodies[2 * b + 1] - y) <= reach + 0.5)) continue;
    const radius = page.run?.bodies[b]?.radius;
    return `${b}, ${KIND[kinds[b]] ?? kinds[b]}${radius ? `, radius ${brief(radius)} m` : ""}`;
  }
  return "";
}

/** Where the robot has been by now. @param {Page} page @param {number} x @param {number} y @param {number} reach @returns {Array<[string, string]> | null} */
function driven(page, x, y, reach) {
  const { run } = page;
  if (!run || run.ticks === 0) return null;
  const last = Math.min(Math.floor(page.play.tick + 1e-6), run.ticks - 1);
  const tick = nearest(run.robot, last + 1, x, y, reach);
  if (tick < 0 || last === 0) return null;
  return [[run.step || run.tick_s ? "Time" : "Tick", timeOf(run, tick)], ["Speed", `${brief(run.speed[tick])} ${run.units}: ${run.causes[run.cause[tick]] ?? ""}`]];
}

/** A node of the plan. @param {Page} page @param {number} x @param {number} y @param {number} reach @returns {Array<[string, string]> | null} */
function node(page, x, y, reach) {
  const { plan } = page;
  if (!plan?.cells?.length) return null;
  const speed = /** @type {any} */ (plan.speed);
  const n = plan.cells.length / 2;
  // Laws with places of their own (curves, waits) say where; else a node is a cell of the way.
  const places = speed?.xy ? speed.xy.flat() : plan.cells;
  const k = nearest(places, places.length / 2, x, y, reach);
  if (k < 0) return null;
  /** @type {Array<[string, string]>} */
  const rows = [["Node", `${k} of ${places.length / 2 - 1}`]];
  if (speed?.v && (speed.xy || speed.v.length === n)) rows.push(["Speed", `${brief(speed.v[k])} ${speed.units}: ${speed.why?.[k] ?? speed.cause[k]}`]);
  if (!speed?.xy) rows.push(...nodeFacts(plan, k));
  return rows;
}

/** Number of the last place nearest to a cell, within reach; -1: none. @param {ArrayLike<number>} places @param {number} n @param {number} x @param {number} y @param {number} reach */
function nearest(places, n, x, y, reach) {
  let best = (reach + 0.5) * (reach + 0.5) * 2 + 1e-9;
  let found = -1;
  for (let k = 0; k < n; k++) {
    const dx = places[2 * k] - x;
    const dy = places[2 * k + 1] - y;
    const far = dx * dx + dy * dy;
    if (far <= best) {
      best = far;
      found = k;
    }
  }
  return found;
}

/** The card beside the pointer, from one of its moves on. @param {Page} page @param {HTMLElement} element @param {PointerEvent} first */
export function askHover(page, element, first) {
  const { canvas, view } = page.map;
  const list = el("dl", { class: "facts" });
  element.setAttribute("aria-hidden", "true");
  element.append(list);
  let px = 0;
  let py = 0;
  let inside = false;
  let asked = false;
  let rest = 0;
  let announced = "";
  let box = canvas.getBoundingClientRect();
  /** Of the card, read when its rows change. */
  let size = { width: 0, height: 0 };

  const hide = () => {
    inside = false;
    clearTimeout(rest);
    element.hidden = true;
    announced = "";
  };
  const show = () => {
    asked = false;
    if (!inside) return;
    const cell = view.cellAt(px, py);
    // A way a few pixels off is meant all the same.
    const reach = Math.min(6, Math.floor(5 / view.scale));
    const rows = facts(page, cell, reach);
    const text = rows.map((row) => row.join(" ")).join("|");
    if (!rows.length) {
      element.hidden = true;
      announced = "";
      return;
    }
    if (text !== announced) {
      announced = text;
      list.replaceChildren(...rows.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));
      element.hidden = false;
      size = { width: element.offsetWidth, height: element.offsetHeight };
    }
    // On the side where there is room, never under the pointer.
    const x = px + 18 + size.width > view.width ? px - 14 - size.width : px + 18;
    const y = py + 18 + size.height > view.height ? py - 14 - size.height : py + 18;
    element.style.transform = `translate(${Math.round(Math.max(4, x))}px, ${Math.round(Math.max(4, y))}px)`;
  };
  const soon = () => {
    if (asked || !inside) return;
    asked = true;
    requestAnimationFrame(show);
  };
  const rested = () => {
    if (!inside || !cheap(page) || !page.store.scenario.goal || page.play.playing) return;
    const source = sourceOf(page);
    for (const name of ["cost", "luciferin"]) source.want(name);
  };
  canvas.addEventListener("pointerenter", () => {
    box = canvas.getBoundingClientRect();
  });
  const moved = (/** @type {PointerEvent} */ event) => {
    // A finger hides what it points at, and a pressed button draws or pans.
    if (event.pointerType === "touch" || event.buttons) {
      hide();
      return;
    }
    px = event.clientX - box.left;
    py = event.clientY - box.top;
    inside = true;
    clearTimeout(rest);
    rest = setTimeout(rested, REST);
    soon();
  };
  canvas.addEventListener("pointermove", moved);
  canvas.addEventListener("pointerleave", hide);
  canvas.addEventListener("pointerdown", hide);
  new ResizeObserver(() => (box = canvas.getBoundingClientRect())).observe(canvas);
  for (const name of ["plan", "ground", "layer-came"]) page.on(name, soon);
  let last = 0;
  page.on("tick", () => {
    // A moving picture changes what is under a resting pointer; ten times a second is enough to read.
    const now = performance.now();
    if (!inside || now - last < 100) return;
    last = now;
    soon();
  });
  // It may have left meanwhile.
  if (canvas.matches(":hover")) moved(first);
}
