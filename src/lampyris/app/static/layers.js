// Layers: what colours the ground. One question in flight at most; when its answer has come, the newest one is asked.

import { levels } from "./colours.js";
import { brief } from "./charts.js";
import { json, layerOf } from "./frames.js";
import { ServerError } from "./api.js";
import { button, el, tell } from "./make.js";
import { brought } from "./later.js";

/** @typedef {{title: string, about: string, low: string, high: string, unit: (page: Page) => string}} Kind */

/** @type {Record<string, Kind>} */
const KINDS = {
  none: { title: "None", about: "Walls and ground alone.", low: "", high: "", unit: () => "" },
  cost: { title: "Cost", about: "What is left to pay from each cell to the goal.", low: "at the goal", high: "far", unit: () => "cells" },
  luciferin: { title: "Luciferin", about: "What AD-GSO steers by: it goes to cells that have less, and the goal has none. It has no unit.", low: "at the goal", high: "far", unit: () => "" },
  clearance: { title: "Clearance", about: "How far each cell is from the nearest wall.", low: "tight", high: "open", unit: () => "m" },
  expanded: { title: "Expanded", about: "", low: "first", high: "last", unit: () => "" },
  reach: { title: "Reachable set", about: "After how many ticks a moving obstacle could be there, from where they are at the shown tick.", low: "soon", high: "later", unit: () => "ticks" },
};
/**
 * Milliseconds after which an answer that is no longer wanted is stopped instead of waited for, as for plans: an engine
 * that is stopped may have to start anew. With 400 here a layer of a large map never came.
 */
const PATIENCE = 2500;
/** While an end is dragged nothing is stopped: milliseconds without a change after which it may be. */
const SETTLED = 300;
/** Milliseconds after which it is said that a layer is on its way, and between two sayings of how long. */
const SLOW = 350;
/** Cells of the largest map of which a hover fetches layers that are not shown. */
const SMALL = 300_000;

/** What the layer of inflation shows. */
const CLOSE = ": too close to a wall for the robot";

