"""Ends of a scene, in cells or in metres of the map frame."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import SceneError, SettingError

GRID = lampyris.Grid(np.zeros((4, 6), bool), resolution=0.5, origin=(-1.0, 2.0, 0.0))


def test_ends_in_metres_are_the_cells_that_hold_them() -> None:
    scene = lampyris.Scene(GRID, start_m=(-0.9, 2.1), goal_m=(1.99, 3.99))
    assert (scene.start, scene.goal) == ((0, 3), (5, 0))
    assert scene.start_m == (-0.75, 2.25)
    assert scene.goal_m == (1.75, 3.75)
    assert scene == lampyris.Scene(GRID, (0, 3), (5, 0))
    mixed = lampyris.Scene(GRID, start=(0, 3), goal_m=np.array([1.75, 3.75]))
    assert mixed == scene


def test_metres_of_a_turned_map() -> None:
    grid = dataclasses.replace(GRID, origin=(1.0, 1.0, math.pi / 2))
    for cell in ((0, 0), (5, 3), (2, 1)):
        x, y = grid.to_metres(cell).tolist()
        assert lampyris.Scene(grid, (0, 0), goal_m=(x, y)).goal == cell


def test_a_changed_scene_keeps_its_ends() -> None:
    scene = lampyris.Scene(GRID, start_m=(-0.9, 2.1), goal_m=(1.99, 3.99))
    assert dataclasses.replace(scene, robot=lampyris.Robot(radius=0.1)).start == scene.start
    assert lampyris.Scene.from_dict(scene.to_dict()) == scene


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (
            {"start": (0, 0)},
            "ENDS.*goal is given neither in cells nor in metres; allowed: one of goal .cell., goal_m",
        ),
        ({"start": None, "goal": (1, 1)}, "ENDS.*start is given neither in cells nor in metres"),
        ({"start": (0, 0), "start_m": (0.0, 2.5), "goal": (1, 1)}, "ENDS.*start is given more than once"),
        ({"start_m": (0.0,), "goal": (1, 1)}, "TYPE.*start_m.*metres"),
        ({"start_m": (math.nan, 2.5), "goal": (1, 1)}, "TYPE.*start_m.*metres"),
        ({"start_m": "ab", "goal": (1, 1)}, "TYPE.*start_m.*metres"),
    ],
)
def test_wrong_ends_are_refused_by_name(given: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingError, match=says):
        lampyris.Scene(GRID, **given)
    with pytest.raises(ValueError, match=says):  # as Python has it
        lampyris.Scene(GRID, **given)


def test_metres_off_the_map_are_off_the_map() -> None:
    with pytest.raises(SceneError, match="GOAL_OUTSIDE"):
        lampyris.Scene(GRID, (0, 0), goal_m=(5.0, 2.5))
