"""Faults of what is reported of a run, put into sound traces; see :mod:`.monitor_traces`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Recorded
from lampyris_selfcheck.checks.traffic.monitor_places import pick


def wrong_arrival(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It is told to have arrived, and the last step is missing."""
    if not trace.arrived or trace.ticks < 3 or (trace.robot[-1] == trace.robot[-2]).all():
        return None
    n = trace.ticks
    if any(e.tick >= n for e in trace.edits) or any(t0 >= n for t0 in trace.appears) or trace.path is None:
        return None
    return replace(
        trace,
        robot=trace.robot[:n],
        speed=trace.speed[:n],
        cause=trace.cause[:n],
        tracks=tuple(track[:-1] for track in trace.tracks),
        events=tuple(e for e in trace.events if e.tick < n),
    )


def untold_arrival(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It stands on the goal, and is told not to have arrived."""
    return replace(trace, outcome=Outcome.TIMEOUT) if trace.arrived and trace.ticks else None


def waits_miscounted(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """One wait more is told."""
    return replace(trace, waits=trace.waits + 1)


def impossible_speed(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A speed below 0."""
    if trace.ticks < 2:
        return None
    speed = trace.speed.copy()
    speed[int(rng.integers(1, trace.ticks))] = -0.25
    return replace(trace, speed=speed)


def another_way_told(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The way told is not the one driven: its last cell is left out."""
    if trace.path is None or len(trace.path.cells) < 3:
        return None
    return replace(trace, path=replace(trace.path, cells=trace.path.cells[:-1]))


def body_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body's track ends a tick early."""
    k = pick(rng, [k for k, t0 in enumerate(trace.appears) if t0 < trace.ticks])
    if k is None:
        return None
    tracks = list(trace.tracks)
    tracks[k] = tracks[k][:-1]
    return replace(trace, tracks=tuple(tracks))


def waiting_mistold(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A tick at which the robot drives is told as a wait; the count of waits is right."""
    t = pick(rng, [t for t in range(1, trace.ticks + 1) if (trace.robot[t] != trace.robot[t - 1]).any()])
    if t is None:
        return None
    return replace(trace, cause=(*trace.cause[:t], "waiting", *trace.cause[t + 1 :]))


def drives_on_at_the_goal(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It arrives with a speed."""
    if not trace.arrived or not trace.ticks:
        return None
    return replace(trace, speed=np.append(trace.speed[:-1], 0.25))


def a_cause_too_many(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """More causes than ticks."""
    return replace(trace, cause=(*trace.cause, "law"))


def own_collision(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It is told to have driven into somebody; on one that was hit it would be seen that they touch."""
    return None if trace.outcome is Outcome.HIT else replace(trace, outcome=Outcome.COLLISION)


def out_of_order(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The body that appeared last is told first."""
    if len(trace.appears) < 2 or trace.appears[-1] == trace.appears[0]:
        return None
    order = [len(trace.appears) - 1, *range(len(trace.appears) - 1)]
    return replace(
        trace,
        obstacle_specs=tuple(trace.obstacle_specs[k] for k in order),
        appears=tuple(trace.appears[k] for k in order),
        tracks=tuple(trace.tracks[k] for k in order),
    )


def not_asked_for(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Bodies that the scene does not ask for."""
    if not trace.obstacle_specs or any(isinstance(one, Recorded) for one in trace.scene.traffic):
        return None
    return replace(trace, scene=replace(trace.scene, traffic=()))


def edit_untold(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Walls turned, and nothing reports it."""
    if not trace.edits:
        return None
    k = int(rng.integers(len(trace.edits)))
    return replace(trace, edits=trace.edits[:k] + trace.edits[k + 1 :])
