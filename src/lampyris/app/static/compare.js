// Compare: planners and speed laws in the same world, overlaid on the map or side by side, played together.

import { LINES } from "./colours.js";
import { applyEdits } from "./ground.js";
import { brought } from "./later.js";
import { block, button, el, explained, fill, sentence, tell } from "./make.js";
import { MapView } from "./map.js";
import { charts, entrants, swatch, tableOf } from "./measures.js";
import { chosen, followed, labelOf, linked, meeting, textOf } from "./meeting.js";
import { bodiesAt, gather, goalAt, headingsAt, outlinesOf, placeAt, robotHeading, seenAt } from "./runs.js";

/** @typedef {import("./meeting.js").Entry} Entry */

const MOST = 8;
const MOST_SEEDS = 50;
/** What a world is made of: a comparison of another world is an old one. */
const WORLD = ["map", "start", "goal", "robot", "preset", "moves", "seed", "obstacles", "edits", "simulate"];

/** @param {Page} page @param {HTMLElement} into */
export function mount(page, into) {
  const place = block(into, "meeting", "Compare");
  if (place) new Comparison(page, place);
}

class Comparison {
  /** @param {Page} page @param {HTMLElement} into */
  constructor(page, into) {
    this.page = page;
    this.who = chosen(page);
    /** @type {import("./runs.js").Gathered | null} */
    this.found = null;
    this.beside = false;
    this.shown = false;
    /** @type {{run: Run | null, tick: number} | null} */
    this.before = null;
    /** Who met in it. @type {import("./meeting.js").Meeting | null} */
    this.met = null;
    /** @type {AbortController | null} */
    this.asked = null;
    this.mosaic = new Mosaic(page);
    /** @type {Array<() => void>} */
    this.offers = [];
    /** @type {import("./map.js").Way[]} */
    this.lines = [];
    this._build(into);
    page.met = () => textOf(page, this.shown || this.asked ? 1 + Number(this.beside) : 0);
    this._linked();
    page.on("token", () => this._linked());
    page.on("tick", (t) => this._move(t));
    page.on("run", () => {
      if (this.shown && page.run !== this.leader()) this.leave(false);
    });
    page.on("map", () => this._ways());
    // A plan that comes in draws its own way.
    page.on("plan", () => this._ways());
    page.on("theme", (dark) => this.mosaic.setDark(dark));
    page.store.listen((keys) => {
      this.offers.forEach((offer) => offer());
      if (keys.has("planner") && followed(page)) this._list();
      // Where no law was chosen the scenario's own counts.
      if (!WORLD.some((key) => keys.has(key)) && !(keys.has("law") && !this.who.laws.length)) return;
      if (this.asked) this.asked.abort();
      if (this.shown) this.leave(true);
      if (this.old) this.old.hidden = !this.found;
    });
  }

  /** @param {HTMLElement} into */
  _build(into) {
    const { page } = this;
    this.chosen = el("ul", { class: "entrants", "aria-label": "Planners that meet" });
    this.chosenLaws = el("ul", { class: "entrants", "aria-label": "Speed laws that meet" });
    this.seeds = el("input", { type: "number", id: "compare-seeds", min: 1, max: MOST_SEEDS, step: 1, value: this.who.seeds, oninput: () => this._seeds() });
    this.go = button("Compare", () => this._compare(), { class: "btn primary" });
    this.race = button("Race", () => void this._race(), { title: "Watch them search the map side by side, then drive" });
    this.end = button("Stop", () => this.asked?.abort(), { hidden: true });
    this.progress = el("p", { class: "hint", role: "status" });
    this.old = el("p", { class: "hint", hidden: true }, "The world has changed since: compare again.");
    this.both = [button("Overlaid", () => this._look(false), { class: null }), button("Side by side", () => this._look(true), { class: null })];
    this.close = button("Leave", () => this.leave(true));
    this.bar = el("div", { class: "row", hidden: true }, el("div", { class: "seg", role: "group", "aria-label": "How to show it" }, ...this.both), this.close);
    this.whose = el("p", { class: "hint", hidden: true });
    this.again = button("Show it", () => this._show(), { hidden: true });
    this.results = el("div", { class: "results" });
    this.sheet = button("Results page", () => void this._sheet(), { title: "Table, intervals, settings and studies in a large window" });
    into.append(
      el("h3", null, "Planners"), this.chosen,
      this._adder("Add a planner", page.hello.planners, page.hello.planners_of_poses, () => this.who.planners, () => page.store.scenario.planner),
      el("h3", null, "Speed laws"), this.chosenLaws,
      this._adder("Add a speed law", page.hello.laws, [], () => this.who.laws, () => page.store.scenario.law),
      el("div", { class: "field" }, el("label", { for: "compare-seeds" }, "seeds"), this.seeds,
        el("p", { class: "hint" }, "Several seeds give means with intervals; the first is played.")),
      el("div", { class: "row" }, this.go, this.race, this.end, this.again, this.sheet), this.progress, this.old, this.bar, this.whose, this.results,
    );
    this._list();
  }

