"""Box: the part of space in which a swarm looks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris._core.predicates import numbers
from lampyris._core.scalars import is_real
from lampyris.errors import SettingError, shown

Points: TypeAlias = NDArray[np.float64]
"""float64, (n, d): n points of d coordinates."""
Values: TypeAlias = NDArray[np.float64]
"""float64, (n,): one value for each point."""


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """All points between two corners, both included.

    Parameters
    ----------
    low, high : float64, (d,), read-only, low < high in every coordinate.

    Raises
    ------
    SettingError : corners of different lengths, empty, not finite or not in order.
    """

    low: Values
    high: Values

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            given = getattr(self, name)
            corner = numbers([given] if is_real(given) else given, (None,))
            if corner is None:
                raise SettingError.of("BOX", name, shown(given), allowed="numbers, (d,)")
            corner.setflags(write=False)
            object.__setattr__(self, name, corner)
        fits = self.low.shape == self.high.shape and self.low.ndim == 1 and self.low.size > 0
        if not (fits and np.isfinite(self.low).all() and (self.low < self.high).all()):
            raise SettingError("BOX", f"{self.low} to {self.high}", allowed="low < high, finite, (d,)")
        if not np.isfinite(self.span).all():
            raise SettingError("BOX", f"{self.low} to {self.high}", allowed="sides of finite length")

    @property
    def dimensions(self) -> int:
        """d."""
        return int(self.low.size)

    @property
    def span(self) -> Values:
        """Length of each side, float64, (d,)."""
        length: Values = self.high - self.low
        return length

    @property
    def diagonal(self) -> float:
        """Distance between the corners."""
        return float(norms(self.span[np.newaxis])[0])

    def contains(self, points: Points) -> NDArray[np.bool_]:
        """Which of the points (n, d) lie in it; bool, (n,)."""
        inside: NDArray[np.bool_] = np.all((points >= self.low) & (points <= self.high), axis=1)
        return inside

    def scatter(self, rng: np.random.Generator, n: int) -> Points:
        """n points drawn uniformly, (n, d)."""
        return self.low + rng.random((n, self.dimensions)) * self.span

    def begin(self, rng: np.random.Generator, n: int, first: ArrayLike | None) -> Points:
        """Where a swarm of n begins, (n, d): the points of ``first`` (at most n), the others scattered.

        Raises
        ------
        SettingError : points that are too many, of another dimension or outside the box.
        """
        points = self.scatter(rng, n)
        if first is not None:
            given = np.asarray(first, dtype=np.float64)
            fits = given.ndim == 2 and given.shape[1] == self.dimensions and len(given) <= n
            if not fits or not self.contains(given).all():
                raise SettingError(
                    "FIRST",
                    f"first points of shape {given.shape}",
                    allowed=f"at most {n} points of {self.dimensions} coordinates inside the box",
                )
            points[: len(given)] = given
        return points


def norms(vectors: Points) -> Values:
    """Length of each vector (..., d), float64, (...): squares are added in the order of the coordinates.

    Written out because a library's sum or product may add in an order of its own, and the last bit with it.
    """
    total = vectors[..., 0] * vectors[..., 0]
    for k in range(1, vectors.shape[-1]):
        total = total + vectors[..., k] * vectors[..., k]
    root: Values = np.sqrt(total)
    return root


def checked_values(values: ArrayLike, n: int) -> Values:
    """The values passed to a swarm of n, checked; float64, (n,).

    Raises
    ------
    SettingError : not n values, or one that is not finite.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (n,) or not np.isfinite(array).all():
        raise SettingError("VALUES", f"values of shape {array.shape}", allowed=f"{n} finite numbers")
    return array
