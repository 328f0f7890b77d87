"""A slow watcher of drives: looks every few milliseconds, in plain Python, at what the referee proves.

It shares no code with the referee: places come from :meth:`lampyris.model.drive.Drive.at`, walls are sampled
points against squares, and contact is a comparison of two numbers at each time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from lampyris.model.drive import Drive


@dataclass
class DriveObservations:
    """What was seen at the times looked at."""

    gap: float = math.inf
    """Least metres between rims while the robot moved."""
    gap_when: float = 0.0
    touched: set[int] = field(default_factory=set)
    """Bodies that overlapped the standing robot by more than a micrometre."""
    wall: float = math.inf
    """Least metres from the robot's centre to a wall's square; below 0: how deep it is within."""
    top: float = 0.0
    longest_jump: float = 0.0
    """Greatest speed between two looks, m/s."""
    apart: float = math.inf
    """Least metres between the rims of two obstacles that are to keep apart."""
    body_speed: dict[int, float] = field(default_factory=dict)


def watch(drive: Drive, every: float = 0.002, wall_reach: float = 2.0) -> DriveObservations:
    """Look at a drive every ``every`` seconds."""
    seen = DriveObservations()
    grid = drive.scene.grid
    count = max(2, math.ceil(drive.duration / every) + 1)
    times = np.linspace(0.0, drive.duration, count)
    xy, speed = drive.at(times)
    places = (xy * grid.resolution).tolist()
    blocked = {(int(x), int(y)) for y, x in np.argwhere(grid.blocked)}
    bodies = [(t.at(times) * grid.resolution).tolist() for t in drive.tracks]
    before, step = None, float(times[1] - times[0]) or math.inf
    for i, (t, (x, y), v) in enumerate(zip(times.tolist(), places, speed.tolist(), strict=True)):
        seen.top = max(seen.top, v)
        if before is not None:
            seen.longest_jump = max(seen.longest_jump, math.dist(before, (x, y)) / step)
        before = (x, y)
        for k, track in enumerate(drive.tracks):
            if t < track.t[0]:
                continue
            gap = math.dist((x, y), bodies[k][i]) - track.radius - drive.scene.robot.radius
            if v > 1e-9 and gap < seen.gap:
                seen.gap, seen.gap_when = gap, t
            if v <= 1e-9 and gap < -1e-6:
                seen.touched.add(k)
            if i and t - times[1] >= track.t[0]:
                pace = math.dist(bodies[k][i - 1], bodies[k][i]) / step
                seen.body_speed[k] = max(seen.body_speed.get(k, 0.0), pace)
        if i % 5 == 0:
            seen.apart = min(seen.apart, _apart(drive, [one[i] for one in bodies], t))
        if blocked and i % 5 == 0:
            seen.wall = min(seen.wall, _wall(x / grid.resolution, y / grid.resolution, blocked, wall_reach))
    seen.wall *= grid.resolution
    return seen


def _apart(drive: Drive, places: list[list[float]], t: float) -> float:
    """Least metres between two obstacles at one time, one of which is of a kind that avoids the other."""
    keeps = ("random-walk", "patrol", "crossing")
    best = math.inf
    there = [k for k, track in enumerate(drive.tracks) if t >= track.t[0]]
    for n, j in enumerate(there):
        for k in there[:n]:
            words = {drive.obstacle_specs[j].kind, drive.obstacle_specs[k].kind}
            if words & set(keeps) and words <= {*keeps, "recorded"}:
                reach = drive.tracks[j].radius + drive.tracks[k].radius
                best = min(best, math.dist(places[j], places[k]) - reach)
    return best


def _wall(x: float, y: float, blocked: set[tuple[int, int]], reach: float) -> float:
    best = math.inf
    for cx in range(math.floor(x - reach), math.ceil(x + reach) + 1):
        for cy in range(math.floor(y - reach), math.ceil(y + reach) + 1):
            if (cx, cy) in blocked:
                dx, dy = abs(x - cx) - 0.5, abs(y - cy) - 0.5
                # A robot without size keeps 0 of a wall; only a depth tells that it is within.
                inside = dx < 0.0 and dy < 0.0
                best = min(best, max(dx, dy) if inside else math.hypot(max(dx, 0.0), max(dy, 0.0)))
    return best