  /** @param {string} title @param {any[]} rows @param {any[]} poses planners of poses @param {() => Entry[]} list @param {() => Who | null} present */
  _adder(title, rows, poses, list, present) {
    const options = (/** @type {any[]} */ some) => some.map((row) => el("option", { value: row.name }, explained(row)));
    const pick = el("select", { "aria-label": title, class: "grow" }, ...options(rows), poses.length ? el("optgroup", { label: "Planners of poses: all drive in continuous time" }, ...options(poses)) : null);
    const add = (/** @type {Who} */ who) => {
      const label = labelOf(this.page, who);
      if (list().some((one) => one.label === label)) this.page.say(`${label} is in the list already.`);
      else if (list().length >= MOST) this.page.say(`At most ${MOST} at once: more is a study.`);
      else list().push({ ...who, label });
      this._list();
    };
    const own = button("", () => add(/** @type {Who} */ (present())), { class: "btn quiet own", title: "As it is set now" });
    const offer = () => {
      const who = present();
      own.hidden = !who || list().some((one) => one.label === labelOf(this.page, who));
      own.textContent = who ? `Add ${labelOf(this.page, who)}` : "";
    };
    this.offers.push(offer);
    return el("div", null, el("div", { class: "row adder" }, pick, button("Add", () => add({ name: pick.value, settings: {} }))), own);
  }

  _list() {
    const draw = (/** @type {HTMLElement} */ into, /** @type {Entry[]} */ list, /** @type {boolean} */ lines) =>
      fill(into, ...list.map((one, k) => el("li", { class: "row" }, lines ? swatch(k) : null, el("span", { class: "grow" }, one.label),
        button("×", () => {
          list.splice(k, 1);
          this._list();
        }, { class: "btn quiet icon", "aria-label": `Take ${one.label} out` }))));
    draw(/** @type {HTMLElement} */ (this.chosen), this.who.planners, this.who.laws.length < 2);
    draw(/** @type {HTMLElement} */ (this.chosenLaws), this.who.laws, false);
    if (!this.who.laws.length) fill(/** @type {HTMLElement} */ (this.chosenLaws), el("li", { class: "hint" }, "The scenario's own."));
    this.offers.forEach((offer) => offer());
    this.page.tell("met");
    if (!this.go || !this.race) return;
    this.race.disabled = !this.who.planners.length;
    this.go.disabled = !this.who.planners.length || Boolean(this.asked);
    this.go.title = this.who.planners.length ? "" : "Add a planner first.";
    if (!this.who.planners.length) fill(/** @type {HTMLElement} */ (this.chosen), el("li", { class: "hint" }, "Nobody: add a planner."));
  }

  /** The first six explore the map side by side. */
  async _race() {
    const { page } = this;
    try {
      const [race] = await brought(page, "race");
      race.askRace(page, this.who.planners);
    } catch (error) {
      page.fault(error);
    }
  }

  /** What the address says of who meets; a comparison that it shows is made. */
  _linked() {
    const { page } = this;
    const how = linked(page);
    if (!how) return;
    this.who = chosen(page);
    if (this.seeds) this.seeds.value = String(this.who.seeds);
    this._list();
    if (!how.look) return;
    this.beside = how.look === 2;
    void this._compare(how.tick);
  }

  _seeds() {
    this.who.seeds = Math.min(Math.max(Math.round(Number(this.seeds?.value) || 1), 1), MOST_SEEDS);
    this.page.tell("met");
  }

