"""Swarm planners keep to their bounds: valid, never shorter than the best way, never longer than their seed.

What is promised: a seeded swarm (the ten that judge whole ways begin with the exact way unless told not
to) is never longer than that way and its slack; without a seed and repairing it may find nothing, but says so
and denies no way: it alone may give up. The two baselines that move cell by cell and AD-GSO promise a valid
way. Nobody is better than the best. The reference is that of the check ``random``.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from lampyris.model.plan import Plan
from lampyris.planning import registry
from lampyris.planning.swarm.session import SwarmPlanner
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.paths import worlds
from lampyris_selfcheck.checks.paths.answers import Truth, drawn, in_cells, wrong
from lampyris_selfcheck.checks.paths.worlds import SmallWorld
from lampyris_selfcheck.reference.paths.search import Cell

SWARMS = (
    "gso",
    "igso",
    "pso",
    "lpso",
    "apso",
    "ipso",
    "pso-apf",
    "diversity-pso",
    "ant-system",
    "mmas-dstar",
)
STEPPERS = ("ad-gso", "dstar-lpso", "dstar16-lpso")
MOVES = ("octile", "dissertation", "four-connected", "sixteen-connected")
SEEDS = 5
"""Runs of a planner on one map."""
SMALLEST, LARGEST = 4, 22
"""Cells a side."""
ROUNDING = 1e-9
SLACKS = (0.1, 0.5, 2.0)


@lru_cache(maxsize=4)
def _asked(ask: Ask, group: int) -> tuple[SmallWorld, Cell, Cell]:
    """A map and two ends; one map in ten has a blocked end, one in thirty the same cell twice."""
    rng = ask.rng("swarm", "map", group)
    width, height = (int(n) for n in rng.integers(SMALLEST, LARGEST + 1, size=2))
    world = worlds.made(rng, width, height, MOVES[group % 4], rough=rng.random() < 0.4, goals=1)
    if not world.goals:
        return world, (0, 0), (0, 0)
    start, goal = worlds.one(rng, world.free), world.goals[0]
    draw = rng.random()
    if draw < 1 / 30:
        start = goal
    elif draw < 2 / 15 and not world.free.all():
        blocked = worlds.one(rng, ~world.free)
        start, goal = (blocked, goal) if rng.random() < 0.5 else (start, blocked)
    return world, start, goal


def _settings(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """Of a swarm: seeded in four runs of five, sometimes with slack; without a seed sometimes repaired.

    Half of them care more for room and straightness than for length: only these would pass their bounds.
    """
    settings: dict[str, Any] = {"swarm": int(rng.integers(4, 11)), "iterations": int(rng.integers(2, 7))}
    if rng.random() < 0.5:
        settings |= {"clearance": float(rng.choice([3.0, 20.0])), "turns": float(rng.choice([0.0, 2.0]))}
    if seed == SEEDS - 1:
        return settings | {"seeded": False, "repair": bool(rng.integers(2))}
    return settings | ({"slack": float(rng.choice(SLACKS))} if rng.random() < 0.25 else {})


def bounds_wrong(plan: Plan, truth: Truth, settings: dict[str, Any]) -> str:
    """What of a swarm's own promises an answer breaks, beyond those of every planner."""
    trace = plan.best_by_iteration
    if any(after > before for before, after in pairwise(trace)):
        return f"the best so far rose: {trace}"
    if len(trace) != plan.iterations:
        return f"{plan.iterations} iterations, a record of {len(trace)}"
    if truth.word != "found" or truth.cost is None:
        return ""
    if not settings.get("seeded", True):
        repaired = bool(plan.detail)
        if plan.path is not None and trace and not repaired and trace[-1] < plan.cost - ROUNDING:
            return f"the best fitness, {trace[-1]!r}, is below the cost of its way, {plan.cost!r}"
        return ""
    if plan.path is None:
        return f"seeded, and answers {plan.status.value}"
    best = in_cells(truth.cost, plan.path.moves.name, weighed=truth.terrain is not None)
    most = best * (1.0 + settings.get("slack", 0.0))
    if plan.cost > most * (1.0 + ROUNDING):
        return f"costs {plan.cost!r} cells; its seed {best!r}, with its slack {most!r}"
    return ""


def _judge(ask: Ask, name: str, number: int) -> tuple[SmallWorld, Cell, Cell, dict[str, Any], str, str]:
    """The question, the settings, the status and what is wrong."""
    group, seed = divmod(number, SEEDS)
    world, start, goal = _asked(ask, group)
    rng = ask.rng("swarm", name, number)
    swarm = issubclass(registry.planner_class(name), SwarmPlanner)
    settings = _settings(rng, seed) if swarm else {}
    truth, scene = worlds.truth(world, start, goal, 0), worlds.scene_of(world, start, goal)
    word = truth.word
    try:
        plan = registry.make(name, settings).open(scene, rng, record=True).plan()
        word = plan.status.value
        seeded = settings.get("seeded", True)
        plain = swarm and seeded and not settings.get("slack")
        gives_up = not seeded and not settings["repair"]
        fault = wrong(plan, scene, truth, optimal=plain, gives_up=gives_up)
        if not fault and swarm:
            fault = bounds_wrong(plan, truth, settings)
    except Exception as error:
        fault = f"raises {type(error).__name__}: {error}"
    return world, start, goal, settings, word, fault


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        world, start, goal, settings, word, fault = _judge(ask, part.kind, number)
        how = "with slack" if settings.get("slack") else "seeded"
        how = how if settings.get("seeded", True) else "without a seed"
        tally.case(
            f"{word}, {how}" if settings else word,
            *(["rough ground"] if world.terrain is not None else []),
            *(["robot with a size"] if world.wide else []),
        )
        if fault:
            grid, moves = world.scene.grid, world.scene.moves.name
            tally.fail(
                number,
                f"{part.kind} {settings}, {moves} moves, {start} to {goal}: {fault}",
                rows=drawn((~grid.blocked).tolist()),
                terrain=None if grid.terrain is None else grid.terrain.tolist(),
                start=start,
                goal=goal,
                moves=moves,
                radius=world.scene.robot.radius,
                resolution=grid.resolution,
                settings=settings,
            )
    return tally.outcome()


def _kind(name: str) -> Kind:
    """Each planner on 250 maps, 5 seeds each; 20,000 by night; 120,000 for a release."""
    bound = "never longer than its seed and slack" if name in SWARMS else "valid"
    return Kind(
        f"{name}: {bound}, never shorter than the best way; {SEEDS} seeds a map",
        commit=25 * SEEDS,
        nightly=20_000 * SEEDS,
        release=120_000 * SEEDS,
        chunk=300,
    )


CHECK = Check(
    "swarm",
    ("G6",),
    "swarm planners are valid and within their bounds, and their best so far never gets worse",
    {name: _kind(name) for name in (*SWARMS, *STEPPERS)},
    _run,
)
