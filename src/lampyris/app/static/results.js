// Results: what a comparison or a study found, in a window of its own that can be resized: a table to be sorted, every
// measure on an axis of its own, settings beside measures as parallel coordinates, and the studies that were sent.

import { LINES } from "./colours.js";
import { forget, history } from "./history.js";
import { button, el, fill, formatted, sentence, svg, tell } from "./make.js";
import { MEASURES, STARS, numbersOf, swatch } from "./measures.js";

/** @typedef {import("./measures.js").Entrant} Entrant */
/** @typedef {import("./measures.js").Estimate} Estimate */
/** @typedef {{title: string, some: Entrant[], bests: import("./measures.js").Bests, met: import("./meeting.js").Meeting}} Found */
/** A column of the parallel coordinates: a place 0 to 1 for each entrant, null where it has none, and its ends in words. @typedef {{title: string, at: Array<number | null>, low: string, high: string, words: string[]}} Axis */

const WIDE = 250;
/** Axes that are shown before somebody chooses others. */
const FIRST = ["cost", "time_s", "near_m", "plan_s"];

/** @type {Results | null} */
let only = null;

/** Show what was found, or the studies. @param {Page} page @param {Found | null} found */
export function askResults(page, found) {
  only ??= new Results(page);
  only.open(found);
}

