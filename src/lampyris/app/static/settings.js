// Settings: who plans, by which speed law, which robot, among what, from which seed. Every change goes through
// the store, so that it is undone, kept and linked like any other.
// ---- planner and law --------------------
// ---- preset, robot, seed --------------------

import { field } from "./fields.js";
import { block, button, el, explained, fill } from "./make.js";
import { rectangleOf } from "./shape.js";

/** @typedef {import("./fields.js").Setting} Setting */
/** @typedef {import("./fields.js").Field} Field */

/** What a preset stands for. @type {Record<string, {moves: string, law: string, title: string, about: string}>} */
const PRESETS = {
  robot: {
    moves: "octile", law: "physical", title: "Robot", about: "metres and seconds; a diagonal costs √2 and cuts no corner",
  },
  dissertation: {
    moves: "dissertation", law: "dissertation", title: "Dissertation",
    about: "its prices, 1 and 1.4, and its velocity units; corners may be cut",
  },
};

/** @type {Record<string, [string, string]>} */
const TRAITS = {
  optimal: ["optimal", "its path is a shortest one on a map that does not change"],
  incremental: ["repairs plans", "it keeps what it knows when the map changes"],
  stochastic: ["stochastic", "another seed may give another answer"],
  sees_traffic: ["sees traffic", "it plans around what moves, in time"],
  plans_headings: ["plans headings", "a path of poses for the robot's footprint and drive, with a bound on its cost"],
};

const MOVES = {
  octile: "octile: 8 directions, no corner cut", dissertation: "dissertation: 8 directions, 1 and 1.4", "four-connected": "four-connected: no diagonals",
  "sixteen-connected": "sixteen-connected: knight's moves too",
};

/** @param {string} name @param {string} title @param {string} unit @param {unknown} value @param {number} least @param {string} about @param {string} [none] @returns {Setting} */
function limit(name, title, unit, value, least, about, none) {
  return { name, title, unit, type: "number", default: value, choices: null, least, most: 1e6, about, allowed: "", none };
}

const MOST_SEED = Number.MAX_SAFE_INTEGER;

/** @param {string} name @param {string} title @param {unknown} value @param {number} least @param {number} most @param {string} about @param {string} [none] @returns {Setting} */
function whole(name, title, value, least, most, about, none) {
  return { name, title, type: "whole", default: value, choices: null, least, most, about, allowed: "", none };
}

const RADIUS = limit("radius", "radius", "m", 0, 0, "Radius of each; 0 is one cell.");

/** Settings of a simulation that are those of the robot's sensor, and their titles. @type {Record<string, string>} */
const SENSOR = { sensor_range: "Sensor range", field_of_view: "Field of view", unseen_cost: "Cost of unseen cells" };

/** Kinds of obstacles that are given by their number, with what else is said of them. @type {Array<{kind: string, title: string, about: string, more: Setting[]}>} */
const COUNTED = [
  {
    kind: "random-walk", title: "Random walkers", about: "step to a free neighbour or stay; they wait for the robot",
    more: [{
      name: "rate", title: "appear at a rate", type: "number", default: null, choices: null, least: 1e-9, most: 1,
      about: "Chance in each tick that one more appears. Empty: all are there from the start.", allowed: "", none: "all at once",
    }, RADIUS],
  },
  {
    kind: "crossing", title: "Crossing obstacles", about: "go from side to side and back; they do not wait",
    more: [RADIUS],
  },
];

/** @param {Page} page @param {HTMLElement} into */
export function mount(page, into) {
  /** @type {Array<() => void>} */
  const shown = [];
  const planner = block(into, "planner", "Planner");
  if (!planner) return;
  shown.push(plannerPart(page, planner));
  shown.push(presetPart(page, /** @type {HTMLElement} */ (block(into, "preset", "Steps and units"))));
  shown.push(lawPart(page, /** @type {HTMLElement} */ (block(into, "law", "Speed law"))));
  const robot = /** @type {HTMLElement} */ (block(into, "robot", "Robot"));
  shown.push(shapePart(page, robot));
  shown.push(plainPart(page, robot, page.hello.robot, "robot"));
  shown.push(seedPart(page, /** @type {HTMLElement} */ (block(into, "seed", "Seed and end"))));
  const traffic = document.getElementById("traffic") ?? into;
  shown.push(trafficPart(page, /** @type {HTMLElement} */ (block(traffic, "counted", "Moving obstacles"))));
  mountTraffic(page, traffic);
  const sensor = page.hello.simulate.filter((/** @type {Setting} */ { name }) => name in SENSOR).map((/** @type {Setting} */ row) => ({ ...row, title: SENSOR[row.name], none: row.none && "none" }));
  shown.push(plainPart(page, /** @type {HTMLElement} */ (block(traffic, "sensor", "Sensor, for an unknown map")), sensor, "simulate"));
  const show = () => shown.forEach((one) => one());
  page.store.listen(show);
  show();
}

