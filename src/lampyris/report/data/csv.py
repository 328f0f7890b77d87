"""CSV for other programs: one row a node or a tick, all digits of every number, ``\\n`` on every system."""

from __future__ import annotations

import csv
from collections.abc import Sequence

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.drive import Drive, PlannedTimes
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.model.plan import Plan
from lampyris.model.profile import NodeTable, Profile
from lampyris.model.trace import Trace
from lampyris.report.data.columns import (
    Columns,
    cells_columns,
    drive_columns,
    path_columns,
    profile_columns,
    trace_columns,
    yaws,
)
from lampyris.report.style import OutFile, cannot_write
from lampyris.typing import Points

PLAN_COLUMNS = ("x_m", "y_m", "yaw", "v", "t_s", "s", "a", "cause", "x", "y", "why")
PROFILE_COLUMNS = ("x_m", "y_m", "yaw", "v", "t_s", "s", "a", "cause", "why")
POSE_COLUMNS = (*PROFILE_COLUMNS[:4], "gear", *PROFILE_COLUMNS[4:])
DRIVE_COLUMNS = ("t_s", "x_m", "y_m", "yaw", "v", "a", "s", "leg", "cause", "why")
TRACE_COLUMNS = ("x_m", "y_m", "yaw", "v", "tick", "cause", "x", "y", "event")
FLEET_COLUMNS = ("robot", "tick", "x", "y")

_TRANSFERS = {"t_s": "t_transfers"}


def write_plan_csv(
    out: OutFile, plan: Plan, profile: Profile, grid: Grid, nodes: NodeTable | None = None
) -> None:
    """Write a path with its speeds, one row a node; an existing file is replaced.

    Columns: ``x_m``, ``y_m`` metres of the map frame (cell centres); ``yaw`` radians in the map frame, -pi
    to pi, of the step that leaves the node (the last keeps the one before); ``v``, ``t_s``, ``s``, ``a`` in
    m/s, s, m and m/s2 (of a law in velocity units these are velocity units and cells, and ``t_transfers``
    stands in place of ``t_s``); ``cause`` what binds v; ``x``, ``y`` the cell; ``why`` the cause in words,
    with what it speaks of. A plan with a schedule has ``tick`` before that: when the robot is to enter the
    cell. Its times are of the drive alone and know nothing of the waiting. Then come the columns of ``nodes``, empty where
    there is no value. A plan of poses has the columns of
    :func:`write_profile_csv` and ``gear`` (1 ahead, -1 in reverse, 0 in place); its yaw is that of the robot, also in reverse.
    One with times has ``planned_reach_s``, ``planned_leave_s`` too: when the plan reaches the node and leaves it. ``t_s`` is
    when the speed law reaches it, which knows of no waiting.

    Raises
    ------
    UsageError : a plan without a path, or a profile of another one.
    FileError : the system refuses to write.
    """
    path = plan.path
    if plan.pose_path is not None:
        columns = profile_columns(profile, grid.frame)
        poses, turned = plan.pose_path, plan.pose_path.turned_in_place
        # What a radian turned in place counts as in the profile.
        arm = max(float(profile.s[-1]) - poses.length_m, 0.0) / turned if turned > 0 else 0.0
        columns["yaw"] = poses.yaw_at(profile.s, arm).tolist()
        columns["gear"] = poses.gear_at(profile.s, arm).tolist()
        if not profile.metric:
            columns["t_s"] = columns.pop("t_transfers")
        names: tuple[str, ...] = POSE_COLUMNS
        if poses.times is not None:
            columns["planned_reach_s"], columns["planned_leave_s"] = _planned_times(poses, arm, profile)
            names = (*names[:-2], "planned_reach_s", "planned_leave_s", *names[-2:])
        _write(out, names, columns)
        return
    if path is None or len(path.cells) != len(profile.v):
        length = 0 if path is None else len(path.cells)
        raise UsageError(
            "CSV", f"a path of {length} nodes and {len(profile.v)} speeds", allowed="a path and its profile"
        )
    columns = path_columns(path, grid.frame) | cells_columns(path) | profile_columns(profile, None)
    names = PLAN_COLUMNS if profile.metric else tuple(_TRANSFERS.get(c, c) for c in PLAN_COLUMNS)
    if plan.schedule is not None:
        columns["tick"] = plan.schedule.tolist()
        names = (*names[:-1], "tick", names[-1])
    around = {
        name: ["" if value is None else value for value in column]
        for name, column in ({} if nodes is None else nodes.columns()).items()
    }
    _write(out, (*names, *around), columns | around)


