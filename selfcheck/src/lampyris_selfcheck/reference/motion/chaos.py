"""Mean, variance and Sobol indices of polynomials of independent inputs, from the moments of these."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence

Poly = Mapping[tuple[int, ...], float]
"""Coefficients by the exponents of all inputs."""
Input = tuple[str, float, float]
"""``uniform``, low, high; or ``normal``, mean, standard deviation."""


def value(poly: Poly, at: Sequence[float]) -> float:
    """The polynomial at a point."""
    return math.fsum(
        c * math.prod(x**k for x, k in zip(at, powers, strict=True)) for powers, c in poly.items()
    )


def moment(given: Input, k: int) -> float:
    """The mean of the k-th power of an input."""
    kind, a, b = given
    if kind == "uniform":
        return (b ** (k + 1) - a ** (k + 1)) / ((k + 1) * (b - a))
    even = (math.prod(range(1, j, 2)) if j % 2 == 0 else 0 for j in range(k + 1))
    return math.fsum(math.comb(k, j) * a ** (k - j) * b**j * m for j, m in enumerate(even))


def _known(poly: Poly, inputs: Sequence[Input], which: set[int]) -> Poly:
    """The mean of the polynomial given the inputs in a set."""
    made: defaultdict[tuple[int, ...], float] = defaultdict(float)
    for powers, c in poly.items():
        rest = math.prod(moment(inputs[k], n) for k, n in enumerate(powers) if k not in which)
        made[tuple(n if k in which else 0 for k, n in enumerate(powers))] += c * rest
    return made


def _mean(poly: Poly, inputs: Sequence[Input]) -> float:
    return math.fsum(
        c * math.prod(moment(one, n) for one, n in zip(inputs, powers, strict=True))
        for powers, c in poly.items()
    )


def variance(poly: Poly, inputs: Sequence[Input]) -> float:
    """Of the polynomial."""
    square: defaultdict[tuple[int, ...], float] = defaultdict(float)
    for one, a in poly.items():
        for other, b in poly.items():
            square[tuple(m + n for m, n in zip(one, other, strict=True))] += a * b
    return _mean(square, inputs) - _mean(poly, inputs) ** 2


def indices(poly: Poly, inputs: Sequence[Input]) -> tuple[float, float, list[tuple[float, float]]]:
    """Mean, variance, and the first-order and total index of each input."""
    whole, every = variance(poly, inputs), set(range(len(inputs)))
    sobol = [
        (
            variance(_known(poly, inputs, {k}), inputs) / whole,
            1 - variance(_known(poly, inputs, every - {k}), inputs) / whole,
        )
        for k in sorted(every)
    ]
    return _mean(poly, inputs), whole, sobol
