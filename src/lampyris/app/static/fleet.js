// Fleet: many robots on the map in place of one. Its panel, what is asked of the server, and walls that are painted
// while the robots drive. The run is in fleetrun.js, its picture in fleetdraw.js, its numbers in fleetseen.js.

import { ServerError } from "./api.js";
import { line } from "./hand.js";
import { brought } from "./later.js";
import { FleetPicture } from "./fleetdraw.js";
import { keeping, restore, stateOf } from "./fleetkeep.js";
import { FleetClock, FleetRun, pathsOf } from "./fleetrun.js";
import { FleetSeen } from "./fleetseen.js";
import { json, layerOf } from "./frames.js";
import { TOUCH, button, el, explained, sentence, tapped, tell, formatted } from "./make.js";
import { byId } from "./page.js";
import { SwarmPanel } from "./swarm.js";

/** What draws in place of a single robot: below what moves, and in each frame. @typedef {{base: (pen: CanvasRenderingContext2D, view: import("./view.js").View) => void, draw: (pen: CanvasRenderingContext2D, view: import("./view.js").View) => void}} Actors */

/** As many as the server takes. */
const MOST = 1000;
/** Seconds that a plan from where the robots are may take, and its planner: its first plan is driven. */
const AGAIN = { planner: "lacam", settings: { improve: false }, seconds: 10 };
/** Robots that are named in a sentence. */
const NAMED = 5;
/** Why a job is cancelled whose plan another one takes the place of. */
const SHOWN = "shown";
/** Panels beside which a fleet stays on the map. */
const BESIDE = new Set(["fleet", "library", "now"]);

/** @param {Page} page @param {HTMLElement} pane */
export function mount(page, pane) {
  new Fleet(page, pane);
}

