// Tour: the worked 10x10 example in twelve steps, each table of the dissertation beside what lampyris computes. The
// scenario that was there before comes back when it is left.

import { STEPS } from "./chapters.js";
import { SIDE, keep, scenario } from "./example.js";
import { numbers } from "./guide.js";
import { block, button, el, fill, sentence } from "./make.js";
import { Stagehand, turned } from "./stagehand.js";

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
    this.table = el("div", { class: "stack wide" });
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
