// Tour: the worked 10x10 example in twelve steps: what each says, what it puts on the map, and each table of the
// dissertation beside what lampyris computes. The scenario that was there before comes back when it is left.

import { GATE, VEIL } from "./colours.js";
import { GOAL, keep, scenario, SIDE, START } from "./opening.js";
import { avoidedTable, cellOf, fieldTable, index, nodesTable, numbers, pointerTable, velocityTable, walkTable, wallsAgree } from "./guide.js";
import { gatesOf } from "./layers.js";
import { block, button, el, fill, sentence, spelled } from "./make.js";
import { ACCEPTED, CHOSEN, marksOf, Stagehand, stretchOf, turned, wayOf } from "./steps.js";

/** @typedef {import("./guide.js").Numbers} Numbers */

const INTRO = "The dissertation's 10 × 10 example in twelve steps, with its tables beside what is computed here.";

/** @param {Page} page @param {HTMLElement} into */
export function mount(page, into) {
  const place = block(into, "tour", "The dissertation, step by step");
  if (place) new Tour(page, place);
}

class Tour {
  /** @param {Page} page @param {HTMLElement} into */
  constructor(page, into) {
    this.page = page;
    /** @type {Numbers | null} */
    this.numbers = null;
    /** @type {Scenario | null} */
    this.before = null;
    /** @type {Scenario | null} */
    this.own = null;
    this.at = 0;
    /** Moment of the run that was shown before; -1: there was none. */
    this.tick = -1;
    this.hand = new Stagehand(page, () => this._draw());
    this.intro = el("p", { class: "hint", role: "status" }, INTRO);
    this.open = button("Begin the tour", () => this._open(), { class: "btn primary" });
    this.back = button("Back", () => this._go(this.at - 1));
    this.next = button("Next", () => this._go(this.at + 1), { class: "btn primary" });
    this.dots = el("progress", { max: STEPS.length, value: 1, "aria-hidden": "true" });
    this.count = el("p", { class: "hint" });
    this.title = el("h3", { tabindex: -1 });
    this.words = el("div", { class: "stack words", "aria-live": "polite" });
    this.table = el("div", { class: "stack wide", tabindex: 0, role: "group", "aria-label": "Tables of this step" });
    this.box = el("div", { class: "stack", hidden: true }, this.count, this.dots, this.title, this.words,
      el("div", { class: "row" }, this.back, this.next, button("Leave the tour", () => this.leave(), { class: "btn quiet" })), this.table);
    into.append(this.intro, this.open, this.box);
    into.addEventListener("keydown", (event) => this._key(event));
    page.store.listen(() => {
      if (this.own && page.store.scenario !== this.own && this.hand.on) this._changed();
    });
  }

  async _open() {
    const { page } = this;
    this.open.disabled = true;
    this.intro.textContent = "Working out its numbers.";
    try {
      this.numbers ??= await numbers(page);
      this.before = page.store.scenario;
      this.tick = page.run ? page.play.tick : -1;
      keep(this.before);
      page.stop();
      page.store.replace(scenario());
      this.own = page.store.scenario;
      await shown(page);
      this.hand.take();
      page.map.fit();
      page.show("learn");
      this.box.hidden = false;
      this.intro.hidden = true;
      this.open.hidden = true;
      this.at = 0;
      this._go(0);
    } catch (error) {
      page.say(sentence(error), "bad");
      this._restore();
    } finally {
      this.open.disabled = false;
      this.intro.textContent = INTRO;
    }
  }

  /** Someone changed the example: the tour ends there, and what was before can be had by undoing. */
  _changed() {
    this.own = null;
    this._close();
    this.before = null;
    keep(null);
    this.page.say("The example was changed, so the tour has ended. Undo brings your own scenario back.");
  }

  leave() {
    this._close();
    this._restore();
    this.open.focus();
  }

  _close() {
    this.hand.give();
    this.box.hidden = true;
    this.intro.hidden = false;
    this.open.hidden = false;
  }