  /** @param {number} [tick] the moment that is shown when it is there; 0: it plays */
  async _compare(tick = 0) {
    const { page } = this;
    if (!page.store.scenario.start || !page.store.scenario.goal) {
      if (!page.ground?.start || !page.ground.goal) {
        page.say("Set a start and a goal on the map first.");
        return;
      }
    }
    this.leave(true);
    this.found = null;
    if (this.again) this.again.hidden = true;
    if (this.who.planners.some((one) => this._poses(one))) {
      await this._drives();
      return;
    }
    fill(/** @type {HTMLElement} */ (this.results));
    const who = meeting(page);
    const all = who.planners.length * who.laws.length * who.seeds;
    await this._request(async (signal) => {
      tell(this.progress, `0 of ${all} runs`);
      const frames = page.api.frames("/api/compare", { scenario: page.asked(true), ...who }, signal);
      const found = await gather(frames, (some) => tell(this.progress, `${some.ended} of ${all} runs`));
      this.found = found;
      this.met = who;
      tell(this.progress, "");
      this._results(found, who.seeds);
      this._show(tick);
    });
  }

  /** @param {Who} who */
  _poses({ name }) {
    return this.page.hello.planners_of_poses.some((/** @type {any} */ row) => row.name === name);
  }

  /** All drive in continuous time, as planners of poses do, and are played together. */
  async _drives() {
    const { page } = this;
    fill(/** @type {HTMLElement} */ (this.results));
    await this._request(async (signal) => {
      const [module] = await brought(page, "posecompare");
      const runs = /** @type {Run[]} */ (await module.askDrives(page, this.who.planners, signal, (/** @type {string} */ words) => tell(this.progress, words)));
      tell(this.progress, "");
      const unused = this.who.laws.length || this.who.seeds > 1 ? " One run each, by the scenario's speed law and seed: the laws and seeds chosen above are not used." : "";
      fill(/** @type {HTMLElement} */ (this.results), el("div", { class: "wide", tabindex: 0, role: "group", "aria-label": "Table of the comparison" }, module.askTable(runs)),
        el("p", { class: "hint" }, `Each drives its own path in continuous time, by the controller of the panel Planner.${unused} A change of the scenario ends the comparison.`));
      if (!runs[0]?.ticks) return;
      // The list has the order of the drives, whose colours follow it: the longest is first.
      this.who.planners = runs.flatMap(({ label }) => this.who.planners.filter((one) => one.label === label));
      page.run = runs[0];
      page.map.ways = runs.map((run, k) => ({ cells: run.robot.subarray(0, 2 * run.ticks), colour: LINES[k % LINES.length][0], dash: LINES[k % LINES.length][1], wide: 2.5 }));
      page.map.refresh();
      page.tell("run", { tick: 0, play: true });
      page.tell("end");
    });
  }

  /** Carry out a request that Stop cancels; an error is shown below the buttons. @param {(signal: AbortSignal) => Promise<void>} work */
  async _request(work) {
    const asked = new AbortController();
    this.asked = asked;
    this._busy(true);
    try {
      await work(asked.signal);
    } catch (error) {
      if (asked.signal.aborted) tell(this.progress, "Stopped.");
      else {
        tell(this.progress, sentence(error), true);
        this.page.fault(error);
      }
    } finally {
      this.asked = null;
      this._busy(false);
    }
  }

  /** @param {boolean} busy */
  _busy(busy) {
    // A button that cannot be pressed loses the focus: the one in its place gets it.
    const held = document.activeElement === (busy ? this.go : this.end);
    if (this.end) this.end.hidden = !busy;
    if (this.old && busy) this.old.hidden = true;
    this._list();
    if (held) (busy ? this.end : this.go)?.focus();
    this.page.busy("compare", busy);
  }

