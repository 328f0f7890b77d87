"""What judges a plan: the optimum, the sum of cost-to-go, the gates of the map and of the path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris._core.cancellation import checkpoint
from lampyris.model.path import Path, step_costs
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning.field.gates import find_gates, gates_along
from lampyris.planning.field.layers import free_cells, moves_for
from lampyris.planning.field.solve import costs_along
from lampyris.typing import ByteGrid


def assess(found: Plan, scene: Scene) -> Plan:
    """The same plan with what judges it: the optimum, the sum of cost-to-go, the gates.

    Planners that know these fill them in; the rest is measured here from the exact costs of the scene's field.
    """
    checkpoint()
    gates = find_gates(scene.grid, scene.robot)
    checkpoint()
    if found.path is None:
        return replace(found, gates_in_map=gates)
    optimal, to_go = found.optimal_exact, found.sum_cost_to_go
    if optimal is not None and optimal == found.path.exact and to_go is None:
        to_go = _sum_along_optimum(found.path, scene.grid.terrain)
    elif optimal is None or to_go is None:
        moves = moves_for(scene)
        free = free_cells(scene.grid, scene.robot.radius)
        costs = costs_along(free, moves, scene.goal, found.path.cells, terrain=scene.grid.terrain)
        optimal = int(costs[0])
        to_go = float(moves.values(costs).sum())
    return replace(
        found,
        optimal_exact=optimal,
        sum_cost_to_go=to_go,
        gates_in_map=gates,
        gates_on_path=gates_along(scene.grid, found.path.cells, scene.robot),
    )


def _sum_along_optimum(path: Path, terrain: ByteGrid | None) -> float:
    """Sum of cost-to-go over an optimal path: there, what is left of the path *is* the cost to go."""
    exact = step_costs(path.cells, path.moves, terrain)
    to_go = np.concatenate((np.cumsum(exact[::-1])[::-1], [0]))
    return float(path.moves.values(to_go).sum())
