"""Plans of fleets as plain data."""

from __future__ import annotations

from typing import Any

from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.report.data.serialize import grid_record


def fleet_record(plan: FleetPlan, fleet: Fleet) -> dict[str, Any]:
    """What ``lampyris fleet --json`` prints; costs are null when no plan was found.

    Parameters
    ----------
    plan : the answer.
    fleet : the question.
    """
    return {
        "status": plan.status.value,
        "sentence": plan.sentence,
        "planner": plan.planner,
        "seed": plan.seed,
        "map": grid_record(fleet.grid),
        "moves": plan.moves,
        "robots": len(fleet.robots),
        "starts": [list(cell) for cell in fleet.starts],
        "goals": [list(cell) for cell in fleet.goals],
        "paths": [path.tolist() for path in plan.paths],
        "makespan": plan.makespan,
        "sum_of_costs": plan.sum_of_costs,
        "lower_bound": plan.lower_bound,
        "gap": plan.gap,
        "iterations": plan.iterations,
        "expansions": plan.expansions,
        "improvements": [{"iteration": k, "sum_of_costs": cost} for k, cost in plan.improvements],
        "notes": list(plan.notes),
        "timing": dict(plan.timing),
    }
