// Library: maps to choose from, with pictures; files dropped anywhere on the page become maps.

import { brought } from "./later.js";
import { el, sentence } from "./make.js";
import { byId } from "./page.js";
import { tidy } from "./state.js";

/** @typedef {{id: string, name: string, kind: string, width: number | null, height: number | null, free: number | null}} Row */

const GROUPS = { upload: "Uploaded", folder: "Your folder", bundled: "Bundled" };
const AT_ONCE = 3;
const MOST = 15 * 2 ** 20;

/** @param {Page} page @param {HTMLElement} pane */
export function mount(page, pane) {
  const picker = el("input", { type: "file", multiple: true, hidden: true, "aria-label": "Map files",
    accept: ".png,.bmp,.pgm,.yaml,.yml,.map,.txt,.npy,.csv,.json" });
  const pick = el("button", { type: "button", class: "btn", onclick: () => picker.click() }, "Open files\u2026");
  const empty = el("button", { type: "button", class: "btn", title: "An empty map, to paint your own" }, "Empty map");
  const recipe = el("button", { type: "button", class: "btn", title: "A new map by kind, size and seed" }, "Make a map…");
  const search = el("input", { type: "search", placeholder: "Find a map", "aria-label": "Find a map" });
  const lists = el("div", { class: "maps" });
  pane.append(el("div", { class: "row" }, pick, recipe, empty, picker), el("p", { class: "hint" }, "Drop maps or scenarios here, or anywhere on the page: PNG, BMP, PGM, ROS (YAML and picture together), MovingAI, text, NumPy, CSV."), search, lists);
  const shelf = new Shelf(page, lists);

  picker.addEventListener("change", () => {
    void upload(page, shelf, [...(picker.files ?? [])]);
    picker.value = "";
  });
  empty.addEventListener("click", () => askEmpty(page, empty));
  recipe.addEventListener("click", async () => {
    try {
      const [recipes] = await brought(page, "recipes");
      recipes.askRecipe(page, recipe);
    } catch (error) {
      page.say(sentence(error), "bad");
    }
  });
  search.addEventListener("input", () => shelf.find(search.value));
  page.on("gone", (gone) => {
    if (!gone) void shelf.load();
  });
  page.store.listen((changed) => {
    if (changed.has("map")) shelf.mark();
  });
  dropping(page, shelf);
  void shelf.load();
}