export class Fleet {
  /** @param {Page} page @param {HTMLElement} pane */
  constructor(page, pane) {
    this.page = page;
    this.clock = new FleetClock(page, () => this._moment());
    /** @type {FleetRun | null} */
    this.run = null;
    /** @type {FleetPicture | null} */
    this.picture = null;
    /** How the last plan ended. @type {Record<string, any> | null} */
    this.end = null;
    /** What it avoids: conflicts by cell. @type {Layer | null} */
    this.avoided = null;
    /** How the plan was asked for. @type {Record<string, any>} */
    this.asked = {};
    /** Strokes of the brush, each at the tick at which it was painted. @type {Array<{tick: number, cells: Map<number, number>}>} */
    this.edits = [];
    /** The map as it is without them; null: the fleet has seen none yet. @type {{ground: Ground, single: Uint8Array, cells: Uint8Array} | null} */
    this.map = null;
    this._shown = -1;
    /** What the scenario of the page has of it, as text. */
    this._kept = "";
    /** @type {AbortController | null} */
    this._job = null;
    /** The player of the single robot, while a fleet is shown. @type {Play | null} */
    this._single = null;
    this.swarm = new SwarmPanel(this);
    const field = (/** @type {string} */ name, /** @type {string} */ id, /** @type {HTMLElement} */ control) => {
      control.id = `fleet-${id}`;
      return el("div", { class: "field" }, el("label", { for: control.id }, name), control);
    };
    const whole = (/** @type {number} */ value, /** @type {number} */ least, /** @type {number} */ most) => el("input", { type: "number", min: least, max: most, step: 1, value });
    this.maps = el("select", { onchange: () => this.maps.value && void page.open(this.maps.value).catch((error) => page.fault(error)) },
      el("option", { value: "" }, "as in the panel Map"), ...page.hello.maps.map((/** @type {string} */ name) => el("option", { value: name }, name)));
    this.slider = el("input", { type: "range", min: 1, max: MOST, step: 1, value: 200, "aria-label": "Number of robots" });
    this.number = whole(200, 1, MOST);
    this.slider.addEventListener("input", () => (this.number.value = this.slider.value));
    this.number.addEventListener("change", () => (this.slider.value = this.number.value = String(this._robots())));
    this.fits = el("p", { class: "hint" });
    const about = el("p", { class: "hint" });
    /** @type {Array<{name: string, summary: string}>} */
    const planners = page.hello.planners_of_fleets;
    this.planners = el("select", { onchange: () => this.about() },
      ...planners.map((row) => el("option", { value: row.name }, explained(row))));
    /** Say what the chosen planner is. */
    this.about = () => (about.textContent = planners.find(({ name }) => name === this.planners.value)?.summary ?? "");
    this.about();
    this.seconds = el("input", { type: "number", min: 0.1, max: 30, step: "any", value: 2 });
    this.seed = whole(0, 0, 1e9);
    this.go = button("Plan", () => void this.plan(), { class: "btn primary" });
    this.all = button("Compare planners", () => void this._compare(), { class: "btn fleet-own", title: "Every planner of fleets for the same robots" });
    this.stop = button("Stop", () => this._job?.abort(), { hidden: true });
    this.free = button("Clear painted walls", () => this._clear(), { hidden: true });
    this.words = el("p", { class: "hint", role: "status" });
    this.trails = el("input", { type: "checkbox", checked: true, onchange: () => this._looks() });
    this.waits = el("input", { type: "checkbox", checked: true, onchange: () => this._looks() });
    this.colour = el("select", { onchange: () => this._looks() },
      el("option", { value: "" }, "nothing"), el("option", { value: "waits" }, "waits"), el("option", { value: "avoided" }, "conflicts avoided"));
    this.command = el("code", { class: "command" });
    const own = el("div", { class: "stack fleet-own" },
      el("div", null, field("Planner", "planner", this.planners), about),
      field("Seconds", "seconds", this.seconds),
      el("p", { class: "hint" }, "lacam and lns improve their plans until then; the others end earlier, or without a plan."));
    const looks = el("div", { class: "fleet-own" }, el("h2", null, "On the map"),
      el("label", { class: "row" }, this.trails, "trails"), el("label", { class: "row" }, this.waits, "lines from waiting robots to those in their way"),
      field("Ground colour", "colour", this.colour),
      el("h2", null, "On the command line"), this.command);
    const choice = (/** @type {string} */ text, /** @type {boolean} */ on) => button(text, () => this._choose(on), { class: "", "aria-pressed": String(this.swarm.on === on) });
    this.kinds = [choice("Fleet", false), choice("Glowworms", true)];
    this.lead = el("p", { class: "hint" });
    pane.append(
      el("div", { class: "seg", role: "group", "aria-label": "Kind of robots" }, ...this.kinds), this.lead,
      field("Map", "map", this.maps),
      el("div", null, field("Robots", "number", this.number), this.slider, this.fits),
      own, this.swarm.fields, field("Seed", "seed", this.seed),
      el("div", { class: "row" }, this.go, this.all, this.stop, this.free), this.words, looks, keeping(this),
    );
    pane.addEventListener("change", () => this.remember());
    this.slider.addEventListener("change", () => this.remember());
    page.store.listen((changed) => changed.has("fleet") && this._told());
    this.seen = new FleetSeen(this);
    byId("below").append(this.clock.bar);
    this.clock.bar.id = "fleet-time";

    page.on("panel", (id) => this._opened(id));
    page.on("ground", () => this._ground());
    page.on("theme", () => {
      this.picture?.setLayer(this.picture.layer);
      this.swarm.picture?.theme();
      this.seen.draw();
    });
    this._choose(false);
    if (!pane.hidden) this._opened("fleet");
  }

  // ---- in place of the single robot --------------------

  /** @param {string} id */
  _opened(id) {
    const { page } = this;
    if (id === "fleet" && page.fleet !== this) this._enter();
    else if (page.fleet === this && !BESIDE.has(id)) this._leave(id);
  }

  _enter() {
    const { page } = this;
    page.stop();
    if (page.play.playing) page.play.toggle();
    this._single = page.play;
    page.play = this.clock;
    page.fleet = this;
    document.body.classList.add("fleet");
    if (page.tool === "patrol") page.use("goal");
    page.show("now");
    page.show("fleet");
    page.tell("fleet");
    this._ground();
    this._actors();
    if (!this._told()) this.remember();
  }

