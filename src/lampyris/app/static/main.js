// Main: puts the page together.

import { mountPart } from "./later.js";
import { makePage } from "./page.js";
import { fragment } from "./link.js";

/** Modules and the element each is mounted on, in order: what comes later may use what came before. */
const PARTS = [
  ["tabs", "left"], ["panels", "left"], ["gone", "gone"], ["state", "map"], ["play", "timeline"], ["flow", "map"], ["theme", "acts"], ["edit", "tools"],
  ["library", "library"], ["welcome", "welcome"], ["status", "status"], ["layers", "layers"], ["legend", "legend"],
  ["timeline", "timeline"], ["charts", "charts"], ["opening", "learn"], ["keys", "help"],
  ["later", "left"],
];

async function main() {
  const page = makePage(fragment().get("t") ?? "");
  const greeting = hello(page);
  const parts = await Promise.all(PARTS.map(load));
  mount(parts.filter(({ name }) => name === "tabs" || name === "gone"), page);
  page.hello = await greeting;
  mount(parts.filter(({ name }) => name !== "tabs" && name !== "gone"), page);
  for (const { part } of parts) await part?.begin?.(page);
  document.body.classList.add("ready");
}

/** What there is to choose from; asked until there is an answer. @param {Page} page */
async function hello(page) {
  let again = () => {};
  page.on("gone", (gone) => {
    if (!gone) again();
  });
  addEventListener("hashchange", ({ newURL }) => (page.api.token = fragment(new URL(newURL).hash).get("t") ?? ""));
  for (;;) {
    try {
      return await page.api.json("/api/hello");
    } catch (error) {
      page.fault(error);
    }
    await new Promise((go) => {
      again = () => go(undefined);
      setTimeout(go, 10000);
    });
  }
}

/** @param {string[]} row */
async function load([name, id]) {
  try {
    return { name, id, part: await import(`./${name}.js`) };
  } catch (error) {
    console.error(`${name}.js`, error);
    return { name, id, part: null };
  }
}

/** @param {Array<{name: string, id: string, part: any}>} parts @param {Page} page */
function mount(parts, page) {
  for (const { name, id, part } of parts) mountPart(page, name, id, part);
}

main();
