"""What each planner of fleets must answer: its plan by the rules, and by what it promises."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lampyris.errors import InternalFault
from lampyris.fleets import plan_fleet
from lampyris.kernels.fleet.space_time import AT_MOST, LONGER, MUST_AT, NOT_AT, NOT_FROM, NOT_STEP
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.planning.base import Budget
from lampyris.planning.fleet.distance_tables import tables_of
from lampyris.planning.fleet.lacam import LacamSearch
from lampyris.planning.fleet.pibt import PibtRun
from lampyris.planning.fleet.space_time import SpaceTime
from lampyris_selfcheck.checks.fleets.fleet_draws import FEW, DrawnFleet
from lampyris_selfcheck.reference.fleets.fleet_rules import Cell, broken, distances, neighbours
from lampyris_selfcheck.reference.fleets.joint_space import is_solvable, least_sum_of_costs, least_sum_of_loss
from lampyris_selfcheck.reference.fleets.one_by_one import earliest_allowed, earliest_arrival
from lampyris_selfcheck.reference.paths.joint_plans import least_sum_of_costs as least_by_shares

BEYOND = 2
"""How much more than the sum of the shortest paths is looked for where the joint space is too large."""
ENDLESS = 1_000_000
"""Iterations that exhaust every tiny fleet."""


@dataclass(frozen=True, eq=False)
class FleetTruth:
    """The right answers for a fleet, each worked out when it is asked for."""

    drawn: DrawnFleet

    @cached_property
    def alone(self) -> list[int | None]:
        """Steps of each robot's own shortest path."""
        fleet = self.drawn.fleet
        octile = self.drawn.octile
        return [distances(self.drawn.rows, one.goal, octile=octile).get(one.start) for one in fleet.robots]

    @cached_property
    def solvable(self) -> bool:
        """Whether there is a plan; of tiny fleets."""
        fleet = self.drawn.fleet
        return is_solvable(self.drawn.rows, fleet.starts, fleet.goals, octile=self.drawn.octile)

    @cached_property
    def least(self) -> int | None:
        """The least sum of costs; None: there is no plan, or (of a larger fleet) it is not known."""
        rows, fleet, octile = self.drawn.rows, self.drawn.fleet, self.drawn.octile
        if self.drawn.is_tiny:
            return least_sum_of_costs(rows, fleet.starts, fleet.goals, octile=octile)
        if len(fleet) > FEW:
            return None
        return least_by_shares(rows, fleet.starts, fleet.goals, BEYOND, octile=octile)


def cells_of(plan: FleetPlan) -> list[list[Cell]]:
    """A plan's paths as tuples."""
    return [[(x, y) for x, y in path.tolist()] for path in plan.paths]


def asked(
    fleet: Fleet,
    planner: str,
    seed: int,
    budget: int | None,
    settings: dict[str, Any],
    moves: str = "four-connected",
) -> FleetPlan | str:
    """The plan, or what the referee said."""
    try:
        return plan_fleet(
            fleet, planner, seed=seed, budget=None if budget is None else Budget(expansions=budget),
            planner_settings=settings, moves=moves,
        )  # fmt: skip
    except InternalFault as error:
        return f"the referee: {error}"


def conflicts_of(plan: FleetPlan, drawn: DrawnFleet) -> str:
    """Which rules the paths break, by their definitions; empty: none."""
    if not plan.paths:
        return ""
    fleet, found = drawn.fleet, plan.status is Status.FOUND
    faults = broken(drawn.rows, fleet.starts, fleet.goals, cells_of(plan), whole=found, octile=drawn.octile)
    return f"breaks {', '.join(sorted(faults))}" if faults else ""


def plan_wrong(plan: FleetPlan, drawn: DrawnFleet, truth: FleetTruth) -> str:
    """What every plan must have: no conflicts, figures that are those of its paths, bounds that are true."""
    found = plan.status is Status.FOUND
    fault = conflicts_of(plan, drawn)
    if fault:
        return fault
    lost = None in truth.alone
    if lost != (plan.status is Status.NO_PATH and "walls separate" in plan.sentence):
        return f"answers {plan.status}: {plan.sentence}; robots' own shortest paths are {truth.alone}"
    if not lost and plan.shortest is not None and plan.shortest.tolist() != truth.alone:
        return f"says {plan.shortest.tolist()} are the shortest paths, they are {truth.alone}"
    denied = plan.status is Status.NO_PATH
    if drawn.is_tiny and ((found and not truth.solvable) or (denied and truth.solvable)):
        return f"answers {plan.status}; there is {'a' if truth.solvable else 'no'} plan"
    if found and plan.sum_of_costs != sum(len(path) - 1 for path in plan.paths):
        return f"sum of costs {plan.sum_of_costs}"
    return ""


