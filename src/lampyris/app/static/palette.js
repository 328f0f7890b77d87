// Palette: every verb, layer, planner, speed law, map and example by name, from the keyboard alone (Ctrl+K). What it
// lists it does as a person would: it opens the panel and presses the button there.

import { askRecipe } from "./recipes.js";
import { TOOLS } from "./edit.js";
import { brought } from "./later.js";
import { aboutOf, el, fill } from "./make.js";
import { open as openFirst } from "./opening.js";
import { byId } from "./page.js";
import { copyLink, turnTheme } from "./theme.js";
import { fit, zoomBy } from "./view.js";

/** @typedef {{group: string, name: string, about?: string, key?: string, act: () => unknown}} Entry */

/** Rows that are shown at most. */
const MOST = 60;
/** Milliseconds that a button which a panel brings may take to be there. */
const PATIENCE = 8000;

/** @param {Page} page */
export async function askPalette(page) {
  if (document.querySelector("dialog.palette")) return;
  if (!document.querySelector('link[href="/static/palette.css"]')) document.head.append(el("link", { rel: "stylesheet", href: "/static/palette.css" }));
  new Palette(page, entries(page));
}

class Palette {
  /** @param {Page} page @param {Entry[]} all */
  constructor(page, all) {
    this.page = page;
    this.all = all;
    /** @type {Entry[]} */
    this.found = [];
    this.at = 0;
    this.list = el("ul", { class: "plain palette-list", id: "palette-list", role: "listbox", "aria-label": "Commands" });
    this.words = el("p", { class: "hint", role: "status" });
    this.field = el("input", {
      type: "text", class: "palette-field", role: "combobox", "aria-label": "Command, layer, planner, map or example", "aria-expanded": "true", "aria-controls": "palette-list",
      "aria-autocomplete": "list", autocomplete: "off", spellcheck: "false", placeholder: "Command, layer, planner, map or example", oninput: () => this._search(),
    });
    this.root = el("dialog", { class: "palette", "aria-label": "Commands" }, this.field, this.list, this.words);
    document.body.append(this.root);
    this.root.addEventListener("close", () => this.root.remove());
    this.root.addEventListener("click", (event) => event.target === this.root && this.root.close());
    this.root.addEventListener("keydown", (event) => this._key(event));
    this.root.showModal();
    this.field.focus();
    this._search();
    void this._maps();
  }

  /** Maps that were uploaded, which the page learns of from the server. */
  async _maps() {
    try {
      const listed = await this.page.api.json("/api/maps");
      for (const row of Array.isArray(listed) ? listed : listed.maps) {
        if (row.kind !== "bundled") this.all.push({ group: "Map", name: row.name, about: "yours", act: () => this.page.open({ library: row.id }) });
      }
      this._search();
    } catch {
      // Those that are known are listed.
    }
  }

  /** Entries that have every word that was typed; those whose name begins with it first. */
  _search() {
    const words = this.field.value.toLowerCase().split(/\s+/).filter(Boolean);
    const rank = (/** @type {Entry} */ { group, name, about = "" }) => {
      const [own, whole] = [name.toLowerCase(), `${group} ${name} ${about}`.toLowerCase()];
      if (!words.every((word) => whole.includes(word))) return 9;
      const first = words[0] ?? "";
      return own.startsWith(first) ? 0 : own.split(/[\s-]+/).some((part) => part.startsWith(first)) ? 1 : own.includes(first) ? 2 : 3;
    };
    this.found = this.all.map((entry) => ({ entry, at: rank(entry) })).filter(({ at }) => at < 9).sort((a, b) => a.at - b.at).map(({ entry }) => entry);
    this.at = 0;
    this._draw();
  }

  _draw() {
    const shown = this.found.slice(0, MOST);
    fill(this.list, ...shown.map(({ group, name, about, key }, k) => el("li", {
      id: `palette-${k}`, role: "option", "aria-selected": String(k === this.at), onclick: () => this._do(k), onpointermove: () => this._mark(k),
    }, el("span", { class: "palette-group" }, group), el("b", null, name), el("span", { class: "hint grow" }, about ?? ""), key ? el("kbd", null, key) : null)));
    this._mark(this.at);
    this.words.textContent = this.found.length > MOST ? `${MOST} of ${this.found.length}: type more of the name.` : this.found.length ? `${this.found.length} found` : "No match.";
  }

  /** @param {number} k */
  _mark(k) {
    this.list.children[this.at]?.setAttribute("aria-selected", "false");
    this.at = k;
    const row = this.list.children[k];
    row?.setAttribute("aria-selected", "true");
    row?.scrollIntoView({ block: "nearest" });
    if (row) this.field.setAttribute("aria-activedescendant", row.id);
    else this.field.removeAttribute("aria-activedescendant");
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const many = Math.min(this.found.length, MOST);
    const by = { ArrowDown: 1, ArrowUp: -1, PageDown: 8, PageUp: -8 }[event.key];
    if (by && many) this._mark(Math.abs(by) === 1 ? (this.at + by + many) % many : Math.min(Math.max(this.at + by, 0), many - 1));
    else if (event.key === "Enter") this._do(this.at);
    else if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "k") this.root.close();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {number} k */
  async _do(k) {
    const entry = this.found[k];
    if (!entry) return;
    this.root.close();
    try {
      await entry.act();
    } catch (error) {
      this.page.fault(error);
    }
  }
}

