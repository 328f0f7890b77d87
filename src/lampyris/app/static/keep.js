// Keep: what is shown as a file. The server makes it, from the scenario alone; the browser saves it.

import { bytes, fileOf, safe, save } from "./filed.js";
import { block, button, el, sentence, tell } from "./make.js";
import { meeting } from "./meeting.js";

/** What, how its name ends, what it is. @type {Array<{title: string, kinds: Array<[string, string, string]>}>} */
const GROUPS = [
  { title: "To send", kinds: [["replay", "html", "Interactive page: play and scrub the run in any browser, without lampyris"]] },
  { title: "Picture", kinds: [["png", "png", "Map and path as an image"], ["svg", "svg", "The same as a drawing, sharp at any size"]] },
  { title: "Film", kinds: [["webp", "webp", "The whole run, small and sharp"], ["gif", "gif", "The whole run, plays anywhere"],
    ["webm", "webm", "The same as a video, made by this browser"], ["mp4", "mp4", "The same, for slides and chats"]] },
  { title: "Numbers", kinds: [["csv", "csv", "Tick by tick: where it was, how fast, and why"]] },
  {
    title: "Files and reports", kinds: [
      ["scenario", "yaml", "What decides the run: the command line replays it to the same bytes"],
      ["report", "html", "One page about the run: pictures, film, numbers, events"],
      ["compared", "html", "One page about those chosen to meet, with statistics"],
    ],
  },
];

const FILMS = new Set(["webp", "gif", "webm", "mp4"]);

/** What the server does, and what it counts meanwhile. @type {Record<string, [string, string]>} */
const STAGES = {
  compiling: ["Compiling once for this machine", ""], working: ["Making the file", ""], running: ["Running the simulation", "tick"], driving: ["Driving", "second"], drawing: ["Drawing the film", "frames"],
  writing: ["Writing the file", ""], encoding: ["Making the video", "frames"], comparing: ["Running", "runs"],
};
const WORDS = /** @type {Record<string, string>} */ ({ png: "PNG", svg: "SVG", webp: "WebP", gif: "GIF", webm: "WebM", mp4: "MP4", csv: "CSV", scenario: "Scenario", replay: "HTML", report: "Report", compared: "Comparison" });

/** @param {Page} page @param {HTMLElement} into */
export function mount(page, into) {
  const place = block(into, "keeping", "Export");
  if (place) new Keep(page, place);
}

class Keep {
  /** @param {Page} page @param {HTMLElement} into */
  constructor(page, into) {
    this.page = page;
    /** @type {AbortController | null} */
    this.asked = null;
    this.stage = "";
    /** Say where it is. */
    this._beat = () => {};
    /** @type {HTMLButtonElement[]} */
    this.buttons = [];
    this.name = el("input", { type: "text", id: "keep-name", maxlength: 60, spellcheck: "false", autocomplete: "off" });
    this.now = el("input", { type: "checkbox", id: "keep-now" });
    this.words = el("p", { class: "hint", role: "status" });
    this.shows = el("p", { class: "hint", id: "keep-shows" });
    this.bar = el("progress", { hidden: true, "aria-label": "Making the file" });
    this.stop = button("Stop", () => this.asked?.abort(), { hidden: true });
    into.append(el("div", { class: "field named" }, el("label", { for: "keep-name" }, "name"), this.name));
    for (const { title, kinds } of GROUPS) {
      into.append(el("h3", null, title), el("div", { class: "stack kinds" }, ...kinds.map(([what, ending, about]) => this._kind(what, ending, about))));
      if (title === "Picture") {
        into.append(this.shows, el("div", { class: "field flag" }, el("label", { for: "keep-now" }, "PNG: the shown moment, not the plan"), this.now));
      }
    }
    into.append(this.bar, el("div", { class: "row" }, this.words, this.stop));
    const rename = () => (this.name.placeholder = nameOf(page));
    // Whoever hears of it first puts the layer onto the map.
    const refresh = () => queueMicrotask(() => (this.shows.textContent = shows(page, this.now.checked)));
    page.store.listen(rename);
    page.on("ground", rename);
    for (const name of ["layer", "layer-came", "run", "end", "tick"]) page.on(name, refresh);
    page.store.listen(refresh);
    this.now.addEventListener("change", refresh);
    rename();
    refresh();
  }

  /** @param {string} what @param {string} ending @param {string} about */
  _kind(what, ending, about) {
    const made = button(WORDS[what], () => this._keep(what, ending));
    this.buttons.push(made);
    return el("div", { class: "kind" }, made, el("span", { class: "hint" }, about));
  }

