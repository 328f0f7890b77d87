// Zoom: the view is moved, brought nearer and fitted, and the buttons for it.

import { el, iconButton } from "./make.js";
import { byId } from "./page.js";

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
  const show = () => {
    const { scale } = page.map.view;
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
