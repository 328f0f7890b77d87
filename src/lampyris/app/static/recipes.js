// Recipes: a new map by kind, size and seed, looked at before it is opened. The scenario holds the recipe, so that
// its link and its file are short and the command line makes the same cells.

import { field } from "./fields.js";
import { drawn, loadGround } from "./ground.js";
import { button, el, fill, sentence } from "./make.js";

/** @typedef {{recipe: string, size: [number, number], seed: number, settings: Record<string, number>}} Spec */

/** Milliseconds after the last change before the map is made. */
const SOON = 250;
const MOST_SIDE = 2048;
const WIDE = 236;

/** The settings that all recipes have. */
const COMMON = [
  { name: "columns", default: 64, most: MOST_SIDE, about: "Cells from left to right." },
  { name: "rows", default: 48, most: MOST_SIDE, about: "Cells from top to bottom." },
  { name: "seed", default: 0, most: Number.MAX_SAFE_INTEGER, about: "Same seed, same cells." },
];

/** Open or close the form beneath an element. @param {Page} page @param {HTMLElement} beside */
export function askRecipe(page, beside) {
  const old = document.getElementById("make-map");
  if (old) old.remove();
  else beside.parentElement?.after(new Maker(page).box);
}

class Maker {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** @type {any[]} */
    this.recipes = page.hello.recipes ?? [];
    const now = /** @type {any} */ (page.store.scenario.map);
    /** The map that is open, if a recipe made it; else the first one. @type {Spec} */
    this.spec = now?.recipe ? { recipe: now.recipe, size: [now.size[0], now.size[1]], seed: now.seed ?? 0, settings: { ...now.settings } }
      : { recipe: this.recipes[0].name, size: [64, 48], seed: 0, settings: {} };
    this.timer = 0;
    /** @type {AbortController | null} */
    this.asked = null;
    /** What is looked at. @type {{spec: Spec, ground: Ground} | null} */
    this.seen = null;
    this.kind = el("select", { "aria-label": "Kind of map", onchange: () => {
      this.spec = { ...this.spec, recipe: this.kind.value, settings: {} };
      this._form();
      this._soon();
    } }, ...this.recipes.map((one) => el("option", { value: one.name, title: one.summary }, one.name)));
    this.kind.value = this.spec.recipe;
    this.about = el("p", { class: "hint" });
    this.rows = el("div", { class: "rows" });
    this.picture = el("canvas", { class: "made-picture", role: "img", "aria-label": "The map, not made yet", width: 1, height: 1 });
    this.words = el("p", { class: "hint", role: "status" });
    this.open = button("Open this map", () => this._open(), { class: "btn primary", disabled: true });
    this.box = el("div", { id: "make-map", class: "card stack", role: "group", "aria-label": "Make a map" },
      // The buttons stand above what grows and shrinks as fields are entered and left: a click stays on them.
      this.kind, this.about, this.picture, this.words, el("div", { class: "row" }, this.open, button("Close", () => this._close())), this.rows);
    this._form();
    this._make();
  }

  get recipe() {
    return this.recipes.find((one) => one.name === this.spec.recipe) ?? this.recipes[0];
  }

  _form() {
    const { spec, recipe } = this;
    this.about.textContent = `${recipe.summary}.`;
    const common = COMMON.map((one, k) => {
      const setting = { ...one, type: "whole", choices: null, least: k < 2 ? recipe.least : 0, allowed: "" };
      const made = field(setting, (value) => {
        if (k === 2) this.spec = { ...this.spec, seed: value };
        else this.spec = { ...this.spec, size: k ? [this.spec.size[0], value] : [value, this.spec.size[1]] };
        this._soon();
      });
      made.put(k === 2 ? spec.seed : spec.size[k]);
      if (k < 2) return made.row;
      made.row.classList.add("with-dice");
      made.row.append(button("⚄", () => {
        this.spec = { ...this.spec, seed: Math.floor(Math.random() * 1e6) };
        made.put(this.spec.seed);
        this._soon();
      }, { class: "btn icon dice", "aria-label": "Another seed", title: "Another seed" }));
      return made.row;
    });
    const own = recipe.settings.map((/** @type {import("./fields.js").Setting} */ one) => {
      const made = field(one, (value) => {
        const settings = { ...this.spec.settings, [one.name]: value };
        // A default is not written down: what is said is what was chosen.
        if (value === one.default) delete settings[one.name];
        this.spec = { ...this.spec, settings };
        this._soon();
      });
      made.put(spec.settings[one.name] ?? one.default);
      return made.row;
    });
    fill(this.rows, ...common, ...own);
  }

  _soon() {
    clearTimeout(this.timer);
    // A field tells its value again when it is left, and the click that leaves it may be on the button.
    const same = JSON.stringify(this.spec) === JSON.stringify(this.seen?.spec);
    this.open.disabled = !same;
    if (same) return;
    this.timer = window.setTimeout(() => this._make(), SOON);
  }

  async _make() {
    const { spec, page } = this;
    this.asked?.abort();
    const asked = new AbortController();
    this.asked = asked;
    this.words.textContent = "Making it…";
    this.words.classList.remove("bad");
    try {
      const ground = await loadGround(page.api, spec, asked.signal);
      if (asked !== this.asked) return;
      this.seen = { spec, ground };
      drawn(ground, this.picture, WIDE, page.dark);
      let free = 0;
      for (const cell of ground.cells) if (cell === 0) free++;
      const said = `${ground.width} × ${ground.height} cells, ${Math.round((100 * free) / ground.cells.length)}% free`;
      this.words.textContent = `${said}.`;
      this.picture.setAttribute("aria-label", `${ground.name}: ${said}`);
      this.open.disabled = JSON.stringify(spec) !== JSON.stringify(this.spec);
    } catch (error) {
      if (asked.signal.aborted) return;
      this.words.textContent = sentence(error);
      this.words.classList.add("bad");
    }
  }

  async _open() {
    const { seen, page } = this;
    if (!seen) return;
    try {
      await page.open(seen.spec);
      this._close();
    } catch (error) {
      page.fault(error);
    }
  }

  _close() {
    clearTimeout(this.timer);
    this.asked?.abort();
    this.box.remove();
  }
}
