// Hand: what pointers do on the map from down to up. A press that stays is a click; a drag moves an end, paints or
// pans; two fingers pinch. And the brush: the cells that a stroke goes over, and the stroke itself. What is painted is
// drawn in the same frame; the scenario gets it once a frame.

import { applyEdits, withStroke } from "./ground.js";
import { HANDLE, handleOf } from "./shape.js";
import { moveBy, zoomBy } from "./view.js";

/** @typedef {import("./edit.js").Editor} Editor */

/** What the pointer does from down to up. `raw`: each move at once, not once a frame. @typedef {{move: (event: PointerEvent) => void, up: (event: PointerEvent) => void, drop?: () => void, raw?: (event: PointerEvent) => void}} Deed */

/** Pixels about an end in which it is taken hold of. */
const NEAR = 12;
/** Pixels that a click may slip. */
const SLIP = 5;

export class Hand {
  /** @param {Editor} editor */
  constructor(editor) {
    const { page } = editor;
    this.editor = editor;
    this.page = page;
    /** @type {Map<number, PointerEvent>} */
    this._pointers = new Map();
    /** @type {Deed | null} */
    this._deed = null;
    /** A pointer is pressing: the focus comes from it. */
    this._pressed = false;
    /** The space key, which keys.js looks after: while it is held, dragging pans. */
    this.space = { held: false, panned: false };
    const { canvas } = page.map;
    canvas.addEventListener("pointerdown", (event) => this._down(event));
    canvas.addEventListener("pointermove", (event) => this._move(event));
    // Moves are handed out once a frame, these as they come: a brush does not wait for the frame.
    canvas.addEventListener("pointerrawupdate", (event) => this._raw(/** @type {PointerEvent} */ (event)));
    canvas.addEventListener("pointerup", (event) => this._up(event));
    canvas.addEventListener("pointercancel", (event) => this._up(event));
    canvas.addEventListener("pointerleave", () => this.hideBrush());
    canvas.addEventListener("dblclick", () => editor.patrols.end());
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this._wheel(event), { passive: false });
    canvas.addEventListener("focus", () => {
      // Whoever comes by keyboard sees at once where the cursor is.
      if (canvas.matches(":focus-visible") && !this._pressed) editor.cursor.move([0, 0]);
    });
    // Browsers take a focus that a script sets for one by keyboard: the frame is shown once a key is used.
    canvas.addEventListener("keydown", () => canvas.classList.remove("by-hand"));
    canvas.addEventListener("blur", () => {
      canvas.classList.remove("by-hand");
      page.map.cursor = null;
      page.map.draw();
    });
  }

  /** @param {PointerEvent} event */
  _down(event) {
    const { page } = this;
    if (!page.ground) return;
    this._pressed = true;
    page.map.canvas.classList.add("by-hand");
    page.map.canvas.focus({ preventScroll: true });
    this._pressed = false;
    try {
      page.map.canvas.setPointerCapture(event.pointerId);
    } catch {
      // The pointer is already gone.
    }
    this._pointers.set(event.pointerId, event);
    page.map.held = true;
    page.map.cursor = null;
    if (this._pointers.size === 2) {
      // The second finger makes a pinch of what the first one had begun.
      this._deed?.drop?.();
      this._deed = this._pinch();
      return;
    }
    if (this._pointers.size > 2) return;
    this._deed = this._begin(event);
  }

  /** @param {PointerEvent} event */
  _move(event) {
    if (this._pointers.has(event.pointerId)) {
      this._pointers.set(event.pointerId, event);
      this._deed?.move(event);
    }
    this._hover(event);
  }

  /** @param {PointerEvent} event */
  _raw(event) {
    if (this._pointers.has(event.pointerId)) this._deed?.raw?.(event);
  }

  /** @param {PointerEvent} event */
  _up(event) {
    if (!this._pointers.delete(event.pointerId)) return;
    const deed = this._deed;
    if (this._pointers.size === 0) {
      this._deed = null;
      this.page.map.held = false;
    }
    if (event.type === "pointercancel") deed?.drop?.();
    else deed?.up(event);
    if (event.pointerType === "touch") this.hideBrush();
  }

  /** @param {WheelEvent} event */
  _wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 200 : 1;
    const by = Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.0016));
    const [x, y] = this._pixel(event);
    zoomBy(this.page, by, x, y);
  }

  /** @param {MouseEvent} event @returns {[number, number]} */
  _pixel(event) {
    const box = this.page.map.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** @param {MouseEvent} event @returns {Cell} */
  _cell(event) {
    return this.page.map.view.cellAt(...this._pixel(event));
  }

  /** @param {PointerEvent} event @returns {Deed} */
  _begin(event) {
    const { tool } = this.page;
    const placing = tool === "start" || tool === "goal";
    if (event.button === 1 || tool === "pan" || this.space.held) return this._pan(event);
    const turned = placing && event.button === 0 ? this._handleAt(event) : null;
    if (turned) return this._turn(turned);
    const end = this._endAt(event);
    if (end && (placing || tool === "patrol") && event.button === 0) return this._drag(end);
    if (tool === "wall" || tool === "free") return this._stroke(event, tool === "wall" && event.button === 0 ? 1 : 0);
    if (event.button !== 0) return this._pan(event);
    // A press that stays where it is is a click, one that moves pans.
    const pan = this._pan(event);
    let slipped = false;
    return {
      move: (now) => {
        slipped ||= Math.hypot(now.clientX - event.clientX, now.clientY - event.clientY) > SLIP;
        if (slipped) pan.move(now);
      },
      up: (now) => (slipped ? pan.up(now) : this.editor.click(this._cell(now))),
    };
  }

  /** @param {PointerEvent} event @returns {Deed} */
  _pan(event) {
    let last = event;
    this.page.map.canvas.classList.add("grabbing");
    const end = () => this.page.map.canvas.classList.remove("grabbing");
    return {
      move: (now) => {
        moveBy(this.page, now.clientX - last.clientX, now.clientY - last.clientY);
        last = now;
        this.space.panned = true;
      },
      up: end, drop: end,
    };
  }

  /** @returns {Deed} */
  _pinch() {
    const between = () => {
      const [a, b] = [...this._pointers.values()];
      const [ax, ay] = this._pixel(a);
      const [bx, by] = b ? this._pixel(b) : [ax, ay];
      return { x: (ax + bx) / 2, y: (ay + by) / 2, far: Math.max(1, Math.hypot(ax - bx, ay - by)), two: Boolean(b) };
    };
    let last = between();
    return {
      move: () => {
        const now = between();
        if (now.two && last.two) {
          this.page.map.view.zoom(now.far / last.far, now.x, now.y);
          moveBy(this.page, now.x - last.x, now.y - last.y);
        }
        last = now;
      },
      // A finger that stays behind does nothing more.
      up: () => {
        if (this._pointers.size) last = between();
      },
    };
  }

  /** Which end is under the pointer. @param {PointerEvent} event @returns {"start" | "goal" | null} */
  _endAt(event) {
    const { fleet, map } = this.page;
    if (fleet) return null;
    const [px, py] = this._pixel(event);
    const reach = Math.max(event.pointerType === "touch" ? 22 : NEAR, map.view.scale * 0.6);
    /** @type {"start" | "goal" | null} */
    let found = null;
    let least = reach;
    for (const end of /** @type {const} */ (["goal", "start"])) {
      const cell = this.page.store.scenario[end];
      if (!cell) continue;
      const [x, y] = map.view.pixel(cell[0], cell[1]);
      const far = Math.hypot(px - x, py - y);
      if (far <= least) {
        least = far;
        found = end;
      }
    }
    return found;
  }

  /** Which end's handle is under the pointer. @param {PointerEvent} event */
  _handleAt(event) {
    const { shape, view } = this.page.map;
    if (!shape || this.page.fleet) return null;
    const [px, py] = this._pixel(event);
    const reach = event.pointerType === "touch" ? 22 : HANDLE + 6;
    return shape.ends.find((end) => {
      const [x, y] = handleOf(view, shape, end);
      return Math.hypot(px - x, py - y) <= reach;
    }) ?? null;
  }

  /** Turn the heading of an end after the pointer, in steps. @param {import("./shape.js").End} end @returns {Deed} */
  _turn({ end, at }) {
    const { store } = this.page;
    const before = store.scenario[`${end}_yaw`];
    return {
      move: (event) => {
        const [px, py] = this._pixel(event);
        const [x, y] = this.page.map.view.pixel(at[0], at[1]);
        this.editor.setHeading(end, Math.atan2(y - py, px - x), `turn ${end}`);
      },
      up: () => store.settle(),
      drop: () => {
        if (store.scenario[`${end}_yaw`] !== before) store.undo();
        store.settle();
      },
    };
  }

  /** @param {"start" | "goal"} end @returns {Deed} */
  _drag(end) {
    const { store } = this.page;
    const before = store.scenario[end];
    this.page.map.canvas.classList.add("grabbing");
    const over = () => {
      store.settle();
      this.page.map.canvas.classList.remove("grabbing");
    };
    return {
      move: (event) => this.editor.setEnd(end, this._cell(event), `drag ${end}`),
      up: over,
      drop: () => {
        if (store.scenario[end] !== before) store.undo();
        over();
      },
    };
  }

  /** @param {PointerEvent} event @param {number} value @returns {Deed} */
  _stroke(event, value) {
    const stroke = this.editor.stroke(value);
    stroke.to(this._cell(event));
    const to = (/** @type {PointerEvent} */ now) => stroke.to(this._cell(now));
    return { move: to, raw: to, up: () => stroke.end(), drop: () => stroke.drop() };
  }

  /** @param {PointerEvent} event */
  _hover(event) {
    const { page } = this;
    const { map } = page;
    if (page.tool === "wall" || page.tool === "free") {
      map.brush = { at: this._cell(event), size: this.editor.size };
      map.draw();
    } else if (this._pointers.size === 0) {
      const over = page.tool === "pan" || this.space.held || this._endAt(event) || this._handleAt(event) ? "grab" : "";
      map.canvas.classList.toggle("grab", over !== "");
    }
  }

  hideBrush() {
    if (!this.page.map.brush) return;
    this.page.map.brush = null;
    this.page.map.draw();
  }
}

// ---- the brush ----

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
