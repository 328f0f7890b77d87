"""The clock of a run and the frames it reads, in Node: the page's own files, without a browser."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris.app.engine.frames import NOWHERE, frame, json_frame, layer_frame, ticks_frame
from lampyris.app.engine.simulation import WORDS
from lampyris.report.style import CAUSES

STATIC = files("lampyris.app").joinpath("static")
NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="node is not installed (apt-get install nodejs)")

PLAYER = """
import { Player } from "./play.js";

/** A page without a screen. Frames come when they are asked for with `turn`. */
export function pageOf(run) {
  const heard = new Map();
  const frames = [];
  globalThis.requestAnimationFrame = (f) => frames.push(f);
  const page = {
    run, ground: { resolution: 0.5 }, asked: 0, told: [],
    map: { moment: { robot: null, bodies: null, kinds: [], radii: [], trail: null }, draw() {} },
    on: (name, f) => heard.set(name, [...(heard.get(name) ?? []), f]),
    tell: (name, detail) => {
      page.told.push(name);
      for (const f of heard.get(name) ?? []) f(detail);
    },
    simulate: async () => page.asked++,
    turn: (now) => frames.splice(0).forEach((f) => f(now)),
    waiting: () => frames.length,
  };
  page.play = new Player(page);
  return page;
}

/** A run of so many ticks; one body is there from the start, one comes at tick 3. */
export function runOf(ticks, whole = ticks) {
  const run = {
    ticks, done: ticks === whole, robot: new Int16Array(2 * whole), speed: new Float32Array(whole),
    cause: new Uint8Array(whole), causes: ["limit"], near: new Float32Array(whole), events: [], end: null,
    bodies: [
      { kind: "patrol", radius: 0.25, yields: true }, { kind: "crossing", radius: 0.5, yields: false },
    ],
    places: [],
  };
  for (let k = 0; k < whole; k++) {
    run.robot[2 * k] = 2 * k;
    run.robot[2 * k + 1] = 10 - k;
    run.speed[k] = k;
    run.places.push(Int16Array.from(k < 2 ? [k, 0] : k < 3 ? [k, 0, -32768, -32768] : [k, 0, 4, k]));
  }
  return run;
}

/** A run of which nothing has come. */
export function noRun() {
  return {
    ticks: 0, robot: new Int16Array(0), speed: new Float32Array(0), cause: new Uint8Array(0),
    near: new Float32Array(0), places: [], events: [], bodies: [],
  };
}

