"""The loop of a swarm: measure, broadcast, choose, drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lampyris._core.elementary import cos, direction, sin
from lampyris.kernels.swarm.leaders import choose_leaders
from lampyris.kernels.swarm.motion import drive_steps
from lampyris.model.grid import Grid
from lampyris.model.settings.swarm import SwarmSettings
from lampyris.model.swarm.sources import AnySource
from lampyris.planning.field.layers import clearance
from lampyris.sim.swarm.signals import normal, signal
from lampyris.typing import Floats

GAP = 1e-6
"""Share of a radius that robots keep from walls and from each other, so that rounding never makes them touch."""
_PER_BIN = 4
"""Bins for each robot at most."""


@dataclass(frozen=True, slots=True)
class Bins:
    """Square bins over the map."""

    side: float
    columns: int
    rows: int

    @classmethod
    def of(cls, width: float, height: float, side: float, most: int) -> Bins:
        """Bins of at least this side, at most about so many."""
        side = max(side, math.sqrt(width * height / most), width / most, height / most)
        return cls(side, max(1, math.ceil(width / side)), max(1, math.ceil(height / side)))


@dataclass(slots=True)
class Iteration:
    """What one iteration came to; float64 and int64 (n,), metres from the upper left corner, y down.

    ``path_x`` and ``path_y``, float64 (steps, n), are where the robots were after each small step.
    """

    readings: Floats
    leaders: NDArray[np.int64]
    neighbours: NDArray[np.int64]
    groups: NDArray[np.int64]
    met: NDArray[np.int64]
    path_x: Floats = field(repr=False)
    path_y: Floats = field(repr=False)


class RobotSwarm:
    """Robots on a map, advanced by iterations.

    Parameters
    ----------
    grid : the map.
    sources : at least one.
    settings : resolved for the map.
    starts : float64 (n, 2), metres from the upper left corner, y down; apart from walls and from each other.
    seed : of headings, noise and roulette, each drawn by a generator of its own.

    Attributes
    ----------
    x, y, cosine, sine : float64 (n,): place and heading, y down.
    luciferin, ranges : float64 (n,).
    iteration : how many are done.
    """

    def __init__(
        self, grid: Grid, sources: Sequence[AnySource], settings: SwarmSettings, starts: Floats, seed: int
    ) -> None:
        s = settings
        assert s.radius is not None
        assert s.sensor_range is not None
        assert s.small_step is not None
        n = len(starts)
        self._grid, self._sources, self._settings = grid, sources, s
        self._noise, self._roulette, headings = (
            np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(k,))))
            for k in range(3)
        )
        self._deviation = s.noise * max(one.highest for one in sources)
        size = grid.resolution
        self._map = (np.ascontiguousarray(grid.blocked).view(np.uint8).ravel(), grid.width, grid.height, size)
        self._clear = np.ascontiguousarray(clearance(grid)).ravel()
        wide, high = grid.width * size, grid.height * size
        self._apart = 2.0 * s.radius * (1.0 + GAP)
        self._away = s.radius * (1.0 + GAP)
        most = max(64, _PER_BIN * n)
        self._hearing = Bins.of(wide, high, s.sensor_range / 12.0, most)
        self._touching = Bins.of(wide, high, self._apart + 2.0 * s.small_step, most)
        bins = max(b.columns * b.rows for b in (self._hearing, self._touching))
        self._first, self._member = np.zeros(bins + 1, np.int64), np.zeros(n, np.int64)
        self._near, self._weight = np.zeros(n, np.int64), np.zeros(n)
        turn = s.small_step / s.v_max * s.yaw_rate_max
        self._turn = direction(turn) if turn < math.pi else (-1.0, 0.0)
        self.x, self.y = starts[:, 0].copy(), starts[:, 1].copy()
        angle = 2.0 * np.pi * headings.random(n)
        self.cosine, self.sine = cos(angle), sin(angle)
        self.luciferin, self.ranges = np.full(n, s.luciferin), np.full(n, s.sensor_range)
        self.iteration = 0
        self.encounters = self.wall_encounters = 0

    @property
    def xy(self) -> Floats:
        """Where the robots are, metres of the map frame, float64 (n, 2)."""
        return self._metric(self.x, self.y)

    def advance(self) -> Iteration:
        """One iteration."""
        s = self._settings
        n = len(self.x)
        assert s.small_step is not None
        assert s.step is not None
        t = self.iteration * s.period
        leader, count, group = np.full(n, -1), np.zeros(n, np.int64), np.arange(n)
        if s.method == "gso":
            readings, goal_x, goal_y = self._follow(t, leader, count, group)
        else:
            readings, goal_x, goal_y = self._climb(t)
        left = np.where((goal_x != 0.0) | (goal_y != 0.0), s.step, 0.0)
        path_x, path_y = np.empty(s.steps * n), np.empty(s.steps * n)
        met = np.zeros(n, np.int64)
        bins = self._touching
        drive_steps(
            goal_x, goal_y, self._map[0], self._clear, *self._map[1:], self._away, self._apart, s.steps, s.small_step,
            *self._turn, bins.side, bins.columns, bins.rows, self.x, self.y, self.cosine, self.sine, left,
            np.empty(n), np.empty(n), self._first, self._member, self._near, np.zeros(2), path_x, path_y, met,
        )  # fmt: skip
        self.iteration += 1
        self.wall_encounters += int(np.count_nonzero(met & 1))
        self.encounters += int(np.count_nonzero(met & 2))
        shape = (s.steps, n)
        return Iteration(readings, leader, count, group, met, path_x.reshape(shape), path_y.reshape(shape))

    def _follow(
        self, t: float, leader: NDArray[np.int64], count: NDArray[np.int64], group: NDArray[np.int64]
    ) -> tuple[Floats, Floats, Floats]:
        """Glowworm swarm optimisation: what was measured, and the directions to the leaders."""
        s = self._settings
        assert s.sensor_range is not None
        assert s.beta is not None
        n = len(self.x)
        readings = self._measure(self.xy, t)
        self.luciferin = (1.0 - s.rho) * self.luciferin + s.gamma * readings
        bins = self._hearing
        choose_leaders(
            self.x, self.y, self.luciferin, self._roulette.random(n), *self._map, int(s.line_of_sight),
            s.sensor_range, s.beta, s.nt, bins.side, bins.columns, bins.rows, self.ranges, leader, count, group,
            self._first, self._member, self._near, self._weight,
        )  # fmt: skip
        follows = leader >= 0
        dx, dy = self.x[leader] - self.x, self.y[leader] - self.y
        gap = np.sqrt(dx * dx + dy * dy)
        gap = np.where(follows & (gap > 0.0), gap, np.inf)
        return readings, dx / gap, dy / gap

    def _climb(self, t: float) -> tuple[Floats, Floats, Floats]:
        """Each robot's own gradient, from four sensors on its rim: ahead, behind, left and right."""
        n, r = len(self.x), self._settings.radius
        assert r is not None
        c, s = self.cosine, self.sine
        x = np.concatenate((self.x + r * c, self.x - r * c, self.x + r * s, self.x - r * s))
        y = np.concatenate((self.y + r * s, self.y - r * s, self.y - r * c, self.y + r * c))
        ahead, behind, left, right = self._measure(self._metric(x, y), t).reshape(4, n)
        along, beside = ahead - behind, left - right
        dx, dy = along * c + beside * s, along * s - beside * c
        size = np.sqrt(dx * dx + dy * dy)
        size = np.where(size > 0.0, size, np.inf)
        return 0.25 * ((ahead + behind) + (left + right)), dx / size, dy / size

    def _measure(self, xy: Floats, t: float) -> Floats:
        """The signal at points, with noise."""
        readings = signal(self._sources, xy, t)
        if self._deviation > 0.0:
            readings = readings + self._deviation * normal(self._noise, len(readings))
        return readings

    def _metric(self, x: Floats, y: Floats) -> Floats:
        size = self._grid.resolution
        return self._grid.to_metres(np.stack((x / size - 0.5, y / size - 0.5), axis=-1))
