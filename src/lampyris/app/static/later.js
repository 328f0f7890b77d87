// Later: panels that the first look does not need. What is in them is loaded when one is first opened.
//
// A browser remembers for good that a module could not be loaded (Chromium 150 does), so the server is asked for
// something small first, and nothing is imported while it does not answer.

import { button, el } from "./make.js";
import { byId } from "./page.js";

/** @typedef {import("./types.js").Page} Page */
/** Panels, and the modules they need, each with the element it is mounted on. @typedef {{panels: string[], parts: Array<[string, string]>}} Group */

/** @type {Group[]} */
const GROUPS = [
  { panels: ["settings", "traffic"], parts: [["settings", "settings"], ["traffic", "traffic"]] },
  { panels: ["compare"], parts: [["compare", "compare"], ["study", "compare"]] },
  { panels: ["keep"], parts: [["keep", "keep"]] },
  { panels: ["learn"], parts: [["tour", "learn"], ["steps", "learn"]] },
];

/** @param {Page} page */
export function mount(page) {
  const all = GROUPS.map((group) => new Later(page, group));
  page.on("tab", (panel) => all.forEach((one) => one.group.panels.includes(panel) && one.open()));
  page.on("gone", (gone) => {
    if (!gone) all.forEach((one) => one.wanted && one.open());
  });
  // A tab may have been chosen before it was known what there is.
  all.forEach((one) => one.group.panels.some((panel) => !byId(panel).hidden) && one.open());
}

class Later {
  /** @param {Page} page @param {Group} group */
  constructor(page, group) {
    this.page = page;
    this.group = group;
    /** Somebody has looked for it, and it is not there. */
    this.wanted = false;
    this._busy = false;
    this._there = false;
    /** What is said in each panel while it is not there. @type {HTMLElement[]} */
    this._said = [];
  }

  async open() {
    if (this._busy || this._there) return;
    this.wanted = true;
    this._wait(true);
    try {
      await answers(this.page);
      const parts = await Promise.all(this.group.parts.map(([name]) => import(`./${name}.js`)));
      this._there = true;
      this.wanted = false;
      this._say();
      this.group.parts.forEach(([, id], k) => parts[k].mount(this.page, byId(id)));
    } catch (error) {
      if (this._there) console.error(error);
      const here = this.page.gone
        ? ["The server does not answer, so this could not be loaded. It comes when the server is back."]
        : ["This could not be loaded. Everything you drew is kept: load the page again.", button("Load again", () => location.reload())];
      this._say(...here);
    } finally {
      this._wait(false);
    }
  }

  /** @param {boolean} busy */
  _wait(busy) {
    this._busy = busy;
    for (const panel of this.group.panels) byId(panel).setAttribute("aria-busy", String(busy));
  }

  /** In place of what is not there; nothing: it is. @param {...(string | Node)} what */
  _say(...what) {
    this._said.forEach((one) => one.remove());
    this._said = what.length ? this.group.panels.map((panel) => {
      const said = el("div", { class: "stack hint", role: "status" }, ...what.map((part) => (typeof part === "string" ? el("p", null, part) : part)));
      byId(panel).append(said);
      return said;
    }) : [];
  }
}

/** Nothing if the server answers; else it is told that it is gone. @param {Page} page */
async function answers(page) {
  try {
    if ((await fetch("/static/icon.svg", { credentials: "omit", redirect: "error" })).ok) return;
  } catch {
    page.api.onGone(true);
  }
  throw new Error("the server does not answer");
}
