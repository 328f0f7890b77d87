"""Drives of a robot with a heading: its yaw on the curves, its ends, its yaw rate, and its footprint against walls."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.drive import AT_GOAL, Drive
from lampyris.model.robot import Robot
from lampyris.referee.geometry.footprint import overlapped, placed
from lampyris.referee.geometry.lines_and_arcs import SAME, pieces_of
from lampyris.referee.geometry.moving_discs import RobotMotion
from lampyris.referee.profile import wall_distance_of_points
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats, Points

ROUNDING = 1e-9
"""Share of a limit that rounding may exceed it by."""

FINE = 0.1
"""Cells that a point of the robot moves at most between two places where its footprint is laid on the map."""

NEAR_WALL = 1e-3
"""Cells from a wall within which a robot that has driven into it ends."""

NEAR_CELLS, NEAR_YAW = 1.5, 0.3
"""Cells and radians by which the nearest pose of a planner may miss the pose that was asked for."""


def with_poses(drive: Drive) -> bool:
    """Whether the drive follows curves of poses."""
    return bool(drive.curves) and all(isinstance(curve, PoseCurve) for curve in drive.curves)


def outline_in(drive: Drive) -> Points | None:
    """The footprint by which walls and contacts are judged, metres, (k, 2); None: the disc."""
    footprint = drive.scene.robot.footprint
    return np.array(footprint) if footprint is not None and with_poses(drive) else None


def curves_violation(drive: Drive) -> Violation | None:
    """Whether a curve hangs together with its yaw, and the robot's drive allows it."""
    for k in np.unique(drive.leg).tolist():
        curve = drive.curves[k]
        assert isinstance(curve, PoseCurve)
        found = _pose_curve(curve, f"curve {k}", drive.scene.robot) if len(curve.lengths) else None
        if found is not None:
            return found
    return None


def _pose_curve(curve: PoseCurve, name: str, robot: Robot) -> Violation | None:
    n = len(curve.lengths)
    if len(curve.stops) and not 0 <= curve.stops.min() <= curve.stops.max() < n:
        return Violation("curve", name, f"a stop before piece {int(curve.stops.max())} of {n}")
    pieces = pieces_of((curve,), curve.resolution)
    still, size = pieces.in_place, np.hypot(curve.heading[:, 0], curve.heading[:, 1])
    # Yaw is counted counterclockwise, the direction of travel in rows that point down.
    along = np.arctan2(-curve.heading[:, 1], curve.heading[:, 0])
    drift = np.abs(_angle(2 * (along - curve.yaw))) / 2
    yaws = np.abs(curve.turn + curve.curvature) * curve.lengths > SAME
    goes_straight = robot.drive != "omnidirectional"
    rules: tuple[tuple[str, NDArray[np.bool_], str], ...] = (
        ("curve", ~still & (np.abs(size - 1.0) > SAME), "its heading is no unit vector"),
        ("bend", np.abs(curve.curvature) * robot.turn_radius > 1.0 + SAME * 100, "it is sharper than turn_radius"),
        ("pose", ~still & goes_straight & yaws, "its yaw turns otherwise"),
        ("pose", ~still & goes_straight & (drift > 1e-4), "it moves to the side of its heading"),
        ("pose", still & (curve.curvature != 0.0), "a turn in place has a curvature"),
        ("pose", still & (robot.drive == "ackermann"), "an ackermann robot turns in place"),
        ("pose", still & (np.abs(curve.turn) * robot.radius > 1.0 + SAME), "a point of the robot moves farther than s"),
        ("pose", still & (curve.turn == 0.0), "it neither moves nor turns"),
    )  # fmt: skip
    for rule, bad, what in rules:
        if bad.any():
            return Violation(rule, f"{name}, piece {int(bad.argmax())}", what)
    every = np.arange(n)
    to, goes = pieces.place(every, pieces.end)
    gap = np.hypot(*(to / curve.resolution - np.concatenate((curve.xy[1:], [curve.end]))).T)
    yaw = np.abs(_angle(pieces.yaw_at(every, pieces.end) - np.append(curve.yaw[1:], curve.end_yaw)))
    for rule, off, unit in (("curve", gap / (1.0 + np.abs(curve.xy).max()), "cells"), ("pose", yaw, "rad")):
        if (off > SAME).any():
            k = int(off.argmax())
            return Violation(
                rule, f"{name}, piece {k}", f"ends {float(off[k]):g} {unit} from where the next begins"
            )
    turns = np.hypot(*(goes[:-1] - curve.heading[1:]).T) > 10 * SAME
    turns |= still[:-1] & still[1:] & (np.sign(curve.turn[:-1]) != np.sign(curve.turn[1:]))
    turns[curve.stops[curve.stops > 0] - 1] = False
    if turns.any():
        k = int(turns.argmax())
        return Violation("curve", f"{name}, piece {k + 1}", "changes its direction where there is no stop")
    return None


def _angle(turn: Floats) -> Floats:
    """An angle in [-pi, pi)."""
    return np.remainder(turn + math.pi, 2 * math.pi) - math.pi


def _yaw(drive: Drive, k: int, s: float) -> float:
    """Yaw in the frame of the cells at a distance along the curve of row ``k``."""
    pieces = pieces_of((drive.curves[int(drive.leg[k])],), drive.scene.grid.resolution)
    piece = max(int(np.searchsorted(pieces.begin, s, side="right")) - 1, 0)
    return float(pieces.yaw_at(np.array([piece]), np.array([min(s, float(pieces.end[piece]))]))[0])


