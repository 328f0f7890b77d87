// Viewer of fleets: the paths of many robots.

import { FleetPicture } from "../static/fleetdraw.js";
import { FleetClock, FleetRun, pathsOf } from "../static/fleetrun.js";
import { FleetSeen } from "../static/fleetseen.js";
import { framesOf, json } from "../static/frames.js";
import { byId } from "../static/page.js";
import { dataOf, keys, stageOf, unpacked } from "./stage.js";

async function main() {
  const data = dataOf();
  /** What the modules of the panel Fleet know as the fleet. @type {any} */
  const fleet = { swarm: { on: false }, run: null, end: null, picture: null, pick };
  document.body.classList.add("fleet");
  const page = await stageOf(data, (cell) => fleet.picture && pick(fleet.picture.near(cell)));
  const { ground, map } = page;
  if (!ground) return;
  fleet.page = page;
  page.fleet = fleet;
  for await (const { kind, bytes } of framesOf(unpacked(data.stream))) {
    if (kind === "R") fleet.run = new FleetRun(pathsOf(bytes), ground.width, ground.height);
    else if (kind === "Z") fleet.end = json(bytes);
  }
  /** @type {FleetSeen | null} */
  let seen = null;
  const clock = new FleetClock(page, () => {
    map.draw();
    seen?.moment();
  });
  fleet.clock = page.play = clock;
  clock.bar.id = "fleet-time";
  byId("timeline").append(clock.bar);
  if (fleet.run) {
    fleet.picture = map.actors = new FleetPicture(page, fleet.run, clock);
    clock.changed(fleet.run.last);
  }
  seen = new FleetSeen(fleet);
  page.on("theme", () => seen?.draw());
  byId("now").append(byId("facts"));
  keys(page);
  map.refresh();
  document.body.classList.add("ready");

  /** @param {number | null} robot */
  function pick(robot) {
    if (!fleet.picture) return;
    fleet.picture.chosen = robot;
    map.refresh();
    seen?.draw();
  }
}

void main();
