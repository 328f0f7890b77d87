// Edit: what hand and keys do on the map. Ends are clicked and dragged, walls painted and erased, patrols clicked
// point by point, the view moved. What is painted is drawn in the same frame; the scenario gets it once a frame.

import { byId, el, icon } from "./page.js";
import { applyEdits, withStroke } from "./ground.js";

/** @typedef {import("./types.js").Page} Page */
/** @typedef {import("./types.js").Cell} Cell */

export const TOOLS = [
  { name: "ends", key: "v", label: "Start and goal", tip: "Click the start, then the goal; drag either. Drag the ground to pan.", path: "M2.500 12.500h5v5h-5zM13 17V3l5 2.700-5 2.700M7.500 15h3" },
  { name: "wall", key: "b", label: "Paint walls", tip: "Paint walls; the right button erases.", path: "M4 16c3 0 4-1 4-3l7-8 2 2-8 7c-2 0-2 1-5 2zM8 13l1.500 1.500" },
  { name: "free", key: "e", label: "Erase walls", tip: "Erase walls.", path: "M4 12l7-7 5 5-6 6H7zM8 8l5 5M10 16h7" },
  { name: "patrol", key: "p", label: "Draw a patrol", tip: "Click the patrol's cells one by one; Enter or a double click ends, Esc drops it.", path: "M4 15l4-8 4 6 4-9M3 15h2v2H3zM7 5h2v2H7zM11 13h2v2h-2zM15 3h2v2h-2z" },
  { name: "pan", key: "h", label: "Move the map", tip: "Drag the map. Wheel or pinch zooms.", path: "M10 3v14M3 10h14M10 3L8 5M10 3l2 2M10 17l-2-2M10 17l2-2M3 10l2-2M3 10l2 2M17 10l-2-2M17 10l-2 2" },
];
const NARROW = window.matchMedia("(max-width: 820px)");
const NEAR = 12;
const SLIP = 5;

/** @param {Page} page @param {HTMLElement} bar */
export function mount(page, bar) {
  const editor = new Editor(page);
  /** @type {Map<string, HTMLButtonElement>} */
  const buttons = new Map();
  for (const tool of TOOLS) {
    const label = `${tool.label} (${tool.key.toUpperCase()})`;
    const button = el("button", { type: "button", class: "btn quiet icon", title: label, "aria-label": label, "aria-pressed": "false", onclick: () => page.use(tool.name) }, iconOf(tool));
    buttons.set(tool.name, button);
    bar.append(button);
  }
  const number = el("output", { "aria-hidden": "true" }, "1");
  const slider = el("input", { type: "range", min: 1, max: 9, step: 1, value: 1, "aria-label": "Brush size in cells" });
  const size = el("label", { class: "size", hidden: true, title: "Brush size, [ and ]" }, slider, number);
  slider.addEventListener("input", () => editor.resize(Number(slider.value)));
  const done = el("button", { type: "button", class: "btn primary done", hidden: true, onclick: () => editor.endPatrol() }, "Place this patrol");
  bar.append(size);
  byId("stage").append(done);

  const tip = byId("tip");
  editor.onChange = () => {
    slider.value = String(editor.size);
    number.textContent = `${editor.size}`;
    done.hidden = editor.draft.length === 0;
    const trouble = page.plan && page.plan.cells.length === 0 && !editor.draft.length ? page.plan.sentence : "";
    tip.textContent = trouble || editor.tip();
    tip.classList.toggle("trouble", trouble !== "");
  };
  page.use = (name) => {
    if (name !== "patrol") editor.dropPatrol();
    page.tool = name;
    for (const [one, button] of buttons) button.setAttribute("aria-pressed", String(one === name));
    size.hidden = name !== "wall" && name !== "free";
    page.map.canvas.dataset.tool = name;
    editor.hideBrush();
    editor.onChange();
    page.tell("tool", name);
  };
  page.on("edit-key", (event) => editor.key(event));
  page.on("space", (space) => {
    editor.space = space;
    page.map.canvas.classList.toggle("grab", space.held);
  });
  page.on("brush", (by) => editor.resize(editor.size + by));
  page.on("ground", () => editor.onChange());
  page.on("plan", () => editor.onChange());
  page.store.listen(() => {
    editor.showPatrols();
    editor.onChange();
  });
  zoomButtons(page);
  const room = () => {
    page.map.edge = NARROW.matches ? { top: 56, right: 14, bottom: 14, left: 14 } : { top: 16, right: 58, bottom: 16, left: 58 };
    bar.setAttribute("aria-orientation", NARROW.matches ? "horizontal" : "vertical");
    slider.classList.toggle("upright", !NARROW.matches);
  };
  NARROW.addEventListener("change", () => {
    room();
    fit(page);
  });
  room();
  page.use("ends");
}

