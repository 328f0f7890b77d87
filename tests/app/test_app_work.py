"""What an engine answers: the same as the library and the command line, byte for byte, in frames."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import io
import json
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from PIL import Image

import lampyris
from lampyris import scenarios
from lampyris._core.cancellation import Cancelled
from lampyris.app.engine import simulation, work
from lampyris.app.engine.comparison import ComparisonResults, compare, comparison
from lampyris.app.engine.frames import NOWHERE
from lampyris.app.engine.layers import grid_at, reach
from lampyris.app.engine.parse import scenario_of_request
from lampyris.app.engine.simulation import WORDS, begin
from lampyris.cli import main
from lampyris.errors import LampyrisError, SettingError
from lampyris.io.maps import library
from lampyris.kernels import _jit, loading
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.field.solve import solve_field
from lampyris.planning.incremental.session import IncrementalSession
from lampyris.report.data.measures import METRICS, near_by_tick
from lampyris.report.data.serialize import trace_record
from lampyris.study.design.study_map import pack

STATE: dict[str, Any] = {
    "version": 1, "map": "env-3", "start": None, "goal": None, "robot": {}, "preset": "robot", "moves": None,
    "planner": {"name": "ad-gso", "settings": {}}, "law": None, "seed": 0, "obstacles": [], "edits": [],
    "simulate": {"ticks": None, "patience": None},
}  # fmt: skip
"""What the page holds, as static/state.js makes it."""
CROWD = [
    {"kind": "random-walk", "count": 12, "rate": 0.5},
    {"kind": "crossing", "count": 4},
    {"kind": "patrol", "waypoints": [[5, 5], [12, 5]]},
]

EDITS = [
    {"tick": 0, "blocked": [[10, 10]], "freed": []},
    {"tick": 4, "blocked": [[24, 12], [25, 12]], "freed": [[10, 10]]},
]


def state(**more: Any) -> dict[str, Any]:
    return {**STATE, **more}


def ask(verb: str, scenario: dict[str, Any] | None = None, **more: Any) -> list[tuple[str, Any]]:
    question = {"verb": verb, "job": 7, "scenario": scenario or state(), **more}
    return [unframed(piece) for piece in work.answer(question, lambda: None)]


def unframed(piece: bytes) -> tuple[str, Any]:
    (size,) = struct.unpack_from("<I", piece)
    assert size == len(piece) - 4
    kind = chr(piece[4])
    return kind, json.loads(piece[5:]) if kind in "HEZXPS" else piece[5:]


def only(frames: list[tuple[str, Any]], kind: str) -> Any:
    found = [value for k, value in frames if k == kind]
    assert len(found) == 1
    return found[0]


def refusal(verb: str, scenario: dict[str, Any] | None = None, **more: Any) -> LampyrisError:
    with pytest.raises(LampyrisError) as found:
        ask(verb, scenario, **more)
    assert "\n" not in str(found.value)
    return found.value


# ---- scenarios --------------------


@pytest.mark.parametrize(
    ("more", "code", "where"),
    [
        ({"goal": [1]}, "TYPE", "scenario: /goal"),
        ({"start": [99, 2]}, "START_OUTSIDE", "scenario: /start"),
        ({"robot": {"v_max": 0}}, "ROBOT_LIMIT", "scenario: /robot/v_max"),
        ({"obstacles": [{"kind": "crossing", "count": -1}]}, "TRAFFIC_COUNT", "scenario: /obstacles/0/count"),
        (
            {"obstacles": [{"kind": "patrol", "waypoints": [[0]]}]},
            "TYPE",
            "scenario: /obstacles/0/waypoints/0",
        ),
        ({"obstacles": [{"kind": "recorded", "file": "/etc/passwd"}]}, "PATH_OUTSIDE", "/obstacles/0/file"),
        ({"zones": "zones.npy"}, "PATH_OUTSIDE", "scenario: /zones"),
        ({"map": {"file": "/etc/passwd"}}, "PATH_OUTSIDE", "scenario: /map/file"),
        ({"map": {"library": "nobody"}}, "KEY", "scenario: /map"),
        ({"map": "nobody"}, "FILE_MISSING", "scenario: /map"),
        ({"planner": {"name": "nobody"}}, "PLANNER", "scenario: /planner"),
        ({"planner": {"name": "astar", "settings": {"x": 1}}}, "SETTING", "scenario: /planner"),
        ({"nonsense": 1}, "KEY", "scenario: /nonsense"),
        ({"version": 2}, "VERSION", "scenario: /version"),
        ({"seed": -1}, "SEED", "scenario: /seed"),
        (
            {"map": {"recipe": "caves", "size": [9000, 9]}, "start": [0, 0], "goal": [1, 1]},
            "MAP_SIDE",
            "scenario: /map",
        ),
        ({"map": {"recipe": "caves", "size": [9000, 9000]}}, "MAP_TOO_LARGE", "scenario: /map"),
    ],
)
def test_mistakes_are_told_at_their_json_pointer(more: dict[str, Any], code: str, where: str) -> None:
    fault = refusal("plan", state(**more))
    assert fault.code in (code, "MAP") if more.get("map") == "nobody" else fault.code == code
    assert where in fault.where


def test_all_mistakes_are_told_at_once() -> None:
    fault = refusal("plan", state(goal=[1], seed=-1, robot={"v_max": 0}))
    assert len(getattr(fault, "__notes__", ())) == 2


def test_no_file_is_opened_for_a_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario_of_request({"scenario": state(map={"rows": ["S..G"]})})  # what is imported late is there
    opened: list[str] = []
    active = [True]
    sys.addaudithook(
        lambda event, given: opened.append(str(given[0])) if active[0] and event == "open" else None
    )
    for more in (
        {"obstacles": [{"kind": "recorded", "file": "../../etc/passwd"}]},
        {"zones": "/etc/passwd"},
        {"map": {"file": "etc/passwd"}},
    ):
        refusal("plan", state(map={"rows": ["S..G"]}) | more)
    active[0] = False
    assert not [name for name in opened if "passwd" in name]


def test_a_map_beside_the_question_is_taken_whatever_the_scenario_calls_it() -> None:
    blocked = np.zeros((4, 5), dtype=np.bool_)
    blocked[1, 1:] = True
    ground = {**pack(Grid(blocked, resolution=0.5, name="mine.png")), "start": [4, 0], "goal": [4, 3]}
    for spec in ("up-0123", {"library": "up-0123"}, {"rows": ["..."]}):
        scenario = scenario_of_request({"scenario": state(map=spec), "ground": ground})
        assert np.array_equal(scenario.scene.grid.blocked, blocked)
        assert (scenario.scene.start, scenario.scene.goal, scenario.map) == ((4, 0), (4, 3), None)
        assert scenario.scene.grid.name == "mine.png"
    # One of ours is ours.
    given = scenario_of_request({"scenario": state(), "ground": ground}).scene.grid
    assert np.array_equal(given.blocked, library.load("env-3").grid.blocked)


def test_rows_recipes_and_resolutions_are_maps_too() -> None:
    rows = scenario_of_request({"scenario": state(map={"rows": ["S..", ".#.", "..G"]})}).scene
    assert (rows.start, rows.goal, rows.grid.blocked.sum()) == ((0, 0), (2, 2), 1)
    table = scenario_of_request({"scenario": state(map={"bundled": "env-3", "resolution": 0.25})}).scene
    assert table.grid.resolution == 0.25
    made = scenario_of_request(
        {"scenario": state(map={"recipe": "caves", "size": [40, 30]}, start=[0, 0], goal=[1, 1])}
    )
    assert made.scene.grid.width == 40


def test_the_same_map_is_the_same_noun_so_that_a_drag_unpacks_it_once() -> None:
    ground = pack(library.load("env-3").grid)
    one, two = (
        scenario_of_request({"scenario": state(map="x", start=[28, k], goal=[26, 26]), "ground": ground})
        for k in (7, 6)
    )
    assert one.scene.grid is two.scene.grid


# ---- plans --------------------


def test_walls_that_are_painted_are_read_once_and_not_at_each_step_of_a_drag(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nor is the map made anew with them: anyone who keeps a field by its map finds it again."""
    from lampyris.app.engine import parse as said

    monkeypatch.setattr(said, "_walls", {})
    read: list[bool] = []
    usual = said.scenario_of

    def spied(data: Any, **more: Any) -> Any:
        read.append("edits" in data)
        return usual(data, **more)

    monkeypatch.setattr(said, "scenario_of", spied)
    walls = [{"tick": 0, "blocked": [[12, 12], [13, 12]], "freed": []}]
    other = [{"tick": 0, "blocked": [[12, 12]], "freed": []}]
    later = [*walls, {"tick": 5, "blocked": [[20, 20]]}]

    def at(k: int, edits: Any, verb: str = "plan") -> Any:
        return scenario_of_request({"verb": verb, "scenario": state(start=[k, 2], edits=edits)})

    found = [at(k, walls) for k in (2, 3, 4)]
    assert read == [True, False, False]
    assert all(one.scene.grid is found[0].scene.grid for one in found)
    assert [one.scene.start for one in found] == [(2, 2), (3, 2), (4, 2)]
    plain = usual(state(start=[4, 2], edits=walls))
    assert np.array_equal(found[2].scene.grid.blocked, plain.scene.grid.blocked)
    assert found[2].scene.grid.blocked[12, 12]
    read.clear()
    assert not at(2, other).scene.grid.blocked[12, 13]
    at(2, later)
    assert len(at(2, later).scene.edits) == 1
    # A run and a file say where the walls came from.
    assert at(2, walls, "simulate").edits
    with pytest.raises(LampyrisError):
        at(2, [*walls, *walls])
    with pytest.raises(LampyrisError):
        at(2, [*walls, *walls])
    assert read == [True] * 6


