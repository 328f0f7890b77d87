"""Traces of compiled ticks and of the loop in Python, compared."""

from __future__ import annotations

import numpy as np

from lampyris.model.trace import Trace
from lampyris.sim.grid import loop

FIELDS = (
    "outcome", "appears", "obstacle_specs", "cause", "events", "replans", "waits", "iterations", "expansions", "detail",
    "last_tick", "path_switches", "edits", "path",
)  # fmt: skip


def by_tick(run: loop.Simulation) -> Trace:
    """The whole run by the loop in Python."""
    while run.outcome is None:
        run.tick()
    return run.trace()


def differ(a: Trace, b: Trace) -> list[str]:
    """The fields in which two traces differ."""
    found = [name for name in FIELDS if getattr(a, name) != getattr(b, name)]
    arrays = [("robot", a.robot, b.robot), ("speed", a.speed, b.speed)]
    arrays += [("tracks", x, y) for x, y in zip(a.tracks, b.tracks, strict=True)]
    return found + [name for name, x, y in arrays if not np.array_equal(x, y)]
