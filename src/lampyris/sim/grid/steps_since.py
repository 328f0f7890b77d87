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
        for track, came in zip(run.state.tracks, run.traffic.appears, strict=True)
    ]
    return Trace(
        scene=run.scene,
        planner=run.planner.name,
        seed=run.seed,
        outcome=Outcome.TIMEOUT if run.outcome is None else run.outcome,
        robot=np.array(run.state.cells[first:], dtype=np.int32),
        tracks=tuple(tracks),
        appears=tuple(appears),
        obstacle_specs=tuple(run.traffic.obstacles),
        speed=np.array(run.state.speeds[first:]),
        cause=tuple(run.state.causes[first:]),
        law=run.tick_speed.name,
        units=run.tick_speed.units,
        events=(),
        replans=run.state.replans,
        waits=run.state.waits,
        path_switches=run.state.path_switches,
        iterations=run.state.iterations,
        expansions=run.state.expansions,
        path=None,
        detail=run.state.detail,
        last_tick=run.state.last_tick,
    )


def events_since(run: Simulation, number: int) -> list[Event]:
    """The events after the first ``number``."""
    return run.state.events[number:]


def _cells(track: list[int], space: CellIndex) -> Cells:
    """Numbers of the space as cells."""
    y, x = np.divmod(np.array(track, dtype=np.int64), space.stride)
    return np.stack((x - 1, y - 1), axis=1).astype(np.int32)
