// Example: the worked example as a scenario, and the scenario that was there before its tour, which comes back even
// after the page was closed in the middle of it. The tour itself is loaded when somebody looks for it.

import { blank } from "./state.js";

const BEFORE = "lampyris-before-tour";

export const SIDE = 10;
export const START = /** @type {Cell} */ ([0, 9]);
export const GOAL = /** @type {Cell} */ ([7, 0]);

/** The worked example as a scenario. @returns {Scenario} */
export function scenario() {
  return { ...blank(), map: "guide", start: START, goal: GOAL, preset: "dissertation" };
}

/** A tour that was cut short by closing the page: what was there before it comes back. @param {Page} page */
export function begin(page) {
  const before = kept();
  if (!before) return;
  keep(null);
  if (!isGuide(page.store.scenario)) return;
  page.store.replace(before, false);
}

/** @param {Scenario} one */
function isGuide(one) {
  return JSON.stringify([one.map, one.start, one.goal]) === JSON.stringify(["guide", START, GOAL]);
}

/** What was there before the tour. @returns {Scenario | null} */
function kept() {
  try {
    const text = localStorage.getItem(BEFORE);
    return text ? JSON.parse(text) : null;
  } catch {
    return null;
  }
}

/** Keep it for after the tour; null: it is back. @param {Scenario | null} one */
export function keep(one) {
  try {
    if (one) localStorage.setItem(BEFORE, JSON.stringify(one));
    else localStorage.removeItem(BEFORE);
  } catch {
    // Undoing is left.
  }
}
