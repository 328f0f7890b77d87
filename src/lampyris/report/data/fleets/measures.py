"""Measures of plans of fleets, by name, as rows of studies hold them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, TypeVar

from lampyris.model.fleet.fleet_plan import FleetPlan

FLEET_METRICS = (
    "outcome", "found", "sum_of_costs", "shortest", "lower_bound", "ratio", "makespan", "first_cost", "iterations", "expansions",
    "improvements", "notes",
)  # fmt: skip
"""In the order of the columns.

* ``outcome``: the word of the status. ``found``: every robot reaches its goal and stays there.
* ``sum_of_costs``: ticks until each robot stays at its goal permanently, summed. ``shortest``: the sum of the robots' shortest
  paths on the bare map. ``lower_bound``: that, or more if the planner proved more. ``ratio``: ``sum_of_costs / shortest``, in
  which all planners can be compared. ``makespan``: the tick of the last arrival.
* ``first_cost``: the sum of costs of the first plan. ``improvements``: how it fell, as ``iteration:cost`` apart by spaces, at
  most :data:`MOST_IMPROVEMENTS` of them: the first, the last and evenly between.
* ``iterations``, ``expansions``: what the planner counts, see :class:`lampyris.model.fleet.fleet_plan.FleetPlan`.
"""
MOST_IMPROVEMENTS = 64
_COST_AT = re.compile(r"[0-9]{1,9}\.[0-9]{6}:[0-9]{1,15}")
X = TypeVar("X", int, float)
"""Iterations or seconds."""


def fleet_metrics(plan: FleetPlan) -> dict[str, Any]:
    """Every measure of a plan; None where it has no value."""
    cost = plan.sum_of_costs
    shortest = None if plan.shortest is None else int(plan.shortest.sum(dtype="int64"))
    improved = plan.improvements
    return {
        "outcome": plan.status.value,
        "found": bool(plan),
        "sum_of_costs": cost,
        "shortest": shortest,
        "lower_bound": plan.lower_bound,
        "ratio": None if cost is None or shortest is None else cost / shortest if shortest else 1.0,
        "makespan": plan.makespan,
        "first_cost": int(improved[0][1]) if improved else cost,
        "iterations": int(plan.iterations),
        "expansions": int(plan.expansions),
        "improvements": " ".join(f"{iteration}:{value}" for iteration, value in thinned(improved)) or None,
        "notes": "; ".join(plan.notes) or None,
    }


def thinned(rows: Sequence[tuple[X, int]]) -> list[tuple[X, int]]:
    """At most :data:`MOST_IMPROVEMENTS` of the rows: the first, the last and evenly between."""
    n, most = len(rows), MOST_IMPROVEMENTS
    return list(rows) if n <= most else [rows[k * (n - 1) // (most - 1)] for k in range(most)]


def costs_text(rows: Sequence[tuple[float, int]]) -> str:
    """The cost of the best plan over CPU seconds, as a row has it: ``seconds:cost`` apart by spaces."""
    return " ".join(f"{seconds:.6f}:{cost}" for seconds, cost in thinned(rows))


def costs_by_seconds(text: str) -> list[tuple[float, int]]:
    """Seconds and costs of such a text.

    Raises
    ------
    ValueError : it is none: more rows than there may be, seconds that fall, or costs that do not fall.
    """
    words = text.split()
    if not words or len(words) > MOST_IMPROVEMENTS or not all(map(_COST_AT.fullmatch, words)):
        raise ValueError("no list of at most 64 seconds:cost")
    pairs = [(float(seconds), int(cost)) for seconds, cost in (word.split(":") for word in words)]
    for (before, more), (after, less) in pairwise(pairs):
        if before > after or more <= less:
            raise ValueError(f"{after:g}:{less} after {before:g}:{more}")
    return pairs


def improvements_of(text: str) -> list[tuple[int, int]]:
    """Iterations and costs of the text that a row has of them."""
    pairs = (word.split(":") for word in text.split())
    return [(int(iteration), int(cost)) for iteration, cost in pairs]
