"""The monitors work: faults that a simulator could have are put into sound runs, and each is seen.

Into traces: by the monitor, which must name the rule, and by the referee. Into drives: by the referee, which must
name the rule, and by a watcher where looking every few milliseconds can show it. A sound run must be clean before.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.drive import Drive
from lampyris.model.trace import Outcome as Ending
from lampyris.model.trace import Trace
from lampyris.planning import registry
from lampyris.referee import check_drive, check_trace
from lampyris.sim.grid import loop
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally, each
from lampyris_selfcheck.checks.traffic import monitor_drives as drives
from lampyris_selfcheck.checks.traffic import monitor_traces as traces
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes
from lampyris_selfcheck.reference.motion.drive_monitor import watch
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor

_TRACES, _DRIVES = len(traces.FAULTS), len(drives.FAULTS)
KINDS = {
    "traces": Kind(
        f"{_TRACES} faults in runs by ticks, in turn: the monitor names the rule, the referee refuses",
        2 * _TRACES, 500 * _TRACES, 2_000 * _TRACES, 2 * _TRACES,
    ),
    "drives": Kind(
        f"{_DRIVES} faults in drives, in turn: the referee names the rule, a watcher some",
        _DRIVES, 100 * _DRIVES, 400 * _DRIVES, 2 * _DRIVES,
    ),
}  # fmt: skip
TRIES = 150
"""Runs asked for an occasion, before it is said that a fault cannot be put in."""


def _run(ask: Ask, part: Part) -> Outcome:
    faults: Mapping[str, Any] = traces.FAULTS if part.kind == "traces" else drives.FAULTS
    sound, misses = (trace_of, missed) if part.kind == "traces" else (drive_of, missed_drive)

    def judge(number: int, tally: Tally) -> None:
        name = list(faults)[number % len(faults)]
        rng = ask.rng("monitor", part.kind, number)
        wrong = spoilt(faults[name].put, partial(sound, ask.seed), number // len(faults), rng)
        tally.count(name)
        if wrong is None:
            tally.fail(number, f"{name}: no occasion in {TRIES} runs")
        elif by := misses(faults[name], wrong):
            tally.fail(number, f"{name}: not seen by {', '.join(by)}", fault=name)

    return each(part, judge)


def spoilt(put: Callable[..., Any], sound: Callable[[int], Any], first: int, rng: np.random.Generator) -> Any:
    """The first run, from a number on, into which a fault can be put; None: none of some."""
    for number in range(first, first + TRIES):
        run = sound(number)
        wrong = None if run is None else put(run, rng)
        if wrong is not None:
            return wrong
    return None


@lru_cache(maxsize=256)
def trace_of(seed: int, number: int) -> Trace | None:
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
    if Monitor(trace).faults() or check_trace(trace) is not None:
        raise RuntimeError(f"run {number} is not sound by itself: the check sim says more")
    return trace


def missed(fault: traces.Fault, wrong: Trace) -> list[str]:
    """Who does not see the rule that is broken."""
    named = any(re.search(fault.words, one) for one in Monitor(wrong).faults())
    refused = not fault.referee or check_trace(wrong) is not None
    return [*([] if named else ["the monitor"]), *([] if refused else ["the referee"])]


@lru_cache(maxsize=16)
def drive_of(seed: int, number: int) -> Drive | None:
    """A sound drive; None where the obstacles do not fit or nothing was driven."""
    rng = Ask(seed=seed).rng("monitor", "drive", number)
    made = scenes.harsh_drive(rng, number, time_limit=30.0)
    if made is None or not made.curves or len(made.t) < 5:
        return None
    if check_drive(made) is not None or watched(made):
        raise RuntimeError(f"drive {number} is not sound by itself: the check sim says more")
    return made


def missed_drive(fault: drives.DriveFault, wrong: Drive) -> list[str]:
    """Who does not see it; another rule that breaks with it does not count."""
    broken = check_drive(wrong)
    by = [] if broken is not None and broken.rule == fault.rule else [f"the referee ({broken})"]
    return [*by, "the watcher"] if fault.seen and fault.seen not in watched(wrong) else by


def watched(drive: Drive) -> list[str]:
    """What looking every few milliseconds finds wrong."""
    robot, seen = drive.scene.robot, watch(drive, every=0.01)
    tops = [drive.tracks[k].top_speed + 1e-6 for k in seen.body_speed]
    found = {
        "wall": seen.wall < robot.radius - 1e-6,
        "contact": seen.gap < -1e-6 and drive.outcome is not Ending.COLLISION,
        "speed": seen.top > robot.v_max * (1 + 1e-9),
        "jump": seen.longest_jump > robot.v_max * (1 + 1e-6) + 1e-9,
        "bodies": seen.apart < -1e-6,
        "obstacle speed": any(v > top for v, top in zip(seen.body_speed.values(), tops, strict=True)),
    }
    return [word for word, holds in found.items() if holds]


CHECK = Check(
    "monitor",
    ("G13",),
    "every fault put into a simulated run is seen by who judges the runs",
    KINDS,
    _run,
)
