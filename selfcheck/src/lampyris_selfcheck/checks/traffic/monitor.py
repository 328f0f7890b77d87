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
from lampyris.planning import registry
from lampyris.referee import check_drive, check_trace
from lampyris.sim.grid import loop
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.traffic import monitor_drives as drives
from lampyris_selfcheck.checks.traffic import monitor_faults as traces
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes
from lampyris_selfcheck.reference.motion.drive_monitor import watch
from lampyris_selfcheck.reference.motion.quick_monitor import breaches
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor
from lampyris_selfcheck.reference.paths.edits import EditMonitor

KINDS = {
    "traces": Kind(
        f"{len(traces.FAULTS)} faults in runs by ticks, in turn: both monitors and the referee name the rule",
        2 * len(traces.FAULTS),
        500 * len(traces.FAULTS),
        2_000 * len(traces.FAULTS),
        2 * len(traces.FAULTS),
    ),
    "drives": Kind(
        f"{len(drives.FAULTS)} faults in drives, in turn: the referee names the rule, a watcher some",
        len(drives.FAULTS),
        100 * len(drives.FAULTS),
        400 * len(drives.FAULTS),
        2 * len(drives.FAULTS),
    ),
}

_TRIES = 150
"""Runs asked for an occasion, before it is said that a fault cannot be put in."""

_ALL = 99
"""Sentences asked of the quick monitor: all that it has."""


def _run(ask: Ask, part: Part) -> Outcome:
    tally, judge = Tally(part), _traces if part.kind == "traces" else _drives
    for number in part.numbers:
        tally.case()
        try:
            judge(ask, number, tally)
        except Exception as error:
            tally.fail(number, f"{type(error).__name__}: {error}")
    return tally.outcome()


@lru_cache(maxsize=256)
def _trace(seed: int, number: int) -> Trace | None:
    """A sound run; None where the traffic does not fit."""
    rng = Ask(seed=seed).rng("monitor", "trace", number)
    kind = scenes.KINDS[int(rng.integers(len(scenes.KINDS)))]
    moves = scenes.MOVES[int(rng.integers(len(scenes.MOVES)))]
    robot, body = scenes.SIZES[int(rng.integers(len(scenes.SIZES)))]
    scene = scenes.drawn_scene(rng, kind, robot, body, moves)
    if rng.random() < 0.3:
        scene = scenes.with_edits(scene, rng)
    try:
        trace = loop.run(scene, registry.make("astar", {}), seed=number, patience=15)
    except SceneError as refused:
        if refused.code not in scenes.REFUSED:
            raise
        return None
    if breaches(trace) or _slowly(trace) or check_trace(trace) is not None:
        raise RuntimeError(f"run {number} is not sound by itself: the check sim says more")
    return trace


def _slowly(trace: Trace) -> list[str]:
    """What the slow monitor says; of walls that come and go, its own kind."""
    return (EditMonitor(trace) if trace.scene.edits else Monitor(trace)).faults()


def _traces(ask: Ask, number: int, tally: Tally) -> None:
    names = tuple(traces.FAULTS)
    name = names[number % len(names)]
    fault = traces.FAULTS[name]
    rng = ask.rng("monitor", "traces", number)
    for attempt in range(_TRIES):
        trace = _trace(ask.seed, number // len(names) + attempt)
        wrong = None if trace is None else fault.put(trace, rng)
        if wrong is not None:
            break
    else:
        tally.fail(number, f"{name}: no occasion in {_TRIES} runs")
        return
    tally.count(name)
    deaf = deaf_to(fault, wrong)
    if deaf:
        tally.fail(number, f"{name}: not seen by {', '.join(deaf)}", fault=name)


def deaf_to(fault: traces.Fault, wrong: Trace) -> list[str]:
    """Who does not see the rule that is broken; another that breaks with it does not count."""
    deaf = []
    if not traces.said(fault.quick, breaches(wrong, most=_ALL)):
        deaf.append("the quick monitor")
    if not traces.said(fault.slow, _slowly(wrong)):
        deaf.append("the slow monitor")
    broken = check_trace(wrong)
    if not traces.ruled(fault, wrong, None if broken is None else broken.rule):
        deaf.append("the referee" if broken is None else f"the referee ({broken.rule})")
    return deaf


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
    broken = check_drive(wrong)
    deaf = [] if broken is not None and broken.rule == drives.RULES[name] else [f"the referee ({broken})"]
    if name in drives.SEEN and drives.SEEN[name] not in _watched(wrong):
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
    if seen.apart < -1e-6:
        found.append("bodies")
    fast = np.array([pace - drive.tracks[k].top_speed for k, pace in seen.body_speed.items()])
    if (fast > 1e-6).any():
        found.append("body speed")
    return found


CHECK = Check(
    "monitor",
    ("G13",),
    "every fault put into a simulated run is seen by who judges the runs",
    KINDS,
    _run,
)