def ends_violation(drive: Drive, first: Points, changes: NDArray[np.int64]) -> Violation | None:
    """Whether the drive begins at the start's pose, and the yaw goes on where the leg changes.

    Parameters
    ----------
    first : where it begins, cells.
    changes : rows at which another leg begins.
    """
    if not _is_near(drive, first, _yaw(drive, 0, float(drive.s[0])), "start", (0.0, 0.0)):
        return Violation("start", "stretch 0", f"begins at {first.tolist()} cells, not at the start's pose")
    for k in changes.tolist():
        dt = float(drive.t[k] - drive.t[k - 1])
        s = float(drive.s[k - 1]) + dt * (float(drive.v[k - 1]) + 0.5 * float(drive.a[k - 1]) * dt)
        off = abs(float(_angle(np.array(_yaw(drive, k - 1, s) - _yaw(drive, k, float(drive.s[k]))))))
        if off > SAME * 10:
            return Violation("leg change", f"stretch {k}", f"the yaw changes by {off:.6g} rad")
    return None


def _is_near(drive: Drive, place: Points, yaw: float, what: str, tolerance: tuple[float, float]) -> bool:
    """Whether a pose (cells, yaw in their frame) is that of the start or of the goal."""
    scene = drive.scene
    grid = scene.grid
    asked, cell = (
        (scene.start_pose, scene.start) if what == "start" else (scene.goal_pose, scene.goal)
    )  # fmt: skip
    wanted = np.array(cell, dtype=np.float64) if asked is None else grid.frame.to_points(asked[0], asked[1])
    if np.hypot(*(place - wanted)) > NEAR_CELLS + tolerance[0] / grid.resolution + SAME:
        return False
    if asked is None:
        return True
    turned = abs(float(_angle(np.array(yaw - (asked[2] - grid.origin[2])))))
    return turned <= max(NEAR_YAW, tolerance[1] + SAME)


def at_goal_pose(drive: Drive, place: Points) -> bool:
    """Whether the robot is at the end of its last curve, at the goal's pose within the planner's tolerance.

    A robot that has no curve to drive is there if it says so.
    """
    curve, s = drive.curves[int(drive.leg[-1])], float(drive.s[-1])
    length = float(np.sum(curve.lengths))
    if not len(curve.lengths) and not drive.arrived:
        return False
    if (length - s) / drive.scene.grid.resolution > AT_GOAL:
        return False
    yaw = _yaw(drive, len(drive.t) - 1, s)
    return _is_near(drive, place, yaw, "goal", drive.goal_tolerance or (0.0, 0.0))


def yaw_rate_violation(drive: Drive, motion: RobotMotion) -> Violation | None:
    """Whether the robot turns quicker than it can."""
    most = drive.scene.robot.yaw_rate_max
    if most is None or not with_poses(drive) or drive.law == "rpp":
        return None
    found = motion.top * np.abs(motion.pieces.turn[motion.piece])
    if not (found > most * (1 + 4 * ROUNDING)).any():
        return None
    k = int(found.argmax())
    what = f"{float(found[k])!r} rad/s at {float(motion.t0[k]):g} s; yaw_rate_max is {most:g}"
    return Violation("yaw rate", f"{float(motion.s[k]):g} m along", what)


def at_wall_at_the_end(drive: Drive) -> bool:
    """Whether the outline is within :data:`NEAR_WALL` of a wall where the drive ends, or the base of the map's edge."""
    outline, grid = outline_in(drive), drive.scene.grid
    res, k = grid.resolution, len(drive.t) - 1
    if outline is None:
        outline = np.zeros((1, 2))
    s, curve = float(drive.s[k]), drive.curves[int(drive.leg[k])]
    x, y = curve.at(np.array([s]))[0][0].tolist()
    edge = min(x + 0.5, y + 0.5, grid.width - 0.5 - x, grid.height - 0.5 - y)
    if edge < NEAR_WALL:
        return True
    yaw = _yaw(drive, k, s)
    turns = np.linspace(0.0, 2 * math.pi, 16, endpoint=False)
    moved = [(x + NEAR_WALL * math.cos(a), y + NEAR_WALL * math.sin(a)) for a in turns.tolist()]
    if drive.scene.robot.footprint is None:
        near = wall_distance_of_points(grid, np.array([(x, y)]), drive.scene.robot.radius / res + 1.0)
        return bool(near[0] <= drive.scene.robot.radius + NEAR_WALL * res)
    return any(overlapped(placed(outline / res, px, py, yaw), grid.blocked) is not None for px, py in moved)


def walls_violation(drive: Drive, ranges: Sequence[tuple[Curve, float, float]]) -> Violation | None:
    """Whether the footprint overlaps a blocked cell anywhere on what was driven of each curve."""
    grid, outline = drive.scene.grid, outline_in(drive)
    assert outline is not None
    res, arm = grid.resolution, float(np.hypot(*outline.T).max())
    for curve, s0, s1 in ranges:
        pieces = pieces_of((curve,), res)
        for k in range(len(pieces.bend)):
            low, high = max(s0, float(pieces.begin[k])), min(s1, float(pieces.end[k]))
            if high < low:
                continue
            moves = (high - low) * ((not pieces.in_place[k]) + abs(float(pieces.turn[k])) * arm)
            s = np.linspace(low, high, 2 + math.floor(moves / res / FINE))
            piece = np.full(len(s), k)
            places, yaws = pieces.place(piece, s)[0] / res, pieces.yaw_at(piece, s)
            near = np.flatnonzero(wall_distance_of_points(grid, places, arm + res) <= arm)
            for i in near.tolist():
                x, y = places[i].tolist()
                hit = overlapped(placed(outline / res, x, y, float(yaws[i])), grid.blocked)
                if hit is not None:
                    return Violation(
                        "wall", f"after {float(s[i]):.6g} m", f"the robot overlaps the blocked cell {hit}"
                    )
    return None
