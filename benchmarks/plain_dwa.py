"""A dynamic window approach in plain Python, as textbooks and courses write it: the rival of ours, written for this benchmark.

Each pair of a speed and a yaw rate of the window is simulated step by step; its cost is the heading error and the distance to
the goal, the speed that is missing, and the inverse of the least distance to an obstacle, by NumPy over all of its places and
all obstacles. PythonRobotics (MIT) has one of this kind; it is not on PyPI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class PlainDwa:
    """Settings: metres, seconds, radians."""

    v_max: float = 1.0
    a_max: float = 0.5
    w_max: float = 1.86
    radius: float = 0.35
    speeds: int = 9
    yaw_rates: int = 21
    step: float = 0.1
    horizon: float = 2.0
    window: float = 0.5

    def choose(
        self, state: tuple[float, float, float, float], goal: tuple[float, float], obstacles: Any
    ) -> Any:
        """The best command and its trajectory."""
        x, y, yaw, v = state
        low, high = max(v - self.a_max * self.window, 0.0), min(v + self.a_max * self.window, self.v_max)
        best, chosen, path = math.inf, (0.0, 0.0), np.zeros((1, 3))
        for speed in np.linspace(low, high, self.speeds):
            for rate in np.linspace(-self.w_max, self.w_max, self.yaw_rates):
                trajectory = self.simulate(x, y, yaw, speed, rate)
                end = trajectory[-1]
                bearing = math.atan2(goal[1] - end[1], goal[0] - end[0])
                off = abs(math.atan2(math.sin(bearing - end[2]), math.cos(bearing - end[2])))
                cost = 0.15 * off + (self.v_max - speed) + self.obstacle_cost(trajectory, obstacles)
                cost += 0.5 * math.hypot(goal[0] - end[0], goal[1] - end[1])
                if cost < best:
                    best, chosen, path = cost, (float(speed), float(rate)), trajectory
        return chosen, path

    def simulate(self, x: float, y: float, yaw: float, speed: float, rate: float) -> Any:
        """The places of a constant command."""
        places, t = [(x, y, yaw)], 0.0
        while t < self.horizon - 1e-9:
            yaw += rate * self.step
            x += speed * math.cos(yaw) * self.step
            y += speed * math.sin(yaw) * self.step
            places.append((x, y, yaw))
            t += self.step
        return np.array(places)

    def obstacle_cost(self, trajectory: Any, obstacles: Any) -> float:
        """The inverse of the least distance; infinite where it touches."""
        dx = trajectory[:, 0][:, None] - obstacles[:, 0]
        dy = trajectory[:, 1][:, None] - obstacles[:, 1]
        least = np.hypot(dx, dy).min()
        return math.inf if least <= self.radius else 1.0 / float(least)