  /** Have draft and address hold what is set here. @param {boolean} [open] whether the panel is in place of the single robot */
  remember(open = true) {
    const { page } = this;
    if (page.fleet !== this || !this.map) return;
    const state = { open, ...stateOf(this) };
    const text = JSON.stringify(state);
    if (text === this._kept) return;
    this._kept = text;
    page.store.set({ fleet: state }, "fleet");
  }

  /** A link, a draft or an undo has another state than is set here; whether it had. */
  _told() {
    const { page } = this;
    const state = page.store.scenario.fleet;
    const text = JSON.stringify(state ?? null);
    if (!state || text === this._kept || page.fleet !== this || !this.map) return false;
    this._kept = text;
    this._drop();
    this.map.cells.set(this.map.single);
    restore(this, state);
    this._choose(state.swarm === true);
    this._walls();
    this._room();
    page.map.setGround(this.map.ground);
    if (state.planned) void this.plan();
    return true;
  }

  /** @param {string} id the panel that was opened */
  _leave(id) {
    const { page, map } = this;
    this.remember(false);
    this._job?.abort();
    this.clock.pause();
    if (this._single) page.play = this._single;
    page.fleet = null;
    document.body.classList.remove("fleet");
    page.map.actors = null;
    if (map && page.ground === map.ground) map.ground.cells = map.single;
    if (page.ground) page.map.setGround(page.ground);
    if (!byId("fleet").hidden) {
      page.show("library");
      page.show(id);
    }
    page.tell("fleet");
  }

  /** The map is another one, or has just been opened. */
  _ground() {
    const { page } = this;
    const { ground } = page;
    if (page.fleet !== this) return;
    this.maps.value = typeof page.store.scenario.map === "string" ? page.store.scenario.map : "";
    if (!ground) {
      this.map = null;
      this._drop();
      return;
    }
    if (this.map?.ground === ground && ground.cells === this.map.cells) return;
    if (this.map?.ground === ground && ground.cells === this.map.single) {
      ground.cells = this.map.cells;
    } else {
      this.map = { ground, single: ground.cells, cells: ground.cells.slice() };
      ground.cells = this.map.cells;
      this.edits = [];
      this._drop();
    }
    page.map.setGround(ground);
    this._room();
    if (!this._told()) this.remember();
  }

  /** What draws: the fleet or the swarm. */
  _actors() {
    this.page.map.actors = this.swarm.on ? this.swarm : { base: (pen, view) => this.picture?.base(pen, view), draw: (pen, view) => this.picture?.draw(pen, view) };
    this.page.map.refresh();
  }

  /** The plan is of another map, or of nothing. */
  _drop() {
    this._job?.abort();
    this.run = this.picture = this.end = this.avoided = null;
    this.swarm.drop();
    this.clock.pause();
    this.clock.changed(0);
    this._shown = -1;
    this.seen?.draw();
    this.page.map.refresh();
  }

  /** Fleet or glowworms. @param {boolean} swarm */
  _choose(swarm) {
    this._job?.abort();
    this.swarm.on = swarm;
    this.clock.pause();
    document.body.classList.toggle("swarm", swarm);
    this.remember();
    this.kinds.forEach((one, k) => one.setAttribute("aria-pressed", String(Boolean(k) === swarm)));
    this.lead.textContent = swarm ? "Robots that measure a signal, broadcast it as luciferin, and follow brighter neighbours until they gather at its sources."
      : "Each robot drives from a random cell to a random goal; no two are ever in one cell or exchange their cells.";
    this.go.textContent = swarm ? "Simulate" : "Plan";
    tell(this.words, "");
    this.clock.tick = 0;
    this.clock.changed(swarm ? this.swarm.last : this.run?.last ?? 0);
    if (this.page.fleet === this) this._actors();
    this.seen?.draw();
    this.page.tell("fleet");
  }

  /** How many robots there is room for. */
  _room() {
    const { map } = this;
    if (!map) return;
    const room = largest(map.cells, map.ground.width);
    const most = Math.max(1, Math.min(MOST, room));
    this.slider.max = this.number.max = String(most);
    this.slider.value = this.number.value = String(this._robots());
    this.fits.textContent = room < MOST ? `At most ${formatted(most)}: the free cells of the largest region.` : `At most ${formatted(MOST)} in the app; the command line takes more.`;
    this.free.hidden = !this.edits.length;
  }