// ---- planner and law --------------------

/** @param {Page} page @param {HTMLElement} into */
function plannerPart(page, into) {
  const planners = [...page.hello.planners, ...page.hello.planners_of_poses];
  const pick = el("select", { "aria-label": "Planner" }, ...families(planners));
  const facts = el("div", { class: "stack tight" });
  const form = new Form(page, (settings) => {
    const { planner } = page.store.scenario;
    return { planner: { ...planner, settings } };
  }, "planner");
  into.append(pick, facts, form.root);
  /** Settings of planners that were left, so that going back finds them. @type {Map<string, Record<string, unknown>>} */
  const left = new Map();
  /** Of planners of poses that were left. @type {Record<string, any> | null | undefined} */
  let drive = null;
  pick.addEventListener("change", () => {
    const { planner } = page.store.scenario;
    left.set(planner.name, planner.settings);
    // Planners of poses always drive in continuous time; the others do if they are set to.
    const poses = (/** @type {string} */ name) => page.hello.planners_of_poses.some((/** @type {any} */ row) => row.name === name);
    if (poses(planner.name) && !poses(pick.value)) {
      drive = page.store.scenario.drive;
      page.store.set({ planner: { name: pick.value, settings: left.get(pick.value) ?? {} }, drive: undefined });
    } else {
      const kept = poses(pick.value) ? { drive: page.store.scenario.drive ?? drive ?? undefined } : {};
      page.store.set({ planner: { name: pick.value, settings: left.get(pick.value) ?? {} }, ...kept });
    }
  });
  return () => {
    const now = page.store.scenario.planner;
    const row = planners.find((/** @type {any} */ one) => one.name === now.name);
    pick.value = now.name;
    if (!row) {
      fill(facts, el("p", { class: "bad" }, `There is no planner called ${now.name}.`));
      form.show("", [], {});
      return;
    }
    fill(facts, el("p", null, stopped(row.summary)), el("p", { class: "row" },
      ...Object.entries(TRAITS).filter(([key]) => row.traits[key]).map(([, [word, about]]) => el("span", { class: "chip", title: about }, word))),
    el("details", { class: "more" }, el("summary", null, "Source"), el("p", { class: "hint" }, row.source)));
    form.show(row.name, row.settings, now.settings);
  };
}

/** Planners in groups by what they are. @param {any[]} rows */
function families(rows) {
  const groups = [
    ["Glowworm walk", (/** @type {any} */ r) => r.name === "ad-gso"],
    ["Shortest paths", (/** @type {any} */ r) => r.traits.optimal],
    ["Among what moves", (/** @type {any} */ r) => r.traits.sees_traffic],
    ["Swarms", (/** @type {any} */ r) => r.traits.stochastic],
    ["With a shape and a heading", (/** @type {any} */ r) => r.traits.plans_headings],
    ["Others", () => true],
  ];
  const left = new Set(rows);
  return groups.map(([title, fits]) => {
    const some = [...left].filter(/** @type {(row: any) => boolean} */ (fits));
    some.forEach((row) => left.delete(row));
    return some.length ? el("optgroup", { label: String(title) },
      ...some.map((row) => el("option", { value: row.name }, explained(row)))) : null;
  });
}