@pytest.mark.parametrize("planner", ["ad-gso", "astar"])
def test_a_plan_is_that_of_the_library(planner: str) -> None:
    told = only(ask("plan", state(planner={"name": planner, "settings": {}})), "Z")
    document = library.load("env-3")
    assert document.start is not None
    assert document.goal is not None
    scene = Scene(document.grid, document.start, document.goal)
    found = lampyris.plan(scene, planner, record=False)
    assert found.cells is not None
    assert told["cells"] == found.cells.tolist()
    assert told["speed"]["v"] == lampyris.speed_profile(scene, found).v.tolist()
    assert len(told["speed"]["why"]) == len(told["cells"])
    assert {cap["cause"] for cap in told["speed"]["caps"]}
    assert told["jumps"] == []
    assert told["gates"]["in_map"] == []
    assert told["gates"]["count"] == len(found.gates_in_map)


def test_a_plan_has_its_jumps_and_gates_if_they_are_asked_for() -> None:
    told = only(ask("plan", record=True, layers=["gates"]), "Z")
    assert len(told["jumps"]) == told["iterations"]
    assert len(told["gates"]["in_map"]) == told["gates"]["count"] > 0


def test_obstacles_stand_in_the_plan_where_the_run_will_have_them_at_first() -> None:
    scenario = state(obstacles=CROWD, seed=3)
    told = only(ask("plan", scenario), "Z")["obstacle_specs"]
    trace: Any = scenarios.run(scenario_of_request({"scenario": {**scenario, "simulate": {"ticks": 2}}}))
    there = [k for k, came in enumerate(trace.appears) if came == 0]
    assert [tuple(one["at"]) for one in told] == [tuple(trace.tracks[k][0]) for k in there]
    assert [one["kind"] for one in told] == [trace.obstacle_specs[k].kind for k in there]
    assert told
    assert "obstacle_specs" not in only(ask("plan", state()), "Z")
    # A start in a wall is an answer still.
    walled = state(
        map={"rows": ["#..G"]}, start=[0, 0], goal=[3, 0], obstacles=[{"kind": "random-walk", "count": 1}]
    )
    assert only(ask("plan", walled), "Z")["status"] == "start-occupied"


