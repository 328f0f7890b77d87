"""Maps by recipes, what is told while an engine works, and every layer against the library's own numbers."""

from __future__ import annotations

import io
import json
import os
import struct
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from app_server import WAYS
from PIL import Image
from test_app_work import ask, only, refusal, state

from lampyris import scenarios
from lampyris._core.cancellation import Cancelled
from lampyris.app.engine import parse as said
from lampyris.app.engine import simulation, work
from lampyris.app.engine.bootstrap import hello
from lampyris.app.engine.layers import own_order, reach
from lampyris.app.engine.progress import heard
from lampyris.app.engine.simulation import begin
from lampyris.app.server.server import ASKED
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.recipes.make import RECIPES, make_ground
from lampyris.model.grid import Grid
from lampyris.planning import registry
from lampyris.planning.field.gates import gate_mask
from lampyris.planning.field.layers import clearance
from lampyris.planning.field.solve import solve_field
from sizes import some

CAVES = {"recipe": "caves", "size": [48, 32], "seed": 5, "settings": {"fill": 0.45}}


@pytest.fixture(autouse=True)
def _fresh() -> Iterator[None]:
    said._maps.clear()
    yield
    said._maps.clear()


# ---- recipes --------------------


def test_hello_has_every_recipe_with_every_setting_a_form_can_hold() -> None:
    told = {one["name"]: one for one in hello()["recipes"]}
    assert set(told) == set(RECIPES)
    for name, row in RECIPES.items():
        shown = {one["name"]: one for one in told[name]["settings"]}
        assert set(shown) == {one.name for one in row.table if one.kind != "cells"}
        for one in row.table:
            if one.kind == "cells":
                continue
            assert shown[one.name]["default"] == one.default
            assert (shown[one.name]["least"], shown[one.name]["most"]) == (one.least, one.most)
            assert shown[one.name]["type"] == ("whole" if one.kind == "whole number" else "number")
    json.dumps(told, allow_nan=False)


@pytest.mark.parametrize("name", list(RECIPES))
def test_a_made_map_is_the_recipes_and_its_ends_can_meet(name: str) -> None:
    frames = ask("make", map={"recipe": name, "size": [60, 50], "seed": 2, "resolution": 0.5})
    head = only(frames, "H")
    ground = make_ground(name, 60, 50, 2)
    blocks = [value for kind, value in frames if kind == "B"]
    assert np.array_equal(np.frombuffer(blocks[0], np.uint8).reshape(50, 60) == 1, ground.blocked)
    assert (len(blocks) == 2) == (ground.terrain is not None)
    if ground.terrain is not None:
        assert blocks[1] == ground.terrain.tobytes()
    grid = Grid(ground.blocked, resolution=0.5, name=name, terrain=ground.terrain)
    assert head["hash"] == map_hash(grid)
    assert head["resolution"] == 0.5
    found = only(
        ask(
            "plan",
            state(
                map={"recipe": name, "size": [60, 50], "seed": 2},
                planner="astar",
                start=head["start"],
                goal=head["goal"],
            ),
        ),
        "Z",
    )
    assert found["status"] == "found"


@pytest.mark.parametrize(
    ("spec", "code", "where"),
    [
        (None, "MAP", "map"),
        ({"file": "/etc/passwd"}, "MAP", "map"),
        ({"recipe": "caverns", "size": [9, 9]}, "RECIPE", "/map"),
        ({"recipe": "caves"}, "KEY", "/map"),
        ({"recipe": "caves", "size": [3, 9]}, "MAP_SIZE", "/map"),
        ({"recipe": "caves", "size": [9000, 9]}, "MAP_SIDE", "/map"),
        ({"recipe": "random", "size": [9, 9], "settings": {"density": 2}}, "RECIPE", "/map"),
        ({"recipe": "random", "size": [9, 9], "settings": {"edits": []}}, "RECIPE", "/map"),
        ({"recipe": ["caves"], "size": [9, 9]}, "TYPE", "/map/recipe"),
    ],
)
def test_what_no_recipe_makes_is_told_at_its_place(spec: Any, code: str, where: str) -> None:
    fault = refusal("make", map=spec)
    assert (fault.code, fault.where.endswith(where)) == (code, True)


def test_making_is_a_way_of_its_own_that_takes_a_map_and_nothing_else() -> None:
    assert tuple(ASKED["make"]) == ("map",)
    assert [way.method for way in WAYS if way.path == "/api/make"] == ["POST"]


def test_a_map_by_a_recipe_is_made_once_for_many_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []

    def make(*given: Any, **more: Any) -> Any:
        made.append(given)
        return make_ground(*given, **more)

    monkeypatch.setattr("lampyris.io.scenario.map_source.make_ground", make)
    head = only(ask("make", map=CAVES), "H")
    for seed in range(3):
        ask("plan", state(map=CAVES, seed=seed, start=head["start"], goal=head["goal"]))
    # Once to be looked at, and once for the engine's own shelf, which another engine might have.
    assert len(made) <= 2


