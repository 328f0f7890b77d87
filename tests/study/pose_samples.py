"""Small studies of robots with a shape and a heading."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from one_samples import planner, study_of

from lampyris.model.grid import Grid
from lampyris.model.path import Pose
from lampyris.study.design.study import Config, Study, StudyTraffic, World

PLANNERS = ("lattice", "pad", "hybrid-astar")
OUTLINE = ((0.5, 0.25), (-0.4, 0.25), (-0.4, -0.25), (0.5, -0.25))
CART: Mapping[str, Any] = {
    "radius": 0.0, "v_max": 1.0, "a_max": 0.5, "d_max": 1.0, "a_lat_max": 1.0, "turn_radius": 0.5, "jerk_max": None,
    "footprint": OUTLINE,
}  # fmt: skip
CAR: Mapping[str, Any] = {**CART, "drive": "ackermann"}
NONE = StudyTraffic()
START: Pose = (1.125, 1.125, math.pi / 2)
GOAL: Pose = (5.125, 4.125, 0.0)


def hall() -> Grid:
    """Two rooms of 28 x 24 cells of 0.25 m with a door of 2 m."""
    blocked = np.zeros((24, 28), dtype=np.bool_)
    blocked[:, 14] = True
    blocked[8:16, 14] = False
    return Grid(blocked, name="hall", resolution=0.25)


def posed(
    kind: Any = "plan",
    planners: Sequence[Config | str] = ("lattice",),
    crowd: StudyTraffic = NONE,
    *,
    start: Pose | None = START,
    goal: Pose | None = GOAL,
    grid: Grid | None = None,
    robot: Mapping[str, Any] = CART,
    **more: Any,
) -> Study:
    """One query with poses."""
    grid = hall() if grid is None else grid
    made = study_of(kind, planners, crowd, grid=grid, robot=robot, **more)
    (world,) = made.worlds
    ends = [grid.to_cell(*pose[:2]) if pose else (4, 19) for pose in (start, goal)]
    query = World(world.ground, ends[0], ends[1], None, start, goal)
    fields = {name: getattr(made, name) for name in Study.__dataclass_fields__}
    return Study(**{**fields, "worlds": (query,)})


__all__ = ["CAR", "CART", "GOAL", "NONE", "OUTLINE", "PLANNERS", "START", "hall", "planner", "posed"]
