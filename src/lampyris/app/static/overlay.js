// Overlay: what is laid over a layer, a picture of a pixel a cell: cells that are too close to a wall for the robot's
// centre, and, where there is no path, what can be reached from the start and from the goal.

import { GOAL, GOAL_ON_DARK, START, THEMES, packed } from "./colours.js";
import { json, layerOf } from "./frames.js";

/** @typedef {"inflation" | "regions"} Name */

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
  if (apart && layer?.values.some(Boolean)) map.over.set(name, pictureOf(name, layer, page.dark));
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

/** @param {Name} name @param {Layer} layer @param {boolean} dark */
function pictureOf(name, { width, height, values }, dark) {
  const picture = document.createElement("canvas");
  picture.width = width;
  picture.height = height;
  const image = new ImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer);
  const tone = (/** @type {string} */ text, /** @type {number} */ share) =>
    ((packed(/** @type {[number, number, number]} */ ([1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16)))) & 0xffffff) | (Math.round(255 * share) << 24)) >>> 0;
  // Dark stripes: seen on the bright end of a layer and on bare ground, in both themes.
  const [close, between] = [tone(THEMES.light.ink, 0.6), tone(THEMES.light.ink, 0.22)];
  // Told apart by more than their colour: what the goal's side has is striped.
  const stripe = name === "inflation" ? Math.max(1, Math.round(Math.max(width, height) / 160)) : Math.max(2, Math.round(Math.max(width, height) / 60));
  // On dark ground a dark red is no colour to somebody with protanopia.
  const [start, goal, gap] = [tone(START, 0.34), tone(dark ? GOAL_ON_DARK : GOAL, 0.46), tone(dark ? GOAL_ON_DARK : GOAL, 0.12)];
  for (let k = 0; k < values.length; k++) {
    if (!values[k]) continue;
    const striped = ((k % width) + Math.floor(k / width)) % (2 * stripe) < stripe;
    pixels[k] = name === "inflation" ? (striped ? close : between) : values[k] === 1 ? start : striped ? goal : gap;
  }
  picture.getContext("2d")?.putImageData(image, 0, 0);
  return picture;
}
