"""Robot and obstacles: sizes, speeds, contacts, and whether they were reported."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.robot import Polygon
from lampyris.model.trace import Outcome
from lampyris.model.traffic import BOUND_MARGIN, Crossing, Patrol, RandomWalk, Recorded
from lampyris.referee.geometry.moving_discs import (
    Episode,
    Pairs,
    RobotMotion,
    first_contact,
    gap_at,
    moving,
    nearest,
    pairs_of,
    standing_contacts,
)
from lampyris.referee.geometry.moving_polygons import (
    first_polygon_contact,
    nearest_polygon,
    polygon_gap_at,
    polygon_pairs,
    standing_polygon_contacts,
)
from lampyris.referee.geometry.pose_drive import at_wall_at_the_end
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

ROUNDING = 1e-9
"""Share of a value that sums may be off by."""

DUST = 1e-12
"""What a value near 0 may be off by: metres, m/s."""

NEAR = 1e-6
"""Metres within which a contact that is reported must be."""

ANGLE = 1e-6
"""Radians that rounding may make of a heading."""

_KINDS = {RandomWalk: "random-walk", Patrol: "patrol", Crossing: "crossing", Recorded: "recorded"}

_MET = ("hit", "contact")


class Meetings:
    """Robot and obstacles of one drive, discs and polygons.

    Attributes
    ----------
    discs : every part of the robot's motion with every disc that is there.
    polygons : the same of each polygon.
    """

    def __init__(self, drive: Drive, motion: RobotMotion) -> None:
        self.drive, self.motion = drive, motion
        self.radius, resolution = radius_in(drive, motion), drive.scene.grid.resolution
        self.discs: Pairs = pairs_of(motion, drive.tracks, self.radius, resolution)
        self.polygons = polygon_pairs(motion, drive.tracks, resolution)

    def first(self, obstacle: int | None = None) -> tuple[float, int, float] | None:
        """The first contact while the robot moves, with an obstacle or with any: time, obstacle, distance (metres)."""
        discs, polygons = self.discs, self.polygons
        if obstacle is not None:
            discs = discs.some(discs.obstacle == obstacle)
            polygons = [one for one in polygons if one.obstacle == obstacle]
        if not moving(self.motion, discs).any():
            met = None
        else:
            met = first_contact(self.motion, discs)
        found = (met, first_polygon_contact(self.motion, polygons, self.radius))
        return min((one for one in found if one is not None), default=None)

    def standing(self, apart: float) -> list[Episode]:
        """Contacts while the robot stands; those of one obstacle that are no more than ``apart`` seconds apart are one."""
        polygons = standing_polygon_contacts(self.motion, self.polygons, self.radius, apart)
        return standing_contacts(self.motion, self.discs, apart) + polygons

    def nearest(self) -> tuple[float, float, int]:
        """The least gap while the robot moves (metres), when, and which obstacle; (infinity, 0, -1): none was there."""
        discs = nearest(self.motion, self.discs)
        return (
            min(discs, nearest_polygon(self.motion, self.polygons, self.radius)) if self.polygons else discs
        )

    def gap_at(self, obstacle: int, t: float) -> float:
        """Metres between the robot and an obstacle at one time; infinity before it is there."""
        track, resolution = self.drive.tracks[obstacle], self.drive.scene.grid.resolution
        find = gap_at if track.outline is None else polygon_gap_at
        return find(self.motion, track, self.radius, resolution, t)

    def touching_at_the_end(self) -> list[int]:
        """Obstacles within a micrometre of the robot at the end: a drive may end in the instant of a contact."""
        duration = self.drive.duration
        return [k for k in range(len(self.drive.tracks)) if self.gap_at(k, duration) <= NEAR]


def radius_in(drive: Drive, motion: RobotMotion) -> float:
    """The robot's radius; 0 where its outline is looked at instead."""
    return drive.scene.robot.radius if motion.outline is None else 0.0


def tracks_violation(drive: Drive) -> Violation | None:
    """Whether an obstacle has another shape than the scene's, is smaller or faster than it can be, or looks elsewhere."""
    resolution = drive.scene.grid.resolution
    found = _shapes(drive)
    if found is not None:
        return found
    for k, (track, obstacle) in enumerate(zip(drive.tracks, drive.obstacle_specs, strict=True)):
        # A small obstacle of the tick model fills its cell: its disc may be larger than its radius.
        if track.radius < obstacle.radius * (1 - ROUNDING):
            return Violation(
                "obstacle size", f"obstacle {k}", f"{track.radius!r} m in its track, {obstacle.radius!r}"
            )
        if len(track.t) < 2:
            continue
        dt = np.diff(track.t)
        pace = np.hypot(*np.diff(track.xy, axis=0).T) * resolution / dt
        # Places are rounded; over a short time that is a speed.
        give = ROUNDING * track.top_speed + 1e-13 * resolution * (1.0 + np.abs(track.xy).max()) / dt
        fast = pace > track.top_speed + give + DUST
        if fast.any():
            i = int(fast.argmax())
            since = float(track.t[i])
            what = f"{float(pace[i])!r} m/s from {since:g} s on; its top speed is {track.top_speed:g}"
            return Violation("obstacle speed", f"obstacle {k}", what)
    return _headings(drive)


