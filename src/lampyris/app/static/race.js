// Race: up to six planners explore the same map side by side on one clock, each in its own order, and then drive their
// paths with the times of the speed law.

import { ServerError } from "./api.js";
import { bytes, fileOf, safe, save } from "./filed.js";
import { asked } from "./flow.js";
import { json } from "./frames.js";
import { button, el, fill, formatted, sentence, tell } from "./make.js";
import { Tile } from "./racetile.js";
import { outlineOf } from "./shape.js";

/** @typedef {import("./racetile.js").Racer} Racer */

/** Seconds on the screen: of the search, and of the drive at most. */
const SEARCH_S = 8;
const DRIVE_S = 10;
/** Pixels beside a map, and below the maps of a row. */
const GAP = 10;
/** Pixels of a tile at least, where the window has them. */
const LEAST = 170;
/** Captions are written so many times a second. */
const CAPTIONS = 8;
const RATES = [0.25, 0.5, 1, 2, 4];
/** What a step of each kind of record is called. @type {Record<string, string>} */
const STEPS = { cells: "cells expanded", "jump points": "jump points expanded", poses: "poses expanded", "field and rings": "cells of field and rings", tree: "lines of the tree", none: "no order recorded" };

/** @param {Page} page @param {Who[]} planners */
export function askRace(page, planners) {
  if (!document.querySelector('link[href="/static/race.css"]')) document.head.append(el("link", { rel: "stylesheet", href: "/static/race.css" }));
  return new Race(page, planners.slice(0, page.hello.limits.racers));
}

class Race {
  /** @param {Page} page @param {Who[]} planners */
  constructor(page, planners) {
    this.page = page;
    const poses = planners.some(({ name }) => page.hello.planners_of_poses.some((/** @type {any} */ row) => row.name === name));
    /** With the headings of the ends, if anybody plans poses. */
    this.scenario = asked(page.store.scenario, poses, page.drives());
    this.planners = planners;
    /** @type {Tile[]} */
    this.tiles = [];
    this.moment = 0;
    this.playing = false;
    this.rate = 1;
    /** Whether the clock counts steps of the records, the same for all; else measured time. */
    this.bySteps = true;
    this._before = 0;
    this._captioned = 0;
    /** Height of the captions, pixels. */
    this._caption = 60;
    this.asked = new AbortController();
    this.stage = el("div", { class: "race-stage" });
    this.play = button("Play", () => this.toggle(), { class: "btn primary" });
    this.slider = el("input", { type: "range", min: 0, max: 1000, step: 1, value: 0, class: "grow", "aria-label": "Moment of the race", oninput: () => this.seek((this.length * Number(this.slider.value)) / 1000) });
    this.words = el("span", { class: "race-words" });
    this.clocks = [["steps", true], ["time", false]].map(([name, by]) => button(`${name}`, () => this.clock(Boolean(by)), { class: null, "aria-pressed": String(by),
      title: by ? "One step of every record at a time" : "Each record spread over its measured planning time" }));
    this.speed = el("select", { "aria-label": "Speed of the race", onchange: () => (this.rate = Number(this.speed.value)) }, ...RATES.map((rate) => el("option", { value: rate, selected: rate === 1 }, `${rate}×`)));
    this.kind = el("select", { "aria-label": "Kind of film" }, el("option", { value: "webp" }, "WebP"), ...[["gif", "GIF"], ["webm", "WebM"], ["mp4", "MP4"]].map(([kind, name]) => el("option", { value: kind }, name)));
    this.film = button("Export film", () => void this._film(), { disabled: true });
    this.said = el("p", { class: "hint", role: "status" });
    this.root = el("dialog", { class: "race", "aria-labelledby": "race-title" },
      el("div", { class: "row" }, el("h1", { id: "race-title" }, "Race"), el("span", { class: "hint grow" }, "Each planner expands cells in its own order, then its robot drives."), button("Close", () => this.root.close())),
      this.stage,
      el("div", { class: "row race-bar" }, this.play, this.slider, this.words, this.speed,
        el("span", { class: "hint" }, "Clock"), el("div", { class: "seg", role: "group", "aria-label": "Clock of the search" }, ...this.clocks), this.kind, this.film),
      this.said);
    document.body.append(this.root);
    page.play.hold?.(false);
    if (page.play.playing) page.play.toggle();
    this._sized = new ResizeObserver(() => this._layout());
    this._sized.observe(this.stage);
    const dark = (/** @type {boolean} */ on) => this.tiles.forEach((tile) => (tile.setDark(on), tile.resize(tile.scale, tile.room), this._draw(true)));
    page.on("theme", dark);
    this.root.addEventListener("close", () => this._close());
    this.root.addEventListener("keydown", (event) => this._key(event));
    this.root.showModal();
    this.ready = this._load();
  }