  _robots() {
    const given = Math.round(Number(this.number.value)) || 1;
    return Math.min(Math.max(given, 1), Number(this.slider.max));
  }

  _looks() {
    const { picture } = this;
    if (!picture || !this.run || !this.map) return;
    picture.trails = this.trails.checked;
    picture.waits = this.waits.checked;
    picture.setLayer(this.colour.value === "waits" ? heatOf(this.run) : this.colour.value === "avoided" ? this.avoided : null);
    this.seen.draw();
  }

  /** The walls that were painted go, and the plan that knows them. */
  _clear() {
    if (!this.map) return;
    this.map.cells.set(this.map.single);
    this.edits = [];
    this._drop();
    this.page.map.setGround(this.map.ground);
    this._room();
    this.words.textContent = "The map is as it was. Plan again.";
    this.remember();
  }

  // ---- what is asked --------------------

  /** The map with the walls that are there, as a question has it. @param {Uint8Array} cells */
  scenario(cells) {
    const { page } = this;
    /** @type {Cell[]} */
    const blocked = [];
    /** @type {Cell[]} */
    const freed = [];
    const base = page.base ?? cells;
    const width = page.ground?.width ?? 1;
    for (let k = 0; k < cells.length; k++) {
      if (cells[k] !== base[k]) (cells[k] === 1 ? blocked : freed).push([k % width, Math.floor(k / width)]);
    }
    const edits = blocked.length || freed.length ? [{ tick: 0, blocked, freed }] : [];
    return { map: page.store.scenario.map, edits };
  }

  /** Ask, and hear each frame. One job at a time: another ends it. @param {string} path @param {Record<string, any>} question @param {(kind: string, bytes: Uint8Array) => void} hear @returns {Promise<boolean>} whether it was heard to its end */
  async job(path, question, hear) {
    const { page } = this;
    this._job?.abort();
    const job = new AbortController();
    this._job = job;
    page.busy("fleet", true);
    this.go.disabled = true;
    this.stop.hidden = false;
    try {
      for await (const { kind, bytes } of page.api.frames(path, question, job.signal)) {
        if (job.signal.aborted) break;
        if (kind === "X") throw new ServerError(200, json(bytes));
        if (kind === "P") this._progress(json(bytes));
        else hear(kind, bytes);
      }
      return !job.signal.aborted;
    } catch (error) {
      if (!job.signal.aborted) {
        tell(this.words, sentence(error), true);
        if (!(error instanceof ServerError)) page.fault(error);
      }
      return false;
    } finally {
      if (this._job === job) {
        this._job = null;
        page.busy("fleet", false);
        this.go.disabled = false;
        this.stop.hidden = true;
        if (job.signal.aborted && job.signal.reason !== SHOWN) tell(this.words, "Stopped.");
      }
    }
  }

  /** @param {Record<string, any>} how */
  _progress({ what, done, of, cost }) {
    if (what === "compiling") return;
    if (of) tell(this.words, `${what}: ${formatted(done)} of ${formatted(of)}`);
    else if (what === "planning") tell(this.words, `planning: ${formatted(done)} iterations${cost ? `, sum of costs ${formatted(cost)}` : ""}`);
    else if (what === "counting") tell(this.words, "counting the conflicts that the plan avoids");
  }

  /** What is asked of a planner. */
  _asks() {
    return { robots: this._robots(), planner: this.planners.value, seconds: Math.min(Math.max(Number(this.seconds.value) || 1, 0.1), 30), seed: Math.max(0, Math.round(Number(this.seed.value)) || 0) };
  }

  /** Every planner for these robots. */
  async _compare() {
    const { map, page } = this;
    if (!map) return;
    try {
      const [fleets] = await brought(page, "fleetcompare");
      // All painted walls, whatever tick is shown: a plan that is shown has them from its start.
      const cells = map.single.slice();
      for (const [cell, value] of this._allPainted()) cells[cell] = value;
      fleets.askFleets(this, { scenario: this.scenario(cells), ...this._asks() });
    } catch (error) {
      page.fault(error);
    }
  }

