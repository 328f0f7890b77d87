"""What the source of kernels uses besides arithmetic: plain; compiled it is in :mod:`._machine`."""

from __future__ import annotations

import time
from typing import Any

LOOK = 256
"""Cells expanded between two cancellation checks: 0.03 to 0.5 ms, by kernel."""
STRETCH = 4096
"""Cells written between two looks, where they are only written."""


def u64(value: Any) -> Any:
    """Make an unsigned 64-bit index in the compiled form; the value itself in the plain form."""
    return value


def fetch(array: Any, index: Any) -> None:
    """Say that ``array[index]`` will be written to soon: fetch it meanwhile. Nothing in the plain form.

    A store to a line of memory that is far away holds up every store after it, and unlike a load that is
    made early, this never waits. The index may lie anywhere; it must be unsigned.
    """


def lowest(word: Any) -> Any:
    """Number of the lowest bit set in an unsigned 64-bit word that is not 0; one instruction compiled."""
    return (word & -word).bit_length() - 1


def highest(word: Any) -> Any:
    """Number of the highest bit set in an unsigned 64-bit word that is not 0."""
    return word.bit_length() - 1


def stopped(halt: Any) -> Any:
    """Whether the call is to stop (:mod:`lampyris._core.cancellation`); read again each time, from memory."""
    return halt[0] != 0


def clock() -> Any:
    """A clock that never goes back, in a unit of its own: only shares of one span of it mean anything."""
    return time.perf_counter_ns()
