// Status: what is happening, in a sentence and in numbers.
//
// What is seen changes a few times a second; what is read aloud (aria-live) only when something happens.

import { plansTimes } from "./shape.js";
import { EVENTS, causeColour } from "./colours.js";
import { brief } from "./charts.js";
import { timeOf } from "./frames.js";
import { TOUCH, button, el, tapped } from "./make.js";
import { nodesPart } from "./nodes.js";
import { mark } from "./timeline.js";

/** Fingers, and hardly a keyboard. */
/** Milliseconds between two changes of what is seen. */
const SELDOM = 100;
/** Milliseconds between two sentences that are read aloud while it plays. */
const ALOUD = 2500;
/** Lines of the list of events. */
const LINES = 60;

class Status {
  /** @param {Page} page @param {HTMLElement} element */
  constructor(page, element) {
    this.page = page;
    this.sentence = el("p", { class: "st-now", "aria-live": "off" });
    this.next = el("p", { class: "st-next hint" });
    /** What the planner did otherwise than asked. */
    this.otherwise = el("p", { class: "st-otherwise hint", hidden: true });
    this.aloud = el("p", { class: "unseen", "aria-live": "polite", role: "status" });
    this.speed = el("b", {});
    this.swatch = el("i", { class: "swatch" });
    this.cause = el("span", {});
    this.fast = el("p", { class: "st-speed", hidden: true }, this.speed, el("span", { class: "st-cause" }, this.swatch, this.cause));
    this.facts = el("dl", { class: "facts" });
    this.optimal = button("Show the optimal path (A*)", () => page.tell("optimal"), { hidden: true, "aria-pressed": "false", class: "btn st-optimal" });
    page.on("gates", () => this.optimal.setAttribute("aria-pressed", String(Boolean(page.map.beside))));
    /** @type {Map<string, {dt: HTMLElement, dd: HTMLElement}>} */
    this._rows = new Map();
    /** What the controllers of a drive achieved. */
    this.results = el("div", { class: "wide st-results", hidden: true });
    this._table = "";
    this.list = el("ol", { class: "st-events" });
    this.story = el("details", { class: "more st-story", hidden: true, open: true }, el("summary", {}, "Events"), this.list);
    element.classList.add("st");
    element.append(el("div", { class: "st-said" }, this.sentence, this.otherwise, this.next), this.aloud, this.fast, this.facts, this.optimal, nodesPart(page), this.results, this.story);

    this._due = 0;
    this._seen = 0;
    this._spoken = 0;
    this._lastSpoken = "";
    /** Events of the run up to the shown tick: how many, and how many of each word. */
    this._passed = 0;
    /** @type {Record<string, number>} */
    this._counts = {};
    /** @type {Run | null} */
    this._of = null;
    this._listed = -1;
    this._busy = false;

    page.on("tick", () => this.later());
    for (const name of ["plan", "run", "ticks", "end", "play", "ground", "theme", "progress"]) page.on(name, () => this.later(true));
    page.on("busy", (busy) => {
      this._busy = Boolean(busy);
      this.later(true);
    });
    this.tell();
  }

  /** @param {boolean} [important] */
  later(important = false) {
    if (this._due) return;
    const wait = important ? 16 : Math.max(0, SELDOM - (performance.now() - this._seen));
    this._due = setTimeout(() => {
      this._due = 0;
      this.tell();
    }, wait);
  }

  tell() {
    this._seen = performance.now();
    const run = this.page.run && this.page.run.ticks > 0 ? this.page.run : null;
    if (run) this._ofRun(run);
    else this._ofPlan();
    this._events(run);
    this._results(run);
  }

  // ---- a plan --------------------

