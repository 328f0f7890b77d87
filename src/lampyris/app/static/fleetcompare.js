// Fleet comparison: every planner of fleets for the same robots, one after another, in a window with a table.

import { ServerError } from "./api.js";
import { pathsOf } from "./fleetrun.js";
import { json, layerOf } from "./frames.js";
import { button, el, fill, formatted, sentence, tell } from "./make.js";

/** @typedef {import("./fleet.js").Fleet} Fleet */
/** A planner with its plan as it came. @typedef {{name: string, title: string, end: Record<string, any> | null, paths: import("./fleetrun.js").Paths | null, avoided: Layer | null, why: string}} Row */

/** @param {Fleet} fleet @param {Record<string, any>} question without a planner */
export function askFleets(fleet, question) {
  return new FleetComparison(fleet, question);
}

class FleetComparison {
  /** @param {Fleet} fleet @param {Record<string, any>} question */
  constructor(fleet, question) {
    this.fleet = fleet;
    this.question = question;
    this.asked = new AbortController();
    /** @type {Row[]} */
    this.rows = [];
    this.words = el("p", { class: "hint", role: "status" });
    this.table = el("div", { class: "wide", tabindex: 0, role: "group", "aria-label": "Planners of fleets compared" });
    this.root = el("dialog", { "aria-labelledby": "fleets-title" },
      el("div", { class: "row" }, el("h1", { id: "fleets-title", class: "grow" }, `Planners of fleets, ${formatted(question.robots)} robots`), button("Close", () => this.root.close())),
      el("p", { class: "hint" }, `The same starts and goals, seed ${question.seed}, ${formatted(question.seconds)} s each.`), this.table, this.words);
    document.body.append(this.root);
    this.root.addEventListener("close", () => {
      this.asked.abort();
      this.root.remove();
    });
    this.root.showModal();
    this.done = this._ask();
  }

  async _ask() {
    const { page } = this.fleet;
    const planners = page.hello.planners_of_fleets;
    page.busy("fleets", true);
    try {
      for (const { name, title } of planners) {
        tell(this.words, `${title}: ${this.rows.length + 1} of ${planners.length}`);
        const row = /** @type {Row} */ ({ name, title, end: null, paths: null, avoided: null, why: "" });
        try {
          for await (const { kind, bytes } of page.api.frames("/api/fleet", { ...this.question, planner: name }, this.asked.signal)) {
            if (kind === "X") throw new ServerError(200, json(bytes));
            if (kind === "R") row.paths = pathsOf(bytes);
            if (kind === "L") row.avoided = layerOf(bytes);
            if (kind === "Z") row.end = json(bytes);
          }
        } catch (error) {
          if (!(error instanceof ServerError)) throw error;
          row.why = sentence(error);
        }
        this.rows.push(row);
        this._draw();
      }
      tell(this.words, "Costs in ticks; no plan costs less than the bound. The least sum of costs is marked.");
    } catch (error) {
      if (!this.asked.signal.aborted) tell(this.words, sentence(error), true);
    } finally {
      page.busy("fleets", false);
    }
  }

  _draw() {
    const sums = this.rows.flatMap(({ end }) => (end?.found ? [end.sum_of_costs] : []));
    const least = Math.min(...sums);
    const cells = (/** @type {Record<string, any> | null} */ end) => (end?.found
      ? [formatted(end.makespan), `${formatted(end.sum_of_costs)}${end.sum_of_costs === least && sums.length > 1 ? " ☆" : ""}`, end.gap === null ? "–" : `${formatted(100 * end.gap, 1)} %`, `${formatted(end.timing?.plan_s, 3)} s`] : ["–", "–", "–", "–"]);
    fill(this.table, el("table", { class: "data" }, el("caption", { class: "unseen" }, "Planners of fleets"),
      el("thead", null, el("tr", null, ...["planner", "makespan", "sum of costs", "above the bound", "planned in", ""].map((word) => el("th", { scope: "col" }, word || el("span", { class: "unseen" }, "show"))))),
      el("tbody", null, ...this.rows.map((row) => this._row(row, cells(row.end))))));
  }

  /** @param {Row} row @param {string[]} cells */
  _row(row, cells) {
    const { title, end } = row;
    const why = row.why || (end?.sentence ?? "");
    return el("tr", null, el("th", { scope: "row", title: why }, title), ...cells.map((text) => el("td", null, text)),
      el("td", null, end?.found ? button("Show", () => this._show(row), { "aria-label": `Show the plan of ${title}` }) : el("span", { class: "hint" }, why)));
  }

  /** The plan of one on the map, as it was made for the table. @param {Row} row */
  _show({ name, paths, avoided, end }) {
    const { fleet, question } = this;
    this.root.close();
    fleet.planners.value = name;
    fleet.about();
    const { robots, seconds, seed } = question;
    fleet.show({ robots, planner: name, seconds, seed }, paths, avoided, /** @type {Record<string, any>} */ (end));
  }
}