def _shapes(drive: Drive) -> Violation | None:
    """Whether every polygon is one of the scene's, no more often than it is there, and within the disc around it."""
    asked: dict[str, Counter[Polygon | None]] = {}
    for spec in drive.scene.traffic:
        count = spec.count if isinstance(spec, RandomWalk | Crossing) else 1
        asked.setdefault(_KINDS[type(spec)], Counter())[spec.footprint] += count
    for k, (track, obstacle) in enumerate(zip(drive.tracks, drive.obstacle_specs, strict=True)):
        if track.outline != obstacle.outline:
            return Violation(
                "obstacle shape", f"obstacle {k}", "its track has another outline than the obstacle"
            )
        left = asked.get(obstacle.kind, Counter())
        if any(one is not None for one in left):
            left[track.outline] -= 1
        if left[track.outline] < 0 or (track.outline is not None and track.outline not in left):
            what = f"the scene has no such {obstacle.kind}, or fewer: {_outline_words(track.outline)}"
            return Violation("obstacle shape", f"obstacle {k}", what)
        if track.outline is None:
            continue
        far = float(np.hypot(*np.array(track.outline).T).max())
        if track.radius < far * (1 - ROUNDING) + BOUND_MARGIN:
            what = f"{track.radius!r} m in its track, a vertex at {far!r}"
            return Violation("obstacle size", f"obstacle {k}", what)
    return None


def _outline_words(outline: Polygon | None) -> str:
    return "a disc" if outline is None else f"a polygon of {len(outline)} vertices"


def _headings(drive: Drive) -> Violation | None:
    """Whether a polygon has the heading of its recording, or turns to its direction of motion."""
    recorded = [spec for spec in drive.scene.traffic if isinstance(spec, Recorded)]
    resolution, north = drive.scene.grid.resolution, drive.scene.grid.origin[2]
    for k, (track, obstacle) in enumerate(zip(drive.tracks, drive.obstacle_specs, strict=True)):
        spec = recorded.pop(0) if obstacle.kind == "recorded" and recorded else None
        if track.yaw is None or track.top_speed <= 0.0:
            continue
        # The top speed is that of a diagonal step, which takes a tick.
        tick = math.sqrt(2.0) * resolution / track.top_speed
        if spec is not None and spec.yaw:
            found = _recorded_heading(k, track, tick, np.array(spec.yaw) - north)
        else:
            found = _heading(k, track, tick)
        if found is not None:
            return found
    return None


def _recorded_heading(k: int, track: Track, tick: float, given: Floats) -> Violation | None:
    """Whether a polygon has the given heading at the end of every tick (one a tick, then the last), and turns the shorter way."""
    assert track.yaw is not None
    ticks = np.arange(math.floor(float(track.t[-1]) / tick + 1e-6) + 1)
    want = given[np.minimum(ticks, len(given) - 1)]
    off = np.abs(_wrapped(np.interp(ticks * tick, track.t, track.yaw) - want))
    if (off > ANGLE).any():
        i = int(off.argmax())
        what = f"is {float(off[i]):.6g} rad off its recorded yaw at {i * tick:g} s"
        return Violation("obstacle heading", f"obstacle {k}", what)
    turn = np.abs(np.diff(track.yaw))
    long = turn > np.pi * np.diff(track.t) / tick + ANGLE
    if long.any():
        i = int(long.argmax())
        what = f"turns by {float(turn[i]):.6g} rad from {float(track.t[i]):g} s on, not the shorter way"
        return Violation("obstacle heading", f"obstacle {k}", what)
    return None


def _heading(k: int, track: Track, tick: float) -> Violation | None:
    """Whether a polygon turns to the direction in which it moves, the shorter way, and not while it stands.

    It turns at an even rate that ends with the tick: in a stretch of a share of the tick by at least that share of what is left,
    in a whole tick by all of it, within ANGLE.
    """
    assert track.yaw is not None
    step, turn = np.diff(track.xy, axis=0), np.diff(track.yaw)
    moves = (step != 0.0).any(axis=1)
    along = np.arctan2(-step[:, 1], step[:, 0])
    before, after = (np.abs(_wrapped(along - yaw)) for yaw in (track.yaw[:-1], track.yaw[1:]))
    left = before * (1.0 - np.minimum(np.diff(track.t) / tick, 1.0))
    # Over a tiny step the direction is rounded.
    bad = np.where(moves, after > np.minimum(left, before - np.abs(turn)) + ANGLE, np.abs(turn) > ANGLE)
    bad &= ~moves | (np.hypot(*step.T) > 1e-6)
    if not bad.any():
        return None
    i = int(bad.argmax())
    since = float(track.t[i])
    off = f"is then {float(after[i]):.6g} rad off its direction of motion"
    what = f"turns by {float(turn[i]):.6g} rad from {since:g} s on and {off}"
    if not moves[i]:
        what = f"turns by {float(turn[i]):.6g} rad from {since:g} s on while it stands"
    return Violation("obstacle heading", f"obstacle {k}", what)


