"""What no map, curve, profile or patrol can be is refused when it is made, by name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import SettingError
from lampyris.model.curve import Curve
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.profile import Profile
from lampyris.model.traffic import Patrol

FREE = np.zeros((3, 4), bool)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ({"unknown": np.zeros((4, 3), bool)}, "GRID_SHAPE"),
        ({"terrain": np.zeros((4, 3), np.uint8)}, "GRID_SHAPE"),
        ({"terrain": np.zeros((3, 4))}, "GRID_TYPE"),
    ],
)
def test_a_grid_of_two_sizes_or_of_fractions(words: dict[str, Any], code: str) -> None:
    with pytest.raises(SettingError) as caught:
        lampyris.Grid(FREE, **words)
    assert caught.value.code == code


@pytest.mark.parametrize("point", [(math.nan, 0.0), (0.0, math.inf), (1e308, -1e308)])
def test_a_point_that_is_nowhere(point: tuple[float, float]) -> None:
    grid = lampyris.Grid(FREE, resolution=1e-6)
    with pytest.raises(SettingError) as caught:
        grid.to_cell(*point)
    assert caught.value.code == "POINT"


def test_a_patrol_without_waypoints() -> None:
    with pytest.raises(SettingError) as caught:
        Patrol(())
    assert caught.value.code == "TRAFFIC_WAYPOINTS"


@pytest.mark.parametrize("name", "svat")
@pytest.mark.parametrize("values", [[0.0], [0.0, math.nan]])
def test_a_profile_of_other_length_or_not_finite(name: str, values: list[float]) -> None:
    words: dict[str, Any] = {**{key: [0.0, 1.0] for key in "svat"}, name: values}
    with pytest.raises(SettingError, match=rf"profile\.{name}: .*; allowed: finite numbers of shape \(2,\)"):
        Profile("physical", **words, cause=("limit", "approach"), units="m/s")


@pytest.mark.parametrize("words", [{"cause_index": [0]}, {"caps": (("limit", [1.0]),)}])
def test_a_profile_whose_causes_do_not_go_with_it(words: dict[str, Any]) -> None:
    zero = np.zeros(2)
    with pytest.raises(SettingError, match=r"profile\.(cause_index: .* shape \(2,\)|caps: .* 2 numbers)"):
        Profile("physical", zero, zero, zero, zero, ("limit", "approach"), "m/s", **words)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"curvature": [math.inf]}, r"curve\.curvature: .*; allowed: finite"),
        ({"heading": [[1.0]]}, r"curve\.heading: .*; allowed: finite numbers of shape \(1, 2\)"),
        ({"lengths": [0.0]}, r"curve\.lengths: .*; allowed: numbers > 0"),
    ],
)
def test_a_curve_with_a_piece_that_is_none(change: dict[str, Any], what: str) -> None:
    words: dict[str, Any] = {
        "xy": [[0.0, 0.0]], "heading": [[1.0, 0.0]], "lengths": [1.0], "curvature": [0.0],
        "end": (1.0, 0.0), "resolution": 1.0,
    }  # fmt: skip
    assert Curve(**words).begins.tolist() == [0.0, 1.0]
    with pytest.raises(SettingError, match=what):
        Curve(**{**words, **change})


def test_a_path_of_one_cell_has_a_heading() -> None:
    path = path_of(np.array([[2, 1]], dtype=np.int32), MOVES["octile"])
    assert path.heading.tolist() == [0.0]
