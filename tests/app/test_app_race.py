"""Races as an engine answers: plans of the library, and the order in which each planner expands cells."""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np
import pytest
from test_app_work import ask, only, refusal, state

import lampyris
from lampyris.app.engine.layers import layer_of, own_order
from lampyris.app.engine.parse import scenario_of_request
from lampyris.errors import SettingError
from lampyris.planning import registry
from lampyris.planning.graph.expanded import expanded
from lampyris.races.race import MOST_RACERS, racer

PLANNERS = ["astar", "ad-gso", "voronoi"]


def raced(
    scenario: dict[str, Any], planners: list[Any], first: int = 0
) -> tuple[list[dict[str, Any]], list[np.ndarray[Any, Any]]]:
    """Heads and orders of a race."""
    frames = ask("race", scenario, planners=planners)
    assert frames[-1] == ("Z", {})
    orders = []
    for data in (value for kind, value in frames if kind == "O"):
        number, tree, many = struct.unpack_from("<HHI", data)
        assert number == first + len(orders)
        made = np.frombuffer(data[8:], dtype="<f4" if tree else "<u4")
        assert len(made) == (4 if tree else 1) * many
        orders.append(made)
    return [value for kind, value in frames if kind == "H"], orders


def test_a_race_has_the_plans_and_the_recorded_orders_of_the_library() -> None:
    scenario = state(map="guide", start=[0, 9], goal=[7, 0], planner="astar", obstacles=[])
    heads, orders = raced(scenario, PLANNERS)
    scene = scenario_of_request({"scenario": scenario}).scene
    assert [head["planner"] for head in heads] == PLANNERS
    for head, order in zip(heads, orders, strict=True):
        plan = lampyris.plan(scene, head["planner"], seed=scenario["seed"])
        profile = lampyris.speed_profile(scene, plan)
        assert (head["expansions"], head["cost"], head["gap"]) == (plan.expansions, plan.cost, plan.gap)
        assert head["path"] == plan.cells.tolist()
        assert head["t"] == pytest.approx(profile.t, abs=1e-4)
        assert head["steps"] == len(order)
        assert head["ms"] > 0
    cells = expanded(registry.make("astar", {}), scene)
    assert cells is not None
    assert np.array_equal(orders[0], cells[:, 1] * scene.grid.width + cells[:, 0])
    assert heads[1]["steps"] == heads[1]["expansions"] or heads[1]["kind"] == "field and rings"
    assert heads[1]["jumps"][-1][1:] == [7, 0]
    assert (heads[2]["kind"], heads[2]["steps"]) == ("none", 0)
    assert "only its path is shown" in heads[2]["note"]


def test_planners_of_poses_race_beside_planners_of_cells() -> None:
    scenario = state(map="guide", start={"cell": [0, 9], "yaw": 0.0}, goal=[7, 0], obstacles=[])
    heads, orders = raced(scenario, ["lattice", "astar", "hybrid-astar"])
    scene = scenario_of_request({"scenario": scenario}).scene
    assert scene.start_pose is not None
    for head, order in zip(heads, orders, strict=True):
        plan = lampyris.plan(scene, head["planner"], seed=scenario["seed"])
        assert (head["steps"], len(order)) == (plan.expansions, plan.expansions)
        poses = plan.pose_path
        assert head["kind"] == ("cells" if poses is None else "poses")
        if poses is not None:
            assert (head["cost"], head["any_angle"]) == (poses.length_m / scene.grid.resolution, True)
            assert len(head["path"]) == len(head["t"]) == len(head["yaw"]) > 1
            assert head["yaw"][0] == 0.0
            turns = np.unwrap(poses.poses[:, 2])
            assert head["yaw"][-1] == pytest.approx(turns[-1], abs=1e-3)
            # Ahead of where it looks, unless it drives in reverse: the heading is that of the node, not of another.
            ahead = np.diff(np.array(head["path"]), axis=0) * [1, -1]
            moves = np.linalg.norm(ahead, axis=1) > 0.05
            looks = np.column_stack([np.cos(head["yaw"]), np.sin(head["yaw"])])[:-1]
            along = (ahead * looks).sum(axis=1)[moves] / np.linalg.norm(ahead, axis=1)[moves]
            assert np.abs(along).min() > 0.9
        else:
            assert head["yaw"] == []


def test_who_refuses_is_named_and_the_others_race(monkeypatch: pytest.MonkeyPatch) -> None:
    def picky(label: str, *given: Any, **more: Any) -> Any:
        if label == "dijkstra":
            raise SettingError("SIZE", "too large", where="map", allowed="smaller")
        return racer(label, *given, **more)

    monkeypatch.setattr("lampyris.app.engine.race.race.racer", picky)
    heads, orders = raced(state(map="guide", obstacles=[]), ["dijkstra", "astar"], first=1)
    assert [head["outcome"] for head in heads] == ["refused", "found"]
    assert "too large" in heads[0]["sentence"]
    assert len(orders) == 1


