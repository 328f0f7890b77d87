// Flow: from what was changed to what must be asked. A changed scenario is planned again at once, one question in
// flight at most and the newest state next; a run is made again when a wall was painted while it is shown.

import { Gone, ServerError } from "./api.js";
import { json } from "./frames.js";
import { applyEdits, loadGround } from "./ground.js";
import { sentence } from "./make.js";
import { dropped, open } from "./opening.js";
import { Runs } from "./running.js";
import { outlineOf, plansPoses, plansTimes, radiusOf } from "./shape.js";
import { first } from "./state.js";

/** Keys that decide a run. */
const DECIDE = ["map", "start", "goal", "start_yaw", "goal_yaw", "robot", "preset", "moves", "planner", "law", "seed", "obstacles", "edits", "simulate", "drive", "controllers", "zones"];
/** Of these, the ones that decide a plan at the start as well. */
const UNPLANNED = new Set(["simulate", "drive", "controllers"]);
/**
 * Milliseconds after which a plan that is no longer wanted is stopped instead of waited for. An engine that is
 * stopped may have to start anew, which takes about a second: with 400 here a drag never saw an answer.
 */
const PATIENCE = 2500;
/** What can be changed while a drive plays: it is made again, and plays from its start. */
const FOLLOWED = new Set(["start", "goal", "edits"]);
/** Milliseconds without a change, after which it is made again. */
const SETTLED = 400;
/** Milliseconds after which it is said that a plan is on its way: what is shown meanwhile is an older one. */
const LATE = 500;
/** Milliseconds between two drawings of the way of a run that is still coming in. */
const OFTEN = 250;

