// Edit: the tools beside the map, and what each does with a cell; patrols, drawn cell by cell; the map by keyboard, where
// arrows move a cell and other keys do to it what a hand would. Hands are in hand.js.

import { brush, Hand, Stroke } from "./hand.js";
import { TOUCH, el, iconButton, tapped } from "./make.js";
import { byId } from "./page.js";
import { fit, moveBy, zoomButtons } from "./view.js";

export const TOOLS = [
  { name: "start", key: "v", label: "Set the start", tip: "", path: "M5 5h10v10H5zM8.500 8.500h3v3h-3z" },
  { name: "goal", key: "n", label: "Set the goal", tip: "", path: "M6 18V3l9 3.500L6 10" },
  { name: "wall", key: "b", label: "Paint walls", tip: "Paint walls; the right button erases.", touch: "Paint walls.", path: "M4 16c3 0 4-1 4-3l7-8 2 2-8 7c-2 0-2 1-5 2zM8 13l1.500 1.500" },
  { name: "free", key: "e", label: "Erase walls", tip: "Erase walls.", path: "M4 12l7-7 5 5-6 6H7zM8 8l5 5M10 16h7" },
  { name: "patrol", key: "p", label: "Draw a patrol", tip: "Click the patrol's cells one by one; Enter or a double click ends, Esc drops it.", touch: "Tap the patrol's cells one by one; Done ends.", path: "M4 15l4-8 4 6 4-9M3 15h2v2H3zM7 5h2v2H7zM11 13h2v2h-2zM15 3h2v2h-2z" },
  { name: "pan", key: "h", label: "Move the map", tip: "Drag the map. Wheel or pinch zooms.", touch: "Drag the map. Pinch to zoom.", path: "M10 3v14M3 10h14M10 3L8 5M10 3l2 2M10 17l-2-2M10 17l2-2M3 10l2-2M3 10l2 2M17 10l-2-2M17 10l-2 2" },
];
/** Cells of the largest brush, on maps of up to eight times as many a side; of larger maps an eighth. */
const LARGEST = 9;
/** Degrees of a step of a heading. */
const TURN = 5;
const NARROW = window.matchMedia("(max-width: 820px)");

/** @param {Page} page @param {HTMLElement} bar */
export function mount(page, bar) {
  const editor = new Editor(page);
  /** @type {Map<string, HTMLButtonElement>} */
  const buttons = new Map();
  for (const tool of TOOLS) {
    const button = iconButton(`${tool.label} (${tool.key.toUpperCase()})`, tool.path, () => page.use(tool.name), { "aria-pressed": "false" });
    buttons.set(tool.name, button);
    bar.append(button);
  }
  const number = el("output", { "aria-hidden": "true" }, "1");
  const slider = el("input", { type: "range", min: 1, max: LARGEST, step: 1, value: 1, "aria-label": "Brush size in cells" });
  const size = el("label", { class: "size", hidden: true, title: "Brush size, [ and ]" }, slider, number);
  slider.addEventListener("input", () => editor.resize(Number(slider.value)));
  const done = el("button", { type: "button", class: "btn primary done", hidden: true, onclick: () => editor.patrols.end() }, "Place this patrol");
  bar.append(size);
  byId("stage").append(done);

  const press = () => {
    for (const [one, button] of buttons) button.setAttribute("aria-pressed", String(one === (placesEnds(page.tool) && !page.fleet ? editor.next : page.tool)));
  };
  const tip = byId("tip");
  editor.onChange = () => {
    slider.value = String(editor.size);
    number.textContent = `${editor.size}`;
    done.hidden = editor.patrols.draft.length === 0;
    press();
    const trouble = lost || !page.plan || page.fleet ? lost : page.plan.cells.length === 0 && !editor.patrols.draft.length ? page.plan.sentence : "";
    tip.textContent = trouble || editor.tip();
    tip.classList.toggle("trouble", trouble !== "");
  };
  page.use = (name) => {
    if (page.fleet && name === "patrol") return;
    if (name !== "patrol") editor.patrols.drop();
    page.tool = name;
    press();
    size.hidden = name !== "wall" && name !== "free";
    page.map.canvas.dataset.tool = name;
    editor.hand.hideBrush();
    editor.onChange();
    page.tell("tool", name);
  };
  page.on("edit-key", (event) => editor.cursor.key(event));
  page.on("space", (space) => {
    editor.hand.space = space;
    page.map.canvas.classList.toggle("grab", space.held);
  });
  page.on("brush", (by) => editor.resize(editor.size + by * Math.max(1, editor.size >> 3)));
  /** Why there is no map. */
  let lost = "";
  page.on("ground", (why) => {
    lost = why ?? "";
    slider.max = String(editor.largest);
    editor.resize(editor.size);
  });
  page.on("fleet", () => editor.onChange());
  page.on("plan", () => {
    editor.patrols.show();
    editor.onChange();
  });
  page.store.listen(() => {
    editor.patrols.show();
    editor.onChange();
  });
  zoomButtons(page);
  const room = () => {
    page.map.edge = NARROW.matches ? { top: 56, right: 14, bottom: 58, left: 14 } : { top: 16, right: 70, bottom: 16, left: 70 };
    bar.setAttribute("aria-orientation", NARROW.matches ? "horizontal" : "vertical");
    slider.classList.toggle("upright", !NARROW.matches);
  };
  NARROW.addEventListener("change", () => {
    room();
    fit(page);
  });
  room();
  page.use("goal");
}

