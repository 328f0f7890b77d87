// Brush: the cells that a stroke goes over, and the stroke itself. What is painted is drawn in the same frame; the
// scenario gets it once a frame.

import { applyEdits, withStroke } from "./ground.js";

/** Cells of a line between two, both ends included (Bresenham). @param {Cell} a @param {Cell} b @returns {Cell[]} */
export function line(a, b) {
  let [x, y] = a;
  const dx = Math.abs(b[0] - x);
  const dy = -Math.abs(b[1] - y);
  const sx = x < b[0] ? 1 : -1;
  const sy = y < b[1] ? 1 : -1;
  let error = dx + dy;
  /** @type {Cell[]} */
  const cells = [[x, y]];
  while (x !== b[0] || y !== b[1]) {
    const twice = 2 * error;
    if (twice >= dy) {
      error += dy;
      x += sx;
    }
    if (twice <= dx) {
      error += dx;
      y += sy;
    }
    cells.push([x, y]);
  }
  return cells;
}

/** Cells of a brush about (0, 0): squares of 1 to 3, then discs. @param {number} size @returns {Cell[]} */
export function brush(size) {
  const low = -Math.floor((size - 1) / 2);
  const middle = low + (size - 1) / 2;
  /** @type {Cell[]} */
  const cells = [];
  for (let y = low; y < low + size; y++) {
    for (let x = low; x < low + size; x++) {
      if (size <= 3 || Math.hypot(x - middle, y - middle) <= size / 2) cells.push([x, y]);
    }
  }
  return cells;
}

let strokes = 0;

/** A stroke of the brush, from down to up. */
export class Stroke {
  /** @param {Page} page @param {number} value 1: wall, 0: free @param {Cell[]} cells of the brush */
  constructor(page, value, cells) {
    this._page = page;
    this._value = value;
    this._brush = cells;
    /** @type {Cell | null} */
    this._last = null;
    /** Value of each painted cell. @type {Map<number, number>} */
    this._painted = new Map();
    this._edits = page.store.scenario.edits;
    this._map = page.store.scenario.map;
    this._ground = page.ground;
    this._mark = `stroke ${++strokes}`;
    this._asked = false;
    const { run, play } = page;
    const over = run !== null && run.done && !run.cut && play.tick >= run.ticks - 1;
    // What has been driven stays as it is: the wall comes at the next tick. Behind the end nothing would change.
    this._tick = run && !run.step && (play.tick > 0 || play.playing) && !over ? Math.floor(play.tick) + 1 : 0;
    if (over) play.seek(0);
    play.hold(true);
    this._before = new Uint8Array(page.base?.length ?? 0);
    const earlier = this._edits.filter((edit) => edit.tick < this._tick);
    if (page.base && page.ground) applyEdits(page.base, earlier, this._tick, page.ground.width, this._before);
  }

  /** @param {Cell} cell */
  to(cell) {
    const { ground, map, store } = this._page;
    if (!ground || this._over || this._elsewhere) return;
    const { start, goal } = store.scenario;
    /** @type {Cell[]} */
    const fresh = [];
    for (const [x, y] of line(this._last ?? cell, cell)) {
      for (const [dx, dy] of this._brush) {
        const cx = x + dx;
        const cy = y + dy;
        if (cx < 0 || cy < 0 || cx >= ground.width || cy >= ground.height) continue;
        const k = cy * ground.width + cx;
        if (ground.cells[k] === this._value || this._painted.has(k)) continue;
        if (this._value && ((start?.[0] === cx && start[1] === cy) || (goal?.[0] === cx && goal[1] === cy))) continue;
        this._painted.set(k, this._value);
        ground.cells[k] = this._value;
        fresh.push([cx, cy]);
      }
    }
    this._last = cell;
    if (!fresh.length) return;
    map.repaint(fresh);
    // Before the start the plan follows the brush; a run is made again when the stroke is done.
    if (this._tick === 0 && !this._asked) {
      this._asked = true;
      requestAnimationFrame(() => {
        this._asked = false;
        this._commit();
      });
    }
  }

  _commit() {
    const { store, ground } = this._page;
    if (!ground || this._over || this._elsewhere || !this._painted.size) return;
    const edits = withStroke(this._edits, this._tick, this._painted, this._before, ground.width);
    this._page.tell("painted", edits);
    store.set({ edits }, this._mark);
  }

  end() {
    this._page.play.hold(false);
    this._commit();
    this._over = true;
    this._page.store.settle();
  }

  /** It was a pinch after all. */
  drop() {
    this._page.play.hold(false);
    this._over = true;
    if (this._elsewhere) return;
    if (this._page.store.scenario.edits !== this._edits) this._page.store.undo();
    else if (this._painted.size) this._page.tell("repaint");
  }

  /** Another map has come meanwhile: what was begun on the old one is nothing on it. */
  get _elsewhere() {
    return this._page.ground !== this._ground || this._page.store.scenario.map !== this._map;
  }

  _over = false;
}
