// Steps: AD-GSO in slow motion. Rings grow one by one, accepted cells come with luciferin and probability, one is
// chosen, and the robot goes there. It is the record of the plan that is shown, nothing is worked out here.

import { block, button, el, fill, sentence, spelled, spoken } from "./make.js";
import { planned } from "./runs.js";
import { Stagehand, marksOf, stretchOf, turned, wayOf } from "./stagehand.js";

/** @typedef {import("./stagehand.js").Jump} Jump */

/** What is shown at once: a ring of an iteration, its choice, or its way. @typedef {{jump: number, ring: number, act: "ring" | "choice" | "path"}} Scene */

const MOST_ROWS = 150;
const PAUSES = /** @type {Array<[string, number]>} */ ([["slow", 2600], ["calm", 1400], ["quick", 500]]);

/** @param {Page} page @param {HTMLElement} into */
export function mount(page, into) {
  const place = block(into, "slow", "AD-GSO step by step");
  if (place) new Steps(page, place);
}

class Steps {
  /** @param {Page} page @param {HTMLElement} into */
  constructor(page, into) {
    this.page = page;
    /** @type {Jump[]} */
    this.jumps = [];
    /** @type {Scene[]} */
    this.scenes = [];
    this.at = 0;
    this.enough = 10;
    this.timer = 0;
    this.hand = new Stagehand(page, () => this._draw());
    this.hint = el("p", { class: "hint" });
    this.open = button("Show its steps", () => this._open(), { class: "btn primary" });
    this.take = button("Plan with AD-GSO", () => page.store.set({ planner: { name: "ad-gso", settings: {} } }));
    this.back = button("‹", () => this._go(this.at - 1), { class: "btn icon", "aria-label": "Previous step" });
    this.next = button("›", () => this._go(this.at + 1), { class: "btn icon", "aria-label": "Next step" });
    this.auto = button("Play", () => this._auto(), { "aria-pressed": "false" });
    this.pace = el("select", { "aria-label": "Pace" }, ...PAUSES.map(([word], k) => el("option", { value: k, selected: k === 1 }, word)));
    this.slider = el("input", { type: "range", min: 0, max: 0, step: 1, value: 0, "aria-label": "Step", oninput: () => this._go(Number(this.slider.value)) });
    this.where = el("h3", null);
    this.words = el("p", { "aria-live": "polite" });
    this.table = el("div", { class: "wide" });
    this.box = el("div", { class: "stack", hidden: true }, el("div", { class: "row" }, this.back, this.auto, this.next, this.pace,
      button("Leave", () => this.leave())), this.slider, this.where, this.words, this.table);
    into.append(this.hint, el("div", { class: "row" }, this.open, this.take), this.box);
    into.addEventListener("keydown", (event) => this._key(event));
    page.store.listen(() => {
      if (this.hand.on) this.leave(false);
      this._offer();
    });
    page.on("run", () => {
      if (this.hand.on && page.run) this.leave();
    });
    page.on("plan", () => this._offer());
    this._offer();
  }

  /** What can be shown of the present scenario. */
  _offer() {
    const mine = this.page.store.scenario.planner.name === "ad-gso";
    this.open.hidden = !mine || this.hand.on;
    this.take.hidden = mine;
    this.open.disabled = this.page.plan?.status !== "found" && !this.page.plan?.iterations;
    this.hint.hidden = this.hand.on;
    this.hint.textContent = mine ? "How it walks down the landscape: the window grows ring by ring, one cell in it is chosen, the robot goes there."
      : "These are the steps of AD-GSO; another planner is chosen now.";
  }

  async _open() {
    const { page } = this;
    this.open.disabled = true;
    try {
      const plan = await planned(page, { scenario: page.asked(true), record: true, layers: [] });
      if (!plan.jumps?.length) {
        page.say(plan.sentence || "There is no step to show.");
        return;
      }
      this.jumps = plan.jumps;
      const { settings } = page.store.scenario.planner;
      this.enough = Number(settings.nt ?? 10);
      this.scenes = this.jumps.flatMap((jump, k) => scenesOf(jump, k));
      this.hand.take();
      this.box.hidden = false;
      this.slider.max = String(this.scenes.length - 1);
      this.at = 0;
      this._offer();
      this._draw();
      this.next.focus();
    } catch (error) {
      page.say(sentence(error), "bad");
    } finally {
      this.open.disabled = false;
    }
  }

  /** @param {boolean} [look] */
  leave(look = true) {
    this._stop();
    this.box.hidden = true;
    this.hand.give(look);
    this._offer();
  }

  /** @param {number} k */
  _go(k) {
    this.at = Math.min(Math.max(k, 0), this.scenes.length - 1);
    this._draw();
  }