/** Where layers come from: one question at a time, the newest state of the shown one first. */
export class Source {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** The layer that is shown, by name. */
    this.shown = "none";
    /** Layers that have come, each with what they were asked for. @type {Map<string, {key: string, layer: Layer | null}>} */
    this._have = new Map();
    /** @type {Set<string>} */
    this._wanted = new Set();
    /** Grows when the scenario or the map changes. */
    this._state = 0;
    /** What the state is of. @type {unknown[]} */
    this._from = [];
    /** @type {AbortController | null} */
    this._abort = null;
    this._began = 0;
    /** State that is asked about, and the layer. */
    this._about = 0;
    this._of = "";
    this._timer = 0;
    /** Whose order the expanded cells are in. @type {{own: boolean, planner: string} | null} */
    this.order = null;
    /** Called when one is asked for, and with an empty name when nothing is any more. @type {(name: string) => void} */
    this.onAsked = () => {};
    /** Called when one has come. @type {(name: string, layer: Layer | null, fault: string) => void} */
    this.onLayer = () => {};
  }

  /** The scenario or its ground may be another: then what is held is old. */
  changed() {
    const from = [this.page.store.scenario, this.page.ground];
    if (from.every((one, k) => one === this._from[k])) return;
    this._from = from;
    this._state++;
  }

  /** It is another map. */
  forget() {
    this._have.clear();
  }

  /** @param {string} name */
  _key(name) {
    // Only reach moves from tick to tick; cost and luciferin change when walls do, and then the state does.
    const tick = name === "reach" ? Math.floor(this.page.play.tick + 1e-6) : 0;
    return `${this._state} ${tick} ${name === "reach" ? this.page.run?.ticks && 1 : ""}`;
  }

  /** The layer as it is now; null: it is not here yet. @param {string} name @returns {Layer | null} */
  peek(name) {
    const have = this._have.get(name);
    return have && have.key === this._key(name) ? have.layer : null;
  }

  /** Ask for a layer unless it is here or on its way. @param {string} name */
  want(name) {
    if (name === "none" || !this.page.ground || this.page.gone) return;
    const { start, goal } = this.page.store.scenario;
    if (!start || !goal) {
      // Where nothing can be asked nothing is shown, and nothing of before comes back.
      this._wanted.clear();
      if (this._have.delete(name) || name === this.shown) this.onLayer(name, null, "Set a start and a goal first.");
      return;
    }
    if (this._have.get(name)?.key === this._key(name)) return;
    this._wanted.add(name);
    if (!this._abort) {
      void this._ask();
      return;
    }
    clearTimeout(this._timer);
    const abort = this._abort;
    this._timer = window.setTimeout(() => {
      // Another tick is no reason to stop: where answers take long, none would ever come.
      const old = this._about !== this._state || (this._of !== this.shown && this._wanted.has(this.shown));
      if (old && this._abort === abort) abort.abort();
    }, Math.max(SETTLED, this._began + PATIENCE - performance.now()));
  }

  async _ask() {
    for (;;) {
      const name = this._wanted.has(this.shown) ? this.shown : [...this._wanted][0];
      if (!name) break;
      this._wanted.delete(name);
      const key = this._key(name);
      if (this._have.get(name)?.key === key) continue;
      const abort = new AbortController();
      this._abort = abort;
      this._began = performance.now();
      this._about = this._state;
      this._of = name;
      this.onAsked(name);
      let layer = null;
      let fault = "";
      let answered = true;
      try {
        layer = await this._fetch(name, abort.signal);
      } catch (error) {
        if (abort.signal.aborted) continue;
        fault = error instanceof ServerError ? error.message : "";
        answered = Boolean(fault);
        if (!answered) this.page.fault(error);
        // Where there is nothing to be had nobody asks again before something changes.
      }
      this._have.set(name, { key: answered ? key : "", layer });
      this.onLayer(name, layer, fault);
    }
    this._abort = null;
    this.onAsked("");
  }

  /** @param {string} name @param {AbortSignal} signal */
  async _fetch(name, signal) {
    const { page } = this;
    const tick = Math.floor(page.play.tick + 1e-6);
    const body = { scenario: page.asked(true), layer: name, obstacle_cells: name === "reach" ? bodiesNow(page) : null, tick };
    /** @type {Layer | null} */
    let layer = null;
    /** @type {any} */
    let head = null;
    // Read to its end: a question is in flight until then.
    for await (const { kind, bytes } of page.api.frames("/api/layer", body, signal)) {
      if (kind === "X") throw new ServerError(200, json(bytes));
      if (kind === "H") head = json(bytes);
      if (kind === "L") layer = layerOf(bytes);
    }
    // Nothing in any cell is no layer: a scale from 0 to 0 would say otherwise.
    if (!layer?.values.some(Boolean)) layer = null;
    if (head && name === "expanded") this.order = head;
    return layer;
  }
}

/** What a layer shows, in words. @param {Page} page @param {string} name @param {{own: boolean, planner: string} | null} order */
function aboutOf({ titleOf }, name, order) {
  if (name !== "expanded" || !order) return KINDS[name].about;
  if (order.own) return `In which order ${titleOf(order.planner)} expands the cells from the start, at the beginning.`;
  return `Not ${titleOf(order.planner)}'s own order, which is not recorded: in which order a search from the goal settles the cells, until it comes to the start.`;
}

/** Cells of the obstacles at the shown tick; null: none are shown. @param {Page} page @returns {Array<[number, number]> | null} */
function bodiesNow(page) {
  const { run, play } = page;
  const places = run?.places[Math.min(Math.floor(play.tick + 1e-6), run.ticks - 1)];
  if (!places) return null;
  /** @type {Array<[number, number]>} */
  const cells = [];
  for (let b = 0; b < places.length; b += 2) if (places[b] >= -0.5) cells.push([Math.round(places[b]), Math.round(places[b + 1])]);
  return cells;
}