class Shelf {
  /** @param {Page} page @param {HTMLElement} into */
  constructor(page, into) {
    this._page = page;
    this._into = into;
    /** @type {Map<string, HTMLButtonElement>} */
    this._cards = new Map();
    /** @type {Map<string, string>} */
    this._pictures = new Map();
    /** @type {Array<() => Promise<void>>} */
    this._queue = [];
    this._busy = 0;
    into.addEventListener("keydown", (event) => this._go(event));
    /** The map that was deleted last, to be had again. @type {Row | null} */
    this._away = null;
    this._seen = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        if (!isIntersecting) continue;
        this._seen.unobserve(target);
        this._picture(/** @type {HTMLImageElement} */ (target));
      }
    });
  }

  async load() {
    try {
      const listed = await this._page.api.json("/api/maps");
      this._show(Array.isArray(listed) ? listed : listed.maps);
    } catch (error) {
      this._page.fault(error);
    }
  }

  /** @param {Row[]} rows */
  _show(rows) {
    this._cards.clear();
    const parts = [];
    for (const [kind, title] of Object.entries(GROUPS)) {
      const some = rows.filter((row) => row.kind === kind);
      if (!some.length) continue;
      parts.push(el("h2", {}, title), el("div", { class: "shelf", role: "group", "aria-label": title }, ...some.map((row) => this._card(row))));
    }
    const away = this._away;
    if (away) parts.unshift(el("button", { type: "button", class: "btn back", onclick: () => void this._put(away, true) }, `Bring back ${away.name}`));
    this._into.replaceChildren(...parts);
    this.mark();
  }

  /** @param {Row} row */
  _card(row) {
    const image = el("img", { alt: "", "data-id": row.id, draggable: "false" });
    const size = row.width ? `${row.width} \u00d7 ${row.height}` : "";
    const free = row.free === null || row.free === undefined ? "" : `, ${Math.round(100 * (row.free <= 1 ? row.free : row.free / ((row.width ?? 1) * (row.height ?? 1))))}% free`;
    const card = el("button", { type: "button", class: "map-card", "aria-pressed": "false", title: `${row.name} ${size}${free}`,
      onclick: () => void this.choose(row) },
    el("span", { class: "picture" }, image), el("span", { class: "name" }, row.name), el("span", { class: "hint" }, size));
    this._cards.set(row.id, card);
    this._seen.observe(image);
    if (row.kind !== "upload") return card;
    const away = el("button", { type: "button", class: "away", title: "Delete", "aria-label": `Delete the map ${row.name}`,
      onclick: () => void this._put(row, false) }, "\u00d7");
    return el("div", { class: "deletable" }, card, away);
  }

  /** @param {Row} row */
  async choose(row) {
    try {
      await this._page.open(row.kind === "bundled" ? row.id : { library: row.id });
    } catch (error) {
      this._page.fault(error);
    }
  }

  /** Delete an uploaded map, or have it back: the server keeps it for a day. @param {Row} row @param {boolean} back */
  async _put(row, back) {
    try {
      await this._page.api.json(`/api/maps/${encodeURIComponent(row.id)}/delete`, back ? { back } : {});
      this._away = back ? null : row;
      await this.load();
      this._page.say(back ? `${row.name} is back.` : `${row.name} is deleted; for a day it can be brought back.`);
    } catch (error) {
      this._page.fault(error);
    }
  }

  /** Fetch a card's picture; a few at once, so that the map itself does not wait behind them. @param {HTMLImageElement} image */
  _picture(image) {
    const id = image.dataset.id ?? "";
    const known = this._pictures.get(id);
    if (known) {
      image.src = known;
      return;
    }
    this._queue.push(async () => {
      const bytes = await this._page.api.bytes(`/api/thumbs/${encodeURIComponent(id)}`);
      const url = URL.createObjectURL(new Blob([/** @type {any} */ (bytes)], { type: "image/png" }));
      this._pictures.set(id, url);
      image.src = url;
    });
    this._work();
  }

  _work() {
    while (this._busy < AT_ONCE) {
      const job = this._queue.shift();
      if (!job) return;
      this._busy++;
      job().catch(() => {}).finally(() => {
        this._busy--;
        this._work();
      });
    }
  }

  /** Show which map is open. */
  mark() {
    const spec = /** @type {any} */ (this._page.store.scenario.map);
    const id = typeof spec === "string" ? spec : spec?.library ?? spec?.bundled;
    for (const [one, card] of this._cards) card.setAttribute("aria-pressed", String(one === id));
    this._stop();
  }

  /** All maps are one stop of Tab: this one, else the open one, else the first. @param {Element} [at] */
  _stop(at) {
    const cards = [...this._cards.values()].filter((card) => !card.closest("[hidden]"));
    const stop = at ?? cards.find((card) => card.getAttribute("aria-pressed") === "true") ?? cards[0];
    for (const card of this._cards.values()) card.tabIndex = card === stop ? 0 : -1;
    return cards;
  }

  /** Arrows go from map to map. @param {KeyboardEvent} event */
  _go(event) {
    const here = /** @type {HTMLButtonElement} */ (event.target);
    const shelf = here.closest(".shelf");
    if (!shelf || !here.matches(".map-card")) return;
    const cards = this._stop(here);
    const row = getComputedStyle(shelf).gridTemplateColumns.split(" ").length;
    const by = { ArrowRight: 1, ArrowLeft: -1, ArrowDown: row, ArrowUp: -row, Home: -cards.length, End: cards.length }[event.key];
    if (!by) return;
    event.preventDefault();
    const next = cards[Math.min(Math.max(cards.indexOf(here) + by, 0), cards.length - 1)];
    this._stop(next);
    next.focus();
  }

  /** @param {string} words */
  find(words) {
    const want = words.trim().toLowerCase();
    for (const [id, card] of this._cards) {
      const box = card.parentElement?.classList.contains("deletable") ? card.parentElement : card;
      box.hidden = want !== "" && !`${id} ${card.title}`.toLowerCase().includes(want);
    }
    for (const shelf of this._into.querySelectorAll(".shelf")) {
      const none = [...shelf.children].every((one) => /** @type {HTMLElement} */ (one).hidden);
      /** @type {HTMLElement} */ (shelf).hidden = none;
      /** @type {HTMLElement} */ (shelf.previousElementSibling).hidden = none;
    }
    this._stop();
  }
}

/**
 * Files become a map; one JSON file that is a scenario becomes the scenario.
 * @param {Page} page @param {Shelf} shelf @param {File[]} files
 */
