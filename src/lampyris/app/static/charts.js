// Charts: speed with what binds it, and the distance to the nearest obstacle, over time or over the way.
//
// uPlot draws them when data or size change. What moves while it plays is one line a chart, moved by a transform;
// where it stands is computed from sizes that are kept, never read from the page.

import { capsOf, closeness, whyOf } from "./bounds.js";
import { causeColour } from "./colours.js";
import { secondsOf } from "./frames.js";
import { el } from "./make.js";

/** @typedef {"time" | "path"} Over */
/**
 * What is drawn: places along x, values, what binds each.
 * @typedef {{
 *   x: Float64Array, v: ArrayLike<number | null>, near: ArrayLike<number> | null, causes: ArrayLike<string | number>,
 *   word: (k: number) => string, why: (k: number) => string, units: string, along: string,
 *   caps: Array<{cause: string, v: Array<number | null>}>, run: boolean,
 * }} Shown
 */

/** Milliseconds between two drawings while a run streams in or an end is dragged. */
const SELDOM = 140;
const HIGH = 108;
/** Height of the strip of causes. */
const STRIP = 7;
/** Height of the name of the line that no distance may cross. */
const UNDER = 13;
const MAKE = /** @type {any} */ (globalThis);

class Charts {
  /** @param {Page} page @param {HTMLElement} element */
  constructor(page, element) {
    this.page = page;
    this.element = element;
    this.over = /** @type {Over} */ ("time");
    this.source = /** @type {"run" | "plan"} */ ("run");
    /** @type {Shown | null} */
    this.shown = null;
    /** Way driven until each tick, cells. */
    this._way = new Float64Array(0);
    this._walked = 0;
    this._drawn = 0;
    this._due = 0;
    this._widths = [0, 0];
    /** Where the lines of the shown moment stand, pixels. */
    this._at = [-1, -1];
    this._keys = ["", ""];
    this._legend = "";
    /** Length of x as of the last drawing. */
    this._most = 1;

    this.overs = this._switch("Charts over", [["time", "Time"], ["path", "Distance"]], (word) => {
      this.over = /** @type {Over} */ (word);
      this.draw();
    });
    this.sources = this._switch("Charts of", [["run", "Run"], ["plan", "Plan"]], (word) => {
      this.source = /** @type {"run" | "plan"} */ (word);
      this.draw();
    });
    this.legend = el("ul", { class: "ch-legend", "aria-label": "What binds the speed" });
    this.hosts = [
      el("div", { class: "ch-plot", role: "img", "aria-label": "Speed" }),
      el("div", { class: "ch-plot", role: "img", "aria-label": "Free distance to the nearest obstacle" }),
    ];
    /** What each chart is of; under the pointer: its value there. */
    this.titles = [el("figcaption", {}, "Speed"), el("figcaption", {}, "Free distance")];
    this.names = ["", ""];
    this.boxes = this.hosts.map((host, i) => el("figure", { class: "ch-box" }, this.titles[i], host));
    this.empty = el("p", { class: "hint ch-empty" }, "Speeds are drawn here once there is a plan.");
    /** @type {any[]} */
    this.plots = [null, null];
    /** @type {HTMLElement[]} */
    this.heads = [];
    element.classList.add("ch");
    element.append(el("div", { class: "ch-head" }, this.sources.box, this.overs.box, this.legend), el("div", { class: "ch-boxes" }, ...this.boxes), this.empty);
    this._sync = MAKE.uPlot.sync("lampyris");

    const sizes = new ResizeObserver((entries) => this._resized(entries));
    for (const host of this.hosts) sizes.observe(host);
    page.on("run", () => {
      this._walked = 0;
      this.source = "run";
      this.later();
    });
    for (const name of ["ticks", "end", "plan"]) page.on(name, () => this.later());
    page.on("theme", () => {
      this._keys = ["", ""];
      this._legend = "";
      this.draw();
    });
    page.on("tick", (tick) => this._move(tick));
    this.draw();
  }

  /** @param {string} label @param {Array<[string, string]>} choices @param {(word: string) => void} chosen */
  _switch(label, choices, chosen) {
    const box = el("div", { class: "seg small", role: "group", "aria-label": label });
    const buttons = choices.map(([word, text]) => {
      const button = el("button", { type: "button", "aria-pressed": "false", onclick: () => chosen(word) }, text);
      box.append(button);
      return /** @type {const} */ ([word, button]);
    });
    return {
      box,
      /** @param {string} word */
      set: (word) => buttons.forEach(([own, button]) => button.setAttribute("aria-pressed", String(own === word))),
    };
  }

