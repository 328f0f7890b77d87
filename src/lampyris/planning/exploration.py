"""Exploration: what a planner looks at until it has its path, in the order that it records itself."""

from __future__ import annotations

import numpy as np

from lampyris.model.plan import Jump, Plan
from lampyris.model.race.race import Exploration
from lampyris.model.scene import Scene
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Planner
from lampyris.planning.field.solve import solve_field
from lampyris.planning.graph.expanded import MOST_CELLS, expanded, most_poses
from lampyris.typing import Cells

_NO_CELLS = np.zeros((0, 2), dtype=np.int32)
_NO_LINES = np.zeros((0, 4))


def exploration(planner: Planner, scene: Scene, plan: Plan) -> Exploration:
    """What a planner looked at for its first plan of a scene.

    Planners of graphs and incremental ones record the cells that they expand; ``jps`` jump points; AD-GSO its field and
    the rings of each jump; those of poses the cells of the poses that they expand; those that sample the lines of their
    trees. Others keep no record.

    Parameters
    ----------
    plan : the plan it made there, with its record.
    """
    if scene.via:
        return _none("With via points no order of expansion is recorded.")
    if plan.tree is not None:
        return Exploration(
            "tree", _NO_CELLS, plan.tree, note="Lines of the final tree, in the order of its nodes."
        )
    if isinstance(planner, AdGso):
        return _field_and_rings(planner, scene, plan)
    poses = planner.traits.plans_headings
    if poses and plan.expansions > most_poses(plan.planner):
        return _none(
            f"{plan.planner} expanded {plan.expansions:,} poses, too many to be recorded: only its path is shown."
        )
    cells = expanded(planner, scene)
    if cells is None:
        size = scene.grid.blocked.size
        large = f" on a map of {size:,} cells" if size > MOST_CELLS else ""
        return _none(f"{plan.planner} records no order of expansion{large}: only its path is shown.")
    if poses:
        return Exploration("poses", cells, _NO_LINES, note="The cell of each pose, whatever its heading.")
    jumps = plan.planner == "jps" and len(cells) and scene.grid.terrain is None
    return Exploration("jump points" if jumps else "cells", cells, _NO_LINES)


def _none(note: str) -> Exploration:
    return Exploration("none", _NO_CELLS, _NO_LINES, note=note)


def _field_and_rings(planner: AdGso, scene: Scene, plan: Plan) -> Exploration:
    """AD-GSO's field, settled from the goal by rising cost, and then ring by ring what each jump looks at."""
    if plan.attributes or planner.gates == "replan" or not (plan.jumps or plan.path is None):
        return _none(
            f"{plan.planner} with these settings records no order of expansion: only its path is shown."
        )
    gates = "close" if planner.gates == "close" else "ignore"
    exact = solve_field(scene, gates=gates, rho=planner.rho, gamma=planner.gamma).exact
    known = np.flatnonzero(exact >= 0)
    y, x = np.divmod(known[np.argsort(exact.ravel()[known], kind="stable")], exact.shape[1])
    parts: list[Cells] = [np.stack((x, y), axis=1).astype(np.int32)]
    count, jumps = len(known), []
    for jump in plan.jumps:
        parts.append(_rings(jump, exact.shape))
        count += len(parts[-1])
        jumps.append((count, jump.chosen))
    note = "The field from the goal by rising cost, then the rings of each jump."
    return Exploration("field and rings", np.concatenate(parts), _NO_LINES, len(known), tuple(jumps), note)


def _rings(jump: Jump, shape: tuple[int, ...]) -> Cells:
    """Cells of the map in the rings around a place, the innermost ring first."""
    n, (x0, y0) = jump.rings, jump.at
    y, x = np.mgrid[-n : n + 1, -n : n + 1]
    ring = np.maximum(abs(x), abs(y)).ravel()
    order = np.argsort(ring, kind="stable")[1:]
    cells = np.stack((x.ravel()[order] + x0, y.ravel()[order] + y0), axis=1)
    inside = (cells >= 0).all(axis=1) & (cells < (shape[1], shape[0])).all(axis=1)
    out: Cells = cells[inside].astype(np.int32)
    return out
