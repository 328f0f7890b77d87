"""What several recipes share: regions, spanning trees, doors between rooms.

SciPy is imported when something is made, never when a map is merely loaded.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import uninterrupted
from lampyris.io.maps.recipes.draw import Draw
from lampyris.typing import BoolGrid

Whole = NDArray[np.int64]


def keep_largest(blocked: BoolGrid) -> BoolGrid:
    """The same map with its largest free region only (by sides; ties to the one that is met first by rows).

    Where nothing is free at all, the middle cell becomes so: a map has a place to stand.
    """
    with uninterrupted():
        from scipy.ndimage import label  # bits: whole numbers in, whole numbers out

    regions, count = label(~blocked)
    if count == 0:
        blocked = blocked.copy()
        blocked[blocked.shape[0] // 2, blocked.shape[1] // 2] = False
        return blocked
    if count == 1:
        return blocked
    sizes = np.bincount(index_array(regions.ravel()))
    sizes[0] = 0
    kept: BoolGrid = regions != int(np.argmax(sizes))
    return kept


def spanning_tree(draw: Draw, nodes: int, a: Whole, b: Whole) -> BoolGrid:
    """Which edges (a[k], b[k]) of a connected graph form a spanning tree, drawn at random; bool (edges,).

    The minimum tree of random weights. No two weights are equal, so there is one such tree, whichever
    algorithm finds it. a < b everywhere, and no edge occurs twice.
    """
    with uninterrupted():
        from scipy.sparse import csr_array  # bits: only carries the weights
        from scipy.sparse.csgraph import minimum_spanning_tree  # bits: compares weights; no two are equal

    edges = len(a)
    order = np.lexsort((b, a))
    # As many random bits as a float holds besides the edge's own number, which makes every weight unique and
    # is also what is read from the result.
    bits = max(edges, 1).bit_length()
    random = (draw.raw(edges) >> np.uint64(11 + bits)) << np.uint64(bits)
    weight = (random + np.arange(1, edges + 1, dtype=np.uint64)).astype(np.float64)
    starts = np.searchsorted(a[order], np.arange(nodes + 1)).astype(np.int32)
    graph = csr_array((weight[order], b[order].astype(np.int32), starts), shape=(nodes, nodes))
    found: Any = minimum_spanning_tree(graph).data
    chosen = np.zeros(edges, dtype=np.bool_)
    chosen[(found.astype(np.uint64) & np.uint64((1 << bits) - 1)).astype(np.int64) - 1] = True
    return chosen


def open_doors(draw: Draw, blocked: BoolGrid, rooms: NDArray[np.int32], door: int, loops: float) -> None:
    """Cut doors into walls one cell thick so that every room can be reached; some more make loops.

    Parameters
    ----------
    blocked : written to.
    rooms : int32 (height, width), the room of each free cell from 1, 0 for walls. Two rooms share one
        straight piece of wall at most.
    door : width of a door in cells; where the shared wall is shorter, the door is as wide as that.
    loops : share of the pairs of neighbours that get a door without need.
    """
    width = rooms.shape[1]
    first, run, a, b, upright = _shared_walls(rooms)
    nodes = int(rooms.max())
    chosen = spanning_tree(draw, nodes, a - 1, b - 1) | (draw.units(1, len(a))[0] < loops)
    wide = np.minimum(run, door)
    offset = draw.belows(run - wide + 1)
    step = np.where(upright, width, 1)
    flat = blocked.reshape(-1)
    for k in range(door):
        cut = chosen & (k < wide)
        flat[(first + (offset + k) * step)[cut]] = False


def _shared_walls(rooms: NDArray[np.int32]) -> tuple[Whole, Whole, Whole, Whole, BoolGrid]:
    """For each pair of neighbours: first cell of their wall, its length, the two rooms, whether upright."""
    height, width = rooms.shape
    flat = np.arange(height * width, dtype=np.int64).reshape(height, width)
    parts = []
    for upright in (True, False):
        inner = (slice(None), slice(1, -1)) if upright else (slice(1, -1), slice(None))
        before = rooms[:, :-2] if upright else rooms[:-2]
        behind = rooms[:, 2:] if upright else rooms[2:]
        at = (rooms[inner] == 0) & (before > 0) & (behind > 0)
        one, two = before[at].astype(np.int64), behind[at].astype(np.int64)
        low, high = np.minimum(one, two), np.maximum(one, two)
        _, index, count = np.unique(
            low * (int(rooms.max()) + 1) + high, return_index=True, return_counts=True
        )
        parts.append((flat[inner][at][index], count, low[index], high[index], np.full(len(index), upright)))
    first, run, a, b, upright_all = (np.concatenate(p) for p in zip(*parts, strict=True))
    return first, run, a, b, upright_all
