"""Connected cells by fronts, judged by labels of regions."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import ndimage

from lampyris.planning.field import connected


@pytest.mark.parametrize("corners", [True, False])
@pytest.mark.parametrize("fronts", [connected.FRONTS, 0])
def test_cells_are_connected_where_labels_are_equal(
    corners: bool, fronts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connected, "FRONTS", fronts)
    if fronts:  # these maps need no labels
        monkeypatch.delitem(sys.modules, "scipy.ndimage")
        monkeypatch.setitem(sys.modules, "scipy", SimpleNamespace())
    rng, said = np.random.default_rng(7), {True: 0, False: 0}
    for _ in range(60):
        height, width = rng.integers(2, 14, 2).tolist()
        free = np.pad(rng.random((height, width)) > 0.4, 2)
        labels = ndimage.label(free, np.ones((3, 3)) if corners else None)[0].ravel()
        cells = np.flatnonzero(free)
        for a, b in rng.choice(cells, (8, 2)).tolist() if cells.size else []:
            same = bool(labels[a] == labels[b])
            said[same] += 1
            flat = free.astype(np.uint8).ravel()
            assert connected.are_connected(flat, width + 4, a, b, corners=corners) == same
    assert min(said.values()) > 50


def test_where_scipy_is_imported_no_front_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fronts that came to nothing took 5 ms of each query on maze512-32-0."""
    monkeypatch.setattr(connected, "_by_fronts", None)
    free = np.pad(np.ones((2, 5), dtype=np.uint8), 1).ravel()
    assert connected.are_connected(free, 7, 8, 19, corners=False)
