"""Drawn ways for speed laws: paths of cells and courses on curves, with walls, zones and bodies around."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import Path, path_of
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws.node_refinement import refined
from lampyris.typing import Floats, Points

SIZE = 40
"""Cells a side of the map under a course."""


class ProfilePath(NamedTuple):
    """A way, its scene, and the cells of bodies around it, (m, 2)."""

    way: Path | SampledPath
    scene: Scene
    bodies: list[tuple[int, int]]

    def between(self) -> tuple[Points, Floats]:
        """Places to look at (cells, (m, 2)), and where each is: an edge's number and the part of it passed.

        On a path these are its nodes, on a course three places between every two as well.
        """
        if isinstance(self.way, Path):
            return self.way.cells.astype(np.float64), np.arange(len(self.way.cells), dtype=np.float64)
        course = self.way
        assert course.curve is not None
        n = len(course)
        share = np.arange(4 * (n - 1) + 1) / 4.0
        return course.curve.at(np.interp(share, np.arange(n), course.s))[0], share


def drawn_robot(rng: np.random.Generator) -> Robot:
    """Limits over an order of magnitude; every fourth with a limit on jerk."""
    v_max, a_max, d_max, a_lat_max = (10.0 ** rng.uniform(-0.7, 0.5, 4)).tolist()
    jerk = float(10.0 ** rng.uniform(-0.5, 1)) if rng.random() < 0.25 else None
    return Robot(float(rng.uniform(0, 0.3)), v_max, a_max, d_max, a_lat_max, jerk_max=jerk)


def on_cells(rng: np.random.Generator) -> ProfilePath:
    """A random walk by any step set, with the map random around it."""
    name = ("four-connected", "octile", "sixteen-connected")[int(rng.integers(3))]
    steps = MOVES[name].offsets
    width, height = (int(x) for x in rng.integers(3, 40, 2))
    blocked = rng.random((height, width)) < rng.uniform(0, 0.5)
    way = [(int(rng.integers(width)), int(rng.integers(height)))]
    for k in rng.integers(len(steps), size=int(rng.integers(0, 60))).tolist():
        x, y = way[-1][0] + steps[k][0], way[-1][1] + steps[k][1]
        if 0 <= x < width and 0 <= y < height:
            way.append((x, y))
    for x, y in way:
        blocked[y, x] = False
    grid = Grid(blocked, resolution=float(rng.choice([0.05, 0.1, 0.5, 1.0])))
    scene = Scene(grid, way[0], way[-1], MOVES[name], drawn_robot(rng))
    return _peopled(rng, path_of(np.array(way), MOVES[name]), scene)


def on_curves(rng: np.random.Generator) -> ProfilePath:
    """A course over lines and arcs; walls not under it; every second with nodes more where it is tight."""
    resolution = float(rng.choice([0.1, 0.25, 1.0]))
    curve = drawn_curve(rng, resolution)
    while not len(curve.lengths):
        curve = drawn_curve(rng, resolution)
    blocked = rng.random((SIZE, SIZE)) < rng.uniform(0, 0.15)
    under = np.floor(curve.at(np.linspace(0, curve.length, 2000))[0] + 0.5).astype(int)
    blocked[under[:, 1], under[:, 0]] = False
    scene = Scene(Grid(blocked, resolution=resolution), (0, 0), (1, 1), robot=drawn_robot(rng))
    ground = _peopled(rng, sample_curve(curve, resolution / 4.0), scene)
    if isinstance(ground.way, SampledPath) and rng.random() < 0.5:
        return ground._replace(way=refined(ground.way, ground.scene))
    return ground


def _peopled(rng: np.random.Generator, way: Path | SampledPath, scene: Scene) -> ProfilePath:
    """With zones, and bodies, each in every second case."""
    width, height = scene.grid.width, scene.grid.height
    if rng.random() < 0.5:
        limits = np.full((height, width), np.inf)
        for _ in range(4):
            x, y = int(rng.integers(width)), int(rng.integers(height))
            block = limits[y : y + int(rng.integers(1, 9)), x : x + int(rng.integers(1, 9))]
            block[:] = rng.uniform(0.05, 1.0)
        scene = replace(scene, zones=limits)
    count = int(rng.integers(1, 6)) if rng.random() < 0.5 else 0
    drawn = rng.integers((0, 0), (width, height), (count, 2)).tolist()
    return ProfilePath(way, scene, [(x, y) for x, y in drawn])


def drawn_curve(rng: np.random.Generator, resolution: float, pieces: int = 8, stops: bool = True) -> Curve:
    """Lines and arcs from about the middle of the map that stay on it; at some borders the robot turns."""
    xy: list[Points] = []
    heading: list[tuple[float, float]] = []
    lengths: list[float] = []
    curvature: list[float] = []
    halts: list[int] = []
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