def test_edits_at_the_beginning_do_not_stay_in_the_map_of_the_recipe() -> None:
    head = only(ask("make", map=CAVES), "H")
    x, y = head["start"]
    ends = {"start": head["start"], "goal": head["goal"], "map": CAVES}
    edits = [{"tick": 0, "blocked": [[x + 1, y]], "freed": []}]
    first = said.scenario_of_request({"scenario": state(**ends)}).scene.grid.blocked.copy()
    said.scenario_of_request({"scenario": state(**ends, edits=edits)})
    assert np.array_equal(said.scenario_of_request({"scenario": state(**ends)}).scene.grid.blocked, first)


def test_the_saved_scenario_of_a_made_map_holds_its_recipe_and_gives_the_same_run(tmp_path: Path) -> None:
    head = only(ask("make", map=CAVES), "H")
    crowd = [{"kind": "random-walk", "count": 6}]
    made = state(map=CAVES, start=head["start"], goal=head["goal"], obstacles=crowd)
    shown = only(ask("simulate", made), "Z")
    text = b"".join(value for kind, value in ask("export", made, what="scenario") if kind == "B")
    assert b"recipe: caves" in text
    assert b"rows" not in text
    file = tmp_path / "made.yaml"
    file.write_bytes(text)
    trace: Any = scenarios.run(scenarios.load_scenario(file))
    assert simulation.digest(trace) == shown["digest"]


# ---- what is told meanwhile --------------------


def told_of(verb: str, scenario: dict[str, Any], **more: Any) -> list[dict[str, Any]]:
    pieces: list[bytes] = []
    with heard(pieces.append):
        ask(verb, scenario, **more)
    return [json.loads(piece[5:]) for piece in pieces]