/** @param {Page} page @param {HTMLElement} into */
function lawPart(page, into) {
  const own = el("option", { value: "" });
  const pick = el("select", { "aria-label": "Speed law" }, own,
    ...page.hello.laws.map((/** @type {any} */ row) => el("option", { value: row.name }, explained(row))));
  const facts = el("div", { class: "stack tight" });
  const form = new Form(page, (settings) => ({ law: { name: named().name, settings } }), "law");
  into.append(pick, facts, form.root);
  const named = () => page.store.scenario.law ?? { name: PRESETS[page.store.scenario.preset]?.law ?? "physical", settings: {} };
  pick.addEventListener("change", () => page.store.set({ law: pick.value ? { name: pick.value, settings: {} } : null }));
  return () => {
    const now = named();
    own.textContent = `the preset's (${PRESETS[page.store.scenario.preset]?.law ?? "physical"})`;
    pick.value = page.store.scenario.law ? now.name : "";
    const row = page.hello.laws.find((/** @type {any} */ one) => one.name === now.name);
    if (!row) {
      fill(facts, el("p", { class: "bad" }, `There is no speed law called ${now.name}.`));
      form.show("", [], {});
      return;
    }
    fill(facts, el("p", null, stopped(row.summary)), el("p", { class: "row" }, el("span", { class: "chip" }, row.units)),
      el("details", { class: "more" }, el("summary", null, "Source"), el("p", { class: "hint" }, row.source)));
    form.show(row.name, withRules(row, now.settings), now.settings);
  };
}

/** Settings of a law, with those of the rules that are on. @param {any} row @param {Record<string, unknown>} now @returns {Setting[]} */
function withRules(row, now) {
  /** @type {Setting[]} */
  const all = [];
  for (const setting of row.settings) {
    all.push(setting);
    const inner = row.rules[setting.name];
    if (!inner || !isOn(setting.name, now)) continue;
    for (const [name, value] of Object.entries(inner)) {
      all.push({
        name, type: typeof value === "number" ? "number" : Array.isArray(value) ? "list" : typeof value === "string" ? "text" : "number",
        default: value, choices: null, least: null, most: null, about: "", allowed: "",
      });
    }
  }
  // A rule's text settings have no list of what is allowed here; they stay as they are.
  return all.filter((setting) => setting.type !== "text");
}

/** @param {string} rule @param {Record<string, unknown>} now */
function isOn(rule, now) {
  return now[rule] === "on" || now[rule] === true;
}

/** Settings of one planner or law. */
export class Form {
  /** @param {Page} page @param {(settings: Record<string, unknown>) => any} patch @param {string} key */
  constructor(page, patch, key) {
    this._page = page;
    this._patch = patch;
    this._key = key;
    this._shape = "";
    /** @type {Setting[]} */
    this._settings = [];
    /** @type {Record<string, unknown>} */
    this._now = {};
    /** @type {Map<string, Field>} */
    this._fields = new Map();
    this._rows = el("div", { class: "rows" });
    this._count = el("span", { class: "chip", hidden: true });
    this._reset = button("Defaults", () => this._page.store.set(this._patch({})), { class: "btn quiet" });
    this.root = el("details", { class: "more settings" }, el("summary", null, "Settings ", this._count), this._rows, this._reset);
  }

  /** @param {string} name @param {Setting[]} settings @param {Record<string, unknown>} now */
  show(name, settings, now) {
    this._settings = settings;
    this._now = now;
    const shape = `${name} ${settings.map((one) => one.name).join()}`;
    if (shape !== this._shape) this._build(shape);
    this.root.hidden = !settings.length;
    for (const one of settings) this._fields.get(one.name)?.put(one.name in now ? now[one.name] : one.default);
    const count = Object.keys(now).length;
    this._count.hidden = !count;
    this._count.textContent = `${count} changed`;
    this._reset.disabled = !count;
  }

  /** @param {string} shape */
  _build(shape) {
    const focused = document.activeElement instanceof HTMLElement && this._rows.contains(document.activeElement)
      ? document.activeElement.closest(".field")?.getAttribute("data-name") : null;
    this._shape = shape;
    this._fields.clear();
    let group = "";
    fill(this._rows, ...this._settings.flatMap((one) => {
      const rule = one.name.includes(".") ? one.name.split(".")[0] : "";
      const head = rule && rule !== group && !this._settings.some(({ name }) => name === rule) ? el("h3", null, rule.replaceAll("_", " ")) : null;
      group = rule;
      const made = field(one, (value, settled) => this._give(one, value, settled));
      made.row.setAttribute("data-name", one.name);
      made.row.classList.toggle("inner", one.name.includes("."));
      this._fields.set(one.name, made);
      return [head, made.row];
    }));
    if (focused) /** @type {HTMLElement | null} */ (this._fields.get(focused)?.row.querySelector("input, select"))?.focus();
  }

