// Timeline: play bar and slider with a mark for every event.
//
// Widths are read when they change, never in a frame; a frame moves the thumb by a transform. Marks are drawn on a
// canvas of their own when there are more of them.

import { EVENTS } from "./colours.js";
import { el, icon } from "./make.js";
import { gateOutline } from "./marks.js";
import { timeOf } from "./frames.js";
import { RATES } from "./play.js";

/** @typedef {import("./play.js").Player} Player */

const ICONS = {
  play: "M6 4l10 6-10 6z", pause: "M7 4v12M13 4v12", again: "M5 10a5.5 5.5 0 1 0 1.8-4.1M6.5 2.5v3.6h3.6",
  stop: "M6 6h8v8H6z", back: "M14 5l-7 5 7 5zM5 5v10", on: "M6 5l7 5-7 5zM15 5v10",
};
/** Milliseconds between two sayings of where it is while it plays. */
const SAID = 120;
/** How far from a mark, in pixels, the pointer still means it. */
const NEAR = 6;
/** Pixels on both sides of the rail that the marks of the first and last tick need. */
const BESIDE = 8;

class Timeline {
  /** @param {Page} page @param {HTMLElement} element */
  constructor(page, element) {
    this.page = page;
    this.width = 1;
    this._said = 0;
    this._shown = -1;
    this._at = -1;
    this._wanted = false;
    this._mode = "";

    this.main = el("button", { type: "button", class: "btn primary main", "aria-keyshortcuts": "Space", onclick: () => page.play.toggle() });
    const step = (/** @type {number} */ n) =>
      el("button", { type: "button", class: "btn icon", "aria-label": n < 0 ? "One tick back" : "One tick on", title: n < 0 ? "One tick back (,)" : "One tick on (.)", onclick: () => page.play.step(n) }, icon(n < 0 ? ICONS.back : ICONS.on));
    this.marks = el("canvas", { "aria-hidden": "true" });
    this.done = el("i", { class: "done" });
    this.thumb = el("i", { class: "thumb" });
    this.tip = el("span", { class: "tl-tip", hidden: true });
    this.track = el(
      "div",
      { class: "tl-track", role: "slider", tabindex: 0, "aria-label": "Moment", "aria-valuemin": 0, "aria-valuemax": 0, "aria-valuenow": 0, "aria-orientation": "horizontal", "aria-disabled": "true" },
      el("i", { class: "rail" }), this.done, this.marks, this.thumb, this.tip,
    );
    this.where = el("output", { class: "tl-where", "aria-live": "off" });
    this.rate = el("select", { "aria-label": "Speed of play", title: "Speed of play" });
    for (const rate of RATES) this.rate.append(el("option", { value: rate }, `${rate}\u00d7`));
    this.rate.value = "1";
    this.rate.addEventListener("change", () => page.play.rate(Number(this.rate.value)));
    element.classList.add("tl");
    element.append(el("div", { class: "tl-buttons" }, step(-1), this.main, step(1)), this.track, this.where, this.rate);

    new ResizeObserver((entries) => this._resized(entries[0].contentRect.width)).observe(this.track);
    this._hear();
    this._button();
    this._say(true);
  }

  get play() {
    return /** @type {Player} */ (this.page.play);
  }

  /** The last tick there is. */
  get last() {
    return Math.max(0, (this.page.run?.ticks ?? 0) - 1);
  }

  _hear() {
    const { page, track } = this;
    page.on("tick", () => this._move());
    page.on("play", () => {
      this._button();
      this._say(true);
    });
    page.on("rate", (rate) => (this.rate.value = String(rate)));
    for (const name of ["run", "ticks", "end", "progress"]) page.on(name, () => this._changed());
    page.on("theme", () => this._want());
    track.addEventListener("keydown", (event) => this._key(event));
    track.addEventListener("pointerdown", (event) => this._grab(event));
    let left = 0;
    track.addEventListener("pointerenter", () => (left = track.getBoundingClientRect().left));
    track.addEventListener("pointermove", (event) => this._point(event.clientX - left));
    track.addEventListener("pointerleave", () => (this.tip.hidden = true));
  }

  /** @param {number} width */
  _resized(width) {
    this.width = Math.max(1, width);
    this._at = -1;
    this._want();
    this._move();
  }

  _changed() {
    const { run } = this.page;
    this.track.setAttribute("aria-valuemax", String(this.last));
    this.track.setAttribute("aria-disabled", run ? "false" : "true");
    this._want();
    this._move();
    this._button();
    this._say(true);
  }