@pytest.mark.parametrize("many", [0, MOST_RACERS, MOST_RACERS + 1])
def test_a_race_has_one_to_six_planners(many: int) -> None:
    planners = [{"name": "astar", "settings": {}, "label": f"{k}"} for k in range(many)]
    if many > MOST_RACERS:
        assert refusal("race", state(map="guide", obstacles=[]), planners=planners).code == "RACERS"
    else:
        heads, _ = raced(state(map="guide", obstacles=[]), planners)
        assert len(heads) == max(many, 1), "none: the scenario's own"


@pytest.mark.nightly
@pytest.mark.parametrize(("what", "clock"), [("webp", "steps"), ("gif", "time")])
def test_a_race_is_one_film_of_search_and_drive(what: str, clock: str) -> None:
    from PIL import Image

    settings = {"race": True, "planners": ["astar", "rrt", "ad-gso", "gso"], "clock": clock, "fps": 5}
    scenario = state(map="guide", obstacles=[])
    data = b"".join(
        value for kind, value in ask("export", scenario, what=what, settings=settings) if kind == "B"
    )
    with Image.open(io.BytesIO(data)) as film:
        assert film.n_frames > 20
        first = np.asarray(film.convert("RGB"))
        film.seek(film.n_frames - 1)
        last = np.asarray(film.convert("RGB"))
    assert first.shape == last.shape
    assert (first != last).any(axis=2).mean() > 0.05
    wrong = refusal("export", scenario, what=what, settings={**settings, "clock": "sun"})
    assert wrong.code == "CLOCK"


def test_a_question_without_planners_races_its_own() -> None:
    assert (
        only(ask("race", state(map="guide", obstacles=[], planner="dijkstra")), "H")["planner"] == "dijkstra"
    )


@pytest.mark.parametrize("change", ["start yaw", "goal yaw", "drive", "turning radius", "footprint"])
def test_the_layer_of_poses_is_that_of_the_scene_asked_about(
    change: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two questions in one process that differ in what only planners of poses look at."""
    monkeypatch.setattr("lampyris.app.engine.cache._kept", {})
    footprint = [[0.9, 0.5], [-0.9, 0.5], [-0.9, -0.5], [0.9, -0.5]]
    robot = {"footprint": footprint, "drive": "ackermann", "turn_radius": 1.0}
    first = {
        "map": "env-3", "planner": "lattice", "obstacles": [], "robot": robot,
        "start": {"cell": [5, 5], "yaw": 0.0}, "goal": {"cell": [15, 20], "yaw": 0.0},
    }  # fmt: skip
    second = {
        "start yaw": {"start": {"cell": [5, 5], "yaw": 3.0}},
        "goal yaw": {"goal": {"cell": [15, 20], "yaw": 3.0}},
        "drive": {"robot": {**robot, "drive": "differential"}},
        "turning radius": {"robot": {**robot, "turn_radius": 8.0}},
        # The farthest vertex is as far from the base as before.
        "footprint": {"robot": {**robot, "footprint": [[0.9, 0.5], [-0.9, 0.3], [-0.9, -0.3], [0.9, -0.5]]}},
    }[change]
    found = []
    for more in ({}, second):
        scenario = scenario_of_request({"scenario": state(**{**first, **more})})
        own = own_order(scenario.scene, scenario)
        fresh = expanded(registry.make("lattice", {}), scenario.scene)
        assert own is not None
        assert fresh is not None
        assert np.array_equal(own, fresh)
        found.append(own)
    assert not np.array_equal(*found), "the scenes tell a stale answer from a fresh one"


def test_the_layer_of_a_long_search_of_poses_is_the_search_from_the_goal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A planner of poses expands more than may be recorded: the layer is answered without the slow search."""
    scenario = state(map="guide", start=[0, 9], goal=[7, 0], obstacles=[], planner="lattice")
    asked = scenario_of_request({"scenario": scenario})
    many = lampyris.plan(asked.scene, "lattice").expansions
    for most, is_own in ((many, True), (many - 1, False)):
        monkeypatch.setattr("lampyris.planning.graph.expanded.MOST_POSES", most)
        monkeypatch.setattr("lampyris.app.engine.cache._kept", {})
        assert only(ask("layer", scenario, layer="expanded"), "H")["own"] is is_own
        values = layer_of("expanded", asked, 0, None)
        assert np.isfinite(values).any()
    assert values[asked.scene.goal[1], asked.scene.goal[0]] == 1