  _restore() {
    const { store } = this.page;
    const { before, own } = this;
    this.before = null;
    this.own = null;
    keep(null);
    if (!before || !own) return;
    // Undoing puts back scenario and history as they were.
    if (store.scenario === own) store.undo();
    if (JSON.stringify(store.scenario) !== JSON.stringify(before)) store.replace(before);
    // The same scenario makes the same run.
    if (this.tick >= 0) void this.page.simulate({ tick: this.tick, play: false });
  }

  /** @param {number} k */
  _go(k) {
    this.at = Math.min(Math.max(k, 0), STEPS.length - 1);
    const step = STEPS[this.at];
    const n = /** @type {Numbers} */ (this.numbers);
    this.count.textContent = `Step ${this.at + 1} of ${STEPS.length}`;
    this.dots.value = this.at + 1;
    this.title.textContent = step.title;
    fill(this.words, ...step.say(n).filter(Boolean).map((text) => el("p", null, text)));
    fill(this.table, ...(step.table?.(n) ?? []));
    this.back.disabled = this.at === 0;
    this.next.disabled = this.at === STEPS.length - 1;
    if (document.activeElement === this.next && this.next.disabled) this.back.focus();
    this._draw();
    this.title.scrollIntoView({ block: "nearest" });
  }

  _draw() {
    const { page, numbers: n } = this;
    if (n && this.hand.on && page.ground) this.hand.show(STEPS[this.at].show(n, page));
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    if (!this.hand.on) return;
    turned(event, (by) => this._go(this.at + by), () => this.leave());
  }
}

/** Once the example's map is on the screen. @param {Page} page @returns {Promise<void>} */
function shown(page) {
  return new Promise((resolve, reject) => {
    const look = () => page.ground?.width === SIDE && page.ground.height === SIDE && page.ground.name.includes("guide");
    const late = setTimeout(() => reject(new Error("the example's map did not come")), 10_000);
    const check = () => {
      if (!look()) return;
      clearTimeout(late);
      resolve();
    };
    page.on("ground", check);
    check();
  });
}

// ---- the twelve steps ----

/** @typedef {import("./make.js").Part} Part */

/**
 * A step: what is said, what is on the map, and its table.
 * @typedef {{title: string, say: (n: Numbers) => string[], show: (n: Numbers, page: Page) => Parameters<Stagehand["show"]>[0], table?: (n: Numbers) => Part[]}} Step
 */

const ARROWS = ["↖", "↑", "↗", "←", "·", "→", "↙", "↓", "↘"];

