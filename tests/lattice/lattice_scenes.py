"""Scenes of random walls for planners of poses, and the least cost by an exhaustive search."""

from __future__ import annotations

import math

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.model.robot import DRIVES, Polygon, Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice import UNIT, StateLattice
from lampyris.planning.lattice.lattice_planner import LatticePlanner, lattice_for
from lampyris_selfcheck.reference.paths.lattice import Motion, is_free, least_costs

FOOTPRINTS: dict[str, Polygon] = {
    "car": ((1.9, 0.6), (-0.5, 0.6), (-0.5, -0.6), (1.9, -0.6)),
    "square": ((0.45, 0.45), (-0.45, 0.45), (-0.45, -0.45), (0.45, -0.45)),
    "arrow": ((1.4, 0.0), (-0.7, 0.9), (-0.3, 0.0), (-0.7, -0.9)),
}
"""In cells of 1 m; the last is not convex."""


def scene_of(seed: int, drive: str, footprint: Polygon, side: int = 12) -> Scene:
    rng = np.random.default_rng([seed, DRIVES.index(drive), len(footprint)])
    walls = rng.random((side, side)) < rng.choice([0.02, 0.06, 0.12])
    ends = [(*(rng.random(2) * side).tolist(), float(rng.uniform(-math.pi, math.pi))) for _ in range(2)]
    robot = Robot(drive=drive, footprint=footprint, turn_radius=2.0 if drive == "ackermann" else 0.0)
    return Scene(Grid(walls), start_pose=ends[0], goal_pose=ends[1], robot=robot)


def motions_of(lattice: StateLattice) -> dict[int, list[Motion]]:
    found: dict[int, list[Motion]] = {k: [] for k in range(lattice.shape.headings)}
    for k, one in enumerate(lattice.primitives):
        first, last = lattice.sweep_first[k : k + 2]
        swept = tuple(map(tuple, lattice.sweep[first:last].tolist()))
        dx, dy = lattice.cell[k].tolist()
        found[one.start].append((dx, dy, one.end, int(lattice.cost[k]), swept))
    return found


def optimum(scene: Scene, planner: LatticePlanner) -> tuple[Status, float]:
    """The status and the least cost (metres) by the exhaustive search, between the same states."""
    session = planner.open(scene, np.random.default_rng(0))
    lattice = lattice_for(scene, planner)
    walls = scene.grid.blocked.tolist()

    def stands(state: tuple[int, int, int]) -> bool:
        first, last = lattice.stand_first[state[2] : state[2] + 2]
        return all(is_free(walls, state[0] + a, state[1] + b) for a, b in lattice.stand[first:last].tolist())

    lattice_map = session.lattice_map
    starts, goals = (
        [(*cell, h) for cell, h in states(lattice_map)] for states in (session.starts, session.goals)
    )
    for status, ends in ((Status.START_OCCUPIED, starts), (Status.GOAL_OCCUPIED, goals)):
        if not ends:
            return status, math.inf
        assert all(map(stands, ends))
    best = least_costs(walls, motions_of(lattice), starts)
    costs = [best[goal] for goal in goals if goal in best]
    if not costs:
        return Status.NO_PATH, math.inf
    return Status.FOUND, min(costs) * scene.grid.resolution / UNIT