  /** A new fleet from the beginning. */
  async plan() {
    if (this.swarm.on) return this.swarm.simulate();
    const { map, page } = this;
    if (!map) return;
    this._begin();
    const asked = this._asks();
    tell(this.words, "asking for a plan");
    /** @type {import("./fleetrun.js").Paths | null} */
    let paths = null;
    /** @type {Layer | null} */
    let avoided = null;
    await this.job("/api/fleet", { scenario: this.scenario(map.cells), ...asked }, (kind, bytes) => {
      if (kind === "R") paths = pathsOf(bytes);
      else if (kind === "L") avoided = layerOf(bytes);
      else if (kind === "Z") this._planned(asked, paths, avoided, json(bytes));
    });
    page.map.refresh();
  }

  /** The last stroke on each painted cell. @returns {Map<number, number>} */
  _allPainted() {
    return new Map(this.edits.flatMap((edit) => [...edit.cells]));
  }

  /** What is painted by now is there from the start. */
  _begin() {
    const walls = this._allPainted();
    this.edits = walls.size ? [{ tick: 0, cells: walls }] : [];
    this._drop();
    this._walls();
  }

  /**
   * A plan that a comparison has made already.
   * @param {typeof this.asked} asked @param {import("./fleetrun.js").Paths | null} paths @param {Layer | null} avoided @param {Record<string, any>} end
   */
  show(asked, paths, avoided, end) {
    this._job?.abort(SHOWN);
    this._begin();
    this._planned(asked, paths, avoided, end);
  }

  /** @param {typeof this.asked} asked @param {import("./fleetrun.js").Paths | null} paths @param {Layer | null} avoided @param {Record<string, any>} end */
  _planned(asked, paths, avoided, end) {
    const { map, page } = this;
    if (!map) return;
    this.asked = asked;
    this.avoided = avoided;
    this.end = end;
    tell(this.words, end.sentence, !end.found);
    const name = typeof page.store.scenario.map === "string" ? page.store.scenario.map : "MAP";
    this.command.textContent = this.edits.length ? "A map with painted walls is not on the command line." : `lampyris fleet ${name} --robots ${asked.robots} --planner ${asked.planner} --seconds ${asked.seconds} --seed ${asked.seed}`;
    if (paths) {
      this.run = new FleetRun(paths, map.ground.width, map.ground.height);
      this.picture = new FleetPicture(page, this.run, this.clock);
      this._looks();
      this.clock.tick = 0;
      this.clock.changed(this.run.last);
      this.clock.start();
    }
    this.remember();
    this.seen.draw();
    page.tell("fleet");
    page.map.refresh();
  }

  /** From where the robots are at a tick, among the walls as they are now. @param {number} tick @param {boolean} wall */
  async _again(tick, wall) {
    const { map, run } = this;
    if (!map || !run) return;
    run.cut(tick);
    run.cuts = run.cuts.filter((one) => one.tick <= tick);
    this.clock.changed(run.last, true);
    tell(this.words, `planning again from tick ${tick}`);
    /** @type {import("./fleetrun.js").Paths | null} */
    let paths = null;
    const before = new Set(run.lost);
    const heard = await this.job("/api/fleet", { scenario: this.scenario(map.cells), agents: run.agents(tick), seed: this.asked.seed, ...AGAIN }, (kind, bytes) => {
      if (kind === "R") paths = pathsOf(bytes);
      else if (kind === "Z") {
        this.end = { ...json(bytes), since: tick, alone: this.end?.alone };
        this._joined(paths, tick, wall, before);
      }
    });
    if (heard || this._job || this.run !== run) return;
    // It was stopped, or could not be made: the robots stand where they are.
    this.clock.changed(run.last);
    this.seen.draw();
  }

