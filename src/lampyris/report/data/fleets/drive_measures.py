"""Measures of fleets that drive and of lifelong fleets, by name, as rows of studies hold them."""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.report.data.fleets.measures import fleet_metrics

FLEET_DRIVE_METRICS = (
    "robots_arrived", "duration_s", "lateness_mean_s", "lateness_max_s", "wait_order_s", "wait_delay_s", "in_motion", "contacts",
    "obstacle_contacts", "moving_contacts", "delayed", "rotations",
)  # fmt: skip
"""Beside those of the plan; ``found`` says that every robot arrived.

* ``robots_arrived``: share of the robots. ``duration_s``: seconds until the last robot stood. ``lateness_mean_s``,
  ``lateness_max_s``: seconds that robots arrived after the plan's time, in which a tick lasts as long as a step at full speed.
* ``wait_order_s``, ``wait_delay_s``: mean seconds that a robot stood for others, and for delays. ``in_motion``: share of the time
  until they arrived that robots moved.
* ``contacts``: pairs of robots that touched. ``obstacle_contacts``: of a robot and a moving obstacle; ``moving_contacts`` of them
  with a robot that drove. ``delayed``: moves. ``rotations``: rings of robots that exchanged their cells at once.
"""
LIFELONG_METRICS = (
    "throughput",
    "utilisation",
    "in_motion",
    "service_ticks",
    "tasks_done",
    "windows",
    "fallbacks",
)
"""Beside ``outcome`` and ``found`` (all ticks were driven).

* ``throughput``: tasks done a tick. ``utilisation``: share of robots and ticks with a task; ``in_motion``: in which a
  robot moved.
* ``service_ticks``: mean ticks from release to completion of the tasks done. ``tasks_done``: how many.
* ``windows``: how often was planned, ``fallbacks`` of them by PIBT, as the planner had found nothing within its limit.
"""


def fleet_drive_metrics(trace: FleetTrace, plan: FleetPlan | None) -> dict[str, Any]:
    """Every measure of a drive and of the plan that was driven; None where it has no value."""
    there = ~np.isnan(trace.arrivals)
    late = trace.lateness[~np.isnan(trace.lateness)]
    waits = dict(zip(("order", "turning", "delay"), trace.waits.mean(axis=0).tolist(), strict=False))
    made = {} if plan is None else fleet_metrics(plan)
    return {
        **made,
        "outcome": trace.status.value,
        "found": bool(trace),
        "notes": "; ".join(trace.notes) or None,
        "robots_arrived": float(there.mean()),
        "duration_s": trace.duration_s,
        "lateness_mean_s": float(late.mean()) if len(late) else None,
        "lateness_max_s": float(late.max()) if len(late) else None,
        "wait_order_s": waits["order"],
        "wait_delay_s": waits["delay"],
        "in_motion": trace.utilisation,
        "contacts": int(trace.contacts),
        "obstacle_contacts": int(trace.obstacle_contacts),
        "moving_contacts": int(trace.moving_contacts),
        "delayed": int(trace.delayed),
        "rotations": int(trace.rotations),
    }


def lifelong_metrics(trace: LifelongTrace) -> dict[str, Any]:
    """Every measure of a lifelong fleet; None where it has no value."""
    return {
        "outcome": trace.status.value,
        "found": bool(trace),
        "notes": "; ".join(trace.notes) or None,
        "throughput": trace.throughput,
        "utilisation": trace.utilisation,
        "in_motion": trace.moving,
        "service_ticks": trace.mean_service_time,
        "tasks_done": trace.completed,
        "windows": int(trace.windows),
        "fallbacks": int(trace.fallbacks),
    }
