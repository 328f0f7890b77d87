// Later: what the first look does not need is loaded when somebody asks for it: panels when they are first opened.
//
// A browser remembers for good that a module could not be loaded (Chromium 150 does), so the server is asked for
// something small first, and nothing is imported while it does not answer.

import { button, el, iconButton, sentence } from "./make.js";
import { MapView } from "./map.js";
import { byId } from "./page.js";

/** Panels, and the modules they need, each with the element it is mounted on. @typedef {{panels: string[], parts: Array<[string, string]>}} Group */

/** @type {Group[]} */
const GROUPS = [
  { panels: ["settings", "traffic"], parts: [["settings", "settings"], ["drives", "settings"]] },
  { panels: ["fleet"], parts: [["fleet", "fleet"]] },
  { panels: ["compare"], parts: [["compare", "compare"], ["study", "compare"]] },
  { panels: ["keep"], parts: [["keep", "keep"]] },
  { panels: ["learn"], parts: [["tour", "learn"], ["steps", "learn"]] },
];

/** Modules of the page by name; what hinders it is thrown as a sentence. @param {Page} page @param {...string} names @returns {Promise<any[]>} */
export async function brought(page, ...names) {
  let there = false;
  try {
    there = (await fetch(new URL("icon.svg", import.meta.url), { credentials: "omit", redirect: "error" })).ok;
  } catch {
    page.api.onGone(true);
  }
  if (!there) throw new Error("The server does not answer, so this could not be loaded.");
  try {
    return await Promise.all(names.map((name) => import(`./${name}.js`)));
  } catch (error) {
    console.error(error);
    throw new Error("This could not be loaded: load the page again. Everything you drew is kept.");
  }
}

/** @param {Page} page */
export function mount(page) {
  const all = GROUPS.map((group) => new Later(page, group));
  const { show } = page;
  page.show = async (section) => {
    show(section);
    await all.find((one) => one.group.panels.some((panel) => byId(panel).contains(byId(section))))?.open();
  };
  page.on("gone", (gone) => {
    if (!gone) all.forEach((one) => one.wanted && one.open());
  });
  const measure = () => brought(page, "ruler").then(([ruler]) => ruler.askRuler(page)).catch(page.fault);
  byId("zoom").append(iconButton("Measure a distance (U)", "M3 13L13 3l4 4L7 17zM6 10l2 2M9 7l2 2", () => void measure()));
  page.on("measure", () => void measure());
  page.on("optimal", () => brought(page, "optimal").then(([optimal]) => optimal.askOptimal(page)).catch(page.fault));
  page.on("palette", () => brought(page, "palette").then(([palette]) => palette.askPalette(page)).catch(page.fault));
  pointed(page);
  page.on("run", () => {
    if (page.run?.seen && !MapView.shade) brought(page, "unseen").then(([unseen]) => unseen.askUnseen(page)).catch(page.fault);
  });
  let rounds = false;
  page.on("plan", (plan) => {
    if (rounds || !plan?.rounds?.length) return;
    rounds = true;
    brought(page, "rounds").then(([part]) => part.askRounds(page, byId("layers"), page.plan)).catch((error) => {
      rounds = false;
      page.fault(error);
    });
  });
  // A tab may have been chosen before it was known what there is.
  all.forEach((one) => one.group.panels.some((panel) => !byId(panel).hidden) && one.open());
}

/** What the card beside the pointer needs is loaded when the pointer first moves over the map. @param {Page} page */
function pointed(page) {
  page.map.canvas.addEventListener("pointermove", (event) => {
    brought(page, "hover").then(([hover]) => hover.askHover(page, byId("hover"), event)).catch(() => pointed(page));
  }, { once: true });
}

class Later {
  /** @param {Page} page @param {Group} group */
  constructor(page, group) {
    this.page = page;
    this.group = group;
    /** Somebody has looked for it, and it is not there. */
    this.wanted = false;
    /** Done when it is there, or is known not to come now. @type {Promise<void> | null} */
    this._coming = null;
    /** What is said in each panel while it is not there. @type {HTMLElement[]} */
    this._said = [];
  }

  open() {
    this._coming ??= this._open();
    return this._coming;
  }

  async _open() {
    const { page, group } = this;
    this.wanted = true;
    this._wait(true);
    try {
      const parts = await brought(page, ...group.parts.map(([name]) => name));
      this.wanted = false;
      this._say();
      group.parts.forEach(([name, id], k) => mountPart(page, name, id, parts[k]));
    } catch (error) {
      this._coming = null;
      if (page.gone) this._say(sentence(error), "It comes when the server is back.");
      else this._say(sentence(error), button("Load again", () => location.reload()));
    } finally {
      this._wait(false);
    }
  }

  /** @param {boolean} busy */
  _wait(busy) {
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

/** One part that fails takes no other with it. @param {Page} page @param {string} name @param {string} id @param {any} part */
export function mountPart(page, name, id, part) {
  try {
    part?.mount?.(page, byId(id));
  } catch (error) {
    console.error(`${name}.js`, error);
  }
}