export function shown(page) {
  const { robot, bodies, trail, kinds, radii } = page.map.moment;
  return {
    tick: page.play.tick, robot: robot && [...robot],
    bodies: bodies && [...bodies].map((v) => (Number.isNaN(v) ? null : v)),
    way: trail && [...trail.cells.subarray(0, 2 * trail.count)],
    shares: trail && [...trail.shares.subarray(0, trail.count)],
    kinds: [...kinds], radii: [...radii],
  };
}
"""


def node(tmp_path: Path, script: str, *sent: Any) -> Any:
    """What a script prints as JSON, run beside the page's files; ``sent``: its arguments."""
    assert NODE is not None
    for file in STATIC.iterdir():
        if file.name.endswith(".js"):
            (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "player.js").write_text(PLAYER)
    (tmp_path / "script.js").write_text(script)
    done = subprocess.run(
        [NODE, "script.js", *map(str, sent)], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def payload(piece: bytes) -> bytes:
    """A frame without length and kind."""
    assert struct.unpack("<I", piece[:4])[0] == len(piece) - 4
    return piece[5:]


@needs_node
def test_ticks_arrive_as_they_were_sent(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    sent: dict[str, Any] = {"robot": [], "speed": [], "cause": [], "near": [], "places": []}
    first = 0
    for number, (n, bodies) in enumerate([(1, 0), (3, 0), (5, 1), (300, 3), (2, 7)]):
        robot = rng.integers(0, 2000, (n, 2)).astype(np.int32)
        speed = rng.random(n).astype(np.float32)
        cause = rng.integers(0, len(WORDS), n).astype(np.uint8)
        places = rng.integers(0, 2000, (n, bodies, 2)).astype(np.int16)
        places[rng.random((n, bodies)) < 0.3] = NOWHERE
        near = rng.random(n).astype(np.float32)
        near[rng.random(n) < 0.3] = np.inf
        piece = ticks_frame(first, robot, speed.astype(float), cause, places, near.astype(float))
        (tmp_path / f"{number}.bin").write_bytes(payload(piece))
        first += n
        sent["robot"] += robot.ravel().tolist()
        sent["speed"] += speed.tolist()
        sent["cause"] += cause.tolist()
        sent["near"] += [v if np.isfinite(v) else None for v in near.tolist()]
        sent["places"] += places.reshape(n, -1).tolist()
    script = """
import { readFileSync } from "node:fs";
import { addTicks } from "./frames.js";
import { noRun } from "./player.js";
const run = noRun();
for (let k = 0; k < 5; k++) {
  // As a part of a larger buffer, at an odd place: nothing may rely on where it lies.
  const bytes = readFileSync(`${k}.bin`);
  const room = new Uint8Array(bytes.length + 3);
  room.set(bytes, 3);
  addTicks(room.subarray(3), run);
}
const n = run.ticks;
console.log(JSON.stringify({
  robot: [...run.robot.subarray(0, 2 * n)], speed: [...run.speed.subarray(0, n)],
  cause: [...run.cause.subarray(0, n)],
  near: [...run.near.subarray(0, n)], places: run.places.map((one) => [...one]),
}));
"""
    assert node(tmp_path, script) == sent


@needs_node
@pytest.mark.parametrize("wrong", ["late", "short", "long"])
def test_ticks_that_do_not_fit_are_refused(tmp_path: Path, wrong: str) -> None:
    robot, cause = np.zeros((2, 2), dtype=np.int32), np.zeros(2, dtype=np.uint8)
    places = np.zeros((2, 1, 2), dtype=np.int16)
    first = 1 if wrong == "late" else 0
    piece = payload(ticks_frame(first, robot, np.zeros(2), cause, places, np.zeros(2)))
    piece = {"late": piece, "short": piece[:-1], "long": piece + b"\0"}[wrong]
    (tmp_path / "one.bin").write_bytes(piece)
    script = """
import { readFileSync } from "node:fs";
import { addTicks } from "./frames.js";
import { noRun } from "./player.js";
const run = noRun();
let said = "";
try { addTicks(new Uint8Array(readFileSync("one.bin")), run); } catch (error) { said = error.message; }
console.log(JSON.stringify([said, run.ticks]));
"""
    said, ticks = node(tmp_path, script)
    assert ticks == 0
    assert {"late": "ticks from 1 on", "short": "bytes", "long": "bytes"}[wrong] in said


@needs_node
def test_streamed_frames_are_read_wherever_they_are_cut(tmp_path: Path) -> None:
    values = np.array([[np.inf, 1.0, 3.0], [2.0, np.inf, 1.0]])
    events = [{"tick": 3, "word": "appear", "cell": [1, 2], "sentence": "x", "obstacle": {"kind": "patrol"}}]
    pieces = [
        json_frame("H", {"a": 1}),
        frame("B", b""),
        layer_frame("cost", values),
        json_frame("E", events),
    ]
    (tmp_path / "all.bin").write_bytes(b"".join(pieces) * 40)
    script = """
import { readFileSync } from "node:fs";
import { addEvents, framesOf, json, layerOf } from "./frames.js";
import { noRun } from "./player.js";
const all = new Uint8Array(readFileSync("all.bin"));
const seen = new Set();
for (const size of [1, 2, 3, 5, 7, 64, all.length]) {
  const parts = [];
  for (let k = 0; k < all.length; k += size) parts.push(all.subarray(k, k + size));
  const stream = new ReadableStream({
    pull(out) {
      const part = parts.shift();
      if (part) out.enqueue(part);
      else out.close();
    },
  });
  const run = noRun();
  const told = [];
  for await (const { kind, bytes } of framesOf(stream)) {
    if (kind === "E") addEvents(bytes, run);
    const layer = kind === "L" ? layerOf(bytes) : null;
    told.push(layer ? { ...layer, values: [...layer.values] } : kind === "H" ? json(bytes) : kind);
  }
  seen.add(JSON.stringify([told, run.events.length, run.bodies.length]));
}
console.log(JSON.stringify([...seen].map((text) => JSON.parse(text))));
"""
    layer = {
        "name": "cost",
        "width": 3,
        "height": 2,
        "low": 1.0,
        "high": 3.0,
        "values": [0, 1, 255, 128, 0, 1],
    }
    assert node(tmp_path, script) == [[[{"a": 1}, "B", layer, "E"] * 40, 40, 40]]


@needs_node
def test_a_moment_lies_between_its_ticks(tmp_path: Path) -> None:
    script = """
import { pageOf, runOf, shown } from "./player.js";
const page = pageOf(runOf(11));
page.tell("run", { tick: 0, play: false });
const at = (t) => { page.play.seek(t); return shown(page); };
console.log(JSON.stringify([at(0), at(2.5), at(3), at(4.25), at(99), at(-1), at(NaN)]));
"""
    start, half, come, quarter, over, before, none = node(tmp_path, script)
    assert (start["robot"], start["bodies"], start["way"]) == ([0, 10], [0, 0, None, None], [0, 10])
    assert (start["kinds"], start["radii"]) == (["patrol", "crossing"], [0.5, 1])
    # Who comes at tick 3 is not seen before.
    assert (half["robot"], half["bodies"]) == ([5, 7.5], [2.5, 0, None, None])
    assert half["way"] == [0, 10, 2, 9, 4, 8, 5, 7.5]
    assert come["bodies"] == [3, 0, 4, 3]
    assert come["way"] == [0, 10, 2, 9, 4, 8, 6, 7], "the node that was bent is straight again"
    assert (quarter["robot"], quarter["bodies"]) == ([8.5, 5.75], [4.25, 0, 4, 4.25])
    assert quarter["shares"][:5] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])
    assert (over["tick"], over["robot"]) == (10, [20, 0])
    assert before == none == start


