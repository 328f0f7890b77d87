// State: one scenario and how it is looked at. Everything that decides a run is in the scenario; it can be undone,
// it is kept as a draft in the browser, and it fits into a link.

import { cellsOf, fragment, ofLink, textOf, toLink } from "./link.js";

const DRAFT = "lampyris-draft";
/** How the draft was looked at: as `v` of a link. */
const LOOK = "lampyris-look";
const DEEP = 200;

/** @returns {Scenario} */
export function blank() {
  return {
    version: 1, map: "env-3", start: null, goal: null, start_yaw: null, goal_yaw: null, robot: {}, preset: "robot", moves: null,
    planner: { name: "ad-gso", settings: {} }, law: null, seed: 0, obstacles: [], edits: [],
    simulate: { ticks: null, patience: null },
  };
}

export class Store {
  constructor() {
    /** @type {Scenario} */
    this.scenario = blank();
    /** @type {Scenario[]} */
    this._past = [];
    /** @type {Scenario[]} */
    this._future = [];
    /** @type {Set<(changed: Set<string>) => void>} */
    this._listeners = new Set();
    this._mark = "";
    /** Somebody has changed something: what the page began with, and ends that the map gives, are nobody's work. */
    this.touched = false;
  }

  /** Have a function called at each change, with the keys that changed. @param {(changed: Set<string>) => void} listener */
  listen(listener) {
    this._listeners.add(listener);
  }

  /**
   * Change some keys. Changes with the same `mark` one after the other (a drag, a stroke) are undone at once.
   * @param {Partial<Scenario>} patch
   * @param {string} [mark]
   */
  set(patch, mark = "") {
    if (!mark || mark !== this._mark) this.remember(this.scenario);
    this.touched ||= mark !== "map";
    this._mark = mark;
    this._future = [];
    this.scenario = { ...this.scenario, ...patch };
    this._told(new Set(Object.keys(patch)));
  }

  /** The stroke or drag is over: the next one is undone apart from it. */
  settle() {
    this._mark = "";
  }

  /** Put another scenario in the place of this one. @param {Scenario} scenario @param {boolean} [undoable] */
  replace(scenario, undoable = true) {
    if (undoable) this.remember(this.scenario);
    this.touched ||= undoable;
    this._future = [];
    // Ends that the map gives are no step of their own.
    this._mark = "map";
    const keys = new Set([...Object.keys(this.scenario), ...Object.keys(scenario)]);
    this.scenario = { ...blank(), ...scenario };
    this._told(keys);
  }

  /** A scenario to be had back by undoing. @param {Scenario} scenario */
  remember(scenario) {
    this._past.push(scenario);
    if (this._past.length > DEEP) this._past.shift();
  }

  get canUndo() {
    return this._past.length > 0;
  }

  get canRedo() {
    return this._future.length > 0;
  }

  undo() {
    this._step(this._past, this._future);
  }

  redo() {
    this._step(this._future, this._past);
  }

  /** @param {Scenario[]} from @param {Scenario[]} to */
  _step(from, to) {
    const scenario = from.pop();
    if (!scenario) return;
    to.push(this.scenario);
    this.touched = true;
    const keys = changed(this.scenario, scenario);
    this.scenario = scenario;
    this._mark = "";
    this._told(keys);
  }

  /** @param {Set<string>} keys */
  _told(keys) {
    for (const listener of this._listeners) listener(keys);
  }
}

/** Keys whose values differ. @param {Scenario} a @param {Scenario} b */
function changed(a, b) {
  const keys = new Set([...Object.keys(a), ...Object.keys(b)]);
  for (const key of [...keys]) {
    if (/** @type {any} */ (a)[key] === /** @type {any} */ (b)[key]) keys.delete(key);
  }
  return keys;
}

/**
 * A scenario of a file, a link or a draft in the form that the page has: every key there, names as tables.
 * What is wrong inside is the server's to say.
 * @param {any} made @param {string} from what to call it in a message @returns {Scenario}
 */
