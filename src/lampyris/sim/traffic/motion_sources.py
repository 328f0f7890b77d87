"""Sources: who moves obstacles in continuous time, and the roster of all of them.

A source is asked period by period where its obstacles go. It may look at what the robot really does in that
period, and answers with *legs*: rows of obstacle, from when, to when, where (cells) and velocity (cells a
second), and where there are polygons also heading and yaw rate (radians counterclockwise, and a second). Legs of an
obstacle follow one another without a gap.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from lampyris.model.obstacles import Track
from lampyris.model.scene import Scene
from lampyris.model.traffic import Obstacle
from lampyris.sim.world.trajectory import CurveLookup, Trajectory
from lampyris.typing import Floats, Points

OBSTACLE, FROM, TO, X, Y, VX, VY, YAW, SPIN = range(9)
"""Columns of a table of legs; without polygons it has the first seven alone."""

NO_LEGS: Floats = np.zeros((0, 7))

ROUNDING = 0.01
"""Cells: far above what rounding may come to, where distances are compared only to leave work out."""


@dataclass
class Roster:
    """All obstacles in order of appearance.

    Attributes
    ----------
    obstacles : what each is; its radius there is that of the tick model.
    radius, top_speed : metres and m/s, one an obstacle.
    corners : for each obstacle the points (t, x, y, yaw) between which it moves straight and turns at an even rate.
    whole : for an obstacle whose path is known from beginning to end, that path.
    """

    obstacles: list[Obstacle] = field(default_factory=list)
    radius: list[float] = field(default_factory=list)
    top_speed: list[float] = field(default_factory=list)
    corners: list[list[tuple[float, float, float, float]]] = field(default_factory=list)
    whole: dict[int, Track] = field(default_factory=dict)

    def add(
        self,
        obstacle: Obstacle,
        radius: float,
        top_speed: float,
        t: float,
        x: float,
        y: float,
        yaw: float = 0.0,
    ) -> int:
        """A new obstacle; its number."""
        self.obstacles.append(obstacle)
        self.radius.append(radius)
        self.top_speed.append(top_speed)
        self.corners.append([(t, x, y, yaw)])
        return len(self.obstacles) - 1

    def go(self, obstacle: int, t: float, x: float, y: float, yaw: float = 0.0) -> None:
        """It moves straight to (x, y) and turns to ``yaw``, where it is at ``t``."""
        corners = self.corners[obstacle]
        last, here = corners[-1], (x, y, yaw)
        if len(corners) > 1 and last[1:] == here == corners[-2][1:]:
            corners[-1] = (t, *here)  # still standing
        elif t > last[0]:
            corners.append((t, *here))

    def tracks(self, end: float, xy: Points, yaw: Floats | None = None) -> tuple[Track, ...]:
        """Where all obstacles were until ``end``, seconds; ``xy`` (m, 2), cells, and ``yaw`` (m,) are theirs then.

        Without ``yaw`` they have turned no farther than at their last corners.
        """
        made = []
        if yaw is None:
            yaw = np.array([corners[-1][3] for corners in self.corners])
        rows = zip(self.corners, self.obstacles, xy.tolist(), yaw.tolist(), strict=True)
        for k, (corners, obstacle, (x, y), heading) in enumerate(rows):
            kept = [c for c in corners if c[0] <= end] or corners[:1]
            if kept[-1][0] < end:
                kept.append((end, x, y, heading))
            table = np.array(kept)
            headed = (None, None) if obstacle.outline is None else (obstacle.outline, table[:, 3])
            made.append(Track(table[:, 0], table[:, 1:3], self.radius[k], self.top_speed[k], *headed))
        return tuple(made)


@dataclass(frozen=True)
class Opening:
    """What a source may look at before the first second.

    Parameters
    ----------
    scene : where.
    roster : to put obstacles into.
    rng : its own stream of draws.
    route : the robot's first path; None: not planned yet.
    """

    scene: Scene
    roster: Roster
    rng: np.random.Generator
    route: CurveLookup | None = None


class MotionSource(Protocol):
    """Who moves some of the obstacles. Settings are frozen; ``open`` gives what remembers."""

    def open(self, opening: Opening) -> RunningSource: ...


class RunningSource(Protocol):
    """A source at work."""

    def advance(self, t0: float, t1: float, trajectory: Trajectory) -> Floats:
        """The legs of its obstacles that cover the time from ``t0`` to ``t1``, in order of time; (k, 7).

        Parameters
        ----------
        trajectory : what the robot does meanwhile.
        """
        ...


def stream(seed: int, k: int) -> np.random.Generator:
    """The draws of source ``k``: 0 is the planner, then the scene's traffic, then the sources beside it."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, k))))