  /** Pixel of a tick. @param {number} tick */
  _x(tick) {
    return this.last ? (Math.min(tick, this.last) / this.last) * this.width : 0;
  }

  _move() {
    // Half pixels are as fine as one sees; each change costs the browser a drawing of this bar.
    const x = Math.round(2 * this._x(this.page.play.tick)) / 2;
    if (x !== this._at) {
      this._at = x;
      this.thumb.style.transform = `translateX(${x}px)`;
      this.done.style.transform = `scaleX(${x / this.width})`;
    }
    this._say(false);
  }

  /** Where it is, in words; seldom enough to be read. @param {boolean} now */
  _say(now) {
    const { play, run } = this.page;
    const tick = Math.floor(play.tick + 1e-6);
    const time = performance.now();
    if (!now && (tick === this._shown || (play.playing && time - this._said < SAID && tick < this.last))) return;
    this._shown = tick;
    this._said = time;
    if (!run) {
      this.where.textContent = "not run yet";
      this.track.setAttribute("aria-valuenow", "0");
      this.track.setAttribute("aria-valuetext", "not run yet");
      return;
    }
    const more = run.done ? "" : "+";
    const [at, all] = [timeOf(run, tick), timeOf(run, this.last)];
    this.where.textContent = `${at} / ${all}${more}`;
    this.track.setAttribute("aria-valuenow", String(Math.min(tick, this.last)));
    this.where.title = run.step ? "" : `Tick ${tick} of ${this.last}${run.tick_s ? `; a tick is ${Number(run.tick_s.toPrecision(3))} s, a cell at the robot's top speed` : ""}`;
    this.track.setAttribute("aria-valuetext", `${run.step || run.tick_s ? "" : "tick "}${at} of ${all}${run.tick_s ? `, tick ${tick}` : ""}${run.done ? "" : ", more to come"}`);
  }

  _button() {
    const { play, run } = this.page;
    const over = Boolean(run?.done) && play.tick >= this.last && this.last > 0;
    const mode = this.page.driving && !run ? "stop" : play.playing ? "pause" : over ? "again" : "play";
    if (mode === this._mode) return;
    this._mode = mode;
    const label = { pause: "Pause", again: "Play again", play: "Play", stop: "Stop" }[mode];
    this.main.setAttribute("aria-label", label);
    this.main.title = `${label} (space)`;
    this.main.replaceChildren(icon(ICONS[/** @type {keyof typeof ICONS} */ (mode)]), mode === "again" ? "Play" : label);
    this.main.classList.toggle("filled", mode === "play");
  }

  // ---- the hand --------------------

