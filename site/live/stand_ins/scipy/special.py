"""The normal distribution, as ``scipy.special`` has it, for single numbers."""

from __future__ import annotations

import math
from statistics import NormalDist


def ndtr(x: float) -> float:
    """The share of a standard normal distribution below a value."""
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


def ndtri(p: float) -> float:
    """The value below which a share of a standard normal distribution lies, 0 < p < 1."""
    return NormalDist().inv_cdf(p)
