"""Fleets that have something in common, and what their least costs must have in common."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris_selfcheck.checks.fleets.fleet_answers import asked
from lampyris_selfcheck.checks.fleets.fleet_draws import DrawnFleet

NODES = 1500
"""Nodes of the tree at most; where one of two searches ends there, only its bound is compared."""
RELATIONS = ("turned", "relabelled", "a robot less", "a wall more")
"""Of case n: the one at n % 4."""


def _turned(fleet: Fleet, rng: np.random.Generator) -> Fleet:
    """The map mirrored, transposed or both, and the robots with it."""
    kind = int(rng.integers(1, 8))
    blocked, ends = fleet.grid.blocked, [(one.start, one.goal) for one in fleet.robots]
    for bit, change in enumerate((_mirrored, _flipped, _transposed)):
        if kind >> bit & 1:
            height, width = blocked.shape
            blocked = (blocked[:, ::-1], blocked[::-1], blocked.T)[bit]
            ends = [(change(a, width, height), change(b, width, height)) for a, b in ends]
    return Fleet(Grid(np.ascontiguousarray(blocked)), [Agent(a, b) for a, b in ends])


def _mirrored(cell: tuple[int, int], width: int, height: int) -> tuple[int, int]:
    return width - 1 - cell[0], cell[1]


def _flipped(cell: tuple[int, int], width: int, height: int) -> tuple[int, int]:
    return cell[0], height - 1 - cell[1]


def _transposed(cell: tuple[int, int], width: int, height: int) -> tuple[int, int]:
    return cell[1], cell[0]


def _relabelled(fleet: Fleet, rng: np.random.Generator) -> Fleet:
    """The same robots in another order."""
    return Fleet(fleet.grid, [fleet.robots[k] for k in rng.permutation(len(fleet)).tolist()])


def _robot_less(fleet: Fleet, rng: np.random.Generator) -> Fleet:
    gone = int(rng.integers(len(fleet)))
    rest = [one for k, one in enumerate(fleet.robots) if k != gone]
    return Fleet(fleet.grid, rest or list(fleet.robots))


def _wall_more(fleet: Fleet, rng: np.random.Generator) -> Fleet:
    used = {*fleet.starts, *fleet.goals}
    free = [(x, y) for y, x in np.argwhere(~fleet.grid.blocked).tolist() if (x, y) not in used]
    if not free:
        return fleet
    x, y = free[int(rng.integers(len(free)))]
    blocked = fleet.grid.blocked.copy()
    blocked[y, x] = True
    return Fleet(Grid(blocked), fleet.robots)


CHANGES: dict[str, Callable[[Fleet, np.random.Generator], Fleet]] = {
    "turned": _turned,
    "relabelled": _relabelled,
    "a robot less": _robot_less,
    "a wall more": _wall_more,
}


def related_wrong(drawn: DrawnFleet, relation: str, rng: np.random.Generator) -> tuple[str, bool]:
    """What is wrong of the least costs of a fleet and a related one; whether both are known."""
    fleets = (drawn.fleet, CHANGES[relation](drawn.fleet, rng))
    intervals = []
    for fleet in fleets:
        plan = asked(fleet, "cbs", 0, NODES, {})
        if isinstance(plan, str):
            return plan, False
        if plan.status is Status.NO_PATH:
            intervals.append((np.inf, np.inf))
        else:
            intervals.append(
                (plan.lower_bound or 0, np.inf if plan.sum_of_costs is None else plan.sum_of_costs)
            )
    (low, high), (other_low, other_high) = intervals
    known = low == high and other_low == other_high
    if relation == "a robot less":
        wrong = high < other_low
    elif relation == "a wall more":
        wrong = other_high < low
    else:
        wrong = high < other_low or other_high < low
    words = f"{relation}: the least cost is {low} to {high}, then {other_low} to {other_high}"
    return (words if wrong else ""), known
