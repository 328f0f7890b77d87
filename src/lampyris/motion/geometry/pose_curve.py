"""The curve that a path of poses drives."""

from __future__ import annotations

import math

import numpy as np

from lampyris._core import elementary
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath

_EQUAL = 1e-6
"""Difference of two curvatures (1/cell), or angle between two directions, that is rounding."""


def curve_of_poses(path: PosePath, grid: Grid) -> Curve:
    """Straight pieces and arcs in the order in which they are driven.

    The robot stands still where it changes between ahead and reverse, turns in place, or changes the direction in
    which it travels. In reverse, and of an omnidirectional robot, the curve's heading is the direction of travel.

    Parameters
    ----------
    grid : the map of the path.
    """
    points = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
    turn = np.remainder(np.diff(path.poses[:, 2]) + math.pi, 2 * math.pi) - math.pi
    lengths, gears = path.step_lengths, path.gears
    # Directions are those of rows that point down: a turn to the left is negative.
    d = np.diff(points, axis=0)
    bearing = elementary.atan2(d[:, 1], d[:, 0]) + turn / 2
    pieces: list[list[float]] = []  # x, y, direction, length, curvature, gear
    stops: list[int] = []
    pausing = False
    for k in range(len(gears)):
        if gears[k] == 0:
            pausing = True
            continue
        direction = float(bearing[k])
        curvature = -float(turn[k]) / float(lengths[k])
        if pieces and not pausing:
            _, _, before, length, bend, gear = pieces[-1]
            after = before + bend * length
            bent = abs(math.remainder(direction - after, 2 * math.pi)) > 1e-4 or gear != gears[k]
            if not bent and abs(bend - curvature) * grid.resolution < _EQUAL:
                pieces[-1][3] += float(lengths[k])
                continue
            pausing = bent
        if pieces and pausing:
            stops.append(len(pieces))
        pausing = False
        pieces.append([*points[k], direction, float(lengths[k]), curvature, float(gears[k])])
    table = np.array(pieces).reshape(-1, 6)
    directions = table[:, 2]
    curvatures = np.where(np.abs(table[:, 4]) * grid.resolution < _EQUAL, 0.0, table[:, 4])
    x, y = points[-1].tolist()
    return Curve(
        table[:, :2], np.column_stack((elementary.cos(directions), elementary.sin(directions))), table[:, 3], curvatures, (x, y),
        grid.resolution, np.array(stops, dtype=np.int64),
    )  # fmt: skip
