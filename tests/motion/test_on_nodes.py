"""Profiles through tracks with the nodes of their courses: the same motion, told closely."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.model.curve import Curve
from lampyris.model.obstacles import Track
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.profile import feasible_profile
from lampyris.motion.timing.path_time import through_tracks
from lampyris.motion.timing.profile_on_nodes import with_nodes
from lampyris.typing import Floats
from sizes import sized


def case(k: int) -> tuple[SampledPath, Profile, Profile, Robot]:
    """A straight way of 8 m, its profile, and the one through up to three crossing tracks."""
    rng = np.random.default_rng(k)
    robot = Robot(radius=0.2, a_max=float(rng.uniform(0.3, 1)), d_max=float(rng.uniform(0.5, 1.5)))
    curve = Curve(
        np.array([[1.0, 5.0]]), np.array([[1.0, 0.0]]), np.array([8.0]), np.zeros(1), (9.0, 5.0), 1.0
    )
    course = sample_curve(curve, float(rng.choice((0.1, 0.25, 1.0))))
    cap = np.full(len(course), 1.0)
    cap[len(course) // 3 : len(course) // 2] = rng.uniform(0.3, 1.0)
    made = feasible_profile(course.s, [("clearance", cap)], a_max=robot.a_max, d_max=robot.d_max)
    still = Profile(
        "physical", course.s, made.v, made.a, made.t, made.cause, "m/s", made.cause_index,
        (("clearance", cap),), course.xy,
    )  # fmt: skip
    tracks = []
    for _ in range(int(rng.integers(1, 4))):
        x, begin = float(rng.uniform(3, 8)), float(rng.uniform(6, 14))
        t = np.array([0.0, begin, begin + 8.0])
        tracks.append(Track(t, np.array([[x, 4.7], [x, 4.7], [x, -4.0]]), 0.2, 2.0))
    return course, still, through_tracks(course, cap, robot, tracks), robot


def place(profile: Profile, t: Floats) -> Floats:
    k = np.clip(np.searchsorted(profile.t, t, side="right") - 1, 0, len(profile.t) - 1)
    d = t - profile.t[k]
    out: Floats = profile.s[k] + d * (profile.v[k] + 0.5 * profile.a[k] * d)
    return out


@pytest.mark.nightly
@sized("cases", 25, 60)
def test_it_is_the_same_motion(cases: int) -> None:
    more = 0
    for k in range(cases):
        course, still, found, robot = case(k)
        made = with_nodes(found, still, course, robot.a_max)
        t = np.linspace(0, found.duration, 500)
        assert np.abs(place(made, t) - place(found, t)).max() < 1e-9
        assert made.duration == found.duration
        # Exact between its nodes, and the clock never runs back.
        ds, dt = np.diff(made.s), np.diff(made.t)
        assert (dt > 0).all()
        assert np.abs(np.diff(made.v**2) - 2 * made.a[:-1] * ds).max() < 1e-12
        assert np.abs(made.v[:-1] + made.a[:-1] * dt - made.v[1:]).max() < 1e-9
        assert made.xy is not None
        assert np.abs(made.xy[:, 0] - 1 - made.s).max() < 1e-9
        # Every node of the course is there, and every node of the motion.
        for s in (course.s, found.s):
            assert np.abs(made.s[:, None] - s).min(axis=0).max() < 1e-5
        more += len(made.s) - len(found.s)
    assert more > 3.34 * cases


@sized("cases", 12, 60)
def test_causes_say_what_holds_each_node(cases: int) -> None:
    words: set[str] = set()
    for k in range(cases):
        course, still, found, robot = case(k)
        made = with_nodes(found, still, course, robot.a_max)
        for n, word in enumerate(made.cause):
            words.add(word)
            cause_index = int(made.cause_index[n])
            if word == "braking":
                assert cause_index > n
                assert made.cause[cause_index] != "braking"
                assert set(made.cause[n:cause_index]) == {"braking"}
            elif word == "acceleration" and n + 1 < len(made.v):
                assert made.a[n] > 0 or made.a[n - 1] > 0
            elif word in ("wait", "moving obstacle"):
                assert cause_index >= 0
    assert {"start", "goal", "braking", "acceleration", "moving obstacle"} <= words
