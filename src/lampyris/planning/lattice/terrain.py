"""What the terrain under a motion adds to its cost.

A part of a motion that lies in a cell of terrain value c costs ``1 + cost_penalty * c / 252`` times its length, as in
Nav2's Smac planners; those take the highest value under a motion for all of it, here each part has its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.model.grid import MAX_TERRAIN
from lampyris.planning.lattice.lattice import STEP, StateLattice
from lampyris.typing import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """The cells that the base passes through during each primitive, and how much of it lies in each.

    Parameters
    ----------
    first : int32 (primitives + 1,): where the cells of a primitive begin.
    cell : int64 (k, 2): x, y down, from the first cell.
    cost : float64 (k,): the part of the primitive's cost that is spent there, in units of the lattice.
    """

    first: NDArray[np.int32]
    cell: NDArray[np.int64]
    cost: Floats

    def weights(self, cost_penalty: float) -> NDArray[np.int64]:
        """What a terrain value of 1 in each of the cells adds, in units of the lattice; whole numbers."""
        return np.floor(self.cost * (cost_penalty / MAX_TERRAIN)).astype(np.int64)


@lru_cache(16)
def tracks_of(lattice: StateLattice) -> Tracks:
    """The tracks of a lattice's primitives; the same object for the same lattice."""
    first, cells, costs = [0], [], []
    for k, one in enumerate(lattice.primitives):
        track = one.poses(STEP, 0.0)[:, :2] * (1.0, -1.0)
        passed, lengths = cells_along(track)
        total = float(lengths.sum())
        if total == 0.0:
            passed, lengths, total = np.zeros((1, 2), np.int64), np.ones(1), 1.0
        where, part = np.unique(passed, axis=0, return_inverse=True)
        share = np.bincount(index_array(part.ravel()), lengths) / total
        cells.append(where)
        costs.append(share * float(lattice.cost[k]))
        first.append(first[-1] + len(where))
    return Tracks(np.array(first, np.int32), np.concatenate(cells), np.concatenate(costs))


def cells_along(track: Floats) -> tuple[NDArray[np.int64], Floats]:
    """The cells (x, y) of the pieces of a polyline, int64 (k, 2), and the length of each piece, float64 (k,).

    Parameters
    ----------
    track : float64 (n, 2): points in cells, less than a cell apart along each axis.
    """
    a, b = track[:-1], track[1:]
    d = b - a
    # Each segment crosses at most one edge between columns and one between rows.
    edge = np.maximum(np.floor(a + 0.5), np.floor(b + 0.5)) - 0.5
    crosses = np.floor(a + 0.5) != np.floor(b + 0.5)
    at = np.where(crosses, (edge - a) / np.where(crosses, d, 1.0), 1.0).clip(0.0, 1.0)
    at.sort(axis=1)
    shares = np.concatenate((np.zeros((len(a), 1)), at, np.ones((len(a), 1))), axis=1)
    parts = np.diff(shares, axis=1).ravel()
    middle = a[:, None, :] + ((shares[:, :-1] + shares[:, 1:]) / 2)[:, :, None] * d[:, None, :]
    length = np.repeat(np.sqrt((d * d).sum(axis=1)), 3) * parts
    kept = length > 0
    return np.floor(middle + 0.5).astype(np.int64).reshape(-1, 2)[kept], length[kept]