  /** @param {import("./fleetrun.js").Paths | null} paths @param {number} tick @param {boolean} wall @param {Set<number>} before robots that were lost before */
  _joined(paths, tick, wall, before) {
    const { run, end, page } = this;
    if (!run || !end) return;
    const lost = /** @type {number[]} */ (end.lost);
    if (paths && end.found) run.join(paths, lost);
    const back = [...before].filter((r) => !lost.includes(r));
    const fresh = lost.filter((r) => !before.has(r));
    const said = [];
    if (!end.found) said.push(`From tick ${tick} on there is no plan: ${end.sentence} The robots stand; erase a wall or paint another.`);
    else {
      said.push(`${wall ? "Wall painted" : "Wall erased"} at tick ${tick}: planned again in ${formatted(end.timing.plan_s, 2)} s.`);
      if (fresh.length) said.push(`${robots(fresh)} cannot reach ${fresh.length === 1 ? "its goal" : "their goals"} any more: ${fresh.length === 1 ? "it waits" : "they wait"} where ${fresh.length === 1 ? "it is" : "they are"} in nobody's way.`);
      if (back.length) said.push(`${robots(back)} can reach ${back.length === 1 ? "its goal" : "their goals"} again.`);
    }
    const what = said.join(" ");
    run.cuts.push({ tick, wall, what });
    tell(this.words, what, !end.found);
    page.say(what, end.found && !fresh.length ? "note" : "bad");
    this._looks();
    this.clock.changed(run.last);
    this.seen.draw();
    page.map.refresh();
  }

  // ---- walls while they drive --------------------

  /** A stroke of the brush. @param {number} value 1: wall, 0: free @param {Cell[]} cells of the brush */
  stroke(value, cells) {
    return new FleetStroke(this, value, cells);
  }

  /** What was painted at a tick. @param {number} tick @param {Map<number, number>} painted @param {Set<number>} refused robots that stood there */
  painted(tick, painted, refused) {
    const { page, run } = this;
    if (refused.size) page.say(`No wall on cells with a robot: ${robots([...refused])} ${refused.size === 1 ? "stands" : "stand"} there.`, "bad");
    if (!painted.size) return;
    this.edits = [...this.edits.filter((edit) => edit.tick <= tick), { tick, cells: painted }];
    this._shown = -1;
    this._room();
    this.remember();
    const wall = [...painted.values()].some((value) => value === 1);
    if (run && !this.swarm.on) void this._again(tick, wall);
    else if (this.swarm.on) this.swarm.stale();
  }

  /** The walls of the shown tick, one ahead, so that what is painted now is seen now. */
  _walls() {
    const { map, page } = this;
    if (!map) return;
    const tick = this.run && !this.swarm.on ? Math.floor(this.clock.tick) + 1 : Infinity;
    const count = this.edits.filter((edit) => edit.tick <= tick).length;
    if (count === this._shown) return;
    this._shown = count;
    map.cells.set(map.single);
    for (const edit of this.edits.slice(0, count)) for (const [cell, value] of edit.cells) map.cells[cell] = value;
    page.map.setGround(map.ground);
  }

  // ---- what the map and the keys ask --------------------

  /** The clock shows another moment. */
  _moment() {
    if (this.page.fleet !== this) return;
    this._walls();
    this.page.map.draw();
    this.seen?.moment();
  }

  /** A click on a cell chooses the robot there. @param {Cell} cell */
  choose(cell) {
    if (this.swarm.on) this.swarm.choose(cell);
    else if (this.picture) this.pick(this.picture.near(cell));
  }

  /** @param {number | null} robot */
  pick(robot) {
    if (!this.picture || !this.run) return;
    this.picture.chosen = robot !== null && robot >= 0 && robot < this.run.n ? robot : null;
    this.seen.draw();
    this.page.map.refresh();
  }

  tip() {
    const { tool } = this.page;
    if (tool === "wall") return this.swarm.on ? "Paint walls, then simulate." : "Paint a wall: the fleet is planned again around it.";
    if (tool === "free") return "Erase walls.";
    if (tool === "pan") return TOUCH.matches ? "Drag the map. Pinch to zoom." : "Drag the map. Wheel or pinch zooms.";
    if (this.swarm.on) return this.swarm.last ? "Play it." : "Choose a number of robots and simulate.";
    return this.run ? tapped("Click a robot: its path, where it waits, its goal.") : "Choose a number of robots and plan.";
  }

  /** From the first tick, or planned if it is not. */
  again() {
    if (!this.clock.last) {
      void this.plan();
      return;
    }
    this.clock.seek(0);
    this.clock.start();
  }
}

