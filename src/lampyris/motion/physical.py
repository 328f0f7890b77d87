"""The physical law: SI units, limits of the robot, and room enough to stop before the nearest surface."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SettingError
from lampyris.kernels.near import nearest_squares
from lampyris.model.movers import Movers
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion import caps
from lampyris.motion.course import Course
from lampyris.motion.profile import OnInfeasible, feasible_profile
from lampyris.motion.rings import as_cells
from lampyris.typing import BoolGrid, Cell

_FAR = 2**62
"""Squared half cells where nothing is within reach."""


@dataclass(frozen=True, slots=True)
class PhysicalLaw:
    """Settings of the physical law; the limits themselves are the robot's.

    Parameters
    ----------
    creep : share of the robot's v_max that no clearance takes away, 0 < creep <= 1. A path is planned
        through free cells, so a robot in a tight place must go on; at a tenth of its top speed it stops
        within a hundredth of the distance it needs from top speed (5 mm for the default robot).

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    creep: float = 0.1

    def __post_init__(self) -> None:
        real = isinstance(self.creep, int | float) and not isinstance(self.creep, bool)
        if not (real and 1e-6 <= self.creep <= 1.0):
            raise SettingError("LAW_SETTING", f"{self.creep!r}", where="physical.creep", allowed="1e-6 to 1")


def physical_profile(
    way: Path | Course,
    scene: Scene,
    law: PhysicalLaw,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    movers: Movers | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """A profile in metres and seconds: s = path.arc * resolution, v in m/s, a in m/s2, t in s.

    Caps at every node, ties in this order: ``start`` (v0 at the first node), ``limit`` (v_max),
    ``acceleration``, ``clearance`` (:func:`lampyris.motion.caps.clearance` of the distance from the node's
    centre to the nearest square of a blocked cell; the edge of the map is not a wall), ``obstacle`` (the
    same to the nearest square that a moving obstacle covers), ``braking``, ``goal`` (0 at the last node).
    Between nodes: see :func:`lampyris.motion.profile.feasible_profile`. A node that an obstacle covers has
    no clearance and is passed at creep speed: not to drive there is the planner's part, not the profile's.

    ``previous`` says nothing here.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE`` (unless ``on_infeasible`` is ``brake``), ``START_SPEED``,
        ``PATH_OUTSIDE``.
    """
    if isinstance(way, Course):
        raise NotImplementedError
    path = way
    robot = scene.robot
    resolution = scene.grid.resolution
    cells = path.cells.astype(np.int64)
    # Farther surfaces allow v_max anyway.
    reach = (robot.v_max * robot.v_max / (2.0 * robot.d_max) + robot.radius) / resolution
    rings = max(0, math.ceil(min(reach, float(max(scene.grid.blocked.shape))) + 0.5) - 1)
    creep = law.creep * robot.v_max
    half = 0.5 * resolution
    found = [("limit", caps.limit(len(cells), robot.v_max))]
    for cause, squared in (
        ("clearance", wall_squares(cells, scene.grid.blocked, rings)),
        ("obstacle", body_squares(cells, as_cells(obstacles), rings)),
    ):
        if squared is not None:
            distance = np.where(squared == _FAR, np.inf, np.sqrt(squared) * half)
            cap = caps.clearance(distance, radius=robot.radius, d_max=robot.d_max, creep=creep)
            found.append((cause, cap))
    s = path.arc * resolution
    made = feasible_profile(
        s, found, a_max=robot.a_max, d_max=robot.d_max, v0=v0, on_infeasible=on_infeasible
    )
    return Profile("physical", s, made.v, made.a, made.t, made.cause, "m/s")


def wall_squares(cells: NDArray[np.int64], blocked: BoolGrid, rings: int) -> NDArray[np.int64] | None:
    """Squared half cells from each centre to the nearest blocked square within so many rings.

    None where the whole surroundings of the path hold none.

    Raises
    ------
    SettingError : ``PATH_OUTSIDE``: a cell outside the map.
    """
    x, y = cells[:, 0], cells[:, 1]
    x0, y0, x1, y1 = int(x.min()), int(y.min()), int(x.max()), int(y.max())
    height, width = blocked.shape
    if x0 < 0 or y0 < 0 or x1 >= width or y1 >= height:
        raise SettingError(
            "PATH_OUTSIDE",
            f"cells from ({x0}, {y0}) to ({x1}, {y1})",
            where="path",
            allowed=f"cells of the map, {width} x {height}",
        )
    # Only the piece of the map around the path: the kernel's plain form turns its arrays into lists.
    x0, y0 = max(x0 - rings, 0), max(y0 - rings, 0)
    piece = np.ascontiguousarray(blocked[y0 : y1 + rings + 1, x0 : x1 + rings + 1])
    if not piece.any():
        return None
    squared = np.full(len(cells), _FAR, dtype=np.int64)
    xs, ys = x - x0, y - y0
    if rings == 0:
        squared[piece[ys, xs]] = 0
    else:
        nearest_squares(piece.ravel(), piece.shape[1], piece.shape[0], xs, ys, rings, squared)
    return squared


def body_squares(cells: NDArray[np.int64], bodies: NDArray[np.int64], rings: int) -> NDArray[np.int64] | None:
    """The same to the nearest of ``bodies``, int64 (m, 2); None if none is that near to the path's box."""
    x, y = cells[:, 0], cells[:, 1]
    bx, by = bodies[:, 0], bodies[:, 1]
    near = (bx >= x.min() - rings) & (bx <= x.max() + rings)
    near &= (by >= y.min() - rings) & (by <= y.max() + rings)
    bx, by = bx[near], by[near]
    if len(bx) == 0:
        return None
    squared = np.empty(len(cells), dtype=np.int64)
    # Blocks keep the table small however long the path and however many the bodies. Bodies lie along the
    # first axis: the minimum over them then runs over whole rows.
    block = max(1, 1_000_000 // len(bx))
    for k in range(0, len(cells), block):
        gx = np.maximum(2 * np.abs(bx[:, None] - x[k : k + block]) - 1, 0)
        gy = np.maximum(2 * np.abs(by[:, None] - y[k : k + block]) - 1, 0)
        squared[k : k + block] = (gx * gx + gy * gy).min(axis=0)
    return squared