class Layers {
  /** @param {Page} page @param {HTMLElement} element @param {Source} source */
  constructor(page, element, source) {
    this.page = page;
    this.source = source;
    this.buttons = Object.entries(KINDS).map(([name, kind]) => {
      const input = el("input", { type: "radio", name: "layer", value: name, onchange: () => this.choose(name) });
      input.checked = name === "none";
      return { name, input, label: el("label", { class: "ly-one", title: kind.about }, input, el("span", {}, kind.title)) };
    });
    this.about = el("p", { class: "hint", "aria-live": "polite" });
    this.ramp = el("canvas", { class: "ly-ramp", width: 254, height: 1, role: "img" });
    this.low = el("span", {});
    this.high = el("span", {});
    this.legend = el("div", { class: "ly-legend", hidden: true }, this.ramp, el("div", { class: "ly-ends" }, this.low, this.high));
    this.upTo = el("input", { type: "range", min: 0, max: 255, value: 255, "aria-label": "Cells expanded so far", oninput: () => this._put() });
    this.order = el("label", { class: "ly-order", hidden: true }, el("span", { class: "hint" }, "So far"), this.upTo);
    this.gates = el("input", { type: "checkbox", onchange: () => this._gates(true) });
    this.lines = el("input", { type: "checkbox", onchange: () => void this._contours() });
    this.strength = el("input", { type: "range", min: 10, max: 100, step: 5, value: 100, "aria-label": "Opacity of the layer", title: "Opacity of the layer", oninput: () => this._opacity() });
    this.close = el("input", { type: "checkbox", onchange: () => void this._overlays() });
    this.closeAbout = el("span", { class: "hint" }, CLOSE);
    // A robot without a radius is nowhere too close: the layer is empty then.
    page.on("gates", () => tell(this.closeAbout, this.close.checked && !page.map.over.has("inflation") ? ": none for this robot (its radius is set in the panel Planner)" : CLOSE));
    this.deep = button("In 3-D", () => void this._deep(), { title: "The layer as a landscape, with the robot on its path" });
    this.more = el("div", { class: "row ly-more", hidden: true }, el("label", { class: "ly-gates" }, this.lines, el("span", {}, "Contour lines")), this.deep, el("label", { class: "ly-gates" }, el("span", {}, "Opacity"), this.strength));
    element.classList.add("ly");
    this.words = el("span", { class: "hint", role: "status" });
    this.busy = el("div", { class: "ly-busy", hidden: true }, el("progress", { "aria-label": "The layer is loading" }), this.words);
    /** Of what is on its way: since when, and the clock that says so. */
    this._since = 0;
    this._clock = 0;
    element.append(
      el("h2", {}, "Layers"),
      el("div", { class: "ly-all", role: "radiogroup", "aria-label": "Layer" }, ...this.buttons.map((one) => one.label)),
      this.busy, this.legend, this.more, this.order, this.about,
      el("label", { class: "ly-gates" }, this.gates, el("span", {}, "Gates", el("span", { class: "hint" }, ": openings one cell wide"))),
      el("label", { class: "ly-gates" }, this.close, el("span", {}, "Inflation", this.closeAbout)),
    );
    /** Part of the expanded cells, and the one it was cut from. @type {Layer | null} */
    this._cut = null;
    this._gatesOf = "";
    /** @type {any[]} */
    this._inMap = [];
    this._ground = page.ground;

    source.onLayer = (name, layer, fault) => {
      page.tell("layer-came", name);
      if (name !== source.shown) return;
      this._put();
      this.about.textContent = fault || (layer ? aboutOf(page, name, source.order) : name === "reach" ? "Nothing moves." : `There is no ${KINDS[name].title.toLowerCase()} to show here.`);
      this.about.classList.toggle("bad", Boolean(fault));
    };
    source.onAsked = () => this._wait();
    const renew = () => {
      source.changed();
      source.want(source.shown);
      this._gates(false);
      void this._overlays();
    };
    page.on("plan", renew);
    page.on("ground", () => {
      // Of another map nothing is worth keeping.
      if (page.ground !== this._ground) source.forget();
      this._ground = page.ground;
      if (!this._held()) this._put();
      renew();
    });
    page.on("run", () => source.want(source.shown));
    page.on("tick", () => {
      if (source.shown === "reach") source.want("reach");
    });
    page.on("theme", () => {
      this._ramp();
      void this._overlays();
    });
    page.on("show-layer", (name) => this.choose(name));
  }