def test_no_way_is_an_answer_and_no_error() -> None:
    told = only(ask("plan", state(map={"rows": ["S#G"]})), "Z")
    assert (told["status"], told["cells"], told["speed"]) == ("no-path", None, None)


# ---- simulations --------------------


def ticks(frames: list[tuple[str, Any]]) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    for kind, data in frames:
        if kind != "T":
            continue
        first, n, bodies = struct.unpack_from("<IHH", data)
        at, parts = 8, {}
        shapes = (("robot", "<i2", (n, 2)), ("speed", "<f4", (n,)), ("cause", "u1", (n,)),
                  ("places", "<i2", (n, bodies, 2)), ("near", "<f4", (n,)))  # fmt: skip
        for name, kind_, shape in shapes:
            size = int(np.prod(shape))
            parts[name] = np.frombuffer(data, kind_, size, at).reshape(shape)
            at += parts[name].nbytes
        assert at == len(data)
        yield first, parts


@pytest.mark.parametrize("slow", [False, True])
def test_frames_hold_the_whole_trace(monkeypatch: pytest.MonkeyPatch, slow: bool) -> None:
    monkeypatch.setattr("lampyris.app.engine.simulation.CHUNK_S", -1.0 if slow else 1e9)
    scenario = state(obstacles=CROWD)
    frames = ask("simulate", scenario)
    head, end = only(frames, "H"), only(frames, "Z")
    trace: Any = scenarios.run(scenario_of_request({"scenario": scenario}))
    assert (head["job"], head["planner"], head["law"], head["units"]) == (7, "ad-gso", "physical", "m/s")
    kinds = [body["kind"] for body in head["obstacle_specs"]]
    told = 0
    near = near_by_tick(trace)
    number = 0
    for kind, value in frames:
        if kind == "E":
            kinds += [event["obstacle"]["kind"] for event in value if event["word"] == "appear"]
        if kind != "T":
            continue
        first, part = list(ticks(frames))[number]
        number += 1
        n = len(part["robot"])
        assert first == told
        assert part["places"].shape[1] == len(kinds), "events come before the ticks that need them"
        assert np.array_equal(part["robot"], trace.robot[first : first + n])
        assert np.array_equal(part["speed"], trace.speed[first : first + n].astype(np.float32))
        assert [head["causes"][c] for c in part["cause"]] == list(trace.cause[first : first + n])
        assert np.array_equal(part["near"], near[first : first + n].astype(np.float32))
        for k in range(n):
            there = [tuple(cell) for cell in part["places"][k].tolist() if cell[0] != NOWHERE]
            assert there == trace.obstacles_at(first + k)
        told += n
    assert told == trace.ticks + 1 == end["ticks"] + 1
    assert (number > 5) == slow
    events = [event for kind, value in frames if kind == "E" for event in value]
    assert [(e["tick"], e["word"]) for e in events] == [(e.tick, e.word) for e in trace.events]
    assert (end["outcome"], end["sentence"]) == (trace.outcome.value, trace.sentence)
    assert end["last_tick"] == trace.last_tick
    assert tuple(end["metrics"]) == METRICS
    assert len(end["obstacle_specs"]) == len(trace.obstacle_specs) == len(kinds)
    plain = json.dumps({**trace_record(trace), "timing": {}}, separators=(",", ":"))
    assert end["digest"] == hashlib.sha256(plain.encode()).hexdigest()