/** @param {Page} page */
export function mount(page) {
  const { store, map } = page;
  const plans = new Plans(page);
  const runs = new Runs(page);
  page.replan = () => plans.want();
  page.simulate = async (how) => runs.begin(how ?? {});
  page.stop = () => runs.stop();
  page.drives = () => (plansPoses(page) || Boolean(store.scenario.drive));
  page.asked = (ticks = false) => asked(store.scenario, plansPoses(page), plansTimes(page) && ticks ? null : page.drives() && !ticks);

  /** What the ground on the screen is made of. */
  let shown = { map: /** @type {unknown} */ (null), edits: /** @type {unknown} */ (null), tick: -1 };
  /** Number of the newest loading: an older one that comes later is let go. */
  let loading = 0;
  /** Number of the newest wish for a map: what an older one brings later is let go. */
  let turns = 0;
  page.turn = () => ++turns;

  /** The tick up to which walls are shown: one ahead, so that what is painted now is seen now. */
  const tickOfGround = () => (page.run && (page.play.tick > 0 || page.play.playing) ? Math.floor(page.play.tick) + 1 : 0);
  const paint = (force = false) => {
    const { ground, base } = page;
    if (!ground || !base) return;
    const { edits } = store.scenario;
    const tick = tickOfGround();
    // Nothing to do unless a tick with an edit lies between then and now.
    const crossed = edits.some((edit) => edit.tick > 0 && edit.tick > shown.tick !== edit.tick > tick);
    const fresh = shown.edits !== edits;
    shown.edits = edits;
    shown.tick = tick;
    if (!fresh && !crossed && !force) return;
    const before = ground.cells;
    const after = new Uint8Array(base.length);
    applyEdits(base, edits, tick, ground.width, after);
    /** @type {Array<[number, number]>} */
    const cells = [];
    for (let k = 0; k < after.length && cells.length < 20000; k++) {
      if (after[k] !== before[k]) cells.push([k % ground.width, Math.floor(k / ground.width)]);
    }
    ground.cells = after;
    if (cells.length >= 20000) map.setGround(ground);
    else if (cells.length) map.repaint(cells);
    if (cells.length || fresh) page.tell("ground");
  };
  page.on("repaint", () => paint(true));
  // The brush has drawn these already.
  page.on("painted", (edits) => (shown.edits = edits));

  /** A map that was loaded to be opened, so that it is not asked for twice. @type {{spec: unknown, ground: Ground} | null} */
  let opened = null;

  const load = async () => {
    const spec = store.scenario.map;
    const mine = ++loading;
    page.turn();
    shown.map = spec;
    page.busy("map", true);
    try {
      const ready = /** @type {{spec: unknown, ground: Ground} | null} */ (opened);
      const ground = ready && ready.spec === spec ? ready.ground : await loadGround(page.api, spec);
      opened = null;
      if (mine !== loading) return;
      page.base = ground.cells.slice();
      const { edits } = store.scenario;
      applyEdits(page.base, edits, 0, ground.width, ground.cells);
      page.ground = ground;
      shown.edits = edits;
      shown.tick = 0;
      map.setGround(ground);
      map.fit();
      ends();
      page.tell("ground");
      const { start, goal } = store.scenario;
      // The map's own ends, so that there is something to see at once.
      if (!start && !goal && ground.start && ground.goal) store.set({ start: ground.start, goal: ground.goal }, "map");
      else plans.want();
    } catch (error) {
      if (mine !== loading) return;
      // What is on the screen is of another scenario: an empty screen with a sentence lies less.
      shown.map = page.ground = page.base = page.plan = map.ground = null;
      map.ways = [];
      map.start = map.goal = null;
      map.refresh();
      page.tell("plan", null);
      page.tell("ground", error instanceof Gone ? "The server does not answer: the map comes when it does."
        : `The map cannot be opened: ${sentence(error)}. Choose another, or undo.`);
      page.fault(error);
    } finally {
      if (mine === loading) page.busy("map", false);
    }
  };

  const ends = () => {
    map.start = store.scenario.start;
    map.goal = store.scenario.goal;
    map.robotRadius = Number(store.scenario.robot.radius ?? 0) / (page.ground?.resolution || 1);
    map.shape = shapeOf(page);
    map.refresh();
  };

  page.open = async (spec, turn = page.turn()) => {
    const ground = await loadGround(page.api, spec);
    if (turn !== turns) return false;
    opened = { spec, ground };
    store.set({ map: spec, start: ground.start, goal: ground.goal, edits: [], obstacles: [...placeless(store.scenario.obstacles), ...drawnIn(ground)], ...dropped(store.scenario), map_hash: undefined }, "open");
    store.settle();
    return true;
  };
  page.adopt = async (scenario, turn = page.turn()) => {
    // A map that cannot be had leaves everything as it was.
    const { map } = scenario;
    const ground = map === shown.map && page.ground ? page.ground : await loadGround(page.api, map);
    if (turn !== turns) return false;
    if (map !== shown.map) opened = { spec: map, ground };
    const placed = settled(scenario, ground);
    const { start, goal } = placed.start || placed.goal ? placed : ground;
    store.replace({ ...placed, start, goal });
    return true;
  };

  /** When a drive that was interrupted by a change begins again; 0: none was. */
  let anew = 0;
  page.on("plan", function follow() {
    if (!anew || page.run || runs.busy) return;
    const left = anew - performance.now();
    if (left > 0) setTimeout(follow, left + 1);
    else {
      anew = 0;
      if (page.plan?.cost) void runs.begin({ tick: 0, play: true });
    }
  });

  store.listen((changed) => {
    const moved = changed.has("map") && store.scenario.map !== shown.map;
    if (moved) void load();
    else if (changed.has("edits")) {
      if (shown.edits === store.scenario.edits) page.tell("ground");
      else paint();
    }
    if (SHOWN.some((key) => changed.has(key))) ends();
    const decisive = DECIDE.filter((key) => changed.has(key));
    if (!decisive.length) return;
    if (anew) anew = decisive.every((key) => FOLLOWED.has(key)) ? performance.now() + SETTLED : 0;
    if (page.run || runs.busy) {
      const tick = page.play.tick;
      if (page.run && decisive.length === 1 && decisive[0] === "edits" && !page.run.step && (tick > 0 || page.play.playing)) {
        void runs.begin({ tick, play: page.play.playing, cut: true });
      } else {
        const again = page.run?.step !== undefined && page.play.playing && decisive.every((key) => FOLLOWED.has(key));
        runs.clear();
        if (again) anew = performance.now() + SETTLED;
      }
    }
    if (decisive.some((key) => !UNPLANNED.has(key)) && !moved) plans.want();
  });
  page.on("tick", () => paint());
  page.on("run", () => paint());
  page.on("gone", (gone) => {
    if (gone) return;
    if (!page.ground) void load();
    else {
      plans.want();
      runs.again();
    }
  });

  // The way of the plan, by its speeds. While a run is on its way: the run's own, as far as it has come; what it
  // has driven is drawn over it. The plan's would lead through walls that were painted since.
  let running = false;
  /** The path that a drive follows at the shown moment. @type {number[][]} */
  let followed = [];
  const drawWays = () => {
    const { plan, run } = page;
    // A comparison draws ways of its own.
    if (run && run !== runs.own) return;
    running = run !== null && page.play.tick > 0;
    followed = (run?.step && running && page.driver?.pathAt(run, page.play.tick)) || [];
    if (run?.step && running) map.ways = page.driver?.waysOf(run, followed) ?? [];
    else if (run && running) map.ways = run.ticks > 1 ? [{ cells: run.robot.subarray(0, 2 * run.ticks), faint: true }] : [];
    else map.ways = plan && plan.cells.length > 2 ? [wayOf(plan, page)] : [];
    map.shape = shapeOf(page, followed.length ? followed : undefined);
    map.refresh();
  };
  for (const name of ["plan", "run", "end"]) page.on(name, drawWays);
  let drawn = 0;
  page.on("ticks", () => {
    if (!running || performance.now() - drawn < OFTEN) return;
    drawn = performance.now();
    drawWays();
  });
  page.on("tick", () => {
    const { run, play } = page;
    if (running !== (run !== null && play.tick > 0) || (run?.step && running && followed !== page.driver?.pathAt(run, play.tick))) drawWays();
  });
}