  _auto() {
    if (this.timer) {
      this._stop();
      return;
    }
    if (this.at >= this.scenes.length - 1) this._go(0);
    this.auto.setAttribute("aria-pressed", "true");
    this.auto.textContent = "Pause";
    const tick = () => {
      this.timer = window.setTimeout(() => {
        this._go(this.at + 1);
        if (this.at >= this.scenes.length - 1) this._stop();
        else tick();
      }, PAUSES[Number(this.pace.value)][1]);
    };
    tick();
  }

  _stop() {
    clearTimeout(this.timer);
    this.timer = 0;
    this.auto.setAttribute("aria-pressed", "false");
    this.auto.textContent = "Play";
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    if (!this.hand.on || event.target === this.slider || event.target === this.pace) return;
    turned(event, (by) => this._go(this.at + by), () => this.leave());
  }

  _draw() {
    const { page } = this;
    const scene = this.scenes[this.at];
    if (!scene || !page.ground) return;
    const jump = this.jumps[scene.jump];
    const walked = this.jumps.slice(0, scene.jump);
    const ways = walked.length ? [wayOf(walked)] : [];
    if (scene.act === "path") ways.push(/** @type {any} */ (stretchOf(jump)));
    this.hand.look(jump.at, jump.rings);
    this.hand.show({
      marks: marksOf(jump, scene.ring, scene.act !== "ring", page.ground), ways, robot: scene.act === "path" ? jump.chosen : jump.at,
    });
    this.slider.value = String(this.at);
    this.slider.setAttribute("aria-valuetext", `iteration ${scene.jump}, ${scene.act} ${scene.ring}`);
    this.back.disabled = this.at === 0;
    this.next.disabled = this.at === this.scenes.length - 1;
    this.where.textContent = `Iteration ${scene.jump} of ${this.jumps.length}, at ${spelled(jump.at)}`;
    this.words.textContent = wordsOf(scene, jump, this.enough);
    fill(this.table, jumpTable(jump, scene.ring, scene.act !== "ring"));
  }
}

/** @param {Jump} jump @param {number} k @returns {Scene[]} */
function scenesOf(jump, k) {
  const last = jump.rings;
  /** @type {Scene[]} */
  const scenes = Array.from({ length: last }, (_, ring) => ({ jump: k, ring: ring + 1, act: "ring" }));
  return [...scenes, { jump: k, ring: last, act: "choice" }, { jump: k, ring: last, act: "path" }];
}

/** @param {Scene} scene @param {Jump} jump @param {number} enough */
function wordsOf(scene, jump, enough) {
  if (scene.act === "ring") {
    const here = jump.accepted.filter((one) => one.ring === scene.ring).length;
    const all = jump.accepted.filter((one) => one.ring <= scene.ring).length;
    const more = scene.ring < jump.rings;
    const why = more ? `${all} so far, fewer than ${enough}: the window grows.` : all >= enough ? `${all} in all, enough: the window stops growing.` : `${all} in all; no ring is left that may be opened.`;
    return `Ring ${scene.ring}: ${here} of ${8 * scene.ring} cells are accepted. They are free, have less luciferin than ${jump.luciferin.toFixed(3)}, and can be reached through accepted cells. ${why}`;
  }
  if (scene.act === "choice") {
    const one = jump.accepted.find(({ cell }) => cell.join() === jump.chosen.join());
    return one ? `${spelled(jump.chosen)} is chosen: luciferin ${one.luciferin.toFixed(3)}, probability ${one.probability.toFixed(3)}.` : `${spelled(jump.chosen)} is chosen.`;
  }
  const how = jump.by_parents ? "along the back pointers" : "the cheapest path inside the accepted cells";
  return `It goes there ${how}: ${jump.subpath.map(spelled).join(" ")}.`;
}

/** The accepted cells of an iteration, as the dissertation lists them. @param {Jump} jump @param {number} ring @param {boolean} chosen */
export function jumpTable(jump, ring, chosen) {
  const there = jump.accepted.filter((one) => one.ring <= ring);
  const made = el("table", { class: "data accepted" }, el("caption", { class: "unseen" }, "Accepted cells"),
    el("thead", null, el("tr", null, ...["cell", "ring", "luciferin", "probability"].map((word) => el("th", { scope: "col" }, word)))),
    el("tbody", null, ...there.slice(0, MOST_ROWS).map((one) => {
      const is = chosen && one.cell.join() === jump.chosen.join();
      return el("tr", is ? { class: "chosen" } : null, el("th", { scope: "row" }, spelled(one.cell), is ? " ◂" : null, is ? spoken(" chosen") : null),
        el("td", null, String(one.ring)), el("td", null, one.luciferin.toFixed(3)), el("td", null, one.probability.toFixed(4)));
    })));
  if (there.length > MOST_ROWS) made.append(el("tfoot", null, el("tr", null, el("td", { colspan: 4 }, `and ${there.length - MOST_ROWS} more`))));
  return made;
}
