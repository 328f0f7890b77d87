"""Cells that obstacles close, against their definition asked of every cell of the map."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.sim.continuous.leg import closed_cells, covered_cells
from lampyris.sim.sensor import ObstacleMessage

HUGE = 1e9
"""What a message may say at most, of a place and of a radius."""


@pytest.mark.parametrize("seed", range(60))
def test_cells_that_obstacles_close_and_cover_are_those_of_the_definition(seed: int) -> None:
    """Outside the map, on its edges and far larger than it, too: the search is cut to the map first."""
    rng = np.random.default_rng(seed)
    width, height = (int(n) for n in rng.integers(1, 12, 2))
    resolution = float(rng.choice([0.05, 1.0, 3.0]))
    scene = Scene(
        Grid(np.zeros((height, width), dtype=np.bool_), resolution=resolution),
        (0, 0),
        (width - 1, height - 1),
        robot=Robot(radius=0.3 * resolution),
    )
    n = int(rng.integers(0, 5))
    xy = rng.choice([0.0, 0.5, 1.0], (n, 2)) + rng.integers(-3, 14, (n, 2)) * rng.choice(
        [1.0, 1.0, HUGE / 20]
    )
    radius = rng.choice([0.0, 0.5, 1.0, 2.3, 40.0, HUGE], n) * resolution
    more = None if rng.random() < 0.5 else rng.choice([0.0, 1.7, HUGE], n) * resolution
    told = ObstacleMessage(0.0, xy, radius, np.ones(n))
    closed, covered = set(), []
    for k, (x, y) in enumerate(xy.tolist()):
        far = (radius[k] + scene.robot.radius + (0.0 if more is None else more[k])) / resolution
        reach = radius[k] / resolution - 1e-9
        for cy in range(height):
            for cx in range(width):
                away = (cx - x) * (cx - x) + (cy - y) * (cy - y)
                if away < far * far - 1e-9 or (cx, cy) == (math.floor(x + 0.5), math.floor(y + 0.5)):
                    closed.add((cx, cy))
                gx, gy = max(abs(cx - x) - 0.5, 0.0), max(abs(cy - y) - 0.5, 0.0)
                inside = reach >= 0.0 or max(abs(cx - x), abs(cy - y)) <= 0.5 + reach
                if inside and gx * gx + gy * gy < reach * reach and (cx, cy) not in covered:
                    covered.append((cx, cy))
    assert closed_cells(scene, told, more) == closed
    assert covered_cells(scene, told) == covered
    assert all(type(v) is int for cell in [*closed_cells(scene, told, more), *covered] for v in cell)
