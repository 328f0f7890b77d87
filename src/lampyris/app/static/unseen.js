// Unseen: of a robot that does not know its map, the cells that it has not seen, and what its sensor sees of the map: a
// circle, or the sector ahead of it. Loaded with the first run of such a robot.

import { drawCells, penOf } from "./cells.js";
import { THEMES } from "./colours.js";
import { MapView } from "./map.js";

/** @typedef {import("./cells.js").Seen} Seen */

/** How much of the ground the shade of unseen cells covers. */
const SHADE = 150;
/** Steps that are shorter than this are none, cells. */
const STILL = 1e-6;

/** The pictures of maps: each that shows such a run has its own. @type {WeakMap<MapView, UnseenPicture>} */
const pictures = new WeakMap();

/** From now on it is shown. @param {Page} page */
export function askUnseen(page) {
  MapView.shade = shade;
  page.map.draw();
}

/** @param {CanvasRenderingContext2D} pen @param {MapView} map @param {Seen} seen */
export function shade(pen, map, { run, t }) {
  const { ground, view, moment } = map;
  if (!ground || run.seen?.length !== ground.width * ground.height) return;
  const picture = pictures.get(map) ?? new UnseenPicture();
  pictures.set(map, picture);
  picture.put(run.seen, Math.floor(t + 1e-6), ground.width, ground.height, map.dark);
  pen.imageSmoothingEnabled = view.scale * map.ratio < 1;
  drawCells(pen, view, picture.canvas);
  const robot = moment.robot ?? moment.others?.[0]?.robot;
  const ahead = run.angle < 2 * Math.PI - 1e-9 ? travelled(run, t) : null;
  // Farther than the map is large a circle is outside it, and of a sector its two sides are on it.
  const most = ground.width + ground.height;
  if (!robot || (ahead === null && run.reach > most)) return;
  const [x, y] = view.pixel(robot[0], robot[1]);
  const r = Math.min(run.reach, most) * view.scale;
  pen.save();
  pen.beginPath();
  pen.rect(...view.pixel(-0.5, -0.5), ground.width * view.scale, ground.height * view.scale);
  pen.clip();
  pen.strokeStyle = THEMES[map.dark ? "dark" : "light"].ink;
  pen.lineWidth = 1;
  pen.setLineDash([3, 4]);
  pen.beginPath();
  if (ahead === null) pen.arc(x, y, r, 0, 2 * Math.PI);
  else {
    pen.moveTo(x, y);
    pen.arc(x, y, r, ahead - run.angle / 2, ahead + run.angle / 2);
    pen.closePath();
  }
  pen.stroke();
  pen.restore();
}

/**
 * Where the sensor looks, clockwise from the right on the screen, radians: in the direction of the last move, in a drive of the
 * next one; null: the robot has not moved, and its sensor sees all around it.
 * @param {Pick<Run, "robot" | "ticks" | "step">} run @param {number} t
 */
export function travelled({ robot, ticks, step }, t) {
  const now = Math.min(Math.floor(t + 1e-6), ticks - 1);
  const move = (/** @type {number} */ k) => {
    const [dx, dy] = [robot[2 * k] - robot[2 * k - 2], robot[2 * k + 1] - robot[2 * k - 1]];
    return Math.abs(dx) + Math.abs(dy) > STILL ? Math.atan2(dy, dx) : null;
  };
  let last = null;
  for (let k = now; k > 0 && last === null; k--) last = move(k);
  let next = null;
  if (step && last !== null) for (let k = now + 1; k < ticks && next === null; k++) next = move(k);
  return next ?? last;
}

/** The cells that have not been seen, shaded. */
class UnseenPicture {
  constructor() {
    this.canvas = document.createElement("canvas");
    this._key = "";
    /** @type {Int32Array | null} */
    this._of = null;
  }

  /** @param {Int32Array} seen the tick at which each cell was first seen, -1 never @param {number} tick @param {number} width @param {number} height @param {boolean} dark */
  put(seen, tick, width, height, dark) {
    const key = `${tick} ${width} ${height} ${dark}`;
    if (key === this._key && seen === this._of) return;
    this._key = key;
    this._of = seen;
    const { canvas } = this;
    canvas.width = width;
    canvas.height = height;
    const image = new ImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    const [r, g, b] = THEMES[dark ? "dark" : "light"].unseen;
    const tone = ((SHADE << 24) | (b << 16) | (g << 8) | r) >>> 0;
    for (let k = 0; k < pixels.length; k++) if (seen[k] < 0 || seen[k] > tick) pixels[k] = tone;
    penOf(canvas).putImageData(image, 0, 0);
  }
}
