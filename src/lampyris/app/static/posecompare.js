// Pose comparison: planners of poses, and others with them, in the same world: each drives its own path in continuous
// time, and all drives are played together. Loaded with the first one.

import { ServerError } from "./api.js";
import { driver } from "./driven.js";
import { asked } from "./flow.js";
import { addEvents, json, newRun } from "./frames.js";
import { sentence } from "./make.js";

/**
 * A drive for each planner, the longest first, with the others as its rivals. @param {Page} page @param {Array<Who & {label: string}>} planners
 * @param {AbortSignal} signal @param {(words: string) => void} progress @returns {Promise<Run[]>}
 */
export async function askDrives(page, planners, signal, progress) {
  page.driver = driver;
  const { scenario } = page.store;
  /** @type {Run[]} */
  const runs = [];
  for (const { name, settings, label } of planners) {
    const poses = page.hello.planners_of_poses.some((/** @type {any} */ row) => row.name === name);
    const question = asked({ ...scenario, planner: { name, settings }, drive: scenario.drive ?? {} }, poses, true);
    progress(`${label}: ${runs.length + 1} of ${planners.length}`);
    let run = newRun({ planner: name });
    try {
      for await (const { kind, bytes } of page.api.frames("/api/drive", { scenario: question }, signal)) {
        if (kind === "X") throw new ServerError(200, json(bytes));
        else if (kind === "H") run = newRun(json(bytes));
        else if (kind === "D") driver.addSamples(bytes, run);
        else if (kind === "E") addEvents(bytes, run);
        else if (kind === "P") progress(`${label}: ${driver.progressOf(json(bytes)) || "planning"}`);
        else if (kind === "Z") run.end = json(bytes);
      }
    } catch (error) {
      if (!(error instanceof ServerError)) throw error;
      // The others go on; the table says why this one has no numbers.
      run.end = { outcome: "refused", sentence: sentence(error) };
    }
    run.label = label;
    run.done = true;
    runs.push(run);
  }
  runs.sort((a, b) => b.ticks - a.ticks);
  if (runs[0]) runs[0].rivals = runs.slice(1);
  return runs;
}

/** What each did, as a table. @param {Run[]} runs */
export function askTable(runs) {
  return driver.resultsOf(runs);
}
