"""The first try of the planner lattice: its lower bound, its paths, and what it saves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lattice_scenes import FOOTPRINTS, optimum, scene_of

from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.guided import guided_search
from lampyris.planning.lattice.guided.lower_bound import both_ends_bound, goal_of, lower_bounds
from lampyris.planning.lattice.guided.open_space import FAR, open_space_of
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.lattice_planner import LatticePlanner, LatticeSession
from lampyris.referee import check_plan
from sizes import sized


def opened(scene: Scene, weight: float) -> LatticeSession:
    return LatticePlanner(weight=weight, shortcut=False).open(scene, np.random.default_rng(0))


def asked(scene: Scene, weight: float, budget: Budget | None = None) -> Plan:
    plan = opened(scene, weight).plan(None, budget)
    if plan:
        assert check_plan(plan, scene) is None
    return plan


@sized("maps", 6, 1000)
def test_paths_keep_the_bound_and_no_path_agrees(maps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against the exhaustive search, with the first try on maps of any size."""
    monkeypatch.setattr(guided_search, "MANY", 0)
    monkeypatch.setattr(guided_search, "CELLS", 0)
    tries: list[bool] = []
    first_try = guided_search.GuidedSearch.first_try

    def noted(self, *arguments):  # type: ignore[no-untyped-def]
        found, expansions = first_try(self, *arguments)
        tries.append(found is not None)
        return found, expansions

    monkeypatch.setattr(guided_search.GuidedSearch, "first_try", noted)
    for seed in range(maps):
        scene = scene_of(seed, "ackermann", list(FOOTPRINTS.values())[seed % 3], side=12 + seed % 9)
        status, least = optimum(scene, LatticePlanner(weight=1.0))
        for weight in (1.3, 2.0, 8.0):
            plan = asked(scene, weight)
            assert plan.status is status, (seed, weight)
            if plan.pose_path is not None:
                path = plan.pose_path
                assert path.lower_bound_m <= least * (1 + 1e-9), (seed, weight)
                assert least <= path.cost_m * (1 + 1e-9) <= weight * least * (1 + 2e-9)
                assert path.bound <= weight * (1 + 1e-6)
    assert True in tries
    assert False in tries