async function upload(page, shelf, files) {
  if (!files.length) return;
  const size = files.reduce((sum, file) => sum + file.size, 0);
  if (size > MOST) {
    page.say(`${files.map((file) => file.name).join(", ")}: ${(size / 2 ** 20).toFixed(1)} MiB, the app takes 15 at most.`, "bad");
    return;
  }
  const turn = page.turn();
  page.busy("files", true);
  try {
    const scenario = await scenarioIn(page, files);
    if (scenario) {
      if (await page.adopt(scenario, turn)) page.say("The scenario is loaded.", "good");
      return;
    }
    const row = await send(page, files);
    await page.open({ library: row.id }, turn);
    page.say([`${row.name}: ${row.width} \u00d7 ${row.height} cells.`, ...(row.notes ?? [])].join(" "), "good");
    await shelf.load();
  } catch (error) {
    page.fault(error);
  } finally {
    page.busy("files", false);
  }
}

/** Keep files as a map of the library. @param {Page} page @param {File[]} files @returns {Promise<any>} */
async function send(page, files) {
  return (await page.api.call("/api/maps", { bytes: await container(files) })).json();
}

/**
 * The scenario among some files, if one of them is a scenario; a map that it names is one of the others.
 * @param {Page} page @param {File[]} files @returns {Promise<Scenario | null>}
 */
async function scenarioIn(page, files) {
  for (const file of files) {
    if (!/\.(json|ya?ml)$/i.test(file.name)) continue;
    const text = await file.text();
    // A ROS map is YAML as well; no map is JSON.
    const keyed = (/** @type {string} */ key) => new RegExp(`(^|[{,])\\s*["']?${key}["']?\\s*:`, "m").test(text);
    if (!/\.json$/i.test(file.name) && !(keyed("version") && keyed("map"))) continue;
    const { scenario } = await page.api.json("/api/scenario", { name: file.name, text });
    const made = tidy(scenario, file.name);
    const source = /** @type {any} */ (made.map);
    if (typeof source === "object" && "file" in source) {
      const others = files.filter((one) => one !== file);
      if (!others.length) throw new Error(`${file.name} names the map ${source.file}: open both files together.`);
      made.map = { library: (await send(page, others)).id };
    }
    return made;
  }
  return null;
}

/** Files as the server takes them: their number, then name and bytes of each. @param {File[]} files */
async function container(files) {
  const parts = await Promise.all(files.map(async (file) => ({ name: new TextEncoder().encode(file.name), bytes: new Uint8Array(await file.arrayBuffer()) })));
  const size = 4 + parts.reduce((sum, { name, bytes }) => sum + 6 + name.length + bytes.length, 0);
  const made = new Uint8Array(size);
  const view = new DataView(made.buffer);
  view.setUint32(0, parts.length, true);
  let at = 4;
  for (const { name, bytes } of parts) {
    view.setUint16(at, name.length, true);
    made.set(name, at + 2);
    view.setUint32(at + 2 + name.length, bytes.length, true);
    made.set(bytes, at + 6 + name.length);
    at += 6 + name.length + bytes.length;
  }
  return made;
}

/** @param {Page} page @param {Shelf} shelf */
function dropping(page, shelf) {
  const veil = byId("drop");
  veil.textContent = "Drop a map here";
  let depth = 0;
  const files = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files");
  addEventListener("dragenter", (event) => {
    if (!files(event)) return;
    depth++;
    veil.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (files(event) && --depth <= 0) veil.hidden = true;
  });
  addEventListener("dragover", (event) => {
    if (files(event)) event.preventDefault();
  });
  addEventListener("drop", (event) => {
    depth = 0;
    veil.hidden = true;
    if (!files(event)) return;
    event.preventDefault();
    void upload(page, shelf, [...(event.dataTransfer?.files ?? [])]);
  });
}

/** An empty map of a size. @param {Page} page @param {HTMLElement} beside */
function askEmpty(page, beside) {
  const old = document.getElementById("empty-map");
  if (old) {
    old.remove();
    return;
  }
  const width = el("input", { type: "number", min: 2, max: 512, value: 48, "aria-label": "Columns" });
  const height = el("input", { type: "number", min: 2, max: 512, value: 32, "aria-label": "Rows" });
  const make = el("button", { type: "button", class: "btn primary", onclick: () => {
    const w = Number(width.value);
    const h = Number(height.value);
    if (![w, h].every((n) => Number.isInteger(n) && n >= 2 && n <= 512)) {
      page.say("Columns and rows: whole numbers from 2 to 512.", "bad");
      return;
    }
    box.remove();
    page.open({ rows: Array(h).fill(".".repeat(w)), name: "drawn" }).catch(page.fault);
    page.use("wall");
  } }, "Make");
  const box = el("div", { id: "empty-map", class: "row card" }, width, "\u00d7", height, make);
  beside.parentElement?.after(box);
  width.focus();
}