export function tidy(made, from) {
  if (!made || typeof made !== "object" || made.version !== 1 || !made.map) {
    throw new Error(`${from} is not a lampyris scenario: it needs "version": 1 and a "map".`);
  }
  const named = (/** @type {any} */ who) => (typeof who === "string" ? { name: who, settings: {} } : who ? { settings: {}, ...who } : null);
  const cell = (/** @type {any} */ given) => {
    const end = given?.cell ?? given;
    return Array.isArray(end) && end.length === 2 && end.every(Number.isInteger) ? end : null;
  };
  /** A pose in metres is held until its map is there: see `settled`. */
  const ends = (/** @type {"start" | "goal"} */ end) => {
    const given = made[end];
    const yaw = given?.yaw ?? given?.pose?.[2] ?? made[`${end}_yaw`];
    return { [end]: cell(given), [`${end}_yaw`]: Number.isFinite(yaw) ? yaw : null, ...(given?.pose || given?.m ? { [`${end}_m`]: given.pose ?? given.m } : {}) };
  };
  const list = (/** @type {any} */ some) => (Array.isArray(some) ? some : []);
  const rivals = list(made.controllers).filter((one) => typeof one?.name === "string");
  const edits = list(made.edits).map((one) => ({ tick: Number(one?.tick) || 0, blocked: cellsOf(one?.blocked), freed: cellsOf(one?.freed) }));
  return {
    ...blank(), ...made, planner: named(made.planner) ?? blank().planner, law: named(made.law), ...ends("start"), ...ends("goal"),
    obstacles: list(made.obstacles).filter((one) => one && typeof one === "object"), edits, robot: made.robot ?? {},
    drive: made.drive ?? undefined, controllers: rivals.length ? rivals : undefined,
  };
}

/**
 * Keep a draft, in the tab and for tabs to come; a browser that refuses (private windows, no room) costs the draft and
 * nothing else: the link still holds everything.
 * @param {Scenario} scenario @param {string} look
 */
function keep(scenario, look) {
  const text = textOf(scenario);
  for (const shelf of shelves()) {
    try {
      shelf.setItem(DRAFT, text);
      shelf.setItem(LOOK, look);
    } catch {
      // Said nowhere.
    }
  }
}

/** What was drawn last in this tab, else in this browser. @returns {{scenario: Scenario, look: string} | null} */
function draft() {
  for (const shelf of shelves()) {
    try {
      const text = shelf.getItem(DRAFT);
      if (text) return { scenario: tidy(JSON.parse(text), "The draft"), look: shelf.getItem(LOOK) ?? "" };
    } catch {
      // Not this one then.
    }
  }
  return null;
}

/** Where drafts are: the tab's own, then the browser's. */
function* shelves() {
  for (const name of /** @type {const} */ (["sessionStorage", "localStorage"])) {
    try {
      yield window[name];
    } catch {
      // A browser that has none.
    }
  }
}

/** A link longer than this is not put into the address bar: browsers end between 1 and 2 million letters. */
const LONGEST = 500_000;
const SOON = 300;

/** How the state is looked at, for the link: layer, moment, and where the map is if not all of it is shown. @param {Page} page @param {string} layer */
function viewOf(page, layer) {
  const { map, ground } = page;
  const { view } = map;
  const tick = page.run && !page.play.playing ? Math.floor(page.play.tick) : 0;
  const place = map.fitted || !ground ? "" : [(view.width / 2 - view.x) / view.scale, (view.height / 2 - view.y) / view.scale, view.scale].map((v) => v.toFixed(2)).join("_");
  return layer === "none" && !tick && !place && !MEET.test(page.met()) ? "" : `${layer}~${tick}~${place}`;
}

/** Who meets, where the comparison is shown: it makes its own runs. See meeting.js. */
const MEET = /,[12],\d+\]$/;

/** Look at it in the same way. @param {Page} page @param {string} text */
function look(page, text) {
  const [layer, tick, place] = text.split("~");
  const [cx, cy, scale] = (place ?? "").split("_").map(Number);
  if (scale > 0 && Number.isFinite(cx + cy + scale)) page.map.look(cx, cy, scale);
  if (/^[a-z]+$/.test(layer)) page.tell("show-layer", layer);
  if (MEET.test(page.met())) void page.show("compare");
  else if (Number(tick) > 0 && Number(tick) < 1e6) void page.simulate({ tick: Number(tick), play: false });
}

