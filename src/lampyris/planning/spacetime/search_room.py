"""Room of searches by intervals, kept from call to call and cleaned where a search has been, not as a whole.

On a large map a search comes upon few of the states for which there is room: to fill the arrays before each took a sixth
of its time.
"""

from __future__ import annotations

import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.spacetime.timed_search import NEVER, clean

KEPT_STATES = 1 << 20
"""States for which room is kept at most, as long as the search lives that used it last; 45 bytes each."""
LASTING_STATES = 1 << 13
"""States for which room is kept after that."""


class StateRoom(NamedTuple):
    """The arrays of :func:`lampyris.kernels.spacetime.timed_search.sipp`, from ``arrive`` to ``tie``."""

    arrive: NDArray[np.int64]
    paid: NDArray[np.int64]
    came: NDArray[np.int32]
    done: NDArray[np.uint8]
    heap: NDArray[np.int32]
    place: NDArray[np.int32]
    key: NDArray[np.int64]
    tie: NDArray[np.int64]

    @classmethod
    def of(cls, states: int) -> StateRoom:
        """Clean room for so many states."""
        paid, key, tie = (np.empty(states, dtype=np.int64) for _ in range(3))
        return cls(
            np.full(states, NEVER, dtype=np.int64),
            paid,
            np.empty(states, dtype=np.int32),
            np.zeros(states, dtype=np.uint8),
            np.zeros(states + 1, dtype=np.int32),
            np.zeros(states, dtype=np.int32),
            key,
            tie,
        )

    def first(self, states: int) -> StateRoom:
        """The part for the first states."""
        return StateRoom(
            self.arrive[:states],
            self.paid[:states],
            self.came[:states],
            self.done[:states],
            self.heap[: states + 1],
            self.place[:states],
            self.key[:states],
            self.tie[:states],
        )


class SearchRoom(threading.local):
    """Working memory for one search at a time in each thread; large arrays are released with the search that used them last."""

    def __init__(self) -> None:
        self._held: list[StateRoom] = []
        self._user: weakref.ref[object] | None = None

    @property
    def kept(self) -> StateRoom | None:
        """This thread's room."""
        return self._held[0] if self._held else None

    @contextmanager
    def take(self, states: int, result: NDArray[np.int64], user: object) -> Iterator[StateRoom]:
        """Clean room for exactly so many states.

        Parameters
        ----------
        states : how many.
        result : of the search: the second number says how many states it expanded.
        user : whose search it is: large room is not kept for longer than this lives.
        """
        kept = _taken(self._held)  # a search that an exception stops leaves it in any state
        if kept is None or len(kept.arrive) < states:
            kept = StateRoom.of(states)
        there = kept.first(states)
        yield there
        clean(there.arrive, there.done, there.heap, there.place, int(result[1]))
        if len(kept.arrive) <= KEPT_STATES:
            if self._user is None or self._user() is not user:
                held = self._held  # of this thread, whichever thread the user ends in
                self._user = weakref.ref(user, lambda _: _shrink(held, LASTING_STATES))
            self._held.append(kept)

    def shrink(self, states: int) -> None:
        """Let go of this thread's room if it is for more states than that."""
        _shrink(self._held, states)


def _taken(held: list[StateRoom]) -> StateRoom | None:
    """Room taken out, so that no other thread has it; None: there is none."""
    try:
        return held.pop()
    except IndexError:
        return None


def _shrink(held: list[StateRoom], states: int) -> None:
    # Another thread may take the room meanwhile: nothing is put back.
    if any(len(room.arrive) > states for room in held):
        held.clear()


ROOM = SearchRoom()