SAME = {
    "crowd": state(obstacles=CROWD, seed=5),
    "dissertation": state(
        preset="dissertation", obstacles=CROWD, planner={"name": "ad-gso", "settings": {"nt": 6}}
    ),
    "astar": state(planner={"name": "astar", "settings": {}}, obstacles=CROWD[1:], simulate={"ticks": 9}),
    "no way": state(map={"rows": ["S#.", "##.", "..G"], "name": "closed"}, obstacles=[]),
    "wall": state(map={"rows": ["S#.", "...", "..G"], "name": "wall"}, start=[1, 0], obstacles=CROWD[:1]),
    "rows": state(map={"rows": ["S....", ".###.", ".#?..", "....G"], "resolution": 0.5, "name": "drawn"}),
    "recipe": state(
        map={"recipe": "caves", "size": [40, 30], "seed": 3, "settings": {}}, start=[20, 15], goal=[39, 29]
    ),
    "edits": state(obstacles=CROWD, edits=EDITS),
    "track": state(obstacles=[{"kind": "recorded", "track": [[20, 10], [21, 10], [22, 10]]}]),
}  # fmt: skip


@pytest.mark.commit(3)
@pytest.mark.parametrize("name", SAME)
def test_the_command_line_replays_the_saved_scenario_to_the_same_bytes(tmp_path: Path, name: str) -> None:
    digest = only(ask("simulate", SAME[name]), "Z")["digest"]
    saved = b"".join(value for kind, value in ask("export", SAME[name], what="scenario") if kind == "B")
    file = tmp_path / "kept.yaml"
    file.write_bytes(saved)
    out = io.StringIO()
    words = ["lampyris", "run", str(file), "--json", "--no-timing"]
    with (
        mock.patch.object(sys, "argv", words),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(io.StringIO()),
        pytest.raises(SystemExit) as done,
    ):
        main()
    assert done.value.code in (0, 4)
    text = out.getvalue()
    assert text.endswith("}\n")
    assert hashlib.sha256(text[:-1].encode()).hexdigest() == digest


def test_a_scenario_that_is_too_large_for_yaml_is_saved_as_json_and_read_again(tmp_path: Path) -> None:
    cells = [[x, y] for y in range(2, 30) for x in range(30)]
    small = state(edits=[{"tick": 0, "blocked": cells[:20], "freed": []}])
    large = state(
        map="random-512", edits=[{"tick": 3, "blocked": [[x, y] for y in range(80) for x in range(50)]}]
    )
    for name, scenario, start in (("a.yaml", small, b"#"), ("a.json", large, b"{")):
        said = {**scenario, "simulate": {"ticks": 5}}
        data = b"".join(value for kind, value in ask("export", said, what="scenario") if kind == "B")
        assert data[:1] == start
        (tmp_path / name).write_bytes(data)
        again = scenarios.load_scenario(tmp_path / name)
        assert again.edits == scenario_of_request({"scenario": said}).edits


