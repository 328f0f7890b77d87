"""The obstacles of a drive: positions, motion, and contacts with the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.motion.curve_motion import first_contact
from lampyris.kernels.motion.footprint_motion import outline_first_contact
from lampyris.model.grid import frozen
from lampyris.model.obstacles import Track
from lampyris.model.scene import Scene
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.traffic.continuous_traffic import TrafficMotion
from lampyris.sim.traffic.motion_sources import (
    FROM,
    NO_LEGS,
    OBSTACLE,
    ROUNDING,
    SPIN,
    TO,
    VX,
    VY,
    YAW,
    MotionSource,
    Opening,
    Roster,
    RunningSource,
    X,
    Y,
    stream,
)
from lampyris.sim.world.pose_lookup import PoseLookup, Turning
from lampyris.sim.world.trajectory import CurveLookup, Trajectory
from lampyris.typing import Floats


class ObstacleSet:
    """All moving obstacles of one drive.

    Attributes
    ----------
    roster : each with its corners.
    traffic : the scene's own traffic.
    touching : those that overlap the standing robot and have been reported.
    """

    def __init__(self, scene: Scene, seed: int, obstacle_speed: float | None, noise: float) -> None:
        self.scene, self.seed, self.noise = scene, seed, noise
        self.roster = Roster()
        self.traffic = TrafficMotion(obstacle_speed, seed).open(scene, self.roster)
        self.touching: set[int] = set()
        self.running: list[RunningSource] = [self.traffic]
        self.legs: Floats = NO_LEGS
        self._draws = stream(seed, 0)
        self.xy = self.velocity = np.zeros((0, 2))
        self._yaw: Floats = np.zeros(0)
        self._meet()

    def open(self, sources: Sequence[MotionSource], route: CurveLookup | None) -> None:
        """Let in the sources beside the traffic, now that the robot's first path is known."""
        first = 1 + len(self.scene.traffic)
        for k, source in enumerate(sources):
            self.running.append(
                source.open(Opening(self.scene, self.roster, stream(self.seed, first + k), route))
            )
        self._draws = stream(self.seed, first + len(sources))
        self._meet()

    def _meet(self) -> None:
        """Take in those that are new in the roster."""
        roster, known = self.roster, len(self.xy)
        fresh = [corners[-1][1:] if known == 0 else corners[0][1:] for corners in roster.corners[known:]]
        table = np.array(fresh).reshape(-1, 3)
        self.xy, self._yaw = np.concatenate((self.xy, table[:, :2])), np.append(self._yaw, table[:, 2])
        self.velocity = np.concatenate((self.velocity, np.zeros((len(fresh), 2))))
        self.radius, self.top_speed = np.array(roster.radius), np.array(roster.top_speed)
        self.outlined = np.array([one.outline is not None for one in roster.obstacles], dtype=np.bool_)

    def tracks(self, t: float) -> tuple[Track, ...]:
        """Where all obstacles were until ``t``, the end of the last move."""
        return self.roster.tracks(t, self.xy, self._yaw)

    def truth(self, t: float) -> ObstacleMessage:
        """Where all obstacles are; with noise, as sensors of that noise see it."""
        xy = self.xy
        if self.noise and len(xy):
            # A square within the circle of the noise.
            reach = self.noise / math.sqrt(2.0) / self.scene.grid.resolution
            xy = xy + (2.0 * reach * self._draws.random(xy.shape) - reach)
        return ObstacleMessage(t, xy, self.radius, self.top_speed, self.velocity)

    def move(self, t: float, end: float, trajectory: Trajectory) -> list[int]:
        """Every obstacle moves from ``t`` to ``end``, seeing the robot; those that have appeared."""
        before = len(self.roster.obstacles)
        tables = [legs for one in self.running if len(legs := one.advance(t, end, trajectory))]
        if len(tables) > 1 and self.outlined.any():
            tables = [np.hstack((one, np.zeros((len(one), 9 - one.shape[1])))) for one in tables]
        self.legs = tables[0] if len(tables) == 1 else np.concatenate(tables) if tables else NO_LEGS
        if len(self.roster.obstacles) > before:
            self._meet()
        return list(range(before, len(self.roster.obstacles)))

    def arrive(self, t: float) -> None:
        """Put every obstacle where it is at ``t``, within the last move."""
        legs = self.legs
        if not len(legs):
            return
        legs = legs[legs[:, FROM] <= t]
        obstacles = legs[:, 0].astype(np.int64)
        d = np.minimum(t, legs[:, 2]) - legs[:, 1]
        self.xy, self.velocity = self.xy.copy(), self.velocity.copy()
        # Rows are in order of time: the last of an obstacle stays.
        self.xy[obstacles] = legs[:, 3:5] + legs[:, 5:7] * d[:, None]
        self.velocity[obstacles] = legs[:, 5:7] * self.scene.grid.resolution
        if legs.shape[1] > YAW:
            self._yaw = self._yaw.copy()
            self._yaw[obstacles] = legs[:, YAW] + legs[:, SPIN] * d

    def _in_reach(self, trajectory: Trajectory) -> Floats:
        """The legs of the last move that can come to touch the robot at all, wherever on its way it is."""
        legs, resolution = self.legs, self.scene.grid.resolution
        first, last = trajectory.segments[0], trajectory.segments[-1]
        driven = (last.after(last.end)[0] - first.s) / resolution
        x, y = trajectory.route.at(first.s)
        seconds = legs[:, TO] - legs[:, FROM]
        reach = (self.radius + self.scene.robot.radius) / resolution + (driven + ROUNDING)
        reach = reach[legs[:, OBSTACLE].astype(np.int64)]
        near = np.abs(legs[:, X] - x) <= reach + np.abs(legs[:, VX]) * seconds
        near &= np.abs(legs[:, Y] - y) <= reach + np.abs(legs[:, VY]) * seconds
        return legs[near]

    def contact(self, trajectory: Trajectory) -> tuple[float, int] | None:
        """The first contact within the last move that has not been reported: when, and with which obstacle."""
        legs, route = self._in_reach(trajectory), trajectory.route
        if not len(legs):
            return None
        obstacles = legs[:, 0].astype(np.int64)
        old = np.zeros(len(obstacles), dtype=np.int64)
        for obstacle in self.touching:  # bits: each sets its own entries
            old[obstacles == obstacle] = 1
        made = np.array([(one.t, one.s, one.v, one.a, one.end) for one in trajectory.segments])
        outlined = self.outlined[obstacles]
        if not outlined.any():
            return self._disc_contact(route, made, legs, obstacles, old)
        met = self._outline_contact(route, made, legs[outlined], obstacles[outlined], old[outlined])
        if not outlined.all():
            disc = ~outlined
            other = self._disc_contact(route, made, legs[disc], obstacles[disc], old[disc])
            met = min((one for one in (met, other) if one is not None), default=None)
        return met

    def _outline_contact(
        self,
        route: CurveLookup,
        made: Floats,
        legs: Floats,
        obstacles: NDArray[np.int64],
        old: NDArray[np.int64],
    ) -> tuple[float, int] | None:
        """As :meth:`contact`, with polygons."""
        lines, robot = route.lines, self.scene.robot
        if isinstance(route, PoseLookup):
            turning, rate, (vx, vy), arm, margin = (
                route.turning,
                route.rate,
                route.vertices,
                route.arm,
                route.margin,
            )
        else:
            none, one = frozen(np.zeros(len(lines.px))), frozen(np.ones(len(lines.px)))
            turning, rate, arm, margin = Turning(one, none, none), one, 0.0, robot.radius
            vx = vy = frozen(np.zeros(1))
        outlines = [np.array(self.roster.obstacles[k].outline) for k in obstacles.tolist()]
        counts = np.array([len(outline) for outline in outlines])
        vertices = np.concatenate(outlines)
        room, found = int(counts.max()), np.zeros(1)
        when = outline_first_contact(
            *lines, *turning, len(lines.px), rate, self.scene.grid.resolution, vx, vy, arm, margin,
            np.append(made[:, 0], made[-1, 4]), made[:, 1].copy(), made[:, 2].copy(), made[:, 3].copy(),
            route.piece(float(made[0, 1])), *np.ascontiguousarray(legs[:, 1:].T),
            np.concatenate(([0], np.cumsum(counts))), vertices[:, 0].copy(), vertices[:, 1].copy(),
            self.radius[obstacles], old, np.zeros(room), np.zeros(room), found,
        )  # fmt: skip
        return None if found[0] < 0.0 else (float(when), int(obstacles[int(found[0])]))

    def _disc_contact(
        self,
        route: CurveLookup,
        made: Floats,
        legs: Floats,
        obstacles: NDArray[np.int64],
        old: NDArray[np.int64],
    ) -> tuple[float, int] | None:
        """As :meth:`contact`, with discs."""
        if isinstance(route, PoseLookup):
            when, which = route.first_contact(made, legs[:, 1:YAW], self.radius[obstacles], old)
            return None if which < 0 else (when, int(obstacles[which]))
        columns = np.ascontiguousarray(legs[:, 1:YAW].T)
        found = np.zeros(1)
        t = first_contact(
            *route.lines,
            len(route.lines.px),
            self.scene.grid.resolution,
            np.append(made[:, 0], made[-1, 4]),
            made[:, 1].copy(),
            made[:, 2].copy(),
            made[:, 3].copy(),
            route.piece(float(made[0, 1])),
            *columns,
            self.radius[obstacles] + self.scene.robot.radius,
            old,
            found,
        )
        return None if found[0] < 0.0 else (float(t), int(obstacles[int(found[0])]))

    def let_go(self, route: CurveLookup, s: float) -> None:
        """Forget those that no longer touch the robot, which is at a distance along a path."""
        outlined = {k for k in self.touching if self.outlined[k]}
        if outlined:
            kept = {k for k in outlined if self._touches(route, s, k)}
            self.touching -= outlined
            self.let_go(route, s)
            self.touching |= kept
            return
        if isinstance(route, PoseLookup):
            gaps = route.gaps(s, self.xy) - self.radius
            self.touching.intersection_update(np.flatnonzero(gaps < 0.0).tolist())
            return
        xy = route.at(s)
        for obstacle in sorted(self.touching):
            dx, dy = self.xy[obstacle] - xy
            gap = math.sqrt(dx * dx + dy * dy) * self.scene.grid.resolution
            if gap >= self.radius[obstacle] + self.scene.robot.radius:
                self.touching.discard(obstacle)

    def _touches(self, route: CurveLookup, s: float, obstacle: int) -> bool:
        """Whether a polygon is on the robot, which is at a distance along a path and stands."""
        stands = np.array([[0.0, s, 0.0, 0.0, 0.0]])
        row = np.array([[obstacle, 0.0, 0.0, *self.xy[obstacle], 0.0, 0.0, self._yaw[obstacle], 0.0]])
        new = np.zeros(1, dtype=np.int64)
        return self._outline_contact(route, stands, row, np.array([obstacle]), new) is not None
