"""What a single value is, asked before anything is done with it: whatever it is, the answer is yes or no.

NumPy's numbers are recognised by the classes of :mod:`numbers`, so that this module need not import NumPy.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from numbers import Integral, Rational, Real
from typing import TypeGuard

MOST_WHOLE = 2**63 - 1
"""The greatest whole number that compiled code can count with."""

MAX_SEED = MOST_WHOLE
SEED_RANGE = "a whole number, 0 to 2^63 - 1"
"""What a seed may be, for every message about one."""


def is_real(value: object) -> TypeGuard[float]:
    """Whether it is a finite number that a float64 can hold: an int, a float, or one of NumPy's; no bool."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    if isinstance(value, Rational) and not isinstance(value, Integral):
        return False
    try:
        return math.isfinite(value)
    except (OverflowError, TypeError, ValueError):
        return False


def in_range(value: object, least: float, most: float) -> TypeGuard[float]:
    """Whether it is a finite number from ``least`` to ``most``."""
    return is_real(value) and least <= float(value) <= most


def is_whole(value: object, least: int = -MOST_WHOLE, most: int = MOST_WHOLE) -> TypeGuard[int]:
    """Whether it is a whole number from ``least`` to ``most``: an int, or one of NumPy's; no bool."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    return whole and bool(least <= int(value) <= most)  # type: ignore[call-overload]


def is_word(value: object, known: Collection[str]) -> TypeGuard[str]:
    """Whether it is one of these words."""
    return isinstance(value, str) and value in known
