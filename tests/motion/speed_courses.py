"""Random curves on random maps, for the tests of speed laws: lines and arcs that join, free of walls."""

from __future__ import annotations

import math

import numpy as np

from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.course import Course, course_of

SIZE = 40
"""Cells a side."""


def random_curve(rng: np.random.Generator, resolution: float, pieces: int = 8, stops: bool = True) -> Curve:
    """Lines and arcs from about the middle of the map that stay on it; at some borders the robot turns."""
    xy, heading, lengths, curvature, halts = [], [], [], [], []
    at, angle = np.array([SIZE / 2, SIZE / 2]) + rng.uniform(-8, 8, 2), float(rng.uniform(0, 2 * math.pi))
    for _ in range(pieces):
        kappa = 0.0 if rng.random() < 0.5 else float(rng.choice([-1, 1]) / rng.uniform(0.4, 6))
        long = float(rng.uniform(0.5, 5.0))
        piece = Curve(
            np.array([at]), np.array([[math.cos(angle), math.sin(angle)]]), np.array([long * resolution]),
            np.array([kappa / resolution]), (0.0, 0.0), resolution,
        )  # fmt: skip
        end = piece.at(np.array([long * resolution * (1 - 1e-15)]))[0][0]
        if not ((end > 1.0) & (end < SIZE - 2.0)).all():
            angle += math.pi / 2
            halts.append(len(lengths))
            continue
        xy.append(at)
        heading.append((math.cos(angle), math.sin(angle)))
        lengths.append(long * resolution)
        curvature.append(kappa / resolution)
        at, angle = end, angle + kappa * long
    found = sorted({h for h in halts if 0 < h < len(lengths)}) if stops else []
    return Curve(
        np.array(xy).reshape(-1, 2), np.array(heading).reshape(-1, 2), np.array(lengths), np.array(curvature),
        (float(at[0]), float(at[1])), resolution, np.array(found, dtype=np.int64),
    )  # fmt: skip


def random_robot(rng: np.random.Generator) -> Robot:
    """Limits over an order of magnitude."""
    return Robot(
        radius=float(rng.uniform(0, 0.3)),
        v_max=float(10.0 ** rng.uniform(-0.5, 0.5)),
        a_max=float(10.0 ** rng.uniform(-0.7, 0.3)),
        d_max=float(10.0 ** rng.uniform(-0.7, 0.3)),
        lat_max=float(10.0 ** rng.uniform(-0.7, 0.3)),
    )


def random_course(
    rng: np.random.Generator, *, zones: bool = True, robot: Robot | None = None, fine: float = 4.0
) -> tuple[Course, Scene]:
    """A course and its scene: walls here and there, not under the way; zones in blocks; unknown cells."""
    resolution = float(rng.choice([0.1, 0.25, 1.0]))
    curve = random_curve(rng, resolution)
    course = course_of(curve, resolution / fine)
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
