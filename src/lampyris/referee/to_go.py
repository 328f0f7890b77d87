"""The sum of cost-to-go over a path, worked out a second time: a plain heap from the goal, no field."""

from __future__ import annotations

import heapq
import math

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.moves import Moves
from lampyris.model.path import Path
from lampyris.model.scene import Scene
from lampyris.referee.geometry.shapes import disc_cells
from lampyris.typing import BoolGrid, Cell

_PLAIN_GROUND = 63


def sum_cost_to_go(path: Path, scene: Scene, *, every: int = 1) -> float:
    """Sum of the exact costs-to-go of a path's cells, in cells: the "path cost" that the dissertation prints
    of the baselines.

    Gates are open and nobody is in the way. For a robot with a radius the free cells are those where its disc
    may stand, and the steps are the path's own.

    Parameters
    ----------
    path : judged; its first cell counts, its last has nothing to go.
    scene : the map, the goal and the robot.
    every : count each cell (1), each second cell from the start (2), and so on: the dissertation's improved
        baseline moves two cells an iteration and counts the cells at which it stopped.

    Raises
    ------
    UsageError : ``every`` below 1, or a cell of the path from which the goal cannot be reached.

    It takes some 10 microseconds a cell of the map: meant for tables and tests.
    """
    if every < 1:
        raise UsageError.of("EVERY", "every", f"{every}", allowed="1 or more")
    counted = [(int(x), int(y)) for x, y in path.cells[::every].tolist()]
    known = _costs_to_go(_standing(scene), path.moves, scene, set(counted))
    lost = [cell for cell in counted if cell not in known]
    if lost:
        raise UsageError("TO_GO", f"{lost[0]} cannot reach the goal", allowed="a path of this scene")
    return math.fsum(path.moves.value(known[cell]) for cell in counted)


def _standing(scene: Scene) -> BoolGrid:
    """Where the robot's disc overlaps no wall; bool, (height, width)."""
    blocked = scene.grid.blocked
    offsets = disc_cells(scene.robot.radius, scene.grid.resolution)
    far = int(np.abs(offsets).max())
    walls = np.pad(blocked, far)
    hit = np.zeros_like(blocked)
    height, width = blocked.shape
    for dx, dy in offsets.tolist():
        hit |= walls[far + dy : far + dy + height, far + dx : far + dx + width]
    return ~hit


def _costs_to_go(free: BoolGrid, moves: Moves, scene: Scene, wanted: set[Cell]) -> dict[Cell, int]:
    """Exact cost-to-go of all wanted cells, and of those that are no farther."""
    height, width = free.shape
    open_cell = free.tolist()
    terrain = None if scene.grid.terrain is None else scene.grid.terrain.tolist()

    def is_free(x: int, y: int) -> bool:
        return 0 <= x < width and 0 <= y < height and bool(open_cell[y][x])

    sides = [_between(dx, dy, moves.corner_cutting) for dx, dy in moves.offsets]
    best = {scene.goal: 0}
    done: dict[Cell, int] = {}
    heap = [(0, scene.goal)]
    missing = set(wanted)
    while heap and missing:
        paid, (x, y) = heapq.heappop(heap)
        if (x, y) in done:
            continue
        done[x, y] = paid
        missing.discard((x, y))
        for (dx, dy), price, between in zip(moves.offsets, moves.costs, sides, strict=True):
            # The step leads from (x - dx, y - dy) to here, and pays for the ground here.
            px, py = x - dx, y - dy
            if not is_free(px, py) or not all(is_free(px + a, py + b) for a, b in between):
                continue
            if terrain is not None:
                price = price // _PLAIN_GROUND * (_PLAIN_GROUND + terrain[y][x])
            if paid + price < best.get((px, py), paid + price + 1):
                best[px, py] = paid + price
                heapq.heappush(heap, (paid + price, (px, py)))
    return done


def _between(dx: int, dy: int, corner_cutting: bool) -> tuple[Cell, ...]:
    """Cells beside its ends that a step needs free, as offsets from where it begins."""
    if abs(dx) == abs(dy) == 1:
        return () if corner_cutting else ((dx, 0), (0, dy))
    if abs(dx * dy) == 2:
        sx, sy = dx // abs(dx), dy // abs(dy)
        return (sx, sy), ((sx, 0) if abs(dx) == 2 else (0, sy))
    return ()
