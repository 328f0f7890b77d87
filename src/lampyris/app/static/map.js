// The map on its canvas: cells, layers, ways, obstacles and the robot.
//
// What changes seldom (cells, layer, ways) is put together once at the screen's size, the base; each frame copies
// it and draws what moves on top. Measured in a software-drawn browser, see docs: redrawing cells and layer in
// every frame instead takes several times as long.

import { GOAL, START, THEMES } from "./colours.js";
import { GroundPicture, LayerPicture, drawCells, penOf } from "./cells.js";
import { drawWay, goalMark, startMark, Trail } from "./marks.js";
import { Sprites, drawBrush, drawCursor, drawMoment } from "./moving.js";
import { drawGates, drawLines, drawMark, drawPatrol } from "./still.js";
import { drawShape } from "./shape.js";
import { View } from "./view.js";

/** @typedef {import("./marks.js").Way} Way */
/** @typedef {import("./still.js").Patrol} Patrol */
/** @typedef {import("./moving.js").Moment} Moment */

export class MapView {
  /** Shades what a robot with a sensor has not seen, once that is loaded. @type {typeof import("./unseen.js").shade | null} */
  static shade = null;

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
    this.view = new View();
    /** @type {Ground | null} */
    this.ground = null;
    this.dark = false;
    /** @type {Layer | null} */
    this.layer = null;
    /** @type {Way[]} */
    this.ways = [];
    /** @type {import("./still.js").Gate[]} */
    this.gates = [];
    /** @type {import("./still.js").Mark[]} */
    this.marks = [];
    /** @type {Cell | null} */
    this.start = null;
    /** @type {Cell | null} */
    this.goal = null;
    /** @type {Cell | null} */
    this.cursor = null;
    /** @type {Moment} */
    this.moment = { robot: null, bodies: null, kinds: [], radii: [], trail: null };
    this.robotRadius = 0;
    /** The robot's footprint, its poses and the headings of the ends; null: a disc, and a planner on cells. @type {import("./shape.js").Shape | null} */
    this.shape = null;
    /** A round of planning with adaptive dimensionality; as it draws itself; null: none is shown.
     * @type {((pen: CanvasRenderingContext2D, view: View, ground: Ground, dark: boolean) => void) | null} */
    this.round = null;
    /** Whether the whole map is shown; it stays so when the page's size changes. */
    this.fitted = true;
    /** What is shown in place of a single robot: a fleet or a swarm. @type {import("./fleet.js").Actors | null} */
    this.actors = null;
    /** Draws contour lines of the layer; null: none. @type {((pen: CanvasRenderingContext2D, view: View, layer: Layer, dark: boolean) => void) | null} */
    this.contours = null;
    /** A hand is on the map: it must not move below it, whatever else on the page grows or shrinks. */
    this.held = false;
    /** Pixels at each side that the map leaves free when it is fitted. */
    this.edge = { top: 16, right: 16, bottom: 16, left: 16 };
    /** @type {Patrol[]} */
    this.patrols = [];
    /** The brush under the pointer. @type {{at: Cell, size: number} | null} */
    this.brush = null;
    /** A second path beside that of the plan. @type {import("./marks.js").Way | null} */
    this.beside = null;
    /** Opacity of the layer; and what is laid over it, by name: how each is drawn. */
    this.opacity = 1;
    /** @type {Map<string, (pen: CanvasRenderingContext2D, view: View) => void>} */
    this.over = new Map();
    this._cells = new GroundPicture();
    this._heat = new LayerPicture();
    /** Whether the goal is drawn where it is now, and not in the base. */
    this._chased = false;
    this._base = document.createElement("canvas");
    this._trail = new Trail();
    this._sprites = new Sprites();
    this._stale = true;
    this._asked = false;
    this._ratio = 1;
    /** Called after each frame with its milliseconds. @type {((ms: number) => void) | null} */
    this.onFrame = null;
    /** Called when the map is shown at another scale or place because its room has changed. @type {(() => void) | null} */
    this.onView = null;
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  /** Pixels of the screen to a pixel of the page. */
  get ratio() {
    return this._ratio;
  }