  _ofPlan() {
    const { plan, store } = this.page;
    const { start, goal } = store.scenario;
    this.fast.hidden = true;
    this._of = null;
    this._otherwise(plan?.weakened);
    if (!plan) {
      const missing = !start && !goal ? "a start and a goal" : !start ? "a start" : !goal ? "a goal" : "";
      this._now(missing ? tapped(`Click ${missing} on the map.`) : this._busy ? "Planning\u2026" : "No plan yet.");
      set(this.next, !this.page.ground && !this._busy ? "Choose a map first: in the tab Map, or drop a file on the page." : "");
      this._show([]);
      return;
    }
    if (this.page.planning) {
      this._now("Planning\u2026");
      set(this.next, "The path on the map is the one from before the change.");
      return;
    }
    this._now(plan.sentence, plan.cost === null);
    set(this.next, this.page.driving ? this.page.driving : plan.cost === null ? REMEDY[/** @type {any} */ (plan).status] ?? "" : plansTimes(this.page) ? "The plan has times, by the tracks of recorded obstacles. Press Play to see the robot follow them. Drag S or G, and the path follows." : plan.pose_cells ? "Press Play to see the robot drive it. Drag S or G, or a round handle to turn it, and the path follows." : "Press Play to see the robot drive it. Drag S or G, and the path follows.");
    this._show(this._planFacts());
    this.optimal.hidden = !plan.gap || plan.gap <= 0;
  }

  /** @returns {Array<[string, string]>} */
  _planFacts() {
    const { plan } = this.page;
    if (!plan) return [];
    /** @type {Array<[string, string]>} */
    const rows = [];
    const add = (/** @type {string} */ name, /** @type {string | null} */ value) => void (value && rows.push([name, value]));
    if (plan.pose_cells) {
      add("Length", `${brief(plan.length_m ?? 0)} m`);
      add("Reversals", whole(plan.reversals ?? 0));
      add("Cost, at most", plan.bound ? `${brief(plan.bound)} x the least of its lattice` : null);
    } else add("Cost", plan.cost === null ? null : `${brief(plan.cost)} cells`);
    add("Optimal", plan.optimal_cost === null ? null : `${brief(plan.optimal_cost)} cells`);
    add("Gap", plan.gap === null ? null : percent(plan.gap));
    add("Sum of cost to go", plan.sum_cost_to_go === null ? null : brief(plan.sum_cost_to_go));
    add("Iterations", plan.iterations ? whole(plan.iterations) : null);
    add("Expansions", whole(plan.expansions));
    const { gates } = plan;
    // Planners that know no gates have none to tell of.
    if (gates?.count) add("Gates", `${whole(gates.on_path?.length ?? 0)} of ${whole(gates.count)} on the path`);
    const speed = /** @type {any} */ (plan.speed);
    if (speed?.v?.length) {
      const metric = speed.units === "m/s";
      add("Mean speed moving", speed.mean === undefined ? null : `${brief(speed.mean)} ${speed.units}`);
      add("Time", `${brief(speed.t[speed.t.length - 1])} ${metric ? "s" : "transfers"}`);
    }
    const seconds = plan.seconds ?? /** @type {any} */ (plan).timing?.total;
    add("Planned in", Number.isFinite(seconds) ? `${brief(1000 * seconds)} ms` : null);
    return rows;
  }

  // ---- a run --------------------