  /** @param {Setting} setting @param {unknown} value @param {boolean} settled */
  _give(setting, value, settled) {
    const settings = { ...this._now };
    if (JSON.stringify(value) === JSON.stringify(setting.default)) delete settings[setting.name];
    else settings[setting.name] = value;
    if (setting.choices?.join() === "on,off" && !isOn(setting.name, settings)) {
      for (const key of Object.keys(settings)) if (key.startsWith(`${setting.name}.`)) delete settings[key];
    }
    if (JSON.stringify(settings) !== JSON.stringify(this._now)) this._page.store.set(this._patch(settings), `${this._key}.${setting.name}`);
    if (settled) this._page.store.settle();
  }
}

// ---- preset, robot, seed --------------------

/** @param {Page} page @param {HTMLElement} into */
function presetPart(page, into) {
  const buttons = Object.entries(PRESETS).map(([name, { title, about }]) =>
    [name, button(title, () => page.store.set({ preset: name, law: null, moves: null }), { class: null, title: about })]);
  const about = el("p", { class: "hint" });
  const moves = field({
    name: "moves", type: "word", default: null, choices: page.hello.moves, least: null, most: null, allowed: "",
    about: Object.values(MOVES).join("; "), none: "the preset's",
  }, (value) => page.store.set({ moves: value }));
  into.append(el("div", { class: "seg", role: "group", "aria-label": "Preset" }, ...buttons.map(([, one]) => /** @type {Node} */ (one))), about, moves.row);
  return () => {
    const { preset } = page.store.scenario;
    for (const [name, one] of buttons) /** @type {HTMLElement} */ (one).setAttribute("aria-pressed", String(name === preset));
    about.textContent = PRESETS[preset] ? stopped(PRESETS[preset].about) : "";
    moves.put(page.store.scenario.moves ?? null);
  };
}

/** Fields that are keys of one table of the scenario; what has its default is left out. @param {Page} page @param {HTMLElement} into @param {Setting[]} settings @param {"robot" | "simulate"} key */
function plainPart(page, into, settings, key) {
  const fields = settings.map((one) => {
    const made = field(one, (value, settled) => {
      const table = { .../** @type {any} */ (page.store.scenario[key] ?? {}) };
      const before = one.name in table ? table[one.name] : one.default;
      if (value === one.default && key === "robot") delete table[one.name];
      else table[one.name] = value;
      if (value !== before) page.store.set({ [key]: table }, `${key}.${one.name}`);
      if (settled) page.store.settle();
    });
    made.row.setAttribute("data-name", one.name);
    into.append(made.row);
    return /** @type {[Setting, Field]} */ ([one, made]);
  });
  return () => {
    const table = /** @type {any} */ (page.store.scenario[key] ?? {});
    for (const [one, made] of fields) made.put(table[one.name] ?? one.default);
  };
}

const SIDES = /** @type {const} */ (["length", "width", "rear"]);

/** The robot's shape: a disc, or a rectangle around its base. @param {Page} page @param {HTMLElement} into */
function shapePart(page, into) {
  const give = (/** @type {Record<string, any>} */ shape, /** @type {string} */ mark) => {
    const { footprint, rectangle, radius, ...robot } = page.store.scenario.robot;
    page.store.set({ robot: { ...robot, ...shape } }, mark);
  };
  const pick = field({
    name: "shape", type: "word", default: "disc", choices: ["disc", "rectangle", "polygon"], least: null, most: null, allowed: "",
    about: "Planners of poses take a rectangle as it is, and a polygon from a scenario file; the others take the circle around it.",
  }, (value) => {
    const cell = page.ground?.resolution ?? 1;
    if (value === "rectangle") give({ rectangle: [Math.max(0.6, 1.2 * cell), Math.max(0.4, 0.8 * cell)] }, "");
    else if (value === "disc") give({}, "");
    else show();
  });
  const sides = SIDES.map((name) => field(
    limit(name, name === "rear" ? "base to back edge" : name, "m", 1, 1e-3, name === "rear" ? "From the base, such as the rear axle, to the back edge." : `Its ${name}.`),
    (value, settled) => {
      const now = rectangle(page.store.scenario.robot);
      if (!now) return;
      const next = { ...now, [name]: value };
      if (name === "length") next.rear = (now.rear / now.length) * value;
      if (next.rear >= next.length) return;
      if (next[name] !== now[name]) give(Math.abs(next.rear - next.length / 2) < 1e-9 ? { rectangle: [next.length, next.width] }
        : { footprint: rectangleOf(next.length, next.width, next.rear) }, `robot.${name}`);
      if (settled) page.store.settle();
    }));
  into.append(pick.row, ...sides.map(({ row }) => row));
  const show = () => {
    const { robot } = page.store.scenario;
    const now = rectangle(robot);
    const disc = !robot.rectangle && !robot.footprint;
    pick.put(disc ? "disc" : now ? "rectangle" : "polygon");
    SIDES.forEach((name, k) => {
      sides[k].row.hidden = !now;
      if (now) sides[k].put(Number(now[name].toPrecision(12)));
    });
    const radius = /** @type {HTMLElement | null} */ (into.querySelector("[data-name=radius]"));
    if (radius) radius.hidden = !disc;
  };
  return show;
}

