"""The least of several caps at each node, and the name of the one that is least."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.motion.speed_passes import ACCELERATION, BRAKING
from lampyris.motion.cap_values import Cap
from lampyris.typing import Floats

CapLike: TypeAlias = Cap | tuple[str, Floats]
"""A cap, or its cause and speeds alone."""

_KEEPS = ("start", "limit")
"""Causes that keep their node when the forward pass reaches the very same value."""

NAMES = ("acceleration", "braking", "start", "goal", "turn", "jerk")
"""Words of the first cause numbers; those of the caps follow."""

START, GOAL, TURN, JERK = 2, 3, 4, 5
assert (NAMES[ACCELERATION], NAMES[BRAKING]) == NAMES[:2]


class Lowest(NamedTuple):
    """The least cap at each node.

    Parameters
    ----------
    v : float64 (n,).
    cause : int64 (n,), places in ``names``.
    cause_index : int64 (n,); -1: nothing.
    names : words of the causes, ``acceleration`` and ``braking`` first.
    """

    v: Floats
    cause: NDArray[np.int64]
    cause_index: NDArray[np.int64]
    names: tuple[str, ...]

    @property
    def words(self) -> tuple[str, ...]:
        """The cause of each node as a word."""
        return tuple(np.array(self.names, dtype=object)[self.cause].tolist())

    @property
    def keeps(self) -> NDArray[np.bool_]:
        """Where the cause keeps a tie with acceleration: ``start`` and ``limit``; bool (n,)."""
        out = np.zeros(len(self.cause), dtype=np.bool_)
        for code, name in enumerate(self.names):
            if name in _KEEPS:
                out |= self.cause == code
        return out


def only(count: int, node: int, value: float) -> Floats:
    """A cap that binds one node alone: infinity elsewhere; shape (count,)."""
    out = np.full(count, np.inf)
    out[node] = value
    return out


def lowest(caps: Sequence[CapLike]) -> Lowest:
    """The least cap at each node and its cause; the first named wins a tie.

    Parameters
    ----------
    caps : in the order in which ties are decided, at least one; infinity where a cap says nothing.
    """
    table = np.array([cap[1] for cap in caps], dtype=np.float64)
    row = table.argmin(axis=0)
    nodes = np.arange(table.shape[1])
    cause_index = np.full(len(row), -1, dtype=np.int64)
    for k, cap in enumerate(caps):
        if len(cap) > 2 and cap[2] is not None:
            cause_index = np.where(row == k, cap[2], cause_index)
    names = (*NAMES, *(cap[0] for cap in caps))
    return Lowest(table[row, nodes], row + len(NAMES), cause_index, names)
