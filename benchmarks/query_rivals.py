"""Whom queries are held against: what each does, prepared for one map but for the call itself."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from benchmarks.field_rivals import edges
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from lampyris.kernels.graph.trail import trail
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning.field.solve import fill
from lampyris.planning.graph.any_angle_search import AnyAngleSearch
from lampyris.planning.graph.bidirectional_search import TwoSearches
from lampyris.planning.graph.fastest_search import FieldSearch, suited
from lampyris.planning.graph.grid_graph import GridSearch
from lampyris.planning.graph.jps import JumpPointSearch
from lampyris.planning.graph.jps_search import JumpSearch, PackedMap

Cell = tuple[int, int]
Search = Callable[[Cell, Cell], Any]

MOVED = MOVES["octile"]
OURS = {
    "jps": "`JumpSearch.find_path`: the search and the path's cells",
    "astar": "the search of the planner `astar`",
    "field": "the field of the goal, solved as far as the start, and the path read off it",
    "fastest": "the search that the planner `fastest` picks for the map",
    "jps call": "the whole public call, `session.plan(Change(robot=start))` of the planner `jps`, its "
    "session open at the goal",
    "jps anew": "a session opened for the query and asked once, the map packed in it: nothing is kept",
    "both ends": "the search of `bidirectional-astar`",
    "theta": "the search of `theta-star`: shorter ways, at any angle",
    "lazy": "the search of `lazy-theta-star`, likewise",
}
RIVALS = {
    "nano-astar": "`astar(grid, start, goal)`, C++; our rules; the map is taken as it is, but lists of nodes "
    "for all of it are laid out in every call, which its user cannot avoid",
    "w9-pathfinding": "`AStar(grid).find_path`, C++; our rules",
    "pathfinding": "`AStarFinder`, Python; our rules; its grid is cleaned within the time",
    "tcod": "`path.AStar(cost, 1.41).get_path`, C; cuts corners",
    "scikit-image": "`graph.route_through_array`, fully connected, geometric; cuts corners",
    "pyastar2d": "`astar_path`, C++; cuts corners, and a diagonal step costs it 1: its ways are not shortest",
}
WHOLE = ("jps", "jps call", "jps anew", "astar", "field", "fastest", "nano-astar")
"""Who answers every query; the others answer a sample, spread evenly over the lengths."""
SAME_RULES = (*WHOLE, "both ends", "w9-pathfinding", "pathfinding")
"""Whose lengths must be the published ones."""
ANY_ANGLE = ("theta", "lazy")


class Contest:
    """Everybody on one map, each ready for its first query.

    Parameters
    ----------
    free : bool, (height, width).
    """

    def __init__(self, free: np.ndarray) -> None:
        self._free = free
        self._grid = Grid(~free)
        self.made_ms: dict[str, float] = {}
        jumps = self._make("jps", lambda: JumpSearch(free, MOVED))
        astar = self._make("astar", lambda: GridSearch(free, MOVED, informed=True))
        self._ways: dict[str, Search] = {
            "jps": jumps.find_path,
            "astar": astar.find_path,
            "field": FieldSearch(free, MOVED, jumps).find_path,
            "fastest": self._make("fastest", lambda: suited(free, None, MOVED)).find_path,
            "both ends": TwoSearches(free, MOVED).find_path,
            "theta": AnyAngleSearch(free, None, MOVED, wide=False, lazy=0).find_path,
            "lazy": AnyAngleSearch(free, None, MOVED, wide=False, lazy=2).find_path,
        }
        self._theirs: dict[str, Search] = {
            "nano-astar": self._make("nano-astar", lambda: _nano(free)),
            "w9-pathfinding": self._make("w9-pathfinding", lambda: _w9(free)),
            "pathfinding": self._make("pathfinding", lambda: _pathfinding(free)),
            "tcod": self._make("tcod", lambda: _tcod(free)),
            "scikit-image": self._make("scikit-image", lambda: _scikit(free)),
            "pyastar2d": self._make("pyastar2d", lambda: _pyastar2d(free)),
        }

    def _make(self, who: str, build: Callable[[], Any]) -> Any:
        """What somebody prepares once a map; the second time counts."""
        build()
        began = time.thread_time_ns()
        made = build()
        self.made_ms[who] = (time.thread_time_ns() - began) / 1e6
        return made

    @property
    def packing_ms(self) -> float:
        """The bits of :class:`PackedMap` alone, the middle of five."""
        spent = []
        for _ in range(5):
            began = time.thread_time_ns()
            PackedMap(self._free, MOVED.corner_cutting)
            spent.append((time.thread_time_ns() - began) / 1e6)
        return float(np.median(spent))

    def call(self, who: str, start: Cell, goal: Cell) -> Callable[[], Any]:
        """Somebody's search for one query; called, it answers."""
        if who in ("jps call", "jps anew"):
            scene, rng = Scene(self._grid, start, goal), np.random.default_rng(0)
            if who == "jps anew":
                return lambda: JumpPointSearch().open(scene, rng).plan()
            session = JumpPointSearch().open(scene, rng)
            session.plan()
            return partial(session.plan, Change(robot=start))
        return partial((self._ways | self._theirs)[who], start, goal)

    @staticmethod
    def length(who: str, answer: Any) -> float:
        """Length of an answer of ours, or of somebody's with our rules; -1: no way."""
        if who == "nano-astar":
            cells = None if answer is None else answer[0]
        elif who == "pathfinding":
            cells = [(node.x, node.y) for node in answer[0]] or None
        elif who == "w9-pathfinding":
            cells = answer or None
        else:
            if who in ("jps call", "jps anew"):
                answer = answer.path
            cells = None if answer is None else answer.waypoints if who in ANY_ANGLE else answer.cells
        return -1.0 if cells is None else length_of(cells)


