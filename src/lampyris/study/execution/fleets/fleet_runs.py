"""Runs of fleets: from a job's plain data to the fleet, and to the plan of its planner."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from lampyris import fleets
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.planning.base import Budget
from lampyris.planning.fleet import registry
from lampyris.study.design.study import FleetQuery


def fleet_of(plain: Mapping[str, Any], grid: Grid, query: FleetQuery) -> Fleet:
    """The fleet of a job: the first robots of a query, on its map.

    Raises
    ------
    ValueError : other robots than the job names, or fewer.
    LampyrisError : robots that cannot be there.
    """
    robots = plain["robots"]
    if query.hash != plain["fleet"] or not 1 <= robots <= len(query.ends):
        raise ValueError(f"the first {robots} robots of a fleet of {len(query.ends)}")
    radius = plain["robot"].get("radius", 0.0)
    robot = Robot(radius=radius) if radius else None
    return Fleet(grid, [Agent((a, b), (c, d), robot) for a, b, c, d in query.ends[:robots].tolist()])


def plan_of_fleet(plain: Mapping[str, Any], fleet: Fleet) -> FleetPlan:
    """What the planner of a job answers, not yet refereed.

    Raises
    ------
    LampyrisError : robots or moves that it does not plan for; its tables would take too much memory.
    """
    who, limits = plain["planner"], plain["budget"]
    planner = registry.make(who["name"], who["settings"])
    budget = Budget(limits["expansions"], limits["seconds"])
    return fleets.unchecked_plan(fleet, planner, moves=plain["moves"], seed=plain["seed"], budget=budget)


def load_planner(plain: Mapping[str, Any]) -> None:
    """Load or compile what a planner runs: a limit in seconds is for planning."""
    _load(plain["planner"]["name"], plain["moves"])


@cache
def _load(name: str, moves: str) -> None:
    small = Fleet(Grid([[False] * 3] * 2), [Agent((0, 0), (2, 1)), Agent((2, 0), (0, 1))])
    fleets.unchecked_plan(small, registry.make(name, {}), moves=moves, seed=0, budget=None)
