"""Traces of swarms as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris._core import dict_codec
from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.report.data.serialize import grid_record


def swarm_record(trace: SwarmTrace) -> dict[str, Any]:
    """What ``lampyris swarm --json`` prints.

    Parameters
    ----------
    trace : of a swarm. Its positions are given at the end alone; ``trace.to_dict()`` has them all.
    """
    return {
        "status": trace.status.value,
        "sentence": trace.sentence,
        "method": trace.settings.method,
        "seed": trace.seed,
        "map": grid_record(trace.grid),
        "robots": trace.robots,
        "iterations": trace.iterations,
        "period_s": trace.settings.period,
        "duration_s": trace.duration,
        "settings": _settings(trace),
        "sources": [_source(trace, k) for k in range(trace.held.shape[1])],
        "held_over_time": trace.held.tolist(),
        "groups_over_time": trace.groups_over_time.tolist(),
        "groups": list(trace.group_sizes(trace.iterations - 1)) if trace.iterations else [],
        "starts_m": trace.xy[0].tolist(),
        "ends_m": trace.xy[-1].tolist(),
        "holder": trace.holder.tolist(),
        "luciferin": trace.luciferin[-1].tolist(),
        "encounters": trace.encounters,
        "wall_encounters": trace.wall_encounters,
        "notes": list(trace.notes),
        "timing": dict(trace.timing),
    }


def _settings(trace: SwarmTrace) -> dict[str, Any]:
    made: dict[str, Any] = dict_codec.encode(trace.settings)
    return {name: value for name, value in made.items() if name != "type"}


def _source(trace: SwarmTrace, k: int) -> dict[str, Any]:
    return {
        "at_m": trace.source_xy[-1, k].tolist(),
        "held": int(trace.held[-1, k]),
        "held_from": trace.held_from[k],
        "nearest_m": nearest_robots(trace, k),
    }


def nearest_robots(trace: SwarmTrace, k: int) -> list[float]:
    """Distances of the nearest robots to a source at the end, as many as hold it, metres."""
    gap = trace.xy[-1] - trace.source_xy[-1, k]
    square = np.sort((gap * gap).sum(axis=1))[: trace.settings.capture_robots]
    out: list[float] = np.sqrt(square).tolist()
    return out
