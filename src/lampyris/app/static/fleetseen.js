// What is shown beside the map of a fleet: its costs, how many have arrived, the chosen robot, and the key.

import { THEMES } from "./colours.js";
import { STATES, ramp, robotLook } from "./fleetdraw.js";
import { button, el, fill, formatted, tapped } from "./make.js";
import { byId } from "./page.js";

/** Milliseconds between two sayings of the shown moment while it plays. */
const SELDOM = 120;
const HIGH = 132;
const SIDE = 18;
const MAKE = /** @type {any} */ (globalThis);

/** A list of numbers. @param {Array<[string, string, string?]>} rows name, value, what it means */
function facts(rows) {
  return el("dl", { class: "facts" }, ...rows.flatMap(([name, value, about]) => [el("dt", about ? { title: about } : null, name), el("dd", null, value)]));
}

export class FleetSeen {
  /** @param {import("./fleet.js").Fleet} fleet */
  constructor(fleet) {
    this.fleet = fleet;
    this.now = el("dl", { class: "facts" });
    this.sums = el("div", { class: "stack" });
    this.robot = el("div", { class: "stack" });
    this.plot = el("div", { class: "fleet-plot", role: "img" });
    this.head = el("i", { class: "fleet-head" });
    this.title = el("h2", null, "Over time");
    this.key = el("ul", { class: "fleet-key" });
    this.cuts = el("ul", { class: "plain hint" });
    this.box = el("section", { id: "fleet-now", "aria-label": "Fleet" },
      this.now, this.sums, this.title, el("div", { class: "fleet-chart" }, this.plot, this.head), this.cuts, this.robot, el("h2", null, "Key"), this.key);
    byId("now").append(this.box);
    /** @type {any} */
    this._chart = null;
    this._said = 0;
    this._tick = -1;
    new ResizeObserver(() => this._size()).observe(this.plot);
    this.draw();
  }

  /** Everything: the plan is another one, or is looked at in another way. */
  draw() {
    const { fleet } = this;
    this._tick = -1;
    if (fleet.swarm.on) {
      fill(this.sums, ...fleet.swarm.summary());
      fill(this.robot);
      fill(this.cuts);
    } else this._fleet();
    this._chartOf();
    this._key();
    this.moment(true);
  }

  _fleet() {
    const { run, end, picture } = this.fleet;
    if (!run || !end) {
      fill(this.sums, el("p", { class: "hint" }, end ? end.sentence : "Nothing is planned yet."));
      fill(this.robot);
      fill(this.cuts);
      return;
    }
    const { costs, waits, hindered, arrived } = run.sums();
    const since = /** @type {number | undefined} */ (end.since);
    const whole = arrived === run.n;
    /** @type {Array<[string, string, string?]>} */
    const rows = [
      ["Makespan", whole ? `${formatted(run.last)} ticks` : "\u2013", "The tick of the last arrival"],
      ["Sum of costs", whole ? formatted(costs) : "\u2013", "Ticks until each robot is on its goal for good, summed"],
    ];
    if (since === undefined) {
      rows.push(["Lower bound", formatted(end.lower_bound), "No plan costs less: the shortest paths of all robots, summed, or what the planner proved beyond"]);
      if (end.gap !== null) rows.push(["Above the bound", `${formatted(100 * end.gap, 1)} %`]);
    } else if (end.found) {
      rows.push([`From tick ${since} on`, formatted(end.sum_of_costs), "The sum of costs of the last plan, counted from its first tick"], ["Its lower bound", formatted(end.lower_bound)]);
    }
    rows.push(
      ["Ticks waited", formatted(waits), "Ticks that robots stay in their cells before they are on their goals for good, summed"],
      ["\u2003behind another", formatted(hindered), "Of these: at the end of the tick another robot is in the cell that the robot enters next"],
    );
    if (end.alone) rows.push(["Conflicts avoided", formatted(end.alone.vertex + end.alone.swap), "If each robot drove a shortest path as if it were alone: pairs of robots in one cell or exchanging cells, summed over ticks"]);
    if (end.timing?.plan_s !== undefined) rows.push(["Planned in", `${formatted(end.timing.plan_s, 3)} s`]);
    const conflicts = end.alone ? el("p", { class: "hint" }, `Had each robot driven a shortest path as if it were alone, pairs of robots would have been in one cell ${formatted(end.alone.vertex)} times and exchanged cells ${formatted(end.alone.swap)} times (pairs, summed over ticks). The plan has none of either${since === undefined ? "" : "; counted for the first plan"}.`) : null;
    fill(this.sums, facts(rows), conflicts, ...end.notes.map((/** @type {string} */ note) => el("p", { class: "hint" }, note)));
    fill(this.cuts, ...run.cuts.map((cut) => el("li", null, button(`tick ${cut.tick}`, () => this.fleet.clock.seek(cut.tick), { class: "btn quiet" }), ` ${cut.what}`)));
    this._robot(picture?.chosen ?? null);
  }

