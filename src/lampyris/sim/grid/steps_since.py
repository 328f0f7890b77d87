"""Since: what a simulation has done since a tick, for those who watch it run.

A whole trace at every look would cost the square of the ticks: 200 obstacles over 5,000 ticks are 80 ms a look.
"""

from __future__ import annotations

import numpy as np

from lampyris.model.trace import Event, Outcome, Trace
from lampyris.sim.grid.loop import Simulation
from lampyris.sim.world.cell_index import CellIndex
from lampyris.typing import Cells


def since(run: Simulation, first: int) -> Trace:
    """The ticks from ``first`` on, as a trace whose tick 0 is ``first``.

    Its counts are those of the whole run so far; it has no path and no events: see :func:`events_since`.
    """
    space = run.world.space
    appears = [max(came - first, 0) for came in run.traffic.appears]
    tracks = [
        _cells(track[max(first - came, 0) :], space)
        for track, came in zip(run._tracks, run.traffic.appears, strict=True)
    ]
    return Trace(
        scene=run.scene,
        planner=run.planner.name,
        seed=run.seed,
        outcome=Outcome.TIMEOUT if run.outcome is None else run.outcome,
        robot=np.array(run._robot[first:], dtype=np.int32),
        tracks=tuple(tracks),
        appears=tuple(appears),
        obstacle_specs=tuple(run.traffic.obstacles),
        speed=np.array(run._speed[first:]),
        cause=tuple(run._cause[first:]),
        law=run.tick_speed.name,
        units=run.tick_speed.units,
        events=(),
        replans=run._replans,
        waits=run._waits,
        path_switches=run._path_switches,
        iterations=run._iterations,
        expansions=run._expansions,
        path=None,
        detail=run.detail,
        last_tick=run.last_tick,
    )


def events_since(run: Simulation, number: int) -> list[Event]:
    """The events after the first ``number``."""
    return run._events[number:]


def _cells(track: list[int], space: CellIndex) -> Cells:
    """Numbers of the space as cells."""
    y, x = np.divmod(np.array(track, dtype=np.int64), space.stride)
    return np.stack((x - 1, y - 1), axis=1).astype(np.int32)
