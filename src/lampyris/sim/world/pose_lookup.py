"""A curve of poses as kernels and loops want it: where the robot's footprint is, and what it comes near to."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.kernels.motion.footprint_distance import gaps_at, least_gaps
from lampyris.kernels.motion.footprint_motion import footprint_first_contact, footprint_first_unsafe
from lampyris.model.curve import PoseCurve
from lampyris.model.grid import frozen
from lampyris.sim.world.trajectory import CurveLookup
from lampyris.typing import Floats, Points

PARTS = 64
"""Parts in which a stretch of path is looked at for its least distance to an obstacle."""


class Turning(NamedTuple):
    """How a robot's yaw changes along the pieces, as flat arrays, in the order in which kernels take them."""

    cosine: Floats
    sine: Floats
    turn: Floats


class PoseLookup(CurveLookup):
    """A curve of poses with quick answers for the footprint of the robot that drives it.

    Attributes
    ----------
    poses : the curve.
    margin : metres around the outline that are of the robot, too.
    turning : how the yaw changes along the pieces.
    rate : metres that a point of the robot moves at most, a metre of each piece.
    vertices : x and y of the outline's vertices, metres.
    arm : distance of the farthest from the base, metres.
    """

    def __init__(self, curve: PoseCurve) -> None:
        super().__init__(curve)
        self.poses = curve
        self.margin = curve.margin
        none = not len(curve.lengths)
        yaw = np.array([curve.end_yaw]) if none else curve.yaw
        turn, movement = (np.zeros(1), np.zeros(1)) if none else (curve.turn, curve.movement)
        self.turning = Turning(
            *(frozen(np.ascontiguousarray(a)) for a in (elementary.cos(yaw), elementary.sin(yaw), turn))
        )
        lengths = np.zeros(1) if none else curve.lengths
        self._moved = frozen(np.concatenate(([0.0], np.cumsum(movement * lengths)))[:-1].copy())
        self.rate = frozen(np.ascontiguousarray(movement))
        self.vertices = tuple(frozen(np.ascontiguousarray(curve.outline[:, k])) for k in (0, 1))
        self.arm = curve.reach

    @property
    def _pieces(self) -> tuple[Floats | int, ...]:
        return (*self.lines, *self.turning, len(self.lines.px))

    def gaps(self, s: float, xy: Points) -> Floats:
        """Distance from the robot's rim at a distance to points (cells, (m, 2)), metres, negative inside; (m,)."""
        gap = np.zeros(len(xy))
        if len(xy):
            xs, ys = xy[:, 0].copy(), xy[:, 1].copy()
            gaps_at(*self._pieces, self.curve.resolution, *self.vertices, self._within(s), xs, ys, gap)
        return gap - self.margin

    def least_gaps(self, s0: float, s1: float, xy: Points) -> Floats:
        """A lower bound of :meth:`gaps` at all distances from one to another; (m,)."""
        gap = np.zeros(len(xy))
        if len(xy):
            xs, ys = xy[:, 0].copy(), xy[:, 1].copy()
            least_gaps(
                *self._pieces, self._moved, self.rate, self.curve.resolution, *self.vertices,
                self._within(s0), self._within(s1), PARTS, xs, ys, gap,
            )  # fmt: skip
        return gap - self.margin

    def _within(self, s: float) -> float:
        return min(max(float(s), 0.0), self.length)

    def first_unsafe(
        self,
        s: float,
        v: float,
        push: float,
        period: float,
        d_max: float,
        xy: Points,
        reach: Floats,
        speed: Floats,
    ) -> int:
        """The first obstacle that a push for one period and full braking after it are not safe from; -1: none.

        Parameters
        ----------
        reach, speed : metres that the robot's rim must keep from each place now, and m/s by which that grows; (m,).
        """
        xs, ys = xy[:, 0].copy(), xy[:, 1].copy()
        return int(
            footprint_first_unsafe(
                *self._pieces, self._moved, self.rate, self.curve.resolution, *self.vertices, self.arm,
                float(s), float(v), float(push), float(period), float(d_max), xs, ys, reach + self.margin, speed,
            )
        )  # fmt: skip

    def first_contact(
        self, segments: Floats, legs: Floats, radius: Floats, old: NDArray[np.int64]
    ) -> tuple[float, int]:
        """The first instant at which the robot and one of several discs overlap, and which; (infinity, -1): never.

        Parameters
        ----------
        segments : (k, 5): t, s, v, a and end of each stretch.
        legs : (n, 6): from when, to when, x, y (cells), velocity (cells/s) of each disc.
        radius : metres, (n,).
        old : int64 (n,): 1 where the disc has touched the standing robot before.
        """
        found = np.zeros(1)
        columns = np.ascontiguousarray(legs.T)
        t = footprint_first_contact(
            *self._pieces, self._moved, self.rate, self.curve.resolution, *self.vertices, self.arm,
            np.append(segments[:, 0], segments[-1, 4]), segments[:, 1].copy(), segments[:, 2].copy(),
            segments[:, 3].copy(), self.piece(float(segments[0, 1])), *columns, radius + self.margin, old, found,
        )  # fmt: skip
        return (float(t), int(found[0])) if found[0] >= 0.0 else (math.inf, -1)
