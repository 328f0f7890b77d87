"""Ways and movers from files: what is read, in which frame, and what is refused at which line."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import LampyrisError, UsageError
from lampyris.io import paths as way_file
from lampyris.io.paths import read_path_points
from lampyris.io.tracks.obstacle_states import read_obstacle_states
from lampyris.model.grid import Grid
from lampyris_selfcheck.reference.files.map_files import put

GRID = Grid(np.zeros((30, 40), bool), resolution=0.05, origin=(-1.5, 2.25, 0.0))
TURNED = Grid(np.zeros((30, 40), bool), resolution=0.05, origin=(-1.5, 2.25, 0.7))


def pose(x: object, y: object) -> dict[str, object]:
    return {"header": {"frame_id": ""}, "pose": {"position": {"x": x, "y": y, "z": 0.0}}}


PATH = {"header": {"frame_id": "map"}, "poses": [pose(1.0, 2), pose(1.5, -2.5)]}
ECHO = """header:
  stamp:
    sec: 12
    nanosec: 34
  frame_id: odom
poses:
- header:
    stamp:
      sec: 0
      nanosec: 0
    frame_id: map
  pose:
    position:
      x: 1.0
      y: 2.0
      z: 0.0
    orientation:
      x: 0.0
      y: 0.0
      z: 0.0
      w: 1.0
- pose:
    position: {x: 1.5, y: -2.5, z: 0.0}
