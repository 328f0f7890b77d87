"""python-motion-planning 1.1.1 on our maps: the last release with a D* Lite, in plain Python; our rules."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

Cell = tuple[int, int]


def ground(free: np.ndarray) -> Any:
    """Its grid: a frame of obstacles, which it counts on, around the map."""
    import matplotlib as mpl

    mpl.use("Agg")  # each of its planners makes a figure
    import python_motion_planning as pmp

    height, width = free.shape
    grid = pmp.Grid(width + 2, height + 2)
    walls = {(int(x) + 1, int(y) + 1) for y, x in np.argwhere(~free)}
    grid.update(grid.obstacles | walls)
    return grid


def astar(free: np.ndarray, start: Cell, goal: Cell) -> Any:
    """Its A*, ready to `plan()`; with the answer come the cost, the path and the cells looked at."""
    import python_motion_planning as pmp

    return pmp.AStar(_in(start), _in(goal), ground(free))


def _in(cell: Cell) -> Cell:
    return cell[0] + 1, cell[1] + 1


class DStarLite:
    """Its D* Lite, told of changes as its own handler of mouse clicks tells it, without the picture."""

    def __init__(self, free: np.ndarray, start: Cell, goal: Cell) -> None:
        import python_motion_planning as pmp

        self._known = pmp.DStarLite(_in(start), _in(goal), ground(free))

    def plan(self, blocked: Iterable[Cell] = (), freed: Iterable[Cell] = ()) -> float:
        """Length of the path once the cells have changed; where it answers with no path, infinity."""
        known = self._known
        for cell in map(_in, blocked):
            known.obstacles.add(cell)
            self._around(cell)
        for cell in map(_in, freed):
            known.obstacles.remove(cell)
            known.updateVertex(known.map[cell])
            self._around(cell)
        length, path, _ = known.plan()
        return float(length) if path else float("inf")

    def _around(self, cell: Cell) -> None:
        for node in self._known.getNeighbor(self._known.map[cell]):
            self._known.updateVertex(node)
