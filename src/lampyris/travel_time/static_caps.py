"""The caps of the law ``physical`` that the map and the robot alone decide, for every cell and step of a map."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.model.path import path_of
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion import caps
from lampyris.motion.geometry.sampled_path import corners_of_path
from lampyris.motion.laws.physical import PhysicalLaw, map_clearance_cap
from lampyris.motion.safety.blind_areas import BlindArea, caps_by_step
from lampyris.typing import BoolGrid, FloatGrid, Floats


def node_caps(scene: Scene, free: BoolGrid, *, clearance: bool, creep: float) -> FloatGrid:
    """The maximum speed in each cell: v_max, and the clearance cap; m/s, (height, width)."""
    robot = scene.robot
    out = np.full(free.shape, robot.v_max)
    if clearance:
        rows, columns = np.nonzero(free)
        cells = np.stack((columns, rows), axis=1).astype(np.int64)
        law = PhysicalLaw(creep=creep)
        near = map_clearance_cap(cells, scene, law)
        if near is not None:
            out[rows, columns] = np.minimum(out[rows, columns], near)
    return out


@lru_cache(maxsize=32)
def corner_speeds(robot: Robot, resolution: float, moves: Moves) -> Floats:
    """The maximum speed at each corner between two steps, as a profile on the path's cells has it.

    Returns
    -------
    float64 (steps, steps), m/s, by the step into a node and the step out of it: infinity straight on, 0 for a stop.
    """
    steps = len(moves.offsets)
    most = np.full((steps, steps), np.inf)
    for i, (ax, ay) in enumerate(moves.offsets):
        for j, (bx, by) in enumerate(moves.offsets):
            cells = np.array([(0, 0), (ax, ay), (ax + bx, ay + by)], dtype=np.int32)
            corners = corners_of_path(path_of(cells, moves, None), resolution, robot)
            if len(corners.node) and corners.stop[0]:
                most[i, j] = 0.0
            elif len(corners.node):
                most[i, j] = caps.curvature(1.0 / corners.radius, a_lat_max=robot.a_lat_max)[0]
    return frozen(most)


def edge_caps(
    scene: Scene, free: BoolGrid, moves: Moves, *, zones: bool, blind: BlindArea | None
) -> Floats | None:
    """The maximum speed on the step that leaves each cell, (steps, height, width); None: there is no such cap."""
    found: list[NDArray[np.float64]] = []
    if zones and scene.zones is not None:
        found.append(np.stack([_least_touched(scene.zones, dx, dy) for dx, dy in moves.offsets]))
    if blind is not None:
        found.append(caps_by_step(scene, free, moves.offsets, blind))
    return None if not found else frozen(np.minimum.reduce(found))


def _least_touched(zones: FloatGrid, dx: int, dy: int) -> FloatGrid:
    """The least limit of the cells that the step (dx, dy) from each cell touches: those of the box around it."""
    least = zones.copy()
    height, width = zones.shape
    for y in sorted({0, dy, *range(min(dy, 0), max(dy, 0) + 1)}):
        for x in sorted({0, dx, *range(min(dx, 0), max(dx, 0) + 1)}):
            if not _touches(dx, dy, x, y):
                continue
            ys, xs = slice(max(0, -y), min(height, height - y)), slice(max(0, -x), min(width, width - x))
            shifted = zones[max(0, y) : height + min(0, y), max(0, x) : width + min(0, x)]
            least[ys, xs] = np.minimum(least[ys, xs], shifted)
    return least


def _touches(dx: int, dy: int, x: int, y: int) -> bool:
    """Whether the segment from (0, 0) to (dx, dy) touches the closed square of the cell (x, y)."""
    # The four corners of the square lie strictly on one side of the line exactly if it misses the square.
    sides = [dx * (2 * y + v) - dy * (2 * x + u) for u in (-1, 1) for v in (-1, 1)]
    return min(sides) <= 0 <= max(sides)