  /** @param {ResizeObserverEntry[]} entries */
  _resized(entries) {
    let changed = false;
    for (const { target, contentRect } of entries) {
      const i = this.hosts.indexOf(/** @type {HTMLDivElement} */ (target));
      if (!contentRect.width || Math.abs(contentRect.width - this._widths[i]) < 1) continue;
      this._widths[i] = contentRect.width;
      changed = true;
    }
    if (!changed) return;
    if (this.shown && (!this.plots[0] || (this.shown.near && !this.plots[1]))) this.draw();
    this.plots.forEach((plot, i) => plot?.setSize({ width: this._wide(i), height: HIGH }));
    this._move(this.page.play.tick);
  }

  /** The second chart has a width of its own beside the first, and the same below it. @param {number} i */
  _wide(i) {
    return Math.max(120, Math.floor(this._widths[i]));
  }

  /** Draw soon, but not more often than one can see. */
  later() {
    if (this._due) return;
    const wait = Math.max(0, SELDOM - (performance.now() - this._drawn));
    this._due = setTimeout(() => {
      this._due = 0;
      this.draw();
    }, wait);
  }

  draw() {
    this._drawn = performance.now();
    const { page } = this;
    const run = page.run && page.run.ticks > 0 ? page.run : null;
    const speed = page.plan?.speed?.v?.length ? page.plan : null;
    const source = run && (this.source === "run" || !speed) ? "run" : "plan";
    this.shown = source === "run" && run ? this._ofRun(run) : speed ? this._ofPlan(speed) : null;
    this.sources.box.hidden = !(run && speed);
    this.sources.set(source);
    this.overs.set(this.over);
    this.empty.hidden = Boolean(this.shown);
    this.overs.box.hidden = this.boxes[0].hidden = !this.shown;
    this.boxes[1].hidden = !this.shown?.near;
    this.element.classList.toggle("two", Boolean(this.shown?.near));
    if (!this.shown || !this._widths[0]) return;
    this._most = this.shown.x[this.shown.x.length - 1] || 1;
    this._plot(0, this.shown);
    if (this.shown.near && this._widths[1]) this._plot(1, this.shown);
    this._tellLegend(this.shown);
    this._move(page.play.tick);
  }

  /** @param {Run} run @returns {Shown} */
  _ofRun(run) {
    const n = run.ticks;
    const cell = this.page.ground?.resolution ?? 1;
    if (this._way.length < n) {
      const longer = new Float64Array(Math.max(2 * n, 512));
      longer.set(this._way);
      this._way = longer;
    }
    for (let k = Math.max(1, this._walked); k < n; k++) {
      const dx = run.robot[2 * k] - run.robot[2 * k - 2];
      const dy = run.robot[2 * k + 1] - run.robot[2 * k - 1];
      this._way[k] = this._way[k - 1] + Math.sqrt(dx * dx + dy * dy) * cell;
    }
    this._walked = n;
    const x = this._way.slice(0, n);
    if (this.over === "time") for (let k = 0; k < n; k++) x[k] = k * (secondsOf(run) || 1);
    // A step needs an x that grows; a robot that waits does not.
    else for (let k = 1; k < n; k++) if (x[k] <= x[k - 1]) x[k] = x[k - 1] + 1e-9;
    const among = run.bodies.length > 0;
    const near = among ? Float64Array.from(run.near.subarray(0, n), (v) => (v < Infinity ? v : NaN)) : null;
    const causes = run.cause.subarray(0, n);
    const word = (/** @type {number} */ k) => run.causes[causes[k]] ?? "";
    return {
      x, v: run.speed.subarray(0, n), near, causes, word, why: (k) => whyOf(run, k, brief), units: run.units, caps: capsOf(run, n), run: true,
      along: this.over === "path" ? "m" : secondsOf(run) ? "s" : "ticks",
    };
  }

  /** @param {Plan} plan @returns {Shown} */
  _ofPlan(plan) {
    const speed = /** @type {NonNullable<Plan["speed"]>} */ (plan.speed);
    const metric = speed.units === "m/s";
    const x = Float64Array.from(this.over === "time" ? speed.t : speed.s);
    for (let k = 1; k < x.length; k++) if (x[k] <= x[k - 1]) x[k] = x[k - 1] + 1e-9;
    const time = metric ? "s" : "transfers";
    return {
      x, v: speed.v, near: null, causes: speed.cause, word: (k) => speed.cause[k], why: (k) => speed.why?.[k] ?? speed.cause[k],
      units: speed.units, along: this.over === "time" ? time : metric ? "m" : "cells", caps: speed.caps ?? [], run: false,
    };
  }

