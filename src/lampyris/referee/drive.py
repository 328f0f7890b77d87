"""Drives: a robot in continuous time, its limits at and between nodes, walls, and discs against discs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.model.curve import Curve
from lampyris.model.drive import AT_GOAL, Drive
from lampyris.model.trace import Outcome
from lampyris.referee.geometry.lines_and_arcs import SAME, joins, nearest_wall, pieces_of, wall_along
from lampyris.referee.geometry.moving_discs import (
    STANDS,
    RobotMotion,
    motion_of,
)
from lampyris.referee.geometry.pose_drive import (
    at_goal_pose,
    curves_violation,
    ends_violation,
    outline_in,
    walls_violation,
    with_poses,
    yaw_rate_violation,
)
from lampyris.referee.geometry.separation import obstacles_violation
from lampyris.referee.geometry.shapes import Ints, stands_free
from lampyris.referee.meetings import (
    DUST,
    ROUNDING,
    Meetings,
    meetings_violation,
    tracks_violation,
)
from lampyris.referee.simulations.drive_sensing import drive_sensing_violation
from lampyris.referee.simulations.visits import drive_visits_violation
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

NO_LATERAL_PROMISE = ("dissertation", "rpp")
"""Laws that say nothing of lateral acceleration: theirs is measured, not refused."""

EARLY = 1e-5
"""Cells that a robot may be ahead of its planned times: rounding."""

_NEVER = (Outcome.NO_PATH, Outcome.START_OCCUPIED, Outcome.GOAL_OCCUPIED)


def check_drive(drive: Drive) -> Violation | None:
    """Whether a drive broke a rule anywhere between its begin and its end.

    Rules, in this order: ``lengths``, ``obstacles``, ``time``, ``leg``, ``curve``, ``bend``, ``distance`` (s
    does not follow from v and a), ``start``, ``leg change``, ``speed``, ``pace`` (v does not follow from a),
    ``acceleration``, ``braking``, ``turn`` (drives over a stop), ``planned times`` (ahead of them), ``lateral`` (not
    for the laws of :data:`NO_LATERAL_PROMISE`), ``outside``, ``wall``; of a robot without
    the map ``seen``, ``sight``, ``unseen``; ``via``; of obstacles ``obstacle shape``, ``obstacle size``,
    ``obstacle speed``, ``obstacle heading``, ``collision`` (contact while the robot moves), ``yield`` (one that
    yields ran into it), ``unreported contact``, ``reported contact``, ``obstacles apart`` (two obstacles overlap:
    :mod:`lampyris.referee.geometry.separation`); ``outcome``, ``moments``, ``numbers``.

    On curves of poses there are also ``pose`` (yaw and curve do not fit each other, or not the robot's drive) and ``yaw
    rate``; walls and contacts are those of the footprint, and to turn in place is to move.

    Contact is an overlap of more than 1e-9 m, with a polygon a distance of less than 1e-8 m. A jerk limit is not judged:
    a stretch has one acceleration, so that the jerk between two is not defined.
    """
    found = _shapes(drive) or _legs(drive)
    if found is not None or drive.outcome in _NEVER:
        return found or _never(drive) or _moments(drive)
    motion = _motion(drive)
    return (
        _curves(drive)
        or _driven(drive)
        or _limits(drive)
        or _stops(drive)
        or _planned_times(drive)
        or _lateral(drive, motion)
        or yaw_rate_violation(drive, motion)
        or _walls(drive)
        or drive_sensing_violation(drive)
        or drive_visits_violation(drive)
        or tracks_violation(drive)
        or meetings_violation(drive, motion)
        or obstacles_violation(
            drive.tracks, drive.obstacle_specs, drive.scene.grid.resolution, drive.duration
        )
        or _end(drive)
        or _moments(drive)
        or _numbers(drive)
    )


def measure(drive: Drive) -> dict[str, Any]:
    """What the referee saw, in numbers; also what some laws do not promise.

    Keys: ``duration``, ``ratio`` (to the time optimum; None if that is not known), ``length`` (metres
    driven), ``stood`` (seconds), ``lateral`` (greatest, m/s2), ``peak_accel``, ``peak_braking``, ``wall``
    (least distance from the centre to a wall, metres, infinity beyond the radius + 1 m), ``gap`` (least
    distance of the rims to an obstacle while moving; below 0 they overlap), ``gap_when``, ``gap_body``,
    ``collisions`` (obstacles in contact while the robot moved), ``hits`` (contacts while it stood). Of a polygon that is on the
    robot the gap is 0.
    """
    empty = len(drive.t) < 2 or not drive.curves
    motion = None if empty else _motion(drive)
    dt = np.diff(drive.t)
    still = (drive.v[:-1] <= STANDS) & (drive.v[1:] <= STANDS)
    out: dict[str, Any] = {
        "duration": drive.duration,
        "ratio": drive.duration / drive.optimum if drive.optimum else None,
        "length": float(sum(s1 - s0 for _, s0, s1 in _ranges(drive))),
        "stood": float(dt[still].sum()),
        "lateral": 0.0 if motion is None else float(motion.lateral.max(initial=0.0)),
        "peak_accel": float(np.maximum(drive.a, 0.0).max(initial=0.0)),
        "peak_braking": float(np.maximum(-drive.a, 0.0).max(initial=0.0)),
        "wall": float("inf"),
        "gap": float("inf"),
        "gap_when": 0.0,
        "gap_body": -1,
        "collisions": 0,
        "hits": 0,
    }
    grid, radius = drive.scene.grid, drive.scene.robot.radius
    for curve, s0, s1 in _ranges(drive):
        out["wall"] = min(out["wall"], nearest_wall(curve, s0, s1, grid, radius + 1.0))
    if motion is not None:
        meetings = Meetings(drive, motion)
        out["gap"], out["gap_when"], out["gap_body"] = meetings.nearest()
        episodes = meetings.standing(drive.period)
        met = {k for k in range(len(drive.tracks)) if meetings.first(k)}
        last = set(meetings.touching_at_the_end())
        if drive.outcome is Outcome.COLLISION:
            met |= last
        fresh = last - {e.obstacle for e in episodes} if drive.outcome is Outcome.HIT else set()
        out["collisions"], out["hits"] = len(met), len(episodes) + len(fresh)
    return out


def _motion(drive: Drive) -> RobotMotion:
    pieces = pieces_of(drive.curves, drive.scene.grid.resolution)
    return motion_of(drive.t, drive.s, drive.v, drive.a, drive.leg, pieces, outline_in(drive))


def _at(rule: str, bad: NDArray[np.bool_], sentence: str, *values: Floats) -> Violation | None:
    """A violation at the first True; the sentence's braces are filled with the values there."""
    if not bad.any():
        return None
    k = int(bad.argmax())
    return Violation(rule, f"stretch {k}", sentence.format(*(repr(float(v[k])) for v in values)))


# ---- the robot alone ---------------------------------------------------------------------------------


def _shapes(drive: Drive) -> Violation | None:
    n = len(drive.t)
    sizes = {len(x) for x in (drive.t, drive.s, drive.v, drive.a, drive.leg, drive.cause, drive.cause_index)}
    if len(sizes) != 1 or n == 0:
        return Violation("lengths", "drive", f"{sorted(sizes)} values; one or more of each, and all alike")
    if len(drive.tracks) != len(drive.obstacle_specs):
        return Violation(
            "tracks", "drive", f"{len(drive.tracks)} tracks of {len(drive.obstacle_specs)} obstacles"
        )
    if not np.isfinite(np.concatenate((drive.t, drive.s, drive.v, drive.a))).all():
        return Violation("lengths", "drive", "a value that is not a finite number")
    if drive.t[0] != 0:
        return Violation("time", "stretch 0", f"begins at {float(drive.t[0])!r}; must be 0")
    return _at("time", ~(np.diff(drive.t) > 0), "from {} to {} s", drive.t, drive.t[1:])


def _never(drive: Drive) -> Violation | None:
    """Outcomes of a robot that never could start: it stands, and the reason is true as far as can be seen."""
    word = drive.outcome.value
    if (drive.v > 0).any() or (drive.a != 0).any() or (np.diff(drive.s) != 0).any():
        return Violation("outcome", "drive", f"{word}, but the robot drives")
    if drive.outcome is Outcome.NO_PATH:
        return None
    end = drive.scene.start if drive.outcome is Outcome.START_OCCUPIED else drive.scene.goal
    if stands_free(drive.scene.grid, end, drive.scene.robot.radius):
        return Violation("outcome", "drive", f"{word}, but the robot can stand on {end}")
    return None


def _legs(drive: Drive) -> Violation | None:
    leg = drive.leg
    if drive.outcome in _NEVER and not drive.curves:
        return None
    bad = (leg < 0) | (leg >= len(drive.curves))
    if bad.any():
        k = int(bad.argmax())
        return Violation("leg", f"stretch {k}", f"on curve {int(leg[k])} of {len(drive.curves)}")
    step = np.diff(leg)
    if (step < 0).any():
        k = int((step < 0).argmax())
        return Violation("leg", f"stretch {k + 1}", f"goes back from curve {leg[k]} to {leg[k + 1]}")
    resolution = drive.scene.grid.resolution
    for k, curve in enumerate(drive.curves):
        if curve.resolution != resolution:
            what = f"{curve.resolution!r} metres a cell; the map has {resolution!r}"
            return Violation("curve", f"curve {k}", what)
    return None


def _curves(drive: Drive) -> Violation | None:
    if with_poses(drive):
        return curves_violation(drive)
    for k in np.unique(drive.leg).tolist():
        found = joins(drive.curves[k], f"curve {k}", drive.scene.robot.turn_radius)
        if found is not None:
            return found
    return None


def _places(drive: Drive, leg: Ints, s: Floats) -> Floats:
    """Where some distances along some curves are, cells; (m, 2)."""
    pieces = pieces_of(drive.curves, drive.scene.grid.resolution)
    piece = np.zeros(len(s), dtype=np.int64)
    for k in np.unique(leg).tolist():
        lo, hi = int(pieces.first[k]), int(pieces.first[k + 1])
        here = leg == k
        found = np.searchsorted(pieces.begin[lo:hi], s[here], side="right") - 1
        piece[here] = lo + np.clip(found, 0, hi - lo - 1)
    place = pieces.place(piece, s)[0] / drive.scene.grid.resolution
    return np.asarray(place)


def _driven(drive: Drive) -> Violation | None:
    """Distances follow from speeds, on the curve; the first place is the start; curves follow each other."""
    s, v, a, leg = drive.s, drive.v, drive.a, drive.leg
    ends = np.array([float(np.sum(c.lengths)) for c in drive.curves])[leg]
    give = ROUNDING * np.maximum(ends, 1.0)
    found = _at("distance", (s < -give) | (s > ends + give), "{} m along a curve of {} m", s, ends)
    if found is not None:
        return found
    dt = np.diff(drive.t)
    to = s[:-1] + dt * (v[:-1] + 0.5 * a[:-1] * dt)
    give = (
        ROUNDING * np.maximum(np.abs(to - s[:-1]), np.abs(s[1:]))
        + DUST
        + np.maximum(v[:-1], v[1:]) * _clock(drive)
    )
    same = leg[1:] == leg[:-1]
    found = _at("distance", same & ~(np.abs(s[1:] - to) <= give), "ends at {} m, not {}", to, s[1:])
    if found is not None:
        return found
    place = _places(drive, leg, s)
    start = np.array(drive.scene.start, dtype=np.float64)
    if with_poses(drive):
        found = ends_violation(drive, place[0], np.flatnonzero(~same) + 1)
        if found is not None:
            return found
    elif np.abs(place[0] - start).max() > SAME:
        return Violation(
            "start", "stretch 0", f"begins at {_xy(place[0])} cells; the start is {drive.scene.start}"
        )
    for k in np.flatnonzero(~same).tolist():
        if v[k + 1] > STANDS:
            what = f"changes to curve {leg[k + 1]} at {float(v[k + 1])!r} m/s; must stand"
            return Violation("leg change", f"stretch {k + 1}", what)
        came = _places(drive, leg[k : k + 1], to[k : k + 1])[0]
        if np.abs(came - place[k + 1]).max() > SAME:
            what = f"changes to curve {leg[k + 1]} from {_xy(came)} to {_xy(place[k + 1])} cells"
            return Violation("leg change", f"stretch {k + 1}", what)
    return None


def _planned_times(drive: Drive) -> Violation | None:
    """A robot with planned times is never ahead of them: when it should leave a place it is there or before it."""
    for leg, table in enumerate(drive.timetables):
        here = np.flatnonzero(drive.leg == leg)
        if table is None or not len(here):
            continue
        end = drive.t[min(int(here[-1]) + 1, len(drive.t) - 1)]
        due = (table.leave >= drive.t[here[0]]) & (table.leave <= end)
        k = here[np.searchsorted(drive.t[here], table.leave[due], side="right") - 1]
        dt = np.minimum(table.leave[due], end) - drive.t[k]
        place = drive.s[k] + dt * (drive.v[k] + 0.5 * drive.a[k] * dt)
        early = place > table.s[due] + EARLY * drive.scene.grid.resolution
        if early.any():
            j = int(early.argmax())
            what = f"at {float(place[j])!r} m; the plan is at {float(table.s[due][j])!r} m"
            return Violation("planned times", f"{float(table.leave[due][j]):.6g} s", what)
    return None


def _xy(place: Floats) -> str:
    return f"({place[0]:.6g}, {place[1]:.6g})"


def _clock(drive: Drive) -> Floats:
    """Seconds by which the rounding of the times at both ends may change a stretch's duration, (n - 1,)."""
    return np.asarray(2 * np.spacing(np.abs(drive.t[1:])))


def _limits(drive: Drive) -> Violation | None:
    """Speeds and accelerations; within a stretch the speed lies between those at its ends."""
    robot, v, a = drive.scene.robot, drive.v, drive.a
    dt = np.diff(drive.t)
    to = v[:-1] + a[:-1] * dt
    give = ROUNDING * np.maximum(np.maximum(v[:-1], v[1:]), np.abs(a[:-1]) * dt) + DUST
    give += np.abs(a[:-1]) * _clock(drive)
    more = 1 + ROUNDING
    n = len(v)
    return (
        _at("speed", ~(v >= 0), "{} m/s", v)
        or _at("pace", ~(np.abs(v[1:] - to) <= give), "ends at {} m/s, not {}", to, v[1:])
        or _at("speed", v > robot.v_max * more, "{} m/s; v_max is {}", v, np.full(n, robot.v_max))
        or _at("acceleration", a > robot.a_max * more, "{} m/s2; a_max is {}", a, np.full(n, robot.a_max))
        or _at("braking", -a > robot.d_max * more, "{} m/s2; d_max is {}", a, np.full(n, robot.d_max))
        or _at("acceleration", np.append(np.zeros(n - 1), a[-1]) != 0, "a is {} where it ends", a)
    )


def _ranges(drive: Drive) -> list[tuple[Curve, float, float]]:
    """What was driven of each curve: from where to where."""
    out = []
    for k in np.unique(drive.leg).tolist():
        if k < 0 or k >= len(drive.curves):
            continue
        own = np.flatnonzero(drive.leg == k)
        end = float(drive.s[own[-1]])
        if own[-1] + 1 < len(drive.t):  # it leaves this curve at the end of that stretch
            dt = float(drive.t[own[-1] + 1] - drive.t[own[-1]])
            end += dt * (float(drive.v[own[-1]]) + 0.5 * float(drive.a[own[-1]]) * dt)
        out.append((drive.curves[k], float(drive.s[own[0]]), end))
    return out


def _stops(drive: Drive) -> Violation | None:
    """At a stop of a curve the robot stands: a node lies there, with speed 0."""
    for (curve, s0, s1), k in zip(_ranges(drive), np.unique(drive.leg).tolist(), strict=True):
        if len(curve.stops) == 0:
            continue
        own = drive.leg == k
        begins = np.concatenate(([0.0], np.cumsum(curve.lengths)))
        for stop in begins[curve.stops].tolist():
            give = ROUNDING * max(1.0, stop)
            if stop <= s0 + give or stop >= s1 - give:
                continue
            there = own & (np.abs(drive.s - stop) <= give)
            if not (there & (drive.v <= STANDS)).any():
                return Violation("turn", f"curve {k}", f"does not stand at {stop!r} m, where it must turn")
    return None


def _lateral(drive: Drive, motion: RobotMotion) -> Violation | None:
    if drive.law in NO_LATERAL_PROMISE:
        return None
    found = motion.lateral
    limit = drive.scene.robot.a_lat_max
    bad = found > limit * (1 + 4 * ROUNDING)
    if not bad.any():
        return None
    k = int(bad.argmax())
    what = f"{float(found[k])!r} m/s2 to the side at {float(motion.t0[k]):g} s; a_lat_max is {limit:g}"
    return Violation("lateral", f"{float(motion.s[k]):g} m along", what)


def _walls(drive: Drive) -> Violation | None:
    grid, radius = drive.scene.grid, drive.scene.robot.radius
    place = _places(drive, drive.leg, drive.s)
    edge = np.array((grid.width, grid.height)) - 0.5
    off = ((place < -0.5 - SAME) | (place > edge + SAME)).any(axis=1)
    if off.any():
        k = int(off.argmax())
        return Violation("outside", f"stretch {k}", f"{_xy(place[k])} is off the map")
    if outline_in(drive) is not None:
        return walls_violation(drive, _ranges(drive))
    for (curve, s0, s1), k in zip(_ranges(drive), np.unique(drive.leg).tolist(), strict=True):
        found = wall_along(curve, s0, s1, grid, radius)
        if found is not None:
            d, s, cell = found
            what = f"{d:.9g} m from the wall at {cell}; the radius is {radius:g}"
            return Violation("wall", f"curve {k}, after {s:.6g} m", what)
    return None


# ---- the story ---------------------------------------------------------------------------------------


def _end(drive: Drive) -> Violation | None:
    """Arrived means standing on the goal, and the other way round; only two endings leave it moving.

    On the goal is within :data:`lampyris.model.drive.AT_GOAL`, the simulation's own tolerance.
    """
    word, v = drive.outcome.value, float(drive.v[-1])
    place = _places(drive, drive.leg[-1:], drive.s[-1:])[0]
    there = np.abs(place - np.array(drive.scene.goal)).max() <= AT_GOAL
    if with_poses(drive):
        there = at_goal_pose(drive, place)
    # A controller that steers may go on for a robot that stands within the tolerance, to turn to the goal's yaw.
    short = bool(drive.paths) and not drive.arrived
    visited = len(drive.via_times) == len(drive.via)
    if not short and drive.arrived != bool(there and v == 0.0 and visited):
        what = f"{word}, and the robot is at {_xy(place)} with {v!r} m/s; the goal is {drive.scene.goal}"
        return Violation("outcome", "drive", what)
    if v > 0 and drive.outcome not in (Outcome.COLLISION, Outcome.TIMEOUT):
        return Violation("outcome", "drive", f"{word}, and the robot still drives {v!r} m/s")
    return None


def _moments(drive: Drive) -> Violation | None:
    before = 0.0
    for k, m in enumerate(drive.moments):
        if not before <= m.t <= drive.duration:
            what = f"{m.word!r} at {m.t!r} s, after one at {before!r}, of {drive.duration!r}"
            return Violation("moments", f"moment {k}", what)
        if not -1 <= m.obstacle < len(drive.tracks):
            return Violation("moments", f"moment {k}", f"{m.word!r} speaks of obstacle {m.obstacle}")
        if m.word == "arrive" and not drive.arrived:
            return Violation("moments", f"moment {k}", f"arrives, and the outcome is {drive.outcome.value}")
        before = m.t
    return None


def _numbers(drive: Drive) -> Violation | None:
    if min(drive.replans, drive.expansions) < 0 or not drive.period > 0 or not drive.error >= 0:
        what = (
            f"{drive.replans} replans, {drive.expansions} expansions, {drive.period!r} s, {drive.error!r} m"
        )
        return Violation("numbers", "drive", what)
    return None