/** The scenario of the link, the draft, or a first one. @param {Page} page */
export async function begin(page) {
  const found = await first(page);
  if (found) page.store.replace(found, false);
  else open(page);
}

/** Obstacles that are a number, not places of another map. @param {Array<Record<string, any>>} obstacles */
function placeless(obstacles) {
  return obstacles.filter((one) => one.kind === "crossing" || (one.kind === "random-walk" && !one.starts?.length));
}

/** The moving obstacles drawn in a map: random walkers that begin on their cells. @param {Ground} ground @returns {Array<Record<string, any>>} */
function drawnIn(ground) {
  return ground.obstacle_cells.length ? [{ kind: "random-walk", count: ground.obstacle_cells.length, starts: ground.obstacle_cells }] : [];
}

/** The scenario as the server takes it: what is empty is left out. @param {Scenario} scenario @param {boolean} poses whether the planner plans poses @param {boolean | null} [drives] whether it is driven in continuous time, and not simulated in ticks; null: neither @returns {Scenario} */
export function asked(scenario, poses, drives = false) {
  const made = /** @type {any} */ ({ ...scenario, simulate: drives === false ? scenario.simulate ?? {} : undefined, drive: drives ? scenario.drive ?? {} : undefined });
  delete made.controllers;
  delete made.fleet;
  for (const end of ["start", "goal"]) {
    const yaw = made[`${end}_yaw`];
    if (poses && made[end] && yaw !== null) made[end] = { cell: made[end], yaw };
    delete made[`${end}_yaw`];
  }
  for (const key of Object.keys(made)) if (made[key] === undefined) delete made[key];
  if (!made.edits?.length) delete made.edits;
  // A map that was uploaded and painted is checked by the page itself.
  delete made.map_hash;
  return made;
}

/** Keys of what is shown at the ends. */
const SHOWN = ["start", "goal", "start_yaw", "goal_yaw", "robot", "planner"];

/** Ends of a file that are in metres as cells of the map. @param {Scenario} scenario @param {Ground} ground @returns {Scenario} */
function settled(scenario, ground) {
  const made = /** @type {any} */ ({ ...scenario });
  for (const end of ["start", "goal"]) {
    const metres = made[`${end}_m`];
    delete made[`${end}_m`];
    if (!metres) continue;
    const [ox, oy, turn] = ground.origin;
    const [dx, dy] = [(metres[0] - ox) / ground.resolution, (metres[1] - oy) / ground.resolution];
    const x = Math.floor(dx * Math.cos(turn) + dy * Math.sin(turn));
    const up = Math.floor(dy * Math.cos(turn) - dx * Math.sin(turn));
    made[end] = [x, ground.height - 1 - up];
  }
  return made;
}

/** Footprint, poses and headings on the map; of a planner on cells the footprint at both ends of the path. Null: a disc on cells. @param {Page} page @param {number[][]} [path] what a drive follows, if one is shown @returns {import("./shape.js").Shape | null} */
function shapeOf(page, path) {
  const { ground, plan, store } = page;
  if (!ground) return null;
  const { scenario } = store;
  const outline = outlineOf(scenario.robot, ground.resolution);
  if (!plansPoses(page)) return outline && { outline, poses: page.run ? [] : endsOf(plan), ends: [], around: radiusOf(outline) };
  const ends = /** @type {Array<"start" | "goal">} */ (["start", "goal"]).flatMap((end) => {
    const at = scenario[end];
    const yaw = scenario[`${end}_yaw`];
    return at ? [{ end, at, heading: yaw === null ? null : yaw - ground.origin[2] }] : [];
  });
  return { outline, poses: path ?? plan?.pose_cells ?? [], ends, faint: path !== undefined };
}