@sized("maps", 8, 600)
def test_a_first_try_between_joined_ends_keeps_its_bound(maps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against a search with weight 1 between the same states, which makes no first try."""
    monkeypatch.setattr(guided_search, "MANY", 0)
    quick: list[bool] = []
    first_try = guided_search.GuidedSearch.first_try

    def noted(self, *arguments):  # type: ignore[no-untyped-def]
        found, expansions = first_try(self, *arguments)
        quick.append(found is not None)
        return found, expansions

    monkeypatch.setattr(guided_search.GuidedSearch, "first_try", noted)
    for seed in range(maps):
        scene = scene_of(seed, "ackermann", list(FOOTPRINTS.values())[seed % 3], side=14 + 5 * (seed % 5))
        best = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0)).plan()
        for weight in (1.3, 2.5):
            plan = LatticePlanner(weight=weight).open(scene, np.random.default_rng(0)).plan()
            assert plan.status is best.status, (seed, weight)
            if plan.pose_path is None or best.pose_path is None:
                continue
            assert check_plan(plan, scene) is None
            least = best.attributes.get("lattice_cost", best.pose_path.cost_m)
            cost = plan.attributes.get("lattice_cost", plan.pose_path.cost_m)
            assert plan.pose_path.lower_bound_m <= least * (1 + 1e-9), (seed, weight)
            assert cost <= weight * least * (1 + 1e-6), (seed, weight)
    assert any(quick)
    assert False in quick


@sized("pairs", 6, 600)
def test_the_lower_bound_is_below_every_path_and_above_the_field(pairs: int) -> None:
    """On maps some times as large as the squares of open space, against searches with weight 1."""
    rng = np.random.default_rng(8)
    robot = Robot(drive="ackermann", footprint=FOOTPRINTS["car"], turn_radius=2.0)
    known = higher = stronger = 0
    while known < pairs:
        walls = rng.random((50, 50)) < rng.choice([0.0, 0.01, 0.04])
        ends = [(*rng.uniform(0, 50, 2).tolist(), float(rng.uniform(-3, 3))) for _ in range(2)]
        session = opened(Scene(Grid(walls), start_pose=ends[0], goal_pose=ends[1], robot=robot), 1.0)
        plan = session.plan()
        if plan.pose_path is None:
            continue
        known += 1
        lattice_map = session.lattice_map
        start, goal = (
            (lattice_map.index(cell), heading)
            for cell, heading in (session.starts(lattice_map)[0], session.goals(lattice_map)[0])
        )
        assert session._heuristic is not None
        field, open_space = session._heuristic[1], open_space_of(lattice_map.lattice)
        known_goal = goal_of([goal], open_space, lattice_map, field)
        assert known_goal is not None
        (bound,) = lower_bounds([start], [0], known_goal, open_space, lattice_map, field).tolist()
        assert bound <= plan.pose_path.cost_m * UNIT * (1 + 1e-9)
        around = both_ends_bound([start], [0], known_goal, open_space, lattice_map, field)
        assert around <= plan.pose_path.cost_m * UNIT * (1 + 1e-9)
        stronger += around > bound + UNIT
        higher += bound > field[start[0]] + UNIT
    assert higher > known / 3
    assert stronger > 0


@sized("pairs", 6, 600)
def test_the_bound_of_both_ends_holds_between_joined_ends(pairs: int) -> None:
    """Several states at each end, with the costs of their curves, against searches with weight 1."""
    rng = np.random.default_rng(11)
    robot = Robot(drive="ackermann", footprint=FOOTPRINTS["car"], turn_radius=2.0)
    known = stronger = 0
    while known < pairs:
        walls = rng.random((50, 50)) < rng.choice([0.0, 0.01, 0.04])
        ends = [(*rng.uniform(0, 50, 2).tolist(), float(rng.uniform(-3, 3))) for _ in range(2)]
        scene = Scene(Grid(walls), start_pose=ends[0], goal_pose=ends[1], robot=robot)
        session = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0))
        joined = session._joined_ends(session.lattice_map)
        if joined.start is None or joined.goal is None:
            continue
        search = session._search
        assert search is not None
        answer = session._search_states(search, Query.between([], [], joined), None)
        if isinstance(answer, Plan):
            continue
        heuristic, query = session._known_goals(search, Query.between([], [], joined))
        query = query.starting_at([k for k, (cell, _) in enumerate(query.starts) if heuristic[cell] >= 0])
        open_space = open_space_of(session.lattice_map.lattice, FAR)
        goal = goal_of(query.goals, open_space, session.lattice_map, heuristic, query.goal_costs)
        if goal is None or not query.starts:
            continue
        known += 1
        asked = (query.starts, query.start_costs, goal, open_space, session.lattice_map, heuristic)
        around = both_ends_bound(*asked)
        assert around <= answer[0].cost * (1 + 1e-9)
        stronger += around > lower_bounds(*asked).min() + UNIT / 10
    assert stronger > 0


def test_it_expands_a_tenth_of_the_states(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot(drive="ackermann", footprint=FOOTPRINTS["car"], turn_radius=4.0)
    scene = Scene(
        Grid(np.zeros((140, 140), dtype=bool)), start_pose=(20.5, 70.5, math.pi), goal_pose=(100.5, 70.5, math.pi),
        robot=robot,
    )  # fmt: skip
    quick = asked(scene, 2.0)
    assert quick.status is Status.FOUND
    # A budget counts the states of both searches.
    assert asked(scene, 2.0, Budget(expansions=quick.expansions - 1)).status is Status.LIMIT
    monkeypatch.setattr(guided_search, "MANY", 1 << 60)
    assert quick.expansions * 10 <= asked(scene, 2.0).expansions
