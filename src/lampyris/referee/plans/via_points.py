"""Via points: each passed in the stated order at the stated place, and a bound that no path is below."""

from __future__ import annotations

from collections import Counter

from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.referee.verdict import Violation


def via_violation(plan: Plan, scene: Scene) -> Violation | None:
    """Whether a plan passes the via points of its scene as it states.

    Rules: ``via points`` (others than the scene's, or not in the order given; places that fall or are not on the path),
    ``via bound`` (a cost below the stated bound, or a bound of an order that was given).
    """
    if Counter(plan.via) != Counter(scene.via):
        what = f"via points {plan.via}; the scene has {scene.via}"
        return Violation("via points", "plan", what)
    if scene.via_order == "given" and plan.via != scene.via:
        return Violation("via points", "plan", f"visited in the order {plan.via}; given was {scene.via}")
    if plan.path is None:
        return Violation("via points", "plan", "places on no path") if plan.via_at else None
    if len(plan.via_at) != len(plan.via):
        what = f"{len(plan.via_at)} places of {len(plan.via)} via points"
        return Violation("via points", "plan", what)
    last = 0
    for cell, k in zip(plan.via, plan.via_at, strict=True):
        if not last <= k < len(plan.path.cells):
            return Violation("via points", "plan", f"{cell} is passed at node {k}, after node {last}")
        there = tuple(plan.path.cells[k].tolist())
        if there != cell:
            return Violation("via points", f"node {k}", f"is {there}, not the via point {cell}")
        last = k
    least = plan.via_lower_bound
    if least is not None and (scene.via_order == "given" or not 0 <= least <= plan.cost * (1 + 1e-12)):
        return Violation("via bound", "plan", f"costs {plan.cost}, its stated lower bound is {least}")
    return None
