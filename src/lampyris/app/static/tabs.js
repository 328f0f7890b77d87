// Tabs: beside the map two panels with tabs of their own; on a telephone one row of tabs for all of them.

import { byId } from "./page.js";

const NARROW = window.matchMedia("(max-width: 820px)");

/** @param {Page} page */
export function mount(page) {
  const tabs = /** @type {HTMLButtonElement[]} */ ([...document.querySelectorAll('[role="tab"]')]);
  /** What each panel shows when there is room for both. @type {Record<string, string>} */
  const chosen = { left: "library", right: "now" };
  let last = "now";

  const draw = () => {
    for (const tab of tabs) {
      const id = sectionOf(tab);
      const on = NARROW.matches ? id === last : chosen[sideOf(tab)] === id;
      tab.setAttribute("aria-selected", String(on));
      tab.tabIndex = on ? 0 : -1;
      byId(id).hidden = !on;
    }
    // Charts have no room of their own on a telephone: they follow the status.
    const charts = byId("charts");
    const home = byId(NARROW.matches ? "now" : "below");
    if (charts.parentElement !== home) home.append(charts);
  };
  page.show = (section) => {
    const tab = tabs.find((one) => byId(sectionOf(one)).contains(byId(section)));
    if (!tab) return;
    const id = sectionOf(tab);
    chosen[sideOf(tab)] = id;
    last = id;
    draw();
    page.tell("panel", id);
  };
  for (const tab of tabs) {
    tab.addEventListener("click", () => page.show(sectionOf(tab)));
    tab.addEventListener("keydown", (event) => {
      const list = NARROW.matches ? tabs : tabs.filter((one) => sideOf(one) === sideOf(tab));
      const at = list.indexOf(tab);
      const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: list.length - 1 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      const next = list[(to + list.length) % list.length];
      page.show(sectionOf(next));
      next.focus();
    });
  }
  NARROW.addEventListener("change", draw);
  draw();
}

/** @param {Element} tab */
function sectionOf(tab) {
  return /** @type {string} */ (tab.getAttribute("aria-controls"));
}

/** @param {Element} tab */
function sideOf(tab) {
  return /** @type {HTMLElement} */ (tab.closest(".panel")).id;
}