/** Keep draft and address with the state, not at each step of a drag. @param {Page} page */
export function mount(page) {
  const { store } = page;
  let timer = 0;
  let layer = "none";
  /** The look of the link that was opened, until its map is there. */
  let wanted = fragment().get("v") ?? "";
  let begun = false;
  let reported = false;
  // Nobody's work does not take the place of somebody's.
  const save = () => store.touched && keep(store.scenario, viewOf(page, layer));
  const address = async () => {
    const look = viewOf(page, layer);
    const met = page.met();
    return `${location.origin}${location.pathname}#t=${fragment().get("t") ?? ""}&s=${await toLink(store.scenario)}${look && `&v=${look}`}${met && `&c=${encodeURIComponent(met)}`}`;
  };
  const now = async () => {
    clearTimeout(timer);
    timer = 0;
    const { scenario } = store;
    save();
    const made = await address();
    if (scenario !== store.scenario) return;
    // Too long for an address: the draft has it, and a file can.
    const long = made.length > LONGEST;
    // Where it came from has it.
    if (long && !store.touched) return;
    const short = long ? `${location.origin}${location.pathname}#t=${fragment().get("t") ?? ""}` : made;
    if (long && !reported) page.say("This drawing is too large for the address. This tab keeps it as a draft; to send it on, save the scenario (Export).");
    reported = long;
    if (short !== location.href) history.replaceState(null, "", short);
  };
  const soon = () => {
    if (begun && !timer) timer = window.setTimeout(() => void now(), SOON);
  };
  store.listen(() => {
    begun = true;
    soon();
  });
  page.on("layer", (name) => {
    layer = name;
    soon();
  });
  page.on("map", () => {
    if (page.ground) soon();
  });
  page.on("tick", () => {
    if (!page.play.playing) soon();
  });
  for (const name of ["play", "met", "token"]) page.on(name, soon);
  page.on("look", (text) => (wanted = text));
  // A link or a draft of a fleet: its panel takes it from here.
  page.on("ground", () => {
    if (page.ground && store.scenario.fleet?.open && !page.fleet) void page.show("fleet");
  });
  page.on("ground", () => {
    if (!wanted) return;
    const text = wanted;
    wanted = "";
    look(page, text);
  });
  addEventListener("pagehide", () => {
    if (timer) save();
  });
  page.link = address;
  addEventListener("hashchange", ({ oldURL, newURL }) => {
    // As it was opened: what was drawn a moment before may have taken its place in the address.
    const [before, said] = [oldURL, newURL].map((url) => fragment(new URL(url).hash));
    wanted = said.get("v") ?? "";
    void arrived(page, said, said.get("t") !== before.get("t"));
  });
  page.on("gone", (gone) => {
    if (gone && begun) save();
  });
}

/**
 * Another address was opened in this tab. A new server's names the map that it was started with, each time it is
 * started: what is here stays, as the page has said of it. @param {Page} page
 * @param {URLSearchParams} said @param {boolean} anew whether it is a new server's
 */
async function arrived(page, said, anew) {
  page.api.token = said.get("t") ?? "";
  const text = said.get("s");
  if (text) {
    try {
      const scenario = tidy(await ofLink(text), "The link");
      if (textOf(scenario) !== textOf(page.store.scenario)) page.store.replace(scenario);
    } catch {
      page.say("That link is damaged; this is still what was here before.", "bad");
    }
  }
  const name = said.get("m");
  if (!text && !anew && name && mapOf(page.store.scenario.map) !== name) {
    if (drawn(page.store.scenario)) page.say(UNDO);
    page.store.replace({ ...blank(), map: name });
  }
  page.tell("token");
  if (MEET.test(said.get("c") ?? "")) void page.show("compare");
}

const UNDO = "What you drew last, on another map, is one undo away.";

/** Whether there is work in it. @param {Scenario | null} scenario */
function drawn(scenario) {
  return scenario !== null && (scenario.edits.length > 0 || scenario.obstacles.length > 0);
}

/** The map of a scenario in a word. @param {any} spec */
function mapOf(spec) {
  return typeof spec === "string" ? spec : spec?.library ?? spec?.bundled ?? "";
}

/**
 * What to begin with: the link's state, else the map that was asked for, else the draft. What was drawn last is never
 * thrown away: where something else is asked for it is one undo away, and on the same map it is what is shown.
 * @param {Page} page @returns {Promise<Scenario | null>}
 */
export async function first(page) {
  const said = fragment();
  const text = said.get("s");
  const last = draft();
  const kept = last?.scenario ?? null;
  if (text) {
    try {
      const linked = tidy(await ofLink(text), "The link");
      if (kept && textOf(kept) !== textOf(linked)) page.store.remember(kept);
      return linked;
    } catch {
      page.say("The link is damaged; this is what was drawn last.", "bad");
    }
  }
  const name = said.get("m");
  if (name && mapOf(kept?.map) !== name) {
    if (kept) page.store.remember(kept);
    if (drawn(kept)) page.say(UNDO);
    return { ...blank(), map: name };
  }
  if (last) page.tell("look", last.look);
  if (name && drawn(kept)) page.say(`This is what you drew last on ${name}; choose the map again for a clean one.`);
  return kept;
}
