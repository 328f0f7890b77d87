// Page: what all modules share, who hears what, and what is said to the person.

import { Api, Gone, ServerError } from "./api.js";
import { el } from "./make.js";
import { MapView } from "./map.js";
import { fragment } from "./link.js";
import { Store } from "./state.js";

/** The element with this id; the page is ours, so it is there. @param {string} id */
export function byId(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/** @param {string} token @returns {Page} */
export function makePage(token) {
  /** @type {Map<string, Set<(detail: any) => void>>} */
  const hears = new Map();
  const nothing = () => {};
  /** @type {Set<string>} */
  const working = new Set();
  /** @type {Page} */
  const page = {
    store: new Store(), api: new Api(token), map: new MapView(/** @type {HTMLCanvasElement} */ (byId("map"))),
    hello: null, ground: null, base: null, plan: null, run: null, dark: false, gone: false, tool: "goal", fleet: null,
    // Until the player is mounted.
    play: { tick: 0, last: 0, playing: false, speed: 1, seek: nothing, toggle: nothing, step: nothing, rate: nothing, hold: nothing },
    on(name, hear) {
      if (!hears.has(name)) hears.set(name, new Set());
      hears.get(name)?.add(hear);
    },
    tell(name, detail) {
      for (const hear of hears.get(name) ?? []) {
        try {
          hear(detail);
        } catch (error) {
          // One module's mistake must not silence the others.
          console.error(error);
        }
      }
    },
    busy(who, on) {
      working[on ? "add" : "delete"](who);
      page.tell("busy", working.size > 0);
    },
    say, fault,
    simulate: async () => {}, stop: nothing, replan: nothing, turn: () => 0, open: async () => false, adopt: async () => false,
    asked: () => page.store.scenario, drives: () => false, driving: "", planning: false, driver: null, link: async () => location.href.split("#")[0],
    titleOf: (name) => ["planners", "planners_of_poses", "planners_of_fleets"].flatMap((key) => page.hello[key]).find((row) => row.name === name)?.title ?? name,
    show: nothing, use: nothing, met: () => fragment().get("c") ?? "",
  };
  page.map.onView = () => page.tell("map");
  page.api.onGone = (gone) => {
    if (gone === page.gone) return;
    page.gone = gone;
    page.tell("gone", gone);
  };
  return page;
}

/** Say a sentence: on the screen for a while, and to a screen reader. @param {string} sentence @param {Tone} [tone] */
function say(sentence, tone = "note") {
  byId("live").textContent = sentence;
  const notes = byId("notes");
  for (const old of [...notes.children]) {
    if (old.firstElementChild?.textContent === sentence) old.remove();
  }
  while (notes.children.length > 2) notes.firstElementChild?.remove();
  const note = el("div", { class: `note ${tone}` }, el("span", { class: "grow" }, sentence));
  note.append(el("button", { type: "button", "aria-label": "Dismiss", onclick: () => note.remove() }, "\u00d7"));
  notes.append(note);
  setTimeout(() => note.remove(), tone === "bad" ? 12000 : 5000);
}

/** @param {unknown} error */
function fault(error) {
  if (error instanceof Gone) return; // The banner says it.
  if (error instanceof DOMException && error.name === "AbortError") return;
  if (error instanceof ServerError) {
    if (error.fault.code !== "CANCELLED") say(error.message, "bad");
    return;
  }
  console.error(error);
  say(error instanceof Error ? error.message : String(error), "bad");
}
