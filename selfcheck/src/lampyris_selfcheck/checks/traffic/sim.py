"""Nobody ever collides: simulations and drives of every kind, judged by who knows nothing of the simulator.

Ticks are judged by the referee and, a share of the long ones, by :mod:`lampyris_selfcheck.reference.motion.sim_monitor`;
drives by the referee in exact continuous time, a share by a watcher that looks every few milliseconds. A case is one
run; ``steps`` are ticks, and for drives stretches of one acceleration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from lampyris.errors import SceneError
from lampyris.io.maps.library import load
from lampyris.model.moves import moves_named
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Crossing, RandomWalk
from lampyris.motion.laws.dissertation import DissertationLaw
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.field.solve import solve
from lampyris.referee import check_drive, check_trace
from lampyris.sim.grid import loop
from lampyris_selfcheck.check import Ask, Check, Kind, Part, Tally, each
from lampyris_selfcheck.check import Outcome as Seen
from lampyris_selfcheck.checks.paths.answers import own
from lampyris_selfcheck.checks.speed import compiled_drives
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes
from lampyris_selfcheck.reference.motion.drive_monitor import watch
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor
from lampyris_selfcheck.reference.motion.tick_speed import gains

KINDS = {
    "fast": Kind(
        "compiled ticks among 5 to 60 walkers on bundled maps; a share is compared with the loop in Python, field by field",
        60,
        190_000,
        500_000,
        250,
        least={"arrived": 0.9},
    ),
    "crowd": Kind(
        "walkers on up to a third of a small map, a share with crossing obstacles: compiled ticks and the loop in Python, "
        "field by field",
        60,
        8_000,
        40_000,
        50,
        least={"arrived": 0.7, "compared with the loop": 0.7},
    ),
    "walk": Kind(
        "the loop: every planner, step set, kind of traffic and size of bodies",
        190,
        24_000,
        100_000,
        100,
        least={"arrived": 0.6, "sized": 0.3},
    ),
    "compiled": Kind(
        "compiled ticks, whole and stopped at random, and the loop in Python, field by field: every kind of traffic, law and "
        "planner, also with edits",
        12,
        10_000,
        50_000,
        50,
        least={"arrived": 0.5, "of one cell": 0.6},
    ),
    "periods": Kind(
        "drives by compiled periods, whole and stopped at random, and by the loop in Python, field by field: every kind of "
        "traffic, law and planner",
        4,
        1_000,
        4_000,
        10,
        least={"arrived": 0.3, "compiled": 0.8},
    ),
    "edits": Kind("the loop, with walls that come and go", 20, 8_000, 40_000, 50, least={"arrived": 0.5}),
    "drive": Kind(
        "drives in continuous time with settings at their worst: never nearer than both radii while moving, "
        "by laws that promise it; obstacles keep clear of each other",
        6,
        1_500,
        6_000,
        10,
        least={"arrived": 0.3},
    ),
}

MONITORED = {"fast": 19, "crowd": 1, "walk": 1, "edits": 1, "compiled": 1}
"""One run in so many is judged by the monitor too.

