"""Nouns refuse what makes no sense, and never change."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

import lampyris
from lampyris.errors import InputError, LampyrisError, LimitError, SceneError, SettingError
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.trace import Outcome


def empty(height: int = 3, width: int = 4, **kw: object) -> lampyris.Grid:
    return lampyris.Grid(np.zeros((height, width), bool), **kw)  # type: ignore[arg-type]


def test_a_grid_copies_and_freezes_its_array() -> None:
    source = np.zeros((2, 3), bool)
    grid = lampyris.Grid(source)
    source[0, 0] = True
    assert not grid.blocked[0, 0]
    with pytest.raises(ValueError, match="read-only"):
        grid.blocked[0, 0] = True
    assert (grid.height, grid.width) == (2, 3)


@pytest.mark.parametrize(
    "bad", [np.zeros(3, bool), np.zeros((0, 3), bool), np.full((2, 2), 0.5), np.array([[0, 2]]), [["a"]]]
)
def test_a_grid_refuses_what_is_no_map(bad: object) -> None:
    with pytest.raises(SettingError, match="GRID_"):
        lampyris.Grid(bad)  # type: ignore[arg-type]


@pytest.mark.parametrize("resolution", [0, -1, math.nan, math.inf, 1e-300, "x"])
def test_a_grid_refuses_a_senseless_resolution(resolution: object) -> None:
    with pytest.raises(SettingError, match="MAP_RESOLUTION"):
        empty(resolution=resolution)


def test_cells_and_metres_meet_in_the_grid_with_yaw() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        grid = empty(
            int(rng.integers(1, 50)),
            int(rng.integers(1, 50)),
            resolution=float(rng.uniform(0.01, 2)),
            origin=tuple(rng.uniform(-10, 10, 3)),
        )
        cell = (int(rng.integers(grid.width)), int(rng.integers(grid.height)))
        x, y = grid.to_metres(cell)
        assert grid.to_cell(float(x), float(y)) == cell


def test_the_origin_is_the_lower_left_corner() -> None:
    grid = empty(3, 4, resolution=0.5, origin=(10.0, 20.0, 0.0))
    assert grid.to_metres((0, 2)).tolist() == [10.25, 20.25]
    turned = empty(3, 4, resolution=0.5, origin=(10.0, 20.0, math.pi / 2))
    np.testing.assert_allclose(turned.to_metres((0, 2)), [9.75, 20.25])


@pytest.mark.parametrize(
    ("start", "goal", "code"),
    [((-1, 0), (0, 0), "START_OUTSIDE"), ((0, 3), (0, 0), "START_OUTSIDE"), ((0, 0), (4, 0), "GOAL_OUTSIDE")],
)
def test_an_end_outside_the_map_raises(start: tuple[int, int], goal: tuple[int, int], code: str) -> None:
    with pytest.raises(SceneError, match=code) as caught:
        lampyris.Scene(empty(), start, goal)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("bad", [(1.5, 2), ("1", 2), (True, 2), (1,), (1, 2, 3), 7])
def test_an_end_is_two_whole_numbers(bad: object) -> None:
    with pytest.raises(SettingError, match="TYPE"):
        lampyris.Scene(empty(), bad, (0, 0))  # type: ignore[arg-type]


def test_stated_defaults() -> None:
    scene = lampyris.Scene(empty(), (0, 0), (1, 1))
    r = scene.robot
    assert (r.radius, r.v_max, r.a_max, r.d_max) == (0.0, 1.0, 0.5, 1.0)
    assert scene.grid.resolution == 1.0
    assert scene.moves.name == "octile"


@pytest.mark.parametrize("field", ["radius", "v_max", "a_max", "d_max"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, True, "1"])
def test_robot_limits_are_checked(field: str, value: object) -> None:
    with pytest.raises(SettingError, match=f"robot.{field}"):
        lampyris.Robot(**{field: value})  # type: ignore[arg-type]


def test_traffic_is_checked() -> None:
    with pytest.raises(LimitError):
        lampyris.RandomWalk(count=10_001)
    with pytest.raises(SettingError, match="TRAFFIC_COUNT"):
        lampyris.RandomWalk(count=-1)
    with pytest.raises(SettingError, match="TRAFFIC_RATE"):
        lampyris.RandomWalk(count=1, rate=0.0)
    with pytest.raises(SettingError, match="OBSTACLE_SPEED"):
        lampyris.Recorded(((0, 0), (2, 0)))
    with pytest.raises(SettingError, match="OBSTACLE_TIME"):
        lampyris.Recorded(())
    with pytest.raises(SceneError, match="OBSTACLE_TRACK"):
        lampyris.Scene(empty(), (0, 0), (1, 1), traffic=lampyris.Patrol(((0, 0), (9, 0))))  # type: ignore[arg-type]


def test_a_path_counts_its_steps() -> None:
    path = path_of(np.array([(0, 0), (1, 1), (2, 1), (2, 0)], dtype=np.int32), lampyris.MOVES["octile"])
    assert path.steps == (2, 1)
    assert path.cost == 2 + math.sqrt(2)
    assert path.arc.tolist() == [0, math.sqrt(2), math.sqrt(2) + 1, math.sqrt(2) + 2]
    np.testing.assert_allclose(path.heading, [-math.pi / 4, 0, math.pi / 2, math.pi / 2])


def test_only_found_and_arrived_are_true() -> None:
    assert [bool(s) for s in Status].count(True) == 1
    assert [bool(o) for o in Outcome].count(True) == 1
    assert Status.NO_PATH == "no-path"
    for word in (*Status, *Outcome):
        assert word.sentence.endswith(".")
    with pytest.raises(ValueError, match="exactly when"):
        Plan(Status.FOUND, "x")


def test_errors_read_as_one_sentence_and_survive_pickling() -> None:
    error = InputError("CODE", "what", where="a.map:3", allowed="this", todo="do that")
    assert str(error) == "error[CODE]: a.map:3: what; allowed: this; do that"
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is InputError
    assert str(again) == str(error)
    assert {c.exit_code for c in (InputError, LimitError)} == {3, 5}
    assert issubclass(SceneError, LampyrisError)