/** Whether a tool sets start or goal. @param {string} tool */
function placesEnds(tool) {
  return tool === "start" || tool === "goal";
}

export class Editor {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** Of the brush, in cells. */
    this.size = 1;
    this.onChange = () => {};
    this.patrols = new Patrols(page, () => this.onChange());
    this.cursor = new Cursor(this);
    this.hand = new Hand(this);
  }

  /** @param {Cell} cell */
  inside([x, y]) {
    const { ground } = this.page;
    return ground !== null && x >= 0 && y >= 0 && x < ground.width && y < ground.height;
  }

  /** @param {Cell} cell */
  free([x, y]) {
    const { ground } = this.page;
    return ground !== null && this.inside([x, y]) && ground.cells[y * ground.width + x] === 0;
  }

  /** Put an end on a cell, if it is free. @param {"start" | "goal"} end @param {Cell} cell @param {string} [mark] @returns {boolean} */
  setEnd(end, cell, mark) {
    const { scenario } = this.page.store;
    const now = scenario[end];
    if (!this.free(cell)) return false;
    if (now && now[0] === cell[0] && now[1] === cell[1]) return true;
    this.page.store.set({ [end]: cell }, mark);
    return true;
  }

  /** Set the heading of an end, rounded to whole steps. @param {"start" | "goal"} end @param {number} heading radians counterclockwise on the screen @param {string} [mark] */
  setHeading(end, heading, mark) {
    const { ground, store } = this.page;
    const degrees = TURN * Math.round((heading * 180) / Math.PI / TURN);
    const yaw = Math.round(1e6 * ((degrees * Math.PI) / 180 + (ground?.origin[2] ?? 0))) / 1e6;
    if (store.scenario[`${end}_yaw`] !== yaw) store.set({ [`${end}_yaw`]: yaw }, mark);
    byId("live").textContent = `heading of the ${end}: ${((degrees % 360) + 360) % 360} degrees`;
  }

  /** The end that the next click sets: the one that is missing, else the tool's. @returns {"start" | "goal"} */
  get next() {
    const { start, goal } = this.page.store.scenario;
    if (!start) return "start";
    if (!goal) return "goal";
    return this.page.tool === "start" ? "start" : "goal";
  }

  /** What the tool does with one cell. @param {Cell} cell */
  click(cell) {
    const { page } = this;
    if (!this.inside(cell)) return;
    if (page.fleet && placesEnds(page.tool)) {
      page.fleet.choose(cell);
      return;
    }
    if (page.tool === "patrol") {
      if (this.free(cell)) this.patrols.add(cell);
      else page.say("A patrol needs free cells.");
      return;
    }
    if (page.tool === "wall" || page.tool === "free") {
      this.paint(page.tool === "wall" ? 1 : 0, cell);
      return;
    }
    const end = this.next;
    if (!this.putEnd(end, cell)) return;
    page.store.settle();
    this.onChange();
  }

  /** Put an end on a cell and say so; false: it is a wall. @param {"start" | "goal"} end @param {Cell} cell */
  putEnd(end, cell) {
    if (this.page.fleet) return false;
    const put = this.setEnd(end, cell);
    if (put) byId("live").textContent = `${end} at column ${cell[0]}, row ${cell[1]}`;
    else this.page.say(`That cell is a wall: the ${end} needs a free one.`);
    return put;
  }

  /** A stroke of the brush as it is now. @param {number} value 1: wall, 0: free */
  stroke(value) {
    const { page } = this;
    return page.fleet ? page.fleet.stroke(value, brush(this.size)) : new Stroke(page, value, brush(this.size));
  }

  /** A stroke of one cell, or from another to it. @param {number} value @param {Cell} cell @param {Cell} [from] */
  paint(value, cell, from = cell) {
    const stroke = this.stroke(value);
    stroke.to(from);
    stroke.to(cell);
    stroke.end();
  }

  get largest() {
    const { ground } = this.page;
    return Math.max(LARGEST, ground ? Math.min(ground.width, ground.height) >> 3 : 0);
  }

  /** @param {number} size */
  resize(size) {
    this.size = Math.min(Math.max(size, 1), this.largest);
    if (this.page.map.brush) this.page.map.brush.size = this.size;
    this.page.map.draw();
    this.onChange();
  }

  tip() {
    const { page } = this;
    const { start, goal } = page.store.scenario;
    if (!page.ground) return "";
    if (page.fleet) return page.fleet.tip();
    if (page.tool === "patrol" && this.patrols.draft.length) return `${this.patrols.draft.length} ${this.patrols.draft.length === 1 ? "cell" : "cells"}: ${TOUCH.matches ? "tap the next; Done ends." : "click the next, Enter or a double click ends."}`;
    if (placesEnds(page.tool)) return tapped(start && goal ? `A click sets the ${this.next}. Drag S or G${page.map.shape?.ends.length ? ", and the round handles to turn them" : ""}.` : `Click the ${this.next}.`);
    const tool = TOOLS.find(({ name }) => name === page.tool);
    return (TOUCH.matches && tool?.touch) || (tool?.tip ?? "");
  }
}