/** Everything there is, in the order in which it is listed. @param {Page} page @returns {Entry[]} */
function entries(page) {
  const { hello, play, store } = page;
  /** Open a panel and press what is called so in it. */
  const press = (/** @type {string} */ section, /** @type {string} */ name) => async () => {
    await page.show(section);
    const end = performance.now() + PATIENCE;
    for (;;) {
      const all = [...byId(section).querySelectorAll("button, input[type=checkbox]")];
      const one = /** @type {any} */ (all.find((it) => [it.textContent?.trim(), it.getAttribute("aria-label"), it.closest("label")?.textContent?.trim()].some((text) => text?.startsWith(name))));
      if (one && one.checkVisibility() && !one.disabled) {
        one.focus();
        one.click();
        return;
      }
      if (performance.now() > end || page.gone) throw new Error(`\u201c${name}\u201d cannot be used now.`);
      await new Promise((go) => setTimeout(go, 50));
    }
  };
  /** Choose in a list of a panel. */
  const choose = (/** @type {string} */ label, /** @type {string} */ value) => async () => {
    await page.show("settings");
    const pick = /** @type {HTMLSelectElement | null} */ (byId("settings").querySelector(`select[aria-label="${label}"]`));
    if (!pick) throw new Error("The panel Planner could not be loaded.");
    pick.value = value;
    pick.dispatchEvent(new Event("change"));
  };
  const verb = (/** @type {string} */ name, /** @type {() => unknown} */ act, key = "", about = "") => ({ group: "Action", name, about, key, act });
  const step = (/** @type {string} */ name) => async () => (await brought(page, name))[0];
  return [
    verb(play.playing ? "Pause" : "Play", () => play.toggle(), "Space"),
    verb("Run from the beginning", () => (page.fleet ? page.fleet.again() : page.simulate({ tick: 0, play: true })), "R"),
    verb("Compare planners", press("compare", "Compare"), "", "the chosen ones, in the same world"),
    verb("Race planners", press("compare", "Race"), "", "side by side on one clock"),
    verb("Results page", press("compare", "Results page"), "", "table, intervals, settings, studies"),
    verb("Send to a study", press("compare", "Send to a study")),
    verb("Show the layer in 3-D", press("layers", "In 3-D")),
    verb("Show the optimal path (A*)", press("status", "Show the optimal path")),
    verb("Plan a fleet", press("fleet", "Plan"), "", "many robots"),
    verb("Simulate glowworm robots", async () => {
      await press("fleet", "Glowworms")();
      await press("fleet", "Simulate")();
    }),
    ...TOOLS.map((tool) => verb(tool.label, () => page.use(tool.name), tool.key.toUpperCase(), "tool")),
    verb("Measure a distance", () => page.tell("measure"), "U"),
    verb("Undo", () => store.undo(), "Ctrl Z"), verb("Redo", () => store.redo(), "Ctrl Shift Z"),
    verb("One tick back", () => play.step(-1), ","), verb("One tick on", () => play.step(1), "."),
    verb("First tick", () => play.seek(0), "Home"), verb("Last tick", () => play.seek(play.last), "End"),
    verb("Zoom in", () => zoomBy(page, 1.4), "+"), verb("Zoom out", () => zoomBy(page, 1 / 1.4), "\u2212"), verb("Whole map", () => fit(page), "0"),
    verb("Clear moving obstacles", () => store.set({ obstacles: [] })), verb("Clear painted walls", () => store.set({ edits: [] })),
    verb("Make a map\u2026", () => {
      void page.show("library");
      const beside = [...byId("library").querySelectorAll("button")].find((one) => one.textContent?.startsWith("Make a map"));
      if (beside) askRecipe(page, beside);
    }, "", "by recipe, size and seed"),
    verb("Open files\u2026", press("library", "Open files"), "", "pictures, ROS maps, scenarios"),
    verb("Copy the link of this state", () => copyLink(page), "L"), verb("Colours: light, dark, as the system", () => turnTheme(page), "T"),
    verb("Show or hide the left panel", () => page.tell("fold", "left")), verb("Show or hide the right panel", () => page.tell("fold", "right")),
    verb("Keys", () => page.tell("help"), "?"),
    ...[["Map", "library"], ["Planner", "settings"], ["Traffic", "traffic"], ["Status", "now"], ["Compare", "compare"], ["Export", "keep"], ["Learn", "learn"], ["Fleet", "fleet"]].map(([name, id], k) => ({
      group: "Panel", name, key: String(k + 1), act: async () => {
        await page.show(id);
        byId(`tab-${id}`).focus();
      },
    })),
    ...["None", "Cost", "Luciferin", "Clearance", "Expanded", "Reachable set"].map((name) => ({ group: "Layer", name, act: async () => {
      await page.show("layers");
      page.tell("show-layer", name === "Reachable set" ? "reach" : name.toLowerCase());
    } })),
    ...["Contour lines", "Gates", "Inflation"].map((name) => ({ group: "Layer", name, about: "on or off", act: press("layers", name) })),
    ...[...hello.planners, ...hello.planners_of_poses].map((/** @type {any} */ row) => ({ group: "Planner", name: row.title, about: aboutOf(row), act: choose("Planner", row.name) })),
    ...hello.laws.map((/** @type {any} */ row) => ({ group: "Speed law", name: row.name, about: row.summary, act: choose("Speed law", row.name) })),
    ...["PNG", "SVG", "WebP", "GIF", "WebM", "MP4", "CSV", "HTML", "Scenario", "Report"].map((name) => ({ group: "Export", name, act: press("keep", name) })),
    { group: "Example", name: "Office among people", about: "the opening scene", act: () => openFirst(page) },
    { group: "Example", name: "The dissertation, step by step", about: "the worked 10 \u00d7 10 example", act: press("learn", "Begin the tour") },
    { group: "Example", name: "AD-GSO step by step", act: press("learn", "Show its steps") },
    { group: "Example", name: "Tour of the app", about: "five steps", act: async () => (await step("firststeps")()).begin(page) },
    ...hello.maps.map((/** @type {string} */ name) => ({ group: "Map", name, act: () => page.open(name) })),
  ];
}
