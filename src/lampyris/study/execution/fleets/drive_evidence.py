"""Evidence of fleets that drive and of lifelong fleets; see :mod:`lampyris.study.execution.evidence`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import FleetTask, LifelongTrace
from lampyris.model.obstacles import Track
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris.study.execution import evidence as e
from lampyris.study.execution.fleets.fleet_evidence import fleet_evidence

_COLUMNS = ("t", "duration", "x", "y", "dx", "dy", "v", "a")
_DRIVE = {
    "robot": ("<i4", 1), "columns": ("<f8", 2), "arrivals": ("<f8", 1), "planned": ("<f8", 1), "waits": ("<f8", 2),
    "corners": ("<f8", 2), "corner_counts": ("<i4", 1), "discs": ("<f8", 2),
}  # fmt: skip
_COUNTS = (
    "contacts", "obstacle_contacts", "moving_contacts", "wall_contacts", "delayed", "rotations",
)  # fmt: skip
_LIFELONG = {
    "starts": ("<i4", 2), "steps": ("|i1", 2), "stops": ("<i4", 2), "stop_counts": ("<i4", 1), "release": ("<i4", 1),
    "own": ("<i4", 1), "robot": ("<i4", 1), "assigned": ("<i4", 1), "done": ("<i4", 1), "visits": ("<i4", 1),
    "visit_counts": ("<i4", 1),
}  # fmt: skip


def drive_evidence(trace: FleetTrace, plan: FleetPlan | None) -> dict[str, Any]:
    """A drive as plain data, with the plan that was driven; None: there was none."""
    corners = [np.column_stack((one.t, one.xy)) for one in trace.obstacles]
    arrays = {
        "robot": trace.robot,
        "columns": np.stack([getattr(trace, name) for name in _COLUMNS], axis=1),
        "arrivals": trace.arrivals,
        "planned": trace.planned,
        "waits": trace.waits,
        "corners": e.rows(corners, 3),
        "corner_counts": e.counts(corners),
        "discs": np.array([(one.radius, one.top_speed) for one in trace.obstacles]).reshape(-1, 2),
    }
    return {
        "kind": "fleet-drive",
        "status": trace.status.value,
        "plan": None if plan is None else fleet_evidence(plan),
        "tick": float(trace.tick),
        "counts": [int(getattr(trace, name)) for name in _COUNTS],
        "arrays": e.pack_arrays(arrays, _DRIVE),
        "notes": list(trace.notes),
    }


def drive_of(
    plain: Any,
    fleet: Fleet,
    robots: tuple[Robot, ...],
    settings: Any,
    delays: Any,
    seed: int,
    plan: FleetPlan | None,
) -> FleetTrace:
    """The drive that is claimed.

    Parameters
    ----------
    fleet, robots, settings, delays, seed : of the job.
    plan : that is claimed to have been driven.

    Raises
    ------
    FileError : ``EVIDENCE``. LimitError : ``EVIDENCE_SIZE``.
    """

    def read(plain: Mapping[str, Any]) -> FleetTrace:
        got = e.unpack_arrays(plain["arrays"], _DRIVE)
        corners = e.split(got["corners"], got["corner_counts"])
        tracks = [
            Track(table[:, 0], table[:, 1:], radius, top)
            for table, (radius, top) in zip(corners, got["discs"].tolist(), strict=True)
        ]
        counts: dict[str, Any] = dict(
            zip(_COUNTS, (e.whole(n, "counts") for n in plain["counts"]), strict=True)
        )
        columns: dict[str, Any] = dict(zip(_COLUMNS, got["columns"].T, strict=True))
        return FleetTrace(
            status=Status(plain["status"]), grid=fleet.grid, settings=settings, delays=delays, seed=seed, robots=robots,
            starts=np.array(fleet.starts, np.int32), goals=np.array(fleet.goals, np.int32), robot=got["robot"], **columns,
            arrivals=got["arrivals"], planned=got["planned"], waits=got["waits"], tick=e.number(plain["tick"], "tick"),
            plans=() if plan is None else (plan.paths,), plan_times=() if plan is None else (0.0,),
            obstacles=tuple(tracks), notes=e.notes_of(plain), **counts,
        )  # fmt: skip

    return e.reading("fleet-drive", plain, read)


def lifelong_evidence(trace: LifelongTrace) -> dict[str, Any]:
    """A lifelong fleet as plain data."""
    stops = [np.array(one.stops, dtype=np.int32).reshape(-1, 2) for one in trace.tasks]
    visits = [np.array(one, dtype=np.int32) for one in trace.stop_ticks]
    arrays = {
        "starts": trace.xy[0],
        "steps": np.diff(trace.xy, axis=0).reshape(-1, 2),
        "stops": e.rows(stops, 2),
        "stop_counts": e.counts(stops),
        "release": np.array([one.release for one in trace.tasks], dtype=np.int32),
        "own": np.array([-1 if one.robot is None else one.robot for one in trace.tasks], dtype=np.int32),
        "robot": trace.robot,
        "assigned": trace.assigned,
        "done": trace.done,
        "visits": np.concatenate([np.zeros(0, dtype=np.int32), *visits]),
        "visit_counts": e.counts(visits),
    }
    return {
        "kind": "lifelong",
        "status": trace.status.value,
        "windows": int(trace.windows),
        "fallbacks": int(trace.fallbacks),
        "arrays": e.pack_arrays(arrays, _LIFELONG),
        "notes": list(trace.notes),
    }


def lifelong_of(plain: Any, fleet: Fleet, planner: str, window: int, seed: int) -> LifelongTrace:
    """The lifelong fleet that is claimed.

    Raises
    ------
    FileError : ``EVIDENCE``. LimitError : ``EVIDENCE_SIZE``.
    """

    def read(plain: Mapping[str, Any]) -> LifelongTrace:
        got = e.unpack_arrays(plain["arrays"], _LIFELONG)
        starts = got["starts"]
        steps = got["steps"].astype(np.int32).reshape(-1, len(starts), 2)
        stops = [tuple(map(tuple, some.tolist())) for some in e.split(got["stops"], got["stop_counts"])]
        rows = zip(stops, got["release"].tolist(), got["own"].tolist(), strict=True)
        return LifelongTrace(
            Status(plain["status"]), fleet.grid, planner, window, seed,
            np.concatenate((starts[None], starts + np.cumsum(steps, axis=0, dtype=np.int32))),
            tuple(FleetTask(some, release, None if own < 0 else own) for some, release, own in rows),
            got["robot"], got["assigned"], got["done"],
            tuple(tuple(some.tolist()) for some in e.split(got["visits"], got["visit_counts"])),
            windows=e.whole(plain["windows"], "windows"), fallbacks=e.whole(plain["fallbacks"], "fallbacks"),
            notes=e.notes_of(plain),
        )  # fmt: skip

    return e.reading("lifelong", plain, read)
