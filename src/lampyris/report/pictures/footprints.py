"""Outlines of a robot along a path of poses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.model.robot import Robot
from lampyris.report import style
from lampyris.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_APART = 1.2
"""Distance between two outlines, in diameters of the robot."""
_DISC_VERTICES = 40


def outline_of(robot: Robot) -> Floats:
    """The vertices of a robot's outline in its own frame, metres, float64 (k, 2)."""
    if robot.footprint is not None:
        return np.array(robot.footprint)
    turns = np.linspace(0.0, 2 * math.pi, _DISC_VERTICES, endpoint=False)
    return robot.radius * np.column_stack((np.cos(turns), np.sin(turns)))


def outline_at(outline: Floats, pose: Floats, grid: Grid) -> Floats:
    """The same vertices at a pose of the map frame, in cells (y down), float64 (k, 2)."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x = pose[0] + cos * outline[:, 0] - sin * outline[:, 1]
    y = pose[1] + sin * outline[:, 0] + cos * outline[:, 1]
    return grid.frame.to_points(x, y)


def outlines_along(poses: Floats, robot: Robot) -> list[Floats]:
    """The robot at the first and the last of some poses and every so often between; metres of the map frame."""
    outline = outline_of(robot)
    d = np.diff(poses, axis=0)
    moved = np.hypot(d[:, 0], d[:, 1]) + robot.radius * np.abs(
        np.remainder(d[:, 2] + math.pi, 2 * math.pi) - math.pi
    )
    along = np.concatenate(([0.0], np.cumsum(moved)))
    apart = max(_APART * 2 * robot.radius, along[-1] / 400, 1e-9)
    found = {0, len(poses) - 1, *np.searchsorted(along, np.arange(apart, along[-1], apart)).tolist()}
    polygons = []
    for k in sorted(found):
        x, y, yaw = poses[k].tolist()
        cos, sin = math.cos(yaw), math.sin(yaw)
        polygons.append(np.array([(x, y)]) + outline @ np.array([(cos, sin), (-sin, cos)]))
    return polygons


def draw_footprints(axes: Axes, path: PosePath, grid: Grid, robot: Robot) -> list[Any]:
    """Draw the robot at the start, at the goal, where it changes gear and every so often between; legend items."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    outline = outline_of(robot)
    along = np.concatenate(([0.0], np.cumsum(path.step_lengths)))
    apart = max(_APART * 2 * robot.radius, along[-1] / 400, 1e-9)
    shown = {0, len(path.poses) - 1}
    shown |= set(np.searchsorted(along, np.arange(apart, along[-1], apart)).tolist())
    shown |= set((np.flatnonzero(np.diff(path.gears)) + 1).tolist()[:400])
    polygons = [outline_at(outline, path.poses[k], grid) for k in sorted(shown)]
    look: dict[str, Any] = {"facecolor": style.with_alpha(style.FOOTPRINT, 0.22), "edgecolor": style.INK}
    axes.add_collection(PolyCollection(polygons, linewidths=0.7, zorder=4.2, **look), autolim=False)
    return [Patch(label="robot to scale", linewidth=0.7, **look)]
