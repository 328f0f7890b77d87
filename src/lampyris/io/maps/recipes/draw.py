"""Draws that stay the same forever: whole numbers straight from PCG64's raw stream.

NumPy promises the raw stream of a bit generator and of SeedSequence, but not that of ``Generator.integers``
or ``Generator.choice`` from one release to the next (NEP 19). A map that is published by its seed must not
depend on that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.scalars import MAX_SEED, SEED_RANGE
from lampyris.errors import SettingError
from lampyris.typing import FloatGrid

T = TypeVar("T")


class Draw:
    """A stream of draws from one seed.

    Parameters
    ----------
    seed : whole number, 0 to 2^63 - 1.

    Raises
    ------
    SettingError : a seed out of that range.
    """

    def __init__(self, seed: int) -> None:
        if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed <= MAX_SEED:
            raise SettingError.of("SEED", "seed", repr(seed), allowed=SEED_RANGE)
        self._bits = np.random.PCG64(np.random.SeedSequence(seed))

    def below(self, n: int) -> int:
        """A whole number 0 <= k < n, n at most 2^32; some are likelier than others by n / 2^32."""
        return ((int(self._bits.random_raw()) >> 32) * n) >> 32

    def between(self, low: int, high: int) -> int:
        """A whole number low <= k <= high."""
        return low + self.below(high - low + 1)

    def unit(self) -> float:
        """A number 0 <= u < 1 with 53 random bits."""
        return (int(self._bits.random_raw()) >> 11) / 2**53

    def pick(self, items: Sequence[T]) -> T:
        """One of the items, each as likely."""
        return items[self.below(len(items))]

    def raw(self, count: int) -> NDArray[np.uint64]:
        """So many raw draws of 64 bits."""
        return np.asarray(self._bits.random_raw(count), dtype=np.uint64)

    def belows(self, n: NDArray[np.int64]) -> NDArray[np.int64]:
        """Whole numbers 0 <= k < n, one for each n (1 to 2^31 each), in order: :meth:`below` for arrays."""
        product = (self.raw(n.size) >> np.uint64(32)) * n.ravel().astype(np.uint64)
        return (product >> np.uint64(32)).astype(np.int64).reshape(n.shape)

    def units(self, height: int, width: int) -> FloatGrid:
        """Numbers 0 <= u < 1, shape (height, width), drawn row by row."""
        raw = self.raw(height * width).reshape(height, width)
        return (raw >> np.uint64(11)).astype(np.float64) / 2**53