// ---- patrols ----

class Patrols {
  /** @param {Page} page @param {() => void} changed called when what is being drawn is another */
  constructor(page, changed) {
    this.page = page;
    this._changed = changed;
    /** Waypoints of the patrol that is being drawn. @type {Cell[]} */
    this.draft = [];
  }

  /** One more waypoint, on a free cell. @param {Cell} cell */
  add(cell) {
    if (this.isLast(cell)) return;
    this.draft = [...this.draft, cell];
    this.show();
    this._changed();
    byId("live").textContent = `waypoint ${this.draft.length} at column ${cell[0]}, row ${cell[1]}`;
  }

  /** @param {Cell} cell */
  isLast(cell) {
    const last = this.draft[this.draft.length - 1];
    return Boolean(last) && last[0] === cell[0] && last[1] === cell[1];
  }

  /** What was drawn becomes an obstacle. */
  end() {
    if (!this.draft.length) return;
    const { store } = this.page;
    const waypoints = this.draft;
    this.draft = [];
    store.set({ obstacles: [...store.scenario.obstacles, { kind: "patrol", waypoints }] });
    this.page.say(`Patrol of ${waypoints.length} ${waypoints.length === 1 ? "cell" : "cells"} placed.`, "good");
  }

  drop() {
    if (!this.draft.length) return;
    this.draft = [];
    this.show();
    this._changed();
  }

  /** The cells that a patrol takes, as the plan says; before it does, straight lines where no wall is. @param {Cell[]} waypoints @returns {Cell[][]} */
  _linesOf(waypoints) {
    const key = JSON.stringify(waypoints);
    const path = this.page.plan?.obstacle_specs?.find((body) => body.waypoints && JSON.stringify(body.waypoints) === key)?.path;
    return path ? [path] : this._clear(waypoints);
  }

  /** Straight lines between waypoints that lead through no wall. @param {Cell[]} waypoints @returns {Cell[][]} */
  _clear(waypoints) {
    const { ground } = this.page;
    /** @type {Cell[][]} */
    const lines = [];
    for (let k = 1; k < waypoints.length; k++) {
      const [[ax, ay], [bx, by]] = [waypoints[k - 1], waypoints[k]];
      const n = 4 * Math.max(Math.abs(bx - ax), Math.abs(by - ay), 1);
      let clear = ground !== null;
      for (let i = 0; clear && ground && i <= n; i++) {
        const x = Math.round(ax + ((bx - ax) * i) / n);
        const y = Math.round(ay + ((by - ay) * i) / n);
        clear = ground.cells[y * ground.width + x] === 0;
      }
      if (clear) lines.push([waypoints[k - 1], waypoints[k]]);
    }
    return lines;
  }

