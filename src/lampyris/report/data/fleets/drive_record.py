"""Drives of fleets and lifelong fleets as plain data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.report.data.serialize import grid_record

_PHASES = ("robot", "t", "duration", "x", "y", "dx", "dy", "v", "a")


def fleet_drive_record(trace: FleetTrace) -> dict[str, Any]:
    """What ``lampyris fleet --execute --json`` prints.

    Parameters
    ----------
    trace : of a drive.
    """
    return {
        "status": trace.status.value,
        "sentence": trace.sentence,
        "seed": trace.seed,
        "map": grid_record(trace.grid),
        "settings": asdict(trace.settings),
        "delays": asdict(trace.delays),
        "robots": len(trace.robots),
        "starts": trace.starts.tolist(),
        "goals": trace.goals.tolist(),
        "radius_m": [one.radius for one in trace.robots],
        "arrived": trace.arrived,
        "arrivals_s": _or_null(trace.arrivals),
        "planned_s": _or_null(trace.planned),
        "lateness_s": _or_null(trace.lateness),
        "tick_s": trace.tick,
        "duration_s": trace.duration_s,
        "driving_s": trace.driving.tolist(),
        "waits_s": trace.wait_totals(),
        "utilisation": trace.utilisation,
        "delayed": trace.delayed,
        "rotations": trace.rotations,
        "plans": len(trace.plans),
        "faults": [{"robot": k, "t_s": t} for k, t in trace.faults],
        "contacts": trace.contacts,
        "wall_contacts": trace.wall_contacts,
        "obstacle_contacts": trace.obstacle_contacts,
        "moving_contacts": trace.moving_contacts,
        "notes": list(trace.notes),
        "phases": {name: getattr(trace, name).tolist() for name in _PHASES},
        "timing": dict(trace.timing),
    }


def _or_null(values: Any) -> list[float | None]:
    return [None if np.isnan(value) else value for value in values.tolist()]


def lifelong_record(trace: LifelongTrace) -> dict[str, Any]:
    """What ``lampyris fleet --lifelong --json`` prints.

    Parameters
    ----------
    trace : of a lifelong fleet.
    """
    service = trace.service_times
    return {
        "status": trace.status.value,
        "sentence": trace.sentence,
        "planner": trace.planner,
        "window": trace.window,
        "seed": trace.seed,
        "map": grid_record(trace.grid),
        "robots": trace.robots,
        "ticks": trace.ticks,
        "completed": trace.completed,
        "throughput": trace.throughput,
        "utilisation": trace.utilisation,
        "moving": trace.moving,
        "service": {
            "mean": float(service.mean()) if len(service) else None,
            "median": float(np.median(service)) if len(service) else None,
            "most": int(service.max()) if len(service) else None,
        },
        "tasks": [
            {
                "release": task.release, "stops": [list(cell) for cell in task.stops], "robot": robot, "assigned": since,
                "done": done, "stop_ticks": list(ticks),
            }
            for task, robot, since, done, ticks in zip(
                trace.tasks, _known(trace.robot), _known(trace.assigned), _known(trace.done), trace.stop_ticks, strict=True
            )
        ],
        "paths": [path.tolist() for path in trace.paths],
        "faults": [{"robot": k, "tick": tick} for k, tick in trace.faults],
        "windows": trace.windows,
        "fallbacks": trace.fallbacks,
        "notes": list(trace.notes),
        "timing": dict(trace.timing),
    }  # fmt: skip


def _known(values: Any) -> list[int | None]:
    return [None if value < 0 else value for value in values.tolist()]