def _planned_times(poses: PosePath, arm: float, profile: Profile) -> tuple[list[float], list[float]]:
    """When the plan reaches each node of a profile and leaves it, seconds; each wait is at the node nearest to its place."""
    assert poses.times is not None
    along = np.concatenate(([0.0], np.cumsum(poses.steps_in(arm))))
    reach = PlannedTimes(along, poses.times[:, 0], poses.times[:, 1]).times(profile.s)
    leave = reach.copy()
    waits = poses.times[:, 1] - poses.times[:, 0]
    for k in np.flatnonzero(waits > 0.0).tolist():
        node = int(np.abs(profile.s - along[k]).argmin())
        if profile.s[node] >= along[k]:
            reach[node] -= waits[k]
        else:
            leave[node] += waits[k]
    return reach.tolist(), leave.tolist()


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
        raise UsageError("CSV", what, allowed="a profile of a sampled path, and its headings")
    columns = profile_columns(profile, grid.frame) | {"yaw": yaws(heading, grid.frame)}
    if not profile.metric:
        columns["t_s"] = columns.pop("t_transfers")
    _write(out, PROFILE_COLUMNS, columns)


def write_drive_csv(out: OutFile, drive: Drive) -> None:
    """Write a drive in continuous time, one row for each stretch and one for the end.

    Columns: ``t_s`` seconds; ``x_m``, ``y_m``, ``yaw`` in the map frame; ``v`` m/s at that time, ``a`` m/s2
    until the next row; ``s`` metres along the curve number ``leg``; ``cause`` what binds the speed until
    the next row, ``why`` the same in words. The obstacles' tracks are in the JSON, not here.

    Raises
    ------
    FileError : the system refuses to write.
    """
    names: tuple[str, ...] = DRIVE_COLUMNS
    if drive.timetables:
        names = (*names[:-2], "planned_t_s", *names[-2:])
    _write(out, names, drive_columns(drive))


def write_trace_csv(out: OutFile, trace: Trace) -> None:
    """Write the robot's drive, one row a tick; an existing file is replaced.

    Columns as in :func:`write_plan_csv`, with ``tick`` in place of ``t_s`` and ``event`` the words of that
    tick's events, joined by ``+``. The yaw is that of the step that led to the cell; a waiting robot keeps
    it, and before its first step it looks along that. The obstacles' tracks are in the JSON, not here.

    Raises
    ------
    FileError : the system refuses to write.
    """
    _write(out, TRACE_COLUMNS, trace_columns(trace))


def write_fleet_csv(out: OutFile, plan: FleetPlan) -> None:
    """Write a plan of a fleet, one row a robot and tick until it stays; an existing file is replaced.

    Columns: ``robot``, ``tick``, ``x``, ``y`` (the cell).

    Raises
    ------
    FileError : the system refuses to write.
    """
    lengths = [len(path) for path in plan.paths]
    whole = np.concatenate([np.zeros((0, 2), dtype=np.int32), *plan.paths])
    columns: Columns = {
        "robot": np.repeat(np.arange(len(lengths)), lengths).tolist(),
        "tick": [tick for length in lengths for tick in range(length)],
        "x": whole[:, 0].tolist(),
        "y": whole[:, 1].tolist(),
    }
    _write(out, FLEET_COLUMNS, columns)


def _write(out: OutFile, names: Sequence[str], columns: Columns) -> None:
    """These columns, in this order; floats are written with all their digits, as by ``repr``."""
    rows = zip(*(columns[name] for name in names), strict=True)
    try:
        with open(out, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(names)
            writer.writerows(rows)
    except OSError as error:
        raise cannot_write(out, error) from None