  /** @param {number | null} robot */
  _robot(robot) {
    const { fleet } = this;
    const { run, end } = fleet;
    if (!run || !end) return;
    const number = el("input", { type: "number", id: "fleet-robot", min: 0, max: run.n - 1, step: 1, value: robot ?? "", placeholder: `0 to ${run.n - 1}` });
    number.addEventListener("change", () => fleet.pick(number.value === "" ? null : Number(number.value)));
    const again = document.activeElement?.id === "fleet-robot";
    /** @type {HTMLElement[]} */
    const parts = [el("h2", null, "One robot"), el("div", { class: "field" }, el("label", { for: "fleet-robot" }, "Robot"), number)];
    if (robot === null) parts.push(el("p", { class: "hint" }, tapped("Click one on the map, or give its number.")));
    else {
      const { steps, waits, hindered } = run.countsOf(robot);
      const on = run.arrival[robot];
      this.state = el("span");
      const cell = (/** @type {number} */ k) => `(${k % run.width}, ${Math.floor(k / run.width)})`;
      const rows = facts([
        ["Start", cell(run.cellAt(0, robot))], ["Goal", `(${run.goals[2 * robot]}, ${run.goals[2 * robot + 1]})${run.lost.has(robot) ? ", walled off" : ""}`],
        ["On its goal for good", on < 0 ? "not within this plan" : `tick ${formatted(on)}`], ["Steps", formatted(steps)], ["Ticks waited", formatted(waits)], ["\u2003behind another", formatted(hindered)],
      ]);
      rows.prepend(el("dt", null, "Now"), el("dd", null, this.state));
      parts.push(rows);
    }
    fill(this.robot, ...parts);
    if (again) number.focus();
  }

  /** The shown moment. @param {boolean} [all] */
  moment(all = false) {
    const { clock, run, picture, swarm } = this.fleet;
    const tick = Math.floor(clock.tick + 1e-6);
    const now = performance.now();
    if (this._chart && clock.last) this.head.style.transform = `translateX(${Math.round(2 * this._chart.valToPos(clock.tick, "x")) / 2 + this._left}px)`;
    if (!all && (tick === this._tick || (clock.playing && now - this._said < SELDOM))) return;
    this._tick = tick;
    this._said = now;
    if (swarm.on) {
      fill(this.now, ...swarm.at(tick).flatMap(([name, value]) => [el("dt", null, name), el("dd", null, value)]));
      return;
    }
    if (!run) {
      fill(this.now);
      return;
    }
    const t = Math.min(tick, run.last);
    const rows = [["Tick", formatted(t)], ["On their goals", `${formatted(run.arrived[t])} of ${formatted(run.n)}`], ["Wait", formatted(run.waiting[t])], ["\u2003behind another", formatted(run.hindered[t])]];
    if (run.lost.size) rows.push(["Goals walled off", formatted(run.lost.size)]);
    fill(this.now, ...rows.flatMap(([name, value]) => [el("dt", null, name), el("dd", null, value)]));
    const robot = picture?.chosen ?? null;
    if (robot === null || !this.state) return;
    const k = run.cellAt(t, robot);
    const other = t < run.last ? run.behind[t * run.n + robot] : -2;
    this.state.textContent = `${STATES[run.stateAt(t, robot)].name} at (${k % run.width}, ${Math.floor(k / run.width)})${other >= 0 ? `, behind robot ${other}` : ""}`;
  }

  // ---- the chart --------------------