/** Poses at both ends of a path of cells, in the direction of its first and last step. @param {Plan | null} plan @returns {number[][]} */
function endsOf(plan) {
  const cells = plan?.cells ?? [];
  const n = cells.length / 2;
  if (n < 2) return [];
  return [[0, 1, 0], [n - 2, n - 1, n - 1]].map(([a, b, at]) => [cells[2 * at], cells[2 * at + 1],
    Math.atan2(cells[2 * a + 1] - cells[2 * b + 1], cells[2 * b] - cells[2 * a]), 1]);
}

/** The path of a plan: its cells, or where the robot drives if the planner plans poses. @param {Plan} plan @param {Page} page @returns {import("./marks.js").Way} */
function wayOf(plan, page) {
  const places = plan.pose_cells && (plan.speed?.xy ?? plan.pose_cells.map(([x, y]) => [x, y]));
  const cells = places ? Float32Array.from(places.flat()) : plan.cells;
  return { cells, shares: sharesOf(plan, page, cells.length / 2) };
}

/** Speeds of a plan's nodes, 0 to 1. @param {Plan} plan @param {Page} page @param {number} nodes */
function sharesOf(plan, page, nodes) {
  const speeds = plan.speed?.v;
  if (!speeds || speeds.length !== nodes) return null;
  const most = plan.speed?.units.startsWith("m/s") ? Number(page.store.scenario.robot.v_max ?? 1) : Math.max(...speeds);
  return speeds.map((v) => (most > 0 ? v / most : 0));
}

/** Plans: at most one question in flight; when its answer has come, the newest state is asked. */
class Plans {
  /** @param {Page} page */
  constructor(page) {
    this._page = page;
    this._wanted = false;
    this._asking = false;
    /** @type {AbortController | null} */
    this._abort = null;
    this._began = 0;
    /** Says that a plan is late. */
    this._late = 0;
  }

  /** From now on a plan is awaited, or it is not any more. @param {boolean} on */
  _wait(on) {
    const page = this._page;
    if (on) {
      this._late ||= window.setTimeout(() => {
        page.planning = true;
        page.busy("plan", true);
      }, LATE);
      return;
    }
    clearTimeout(this._late);
    this._late = 0;
    page.planning = false;
    page.busy("plan", false);
  }

  want() {
    this._wanted = true;
    if (this._page.gone) return;
    if (!this._asking) void this._ask();
    else {
      const left = Math.max(0, this._began + PATIENCE - performance.now());
      const abort = this._abort;
      setTimeout(() => {
        if (this._wanted && this._abort === abort) abort?.abort();
      }, left);
    }
  }

  async _ask() {
    const page = this._page;
    this._asking = true;
    while (this._wanted && !page.gone) {
      this._wanted = false;
      const { start, goal } = page.store.scenario;
      if (!start || !goal || !page.ground) {
        this._put(null);
        continue;
      }
      this._abort = new AbortController();
      this._began = performance.now();
      this._wait(true);
      try {
        const plan = await this._plan(this._abort.signal);
        this._put(plan);
      } catch (error) {
        if (this._abort.signal.aborted) continue;
        this._wait(false);
        this._failed(error);
      }
    }
    this._wait(false);
    this._asking = false;
    this._abort = null;
  }

  /** @param {AbortSignal} signal @returns {Promise<Plan | null>} */
  async _plan(signal) {
    const page = this._page;
    /** @type {any} */
    let plan = null;
    for await (const { kind, bytes } of page.api.frames("/api/plan", { scenario: page.asked(true), record: false, layers: [] }, signal)) {
      if (kind === "X") throw new ServerError(200, json(bytes));
      if (kind === "Z") plan = json(bytes);
    }
    if (plan) plan.cells = Int16Array.from((plan.cells ?? []).flat());
    return plan;
  }

  /** @param {Plan | null} plan */
  _put(plan) {
    this._wait(false);
    this._page.plan = plan;
    this._page.tell("plan", plan);
  }

  /** A place that cannot be planned from is said where a plan's sentence is said, not as an alarm at each step of a drag. @param {unknown} error */
  _failed(error) {
    if (error instanceof ServerError && error.status !== 401) {
      this._put(/** @type {any} */ ({
        status: "error", sentence: error.message, cells: new Int16Array(0), waypoints: null, cost: null, optimal_cost: null, gap: null,
        sum_cost_to_go: null, iterations: 0, expansions: 0, gates: { count: 0, on_path: [], in_map: [] }, jumps: [], speed: null, seconds: 0,
      }));
    } else {
      this._page.fault(error);
    }
  }
}