def test_an_uploaded_map_goes_into_the_saved_scenario(tmp_path: Path) -> None:
    ground = {**pack(library.load("guide").grid), "name": "my map (1).png"}
    scenario = state(map="up-1", start=[0, 9], goal=[7, 0], obstacles=[{"kind": "random-walk", "count": 2}])
    digest = only(ask("simulate", scenario, ground=ground), "Z")["digest"]
    saved = b"".join(v for k, v in ask("export", scenario, ground=ground, what="scenario") if k == "B")
    file = tmp_path / "kept.yaml"
    file.write_bytes(saved)
    trace: Any = scenarios.run(scenarios.load_scenario(file))
    assert simulation.digest(trace) == digest


def test_a_simulation_is_stopped_between_two_ticks() -> None:
    seen = []

    def look() -> None:
        seen.append(1)
        if len(seen) == 4:
            raise Cancelled

    question = {"verb": "simulate", "job": 1, "scenario": state(obstacles=CROWD)}
    with pytest.raises(Cancelled):
        list(work.answer(question, look))
    assert len(seen) == 4


def test_every_cause_of_a_speed_has_its_number() -> None:
    assert len(set(WORDS)) == len(WORDS) < 256


def test_a_drive_is_not_simulated_in_ticks() -> None:
    scenario = {key: value for key, value in state().items() if key != "simulate"} | {"drive": {}}
    assert refusal("simulate", scenario).code == "DRIVE"


# ---- layers --------------------


def layer(name: str, scenario: dict[str, Any] | None = None, **more: Any) -> tuple[float, float, np.ndarray]:
    data = only(ask("layer", scenario, layer=name, **more), "L")
    letters = data[0]
    assert data[1 : 1 + letters].decode() == name
    width, height, low, high = struct.unpack_from("<IIff", data, 1 + letters)
    return low, high, np.frombuffer(data, np.uint8, width * height, 17 + letters).reshape(height, width)


@pytest.mark.parametrize("name", ["cost", "luciferin", "clearance", "expanded"])
def test_a_layer_is_the_librarys_field_in_255_steps(name: str) -> None:
    low, high, shown = layer(name)
    scene = scenario_of_request({"scenario": state()}).scene
    field = solve_field(scene)
    assert not shown[scene.grid.blocked].any()
    if name in ("cost", "luciferin"):
        values = getattr(field, name)
        there = np.isfinite(values)
        assert np.array_equal(shown > 0, there)
        assert (low, high) == (np.float32(values[there].min()), np.float32(values[there].max()))
        back = low + (shown[there] - 1.0) / 254 * (high - low)
        assert np.abs(back - values[there]).max() <= (high - low) / 254 * 0.51
    if name == "expanded":
        x, y = scene.start
        assert (
            high
            == np.count_nonzero(shown)
            == np.count_nonzero((field.exact >= 0) & (field.exact <= field.exact[y, x]))
        )
        assert shown[scene.goal[1], scene.goal[0]] == 1


def test_where_walls_part_start_and_goal_each_has_a_region_and_walls_are_inflated() -> None:
    rows = ["." * 5 + "#" + "." * 6] * 8
    parted = state(map={"rows": rows, "name": "parted", "resolution": 1.0}, start=[1, 1], goal=[9, 6])
    low, high, shown = layer("regions", parted)
    assert (low, high) == (1.0, 2.0)
    assert (shown[:, :5] == 1).all()
    assert (shown[:, 5] == 0).all()
    assert (shown[:, 6:] == 255).all()
    *_, close = layer("inflation", {**parted, "robot": {"radius": 0.9}})
    scene = scenario_of_request({"scenario": {**parted, "robot": {"radius": 0.9}}}).scene
    assert np.array_equal(close > 0, ~solve_field(scene).free & ~scene.grid.blocked)
    assert (close > 0).any()
    low, high, one = layer(
        "regions", {**parted, "map": {"rows": ["." * 12] * 8, "name": "open", "resolution": 1.0}}
    )
    assert (low, high) == (3.0, 3.0)
    assert (one > 0).all()


def test_the_layers_of_a_planner_are_of_its_own_settings() -> None:
    one = layer("luciferin")
    other = layer("luciferin", state(planner={"name": "ad-gso", "settings": {"rho": 0.1}}))
    assert one[1] != other[1]


@pytest.mark.parametrize("seed", range(8))
def test_reach_is_a_search_step_by_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocked = rng.random((9, 12)) < 0.3
    free = [(int(x), int(y)) for y, x in np.argwhere(~blocked)]
    cells = [free[k] for k in rng.integers(len(free), size=3)]
    cutting, horizon = bool(seed % 2), 6
    found = reach(Grid(blocked), cells, cutting, horizon)
    ticks = dict.fromkeys(cells, 0)
    for tick in range(1, horizon + 1):
        for x, y in [cell for cell, t in ticks.items() if t == tick - 1]:
            for dx in (-1, 0, 1):
                for dy in (-1, 0, 1):
                    to = (x + dx, y + dy)
                    corner = dx and dy and not cutting and not {(x + dx, y), (x, y + dy)} <= set(free)
                    if to in free and not corner:
                        ticks.setdefault(to, tick)
    assert {(int(x), int(y)): int(found[y, x]) for y, x in np.argwhere(np.isfinite(found))} == ticks


