// Ruler: a distance on the map in metres, from where the pointer was pressed to where it is; by keyboard from the cursor.

import { el, svg } from "./make.js";
import { byId } from "./page.js";

/** @type {Ruler | null} */
let only = null;

/** Take up the ruler, or put it away. @param {Page} page */
export function askRuler(page) {
  only ??= new Ruler(page);
  only.turn();
}

class Ruler {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** Both ends in cells; (0, 0) is the middle of the first cell. @type {[number, number] | null} */
    this.from = null;
    /** @type {[number, number] | null} */
    this.to = null;
    this.casing = svg("path", { fill: "none", stroke: "#fff", "stroke-width": 5, "stroke-linecap": "round" });
    this.line = svg("path", { fill: "none", stroke: "#20242c", "stroke-width": 2, "stroke-linecap": "round" });
    this.said = el("output", { class: "chip", id: "ruler-said", "aria-live": "polite" });
    this.root = /** @type {SVGSVGElement} */ (svg("svg", { id: "ruler", "aria-hidden": "true" }, this.casing, this.line));
    Object.assign(this.root.style, { position: "absolute", inset: "0", width: "100%", height: "100%", cursor: "crosshair", touchAction: "none" });
    Object.assign(this.said.style, { position: "absolute", left: "50%", top: "10px", transform: "translateX(-50%)", pointerEvents: "none" });
    this.root.toggleAttribute("hidden", true);
    this.said.hidden = true;
    // Below the toolbars, so that the map can be zoomed meanwhile.
    byId("map").after(this.root, this.said);
    this.root.addEventListener("pointerdown", (event) => {
      this.root.setPointerCapture(event.pointerId);
      this.from = this.to = this._at(event);
      this._draw();
    });
    this.root.addEventListener("pointermove", (event) => {
      if (!event.buttons) return;
      this.to = this._at(event);
      this._draw();
    });
    page.on("map", () => this._draw());
    page.on("ground", () => this._draw());
    addEventListener("keydown", (event) => {
      if (!this.on) return;
      if (event.key === "Escape") this.turn();
      // The map moves its cursor first.
      else setTimeout(() => this._follow());
    });
  }

  get on() {
    return !this.root.hasAttribute("hidden");
  }

  turn() {
    const on = !this.on;
    this.root.toggleAttribute("hidden", !on);
    this.said.hidden = !on;
    this.from = this.to = on && this.page.map.cursor ? [...this.page.map.cursor] : null;
    this._draw();
  }

  _follow() {
    const { cursor } = this.page.map;
    if (!this.on || !cursor || !this.from) return;
    this.to = [...cursor];
    this._draw();
  }

  /** @param {PointerEvent} event @returns {[number, number]} */
  _at(event) {
    const { canvas, view } = this.page.map;
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left - view.x) / view.scale - 0.5, (event.clientY - box.top - view.y) / view.scale - 0.5];
  }

  _draw() {
    if (!this.on) return;
    const { map, ground } = this.page;
    const { from, to } = this;
    if (!from || !to || !ground) {
      for (const line of [this.casing, this.line]) line.setAttribute("d", "");
      this.said.textContent = "Drag from one place to another; Esc puts the ruler away.";
      return;
    }
    const [[ax, ay], [bx, by]] = [map.view.pixel(...from), map.view.pixel(...to)];
    for (const line of [this.casing, this.line]) line.setAttribute("d", `M${ax} ${ay}L${bx} ${by}M${ax - 4} ${ay}h8M${ax} ${ay - 4}v8M${bx - 4} ${by}h8M${bx} ${by - 4}v8`);
    const [dx, dy] = [to[0] - from[0], from[1] - to[1]];
    const turn = (180 / Math.PI) * (Math.atan2(dy, dx) + ground.origin[2]);
    const cells = Math.hypot(dx, dy);
    this.said.textContent = `${(cells * ground.resolution).toFixed(2)} m, heading ${(((Math.round(turn) % 360) + 360) % 360)}\u00b0 (${cells.toFixed(1)} cells)`;
  }
}
