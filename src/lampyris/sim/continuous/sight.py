"""Sight: what the robot of a drive has seen of a map that it does not know, and how far along its path it may rely on it.

At the beginning of each period the robot looks around from the cell that it is in
(:class:`lampyris.sim.world.seen_map.SeenMap`). Up to the last node of its path around which every cell has been seen, it knows
that nothing is in its way; there it must be able to stand. The ceiling of speeds along the path is cut to that: no speed
from which full braking would lead farther. Cells are seen once and for all, so that this ceiling only ever rises, and a wall
that is seen on the path lies behind the place at which the robot can stand.

As bumpers the robot knows every cell within the reach of its next node.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from lampyris.errors import SettingError
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.sim.continuous.leg import Ceiling, Leg
from lampyris.sim.traffic.adversary import square_distances
from lampyris.sim.world.seen_map import SeenMap
from lampyris.typing import Cell

CAUSE = "blind area"
"""What limits the speed of a robot that must be able to stand within what it has seen."""
MOST_SPACING = 0.5
"""Cells between two nodes up to which the robot's bumpers reach what the next node needs."""
_FINE = 1024
"""Parts of a unit vector that the direction of view is rounded to."""
_AHEAD = 1e-3
"""Cells ahead to which the robot looks along its path."""


class Sight:
    """What has been seen, and how much of the present path.

    Parameters
    ----------
    scene : as it really is.
    sensor : what sees.
    spacing : maximum distance between two nodes of a path, metres.

    Attributes
    ----------
    map : what has been seen.
    """

    def __init__(self, scene: Scene, sensor: Sensor, spacing: float) -> None:
        grid = scene.grid
        self._reach = (scene.robot.radius + 0.5 * spacing) / grid.resolution + 1e-9
        self._radius = scene.robot.radius / grid.resolution
        if spacing > MOST_SPACING * grid.resolution:
            raise SettingError(
                "DRIVE_SETTING", f"{spacing:g} m and a map that is not known", where="spacing",
                allowed=f"at most {MOST_SPACING:g} of a cell, {MOST_SPACING * grid.resolution:g} m",
            )  # fmt: skip
        near = math.ceil(self._radius - 1e-9) + 1
        self.map = SeenMap(scene, sensor, near)
        self._width, self._height = grid.width, grid.height
        self._leg: Leg | None = None
        self._last = -1
        self._capped: Leg | None = None
        self._moved = self._learned = False

    @property
    def scene(self) -> Scene:
        """The scene as it is known."""
        return self.map.scene

    def look(self, leg: Leg, s: float, period: int) -> list[Cell]:
        """Look around at the beginning of a period; the walls that are seen for the first time.

        Parameters
        ----------
        leg, s : the path, and where the robot is on it.
        """
        self._moved = self._moved or s > 0.0
        x, y = leg.route.at(s)
        heading, length = (0, 0), 0.0
        if self._moved:
            u, v = leg.route.at(s + _AHEAD * leg.samples.resolution)
            hx, hy = u - x, v - y
            length = math.sqrt(hx * hx + hy * hy)
        if length > 0.0:
            heading = (round(_FINE * hx / length), round(_FINE * hy / length))
        walls = self.map.look((math.floor(x + 0.5), math.floor(y + 0.5)), heading, period)
        self._learned = self._learned or bool(walls)
        return walls

    def blocks(self, walls: list[Cell], leg: Leg, at: int) -> bool:
        """Whether the robot would touch any of some walls on the rest of its path."""
        xy = leg.samples.xy[at:]
        cells = np.array(walls, dtype=np.float64)
        bend = 0.125 * leg.samples.curvature * leg.samples.resolution
        for k, (a, b) in enumerate(pairwise(xy.tolist()), at):
            step = abs(b[0] - a[0]) + abs(b[1] - a[1])
            touch = self._radius + float(max(bend[k], bend[k + 1])) * step * step
            box = 0.5 * step + touch + 0.5
            near = np.abs(cells - (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))).max(axis=1) <= box
            if not near.any():
                continue
            x, y = cells[near].T
            squared = square_distances((a[0], a[1]), (b[0], b[1]), x, y)
            # A point may drive along walls, but not through them.
            if (squared < max(touch * touch - 1e-9, 1e-12)).any():
                return True
        return False

    def capped(self, leg: Leg, ceiling: Ceiling, brake: float) -> Leg:
        """The path with the ceiling by what has been seen.

        Parameters
        ----------
        ceiling : makes the law's own ceiling, by the walls that are known now.
        brake : m/s2.
        """
        if leg.nowhere:
            return leg
        if leg is not self._leg:
            self._begin(leg)
        last = self._seen_to()
        if self._capped is None or last != self._last or self._learned:
            self._last = last
            if self._learned and (made := ceiling(leg.samples)) is not None:
                squares = np.ascontiguousarray(np.minimum(made.v * made.v, leg.limits))
                self._own = replace(leg, profile=made, squares=squares)
            self._learned = False
            self._capped = self._cut(self._own, last, brake)
        return self._capped

    def _begin(self, leg: Leg) -> None:
        """Note which cells have to be seen for each node of a path."""
        self._leg = self._own = leg
        self._capped, self._last = None, -1
        wide = math.ceil(self._reach + 0.5)
        span = np.arange(-wide, wide + 1)
        dy, dx = (v.ravel() for v in np.meshgrid(span, span, indexing="ij"))
        xy = leg.samples.xy
        own = np.floor(xy + 0.5).astype(np.int64)
        x, y = own[:, :1] + dx, own[:, 1:] + dy
        gx = np.maximum(np.abs(x - xy[:, :1]) - 0.5, 0.0)
        gy = np.maximum(np.abs(y - xy[:, 1:]) - 0.5, 0.0)
        inside = (x >= 0) & (x < self._width) & (y >= 0) & (y < self._height)
        needed = inside & (gx * gx + gy * gy <= self._reach * self._reach)
        self._nodes = np.nonzero(needed)[0]
        self._cells = (y * self._width + x)[needed]

    def _seen_to(self) -> int:
        """The last node up to which every cell around the path has been seen."""
        assert self._leg is not None
        unseen = self.map.seen[self._cells] < 0
        if not unseen.any():
            return len(self._leg.nodes) - 1
        return max(int(self._nodes[int(unseen.argmax())]) - 1, 0)

    def _cut(self, leg: Leg, last: int, brake: float) -> Leg:
        """The ceiling cut to what stops at a node."""
        if last == len(leg.nodes) - 1:
            return leg
        most = 2.0 * brake * np.maximum(leg.nodes[last] - leg.nodes, 0.0)
        cut = most < leg.squares
        causes = tuple(CAUSE if c else word for c, word in zip(cut.tolist(), leg.profile.cause, strict=True))
        index = np.where(cut, -1, leg.profile.cause_index)
        profile = replace(leg.profile, cause=causes, cause_index=index)
        return replace(leg, profile=profile, squares=np.ascontiguousarray(np.minimum(leg.squares, most)))