@pytest.mark.nightly
@pytest.mark.parametrize("what", some(["webp", "gif"]))
def test_a_film_tells_how_many_frames_of_how_many_are_drawn(
    what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lampyris.app.engine.progress.SELDOM", 0.0)
    made = state(map="guide", obstacles=[{"kind": "random-walk", "count": 2}])
    end = only(ask("simulate", made), "Z")
    told = told_of("export", made, what=what)
    running = [one["done"] for one in told if one["what"] == "running"]
    assert running == list(range(end["ticks"] + 1))
    drawing = [(one["done"], one["of"]) for one in told if one["what"] == "drawing"]
    assert drawing == [(k, drawing[0][1]) for k in range(drawing[0][1] + 1)]
    assert told[-1] == {"what": "writing"}
    file = b"".join(value for kind, value in ask("export", made, what=what) if kind == "B")
    with Image.open(io.BytesIO(file)) as film:
        # The file may join frames that look the same.
        assert getattr(film, "n_frames", 1) <= drawing[0][1]


def test_nothing_is_told_where_nobody_listens_and_the_frames_stay_the_same() -> None:
    made = state(map="guide")
    quiet = ask("export", made, what="csv")
    pieces: list[bytes] = []
    with heard(pieces.append):
        assert ask("export", made, what="csv") == quiet
    assert [kind for kind, _ in quiet] == ["B"] * (len(quiet) - 1) + ["Z"]
    assert quiet[-1][1] == {"bytes": sum(len(value) for kind, value in quiet if kind == "B")}


def test_a_film_is_stopped_while_it_is_drawn() -> None:
    pieces: list[bytes] = []

    def look() -> None:
        if any(b'"drawing"' in piece for piece in pieces):
            raise Cancelled

    question = {"verb": "export", "job": 1, "scenario": state(map="guide"), "what": "gif"}
    with heard(pieces.append), pytest.raises(Cancelled):
        list(work.answer(question, look))


@pytest.mark.nightly
def test_an_engine_says_that_it_compiles_and_a_warm_one_does_not(tmp_path: Path) -> None:
    """With a cache of its own: the first use compiles, and tells the job that waits for it."""
    question = {"verb": "plan", "job": 9, "scenario": state(map="random-512", planner="astar")}
    code = [sys.executable, "-c", TELLS, json.dumps(question)]
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}
    env["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    cold, warm = (subprocess.run(code, env=env, capture_output=True, text=True, check=True) for _ in "ab")
    told = cold.stdout.split()
    assert set(told) == {"compiling", "working", "found"}
    assert told[-2:] == ["working", "found"]
    assert warm.stdout.split() == ["found"]


TELLS = """
import json, sys
from lampyris.app.engine import work
from lampyris.app.engine.progress import heard, tell
from lampyris.kernels._jit import on_compile
on_compile(lambda on: tell("compiling" if on else "working"))
with heard(lambda piece: print(json.loads(piece[5:])["what"])):
    for piece in work.answer(json.loads(sys.argv[1]), lambda: None):
        print(json.loads(piece[5:])["status"])
"""


# ---- what bounds the speed of a run --------------------


def caps_of(piece: bytes) -> tuple[int, dict[str, np.ndarray]]:
    first, n, rules = struct.unpack_from("<IHH", piece)
    names, at = [], 8
    for _ in range(rules):
        names.append(piece[at + 1 : at + 1 + piece[at]].decode())
        at += 1 + piece[at]
    table = np.frombuffer(piece[at:], "<f4").reshape(rules, n)
    return first, dict(zip(names, table, strict=True))


BUSY = [{"kind": "random-walk", "count": 12, "rate": 0.5}]


@pytest.mark.parametrize("law", ["physical", "dissertation", "blind", "rpp"])
@pytest.mark.parametrize("slow", [False, True])
def test_a_speed_is_what_its_rule_allows_and_no_rule_allows_less(
    law: str, slow: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if slow:
        monkeypatch.setattr("lampyris.app.engine.simulation.CHUNK_S", -1.0)
    made = state(law={"name": law, "settings": {}}, obstacles=BUSY, robot={"radius": 0.2})
    frames = ask("simulate", made)
    head, end = only(frames, "H"), only(frames, "Z")
    n = end["ticks"] + 1
    speed, cause = np.full(n, np.nan), np.full(n, -1)
    caps: dict[str, np.ndarray] = {}
    for kind, value in frames:
        if kind == "T":
            first, some, _ = struct.unpack_from("<IHH", value)
            speed[first : first + some] = np.frombuffer(value, "<f4", some, 8 + 4 * some)
            cause[first : first + some] = np.frombuffer(value, np.uint8, some, 8 + 8 * some)
        elif kind == "C":
            first, found = caps_of(value)
            for name, part in found.items():
                caps.setdefault(name, np.full(n, np.nan))[first : first + len(part)] = part
    assert {"limit"} <= set(caps)
    words = [head["causes"][k] for k in cause]
    bound = 0
    for name, allowed in caps.items():
        told = ~np.isnan(allowed)
        if law != "rpp":
            assert (speed[told] <= allowed[told] * (1 + 1e-6) + 1e-9).all(), name
        by = np.array([word == name for word in words])
        assert np.allclose(speed[by], allowed[by], rtol=1e-6, atol=0, equal_nan=False), name
        bound += int(by.sum())
    assert bound > 0
    still = np.array([word in ("waiting", "goal", "start") for word in words])
    assert all(np.isnan(allowed[still]).all() for allowed in caps.values())


def test_what_is_watched_is_the_same_run_as_what_is_not() -> None:
    made = state(obstacles=BUSY, law="dissertation")
    trace = scenarios.run(said.scenario_of_request({"scenario": made}))
    assert simulation.digest(trace) == only(ask("simulate", made), "Z")["digest"]  # type: ignore[arg-type]


# ---- layers against the library's own numbers --------------------


def layer(name: str, scenario: dict[str, Any], **more: Any) -> tuple[float, float, np.ndarray, Any]:
    frames = ask("layer", scenario, layer=name, obstacle_cells=None, tick=0, **more)
    value = only(frames, "L")
    assert value[1 : 1 + value[0]] == name.encode()
    width, height, low, high = struct.unpack_from("<IIff", value, 1 + value[0])
    head = next((found for kind, found in frames if kind == "H"), None)
    return low, high, np.frombuffer(value[17 + value[0] :], np.uint8).reshape(height, width), head


def pixels(values: np.ndarray) -> np.ndarray:
    """A layer as its frame must hold it: 255 steps from least to greatest, 0 where there is none."""
    there = np.isfinite(values)
    low, high = values[there].min(), values[there].max()
    out = np.zeros(values.shape)
    out[there] = np.round(1 + 254 * (values[there] - low) / (high - low if high > low else 1.0))
    return out


PLACES = [("env-3", {}), ("hills-256", {"planner": "astar"}), ("guide", {"preset": "dissertation"})]


@pytest.mark.parametrize(("map_", "more"), PLACES)
@pytest.mark.parametrize("name", ["cost", "luciferin", "clearance", "reach"])
def test_a_pixel_of_a_layer_is_the_librarys_number(name: str, map_: str, more: dict[str, Any]) -> None:
    made = state(map=map_, obstacles=[{"kind": "random-walk", "count": 5}], **more)
    low, high, shown, _ = layer(name, made)
    scene = said.scenario_of_request({"scenario": made}).scene
    if name == "clearance":
        # Not the function that the layer asks: by the distance to every wall.
        walls = np.argwhere(scene.grid.blocked)
        y, x = 7, 3
        direct = np.sqrt(((walls - (y, x)) ** 2).sum(axis=1).min()) * scene.grid.resolution
        values = np.where(scene.grid.blocked, np.inf, clearance(scene.grid))
        assert scene.grid.blocked[y, x] or abs(values[y, x] - direct) <= scene.grid.resolution
    elif name == "reach":
        run = begin(said.scenario_of_request({"scenario": made}))
        bodies = [run.world.space.cell(number) for number in run.world.where]
        assert (shown[tuple(np.array(bodies).T[::-1])] == 1).all()
        values = reach(scene.grid, bodies, scene.moves.corner_cutting, 64)
    else:
        values = getattr(solve_field(scene), name)
    assert np.array_equal(shown, pixels(values))
    there = np.isfinite(values)
    assert [low, high] == [float(np.float32(f(values[there]))) for f in (np.min, np.max)]


def test_gates_are_those_of_the_librarys_detector() -> None:
    made = state(map="env-3")
    found = only(ask("plan", made, layers=["gates"]), "Z")["gates"]
    scene = said.scenario_of_request({"scenario": made}).scene
    mask = gate_mask(scene.grid, scene.robot)
    cells = {tuple(gate["cell"]) for gate in [*found["in_map"], *found["on_path"]]}
    assert cells == {(int(x), int(y)) for y, x in np.argwhere(mask)}
    assert cells


@pytest.mark.parametrize("planner", ["astar", "dijkstra"])
@pytest.mark.parametrize("map_", some(["env-3", "guide", "hills-256"], 2))
def test_the_expanded_cells_are_the_planners_own_in_its_order(planner: str, map_: str) -> None:
    made = state(map=map_, planner=planner)
    low, high, shown, head = layer("expanded", made)
    plan = only(ask("plan", made), "Z")
    assert head == {"layer": "expanded", "planner": planner, "own": True}
    assert (low, high) == (1, plan["expansions"]) == (1, np.count_nonzero(shown))
    scenario = said.scenario_of_request({"scenario": made})
    cells = own_order(scenario.scene, scenario)
    assert cells is not None
    assert len(np.unique(cells, axis=0)) == len(cells) == plan["expansions"]
    assert tuple(cells[0]) == scenario.scene.start
    assert set(map(tuple, plan["cells"][:-1])) <= set(map(tuple, cells.tolist()))
    # Without a heuristic cells come by their distance from the start.
    if planner == "dijkstra":
        back = solve_field(replace(scenario.scene, start=scenario.scene.goal, goal=scenario.scene.start))
        if scenario.scene.grid.terrain is None:
            far = back.exact[cells[:, 1], cells[:, 0]]
            assert (np.diff(far) >= 0).all()
    # Each but the first is next to one that came before.
    when = np.full(scenario.scene.grid.blocked.shape, len(cells) + 1)
    when[cells[:, 1], cells[:, 0]] = np.arange(len(cells))
    reach_ = scenario.scene.moves.reach
    for k, (x, y) in enumerate(cells[1:].tolist(), 1):
        around = when[max(y - reach_, 0) : y + reach_ + 1, max(x - reach_, 0) : x + reach_ + 1]
        assert around.min() < k


@pytest.mark.parametrize("planner", ["theta-star", "dstar-lite"])
def test_the_layer_has_the_recorded_order_of_other_planners_too(planner: str) -> None:
    made = state(map="env-3", planner=planner)
    low, high, shown, head = layer("expanded", made)
    assert head == {"layer": "expanded", "planner": planner, "own": True}
    assert (low, high) == (1, only(ask("plan", made), "Z")["expansions"]) == (1, np.count_nonzero(shown))


def test_the_order_stops_with_a_budget_as_the_compiled_search_does() -> None:
    """The same cells, counted one by one by searches that may expand k cells."""
    scenario = said.scenario_of_request({"scenario": state(map="guide", planner="astar")})
    cells = own_order(scenario.scene, scenario)
    assert cells is not None
    session: Any = registry.make("astar", {}).open(scenario.scene, np.random.default_rng(0))
    assert session.search.find_path(scenario.scene.start, scenario.scene.goal).expansions == len(cells)
    for k in range(len(cells)):
        assert session.search.find_path(scenario.scene.start, scenario.scene.goal, k).cells is None


@pytest.mark.parametrize("planner", ["ad-gso", "sipp"])
def test_who_keeps_no_record_is_shown_the_search_from_the_goal_under_its_own_name(planner: str) -> None:
    made = state(map="env-3", planner=planner)
    _, _, shown, head = layer("expanded", made)
    assert head == {"layer": "expanded", "planner": planner, "own": False}
    scene = said.scenario_of_request({"scenario": made}).scene
    first = np.argwhere(shown == 1)
    assert tuple(first[0][::-1]) == scene.goal or len(first) > 1
