// Gone: what is said when the server does not answer, and how it is found again. Nothing that was drawn is lost:
// it is in the page, in the browser's draft and in the link.
//
// A page that asks for nothing hears of nothing: a run that is all there plays on without a server. So a page that
// is looked at asks now and then whether somebody is there.
//
// And what is said while code is compiled: the first use of a planner makes machine code for this machine, which takes
// seconds and is kept.

import { wire } from "./api.js";
import { el } from "./make.js";
import { byId } from "./page.js";

const AGAIN = 2500;
/** Milliseconds without an answer to anything after which the server is asked whether it is there. */
const SILENT = 3000;
/** Milliseconds after which one that does not answer that is called gone. */
const PATIENT = 10_000;

/** @param {Page} page */
export function mount(page) {
  const banner = byId("gone");
  const words = el("span", { class: "grow" });
  const again = el("button", { type: "button", class: "btn" }, "Try again");
  banner.append(words, again);
  let timer = 0;

  const ask = async () => {
    clearTimeout(timer);
    if (!page.gone) return;
    let status = 0;
    try {
      status = (await wire.ask("/api/hello", { method: "HEAD", headers: { "X-Lampyris-Token": page.api.token }, cache: "no-store", credentials: "omit" })).status;
    } catch {
      // Still gone.
    }
    words.textContent = status === 401
      ? "This page's token is not the running server's: lampyris app was started again. Open the address that it printed, in this tab; everything you drew is kept."
      : `The server is gone. Everything you drew is kept in this browser. Start it again with "lampyris app --port ${location.port}", then open the address that it prints, in this tab.`;
    if (status === 200) page.api.onGone(false);
    else timer = window.setTimeout(ask, AGAIN);
  };
  again.addEventListener("click", () => void ask());

  const beat = async () => {
    const { api } = page;
    if (!page.gone && !document.hidden && page.hello && performance.now() - api.heard >= SILENT) {
      const late = AbortSignal.timeout(PATIENT);
      try {
        await (await api.call("/api/hello", { method: "HEAD", signal: late })).arrayBuffer();
      } catch {
        if (late.aborted) api.onGone(true);
      }
    }
    setTimeout(beat, SILENT);
  };
  setTimeout(beat, SILENT);
  page.on("token", () => {
    page.gone = true;
    void ask();
  });
  const show = (/** @type {boolean} */ gone) => {
    banner.hidden = !gone;
    clearTimeout(timer);
    if (gone) {
      words.textContent = "The server does not answer. Everything you drew is kept in this browser.";
      timer = window.setTimeout(ask, 300);
    } else {
      page.say("The server is back.", "good");
    }
  };
  page.on("gone", show);
  // An old token is refused before there is anybody here to hear of it.
  if (page.gone) show(true);
  mountCompiling(page, byId("stage"));
}

// ---- while code is compiled ----

/** Milliseconds between two sayings of how long it has taken. */
const BEAT = 1000;
/** Milliseconds that it stays: one kernel is compiled after the other. */
const STAYS = 300;

/** @param {Page} page @param {HTMLElement} stage */
function mountCompiling(page, stage) {
  const words = el("span", {});
  const box = el("p", { class: "compiling", role: "status", hidden: true }, el("i", { class: "spin", "aria-hidden": "true" }), words);
  stage.append(box);
  let began = 0;
  let timer = 0;
  const tell = () => {
    const seconds = Math.round((performance.now() - began) / 1000);
    words.textContent = `Compiling once for this machine${seconds ? `: ${seconds} s` : ""}. Later it is loaded.`;
  };
  let over = 0;
  page.api.onCompiling = (on) => {
    clearTimeout(over);
    if (!on) {
      over = window.setTimeout(() => {
        box.hidden = true;
        clearInterval(timer);
      }, STAYS);
      return;
    }
    if (!box.hidden) return;
    box.hidden = false;
    began = performance.now();
    tell();
    timer = window.setInterval(tell, BEAT);
  };
}