  /** The race as the server streams it. */
  async _load() {
    const { page, asked } = this;
    const ground = /** @type {Ground} */ (page.ground);
    tell(this.said, `0 of ${this.planners.length} planners`);
    this.play.disabled = this.slider.disabled = true;
    page.busy("race", true);
    try {
      /** @type {Racer | null} */
      let racer = null;
      for await (const { kind, bytes: data } of page.api.frames("/api/race", { scenario: this.scenario, planners: this.planners }, asked.signal)) {
        if (kind === "X") throw new ServerError(200, json(data));
        if (kind === "H") {
          racer = { jumps: [], note: "", steps: 0, field: 0, expansions: 0, cost: null, gap: null, any_angle: false, ms: 0, units: "", yaw: [], order: new Uint32Array(0), lines: new Float32Array(0), ...json(data) };
          if (racer?.outcome === "refused") this._add(racer, ground);
        }
        if (kind === "O" && racer) this._add(ordered(racer, data), ground);
      }
      tell(this.said, "");
      this.play.disabled = this.slider.disabled = this.film.disabled = false;
      const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
      if (still) this.seek(this.length);
      else this.toggle();
    } catch (error) {
      if (!asked.signal.aborted) tell(this.said, sentence(error), true);
    } finally {
      page.busy("race", false);
    }
  }

  /** @param {Racer} racer @param {Ground} ground */
  _add(racer, ground) {
    const { page } = this;
    const { robot } = this.scenario;
    const tile = new Tile(racer, ground, page.dark, outlineOf(robot, ground.resolution), Number(robot.radius ?? 0) / ground.resolution);
    this.tiles.push(tile);
    this.stage.append(tile.root);
    tell(this.said, `${this.tiles.length} of ${this.planners.length} planners`);
    const { start, goal } = page.store.scenario;
    tile.setEnds(/** @type {Cell} */ (start ?? ground.start ?? [0, 0]), /** @type {Cell} */ (goal ?? ground.goal ?? [0, 0]));
    this._layout();
  }

  /** Maps as large as they can be: the number of columns that leaves the largest cells. @param {boolean} [again] with the captions as they turned out */
  _layout(again = false) {
    const { tiles, stage } = this;
    const { ground } = this.page;
    if (!tiles.length || !ground) return;
    const wide = stage.clientWidth;
    const high = stage.clientHeight;
    const many = Math.max(this.planners.length, tiles.length);
    let best = { scale: 0, columns: 1, room: wide };
    for (let columns = 1; columns <= many; columns++) {
      const rows = Math.ceil(many / columns);
      const room = (wide - GAP * (columns - 1)) / columns - 2;
      const scale = Math.min(room / ground.width, ((high - GAP * (rows - 1)) / rows - this._caption - 2) / ground.height);
      if (scale > best.scale && (room >= LEAST || columns === 1)) best = { scale, columns, room };
    }
    // A small window scrolls rather than showing maps of no size.
    const scale = Math.max(best.scale, Math.min(LEAST, wide - 2) / Math.max(ground.width, ground.height));
    const room = Math.floor(Math.min(best.room, Math.max(ground.width * scale, 250)));
    stage.style.setProperty("--across", String(best.columns));
    for (const tile of tiles) tile.resize(scale, room);
    const caption = Math.max(...tiles.map((tile) => tile.root.firstElementChild?.clientHeight ?? 0));
    if (!again && Math.abs(caption - this._caption) > 2) {
      this._caption = caption;
      this._layout(true);
    } else this._draw(true);
  }

  /** Seconds of the search on the screen, and of all of it. */
  get search() {
    return this.tiles.some(({ racer }) => racer.steps) ? SEARCH_S : 0.5;
  }

  get driven() {
    return Math.max(0, ...this.tiles.map(({ racer }) => racer.t[racer.t.length - 1] ?? 0));
  }

