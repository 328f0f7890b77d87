"""The page without a server: built, opened in Chromium where nothing outside its folder can be asked, and compared with
the same questions here. Which of the two it is, Python or a recording, depends on what npm can be had from; it is printed."""

from __future__ import annotations

import functools
import http.server
import importlib.util
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_browser import needs_chromium
from scipy import ndimage, spatial, special, stats

import lampyris

ROOT = Path(__file__).resolve().parents[2]
LIVE = ROOT / "site" / "live"
pytestmark = pytest.mark.source
MEASURED = {"seconds", "loading_seconds", "timing"}
"""What differs from run to run."""
REPLANS = 20
"""A second, of a goal that is dragged on 50 x 50 cells, if the worker has a processor."""
MOVES = 200
"""Of the mouse, at most, each to another cell."""
STARTED = 240_000
"""Milliseconds in which Python starts in a browser on a busy machine."""


class _Files(http.server.SimpleHTTPRequestHandler):
    def guess_type(self, path: Any) -> str:
        """Types of the page's files, whatever this system says of them."""
        kinds = {".mjs": "text/javascript", ".js": "text/javascript", ".wasm": "application/wasm"}
        return kinds.get(Path(path).suffix) or super().guess_type(path)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing is said."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """A folder below another on loopback; its address."""
    handler = functools.partial(_Files, directory=str(folder.parent))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/{folder.name}/"
        server.shutdown()


def built(folder: Path, *options: str) -> str:
    """Build the page; the line that says what it is."""
    command = [sys.executable, str(LIVE / "build.py"), str(folder), *options]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=900)
    return done.stdout.splitlines()[-1]


@contextmanager
def opened(browser: Any, address: str) -> Iterator[Any]:
    """The page, ready; whatever it asks for outside its folder is refused and fails the test, as do its errors."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    outside: list[str] = []
    wrong: list[str] = []

    def judge(route: Any) -> None:
        if route.request.url.startswith(address):
            route.continue_()
        else:
            outside.append(route.request.url)
            route.abort()

    context.route("**/*", judge)
    page = context.new_page()
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(address)
    page.wait_for_selector("body.ready", timeout=STARTED)
    page.get_by_text("A path was found.").first.wait_for()
    yield page
    assert not outside
    assert not wrong
    context.close()


SCENE = {"version": 1, "map": "env-3", "start": [28, 7], "goal": [27, 27], "planner": "astar"}
WALKERS = [{"kind": "random-walk", "count": 6}]
LISTEN = """async () => {
  const { wire } = await import("./static/api.js");
  const ask = wire.ask;
  window.heard = [];
  wire.ask = async (path, init) => {
    const answer = await ask(path, init);
    if (path === "/api/plan") answer.clone().text().then((text) => window.heard.push([init.body, text]), () => {});
    return answer;
  };
}"""
QUESTIONS = {
    "/api/simulate": {"scenario": {**SCENE, "obstacles": WALKERS, "simulate": {}}},
    "/api/drive": {"scenario": {**SCENE, "obstacles": WALKERS, "drive": {}}},
    "/api/compare": {"scenario": {**SCENE, "obstacles": WALKERS}, "planners": ["astar", "ad-gso"]},
    "/api/race": {"scenario": SCENE, "planners": ["astar", "dijkstra"]},
    "/api/fleet": {
        "scenario": {"version": 1, "map": "env-3"},
        "robots": 8,
        "planner": "lacam",
        "seconds": 1,
        "seed": 1,
    },
}
"""What the panels of the page ask."""
KINDS = """async ([path, body]) => {
  const { wire } = await import("./static/api.js");
  const bytes = new Uint8Array(await (await wire.ask(path, { method: "POST", body })).arrayBuffer());
  const kinds = [];
  for (let at = 0; at < bytes.length; at += 4 + new DataView(bytes.buffer).getUint32(at, true))
    kinds.push(String.fromCharCode(bytes[at + 4]));
  return kinds.filter((kind, k) => kind !== kinds[k - 1]);
}"""
"""The kinds of frames of an answer, each once in a row; X is an error, Z the end."""
GOAL = """() => {
  const canvas = document.getElementById("map"), box = canvas.getBoundingClientRect();
  return [box.x, box.y, box.width, box.height];
}"""


