"""Via points: the order in which they are visited, a plan for each leg, and the one plan that these make."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import UsageError
from lampyris.model.path import Path
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.many import solve_many
from lampyris.planning.visiting_order import best_order
from lampyris.typing import Cell

PlanLeg = Callable[[Scene, Budget | None], Plan]


@dataclass(frozen=True, slots=True)
class _Visits:
    """Via points in the order of visits, and the cost (cells) that no order is below, where that is known."""

    via: tuple[Cell, ...]
    least: float | None


def plan_through(scene: Scene, planner: Planner, budget: Budget | None, plan_leg: PlanLeg) -> Plan:
    """A plan from the start through all via points of a scene to its goal.

    Parameters
    ----------
    scene : with via points.
    planner : plans each leg.
    budget : its expansions are shared by the legs.
    plan_leg : the plan of a leg, judged against the optimum; its scene has the ends of the leg and no via points.

    Returns
    -------
    Plan : costs, counts and records of all legs. Of a leg that has no path, the status, and which leg it is.

    Raises
    ------
    UsageError : ``VIA``: a planner that plans times or poses.
    """
    traits = planner.traits
    if traits.plans_headings or traits.sees_traffic:
        what = "poses" if traits.plans_headings else "times"
        raise UsageError(
            "VIA", f"{planner.name} plans {what} and takes no via points", where="planner",
            allowed="a planner of paths of cells",
        )  # fmt: skip
    free = free_space(scene)
    for status, (x, y), where in (
        (Status.START_OCCUPIED, scene.start, ""),
        (Status.GOAL_OCCUPIED, scene.goal, ""),
        *((Status.NO_PATH, cell, not_free(cell)) for cell in scene.via),
    ):  # fmt: skip
        if not free[y, x]:
            return Plan(status, planner.name, detail=where, via=scene.via)
    visits = _visits(scene)
    legs: list[Plan] = []
    for leg in _legs(scene, visits.via):
        made = plan_leg(leg, _left(budget, _total(one.expansions for one in legs)))
        legs.append(made)
        if made.path is None:
            return _failed(legs, leg, visits)
    return _joined(legs, visits)


def not_free(cell: Cell) -> str:
    """What is said of a via point on which the robot cannot be."""
    return f"The via point {cell} is not a free cell for this robot."


def visiting_order(scene: Scene) -> tuple[Cell, ...]:
    """The via points of a scene in the order in which they are visited."""
    return _visits(scene).via


def _visits(scene: Scene) -> _Visits:
    if scene.via_order == "given":
        return _Visits(scene.via, None)
    moves = moves_for(scene)
    cells = (scene.start, *scene.via, scene.goal)
    x, y = np.array(cells, dtype=np.int64).T
    fields = solve_many(free_space(scene), moves, cells[1:], terrain=scene.grid.terrain)
    costs: NDArray[np.int64] = np.stack([field.exact[y[:-1], x[:-1]] for field in fields], axis=1)
    if (costs < 0).any():
        return _Visits(scene.via, None)  # one leg has no path in any order
    order, least = best_order(costs)
    return _Visits(tuple(scene.via[k] for k in order), moves.value(least))


def _legs(scene: Scene, via: tuple[Cell, ...]) -> Iterator[Scene]:
    cells = (scene.start, *via, scene.goal)
    for a, b in pairwise(cells):
        yield replace(scene, start=a, goal=b, start_pose=None, goal_pose=None, via=())


def _left(budget: Budget | None, used: int) -> Budget | None:
    if budget is None or budget.expansions is None:
        return budget
    return replace(budget, expansions=max(budget.expansions - used, 1))


def _failed(legs: Sequence[Plan], leg: Scene, visits: _Visits) -> Plan:
    last = legs[-1]
    place = f"Leg {len(legs)} of {len(visits.via) + 1}, {leg.start} to {leg.goal}"
    return Plan(
        last.status,
        last.planner,
        iterations=_total(one.iterations for one in legs),
        expansions=_total(one.expansions for one in legs),
        detail=f"{place}: {last.sentence}",
        gates_in_map=last.gates_in_map,
        notes=_notes(legs),
        via=visits.via,
    )


def _joined(legs: Sequence[Plan], visits: _Visits) -> Plan:
    paths = [one.path for one in legs if one.path is not None]
    lengths = [len(path.cells) - 1 for path in paths]
    cells = np.concatenate([paths[0].cells[:1], *(path.cells[1:] for path in paths)])
    paid = None if paths[0].paid is None else _total(path.exact for path in paths)
    optimal = [one.optimal_exact for one in legs if one.optimal_exact is not None]
    turns = [one.waypoints for one in legs if one.waypoints is not None]
    gates = {gate.cell: gate for one in legs for gate in one.gates_on_path}
    least = [one.time_lower_bound for one in legs if one.time_lower_bound is not None]
    return Plan(
        Status.FOUND,
        legs[0].planner,
        Path(
            cells, paths[0].moves, tuple(map(_total, zip(*(path.steps for path in paths), strict=True))), paid
        ),
        iterations=_total(one.iterations for one in legs),
        expansions=_total(one.expansions for one in legs),
        jumps=tuple(jump for one in legs for jump in one.jumps),
        gates_met=tuple(cell for one in legs for cell in one.gates_met),
        optimal_exact=_total(optimal) if len(optimal) == len(legs) else None,
        repaired=any(one.repaired for one in legs),
        gates_on_path=tuple(gates.values()),
        gates_in_map=legs[0].gates_in_map,
        attributes={
            key: min(one.attributes[key] for one in legs)
            for key in legs[0].attributes
            if all(key in one.attributes for one in legs)
        },
        notes=_notes(legs),
        waypoints=np.concatenate([turns[0][:1], *(one[1:] for one in turns)]) if turns else None,
        via=visits.via,
        via_at=tuple(np.cumsum(lengths)[:-1].tolist()),
        via_lower_bound=visits.least,
        time_lower_bound=math.fsum(least) if len(least) == len(legs) else None,
    )


def _total(numbers: Iterable[int]) -> int:
    return sum(numbers)  # bits: whole numbers


def _notes(legs: Sequence[Plan]) -> tuple[str, ...]:
    """The notes of all legs; one that every leg has is said once."""
    common = [note for note in legs[0].notes if all(note in one.notes for one in legs)]
    own = [
        f"leg {k}: {note}"
        for k, one in enumerate(legs, 1)
        for note in one.notes
        if note not in common
    ]  # fmt: skip
    return (*common, *own)