class Results {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** @type {Found | null} */
    this.found = null;
    /** By what the table is sorted: a measure, or nothing; and whether downwards. */
    this.by = "";
    this.down = false;
    /** The entrant that stands out; -1: none. */
    this.lit = -1;
    /** @type {Set<string>} */
    this.axes = new Set(FIRST);
    this.title = el("h2", { id: "results-title" });
    this.size = button("Full window", () => this._size(), { "aria-pressed": "false" });
    this.table = el("div", { class: "rs-table wide", tabindex: 0, role: "group", "aria-label": "Table of results" });
    this.who = el("div", { class: "row rs-who", role: "group", "aria-label": "Highlight" });
    this.multiples = el("div", { class: "rs-multiples" });
    this.same = el("p", { class: "hint" });
    this.chosen = el("div", { class: "row", role: "group", "aria-label": "Axes" });
    this.parallel = el("div", { class: "rs-parallel wide", tabindex: 0, role: "group", "aria-label": "Parallel coordinates" });
    this.words = el("p", { class: "hint", role: "status" });
    this.studies = el("ul", { class: "plain rs-studies" });
    this.body = el("div", { class: "stack" }, this.who, el("h3", null, "Table"), this.table, el("h3", null, "Measures, each on an axis of its own"), this.multiples, this.same,
      el("h3", null, "Settings and measures"), this.chosen, this.parallel);
    this.dialog = el("dialog", { id: "results", class: "results-page", "aria-labelledby": "results-title" },
      el("div", { class: "row rs-head" }, this.title, el("span", { class: "grow" }), this.size, button("Close", () => this.dialog.close(), { "aria-label": "Close the results" })),
      this.words, this.body, el("h3", null, "Studies"), this.studies);
    document.head.append(el("link", { rel: "stylesheet", href: "/static/results.css" }));
    document.body.append(this.dialog);
    page.on("theme", () => this.dialog.open && this._draw());
  }

  /** @param {Found | null} found */
  open(found) {
    if (found) this.found = found;
    this.lit = -1;
    this._draw();
    void this._studies();
    if (!this.dialog.open) this.dialog.showModal();
  }

  _size() {
    const full = this.dialog.classList.toggle("full");
    this.size.setAttribute("aria-pressed", String(full));
  }

  _draw() {
    const { found } = this;
    this.title.textContent = found?.title ?? "Results";
    this.body.hidden = !found;
    if (!found) {
      tell(this.words, "No comparison of planners on cells yet. Such comparisons, and studies, are shown here; drives are compared in the panel Compare.");
      return;
    }
    tell(this.words, "");
    fill(this.who, ...found.some.map((one, k) => el("button", {
      type: "button", class: "btn quiet", "aria-pressed": String(this.lit === k), onclick: () => this._light(this.lit === k ? -1 : k),
    }, swatch(k), one.label)));
    this._table(found);
    const all = measured(found.some);
    const same = all.filter((measure) => isSame(measure, found.some));
    fill(this.multiples, ...all.filter((measure) => !same.includes(measure)).map((measure) => multiple(measure, found.some, this.lit)));
    this.same.textContent = same.length ? `The same for all: ${same.map(([name, title]) => `${title} ${formatted(found.some.find((one) => one.estimates.has(name))?.estimates.get(name)?.value)}`).join(", ")}.` : "";
    this._parallel(found);
  }

  /** @param {number} k */
  _light(k) {
    this.lit = k;
    this._draw();
    /** @type {HTMLElement | undefined} */ (this.who.querySelectorAll("button")[Math.max(k, 0)])?.focus();
  }

  // ---- the table --------------------

  /** @param {Found} found */
  _table({ some, bests }) {
    const columns = measured(some);
    const order = some.map((_, k) => k);
    const value = (/** @type {number} */ k) => some[k].estimates.get(this.by)?.value ?? NaN;
    if (this.by) {
      order.sort((a, b) => {
        const [x, y] = [value(a), value(b)];
        if (Number.isNaN(x) || Number.isNaN(y)) return Number(Number.isNaN(x)) - Number(Number.isNaN(y));
        return this.down ? y - x : x - y;
      });
    }
    const head = (/** @type {import("./measures.js").Measure} */ [name, title, better]) => el("th", {
      scope: "col", "aria-sort": this.by !== name ? "none" : this.down ? "descending" : "ascending",
    }, el("button", { type: "button", title: better ? `${better} is better` : null, onclick: () => this._sort(name, better) }, title, el("span", { "aria-hidden": "true" }, this.by !== name ? "" : this.down ? " \u2193" : " \u2191")));
    const scales = new Map(columns.map(([name]) => [name, scaleOf(some.map((one) => one.estimates.get(name)))]));
    const cell = (/** @type {number} */ k, /** @type {string} */ name) => {
      const one = some[k].estimates.get(name);
      const { who, sure } = bests[name] ?? { who: [], sure: false };
      const star = !who.includes(some[k].label) ? null : sure ? "\u2605" : "\u2606";
      return el("td", star && sure ? { class: "best" } : null, formatted(one?.value),
        star ? el("span", { class: "star", title: STARS[star] }, ` ${star}`, el("span", { class: "unseen" }, ` ${STARS[star]}`)) : null,
        one && one.low !== null ? interval(one, /** @type {Scale} */ (scales.get(name)), k) : null);
    };
    const held = /** @type {HTMLElement | null} */ (document.activeElement)?.closest(".rs-table th");
    const at = held ? [.../** @type {HTMLElement} */ (held.parentElement).children].indexOf(held) : -1;
    fill(this.table, el("table", { class: "data" }, el("caption", { class: "unseen" }, "Press a heading to sort by it"),
      el("thead", null, el("tr", null, el("th", { scope: "col" }, "planner, law"), ...columns.map(head))),
      el("tbody", null, ...order.map((k) => el("tr", { class: this.lit === k ? "lit" : null }, el("th", { scope: "row" }, swatch(k), ` ${some[k].label}`), ...columns.map(([name]) => cell(k, name)))))));
    if (at >= 0) /** @type {HTMLElement | null} */ (this.table.querySelectorAll("thead th")[at]?.firstElementChild)?.focus();
  }

  /** @param {string} name @param {string} better */
  _sort(name, better) {
    if (this.by === name) this.down = !this.down;
    else this.down = better === "more";
    this.by = name;
    if (this.found) this._table(this.found);
  }

  // ---- parallel coordinates --------------------

  /** @param {Found} found */
  _parallel({ some, met }) {
    const all = measured(some).filter(([name]) => new Set(some.map((one) => one.estimates.get(name)?.value)).size > 1);
    fill(this.chosen, ...all.map(([name, title]) => {
      const box = el("input", { type: "checkbox", onchange: () => {
        if (box.checked) this.axes.add(name);
        else this.axes.delete(name);
        if (this.found) drawn(this.found);
      } });
      box.checked = this.axes.has(name);
      return el("label", { class: "check" }, box, title);
    }));
    const drawn = (/** @type {Found} */ { some: entrants }) => {
      const axes = [...settingAxes(this.page, entrants, met), ...all.filter(([name]) => this.axes.has(name)).map(([name, title]) => measureAxis(name, title, entrants))];
      fill(this.parallel, axes.length > 1 ? coordinates(axes, entrants, this.lit) : el("p", { class: "hint" }, "Nothing differs here: compare several planners, laws or settings, or choose two measures."));
    };
    drawn({ title: "", some, bests: {}, met });
  }

  // ---- studies --------------------

  async _studies() {
    const rows = history();
    fill(this.studies, ...rows.map((sent) => el("li", null, sent.title)));
    if (!rows.length) {
      fill(this.studies, el("li", { class: "hint" }, "None yet: \u201cSend to a study\u201d in the panel Compare begins one."));
      return;
    }
    const lines = await Promise.all(rows.map((sent) => this._study(sent)));
    fill(this.studies, ...lines);
  }

  /** A line of the list. @param {import("./history.js").Sent} sent */
  async _study(sent) {
    const { page } = this;
    const when = new Date(sent.when).toLocaleString("en", { dateStyle: "medium", timeStyle: "short" });
    const about = `${sent.title}, ${when}: ${sent.met.planners.map(({ label }) => label).join(", ")}`;
    /** @type {Record<string, any>} */
    let now = {};
    let state = "";
    try {
      now = await page.api.json(`/api/study/${encodeURIComponent(sent.job)}`);
      state = now.state === "running" ? `${now.done} of ${now.total} runs` : String(now.state);
    } catch (error) {
      state = /** @type {any} */ (error).status === 404 ? "gone: the server was restarted since" : sentence(error);
    }
    const open = () => this.open({ title: about, some: entrantsOf(now.results), bests: now.results.best ?? {}, met: sent.met });
    return el("li", { class: "row" }, el("span", { class: "grow" }, `${about} (${state})`),
      now.results ? button("Show here", open, { "aria-label": `Show here: ${about}` }) : null,
      now.report ? button("Report", () => void this._report(sent.job), { "aria-label": `Report: ${about}` }) : null,
      button("\u00d7", () => {
        forget(sent.job);
        void this._studies();
      }, { class: "btn quiet icon", "aria-label": `Remove from the list: ${about}` }));
  }

  /** @param {string} job */
  async _report(job) {
    try {
      const { ticket } = await this.page.api.json("/api/ticket", { job });
      window.open(`/view/${encodeURIComponent(ticket)}`, "_blank", "noopener,noreferrer");
    } catch (error) {
      this.page.fault(error);
    }
  }
}

