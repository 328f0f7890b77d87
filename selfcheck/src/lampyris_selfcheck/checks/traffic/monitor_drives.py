"""Faults that a simulator of drives could have, put into sound drives; see :mod:`.monitor_traces`.

Limits are tightened in the scene, so that what was driven was more than the robot may.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.trace import Outcome
from lampyris.referee.drive import NO_LATERAL_PROMISE

Fault: TypeAlias = Callable[[Drive, np.random.Generator], Drive | None]

SEEN: Mapping[str, str] = MappingProxyType(
    {
        "speed": "speed",
        "robot through a wall": "wall",
        "robot without size in a wall": "wall",
        "robot radius forgotten": "wall",
        "teleport": "jump",
        "into a body": "contact",
        "body radius forgotten": "contact",
        "body too fast": "body speed",
        "two bodies overlap": "bodies",
    }
)
"""What a watcher who looks every few milliseconds can see as well, in its word."""

RULES: Mapping[str, str] = MappingProxyType(
    {
        "speed": "speed",
        "acceleration": "acceleration",
        "braking": "braking",
        "sideways": "lateral",
        "late brake": "distance",
        "teleport": "distance",
        "clock runs back": "time",
        "begins elsewhere": "start",
        "robot through a wall": "wall",
        "robot without size in a wall": "wall",
        "robot radius forgotten": "wall",
        "into a body": "collision",
        "body radius forgotten": "collision",
        "body too fast": "body speed",
        "two bodies overlap": "bodies apart",
        "wrong arrival": "outcome",
        "untold arrival": "outcome",
        "untold hit": "untold contact",
    }
)
"""The referee's rule that each breaks first."""


def _limit(drive: Drive, **limits: float) -> Drive:
    return replace(drive, scene=replace(drive.scene, robot=replace(drive.scene.robot, **limits)))


