"""The referee of curves: it passes what is right, and names each thing that is wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lampyris import Grid, Robot
from lampyris.model.curve import Curve
from lampyris.referee import check_curve
from lampyris.referee.geometry.curve import SLACK

SIZE = 0.5
"""Metres a cell."""
ROBOT = Robot(radius=0.4 * SIZE, turn_radius=2.0 * SIZE)
POINTS = np.array([(1.0, 1.0), (9.0, 1.0), (9.0, 9.0), (3.0, 9.0)])


def curve() -> Curve:
    """Right, an arc of 3 cells, down, a stop, left."""
    return Curve(
        np.array([(1.0, 1.0), (6.0, 1.0), (9.0, 4.0), (9.0, 9.0)]),
        np.array([(1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]),
        np.array([5.0, 1.5 * math.pi, 5.0, 6.0]) * SIZE,
        np.array([0.0, 1 / 3, 0.0, 0.0]) / SIZE,
        (3.0, 9.0),
        SIZE,
        np.array([3]),
    )


def grid(*cells: tuple[int, int], width: int = 11) -> Grid:
    blocked = np.zeros((11, width), dtype=bool)
    for x, y in cells:
        blocked[y, x] = True
    return Grid(blocked, resolution=SIZE)


def changed(array: np.ndarray, at: int, value: float | tuple[float, float]) -> np.ndarray:
    out = array.copy()
    out[at] = value
    return out


def test_what_is_right_passes() -> None:
    assert check_curve(curve(), grid(), ROBOT, POINTS) is None
    # Walls beside it, as near as the robot is wide: 0.9 from the lines.
    assert check_curve(curve(), grid((3, 2), (10, 6), (6, 8)), ROBOT, POINTS) is None


@pytest.mark.parametrize(
    ("rule", "wrong"),
    [
        ("ends", lambda c: replace(c, end=(3.0, 9.0 + 1e-12))),
        ("ends", lambda c: replace(c, resolution=0.4)),
        ("ends", lambda c: replace(c, xy=changed(c.xy, 0, (1.0, 1.0 + 1e-6)))),
        ("ends", lambda c: replace(c, lengths=changed(c.lengths, 3, 6.001 * SIZE))),
        ("pieces", lambda c: replace(c, stops=np.array([0, 3]))),
        ("pieces", lambda c: replace(c, stops=np.array([3, 4]))),
        ("pieces", lambda c: replace(c, stops=np.array([3, 3]))),
        ("pieces", lambda c: replace(c, heading=changed(c.heading, 0, (1.0 + 1e-8, 0.0)))),
        ("joints", lambda c: replace(c, xy=changed(c.xy, 1, (6.0 + 1e-7, 1.0)))),
        ("joints", lambda c: replace(c, lengths=changed(c.lengths, 0, 5.0001 * SIZE))),
        ("joints", lambda c: replace(c, curvature=changed(c.curvature, 1, 0.3333 / SIZE))),
        ("joints", lambda c: replace(c, curvature=changed(c.curvature, 1, -1 / 3 / SIZE))),
        ("joints", lambda c: replace(c, stops=np.zeros(0, dtype=np.int64))),
    ],
)
def test_pieces_that_do_not_fit_are_named(rule: str, wrong: Callable[[Curve], Curve]) -> None:
    said = check_curve(wrong(curve()), grid(), ROBOT, POINTS)
    assert said is not None
    assert said.rule == rule, said


def test_a_robot_that_cannot_drive_it() -> None:
    stiff = replace(ROBOT, turn_radius=3.001 * SIZE)
    said = check_curve(curve(), grid(), stiff, POINTS)
    assert said is not None
    assert said.rule == "turn radius"


def test_longer_than_the_polyline() -> None:
    direct = np.array([(1.0, 1.0), (3.0, 9.0)])
    said = check_curve(curve(), grid(), ROBOT, direct)
    assert said is not None
    assert said.rule == "longer"


def test_lines_turn_freely_only_where_nothing_bends() -> None:
    nimble = Robot()
    corners = Curve(POINTS[:3], np.array([(1, 0), (0, 1), (-1, 0)]), np.array([8, 8, 6]) * SIZE,
                    np.zeros(3), (3.0, 9.0), SIZE)  # fmt: skip
    assert check_curve(corners, grid(), nimble, POINTS) is None
    said = check_curve(corners, grid(), ROBOT, POINTS)
    assert said is not None
    assert said.rule == "joints"
    said = check_curve(replace(curve(), stops=np.zeros(0)), grid(), nimble, POINTS)
    assert said is not None
    assert said.rule == "joints"


@pytest.mark.parametrize(("cell", "piece"), [((3, 1), 0), ((9, 7), 2), ((5, 9), 3), ((8, 2), 1), ((8, 4), 1)])
def test_walls_on_the_way(cell: tuple[int, int], piece: int) -> None:
    # The last is half a cell from the polyline, and 0.45 cells from the arc.
    said = check_curve(curve(), grid(cell), replace(ROBOT, radius=0.6 * SIZE), POINTS)
    assert said is not None
    assert (said.rule, said.where) == ("clearance", f"piece {piece}")


def test_as_near_as_the_polyline_is_near_enough() -> None:
    assert check_curve(curve(), grid((3, 2)), replace(ROBOT, radius=0.6 * SIZE), POINTS) is None


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.9])
def test_an_arc_exactly_as_near_as_it_may_come(radius: float) -> None:
    # The wall's corner at (x, y) is inside the arc's circle around (6, 4): as far from it as 3 less radius.
    inner = 3.0 - radius
    for angle in (0.3, math.pi / 4, 1.2):
        x, y = 6 + inner * math.sin(angle), 4 - inner * math.cos(angle)
        for shift, passes in ((SLACK * 2, False), (-SLACK, True)):
            shifted = curve()
            # The square's corner nearest to the arc is at whole half cells: the curve is moved there.
            by = np.array((
                math.floor(x) + 0.5 - x - shift * math.sin(angle),
                math.floor(y) + 0.5 - y + shift * math.cos(angle),
            ))  # fmt: skip
            points = POINTS + by
            moved = replace(shifted, xy=shifted.xy + by, end=tuple(points[-1]))
            cell = (math.floor(x), math.floor(y) + 1)
            walls = grid(cell)
            robot = Robot(radius=radius * SIZE)
            said = check_curve(moved, walls, robot, points)
            assert (said is None) == passes, (angle, shift, said)
            assert said is None or (said.rule, said.where) == ("clearance", "piece 1")


def test_off_the_map() -> None:
    # The arc bulges beyond both its ends.
    back = math.sqrt(0.5)
    bulge = Curve(np.array([(9.0, 1.0)]), np.array([(back, back)]), np.array([2 * math.pi / 2 * SIZE]),
                  np.array([0.5 / SIZE]), (9.0, 1.0 + 2 * math.sqrt(2)), SIZE)  # fmt: skip
    told = np.array([(9.0, 1.0), (10.4, 2.0), (9.0, 1.0 + 2 * math.sqrt(2))])
    assert check_curve(bulge, grid(), Robot(), told) is None
    said = check_curve(bulge, grid(width=10), Robot(), told)
    assert said is not None
    assert said.rule == "outside"


def test_no_pieces() -> None:
    nothing = Curve(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), (3.0, 9.0), SIZE)
    assert check_curve(nothing, grid(), ROBOT, np.array([(3.0, 9.0)])) is None
    assert check_curve(nothing, grid(), ROBOT, np.array([(3.0, 9.0), (5.0, 9.0), (3.0, 9.0)])) is None
    said = check_curve(nothing, grid(), ROBOT, POINTS)
    assert said is not None
    assert said.rule == "ends"
