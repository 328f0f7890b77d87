"""CSV for other programs: one row a node or a tick, all digits of every number, ``\\n`` on every system."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.trace import Trace
from lampyris.report.style import OutFile, cannot_write
from lampyris.typing import Points

PLAN_COLUMNS = ("x_m", "y_m", "yaw", "v", "t_s", "s", "a", "cause", "x", "y", "why")
PROFILE_COLUMNS = ("x_m", "y_m", "yaw", "v", "t_s", "s", "a", "cause", "why")
DRIVE_COLUMNS = ("t_s", "x_m", "y_m", "yaw", "v", "a", "s", "leg", "cause", "why")
TRACE_COLUMNS = ("x_m", "y_m", "yaw", "v", "tick", "cause", "x", "y", "event")

_TRANSFERS = {"t_s": "t_transfers"}


def write_plan_csv(out: OutFile, plan: Plan, profile: Profile, grid: Grid) -> None:
    """Write a path with its speeds, one row a node; an existing file is replaced.

    Columns: ``x_m``, ``y_m`` metres of the map frame (cell centres); ``yaw`` radians in the map frame, -pi
    to pi, of the step that leaves the node (the last keeps the one before); ``v``, ``t_s``, ``s``, ``a`` in
    m/s, s, m and m/s2 (of a law in velocity units these are velocity units and cells, and ``t_transfers``
    stands in place of ``t_s``); ``cause`` what binds v; ``x``, ``y`` the cell; ``why`` the cause in words,
    with what it speaks of. A plan with a schedule has ``tick`` before that: when the robot is to enter the
    cell. Its times are of the drive alone and know nothing of the waiting.

    Raises
    ------
    UsageError : a plan without a path, or a profile of another one.
    FileError : the system refuses to write.
    """
    path = plan.path
    if path is None or len(path.cells) != len(profile.v):
        nodes = 0 if path is None else len(path.cells)
        raise UsageError(
            "CSV", f"a path of {nodes} nodes and {len(profile.v)} speeds", allowed="a path and its profile"
        )
    xy = grid.to_metres(path.cells).tolist()
    yaw = [_turned(h, grid.origin[2]) for h in path.heading.tolist()]
    numbers = (profile.v, profile.t, profile.s, profile.a)
    rows = (
        (*map(repr, (x, y, turn, *more)), cause, cx, cy)
        for (x, y), turn, more, cause, (cx, cy) in zip(
            xy,
            yaw,
            zip(*(n.tolist() for n in numbers), strict=True),
            profile.cause,
            path.cells.tolist(),
            strict=True,
        )
    )
    why = [profile.why(k) for k in range(len(profile.v))]
    columns = PLAN_COLUMNS if profile.metric else tuple(_TRANSFERS.get(c, c) for c in PLAN_COLUMNS)
    if plan.schedule is None:
        _write(out, columns, ((*row, w) for row, w in zip(rows, why, strict=True)))
        return
    ticks = plan.schedule.tolist()
    columns = (*columns[:-1], "tick", columns[-1])
    _write(out, columns, ((*row, t, w) for row, t, w in zip(rows, ticks, why, strict=True)))


def write_profile_csv(out: OutFile, profile: Profile, heading: Points, grid: Grid) -> None:
    """Write a profile with its places, one row a node; an existing file is replaced.

    Columns as in :func:`write_plan_csv`; the places are on the curve, not at cells. A wait is two rows at one
    place.

    Parameters
    ----------
    heading : float64 (n, 2), unit vectors, y down: where the robot leaves each node to.

    Raises
    ------
    UsageError : a profile without places, or headings of another one.
    FileError : the system refuses to write.
    """
    if profile.xy is None or len(heading) != len(profile.v):
        what = f"{len(heading)} headings for {len(profile.v)} nodes"
        raise UsageError("CSV", what, allowed="a profile of a course, and its headings")
    numbers = (profile.v, profile.t, profile.s, profile.a)
    rows = (
        (*map(repr, (x, y, yaw, *more)), cause, profile.why(k))
        for k, ((x, y), yaw, more, cause) in enumerate(
            zip(
                grid.to_metres(profile.xy).tolist(),
                _yaws(heading, grid),
                zip(*(n.tolist() for n in numbers), strict=True),
                profile.cause,
                strict=True,
            )
        )
    )
    _write(out, PROFILE_COLUMNS, rows)


def write_drive_csv(out: OutFile, drive: Drive) -> None:
    """Write a drive in continuous time, one row for each stretch and one for the end.

    Columns: ``t_s`` seconds; ``x_m``, ``y_m``, ``yaw`` in the map frame; ``v`` m/s at that time, ``a`` m/s2
    until the next row; ``s`` metres along the curve number ``leg``; ``cause`` what binds the speed until
    the next row, ``why`` the same in words. The obstacles' tracks are in the JSON, not here.

    Raises
    ------
    FileError : the system refuses to write.
    """
    grid, n = drive.scene.grid, len(drive.t)
    xy, heading = np.zeros((n, 2)), np.zeros((n, 2))
    for leg in np.unique(drive.leg).tolist():
        here = drive.leg == leg
        xy[here], heading[here] = drive.curves[leg].at(drive.s[here])
    rows = (
        (*map(repr, (t, x, y, yaw, v, a, s)), leg, cause, drive.why(k))
        for k, (t, (x, y), yaw, v, a, s, leg, cause) in enumerate(
            zip(
                drive.t.tolist(),
                grid.to_metres(xy).tolist(),
                _yaws(heading, grid),
                drive.v.tolist(),
                drive.a.tolist(),
                drive.s.tolist(),
                drive.leg.tolist(),
                drive.cause,
                strict=True,
            )
        )
    )
    _write(out, DRIVE_COLUMNS, rows)


def _yaws(heading: Points, grid: Grid) -> list[float]:
    """Headings as angles of the map frame."""
    return [_turned(math.atan2(0.0 - hy, hx), grid.origin[2]) for hx, hy in heading.tolist()]


def write_trace_csv(out: OutFile, trace: Trace) -> None:
    """Write the robot's drive, one row a tick; an existing file is replaced.

    Columns as in :func:`write_plan_csv`, with ``tick`` in place of ``t_s`` and ``event`` the words of that
    tick's events, joined by ``+``. The yaw is that of the step that led to the cell; a waiting robot keeps
    it, and before its first step it looks along that. The obstacles' tracks are in the JSON, not here.

    Raises
    ------
    FileError : the system refuses to write.
    """
    grid = trace.scene.grid
    cells = trace.robot.tolist()
    words: dict[int, list[str]] = {}
    for event in trace.events:
        words.setdefault(event.tick, []).append(event.word)
    headings: list[float | None] = [None]
    for (x0, y0), (x1, y1) in pairwise(cells):
        moved = (x0, y0) != (x1, y1)
        headings.append(math.atan2(y0 - y1, x1 - x0) if moved else headings[-1])
    first = next((h for h in headings if h is not None), 0.0)
    rows = (
        (
            *map(repr, (x_m, y_m, _turned(first if h is None else h, grid.origin[2]), v)),
            tick,
            cause,
            *cells[tick],
            "+".join(words.get(tick, ())),
        )
        for tick, ((x_m, y_m), h, v, cause) in enumerate(
            zip(
                grid.to_metres(trace.robot).tolist(), headings, trace.speed.tolist(), trace.cause, strict=True
            )
        )
    )
    _write(out, TRACE_COLUMNS, rows)


def _turned(heading: float, yaw: float) -> float:
    """A heading turned by the map's yaw, within -pi .. pi."""
    return heading if yaw == 0 else math.remainder(heading + yaw, 2 * math.pi)


def _write(out: OutFile, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    try:
        with open(out, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(rows)
    except OSError as error:
        raise cannot_write(out, error) from None
