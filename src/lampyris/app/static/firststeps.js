// First steps: the app in five steps, each said beside what it is about. Nothing is taken over: each step is done
// to the scenario on the screen, and can be undone.

import { button, el, fill } from "./make.js";
import { byId } from "./page.js";

/** @typedef {{title: string, words: string, panel: string, tool?: string, at: string}} Step */

/** @type {Step[]} */
const STEPS = [
  { title: "Drag the goal", panel: "status", tool: "goal", at: "map",
    words: "Drag the mark G into another room. The path is planned again while you drag, and the robot then drives along the new one." },
  { title: "Paint a wall while it drives", panel: "status", tool: "wall", at: "map",
    words: "The brush is selected: paint a wall across a door on the path. The path is planned again, and driven from the start. Undo (Ctrl+Z) removes the wall." },
  { title: "Read why it slowed", panel: "status", at: "charts",
    words: "The coloured strip below the speed says what limits it at each moment: clearance to walls, a moving obstacle, the robot's own acceleration. Drag the slider to any moment to read it." },
  { title: "Race planners", panel: "compare", at: "compare",
    words: "Press Race: the planners of the list search this map side by side, then their robots drive. Compare runs them among the same obstacles, with costs and times in a table." },
  { title: "Export", panel: "keep", at: "keep",
    words: "Press HTML for one page with this run, to play and scrub in any browser, also offline. Or take a picture, a film, a table or the scenario file, which gives the same drive on the command line. The address of this page contains everything, too." },
];

class FirstSteps {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.at = 0;
    /** @type {Element | null} */
    this.pointed = null;
    this.count = el("p", { class: "hint" });
    this.title = el("h2", { tabindex: -1 });
    this.words = el("p", {});
    this.back = button("Back", () => this.go(this.at - 1));
    this.next = button("Next", () => (this.at === STEPS.length - 1 ? this.leave() : this.go(this.at + 1)), { class: "btn primary" });
    const close = el("button", { type: "button", class: "away", "aria-label": "Close the tour", title: "Close", onclick: () => this.leave() }, "\u00d7");
    this.box = el("section", { id: "first-steps", class: "welcome card", "aria-label": "Tour" },
      el("div", { class: "row" }, el("div", { class: "grow" }, this.count), close), this.title, this.words, el("div", { class: "row" }, this.back, this.next));
    this.box.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.leave();
    });
    byId("stage").append(this.box);
  }

  /** @param {number} k */
  go(k) {
    this.at = Math.min(Math.max(k, 0), STEPS.length - 1);
    const step = STEPS[this.at];
    fill(this.count, `Step ${this.at + 1} of ${STEPS.length}`);
    fill(this.title, step.title);
    fill(this.words, step.words);
    this.back.disabled = this.at === 0;
    fill(this.next, this.at === STEPS.length - 1 ? "Done" : "Next");
    void this.page.show(step.panel);
    this.page.use(step.tool ?? "goal");
    this.point(byId(step.at));
    this.title.focus({ preventScroll: true });
  }

  /** @param {Element | null} at */
  point(at) {
    this.pointed?.classList.remove("pointed");
    at?.classList.add("pointed");
    this.pointed = at;
  }

  leave() {
    this.point(null);
    this.box.remove();
    this.page.use("goal");
    void this.page.show("status");
    this.page.map.canvas.focus();
  }
}

/** @param {Page} page */
export function begin(page) {
  document.getElementById("first-steps")?.remove();
  new FirstSteps(page).go(0);
}
