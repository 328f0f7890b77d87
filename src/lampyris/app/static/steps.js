// Steps: AD-GSO in slow motion. Rings grow one by one, accepted cells come with luciferin and probability, one is
// chosen, and the robot goes there. It is the record of the plan that is shown, nothing is worked out here. Its stagehand,
// the tour's too, takes the map over to show something step by step, and gives it back as it was.

import { LINES } from "./colours.js";
import { block, button, el, fill, sentence, spelled, spoken } from "./make.js";
import { planned } from "./runs.js";


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
    this.table = el("div", { class: "wide", tabindex: 0, role: "group", "aria-label": "Accepted cells" });
    this.box = el("div", { class: "stack", hidden: true }, el("div", { class: "row" }, this.back, this.auto, this.next, this.pace,
      button("Leave", () => this.leave())), this.slider, this.where, this.words, this.table);
    into.append(this.hint, el("div", { class: "row" }, this.open, this.take), this.box);
    into.addEventListener("keydown", (event) => this._key(event));
    page.store.listen(() => {
      if (this.hand.on) this.leave(false);
      this._offer();
    });
    // A run that waits to be played is no reason to leave: the one from before the tour may come late.
    page.on("play", () => this.hand.on && page.play.playing && this.leave());
    page.on("run", () => this.hand.on && page.map.moment.others?.length && this.leave());
    // Another moment of the same run is shown in their place.
    let [run, tick] = [page.run, page.play.tick];
    page.on("tick", () => {
      const other = run === page.run && tick !== page.play.tick;
      [run, tick] = [page.run, page.play.tick];
      if (other && this.hand.on) this.leave();
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

// ---- what shows it on the map ----

/** @typedef {{at: Cell, text?: string, colour: string, fill?: number, ring?: boolean}} Mark */

const LOOKED = "#8b929c";
export const ACCEPTED = LINES[0][0];
export const CHOSEN = "#d55e00";

/** Rings farther out than this are not filled in cell by cell. */
const MOST_LOOKED = 3000;

/**
 * An iteration of AD-GSO as plans record it.
 * @typedef {{
 *   at: Cell, luciferin: number, chosen: Cell, subpath: Cell[], by_parents: boolean, rings: number,
 *   accepted: Array<{cell: Cell, ring: number, luciferin: number, probability: number}>,
 * }} Jump
 */

export class Stagehand {
  /** @param {Page} page @param {() => void} again called when somebody else has drawn over what is shown */
  constructor(page, again) {
    this.page = page;
    /** @type {(() => void) | null} */
    this._back = null;
    /** @type {{start: Cell | null, goal: Cell | null}} */
    this._ends = { start: null, goal: null };
    const redo = () => {
      if (this._back) queueMicrotask(() => this._back && again());
    };
    for (const name of ["plan", "layer", "ground", "theme"]) page.on(name, redo);
    for (const name of ["run", "ticks", "end", "tick"]) page.on(name, () => page.play.playing || redo());
    // A run that is played is shown alone.
    page.on("play", () => (page.play.playing ? this.on && this.show({}) : redo()));
  }

  get on() {
    return this._back !== null;
  }

  take() {
    if (this._back) return;
    const { map, play } = this.page;
    const { marks, layer, gates, start, goal } = map;
    const { scale, x, y } = map.view;
    if (play.playing) play.toggle();
    // The tools' words would lie over the lowest row.
    document.body.classList.add("led");
    this._ends = { start, goal };
    this._back = () => {
      Object.assign(map, { start, goal });
      map.marks = marks;
      map.gates = gates;
      map.setLayer(layer);
      Object.assign(map.view, { scale, x, y });
    };
  }

  /** @param {boolean} [look] whether the view goes back too */
  give(look = true) {
    const back = this._back;
    if (!back) return;
    this._back = null;
    document.body.classList.remove("led");
    const { map, play } = this.page;
    const { scale, x, y } = map.view;
    back();
    if (!look) Object.assign(map.view, { scale, x, y });
    map.moment.robot = null;
    map.moment.trail = null;
    this.page.tell("plan", this.page.plan);
    if (this.page.run) play.seek(play.tick);
    map.refresh();
    this.page.tell("map");
  }

  /**
   * What is on the map now. `bare`: without the letters of start and goal, which would hide numbers.
   * @param {{bare?: boolean, marks?: Mark[], ways?: import("./map.js").Way[], robot?: Cell | null, layer?: Layer | null, gates?: import("./still.js").Gate[]}} what
   */
  show({ bare = false, marks = [], ways = [], robot = null, layer = null, gates = [] }) {
    const { map } = this.page;
    Object.assign(map, bare ? { start: null, goal: null } : this._ends);
    map.marks = marks;
    map.ways = ways;
    map.gates = gates;
    map.moment.robot = robot ? [robot[0], robot[1]] : null;
    map.moment.trail = null;
    map.moment.bodies = null;
    if (map.layer !== layer) map.setLayer(layer);
    map.refresh();
  }

  /** Bring cells around one into view, large enough to be read. @param {Cell} at @param {number} rings */
  look(at, rings) {
    const { view } = this.page.map;
    const room = Math.min(view.width, view.height);
    const wanted = Math.min(44, Math.max(10, (0.8 * room) / (2 * rings + 3)));
    if (view.scale < Math.min(24, wanted)) view.scale = wanted;
    const [x, y] = view.pixel(at[0], at[1]);
    const edge = Math.min(room / 3, (rings + 1.5) * view.scale);
    const away = x < edge || y < edge || x > view.width - edge || y > view.height - edge;
    if (away) {
      view.x += view.width / 2 - x;
      view.y += view.height / 2 - y;
    }
    this.page.tell("map");
  }
}

/**
 * An iteration as marks, up to a ring.
 * @param {Jump} jump @param {number} ring @param {boolean} chosen whether the choice is shown
 * @param {Ground} ground
 * @returns {Mark[]}
 */
export function marksOf(jump, ring, chosen, ground) {
  /** @type {Mark[]} */
  const marks = [];
  const [x, y] = jump.at;
  const taken = new Set(jump.accepted.map(({ cell }) => cell.join()));
  if ((2 * ring + 1) ** 2 <= MOST_LOOKED) {
    for (let j = Math.max(0, y - ring); j <= Math.min(ground.height - 1, y + ring); j++) {
      for (let i = Math.max(0, x - ring); i <= Math.min(ground.width - 1, x + ring); i++) {
        const far = Math.max(Math.abs(i - x), Math.abs(j - y));
        const wall = ground.cells[j * ground.width + i] === 1;
        if (far && !wall && !taken.has(`${i},${j}`)) marks.push({ at: [i, j], colour: LOOKED, fill: 0.14, ring: false });
      }
    }
  }
  const most = Math.max(...jump.accepted.map((one) => one.probability));
  for (const one of jump.accepted) {
    if (one.ring > ring) continue;
    const is = chosen && one.cell.join() === jump.chosen.join();
    marks.push({
      at: one.cell, colour: is ? CHOSEN : ACCEPTED, fill: is ? 0.5 : 0.15 + (0.4 * one.probability) / most, ring: is || one.ring === ring,
      text: one.probability.toFixed(3).replace(/^0/, ""),
    });
  }
  return marks;
}

/** The way of some iterations, from node to node. @param {Jump[]} jumps */
export function wayOf(jumps) {
  const cells = jumps.flatMap(({ subpath }, k) => (k ? subpath.slice(1) : subpath)).flat();
  return { cells, colour: ACCEPTED, wide: 3 };
}

/** Of one iteration, dashed. @param {Jump} jump */
export function stretchOf(jump) {
  return { cells: jump.subpath.flat(), colour: CHOSEN, dash: [7, 5], wide: 2 };
}

/**
 * What arrows and Escape do where there are pages to turn.
 * @param {KeyboardEvent} event @param {(by: number) => void} go @param {() => void} leave
 */
export function turned(event, go, leave) {
  const by = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
  if (by) go(by);
  else if (event.key === "Escape") leave();
  else return;
  event.preventDefault();
  event.stopPropagation();
}
