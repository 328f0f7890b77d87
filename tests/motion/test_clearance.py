"""Distance from any point to the walls: against every wall in turn, in both forms of the kernel."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris import Grid
from lampyris.errors import SettingError
from lampyris.motion.geometry import clearance
from lampyris.motion.geometry.clearance import wall_distance
from reference.kernel_forms import use


def by_every_wall(points: np.ndarray, grid: Grid, reach: float) -> np.ndarray:
    """The same, wall by wall."""
    ys, xs = np.nonzero(grid.blocked)
    if len(xs) == 0:
        return np.full(len(points), np.inf)
    gx = np.maximum(np.abs(points[:, :1] - xs) - 0.5, 0.0)
    gy = np.maximum(np.abs(points[:, 1:] - ys) - 0.5, 0.0)
    far = np.sqrt((gx * gx + gy * gy).min(axis=1)) * grid.resolution
    return np.where(far <= reach, far, np.inf)


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_against_every_wall(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    monkeypatch.setattr(clearance, "_BOX", 900)
    rng = np.random.default_rng(5)
    for trial in range(120):
        height, width = rng.integers(1, 180, 2)
        blocked = rng.random((height, width)) < rng.choice([0, 0.001, 0.01, 0.1, 0.5])
        grid = Grid(blocked, resolution=1.0 if trial % 2 else 0.05)
        # On the map and a little off it; every other time on centres, edges and corners of cells.
        points = rng.uniform((-1, -1), (width, height), (50, 2))
        if trial % 4 < 2:
            points = np.round(points * 2) / 2
        reach = float(rng.choice([0, 0.5, 1.5, 3, 20, 90, np.inf])) * grid.resolution
        np.testing.assert_allclose(
            wall_distance(points, grid, reach), by_every_wall(points, grid, reach), rtol=1e-12, atol=0
        )


def test_both_forms_give_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    said = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        rng = np.random.default_rng(6)
        grid = Grid(rng.random((140, 150)) < 0.01)
        said[form] = wall_distance(rng.uniform(0, 139, (200, 2)), grid, 12.0).tobytes()
    assert said["plain"] == said["compiled"]


def test_edges() -> None:
    grid = Grid(np.array([[0, 0, 1]], dtype=bool), resolution=2.0)
    points = np.array([(0.0, 0.0), (1.5, 0.0), (1.7, 0.4), (2.0, 0.0)])
    assert wall_distance(points, grid, 3.0).tolist() == [3.0, 0.0, 0.0, 0.0]
    # A wall at the very reach is within it; a hair less, and it is not.
    assert wall_distance(points[:1], grid, math.nextafter(3.0, 0.0)).tolist() == [math.inf]
    assert wall_distance(np.zeros((0, 2)), grid, 1.0).shape == (0,)
    for wrong in (np.zeros(3), np.zeros((2, 3)), np.array([(math.nan, 0.0)])):
        with pytest.raises(SettingError, match="PATH_POINTS"):
            wall_distance(wrong, grid, 1.0)
    for reach in (-1.0, math.nan):
        with pytest.raises(SettingError, match="REACH"):
            wall_distance(points, grid, reach)
