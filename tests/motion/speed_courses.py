"""Random curves on random maps, for the tests of speed laws: free of walls."""

from __future__ import annotations

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris_selfcheck.checks.speed.profile_paths import SIZE
from lampyris_selfcheck.checks.speed.profile_paths import drawn_curve as random_curve


def random_robot(rng: np.random.Generator) -> Robot:
    """Limits over an order of magnitude."""
    return Robot(
        radius=float(rng.uniform(0, 0.3)),
        v_max=float(10.0 ** rng.uniform(-0.5, 0.5)),
        a_max=float(10.0 ** rng.uniform(-0.7, 0.3)),
        d_max=float(10.0 ** rng.uniform(-0.7, 0.3)),
        a_lat_max=float(10.0 ** rng.uniform(-0.7, 0.3)),
    )


def random_course(
    rng: np.random.Generator, *, zones: bool = True, robot: Robot | None = None, fine: float = 4.0
) -> tuple[SampledPath, Scene]:
    """A course and its scene: walls here and there, not under the way; zones in blocks; unknown cells."""
    resolution = float(rng.choice([0.1, 0.25, 1.0]))
    curve = random_curve(rng, resolution)
    course = sample_curve(curve, resolution / fine)
    blocked = rng.random((SIZE, SIZE)) < rng.uniform(0, 0.15)
    under = np.floor(curve.at(np.linspace(0, curve.length, 2000))[0] + 0.5).astype(int)
    blocked[under[:, 1], under[:, 0]] = False
    unknown = blocked & (rng.random((SIZE, SIZE)) < 0.3)
    limits = np.full((SIZE, SIZE), np.inf)
    for _ in range(6):
        x, y = rng.integers(0, SIZE, 2)
        limits[y : y + rng.integers(1, 9), x : x + rng.integers(1, 9)] = rng.uniform(0.05, 1.0)
    grid = Grid(blocked, unknown if unknown.any() else None, resolution)
    who = random_robot(rng) if robot is None else robot
    return course, Scene(grid, (0, 0), (1, 1), robot=who, zones=limits if zones else None)