/** Sides of a robot's rectangle; null: it has another shape. @param {Record<string, any>} robot */
function rectangle({ rectangle: sides, footprint }) {
  if (sides) return { length: sides[0], width: sides[1], rear: sides[0] / 2 };
  const xs = (footprint ?? []).map((/** @type {number[]} */ v) => v[0]);
  const ys = (footprint ?? []).map((/** @type {number[]} */ v) => v[1]);
  const [length, width, rear] = [Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys), -Math.min(...xs)];
  const same = xs.length === 4 && JSON.stringify(rectangleOf(length, width, rear)) === JSON.stringify(footprint);
  return same ? { length, width, rear } : null;
}

/** @param {Page} page @param {HTMLElement} into */
function seedPart(page, into) {
  const seed = field(whole("seed", "seed", 0, 0, MOST_SEED, "Root of every draw: the same seed gives the same run, byte for byte."),
    (value, settled) => {
      if (value !== page.store.scenario.seed) page.store.set({ seed: value }, "seed");
      if (settled) page.store.settle();
    });
  const dice = button("⚄", () => {
    const [drawn] = crypto.getRandomValues(new Uint32Array(1));
    page.store.set({ seed: drawn % 1_000_000 });
  }, { class: "btn icon dice", title: "Another seed", "aria-label": "Draw another seed" });
  seed.row.classList.add("with-dice");
  seed.row.insertBefore(dice, seed.row.children[2] ?? null);
  into.append(seed.row);
  const rows = page.hello.simulate.filter((/** @type {Setting} */ { name }) => !(name in SENSOR));
  const rest = plainPart(page, into, rows.map((/** @type {Setting} */ row) => ({ ...row, title: row.name === "ticks" ? "ticks at most" : row.name })), "simulate");
  return () => {
    seed.put(page.store.scenario.seed);
    rest();
  };
}

// ---- traffic --------------------

/** @param {Page} page @param {HTMLElement} into */
function trafficPart(page, into) {
  const counted = COUNTED.map((group) => countedPart(page, into, group));
  const list = el("ul", { class: "placed" });
  const none = el("p", { class: "hint" }, "Patrols are drawn on the map, with its tool for obstacles.");
  into.append(el("h3", null, "Placed one by one"), list, none);
  const total = el("p", { class: "hint" });
  const clear = button("Clear", () => page.store.set({ obstacles: [] }), { class: "btn quiet" });
  into.append(el("div", { class: "row" }, total, clear));
  return () => {
    counted.forEach((show) => show());
    const { obstacles } = page.store.scenario;
    const placed = [...obstacles.entries()].filter(([, one]) => !COUNTED.some(({ kind }) => kind === one.kind));
    fill(list, ...placed.map(([k, one]) => placedPart(page, k, one)));
    none.hidden = placed.length > 0;
    const all = obstacles.reduce((sum, one) => sum + (COUNTED.some(({ kind }) => kind === one.kind) ? one.count : 1), 0);
    total.textContent = all ? `${all.toLocaleString("en")} in all.` : "Nothing moves but the robot.";
    clear.hidden = !all;
  };
}

