"""Robot and obstacles: sizes, speeds, contacts, and whether they were reported."""

from __future__ import annotations

import numpy as np

from lampyris.model.drive import Drive
from lampyris.model.trace import Outcome
from lampyris.referee.geometry.moving_discs import (
    Pairs,
    RobotMotion,
    first_contact,
    gap_at,
    moving,
    pairs_of,
    standing_contacts,
)
from lampyris.referee.geometry.pose_drive import at_wall_at_the_end
from lampyris.referee.verdict import Violation

ROUNDING = 1e-9
"""Share of a value that sums may be off by."""

DUST = 1e-12
"""What a value near 0 may be off by: metres, m/s."""

NEAR = 1e-6
"""Metres within which a contact that is reported must be."""

_MET = ("hit", "contact")


def pairs_in(drive: Drive, motion: RobotMotion) -> Pairs:
    """Every part of the robot's motion with every obstacle that is there."""
    return pairs_of(motion, drive.tracks, radius_in(drive, motion), drive.scene.grid.resolution)


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


def meetings_violation(drive: Drive, motion: RobotMotion) -> Violation | None:
    """Contacts: none while the robot moves but a reported collision; the others are reported, too."""
    into_wall = _into_wall(drive)
    if into_wall and not at_wall_at_the_end(drive):
        return Violation("outcome", "drive", "collision with a wall, but the robot is at none")
    if not drive.tracks:
        if drive.outcome is Outcome.COLLISION and not into_wall:
            return Violation("outcome", "drive", "collision, but there is nobody to touch")
        return _reported_contacts(drive, motion)
    pairs = pairs_in(drive, motion)
    late = drive.duration - drive.period - ROUNDING * drive.duration
    met = first_contact(motion, pairs) if moving(motion, pairs).any() else None
    if met is not None and (drive.outcome is not Outcome.COLLISION or met[0] < late):
        t, obstacle, d = met
        reach = radius_in(drive, motion) + drive.tracks[obstacle].radius
        part = "the robot's centre" if motion.outline is None else "the robot's outline"
        what = f"{d:.9g} m from {part} at {t:.9g} s while it moves; the radii make {reach:g}"
        return Violation("collision", f"body {obstacle}", what)
    last = touching_at_the_end(drive, motion)
    if (
        met is None
        and drive.outcome is Outcome.COLLISION
        and not into_wall
        and not (last and _moves_at_the_end(drive))
    ):
        return Violation("outcome", "drive", "collision, but nobody was touched while the robot moved")
    # Anyone who lets go and comes back between two decisions has not been away.
    episodes = standing_contacts(motion, pairs, drive.period)
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


def touching_at_the_end(drive: Drive, motion: RobotMotion) -> list[int]:
    """Obstacles within a micrometre of the robot at the end: a drive may end in the instant of a contact."""
    radius, resolution = radius_in(drive, motion), drive.scene.grid.resolution
    gaps = [gap_at(motion, track, radius, resolution, drive.duration) for track in drive.tracks]
    return [k for k, gap in enumerate(gaps) if gap <= NEAR]


def _into_wall(drive: Drive) -> bool:
    """Whether a controller that steers, without the braking rule, is said to have driven into a wall."""
    words = [m for m in drive.moments if m.word == "contact"]
    without = bool(drive.paths) and drive.safety_filter == "none" and drive.outcome is Outcome.COLLISION
    return without and bool(words) and words[-1].obstacle < 0


def _moves_at_the_end(drive: Drive) -> bool:
    return len(drive.t) > 1 and bool(drive.v[-1] > 0 or drive.v[-2] > 0 or drive.a[-2] > 0)


def _reported_contacts(drive: Drive, motion: RobotMotion) -> Violation | None:
    """What is reported as a contact is one, within a micrometre."""
    radius, resolution = radius_in(drive, motion), drive.scene.grid.resolution
    for k, m in enumerate(drive.moments):
        if m.word not in _MET or (m.obstacle < 0 and _into_wall(drive)):
            continue
        if not 0 <= m.obstacle < len(drive.tracks):
            return Violation(
                "told contact", f"moment {k}", f"{m.word} with obstacle {m.obstacle}, which is not there"
            )
        gap = gap_at(motion, drive.tracks[m.obstacle], radius, resolution, m.t)
        if gap > NEAR and len(motion.t0):
            what = f"{m.word} with obstacle {m.obstacle} at {m.t:.9g} s, which is {gap:.6g} m away"
            return Violation("told contact", f"moment {k}", what)
    return None
