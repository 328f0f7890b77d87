// Contours: lines of equal value over a layer, by marching squares between the centres of cells.

import { THEMES } from "./colours.js";

/** Lines of the layer, from its least to its greatest value. */
const LEVELS = 14;

/** Of the layer that was drawn last: every line as one path in cells. @type {{values: Uint8Array | null, path: Path2D}} */
const held = { values: null, path: new Path2D() };

/**
 * Draw the lines of a layer over the ground.
 * @param {CanvasRenderingContext2D} pen @param {import("./view.js").View} view @param {Layer} layer @param {boolean} dark
 */
export function askContours(pen, view, layer, dark) {
  if (held.values !== layer.values) {
    held.values = layer.values;
    held.path = contoursOf(layer.values, layer.width, layer.height);
  }
  pen.save();
  pen.translate(view.x, view.y);
  pen.scale(view.scale, view.scale);
  pen.lineWidth = 1.1 / view.scale;
  pen.strokeStyle = THEMES[dark ? "dark" : "light"].ink;
  pen.globalAlpha = 0.75;
  pen.stroke(held.path);
  pen.restore();
}

/** @param {Uint8Array} values 1 to 255; 0: none @param {number} width @param {number} height */
function contoursOf(values, width, height) {
  const path = new Path2D();
  for (let y = 0; y + 1 < height; y++) {
    for (let x = 0; x + 1 < width; x++) {
      const k = y * width + x;
      // Clockwise from the upper left.
      const v = [values[k], values[k + 1], values[k + width + 1], values[k + width]];
      if (!v[0] || !v[1] || !v[2] || !v[3]) continue;
      const low = Math.min(v[0], v[1], v[2], v[3]);
      const high = Math.max(v[0], v[1], v[2], v[3]);
      for (let n = Math.ceil(((low - 1) / 254) * LEVELS - 0.5); n < LEVELS; n++) {
        const level = 1 + (254 * (n + 0.5)) / LEVELS;
        if (level >= high) break;
        if (level > low) square(path, x + 0.5, y + 0.5, v, level);
      }
    }
  }
  return path;
}

/** The lines of one level in the square between four centres. @param {Path2D} path @param {number} x @param {number} y @param {number[]} v @param {number} level */
function square(path, x, y, v, level) {
  /** @type {Array<[number, number]>} */
  const ends = [];
  for (let side = 0; side < 4; side++) {
    const a = v[side];
    const b = v[(side + 1) % 4];
    if (a > level === b > level) continue;
    const t = (level - a) / (b - a);
    ends.push(side === 0 ? [x + t, y] : side === 1 ? [x + 1, y + t] : side === 2 ? [x + 1 - t, y + 1] : [x, y + 1 - t]);
  }
  // A saddle has four ends: which two belong together is told by the mean of its corners.
  const turned = ends.length === 4 && (v[0] > level) === ((v[0] + v[1] + v[2] + v[3]) / 4 > level);
  for (let k = 0; k + 1 < ends.length; k += 2) {
    const [a, b] = turned ? [ends[k + 1], ends[(k + 2) % 4]] : [ends[k], ends[k + 1]];
    path.moveTo(a[0], a[1]);
    path.lineTo(b[0], b[1]);
  }
}
