"""Via points: orders beside brute force, legs joined to one plan, the referee, files and the command line."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, permutations
from pathlib import Path

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.errors import LampyrisError
from lampyris.planning import visiting_order
from lampyris.planning.visiting_order import best_order
from lampyris.referee.path import check_plan
from lampyris.typing import Cell

SEEDS = range(120)


def scene_of(seed: int, points: int) -> lampyris.Scene:
    """A random map with random ends and via points on free cells; walls may part them."""
    rng = np.random.default_rng(seed)
    grid = lampyris.Grid(rng.random((9, 11)) < 0.2)
    y, x = np.nonzero(~grid.blocked)
    drawn = rng.integers(len(x), size=points + 2)
    cells = [(int(x[k]), int(y[k])) for k in drawn]
    moves = ("octile", "four-connected", "dissertation", "sixteen-connected")[seed % 4]
    return lampyris.Scene(grid, cells[0], cells[1], moves).through(cells[2:], "best")


@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=pytest.mark.nightly) if k >= 24 else k for k in SEEDS]
)
def test_the_best_order_costs_what_the_best_of_all_orders_costs(seed: int) -> None:
    scene = scene_of(seed, 1 + seed % 4)
    found = lampyris.plan(scene, "astar")
    every = [lampyris.plan(scene.through(order), "dijkstra") for order in permutations(scene.via)]
    assert bool(found) == bool(every[0])
    if found and found.path is not None:
        best = min(plan.path.exact for plan in every if plan.path is not None)
        assert found.path.exact == best
        assert found.via_lower_bound == found.cost == found.optimal_cost


def cost_of(costs: np.ndarray, order: tuple[int, ...] | list[int]) -> int:
    places = [-1, *order, len(order)]
    return sum(int(costs[a + 1, b]) for a, b in pairwise(places))


@pytest.mark.parametrize("points", range(8))
def test_orders_are_exact_up_to_eight_points_and_bounded_beyond(
    points: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(points)
    for _ in range(3 if points == 7 else 20):
        costs = rng.integers(0, 40, (points + 1, points + 1))
        least = min(cost_of(costs, order) for order in permutations(range(points)))
        order, bound = best_order(costs)
        assert sorted(order) == list(range(points))
        assert cost_of(costs, order) == bound == least
        monkeypatch.setattr(visiting_order, "EXACT_VIA", -1)
        order, bound = best_order(costs)
        monkeypatch.undo()
        assert sorted(order) == list(range(points))
        assert bound <= least <= cost_of(costs, order)


def test_thirty_points_get_an_order_and_a_bound() -> None:
    rng = np.random.default_rng(5)
    places = rng.integers(0, 100, (32, 2))
    d = np.abs(places[:, None] - places[None]).sum(axis=2)
    order, bound = best_order(d[[0, *range(2, 32)]][:, [*range(2, 32), 1]])
    cost = cost_of(d[[0, *range(2, 32)]][:, [*range(2, 32), 1]], order)
    assert sorted(order) == list(range(30))
    assert bound <= cost <= 1.5 * bound


def test_a_plan_is_that_of_its_legs() -> None:
    scene = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38)).through([(20, 30), (5, 20)])
    for planner in ("ad-gso", "theta-star", "dstar-lite"):
        found = lampyris.plan(scene, planner)
        cells = [scene.start, *scene.via, scene.goal]
        legs = [lampyris.plan(replace(scene, via=(), start=a, goal=b), planner) for a, b in pairwise(cells)]
        assert found.cells is not None
        assert found.via == scene.via
        assert found.via_lower_bound is None
        assert [tuple(found.cells[k].tolist()) for k in found.via_at] == list(scene.via)
        assert found.cost == pytest.approx(sum(leg.cost for leg in legs), rel=1e-12)
        assert found.optimal_cost == pytest.approx(sum(leg.optimal_cost or 0 for leg in legs), rel=1e-12)
        assert found.expansions == sum(leg.expansions for leg in legs)
        assert len(found.jumps) == sum(len(leg.jumps) for leg in legs)


def test_a_via_point_in_a_dead_end_is_left_the_way_it_was_entered() -> None:
    grid = lampyris.Grid(
        np.array([[False] * 9, [True] * 4 + [False] + [True] * 4, [True] * 4 + [False] + [True] * 4])
    )
    scene = lampyris.Scene(grid, (0, 0), (8, 0)).through([(4, 2)])
    found = lampyris.plan(scene, "astar")
    assert found.cells is not None
    assert found.cost == 12
    profile = lampyris.speed_profile(scene, found)
    assert profile.v[found.via_at[0]] == 0  # it turns round
    assert profile.cause[found.via_at[0]] == "turn"


def test_what_cannot_be_passed_is_an_answer_that_says_so() -> None:
    blocked = np.zeros((5, 9), dtype=bool)
    blocked[:, 4] = True
    scene = lampyris.Scene(lampyris.Grid(blocked), (0, 0), (3, 4))
    wall = lampyris.plan(scene.through([(4, 1)]), "astar")
    assert (wall.status, wall.sentence) == (
        "no-path",
        "The via point (4, 1) is not a free cell for this robot.",
    )
    beyond = lampyris.plan(scene.through([(1, 1), (7, 1)], "best"), "astar")
    assert beyond.status == "no-path"
    assert beyond.sentence.startswith("Leg 2 of 3, (1, 1) to (7, 1): No path")
    assert lampyris.plan(replace(scene, start=(4, 0), via=[(1, 1)]), "astar").status == "start-occupied"
    assert lampyris.plan(replace(scene, goal=(4, 0), via=[(1, 1)]), "astar").status == "goal-occupied"
    twice = lampyris.plan(scene.through([(0, 0), (3, 4), (3, 4)]), "astar")
    assert twice
    assert twice.via_at == (0, 4, 4)
    limit = lampyris.plan(scene.through([(3, 0), (0, 4)]), "astar", budget=lampyris.Budget(expansions=3))
    assert limit.status == "limit"


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"via": ((5, 20), (20, 30))}, "via points"),
        ({"via": ((20, 30), (5, 21))}, "via points"),
        ({"via_at": (40, 10)}, "via points"),
        ({"via_at": (10, 40)}, "via points"),
        ({"via_at": (10,)}, "via points"),
        ({"via_at": (10, 4000)}, "via points"),
        ({"via_lower_bound": 1.0}, "via bound"),
    ],
)
def test_the_referee_sees_broken_visits(change: dict[str, object], rule: str) -> None:
    scene = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38)).through([(20, 30), (5, 20)])
    found = lampyris.plan(scene, "astar")
    assert check_plan(found, scene) is None
    broken = check_plan(replace(found, **change), scene)  # type: ignore[arg-type]
    assert broken is not None
    assert broken.rule == rule


def test_the_referee_sees_a_bound_above_the_cost() -> None:
    scene = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38)).through([(20, 30)], "best")
    found = lampyris.plan(scene, "astar")
    broken = check_plan(replace(found, via_lower_bound=found.cost + 1), scene)
    assert broken is not None
    assert broken.rule == "via bound"


def test_wrong_via_points_are_refused_with_their_place() -> None:
    scene = lampyris.Scene(lampyris.Grid(np.zeros((4, 4), dtype=bool)), (0, 0), (3, 3))
    wrong: list[tuple[object, str, str]] = [
        ([(0, 0), (9, 9)], "VIA_OUTSIDE", r"via\[1\]"),
        ([(0, 0.5)], "TYPE", r"via\[0\]"),
        (7, "TYPE", "via"),
        ([(0, 0)] * 101, "VIA", "101 via points"),
    ]
    for given, code, words in wrong:
        with pytest.raises(LampyrisError, match=words) as refused:
            scene.through(given)  # type: ignore[arg-type]
        assert refused.value.code == code
    with pytest.raises(LampyrisError, match="given, best"):
        scene.through([(1, 1)], "worst")
    through = scene.through([(1, 1)])
    for planner in ("sipp", "lattice"):
        with pytest.raises(LampyrisError, match="takes no via points"):
            lampyris.plan(through, planner)


def test_points_in_cells_and_in_metres_have_no_order_together() -> None:
    words = ("plan", "guide", "--via-m", "1.5,2.5", "--via", "4,4")
    refused = call(*words)
    assert refused.returncode == 2
    assert "--via and --via-m both given" in refused.stderr
    assert call(*words, "--via-order", "best").returncode == 0
    alone = call("plan", "guide", "--via-order", "best")
    assert alone.returncode == 2
    assert "without via points" in alone.stderr


def test_a_scenario_keeps_its_via_points(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    text = "version: 1\nmap: {bundled: env-1}\nplanner: astar\nvia: [[20, 30], {m: [5.5, 29.5]}]\nvia_order: best\n"
    file.write_text(text)
    scenario = lampyris.load_scenario(file)
    cells: tuple[Cell, ...] = ((20, 30), (5, 20))
    assert (scenario.scene.via, scenario.scene.via_order) == (cells, "best")
    lampyris.save_scenario(scenario, tmp_path / "b.yaml")
    assert lampyris.load_scenario(tmp_path / "b.yaml").scene.via == cells
    file.write_text(f"{text[: text.index('via:')]}via: [[50, 0]]\n")
    with pytest.raises(LampyrisError, match="outside the map"):
        lampyris.load_scenario(file)
    file.write_text(f"{text}simulate: {{}}\n")
    trace = lampyris.run(lampyris.load_scenario(file))
    assert isinstance(trace, lampyris.Trace)
    assert (trace.arrived, sorted(trace.via)) == (True, sorted(cells))


@pytest.mark.parametrize("order", ["given", "best"])
def test_a_round_trip_to_a_place_out_of_reach_is_no_path(order: str) -> None:
    # The referee took it for a fault: from a start that is the goal there is a path.
    walls = np.zeros((3, 5), dtype=bool)
    walls[:, 2] = True
    scene = lampyris.Scene(lampyris.Grid(walls), (0, 0), (0, 0)).through([(4, 0)], order)
    assert lampyris.plan(scene, "astar").status.value == "no-path"
    home = scene.through([(1, 2)], order)
    assert lampyris.plan(home, "astar").cost == pytest.approx(2 + 2 * 2**0.5)
