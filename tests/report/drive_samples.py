"""Profiles with a curve, and a drive in continuous time, made by hand from the nouns."""

from __future__ import annotations

import math

import numpy as np

from lampyris.model.curve import Curve
from lampyris.model.drive import Drive, Moment
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle


def sample_room() -> Grid:
    """50 x 40 cells of 0.1 m with a block in the middle."""
    blocked = np.zeros((40, 50), dtype=bool)
    blocked[18:22, 20:30] = blocked[0] = True
    return Grid(blocked, resolution=0.1, origin=(1.0, 2.0, 0.5), name="room")


def sample_course(law: str = "physical", top: float = 1.0, n: int = 300) -> Profile:
    """Around the block: acceleration, a bend, a limit, a zone, and braking for the goal."""
    s = np.linspace(0.0, 9.0, n)
    caps = {
        "limit": np.full(n, top),
        "curvature": np.where((s > 2) & (s < 3), 0.4 * top, np.inf),
        "zone": np.where((s > 5) & (s < 7), 0.6 * top, np.inf),
    }
    rows = np.stack(list(caps.values()))
    cause = np.array(list(caps), dtype=object)[rows.argmin(axis=0)]
    squared = rows.min(axis=0) ** 2
    squared[0] = squared[-1] = 0.0
    for k in range(1, n):
        if (most := squared[k - 1] + (s[k] - s[k - 1])) < squared[k]:
            squared[k], cause[k] = most, "acceleration"
    cause_index = np.full(n, -1)
    for k in range(n - 2, -1, -1):
        if (most := squared[k + 1] + 2 * (s[k + 1] - s[k])) < squared[k]:
            squared[k], cause[k] = most, "braking"
            cause_index[k] = cause_index[k + 1] if cause[k + 1] == "braking" else k + 1
    cause[0], cause[-1] = "start", "goal"
    v = np.sqrt(squared)
    a = np.append(np.diff(squared) / (2 * np.diff(s)), 0.0)
    t = np.append(0.0, np.cumsum(2 * np.diff(s) / (v[1:] + v[:-1])))
    turn = s / 9.0 * 1.8 * np.pi
    xy = np.stack((25 + 15 * np.cos(turn), 20 + 12 * np.sin(turn)), axis=-1)
    return Profile(law, s, v, a, t, tuple(cause), "m/s", cause_index, tuple(caps.items()), xy)


def sample_drive() -> Drive:
    """Straight on, a wait for a body that crosses, a bend, and up to the goal; another body appears late."""
    grid = sample_room()
    scene = Scene(grid, (5, 30), (40, 10), robot=Robot(0.15))
    lengths = [2.5, math.pi / 2, 1.0]
    curve = Curve(
        np.array([[5, 30], [30, 30], [40, 20]]), np.array([[1, 0], [1, 0], [0, -1]]), np.array(lengths),
        np.array([0, -1.0, 0]), (40.0, 10.0), 0.1,
    )  # fmt: skip
    t, s, v = [0.0], [0.0], [0.0]
    a, cause, cause_index = [], [], []
    for push, last, word, of in (
        (0.5, 1.6, "acceleration", -1), (0.0, 1.0, "limit", -1), (-1.0, 0.8, "moving obstacle", 0),
        (0.0, 2.0, "wait", 0), (0.5, 1.2, "acceleration", -1), (0.0, 1.5, "curvature", -1),
        (0.0, 0.0, "clearance", -1), (-1.0, 0.6, "braking", 8),
    ):  # fmt: skip
        # What is left at 0.6 m/s but for the braking way of 0.18 m.
        last = last or (curve.length - s[-1] - 0.18) / 0.6
        a.append(push)
        cause.append(word)
        cause_index.append(of)
        t.append(t[-1] + last)
        s.append(s[-1] + last * (v[-1] + 0.5 * push * last))
        v.append(max(0.0, v[-1] + push * last))
    s[-1], v[-1] = curve.length, 0.0
    tracks = (
        Track(np.array([0, 3.0, 6, 12]), np.array([[20, 38], [26, 33], [22, 24], [45, 24]]), 0.2, 1.0),
        Track(np.array([2.0]), np.array([[10, 5]]), 0.3, 1.0),
    )
    moments = (
        Moment(0.0, "appear", (20, 38), "", 0),
        Moment(t[3], "wait", (23, 30)),
        Moment(t[4], "replan", (23, 30)),
        Moment(t[-1], "arrive", (40, 10)),
    )
    return Drive(
        scene, "astar", "physical", 3, Outcome.ARRIVED, (curve,), np.array(t), np.array(s), np.array(v),
        np.array([*a, 0.0]), np.zeros(len(t), dtype=np.int64), (*cause, "goal"), np.array([*cause_index, -1]),
        tracks, (Obstacle("crossing", 0.2, False), Obstacle("patrol", 0.3, False)), moments, 0.1, 5.0, 1, 20,
    )  # fmt: skip
