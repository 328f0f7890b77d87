// View: which part of the map is on the screen, how it is moved and zoomed, and the buttons for it. Cells and pixels meet
// here and nowhere else.

import { el, iconButton } from "./make.js";
import { byId } from "./page.js";

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

// ---- how a person moves it ----

/** The longest scale bar, pixels. */
const RULER = 72;

/** The greatest length of 1, 2 or 5 times a power of ten that is no longer. @param {number} most */
function rounded(most) {
  const unit = 10 ** Math.floor(Math.log10(most));
  return Number(((most >= 5 * unit ? 5 : most >= 2 * unit ? 2 : 1) * unit).toPrecision(1));
}

/** @param {Page} page */
export function zoomButtons(page) {
  const bar = byId("zoom");
  const out = el("output", { "aria-label": "Zoom" });
  const zoom = (/** @type {number} */ f) => zoomBy(page, f);
  /** @type {Array<[string, string, () => void]>} */
  const all = [
    ["Zoom in (+)", "M10 4v12M4 10h12", () => zoom(1.4)],
    ["Zoom out (\u2212)", "M4 10h12", () => zoom(1 / 1.4)],
    ["Whole map (0)", "M4 8V4h4M12 4h4v4M16 12v4h-4M8 16H4v-4", () => fit(page)],
  ];
  bar.append(...all.map((one) => iconButton(...one)));
  bar.append(out);
  const line = el("i", {});
  const length = el("span", {});
  const ruler = el("div", { class: "scale", hidden: true, title: "Scale" }, length, line);
  byId("stage").append(ruler);
  const show = () => {
    const { scale } = page.map.view;
    ruler.hidden = !page.ground;
    if (page.ground) {
      const metre = scale / page.ground.resolution;
      const metres = rounded(RULER / metre);
      length.textContent = metres < 1 ? `${Number((100 * metres).toPrecision(1))} cm` : metres < 1000 ? `${metres} m` : `${metres / 1000} km`;
      line.style.width = `${Math.round(metres * metre)}px`;
    }
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