  /** @param {Run} run */
  _ofRun(run) {
    const { page } = this;
    const tick = Math.min(Math.floor(page.play.tick + 1e-6), run.ticks - 1);
    this.optimal.hidden = true;
    this._count(run, tick);
    const event = this._passed ? run.events[this._passed - 1] : null;
    const cause = run.causes[run.cause[tick]] ?? "";
    const over = run.done && tick === run.ticks - 1;
    this.fast.hidden = false;
    set(this.speed, `${brief(run.speed[tick])} ${run.units}`);
    set(this.cause, cause);
    this.swatch.style.background = causeColour(cause, page.dark);

    const end = run.end ?? {};
    this._otherwise(end.notes);
    const bad = over && end.outcome !== undefined && end.outcome !== "arrived";
    if (over) this._now(end.sentence ?? end.outcome ?? "The run broke off here.", bad);
    else if (event?.sentence && (run.step ? tick - event.tick < 1 / run.step && !(event.word === "wait" && run.speed[tick] > 1e-9) : event.tick === tick)) this._now(event.sentence, event.word === "hit");
    else this._now(page.driver?.turned(run, tick) || going(run, tick, cause));
    const drive = run.step !== undefined;
    set(this.next, drive && page.driving ? page.driving : over ? (bad ? REMEDY[end.outcome ?? ""] ?? "Drag the line under the map to see how it came to this." : drive ? "Drag the line under the map to look back; compare controllers in Planner, Drive." : "Drag the line under the map to look back; paint a wall (B) to see it plan anew.")
      : TOUCH.matches ? `${drive ? "" : "Paint a wall, and it replans. "}Drag the line under the map to another moment.`
      : drive ? "Space pauses, the keys , and . step by a twentieth of a second."
      : "Paint a wall (B), and it replans. Space pauses, the keys , and . step by a tick.");

    /** @type {Array<[string, string]>} */
    const rows = [];
    const more = run.done ? "" : "+";
    if (drive || run.tick_s) rows.push(["Time", `${timeOf(run, tick)} of ${timeOf(run, run.ticks - 1)}${more}`]);
    if (!drive) rows.push(["Tick", `${whole(tick)} of ${whole(run.ticks - 1)}${more}`]);
    const near = run.near[tick];
    if (run.bodies.length) {
      const there = drive ? run.places[tick].filter((x, k) => k % 2 === 0 && x > -1).length : run.places[tick].length / 2;
      rows.push(["Obstacles", whole(there)]);
      rows.push(["Nearest", near < Infinity ? `${brief(near)} m` : "\u2013"]);
    }
    rows.push(["Replans so far", whole(this._counts.replan ?? 0)]);
    rows.push(["Waits so far", whole(this._counts.wait ?? 0)]);
    const m = end.metrics ?? {};
    if (over) {
      rows.push(["Outcome", String(end.outcome ?? "").replaceAll("_", " ")]);
      if (drive) rows.push(...(page.driver?.factsOf(end) ?? []));
      if (Number.isFinite(m.cost)) rows.push(["Cost driven", `${brief(m.cost)} cells`]);
      if (Number.isFinite(m.gap)) rows.push(["Gap", percent(m.gap)]);
      if (Number.isFinite(m.iterations)) rows.push(["Iterations", whole(m.iterations)]);
      if (Number.isFinite(m.expansions)) rows.push(["Expansions", whole(m.expansions)]);
      if (Number.isFinite(m.speed_mean)) rows.push(["Mean speed moving", `${brief(m.speed_mean)} ${run.units}`]);
      if (Number.isFinite(m.near_m)) rows.push(["Nearest of all", `${brief(m.near_m)} m`]);
      for (const [name, value] of [["Collisions", m.collisions], ["Hits", m.hits], ["Near misses", m.near_misses]]) if (Number.isFinite(value)) rows.push([name, whole(value)]);
      // By it somebody can see that `lampyris run` made the same: the sha256 of what it prints.
      if (end.digest) rows.push(["Digest", String(end.digest).slice(0, 16)]);
    } else {
      for (const row of this._planFacts()) {
        if (["Cost", "Gap", "Iterations", "Expansions", "Gates"].includes(row[0])) rows.push([`${row[0]} (plan)`, row[1]]);
      }
    }
    this._show(rows);
  }

  /** Events up to a tick, counted on or back from where the count was. @param {Run} run @param {number} tick */
  _count(run, tick) {
    const { events } = run;
    // A run that is cut has fewer events than were counted.
    if (run !== this._of || this._passed > events.length) {
      this._of = run;
      this._passed = 0;
      this._counts = {};
      this._listed = -1;
    }
    while (this._passed < events.length && events[this._passed].tick <= tick) {
      const { word } = events[this._passed++];
      this._counts[word] = (this._counts[word] ?? 0) + 1;
    }
    while (this._passed > 0 && events[this._passed - 1].tick > tick) this._counts[events[--this._passed].word]--;
  }

