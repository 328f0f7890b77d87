// Viewer: the replay of one robot, in ticks or in continuous time.

import { mount as mountCharts } from "../static/charts.js";
import { mount as mountLegend } from "../static/legend.js";
import { mount as mountPlayer } from "../static/play.js";
import { mount as mountStatus } from "../static/status.js";
import { mount as mountTimeline } from "../static/timeline.js";
import { addCaps } from "../static/bounds.js";
import { driver } from "../static/driven.js";
import { addEvents, addSeen, addTicks, framesOf, json, layerOf, newRun } from "../static/frames.js";
import { applyEdits } from "../static/ground.js";
import { el } from "../static/make.js";
import { byId } from "../static/page.js";
import { outlineOf, radiusOf } from "../static/shape.js";
import { askUnseen } from "../static/unseen.js";
import { dataOf, keys, stageOf, unpacked } from "./stage.js";

async function main() {
  const data = dataOf();
  const page = await stageOf(data);
  const { map, store, ground } = page;
  if (!ground) return;
  const run = await runOf(data);
  store.scenario = { ...store.scenario, start: data.start, goal: data.goal, robot: data.robot, planner: { name: run.planner, settings: {} } };
  page.driver = driver;
  map.start = data.start;
  map.goal = data.goal;
  map.robotRadius = Number(data.robot.radius ?? 0) / ground.resolution;
  mountPlayer(page);
  mountTimeline(page, byId("timeline"));
  mountCharts(page, byId("charts"));
  mountStatus(page, byId("status"));
  mountLegend(page, byId("legend"));
  walls(page, data.edits);
  ways(page, data);
  await layer(page, data.layer);
  keys(page);
  page.run = run;
  if (run.seen) askUnseen(page);
  page.tell("run", { tick: 0, play: false });
  page.tell("end");
  document.body.classList.add("ready");
}

/** @param {import("./stage.js").Data} data @returns {Promise<Run>} */
async function runOf(data) {
  /** @type {Run} */
  let run = newRun({});
  for await (const { kind, bytes } of framesOf(unpacked(data.stream))) {
    if (kind === "H") run = newRun(json(bytes));
    else if (kind === "T") addTicks(bytes, run);
    else if (kind === "K") driver.addSamples(samplesOf(bytes), run);
    else if (kind === "E") addEvents(bytes, run);
    else if (kind === "C") addCaps(bytes, run);
    else if (kind === "U") addSeen(bytes, run);
    else if (kind === "Z") run.end = json(bytes);
  }
  run.done = true;
  return run;
}

/** Numbers of a frame are counted in these. */
const GRAIN = 2 ** -10;
/** So many of them: no obstacle at all. */
const FAR = 2 ** 24;

/** Samples as the server sends them, from second differences. @param {Uint8Array} bytes */
function samplesOf(bytes) {
  const head = new DataView(bytes.buffer, bytes.byteOffset);
  const [n, bodies] = [head.getUint16(4, true), head.getUint16(6, true)];
  const out = bytes.slice();
  const write = new DataView(out.buffer);
  let at = 8;
  for (const wide of [2, 1, 1, 0, 2 * bodies, 1]) {
    for (let c = 0; c < wide; c++) {
      let [value, step] = [0, 0];
      for (let k = 0; k < n; k++) {
        step += head.getInt32(at + 4 * (c * n + k), true);
        value += step;
        write.setFloat32(at + 4 * (k * wide + c), value === FAR ? Infinity : value * GRAIN, true);
      }
    }
    at += wide ? 4 * n * wide : n;
  }
  return out;
}

/** Walls that appear or go while it runs. @param {Page} page @param {Edit[]} edits */
function walls(page, edits) {
  const { ground, base, map } = page;
  if (!edits.length || !ground || !base) return;
  let shown = -2;
  page.on("tick", () => {
    const tick = page.play.tick > 0 || page.play.playing ? Math.floor(page.play.tick) + 1 : 0;
    if (!edits.some((edit) => edit.tick > shown !== edit.tick > tick) && shown !== -2) return;
    shown = tick;
    applyEdits(base, edits, tick, ground.width, ground.cells);
    map.setGround(ground);
  });
}

/** The path that is left, and the footprint. @param {Page} page @param {import("./stage.js").Data} data */
function ways(page, { robot, poses }) {
  const { map, ground } = page;
  const outline = ground && outlineOf(robot, ground.resolution);
  /** @type {number[][] | null} */
  let shown = null;
  page.on("tick", () => {
    const { run } = page;
    if (!run) return;
    const path = run.step ? driver.pathAt(run, page.play.tick) : [];
    if (path === shown) return;
    shown = path;
    map.ways = run.step ? driver.waysOf(run, path) : [{ cells: run.robot.subarray(0, 2 * run.ticks), faint: true }];
    map.shape = outline && { outline, poses: poses ? path : [], ends: [], faint: true, ...(poses ? {} : { around: radiusOf(outline) }) };
    map.refresh();
  });
}

/** What lies beneath the path. @param {Page} page @param {string} text */
async function layer(page, text) {
  if (!text) return;
  for await (const { bytes } of framesOf(unpacked(text))) {
    const found = layerOf(bytes);
    const box = el("input", { type: "checkbox", onchange: () => page.map.setLayer(box.checked ? found : null) });
    box.checked = true;
    byId("layers").append(el("label", { class: "row" }, box, `Layer: ${found.name}`));
    byId("layers").hidden = false;
    page.map.setLayer(found);
  }
}

void main();
