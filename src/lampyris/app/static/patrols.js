// Patrols: drawn cell by cell with the patrol tool, and shown on the map.

import { byId } from "./page.js";

export class Patrols {
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
