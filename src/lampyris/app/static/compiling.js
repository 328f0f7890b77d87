// Compiling: the first use of a planner makes machine code for this machine, which takes seconds and is kept. Said
// where one looks for the path meanwhile, so that nothing seems to hang.

import { el } from "./make.js";

/** Milliseconds between two sayings of how long it has taken. */
const BEAT = 1000;
/** Milliseconds that it stays: one kernel is compiled after the other. */
const STAYS = 300;

/** @param {Page} page @param {HTMLElement} stage */
export function mount(page, stage) {
  const words = el("span", {});
  const box = el("p", { class: "compiling", role: "status", hidden: true }, el("i", { class: "spin", "aria-hidden": "true" }), words);
  stage.append(box);
  let began = 0;
  let timer = 0;
  const tell = () => {
    const seconds = Math.round((performance.now() - began) / 1000);
    words.textContent = `Compiling once for this machine${seconds ? `: ${seconds} s` : ""}. The next time it is at hand.`;
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