/** Entrants of a study's summary. @param {Record<string, any>} results @returns {Entrant[]} */
function entrantsOf(results) {
  return results.entries.map((/** @type {any} */ one) => ({ label: one.entrant, outcome: "", estimates: numbersOf({}, one.own) }));
}

/** The measures of which there are numbers. @param {Entrant[]} some */
function measured(some) {
  return MEASURES.filter(([name]) => some.some((one) => one.estimates.has(name)));
}

/** Whether a measure tells nobody from the others. @param {import("./measures.js").Measure} measure @param {Entrant[]} some */
function isSame([name], some) {
  const numbers = some.map((one) => one.estimates.get(name));
  return numbers.every((one) => one?.low === null && one.value === numbers[0]?.value);
}

// ---- small drawings --------------------

/** From a value to pixels, and the ends. @typedef {{x: (value: number) => number, low: number, high: number}} Scale */

/** @param {Array<Estimate | undefined>} numbers @param {number} [wide] @returns {Scale} */
function scaleOf(numbers, wide = 64) {
  const ends = numbers.flatMap((one) => (one ? [one.value, one.low ?? one.value, one.high ?? one.value] : []));
  const [low, high] = [Math.min(...ends), Math.max(...ends)];
  const room = wide - 8;
  return { x: (value) => 4 + (high > low ? (room * (value - low)) / (high - low) : room / 2), low, high };
}

/** A mean with its interval. @param {Estimate} one @param {Scale} scale @param {number} k @param {number} [wide] */
function interval(one, { x }, k, wide = 64) {
  const [from, to] = [x(one.low ?? one.value), x(one.high ?? one.value)];
  const said = one.low === null ? "" : `95 % interval ${formatted(one.low)} to ${formatted(one.high)}`;
  return svg("svg", { class: "rs-interval", viewBox: `0 0 ${wide} 12`, width: wide, height: 12, ...(said ? { role: "img", "aria-label": said } : { "aria-hidden": "true" }) },
    ...(said ? [svg("title", {}, said), svg("path", { class: "whisker", d: `M${from} 6H${to}M${from} 2v8M${to} 2v8` })] : []),
    svg("circle", { cx: x(one.value), cy: 6, r: 3.5, fill: LINES[k % LINES.length][0] }));
}

/** One measure of all. @param {import("./measures.js").Measure} measure @param {Entrant[]} some @param {number} lit */
function multiple([name, title, better], some, lit) {
  const numbers = some.map((one) => one.estimates.get(name));
  const scale = scaleOf(numbers, WIDE - 74);
  return el("figure", { class: "rs-one" }, el("figcaption", null, title, better ? el("span", { class: "hint" }, ` ${better} is better`) : null),
    ...numbers.map((one, k) => el("div", { class: lit === k ? "rs-line lit" : lit >= 0 ? "rs-line dim" : "rs-line", title: some[k].label },
      el("span", { class: "rs-name" }, some[k].label), one ? interval(one, scale, k, WIDE - 74) : el("span", null), el("b", null, formatted(one?.value)))),
    el("div", { class: "rs-line" }, el("span", null), el("div", { class: "rs-ends" }, el("span", null, formatted(scale.low)), el("span", null, scale.high > scale.low ? formatted(scale.high) : ""))));
}