def test_obstacles_are_never_outside_their_reach() -> None:
    scenario = state(obstacles=[{"kind": "random-walk", "count": 9}, *CROWD[1:]])
    trace: Any = scenarios.run(scenario_of_request({"scenario": scenario}))
    _, _, shown = layer("reach", scenario, obstacle_cells=None)
    grid = trace.scene.grid
    ticks_ = reach(grid, trace.obstacles_at(0), trace.scene.moves.corner_cutting, 64)
    assert np.array_equal(shown > 0, np.isfinite(ticks_))
    for tick in range(min(trace.ticks, 64) + 1):
        assert all(ticks_[y, x] <= tick for x, y in trace.obstacles_at(tick))


@pytest.mark.parametrize(
    ("more", "code"),
    [
        ({"layer": "secret"}, "LAYER"),
        ({"layer": "cost", "tick": -1}, "TICK"),
        ({"layer": "reach", "obstacle_cells": [[0.5, 1]]}, "TYPE"),
        ({"layer": "reach", "obstacle_cells": [[99, 1]]}, "BODY_OUTSIDE"),
        ({"layer": "reach", "obstacle_cells": "all"}, "TYPE"),
    ],
)
def test_layers_that_are_none(more: dict[str, Any], code: str) -> None:
    assert refusal("layer", **more).code == code


def test_layers_are_of_the_map_as_it_is_at_a_tick() -> None:
    applied = importlib.import_module("lampyris.model.edit").applied
    for name, edits in (
        ("env-3", EDITS),
        ("hills-48", [{"tick": 3, "blocked": [[5, 5]], "freed": [[0, 0]]}]),
    ):
        scene: Any = scenario_of_request({"scenario": state(map=name, edits=edits)}).scene
        for tick in (0, 3, 4, 9):
            now = grid_at(scene, tick)
            wanted = applied(scene.grid, [edit for edit in scene.edits if edit.tick <= tick])
            assert np.array_equal(now.blocked, wanted.blocked)
            assert (now.terrain is None) == (wanted.terrain is None)
            assert now.terrain is None or np.array_equal(now.terrain, wanted.terrain)
    at = [layer("clearance", state(edits=EDITS), tick=tick)[2][12, 24] for tick in (0, 4)]
    assert at[0] > 0
    assert at[1] == 0


# ---- what was not done as asked --------------------

FAR = {"name": "ad-gso", "settings": {"min_clearance": 10, "choice": "exact"}}
WEAKENED = "min_clearance 10 was weakened to 0 cells: no path to the goal keeps more"


def test_plans_runs_and_comparisons_say_what_was_weakened() -> None:
    far = state(map="env-1", planner=FAR)
    assert only(ask("plan", far), "Z")["weakened"] == [WEAKENED]
    assert only(ask("plan", state(map="env-1")), "Z")["weakened"] == []
    assert only(ask("simulate", far), "Z")["notes"] == [WEAKENED]
    assert only(ask("simulate", state(map="env-1")), "Z")["notes"] == []
    who = [{**FAR, "label": "far"}, "astar"]
    for seeds, said in (
        (1, f"far: {WEAKENED}"),
        (2, f"2 of 2 runs of far did otherwise than asked: {WEAKENED}"),
    ):
        frames = ask("compare", state(map="env-1"), planners=who, seeds=seeds)
        assert frames[-1][1]["notes"] == [said]


@pytest.mark.nightly
def test_reports_of_runs_and_comparisons_say_what_was_weakened() -> None:
    far = state(map="env-1", planner=FAR, simulate={"ticks": 3, "patience": None})
    page = b"".join(v for k, v in ask("export", far, what="report") if k == "B").decode()
    assert f"Not as asked: {WEAKENED}." in page
    settings = {"planners": [{**FAR, "label": "far"}, "astar"]}
    page = b"".join(
        v for k, v in ask("export", state(map="env-1"), what="report", settings=settings) if k == "B"
    ).decode()
    assert f"<p>far: {WEAKENED}.</p>" in page


# ---- comparisons --------------------