  /** Say that the shown layer is on its way, if it takes long; what is shown stays until it has come. */
  _wait() {
    const { source, page } = this;
    const on = source.shown !== "none" && (source._of === source.shown || source._wanted.has(source.shown)) && source._abort !== null;
    if (on === Boolean(this._clock)) return;
    clearInterval(this._clock);
    this._clock = 0;
    this.busy.hidden = true;
    if (!on) return;
    this._since = performance.now();
    this._clock = window.setInterval(() => {
      const seconds = Math.floor((performance.now() - this._since) / 1000);
      const size = page.ground ? ` of ${page.ground.width} × ${page.ground.height} cells` : "";
      this.words.textContent = `${KINDS[source.shown].title}${size}${seconds ? `: ${seconds} s` : ""}`;
      this.busy.hidden = false;
    }, SLOW);
  }

  /** @param {string} name */
  choose(name) {
    if (!(name in KINDS)) return;
    const { source } = this;
    source.shown = name;
    for (const one of this.buttons) one.input.checked = one.name === name;
    this.about.textContent = name === "none" ? "" : aboutOf(this.page, name, source.peek(name) ? source.order : null);
    this.about.classList.remove("bad");
    this.upTo.value = "255";
    source.want(name);
    this._wait();
    this._put();
    this.page.tell("layer", name);
  }

  /** The shown layer; while a newer one is on its way the old one, if it is of this map. */
  _held() {
    const { ground } = this.page;
    const held = this.source._have.get(this.source.shown)?.layer;
    return held && held.width === ground?.width && held.height === ground.height ? held : null;
  }

  /** The layer onto the map. */
  _put() {
    const { source, page } = this;
    const name = source.shown;
    let layer = this._held();
    this.order.hidden = !(layer && name === "expanded");
    const least = Number(this.upTo.value);
    if (layer && name === "expanded" && least < 255) layer = this._part(layer, least);
    page.map.setLayer(layer);
    this._ramp();
  }

  /** Lines of equal value over the layer. */
  async _contours() {
    const { map } = this.page;
    map.contours = null;
    if (this.lines.checked) {
      try {
        const [contours] = await brought(this.page, "contours");
        map.contours = (pen, view, layer, dark) => contours.askContours(pen, view, layer, dark);
      } catch (error) {
        this.lines.checked = false;
        this.page.fault(error);
      }
    }
    map.refresh();
    this.page.tell("gates");
  }

  _opacity() {
    const { map } = this.page;
    map.opacity = Number(this.strength.value) / 100;
    map.refresh();
  }

  /** What lies over the layer: inflation, if it is asked for, and, where walls separate start and goal, their two regions. */
  async _overlays() {
    const { page } = this;
    const { start, goal } = page.store.scenario;
    const wanted = { inflation: this.close.checked && start && goal && page.ground, regions: start && goal && /** @type {any} */ (page.plan)?.status === "no-path" };
    if (!page.map.over.size && !wanted.inflation && !wanted.regions) return;
    try {
      const [overlay] = await brought(page, "overlay");
      for (const [name, on] of Object.entries(wanted)) void (on ? overlay.askOverlay(page, name) : overlay.askNoOverlay(page, name));
    } catch (error) {
      page.fault(error);
    }
  }

  /** The layer as a landscape. */
  async _deep() {
    const layer = this._held();
    if (!layer) return;
    try {
      const [landscape] = await brought(this.page, "landscape");
      landscape.askLandscape(this.page, layer, KINDS[this.source.shown].title);
    } catch (error) {
      this.page.fault(error);
    }
  }

