// View: which part of the map is on the screen. Cells and pixels meet here and nowhere else.

const LEAST = 0.05;
const MOST = 96;

export class View {
  constructor() {
    /** Pixels of the screen (CSS) a cell. */
    this.scale = 1;
    /** Pixel of the upper left corner of the map. */
    this.x = 0;
    this.y = 0;
    this.width = 1;
    this.height = 1;
  }

  /** @param {number} width @param {number} height */
  resize(width, height) {
    // What was in the middle stays there.
    this.x += (width - this.width) / 2;
    this.y += (height - this.height) / 2;
    this.width = width;
    this.height = height;
  }

  /** The whole map within what is left of the screen. @param {number} columns @param {number} rows @param {{top: number, right: number, bottom: number, left: number}} edge pixels that others need */
  fit(columns, rows, { top, right, bottom, left }) {
    const width = Math.max(40, this.width - left - right);
    const height = Math.max(40, this.height - top - bottom);
    this.scale = clamp(Math.min(width / columns, height / rows), LEAST, MOST);
    this.x = left + (width - columns * this.scale) / 2;
    this.y = top + (height - rows * this.scale) / 2;
  }

  /** Zoom by a factor with the pixel (px, py) kept where it is. @param {number} factor @param {number} px @param {number} py */
  zoom(factor, px, py) {
    const scale = clamp(this.scale * factor, LEAST, MOST);
    this.x = px - ((px - this.x) * scale) / this.scale;
    this.y = py - ((py - this.y) * scale) / this.scale;
    this.scale = scale;
  }

  /** @param {number} dx @param {number} dy @param {number} columns @param {number} rows */
  pan(dx, dy, columns, rows) {
    // A corner of the map stays in reach, so that it cannot be lost.
    const keep = 40;
    this.x = clamp(this.x + dx, keep - columns * this.scale, this.width - keep);
    this.y = clamp(this.y + dy, keep - rows * this.scale, this.height - keep);
  }

  /** The cell under a pixel; it may lie off the map. @param {number} px @param {number} py @returns {[number, number]} */
  cellAt(px, py) {
    return [Math.floor((px - this.x) / this.scale), Math.floor((py - this.y) / this.scale)];
  }

  /** The pixel of a place in cells; (0, 0) is the middle of the first cell. @param {number} cx @param {number} cy @returns {[number, number]} */
  pixel(cx, cy) {
    return [this.x + (cx + 0.5) * this.scale, this.y + (cy + 0.5) * this.scale];
  }
}

/** @param {number} v @param {number} low @param {number} high */
function clamp(v, low, high) {
  return Math.min(Math.max(v, low), high);
}