---
"""


@pytest.mark.parametrize(
    ("name", "text", "columns"),
    [
        ("a.csv", "x_m,y_m\n1,2\n1.5,-2.5\n", ("x_m", "y_m")),
        ("a.csv", "yaw,x_m,y_m,cause\n0,1,2,limit\n0,1.5,-2.5,goal\n", ("yaw", "x_m", "y_m", "cause")),
        ("a.csv", "\ufeffx;y\r\n1;2\r\n\r\n1.5;-25e-1\r\n", ("x", "y")),
        ("a.txt", "# made by hand, 2026\n# x y z\n1 2 0\n# between\n  1.5   -2.5 0\n", ("x", "y", "z")),
        ("a.tsv", "x\ty\n1\t2\n1.5\t-2.5", ("x", "y")),
        ("a", "1,2\n1.5,-2.5", ()),
        ("a.csv", '"x","y"\n"1","2"\n"1.5","-2.5"\n', ("x", "y")),
        ("a.json", json.dumps(PATH), ()),
        ("no-ending", "\ufeff " + json.dumps({"op": "publish", "msg": PATH}), ()),
        ("a.json", json.dumps({"poses": [p["pose"] for p in PATH["poses"]]}), ()),  # type: ignore[index]
        ("a.yaml", ECHO, ()),
        ("a.yml", ECHO.removesuffix("---\n"), ()),
    ],
)
def test_each_kind_of_file_is_the_same_way(
    tmp_path: Path, name: str, text: str, columns: tuple[str, ...]
) -> None:
    way = read_path_points(put(tmp_path, text.encode(), name))
    assert way.points.tolist() == [[1.0, 2.0], [1.5, -2.5]]
    assert (way.frame, way.columns) == ("metres", columns)
    assert ("frame 'odom'" in "".join(way.notes)) == ("odom" in text)
    for grid in (GRID, TURNED):
        there = way.on(grid)
        x, y = grid.to_metres(there).T
        assert np.allclose(np.stack((x, y), axis=-1), way.points, atol=1e-12)


def test_units_are_asked_only_where_the_file_does_not_say(tmp_path: Path) -> None:
    both = put(tmp_path, b"x_m,y_m,x,y\n0.5,0.5,3,4\n", "a.csv")
    plain = put(tmp_path, b"x,y\n3,4\n", "b.csv")
    ros = put(tmp_path, json.dumps(PATH).encode(), "c.json")
    assert (read_path_points(both).points.tolist(), read_path_points(both, "metres").frame) == (
        [[0.5, 0.5]],
        "metres",
    )
    assert (read_path_points(both, "cells").points.tolist(), read_path_points(both, "cells").frame) == (
        [[3, 4]],
        "cells",
    )
    assert [read_path_points(plain, u).frame for u in (None, "metres", "cells")] == [
        "metres",
        "metres",
        "cells",
    ]
    assert read_path_points(ros, "cells").frame == "metres"
    assert read_path_points(plain, "cells").on(GRID).tolist() == [[3, 4]]
    with pytest.raises(UsageError, match="metres or cells"):
        read_path_points(plain, "miles")


@pytest.mark.parametrize("grid", [GRID, TURNED], ids=["straight", "turned"])
def test_metres_of_cells_come_back_as_those_cells(grid: Grid, tmp_path: Path) -> None:
    """To the bit: a way between two walls that touch at a corner must not cut through one."""
    ys, xs = np.indices((30, 40))
    cells = np.stack((xs.ravel(), ys.ravel()), axis=-1)
    rows = "\n".join(f"{x!r},{y!r}" for x, y in grid.to_metres(cells).tolist())
    way = read_path_points(put(tmp_path, f"x_m,y_m\n{rows}\n".encode()))
    assert (way.on(grid) == cells).all()
    raw = grid.to_points(way.points[:, 0], way.points[:, 1])
    assert np.abs(raw - cells).max() < 1e-12
    assert (raw != cells).any(), "or there is nothing to repair"


def test_a_point_between_cells_stays_where_it_is_and_a_repeated_one_is_left_out() -> None:
    way = way_file.PathPoints(np.array([[1.25, 2.0], [1.25, 2.0], [2.0, 2.00001], [1.25, 2.0]]), "cells")
    assert way.on(GRID).tolist() == [[1.25, 2.0], [2.0, 2.00001], [1.25, 2.0]]
    centre = GRID.to_points(-1.5 + 0.5 * 0.05, 2.25 + 0.5 * 0.05)
    assert centre == pytest.approx((0, 29), abs=1e-12)


def test_a_plan_of_ours_is_read_back_as_its_cells_and_only_on_its_own_map(tmp_path: Path) -> None:
    import lampyris
    from lampyris.report.data.csv import write_plan_csv
    from lampyris.report.data.serialize import plan_record

    grid = lampyris.load_grid("guide")
    scene = lampyris.Scene(grid, (0, 9), (7, 0), moves="dissertation")
    plan = lampyris.plan(scene)
    assert plan.cells is not None
    profile = lampyris.speed_profile(scene, plan)
    (tmp_path / "p.json").write_text(json.dumps(plan_record(plan, scene, profile)))
    write_plan_csv(tmp_path / "p.csv", plan, profile, grid)
    for name in ("p.json", "p.csv"):
        assert (read_path_points(tmp_path / name).on(grid) == plan.cells).all()
    with pytest.raises(
        LampyrisError, match=r"PATH_MAP.*p\.json.*10 x 10 cells of 1 m.*40 x 30 cells of 0\.05"
    ):
        read_path_points(tmp_path / "p.json").on(GRID)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.csv", "", "a.csv: no row"),
        ("a.csv", "x,y\n", "a.csv: no row"),
        ("a.csv", "x,z\n1,2\n", "a.csv:1: no column y; allowed: columns x and y"),
        ("a.csv", "x,x,y\n1,2,3\n", "a.csv:1: more than one column x"),
        ("a.csv", "x,y\n1,2\n\n1\n", "a.csv:4: y is missing; allowed: a number from -1e+09 to 1e+09"),
        ("a.csv", "x,y\n1,b\n", "a.csv:2: y is 'b'"),
        ("a.csv", "x,y\nnan,1\n", "a.csv:2: x is 'nan'"),
        ("a.csv", "x,y\n1e10,1\n", "a.csv:2: x is '1e10'"),
        ("a.csv", "x,y\n1_0,1\n", "a.csv:2: x is '1_0'"),
        ("a.csv", "x;y\n1,5;2\n", "a.csv:2: x is '1,5'; allowed: a number from -1e+09 to 1e+09; write"),
        ("a.csv", 'x,y\n"1,2\n', "a.csv:2: unexpected end of data"),
        ("a.csv", b"x,y\n1,\xff\n", "a.csv:2: byte 0xff is not UTF-8"),
        ("a.csv", "5\n6\n", "a.csv:1: field 2 is missing"),
        ("a.json", "[]", "a.json:1:1: a list"),
        ("a.json", "{}", "a.json:1:1: an empty object; allowed: a nav_msgs/Path"),
        ("a.json", '{"a": 1}', "an object with 'a'"),
        ("a.json", '{"poses": []}', "a.json:1:11: a path without poses"),
        ("a.json", '{"poses": [3]}', "a.json:1:12: pose 0 has no pose"),
        ("a.json", '{"poses": [{"pose": {}}]}', "a.json:1:21: pose 0 has no position"),
        ("a.json", '{"poses": [{"pose": {"position": {"x": 1}}}]}', "y is missing"),
        ("a.json", '{"poses": [{"position": {"x": "1", "y": 2}}]}', "a.json:1:31: x is '1'"),
        ("a.json", '{"poses": [{"position": {"x": true, "y": 2}}]}', "x is True"),
        ("a.json", '{"planner": "x", "cells": null}', "a.json:1:27: a plan that found no path"),
        ("a.json", '{"planner": "x", "cells": [[1]]}', "a.json:1:28: [1]; allowed: a cell [x, y]"),
        ("a.json", '{"planner": "x", "cells": 3}', "a.json:1:27: 3; allowed: a list of cells"),
        ("a.yaml", "poses:\n- pose:\n    position: {x: .nan, y: 1}\n", "a.yaml:3:19: x is nan"),
        ("a.yaml", "poses: &a\n- 1\n", "a.yaml:1:"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str | bytes, says: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(LampyrisError) as caught:
        read_path_points(name)
    assert caught.value.exit_code == 3
    assert says in str(caught.value), str(caught.value)


# ---- movers ----


def test_movers_are_seen_in_the_frame_of_the_map(tmp_path: Path) -> None:
    head = "id,x_m,y_m,radius,top_speed,vx,vy\n"
    file = put(tmp_path, (head + "7,-1.475,2.275,0.3,1.2,1,0.5\n8,0,3,0,0,0,0\n").encode())
    m = read_obstacle_states(file, GRID)
    assert len(m) == 2
    assert m.xy[0] == pytest.approx((0, 29))
    assert (m.radius.tolist(), m.top_speed.tolist()) == ([0.3, 0.0], [1.2, 0.0])
    assert m.velocity is not None
    assert m.velocity[0] == pytest.approx((1, -0.5)), "y is down on the grid"
    turned = read_obstacle_states(file, TURNED)
    assert turned.velocity is not None
    # A step of it in metres is the same step on the grid.
    step = TURNED.to_metres(turned.xy[0] + turned.velocity[0] / TURNED.resolution)
    assert step - TURNED.to_metres(turned.xy[0]) == pytest.approx((1, 0.5))
    none = read_obstacle_states(put(tmp_path, b"x_m,y_m,radius,top_speed\n"), GRID)
    assert (len(none), none.velocity) == (0, None)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1,2,3,4\n", "no header; allowed: a first line with the columns x_m, y_m, radius, top_speed"),
        ("x_m,y_m,radius\n1,2,3\n", ":1: no column top_speed"),
        ("x_m,y_m,radius,top_speed\n1,2,-3,4\n", ":2: radius is '-3'; allowed: a number from 0"),
        ("x_m,y_m,radius,top_speed,vx\n1,2,3,4,5\n", ":1: no column vy"),
        ("x_m,y_m,radius,top_speed,vx,vy\n1,2,3,4,3,3\n", ":2: a velocity of 4.24264 m/s; allowed: at most"),
    ],
)
def test_movers_that_cannot_be(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(LampyrisError, match="OBSTACLE_STATES_FILE") as caught:
        read_obstacle_states(put(tmp_path, text.encode()), GRID)
    assert says in str(caught.value)
    assert math.isfinite(GRID.resolution)
