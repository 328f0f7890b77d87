"""Memory of the states of searches, kept from session to session: fresh pages cost more than a short search."""

from __future__ import annotations

import threading
import weakref

import numpy as np
from numpy.typing import NDArray

KEPT_BYTES = 64 << 20
"""Largest memory that is kept; one at a time."""


class StateMemory:
    """Cost, parent and round of every state, and the number of the last search that wrote to them.

    Parameters
    ----------
    states : number of states.

    Attributes
    ----------
    mark, parent, closed : int64, int16, uint8 (states,); see :func:`lampyris.kernels.lattice.search.search`.
    run : number of the last search.
    """

    def __init__(self, states: int) -> None:
        # Pages of memory that no search touches are never made.
        self.mark: NDArray[np.int64] = np.zeros(states, dtype=np.int64)
        self.parent: NDArray[np.int16] = np.zeros(states, dtype=np.int16)
        self.closed: NDArray[np.uint8] = np.zeros(states, dtype=np.uint8)
        self.run = 0


_lock = threading.RLock()
"""An object may end while its thread is in here."""
_unused: dict[int, StateMemory] = {}


def memory_for(owner: object, states: int) -> StateMemory:
    """Memory for an object, until it is no more: that of an earlier one, if it is there. The numbers of its searches go on."""
    with _lock:
        memory = _unused.pop(states, None)
    memory = memory or StateMemory(states)
    if memory.mark.nbytes + memory.parent.nbytes + memory.closed.nbytes <= KEPT_BYTES:
        weakref.finalize(owner, _keep, memory).atexit = False
    return memory


def _keep(memory: StateMemory) -> None:
    with _lock:
        _unused.clear()
        _unused[len(memory.mark)] = memory
