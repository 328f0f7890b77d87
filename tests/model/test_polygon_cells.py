"""Static polygons on a map: no covered cell stays open, and none that is not covered is taken."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

import lampyris
from lampyris.errors import SettingError
from sizes import sized


@sized("cases", 150, 20_000)
def test_cells_are_those_that_shapely_overlaps(cases: int) -> None:
    rng, judged = np.random.default_rng(4), 0
    y, x = np.mgrid[0:12, 0:15]
    squares = shapely.box(x - 0.5, y - 0.5, x + 0.5, y + 0.5)
    for k in range(cases):
        yaw = float(rng.choice([0.0, 0.3, -2.0]))
        grid = lampyris.Grid(np.zeros((12, 15), dtype=bool), resolution=0.5, origin=(1.0, 2.0, yaw))
        n = int(rng.integers(3, 10))
        angle, far = np.sort(rng.uniform(0.0, 2 * math.pi, n)), rng.uniform(0.2, 4.0, n)
        centre = rng.uniform((1.0, 2.0), (8.0, 9.0))
        vertices = centre + np.column_stack((far * np.cos(angle), far * np.sin(angle)))
        if k % 2:
            vertices = np.round(vertices * 2) / 2  # on the lines between cells
        try:
            cells = grid.polygon_cells(vertices)
        except SettingError:
            continue
        polygon = shapely.Polygon(grid.to_points(*vertices.T))
        covered = np.zeros((12, 15), dtype=bool)
        covered[cells[:, 1], cells[:, 0]] = True
        assert len(cells) == covered.sum()
        assert cells.dtype == np.int32
        assert np.array_equal(covered, shapely.area(shapely.intersection(polygon, squares)) > 1e-12)
        judged += 1
    assert judged > cases // 2


def test_what_lies_outside_the_map_is_left_out() -> None:
    grid = lampyris.Grid(np.zeros((3, 4), dtype=bool))
    assert len(grid.polygon_cells([(-5, -5), (-4, -5), (-4, -4)])) == 0
    assert len(grid.polygon_cells([(-50, -50), (100, -50), (100, 100), (-50, 100)])) == 12
    assert grid.polygon_cells([(3.5, -2), (9, -2), (9, 0.5), (3.5, 0.5)]).tolist() == [[3, 2]]


@pytest.mark.parametrize(
    "vertices",
    [
        [(0, 0), (1, 1)], [(0, 0), (1, 1), (1, 0), (0, 1)], [(0, 0), (0, 0), (1, 1)], "box", [(0, math.nan)] * 3,
        [(0, 2e9), (1, 0), (0, 1)],
    ],
)  # fmt: skip
def test_what_is_no_polygon_is_refused(vertices: object) -> None:
    with pytest.raises(SettingError, match="POLYGON"):
        lampyris.Grid(np.zeros((3, 4), dtype=bool)).polygon_cells(vertices)  # type: ignore[arg-type]
