"""Pairs of points that are near each other, as ``scipy.spatial.cKDTree.query_pairs`` finds them."""

from __future__ import annotations

from typing import Any

import numpy as np

_ENTRIES = 1_000_000
"""Distances that are held at once."""


class cKDTree:
    """Points of which pairs are asked; each is compared with each.

    Parameters
    ----------
    data : (n, dimensions).
    """

    def __init__(self, data: Any) -> None:
        self.data = np.asarray(data, dtype=np.float64)

    def query_pairs(self, r: float, output_type: str = "set") -> Any:
        """Pairs (i, j), i < j, at most ``r`` apart: an integer array (pairs, 2).

        Parameters
        ----------
        r : distance. output_type : "ndarray"; no other is offered here.
        """
        if output_type != "ndarray":
            raise NotImplementedError("an array of pairs")
        n = len(self.data)
        found = [np.zeros((0, 2), dtype=np.intp)]
        each = max(1, _ENTRIES // max(1, n))
        for begin in range(0, n, each):
            apart = self.data[begin : begin + each, None] - self.data[None]
            near = (apart * apart).sum(axis=2) <= r * r
            one, other = np.nonzero(near)
            one += begin
            found.append(np.stack((one, other), axis=1)[one < other])
        return np.concatenate(found)