@needs_node
def test_what_is_shown_does_not_depend_on_the_way_there(tmp_path: Path) -> None:
    script = """
import { pageOf, runOf, shown } from "./player.js";
let s = 12345;
const random = () => (s = (1103515245 * s + 12345) % 2147483648) / 2147483648;
const run = runOf(40);
const page = pageOf(run);
page.tell("run", { tick: 0, play: false });
let bad = 0;
for (let k = 0; k < 400; k++) {
  const t = random() < 0.3 ? Math.floor(40 * random()) : 39 * random();
  page.play.seek(t);
  const fresh = pageOf(run);
  fresh.tell("run", { tick: 0, play: false });
  fresh.play.seek(t);
  if (JSON.stringify(shown(page)) !== JSON.stringify(shown(fresh))) bad++;
}
const { moment } = page.map;
const kept = [moment.bodies, moment.robot, moment.trail];
page.play.seek(3.3);
const now = [moment.bodies, moment.robot, moment.trail];
console.log(JSON.stringify([bad, now.every((one, k) => one === kept[k])]));
"""
    assert node(tmp_path, script) == [0, True]


@needs_node
def test_it_plays_at_its_speed_waits_for_what_is_to_come_and_stops_at_the_end(tmp_path: Path) -> None:
    script = """
import { PACE } from "./play.js";
import { pageOf, runOf, shown } from "./player.js";
const said = [];
const run = runOf(5, 30);
const page = pageOf(run);
page.tell("run", { tick: 0, play: true });
let now = 1000;
const play = (ms) => { for (let k = 0; k < ms / 10; k++) page.turn((now += 10)); };
play(10);
play(250);
said.push(page.play.tick / (0.25 * PACE));
play(2000);
said.push(page.play.tick, page.play.playing);
run.ticks = 20;
page.tell("ticks");
page.play.rate(16);
play(50);
said.push(page.play.tick - 4);
page.play.hold(true);
play(500);
said.push(page.waiting());
page.play.hold(false);
play(1000);
run.ticks = 30;
run.done = true;
page.tell("ticks");
page.tell("end");
play(1000);
said.push(page.play.tick, page.play.playing, page.waiting());
said.push(shown(page).shares.every((share, k) => Math.abs(share - k / 29) < 1e-6));
page.play.toggle();
play(20);
said.push(page.play.tick < 5 && page.play.playing);
page.play.step(1);
said.push(page.play.playing, Number.isInteger(page.play.tick));
page.play.rate(99);
said.push(page.play.speed);
page.play.rate(1);
page.turn(now + 10);
page.play.seek(3);
page.play.start();
page.turn(now + 20);
page.turn(now + 60_000);
said.push(page.play.tick < 29);
console.log(JSON.stringify(said));
"""
    pace, stands, waits, on, held, end, playing, frames, shares, again, stepping, whole, speed, hidden = node(
        tmp_path, script
    )
    assert pace == pytest.approx(1.0)
    assert (stands, waits) == (4, True), "it waits at the last tick there is, and goes on by itself"
    assert on == pytest.approx(16 * 8 * 0.04, rel=0.3)
    assert held == 0, "nothing turns while the slider is held"
    assert (end, playing, frames) == (29, False, 0)
    assert shares, "a faster speed that comes later changes the colours of what was before"
    assert again, "played again from the beginning"
    assert (stepping, whole, speed) == (False, True, 50)
    assert hidden, "a page that was hidden does not leap"