  /** The last events before now, each a way to its moment. @param {Run | null} run */
  _events(run) {
    if (!run) this.story.hidden = true;
    if (!run || this._listed === this._passed) return;
    this._listed = this._passed;
    /** @type {HTMLElement[]} */
    const lines = [];
    for (let k = this._passed - 1; k >= 0 && lines.length < LINES; k--) {
      const event = run.events[k];
      const look = EVENTS[event.word];
      if (!look?.tell) continue;
      const go = () => {
        /** @type {import("./play.js").Player} */ (this.page.play).pause();
        this.page.play.seek(event.tick);
      };
      lines.push(
        el("li", {}, el("button", { type: "button", onclick: go, title: `Go to ${run.step || run.tick_s ? "" : "tick "}${timeOf(run, event.tick)}` },
          glyph(look.shape, this.page.dark ? look.dark : look.light), el("span", { class: "st-tick" }, timeOf(run, event.tick)),
          el("span", {}, event.sentence || look.label))),
      );
    }
    this.story.hidden = !lines.length;
    this.list.replaceChildren(...lines);
  }

  // ---- what is seen and said --------------------

  /** Measures of a drive, and of those of other controllers beside it. @param {Run | null} run */
  _results(run) {
    const some = run?.step && run.done ? [run, ...run.rivals] : [];
    const key = some.map((one) => `${one.job} ${one.label} ${one.end?.outcome} ${one.end?.digest}`).join();
    if (key === this._table) return;
    this._table = key;
    const made = this.page.driver?.resultsOf(some);
    this.results.hidden = !made;
    this.results.replaceChildren(...(made ? [made] : []));
  }

  /** A remark on what was not done as asked. @param {string[]} [notes] */
  _otherwise(notes = []) {
    this.otherwise.hidden = !notes.length;
    set(this.otherwise, notes.length ? `Not as asked: ${notes.join("; ")}.` : "");
  }

  /** @param {string} sentence @param {boolean} [bad] */
  _now(sentence, bad = false) {
    set(this.sentence, sentence);
    this.sentence.classList.toggle("bad", bad);
    const { play, run } = this.page;
    const time = performance.now();
    // While it plays, a reader hears of it now and then; when it stands, at once.
    const wait = play.playing && !(run?.done && play.tick >= run.ticks - 1) ? ALOUD : 0;
    if (sentence === this._lastSpoken || time - this._spoken < wait) return;
    this._spoken = time;
    this._lastSpoken = sentence;
    set(this.aloud, sentence);
  }

  /** Rows of numbers; only what changed is touched. @param {Array<[string, string]>} rows */
  _show(rows) {
    const names = new Set(rows.map(([name]) => name));
    for (const [name, row] of this._rows) {
      if (names.has(name)) continue;
      row.dt.remove();
      row.dd.remove();
      this._rows.delete(name);
    }
    let moved = false;
    for (const [name, value] of rows) {
      let row = this._rows.get(name);
      if (!row) {
        row = { dt: el("dt", { title: ABOUT[name.replace(" (plan)", "")] }, name), dd: el("dd", {}) };
        this._rows.set(name, row);
        moved = true;
      }
      // Whoever follows a new one stands after it again.
      if (moved) this.facts.append(row.dt, row.dd);
      set(row.dd, value);
    }
  }
}