def complete_wrong(plan: FleetPlan, drawn: DrawnFleet, truth: FleetTruth) -> str:
    """Of a complete planner without a budget: it has a plan if there is one."""
    if drawn.is_tiny and plan.status not in (Status.FOUND, Status.NO_PATH):
        return f"answers {plan.status}, without a budget"
    if drawn.is_tiny and bool(plan) != truth.solvable:
        return f"answers {plan.status}; there is {'a' if truth.solvable else 'no'} plan"
    return ""


def bound_wrong(plan: FleetPlan, drawn: DrawnFleet, truth: FleetTruth, weight: float) -> str:
    """Of ``cbs`` and ``eecbs``: the bound is one, and the plan within its factor of it."""
    bound, costs = plan.lower_bound, plan.sum_of_costs
    if plan.status is Status.LIMIT and len(drawn.fleet) == 2 and drawn.is_tiny:
        return "is not solved, with two robots"
    if bound is None or plan.status is Status.NO_PATH:
        return ""
    if costs is not None and costs > weight * bound * (1 + 1e-9):
        return f"costs {costs}, its bound is {bound}, its factor {weight:g}"
    if truth.least is None:
        alone = sum(one or 0 for one in truth.alone)
        looked = drawn.is_tiny or (len(drawn.fleet) <= FEW and costs is not None and costs <= alone + BEYOND)
        if costs is not None and looked:
            return f"costs {costs}; no plan costs so little"
        return ""
    if bound > truth.least:
        return f"has the lower bound {bound}; there is a plan that costs {truth.least}"
    if costs is not None and costs < truth.least:
        return f"costs {costs}; the least is {truth.least}"
    return ""


def order_wrong(plan: FleetPlan, drawn: DrawnFleet, truth: FleetTruth) -> str:
    """Of ``prioritised-sipp`` in its first order: each robot has the earliest arrival that those before it leave."""
    if not plan:
        return ""
    fleet, paths = drawn.fleet, cells_of(plan)
    order = sorted(range(len(paths)), key=lambda k: -(truth.alone[k] or 0))
    for n, k in enumerate(order):
        others = [paths[j] for j in order[:n]]
        earliest = earliest_arrival(
            drawn.rows, fleet.starts[k], fleet.goals[k], others, last=len(paths[k]) - 1, octile=drawn.octile
        )
        if earliest != len(paths[k]) - 1:
            return f"robot {k} arrives at tick {len(paths[k]) - 1}, it can at {earliest}"
    return ""


def improved_wrong(plan: FleetPlan, drawn: DrawnFleet, seed: int) -> str:
    """Of ``lns``: it costs no more than the plan it began with, and takes no longer."""
    if not plan:
        return ""
    first = asked(drawn.fleet, "lacam", seed, None, {"improve": False}, drawn.moves)
    if isinstance(first, str):
        return first
    costs = [cost for _, cost in plan.improvements]
    if costs != sorted(set(costs), reverse=True) or costs[-1] != plan.sum_of_costs:
        return f"its improvements are {costs}, its sum of costs {plan.sum_of_costs}"
    if (plan.sum_of_costs or 0) > (first.sum_of_costs or 0) or (plan.makespan or 0) > (first.makespan or 0):
        return f"costs {plan.sum_of_costs} in {plan.makespan} ticks; lacam {first.sum_of_costs} in {first.makespan}"
    return ""


def exhausted_wrong(drawn: DrawnFleet, seed: int) -> str:
    """A search by LaCAM* that has come to its end has the plan with the least sum of loss."""
    fleet = drawn.fleet
    tables = tables_of(fleet, drawn.moves)
    if tables.cut_off is not None:
        return ""
    search = LacamSearch(tables, True, 1, seed)
    while not search.exhausted:
        search.go_on(ENDLESS)
    least = least_sum_of_loss(drawn.rows, fleet.starts, fleet.goals, octile=drawn.octile)
    if search.loss != least:
        return f"the search ends with a sum of loss of {search.loss}; the least is {least}"
    return ""