/** Start and goal in their own signs, the rest as lines. @param {{path: string}} tool */
function iconOf(tool) {
  return icon(tool.path);
}

/** @param {Page} page */
function zoomButtons(page) {
  const bar = byId("zoom");
  const out = el("output", { "aria-label": "Zoom" });
  const zoom = (/** @type {number} */ f) => zoomBy(page, f);
  /** @type {Array<[string, string, () => void]>} */
  const all = [
    ["Zoom in (+)", "M10 4v12M4 10h12", () => zoom(1.4)],
    ["Zoom out (\u2212)", "M4 10h12", () => zoom(1 / 1.4)],
    ["Whole map (0)", "M4 8V4h4M12 4h4v4M16 12v4h-4M8 16H4v-4", () => fit(page)],
  ];
  for (const [label, path, act] of all) {
    bar.append(el("button", { type: "button", class: "btn quiet icon", title: label, "aria-label": label, onclick: act }, icon(path)));
  }
  bar.append(out);
  const show = () => {
    const { scale } = page.map.view;
    out.textContent = scale >= 10 ? `${Math.round(scale)}\u00d7` : `${Number(scale.toPrecision(2))}\u00d7`;
  };
  page.on("map", show);
  page.on("ground", show);
}

/** @param {Page} page */
export function fit(page) {
  page.map.fit();
  page.tell("map");
}

/** Zoom about a pixel, else about the middle. @param {Page} page @param {number} factor @param {number} [px] @param {number} [py] */
export function zoomBy(page, factor, px, py) {
  const { view } = page.map;
  view.zoom(factor, px ?? view.width / 2, py ?? view.height / 2);
  moveBy(page, 0, 0);
}

/** @param {Page} page @param {number} dx @param {number} dy */
export function moveBy(page, dx, dy) {
  const { map, ground } = page;
  if (!ground) return;
  map.fitted = false;
  map.view.pan(dx, dy, ground.width, ground.height);
  map.refresh();
  page.tell("map");
}

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

/** What the pointer does from down to up. @typedef {{move: (event: PointerEvent) => void, up: (event: PointerEvent) => void, drop?: () => void}} Deed */

