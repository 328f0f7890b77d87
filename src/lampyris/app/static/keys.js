// Keys: everything can be done without a pointer. What typing in a field means is left to the field.

import { copyLink, turnTheme } from "./theme.js";
import { TOOLS } from "./edit.js";
import { el } from "./make.js";
import { byId } from "./page.js";
import { RATES } from "./play.js";
import { fit, zoomBy } from "./view.js";

const SECTIONS = ["library", "settings", "traffic", "now", "compare", "keep", "learn", "fleet"];

/** What the help lists. @type {Array<[string, Array<[string, string]>]>} */
const LIST = [
  ["On the map", [
    ["\u2190 \u2191 \u2192 \u2193", "move the cursor cell; with Shift by ten"], ["Enter", "do what the tool does: set the start or the goal, paint, add a waypoint"],
    ["S  G", "start, goal at the cursor"], ["Q", "turn the heading of the start or goal at the cursor, for planners of poses; with Shift clockwise"], ["W  X", "wall, no wall at the cursor; with Shift in a line from the last one"], ["Esc", "drop the patrol; back to the goal; out of a field"],
  ]],
  ["Maps", [["\u2190 \u2191 \u2192 \u2193", "from map to map"], ["Enter", "open"]]],
  ["Tools", [...TOOLS.map((tool) => /** @type {[string, string]} */ ([tool.key.toUpperCase(), tool.label.toLowerCase()])), ["[  ]", "smaller, larger brush"]]],
  ["Time", [["Space", "play, pause; held: drag the map"], ["R", "run from the beginning"], [",  .", "one tick back, on"], ["<  >", "slower, faster"], ["Home  End", "first, last tick"]]],
  ["On the timeline", [["\u2190  \u2192", "one tick back, on; with Shift ten"], ["PgDn  PgUp", "a twentieth back, on"], ["[  ]", "to the event before, the next"]]],
  ["View", [["+  \u2212", "zoom in, out"], ["0", "the whole map"], ["1 \u2013 8", "map, planner, traffic, status, compare, export, learn, fleet"], ["M", "to the map"], ["U", "measure a distance: with the pointer, or from the cursor with the arrow keys"], ["T", "colours"]]],
  ["Scenario", [["Ctrl K", "commands: every verb, layer, planner, map and example by name"], ["Ctrl Z", "undo"], ["Ctrl Shift Z", "redo"], ["L", "copy the link"], ["?", "this list"]]],
];

/** @param {Page} page @param {HTMLElement} dialog */
export function mount(page, dialog) {
  const help = /** @type {HTMLDialogElement} */ (dialog);
  help.append(
    el("div", { class: "row" }, el("h1", { id: "help-title", class: "grow" }, "Keys"), el("button", { type: "button", class: "btn", onclick: () => help.close() }, "Close")),
    el("div", { class: "keys" }, ...LIST.map(([title, rows]) =>
      el("section", {}, el("h2", {}, title), el("dl", {}, ...rows.flatMap(([keys, words]) =>
        [el("dt", {}, ...keys.split("  ").map((key) => el("kbd", {}, key))), el("dd", {}, words)]))))),
    el("p", { class: "hint" }, "With the mouse: a click sets what the chosen tool says, start and goal can be dragged; the wheel zooms; dashes are what is still to come of a run; dragging the ground, the middle button or Space moves the map; with the brush the right button erases. Files dropped on the page become maps."),
    el("p", { class: "hint" }, "Charts are drawn by uPlot, whose ", el("a", { href: new URL("uplot-licence.txt", import.meta.url).href, target: "_blank", rel: "noopener noreferrer" }, "licence"), " comes along."),
  );
  page.on("help", () => help.showModal());
  help.addEventListener("click", (event) => {
    if (event.target === help) help.close();
  });
  /** The space key: a press plays, unless the map was dragged meanwhile. */
  const space = { held: false, panned: false };

  /** @type {Record<string, () => void>} */
  const plain = {
    "?": () => help.showModal(), "+": () => zoomBy(page, 1.4), "=": () => zoomBy(page, 1.4), "-": () => zoomBy(page, 1 / 1.4),
    0: () => fit(page), ",": () => page.play.step(-1), ".": () => page.play.step(1),
    "<": () => page.play.rate([...RATES].reverse().find((rate) => rate < page.play.speed) ?? RATES[0]), ">": () => page.play.rate(RATES.find((rate) => rate > page.play.speed) ?? page.play.speed),
    Home: () => page.play.seek(0), End: () => page.play.seek(page.play.last),
    r: () => (page.fleet ? page.fleet.again() : void page.simulate({ tick: 0, play: true })), l: () => void copyLink(page), t: () => turnTheme(page),
    u: () => page.tell("measure"), m: () => page.map.canvas.focus(), "[": () => page.tell("brush", -1), "]": () => page.tell("brush", 1),
  };
  for (const tool of TOOLS) plain[tool.key] = () => page.use(tool.name);
  SECTIONS.forEach((section, k) => {
    plain[String(k + 1)] = () => {
      page.show(section);
      document.getElementById(`tab-${section}`)?.focus();
    };
  });

  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || help.open) return;
    const at = /** @type {HTMLElement} */ (event.target);
    const onMap = at === page.map.canvas;
    if ((event.ctrlKey || event.metaKey) && !event.altKey) {
      const key = event.key.toLowerCase();
      if (key === "k" && !document.querySelector("dialog[open]")) {
        event.preventDefault();
        page.tell("palette");
      }
      if ((key !== "z" && key !== "y") || types(at)) return;
      event.preventDefault();
      if (page.fleet) page.say("Walls of a fleet are taken back with the eraser (E).");
      else if (key === "y" || event.shiftKey) page.store.redo();
      else page.store.undo();
      return;
    }
    // Out of a field, so that the other keys mean what the list says.
    if (event.key === "Escape" && types(at)) at.blur();
    if (event.altKey || types(at)) return;
    if (onMap) page.tell("edit-key", event);
    if (event.defaultPrevented) return;
    if (event.key === " ") {
      // On a button it presses the button.
      if (at.closest("button, summary, select, a, [role=slider]")) return;
      event.preventDefault();
      if (event.repeat) return;
      space.held = true;
      space.panned = false;
      page.tell("space", space);
      return;
    }
    if (!onMap && at.closest("[role=slider], select") && /^(Home|End)$/.test(event.key)) return;
    const act = plain[event.key] ?? plain[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  });
  addEventListener("keyup", (event) => {
    if (event.key !== " " || !space.held) return;
    space.held = false;
    page.tell("space", space);
    if (!space.panned) page.play.toggle();
  });
  addEventListener("blur", () => {
    space.held = false;
    page.tell("space", space);
  });
  // Not a link: the address holds the token.
  byId("skip").addEventListener("click", () => page.map.canvas.focus());
}

/** Whether keys go into a field. @param {HTMLElement} at */
function types(at) {
  if (at instanceof HTMLInputElement) return !["checkbox", "radio", "button", "range"].includes(at.type);
  return at instanceof HTMLTextAreaElement || at.isContentEditable;
}
