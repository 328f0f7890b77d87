"""The front door: load_grid, plan, profile, simulate.

Nothing leaves through it that the referee has not re-checked.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from lampyris import referee
from lampyris.errors import SettingError
from lampyris.field.gates import find_gates
from lampyris.field.layers import clearance, free_cells, free_space, moves_for
from lampyris.field.solve import solve
from lampyris.maps.load import load_map
from lampyris.model.grid import Grid
from lampyris.model.path import Path, step_costs
from lampyris.model.plan import Plan, Status
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.model.traffic import Traffic
from lampyris.motion import laws
from lampyris.planners import registry
from lampyris.planners.base import Budget, Planner
from lampyris.sim import loop
from lampyris.typing import ByteGrid

MAX_SEED = 2**63 - 1


def load_grid(path_or_name: str | os.PathLike[str]) -> Grid:
    """The grid of a map file or of a bundled map.

    Parameters
    ----------
    path_or_name : a picture (PNG, BMP, PGM), a MovingAI ``.map``, text, a NumPy file, or a bundled name.

    Raises
    ------
    FileError : it cannot be read as a map.
    LimitError : it is larger than a map may be.
    """
    return load_map(path_or_name).grid


def plan(
    scene: Scene,
    planner: str | Planner = "ad-gso",
    seed: int = 0,
    *,
    budget: Budget | None = None,
    record: bool = True,
    **settings: Any,
) -> Plan:
    """A way from the scene's start to its goal, re-checked and measured against the optimum.

    Parameters
    ----------
    scene : what to plan in. Of its traffic, planners that see traffic (``sipp``) plan with the recorded
        obstacles, from tick 0; nobody else looks at it: see :func:`simulate`.
    planner : a name (see ``lampyris.planners()``) or a planner object.
    seed : root of every draw; the same seed gives the same plan.
    budget : when to give up.
    record : keep AD-GSO's per-iteration record in ``Plan.jumps``.
    settings : the planner's settings, such as ``choice="exact"``.

    Raises
    ------
    UsageError : no such planner, or settings beside a planner object.
    SettingError : a setting it does not have, or out of its range.
    InternalFault : the referee refused the result; a bug of ours.
    """
    chosen = _planner(planner, settings)
    _typed("scene", scene, Scene)
    if budget is not None:
        _typed("budget", budget, Budget)
    began = time.perf_counter()
    session = chosen.open(scene, np.random.default_rng(_seed(seed)), record=record)
    found = session.plan(None, budget)
    planned = time.perf_counter()
    found = assess(found, scene)
    found = replace(found, detail=_why(found, scene))
    assessed = time.perf_counter()
    referee.demand(referee.check_plan(found, scene))
    ended = time.perf_counter()
    timing = {
        "plan_s": planned - began,
        "assess_s": assessed - planned,
        "referee_s": ended - assessed,
        "total_s": ended - began,
    }
    return replace(found, timing=timing)


def assess(found: Plan, scene: Scene) -> Plan:
    """The same plan with what judges it: the optimum, the sum of cost-to-go, the gates.

    Planners that know these fill them in; the rest is measured here from the exact field of the scene.
    """
    gates = find_gates(scene.grid, scene.robot)
    if found.path is None:
        return replace(found, gates_in_map=gates)
    way = {(int(x), int(y)) for x, y in found.path.cells}
    optimal, to_go = found.optimal_exact, found.sum_cost_to_go
    if optimal is not None and optimal == found.path.exact and to_go is None:
        to_go = _sum_along_optimum(found.path, scene.grid.terrain)
    elif optimal is None or to_go is None:
        moves = moves_for(scene)
        free = free_cells(scene.grid, scene.robot.radius)
        field = solve(free, moves, scene.goal, terrain=scene.grid.terrain)
        x, y = found.path.cells[:, 0], found.path.cells[:, 1]
        optimal = int(field.exact[y[0], x[0]])
        to_go = float(moves.values(field.exact[y, x]).sum())
    return replace(
        found,
        optimal_exact=optimal,
        sum_cost_to_go=to_go,
        gates_in_map=gates,
        gates_on_path=tuple(g for g in gates if g.cell in way),
    )


def _why(found: Plan | Trace, scene: Scene) -> str:
    """The sentence of an answer; where there is no way, with the cells and numbers that say why."""
    word, radius = (found.status if isinstance(found, Plan) else found.outcome).value, scene.robot.radius
    for what, (x, y) in (("start", scene.start), ("goal", scene.goal)):
        if word != f"{what}-occupied":
            continue
        unknown = scene.grid.unknown
        if not scene.grid.blocked[y, x]:
            metres = float(clearance(scene.grid)[y, x])
            where = f"({x}, {y}) is free, but {metres:.3g} m from a wall"
            return f"The {what} {where}; the robot's radius is {radius:g} m."
        if unknown is not None and unknown[y, x]:
            return f"The {what} ({x}, {y}) is unknown to the map, which counts as blocked."
        return f"The {what} ({x}, {y}) is blocked."
    if word == Status.NO_PATH.value:
        size = f"The robot's radius is {radius:g} m." if radius > 0 else ""
        # Searches of the whole map have counted on the way and say so.
        regions = "" if " region" in found.sentence else _regions(scene)
        return " ".join(part for part in (found.sentence, regions, size) if part)
    return found.detail


def _regions(scene: Scene) -> str:
    """How many cells can be reached from either end, where the other is not among them."""
    free, moves = free_space(scene), moves_for(scene)
    reached = [
        solve(free, moves, end, terrain=scene.grid.terrain).exact >= 0 for end in (scene.start, scene.goal)
    ]
    if reached[1][scene.start[1], scene.start[0]]:
        return ""  # it is not the walls
    start, goal = (int(np.count_nonzero(cells)) for cells in reached)
    return f"The start's region has {start:,} cell{'s' * (start > 1)}, the goal's {goal:,}."


def _sum_along_optimum(path: Path, terrain: ByteGrid | None) -> float:
    """Sum of cost-to-go over an optimal path: there, what is left of the path *is* the cost to go."""
    exact = step_costs(path.cells, path.moves, terrain)
    to_go = np.concatenate((np.cumsum(exact[::-1])[::-1], [0]))
    return float(path.moves.values(to_go).sum())


def profile(way: Plan | Path, scene: Scene, law: str = "physical", *, v0: float = 0.0) -> Profile:
    """A speed for every node of a path, each with its cause, re-checked by the referee.

    Parameters
    ----------
    way : a path, or a plan that found one.
    scene : the map and the robot's limits.
    law : ``physical`` (SI units) or ``dissertation`` (velocity units).
    v0 : speed at the start, in the law's units.

    Raises
    ------
    SettingError : a plan without a path; no such law; v0 too fast to stop in time.
    """
    path = way.path if isinstance(way, Plan) else way
    if path is None:
        raise SettingError("PROFILE", "this plan holds no path", allowed="a plan whose status is found")
    made = laws.profile(path, scene, law=law, v0=v0)
    referee.demand(referee.check_profile(made, path, scene, v0=v0))
    return made


def simulate(
    scene: Scene,
    planner: str | Planner = "ad-gso",
    traffic: Traffic | tuple[Traffic, ...] | list[Traffic] | None = None,
    seed: int = 0,
    *,
    ticks: int | None = None,
    law: str = "physical",
    patience: int | None = None,
    progress: Callable[[int], None] | None = None,
    **settings: Any,
) -> Trace:
    """Drive through moving obstacles, tick by tick, and have every tick re-checked.

    Parameters
    ----------
    scene : where.
    planner : a name or a planner object.
    traffic : moving obstacles; None: the scene's own.
    seed : root of every draw; the same seed gives the same trace.
    ticks : when to stop; None: a generous number for the map's size.
    law : the speed law.
    patience : ticks in a row the robot waits before it gives up.
    progress : called with each tick.
    settings : the planner's settings.

    Raises
    ------
    SceneError : obstacles that do not fit the map.
    InternalFault : the referee refused the trace; a bug of ours.
    """
    chosen = _planner(planner, settings)
    _typed("scene", scene, Scene)
    if traffic is not None:
        scene = replace(scene, traffic=tuple(traffic) if isinstance(traffic, tuple | list) else (traffic,))
    free = free_space(scene)
    if scene.traffic and not (free[scene.start[1], scene.start[0]] and free[scene.goal[1], scene.goal[0]]):
        # A blocked end is the answer; whether the obstacles would have fitted is no longer the question.
        scene = replace(scene, traffic=())
    trace = loop.run(
        scene, chosen, seed=_seed(seed), ticks=ticks, law=law, patience=patience, progress=progress
    )
    began = time.perf_counter()
    referee.demand(referee.check_trace(trace))
    timing = {**trace.timing, "referee_s": time.perf_counter() - began}
    return replace(trace, detail=_why(trace, scene), timing=timing)


def _planner(planner: str | Planner, settings: dict[str, Any]) -> Planner:
    if isinstance(planner, str):
        return registry.make(planner, settings)
    if isinstance(planner, type) or not isinstance(planner, Planner):
        raise SettingError(
            "PLANNER", f"{planner!r} is no planner", allowed="a name, or an object with name, traits and open"
        )
    if settings:
        raise SettingError(
            "SETTING",
            f"settings {sorted(settings)} beside a planner object",
            allowed="settings inside the object",
        )
    return planner


def _typed(what: str, value: object, kind: type) -> None:
    if not isinstance(value, kind):
        raise SettingError("TYPE", f"a {type(value).__name__}", where=what, allowed=f"a {kind.__name__}")


def _seed(seed: int) -> int:
    whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if not whole or not 0 <= seed <= MAX_SEED:
        raise SettingError("SEED", f"seed {seed!r}", allowed=f"a whole number, 0 to {MAX_SEED}")
    return int(seed)
