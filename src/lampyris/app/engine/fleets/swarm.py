"""Swarms of robots that look for sources, as iterations that the page can play."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from lampyris import swarms
from lampyris.app.engine.fleets.fleet import MOST_ROBOTS, ground_of, robots_of
from lampyris.app.engine.frames import json_frame, layer_frame, swarm_frame
from lampyris.app.engine.progress import Share
from lampyris.errors import LimitError, SettingError, shown
from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.sim.swarm.signals import signal_on

MOST_PLACES: Final = 4_000_000
"""Robots times iterations: 36 MB."""
PIECE: Final = 50
"""Iterations of one frame."""


def swarm(question: Mapping[str, Any], look: Callable[[], None]) -> Iterator[bytes]:
    """A swarm: ``H L G* Z``; ``L`` is the signal of the sources at the beginning, by cell.

    Parameters
    ----------
    question : ``scenario``: its map and the walls painted on it. ``robots``, ``seed``. ``sources``: a name that
        ``lampyris swarm --sources`` takes. ``settings``: of :class:`lampyris.model.settings.swarm.SwarmSettings`.

    Raises
    ------
    SettingError : ``ROBOTS``, ``SOURCES``, a setting.
    LimitError : ``SWARM_PLACES``: more than the page can hold.
    LampyrisError : as :func:`lampyris.swarm_robots`.
    """
    grid = ground_of(question)
    robots = robots_of(question, MOST_ROBOTS)
    settings = question.get("settings") or {}
    sources = question.get("sources", swarms.SOURCES[0])
    if sources not in swarms.SOURCES:
        raise SettingError("SOURCES", shown(sources), where="sources", allowed=", ".join(swarms.SOURCES))
    iterations = settings.get("iterations", 0)
    if type(iterations) is int and iterations * robots > MOST_PLACES:
        raise LimitError(
            "SWARM_PLACES", f"{robots:,} robots for {iterations:,} iterations",
            allowed=f"{MOST_PLACES:,} robots times iterations", todo="take fewer of either",
        )  # fmt: skip
    share: Share | None = None

    def progress(done: int, of: int) -> None:
        nonlocal share
        look()
        if share is None:
            share = Share("simulating a swarm", of)
        share(done)

    trace = swarms.swarm_robots(
        grid, sources, robots, seed=question.get("seed", 0), progress=progress, swarm_settings=settings
    )
    look()
    yield from frames_of(trace, question.get("job"))


def frames_of(trace: SwarmTrace, job: Any) -> Iterator[bytes]:
    """A trace as frames."""
    grid, settings = trace.grid, trace.settings
    cell = grid.resolution
    ticks, robots = trace.luciferin.shape
    low, high = float(trace.luciferin.min()), float(trace.luciferin.max())
    yield json_frame("H", {
        "job": job, "robots": robots, "iterations": ticks - 1, "radius": (settings.radius or 0.0) / cell,
        "capture_radius": (settings.capture_radius or 0.0) / cell, "capture_robots": settings.capture_robots,
        "luciferin": [low, high], "method": settings.method, "seed": trace.seed,
    })  # fmt: skip
    yield layer_frame("signal", signal_on(grid, trace.sources, 0.0))
    bright = np.round(255.0 * (trace.luciferin - low) / ((high - low) or 1.0)).astype(np.uint8)
    for first in range(0, ticks, PIECE):
        part = slice(first, first + PIECE)
        places, sources = (
            np.asarray(grid.to_points(xy[part, :, 0], xy[part, :, 1])) for xy in (trace.xy, trace.source_xy)
        )
        yield swarm_frame(first, places, bright[part], sources, trace.held[part])
    yield json_frame("Z", {
        "status": trace.status.value, "found": bool(trace.status), "sentence": trace.sentence,
        "held": trace.held[-1].tolist(), "held_from": list(trace.held_from), "encounters": trace.encounters,
        "wall_encounters": trace.wall_encounters, "notes": list(trace.notes), "timing": dict(trace.timing),
    })  # fmt: skip