  show() {
    const { map, store } = this.page;
    /** @type {import("./map.js").Patrol[]} */
    const patrols = [];
    for (const one of store.scenario.obstacles) {
      if (one.kind === "patrol") patrols.push({ cells: one.waypoints, draft: false, lines: this._linesOf(one.waypoints) });
    }
    if (this.draft.length) patrols.push({ cells: this.draft, draft: true, lines: this._clear(this.draft) });
    if (!patrols.length && !map.patrols.length) return;
    map.patrols = patrols;
    map.refresh();
  }
}

// ---- the map by keyboard ----


class Cursor {
  /** @param {Editor} editor */
  constructor(editor) {
    this.editor = editor;
    /** Where it was when the map was left. @type {Cell | null} */
    this._left = null;
    /** Where a wall was painted or taken away last, for a line from there. @type {Cell | null} */
    this._painted = null;
    /** The map of both. @type {Ground | null} */
    this._ground = null;
  }

  /** Keys while the map has the focus. @param {KeyboardEvent} event */
  key(event) {
    const { page, patrols } = this.editor;
    const { map, ground } = page;
    if (!ground) return;
    const step = event.shiftKey ? 10 : 1;
    /** @type {Record<string, Cell>} */
    const arrows = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    const by = arrows[event.key];
    if (by) this.move(by);
    else if (event.key === "Enter" && page.tool === "patrol" && map.cursor && patrols.isLast(map.cursor)) patrols.end();
    else if (event.key === "Enter" && map.cursor) this.editor.click(map.cursor);
    else if (event.key === "Enter" && patrols.draft.length) patrols.end();
    else if (event.key === "Enter") this.move([0, 0]);
    else if (event.key === "Escape" && patrols.draft.length) patrols.drop();
    else if (event.key === "Escape" && !placesEnds(page.tool)) page.use("goal");
    else if ((event.key === "s" || event.key === "g") && map.cursor) this._end(event.key === "s" ? "start" : "goal", map.cursor);
    else if (/^q$/i.test(event.key) && map.cursor) this._turn(map.cursor, event.shiftKey ? -1 : 1);
    else if (/^[wx]$/i.test(event.key) && map.cursor) this._paint(event.key.toLowerCase() === "w" ? 1 : 0, map.cursor, event.shiftKey);
    else return;
    event.preventDefault();
  }

  /** Move it; by nothing: put it where it is seen. @param {Cell} by */
  move(by) {
    const { page } = this.editor;
    const { map, ground } = page;
    if (!ground) return;
    if (ground !== this._ground) this._left = this._painted = null;
    this._ground = ground;
    const from = map.cursor ?? this._left ?? page.store.scenario.start ?? /** @type {Cell} */ ([Math.floor(ground.width / 2), Math.floor(ground.height / 2)]);
    const x = Math.min(Math.max(from[0] + by[0], 0), ground.width - 1);
    const y = Math.min(Math.max(from[1] + by[1], 0), ground.height - 1);
    map.cursor = this._left = [x, y];
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
  }

  /** @param {"start" | "goal"} end @param {Cell} cell */
  _end(end, cell) {
    this.editor.putEnd(end, cell);
    this.editor.page.store.settle();
  }

  /** Turn the heading of the end at a cell. @param {Cell} cell @param {number} by 1: counterclockwise, -1: clockwise */
  _turn(cell, by) {
    const { editor } = this;
    if (editor.page.fleet) return;
    const end = editor.page.map.shape?.ends.find(({ at }) => at[0] === cell[0] && at[1] === cell[1]);
    if (!end) return;
    editor.setHeading(end.end, (end.heading ?? 0) + (by * Math.PI) / 12);
    editor.page.store.settle();
  }

  /** A wall here, or none; `line`: all the way from where the last one was. @param {number} value @param {Cell} cell @param {boolean} line */
  _paint(value, cell, line) {
    const { page } = this.editor;
    const from = (line && this._painted) || cell;
    this.editor.paint(value, cell, from);
    this._painted = cell;
    const now = page.ground?.cells[cell[1] * page.ground.width + cell[0]] === 1 ? "wall" : "no wall";
    const where = from === cell ? "at" : `from column ${from[0]}, row ${from[1]} to`;
    byId("live").textContent = `${now} ${where} column ${cell[0]}, row ${cell[1]}`;
  }
}
