"""Dubins and Reeds-Shepp curves against a numerical solution of the same words, against OMPL, and at odd poses."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lampyris import curves
from lampyris.errors import SettingError
from lampyris.motion.geometry import shortest_curve
from lampyris_selfcheck.reference.paths import shortest_curves as reference
from reference.kernel_forms import use
from sizes import sized

FUNCTIONS = {"dubins": curves.dubins, "reeds-shepp": curves.reeds_shepp}
REFERENCES = {"dubins": reference.dubins_length, "reeds-shepp": reference.reeds_shepp_length}
LENGTHS = {"dubins": curves.dubins_lengths, "reeds-shepp": curves.reeds_shepp_lengths}


def pairs(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Poses near to each other and far away."""
    rng = np.random.default_rng(seed)
    span = rng.choice([0.5, 3.0, 10.0, 30.0], count)[:, None]
    ends = [
        np.column_stack((rng.uniform(-1, 1, (count, 2)) * span, rng.uniform(-math.pi, math.pi, count)))
        for _ in range(2)
    ]
    return ends[0], ends[1]


def driven(curve: curves.ShortestCurve) -> complex:
    """Where the segments lead, in complex numbers and by the mathematics library; the yaw must be the goal's."""
    x, y, yaw = curve.start
    place = complex(x, y)
    for length, turn in curve.segments:
        before = complex(math.cos(yaw), math.sin(yaw))
        yaw += turn
        after = complex(math.cos(yaw), math.sin(yaw))
        place += length * before if turn == 0 else length / turn * (after - before) / 1j
        assert turn == 0 or abs(length / turn) == pytest.approx(curve.turn_radius, rel=1e-9)
    assert math.remainder(yaw - curve.goal[2], 2 * math.pi) == pytest.approx(0.0, abs=1e-8)
    return place


