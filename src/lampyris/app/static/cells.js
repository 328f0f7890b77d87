// Cells: the ground and the layer over it as pictures of a pixel a cell; the canvas stretches them.

import { THEMES, levels, packed } from "./colours.js";

/** @typedef {CanvasRenderingContext2D} Pen */
/** A run whose robot has a sensor, and the moment that is shown. @typedef {{run: Run, t: number}} Seen */

/** @param {HTMLCanvasElement} canvas */
export function penOf(canvas) {
  return /** @type {Pen} */ (canvas.getContext("2d"));
}

/** The part of a picture of cells that is on the screen. @param {Pen} pen @param {import("./view.js").View} view @param {HTMLCanvasElement} image */
export function drawCells(pen, view, image) {
  const x0 = Math.max(0, Math.floor(-view.x / view.scale));
  const y0 = Math.max(0, Math.floor(-view.y / view.scale));
  const x1 = Math.min(image.width, Math.ceil((view.width - view.x) / view.scale));
  const y1 = Math.min(image.height, Math.ceil((view.height - view.y) / view.scale));
  if (x0 >= x1 || y0 >= y1) return;
  const s = view.scale;
  pen.drawImage(image, x0, y0, x1 - x0, y1 - y0, view.x + x0 * s, view.y + y0 * s, (x1 - x0) * s, (y1 - y0) * s);
}

export class GroundPicture {
  constructor() {
    this.canvas = document.createElement("canvas");
  }

  /** @param {Ground} ground @param {boolean} dark */
  put(ground, dark) {
    this.canvas.width = ground.width;
    this.canvas.height = ground.height;
    const theme = THEMES[dark ? "dark" : "light"];
    const tones = [packed(theme.free), packed(theme.wall), packed(theme.unknown)];
    const image = new ImageData(ground.width, ground.height);
    const pixels = new Uint32Array(image.data.buffer);
    const { cells, terrain } = ground;
    for (let k = 0; k < pixels.length; k++) pixels[k] = tones[cells[k]];
    if (terrain) {
      const dear = theme.free.map((v, c) => theme.dear[c] - v);
      for (let k = 0; k < pixels.length; k++) {
        if (cells[k] || !terrain[k]) continue;
        const share = 0.14 + (0.86 * terrain[k]) / 252;
        pixels[k] = packed(/** @type {[number, number, number]} */ (theme.free.map((v, c) => Math.round(v + share * dear[c]))));
      }
    }
    penOf(this.canvas).putImageData(image, 0, 0);
  }

  /** Cells that have just changed. @param {Ground} ground @param {Iterable<Cell>} cells @param {boolean} dark @param {(x: number, y: number, tone: string) => void} too */
  change(ground, cells, dark, too) {
    const theme = THEMES[dark ? "dark" : "light"];
    const tones = [theme.free, theme.wall, theme.unknown].map(([r, g, b]) => `rgb(${r},${g},${b})`);
    const pen = penOf(this.canvas);
    for (const [x, y] of cells) {
      const tone = tones[ground.cells[y * ground.width + x]];
      pen.fillStyle = tone;
      pen.fillRect(x, y, 1, 1);
      too(x, y, tone);
    }
  }
}

export class LayerPicture {
  constructor() {
    this.canvas = document.createElement("canvas");
    /** @type {ImageData | null} */
    this._image = null;
    /** @type {Uint32Array | null} */
    this._tones = null;
    this._dark = false;
  }

  /** @param {Layer} layer @param {boolean} dark */
  put(layer, dark) {
    const { canvas } = this;
    if (!this._image || canvas.width !== layer.width || canvas.height !== layer.height) {
      canvas.width = layer.width;
      canvas.height = layer.height;
      this._image = new ImageData(layer.width, layer.height);
    }
    if (!this._tones || this._dark !== dark) {
      this._tones = levels("landscape", dark);
      this._dark = dark;
    }
    const pixels = new Uint32Array(this._image.data.buffer);
    const { values } = layer;
    const tones = this._tones;
    for (let k = 0; k < pixels.length; k++) pixels[k] = tones[values[k]];
    penOf(canvas).putImageData(this._image, 0, 0);
  }

  /** What was painted there is seen at once; the layer as it is now is still on its way. @param {number} x @param {number} y */
  clear(x, y) {
    penOf(this.canvas).clearRect(x, y, 1, 1);
  }
}