  /** @param {number} i @param {Shown} shown */
  _plot(i, shown) {
    const data = i ? [shown.x, shown.near] : [shown.x, shown.v, ...shown.caps.map((cap) => cap.v)];
    const key = i ? shown.along : [shown.along, shown.units, ...shown.caps.map((cap) => cap.cause)].join("|");
    const over = { s: "seconds", m: "metres" }[shown.along] ?? shown.along;
    const { map, run } = this.page;
    // In a comparison: whose run the clock goes by.
    const whose = shown.run && map.moment.others?.length ? ` (${run?.label})` : "";
    this.names[i] = this.titles[i].textContent = `${i ? "Free distance, m" : `Speed, ${shown.units}`}, over ${over}${whose}`;
    if (this.plots[i] && key === this._keys[i]) {
      this.plots[i].setData(data);
      return;
    }
    this._keys[i] = key;
    this.plots[i]?.destroy();
    this.plots[i] = new MAKE.uPlot(this._options(i, shown), data, this.hosts[i]);
    this.heads[i] = el("i", { class: "ch-head-line" });
    this._at[i] = -1;
    this.plots[i].over.append(this.heads[i]);
    this._scrubs(this.plots[i]);
  }

  /** @param {number} i @param {Shown} shown */
  _options(i, shown) {
    const { dark } = this.page;
    const ink = dark ? "#eceef2" : "#20242c";
    const faint = dark ? "#a3acba" : "#5b6472";
    const grid = { stroke: dark ? "#2c313a" : "#ebecea", width: 1 };
    const font = "11px system-ui, sans-serif";
    const axis = { stroke: faint, font, grid, ticks: { show: false } };
    const line = { stroke: i ? (dark ? "#63d3a7" : "#00694a") : ink, width: 1.5, points: { show: false } };
    const caps = i ? [] : shown.caps.map((cap) => ({
      stroke: causeColour(cap.cause, dark), width: 1, alpha: dark ? 0.8 : 0.6, dash: [4, 3], points: { show: false }, spanGaps: false,
    }));
    const under = i ? UNDER : STRIP + 3;
    return {
      width: this._wide(i), height: HIGH, padding: [4, 8, 0, 0], legend: { show: false },
      cursor: { y: false, points: { show: false }, drag: { x: false, y: false, setScale: false }, sync: { key: this._sync.key } },
      scales: {
        x: { time: false },
        // Below zero, where no speed and no distance is, lies the strip of causes, or the name of the line at zero.
        y: {
          range: (/** @type {any} */ u) => {
            // What the robot may drive at most is seen, too.
            const limit = i ? -1 : shown.caps.findIndex((cap) => cap.cause === "limit");
            const top = Math.max(1.25 * (most(u.data[1]) || 1), limit < 0 ? 0 : 1.1 * most(u.data[2 + limit] ?? []));
            return [(-top * under) / (HIGH - 24 - under), top];
          },
        },
      },
      axes: [
        { ...axis, size: 20, gap: 3, space: 56 },
        { ...axis, size: 34, gap: 4, space: 24 },
      ],
      series: [{}, line, ...caps],
      hooks: {
        draw: [(/** @type {any} */ u) => (i ? closeness(u, this.page.ground?.resolution ?? 1, this.page.dark, this.page.run?.step ? "0: contact" : "0: adjacent") : this._strip(u))],
        setCursor: [(/** @type {any} */ u) => this._read(u.cursor.idx)],
      },
    };
  }

  /** What binds the speed, as a strip of colours at the foot. @param {any} u */
  _strip(u) {
    const { shown } = this;
    if (!shown) return;
    const ratio = window.devicePixelRatio || 1;
    const pen = /** @type {CanvasRenderingContext2D} */ (u.ctx);
    const { left, top, width, height } = u.bbox;
    const high = STRIP * ratio;
    const n = shown.x.length;
    pen.save();
    for (let from = 0; from < n; ) {
      let to = from + 1;
      while (to < n && shown.causes[to] === shown.causes[from]) to++;
      const x0 = u.valToPos(shown.x[from], "x", true);
      const x1 = to < n ? u.valToPos(shown.x[to], "x", true) : left + width;
      pen.fillStyle = causeColour(shown.word(from), this.page.dark);
      pen.fillRect(Math.max(x0, left), top + height - high, Math.max(x1 - Math.max(x0, left), 0.5), high);
      from = to;
    }
    pen.fillStyle = this.page.dark ? "#727b89" : "#8b929c";
    pen.fillRect(left, top + height - high - 1, width, 1);
    pen.restore();
  }

