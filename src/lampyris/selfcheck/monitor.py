"""The monitors are awake: faults that a simulator could have are put into sound runs, and each is seen.

Into traces: by the quick monitor, the slow one and the referee, each by itself. Into drives: by the referee,
and by the watcher where looking every few milliseconds can show it. A sound run must be clean before.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.drive import Drive
from lampyris.model.trace import Outcome as Ending
from lampyris.model.trace import Trace
from lampyris.planners import registry
from lampyris.referee import check_drive, check_trace
from lampyris.selfcheck import _monitor_drives as drives
from lampyris.selfcheck import _monitor_traces as traces
from lampyris.selfcheck import _sim_scenes as scenes
from lampyris.selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris.selfcheck.twins.drive_monitor import watch
from lampyris.selfcheck.twins.quick_monitor import breaches
from lampyris.selfcheck.twins.sim_monitor import Monitor
from lampyris.sim import loop

KINDS = {
    "traces": Kind(
        f"{len(traces.FAULTS)} faults in runs by ticks, in turn: each seen by both monitors and the referee",
        10 * len(traces.FAULTS),
        500 * len(traces.FAULTS),
        2_000 * len(traces.FAULTS),
        2 * len(traces.FAULTS),
    ),
    "drives": Kind(
        f"{len(drives.FAULTS)} faults in drives, in turn: each seen by the referee, some by a watcher too",
        6 * len(drives.FAULTS),
        100 * len(drives.FAULTS),
        400 * len(drives.FAULTS),
        2 * len(drives.FAULTS),
    ),
}

_TRIES = 40
"""Runs asked for an occasion, before it is said that a fault cannot be put in."""


def _run(ask: Ask, part: Part) -> Outcome:
    tally, judge = Tally(part), _traces if part.kind == "traces" else _drives
    for number in part.numbers:
        tally.case()
        try:
            judge(ask, number, tally)
        except Exception as error:
            tally.fail(number, f"{type(error).__name__}: {error}")
    return tally.outcome()


@lru_cache(maxsize=64)
def _trace(seed: int, number: int) -> Trace | None:
    """A sound run; None where the traffic does not fit."""
    rng = Ask(seed=seed).rng("monitor", "trace", number)
    kind = scenes.KINDS[int(rng.integers(4))]
    scene = scenes.drawn_scene(rng, kind, moves=("octile", "dissertation", "four")[int(rng.integers(3))])
    try:
        trace = loop.run(scene, registry.make("astar", {}), seed=number, patience=15)
    except SceneError:
        return None
    if breaches(trace) or Monitor(trace).faults() or check_trace(trace) is not None:
        raise RuntimeError(f"run {number} is not sound by itself: the check sim says more")
    return trace


def _traces(ask: Ask, number: int, tally: Tally) -> None:
    names = tuple(traces.FAULTS)
    name = names[number % len(names)]
    rng = ask.rng("monitor", "traces", number)
    for attempt in range(_TRIES):
        trace = _trace(ask.seed, number // len(names) + attempt)
        wrong = None if trace is None else traces.FAULTS[name](trace, rng)
        if wrong is not None:
            break
    else:
        tally.fail(number, f"{name}: no occasion in {_TRIES} runs")
        return
    tally.count(name)
    deaf = []
    if not breaches(wrong):
        deaf.append("the quick monitor")
    if not Monitor(wrong).faults():
        deaf.append("the slow monitor")
    if check_trace(wrong) is None:
        deaf.append("the referee")
    if deaf:
        tally.fail(number, f"{name}: not seen by {', '.join(deaf)}", fault=name)


@lru_cache(maxsize=16)
def _drive(seed: int, number: int) -> Drive | None:
    """A sound drive; None where the obstacles do not fit or nothing was driven."""
    rng = Ask(seed=seed).rng("monitor", "drive", number)
    made = scenes.harsh_drive(rng, number, time_limit=30.0)
    if made is None or not made.curves or len(made.t) < 5:
        return None
    if check_drive(made) is not None or _watched(made):
        raise RuntimeError(f"drive {number} is not sound by itself: the check sim says more")
    return made


def _drives(ask: Ask, number: int, tally: Tally) -> None:
    names = tuple(drives.FAULTS)
    name = names[number % len(names)]
    rng = ask.rng("monitor", "drives", number)
    for attempt in range(_TRIES):
        made = _drive(ask.seed, number // len(names) + attempt)
        wrong = None if made is None else drives.FAULTS[name](made, rng)
        if wrong is not None:
            break
    else:
        tally.fail(number, f"{name}: no occasion in {_TRIES} drives")
        return
    tally.count(name)
    deaf = [] if check_drive(wrong) is not None else ["the referee"]
    if name in drives.SEEN and not _watched(wrong):
        deaf.append("the watcher")
    if deaf:
        tally.fail(number, f"{name}: not seen by {', '.join(deaf)}", fault=name)


def _watched(drive: Drive) -> list[str]:
    """What a watcher who looks every few milliseconds finds wrong."""
    robot, seen = drive.scene.robot, watch(drive, every=0.01)
    found = []
    if seen.wall < robot.radius - 1e-6:
        found.append("wall")
    if seen.gap < -1e-6 and drive.outcome is not Ending.COLLISION:
        found.append("contact")
    if seen.top > robot.v_max * (1 + 1e-9):
        found.append("speed")
    if seen.longest_jump > robot.v_max * (1 + 1e-6) + 1e-9:
        found.append("jump")
    fast = np.array([pace - drive.tracks[k].top_speed for k, pace in seen.body_speed.items()])
    if (fast > 1e-6).any():
        found.append("body speed")
    return found


CHECK = Check(
    "monitor",
    ("G13",),
    "Every fault put into a simulated run is seen by who judges the runs.",
    KINDS,
    _run,
)
