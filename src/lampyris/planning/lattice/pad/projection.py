"""The projection of a lattice onto cells: its displacements, each at the cost of its cheapest free primitive."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.lattice import StateLattice

Vector = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """Displacements of a lattice, as kernels read them.

    Parameters
    ----------
    member : int32 (m,): the primitives that move the base, by displacement, cheap ones first.
    member_group : int32 (m,): the displacement of each.
    group_first : int32 (groups + 1,): where the primitives of a displacement begin.
    span : the least cost of a displacement.
    costliest : the greatest cost of a primitive that moves the base.
    """

    member: NDArray[np.int32]
    member_group: NDArray[np.int32]
    group_first: NDArray[np.int32]
    span: int
    costliest: int


@lru_cache(16)
def projection_of(lattice: StateLattice) -> Projection:
    """The projection of a lattice; the same object for the same lattice."""
    groups: dict[Vector, list[int]] = {}
    for k, (x, y) in enumerate(lattice.cell.tolist()):
        if (x, y) != (0, 0):
            groups.setdefault((x, y), []).append(k)
    for one in groups.values():
        one.sort(key=lambda k: (int(lattice.cost[k]), k))
    order = [groups[vector] for vector in sorted(groups)]
    member = [k for one in order for k in one]
    return Projection(
        np.array(member, dtype=np.int32),
        np.repeat(np.arange(len(order)), [len(one) for one in order]).astype(np.int32),
        np.concatenate(([0], np.cumsum([len(one) for one in order]))).astype(np.int32),
        int(lattice.cost[member].min()),
        int(lattice.cost[member].max()),
    )