  /** Colours with their words, those that occur. @param {Shown} shown */
  _tellLegend(shown) {
    /** How often each, and where first. @type {Map<string | number, [number, number]>} */
    const counts = new Map();
    for (let k = 0; k < shown.causes.length; k++) {
      const count = counts.get(shown.causes[k]);
      if (count) count[0]++;
      else counts.set(shown.causes[k], [1, k]);
    }
    // The frequent ones first: where there is little room, they are the ones that are seen.
    const words = [...counts.values()].sort((a, b) => b[0] - a[0]).map(([, k]) => shown.word(k));
    const key = [...words].sort().join("|");
    if (key === this._legend) return;
    this._legend = key;
    this.legend.title = words.join(", ");
    this.legend.replaceChildren(
      ...words.map((word) => {
        const chip = el("i", { class: "swatch" });
        chip.style.background = causeColour(word, this.page.dark);
        return el("li", {}, chip, word);
      }),
    );
    this.hosts[0].setAttribute("aria-label", `Speed in ${shown.units}, bound by ${words.join(", ")}`);
  }

  // ---- what moves --------------------

  /** @param {number} tick */
  _move(tick) {
    const { shown } = this;
    for (let i = 0; i < 2; i++) {
      const plot = this.plots[i];
      const head = this.heads[i];
      if (!plot || !head) continue;
      const there = Boolean(shown?.run);
      if (head.hidden === there) head.hidden = !there;
      if (!shown?.run) continue;
      const wide = plot.bbox.width / (window.devicePixelRatio || 1);
      const k = Math.min(Math.floor(tick), shown.x.length - 1);
      const next = Math.min(k + 1, shown.x.length - 1);
      const x = shown.x[k] + (tick - k) * (shown.x[next] - shown.x[k]);
      const px = Math.round(2 * Math.min(x / this._most, 1) * wide) / 2;
      if (px === this._at[i]) continue;
      this._at[i] = px;
      head.style.transform = `translateX(${px}px)`;
    }
  }

  /** What the chart says under the pointer. @param {number | null | undefined} k */
  _read(k) {
    const { shown } = this;
    const there = shown && k !== null && k !== undefined && k < shown.x.length;
    const at = !there ? "" : shown.along === "ticks" ? `tick ${k}` : `${brief(shown.x[k])} ${shown.along}`;
    const texts = there
      ? [`${at}: ${brief(Number(shown.v[k]))} ${shown.units.replace("velocity units", "vu")}, ${shown.why(k)}`, `${at}: ${brief(Number(shown.near?.[k] ?? NaN))} m free to the nearest`]
      : this.names;
    this.titles.forEach((title, i) => {
      if (title.textContent !== texts[i]) title.textContent = texts[i];
    });
  }

  /** A press or a drag on a chart goes to that moment. @param {any} plot */
  _scrubs(plot) {
    const over = /** @type {HTMLElement} */ (plot.over);
    const to = () => {
      const { shown } = this;
      const k = plot.cursor.idx;
      if (shown?.run && k !== null && k !== undefined) this.page.play.seek(k);
    };
    over.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !this.shown?.run) return;
      const play = /** @type {import("./play.js").Player} */ (this.page.play);
      play.hold(true);
      const end = () => {
        over.removeEventListener("pointermove", to);
        play.hold(false);
      };
      over.addEventListener("pointermove", to);
      addEventListener("pointerup", end, { once: true });
      addEventListener("pointercancel", end, { once: true });
    });
    over.addEventListener("click", to);
  }
}

/** The greatest that is finite. @param {ArrayLike<number | null>} values */
function most(values) {
  let found = 0;
  for (let k = 0; k < values.length; k++) {
    const v = values[k];
    if (v !== null && v > found && v < Infinity) found = v;
  }
  return found;
}

/** Three figures. @param {number} v */
export function brief(v) {
  if (!Number.isFinite(v)) return "\u2013";
  const size = Math.abs(v);
  if (size >= 1000) return Math.round(v).toLocaleString("en");
  // What is left of a sum that comes to nothing is nothing.
  return size < 1e-9 ? "0" : String(Number(v.toPrecision(3)));
}

/** @param {Page} page @param {HTMLElement} element */
export function mount(page, element) {
  new Charts(page, element);
}
