"""The planner voronoi: no path has more room where it is narrowest, and it runs along ridges."""

from __future__ import annotations

import heapq
import math

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import clearance, free_cells
from lampyris.planning.map_models import ridges
from lampyris.planning.map_models.voronoi import Voronoi
from lampyris.referee import check_plan
from lampyris.testing import check_planner
from sizes import sized

RNG = np.random.default_rng(0)
Cell = tuple[int, int]


def rooms_of(walls: np.ndarray, free: np.ndarray, border: bool) -> dict[Cell, float]:
    """The distance of each free cell to the nearest wall, cells, by trying all."""
    height, width = walls.shape
    rooms = {}
    for y, x in np.argwhere(free):
        gaps = [
            math.hypot(max(abs(bx - x) - 0.5, 0), max(abs(by - y) - 0.5, 0)) for by, bx in np.argwhere(walls)
        ]
        edge = min(x, y, width - 1 - x, height - 1 - y) + 0.5
        rooms[int(x), int(y)] = min([*gaps, *([edge] if border else [])], default=math.inf)
    return rooms


def widest(rooms: dict[Cell, float], start: Cell, goal: Cell, corners: bool) -> float | None:
    """The greatest least room of a path, by a search for it; None: there is no path."""
    heap, done = [(-rooms[start], start)], set()
    while heap:
        worst, here = heapq.heappop(heap)
        if here == goal:
            return -worst
        if here in done:
            continue
        done.add(here)
        for dx, dy in ((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if corners or not i * j):
            to = (here[0] + dx, here[1] + dy)
            if to in rooms and to not in done:
                heapq.heappush(heap, (max(worst, -rooms[to]), to))
    return None


@pytest.mark.nightly
@sized("cases", 1, 3)
def test_the_contract(cases: int) -> None:
    check_planner(Voronoi(), cases=cases)
    check_planner(Voronoi(border=False), cases=cases)


@sized("maps", 25, 300)
def test_no_path_has_more_room_where_it_is_narrowest(maps: int) -> None:
    rng = np.random.default_rng(83)
    found = 0
    for _ in range(maps):
        walls = rng.random(rng.integers(3, 14, 2)) < rng.choice([0.05, 0.1, 0.2, 0.3])
        name, radius, border = (
            str(rng.choice(sorted(MOVES))),
            float(rng.choice([0, 0, 0.8])),
            bool(rng.integers(2)),
        )
        grid = Grid(walls)
        open_cells = free_cells(grid, radius)
        rooms = rooms_of(walls, open_cells, border)
        if len(rooms) < 2:
            continue
        start, goal = (list(rooms)[int(rng.integers(len(rooms)))] for _ in range(2))
        scene = Scene(grid, start, goal, name, Robot(radius=radius))
        plan = Voronoi(border=border).open(scene, RNG).plan()
        assert check_plan(plan, scene) is None
        best = widest(rooms, start, goal, MOVES[name].corner_cutting and radius == 0)
        assert bool(plan) == (best is not None)
        if plan.path is None or plan.map_model is None or best is None:
            continue
        found += 1
        cells = [(int(x), int(y)) for x, y in plan.path.cells]
        assert len(set(cells)) == len(cells)
        assert min(rooms[cell] for cell in cells) >= best - 1e-9
        if math.isinf(best):
            assert plan.map_model.clearance is None
        else:
            assert plan.map_model.clearance == pytest.approx(best, abs=1e-12)
        assert plan.map_model.points.shape[0] == plan.map_model.counts["ridge cells"]
    assert found > 0.5 * maps


def test_it_takes_the_middle_of_the_corridor_and_the_wide_door() -> None:
    """Both ends stand beside a wall; the short way leads through a door one cell wide."""
    walls = np.zeros((31, 41), dtype=bool)
    walls[:, 20] = True
    walls[4, 20] = False
    walls[18:25, 20] = False
    scene = Scene(Grid(walls), (0, 0), (40, 0), "octile")
    plan = Voronoi().open(scene, RNG).plan()
    assert plan.path is not None
    assert plan.map_model is not None
    through = [tuple(c) for c in plan.path.cells.tolist() if c[0] == 20]
    assert through == [(20, 21)]
    room = clearance(scene.grid)
    assert plan.map_model.ridge_clearance == pytest.approx(float(room[21, 20]))
    assert plan.map_model.clearance == 0.5  # the corner of the map, where it starts


def test_ridges_are_one_cell_wide_and_connected() -> None:
    rng = np.random.default_rng(84)
    walls = rng.random((40, 60)) < 0.04
    walls[0, 0] = walls[39, 59] = False
    scene = Scene(Grid(walls), (0, 0), (59, 39), "octile")
    plan = Voronoi().open(scene, RNG).plan()
    assert plan.map_model is not None
    ridge = np.zeros((42, 62), dtype=bool)
    x, y = plan.map_model.points.astype(int).T
    ridge[y + 1, x + 1] = True
    squares = ridge[:-1, :-1] & ridge[1:, :-1] & ridge[:-1, 1:] & ridge[1:, 1:]
    assert squares.sum() <= 0.01 * ridge.sum()  # where four ridges meet
    from scipy import ndimage

    assert ndimage.label(ridge)[1] == 1


def test_a_walk_along_one_ridge_can_be_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plan through a spiral of 512 x 512 cells went on for 0.4 s after it was cancelled, all of it here."""
    asked: list[int] = []
    monkeypatch.setattr(ridges, "checkpoint", lambda: asked.append(1))
    ridge = np.ones((1, 5000), dtype=np.bool_)
    steps = ridges._Steps(ridge, ridge, {(1, 0): 1, (-1, 0): 1}, eight=False)
    assert ridges._branch(steps, (0, 0), (4999, 0)) == [(x, 0) for x in range(5000)]
    assert len(asked) == 4999 // ridges._LOOK
