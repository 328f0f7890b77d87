"""Walks of a robot with a size, over ground that costs: lawful ones, and three ways of spoiling one.

What is lawful is told from the definition: no wall's square is nearer to the straight lines between the cells
than the radius (touching is free), and each cell entered is paid for at its own weight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import Path
from lampyris.model.robot import Robot
from lampyris.typing import BoolGrid, ByteGrid, Cell
from lampyris_selfcheck.checks.paths import drawn_maps
from lampyris_selfcheck.checks.paths.referee_cases import LEAST, counted
from lampyris_selfcheck.checks.paths.worlds import RADII, RESOLUTIONS
from lampyris_selfcheck.reference.paths.path_cost import PLAIN
from lampyris_selfcheck.reference.paths.search import steps

_MOVES = ("octile", "four-connected", "dissertation")
"""A robot with a size makes no knight's steps."""
_TOUCH = 1e-9
WAYS = ("too near a wall", "paid as plain ground", "a cell paid one too little")
RULES = ("sweep", "cost", "cost")
"""Which rule must refuse each."""


@dataclass(frozen=True)
class Wide:
    """A walk and what it is judged by.

    Parameters
    ----------
    blocked : bool (height, width).
    terrain : uint8 (height, width), some of it not 0.
    radius : of the robot, cells.
    resolution : metres a cell.
    moves : name of the step set.
    cells : the walk.
    off : added to what its steps cost.
    """

    blocked: BoolGrid
    terrain: ByteGrid
    radius: float
    resolution: float
    moves: str
    cells: tuple[Cell, ...]
    off: int = 0

    @property
    def grid(self) -> Grid:
        """The map."""
        return Grid(self.blocked, terrain=self.terrain, resolution=self.resolution)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return Robot(radius=self.radius * self.resolution)

    @property
    def path(self) -> Path:
        """The walk as a planner would hand it back."""
        moves = MOVES[self.moves]
        paid = price(self.cells, self.moves, self.terrain) + self.off
        return Path(np.array(self.cells, np.int32), moves.weighed(), counted(self.cells, moves), paid)


def price(cells: tuple[Cell, ...], name: str, terrain: ByteGrid | None) -> int:
    """What a walk costs, in units of the step set and 63rds; on plain ground where there is no terrain."""
    moves = MOVES[name]
    paid = 0
    for (x, y), (u, v) in pairwise(cells):
        weight = PLAIN if terrain is None else PLAIN + int(terrain[v, u])
        paid += weight * (moves.diagonal if x != u and y != v else moves.straight)
    return paid


def gap(one: Cell, other: Cell, wall: Cell) -> float:
    """Distance from the line between two neighbouring cells' centres to the square of a third cell."""
    # A line of one step that meets a square has an end in it or passes its corner.
    ends = (
        math.hypot(*(max(abs(e - w) - 0.5, 0.0) for e, w in zip(end, wall, strict=True)))
        for end in (one, other)
    )
    corners = ((wall[0] + a, wall[1] + b) for a in (-0.5, 0.5) for b in (-0.5, 0.5))
    return min(*ends, *(_to_line(one, other, corner) for corner in corners))


def _to_line(one: Cell, other: Cell, point: tuple[float, float]) -> float:
    dx, dy = other[0] - one[0], other[1] - one[1]
    along = ((point[0] - one[0]) * dx + (point[1] - one[1]) * dy) / (dx * dx + dy * dy)
    along = min(max(along, 0.0), 1.0)
    return math.hypot(point[0] - one[0] - along * dx, point[1] - one[1] - along * dy)


def _walls_near(blocked: BoolGrid, cell: Cell, reach: int) -> list[Cell]:
    x, y = max(cell[0] - reach, 0), max(cell[1] - reach, 0)
    window = blocked[y : cell[1] + reach + 1, x : cell[0] + reach + 1]
    return [(x + int(b), y + int(a)) for a, b in np.argwhere(window)]


def _clear(blocked: BoolGrid, one: Cell, other: Cell, radius: float) -> bool:
    walls = _walls_near(blocked, one, math.ceil(radius) + 2)
    return all(gap(one, other, wall) >= radius - _TOUCH for wall in walls)


def lawful(rng: np.random.Generator) -> Wide:
    """A random walk of at least four cells that a robot of that size can drive."""
    while True:
        width, height = (int(n) for n in rng.integers(8, 21, 2))
        blocked = drawn_maps.walls(rng, width, height) & (
            rng.random((height, width)) < rng.choice([0.1, 0.4, 1.0])
        )
        terrain = drawn_maps.terrain(rng, blocked)
        name = _MOVES[int(rng.integers(len(_MOVES)))]
        radius = float(rng.choice(RADII))
        free = np.argwhere(~blocked)
        if terrain is None or not len(free):
            continue
        y, x = free[int(rng.integers(len(free)))].tolist()
        cells, table = [(x, y)], list(steps(name))
        for _ in range(int(rng.integers(LEAST, 20))):
            x, y = cells[-1]
            ahead = [(x + dx, y + dy) for dx, dy in table]
            ahead = [c for c in ahead if 0 <= c[0] < width and 0 <= c[1] < height]
            ahead = [c for c in ahead if _clear(blocked, (x, y), c, radius)]
            if not ahead:
                break
            cells.append(ahead[int(rng.integers(len(ahead)))])
        if len(cells) >= LEAST:
            resolution = float(rng.choice(RESOLUTIONS))
            return Wide(blocked, terrain, radius, resolution, name, tuple(cells))


def spoilt(rng: np.random.Generator, way: int) -> Wide:
    """A walk spoilt in one of :data:`WAYS`."""
    assert 0 <= way < len(WAYS)
    while True:
        asked = lawful(rng)
        if way == 0:
            wrong = _wall_beside(rng, asked)
            if wrong is not None:
                return wrong
            continue
        plain, true = (price(asked.cells, asked.moves, ground) for ground in (None, asked.terrain))
        if way == 1 and plain != true:
            return replace(asked, off=plain - true)
        if way == 2:
            x, y = asked.cells[int(rng.integers(1, len(asked.cells)))]
            if not asked.terrain[y, x]:
                continue
            terrain = asked.terrain.copy()
            terrain[y, x] -= 1
            return replace(asked, off=price(asked.cells, asked.moves, terrain) - true)


def _wall_beside(rng: np.random.Generator, asked: Wide) -> Wide | None:
    """With a wall that the robot's body meets though its centre enters no wall."""
    height, width = asked.blocked.shape
    reach = math.ceil(asked.radius) + 1
    k = int(rng.integers(len(asked.cells) - 1))
    one, other = asked.cells[k : k + 2]
    beside = [
        (x, y)
        for y in range(max(one[1] - reach, 0), min(one[1] + reach + 1, height))
        for x in range(max(one[0] - reach, 0), min(one[0] + reach + 1, width))
        if (x, y) not in asked.cells and gap(one, other, (x, y)) < asked.radius - _TOUCH
    ]
    if not beside:
        return None
    x, y = beside[int(rng.integers(len(beside)))]
    blocked = asked.blocked.copy()
    blocked[y, x] = True
    return replace(asked, blocked=blocked)
