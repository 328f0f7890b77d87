"""A robot with a sensor and a goal that moves, as the page is sent them and as it reads them."""

from __future__ import annotations

import base64
import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from test_page_play import needs_node, node, payload

from lampyris.app.engine.bootstrap import hello
from lampyris.app.engine.frames import json_frame
from lampyris.app.engine.parse import scenario_of_request
from lampyris.app.engine.simulation import begin, header, watch
from lampyris.model.trace import Trace

SCENARIO = {
    "version": 1,
    "map": "guide",
    "planner": "dstar-lite",
    "goal": [7, 0],
    "obstacles": [],
    "simulate": {"sensor_range": 2.5, "unseen_cost": 1.5, "goal_track": [[7, 0], [7, 0], [7, 1]]},
}


@pytest.fixture(scope="module")
def sent() -> tuple[list[bytes], Trace]:
    """Head and frames of a run, and its trace."""
    scenario = scenario_of_request({"scenario": SCENARIO})
    run = begin(scenario)
    frames = [json_frame("H", header(run, scenario)), *watch(run, lambda: None)]
    return frames, run.trace()


def test_what_was_seen_is_sent_with_its_ticks(sent: tuple[list[bytes], Trace]) -> None:
    frames, trace = sent
    head = json.loads(payload(frames[0]))
    assert head["sensor"] == [2.5, math.tau]
    assert head["goal_track"] == [[7, 0], [7, 0], [7, 1]]
    assert trace.seen is not None
    seen = np.full(trace.seen.size, -1)
    for one in frames:
        if chr(one[4]) == "U":
            (n,) = struct.unpack("<I", one[5:9])
            cells, ticks = np.frombuffer(one[9:], "<u4").reshape(2, n)
            assert (seen[cells] == -1).all()
            seen[cells] = ticks
    assert np.array_equal(seen, trace.seen.ravel())


@needs_node
def test_the_page_reads_them(sent: tuple[list[bytes], Trace], tmp_path: Path) -> None:
    frames, trace = sent
    script = """
    import { addSeen, newRun } from "./frames.js";
    import { goalAt, seenAt } from "./runs.js";
    const [head, ...parts] = process.argv.slice(2);
    const run = newRun(JSON.parse(head));
    for (const part of parts) addSeen(new Uint8Array(Buffer.from(part, "base64")), run);
    const at = [0, 1.5, 9].map((t) => goalAt(run, t));
    console.log(JSON.stringify([[...run.seen], at, seenAt(run, 3.7).t, seenAt(newRun({}), 1)]));
    """
    parts = [base64.b64encode(payload(one)).decode() for one in frames if chr(one[4]) == "U"]
    seen, goals, tick, known = node(tmp_path, script, payload(frames[0]).decode(), *parts)
    assert trace.seen is not None
    assert seen == trace.seen.ravel().tolist()
    assert goals == [[7, 0], [7, 0.5], [7, 1]]
    assert (tick, known) == (3.7, None)


@needs_node
def test_a_sensor_looks_where_the_robot_moved_last(tmp_path: Path) -> None:
    """Before its first move it sees all around it; while it waits it looks where it looked before."""
    script = """
    import { travelled } from "./unseen.js";
    const robot = Int16Array.from([3, 3, 3, 3, 4, 3, 4, 3, 3, 4]);
    const at = (more) => [0, 1.5, 2, 3.9, 4, 9].map((t) => travelled({ robot, ticks: 5, ...more }, t));
    console.log(JSON.stringify([at({}), at({ step: 0.05 })]));
    """
    right, down_left = 0.0, pytest.approx(0.75 * math.pi)
    ticks, drive = node(tmp_path, script)
    # A drive looks ahead along its path.
    assert drive == [None, None, down_left, down_left, down_left, down_left]
    assert ticks == [None, None, right, right, down_left, down_left]


@needs_node
def test_a_narrow_sensor_that_reaches_beyond_the_map_shows_its_sides_on_it(tmp_path: Path) -> None:
    """A circle as large would be outside the map, and is not drawn."""
    script = """
    globalThis.document = { createElement: () => ({ getContext: () => ({ putImageData() {} }) }) };
    globalThis.ImageData = class { constructor(w, h) { this.data = new Uint8ClampedArray(4 * w * h); } };
    const { shade } = await import("./unseen.js");
    const { View } = await import("./view.js");
    const view = Object.assign(new View(), { width: 200, height: 200, scale: 10, x: 40, y: 60 });
    const map = { ground: { width: 8, height: 6 }, view, moment: { robot: [4, 3] }, dark: false, ratio: 1 };
    const drawn = (reach, angle) => {
      const calls = [];
      const pen = new Proxy({}, { get: (_, name) => (...said) => calls.push([name, ...said]), set: () => true });
      const run = { seen: new Int32Array(48), reach, angle, robot: Int16Array.from([3, 3, 4, 3]), ticks: 2 };
      shade(pen, map, { run, t: 1 });
      return calls.filter(([name]) => ["rect", "clip", "moveTo", "arc"].includes(name));
    };
    console.log(JSON.stringify([drawn(1e6, 1), drawn(1e6, 2 * Math.PI), drawn(2, 1)]));
    """
    far, circle, near = node(tmp_path, script)
    box, tip = [["rect", 40, 60, 80, 60], ["clip"]], ["moveTo", 85, 95]
    assert far == [*box, tip, ["arc", 85, 95, 140, -0.5, 0.5]]
    assert near == [*box, tip, ["arc", 85, 95, 20, -0.5, 0.5]]
    assert circle == []


def test_the_form_has_the_sensor() -> None:
    fields = {one["name"]: one for one in hello()["simulate"]}
    assert (fields["sensor_range"]["default"], fields["sensor_range"]["unit"]) == (None, "metres")
    assert (fields["unseen_cost"]["default"], fields["unseen_cost"]["most"]) == (1.0, 5.0)
