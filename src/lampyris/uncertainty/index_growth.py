"""Dimension-adaptive growth of a Smolyak pseudo-spectral projection.

An index gives each input a level. The projection of an index is that of the tensor product of the rules of its levels; its
surplus is that projection less those of the indices below it (with alternating signs), and the expansion is the sum
of the surpluses of all indices. Indices whose surplus was computed but which were not yet built upon are *active*. Each
step builds upon the active one with the greatest surplus: it becomes old, and the indices one level above it of which
all indices one level below are old become active.

Gerstner, Griebel, "Dimension-adaptive tensor-product quadrature", Computing 71 (2003); Conrad, Marzouk, "Adaptive
Smolyak pseudospectral approximations", SIAM J. Sci. Comput. 35 (2013).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from lampyris.typing import Floats
from lampyris.uncertainty.inputs import Input

Index: TypeAlias = tuple[int, ...]
Terms: TypeAlias = dict[Index, float]
"""Coefficients by the degrees of their polynomials."""

FORCED = 2
"""Indices of that order or less (sum of the levels) are computed before growth is left to the surpluses. An input without
an effect of its own has a surplus of 0 and would never be paired: on Ishigami's function the plain rule stops at less
than half of the variance."""


class IndexGrowth:
    """The expansion as it grows.

    Parameters
    ----------
    evaluate : from standardised inputs, (n, d), to the outcomes; each point is asked for once.
    inputs : their distributions.
    """

    def __init__(self, evaluate: Callable[[Floats], Sequence[float]], inputs: Sequence[Input]) -> None:
        self._evaluate, self._inputs = evaluate, inputs
        self._values: dict[tuple[float, ...], float] = {}
        self._tensors: dict[Index, Terms] = {}
        self.old: set[Index] = set()
        self.active: dict[Index, float] = {}
        self.terms: Terms = {}

    @property
    def runs(self) -> int:
        """Evaluations so far."""
        return len(self._values)

    def start(self) -> None:
        """Compute all indices of order up to :data:`FORCED`; those of that order are active."""
        first = _of_order(len(self._inputs), FORCED)
        self._evaluate_all(first)
        for index in first:
            self._add(index)
            if sum(index) < FORCED:
                self.active.pop(index)
                self.old.add(index)

    def points_of(self, index: Index) -> int:
        """Evaluations that an index would add."""
        return sum(point not in self._values for point in self._points(index))

    @property
    def open(self) -> float:
        """Sum of the squared surpluses of the active indices: what is estimated to be missing of the variance."""
        return sum(self.active.values())

    @property
    def variance(self) -> float:
        """Sum of the squared coefficients without the constant's."""
        constant = (0,) * len(self._inputs)
        return sum(value * value for degrees, value in self.terms.items() if degrees != constant)

    def grow(self, most: int) -> bool:
        """Build upon the active index with the greatest surplus; False if nothing can be added within so many runs."""
        for index in sorted(self.active, key=lambda one: (-self.active[one], one)):
            following = [new for new in self._above(index) if self._admissible(new)]
            # Points of two new indices may coincide: their sum is an upper bound.
            if self.runs + sum(map(self.points_of, following)) > most:
                continue
            del self.active[index]
            self.old.add(index)
            self._evaluate_all(following)
            for new in following:
                self._add(new)
            return True
        return False

    def _above(self, index: Index) -> Iterator[Index]:
        for k, one in enumerate(self._inputs):
            if index[k] + 1 < one.levels:
                yield (*index[:k], index[k] + 1, *index[k + 1 :])

    def _admissible(self, new: Index) -> bool:
        below = ((*new[:k], level - 1, *new[k + 1 :]) for k, level in enumerate(new) if level > 0)
        computed = self.old | self.active.keys()
        return new not in computed and all(one in computed for one in below)

    def _add(self, index: Index) -> None:
        """Compute the surplus of an index and add it to the expansion."""
        surplus: Terms = {}
        axes = [k for k, level in enumerate(index) if level > 0]
        for lowered in itertools.product((0, 1), repeat=len(axes)):
            down = list(index)
            for k, by in zip(axes, lowered, strict=True):
                down[k] -= by
            sign = -1.0 if sum(lowered) % 2 else 1.0
            for degrees, value in self._tensor(tuple(down)).items():
                surplus[degrees] = surplus.get(degrees, 0.0) + sign * value
        for degrees, value in surplus.items():
            self.terms[degrees] = self.terms.get(degrees, 0.0) + value
        self.active[index] = sum(value * value for value in surplus.values())

    def _tensor(self, index: Index) -> Terms:
        """Coefficients of the tensor product of the rules of an index."""
        if index not in self._tensors:
            rules = [one.rule(level) for one, level in zip(self._inputs, index, strict=True)]
            values = np.array([self._values[point] for point in self._points(index)])
            table = values.reshape([len(rule.points) for rule in rules])
            for rule in rules:
                # The first axis is projected and goes last: after all of them the order is the old one.
                table = np.tensordot(table, rule.project, axes=(0, 1))
            degrees = itertools.product(*(range(rule.degree + 1) for rule in rules))
            self._tensors[index] = dict(zip(degrees, table.ravel().tolist(), strict=True))
        return self._tensors[index]

    def _points(self, index: Index) -> Iterator[tuple[float, ...]]:
        rules = (one.rule(level) for one, level in zip(self._inputs, index, strict=True))
        return itertools.product(*(rule.points.tolist() for rule in rules))

    def _evaluate_all(self, indices: Sequence[Index]) -> None:
        """Ask for the outcomes at all points of some indices that are not known, at once."""
        wanted = dict.fromkeys(point for index in indices for point in self._points(index))
        new = [point for point in wanted if point not in self._values]
        if new:
            self._values.update(zip(new, self._evaluate(np.array(new)), strict=True))


def _of_order(count: int, order: int) -> list[Index]:
    """Indices of ``count`` levels of a sum up to ``order``, each after those below it."""
    found = [
        tuple(sum(k == one for one in chosen) for k in range(count))
        for total in range(order + 1)
        for chosen in itertools.combinations_with_replacement(range(count), total)
    ]
    return sorted(found, key=lambda index: (sum(index), index))


def value_of(terms: Terms, inputs: Sequence[Input], z: Floats) -> Floats:
    """The expansion at standardised inputs, (n, d); (n,)."""
    degrees = np.array(list(terms), dtype=np.int64)
    tables = [one.basis(z[:, k], int(degrees[:, k].max())) for k, one in enumerate(inputs)]
    total = np.zeros(len(z))
    for row, coefficient in zip(degrees.tolist(), terms.values(), strict=True):
        product = np.full(len(z), coefficient)
        for table, degree in zip(tables, row, strict=True):
            if degree:
                product *= table[degree]
        total += product
    return total
