"""SegmentedPhoto: a photograph that became a map."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lampyris._core.values import Value
from lampyris.model.grid import Grid
from lampyris.model.settings.photo import PhotoSettings

LEVELS = 256
"""Levels of grey."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SegmentedPhoto(Value):
    """A map made of a photograph, and the thresholds between the classes of its grey levels.

    Parameters
    ----------
    grid : the map.
    thresholds : in ascending order; class c holds the levels above threshold c - 1 up to threshold c.
    free : the classes that are free, 0 the darkest.
    score : what the thresholds are worth by the criterion: of ``otsu`` the variance between classes, of ``kapur`` the
        sum of entropies in nats, of ``cross-entropy`` what it falls by in comparison with a single class, each for a
        pixel.
    optimum : the greatest score of as many thresholds, by dynamic programming.
    histogram : int64 (256,), read-only; opaque pixels of each level, after the median filter.
    width, height : of the photograph, pixels.
    settings : how it was made.
    notes : sentences about how the photograph was read.
    seconds : CPU time of the search for thresholds.
    """

    grid: Grid
    thresholds: tuple[int, ...]
    free: tuple[int, ...]
    score: float
    optimum: float
    histogram: NDArray[np.int64]
    width: int
    height: int
    settings: PhotoSettings
    notes: tuple[str, ...] = ()
    seconds: float = field(default=0.0, compare=False)

    def _brief(self) -> str:
        levels = ", ".join(map(str, self.thresholds))
        cells = f"{self.grid.width} x {self.grid.height} cells"
        return f"<SegmentedPhoto: {self.width} x {self.height} pixels, thresholds {levels}, {cells}>"

    @property
    def gap(self) -> float:
        """Share by which the score is below the optimum; 0 for the best thresholds there are."""
        return (self.optimum - self.score) / self.optimum if self.optimum > 0 else 0.0

    @property
    def counts(self) -> tuple[int, ...]:
        """Pixels of each class, from the darkest to the brightest."""
        bounds = (-1, *self.thresholds, LEVELS - 1)
        parts = zip(bounds[:-1], bounds[1:], strict=True)
        return tuple(int(self.histogram[a + 1 : b + 1].sum()) for a, b in parts)

    def ranges(self) -> tuple[tuple[int, int, int], ...]:
        """First level, last level and pixels of each class, from the darkest."""
        bounds = (-1, *self.thresholds, LEVELS - 1)
        return tuple((a + 1, b, n) for a, b, n in zip(bounds, bounds[1:], self.counts, strict=False))