def length_of(cells: Any) -> float:
    """Length of a walk, or of straight lines, in cells."""
    d = np.diff(np.asarray(cells, dtype=np.float64), axis=0)
    return float(np.sqrt((d**2).sum(axis=1)).sum())


def _nano(free: np.ndarray) -> Search:
    import nano_astar

    walls = np.ascontiguousarray(~free).view(np.uint8)
    return lambda start, goal: nano_astar.astar(walls, start[::-1], goal[::-1])


def _w9(free: np.ndarray) -> Search:
    from w9_pathfinding.envs import DiagonalMovement, Grid
    from w9_pathfinding.pf import AStar

    grid = Grid(
        np.where(free, 1.0, -1.0).tolist(),
        diagonal_movement=DiagonalMovement.only_when_no_obstacle,
        diagonal_movement_cost_multiplier=math.sqrt(2),
    )
    search: Search = AStar(grid).find_path
    return search


def _pathfinding(free: np.ndarray) -> Search:
    from pathfinding.core.diagonal_movement import DiagonalMovement
    from pathfinding.core.grid import Grid
    from pathfinding.finder.a_star import AStarFinder

    grid = Grid(matrix=free.astype(int).tolist())
    finder = AStarFinder(diagonal_movement=DiagonalMovement.only_when_no_obstacle)

    def search(start: Cell, goal: Cell) -> Any:
        grid.cleanup()
        return finder.find_path(grid.node(*start), grid.node(*goal), grid)

    return search


def _tcod(free: np.ndarray) -> Search:
    import tcod.path

    search = tcod.path.AStar(free.astype(np.int8), 1.41)
    return lambda start, goal: search.get_path(*start[::-1], *goal[::-1])


def _scikit(free: np.ndarray) -> Search:
    from skimage.graph import route_through_array

    prices = np.where(free, 1.0, -1.0)
    return lambda start, goal: route_through_array(prices, start[::-1], goal[::-1], fully_connected=True)


def _pyastar2d(free: np.ndarray) -> Search:
    from pyastar2d import astar_path

    prices = np.where(free, 1.0, np.inf).astype(np.float32)
    return lambda start, goal: astar_path(prices, start[::-1], goal[::-1], allow_diagonal=True)


# ---- path and field --------------------

WITH_FIELD = {
    "lampyris": "the whole field (cost, parents, luciferin) of the goal, and the path read off it",
    "scikit-image": "`MCP_Geometric.find_costs([goal])` and `traceback(start)`; costs and where each cell "
    "was reached from; cuts corners",
    "tcod": "`path.dijkstra2d` and `path.hillclimb2d`; costs alone; cuts corners",
    "scipy": "`csgraph.dijkstra` with predecessors, of exactly our moves, its graph made beforehand; its "
    "paths and ours are as long",
}


def with_field(free: np.ndarray) -> dict[str, Search]:
    """Who gives a path and the costs of all cells, by name; our path and scipy's are cells (x, y)."""
    import tcod.path
    from skimage.graph import MCP_Geometric

    rows, cols, lengths, node = edges(free, MOVED)
    many = int(free.sum())
    matrix = csr_matrix((lengths, (rows, cols)), shape=(many, many))
    prices = np.where(free, 1.0, -1.0)
    walkable = free.astype(np.int8)
    places = np.argwhere(free)
    scratch = np.empty(free.size, dtype=np.int32)
    begin = np.full(free.shape, np.iinfo(np.int32).max, dtype=np.int32)
    spare = begin.copy()
    shares = (0.6, 0.6, float(MOVED.unit))

    def ours(start: Cell, goal: Cell) -> Sequence[Any]:
        frame, (_, _, step), _ = fill(free, None, MOVED, goal, shares)
        jump, _, _ = frame.table(MOVED)
        count = trail(step, jump, frame.index(start), scratch)
        y, x = np.divmod(scratch[:count], np.int32(frame.width))
        cells: np.ndarray = np.stack((x, y), axis=1) - np.int32(frame.pad)
        return cells

    def scikit(start: Cell, goal: Cell) -> Any:
        costs = MCP_Geometric(prices, fully_connected=True)
        costs.find_costs([goal[::-1]])
        return costs.traceback(start[::-1])

    def by_tcod(start: Cell, goal: Cell) -> Any:
        begin[goal[::-1]] = 0
        out = tcod.path.dijkstra2d(begin, walkable, 10, 14, out=spare)
        begin[goal[::-1]] = np.iinfo(np.int32).max
        return tcod.path.hillclimb2d(out, start[::-1], True, True)

    def scipy(start: Cell, goal: Cell) -> Any:
        _, before = dijkstra(matrix, indices=int(node[goal[::-1]]), return_predecessors=True)
        way = [int(node[start[::-1]])]
        while before[way[-1]] >= 0:
            way.append(int(before[way[-1]]))
        y, x = places[way].T
        out: np.ndarray = np.stack((x, y), axis=1)
        return out

    return {"lampyris": ours, "scikit-image": scikit, "tcod": by_tcod, "scipy": scipy}