def reaches_wrong(fleet: Fleet, seed: int, ticks: int) -> tuple[str, int]:
    """PIBT without the swap rule: every robot has been on its goal. With the first tick by which all have."""
    run = PibtRun(tables_of(fleet), swap=False, seed=seed)
    while not run.solved and (run.visited < 0).any() and run.tick < ticks:
        run.go_on(min(ticks, run.tick + 50))
    if (run.visited < 0).any():
        return (
            f"{int((run.visited < 0).sum())} of {len(fleet)} robots have not been on their goals by tick {run.tick}",
            run.tick,
        )
    track = run.track.T
    graph = tables_of(fleet).graph.places
    paths = [[(x, y) for x, y in graph[row].tolist()] for row in track]
    faults = broken(fleet.grid.blocked.tolist(), fleet.starts, fleet.goals, paths, whole=False)
    return f"breaks {', '.join(sorted(faults))}" if faults else "", int(run.visited.max())


KINDS = {
    "not at": NOT_AT, "not step": NOT_STEP, "must be at": MUST_AT, "later": LONGER, "by": AT_MOST, "not from": NOT_FROM,
}  # fmt: skip
"""Constraints of one robot's path, as the reference and the search call them."""


def _keeps(way: list[Cell], kind: str, cell: Cell, then: Cell, tick: int) -> bool:
    """Whether a path, which stays at its end, keeps to a constraint."""
    at, before = way[min(tick, len(way) - 1)], way[min(tick - 1, len(way) - 1)]
    if kind == "must be at":
        return at == cell
    if kind == "not step":
        return not (before == cell and at == then)
    if kind == "not from":
        return cell not in way[tick:] and way[-1] != cell
    if kind == "later":
        return len(way) - 1 > tick
    return len(way) - 1 <= tick if kind == "by" else at != cell


def constrained_wrong(rng: np.random.Generator, drawn: DrawnFleet) -> tuple[str, str]:
    """The path of one robot under constraints is as short as the reference's, and its bound is its cost."""
    fleet, rows = drawn.fleet, drawn.rows
    tables = tables_of(fleet, drawn.moves)
    if tables.cut_off is not None:
        return "", "cut off"
    start, goal = fleet.starts[0], fleet.goals[0]
    cells = sorted(distances(rows, goal, octile=drawn.octile))
    given: list[tuple[str, Cell, Cell, int]] = []
    for _ in range(int(rng.integers(1, 9))):
        cell = cells[int(rng.integers(len(cells)))]
        kind, tick = (
            str(rng.choice(["not at", "not at", "not step", "not step", "not from"])),
            int(rng.integers(1, 9)),
        )
        near = neighbours(rows, cell, octile=drawn.octile)
        if kind == "not step" and near:
            given.append((kind, cell, near[int(rng.integers(len(near)))], tick))
        elif kind != "not from" or cell != goal:
            given.append(("not at" if kind == "not step" else kind, cell, cell, tick))
    draw = rng.random()
    if draw < 0.4:
        cell = cells[int(rng.integers(len(cells)))]
        given.append(("must be at", cell, cell, int(rng.integers(1, 9))))
    elif draw < 0.6:
        given.append(("later" if draw < 0.5 else "by", goal, goal, int(rng.integers(2, 12))))
    numbers = {
        cell: int(number) for cell, number in zip(cells, tables.graph.numbers(tuple(cells)), strict=True)
    }
    places = {number: cell for cell, number in numbers.items()}
    path = SpaceTime(tables, 4).find(0, [(KINDS[k], numbers[u], numbers[v], t) for k, u, v, t in given])
    least = earliest_allowed(rows, start, goal, given, last=60, octile=drawn.octile)
    cost = None if path is None else path.cost
    if cost != least:
        return f"the path costs {cost}, the least is {least}: {given}", "wrong"
    if path is not None:
        way = [places[number] for number in path.cells]
        broken_ones = [one for one in given if not _keeps(way, *one)]
        if broken_ones:
            return f"the path {way} does not keep to {broken_ones}", "wrong"
    if path is not None and path.bound != path.cost:
        return f"the path costs {cost}, its bound is {path.bound}: {given}", "wrong"
    return "", "no path" if path is None else "path"