def _wrapped(angle: Floats) -> Floats:
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def meetings_violation(drive: Drive, motion: RobotMotion) -> Violation | None:
    """Contacts: none while the robot moves but a reported collision; the others are reported, too."""
    into_wall = _into_wall(drive)
    if into_wall and not at_wall_at_the_end(drive):
        return Violation("outcome", "drive", "collision with a wall, but the robot is at none")
    if not drive.tracks:
        if drive.outcome is Outcome.COLLISION and not into_wall:
            return Violation("outcome", "drive", "collision, but there is nobody to touch")
        return _reported_contacts(drive, motion)
    meetings = Meetings(drive, motion)
    late = drive.duration - drive.period - ROUNDING * drive.duration
    met = meetings.first()
    if met is not None and (drive.outcome is not Outcome.COLLISION or met[0] < late):
        t, obstacle, d = met
        reach = radius_in(drive, motion) + drive.tracks[obstacle].radius
        part = "the robot's centre" if motion.outline is None else "the robot's outline"
        what = f"{d:.9g} m from {part} at {t:.9g} s while it moves; the radii make {reach:g}"
        if drive.tracks[obstacle].outline is not None:
            what = f"its outline is on the robot at {t:.9g} s while it moves"
        return Violation("collision", f"obstacle {obstacle}", what)
    last = meetings.touching_at_the_end()
    if (
        met is None
        and drive.outcome is Outcome.COLLISION
        and not into_wall
        and not (last and _moves_at_the_end(drive))
    ):
        return Violation("outcome", "drive", "collision, but nobody was touched while the robot moved")
    # Anyone who lets go and comes back between two decisions has not been away.
    episodes = meetings.standing(drive.period)
    for one in episodes:
        if drive.obstacle_specs[one.obstacle].yields:
            what = f"is on the standing robot from {one.begin:.9g} s on, and it yields"
            return Violation("yield", f"obstacle {one.obstacle}", what)
    reported = [(m.obstacle, m.t) for m in drive.moments if m.word in _MET]
    for one in episodes:
        lo, hi = one.begin - drive.period - NEAR, one.end + drive.period + NEAR
        if not any(obstacle == one.obstacle and lo <= t <= hi for obstacle, t in reported):
            what = f"touches the standing robot from {one.begin:.9g} s on; no moment tells of it"
            return Violation("unreported contact", f"obstacle {one.obstacle}", what)
    if drive.outcome is Outcome.HIT and not (last or any(e.end >= late for e in episodes)):
        return Violation("outcome", "drive", "hit, but nobody is on the robot at the end")
    return _reported_contacts(drive, motion)


def _into_wall(drive: Drive) -> bool:
    """Whether a controller that steers, without the braking rule, is said to have driven into a wall."""
    words = [m for m in drive.moments if m.word == "contact"]
    without = bool(drive.paths) and drive.safety_filter == "none" and drive.outcome is Outcome.COLLISION
    return without and bool(words) and words[-1].obstacle < 0


def _moves_at_the_end(drive: Drive) -> bool:
    return len(drive.t) > 1 and bool(drive.v[-1] > 0 or drive.v[-2] > 0 or drive.a[-2] > 0)


def _reported_contacts(drive: Drive, motion: RobotMotion) -> Violation | None:
    """What is reported as a contact is one, within a micrometre."""
    meetings: Meetings | None = None
    for k, m in enumerate(drive.moments):
        if m.word not in _MET or (m.obstacle < 0 and _into_wall(drive)):
            continue
        if not 0 <= m.obstacle < len(drive.tracks):
            return Violation(
                "reported contact", f"moment {k}", f"{m.word} with obstacle {m.obstacle}, which is not there"
            )
        meetings = meetings or Meetings(drive, motion)
        gap = meetings.gap_at(m.obstacle, m.t)
        if gap > NEAR and len(motion.t0):
            what = f"{m.word} with obstacle {m.obstacle} at {m.t:.9g} s, which is {gap:.6g} m away"
            return Violation("reported contact", f"moment {k}", what)
    return None
