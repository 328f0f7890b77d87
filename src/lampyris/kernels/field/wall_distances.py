"""Distances to walls, by :func:`.clearance.wall_distance` or, where walls are near and that is not compiled, by arrays.

Loading that kernel and compiling it, once for a machine, takes 0.2 s; its plain form takes as long on 512 x 512 cells. By
operations on whole arrays it is 10 ms there, with a tenth of the cells blocked; the numbers are the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.kernels.field.clearance import wall_distance

PASSES = 12
"""Cells looked at by arrays, in cells of the map, before the rest is left to the kernel: the open ground of a map is far
from walls, and takes a pass for each cell of the distance."""
CELLS = 1 << 20
"""Cells of a map up to which this is done by arrays, which take 40 bytes a cell meanwhile."""
SIDE = 16_000
"""Cells a side up to which squared distances fit 32 bits."""
_FAR = 1 << 30


def wall_distances(blocked: NDArray[np.bool_], never: int, *, edge: bool) -> NDArray[np.int64]:
    """Squared distance of each cell's centre to the nearest wall, in half cells.

    Parameters
    ----------
    blocked : bool, (height, width).
    never : what cells of a map without a wall get; more than any squared distance.
    edge : to the nearest point of a blocked cell's square; else to its centre.

    Returns
    -------
    int64, (height, width).
    """
    height, width = blocked.shape
    if not wall_distance.is_compiled and blocked.size <= CELLS and max(height, width) <= SIDE:
        near = _near(blocked, edge)
        if near is not None:
            return near.astype(np.int64)
    squared = np.empty(blocked.size, dtype=np.int64)
    scratch = np.zeros((3, width), dtype=np.int64)
    walls = np.ascontiguousarray(blocked).view(np.uint8).ravel()
    walls.setflags(write=False)  # to numba an array that can be written is of another type
    wall_distance(walls, squared, *scratch, height, width, never, int(edge))
    return squared.reshape(height, width)


def _near(blocked: NDArray[np.bool_], edge: bool) -> NDArray[np.int32] | None:
    """Squared distances by array operations; None where these would take longer than the kernel.

    Down and up each column first. What a wall k columns away gives is its own distance from the row and that of k columns:
    the cells to which k columns alone are not too far get fewer with each k.
    """
    width = blocked.shape[1]
    cells = _along_columns(blocked)
    own = 2 * cells - np.int32(edge)
    own *= own
    own[cells == 0] = 0
    own[cells >= SIDE] = _FAR
    best, done, k = own.copy(), 0, 1
    rest: NDArray[np.intp] | None = None  # flat indices of those that are left, once they are few
    while k < width:
        flat = np.int32((2 * k - edge) * (2 * k - edge))
        if rest is None:
            left = np.flatnonzero(best.ravel() > flat)
            if 4 * len(left) < best.size:
                rest = left
            elif done + best.size > PASSES * best.size:
                return None
        else:
            rest = rest[best.ravel()[rest] > flat]
        if rest is None:
            done += best.size
            np.minimum(best[:, k:], own[:, :-k] + flat, out=best[:, k:])
            np.minimum(best[:, :-k], own[:, k:] + flat, out=best[:, :-k])
        else:
            done += 4 * len(rest)  # looking up single cells takes longer
            if not len(rest):
                break
            if done > PASSES * best.size:
                return None
            x, row = rest % width, own.ravel()
            lower = np.where(x >= k, row[rest - np.minimum(x, k)], _FAR)
            upper = np.where(x + k < width, row[rest + np.minimum(width - 1 - x, k)], _FAR)
            at = best.ravel()
            at[rest] = np.minimum(at[rest], np.minimum(lower, upper) + flat)
        checkpoint()
        k += 1
    return None if int(best.max()) >= _FAR else best


def _along_columns(blocked: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Cells to the nearest wall of each cell's column; SIDE or more where it has none."""
    height = len(blocked)
    y = np.arange(height, dtype=np.int32)[:, None]
    above = np.where(blocked, y, np.int32(-2 * SIDE))
    np.maximum.accumulate(above, axis=0, out=above)
    below = np.where(blocked, y, np.int32(3 * SIDE))[::-1]
    below = np.minimum.accumulate(below, axis=0)[::-1]
    return np.minimum(y - above, below - y)
