"""Drawn maps with the right answers to all questions about some of their cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid
from lampyris.model.moves import moves_named
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.typing import BoolGrid, ByteGrid
from lampyris_selfcheck.checks.paths import drawn_maps
from lampyris_selfcheck.checks.paths.answers import Truth
from lampyris_selfcheck.checks.paths.grid_costs import cost_at, costs_to, room_for
from lampyris_selfcheck.reference.paths.search import Cell

Rows = list[list[bool]]

RADII = (0.3, 0.5, 0.8, 1.3, 1.5, 2.2)
"""Of robots with a size, cells; half a cell and one and a half touch walls exactly."""
RESOLUTIONS = (1.0, 0.05, 0.1, 0.37)
WIDE = 0.3
"""Share of maps whose robot has a size."""


@dataclass(frozen=True, eq=False)
class SmallWorld:
    """A map with the answers to all questions about some of its cells.

    Parameters
    ----------
    scene : the map, a robot and its moves; the ends are any.
    free : where the robot's centre may be; ``rows``: the same as lists.
    goals : free cells; none where none is free.
    costs : see :func:`lampyris_selfcheck.checks.paths.grid_costs.costs_to`.
    """

    scene: Scene
    free: BoolGrid
    rows: Rows
    goals: tuple[Cell, ...]
    costs: NDArray[np.int64]

    @property
    def terrain(self) -> ByteGrid | None:
        """What cells cost besides."""
        return self.scene.grid.terrain

    @property
    def wide(self) -> bool:
        """Whether the robot has a size."""
        return self.scene.robot.radius > 0


def made(
    rng: np.random.Generator, width: int, height: int, name: str, *, rough: bool, goals: int
) -> SmallWorld:
    """A map of that size, its robot, some goals and the least costs to them.

    Parameters
    ----------
    name : the step set.
    rough : whether cells may cost more than others.
    goals : how many; they may be the same cell.
    """
    blocked = drawn_maps.walls(rng, width, height)
    terrain = drawn_maps.terrain(rng, blocked) if rough else None
    radius = float(rng.choice(RADII)) if rng.random() < WIDE else 0.0
    resolution = float(rng.choice(RESOLUTIONS))
    grid = Grid(blocked, terrain=terrain, resolution=resolution)
    free = room_for(blocked, radius)
    ends = tuple(one(rng, free) for _ in range(goals)) if free.any() else ()
    costs = np.zeros((0, height, width), dtype=np.int64)
    if ends:
        costs = costs_to(ends, free, name, wide=radius > 0, terrain=grid.terrain)
    scene = Scene(grid, (0, 0), (0, 0), moves_named(name), Robot(radius=radius * resolution))
    return SmallWorld(scene, free, free.tolist(), ends, costs)


def one(rng: np.random.Generator, where: BoolGrid) -> Cell:
    """One of the cells that are true."""
    cells = np.flatnonzero(where)
    y, x = divmod(int(cells[rng.integers(len(cells))]), where.shape[1])
    return x, y


def truth(world: SmallWorld, start: Cell, goal: Cell, index: int) -> Truth:
    """What must be answered; ``index`` is the goal's number in the world, any if an end is blocked."""
    word, cost = "no-path", None
    if not world.free[start[1], start[0]]:
        word = "start-occupied"
    elif not world.free[goal[1], goal[0]]:
        word = "goal-occupied"
    else:
        cost = cost_at(world.costs[index], start, world.scene.moves.name)
        word = word if cost is None else "found"
    return Truth(world.rows, word, cost, world.terrain, world.wide)


def scene_of(world: SmallWorld, start: Cell, goal: Cell) -> Scene:
    """The world's map and robot with these ends."""
    scene = world.scene
    return Scene(scene.grid, start, goal, scene.moves, scene.robot)
