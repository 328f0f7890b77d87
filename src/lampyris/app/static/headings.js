// Headings: where robots and obstacles with an outline look in simulations in ticks.
//
// During a step they turn evenly, the shorter way, to the direction of the step, and have it at its end, as obstacles that are
// polygons do in drives; what stands keeps its heading. In ticks the simulation itself knows cells, and no headings.

/** Ticks that are looked back for the last step. */
const BACK = 500;

/** @param {number} dx @param {number} dy */
function direction(dx, dy) {
  return dx || dy ? Math.atan2(-dy, dx) : null;
}

/**
 * A heading at a moment. @param {(k: number) => [number, number] | null} at a place at a tick; null: not there
 * @param {number} last the last tick @param {number} t @param {number} first the heading before anything has moved
 */
function headingBy(at, last, t, first) {
  const step = (/** @type {number} */ k) => {
    const [a, b] = [at(k), at(k + 1)];
    return a && b ? direction(b[0] - a[0], b[1] - a[1]) : null;
  };
  const now = Math.max(0, Math.min(Math.floor(t), last));
  let before = first;
  for (let k = now - 1; k >= Math.max(0, now - BACK); k--) {
    const found = step(k);
    if (found === null) continue;
    before = found;
    break;
  }
  const share = now < last ? t - now : 0;
  const next = share > 0 ? step(now) : null;
  if (next === null) return before;
  const turn = next - before;
  return before + share * Math.atan2(Math.sin(turn), Math.cos(turn));
}

/** Of an obstacle of a simulation in ticks. @param {Run} run @param {number} b its number @param {number} t */
export function bodyHeading(run, b, t) {
  const at = (/** @type {number} */ k) => {
    const places = run.places[k];
    return places && 2 * b + 1 < places.length && places[2 * b] >= -0.75 ? /** @type {[number, number]} */ ([places[2 * b], places[2 * b + 1]]) : null;
  };
  return headingBy(at, run.ticks - 1, t, run.bodies[b].yaw ?? 0);
}

/** Of the robot of a simulation in ticks; it begins in the direction of its first step. @param {Run} run @param {number} t */
export function robotHeading(run, t) {
  const { robot, ticks } = run;
  let first = 0;
  for (let k = 0; k + 1 < ticks; k++) {
    const found = direction(robot[2 * k + 2] - robot[2 * k], robot[2 * k + 3] - robot[2 * k + 1]);
    if (found === null) continue;
    first = found;
    break;
  }
  return headingBy((k) => [robot[2 * k], robot[2 * k + 1]], ticks - 1, t, first);
}