  /** @param {KeyboardEvent} event */
  _key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { play } = this;
    const leap = Math.max(1, Math.round(this.last / 20));
    const steps = /** @type {Record<string, number>} */ ({
      ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -leap, PageUp: leap,
    });
    if (event.key in steps) play.step(steps[event.key] * (event.shiftKey ? 10 : 1));
    else if (event.key === "Home") play.seek(0);
    else if (event.key === "End") play.seek(this.last);
    else if (event.key === "[" || event.key === "]") this._event(event.key === "]" ? 1 : -1);
    else if (event.key === " " || event.key === "Enter") play.toggle();
    else return;
    event.preventDefault();
    event.stopPropagation();
    this._button();
    this._say(true);
  }

  /** The next event worth a line, or the one before. @param {1 | -1} way */
  _event(way) {
    const { page, play } = this;
    const listed = (page.run?.events ?? []).filter((event) => EVENTS[event.word]?.tell);
    if (way < 0) listed.reverse();
    const next = listed.find((event) => way * (event.tick - play.tick) > 1e-6);
    if (!next) return;
    play.pause();
    play.seek(next.tick);
  }

  /** @param {PointerEvent} event */
  _grab(event) {
    if (event.button !== 0 || !this.page.run) return;
    const { track, play } = this;
    const { left } = track.getBoundingClientRect();
    const to = (/** @type {number} */ x) => {
      const tick = Math.min(Math.max((x - left) / this.width, 0), 1) * this.last;
      play.seek(play.playing ? tick : Math.round(tick));
      this._button();
    };
    track.setPointerCapture(event.pointerId);
    play.hold(true);
    to(event.clientX);
    const move = (/** @type {PointerEvent} */ moved) => to(moved.clientX);
    const end = () => {
      track.removeEventListener("pointermove", move);
      track.removeEventListener("pointerup", end);
      track.removeEventListener("pointercancel", end);
      play.hold(false);
      this._say(true);
    };
    track.addEventListener("pointermove", move);
    track.addEventListener("pointerup", end);
    track.addEventListener("pointercancel", end);
    track.focus({ preventScroll: true });
    event.preventDefault();
  }

  /** What lies under the pointer. @param {number} x */
  _point(x) {
    const { run } = this.page;
    if (!run || !this.last) return;
    const tick = Math.round((Math.min(Math.max(x, 0), this.width) / this.width) * this.last);
    const reach = (NEAR / this.width) * this.last;
    let found = null;
    let near = Math.max(reach, 0.5);
    for (const event of run.events) {
      const away = Math.abs(event.tick - (x / this.width) * this.last);
      if (EVENTS[event.word]?.tell && away <= near) {
        near = away;
        found = event;
      }
    }
    this.tip.textContent = found ? `${timeOf(run, found.tick)}: ${found.sentence || EVENTS[found.word].label}` : timeOf(run, tick);
    this.tip.style.transform = `translateX(${Math.round(x)}px) translateX(${x > this.width / 2 ? "-100%" : "0"})`;
    this.tip.hidden = false;
  }

  // ---- marks --------------------

  _want() {
    if (this._wanted) return;
    this._wanted = true;
    requestAnimationFrame(() => {
      this._wanted = false;
      this._draw();
    });
  }

  _draw() {
    const { marks, page, width } = this;
    const ratio = window.devicePixelRatio || 1;
    const height = 26;
    const wide = Math.round((width + 2 * BESIDE) * ratio);
    if (marks.width !== wide || marks.height !== Math.round(height * ratio)) {
      marks.width = wide;
      marks.height = Math.round(height * ratio);
    }
    const pen = /** @type {CanvasRenderingContext2D} */ (marks.getContext("2d"));
    pen.setTransform(ratio, 0, 0, ratio, BESIDE * ratio, 0);
    pen.clearRect(-BESIDE, 0, width + 2 * BESIDE, height);
    if (!page.run || !this.last) return;
    /** Pixels that have this mark already: hundreds of waits are drawn once each pixel. @type {Record<string, number>} */
    const taken = {};
    for (const event of page.run.events) {
      const look = EVENTS[event.word];
      if (!look) continue;
      const x = Math.round(this._x(event.tick));
      const room = look.shape === "bar" || look.shape === "tick" ? 1 : 3;
      if (taken[event.word] !== undefined && x - taken[event.word] < room) continue;
      taken[event.word] = x;
      pen.fillStyle = pen.strokeStyle = page.dark ? look.dark : look.light;
      mark(pen, look.shape, x, height / 2);
    }
  }
}

/** @param {CanvasRenderingContext2D} pen @param {string} shape @param {number} x @param {number} y */
export function mark(pen, shape, x, y) {
  const r = 4.5;
  pen.lineWidth = 2;
  pen.beginPath();
  if (shape === "bar") pen.rect(x - 0.75, y + 4, 1.5, 6);
  else if (shape === "tick") pen.rect(x - 0.5, y - 9, 1, 4);
  else if (shape === "square") pen.rect(x - r + 0.5, y - r + 0.5, 2 * r - 1, 2 * r - 1);
  else if (shape === "triangle") {
    pen.moveTo(x, y - r - 0.5);
    pen.lineTo(x + r + 0.5, y + r - 0.5);
    pen.lineTo(x - r - 0.5, y + r - 0.5);
    pen.closePath();
  } else if (shape === "gate") {
    gateOutline(pen, x, y, r + 0.5);
    pen.stroke();
    return;
  } else if (shape === "star") {
    for (let k = 0; k < 10; k++) {
      const turn = (Math.PI * k) / 5 - Math.PI / 2;
      const far = k % 2 ? 2.6 : 6;
      pen.lineTo(x + far * Math.cos(turn), y + far * Math.sin(turn));
    }
    pen.closePath();
  } else if (shape === "cross") {
    pen.moveTo(x - r, y - r);
    pen.lineTo(x + r, y + r);
    pen.moveTo(x + r, y - r);
    pen.lineTo(x - r, y + r);
    pen.stroke();
    return;
  } else {
    pen.arc(x, y, r - 0.5, 0, 2 * Math.PI);
    pen.stroke();
    return;
  }
  pen.fill();
}

/** @param {Page} page @param {HTMLElement} element */
export function mount(page, element) {
  new Timeline(page, element);
}