  get length() {
    return this.search + Math.min(DRIVE_S, this.driven);
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.moment >= this.length) this.moment = 0;
    this.play.textContent = this.playing ? "Pause" : "Play";
    this._before = 0;
    if (this.playing) requestAnimationFrame((now) => this._frame(now));
  }

  /** @param {number} moment */
  seek(moment) {
    this.moment = Math.min(Math.max(moment, 0), this.length);
    this._draw(true);
  }

  /** @param {boolean} bySteps */
  clock(bySteps) {
    this.bySteps = bySteps;
    this.clocks.forEach((one, k) => one.setAttribute("aria-pressed", String(bySteps === (k === 0))));
    this._draw(true);
  }

  /** @param {number} now */
  _frame(now) {
    if (!this.playing || !this.root.open) return;
    if (this._before) this.moment += Math.min((now - this._before) / 1000, 0.25) * this.rate;
    this._before = now;
    if (this.moment >= this.length) {
      this.moment = this.length;
      this.toggle();
    }
    this._draw(!this.playing);
    if (this.playing) requestAnimationFrame((next) => this._frame(next));
  }

  /** @param {boolean} captions whether they are written in any case */
  _draw(captions) {
    const { search, tiles } = this;
    this.page.tell("race-frame");
    const part = Math.min(this.moment / search, 1);
    const most = Math.max(1, ...tiles.map(({ racer }) => racer.steps));
    const longest = Math.max(1e-6, ...tiles.map(({ racer }) => racer.ms));
    const pace = this.driven > DRIVE_S ? this.driven / DRIVE_S : 1;
    const driving = this.moment > search ? (this.moment - search) * pace : null;
    const written = captions || performance.now() - this._captioned > 1000 / CAPTIONS;
    if (written) this._captioned = performance.now();
    for (const tile of tiles) {
      const { racer } = tile;
      const done = this.bySteps ? (racer.steps ? part * most : part >= 1 ? 1 : 0) / Math.max(racer.steps, 1) : (part * longest) / Math.max(racer.ms, 1e-6);
      const over = done >= 1 || part >= 1;
      const steps = over ? racer.steps : done * racer.steps;
      tile.show(steps, over, driving);
      if (written) tile.say(stateOf(racer, over, driving), countOf(racer, steps));
    }
    if (!written) return;
    this.slider.value = String(Math.round((1000 * this.moment) / this.length));
    this.words.textContent = driving === null ? `Search ${Math.round(100 * part)} %` : `Drive ${formatted(driving, 1)} ${this._unit()}${pace > 1 ? `, ${formatted(pace, 1)}×` : ""}`;
    this.slider.setAttribute("aria-valuetext", this.words.textContent);
  }

  _unit() {
    return this.tiles.every(({ racer }) => !racer.units || racer.units.startsWith("m/s")) ? "s" : "transfers";
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const at = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.altKey || event.metaKey || at.closest("select")) return;
    const step = { ArrowLeft: -0.2, ArrowRight: 0.2, PageDown: -1, PageUp: 1 }[event.key];
    if (event.key === " " && !at.closest("button")) this.toggle();
    else if (step !== undefined) this.seek(this.moment + step);
    else if (event.key === "Home") this.seek(0);
    else if (event.key === "End") this.seek(this.length);
    else return;
    event.preventDefault();
  }

  /** The race as one film, drawn by the server. */
  async _film() {
    const { page } = this;
    const ending = this.kind.value;
    this.film.disabled = true;
    const name = `${safe(page.ground?.name ?? "") || "lampyris"}-race.${ending}`;
    tell(this.said, `Making ${name}.`);
    try {
      const body = { scenario: this.scenario, what: ending, settings: { race: true, planners: this.planners, clock: this.bySteps ? "steps" : "time" } };
      const file = await fileOf(page, body, ending, this.asked.signal, ({ what, done, of }) => tell(this.said, `Making ${name}: ${what}${of ? ` ${done} of ${of}` : ""}.`));
      save(file, name);
      tell(this.said, `Saved ${name}, ${bytes(file.size)}.`);
    } catch (error) {
      if (!this.asked.signal.aborted) tell(this.said, sentence(error), true);
    } finally {
      this.film.disabled = false;
    }
  }

  _close() {
    this.playing = false;
    this.asked.abort();
    this._sized.disconnect();
    this.root.remove();
    fill(this.stage);
    this.tiles = [];
  }
}

/** A racer with its order. @param {Racer} racer @param {Uint8Array} data */
function ordered(racer, data) {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const many = view.getUint32(4, true);
  const rest = data.slice(8).buffer;
  if (view.getUint16(2, true)) racer.lines = new Float32Array(rest);
  else racer.order = new Uint32Array(rest);
  if (many !== racer.steps) throw new Error(`${racer.label}: ${many} of ${racer.steps} steps`);
  return racer;
}

/** @param {Racer} racer @param {boolean} over @param {number | null} driving */
function stateOf(racer, over, driving) {
  if (racer.outcome === "refused") return "refused";
  // Where nothing was searched there is nothing to wait for.
  if (!over && (racer.steps || racer.cost !== null)) return "searching";
  if (racer.cost === null) return "no path";
  if (driving === null) return "path found";
  return driving >= racer.t[racer.t.length - 1] ? "arrived" : "driving";
}

/** @param {Racer} racer @param {number} steps */
function countOf(racer, steps) {
  if (racer.kind === "none") return racer.outcome === "refused" ? "" : STEPS.none;
  return `${formatted(Math.floor(steps))} of ${formatted(racer.steps)} ${STEPS[racer.kind] ?? "steps"}`;
}
