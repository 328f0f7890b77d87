// Main: puts the page together.

import { byId, makePage } from "./page.js";

/** Modules and the element each is mounted on, in order: what comes later may use what came before. */
const PARTS = [
  ["flow", "map"], ["theme", "acts"], ["edit", "tools"], ["library", "library"], ["traffic", "traffic"],
  ["settings", "settings"], ["status", "status"], ["layers", "layers"], ["hover", "hover"],
  ["play", "timeline"], ["timeline", "timeline"], ["charts", "charts"], ["compare", "compare"],
  ["study", "compare"], ["keep", "keep"], ["tour", "learn"], ["steps", "learn"], ["keys", "help"],
];

async function main() {
  const token = new URLSearchParams(location.hash.slice(1)).get("t") ?? "";
  const page = makePage(token);
  const parts = await Promise.all(
    PARTS.map(async ([name, id]) => {
      try {
        return { name, id, part: await import(`./${name}.js`) };
      } catch (error) {
        console.error(`${name}.js`, error);
        return { name, id, part: null };
      }
    }),
  );
  for (const { name, id, part } of parts) {
    try {
      part?.mount?.(page, byId(id));
    } catch (error) {
      console.error(`${name}.js`, error);
    }
  }
  for (const { part } of parts) await part?.begin?.(page);
}

main();
