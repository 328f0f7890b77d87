// Fleet comparison: every planner of fleets for the same robots, one after another, in a window with a table.

import { ServerError } from "./api.js";
import { json } from "./frames.js";
import { button, el, fill, formatted, sentence, tell } from "./make.js";

/** @typedef {import("./fleet.js").Fleet} Fleet */

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
    /** @type {Array<{name: string, end: Record<string, any> | null, why: string}>} */
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
      for (const { name } of planners) {
        tell(this.words, `${name}: ${this.rows.length + 1} of ${planners.length}`);
        const row = { name, end: /** @type {Record<string, any> | null} */ (null), why: "" };
        try {
          for await (const { kind, bytes } of page.api.frames("/api/fleet", { ...this.question, planner: name }, this.asked.signal)) {
            if (kind === "X") throw new ServerError(200, json(bytes));
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
      el("tbody", null, ...this.rows.map(({ name, end, why }) => el("tr", null, el("th", { scope: "row", title: why || end?.sentence }, name), ...cells(end).map((text) => el("td", null, text)),
        el("td", null, end?.found ? button("Show", () => this._show(name), { "aria-label": `Show the plan of ${name}` }) : el("span", { class: "hint" }, why || end?.sentence || "")))))));
  }

  /** The plan of one on the map. @param {string} name */
  _show(name) {
    const { fleet } = this;
    this.root.close();
    fleet.planners.value = name;
    fleet.planners.dispatchEvent(new Event("change"));
    void fleet.plan();
  }
}