def test_a_comparison_is_runs_in_one_world_and_what_studies_say_of_them() -> None:
    who = ["ad-gso", {"name": "astar", "settings": {}, "label": "A*"}]
    frames = ask("compare", state(obstacles=CROWD[1:]), planners=who, seeds=3)
    heads = [value for kind, value in frames if kind == "H"]
    ends = [value for kind, value in frames if kind == "Z"]
    assert [head["label"] for head in heads] == ["ad-gso", "A*"]
    assert [(end["label"], end["seed"]) for end in ends] == [
        (w, s) for s in range(3) for w in ("ad-gso", "A*")
    ]
    alone = only(ask("simulate", state(obstacles=CROWD[1:], planner="astar", seed=2)), "Z")
    assert ends[-1]["digest"] == alone["digest"]
    assert frames[-1][0] == "S"
    summary = frames[-1][1]
    assert summary["entrants"] == ["ad-gso", "A*"]
    entry = next(e for e in summary["entries"] if e["entrant"] == "A*" and e["place"] == "")
    costs = [end["metrics"]["cost"] for end in ends if end["label"] == "A*" and end["metrics"]["cost"]]
    assert entry["runs"] == 3
    assert entry["own"]["cost"]["value"] == pytest.approx(np.mean(costs))
    # Of three seeds nobody is said to be better; who has the best number is.
    means = {
        w: np.mean([end["metrics"]["iterations"] for end in ends if end["label"] == w])
        for w in ("ad-gso", "A*")
    }
    assert summary["best"]["iterations"] == {"who": [min(means, key=lambda w: means[w])], "sure": False}


def test_a_comparison_tells_the_walls_that_each_run_has_met() -> None:
    """A wall comes where the first robot stands: in that run it does not, in the others it does."""
    alone = [ask("simulate", state(planner=name)) for name in ("ad-gso", "astar")]
    first, other = (robot_of(frames) for frames in alone)
    tick = next(t for t in range(3, 40) if first[t] not in other and other[t] not in first)
    cells = [list(first[tick]), [0, 0]]
    edits = [{"tick": tick + 1, "blocked": cells, "freed": []}]
    frames = ask("compare", state(edits=edits), planners=["ad-gso", "astar"], seeds=2)
    ends = [value for kind, value in frames if kind == "Z"]
    met = [end.get("edits") and end["edits"][0]["blocked"] for end in ends]
    assert met == [[[0, 0]], cells, None, None]


def robot_of(frames: list[tuple[str, Any]]) -> list[tuple[int, int]]:
    """The robot's cells of a stream."""
    cells = []
    for kind, value in frames:
        if kind == "T":
            (n,) = struct.unpack_from("<H", value, 4)
            cells += list(struct.iter_unpack("<hh", value[8 : 8 + 4 * n]))
    return cells


def test_everybody_plans_once_for_nobody_before_his_first_time_is_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from lampyris.app.engine import comparison as compared

    plans: list[tuple[str, int]] = []

    def spied(scenario: Any) -> Any:
        plans.append((scenario.planner, scenario.seed))
        return begin(scenario)

    monkeypatch.setattr(compared, "begin", spied)
    frames = ask("compare", state(), planners=["ad-gso", "astar"], seeds=2)
    first = [("ad-gso", 0), ("ad-gso", 0), ("astar", 0), ("astar", 0)]
    assert plans == [*first, ("ad-gso", 1), ("astar", 1)]
    assert len([kind for kind, _ in frames if kind == "Z"]) == 4


def test_who_refuses_is_told_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(scenario: Any) -> Any:
        if scenario.planner == "jps":
            raise SettingError("MOVES", "not with these moves")
        return begin(scenario)

    monkeypatch.setattr("lampyris.app.engine.comparison.begin", refuses)
    frames = ask("compare", planners=["jps", "astar"], seeds=2)
    assert [value["label"] for kind, value in frames if kind == "H"] == ["jps", "astar"]
    outcomes = [(value["planner"], value["outcome"]) for kind, value in frames if kind == "Z"]
    assert outcomes == [("jps", "refused"), ("astar", "arrived")] * 2
    assert frames[-1][0] == "S"
    entry = next(e for e in frames[-1][1]["entries"] if e["entrant"] == "jps")
    assert entry["endings"] == {"refused": 2}


@pytest.mark.parametrize(
    ("more", "code", "where"),
    [
        ({"planners": ["nobody"]}, "PLANNER", "planners: /0"),
        ({"planners": [{"name": "astar", "sets": {}}]}, "KEY", "planners: /0"),
        ({"planners": ["astar"] * 2}, "LABEL", "planners"),
        ({"planners": ["astar"] * 17}, "LIMIT", "planners"),
        ({"planners": ["astar"], "laws": [{"name": "x"}]}, "LAW", "laws: /0"),
        ({"planners": ["astar"], "seeds": 0}, "SEEDS", "seeds"),
        ({"planners": ["astar"], "seeds": [1, 1]}, "SEEDS", "seeds"),
        ({"planners": [{"name": "astar", "label": "a\nb"}]}, "TEXT", "planners: /0/label"),
    ],
)
def test_comparisons_that_are_none(more: dict[str, Any], code: str, where: str) -> None:
    fault = refusal("compare", **more)
    assert (fault.code, fault.where) == (code, where)


