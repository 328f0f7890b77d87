// Stage: what replays of one robot and of a fleet have in common: their data, light and dark, the view, keys, what it is.

import { el, iconButton } from "../static/make.js";
import { Hand } from "../static/hand.js";
import { byId, makePage } from "../static/page.js";
import { fit, zoomBy, zoomButtons } from "../static/view.js";
import { loadGround } from "../static/ground.js";

const LOOK = "M10 3a7 7 0 1 0 0 14zM10 3a7 7 0 0 1 0 14";

/** @typedef {{name: string, digest: string, facts: Array<[string, string]>, ground: string, stream: string, layer: string, start: Cell, goal: Cell, robot: Record<string, any>, poses: boolean, edits: Edit[]}} Data */

/** What the file holds. @returns {Data} */
export function dataOf() {
  return JSON.parse(byId("run").textContent ?? "");
}

/** Packed bytes, as a stream. @param {string} text @returns {ReadableStream<Uint8Array>} */
export function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  return new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
}

/** The page with its map. @param {Data} data @param {(cell: Cell) => void} [click] @returns {Promise<Page>} */
export async function stageOf(data, click) {
  const page = makePage("");
  page.tool = click ? "ends" : "pan";
  const give = /** @type {any} */ ({ call: async () => new Response(unpacked(data.ground)) });
  const ground = await loadGround(give, "map");
  page.ground = ground;
  page.base = ground.cells.slice();
  themes(page);
  zoomButtons(page);
  new Hand(/** @type {any} */ ({ page, size: 1, click, cursor: { move() {} }, patrols: { end() {} } }));
  page.map.setGround(ground);
  page.map.fit();
  page.map.resize();
  page.tell("ground");
  about(data);
  return page;
}

/** Light or dark as the system, until somebody presses the button. @param {Page} page */
function themes(page) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const put = (/** @type {boolean} */ dark) => {
    page.dark = dark;
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    page.map.setDark(dark);
    page.tell("theme", dark);
  };
  byId("acts").append(iconButton("Light or dark (T)", LOOK, () => put(!page.dark)));
  system.addEventListener("change", () => put(system.matches));
  page.on("turn-theme", () => put(!page.dark));
  put(system.matches);
}

/** What was run, and the digest by which anybody can see that the program gives the same. @param {Data} data */
function about({ facts, digest }) {
  byId("facts").append(el("h2", null, "About this run"),
    el("dl", { class: "facts" }, ...facts.flatMap(([name, value]) => [el("dt", null, name), el("dd", null, value)])),
    el("h2", null, "Digest"), el("p", { class: "digest", id: "digest" }, digest),
    el("p", { class: "hint" }, "SHA-256 of the result as JSON (--json --no-timing, without the line's end): the same scenario gives the same."));
}

/** Keys of the whole page. @param {Page} page */
export function keys(page) {
  /** @type {Record<string, () => void>} */
  const acts = {
    " ": () => page.play.toggle(), ",": () => page.play.step(-1), ".": () => page.play.step(1), Home: () => page.play.seek(0), End: () => page.play.seek(page.play.last),
    "+": () => zoomBy(page, 1.4), "=": () => zoomBy(page, 1.4), "-": () => zoomBy(page, 1 / 1.4), 0: () => fit(page), t: () => page.tell("turn-theme"),
  };
  addEventListener("keydown", (event) => {
    const at = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.metaKey || event.altKey || at.closest("input, select, summary")) return;
    if (event.key === " " && at.closest("button")) return;
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
}
