// Study: the comparison sent on as a full study, its progress, and its report in a tab of its own.

import { remember } from "./history.js";
import { block, button, el, sentence, tell } from "./make.js";
import { labelOf, meeting } from "./meeting.js";
import { plansPoses } from "./shape.js";

const POLL = 700;
/** Where the job of this browser's last study is kept, so that a reload finds it. */
const KEPT = "lampyris-study";

/** @param {Page} page @param {HTMLElement} into */
export function mount(page, into) {
  const place = block(into, "study", "Full study");
  if (place) new Study(page, place);
}

class Study {
  /** @param {Page} page @param {HTMLElement} into */
  constructor(page, into) {
    this.page = page;
    this.job = "";
    this.timer = 0;
    this.seeds = el("input", { type: "number", id: "study-seeds", min: 1, max: 1000, step: 1, value: 30 });
    this.queries = el("input", { type: "number", id: "study-queries", min: 1, max: 500, step: 1, value: 10 });
    this.send = button("Send to a study", () => this._send(), { class: "btn primary" });
    this.stop = button("Stop", () => this._stop(), { hidden: true });
    this.open = button("Open the report", () => this._open(), { hidden: true });
    this.bar = el("progress", { "aria-label": "Progress of the study", hidden: true });
    this.words = el("p", { class: "hint", role: "status" });
    this.cannot = el("div", { class: "card stack cannot", hidden: true },
      el("p", null, "Walls are painted that come while the robot drives. A study draws new obstacles for each run and cannot hold them."),
      el("p", null, "Compare above takes them as they are. Or have them there from the start, and send that."),
      el("div", { class: "row" }, button("To Compare", () => document.querySelector("#compare .meeting .btn.primary")?.scrollIntoView({ block: "center" })),
        button("Walls from the start", () => this._early())));
    into.append(
      el("p", { class: "hint" }, "The planners and laws chosen above, from this start to this goal and between others of the map, with statistics and a report. A planner of poses that is chosen in the panel Planner is added: all then drive in continuous time."),
      el("div", { class: "field" }, el("label", { for: "study-queries" }, "starts and goals"), this.queries),
      el("div", { class: "field" }, el("label", { for: "study-seeds" }, "seeds of each"), this.seeds),
      el("div", { class: "row" }, this.send, this.stop, this.open), this.cannot, this.bar, this.words,
    );
    page.store.listen(() => this._can());
    this._can();
    const before = kept();
    if (before) this._watch(before);
  }

  /** Walls that come during a run are in no study: said before it is sent, with what can be done instead. */
  _can() {
    const late = this.page.store.scenario.edits.some((edit) => edit.tick > 0);
    this.cannot.hidden = !late;
    this.send.disabled = late;
  }

  /** All walls at tick 0, the later strokes over the earlier ones; undoable. */
  _early() {
    const { store } = this.page;
    /** @type {Map<string, {cell: Cell, wall: boolean}>} */
    const last = new Map();
    for (const edit of [...store.scenario.edits].sort((a, b) => a.tick - b.tick)) {
      for (const cell of edit.freed) last.set(cell.join(), { cell, wall: false });
      for (const cell of edit.blocked) last.set(cell.join(), { cell, wall: true });
    }
    const of = (/** @type {boolean} */ wall) => [...last.values()].filter((one) => one.wall === wall).map((one) => one.cell);
    store.set({ edits: [{ tick: 0, blocked: of(true), freed: of(false) }] });
  }