@pytest.mark.nightly
@sized("count", 25, 3000)
@pytest.mark.parametrize("kind", FUNCTIONS)
def test_lengths_are_those_of_a_numerical_search_over_all_words(kind: str, count: int) -> None:
    starts, goals = pairs(count, 5)
    radius = 1.3
    for start, goal in zip(starts, goals, strict=True):
        turn = complex(math.cos(start[2]), -math.sin(start[2]))
        place = complex(*(goal - start)[:2]) * turn / radius
        least = REFERENCES[kind]((place.real, place.imag, goal[2] - start[2])) * radius
        assert FUNCTIONS[kind](start, goal, radius).length == pytest.approx(least, abs=1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", FUNCTIONS)
def test_a_million_lengths_are_those_of_ompl(kind: str) -> None:
    base: Any = pytest.importorskip("ompl").base
    starts, goals = pairs(1_000_000, 1)
    radius = 1.3
    space = base.DubinsStateSpace(radius) if kind == "dubins" else base.ReedsSheppStateSpace(radius)
    bounds = base.RealVectorBounds(2)
    bounds.setLow(-100.0)
    bounds.setHigh(100.0)
    space.setBounds(bounds)
    ends = [space.allocState(), space.allocState()]
    theirs = np.empty(len(starts))
    for k, poses in enumerate(zip(starts.tolist(), goals.tolist(), strict=True)):
        for state, (x, y, yaw) in zip(ends, poses, strict=True):
            state.setX(x)
            state.setY(y)
            state.setYaw(yaw)
        theirs[k] = space.distance(*ends)
    off = np.abs(LENGTHS[kind](starts, goals, radius) - theirs)
    print(f"\n{kind}: greatest difference to OMPL of {len(off):,} lengths: {off.max():.3g}")
    assert off.max() < 1e-9


@pytest.mark.commit(1)
@sized("count", 400, 100_000)
@pytest.mark.parametrize("kind", FUNCTIONS)
def test_segments_lead_to_the_goal_and_poses_lie_on_them(kind: str, count: int) -> None:
    starts, goals = pairs(count, 6)
    lengths = LENGTHS[kind](starts, goals, 0.7)
    words = set()
    for start, goal, length in zip(starts, goals, lengths.tolist(), strict=True):
        curve = FUNCTIONS[kind](start, goal, 0.7)
        words.add(curve.word)
        assert curve.length == pytest.approx(length, rel=1e-12)
        assert abs(driven(curve) - complex(goal[0], goal[1])) < 1e-8
        assert kind == "reeds-shepp" or "-" not in curve.word
        poses = curve.poses(0.2)
        assert poses[0] == pytest.approx(start)
        assert poses[-1] == pytest.approx(goal)
        steps = np.diff(poses, axis=0)
        chords = np.hypot(steps[:, 0], steps[:, 1])
        turns = np.abs(np.remainder(steps[:, 2] + math.pi, 2 * math.pi) - math.pi)
        assert chords.max() <= 0.2 + 1e-9
        assert (turns * 0.7 <= chords * (1 + 0.02) + 1e-8).all()
    assert len(words) >= (6 if kind == "dubins" else 30)


@pytest.mark.parametrize(
    ("start", "goal", "dubins", "reeds_shepp"),
    [
        ((0, 0, 0), (0, 0, 0), 0.0, 0.0),
        ((3, 4, 1), (3, 4, 1 + 2 * math.pi), 0.0, 0.0),
        ((0, 0, 0), (5, 0, 0), 5.0, 5.0),
        ((1, 2, 0.7), (1 + 5 * math.cos(0.7), 2 + 5 * math.sin(0.7), 0.7), 5.0, 5.0),
        ((1, 2, -2.9), (1 - 5 * math.cos(-2.9), 2 - 5 * math.sin(-2.9), -2.9), None, 5.0),
        ((0, 0, 0), (-5, 0, 0), 2 * math.pi + 5, 5.0),
        ((0, 0, 0), (0, 2, math.pi), math.pi, math.pi),
        ((0, 0, 0), (0, 0, math.pi), 7 * math.pi / 3, math.pi),
        ((0, 0, 0), (1, 1, math.pi / 2), math.pi / 2, math.pi / 2),
        ((0, 0, 0), (1e6, 0, 0), 1e6, 1e6),
        ((0, 0, math.pi), (-3, 0, -math.pi), 3.0, 3.0),
    ],
)
def test_odd_poses(start: Any, goal: Any, dubins: float | None, reeds_shepp: float) -> None:
    if dubins is not None:
        assert curves.dubins(start, goal, 1.0).length == pytest.approx(dubins, rel=1e-9, abs=1e-9)
    curve = curves.reeds_shepp(start, goal, 1.0)
    assert curve.length == pytest.approx(reeds_shepp, rel=1e-9, abs=1e-9)
    assert curve.poses(1.0 + curve.length / 100)[-1, :2] == pytest.approx(goal[:2])


def test_a_curve_of_reeds_and_shepp_is_as_long_driven_back_and_never_longer_than_that_of_dubins() -> None:
    starts, goals = pairs(2000, 8)
    there = curves.reeds_shepp_lengths(starts, goals, 1.0)
    assert curves.reeds_shepp_lengths(goals, starts, 1.0) == pytest.approx(there, abs=1e-9)
    assert (there <= curves.dubins_lengths(starts, goals, 1.0) + 1e-9).all()
    assert (there >= np.hypot(*(goals - starts)[:, :2].T) - 1e-9).all()


def test_both_forms_of_the_kernels_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    starts, goals = pairs(60, 9)
    found = []
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        rows: list[Any] = [LENGTHS[kind](starts, goals, 0.9).tobytes() for kind in LENGTHS]
        for function in FUNCTIONS.values():
            each = [function(a, b, 0.9) for a, b in zip(starts, goals, strict=True)]
            rows += [(one.segments, one.poses(0.1).tobytes()) for one in each]
        found.append(rows)
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda: curves.dubins((0, 0), (1, 1, 1), 1.0), "ARRAY.*dubins.start"),
        (lambda: curves.dubins((0, 0, 0), (1, math.nan, 1), 1.0), "ARRAY.*dubins.goal"),
        (lambda: curves.reeds_shepp((0, 0, 0), (1, 1e7, 1), 1.0), "CURVE.*reeds_shepp.goal.*within 1e6"),
        (lambda: curves.reeds_shepp((0, 0, 0), (1, 1, 1), 0.0), "CURVE.*turn_radius 0.*> 0"),
        (lambda: curves.dubins_lengths([(0, 0, 0)], [(1, 1, 1)] * 2, 1.0), "ARRAY.*goals.*\\(1, 3\\)"),
        (lambda: curves.dubins((0, 0, 0), (1, 1, 1), 1.0).poses(0), "CURVE.*spacing 0"),
        (lambda: curves.dubins((0, 0, 0), (1, 1, 1), "1"), "CURVE.*turn_radius '1'"),  # type: ignore[arg-type]
    ],
)
def test_wrong_arguments_are_refused_by_name(call: Callable[[], Any], error: str) -> None:
    with pytest.raises(SettingError, match=error):
        call()


def test_more_poses_than_can_be_held_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shortest_curve, "_MOST_POSES", 10)
    curve = curves.dubins((0, 0, 0), (9, 0, 0), 1.0)
    assert len(curve.poses(0.9)) == 11
    assert len(curve.poses(0.91)) == 11
    with pytest.raises(SettingError, match=r"CURVE.*spacing 0.89; .*at least 0.9"):
        curve.poses(0.89)