class Editor {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.size = 1;
    /** Waypoints of the patrol that is being drawn. @type {Cell[]} */
    this.draft = [];
    this.onChange = () => {};
    /** @type {Map<number, PointerEvent>} */
    this._pointers = new Map();
    /** @type {Deed | null} */
    this._deed = null;
    /** The space key, which keys.js looks after: while it is held, dragging pans. */
    this.space = { held: false, panned: false };
    const { canvas } = page.map;
    canvas.addEventListener("pointerdown", (event) => this._down(event));
    canvas.addEventListener("pointermove", (event) => this._move(event));
    canvas.addEventListener("pointerup", (event) => this._up(event));
    canvas.addEventListener("pointercancel", (event) => this._up(event));
    canvas.addEventListener("pointerleave", () => this.hideBrush());
    canvas.addEventListener("dblclick", () => this.endPatrol());
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this._wheel(event), { passive: false });
    canvas.addEventListener("focus", () => {
      // Whoever comes by keyboard sees at once where the cursor is.
      if (canvas.matches(":focus-visible") && !this._pressed) this._moveCursor([0, 0]);
    });
    canvas.addEventListener("blur", () => {
      page.map.cursor = null;
      page.map.draw();
    });
  }

  // ---- pointers --------------------

  /** @param {PointerEvent} event */
  _down(event) {
    const { page } = this;
    if (!page.ground) return;
    this._pressed = true;
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

  /** @param {Cell} cell */
  _inside([x, y]) {
    const { ground } = this.page;
    return ground !== null && x >= 0 && y >= 0 && x < ground.width && y < ground.height;
  }

  /** @param {Cell} cell */
  _free([x, y]) {
    const { ground } = this.page;
    return ground !== null && this._inside([x, y]) && ground.cells[y * ground.width + x] === 0;
  }

  /** @param {PointerEvent} event @returns {Deed} */
  _begin(event) {
    const { tool } = this.page;
    if (event.button === 1 || tool === "pan" || this.space.held) return this._pan(event);
    const end = this._endAt(event);
    if (end && (tool === "ends" || tool === "patrol") && event.button === 0) return this._drag(end);
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
      up: (now) => (slipped ? pan.up(now) : this.click(this._cell(now))),
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

  // ---- ends --------------------

  /** Which end is under the pointer. @param {PointerEvent} event @returns {"start" | "goal" | null} */
  _endAt(event) {
    const { map } = this.page;
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
      move: (event) => this.setEnd(end, this._cell(event), `drag ${end}`),
      up: over,
      drop: () => {
        if (store.scenario[end] !== before) store.undo();
        over();
      },
    };
  }

  /** Put an end on a cell, if it is free. @param {"start" | "goal"} end @param {Cell} cell @param {string} [mark] @returns {boolean} */
  setEnd(end, cell, mark) {
    const { scenario } = this.page.store;
    const now = scenario[end];
    if (!this._free(cell)) return false;
    if (now && now[0] === cell[0] && now[1] === cell[1]) return true;
    this.page.store.set({ [end]: cell }, mark);
    return true;
  }

  /** The end that the next click sets: start and goal in turn. */
  get next() {
    const { start, goal } = this.page.store.scenario;
    if (!start) return "start";
    if (!goal) return "goal";
    return this._turn ?? "start";
  }

  /** What the tool does with one cell. @param {Cell} cell */
  click(cell) {
    const { page } = this;
    if (!this._inside(cell)) return;
    if (page.tool === "patrol") {
      this._waypoint(cell);
      return;
    }
    if (page.tool === "wall" || page.tool === "free") {
      const stroke = new Stroke(page, page.tool === "wall" ? 1 : 0, brush(this.size));
      stroke.to(cell);
      stroke.end();
      return;
    }
    const end = this.next;
    if (!this.setEnd(end, cell)) {
      page.say(`That cell is a wall: the ${end} needs a free one.`);
      return;
    }
    /** @type {"start" | "goal"} */
    this._turn = end === "start" ? "goal" : "start";
    page.store.settle();
    this.onChange();
    byId("live").textContent = `${end} at column ${cell[0]}, row ${cell[1]}`;
  }

  // ---- walls --------------------

  /** @param {PointerEvent} event @param {number} value @returns {Deed} */
  _stroke(event, value) {
    const stroke = new Stroke(this.page, value, brush(this.size));
    stroke.to(this._cell(event));
    return { move: (now) => stroke.to(this._cell(now)), up: () => stroke.end(), drop: () => stroke.drop() };
  }

  /** @param {number} size */
  resize(size) {
    this.size = Math.min(Math.max(size, 1), 9);
    if (this.page.map.brush) this.page.map.brush.size = this.size;
    this.page.map.draw();
    this.onChange();
  }

  /** @param {PointerEvent} event */
  _hover(event) {
    const { page } = this;
    const { map } = page;
    if (page.tool === "wall" || page.tool === "free") {
      map.brush = { at: this._cell(event), size: this.size };
      map.draw();
    } else if (this._pointers.size === 0) {
      const over = page.tool === "pan" || this.space.held ? "grab" : this._endAt(event) ? "grab" : "";
      map.canvas.classList.toggle("grab", over !== "");
    }
  }

  hideBrush() {
    if (!this.page.map.brush) return;
    this.page.map.brush = null;
    this.page.map.draw();
  }

  // ---- patrols --------------------

  /** @param {Cell} cell */
  _waypoint(cell) {
    if (!this._free(cell)) {
      this.page.say("A patrol needs free cells.");
      return;
    }
    const last = this.draft[this.draft.length - 1];
    if (last && last[0] === cell[0] && last[1] === cell[1]) return;
    this.draft = [...this.draft, cell];
    this.showPatrols();
    this.onChange();
    byId("live").textContent = `waypoint ${this.draft.length} at column ${cell[0]}, row ${cell[1]}`;
  }

  endPatrol() {
    if (!this.draft.length) return;
    const { store } = this.page;
    const waypoints = this.draft;
    this.draft = [];
    store.set({ obstacles: [...store.scenario.obstacles, { kind: "patrol", waypoints }] });
    this.page.say(`Patrol of ${waypoints.length} ${waypoints.length === 1 ? "cell" : "cells"} placed.`, "good");
  }

  dropPatrol() {
    if (!this.draft.length) return;
    this.draft = [];
    this.showPatrols();
    this.onChange();
  }

  showPatrols() {
    const { map, store } = this.page;
    /** @type {import("./map.js").Patrol[]} */
    const patrols = [];
    for (const one of store.scenario.obstacles) {
      if (one.kind === "patrol") patrols.push({ cells: one.waypoints, draft: false });
    }
    if (this.draft.length) patrols.push({ cells: this.draft, draft: true });
    if (!patrols.length && !map.patrols.length) return;
    map.patrols = patrols;
    map.refresh();
  }

  // ---- words and keys --------------------

  tip() {
    const { page } = this;
    const { start, goal } = page.store.scenario;
    if (!page.ground) return "";
    if (page.tool === "patrol" && this.draft.length) return `${this.draft.length} ${this.draft.length === 1 ? "cell" : "cells"}: click the next, Enter or a double click ends.`;
    if (page.tool === "ends") return start && goal ? `A click sets the ${this.next}. Drag S or G.` : `Click the ${this.next}.`;
    return TOOLS.find((tool) => tool.name === page.tool)?.tip ?? "";
  }

  /** Keys while the map has the focus; true: it was one of ours. @param {KeyboardEvent} event */
  key(event) {
    const { page } = this;
    const { map, ground } = page;
    if (!ground) return;
    const step = event.shiftKey ? 10 : 1;
    /** @type {Record<string, Cell>} */
    const arrows = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    const by = arrows[event.key];
    if (by) this._moveCursor(by);
    else if (event.key === "Enter" && page.tool === "patrol" && map.cursor && this._isLast(map.cursor)) this.endPatrol();
    else if (event.key === "Enter" && map.cursor) this.click(map.cursor);
    else if (event.key === "Enter" && this.draft.length) this.endPatrol();
    else if (event.key === "Enter") this._moveCursor([0, 0]);
    else if (event.key === "Escape" && this.draft.length) this.dropPatrol();
    else if (event.key === "Escape" && page.tool !== "ends") page.use("ends");
    else if ((event.key === "s" || event.key === "g") && map.cursor) this._endHere(event.key === "s" ? "start" : "goal", map.cursor);
    else if ((event.key === "w" || event.key === "x") && map.cursor) this._paintHere(event.key === "w" ? 1 : 0, map.cursor);
    else return;
    event.preventDefault();
  }

  /** @param {Cell} cell */
  _isLast(cell) {
    const last = this.draft[this.draft.length - 1];
    return Boolean(last) && last[0] === cell[0] && last[1] === cell[1];
  }

  /** @param {Cell} by */
  _moveCursor(by) {
    const { page } = this;
    const { map, ground } = page;
    if (!ground) return;
    const from = map.cursor ?? page.store.scenario.start ?? /** @type {Cell} */ ([Math.floor(ground.width / 2), Math.floor(ground.height / 2)]);
    const x = Math.min(Math.max(from[0] + by[0], 0), ground.width - 1);
    const y = Math.min(Math.max(from[1] + by[1], 0), ground.height - 1);
    map.cursor = [x, y];
    const [px, py] = map.view.pixel(x, y);
    const edge = Math.max(30, map.view.scale);
    const dx = px < edge ? edge - px : px > map.view.width - edge ? map.view.width - edge - px : 0;
    const dy = py < edge ? edge - py : py > map.view.height - edge ? map.view.height - edge - py : 0;
    if (dx || dy) moveBy(page, dx, dy);
    map.draw();
    const what = ["free", "wall", "unknown"][ground.cells[y * ground.width + x]];
    const { start, goal } = page.store.scenario;
    const end = start?.[0] === x && start[1] === y ? ", start" : goal?.[0] === x && goal[1] === y ? ", goal" : "";
    byId("live").textContent = `column ${x}, row ${y}, ${what}${end}`;
    page.tell("cursor", map.cursor);
  }

  /** @param {"start" | "goal"} end @param {Cell} cell */
  _endHere(end, cell) {
    if (!this.setEnd(end, cell)) this.page.say(`That cell is a wall: the ${end} needs a free one.`);
    else byId("live").textContent = `${end} at column ${cell[0]}, row ${cell[1]}`;
    this.page.store.settle();
  }

  /** @param {number} value @param {Cell} cell */
  _paintHere(value, cell) {
    const stroke = new Stroke(this.page, value, brush(this.size));
    stroke.to(cell);
    stroke.end();
  }

  /** A pointer is pressing: the focus comes from it. */
  _pressed = false;
  /** @type {"start" | "goal" | undefined} */
  _turn = undefined;
}

let strokes = 0;

/** A stroke of the brush, from down to up. */
class Stroke {
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
    this._mark = `stroke ${++strokes}`;
    this._asked = false;
    const { run, play } = page;
    const over = run !== null && run.done && play.tick >= run.ticks - 1;
    // What has been driven stays as it is: the wall comes at the next tick. Behind the end nothing would change.
    this._tick = run && (play.tick > 0 || play.playing) && !over ? Math.floor(play.tick) + 1 : 0;
    if (over) play.seek(0);
    play.hold(true);
    this._before = new Uint8Array(page.base?.length ?? 0);
    const earlier = this._edits.filter((edit) => edit.tick < this._tick);
    if (page.base && page.ground) applyEdits(page.base, earlier, this._tick, page.ground.width, this._before);
  }

  /** @param {Cell} cell */
  to(cell) {
    const { ground, map, store } = this._page;
    if (!ground || this._over) return;
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
    if (!ground || this._over || !this._painted.size) return;
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
    if (this._page.store.scenario.edits !== this._edits) this._page.store.undo();
    else if (this._painted.size) this._page.tell("repaint");
  }

  _over = false;
}