  _chartOf() {
    const { fleet } = this;
    const { run, swarm, page } = fleet;
    this._chart?.destroy();
    this._chart = null;
    /** @type {Array<{label: string, values: ArrayLike<number>, colour: string, dash?: number[]}>} */
    let lines = [];
    if (swarm.on) lines = swarm.lines();
    else if (run) {
      const tone = (/** @type {number} */ state) => (page.dark ? STATES[state].dark : STATES[state].light);
      lines = [{ label: "on their goals", values: run.arrived, colour: tone(2) }, { label: "wait", values: run.waiting, colour: tone(1), dash: [4, 3] }];
    }
    const there = lines.length > 0 && lines[0].values.length > 1;
    this.title.hidden = this.head.hidden = this.plot.hidden = !there;
    if (!there) return;
    this.title.textContent = swarm.on ? "Robots at each source over iterations" : "Robots over ticks";
    const theme = THEMES[page.dark ? "dark" : "light"];
    const axis = { stroke: theme.faint, grid: { stroke: theme.line, width: 1 }, ticks: { stroke: theme.line, width: 1 }, font: "11px system-ui, sans-serif" };
    const x = Float64Array.from(lines[0].values, (_, k) => k);
    this._chart = new MAKE.uPlot({
      width: Math.max(80, this.plot.clientWidth), height: HIGH, legend: { show: false }, cursor: { show: false }, padding: [8, 10, 0, 0],
      scales: { x: { time: false }, y: { range: (/** @type {any} */ _, /** @type {number} */ __, /** @type {number} */ most) => [0, Math.max(1, most)] } },
      axes: [{ ...axis, size: 26 }, { ...axis, size: 46 }],
      series: [{}, ...lines.map(({ label, colour, dash }) => ({ label, stroke: colour, width: 2, dash, points: { show: false } }))],
      hooks: { draw: [(/** @type {any} */ chart) => this._marks(chart)] },
    }, [x, ...lines.map(({ values }) => Array.from(values))], this.plot);
    this.plot.setAttribute("aria-label", `${this.title.textContent}: ${lines.map(({ label, values }) => `${label}, ${formatted(values[values.length - 1])} at the end`).join("; ")}`);
    this._lines = lines;
  }

  _left = 0;

  /** Where walls were painted. @param {any} chart */
  _marks(chart) {
    const { run, swarm, page } = this.fleet;
    this._left = chart.bbox.left / page.map.ratio;
    if (!run || swarm.on) return;
    const { ctx, bbox } = chart;
    ctx.save();
    ctx.strokeStyle = THEMES[page.dark ? "dark" : "light"].ink;
    ctx.setLineDash([2, 3]);
    ctx.beginPath();
    for (const { tick } of run.cuts) {
      const x = Math.round(chart.valToPos(tick, "x", true));
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
    }
    ctx.stroke();
    ctx.restore();
  }

  _size() {
    if (this._chart && this.plot.clientWidth > 0 && Math.abs(this._chart.width - this.plot.clientWidth) > 1) this._chart.setSize({ width: this.plot.clientWidth, height: HIGH });
  }

  _key() {
    const { swarm, page, picture } = this.fleet;
    const ratio = page.map.ratio;
    const mark = (/** @type {string} */ name, /** @type {(pen: CanvasRenderingContext2D) => void} */ draw) => {
      const canvas = el("canvas", { width: SIDE * ratio, height: SIDE * ratio, "aria-hidden": "true" });
      const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
      pen.scale(ratio, ratio);
      draw(pen);
      return el("li", null, canvas, name);
    };
    const line = (/** @type {string} */ colour, /** @type {number[]} */ dash = []) => (/** @type {CanvasRenderingContext2D} */ pen) => {
      pen.strokeStyle = colour;
      pen.lineWidth = 2;
      pen.setLineDash(dash);
      pen.beginPath();
      pen.moveTo(1, SIDE / 2);
      pen.lineTo(SIDE - 1, SIDE / 2);
      pen.stroke();
    };
    const charted = (this._chart ? this._lines ?? [] : []).map(({ label, colour, dash }) => mark(`chart: ${label}`, line(colour, dash)));
    if (swarm.on) {
      fill(this.key, ...swarm.key().map(([name, draw]) => mark(name, draw)), ...charted);
      return;
    }
    const all = STATES.map(({ name }, state) => mark(`robot: ${name}${state ? "" : "; a square where it is small"}`, (pen) => robotLook(pen, state, SIDE, page.dark)));
    all.push(mark("waits for the robot at the other end", line(page.dark ? STATES[1].dark : STATES[1].light)));
    const layer = picture?.layer;
    if (layer) all.push(mark(`ground: ${layer.name === "waits" ? "ticks waited" : "conflicts avoided"} in a cell, ${formatted(layer.low)} to ${formatted(layer.high)}`, (pen) => ramp(pen, page.dark)));
    fill(this.key, ...all, ...charted);
  }

  /** @type {Array<{label: string, values: ArrayLike<number>, colour: string, dash?: number[]}> | undefined} */
  _lines = undefined;
  /** @type {HTMLElement | undefined} */
  state = undefined;
}
