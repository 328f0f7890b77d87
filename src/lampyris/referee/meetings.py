"""Robot and obstacles: sizes, speeds, contacts, and whether they were reported."""

from __future__ import annotations

import numpy as np

from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle
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
    """Whether an obstacle's disc is smaller than its obstacle, or faster than it can be."""
    resolution = drive.scene.grid.resolution
    for k, (track, obstacle) in enumerate(zip(drive.tracks, drive.obstacle_specs, strict=True)):
        # A small obstacle of the tick model fills its cell: its disc may be larger than its radius.
        if track.radius < obstacle.radius * (1 - ROUNDING):
            return Violation(
                "body size", f"body {k}", f"{track.radius!r} m in its track, {obstacle.radius!r}"
            )
        found = _shape(k, track, obstacle) or _heading(k, track, obstacle)
        if found is not None:
            return found
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
            return Violation("body speed", f"body {k}", what)
    return None


def _shape(k: int, track: Track, obstacle: Obstacle) -> Violation | None:
    """Whether a polygon of a track is its obstacle's, and within the disc around it."""
    if track.outline != obstacle.outline:
        return Violation("obstacle shape", f"body {k}", "its track has another outline than the obstacle")
    far = 0.0 if track.outline is None else float(np.hypot(*np.array(track.outline).T).max())
    if track.radius < far:
        return Violation("body size", f"body {k}", f"{track.radius!r} m in its track, a vertex at {far!r}")
    return None


def _heading(k: int, track: Track, obstacle: Obstacle) -> Violation | None:
    """Whether a polygon turns towards the direction in which it moves, the shorter way, and not while it stands.

    The heading of a recorded one may be given with its track.
    """
    if track.yaw is None or obstacle.kind == "recorded" or len(track.t) < 2:
        return None
    step, turn = np.diff(track.xy, axis=0), np.diff(track.yaw)
    moves = (step != 0.0).any(axis=1)
    along = np.arctan2(-step[:, 1], step[:, 0])
    before, after = (np.abs(_wrapped(along - yaw)) for yaw in (track.yaw[:-1], track.yaw[1:]))
    # Towards it: what is left to turn is less by what was turned. Over a tiny step the direction is rounded.
    bad = np.where(moves, after > before - np.abs(turn) + ANGLE, np.abs(turn) > ANGLE)
    bad &= ~moves | (np.hypot(*step.T) > 1e-6)
    if not bad.any():
        return None
    i = int(bad.argmax())
    what = (
        f"turns by {float(turn[i]):.6g} rad from {float(track.t[i]):g} s on, not to its direction of motion"
    )
    return Violation("heading", f"body {k}", what)


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
        return Violation("collision", f"body {obstacle}", what)
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
            return Violation("yield", f"body {one.obstacle}", what)
    reported = [(m.obstacle, m.t) for m in drive.moments if m.word in _MET]
    for one in episodes:
        lo, hi = one.begin - drive.period - NEAR, one.end + drive.period + NEAR
        if not any(obstacle == one.obstacle and lo <= t <= hi for obstacle, t in reported):
            what = f"touches the standing robot from {one.begin:.9g} s on; no moment tells of it"
            return Violation("untold contact", f"body {one.obstacle}", what)
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
                "told contact", f"moment {k}", f"{m.word} with obstacle {m.obstacle}, which is not there"
            )
        meetings = meetings or Meetings(drive, motion)
        gap = meetings.gap_at(m.obstacle, m.t)
        if gap > NEAR and len(motion.t0):
            what = f"{m.word} with obstacle {m.obstacle} at {m.t:.9g} s, which is {gap:.6g} m away"
            return Violation("told contact", f"moment {k}", what)
    return None