  /** @param {import("./runs.js").Gathered} found @param {number} seeds */
  _results(found, seeds) {
    const some = entrants(found);
    const { best, fewest } = found.summary ?? {};
    const note = seeds > 1 ? `Means over ${seeds} seeds, 95 % intervals beneath.` : "One run each, in the same world.";
    const stars = seeds < fewest ? `☆: best number; the difference is tested with ${fewest} or more seeds.`
      : "★: better than all others: the interval of the difference, seed by seed, excludes 0. ☆: best number, not distinguishable.";
    fill(/** @type {HTMLElement} */ (this.results), el("div", { class: "wide", tabindex: 0, role: "group", "aria-label": "Table of the comparison" }, tableOf(some, `${note} ${stars}`, best ?? {})),
      ...(found.summary?.notes ?? []).map((/** @type {string} */ one) => el("p", { class: "hint otherwise" }, `${one}.`)), ...charts(some));
  }

  /** The same in a large window. */
  async _sheet() {
    const { found, met, page } = this;
    try {
      const [results] = await brought(page, "results");
      results.askResults(page, found && met ? { title: `Comparison on ${page.ground?.name ?? "the map"}`, some: entrants(found), bests: found.summary?.best ?? {}, met } : null);
    } catch (error) {
      page.fault(error);
    }
  }

  // ---- on the map --------------------

  /** The run by which the clock goes: the longest. */
  leader() {
    return this.found?.runs.reduce((a, b) => (b.ticks > a.ticks ? b : a)) ?? null;
  }

  /** @param {number} [tick] */
  _show(tick = 0) {
    const { page, found } = this;
    if (!found?.runs.length) return;
    if (!this.before) this.before = { run: page.run, tick: page.play.tick };
    this.shown = true;
    page.run = this.leader();
    if (this.bar) this.bar.hidden = false;
    if (this.again) this.again.hidden = true;
    this._look(this.beside);
    page.tell("run", { tick, play: !tick });
    page.tell("end");
  }

  /** @param {boolean} beside */
  _look(beside) {
    this.beside = beside;
    this.both?.forEach((one, k) => one.setAttribute("aria-pressed", String(beside === Boolean(k))));
    if (!this.shown || !this.found) return;
    if (this.whose) {
      this.whose.hidden = false;
      this.whose.textContent = beside ? "Each map shows the obstacles of its own run, all at the same moment."
        : `The obstacles are those of ${this.leader()?.label}, the longest run. They react to the robot and differ from run to run: Side by side shows those of each.`;
    }
    if (beside) this.mosaic.open(this.found.runs);
    else this.mosaic.close();
    this._ways();
    this._move(this.page.play.tick);
    this.page.tell("met");
  }

  /** Ways a little apart, so that those that run together are all seen. */
  _ways() {
    const { page, found } = this;
    if (!this.shown || !found) return;
    const n = found.runs.length;
    const apart = Math.max(0.1, 2.5 / page.map.view.scale);
    this.lines = found.runs.map((run, k) => wayOf(run, k, Math.max(-0.4, Math.min(0.4, apart * (k - (n - 1) / 2)))));
    page.map.ways = this.lines;
    page.map.refresh();
  }

  /** Everybody to where they are at a moment. @param {number} t */
  _move(t) {
    const { page, found } = this;
    if (!this.shown || !found) return;
    const { moment } = page.map;
    if (page.map.ways !== this.lines) {
      // The plan's way was drawn anew.
      page.map.ways = this.lines;
      page.map.refresh();
    }
    moment.robot = moment.seen = null;
    moment.trail = null;
    moment.goal = found.runs.length ? goalAt(found.runs[0], t) : null;
    const outline = page.map.shape?.outline;
    moment.others = found.runs.map((run, k) => ({ robot: placeAt(run, t), line: k, there: run.ticks > 0, heading: outline ? robotHeading(run, t) : undefined }))
      .filter(({ there }) => there);
    page.map.draw();
    if (this.beside) this.mosaic.move(t);
  }

  /** Back to what was there. @param {boolean} restore */
  leave(restore) {
    if (!this.shown) return;
    const { page, before } = this;
    this.shown = false;
    this.before = null;
    this.mosaic.close();
    page.map.moment.others = [];
    page.map.moment.goal = null;
    if (this.bar) this.bar.hidden = true;
    if (this.whose) this.whose.hidden = true;
    if (this.again) this.again.hidden = !this.found;
    if (restore && before) {
      page.run = before.run;
      page.tell("run", { tick: before.tick, play: false });
      if (before.run) page.tell("end");
    }
    page.tell("plan", page.plan);
    page.tell("met");
  }
}

