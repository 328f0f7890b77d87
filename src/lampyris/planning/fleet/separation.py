"""What a robot on its path forbids another one: cells and steps that bring their centres nearer than their radii allow.

Two robots that step in one tick move along straight lines at constant speed, so their closest approach is that of two points,
and its square is a fraction of whole numbers.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.model.fleet.fleet import FORGIVEN
from lampyris.model.grid import frozen
from lampyris.model.moves import MOVES

_Ints = NDArray[np.int64]


def meets(x: int, y: int, vx: int, vy: int, distance: float) -> bool:
    """Whether two robots come nearer than ``distance`` cells in a tick.

    Parameters
    ----------
    x, y : from one to the other, when the tick begins.
    vx, vy : the difference of their steps, the other's minus the one's.
    """
    need = distance * distance * (1.0 - FORGIVEN)
    along, length = x * vx + y * vy, vx * vx + vy * vy
    if along >= 0:  # they part, or keep their distance
        return x * x + y * y < need
    if along + length <= 0:  # nearest when the tick ends
        return (x + vx) ** 2 + (y + vy) ** 2 < need
    return (x * x + y * y) * length - along * along < need * length


@lru_cache(maxsize=1024)
def cells_kept(distance: float) -> _Ints:
    """Where another robot must not stand beside one that stands: offsets, int64 (n, 2)."""
    far = int(distance) + 1
    span = range(-far, far + 1)
    near = [(x, y) for y in span for x in span if meets(x, y, 0, 0, distance)]
    return frozen(np.array(near, dtype=np.int64).reshape(-1, 2))


@lru_cache(maxsize=4096)
def cells_passed(distance: float, dx: int, dy: int) -> _Ints:
    """Where another robot must not wait while one steps by (dx, dy), beyond :func:`cells_kept` of both its cells.

    Offsets from the cell that it leaves, int64 (n, 2).
    """
    near = {(x, y) for x, y in cells_kept(distance).tolist()}
    near |= {(x + dx, y + dy) for x, y in near}
    far = int(distance) + 2
    span = range(-far, far + 1)
    found = [(x, y) for y in span for x in span if (x, y) not in near and meets(x, y, -dx, -dy, distance)]
    return frozen(np.array(found, dtype=np.int64).reshape(-1, 2))


@lru_cache(maxsize=4096)
def steps_barred(distance: float, dx: int, dy: int, moves: str) -> _Ints:
    """Steps that another robot must not make while one steps by (dx, dy), or waits.

    Rows of x, y of its first cell, relative to the cell that the one leaves, and its step; int64 (n, 4). Steps that begin or end
    where it must not stand are left out.
    """
    kept = {(x, y) for x, y in cells_kept(distance).tolist()}
    far = int(distance) + 3
    span = range(-far, far + 1)
    found = [
        (x, y, ex, ey)
        for y in span
        for x in span
        if (x, y) not in kept
        for ex, ey in MOVES[moves].offsets
        if (x + ex - dx, y + ey - dy) not in kept and meets(x, y, ex - dx, ey - dy, distance)
    ]
    return frozen(np.array(found, dtype=np.int64).reshape(-1, 4))


def apart(cells: _Ints, robots: int, distance: float) -> _Ints:
    """The first cells, in their order, that are at least ``distance`` from each other.

    Parameters
    ----------
    cells : int64 (n, 2), x and y, no two the same.
    robots : as many as are wanted; fewer are returned where there is no room for more.
    distance : in cells.
    """
    near = cells_kept(distance)
    if len(near) <= 1 or not len(cells):
        return cells[:robots]
    far = int(np.abs(near).max())
    low = cells.min(axis=0) - far
    width, height = (cells.max(axis=0) + far + 1 - low).tolist()
    taken = np.zeros(width * height, dtype=np.bool_)
    around = near[:, 1] * width + near[:, 0]
    places = (cells[:, 1] - low[1]) * width + cells[:, 0] - low[0]
    kept: list[int] = []
    for k, place in enumerate(places.tolist()):
        if len(kept) == robots:
            break
        if not taken[place]:
            taken[place + around] = True
            kept.append(k)
    return cells[kept]