  async _send() {
    const { page } = this;
    const who = meeting(page);
    const own = plansPoses(page) && page.store.scenario.planner;
    if (own && !who.planners.some(({ name }) => name === own.name)) who.planners = [{ ...own, label: labelOf(this.page, own) }, ...who.planners];
    const poses = who.planners.some(({ name }) => page.hello.planners_of_poses.some((/** @type {any} */ row) => row.name === name));
    if (!who.planners.length) {
      page.say("Choose somebody to compare first.");
      return;
    }
    this.send.disabled = true;
    tell(this.words, "Sending.");
    try {
      const { job } = await page.api.json("/api/study", {
        scenario: page.asked(!poses), planners: who.planners, laws: who.laws, seeds: whole(this.seeds, 1000), queries: whole(this.queries, 500),
      });
      remember({ job: String(job), when: Date.now(), title: `Study on ${page.ground?.name ?? "a map"}`, met: who });
      this._watch(String(job));
      page.say("The study was sent: how far it is stands in the panel Compare.");
      this.stop.focus();
      this.words.scrollIntoView({ block: "nearest" });
    } catch (error) {
      tell(this.words, sentence(error), true);
      page.fault(error);
    } finally {
      this._can();
    }
  }

  /** @param {string} job */
  _watch(job) {
    this.job = job;
    keep(job);
    this.open.hidden = true;
    this.stop.hidden = false;
    this.bar.hidden = false;
    this.bar.removeAttribute("value");
    clearTimeout(this.timer);
    void this._poll(job);
  }

  /** @param {string} job */
  async _poll(job) {
    if (job !== this.job) return;
    try {
      const now = await this.page.api.json(`/api/study/${encodeURIComponent(job)}`);
      if (job !== this.job) return;
      if (this._show(now)) return;
    } catch (error) {
      if (job !== this.job) return;
      if (/** @type {any} */ (error).status === 404) {
        this._over("That study is gone: the server was restarted.");
        keep("");
        return;
      }
      tell(this.words, "The server does not answer; this goes on when it is back.");
    }
    this.timer = window.setTimeout(() => void this._poll(job), POLL);
  }

  /** How far it is; true when there is nothing more to come. @param {Record<string, any>} now */
  _show(now) {
    const done = Number(now.done ?? 0);
    const all = Number(now.total ?? now.of ?? 0);
    const state = String(now.state ?? (now.report ? "done" : ""));
    if (all) {
      this.bar.max = all;
      this.bar.value = done;
    }
    if (now.error || state === "failed") {
      this._over(now.error?.what ?? now.error ?? "The study failed.", true);
      return true;
    }
    if (state === "cancelled" || state === "stopped") {
      this._over("Stopped.");
      return true;
    }
    if (state === "done" || state === "finished" || now.report === true) {
      this._over(`Done: ${all.toLocaleString("en")} runs.`);
      this.open.hidden = false;
      return true;
    }
    const left = now.left_s ?? now.left;
    const time = typeof left === "number" ? `, about ${duration(left)} left` : "";
    tell(this.words, all ? `${done.toLocaleString("en")} of ${all.toLocaleString("en")} runs${time}.` : "It begins soon.");
    return false;
  }

  /** @param {string} words @param {boolean} [bad] */
  _over(words, bad = false) {
    this.stop.hidden = true;
    this.bar.hidden = true;
    tell(this.words, words, bad);
  }

  async _stop() {
    const { job } = this;
    const number = Number(job);
    try {
      await this.page.api.json("/api/cancel", { job: job !== "" && Number.isInteger(number) ? number : job });
    } catch (error) {
      this.page.fault(error);
    }
  }

  async _open() {
    try {
      const { ticket } = await this.page.api.json("/api/ticket", { job: this.job });
      // A tab of its own that knows nothing of this one.
      window.open(`/view/${encodeURIComponent(ticket)}`, "_blank", "noopener,noreferrer");
    } catch (error) {
      this.page.fault(error);
    }
  }
}

/** @param {HTMLInputElement} input @param {number} most */
function whole(input, most) {
  const value = Math.min(Math.max(Math.round(Number(input.value) || 1), 1), most);
  input.value = String(value);
  return value;
}

/** @param {number} seconds */
function duration(seconds) {
  if (seconds < 90) return `${Math.max(1, Math.round(seconds))} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}

function kept() {
  try {
    return sessionStorage.getItem(KEPT) ?? "";
  } catch {
    return "";
  }
}

/** @param {string} job */
function keep(job) {
  try {
    sessionStorage.setItem(KEPT, job);
  } catch {
    // Then a reload forgets it.
  }
}
