"""Baseline controllers: the dissertation's law and Regulated Pure Pursuit, as published.

Neither keeps room for what an obstacle may do next; that is what is measured. Both are given the robot's
limits: they brake into the goal and into places where the robot must turn in time, accelerate and brake no
harder than it can, and take no bend faster than it can.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris.model.scene import Scene
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.laws.dissertation import DissertationLaw, cell_speeds
from lampyris.motion.laws.dissertation_in_metres import cells_passed
from lampyris.motion.laws.rpp import Rpp, cost_of, regulate, steered
from lampyris.sim.continuous.control import Decision, State, towards, under_ceiling
from lampyris.sim.continuous.leg import Leg
from lampyris.typing import Floats

LOOK_AHEAD = 1.0
"""Seconds that Regulated Pure Pursuit looks ahead for a collision: Nav2's default."""

_LOOKS = 10
"""Places looked at within that time."""


@dataclass
class ByRings:
    """The dissertation's law: obstacles are counted, period by period, in the rings around the next cells.

    Its velocity at the next cell, its greatest one taken as the robot's v_max, is aimed at by an even push. A
    cell that an obstacle covers is not entered: the robot brakes until it is free.
    """

    scene: Scene
    law: DissertationLaw
    _leg: Leg | None = None
    _cells: list[tuple[NDArray[np.int64], Floats]] = field(default_factory=list)

    def _begin(self, leg: Leg) -> None:
        self._leg = leg
        stops = np.flatnonzero(leg.samples.stop[1:-1]) + 1
        borders = [0, *stops.tolist(), len(leg.samples) - 1]
        self._cells = [cells_passed(leg.samples, int(a), int(b)) for a, b in pairwise(borders)]

    def decide(self, state: State) -> Decision:
        """Aim at the next cell's velocity, or brake because it is taken."""
        if state.leg is not self._leg:
            self._begin(state.leg)
        wish = under_ceiling(state)
        s, v = state.s, state.v
        cells, where = next((c for c in self._cells if s < c[1][-1]), self._cells[-1])
        # The next cell is entered half way between the two middles.
        k = min(int(np.searchsorted(where, s, side="right")), len(where) - 1)
        ahead = (int(cells[k, 0]), int(cells[k, 1]))
        if ahead in state.cells:
            return Decision(-state.robot.d_max, "obstacle")
        if len(cells) <= 2:
            return wish
        scale = state.robot.v_max / self.law.v_max
        depth = math.ceil(self.law.v_max / self.law.braking) + 3
        near = cells[max(k - 1, 0) : k + depth]
        own = min(v / scale, self.law.v_max)
        speeds, words, _ = cell_speeds(near, self.scene, self.law, state.cells, own)
        one = min(1, len(near) - 1)
        target, left = float(speeds[one]) * scale, float(where[k]) - s
        if left <= 0.0 or words[one] == "goal":
            return wish
        a = 0.5 * (target * target - v * v) / left
        if a >= wish.a:
            return wish
        cause = words[one] if words[one] not in ("start", "braking") else "braking"
        return Decision(max(a, -state.robot.d_max), cause)


@dataclass
class Regulated:
    """Regulated Pure Pursuit: its command here and now, and a stop where it would collide within a second.

    What moves is a surface where it is now, as in Nav2's obstacle layer; the collision check projects the
    present speed along the path among these surfaces.
    """

    scene: Scene
    law: Rpp
    _leg: Leg | None = None
    _wall: Floats = field(default_factory=lambda: np.zeros(0))
    _bend: Floats = field(default_factory=lambda: np.zeros(0))

    def _begin(self, leg: Leg) -> None:
        self._leg = leg
        samples = leg.samples
        reach = max(self.law.inflation_radius, self.scene.robot.radius)
        self._wall = wall_distance(samples.xy, self.scene.grid, reach)
        self._bend = steered(samples, self.law.lookahead) if self.law.lookahead > 0.0 else samples.curvature

    def decide(self, state: State) -> Decision:
        """Track the command of the present place."""
        if state.leg is not self._leg:
            self._begin(state.leg)
        gaps = self._gaps(state, [state.s])
        if self._collides(state):
            return towards(state, 0.0, "moving obstacle", int(gaps.argmin()))
        samples, k = state.leg.samples, state.at
        here = slice(k, k + 1)
        desired = min(self.law.desired, state.robot.v_max)
        one = replace(self.law, desired=desired)
        left = np.maximum(samples.s[-1:] - state.s, 0.0)
        near = np.minimum(self._wall[here], max(float(gaps.min(initial=np.inf)), 0.0))
        radius = state.robot.radius
        found = regulate(desired, self._bend[here], cost_of(near, radius, one), left, radius, one)
        least = min(found, key=lambda cap: float(cap.v[0]))
        return towards(state, float(least.v[0]), least.cause)

    def _gaps(self, state: State, places: list[float]) -> Floats:
        """Least distance from the robot's centre, at some places, to each obstacle's rim; (m,)."""
        at = np.array([state.leg.route.at(s) for s in places])
        d = (state.message.xy[:, None, :] - at) * state.leg.samples.resolution
        least: Floats = np.sqrt((d * d).sum(axis=2)).min(axis=1, initial=np.inf) - state.message.radius
        return least

    def _collides(self, state: State) -> bool:
        far = state.v * LOOK_AHEAD
        near = self._gaps(state, [state.s]).min(initial=np.inf) - state.robot.radius
        if far == 0.0 or near > far:
            return bool(near <= 0.0)
        end = state.leg.route.length
        places = [min(state.s + far * k / _LOOKS, end) for k in range(_LOOKS + 1)]
        return bool(self._gaps(state, places).min(initial=np.inf) <= state.robot.radius)
