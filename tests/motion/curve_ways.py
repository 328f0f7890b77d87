"""Random maps with random polylines on them, for the tests of curves."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from lampyris import Grid, Robot


class Case(NamedTuple):
    """A polyline on a map, a robot, and how to make a curve of it."""

    points: np.ndarray
    grid: Grid
    robot: Robot
    how: dict[str, Any]


def walk(rng: np.random.Generator, blocked: np.ndarray) -> np.ndarray:
    """A random walk over free cells, with runs of equal steps, diagonals that cut corners and stands."""
    height, width = blocked.shape
    at = (int(rng.integers(width)), int(rng.integers(height)))
    blocked[at[1], at[0]] = False
    cells, step = [at], (1, 0)
    for _ in range(int(rng.integers(0, 70))):
        if rng.random() < 0.4:
            step = (int(rng.integers(-1, 2)), int(rng.integers(-1, 2)))
        x, y = cells[-1][0] + step[0], cells[-1][1] + step[1]
        if 0 <= x < width and 0 <= y < height and not blocked[y, x]:
            cells.append((x, y))
    return np.array(cells, dtype=np.float64)


def polyline(rng: np.random.Generator, blocked: np.ndarray, halves: bool) -> np.ndarray:
    """Random points of the map, or centres, edges and corners of cells; most walls on the way are opened."""
    height, width = blocked.shape
    points = rng.uniform((-0.5, -0.5), (width - 0.5, height - 0.5), (int(rng.integers(1, 12)), 2))
    if halves:
        points = np.clip(np.round(points * 2) / 2, -0.5, (width - 0.5, height - 0.5))
    share = np.linspace(0, 1, 300)[:, None]
    for a, b in pairwise(points):
        x, y = np.floor(a + share * (b - a) + 0.5).astype(int).T
        blocked[np.minimum(y, height - 1), np.minimum(x, width - 1)] = False
    return points


def cases(count: int, seed: int) -> list[Case]:
    """Cases of every kind."""
    rng = np.random.default_rng(seed)
    out = []
    for number in range(count):
        width, height = rng.integers(1, 34, 2)
        blocked = rng.random((height, width)) < rng.uniform(0, 0.45)
        if number % 3 == 0:
            points = walk(rng, blocked)
        else:
            blocked &= rng.random(blocked.shape) < 0.15
            points = polyline(rng, blocked, number % 3 == 1)
        size = float(rng.choice([0.05, 0.5, 1.0]))
        robot = Robot(
            radius=float(rng.choice([0, 0, 0.3, 0.5, 0.7, 1.0, 1.4, 3.2])) * size,
            v_max=float(rng.choice([0.3, 1.0, 5.0])),
            turn_radius=float(rng.choice([0, 0, 0, 0.5, 2.0])) * size,
        )
        how = {
            "smooth": str(rng.choice(["arcs", "arcs", "arcs", "none"])),
            "shortcut": bool(rng.random() < 0.7),
        }
        out.append(Case(points, Grid(blocked, resolution=size), robot, how))
    return out
