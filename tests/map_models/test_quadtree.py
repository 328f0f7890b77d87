"""The planner quadtree: its leaves cover the map exactly, and it finds a path wherever there is one."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.graph.astar import AStar
from lampyris.planning.map_models import quadtree
from lampyris.planning.map_models.quadtree import Quadtree, leaves_of
from lampyris.referee import check_plan
from lampyris.testing import check_planner
from sizes import sized

NAMES = sorted(MOVES)
RNG = np.random.default_rng(0)


@pytest.mark.nightly
@sized("cases", 1, 3)
def test_the_contract(cases: int) -> None:
    check_planner(Quadtree(), cases=cases)


@pytest.mark.parametrize("shape", [(1, 1), (3, 7), (16, 16), (20, 33)])
def test_leaves_cover_the_map_once_and_cannot_be_joined(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng([85, *shape])
    free = rng.random(shape) > 0.15
    leaves = leaves_of(free)
    covered = np.zeros((64, 64), dtype=int)
    for k, (x, y, side, kind) in enumerate(leaves.boxes.tolist()):
        assert side & (side - 1) == x % side == y % side == 0
        block = free[y : y + side, x : x + side]
        assert (block == bool(kind)).all()
        assert (k < leaves.free) == bool(kind)
        if kind:
            assert block.shape == (side, side)
            assert (leaves.leaf[y : y + side, x : x + side] == k).all()
        covered[y : y + side, x : x + side] += 1
        # The square of twice the side around it is mixed, or there is none.
        twice = 2 * side
        whole = np.zeros((128, 128), dtype=bool)
        whole[: shape[0], : shape[1]] = free
        around = whole[y // twice * twice :, x // twice * twice :][:twice, :twice]
        assert twice > leaves.leaf.shape[0] or (around.any() and not around.all())
    assert (covered[: shape[0], : shape[1]] == 1).all()


def test_leaves_are_cut_band_by_band_and_asked_to_stop_in_between(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plan on 1024 x 1024 once went on for 57 ms after it was cancelled, all of it here."""
    asked: list[int] = []
    monkeypatch.setattr(quadtree, "checkpoint", lambda: asked.append(1))
    rng = np.random.default_rng(87)
    for _ in range(20):
        free = rng.random(rng.integers(1, 40, 2)) < rng.choice([0.5, 0.97, 1.0])
        monkeypatch.setattr(quadtree, "_PART", 1 << 18)
        asked.clear()
        whole, few = leaves_of(free), len(asked)
        monkeypatch.setattr(quadtree, "_PART", int(rng.integers(1, 200)))
        asked.clear()
        cut = leaves_of(free)
        assert cut.free == whole.free
        np.testing.assert_array_equal(cut.leaf, whole.leaf)
        np.testing.assert_array_equal(cut.boxes, whole.boxes)
        assert len(asked) >= few >= 2
    assert len(asked) > 4


@pytest.mark.parametrize("name", NAMES)
@sized("maps", 12, 200)
def test_it_finds_a_path_wherever_there_is_one(name: str, maps: int) -> None:
    rng = np.random.default_rng([86, NAMES.index(name)])
    found = 0
    for _ in range(maps):
        walls = rng.random(rng.integers(2, 30, 2)) < rng.choice([0.1, 0.25, 0.4])
        height, width = walls.shape
        start, goal = ((int(rng.integers(width)), int(rng.integers(height))) for _ in range(2))
        scene = Scene(Grid(walls), start, goal, name, Robot(radius=float(rng.choice([0.0, 0.0, 0.8]))))
        plan, exact = (one.open(scene, RNG).plan() for one in (Quadtree(), AStar()))
        assert check_plan(plan, scene) is None
        assert plan.status == exact.status
        if plan.map_model is not None and plan.any_angle_length is not None:
            found += 1
            assert (
                plan.map_model.counts["expanded"] == plan.expansions <= plan.map_model.counts["free leaves"]
            )
            assert plan.any_angle_length >= np.hypot(goal[0] - start[0], goal[1] - start[1]) - 1e-9
    assert found >= maps // 6


def test_an_empty_map_is_one_leaf() -> None:
    scene = Scene(Grid(np.zeros((64, 64), dtype=bool)), (3, 5), (60, 17))
    plan = Quadtree().open(scene, RNG).plan()
    assert plan.waypoints is not None
    assert plan.map_model is not None
    assert plan.waypoints.tolist() == [[3, 5], [60, 17]]
    assert plan.map_model.boxes.tolist() == [[0, 0, 64, 1]]
    assert plan.expansions == 0
