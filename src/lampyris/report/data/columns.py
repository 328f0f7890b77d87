"""Columns of nouns that are rows over time or distance: what CSV files and data frames hold, in metres and seconds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from lampyris.model.curve import PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.grid import MapFrame
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.trace import Trace
from lampyris.typing import Points

Columns: TypeAlias = dict[str, Sequence[Any]]
"""Columns by name, in order, all of one length."""


def path_columns(path: Path, frame: MapFrame) -> Columns:
    """``x_m``, ``y_m``: centres of the cells, metres of the map frame; ``yaw`` of the step that leaves each cell,
    radians in the map frame, -pi to pi (the last keeps the one before)."""
    yaw = [turned(h, frame.origin[2]) for h in path.heading.tolist()]
    return _places(frame, path.cells) | {"yaw": yaw}


def plan_columns(plan: Plan, path: Path, frame: MapFrame) -> Columns:
    """:func:`path_columns`, ``s`` (metres), ``x``, ``y`` (the cell) and, with a schedule, ``tick``."""
    columns = path_columns(path, frame) | {"s": (path.arc * frame.resolution).tolist()} | cells_columns(path)
    return columns if plan.schedule is None else columns | {"tick": plan.schedule.tolist()}


def cells_columns(path: Path) -> Columns:
    """``x``, ``y``: the cells."""
    return {"x": path.cells[:, 0].tolist(), "y": path.cells[:, 1].tolist()}


def profile_columns(profile: Profile, frame: MapFrame | None) -> Columns:
    """``x_m``, ``y_m`` where they are known; ``t_s``, ``s``, ``v``, ``a`` in s, m, m/s, m/s2; ``cause``, ``why``.

    Of a law in velocity units ``t_transfers`` stands in place of ``t_s``, and the others are in cells and velocity
    units.
    """
    places = {} if frame is None or profile.xy is None else _places(frame, profile.xy)
    return places | {
        "t_s" if profile.metric else "t_transfers": profile.t.tolist(),
        "s": profile.s.tolist(),
        "v": profile.v.tolist(),
        "a": profile.a.tolist(),
        "cause": profile.cause,
        "why": [profile.why(k) for k in range(len(profile.v))],
    }


def drive_columns(drive: Drive) -> Columns:
    """A row for each segment and one for the end: ``t_s``; ``x_m``, ``y_m``, ``yaw``; ``v`` at that time, ``a`` until
    the next row; ``s`` metres along the curve number ``leg``; ``cause`` what limits the speed, ``why`` in words."""
    frame, n = drive.scene.grid.frame, len(drive.t)
    xy, yaw = np.zeros((n, 2)), np.zeros(n)
    for leg in np.unique(drive.leg).tolist():
        here, curve = drive.leg == leg, drive.curves[leg]
        xy[here], heading = curve.at(drive.s[here])
        if isinstance(curve, PoseCurve):
            yaw[here] = [turned(one, frame.origin[2]) for one in curve.yaw_at(drive.s[here]).tolist()]
        else:
            yaw[here] = yaws(heading, frame)
    return {
        "t_s": drive.t.tolist(),
        **_places(frame, xy),
        "yaw": yaw.tolist(),
        "v": drive.v.tolist(),
        "a": drive.a.tolist(),
        "s": drive.s.tolist(),
        "leg": drive.leg.tolist(),
        **_planned(drive),
        "cause": drive.cause,
        "why": [drive.why(k) for k in range(n)],
    }


def _planned(drive: Drive) -> Columns:
    """``planned_t_s``: when the plan wanted the robot to leave the place of each row; nothing without planned times."""
    planned = drive.planned_times
    return {} if planned is None else {"planned_t_s": ["" if t != t else t for t in planned.tolist()]}


def trace_columns(trace: Trace) -> Columns:
    """A row a tick: ``x_m``, ``y_m``, ``yaw``, ``v``, ``tick``, ``cause``, ``x``, ``y``, ``event``.

    The yaw is that of the step that led to the cell; a waiting robot keeps it, and before its first step it looks
    along that.
    """
    frame = trace.scene.grid.frame
    cells = trace.robot.tolist()
    words: dict[int, list[str]] = {}
    for event in trace.events:
        words.setdefault(event.tick, []).append(event.word)
    headings: list[float | None] = [None]
    for (x0, y0), (x1, y1) in pairwise(cells):
        moved = (x0, y0) != (x1, y1)
        headings.append(math.atan2(y0 - y1, x1 - x0) if moved else headings[-1])
    first = next((h for h in headings if h is not None), 0.0)
    return {
        **_places(frame, trace.robot),
        "yaw": [turned(first if h is None else h, frame.origin[2]) for h in headings],
        "v": trace.speed.tolist(),
        "tick": range(len(cells)),
        "cause": trace.cause,
        "x": [x for x, _ in cells],
        "y": [y for _, y in cells],
        "event": ["+".join(words.get(tick, ())) for tick in range(len(cells))],
    }


def yaws(heading: Points, frame: MapFrame) -> list[float]:
    """Headings (unit vectors, y down) as angles of the map frame."""
    return [turned(math.atan2(0.0 - hy, hx), frame.origin[2]) for hx, hy in heading.tolist()]


def turned(heading: float, yaw: float) -> float:
    """A heading turned by the map's yaw, within -pi .. pi."""
    return heading if yaw == 0 else math.remainder(heading + yaw, 2 * math.pi)


def _places(frame: MapFrame, xy: Any) -> Columns:
    metres = frame.to_metres(xy)
    return {"x_m": metres[:, 0].tolist(), "y_m": metres[:, 1].tolist()}
