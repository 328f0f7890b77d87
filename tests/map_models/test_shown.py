"""Models of the map in pictures, JSON and on the terminal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris.report.data.serialize import model_record, plan_record
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


@pytest.mark.parametrize("planner", ["theta-star", "polyanya", "rrt", "bit-star", "astar"])
def test_the_lines_of_a_plan_are_written(planner: str) -> None:
    """Whether the planner has a model of the map or not; a planner by steps has no lines."""
    walls = np.zeros((14, 14), dtype=bool)
    walls[3:9, 6] = walls[11, 2:9] = True
    scene = lampyris.Scene(lampyris.Grid(walls), (1, 6), (12, 12))
    plan = lampyris.plan(scene, planner)
    record = plan_record(plan, scene, None)
    if planner == "astar":
        assert "waypoints" not in record
        return
    ends = np.array(record["waypoints"])
    assert (ends[0].tolist(), ends[-1].tolist()) == ([1, 6], [12, 12])
    assert record["any_angle_length"] == pytest.approx(np.hypot(*np.diff(ends, axis=0).T).sum())