def worker_seconds() -> float:
    """CPU seconds of the workers of pages below this process, as Linux names them; 0 where it does not tell."""
    children: dict[int, list[int]] = {}
    for place in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            children.setdefault(int(place.read_text().rpartition(")")[2].split()[1]), []).append(
                int(place.parent.name)
            )
    found, below = 0.0, [os.getpid()]
    while below:
        one = below.pop()
        below += children.get(one, [])
        for place in Path(f"/proc/{one}/task").glob("*/stat"):
            with suppress(OSError):
                name, _, rest = place.read_text().rpartition(")")
                if "DedicatedWorker" in name:
                    found += sum(map(int, rest.split()[11:13])) / os.sysconf("SC_CLK_TCK")
    return found


def native(body: str) -> dict[str, Any]:
    """The same question, answered here."""
    sys.path.insert(0, str(LIVE))
    try:
        import live_engine
    finally:
        sys.path.pop(0)
    answer = live_engine.ask("/api/plan", body)
    data: bytes = b"".join(iter(answer.next, None))
    return plain(data.decode("utf-8", "replace"))


def plain(text: str) -> dict[str, Any]:
    """An answer's record without what is measured."""
    record: dict[str, Any] = json.loads(text[text.index('{"') :])
    return {key: value for key, value in record.items() if key not in MEASURED}


