// Zoom: the view is moved, brought nearer and fitted, and the buttons for it.

import { el, iconButton } from "./make.js";
import { byId } from "./page.js";

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