/** A stroke over the map while a fleet is shown; cells with robots stay as they are. */
class FleetStroke {
  /** @param {Fleet} fleet @param {number} value @param {Cell[]} cells */
  constructor(fleet, value, cells) {
    this._fleet = fleet;
    this._value = value;
    this._brush = cells;
    this._map = fleet.map;
    /** @type {Map<number, number>} */
    this._painted = new Map();
    /** @type {Set<number>} */
    this._refused = new Set();
    /** @type {Cell | null} */
    this._last = null;
    const { clock, run, swarm } = fleet;
    clock.hold(true);
    // Robots that are between two cells finish their step: they are on both until then.
    this._tick = run && !swarm.on ? Math.min(Math.ceil(clock.tick - 1e-6), run.last) : 0;
    /** Who is on a cell. @type {Map<number, number>} */
    this._stand = new Map();
    for (let r = 0; value && run && !swarm.on && r < run.n; r++) {
      for (const t of [Math.floor(clock.tick + 1e-6), this._tick]) this._stand.set(run.cellAt(t, r), r);
    }
  }

  /** @param {Cell} cell */
  to(cell) {
    const { page } = this._fleet;
    const map = this._map;
    if (!map || map !== this._fleet.map) return;
    const { width, height } = map.ground;
    /** @type {Cell[]} */
    const fresh = [];
    for (const [x, y] of line(this._last ?? cell, cell)) {
      for (const [dx, dy] of this._brush) {
        const [cx, cy] = [x + dx, y + dy];
        if (cx < 0 || cy < 0 || cx >= width || cy >= height) continue;
        const k = cy * width + cx;
        const robot = this._stand.get(k);
        if (robot !== undefined) this._refused.add(robot);
        if (robot !== undefined || this._painted.has(k) || map.cells[k] === this._value) continue;
        this._painted.set(k, this._value);
        map.cells[k] = this._value;
        fresh.push([cx, cy]);
      }
    }
    this._last = cell;
    if (fresh.length) page.map.repaint(fresh);
  }

  end() {
    const fleet = this._fleet;
    fleet.clock.hold(false);
    if (this._map === fleet.map) fleet.painted(this._tick, this._painted, this._refused);
  }

  /** It was a pinch after all. */
  drop() {
    const fleet = this._fleet;
    fleet.clock.hold(false);
    if (this._map !== fleet.map || !this._map) return;
    fleet._shown = -1;
    fleet._walls();
  }
}

/** Robots in words, by their numbers. @param {number[]} some */
function robots(some) {
  const named = some.slice(0, NAMED).join(", ");
  if (some.length === 1) return `Robot ${named}`;
  return `${formatted(some.length)} robots (${named}${some.length > NAMED ? ", \u2026" : ""})`;
}

/** Ticks that robots wait, by cell, as a layer. @param {FleetRun} run @returns {Layer} */
function heatOf({ heat, width, height }) {
  let most = 0;
  for (const many of heat) most = Math.max(most, many);
  const values = new Uint8Array(heat.length);
  for (let k = 0; k < heat.length; k++) if (heat[k]) values[k] = 1 + Math.round((254 * (heat[k] - 1)) / Math.max(1, most - 1));
  return { name: "waits", width, height, low: most ? 1 : 0, high: most, values };
}

/** Cells of the largest region that is connected by steps along rows and columns. @param {Uint8Array} cells @param {number} width */
function largest(cells, width) {
  const seen = Uint8Array.from(cells, (cell) => (cell ? 1 : 0));
  const stack = new Int32Array(cells.length);
  let most = 0;
  for (let from = 0; from < cells.length; from++) {
    if (seen[from]) continue;
    let [many, top] = [0, 0];
    stack[top++] = from;
    seen[from] = 1;
    while (top) {
      const k = stack[--top];
      const x = k % width;
      many++;
      for (const to of [x ? k - 1 : -1, x < width - 1 ? k + 1 : -1, k - width, k + width]) {
        if (to < 0 || to >= cells.length || seen[to]) continue;
        seen[to] = 1;
        stack[top++] = to;
      }
    }
    most = Math.max(most, many);
  }
  return most;
}
