"""The referee on drives: discs against discs and against walls are where a watcher and sampling see them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from drive_builders import Turtle, clear, drive_of, good_drive, random_track, with_tracks

from lampyris.model.curve import Curve
from lampyris.model.drive import AT_GOAL, Drive
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.referee import check_drive
from lampyris.referee.drive import measure
from lampyris.referee.geometry.lines_and_arcs import arc_to_squares, pieces_of, segment_to_squares
from lampyris_selfcheck.reference.motion.drive_monitor import watch
from sizes import sized


def judge(drive: Drive) -> str | None:
    verdict = check_drive(drive)
    return None if verdict is None else verdict.rule


# ---- where it is -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("short", "there"), [(0.0, True), (0.9, True), (1.1, False)])
def test_at_the_goal_is_one_tolerance(short: float, there: bool) -> None:
    """Standing within it and another outcome is refused, and so is arriving beside it."""
    short *= AT_GOAL
    pen = Turtle(5.0, 5.0, 1.0, 0.0, 1.0)
    pen.forward(10)
    scene = Scene(Grid(np.zeros((30, 30), bool)), (5, 5), (15, 5))
    t, v, a = np.array([0.0, 2.0, 10.5 - short, 11.5 - short]), np.array([0, 1.0, 1, 0]), [0.5, 0, -1, 0]
    s = np.array([0, 1.0, 9.5 - short, 10 - short])
    drive = drive_of(scene, (pen.curve(),), t, s, v, np.array(a), np.zeros(4, int))
    assert judge(drive) == (None if there else "outcome")
    late = replace(drive, outcome=Outcome.TIMEOUT, moments=())
    assert judge(late) == ("outcome" if there else None)


def test_corners_of_straight_lines_are_driven_where_the_turn_radius_is_0() -> None:
    """Nothing turns on the spot then; for a robot that cannot, and beside an arc, it is refused."""
    pen = Turtle(5.0, 5.0, 1.0, 0.0, 1.0)
    pen.forward(4)
    pen.spin(1)
    pen.forward(6)
    curve = replace(pen.curve(), stops=np.zeros(0, int))
    scene = Scene(Grid(np.zeros((30, 30), bool)), (5, 5), (9, 11))
    t, v, a = np.array([0.0, 2.0, 10.5, 11.5]), np.array([0, 1.0, 1, 0]), np.array([0.5, 0, -1, 0])
    drive = drive_of(scene, (curve,), t, np.array([0, 1.0, 9.5, 10]), v, a, np.zeros(4, int))
    assert judge(drive) is None
    stiff = replace(scene, robot=replace(scene.robot, turn_radius=0.1))
    assert judge(replace(drive, scene=stiff)) == "curve"
    bent = replace(curve, curvature=np.array([0.0, 1e-9]))
    assert judge(replace(drive, curves=(bent,))) == "curve"


# ---- discs against discs -----------------------------------------------------------------------------


@pytest.mark.nightly
@sized("cases", 50, 150)
def test_contacts_are_those_that_a_watcher_sees(cases: int) -> None:
    """Random tracks through the robot's way: refused if and only if two discs overlap while it moves."""
    rng = np.random.default_rng(23)
    refused = 0
    for k in range(cases):
        drive = good_drive(rng, size=24, pieces=4, resolution=(1.0, 0.2)[k % 2])
        speed = 0.5 if k % 3 else 20.0
        near = drive.at(np.array([rng.random() * drive.duration]))[0][0]
        tracks = []
        for _ in range(2):
            one = random_track(rng, drive.duration, 24, drive.scene.grid.resolution, 0.3, speed)
            shift = near - one.xy[int(rng.integers(len(one.t)))]
            tracks.append(replace(one, xy=one.xy + shift + rng.normal(size=2) * 1.5))
        drive = with_tracks(drive, tracks)
        gap = min(clear(drive, track, 0.002) for track in tracks)
        verdict = check_drive(drive)
        told = measure(drive)
        assert told["gap"] <= watch(drive, 0.01).gap + 1e-6
        if gap < -1e-3:
            assert verdict is not None
            assert verdict.rule in ("collision", "unreported contact")
            refused += 1
        elif gap > 0.03:
            assert verdict is None
    assert 0.2 * cases < refused < 0.8 * cases