/** What a number is, for who rests on its name. @type {Record<string, string>} */
const ABOUT = {
  Cost: "Length of the path, by the costs of its steps", Optimal: "Cost of a shortest path on this map", Gap: "How much more it costs than a shortest path",
  "Sum of cost to go": "The cost to the goal, summed over the path's cells, as the dissertation's tables have it",
  Iterations: "Times the planner chose a next cell", Expansions: "Cells that the planner looked at",
  Gates: "Openings one cell wide", Time: "How long the robot takes for the path", "Planned in": "Time of computing",
  "Replans so far": "Times the robot made another plan", "Waits so far": "Times the robot stood and waited",
  "Mean speed moving": "Over the cells at which it moves, each counted once: starting, stopping and waiting take time besides",
  Took: "Time from start to end, beside that of the fastest drive of the first path without obstacles",
  "Limited by": "What limited the speed, by its share of the time",
  Nearest: "Free distance from the robot's rim to the nearest obstacle's, each at least as large as its cell; 0: in cells side by side",
};

/** What to do about a plan that is none or a run that did not arrive, by status or outcome. @type {Record<string, string>} */
const REMEDY = {
  "no-path": "Erase a wall (E), or drag S or G to the other's side.",
  "start-occupied": "Drag S to a free cell, erase the wall, or make the robot smaller (Planner, Robot, radius).",
  "goal-occupied": "Drag G to a free cell, erase the wall, or make the robot smaller (Planner, Robot, radius).",
  timeout: "Allow more ticks (Planner, Seed and end).",
  blocked: "Give it more patience (Planner, Seed and end), or take obstacles away (Traffic).",
  "hemmed-in": "Take some obstacles away (Traffic), or let the planner wait.",
  "iteration-limit": "Give the planner more iterations, or take another planner (Planner).",
  error: "Change what is named here, or take the last change back (Undo, Ctrl+Z).",
  limit: "Give the planner a larger budget, or take another planner (Planner).",
};

/** What the robot does when nothing happens. @param {Run} run @param {number} tick @param {string} cause */
function going(run, tick, cause) {
  const { robot } = run;
  if (tick === 0) return "The robot stands at the start.";
  const still = robot[2 * tick] === robot[2 * tick - 2] && robot[2 * tick + 1] === robot[2 * tick - 1];
  if (still) return cause === "wait" || cause === "waiting" ? "The robot waits." : `The robot stands: ${cause}.`;
  return PHRASES[cause] ?? (cause ? `The robot drives; what bounds its speed: ${cause}.` : "The robot drives.");
}

/** What causes mean for who does not know the words. @type {Record<string, string>} */
const PHRASES = {
  start: "The robot sets off.", limit: "The robot drives at its top speed.", acceleration: "The robot speeds up.",
  braking: "The robot brakes for what comes.", clearance: "The robot is slowed by walls close by.",
  curvature: "The robot is slowed by a bend.", turn: "The robot is slowed by a turn.", angle: "The robot is slowed by a turn.",
  "moving obstacle": "The robot is slowed by a moving obstacle.", obstacle: "The robot is slowed by a moving obstacle.",
  zone: "The robot is in a zone with a limit of its own.", "blind area": "The robot is slowed by what it cannot see.",
  "ring 1": "The robot is slowed by walls next to it.", "ring 2": "The robot is slowed by walls two cells away.",
  approach: "The robot slows down for the goal.", goal: "The robot is at the goal.",
};

/** A small picture of an event's mark. @param {string} shape @param {string} colour */
function glyph(shape, colour) {
  const canvas = el("canvas", { width: 28, height: 28, class: "st-glyph", "aria-hidden": "true" });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.scale(2, 2);
  pen.fillStyle = pen.strokeStyle = colour;
  mark(pen, shape, 7, 7);
  return canvas;
}

/** @param {HTMLElement} element @param {string} text */
function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** @param {number} v */
function whole(v) {
  return Number(v).toLocaleString("en");
}

/** @param {number} v */
function percent(v) {
  if (v === 0) return "0 % (optimal)";
  return `${(100 * v).toPrecision(3)} %`;
}

/** @param {Page} page @param {HTMLElement} element */
export function mount(page, element) {
  new Status(page, element);
}
