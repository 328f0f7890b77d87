"""SegmentedPhoto: a photograph that became a map."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.predicates import numbers
from lampyris._core.scalars import is_real, is_whole
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.model.grid import Grid, frozen
from lampyris.model.settings.photo import PhotoSettings

LEVELS = 256
"""Levels of grey."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SegmentedPhoto(Value):
    """A map made from a photograph, with the thresholds between the classes of its grey levels.

    Parameters
    ----------
    grid : the map.
    thresholds : in ascending order; class c holds the levels above threshold c - 1 up to threshold c.
    free : the classes that are free, 0 the darkest.
    score : score of the thresholds by the criterion: of ``otsu`` the variance between classes, of ``kapur`` the
        sum of entropies in nats, of ``cross-entropy`` its reduction compared with a single class, each per
        pixel.
    optimum : the greatest score of as many thresholds, by dynamic programming.
    histogram : int64 (256,), read-only; opaque pixels of each level, after the median filter.
    width, height : of the photograph, pixels.
    settings : how it was made.
    notes : sentences about how the photograph was read.
    seconds : CPU time of the search for thresholds.

    Raises
    ------
    SettingError : ``SEGMENTED_PHOTO``: a field of another kind.

    Examples
    --------
    >>> import lampyris
    >>> import numpy as np
    >>> image = np.repeat(np.array([[30, 220]], dtype=np.uint8), 20, axis=1).repeat(20, axis=0)
    >>> photo = lampyris.segment_photo(image, seed=1)
    >>> len(photo.thresholds), float(photo.grid.blocked.mean())
    (1, 0.5)
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

    def __post_init__(self) -> None:
        for name, kind in (("grid", Grid), ("settings", PhotoSettings)):
            self._demand(name, isinstance(getattr(self, name), kind), f"a {kind.__name__}")
        for name in ("thresholds", "free"):
            some: Any = getattr(self, name)
            right = isinstance(some, tuple | list) and all(is_whole(v, 0, LEVELS - 1) for v in some)
            self._demand(name, right and list(some) == sorted(some), "levels or classes, ascending")
            object.__setattr__(self, name, tuple(int(v) for v in some))
        for name in ("score", "optimum", "seconds"):
            self._demand(name, is_real(getattr(self, name)), "a finite number")
        for name in ("width", "height"):
            self._demand(name, is_whole(getattr(self, name), 1), "a whole number of pixels from 1")
        many = numbers(self.histogram, (LEVELS,))
        right = many is not None and bool(((many >= 0) & (many < (1 << 53)) & (many % 1 == 0)).all())
        self._demand("histogram", right, f"{LEVELS} whole numbers")
        object.__setattr__(self, "histogram", frozen(np.asarray(many).astype(np.int64)))
        notes: Any = self.notes
        self._demand(
            "notes", isinstance(notes, tuple | list) and all(isinstance(n, str) for n in notes), "text"
        )
        object.__setattr__(self, "notes", tuple(notes))

    def _demand(self, name: str, right: bool, allowed: str) -> None:
        if not right:
            raise SettingError("SEGMENTED_PHOTO", shown(getattr(self, name)), where=name, allowed=allowed)

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
        parts = itertools.pairwise(bounds)
        return tuple(int(self.histogram[a + 1 : b + 1].sum()) for a, b in parts)

    def ranges(self) -> tuple[tuple[int, int, int], ...]:
        """First level, last level and pixels of each class, from the darkest."""
        bounds = (-1, *self.thresholds, LEVELS - 1)
        return tuple((a + 1, b, n) for a, b, n in zip(bounds, bounds[1:], self.counts, strict=False))
