// The clock of a fleet or a swarm, and its bar: play, pause, a slider over the ticks, speed.

import { el, icon } from "./make.js";
import { PACE, RATES } from "./play.js";

const LONGEST = 250;
const ICONS = { play: "M6 4l10 6-10 6z", pause: "M7 4v12M13 4v12", back: "M14 5l-7 5 7 5zM5 5v10", on: "M6 5l7 5-7 5zM15 5v10" };

/** It takes the place of the player of a single robot while a fleet is shown. */
export class FleetClock {
  /** @param {Page} page @param {() => void} show called whenever another moment is shown */
  constructor(page, show) {
    this.page = page;
    this.tick = 0;
    this.playing = false;
    this.speed = 1;
    this.last = 0;
    /** Nothing is known behind the last tick yet, so that it is waited for. */
    this.more = false;
    this.held = false;
    this._show = show;
    this._before = 0;
    this._asked = false;
    this._frame = (/** @type {number} */ now) => this._advance(now);

    this.main = el("button", { type: "button", class: "btn primary main", "aria-keyshortcuts": "Space", onclick: () => this.toggle() });
    const step = (/** @type {number} */ by) => el("button", { type: "button", class: "btn icon", "aria-label": by < 0 ? "One tick back" : "One tick on", title: by < 0 ? "One tick back (,)" : "One tick on (.)", onclick: () => this.step(by) }, icon(by < 0 ? ICONS.back : ICONS.on));
    this.slider = el("input", { type: "range", class: "grow", min: 0, max: 0, step: 1, value: 0, "aria-label": "Tick" });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.slider.addEventListener("pointerdown", () => this.hold(true));
    for (const name of ["pointerup", "pointercancel"]) this.slider.addEventListener(name, () => this.hold(false));
    this.where = el("output", { class: "tl-where" });
    this.rates = el("select", { "aria-label": "Speed of play", title: "Speed of play" }, ...RATES.map((rate) => el("option", { value: rate }, `${rate}\u00d7`)));
    this.rates.value = "1";
    this.rates.addEventListener("change", () => this.rate(Number(this.rates.value)));
    this.bar = el("div", { class: "tl" }, el("div", { class: "tl-buttons" }, step(-1), this.main, step(1)), this.slider, this.where, this.rates);
    this._said = "";
    this._button();
    this.changed(0);
  }

  /** Other ticks are known. @param {number} last @param {boolean} [more] others are on their way */
  changed(last, more = false) {
    this.last = last;
    this.more = more;
    this.slider.max = String(last);
    this.slider.disabled = !last;
    this.main.disabled = !last && !more;
    this.tick = Math.min(this.tick, last);
    this._now();
    this._ask();
  }

  /** @param {number} t */
  seek(t) {
    this.tick = Math.min(Math.max(Number.isFinite(t) ? t : 0, 0), this.last);
    this._now();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.start();
  }

  start() {
    if (!this.last) return;
    if (this.tick >= this.last && !this.more) this.tick = 0;
    this.playing = true;
    this._before = 0;
    this._button();
    this._ask();
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.tick = Math.min(Math.round(this.tick), this.last);
    this._button();
    this._now();
  }

  /** @param {number} n */
  step(n) {
    this.pause();
    this.seek((n > 0 ? Math.floor(this.tick + 1e-6) : Math.ceil(this.tick - 1e-6)) + n);
  }

  /** @param {number} f */
  rate(f) {
    this.speed = Math.min(Math.max(f, RATES[0]), RATES[RATES.length - 1]);
    this.rates.value = String(this.speed);
  }

  /** @param {boolean} held */
  hold(held) {
    this.held = held;
    this._before = 0;
    this._ask();
  }

  _ask() {
    if (this._asked || !this.playing || this.held) return;
    this._asked = true;
    requestAnimationFrame(this._frame);
  }

  /** @param {number} now */
  _advance(now) {
    this._asked = false;
    if (!this.playing || this.held) return;
    const passed = this._before ? Math.min(now - this._before, LONGEST) : 0;
    this._before = now;
    if (this.tick < this.last) {
      this.tick = Math.min(this.tick + (passed / 1000) * PACE * this.speed, this.last);
      this._now();
    }
    if (this.tick >= this.last && !this.more) this.pause();
    else this._ask();
  }

  /** The bar, seldom: each change costs the browser a drawing of it. */
  _now() {
    const said = `${Math.floor(this.tick + 1e-6)} / ${this.last}${this.more ? "+" : ""}`;
    if (said !== this._said) {
      this._said = said;
      this.where.textContent = this.last || this.more ? said : "not planned yet";
      this.slider.value = String(Math.floor(this.tick + 1e-6));
      this.slider.setAttribute("aria-valuetext", `tick ${this.slider.value} of ${this.last}`);
    }
    this._show();
  }

  _button() {
    const label = this.playing ? "Pause" : "Play";
    this.main.setAttribute("aria-label", label);
    this.main.replaceChildren(icon(this.playing ? ICONS.pause : ICONS.play), label);
    this.main.classList.toggle("filled", !this.playing);
  }
}
