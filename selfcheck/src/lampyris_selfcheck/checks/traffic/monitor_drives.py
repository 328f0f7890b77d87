"""Faults that a simulator of drives could have, put into sound drives.

Limits are tightened in the scene, so that what was driven was more than the robot may.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.trace import Outcome

Put: TypeAlias = Callable[[Drive, np.random.Generator], Drive | None]


class DriveFault(NamedTuple):
    """A fault, the referee's rule that it breaks first, and the word of who looks every few milliseconds."""

    put: Put
    rule: str
    seen: str = ""


def _limit(drive: Drive, **limits: Any) -> Drive:
    return replace(drive, scene=replace(drive.scene, robot=replace(drive.scene.robot, **limits)))


def _tighter(name: str, of: Callable[[Drive], float], share: float) -> Put:
    """A limit of the robot is less than what it drove."""

    def put(drive: Drive, rng: np.random.Generator) -> Drive | None:
        most = of(drive)
        return _limit(drive, **{name: share * most}) if most > 0.01 else None

    return put


def _late_brake(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A stretch of braking begins a little later than its places and speeds say."""
    some = np.flatnonzero((drive.a[:-1] < -1e-3) & (np.diff(drive.t) > 1e-3))[1:]
    if not len(some):
        return None
    k = int(some[int(rng.integers(len(some)))])
    t = drive.t.copy()
    t[k] += 0.2 * (t[k + 1] - t[k])
    return replace(drive, t=t)


def _clock_runs_back(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """Two times in the wrong order."""
    if len(drive.t) < 4:
        return None
    k = int(rng.integers(1, len(drive.t) - 2))
    t = drive.t.copy()
    t[[k, k + 1]] = t[[k + 1, k]]
    return replace(drive, t=t)


def _begins_elsewhere(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """The start is another cell."""
    x, y = drive.scene.start
    for to in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
        if drive.scene.grid.contains(to) and not drive.scene.grid.blocked[to[1], to[0]]:
            return replace(drive, scene=replace(drive.scene, start=to))
    return None


def _through_a_wall(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """A wall on the path, off start and goal, with the path well within it."""
    xy = drive.at(np.linspace(0.0, drive.duration, 200))[0]
    cells = np.floor(xy + 0.5).astype(np.int64)
    ends = np.array([drive.scene.start, drive.scene.goal])
    off = (np.abs(cells[:, None] - ends).max(axis=2) > 0).all(axis=1)
    deep = np.flatnonzero(off & (np.abs(xy - cells).max(axis=1) < 0.4))
    if not len(deep):
        return None
    x, y = cells[int(deep[int(rng.integers(len(deep)))])].tolist()
    blocked = drive.scene.grid.blocked.copy()
    blocked[y, x] = True
    return replace(drive, scene=replace(drive.scene, grid=replace(drive.scene.grid, blocked=blocked)))


def _into_a_body(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """An obstacle stands where the robot drives through."""
    times = np.linspace(0.0, drive.duration, 400)[1:-1]
    times = times[drive.at(times)[1] > 0.1]
    if not len(drive.tracks) or not len(times) or drive.outcome is Outcome.COLLISION:
        return None
    k, t = int(rng.integers(len(drive.tracks))), float(times[int(rng.integers(len(times)))])
    one = drive.tracks[k]
    if one.t[0] > t - 0.2:
        return None
    there = Track(one.t[:1], drive.at(np.array([t]))[0], max(one.radius, 0.05), one.top_speed)
    return replace(drive, tracks=(*drive.tracks[:k], there, *drive.tracks[k + 1 :]))


def _body_too_fast(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """An obstacle faster than it is said to be able to."""
    for k in rng.permutation(len(drive.tracks)).tolist():
        one = drive.tracks[k]
        dt = np.diff(one.t)
        pace = np.hypot(*np.diff(one.xy, axis=0).T) * drive.scene.grid.resolution / dt
        long = pace[(dt > 0.1) & (pace > 0.05)]
        if len(long):
            slow = Track(one.t, one.xy, one.radius, 0.5 * float(long.max()))
            return replace(drive, tracks=(*drive.tracks[:k], slow, *drive.tracks[k + 1 :]))
    return None


def _arrival_invented(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """It is said to have arrived, and has not; after a collision the contact would be reported first."""
    if drive.arrived or drive.outcome is Outcome.COLLISION or not drive.curves:
        return None
    return replace(drive, outcome=Outcome.ARRIVED)


def _arrival_not_reported(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """It stands at the goal, and is said not to have arrived."""
    moments = tuple(m for m in drive.moments if m.word != "arrive")
    return replace(drive, outcome=Outcome.BLOCKED, moments=moments) if drive.arrived else None


def _hit_not_reported(drive: Drive, rng: np.random.Generator) -> Drive | None:
    """Obstacles ran into the standing robot, and nothing reports it."""
    moments = tuple(m for m in drive.moments if m.word != "hit")
    return replace(drive, moments=moments) if len(moments) < len(drive.moments) else None


FAULTS: Mapping[str, DriveFault] = {
    "speed": DriveFault(_tighter("v_max", lambda d: float(d.v.max(initial=0.0)), 0.9), "speed", "speed"),
    "acceleration": DriveFault(
        _tighter("a_max", lambda d: float(d.a.max(initial=0.0)), 0.99), "acceleration"
    ),
    "braking": DriveFault(_tighter("d_max", lambda d: float((-d.a).max(initial=0.0)), 0.99), "braking"),
    "late brake": DriveFault(_late_brake, "distance"),
    "clock runs back": DriveFault(_clock_runs_back, "time"),
    "begins elsewhere": DriveFault(_begins_elsewhere, "start"),
    "through a wall": DriveFault(_through_a_wall, "wall", "wall"),
    "into a body": DriveFault(_into_a_body, "collision", "contact"),
    "body too fast": DriveFault(_body_too_fast, "obstacle speed", "obstacle speed"),
    "arrival invented": DriveFault(_arrival_invented, "outcome"),
    "arrival not reported": DriveFault(_arrival_not_reported, "outcome"),
    "hit not reported": DriveFault(_hit_not_reported, "unreported contact"),
}
"""Every fault by name."""
