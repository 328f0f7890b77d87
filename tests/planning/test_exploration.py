"""The order in which planners look at cells: as many as they expand, each reached from an earlier one."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.kernels.lattice.search import SHIFT
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning import exploration as explored
from lampyris.planning import registry
from lampyris.planning.exploration import exploration
from lampyris.planning.graph import expanded as recorded

GRAPHS = ("astar", "dijkstra", "bidirectional-astar", "theta-star", "lazy-theta-star", "jps")
INCREMENTAL = ("lpa-star", "dstar-lite", "dstar", "focussed-dstar")


def scene_of(seed: int, terrain: bool = False) -> Scene:
    rng = np.random.default_rng(seed)
    blocked = rng.random((19, 23)) < 0.25
    blocked[:3, :3] = blocked[-3:, -3:] = False
    values = rng.integers(0, 200, blocked.shape).astype(np.uint8) if terrain else None
    return Scene(Grid(blocked, terrain=values), (0, 0), (22, 18), "octile")


@pytest.mark.parametrize("terrain", [False, True])
@pytest.mark.parametrize("name", [*GRAPHS, *INCREMENTAL])
def test_as_many_cells_as_the_plan_expands_each_beside_an_earlier_one(name: str, terrain: bool) -> None:
    scene, planner = scene_of(1, terrain), registry.make(name, {})
    plan = lampyris.plan(scene, planner)
    looked = exploration(planner, scene, plan)
    kind = "jump points" if name == "jps" and not terrain else "cells"
    assert (looked.kind, looked.steps) == (kind, plan.expansions)
    assert not scene.grid.blocked[looked.cells[:, 1], looked.cells[:, 0]].any()
    first = scene.goal if name in INCREMENTAL else scene.start
    assert tuple(looked.cells[0]) == first
    if name in ("jps", "bidirectional-astar"):
        return
    for k in range(1, len(looked.cells)):
        assert np.abs(looked.cells[:k] - looked.cells[k]).max(axis=1).min() <= 1


@pytest.mark.parametrize("name", GRAPHS)
def test_a_search_that_may_expand_k_cells_stops_where_the_record_says(name: str) -> None:
    scene = scene_of(2)
    plan = lampyris.plan(scene, name)
    steps = exploration(registry.make(name, {}), scene, plan).steps
    session = registry.make(name, {}).open(scene, np.random.default_rng(0))
    for budget in (1, steps // 2, steps - 1):
        made = session.plan(budget=lampyris.Budget(expansions=budget))
        assert made.status is lampyris.Status.LIMIT


def test_ad_gso_has_its_field_and_the_rings_of_each_jump() -> None:
    scene = scene_of(3)
    planner = registry.make("ad-gso", {})
    plan = lampyris.plan(scene, planner)
    looked = exploration(planner, scene, plan)
    assert looked.kind == "field and rings"
    assert looked.field == len(np.unique(looked.cells[: looked.field], axis=0))
    assert tuple(looked.cells[0]) == scene.goal
    assert [cell for _, cell in looked.jumps] == [jump.chosen for jump in plan.jumps]
    counts = [looked.field, *(count for count, _ in looked.jumps)]
    assert counts == sorted(counts)
    assert counts[-1] == looked.steps
    before = scene.start
    for (a, b), jump in zip(itertools.pairwise(counts), plan.jumps, strict=True):
        ring = np.abs(looked.cells[a:b] - before).max(axis=1)
        assert (np.diff(ring) >= 0).all()
        assert (ring.min(), ring.max() <= jump.rings) == (1, True)
        before = jump.chosen


@pytest.mark.parametrize(("name", "settings"), [("gso", {"iterations": 2}), ("ad-gso", {"min_clearance": 1})])
def test_who_keeps_no_record_says_so(name: str, settings: dict[str, object]) -> None:
    scene = scene_of(3)
    known = {key: value for key, value in settings.items() if hasattr(registry.make(name, {}), key)}
    planner = registry.make(name, known)
    looked = exploration(planner, scene, lampyris.plan(scene, planner))
    assert (looked.kind, looked.steps) == ("none", 0)
    assert "records no order of expansion" in looked.note


CAR = lampyris.Robot(
    footprint=((1.6, 0.4), (-0.4, 0.4), (-0.4, -0.4), (1.6, -0.4)), drive="ackermann", turn_radius=2.0
)


def scene_of_poses(robot: lampyris.Robot = CAR) -> Scene:
    blocked = np.zeros((40, 50), dtype=bool)
    blocked[12, :40] = blocked[26, 10:] = True
    return Scene(
        Grid(blocked), (4, 4), (44, 34), robot=robot, start_pose=(4.5, 35.5, 0.0), goal_pose=(44.5, 5.5, 0.0)
    )


@pytest.mark.parametrize("name", ["lattice", "pad", "hybrid-astar", "lattice-sipp", "pad-sipp"])
def test_as_many_poses_as_the_plan_expands_each_where_the_base_may_be(name: str) -> None:
    for robot in (CAR, lampyris.Robot(radius=1.2))[: 1 if name == "hybrid-astar" else 2]:
        scene, planner = scene_of_poses(robot), registry.make(name, {})
        plan = lampyris.plan(scene, planner)
        looked = exploration(planner, scene, plan)
        assert (looked.kind, looked.steps) == ("poses", plan.expansions)
        assert looked.steps > 10
        assert not scene.grid.blocked[looked.cells[:, 1], looked.cells[:, 0]].any()
        if name not in ("pad", "pad-sipp"):  # which also search backward, from the goal
            assert tuple(looked.cells[0]) == scene.start


@pytest.mark.parametrize("name", ["lattice", "hybrid-astar"])
def test_poses_are_recorded_in_the_order_in_which_the_search_expands_them(name: str) -> None:
    scene, planner = scene_of_poses(), registry.make(name, {})
    order = exploration(planner, scene, lampyris.plan(scene, planner)).cells
    for many in (1, 2, 7, len(order) // 2, len(order) - 1):
        session: Any = planner.open(scene, np.random.default_rng(0))
        assert session.plan(budget=lampyris.Budget(expansions=many)).status is lampyris.Status.LIMIT
        search = session._search
        if name == "lattice":
            # The arrays may have been those of an earlier session.
            own = search._mark >> SHIFT == search._run
            states = np.flatnonzero(own & (search._closed > 0)) // search._stride
            closed = search.lattice_map.cells(states)
        else:
            nodes = np.flatnonzero(search._wholes[5::6] == 2)
            at = np.stack((search._floats[3 * nodes], search._floats[3 * nodes + 1]), axis=1)
            closed = (np.floor(at + 0.5) - search.hybrid_map.border).astype(int)
        assert sorted(map(tuple, closed)) == sorted(map(tuple, order[:many]))


def test_a_search_that_nobody_asks_about_records_nothing() -> None:
    for name in ("lattice", "pad", "hybrid-astar"):
        session: Any = registry.make(name, {}).open(scene_of_poses(), np.random.default_rng(0))
        session.plan()
        assert session._search.expanded is None


def test_too_many_poses_are_not_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, planner = scene_of_poses(), registry.make("lattice", {})
    plan = lampyris.plan(scene, planner)
    monkeypatch.setattr(recorded, "MOST_POSES", plan.expansions - 1)
    looked = exploration(planner, scene, plan)
    assert looked.kind == "none"
    assert "too many to be recorded" in looked.note
    assert recorded.expanded(planner, scene) is None


@pytest.mark.parametrize("name", ["lattice", "pad", "hybrid-astar", "lattice-sipp", "pad-sipp"])
def test_the_longest_record_has_as_many_poses_as_are_allowed(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, planner = scene_of_poses(), registry.make(name, {})
    many = lampyris.plan(scene, planner).expansions
    monkeypatch.setattr(recorded, "SLOW_POSES", {name: many})
    order = recorded.expanded(planner, scene)
    assert order is not None
    assert len(order) == many
    monkeypatch.setattr(recorded, "SLOW_POSES", {name: many - 1})
    for module in ("lattice.search", "lattice.timed.search", "lattice.pad.around_goal", "hybrid.search"):
        monkeypatch.setattr(f"lampyris.planning.{module}.run_noting", None)  # the slow form is not begun
    assert recorded.expanded(planner, scene) is None


def test_a_tree_is_its_lines() -> None:
    scene = scene_of(1)
    planner = registry.make("rrt", {})
    plan = lampyris.plan(scene, planner)
    looked = exploration(planner, scene, plan)
    assert (looked.kind, looked.steps) == ("tree", len(looked.lines))
    assert looked.steps > 5


def test_what_would_take_too_long_is_not_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(1)
    for name in ("theta-star", "dstar", "jps", "bidirectional-astar", "lpa-star"):
        planner = registry.make(name, {})
        plan = lampyris.plan(scene, planner)
        with monkeypatch.context() as patch:
            for module in (
                "graph.any_angle_search",
                "graph.bidirectional_search",
                "graph.jps_search",
                "incremental.search",
            ):
                patch.setattr(f"lampyris.planning.{module}.MOST_NS", 1000)
            assert exploration(planner, scene, plan).kind == "none"
        with monkeypatch.context() as patch:
            patch.setattr(recorded, "MOST_CELLS", 10)
            patch.setattr(explored, "MOST_CELLS", 10)
            assert "on a map of 437 cells" in exploration(planner, scene, plan).note
    assert recorded.MOST_NS > 10**9
