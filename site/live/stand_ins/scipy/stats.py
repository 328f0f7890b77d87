"""Ranks and two distributions, as ``scipy.stats`` has them, for what comparisons of planners ask."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

_Z = np.linspace(-40.0, 40.0, 8001)
"""Places at which an integrand that falls as exp(-z²/2) is summed: the sum is exact to rounding."""


def rankdata(a: Any) -> Any:
    """Ranks from 1; what is equal shares the mean of its ranks.

    Parameters
    ----------
    a : (n,).
    """
    _, inverse, counts = np.unique(np.asarray(a), return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2.0)[inverse]


class _ChiSquared:
    def sf(self, x: float, df: int) -> float:
        """The share of a chi-squared distribution above x.

        Parameters
        ----------
        x : 0 or more. df : degrees of freedom, whole, 1 or more.
        """
        half = max(float(x), 0.0) / 2.0
        if df % 2:
            total, term, k = (
                math.erfc(math.sqrt(half)),
                2.0 * math.sqrt(half / math.pi) * math.exp(-half),
                1.5,
            )
        else:
            total, term, k = 0.0, math.exp(-half), 1.0
        while k <= df / 2.0:
            total += term
            term *= half / k
            k += 1.0
        return total


class _StudentizedRange:
    def ppf(self, q: float, k: int, df: float) -> float:
        """Quantile of the range of k standard normal values.

        Parameters
        ----------
        q : share, 0 < q < 1. k : 2 or more. df : infinity; nothing else is offered here.
        """
        if df != np.inf:
            raise NotImplementedError("a known variance")
        low, high = 0.0, 40.0
        for _ in range(60):
            middle = (low + high) / 2.0
            low, high = (middle, high) if self._below(middle, k) < q else (low, middle)
        return (low + high) / 2.0

    def _below(self, width: float, k: int) -> float:
        density = np.exp(-_Z * _Z / 2.0) / math.sqrt(2.0 * math.pi)
        share = _normal(_Z) - _normal(_Z - width)
        return float(k * (density * share ** (k - 1)).sum() * (_Z[1] - _Z[0]))


def _normal(z: Any) -> Any:
    return np.array([0.5 * math.erfc(-one / math.sqrt(2.0)) for one in z.tolist()])


chi2 = _ChiSquared()
studentized_range = _StudentizedRange()
