"""A list in the place of a kernel's scratch array that writes down the order of its changes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_NS = 2_000_000_000
"""Nanoseconds of the plain form, about, that an order of expansion may take."""


class Writes(list[Any]):
    """A list that writes down which of its values are changed, for the plain form of a kernel.

    Parameters
    ----------
    values : what it holds at first.
    to : only changes to this value are written down; None: every write.
    """

    def __init__(self, values: Iterable[Any], to: int | None = None) -> None:
        super().__init__(values)
        self.to = to
        self.changed: list[int] = []

    def __setitem__(self, k: Any, value: Any) -> None:
        if type(k) is not slice and (self.to is None or (value == self.to and self[k] != value)):
            self.changed.append(int(k))
        super().__setitem__(k, value)

    def order(self) -> NDArray[np.int64]:
        """Indices of what was changed, first come first."""
        return np.array(self.changed, dtype=np.int64)