@pytest.mark.nightly
@needs_chromium
def test_goal_dragged_in_a_page_without_a_server(browser: Any, tmp_path: Path) -> None:
    said = built(tmp_path / "live")
    print(f"\n{said}")
    computes = json.loads((tmp_path / "live" / "made.json").read_text())["python"]
    with served(tmp_path / "live") as address, opened(browser, address) as page:
        kind = page.evaluate("document.documentElement.dataset.live")
        print(f"the page ran: {kind}")
        assert kind == ("python" if computes else "recorded")
        if not computes:
            return
        page.evaluate(LISTEN)
        found = [
            page.evaluate(
                """async (planner) => {
                  const { wire } = await import("./static/api.js");
                  const body = JSON.stringify({ scenario: { version: 1, map: "env-3", planner } });
                  return [body, await (await wire.ask("/api/plan", { method: "POST", body })).text()];
                }""",
                planner,
            )
            for planner in (
                "ad-gso",
                "astar",
                "dijkstra",
                "theta-star",
                "polyanya",
                "rrt-connect",
                "sipp",
                "pso",
            )
        ]
        for body, text in found:
            assert plain(text) == native(body)
        for path, body in QUESTIONS.items():
            kinds = page.evaluate(KINDS, [path, json.dumps(body)])
            print(path, kinds)
            assert "Z" in kinds
            assert "X" not in kinds  # an error
        page.evaluate("window.heard = []")
        page.evaluate("location.hash = '#m=env-3'")
        x, y, width, height = page.evaluate(GOAL)
        side = min(width, height) - 4
        left, top = x + (width - side) / 2, y + (height - side) / 2
        goal = native(json.dumps({"scenario": {"version": 1, "map": "env-3", "planner": "astar"}}))["cells"][
            -1
        ]
        # Over walls nothing would be asked.
        blocked = lampyris.load_grid("env-3").blocked
        there = [(goal[0] + k, goal[1] + k) for k in range(17) if not blocked[goal[1] + k, goal[0] + k]]
        cell = side / 50
        page.mouse.move(left + (goal[0] + 0.5) * cell, top + (goal[1] + 0.5) * cell)
        page.mouse.down()
        page.evaluate("window.heard = []")
        used = worker_seconds()
        began = page.evaluate("performance.now()")
        # There and back in one command each: a command a cell would let the mouse wait for this process.
        steps = len(there) - 1
        ends = [(left + (x + 0.5) * cell, top + (y + 0.5) * cell) for x, y in (there[-1], there[0])]
        for k in range(MOVES // steps):
            page.mouse.move(*ends[k % 2], steps=steps)
        seconds = (page.evaluate("performance.now()") - began) / 1000
        heard = page.evaluate("window.heard")
        used = worker_seconds() - used
        page.mouse.up()
        page.wait_for_timeout(1000)
        goals = {json.dumps(json.loads(body)["scenario"]["goal"]) for body, _ in heard}
        moves = MOVES // steps * steps
        print(f"{moves} moves over {len(there)} cells, {moves / seconds:.1f} a second")
        print(
            f"{len(heard)} plans of {len(goals)} goals in {seconds:.1f} s: {len(heard) / seconds:.1f} a second"
        )
        assert len(goals) >= 5
        # By the clock it depends on what else the machine does.
        assert used > 0 or sys.platform != "linux", "the worker's thread was not found"
        cost = used / len(heard)
        print(f"{1000 * cost:.0f} ms of the worker's processor time a plan")
        assert cost < 1 / REPLANS
        for body, text in heard:
            assert plain(text) == native(body)


@pytest.mark.nightly
@needs_chromium
def test_recording_where_python_cannot_run(browser: Any, tmp_path: Path) -> None:
    assert "a recording (--recorded was given)" in built(tmp_path / "live", "--recorded")
    with served(tmp_path / "live") as address, opened(browser, address) as page:
        assert "a recording" in page.inner_text("#starting")
        page.click("#timeline button:has-text('Play')")
        page.locator("#timeline").get_by_text("not run yet").wait_for(state="hidden")
        # What was not recorded is answered by a sentence.
        page.locator("#library").get_by_text("env-1", exact=True).click()
        page.get_by_text("This is a recording").first.wait_for()


def stand_in(name: str) -> Any:
    """A module that stands in for one of SciPy's."""
    spec = importlib.util.spec_from_file_location(name, LIVE / "stand_ins" / "scipy" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_regions_are_numbered_as_scipy_numbers_them() -> None:
    module = stand_in("ndimage")
    draw = np.random.default_rng(5)
    for share in (0.0, 0.3, 0.5, 0.6, 0.9, 1.0):
        image = draw.random((13, 17)) < share
        for structure in (None, np.ones((3, 3), dtype=int)):
            regions, count = module.label(image, structure=structure)
            expected, number = ndimage.label(image, structure=structure)
            assert count == number
            assert np.array_equal(regions, expected)


def test_normal_distribution_is_that_of_scipy() -> None:
    module = stand_in("special")
    for share in np.linspace(1e-6, 1 - 1e-6, 501):
        assert module.ndtri(share) == pytest.approx(special.ndtri(share), rel=1e-12, abs=1e-15)
        value = 12.0 * share - 6.0
        assert module.ndtr(value) == pytest.approx(special.ndtr(value), rel=1e-12)


def test_ranks_and_their_distributions_are_those_of_scipy() -> None:
    module = stand_in("stats")
    for values in ([], [3.0], [2.0, 1.0, 2.0, 5.0, 1.0, 2.0]):
        assert np.array_equal(module.rankdata(values), stats.rankdata(values))
    for df in (1, 2, 3, 4, 9, 30):
        for x in (0.0, 0.3, 2.0, 17.5, 90.0):
            assert module.chi2.sf(x, df) == pytest.approx(stats.chi2.sf(x, df), rel=1e-12)
    for k, quantile in ((2, 2.771807648), (3, 3.314493), (10, 4.474124)):  # of printed tables
        assert module.studentized_range.ppf(0.95, k, np.inf) == pytest.approx(quantile, abs=1e-6)


def test_near_pairs_are_those_of_scipy() -> None:
    module = stand_in("spatial")
    draw = np.random.default_rng(8)
    for n in (0, 1, 2, 70, 1100):
        points = draw.integers(0, 40, (n, 2)) * 0.5
        for reach in (0.0, 0.5, 1.3, 99.0) if n < 100 else (0.5,):
            pairs = module.cKDTree(points).query_pairs(reach, output_type="ndarray")
            expected = spatial.cKDTree(points).query_pairs(reach, output_type="ndarray") if n else pairs
            assert set(map(tuple, pairs)) == set(map(tuple, expected))
            assert len(pairs) == len(expected)


SCENARIOS = """
import json, sys
from lampyris.scenarios import scenario_of
from lampyris.errors import LampyrisError
said = []
for data in json.load(sys.stdin):
    try:
        found = scenario_of(data)
        said.append([repr(found.planner), repr(found.scene.start), repr(found.scene.robot), repr(found.drive), found.seed])
    except LampyrisError as fault:
        said.append([fault.code, fault.what, fault.where, fault.allowed, fault.todo, getattr(fault, "__notes__", [])])
print(json.dumps(said))
"""
CHANGES: tuple[dict[str, Any], ...] = (
    {}, {"planner": "astar"}, {"planner": {"name": "gso", "settings": {"fireflies": 12}}}, {"planner": 3}, {"planner": ""},
    {"planner": {"settings": {}}}, {"goal": [9, 9]}, {"goal": [9]}, {"goal": [9.5, 1]}, {"goal": {"m": [3.0, 4]}},
    {"goal": {"pose": [3.0, 4, 0.5]}}, {"goal": {"cell": [3, 4], "yaw": 1}}, {"goal": "x"}, {"start": None}, {"seed": -1},
    {"seed": True}, {"seed": 2**63}, {"robot": {"radius": 0.3}}, {"robot": {"radius": -1}}, {"robot": {"raduis": 1}},
    {"robot": {"a_max": "1"}}, {"robot": []}, {"moves": "octil"}, {"moves": "octile"}, {"preset": "dissertation"},
    {"law": {"name": "physical", "settings": {}}}, {"simulate": {}}, {"simulate": {"ticks": 0}}, {"simulate": None},
    {"drive": {"clearance": 0.1}}, {"drive": {"obstacle_speed": "fast"}}, {"obstacles": [{"kind": "random-walk", "count": 2}]},
    {"obstacles": [{"kind": "walk"}]}, {"obstacles": [{}]}, {"obstacles": [{"kind": "crossing", "count": 10**7}]},
    {"obstacles": [{"kind": "patrol", "waypoints": []}]}, {"obstacles": [{"kind": "patrol", "waypoints": [[1, 2], [3]]}]},
    {"edits": [{"tick": 3, "blocked": [[1, 1]]}]},
    {"edits": [{"blocked": [[1, 1]]}]}, {"edits": [{"tick": 0, "blocked": [[1, 1, 1]]}]},
    {"via": [[3, 3]]}, {"via": 3}, {"inflation": {"inflation_radius": 2}}, {"map_hash": "zz"}, {"name": "\\u0007"},
    {"name": "a" * 65}, {"map": {"recipe": "rooms", "size": [20, 20]}}, {"map": {"recipe": "rooms", "size": [0, 20]}},
    {"map": {"rows": ["S..G"]}, "start": None, "goal": None}, {"map": {"bundle": "x"}}, {"map": {}}, {"zones": ""},
    {"version": 2}, {"colour": 1}, {"map": {"rows": ["S..G"], "resolution": float(10**6)}}, {"$schema": "x"},
)  # fmt: skip


@pytest.mark.nightly
def test_stand_in_for_pydantic_reads_and_refuses_as_pydantic_does() -> None:
    base = {"version": 1, "map": "env-3", "start": [28, 7], "goal": [26, 26]}
    asked = json.dumps([{**base, **change} for change in CHANGES])
    said = []
    for before in ("", f"import sys; sys.path.insert(0, {str(LIVE / 'stand_ins')!r})\n"):
        # SciPy's stand-in lies beside it: SciPy is imported first.
        code = "import scipy.ndimage, scipy.sparse.csgraph\n" + before + SCENARIOS
        done = subprocess.run(
            [sys.executable, "-c", code], input=asked, capture_output=True, text=True, check=True
        )
        said.append(json.loads(done.stdout))
    for change, real, own in zip(CHANGES, *said, strict=True):
        assert own == real, change
