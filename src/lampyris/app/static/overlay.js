// Overlay: what is laid over a layer: cells that are too close to a wall for the robot's
// centre, and, where there is no path, what can be reached from the start and from the goal.

import { drawCells, penOf } from "./cells.js";
import { GOAL, GOAL_ON_DARK, START, THEMES, packed } from "./colours.js";
import { json, layerOf } from "./frames.js";

/** @typedef {"inflation" | "regions"} Name */
/** @typedef {import("./view.js").View} View */

/** Pixels from stripe to stripe, to the right, and the width of each. */
const PERIOD = 11;
const STRIPE = 3;

/** What is on the way, by name. @type {Map<Name, AbortController>} */
const asked = new Map();

/** Lay it over the map as the scenario is now; what was asked for before is let go. @param {Page} page @param {Name} name */
export async function askOverlay(page, name) {
  asked.get(name)?.abort();
  const abort = new AbortController();
  asked.set(name, abort);
  const body = { scenario: page.asked(true), layer: name, obstacle_cells: null, tick: Math.floor(page.play.tick + 1e-6) };
  /** @type {Layer | null} */
  let layer = null;
  try {
    for await (const { kind, bytes } of page.api.frames("/api/layer", body, abort.signal)) {
      if (kind === "L") layer = layerOf(bytes);
      // The status says why there is no plan; a second sentence would say it again.
      if (kind === "X") console.info(json(bytes));
    }
  } catch (error) {
    if (!abort.signal.aborted) page.fault(error);
    return;
  }
  if (abort.signal.aborted) return;
  const { map } = page;
  const apart = name !== "regions" || (layer?.low === 1 && layer.high === 2);
  if (apart && layer?.values.some(Boolean)) map.over.set(name, drawingOf(name, layer, page.dark));
  else map.over.delete(name);
  map.refresh();
  page.tell("gates");
}

/** Off the map. @param {Page} page @param {Name} name */
export function askNoOverlay(page, name) {
  asked.get(name)?.abort();
  if (!page.map.over.delete(name)) return;
  page.map.refresh();
  page.tell("gates");
}

/** How it is drawn: cells in one tone, and stripes of an even width on the screen, at any scale. @param {Name} name @param {Layer} layer @param {boolean} dark */
function drawingOf(name, { width, height, values }, dark) {
  const cells = (/** @type {(value: number) => boolean} */ mine, /** @type {string} */ colour) => {
    const picture = document.createElement("canvas");
    picture.width = width;
    picture.height = height;
    const image = new ImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    const tone = packed(/** @type {[number, number, number]} */ ([1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16))));
    for (let k = 0; k < values.length; k++) if (values[k] && mine(values[k])) pixels[k] = tone;
    penOf(picture).putImageData(image, 0, 0);
    return picture;
  };
  if (name === "inflation") {
    // Dark stripes: seen on the bright end of a layer and on bare ground, in both themes.
    const close = cells(() => true, THEMES.light.ink);
    return (/** @type {CanvasRenderingContext2D} */ pen, /** @type {View} */ view) => hatched(pen, view, close, 0.22, 0.5);
  }
  // Told apart by more than their colour: what the goal's side has is striped. On dark ground a dark red is no colour to somebody with protanopia.
  const [start, goal] = [cells((value) => value === 1, START), cells((value) => value > 1, dark ? GOAL_ON_DARK : GOAL)];
  return (/** @type {CanvasRenderingContext2D} */ pen, /** @type {View} */ view) => {
    laid(pen, 0.34, () => drawCells(pen, view, start));
    hatched(pen, view, goal, 0.12, 0.4);
  };
}

/** @param {CanvasRenderingContext2D} pen @param {number} share @param {() => void} draw */
function laid(pen, share, draw) {
  pen.globalAlpha = share;
  draw();
  pen.globalAlpha = 1;
}

/** Where the stripes are cut to the cells. */
const sheet = document.createElement("canvas");

/** Cells of one tone, with stripes of it. @param {CanvasRenderingContext2D} pen @param {View} view @param {HTMLCanvasElement} cells @param {number} between share of the tone between stripes @param {number} more share of it that a stripe adds */
function hatched(pen, view, cells, between, more) {
  laid(pen, between, () => drawCells(pen, view, cells));
  const { width, height } = pen.canvas;
  const ratio = pen.getTransform().a;
  sheet.width = width;
  sheet.height = height;
  const own = penOf(sheet);
  own.setTransform(ratio, 0, 0, ratio, 0, 0);
  own.imageSmoothingEnabled = pen.imageSmoothingEnabled;
  own.lineWidth = STRIPE;
  own.beginPath();
  // Stripes stay where they are on the map while it is dragged.
  const [w, h] = [width / ratio, height / ratio];
  for (let at = (view.x + view.y) % PERIOD; at < w + h + PERIOD; at += PERIOD) {
    own.moveTo(at, 0);
    own.lineTo(at - h, h);
  }
  own.stroke();
  own.globalCompositeOperation = "source-in";
  drawCells(own, view, cells);
  laid(pen, more, () => pen.drawImage(sheet, 0, 0, w, h));
}
