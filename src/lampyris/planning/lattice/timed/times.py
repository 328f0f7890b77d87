"""When the robot is at each pose of a path of the lattice."""

from __future__ import annotations

import numpy as np

from lampyris.planning.lattice.lattice import StateLattice
from lampyris.planning.lattice.poses import STEP
from lampyris.planning.lattice.timed.discs import times_along
from lampyris.planning.lattice.timed.search import TimedFound
from lampyris.typing import Floats


def pose_times(found: TimedFound, lattice: StateLattice, duration: Floats, arm: float) -> Floats:
    """When the robot reaches each pose of :func:`lampyris.planning.lattice.poses.pose_path_of` and when it leaves it.

    Parameters
    ----------
    duration : float64 (primitives,): ticks.
    arm : distance from the base to the farthest point of the robot, cells.

    Returns
    -------
    float64 (n, 2): ticks.
    """
    assert found.path is not None
    rows: list[Floats] = []
    reached = 0.0
    for k, departure in zip(found.path.primitives, found.departures, strict=True):
        one = lattice.primitives[k]
        at = departure + times_along(one.poses(STEP, arm), float(duration[k]), in_place=one.length == 0)
        part = np.column_stack((at[:-1], at[:-1]))
        part[0, 0] = reached
        rows.append(part)
        reached = departure + float(duration[k])
    return np.concatenate([*rows, np.array([(reached, reached)])])
