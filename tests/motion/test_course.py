"""Courses: nodes on curves and on paths of cells."""

from __future__ import annotations

import math

import numpy as np
import pytest
from curve_ways import cases

from lampyris import Robot
from lampyris.errors import SettingError
from lampyris.model.curve import Curve
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.motion.geometry.curve import curve_of
from lampyris.motion.geometry.sampled_path import sample_curve, sample_path


def curves(count: int, seed: int) -> list[Curve]:
    out = []
    for case in cases(count, seed):
        try:
            out.append(curve_of(case.points, case.grid, case.robot, **case.how))
        except SettingError:
            continue
    return out


def test_nodes_of_random_curves() -> None:
    stops = 0
    for number, curve in enumerate(curves(150, seed=6)):
        spacing = (0.07, 0.9, 40.0)[number % 3]
        course = sample_curve(curve, spacing)
        n = len(course)
        assert course.s[0] == 0.0
        assert course.s[-1] == curve.length
        step = np.diff(course.s)
        assert (step > 0).all()
        assert (step <= spacing * (1 + 1e-12)).all()
        # Every border of two pieces is a node, and what is said of the nodes is what the curve says.
        at = np.searchsorted(course.s, curve.begins)
        assert (course.s[at] == curve.begins).all()
        xy, heading = curve.at(course.s)
        assert (course.xy == xy).all()
        assert (course.heading == heading).all()
        assert tuple(course.xy[-1]) == curve.end
        # Curvature: of the pieces on either side the sharper.
        piece = np.clip(np.searchsorted(curve.begins, course.s, side="right") - 1, 0, len(curve.lengths) - 1)
        before = np.clip(np.searchsorted(curve.begins, course.s, side="left") - 1, 0, None)
        if n > 1:
            sharper = np.maximum(np.abs(curve.curvature[piece]), np.abs(curve.curvature[before]))
            assert (course.curvature == sharper).all()
        # Stops: where the curve says, with a node between any two places at which the robot stands.
        assert sorted(np.flatnonzero(course.stop)) == sorted(at[curve.stops])
        stand = [0, *np.flatnonzero(course.stop), n - 1]
        assert n == 1 or min(np.diff(stand)) >= 2
        stops += len(curve.stops)
    assert stops > 30


def test_a_piece_between_two_stands_has_a_node() -> None:
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    case = cases(1, seed=1)[0]
    grid = type(case.grid)(np.zeros((3, 3), dtype=bool))
    curve = curve_of(square, grid, Robot(turn_radius=5.0), shortcut=False)
    course = sample_curve(curve, 100.0)
    np.testing.assert_allclose(course.s, [0, 0.5, 1, 1.5, 2, 2.5, 3])
    assert course.stop.tolist() == [False, False, True, False, True, False, False]
    assert len(sample_curve(curve_of(square[:1], grid, Robot()), 1.0)) == 1


def test_an_arc_is_divided_evenly() -> None:
    bend = Curve(
        np.zeros((1, 2)), np.array([(1.0, 0.0)]), np.array([math.pi / 2]), np.ones(1), (1.0, 1.0), 1.0
    )  # fmt: skip
    course = sample_curve(bend, math.pi / 6 + 1e-12)
    np.testing.assert_allclose(np.diff(course.s), math.pi / 6)
    third = math.pi / 6
    np.testing.assert_allclose(course.xy[1], (math.sin(third), 1 - math.cos(third)), rtol=1e-15)
    np.testing.assert_allclose(course.heading[1], (math.cos(third), math.sin(third)), rtol=1e-15)
    assert course.curvature.tolist() == [1.0] * 4


@pytest.mark.parametrize("cells", [[(3, 4)], [(0, 0), (1, 0), (2, 1), (2, 2), (1, 3)]])
def test_a_path_as_it_is(cells: list[tuple[int, int]]) -> None:
    path = path_of(np.array(cells), MOVES["octile"])
    course = sample_path(path, 0.5)
    assert course.s.tolist() == (0.5 * path.arc).tolist()
    assert course.xy.tolist() == [list(map(float, c)) for c in cells]
    np.testing.assert_allclose(np.hypot(*course.heading.T), 1.0, rtol=1e-15)
    assert not course.stop.any()
    assert not course.curvature.any()
    if len(cells) > 1:
        half = math.sqrt(0.5)
        np.testing.assert_allclose(
            course.heading, [(1, 0), (half, half), (0, 1), (-half, half), (-half, half)]
        )