def test_nobody_named_is_the_scenarios_own() -> None:
    made = comparison(scenario_of_request({"scenario": state()}), {})
    assert [label for label, *_ in made.entrants] == ["ad-gso"]


# ---- files --------------------

MAGIC = {
    "png": b"\x89PNG", "svg": b"<?xml", "webp": b"RIFF", "gif": b"GIF8", "csv": b"x_m,y_m",
    "scenario": b"# A lam", "report": b"<!DOCTYPE html>",
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("what", MAGIC)
def test_files_are_of_their_kind_and_the_same_twice(what: str) -> None:
    scenario = state(map="guide", obstacles=[{"kind": "random-walk", "count": 2}], simulate={"ticks": 12})
    one, two = (b"".join(v for k, v in ask("export", scenario, what=what) if k == "B") for _ in range(2))
    assert one.startswith(MAGIC[what])
    assert one == two
    assert b"/tmp" not in one


def test_a_moment_is_a_picture_of_its_tick() -> None:
    scenario = state(map="guide", obstacles=[{"kind": "random-walk", "count": 2}])
    pictures = [ask("export", scenario, what="png", tick=tick)[0][1] for tick in (0, 5)]
    assert pictures[0] != pictures[1]
    assert Image.open(io.BytesIO(pictures[0])).format == "PNG"
    assert refusal("export", scenario, what="svg", tick=3).code == "EXPORT"
    assert refusal("export", scenario, what="png", tick=-3).code == "TICK"
    assert refusal("export", scenario, what="exe").code == "EXPORT"


@pytest.mark.nightly
def test_the_report_of_a_comparison_is_a_studys_page() -> None:
    settings = {"planners": ["ad-gso", "astar"], "seeds": 2}
    page = b"".join(
        v for k, v in ask("export", state(map="guide"), what="report", settings=settings) if k == "B"
    ).decode()
    assert "ad-gso" in page
    assert "<script" not in page


def test_words_of_a_scenario_do_not_become_markup() -> None:
    scenario = state(map={"rows": ["S..", "..G"], "name": "<img src=x>"}, name="<script>1</script>")
    page = b"".join(v for k, v in ask("export", scenario, what="report") if k == "B").decode()
    assert "<script>1" not in page
    assert "<img src=x>" not in page


def test_verbs_that_are_none() -> None:
    assert refusal("sudo").code == "VERB"
    with pytest.raises(LampyrisError, match="KEY"):
        list(work.answer({"verb": "plan", "job": 1, "scenario": [1]}, lambda: None))


def test_every_planner_can_be_watched() -> None:
    run = begin(scenario_of_request({"scenario": state(map="guide")}))
    run.tick()
    assert run.now == 1


@pytest.mark.nightly
def test_no_planning_time_of_a_comparison_holds_what_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """D* Lite was told with 650 ms at the first press and 1.3 at the second: the kernels of its repairs were
    compiled while it replanned. Here the planner compiles for an hour in each replanning."""
    hour = 3600.0

    class Clock:
        now = 0.0

        def perf_counter(self) -> float:
            return self.now

        thread_time = perf_counter

    clock = Clock()
    monkeypatch.setattr(loading, "time", clock)
    monkeypatch.setattr(loading, "_loaded", loading._Loaded())
    take, forms = IncrementalSession._take, []

    def slow(session: IncrementalSession, change: Any) -> None:
        with loading.loading():
            clock.now += hour
        clock.now += 0.001
        forms.append(_jit._compiled_only.depth)
        take(session, change)

    monkeypatch.setattr(IncrementalSession, "_take", slow)
    question = {
        "scenario": {
            "version": 1, "map": "guide", "obstacles": [{"kind": "random-walk", "count": 2}], "simulate": {}
        },
        "planners": ["dstar-lite"],
    }  # fmt: skip
    found = comparison(scenario_of_request(question), question)
    told = ComparisonResults(found)
    frames = list(compare(found, lambda: None, 1, told))
    ends = [json.loads(one[5:]) for one in frames if one[4:5] == b"Z"]
    assert len(forms) >= 2
    assert set(forms) == {1}, "what is compared runs in compiled form alone"
    assert ends[0]["timing"]["loading_s"] >= hour
    assert ends[0]["timing"]["planning_s"] < 1.0
    assert [numbers["plan_s"] for *_, numbers in told._records] == [ends[0]["timing"]["planning_s"]]
