"""The referee's rule that two obstacles never overlap, against a plain look at each pair."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from lampyris.model.obstacles import Track
from lampyris.model.traffic import Obstacle
from lampyris.referee.geometry.separation import least_gap, obstacles_violation

WALKER, CUTTER, TOLD = (Obstacle(kind, 0.0, True) for kind in ("random-walk", "cutter", "recorded"))


def random_track(rng: np.random.Generator, size: float, end: float) -> Track:
    """A track that begins some time and turns at times of its own."""
    times = np.unique(np.round(np.sort(rng.uniform(0.0, end * 1.2, int(rng.integers(1, 9)))), 3))
    xy = rng.uniform(0.0, size, (1, 2)) + np.cumsum(rng.uniform(-1.0, 1.0, (len(times), 2)), axis=0)
    return Track(times, xy, float(rng.choice([0.1, 0.5, 0.9])), 99.0)


def plainly(tracks: list[Track], resolution: float, end: float) -> float:
    best = np.inf
    for i, a in enumerate(tracks):
        for b in tracks[:i]:
            begin = max(a.t[0], b.t[0])
            times = np.unique(np.concatenate(([begin, end], a.t, b.t)))
            times = times[(times >= begin) & (times <= end)]
            if begin >= end:
                continue
            way = (a.at(times) - b.at(times)) * resolution
            for p, q in pairwise(way):
                v = q - p
                share = np.clip(-(p @ v) / (v @ v), 0.0, 1.0) if v @ v > 0.0 else 0.0
                best = min(best, float(np.hypot(*(p + share * v))) - a.radius - b.radius)
    return best


@pytest.mark.commit(15)
@pytest.mark.parametrize("seed", range(60))
def test_the_least_gap_is_that_of_a_plain_look_at_each_pair(seed: int) -> None:
    rng = np.random.default_rng([3, seed])
    size, end, resolution = float(rng.choice([4.0, 20.0])), 7.0, float(rng.choice([0.5, 1.0]))
    tracks = [random_track(rng, size, end) for _ in range(int(rng.integers(2, 12)))]
    bodies = [WALKER] * len(tracks)
    wanted = plainly(tracks, resolution, end)
    found = least_gap(tracks, bodies, resolution, end)
    if wanted < 0.0:
        assert found is not None
        assert found[0] == pytest.approx(wanted, abs=3e-9)
    assert (obstacles_violation(tracks, bodies, resolution, end) is not None) == (wanted < -1e-9)


def crossing_pair(gap: float) -> list[Track]:
    """Two that pass each other at right angles, ``gap`` metres between their rims where they are nearest."""
    t = np.array([0.0, 2.0])
    away = (1.0 + gap) * np.sqrt(2.0) - 1.0
    one = Track(t, np.array([[-1.0, 0.0], [1.0, 0.0]]), 0.5, 2.0)
    return [one, Track(t, np.array([[0.0, away], [0.0, away + 2.0]]), 0.5, 2.0)]


def test_a_short_meeting_between_two_corners_is_found_with_its_time_and_place() -> None:
    tracks = crossing_pair(-0.01)
    found = obstacles_violation(tracks, [WALKER, WALKER], 1.0, 2.0)
    assert found is not None
    assert found.rule == "obstacles apart"
    assert "obstacles 0 and 1" in str(found)
    assert obstacles_violation(crossing_pair(1e-6), [WALKER, WALKER], 1.0, 2.0) is None


def test_touching_is_no_overlap() -> None:
    t = np.array([0.0, 3.0])
    follow = [Track(t, np.array([[x, 0.0], [x + 3.0, 0.0]]), 0.5, 1.0) for x in (0.0, 1.0, 2.0)]
    assert obstacles_violation(follow, [WALKER] * 3, 1.0, 3.0) is None


def test_only_kinds_that_avoid_others_are_judged() -> None:
    tracks = crossing_pair(-0.3)
    for bodies, judged in (
        ([WALKER, WALKER], True), ([WALKER, TOLD], True), ([TOLD, WALKER], True), ([TOLD, TOLD], False),
        ([WALKER, CUTTER], False), ([CUTTER, TOLD], False),
        ([WALKER, Obstacle("of a new kind", 0.5, True)], True),
    ):  # fmt: skip
        assert (obstacles_violation(tracks, bodies, 1.0, 2.0) is not None) == judged


def test_nobody_is_judged_before_it_appears_nor_after_the_end() -> None:
    early = Track(np.array([0.0, 1.0]), np.array([[0.0, 0.0], [5.0, 0.0]]), 0.5, 9.0)
    late = Track(np.array([1.0]), np.array([[0.0, 0.0]]), 0.5, 9.0)
    assert obstacles_violation([early, late], [WALKER] * 2, 1.0, 4.0) is None
    back = Track(np.array([0.0, 1.0, 3.0]), np.array([[0.0, 0.0], [5.0, 0.0], [0.0, 0.0]]), 0.5, 9.0)
    assert obstacles_violation([back, late], [WALKER] * 2, 1.0, 4.0) is not None
    assert obstacles_violation([back, late], [WALKER] * 2, 1.0, 2.0) is None
