// Stagehand: takes the map over to show something step by step, and gives it back as it was.

import { LINES } from "./colours.js";

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
    page.on("plan", redo);
    page.on("layer", redo);
    page.on("ground", redo);
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
