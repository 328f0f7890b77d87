"""The obstacles of a drive: positions, motion, and contacts with the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lampyris.kernels.motion.curve_motion import first_contact
from lampyris.model.obstacles import Track
from lampyris.model.scene import Scene
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.traffic.continuous_traffic import TrafficMotion
from lampyris.sim.traffic.motion_sources import (
    FROM,
    NO_LEGS,
    OBSTACLE,
    ROUNDING,
    TO,
    VX,
    VY,
    MotionSource,
    Opening,
    Roster,
    RunningSource,
    X,
    Y,
    stream,
)
from lampyris.sim.world.pose_lookup import PoseLookup
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
        self._running: list[RunningSource] = [self.traffic]
        self._legs: Floats = NO_LEGS
        self._draws = stream(seed, 0)
        self._xy = self._velocity = np.zeros((0, 2))
        self._meet()

    def open(self, sources: Sequence[MotionSource], route: CurveLookup | None) -> None:
        """Let in the sources beside the traffic, now that the robot's first path is known."""
        first = 1 + len(self.scene.traffic)
        for k, source in enumerate(sources):
            self._running.append(
                source.open(Opening(self.scene, self.roster, stream(self.seed, first + k), route))
            )
        self._draws = stream(self.seed, first + len(sources))
        self._meet()

    def _meet(self) -> None:
        """Take in those that are new in the roster."""
        roster, known = self.roster, len(self._xy)
        fresh = [corners[-1][1:] if known == 0 else corners[0][1:] for corners in roster.corners[known:]]
        self._xy = np.concatenate((self._xy, np.array(fresh).reshape(-1, 2)))
        self._velocity = np.concatenate((self._velocity, np.zeros((len(fresh), 2))))
        self._radius, self._top_speed = np.array(roster.radius), np.array(roster.top_speed)

    def tracks(self, t: float) -> tuple[Track, ...]:
        """Where all obstacles were until ``t``, the end of the last move."""
        return self.roster.tracks(t, self._xy)

    def truth(self, t: float) -> ObstacleMessage:
        """Where all obstacles are; with noise, as sensors of that noise see it."""
        xy = self._xy
        if self.noise and len(xy):
            # A square within the circle of the noise.
            reach = self.noise / math.sqrt(2.0) / self.scene.grid.resolution
            xy = xy + (2.0 * reach * self._draws.random(xy.shape) - reach)
        return ObstacleMessage(t, xy, self._radius, self._top_speed, self._velocity)

    def move(self, t: float, end: float, trajectory: Trajectory) -> list[int]:
        """Every obstacle moves from ``t`` to ``end``, seeing the robot; those that have appeared."""
        before = len(self.roster.obstacles)
        tables = [legs for one in self._running if len(legs := one.advance(t, end, trajectory))]
        self._legs = tables[0] if len(tables) == 1 else np.concatenate(tables) if tables else NO_LEGS
        if len(self.roster.obstacles) > before:
            self._meet()
        return list(range(before, len(self.roster.obstacles)))

    def arrive(self, t: float) -> None:
        """Put every obstacle where it is at ``t``, within the last move."""
        legs = self._legs
        if not len(legs):
            return
        legs = legs[legs[:, FROM] <= t]
        obstacles = legs[:, 0].astype(np.int64)
        d = np.minimum(t, legs[:, 2]) - legs[:, 1]
        self._xy, self._velocity = self._xy.copy(), self._velocity.copy()
        # Rows are in order of time: the last of an obstacle stays.
        self._xy[obstacles] = legs[:, 3:5] + legs[:, 5:7] * d[:, None]
        self._velocity[obstacles] = legs[:, 5:7] * self.scene.grid.resolution

    def _in_reach(self, trajectory: Trajectory) -> Floats:
        """The legs of the last move that can come to touch the robot at all, wherever on its way it is."""
        legs, resolution = self._legs, self.scene.grid.resolution
        first, last = trajectory.segments[0], trajectory.segments[-1]
        driven = (last.after(last.end)[0] - first.s) / resolution
        x, y = trajectory.route.at(first.s)
        seconds = legs[:, TO] - legs[:, FROM]
        reach = (self._radius + self.scene.robot.radius) / resolution + (driven + ROUNDING)
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
        if isinstance(route, PoseLookup):
            when, which = route.first_contact(made, legs[:, 1:], self._radius[obstacles], old)
            return None if which < 0 else (when, int(obstacles[which]))
        columns = np.ascontiguousarray(legs[:, 1:].T)
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
            self._radius[obstacles] + self.scene.robot.radius,
            old,
            found,
        )
        return None if found[0] < 0.0 else (float(t), int(obstacles[int(found[0])]))

    def let_go(self, route: CurveLookup, s: float) -> None:
        """Forget those that no longer touch the robot, which is at a distance along a path."""
        if isinstance(route, PoseLookup):
            gaps = route.gaps(s, self._xy) - self._radius
            self.touching.intersection_update(np.flatnonzero(gaps < 0.0).tolist())
            return
        xy = route.at(s)
        for obstacle in sorted(self.touching):
            dx, dy = self._xy[obstacle] - xy
            gap = math.sqrt(dx * dx + dy * dy) * self.scene.grid.resolution
            if gap >= self._radius[obstacle] + self.scene.robot.radius:
                self.touching.discard(obstacle)
