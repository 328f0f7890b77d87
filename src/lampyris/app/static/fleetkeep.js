// Kept fleets: what is shown of a fleet or a swarm as a file, and as text for an address and a draft.

import { bytes, fileOf, safe, save } from "./filed.js";
import { cellsOf, packed } from "./link.js";
import { button, el, sentence, tell } from "./make.js";

/** What, how its name ends, what it is, and whether there is one of a swarm. @type {Array<[string, string, string, boolean]>} */
const KINDS = [
  ["webp", "webp", "Film", true], ["webm", "webm", "WebM", true], ["mp4", "mp4", "MP4", true], ["replay", "html", "HTML", false], ["png", "png", "Picture", false], ["csv", "csv", "CSV", false], ["json", "json", "JSON", true], ["scenario", "yaml", "Scenario", false],
];
/** Fields of the panel that are kept, by what they are called in the text. */
const FIELDS = /** @type {const} */ (["planner", "seconds", "seed"]);
const OF_SWARMS = /** @type {const} */ (["sources", "method", "iterations", "noise"]);

/** The buttons that keep what is shown. @param {import("./fleet.js").Fleet} fleet @returns {HTMLElement} */
export function keeping(fleet) {
  const { page } = fleet;
  const words = el("p", { class: "hint", role: "status", id: "fleet-kept" });
  /** @type {AbortController | null} */
  let asked = null;
  const stop = button("Stop", () => asked?.abort(), { hidden: true });
  const keep = async (/** @type {string} */ what, /** @type {string} */ ending) => {
    const body = question(fleet);
    if (typeof body === "string") {
      tell(words, body, true);
      return;
    }
    const name = `${safe(page.ground?.name ?? "") || "fleet"}-${body.settings.fleet.robots}-robots.${ending}`;
    const began = performance.now();
    asked = new AbortController();
    page.busy("fleet-keep", true);
    buttons.forEach((one) => (one.disabled = true));
    stop.hidden = false;
    tell(words, `Making ${name}.`);
    try {
      const file = await fileOf(page, { ...body, what }, ending, asked.signal, ({ what: doing, done }) => tell(words, `Making ${name}: ${doing}${done ? ` ${done}` : ""}, ${Math.round((performance.now() - began) / 1000)} s.`));
      const said = what === "scenario" && (await file.slice(0, 1).text()) === "{" ? name.replace(/yaml$/, "json") : name;
      save(file, said);
      tell(words, `Saved ${said}, ${bytes(file.size)}.`);
    } catch (error) {
      tell(words, asked.signal.aborted ? "Stopped." : sentence(error), !asked.signal.aborted);
      if (!asked.signal.aborted) page.fault(error);
    } finally {
      asked = null;
      page.busy("fleet-keep", false);
      buttons.forEach((one) => (one.disabled = false));
      stop.hidden = true;
    }
  };
  const buttons = KINDS.map(([what, ending, name, swarms]) => button(name, () => void keep(what, ending), { class: swarms ? "btn" : "btn fleet-own" }));
  return el("div", { class: "stack" }, el("h2", null, "Export"), el("div", { class: "row" }, ...buttons, stop), words,
    el("p", { class: "hint" }, "The address bar holds map, walls and all numbers of this panel: copy it to send this on."));
}

/** What the server makes the file of; in words why there is none. @param {import("./fleet.js").Fleet} fleet @returns {Record<string, any> | string} */
function question(fleet) {
  const { map, run, end, swarm, asked } = fleet;
  if (!map) return "Choose a map first.";
  const scenario = fleet.scenario(map.cells);
  if (swarm.on) return swarm.run ? { scenario, settings: { fleet: { ...swarm.asked, swarm: swarm.asked.settings, settings: undefined } } } : "Simulate first.";
  if (!run || !end?.found) return "Plan first.";
  if (run.cuts.length) return "Walls were painted while the robots drove. Plan again, and keep that.";
  const { robots, planner, seed } = asked;
  return { scenario, settings: { fleet: { robots, planner, seed, iterations: end.iterations, sum_of_costs: end.sum_of_costs } } };
}

/** Everything of the panel, as a scenario of the page holds it. @param {import("./fleet.js").Fleet} fleet @returns {Record<string, any>} */
export function stateOf(fleet) {
  const { swarm, map } = fleet;
  const walls = new Map();
  for (const edit of fleet.edits) for (const [cell, value] of edit.cells) walls.set(cell, value);
  const width = map?.ground.width ?? 1;
  const painted = (/** @type {number} */ value) => packed([...walls].filter(([, one]) => one === value).map(([k]) => /** @type {Cell} */ ([k % width, Math.floor(k / width)])));
  return {
    swarm: swarm.on, robots: fleet._robots(), ...Object.fromEntries(FIELDS.map((name) => [name, fleet[name === "planner" ? "planners" : name].value])),
    ...Object.fromEntries(OF_SWARMS.map((name) => [name, swarm[name].value])), sight: swarm.sight.checked,
    planned: Boolean(swarm.on ? swarm.run : fleet.run), blocked: painted(1), freed: painted(0),
  };
}

/** Put it back; what is damaged stays as it is. @param {import("./fleet.js").Fleet} fleet @param {Record<string, any>} state */
export function restore(fleet, state) {
  const { swarm, map } = fleet;
  const put = (/** @type {HTMLInputElement | HTMLSelectElement} */ field, /** @type {unknown} */ value) => {
    if (typeof value !== "string" && typeof value !== "number") return;
    const before = field.value;
    field.value = String(value);
    if (field.value === "" || (field instanceof HTMLInputElement && !field.checkValidity())) field.value = before;
  };
  put(fleet.number, state.robots);
  put(fleet.slider, fleet.number.value);
  for (const name of FIELDS) put(fleet[name === "planner" ? "planners" : name], state[name]);
  fleet.about();
  for (const name of OF_SWARMS) put(swarm[name], state[name]);
  swarm.sight.checked = state.sight !== false;
  if (!map) return;
  const { width, height } = map.ground;
  const cells = new Map();
  for (const [list, value] of /** @type {Array<[any, number]>} */ ([[state.blocked, 1], [state.freed, 0]])) {
    for (const [x, y] of cellsOf(list)) if (x >= 0 && y >= 0 && x < width && y < height) cells.set(y * width + x, value);
  }
  fleet.edits = cells.size ? [{ tick: 0, cells }] : [];
}
