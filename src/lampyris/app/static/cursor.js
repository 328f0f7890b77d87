// Cursor: the map by keyboard. Arrows move a cell, other keys do to it what a hand would.

import { byId } from "./page.js";
import { moveBy } from "./view.js";

/** @typedef {import("./edit.js").Editor} Editor */

export class Cursor {
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
    else if (event.key === "Escape" && page.tool !== "ends") page.use("ends");
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
