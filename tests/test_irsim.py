"""Maps of IR-SIM, python_motion_planning and PythonRobotics; the real IR-SIM runs in examples/irsim_navigation.py."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

import lampyris
from lampyris.errors import LampyrisError
from lampyris.irsim import IrsimPlanner


def world(**more: Any) -> SimpleNamespace:
    """What IR-SIM's ``get_map`` returns, as far as planners read it."""
    given = {
        "width": 6.0,
        "height": 4.0,
        "resolution": 0.5,
        "obstacle_list": [],
        "grid": None,
        "world_offset": (2.0, -1.0),
    }
    return SimpleNamespace(**{**given, **more})


def test_a_grid_blocks_what_obstacles_touch() -> None:
    """Against the definition, cell by cell."""
    shapes = [
        shapely.Point(4.1, 0.7).buffer(0.8),
        shapely.Polygon([(6.1, 0.2), (7.9, 0.2), (7.0, 1.9)]),
        shapely.LineString([(2.1, 2.9), (3.9, 1.6)]),
        shapely.Point(30.0, 30.0).buffer(1.0),
    ]
    grid = lampyris.Grid.from_irsim(world(obstacle_list=[SimpleNamespace(_geometry=one) for one in shapes]))
    assert (grid.width, grid.height, grid.resolution, grid.origin) == (12, 8, 0.5, (2.0, -1.0, 0.0))
    for y in range(8):
        for x in range(12):
            cx, cy = grid.to_metres((x, y)).tolist()
            square = shapely.box(cx - 0.25, cy - 0.25, cx + 0.25, cy + 0.25)
            assert grid.blocked[y, x] == any(square.intersects(one) for one in shapes), (x, y)
    assert 20 < grid.blocked.sum() < 60


def test_an_occupancy_grid_is_turned_and_read_at_fifty() -> None:
    occupancy = np.zeros((12, 8))
    occupancy[0, 0], occupancy[11, 0], occupancy[0, 7] = 100.0, 50.0, 50.5
    grid = lampyris.Grid.from_irsim(
        SimpleNamespace(get_map=lambda r: world(grid=occupancy, resolution=r)), 0.25
    )
    assert grid.resolution == 0.5
    assert [(int(x), int(y)) for y, x in np.argwhere(grid.blocked)] == [(0, 0), (0, 7)]
    assert grid.to_metres((0, 7)).tolist() == [2.25, -0.75]


def test_a_planner_answers_from_goal_to_start() -> None:
    wall = shapely.box(4.6, -1.0, 5.0, 2.0)
    planner = IrsimPlanner(world(obstacle_list=[SimpleNamespace(_geometry=wall)]), "theta-star", radius=0.2)
    path = planner.planning(np.array([[2.6], [-0.6], [0.0]]), [7.4, -0.6])
    assert path is not None
    assert (path[:, 0].round(3).tolist(), path[:, -1].round(3).tolist()) == ([7.25, -0.75], [2.75, -0.75])
    assert shapely.LineString(path.T).distance(wall) >= 0.2
    shut = IrsimPlanner(world(obstacle_list=[SimpleNamespace(_geometry=shapely.box(4.6, -1.0, 5.0, 3.0))]))
    assert shut.planning((2.6, -0.6), (7.4, -0.6)) is None
    assert shut.plan.status == "no-path"


@pytest.mark.parametrize(
    ("ask", "code"),
    [
        (lambda: lampyris.Grid.from_irsim(3), "IRSIM"),
        (lambda: lampyris.Grid.from_irsim(world(), 0.1), "IRSIM"),
        (lambda: lampyris.Grid.from_irsim(world(grid=np.zeros((12, 9)))), "IRSIM"),
        (lambda: IrsimPlanner(world(), radius=-1), "ROBOT_LIMIT"),
        (lambda: IrsimPlanner(world()).planning("ab", (1, 1)), "TYPE"),
        (lambda: lampyris.Grid.from_xy([1, 2]), "GRID_SHAPE"),
        (lambda: lampyris.Grid.from_xy([[float("nan")]]), "GRID_SHAPE"),
        (lambda: lampyris.Grid.from_xy([[0]], origin=(1,)), "MAP_ORIGIN"),
        (lambda: lampyris.Grid.from_points([], []), "POINT"),
        (lambda: lampyris.Grid.from_points([1], [1, 2]), "POINT"),
        (lambda: lampyris.Grid.from_points([0, 1e9], [0, 1e9]), "MAP_CELLS"),
        (lambda: lampyris.Grid.from_points([0], [0], 0), "MAP_RESOLUTION"),
    ],
)
def test_what_is_no_map_is_refused(ask: Any, code: str) -> None:
    with pytest.raises(LampyrisError) as refused:
        ask()
    assert refused.value.code == code


def test_points_block_the_cells_that_hold_them() -> None:
    """The walls of PythonRobotics' own examples: a frame, and two inner walls."""
    ox = [*range(-10, 61), *[60.0] * 71, *range(-10, 61), *[-10.0] * 71, *[20.0] * 50, *[40.0] * 50]
    oy = [*[-10.0] * 71, *range(-10, 61), *[60.0] * 71, *range(-10, 61), *range(-10, 40), *range(60, 10, -1)]
    grid = lampyris.Grid.from_points(ox, oy, 2.0)
    assert (grid.width, grid.height) == (36, 36)
    cells = {grid.to_cell(x, y) for x, y in zip(ox, oy, strict=True)}
    assert {(int(x), int(y)) for y, x in np.argwhere(grid.blocked)} == cells
    scene = lampyris.Scene(grid, start_m=(10.0, 10.0), goal_m=(50.0, 50.0), robot=lampyris.Robot(radius=1.0))
    assert lampyris.plan(scene, "astar").status == "found"