/** Settings that differ among those that met, and planners and laws. @param {Page} page @param {Entrant[]} some @param {import("./meeting.js").Meeting} met @returns {Axis[]} */
function settingAxes(page, some, { planners, laws }) {
  // Entrants are pairs, law by law for each planner.
  const pairs = planners.flatMap((planner) => laws.map((law) => ({ planner, law })));
  if (pairs.length !== some.length) return [];
  /** @type {Map<string, Array<unknown>>} */
  const columns = new Map([["planner", pairs.map(({ planner }) => page.titleOf(planner.name))], ["speed law", pairs.map(({ law }) => law.name)]]);
  for (const who of /** @type {const} */ (["planner", "law"])) {
    for (const key of new Set(pairs.flatMap((pair) => Object.keys(pair[who].settings)))) columns.set(key, pairs.map((pair) => pair[who].settings[key] ?? null));
  }
  return [...columns].filter(([, values]) => new Set(values.map(String)).size > 1).map(([title, values]) => settingAxis(title, values));
}

/** @param {string} title @param {unknown[]} values @returns {Axis} */
function settingAxis(title, values) {
  const words = values.map((value) => (value === null ? "default" : String(value)));
  const numbers = values.map((value) => (typeof value === "number" ? value : null));
  if (numbers.every((value, k) => value !== null || values[k] === null) && numbers.some((value) => value !== null)) {
    const scale = scaleOf(numbers.map((value) => (value === null ? undefined : { value, low: null, high: null })), 9);
    return { title, at: numbers.map((value) => (value === null ? null : scale.x(value) - 4)), low: formatted(scale.low), high: formatted(scale.high), words };
  }
  const kinds = [...new Set(words)];
  return { title, at: words.map((word) => (kinds.length > 1 ? kinds.indexOf(word) / (kinds.length - 1) : 0.5)), low: kinds[0], high: kinds[kinds.length - 1], words };
}

/** @param {string} name @param {string} title @param {Entrant[]} some @returns {Axis} */
function measureAxis(name, title, some) {
  const numbers = some.map((one) => one.estimates.get(name));
  const scale = scaleOf(numbers, 9);
  return { title, at: numbers.map((one) => (one ? scale.x(one.value) - 4 : null)), low: formatted(scale.low), high: formatted(scale.high), words: numbers.map((one) => formatted(one?.value)) };
}

/** @param {Axis[]} axes @param {Entrant[]} some @param {number} lit */
function coordinates(axes, some, lit) {
  const [apart, top, foot] = [150, 34, 210];
  const wide = 110 + apart * (axes.length - 1) + 110;
  const x = (/** @type {number} */ c) => 110 + apart * c;
  const y = (/** @type {number} */ at) => foot - at * (foot - top);
  const lines = some.map((one, k) => {
    const [colour, dash] = LINES[k % LINES.length];
    let [d, open] = ["", false];
    axes.forEach((axis, c) => {
      const at = axis.at[k];
      if (at !== null) d += `${open ? "L" : "M"}${x(c)} ${y(at)}`;
      open = at !== null;
    });
    const said = `${one.label}: ${axes.map((axis) => `${axis.title} ${axis.words[k]}`).join(", ")}`;
    return svg("g", { class: lit === k ? "lit" : lit >= 0 ? "dim" : null }, svg("title", {}, said), svg("path", { d, stroke: colour, "stroke-dasharray": dash.join(" ") || null }),
      ...axes.flatMap((axis, c) => (axis.at[k] === null ? [] : [svg("circle", { cx: x(c), cy: y(/** @type {number} */ (axis.at[k])), r: 4, fill: colour })])));
  });
  const words = some.map((one, k) => `${one.label}: ${axes.map((axis) => `${axis.title} ${axis.words[k]}`).join(", ")}`);
  return svg("svg", { class: "rs-coordinates", viewBox: `0 0 ${wide} 236`, width: wide, height: 236, role: "img", "aria-label": `Parallel coordinates. ${words.join(". ")}.` },
    ...axes.flatMap((axis, c) => [
      svg("line", { x1: x(c), x2: x(c), y1: top, y2: foot }), svg("text", { x: x(c), y: 12, class: "head" }, axis.title),
      svg("text", { x: x(c), y: top - 6 }, axis.high), svg("text", { x: x(c), y: foot + 14 }, axis.low),
    ]), ...lines);
}