/** A kind of obstacles by number: the first table of that kind in the scenario. @param {Page} page @param {HTMLElement} into @param {{kind: string, title: string, about: string, more: Setting[]}} group */
function countedPart(page, into, group) {
  const find = () => page.store.scenario.obstacles.findIndex((one) => one.kind === group.kind);
  const give = (/** @type {string} */ key, /** @type {unknown} */ value, /** @type {boolean} */ settled) => {
    const obstacles = [...page.store.scenario.obstacles];
    const k = find();
    const now = k < 0 ? { kind: group.kind, count: 0 } : obstacles[k];
    if ((now[key] ?? (key === "count" ? 0 : group.more.find((one) => one.name === key)?.default)) !== value) {
      const next = { ...now, [key]: value };
      if (k < 0) obstacles.push(next);
      else if (next.count === 0) obstacles.splice(k, 1);
      else obstacles[k] = next;
      page.store.set({ obstacles }, `${group.kind}.${key}`);
    }
    if (settled) page.store.settle();
  };
  const count = field(whole("count", group.title, 0, 0, page.hello.limits.obstacles, `They ${group.about}.`), (value, settled) => give("count", value, settled));
  const more = group.more.map((one) => /** @type {[Setting, Field]} */ ([one, field(one, (value, settled) => give(one.name, value, settled))]));
  const rest = el("div", { class: "inner" }, ...more.map(([, one]) => one.row));
  into.append(count.row, rest);
  return () => {
    const now = page.store.scenario.obstacles[find()];
    count.put(now?.count ?? 0);
    rest.hidden = !now;
    for (const [one, made] of more) made.put(now?.[one.name] ?? one.default);
  };
}

/** @param {Page} page @param {number} k @param {Record<string, any>} one */
function placedPart(page, k, one) {
  const cells = one.waypoints ?? one.track ?? [];
  const at = cells.length ? `from (${cells[0]})` : one.file ?? "";
  const words = one.kind === "patrol" ? `patrol ${at}, ${cells.length} ${cells.length === 1 ? "cell" : "cells"}`
    : `${one.kind} ${at}${cells.length ? `, ${cells.length} ticks` : ""}`;
  const away = button("×", () => page.store.set({ obstacles: page.store.scenario.obstacles.filter((_, j) => j !== k) }),
    { class: "btn quiet icon", "aria-label": `Take away ${words}` });
  return el("li", { class: "row" }, el("span", { class: "grow" }, words), away);
}

/** A sentence with its full stop. @param {string} text */
function stopped(text) {
  const word = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.!?]$/.test(word) ? word : `${word}.`;
}

// ---- what was drawn on the map, in words, below the numbers ----

/** @param {Page} page @param {HTMLElement} pane */
function mountTraffic(page, pane) {
  const { store } = page;
  const draw = el("button", { type: "button", class: "btn", "aria-pressed": String(page.tool === "patrol"), onclick: () => page.use("patrol") }, "Draw a patrol on the map");
  (pane.querySelector(":scope > .counted") ?? pane).append(draw);
  const list = el("ul", { class: "plain" });
  const none = el("p", { class: "hint" }, "None. Paint with the brush (B); while a run is shown, the wall comes at that moment and the run is made again from there.");
  const box = el("div", { class: "walls" }, el("h2", {}, "Painted walls"), none, list);
  pane.append(box);

  const show = () => {
    const { edits } = store.scenario;
    none.hidden = edits.length > 0;
    list.replaceChildren(...edits.map((edit) => {
      const when = edit.tick ? `at tick ${edit.tick}` : "before the start";
      const parts = [];
      if (edit.blocked.length) parts.push(`${edit.blocked.length.toLocaleString("en")} walls`);
      if (edit.freed.length) parts.push(`${edit.freed.length.toLocaleString("en")} freed`);
      const gone = el("button", { type: "button", class: "btn quiet icon", "aria-label": `Take back what was painted ${when}`, title: "Take back",
        onclick: () => store.set({ edits: store.scenario.edits.filter((one) => one !== edit) }) }, "\u00d7");
      const to = el("button", { type: "button", class: "btn quiet grow", disabled: !page.run || !edit.tick, onclick: () => page.play.seek(edit.tick) }, `${when}: ${parts.join(", ")}`);
      return el("li", { class: "row" }, to, gone);
    }));
  };
  store.listen(show);
  page.on("run", show);
  page.on("tool", (tool) => draw.setAttribute("aria-pressed", String(tool === "patrol")));
  show();
}
