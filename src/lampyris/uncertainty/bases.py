"""Orthonormal polynomials and quadrature rules of the distributions: Legendre for uniform, Hermite for normal.

Uniform inputs have the nested rules of Patterson (1, 3, 7, 15, 31, 63 points), which reuse the runs of the level below;
normal inputs have Gauss rules (1, 3, 5, 9, 13 points), which share the middle only. Both are computed here: roots
are bracketed by those of the rule before and found by bisection, so nothing is tabulated and no eigenvalue solver decides.

Patterson, "The optimum addition of points to quadrature formulae", Mathematics of Computation 22 (1968).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from lampyris.typing import Floats

PATTERSON_LEVELS = 6
"""Levels of uniform inputs: 63 points, exact to degree 95."""
HERMITE_POINTS = (1, 3, 5, 9, 13)
"""Points of the levels of normal inputs. The outermost of 13 is 5.8 standard deviations from the mean."""
_HALVINGS = 90


@dataclass(frozen=True, slots=True, eq=False)
class QuadratureRule:
    """One level of one input.

    Parameters
    ----------
    points : standardised places, (m,).
    weights : (m,), of the distribution: they add up to 1.
    degree : greatest degree that is projected: half of what the rule integrates exactly, so that no two polynomials of
        the basis are confused by it (Conrad and Marzouk 2013).
    project : (degree + 1, m); times the values at the points it gives the coefficients.
    """

    points: Floats
    weights: Floats
    degree: int
    project: Floats


def legendre(z: Floats, degree: int) -> Floats:
    """Legendre polynomials orthonormal for the uniform distribution on [-1, 1]; (degree + 1, *z.shape)."""
    rows = _legendre(z, degree)
    norms = np.sqrt(2.0 * np.arange(degree + 1) + 1.0)
    normed: Floats = rows * norms.reshape(-1, *([1] * np.ndim(z)))
    return normed


def hermite(z: Floats, degree: int) -> Floats:
    """Hermite polynomials orthonormal for the standard normal distribution; (degree + 1, *z.shape)."""
    rows = np.ones((degree + 1, *np.shape(z)))
    if degree:
        rows[1] = z
    for k in range(1, degree):
        rows[k + 1] = (z * rows[k] - math.sqrt(k) * rows[k - 1]) / math.sqrt(k + 1.0)
    return rows


@lru_cache(maxsize=32)
def uniform_rule(level: int) -> QuadratureRule:
    """Level 0 to ``PATTERSON_LEVELS`` - 1."""
    points = _patterson(level)
    m = len(points)
    z, w = _gauss_legendre(m // 2 + 1)
    weights = np.empty(m)
    for i in range(m):
        others = np.delete(points, i)
        weights[i] = (w * np.prod((z[:, None] - others) / (points[i] - others), axis=1)).sum()
    exact = 1 if m == 1 else (3 * m + 1) // 2
    degree = exact // 2
    return QuadratureRule(points, weights, degree, legendre(points, degree) * weights)


@lru_cache(maxsize=32)
def normal_rule(level: int) -> QuadratureRule:
    """Level 0 to ``len(HERMITE_POINTS)`` - 1."""
    m = HERMITE_POINTS[level]
    points = np.zeros(0)
    for k in range(1, m + 1):
        points = _roots(partial(_highest, hermite, k), points, math.sqrt(4.0 * k + 2.0))
    weights = 1.0 / (m * hermite(points, m - 1)[m - 1] ** 2)
    return QuadratureRule(points, weights, m - 1, hermite(points, m - 1) * weights)


def _legendre(z: Floats, degree: int) -> Floats:
    rows = np.ones((degree + 1, *np.shape(z)))
    if degree:
        rows[1] = z
    for k in range(1, degree):
        rows[k + 1] = ((2 * k + 1) * z * rows[k] - k * rows[k - 1]) / (k + 1)
    return rows


def _highest(basis: Callable[[Floats, int], Floats], degree: int, z: Floats) -> Floats:
    """The polynomial of one degree."""
    found: Floats = basis(z, degree)[degree]
    return found


def _roots(function: Callable[[Floats], Floats], between: Floats, far: float) -> Floats:
    """Roots, one in each gap of the sorted ``between`` and beyond its ends to ``far``; 0 exactly in the middle."""
    low, high = np.concatenate(([-far], between)), np.concatenate((between, [far]))
    rising = function(high) > 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        above = (function(middle) > 0.0) == rising
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    found = 0.5 * (low + high)
    return 0.5 * (found - found[::-1])  # symmetric to the last bit


@lru_cache(maxsize=8)
def _gauss_legendre(m: int) -> tuple[Floats, Floats]:
    """Points and weights of the Gauss rule for the uniform distribution on [-1, 1]."""
    points = np.zeros(0)
    for k in range(1, m + 1):
        points = _roots(partial(_highest, _legendre, k), points, 1.0)
    below = _legendre(points, m - 1)[m - 1]
    return points, (1.0 - points * points) / (m * below) ** 2


@lru_cache(maxsize=8)
def _patterson(level: int) -> Floats:
    """Points of the nested rule: those of the level below and one more in each gap.

    The new ones are the roots of the polynomial E of degree n + 1 with ``integral of G E p = 0`` for every p of degree up
    to n, where G has the n points below as its roots.
    """
    if level == 0:
        return np.zeros(1)
    below = _patterson(level - 1)
    n = len(below)
    z, w = _gauss_legendre(3 * n // 2 + 2)
    rows = _legendre(z, n + 1)
    weighted = w * np.prod(2.0 * (z[:, None] - below), axis=1)
    weighted /= np.abs(weighted).max()
    # G is odd and E even: even p vanish by themselves, and E has even terms only.
    even, odd = range(0, n, 2), range(1, n + 1, 2)
    matrix = [[float((weighted * rows[k] * rows[j]).sum()) for j in even] for k in odd]
    right = [-float((weighted * rows[k] * rows[n + 1]).sum()) for k in odd]
    terms = _solved(matrix, right)

    def added(t: Floats) -> Floats:
        at = _legendre(t, n + 1)
        total: Floats = at[n + 1]
        for j, term in zip(even, terms, strict=True):
            total = total + term * at[j]
        return total

    return np.sort(np.concatenate((below, _roots(added, below, 1.0))))


def _solved(matrix: list[list[float]], right: list[float]) -> list[float]:
    """Solution of a small system of linear equations, by elimination with the greatest pivot."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    n = len(rows)
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        for i in range(k + 1, n):
            share = rows[i][k] / rows[k][k]
            rows[i] = [a - share * b for a, b in zip(rows[i], rows[k], strict=True)]
    x = [0.0] * n
    for k in range(n - 1, -1, -1):
        x[k] = (rows[k][n] - sum(rows[k][j] * x[j] for j in range(k + 1, n))) / rows[k][k]
    return x
