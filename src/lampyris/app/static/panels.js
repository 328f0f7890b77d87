// Panels: the two beside the map are as wide as somebody makes them, or folded away; on a telephone the map is as high.

import { el } from "./make.js";
import { byId } from "./page.js";

const KEPT = "lampyris-panels";
/** Pixels: the least of a panel and of a map beside them; a step of an arrow key; the least height of a map. */
const LEAST = { panel: 180, map: 220, high: 140 };
const STEP = 16;
/** The map is above the panels: a telephone, or a tablet held upright. */
const STACKED = window.matchMedia("(max-width: 820px), (max-width: 1023px) and (orientation: portrait)");

/** @typedef {"left" | "right" | "stage"} Side */

/** @param {Page} page */
export function mount(page) {
  /** Width or height in pixels, as far as somebody has chosen it; negative: folded away. @type {Partial<Record<Side, number>>} */
  const sizes = kept();
  const stage = byId("stage");
  const style = document.body.style;

  /** @param {Side} side */
  const now = (side) => (side === "stage" ? stage.offsetHeight : Math.round(byId(side).getBoundingClientRect().width));
  /** @param {Side} side */
  const most = (side) => Math.max(LEAST.panel, side === "stage" ? innerHeight - 300 : innerWidth - LEAST.map - now(side === "left" ? "right" : "left"));
  const apply = () => {
    for (const { side, grip, fold } of all) {
      const size = sizes[side];
      const folded = side !== "stage" && !STACKED.matches && size !== undefined && size < 0;
      document.body.classList.toggle(`no-${side}`, folded);
      if (size === undefined) style.removeProperty(`--${side}`);
      // What was chosen in a larger window leaves room for the map in a smaller one.
      else style.setProperty(`--${side}`, `${Math.max(Math.min(size, most(side)), 0)}px`);
      grip.hidden = STACKED.matches !== (side === "stage");
      if (grip.hidden) continue;
      grip.setAttribute("aria-valuenow", String(folded ? 0 : now(side)));
      grip.setAttribute("aria-valuemax", String(most(side)));
      if (!fold) continue;
      fold.setAttribute("aria-expanded", String(!folded));
      fold.title = `${folded ? "Show" : "Hide"} the ${side} panel`;
      fold.setAttribute("aria-label", fold.title);
      fold.textContent = folded === (side === "left") ? "\u203a" : "\u2039";
    }
  };
  /** @param {Side} side @param {number} size */
  const set = (side, size) => {
    sizes[side] = side !== "stage" && size < LEAST.panel / 2 ? -Math.abs(sizes[side] ?? now(side)) : Math.min(Math.max(size, side === "stage" ? LEAST.high : LEAST.panel), most(side));
    apply();
    keep(sizes);
  };
  /** @param {Side} side */
  const fold = (side) => {
    if (side === "stage" || STACKED.matches) return;
    sizes[side] = -(sizes[side] ?? now(side));
    apply();
    keep(sizes);
  };

  const all = /** @type {const} */ (["left", "right", "stage"]).map((side) => {
    const upright = side !== "stage";
    const grip = el("div", { class: `grip ${side}`, role: "separator", tabindex: 0, "aria-orientation": upright ? "vertical" : "horizontal", "aria-valuemin": 0,
      "aria-label": upright ? `Width of the ${side} panel` : "Height of the map", title: upright ? "Drag, or arrow keys; Enter hides the panel" : "Drag, or arrow keys" });
    /** @type {{at: number, size: number} | null} */
    let from = null;
    const sign = side === "right" ? -1 : 1;
    grip.addEventListener("pointerdown", (event) => {
      from = { at: upright ? event.clientX : event.clientY, size: now(side) };
      grip.setPointerCapture(event.pointerId);
    });
    grip.addEventListener("pointermove", (event) => from && set(side, from.size + sign * ((upright ? event.clientX : event.clientY) - from.at)));
    for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) grip.addEventListener(name, () => (from = null));
    grip.addEventListener("dblclick", () => fold(side));
    grip.addEventListener("keydown", (event) => {
      const by = /** @type {Record<string, number>} */ (upright ? { ArrowLeft: -sign, ArrowRight: sign } : { ArrowUp: -1, ArrowDown: 1 })[event.key];
      if (by) set(side, now(side) + by * STEP);
      else if (event.key === "Enter") fold(side);
      else return;
      event.preventDefault();
    });
    const button = upright ? el("button", { type: "button", class: `fold ${side}`, "aria-controls": side, onclick: () => fold(side) }) : null;
    if (button) stage.append(grip, button);
    else byId("below").append(grip);
    return { side, grip, fold: button };
  });
  page.on("fold", fold);
  // A panel that is asked for is there.
  page.on("panel", (id) => {
    const side = byId(id).closest("#left") ? "left" : "right";
    if ((sizes[side] ?? 0) < 0) fold(side);
  });
  STACKED.addEventListener("change", apply);
  addEventListener("resize", apply);
  apply();
}

/** @returns {Partial<Record<Side, number>>} */
function kept() {
  try {
    const { left, right, stage } = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    return { left, right, stage };
  } catch {
    return {};
  }
}

/** @param {Partial<Record<Side, number>>} sizes */
function keep(sizes) {
  try {
    localStorage.setItem(KEPT, JSON.stringify(sizes));
  } catch {
    // Not kept then.
  }
}