  /** Take the canvas's size on the page. */
  resize() {
    const box = this.canvas.getBoundingClientRect();
    this._ratio = this._sprites.ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(box.width * this._ratio));
    const height = Math.max(1, Math.round(box.height * this._ratio));
    if (width === this.canvas.width && height === this.canvas.height) return;
    for (const one of [this.canvas, this._base]) {
      one.width = width;
      one.height = height;
    }
    const whole = this.fitted || this.view.width <= 1;
    if (this.held) {
      this.view.width = box.width;
      this.view.height = box.height;
    } else {
      this.view.resize(box.width, box.height);
      if (whole) this.fit();
    }
    this.onView?.();
    this.refresh();
  }

  fit() {
    this.fitted = true;
    const { view } = this;
    // Where it is high and narrow there is room for the tools above and below the map.
    const edge = view.height > 1.5 * view.width && view.height > 600 ? { top: 210, right: 14, bottom: 170, left: 14 } : this.edge;
    if (this.ground) view.fit(this.ground.width, this.ground.height, edge);
    this.refresh();
  }

  /** A place in cells in the middle, at a scale. @param {number} cx @param {number} cy @param {number} scale */
  look(cx, cy, scale) {
    const { view } = this;
    this.fitted = false;
    view.zoom(scale / view.scale, 0, 0);
    view.x = view.width / 2 - cx * view.scale;
    view.y = view.height / 2 - cy * view.scale;
    this.refresh();
    this.onView?.();
  }

  /** Show another map, or the same one in other colours. @param {Ground} ground */
  setGround(ground) {
    const other = !this.ground || this.ground.width !== ground.width || this.ground.height !== ground.height;
    this.ground = ground;
    this._cells.put(ground, this.dark);
    if (other) this.fit();
    this.refresh();
  }

  /** @param {boolean} dark */
  setDark(dark) {
    this.dark = this._sprites.dark = dark;
    this._sprites.clear();
    if (this.ground) this._cells.put(this.ground, dark);
    this.setLayer(this.layer);
  }

  /** Cells that have just changed, on the screen's canvas at once: the next frame brings all of it. @param {Iterable<Cell>} cells */
  repaint(cells) {
    const { ground, pen, view } = this;
    if (!ground) return;
    const s = view.scale;
    this._cells.change(ground, cells, this.dark, (x, y, tone) => {
      if (this.layer) this._heat.clear(x, y);
      pen.fillStyle = tone;
      pen.fillRect(view.x + x * s, view.y + y * s, s, s);
    });
    this.refresh();
  }

  /** The layer beneath the ways; null: none. @param {Layer | null} layer */
  setLayer(layer) {
    this.layer = layer;
    if (layer) this._heat.put(layer, this.dark);
    this.refresh();
  }

  /** Draw the base anew in the next frame. */
  refresh() {
    this._stale = true;
    this.draw();
  }

  /** Draw once, in the next frame. */
  draw() {
    if (this._asked) return;
    this._asked = true;
    requestAnimationFrame(() => {
      this._asked = false;
      this.drawNow();
    });
  }

  drawNow() {
    const began = performance.now();
    const { pen, view } = this;
    const trail = this.actors ? null : this.moment.trail;
    const on = { dark: this.dark, layered: this.layer !== null };
    const chased = !this.actors && Boolean(this.moment.goal);
    if (this._stale || chased !== this._chased || !this._trail.holds(trail)) {
      this._chased = chased;
      this._drawBase();
    }
    if (trail) this._trail.settle(penOf(this._base), view, trail, on);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(this._base, 0, 0);
    pen.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    if (this.moment.seen && !this.actors) MapView.shade?.(pen, this, this.moment.seen);
    if (trail) this._trail.draw(pen, view, trail, on);
    if (this.actors) this.actors.draw(pen, view);
    else {
      if (this.moment.goal) this._drawGoal(pen, this.moment.goal);
      drawMoment(pen, view, this.moment, this.robotRadius, this._sprites, this.shape?.outline ?? null, this.shape?.around);
    }
    if (this.brush) drawBrush(pen, view, this.brush);
    if (this.cursor) drawCursor(pen, view, this.cursor);
    if (this.onFrame) this.onFrame(performance.now() - began);
  }

  /** @param {CanvasRenderingContext2D} pen @param {Cell} goal */
  _drawGoal(pen, goal) {
    goalMark(pen, ...this.view.pixel(goal[0], goal[1]), Math.max(7, this.view.scale * 0.45), GOAL);
  }

  /** What changes seldom. */
  _drawBase() {
    this._stale = false;
    this._trail.forget();
    const pen = penOf(this._base);
    const theme = THEMES[this.dark ? "dark" : "light"];
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = theme.paper;
    pen.fillRect(0, 0, this._base.width, this._base.height);
    const { ground, view } = this;
    pen.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    if (!ground) return;
    // Cells are squares; only where several share a pixel are they mixed.
    pen.imageSmoothingEnabled = view.scale * this._ratio < 1;
    drawCells(pen, view, this._cells.canvas);
    pen.globalAlpha = this.opacity;
    if (this.layer && !this.actors) drawCells(pen, view, this._heat.canvas);
    pen.globalAlpha = 1;
    if (!this.actors) for (const draw of this.over.values()) draw(pen, view);
    if (this.contours && this.layer && !this.actors) this.contours(pen, view, this.layer, this.dark);
    if (view.scale >= 14) drawLines(pen, view, ground, theme.line);
    pen.strokeStyle = theme.ink;
    pen.lineWidth = 1;
    pen.strokeRect(view.x - 0.5, view.y - 0.5, ground.width * view.scale + 1, ground.height * view.scale + 1);
    if (this.actors) {
      this.actors.base(pen, view);
      return;
    }
    this.round?.(pen, view, ground, this.dark);
    if (this.gates.length) drawGates(pen, view, this.gates);
    for (const way of this.ways) drawWay(pen, view, way, { dark: this.dark, layered: this.layer !== null });
    if (this.beside) drawWay(pen, view, this.beside, { dark: this.dark, layered: this.layer !== null });
    if (this.shape) drawShape(pen, view, this.shape, this.dark);
    for (const mark of this.marks) drawMark(pen, view, mark, this.dark);
    for (const patrol of this.patrols) drawPatrol(pen, view, patrol);
    const r = Math.max(7, view.scale * 0.45);
    if (this.start) startMark(pen, ...view.pixel(this.start[0], this.start[1]), r, START);
    if (this.goal && !this._chased) this._drawGoal(pen, this.goal);
  }
}