def speed(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """Faster than the robot can drive."""
    top = float(drive.v.max(initial=0.0))
    return _limit(drive, v_max=0.9 * top) if top > 0.01 else None


def acceleration(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """More than a_max."""
    most = float(drive.a.max(initial=0.0))
    return _limit(drive, a_max=0.99 * most) if most > 0.01 else None


def braking(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """Harder than d_max."""
    most = float((-drive.a).max(initial=0.0))
    return _limit(drive, d_max=0.99 * most) if most > 0.01 else None


def sideways(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """Faster through a bend than a_lat_max lets it."""
    if drive.law in NO_LATERAL_PROMISE:
        return None
    most = 0.0
    for k, s, v in zip(drive.leg.tolist(), drive.s.tolist(), drive.v.tolist(), strict=True):
        curve = drive.curves[k]
        if len(curve.lengths):
            piece = int(
                np.clip(np.searchsorted(curve.begins, s, side="right") - 1, 0, len(curve.lengths) - 1)
            )
            inner = 1e-6 < s - float(curve.begins[piece]) < float(curve.lengths[piece]) - 1e-6
            most = max(most, v * v * abs(float(curve.curvature[piece])) if inner else 0.0)
    return _limit(drive, a_lat_max=0.9 * most) if most > 0.01 else None


def late_brake(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A stretch of braking begins a little later than its places and speeds say."""
    some = np.flatnonzero((drive.a[:-1] < -1e-3) & (np.diff(drive.t) > 1e-3))[1:]
    if not len(some):
        return None
    k = int(some[int(rng.integers(len(some)))])
    t = drive.t.copy()
    t[k] += 0.2 * (t[k + 1] - t[k])
    return replace(drive, t=t)


def teleport(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """It is suddenly where it was before, and drives on from there."""
    way = np.append(np.diff(drive.s), 0.0)
    some = np.flatnonzero((way > 0.05) & (drive.leg == drive.leg[-1]) & (np.arange(len(way)) > 0))
    if len(some) < 3:
        return None
    k = int(some[int(rng.integers(1, len(some) - 1))])
    end = float(np.sum(drive.curves[int(drive.leg[k])].lengths))
    jump = min(0.5 * (float(drive.s[k]) - float(drive.s[some[0]])), end)
    if jump < 0.2:
        return None
    s = drive.s.copy()
    s[k:] -= jump
    if s[k:].min() < 0:
        return None
    return replace(drive, s=s, outcome=Outcome.TIMEOUT, moments=())


def clock_runs_back(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """Two times in the wrong order."""
    if len(drive.t) < 4:
        return None
    k = int(rng.integers(1, len(drive.t) - 2))
    t = drive.t.copy()
    t[[k, k + 1]] = t[[k + 1, k]]
    return replace(drive, t=t)


def begins_elsewhere(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """The start is another cell."""
    x, y = drive.scene.start
    for to in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
        if drive.scene.grid.contains(to) and not drive.scene.grid.blocked[to[1], to[0]]:
            return replace(drive, scene=replace(drive.scene, start=to))
    return None


def _under(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A wall on the way, off start and goal, with the way well within it."""
    times = np.linspace(0.0, drive.duration, 200)
    xy = drive.at(times)[0]
    cells = np.floor(xy + 0.5).astype(np.int64)
    ends = np.array([drive.scene.start, drive.scene.goal])
    off = (np.abs(cells[:, None] - ends).max(axis=2) > 0).all(axis=1)
    deep = np.flatnonzero(off & (np.abs(xy - cells).max(axis=1) < 0.4))
    if not len(deep):
        return None
    x, y = cells[int(deep[int(rng.integers(len(deep)))])].tolist()
    blocked = drive.scene.grid.blocked.copy()
    blocked[y, x] = True
    grid = replace(drive.scene.grid, blocked=blocked)
    return replace(drive, scene=replace(drive.scene, grid=grid))


def robot_through_a_wall(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A wall where a robot with a radius drives."""
    return _under(drive, rng) if drive.scene.robot.radius > 0.01 else None


def robot_without_size_in_a_wall(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """The same for a robot that is a point: its distance to the wall is its radius."""
    return _under(drive, rng) if drive.scene.robot.radius == 0.0 else None


def robot_radius_forgotten(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """The robot is larger than the simulator thought: a wall is within its radius."""
    xy = drive.at(np.linspace(0.0, drive.duration, 200))[0]
    ys, xs = np.nonzero(drive.scene.grid.blocked)
    if not len(xs):
        return None
    gx = np.maximum(np.abs(xy[:, :1] - xs) - 0.5, 0.0)
    gy = np.maximum(np.abs(xy[:, 1:] - ys) - 0.5, 0.0)
    cells = float(np.hypot(gx, gy).min())
    near = cells * drive.scene.grid.resolution
    # The watcher looks for walls no farther than 2 cells off.
    return _limit(drive, radius=near + 0.05) if near > drive.scene.robot.radius and cells < 1.5 else None


def _moving_times(drive: Drive, least: float = 0.1) -> np.ndarray[Any, np.dtype[np.float64]]:
    times = np.linspace(0.0, drive.duration, 400)[1:-1]
    return times[drive.at(times)[1] > least]


def into_a_body(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A body stands where the robot drives through."""
    times = _moving_times(drive)
    if not len(drive.tracks) or not len(times) or drive.outcome is Outcome.COLLISION:
        return None
    k = int(rng.integers(len(drive.tracks)))
    t = float(times[int(rng.integers(len(times)))])
    one = drive.tracks[k]
    if one.t[0] > t - 0.2:
        return None
    at = drive.at(np.array([t]))[0][0]
    tracks = list(drive.tracks)
    tracks[k] = Track(one.t[:1], at[None], max(one.radius, 0.05), one.top_speed)
    return replace(drive, tracks=tuple(tracks))


def body_radius_forgotten(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A body is larger than the simulator thought: the robot drives within its radius."""
    times = _moving_times(drive)
    if not len(times) or drive.outcome is Outcome.COLLISION:
        return None
    xy = drive.at(times)[0] * drive.scene.grid.resolution
    for k in rng.permutation(len(drive.tracks)).tolist():
        one = drive.tracks[k]
        there = times >= one.t[0]
        if not there.any():
            continue
        gap = np.hypot(*(xy[there] - one.at(times[there]) * drive.scene.grid.resolution).T)
        reach = float(gap.min()) - drive.scene.robot.radius
        if reach > one.radius:
            tracks = list(drive.tracks)
            tracks[k] = Track(one.t, one.xy, reach + 0.05, one.top_speed)
            return replace(drive, tracks=tuple(tracks))
    return None


def body_too_fast(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A body faster than it is said to be able to."""
    for k in rng.permutation(len(drive.tracks)).tolist():
        one = drive.tracks[k]
        dt = np.diff(one.t)
        pace = np.hypot(*np.diff(one.xy, axis=0).T) * drive.scene.grid.resolution / dt
        long = pace[(dt > 0.1) & (pace > 0.05)]
        if len(long):
            tracks = list(drive.tracks)
            tracks[k] = Track(one.t, one.xy, one.radius, 0.5 * float(long.max()))
            return replace(drive, tracks=tuple(tracks))
    return None


def two_bodies_overlap(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A body goes beside another one, nearer than both radii, and clear of the robot."""
    avoid = [
        k for k, body in enumerate(drive.obstacle_specs) if body.kind in ("random-walk", "patrol", "crossing")
    ]
    times = np.linspace(0.0, drive.duration, 2000)
    robot, cell = drive.at(times)[0], drive.scene.grid.resolution
    for k in rng.permutation(avoid).tolist():
        for j in rng.permutation(avoid).tolist():
            one, other = drive.tracks[k], drive.tracks[j]
            if j == k or drive.duration - other.t[0] < 0.5:
                continue
            beside = 0.5 * (one.radius + other.radius) / cell
            for shift in ((beside, 0.0), (-beside, 0.0), (0.0, beside), (0.0, -beside)):
                moved = Track(other.t, other.xy + shift, one.radius, other.top_speed)
                gap = np.hypot(*(robot - moved.at(times)).T) * cell - one.radius - drive.scene.robot.radius
                if gap[times >= moved.t[0]].min() > 0.05:
                    tracks = list(drive.tracks)
                    tracks[k] = moved
                    told = tuple(m for m in drive.moments if m.body != k)
                    return replace(drive, tracks=tuple(tracks), moments=told)
    return None


def wrong_arrival(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """It is told to have arrived, and has not; after a collision the contact would be told first."""
    if drive.arrived or drive.outcome is Outcome.COLLISION or not drive.curves:
        return None
    return replace(drive, outcome=Outcome.ARRIVED)


def untold_arrival(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """It stands at the goal, and is told not to have arrived."""
    moments = tuple(m for m in drive.moments if m.word != "arrive")
    return replace(drive, outcome=Outcome.BLOCKED, moments=moments) if drive.arrived else None


def untold_hit(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """Bodies ran into the standing robot, and nothing reports it."""
    moments = tuple(m for m in drive.moments if m.word != "hit")
    return replace(drive, moments=moments) if len(moments) < len(drive.moments) else None


FAULTS: Mapping[str, Fault] = MappingProxyType(
    {
        f.__name__.replace("_", " "): f
        for f in (
            *(speed, acceleration, braking, sideways, late_brake, teleport, clock_runs_back),
            *(begins_elsewhere, robot_through_a_wall, robot_without_size_in_a_wall),
            *(robot_radius_forgotten, into_a_body, body_radius_forgotten, body_too_fast),
            *(two_bodies_overlap, wrong_arrival, untold_arrival, untold_hit),
        )
    }
)
"""Every fault by name."""
