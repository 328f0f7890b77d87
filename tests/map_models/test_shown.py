"""Models of the map in pictures, JSON and on the terminal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris.report.data.serialize import model_record
from lampyris.report.pictures.plan_picture import draw_plan


@pytest.mark.parametrize("planner", ["visibility-graph", "polyanya", "voronoi", "quadtree"])
def test_a_model_is_drawn_and_written(planner: str, tmp_path: Path) -> None:
    walls = np.zeros((14, 14), dtype=bool)
    walls[3:9, 6] = walls[11, 2:9] = True
    grid = lampyris.Grid(walls)
    plan = lampyris.plan(lampyris.Scene(grid, (1, 6), (12, 12)), planner)
    assert plan.map_model is not None
    for name, shown in (("a", plan), ("b", plan), ("without", replace(plan, map_model=None))):
        draw_plan(grid, shown, out=tmp_path / f"{name}.svg")
    a, b, without = ((tmp_path / f"{name}.svg").read_bytes() for name in ("a", "b", "without"))
    assert a == b
    assert len(a) > len(without)
    record = model_record(plan, plan.map_model)
    assert record["kind"] == planner
    assert min(record["counts"].values()) > 0
    known = {"voronoi": "clearance", "quadtree": "any_angle_length"}.get(planner, "bound")
    assert record[known] > 0
    assert lampyris.Plan.from_dict(plan.to_dict()) == plan
    assert planner in plan._repr_html_()  # type: ignore[operator]