@needs_node
def test_a_run_made_again_keeps_its_moment(tmp_path: Path) -> None:
    script = """
import { pageOf, runOf, shown } from "./player.js";
const page = pageOf(runOf(30));
page.tell("run", { tick: 0, play: false });
page.play.seek(12.5);
const before = shown(page);
const again = runOf(6, 30);
page.run = again;
page.tell("run", { tick: 12.5, play: true });
page.turn(10);
page.turn(20);
const waits = [shown(page).robot, page.play.tick];
again.ticks = 30;
again.done = true;
page.tell("ticks");
page.turn(30);
page.turn(40);
const goes = page.play.tick;
const short = runOf(8);
page.run = short;
page.tell("run", { tick: 12.5, play: false });
page.tell("end");
const cut = page.play.tick;
page.run = null;
page.tell("run", { tick: 0, play: false });
page.play.toggle();
console.log(JSON.stringify([before, waits, goes, cut, shown(page), page.asked]));
"""
    before, (robot, tick), goes, cut, none, asked = node(tmp_path, script)
    assert (before["robot"], robot, tick) == ([25, -2.5], [25, -2.5], 12.5)
    assert 12.5 < goes < 14
    assert cut == 7, "a run that ends before it is shown at its end"
    assert (none["robot"], none["bodies"], none["way"]) == (None, None, None)
    assert asked == 1, "without a run, play asks for one"


@pytest.mark.nightly
@needs_node
def test_one_layer_is_asked_for_at_a_time_and_the_newest_tick_wins(tmp_path: Path) -> None:
    script = """
import { Source } from "./layers.js";
import { pageOf, runOf } from "./player.js";
const layer = (v) => {
  const bytes = new Uint8Array(1 + 1 + 16 + 1);
  const view = new DataView(bytes.buffer);
  bytes[0] = 1;
  bytes[1] = 97;
  view.setUint32(2, 1, true);
  view.setUint32(6, 1, true);
  view.setFloat32(10, v, true);
  bytes[18] = 1;
  return bytes;
};
const page = pageOf(runOf(30));
let flying = 0, most = 0;
const asked = [];
let answer = () => {};
page.asked = () => ({});
globalThis.window = globalThis;
page.store = { scenario: { start: [0, 0], goal: [1, 0] } };
page.api = { async *frames(path, body) {
  most = Math.max(most, ++flying);
  asked.push([body.layer, body.tick, body.obstacle_cells]);
  await new Promise((done) => (answer = done));
  yield { kind: "L", bytes: layer(body.tick) };
  flying--;
} };
const source = new Source(page);
const came = [];
source.onLayer = (name, layer) => came.push([name, layer.low]);
const rest = () => new Promise((done) => setTimeout(done, 0));
source.shown = "reach";
for (let t = 0; t < 8; t++) {
  page.play.seek(t);
  source.want("reach");
  if (t === 2) source.want("cost");
  await rest();
}
for (let k = 0; k < 5; k++) {
  answer();
  await rest();
}
source.want("reach");
source.want("cost");
await rest();
const same = asked.length;
source.changed();
source.want("cost");
await rest();
answer();
await rest();
const held = [source.peek("cost")?.low, source.peek("reach")];
console.log(JSON.stringify([most, asked, came, same, asked.length, held]));
"""
    most, asked, came, same, again, held = node(tmp_path, script)
    assert most == 1
    assert [one[:2] for one in asked] == [["reach", 0], ["reach", 7], ["cost", 7], ["cost", 7]]
    assert asked[0][2] == [[0, 0]], "reach is of the bodies that are there"
    assert asked[1][2] == [[7, 0], [4, 7]]
    assert asked[2][2] is None
    assert came == [["reach", 0], ["reach", 7], ["cost", 7], ["cost", 7]]
    assert (same, again) == (3, 4), "what is here is not asked for again, until the scenario changes"
    assert held == [7, None]


@needs_node
def test_causes_have_the_reports_colours_and_are_seen_on_dark(tmp_path: Path) -> None:
    script = """
import { CAUSES, causeColour } from "./colours.js";
const words = [...Object.keys(CAUSES), "never heard of"];
const both = words.map((word) => [word, [causeColour(word), causeColour(word, true)]]);
console.log(JSON.stringify([CAUSES, Object.fromEntries(both)]));
"""
    causes, both = node(tmp_path, script)
    assert causes == CAUSES
    panel = luminance("#1d2026")
    for word, (light, dark) in both.items():
        if word in CAUSES:
            assert light == CAUSES[word]
        assert (luminance(dark) + 0.05) / (panel + 0.05) >= 3.0, word


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb, as WCAG 2 defines it."""
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