/** @type {Step[]} */
const STEPS = [
  {
    title: "A map of a hundred cells",
    say: (n) => [
      "Ten columns, ten rows. A cell is named by its column and then its row, counted from the upper left: the robot starts at (0,9), lower left, and drives to (7,0), above.",
      `The dissertation draws this map in its Figure 4.1. The walls here are the cells to which its Table 4.2 gives 10000${n.printed ? `: ${wallsAgree(n)}` : ""}.`,
    ],
    show: () => ({}),
  },
  {
    title: "What is left to drive",
    say: (n) => [
      "A wave goes out from the goal and writes into each cell the least cost from there to the goal: 1 for a straight step, 1.4 for a diagonal one. Diagonals may cut corners.",
      `At the start it says ${n.cost[index(START)].toFixed(1)}. That is the cost of a shortest path, before anybody has moved.`,
    ],
    show: (n, page) => ({ layer: n.layers.cost, bare: true, marks: texts(n.cost, (v) => v.toFixed(1), page.dark) }),
  },
  {
    title: "Luciferin",
    say: (n) => {
      const [k, p] = [index(START), n.parent[index(START)]];
      return [
        "Each cell glows by its own cost and by the glow of the cell that its back pointer names: 0.6 times the one and 0.6 times the other. Here less is better, and the goal has none at all.",
        `At the start: 0.6 × ${n.luciferin[p].toFixed(3)} + 0.6 × ${n.cost[k].toFixed(1)} = ${n.luciferin[k].toFixed(3)}.`,
      ];
    },
    show: (n, page) => ({ layer: n.layers.luciferin, bare: true, marks: texts(n.luciferin, (v) => v.toFixed(2), page.dark) }),
    table: (n) => fieldTable(n),
  },
  {
    title: "Back pointers",
    say: () => [
      "The arrow of a cell points to the neighbour through which its cost is reached. Where several would do, a fixed order decides, diagonals first; with that order all printed pointers of free cells come out, once the few that are printed row first are read that way.",
    ],
    show: (n) => ({ bare: true, marks: framed(n.parent.map((p, k) => ({ at: cellOf(k), colour: ACCEPTED, fill: 0, text: p < 0 ? "" : arrow(k, p) }))) }),
    table: (n) => pointerTable(n),
  },
  {
    title: "A gate",
    say: (n) => [
      `An opening one cell wide is a gate: walls on both sides. This map has ${n.plan.gates.count === 1 ? "one" : n.plan.gates.count}, at ${(n.plan.gates.in_map ?? []).map((/** @type {any} */ g) => spelled(g.cell)).join(" ") || "(7,5)"}; the dissertation counts ${n.printed?.whole.gates ?? "one"} too.`,
      "It leads into a dead end, so that no path needs it, and it stays open here.",
    ],
    show: (n) => {
      const gates = gatesOf(n.plan.gates);
      return { gates, marks: gates.map(({ at }) => ({ at, colour: GATE, fill: 0.2 })) };
    },
  },
  {
    title: "Iteration 0: from (0,9)",
    say: (n) => [
      `The robot looks around itself, ring by ring. Accepted is what is free, glows less than ${n.jumps[0].luciferin.toFixed(3)}, and can be reached through accepted cells. It stops with the ring in which there are ten: here the third.`,
      `The share of a cell is how much less it glows, out of all. The greatest share wins: ${spelled(n.jumps[0].chosen)}.`,
      n.printed ? "One printed share is a slip, that of (1,8): the others all come of one sum, and with ours in its place they add up to 1." : "",
    ],
    ...iteration(0),
  },
  {
    title: "Iteration 1: from (3,7)",
    say: (n) => [
      "The same again. The walls leave nine cells even with three rings, and more than three are never opened.",
      `${spelled(n.jumps[1].chosen)} has the greatest share. It is reached along the back pointers, in three steps.`,
    ],
    ...iteration(1),
  },
  {
    title: "Iteration 2: from (5,4)",
    say: (n) => [
      `The printed table stops at seven cells, fewer than ten, where by its own rule the third ring is still to come. With it, ${n.jumps[2].accepted.length} cells are accepted, and ${spelled(n.jumps[2].chosen)} glows least.`,
      "The printed shares also add up to 0.30 and not to 1: seven more cells went into the sum as if they had no luciferin. So this table agrees in its cells, not in its numbers.",
    ],
    ...iteration(2),
  },
  {
    title: "Iteration 3: to the goal",
    say: (n) => [
      `From ${spelled(n.jumps[3]?.at ?? [7, 1])} the goal is next door, and nothing glows less than it. The printed walk stands on (7,2) instead: the table below is worked out from there, to be compared.`,
      "It lists (8,1), which Table 4.2 has as a wall, and two cells that glow as much as the robot's own; shares again do not add up to 1.",
    ],
    show: (n, page) => ({ ...jumpShow(n, 3, page) }),
    table: (n) => walkTable(n, 3, n.fourth),
  },
  {
    title: "The whole path",
    say: (n) => {
      const printed = n.printed?.whole;
      const straight = n.plan.steps?.straight ?? 4;
      const diagonal = n.plan.steps?.diagonal ?? 6;
      return [
        `${n.jumps.length} iterations${printed ? `, as printed (${printed.iterations})` : ""}, ${straight} straight steps and ${diagonal} diagonal ones: ${straight} + ${diagonal} × 1.4 = ${Number(n.plan.cost).toFixed(1)}, which is a shortest path.`,
        printed ? `The dissertation prints ${printed.cost} for this path. Its own cells cost 12.4, and so does the luciferin it begins with. The ${printed.table_cost} of its Table 4.10 is for another map of 10 × 10 cells, which has two gates.` : "",
        "Leave the tour to have your own scenario back, or stay on this map and drag start and goal.",
      ];
    },
    show: (n) => ({ ways: [wayOf(n.jumps)], marks: n.jumps.map((jump) => ({ at: jump.chosen, colour: CHOSEN, fill: 0.25, ring: true })), robot: START }),
    table: (n) => nodesTable(n),
  },
  {
    title: "Moving obstacles (section 4.3)",
    say: ({ avoided }) => [
      "The same drive, tick by tick, with an obstacle that waits at (4,5) and steps onto the path, to (5,4), when the robot is about to enter that cell. The robot knows where obstacles are now, and not where they will be.",
      `It chooses its next cell again from where it stands, waits if no acceptable neighbour is free, and arrives at tick ${avoided.ticks - 1} instead of 10. Dashed: the path without the obstacle.`,
    ],
    show: (n) => ({
      ways: [{ ...wayOf(n.jumps), dash: [3, 5] }, { cells: n.avoided.robot.subarray(0, 2 * n.avoided.ticks), colour: ACCEPTED }],
      marks: [{ at: [5, 4], colour: CHOSEN, fill: 0.45, ring: true }, { at: [4, 5], colour: CHOSEN, fill: 0.2 }], robot: START,
    }),
    table: (n) => avoidedTable(n),
  },
  {
    title: "The velocity at each node (section 4.5)",
    say: () => [
      "Three limits, and the least of them counts: what the robot has gained since the start (20 for a straight transfer, 28 for a diagonal one), what the obstacles around the node leave (80, less 6 for each in the nearest ring and 3 for each ahead in the next), and what the angle of the path allows (80 straight on, 60 at 135 degrees, 20 at a right angle).",
      "Walls and cells off the map count as obstacles. The tables that the dissertation prints for this, 4.12 to 4.17, are for other maps: here only our numbers stand.",
    ],
    show: (n, page) => ({
      ways: [wayOf(n.jumps)], bare: true,
      marks: texts(n.cost.map((_, k) => velocityAt(n, k)), (v) => v.toFixed(0), page.dark),
    }),
    table: (n) => velocityTable(n),
  },
];

