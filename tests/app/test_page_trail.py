"""The way behind the robot, in Node: what is drawn into the base once, and what in each frame."""

from __future__ import annotations

from pathlib import Path

from test_page_play import needs_node, node

TRAIL = """
import { Trail } from "./marks.js";
import { View } from "./view.js";

const view = new View();
const on = { dark: false, layered: false };
const n = 300;
const cells = Float32Array.from({ length: 2 * n }, (_, k) => (k % 2 ? 0 : k < 200 ? k : 200));
const shares = Float32Array.from({ length: n }, (_, k) => ((k >> 3) % 5) / 5);
/** A pen that writes down its strokes. */
function pen() {
  const strokes = [];
  let line = [];
  return {
    strokes, beginPath: () => (line = []), moveTo: (x) => line.push(x), lineTo: (x) => line.push(x),
    stroke() { strokes.push([this.strokeStyle, this.lineWidth, line[0], line.at(-1), line.length]); },
  };
}
const way = (count, version = 0) => ({ cells, shares, count, version });

const played = pen();
const trail = new Trail();
let most = 0;
for (let count = 1; count <= 290; count++) {
  trail.settle(played, view, way(count), on);
  const frame = pen();
  trail.draw(frame, view, way(count), on);
  most = Math.max(most, ...frame.strokes.map((stroke) => stroke[4]));
}
const leapt = pen();
const other = new Trail();
const empty = other.holds(null);
other.settle(leapt, view, way(290), on);
console.log(JSON.stringify({
  same: JSON.stringify(played.strokes) === JSON.stringify(leapt.strokes),
  strokes: played.strokes.length, most, empty,
  on: other.holds(way(291)), back: other.holds(way(289)), far: other.holds(way(100)), none: other.holds(null),
  another: other.holds(way(290, 1)), forgot: (other.forget(), other.holds(way(5))),
}));
"""


@needs_node
def test_the_trail_is_the_same_played_or_leapt_and_a_frame_draws_its_end(tmp_path: Path) -> None:
    told = node(tmp_path, TRAIL)
    assert told["same"]
    assert told["strokes"] > 10
    assert told["most"] <= 2 * 32 + 8
    assert {key for key, said in told.items() if said is True} == {"same", "empty", "on", "forgot"}