@sized("cases", 50, 300)
def test_what_passes_between_two_looks_is_caught(cases: int) -> None:
    """A small body crosses in a thousandth of a second: the closed form of two straight lines decides."""
    rng = np.random.default_rng(24)
    pen = Turtle(5.0, 5.0, 1.0, 0.0, 1.0)
    pen.forward(10)
    curve = pen.curve()
    robot = Robot(radius=0.0)
    scene = Scene(Grid(np.zeros((30, 30), bool)), (5, 5), (15, 5), robot=robot)
    t = np.array([0.0, 2.0, 10.0 + 0.5, 11.5])
    v, a, s = np.array([0, 1.0, 1, 0]), np.array([0.5, 0, -1, 0]), np.array([0, 1.0, 9.5, 10])
    drive = drive_of(scene, (curve,), t, s, v, a, np.zeros(4, int))
    assert check_drive(drive) is None
    hits = 0
    for _ in range(cases):
        when, radius, pace = 2.2 + 8 * rng.random(), 10.0 ** -rng.integers(1, 4), 10.0 ** rng.integers(1, 3)
        angle = rng.random() * 2 * math.pi
        u = pace * np.array((math.cos(angle), math.sin(angle)))
        offset = rng.normal() * 1.5 * radius
        at = np.array((5 + 1 + (when - 2), 5.0)) + offset * np.array((-u[1], u[0])) / pace
        ends = np.array([at - 0.2 * u, at + 0.2 * u])
        track = Track(np.array([when - 0.2, when + 0.2]), ends, radius, pace * 1.0001)
        relative = u - (1, 0)
        apart = at - (5 + 1 + (when - 2), 5.0)
        nearest = abs(apart[0] * relative[1] - apart[1] * relative[0]) / np.hypot(*relative)
        if when + 0.2 > 10.3 or abs(nearest - radius) < 1e-8:
            continue
        # It stays after its last time: only the crossing itself is compared.
        crossing = with_tracks(drive, [track])
        verdict = judge(crossing)
        assert (verdict == "collision") == (nearest < radius), (nearest, radius)
        hits += verdict == "collision"
    assert 0.2 * cases < hits < 0.8 * cases


# ---- lines and arcs ----------------------------------------------------------------------------------


def test_places_agree_with_the_curve() -> None:
    rng = np.random.default_rng(25)
    for k in range(200):
        bend = float(rng.choice((0.0, 1e-13, 1e-9, 1e-6, 1e-4, 0.1, 1.0, 7.0)) * rng.choice((-1, 1)))
        length = float(rng.choice((1e-6, 0.3, 2.0, 5.0)))
        angle = rng.random() * 7
        res = (1.0, 0.05)[k % 2]
        start = rng.normal(size=2) * 10
        heading = [[math.cos(angle), math.sin(angle)]]
        curve = Curve([start], heading, [length], [bend], (0.0, 0.0), res)
        s = np.linspace(0, length * 0.999999, 7)
        want_xy, want_heading = curve.at(s)
        xy, along = pieces_of((curve,), res).place(np.zeros(7, int), s)
        assert np.abs(xy / res - want_xy).max() < 1e-9 * (1 + length / res)
        assert np.abs(along - want_heading).max() < 1e-11


@pytest.mark.nightly
@sized("cases", 50, 150)
def test_distances_to_squares_agree_with_sampling(cases: int) -> None:
    rng = np.random.default_rng(26)
    gx, gy = np.meshgrid(np.arange(-6, 7), np.arange(-6, 7))
    x, y = gx.ravel(), gy.ravel()
    for _ in range(cases):
        bend = float(rng.choice((0.02, 0.3, 1.0, 3.0)) * rng.choice((-1, 1)))
        length = float(rng.random() * min(1.5 / abs(bend), 8.0))
        angle = rng.random() * 7
        heading = np.array((math.cos(angle), math.sin(angle)))
        a = rng.normal(size=2) * 2
        curve = Curve([a], [heading], [length], [bend], (0.0, 0.0), 1.0)
        many = curve.at(np.linspace(0, length * (1 - 1e-12), 4001))[0]
        b = many[-1]
        sampled = np.full(len(x), np.inf)
        straight = np.full(len(x), np.inf)
        line = a + np.linspace(0, 1, 4001)[:, None] * (b - a)
        for k in range(len(x)):
            for points, out in ((many, sampled), (line, straight)):
                dx = np.maximum(np.abs(points[:, 0] - x[k]) - 0.5, 0)
                dy = np.maximum(np.abs(points[:, 1] - y[k]) - 0.5, 0)
                out[k] = np.hypot(dx, dy).min()
        arc = arc_to_squares(a, b, heading, bend, length, x, y)
        segment = segment_to_squares(a, b, x, y)
        step = length / 4000
        for found, want in ((arc, sampled), (segment, straight)):
            assert (found <= want + 2e-9).all()
            assert (found >= want - step).all()