/** The velocity at a cell of the path; others have none. @param {Numbers} n @param {number} k */
function velocityAt(n, k) {
  const at = n.plan.cells.findIndex((/** @type {Cell} */ cell) => index(cell) === k);
  return at < 0 ? NaN : n.plan.speed.v[at];
}

/** Numbers in their cells; on dark pages the brightest colours are dimmed, so that white can be read on them. @param {number[]} values @param {(v: number) => string} spell @param {boolean} dark */
function texts(values, spell, dark) {
  const { colour, share } = VEIL[dark ? "dark" : "light"];
  return framed(values.map((v, k) => ({ at: cellOf(k), colour, fill: Number.isNaN(v) ? 0 : share, text: Number.isNaN(v) ? "" : spell(v) })));
}

/** Start and goal as frames: their letters would hide what stands in the cells. @param {import("./steps.js").Mark[]} marks */
function framed(marks) {
  return [...marks, ...[START, GOAL].map((at) => ({ at, colour: CHOSEN, fill: 0, ring: true }))];
}

/** @param {number} k @param {number} p */
function arrow(k, p) {
  const [x, y] = cellOf(k);
  const [i, j] = cellOf(p);
  return ARROWS[3 * (j - y + 1) + (i - x + 1)] ?? "?";
}

/** @param {Numbers} n @param {number} k @param {Page} page */
function jumpShow(n, k, page) {
  const jump = n.jumps[k];
  const last = Math.max(...jump.accepted.map((one) => one.ring));
  return {
    marks: marksOf(jump, last, true, /** @type {Ground} */ (page.ground)),
    ways: [...(k ? [wayOf(n.jumps.slice(0, k))] : []), stretchOf(jump)], robot: jump.at,
  };
}

/** @param {number} k */
function iteration(k) {
  return {
    show: (/** @type {Numbers} */ n, /** @type {Page} */ page) => jumpShow(n, k, page),
    table: (/** @type {Numbers} */ n) => walkTable(n, k, n.jumps[k]),
  };
}