/** A run's way in its colour and dash. @param {Run} run @param {number} k @param {number} [aside] */
function wayOf(run, k, aside = 0) {
  const cells = new Float32Array(2 * run.ticks);
  for (let j = 0; j < cells.length; j++) cells[j] = run.robot[j] + aside;
  const [colour, dash] = LINES[k % LINES.length];
  return { cells, colour, dash, wide: 3 };
}

/** A small map, its run, and how many of its edits are drawn. @typedef {{view: MapView, run: Run, turned: number}} Tile */

/** Small maps side by side over the large one. */
class Mosaic {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.root = el("div", { class: "mosaic", hidden: true });
    document.getElementById("stage")?.append(this.root);
    /** @type {Tile[]} */
    this.tiles = [];
  }

  /** @param {Run[]} runs */
  open(runs) {
    const { page } = this;
    this.root.hidden = false;
    this.root.style.setProperty("--across", String(this._across(runs.length)));
    this.tiles = [];
    fill(this.root, ...runs.map((run, k) => {
      const canvas = el("canvas", { role: "img", "aria-label": `${run.label} on the map` });
      const view = new MapView(canvas);
      view.dark = page.dark;
      view.edge = { top: 6, right: 6, bottom: 6, left: 6 };
      view.start = page.map.start;
      view.goal = page.map.goal;
      view.ways = [{ ...wayOf(run, k), wide: 2 }];
      const tile = { view, run, turned: -1 };
      this._walls(tile, page.play.tick);
      this.tiles.push(tile);
      return el("figure", null, canvas, el("figcaption", null, swatch(k), ` ${run.label}, ${run.end?.outcome?.replaceAll("_", " ") ?? ""}`));
    }));
    for (const { view } of this.tiles) {
      view.resize();
      view.fit();
    }
    this.move(page.play.tick);
  }

  /** The number of columns that leaves the largest maps. @param {number} many */
  _across(many) {
    const { ground } = this.page;
    const { clientWidth: wide, clientHeight: high } = this.root;
    if (!ground) return 1;
    const scale = (/** @type {number} */ columns) => Math.min((wide - 8) / columns / ground.width, ((high - 8) / Math.ceil(many / columns) - 40) / ground.height);
    return Array.from({ length: many }, (_, k) => k + 1).reduce((best, columns) => (scale(columns) > scale(best) ? columns : best), 1);
  }

  /** @param {number} t */
  move(t) {
    const cell = this.page.ground?.resolution || 1;
    const outline = this.page.map.shape?.outline;
    for (const [k, tile] of this.tiles.entries()) {
      const { view, run } = tile;
      this._walls(tile, t);
      view.shape = outline ? { outline, poses: [], ends: [] } : null;
      view.moment = {
        robot: null, bodies: bodiesAt(run, t), kinds: run.bodies.map((body) => body.kind), trail: null,
        radii: run.bodies.map((body) => body.radius / cell), outlines: outlinesOf(run), headings: headingsAt(run, t), others: run.ticks ? [{ robot: placeAt(run, t), line: k, heading: outline ? robotHeading(run, t) : undefined }] : [],
        seen: seenAt(run, t), goal: goalAt(run, t),
      };
      view.draw();
    }
  }

  /** The walls that this run has met by now: where somebody stands none comes, and that differs from run to run. @param {Tile} tile @param {number} t */
  _walls(tile, t) {
    const { ground, base, store } = this.page;
    if (!ground || !base) return;
    // One tick ahead, as on the large map.
    const tick = t > 0 ? Math.floor(t) + 1 : 0;
    const edits = tile.run.end?.edits ?? store.scenario.edits;
    const turned = edits.filter((/** @type {Edit} */ edit) => edit.tick <= tick).length;
    if (turned === tile.turned) return;
    tile.turned = turned;
    const cells = new Uint8Array(base.length);
    applyEdits(base, edits, tick, ground.width, cells);
    tile.view.setGround({ ...ground, cells });
  }

  /** @param {boolean} dark */
  setDark(dark) {
    for (const { view } of this.tiles) view.setDark(dark);
  }

  close() {
    this.root.hidden = true;
    this.tiles = [];
    fill(this.root);
  }
}
