"""Judges the order in which the robots of a drive visit each cell, against the plans that they drove."""

from __future__ import annotations

import numpy as np

from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.referee.verdict import Violation
from lampyris.typing import Cells

_LATE = 1e-6
_POINT = 2e-9
"""Metres that are no motion: a robot as near to the centre of a cell is on it."""


def order_violation(trace: FleetTrace) -> Violation | None:
    """The first visit of a cell that is not in the order of its plan, or off the path; None: there is none.

    A robot is on a cell from when its centre comes to the centre of it until it comes to the next one. Of two robots that a
    plan has on one cell one after the other, the first must have come to its next cell when the second comes to this one.
    """
    if not trace.plans:
        return None
    bounds = [*trace.plan_times[1:], np.inf]
    for k, (paths, begin, end) in enumerate(zip(trace.plans, trace.plan_times, bounds, strict=True)):
        found = _check_plan(trace, k, paths, begin, end)
        if found is not None:
            return found
    return None


def _check_plan(
    trace: FleetTrace, number: int, paths: tuple[Cells, ...], begin: float, end: float
) -> Violation | None:
    last: dict[tuple[int, int], tuple[int, float]] = {}
    visits: list[tuple[int, int, tuple[int, int], float, float]] = []
    for robot, path in enumerate(paths):
        moved = np.flatnonzero((np.diff(path, axis=0) != 0).any(axis=1)) + 1
        ticks = [0, *moved.tolist()]
        cells = [tuple(cell) for cell in path[ticks].tolist()]
        times = _times(trace, robot, cells, begin, end)
        if times is None:
            return Violation("order", f"robot {robot}", f"leaves the path of plan {number}")
        for m, when in enumerate(times):
            gone = times[m + 1] if m + 1 < len(times) else np.inf
            visits.append((ticks[m], robot, cells[m], when, gone))
    # By the plan's ticks: each visit after all earlier ones of its cell.
    for tick, robot, cell, when, gone in sorted(visits, key=lambda one: one[:2]):
        before = last.get(cell)
        if before is not None and before[0] != robot and before[1] > when + _LATE * (1.0 + when):
            words = f"comes to {cell} at {when:.6f} s; robot {before[0]}, planned before it, leaves at {before[1]:.6f} s"
            return Violation("order", f"robot {robot}, tick {tick} of plan {number}", words)
        last[cell] = robot, gone
    return None


def _times(
    trace: FleetTrace, robot: int, cells: list[tuple[int, ...]], begin: float, end: float
) -> list[float] | None:
    """When a robot comes to each cell of its path, as far as it goes; None: it drives elsewhere."""
    slack = _LATE * (1.0 + begin)
    rows = np.flatnonzero((trace.robot == robot) & (trace.t >= begin - slack) & (trace.t < end - slack))
    centres = trace.grid.to_metres(np.array(cells))
    near = 1e-5 * trace.grid.resolution
    times, at = [begin], 0
    for row in rows.tolist():
        far = trace.duration[row] * (trace.v[row] + 0.5 * trace.a[row] * trace.duration[row])
        if far < _POINT:
            continue
        if at + 1 >= len(cells):
            return None
        step = centres[at + 1] - centres[at]
        length = float(np.sqrt((step * step).sum()))
        gap = np.array((trace.x[row], trace.y[row])) - centres[at]
        along = float((gap * step).sum()) / length
        aside = float(gap[0] * step[1] - gap[1] * step[0]) / length
        straight = float(trace.dx[row] * step[0] + trace.dy[row] * step[1]) / length
        if abs(aside) > near or straight < 1.0 - 1e-6 or along + far > length + near or along < -near:
            return None
        if along + far >= length - _POINT:
            times.append(float(trace.t[row] + trace.duration[row]))
            at += 1
    return times
