"""One question to a planner and the judgement of its answer, for the checks of planners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.base import Planner
from lampyris.planning.swarm.session import SwarmPlanner
from lampyris.referee import check_plan
from lampyris_selfcheck.reference.paths.path_cost import PLAIN, walked
from lampyris_selfcheck.reference.paths.search import Cost, Counts, cost_of, less

UNFINISHED = ("iteration-limit", "limit")
"""What a planner that may give up says where there is a way: a swarm without a seed and without repairing."""
NEAR = 1e-12
"""Share by which a cost as a float may be off: rounding."""


@cache
def own(optimal: bool) -> tuple[str, ...]:
    """The names of our own planners, exact ones or the others; guests are for their own tests."""
    rows = registry.list_planners()
    return tuple(
        name for name in rows if rows[name].traits.optimal is optimal and not registry.origin_of(name)
    )


SMALL_SWARM = {"swarm": 8, "iterations": 5}
"""A swarm's settings where answers count, not how good they are."""


def exact() -> tuple[str, ...]:
    """All that must answer exactly: our planners that say so, and AD-GSO told to choose exactly."""
    return (*own(True), EXACT_AD_GSO)


EXACT_AD_GSO = "ad-gso choice=exact"


@cache
def planner(name: str) -> Planner:
    """A planner by its name; those with a swarm of their own have a small one."""
    if name == EXACT_AD_GSO:
        return registry.make("ad-gso", {"choice": "exact"})
    small = issubclass(registry.planner_class(name), SwarmPlanner)
    return registry.make(name, SMALL_SWARM if small else {})


@dataclass(frozen=True)
class Truth:
    """What the reference says of a question.

    Parameters
    ----------
    free : where the robot's centre may be: rows, or bool (height, width).
    word : the status that must be answered.
    cost : of a cheapest way, see :func:`lampyris_selfcheck.reference.paths.search.cost_of`; None: no way.
    terrain : what cells cost besides, or None.
    wide : whether the robot has a size.
    """

    free: Any
    word: str
    cost: Cost | None
    terrain: Any = None
    wide: bool = False


def asked(name: str, scene: Scene, rng: np.random.Generator | None = None) -> Plan:
    """The answer of our planner of that name, in a session of its own."""
    return planner(name).open(scene, rng or np.random.default_rng(0)).plan()


def wrong(plan: Plan, scene: Scene, truth: Truth, *, optimal: bool = True, gives_up: bool = False) -> str:
    """What is wrong with an answer; nothing: an empty word.

    The verdict must be the reference's; one that ``gives_up`` may do so where there is a way, but not deny
    it. The referee must pass the plan. The way must be one by the reference's own rules, from end to end,
    and its recounted cost must be the least: exactly for an exact planner, else at least that.
    """
    allowed = (truth.word, *UNFINISHED) if gives_up and truth.word == "found" else (truth.word,)
    if plan.status.value not in allowed:
        return f"answers {plan.status.value}, the reference {truth.word}"
    broken = check_plan(plan, scene)
    if broken is not None:
        return f"the referee: {broken}"
    if plan.path is None:
        return ""
    cells = [(x, y) for x, y in plan.path.cells.tolist()]
    if cells[0] != scene.start or cells[-1] != scene.goal:
        return f"goes from {cells[0]} to {cells[-1]}"
    name = scene.moves.name
    fault, counts = walked(truth.free, cells, name, wide=truth.wide, terrain=truth.terrain)
    if fault:
        return f"the way: {fault}"
    assert truth.cost is not None  # the word is found
    return _cost_wrong(plan, counts, name, truth, optimal)


def _cost_wrong(plan: Plan, counts: Counts, name: str, truth: Truth, optimal: bool) -> str:
    path, best = plan.path, truth.cost
    assert path is not None
    assert best is not None
    if truth.terrain is None and (*path.steps, 0)[:3] != (*counts, 0)[: len((*path.steps, 0)[:3])]:
        return f"claims {path.steps} steps, makes {counts}"
    cost = cost_of(counts, name)
    if less(cost, best):
        return f"costs {cost}, less than the least, {best}: the reference is wrong, or the way"
    if optimal and less(best, cost):
        return f"costs {cost}, the least is {best}"
    value = in_cells(cost, name, weighed=truth.terrain is not None)
    if not math.isclose(plan.cost, value, rel_tol=NEAR, abs_tol=0.0):
        return f"says it costs {plan.cost!r} cells, its steps {value!r}"
    least = path.moves.value(plan.optimal_exact) if plan.optimal_exact is not None else None
    if least is not None and not math.isclose(
        least, in_cells(best, name, weighed=truth.terrain is not None), rel_tol=NEAR
    ):
        return f"says the optimum is {least!r} cells, it is {best}"
    if plan.optimal_exact is None and optimal and plan.planner in own(True):
        return "is exact and does not say so"
    return ""


def in_cells(cost: Cost, name: str, *, weighed: bool) -> float:
    """A reference's cost as a length in cells."""
    unit = (1 if name == "octile" else 10) * (PLAIN if weighed else 1)
    return (cost[0] + math.sqrt(2 * cost[1] ** 2)) / unit


def drawn(free: Sequence[Sequence[bool]]) -> list[str]:
    """A map as rows of ``.`` and ``#``, for a failure's report."""
    return ["".join(".#"[not f] for f in row) for row in free]