Maps take turns, too: a stride that shared a factor with theirs would leave some out for ever.
"""

COMPARED = 101
"""One compiled run in so many is compared with the loop in Python."""

MAPS = ("env-1", "env-2", "env-3", "env-4", "env-5", "env-6", "caves-64", "rooms-20")
_CROWDS = (
    RandomWalk(5),
    RandomWalk(20),
    RandomWalk(40),
    RandomWalk(60),
    RandomWalk(20, 1.0),
    RandomWalk(10, 0.1),
)
_LAWS = ("dissertation", DissertationLaw(ring1="ahead", outside2=True, braking=30.0))
RUNS_A_SCENE = 25
LONGEST_CROWD = 60
"""Ticks of a run in a crowd."""


def _run(ask: Ask, part: Part) -> Seen:
    return each(part, partial(_JUDGES[part.kind], ask))


def faults_of(trace: Trace, monitored: bool = True) -> str:
    """What the referee, and the monitor if it is asked, say of a trace; empty when they find nothing."""
    broken = check_trace(trace)
    found = [] if broken is None else [f"referee: {broken}"]
    if monitored:
        found += [f"monitor: {one}" for one in Monitor(trace).faults()[:3]]
    return "; ".join(found)


def _judge_trace(trace: Trace, kind: str, number: int, tally: Tally, **data: Any) -> None:
    tally.count("steps", trace.ticks)
    tally.count(trace.outcome.value)
    fault = faults_of(trace, number % MONITORED[kind] == 0)
    if fault:
        tally.fail(number, fault, **data)
    if not trace.arrived and not trace.detail:
        tally.fail(number, f"{trace.outcome.value}, and no word why", **data)


# ---- ticks ----


def planner_of(number: int) -> str:
    """Our planners take turns."""
    names = (*own(True), *own(False))
    return names[number % len(names)]


def _looped(ask: Ask, number: int, tally: Tally, *, check: str) -> None:
    name = planner_of(number)
    rng = ask.rng("sim", check, number)
    kind = scenes.KINDS[int(rng.integers(len(scenes.KINDS)))]
    moves = scenes.MOVES[int(rng.integers(len(scenes.MOVES)))]
    robot, body = scenes.SIZES[int(rng.integers(len(scenes.SIZES)))]
    law = ("physical", "dissertation")[int(rng.integers(2))]
    scene = scenes.drawn_scene(rng, kind, robot, body, moves)
    if check == "edits":
        scene = scenes.with_edits(scene, rng)
    data = {"planner": name, "traffic": kind, "moves": moves, "radii": [robot, body]}
    try:
        trace = by_tick(loop.Simulation(scene, scenes.planner(name), seed=number, law=law, patience=15))
    except SceneError as refused:
        tally.count(f"refused: {refused.code}")
        if refused.code not in scenes.REFUSED:
            tally.fail(number, str(refused), **data)
        return
    tally.count(kind)
    tally.count("sized" if robot or body else "of one cell")
    wrong = gains(
        [(x, y) for x, y in trace.robot.tolist()],
        trace.speed.tolist(),
        law,
        scene.robot.a_max,
        scene.grid.resolution,
    )
    if wrong:
        tally.fail(number, f"{law}: {wrong[0]}", **data)
    _judge_trace(trace, check, number, tally, **data)


@lru_cache(maxsize=4)
def _bundled_scene(seed: int, which: int) -> tuple[Scene, AdGso, Any]:
    """A scene between two far cells of a bundled map; kept for the runs that follow."""
    rng = Ask(seed=seed).rng("sim", "fast scene", which)
    grid = load(MAPS[which % len(MAPS)]).grid
    moves = moves_named(("octile", "dissertation", "four-connected")[int(rng.integers(3))])
    ys, xs = np.nonzero(~grid.blocked)
    cells = [(int(x), int(y)) for x, y in zip(xs, ys, strict=True)]
    start = cells[int(rng.integers(len(cells)))]
    # Where a way leads, and among some the one farthest off: a longer run for the same price.
    away = solve(~grid.blocked, moves, start).exact
    some = [cells[k] for k in rng.integers(len(cells), size=6).tolist()]
    goal = max(some, key=lambda c: (float(away[c[1], c[0]]), c))
    crowd = _CROWDS[int(rng.integers(len(_CROWDS)))]
    if grid.width * grid.height < 1_000 and crowd.count > 20:
        crowd = RandomWalk(20)
    who = (AdGso(), AdGso(choice="exact"), AdGso(gates="close"), AdGso(nt=3, mvr=2))[int(rng.integers(4))]
    law = _LAWS[int(rng.integers(2))]
    scene = Scene(grid, start, goal, moves, traffic=(crowd,))
    return scene, who, law


def _fast(ask: Ask, number: int, tally: Tally) -> None:
    scene, who, law = _bundled_scene(ask.seed, number // RUNS_A_SCENE)
    trace = loop.run(scene, who, seed=number, law=law)
    if number % COMPARED == 0:
        _compare(trace, by_tick(loop.Simulation(scene, who, seed=number, law=law)), number, tally)
    _judge_trace(trace, "fast", number, tally)


def _compare(trace: Trace, other: Trace, number: int, tally: Tally) -> None:
    tally.count("compared with the loop")
    where = difference(trace, other)
    if where:
        tally.fail(number, f"compiled ticks and the loop in Python differ in {where}")


def _crowd(ask: Ask, number: int, tally: Tally) -> None:
    """Much happens on little room: bodies in each other's way, and in the robot's, at every tick."""
    rng = ask.rng("sim", "crowd", number)
    scene = scenes.crowded(rng)
    if number % 4 == 3:
        scene = replace(scene, traffic=(*scene.traffic, Crossing(2)))
    who, law = (AdGso(), AdGso(nt=3, mvr=2))[int(rng.integers(2))], _LAWS[int(rng.integers(2))]
    patience = int(rng.integers(0, 6))
    settings: dict[str, Any] = {"seed": number, "law": law, "ticks": LONGEST_CROWD, "patience": patience}
    try:
        found = loop.run(scene, who, **settings)
    except SceneError as refused:
        tally.count(f"refused: {refused.code}")
        if refused.code not in scenes.REFUSED:
            tally.fail(number, str(refused))
        return
    _compare(found, by_tick(loop.Simulation(scene, who, **settings)), number, tally)
    _judge_trace(found, "crowd", number, tally)


def by_tick(run: loop.Simulation) -> Trace:
    """The rest of a simulation by the loop in Python."""
    while run.outcome is None:
        run.tick()
    return run.trace()


def by_pieces(run: loop.Simulation, rng: np.random.Generator) -> Trace:
    """The rest of a simulation, some of it tick by tick, some of it compiled, looked at in between."""
    while run.outcome is None:
        what = int(rng.integers(4))
        if what == 0:
            run.tick()
        elif what < 3:
            run.advance(int(rng.integers(1, (4, 30)[what - 1])))
        else:
            run.tick_speed.caps()
            run.trace()
    return run.trace()


_COMPILED_LAWS = ("physical", "physical", "dissertation", "uncertainty", "rpp")
_COMPILED_PLANNERS = ("ad-gso", "sipp", "astar", "dstar-lite")
LONGEST_COMPILED = 120
"""Ticks of a run that is compared."""


def _compiled(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("sim", "compiled", number)
    name = planner_of(number) if number % 4 == 0 else _COMPILED_PLANNERS[int(rng.integers(4))]
    kind = scenes.KINDS[int(rng.integers(len(scenes.KINDS)))]
    moves = scenes.MOVES[int(rng.integers(len(scenes.MOVES)))]
    robot, body = scenes.SIZES[int(rng.integers(len(scenes.SIZES)))] if number % 8 == 0 else (0.0, 0.0)
    law = _COMPILED_LAWS[int(rng.integers(len(_COMPILED_LAWS)))]
    crowded = number % 5 == 1
    scene = scenes.crowded(rng) if crowded else scenes.drawn_scene(rng, kind, robot, body, moves)
    if number % 6 == 2:
        scene = scenes.with_edits(scene, rng)
    settings: dict[str, Any] = {
        "seed": number, "law": law, "ticks": LONGEST_COMPILED, "patience": int(rng.integers(16)),
    }  # fmt: skip
    who = scenes.planner(name)
    try:
        known = by_tick(loop.Simulation(scene, who, **settings))
    except SceneError as refused:
        tally.count(f"refused: {refused.code}")
        return
    tally.count("sized" if robot or body else "of one cell")
    data = {"planner": name, "traffic": kind, "moves": moves, "law": law}
    for how, trace in (
        ("compiled", loop.run(scene, who, **settings)),
        ("in pieces", by_pieces(loop.Simulation(scene, who, **settings), rng)),
    ):
        where = difference(trace, known)
        if where:
            tally.fail(number, f"{how} and tick by tick the runs differ in {where}", **data)
    _judge_trace(known, "compiled", number, tally, **data)


def difference(a: Trace, b: Trace) -> str:
    """The first field in which two traces differ, but for their timing; empty: none."""
    for name in (f.name for f in fields(Trace)):
        x, y = getattr(a, name), getattr(b, name)
        if name in ("scene", "timing"):
            continue
        if name == "tracks":
            equal = len(x) == len(y) and all(map(np.array_equal, x, y))
        elif name == "path" and x is not None and y is not None:
            equal = np.array_equal(x.cells, y.cells) and x.exact == y.exact
        else:
            equal = np.array_equal(x, y) if isinstance(x, np.ndarray) else x == y
        if not equal:
            return name
    return ""


# ---- continuous time ----


def _drive(ask: Ask, number: int, tally: Tally) -> None:
    run = scenes.harsh_drive(ask.rng("sim", "drive", number), number)
    if run is None:
        tally.count("refused: obstacles do not fit")
        return
    tally.count("steps", max(len(run.t) - 1, 0))
    tally.count(run.outcome.value)
    tally.count(f"law {run.law}")
    broken = check_drive(run)
    data = {"law": run.law, "planner": run.planner}
    if broken is not None:
        tally.fail(number, str(broken), **data)
    # Blind is asked for hidden obstacles alone; what it is given, it minds as the others do.
    if run.law in scenes.PROMISE and run.law != "blind" and run.outcome is Outcome.COLLISION:
        tally.fail(number, f"{run.law} promises not to collide: {run.detail}", **data)
    if number % 4 == 0 and run.curves:
        tally.count("watched")
        seen = watch(run, every=0.02)
        if seen.gap < -1e-6 and run.outcome is not Outcome.COLLISION:
            tally.fail(number, f"seen {-seen.gap!r} m deep in a body at {seen.gap_when!r} s", **data)
        if seen.apart < -1e-6:
            tally.fail(number, f"seen two obstacles {-seen.apart!r} m deep in each other", **data)
        if seen.wall < run.scene.robot.radius - 1e-6:
            tally.fail(number, f"seen {seen.wall!r} m from a wall", **data)


_JUDGES: dict[str, Callable[[Ask, int, Tally], None]] = {
    "fast": _fast,
    "crowd": _crowd,
    "walk": partial(_looped, check="walk"),
    "compiled": _compiled,
    "periods": compiled_drives.judge,
    "edits": partial(_looped, check="edits"),
    "drive": _drive,
}

CHECK = Check(
    "sim",
    ("G10",),
    "obstacles never share a cell, swap or cross, nor overlap in drives; contacts with the robot are told",
    KINDS,
    _run,
)
