"""The gap between a driven robot and moving discs at every instant, from the motion itself.

Between two breaks of either motion the robot is on a straight line with constant acceleration and a disc on
one with constant speed: the square of their distance is a polynomial of degree four in time, and is least at
an end or where its derivative, of degree three, is 0.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded


def least_gap(made: Profile, plan: Plan, scene: Scene, tick_seconds: float) -> tuple[float, int, float]:
    """Least gap between the robot's disc and a recorded obstacle's, metres; which, and when, seconds.

    An obstacle of radius 0 fills its cell: it is a disc of half a cell.
    """
    assert plan.path is not None
    resolution = scene.grid.resolution
    nodes = plan.path.cells.astype(np.float64) * resolution
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(nodes, axis=0).T))))
    begin = 0.0 if plan.schedule is None else float(plan.schedule[0]) * tick_seconds
    least = (math.inf, -1, 0.0)
    for k, one in enumerate(scene.traffic):
        assert isinstance(one, Recorded)
        track = np.array(one.track, dtype=np.float64) * resolution
        touch = scene.robot.radius + (one.radius or 0.5 * resolution)
        for t0, t1, node in _pieces(made, along, begin, tick_seconds, len(track)):
            robot = _robot(made, along, nodes, node, t0, begin)
            disc = _disc(track, t0, t1, tick_seconds)
            near, when = _nearest(robot, disc, t1 - t0)
            if near - touch < least[0]:
                least = (near - touch, k, t0 + when)
    return least


def _pieces(
    made: Profile, along: np.ndarray, begin: float, tick: float, ticks: int
) -> list[tuple[float, float, int]]:
    """Spans of time without a break, each with the profile's node before it."""
    out = []
    # After the robot has arrived the drive is over.
    beats = [n * tick for n in range(ticks)]
    for node, (a, b) in enumerate(pairwise((made.t + begin).tolist())):
        cuts = {a, b, *(beat for beat in beats if a < beat < b)}
        # Corners of the path that lie between two nodes of the profile.
        inside = along[(along > made.s[node]) & (along < made.s[node + 1])].tolist()
        cuts |= {a + _reach(s - float(made.s[node]), made, node) for s in inside}
        out += [(t0, t1, node) for t0, t1 in pairwise(sorted(c for c in cuts if a <= c <= b)) if t1 > t0]
    return out


def _reach(distance: float, made: Profile, node: int) -> float:
    """Seconds from a node to a distance behind it."""
    v, a = float(made.v[node]), float(made.a[node])
    root = math.sqrt(max(v * v + 2.0 * a * distance, 0.0))
    return 2.0 * distance / (v + root) if v + root > 0 else 0.0


def _robot(
    made: Profile, along: np.ndarray, nodes: np.ndarray, node: int, t0: float, begin: float
) -> np.ndarray:
    """Coefficients of the robot's x and y from t0 on: constant, of t, of t squared; (3, 2)."""
    late = t0 - begin - float(made.t[node])
    v = float(made.v[node]) + float(made.a[node]) * late
    s = float(made.s[node]) + (float(made.v[node]) + 0.5 * float(made.a[node]) * late) * late
    # On the straight line that it is about to drive, a hair beyond a corner that it has just reached.
    k = int(np.clip(np.searchsorted(along, s + 1e-9, side="right") - 1, 0, len(along) - 2))
    way = (nodes[k + 1] - nodes[k]) / (along[k + 1] - along[k])
    return np.array([nodes[k] + way * (s - along[k]), way * v, way * 0.5 * float(made.a[node])])


def _disc(track: np.ndarray, t0: float, t1: float, tick: float) -> np.ndarray:
    """The same of an obstacle, which goes straight and evenly from cell to cell, one in a tick."""
    k = math.floor(0.5 * (t0 + t1) / tick)
    if k >= len(track) - 1:
        return np.array([track[-1], [0.0, 0.0], [0.0, 0.0]])
    speed = (track[k + 1] - track[k]) / tick
    return np.array([track[k] + speed * (t0 - k * tick), speed, [0.0, 0.0]])


def _nearest(robot: np.ndarray, disc: np.ndarray, span: float) -> tuple[float, float]:
    """Least distance within a span of time, and when."""
    c, b, a = robot - disc
    # |c + b t + a t^2|^2, highest power first.
    square = np.array([a @ a, 2 * a @ b, b @ b + 2 * a @ c, 2 * b @ c, c @ c])
    slope = square[:-1] * [4.0, 3.0, 2.0, 1.0]
    roots = np.roots(np.trim_zeros(slope, "f")) if slope.any() else np.zeros(0)
    times = [0.0, span, *(float(r.real) for r in roots if abs(r.imag) < 1e-6 and 0.0 < r.real < span)]
    values = [math.sqrt(max(float(np.polyval(square, t)), 0.0)) for t in times]
    best = int(np.argmin(values))
    return values[best], times[best]
