// Live: the app's page without a server. What it asks is answered by Python in a worker of this page (worker.js), or, where
// that cannot run, by a recording. The page itself is the app's own, in static/; only what carries its requests differs.

import { wire } from "./static/api.js";

/** A map small enough that plans in plain Python follow the mouse. */
const FIRST = "env-3";

/** @typedef {{status: number, kind: string, more: ReadableStreamDefaultController<Uint8Array> | null, heard: (answer: Response) => void}} Open */

/** Python in a worker. */
class Worked {
  constructor() {
    this.worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
    /** @type {Map<number, Open>} */
    this.open = new Map();
    this.last = 0;
    this.ready = new Promise((resolve, reject) => {
      this.worker.onerror = (event) => reject(new Error(event.message || "the worker could not be loaded"));
      this.worker.onmessage = ({ data }) => {
        if (data.ready) resolve(data.ready);
        else if (data.failed) reject(new Error(data.failed));
        else if (data.stage) say(data.stage);
        else this.hear(data);
      };
    });
  }

  /** @param {{id: number, status?: number, kind?: string, piece?: Uint8Array, end?: boolean}} data */
  hear({ id, status, kind, piece, end }) {
    const one = this.open.get(id);
    if (!one) return;
    if (status) {
      const stream = new ReadableStream({ start: (more) => { one.more = more; }, cancel: () => this.cancel(id) });
      one.heard(new Response(stream, { status, headers: { "Content-Type": kind ?? "" } }));
    }
    if (piece) one.more?.enqueue(piece);
    if (end) {
      this.open.delete(id);
      one.more?.close();
    }
  }

  /** @param {number} id */
  cancel(id) {
    this.open.delete(id);
    this.worker.postMessage({ cancel: id });
  }

  /** @param {string} path @param {RequestInit} init @returns {Promise<Response>} */
  ask(path, init) {
    const id = ++this.last;
    return new Promise((heard, refused) => {
      const { signal } = init;
      if (signal?.aborted) return refused(signal.reason);
      /** @type {Open} */
      const one = { status: 0, kind: "", more: null, heard };
      this.open.set(id, one);
      signal?.addEventListener("abort", () => {
        if (!this.open.has(id)) return;
        this.cancel(id);
        refused(signal.reason);
        one.more?.error(signal.reason);
      });
      this.worker.postMessage({ id, path, body: init.body ?? undefined });
    });
  }
}

/** Answers that were recorded when the page was built: one scenario, and what the app asks of it. */
class Recorded {
  /** @param {{link: string, answers: Record<string, {status: number, kind: string, body: string}>, same: Record<string, unknown>}} all */
  constructor(all) {
    this.all = all;
  }

  /** @param {string} path @param {RequestInit} init @returns {Promise<Response>} */
  async ask(path, init) {
    const body = typeof init.body === "string" ? JSON.parse(init.body) : null;
    const key = body?.layer ? `${path} ${body.layer}` : path;
    const found = this.all.answers[key];
    if (!found || (body?.scenario && !this.same(body.scenario))) {
      const what = "This is a recording: the browser or this copy of the page cannot run Python, so nothing new is computed";
      return Response.json({ error: { code: "RECORDED", what } }, { status: 400 });
    }
    const bytes = Uint8Array.from(atob(found.body), (letter) => letter.charCodeAt(0));
    return new Response(bytes, { status: found.status, headers: { "Content-Type": found.kind } });
  }

  /** @param {Record<string, any>} scenario */
  same(scenario) {
    const { planner, edits } = scenario;
    const asked = { map: scenario.map, start: scenario.start, goal: scenario.goal, planner: planner?.name ?? planner };
    return JSON.stringify(asked) === JSON.stringify(this.all.same) && !edits?.length;
  }
}

/** How far the start has come; empty: it is done. @param {string} words */
function say(words) {
  const banner = /** @type {HTMLElement} */ (document.getElementById("starting"));
  banner.textContent = words;
  banner.hidden = !words;
}

async function begin() {
  const made = await (await fetch(new URL("made.json", import.meta.url))).json();
  const root = document.documentElement;
  let why = made.python ? "" : "This copy of the page was built without Python: what follows is a recording.";
  if (!why && typeof WebAssembly !== "object") why = "This browser has no WebAssembly: what follows is a recording.";
  if (!why) {
    try {
      const worked = new Worked();
      say("Starting Python in this page ...");
      root.dataset.python = JSON.stringify(await worked.ready);
      wire.ask = (path, init) => worked.ask(path, init);
      root.dataset.live = "python";
      if (!location.hash) history.replaceState(null, "", `#m=${FIRST}`);
    } catch (error) {
      console.warn(error);
      why = "Python could not be started in this page: what follows is a recording.";
    }
  }
  if (why) {
    const recorded = new Recorded(await (await fetch(new URL("recorded.json", import.meta.url))).json());
    wire.ask = (path, init) => recorded.ask(path, init);
    root.dataset.live = "recorded";
    history.replaceState(null, "", recorded.all.link);
  }
  say(why);
  await import("./static/main.js");
}

begin();