  /** @param {string} what @param {string} ending */
  async _keep(what, ending) {
    const { page } = this;
    const { start, goal } = page.store.scenario;
    if (what !== "scenario" && !(start ?? page.ground?.start) && !(goal ?? page.ground?.goal)) {
      page.say("Set a start and a goal on the map first.");
      return;
    }
    const asked = new AbortController();
    this.asked = asked;
    this._busy(true);
    const name = `${safe(this.name.value) || nameOf(page)}${{ compared: "-compared", replay: "-replay" }[what] ?? ""}.${ending}`;
    const began = performance.now();
    this.stage = `Making ${name}`;
    const beat = () => {
      const seconds = Math.round((performance.now() - began) / 1000);
      tell(this.words, `${this.stage}${seconds ? `, ${seconds} s` : ""}.`);
    };
    const clock = window.setInterval(beat, 250);
    this._beat = beat;
    beat();
    try {
      const body = /** @type {Record<string, any>} */ ({ scenario: page.asked(what === "compared"), what: what === "compared" ? "report" : what });
      if (what === "compared") body.settings = meeting(page);
      const moment = this.now.checked && what === "png" && page.run;
      if (moment) body.tick = Math.round(page.play.tick);
      // Films and moments know every layer, pictures of the plan two.
      if (FILMS.has(what) || what === "replay" || moment) body.settings = { layer: page.map.layer?.name ?? "none" };
      else if (what === "png" || what === "svg") body.settings = { layer: beneath(page) };
      const file = await fileOf(page, body, ending, asked.signal, (said) => this._share(said));
      // A scenario too large for YAML comes as JSON.
      const said = what === "scenario" && (await file.slice(0, 1).text()) === "{" ? name.replace(/yaml$/, "json") : name;
      save(file, said);
      tell(this.words, `Saved ${said}, ${bytes(file.size)}.`);
    } catch (error) {
      tell(this.words, asked.signal.aborted ? "Stopped." : sentence(error), !asked.signal.aborted);
      if (!asked.signal.aborted) page.fault(error);
    } finally {
      clearInterval(clock);
      this.bar.removeAttribute("value");
      this.asked = null;
      this._busy(false);
    }
  }

  /** How far it is. Nobody knows when a run will end, so that its ticks are counted alone. @param {{what: string, done?: number, of?: number | null}} said */
  _share({ what, done = 0, of }) {
    const [doing, unit] = STAGES[what.split(" ")[0]] ?? [what, ""];
    const share = of && what !== "running" ? Math.round((100 * done) / of) : null;
    this.stage = share !== null ? `${doing}: ${done} of ${of} ${unit}, ${share} %` : done ? `${doing}: ${unit} ${done}` : doing;
    if (share === null) this.bar.removeAttribute("value");
    else this.bar.value = share / 100;
    this._beat();
  }

  /** @param {boolean} busy */
  _busy(busy) {
    for (const one of this.buttons) one.disabled = busy;
    this.bar.hidden = !busy;
    this.stop.hidden = !busy;
    this.page.busy("keep", busy);
  }
}

/** The layer of a picture: the one that is shown, of those that pictures know. @param {Page} page */
function beneath(page) {
  const name = page.map.layer?.name ?? "none";
  return name === "luciferin" || name === "cost" ? name : "none";
}

/** What picture and film will show, where that is not all that the screen does. @param {Page} page @param {boolean} now */
function shows(page, now) {
  const name = page.titleOf(page.store.scenario.planner.name);
  const shown = page.map.layer?.name;
  const layer = beneath(page);
  const under = layer !== "none" ? `with ${layer} beneath` : shown ? `without a layer (they know cost and luciferin, not ${shown})` : "without a layer";
  const films = shown ? ` Films have ${shown} beneath.` : "";
  if (page.drives()) return `Pictures show the plan of ${name}, ${under}; films and the PNG of a moment the drive of its own controller, without a layer.`;
  const some = page.map.moment.others?.length ? ` Of those compared they show ${name} alone; the file Comparison has them all.` : "";
  return `Pictures show the plan of ${name}, ${under}${now && page.run ? "; the PNG the shown moment of its run, as films do" : ""}.${films}${some}`;
}

/** Map, planner and seed as a file's name. @param {Page} page */
function nameOf(page) {
  const { name, planner, seed } = page.store.scenario;
  return safe(name ?? "") || safe(`${page.ground?.name || "lampyris"}-${planner.name}-seed-${seed}`);
}