  /** Of the expanded cells the first ones. @param {Layer} layer @param {number} most */
  _part(layer, most) {
    if (!this._cut || this._cut.values.length !== layer.values.length) this._cut = { ...layer, values: new Uint8Array(layer.values.length) };
    const { values } = this._cut;
    for (let k = 0; k < values.length; k++) values[k] = layer.values[k] <= most ? layer.values[k] : 0;
    return this._cut;
  }

  _ramp() {
    const name = this.source.shown;
    const layer = this._held();
    this.legend.hidden = this.more.hidden = !layer;
    if (!layer) return;
    const pen = /** @type {CanvasRenderingContext2D} */ (this.ramp.getContext("2d"));
    const image = new ImageData(254, 1);
    new Uint32Array(image.data.buffer).set(levels("landscape", this.page.dark).subarray(1, 255));
    pen.putImageData(image, 0, 0);
    const kind = KINDS[name];
    const unit = kind.unit(this.page);
    const end = (/** @type {number} */ v, /** @type {string} */ word) => `${brief(v)}${unit ? ` ${unit}` : ""}${word ? `, ${word}` : ""}`;
    this.low.textContent = end(layer.low, kind.low);
    this.high.textContent = end(layer.high, kind.high);
    this.ramp.setAttribute("aria-label", `${kind.title} from ${this.low.textContent} to ${this.high.textContent}`);
  }

  /** @param {any[]} onPath */
  _putGates(onPath) {
    const { map } = this.page;
    map.gates = gatesOf({ in_map: this._inMap, on_path: onPath });
    map.refresh();
    this.page.tell("gates");
  }

  /** Gates of the whole map, found by the planner; asked for when map or robot change, not with each plan. @param {boolean} now */
  async _gates(now) {
    const { page } = this;
    const { map } = page;
    if (!this.gates.checked) {
      if (now && map.gates.length) {
        map.gates = [];
        map.refresh();
        page.tell("gates");
      }
      return;
    }
    const { scenario } = page.store;
    if (!scenario.start || !scenario.goal || !page.ground) return;
    const key = JSON.stringify([scenario.map, scenario.edits, scenario.robot, scenario.planner, scenario.preset]);
    if (key === this._gatesOf && !now) {
      // The same gates; which of them are on the path is another matter.
      this._putGates(page.plan?.gates?.on_path ?? []);
      return;
    }
    this._gatesOf = key;
    try {
      for await (const { kind, bytes } of page.api.frames("/api/plan", { scenario: page.asked(true), record: false, layers: ["gates"] })) {
        if (kind === "X") throw new ServerError(200, json(bytes));
        if (kind !== "H" && kind !== "Z") continue;
        const { gates } = json(bytes);
        if (!gates || !this.gates.checked || key !== this._gatesOf) continue;
        this._inMap = gates.in_map;
        this._putGates(gates.on_path);
        if (!map.gates.length && now) page.say(`${page.titleOf(scenario.planner.name)} finds no gates in this map.`);
      }
    } catch (error) {
      this._gatesOf = "";
      if (now) page.fault(error);
    }
  }
}

/** The gates of a plan as the map draws them. @param {{on_path: any[], in_map: any[]}} gates @returns {import("./still.js").Gate[]} */
export function gatesOf({ on_path, in_map }) {
  const met = new Set(on_path.map(({ cell }) => String(cell)));
  const others = in_map.filter(({ cell }) => !met.has(String(cell)));
  return [
    ...others.map(({ cell, dead_end }) => ({ at: cell, look: dead_end ? /** @type {const} */ ("end") : /** @type {const} */ ("gate") })),
    ...on_path.map(({ cell }) => ({ at: cell, look: /** @type {const} */ ("path") })),
  ];
}

/** @type {Source | null} */
let only = null;

/** Where the layers of the page come from. @param {Page} page */
export function sourceOf(page) {
  only ??= new Source(page);
  return only;
}

/** Whether a layer that is not shown is small enough to be fetched for a hover. @param {Page} page */
export function cheap(page) {
  return page.ground !== null && page.ground.width * page.ground.height <= SMALL;
}

/** @param {Page} page @param {HTMLElement} element */
export function mount(page, element) {
  new Layers(page, element, sourceOf(page));
}
