"""Whom fields are held against: what each does, prepared but for the call itself."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from lampyris.model.field import Field
from lampyris.model.moves import MOVES, Moves
from lampyris.planning.field.solve import solve

RULES = {
    "scikit-image": "`find_costs`, which tells where each cost comes from too, of an `MCP_Geometric`, made "
    "beforehand (an `MCP` without diagonals); 1 and sqrt 2, cuts corners",
    "tcod": "`path.dijkstra2d`, int32, costs alone; 10 and 14, cuts corners; its arrays made beforehand",
    "scipy": "`csgraph.dijkstra`, costs alone, on a graph, made beforehand, of exactly our moves",
    "dijkstra3d": "`euclidean_distance_field` of one slice, costs alone; 1 and sqrt 2, cuts corners",
    "rustworkx": "`dijkstra_shortest_path_lengths`, costs alone, on such a graph; an edge's price is a call "
    "of Python",
    "networkx": "`single_source_dijkstra_path_length`, costs alone, on such a graph",
    "pathfinding": "`DijkstraFinder` as far as the farthest cell, one path, no corner cut; its grid is made, "
    "and cleaned again, beforehand",
}
SLOW = ("rustworkx", "networkx", "pathfinding")
"""Thousands of nanoseconds a cell: measured on one map."""
Call = Callable[[], Any]


def edges(free: np.ndarray, moves: Moves) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Our moves as nodes from, to and lengths; and the node of each cell, -1 in walls."""
    height, width = free.shape
    node = np.full(free.shape, -1, dtype=np.int32)
    node[free] = np.arange(int(free.sum()), dtype=np.int32)
    rows, cols, lengths = [], [], []
    for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
        ys = slice(max(0, -dy), height - max(0, dy))
        xs = slice(max(0, -dx), width - max(0, dx))
        ok = free[ys, xs] & _moved(free, dx, dy)[ys, xs]
        for sx, sy in _passed(dx, dy, moves.corner_cutting):
            ok &= _moved(free, sx, sy)[ys, xs]
        rows.append(node[ys, xs][ok])
        cols.append(_moved(node, dx, dy)[ys, xs][ok])
        lengths.append(np.full(rows[-1].size, moves.value(cost)))
    return np.concatenate(rows), np.concatenate(cols), np.concatenate(lengths), node


def _moved(cells: np.ndarray, dx: int, dy: int) -> np.ndarray:
    """What is dx, dy further on; what comes in at the edges is never looked at."""
    return np.roll(cells, (-dy, -dx), (0, 1))


def _passed(dx: int, dy: int, cutting: bool) -> tuple[tuple[int, int], ...]:
    """The cells besides its ends that a step needs free."""
    if abs(dx * dy) == 2:
        x, y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        return ((x, 0) if abs(dx) == 2 else (0, y), (x, y))
    return ((dx, 0), (0, dy)) if dx and dy and not cutting else ()


def contestants(
    free: np.ndarray, moves: Moves, goal: tuple[int, int], *, without: Collection[str] = SLOW
) -> dict[str, Call]:
    """Name and call of everybody who can do it by these moves, or by some near enough (see ``RULES``)."""
    calls: dict[str, Call] = {"lampyris": partial(solve, free, moves, goal)}
    if moves.reach == 1:
        calls |= _by_steps(free, bool(moves.diagonal), goal)
    if "scipy" not in without:
        calls |= _by_graphs(free, moves, goal, slow="networkx" not in without)
    if "pathfinding" not in without:
        calls["pathfinding"] = Pathfinding(free, goal)
    return {name: call for name, call in calls.items() if name not in without}


def _by_steps(free: np.ndarray, diagonals: bool, goal: tuple[int, int]) -> dict[str, Call]:
    import dijkstra3d
    import tcod.path
    from skimage.graph import MCP, MCP_Geometric

    x, y = goal
    prices = np.where(free, 1.0, -1.0)
    walkable = free.astype(np.int8)
    begin = np.full(free.shape, np.iinfo(np.int32).max, dtype=np.int32)
    begin[y, x] = 0
    out = begin.copy()
    ground = np.asfortranarray(free[..., None])
    calls: dict[str, Call] = {
        "tcod": lambda: tcod.path.dijkstra2d(begin, walkable, 10, 14 if diagonals else 0, out=out),
    }
    finder = (MCP_Geometric if diagonals else MCP)(prices, fully_connected=diagonals)
    calls["scikit-image"] = partial(finder.find_costs, [(y, x)])
    if diagonals:
        calls["dijkstra3d"] = lambda: dijkstra3d.euclidean_distance_field(ground, (y, x, 0))
    return calls


def _by_graphs(free: np.ndarray, moves: Moves, goal: tuple[int, int], *, slow: bool) -> dict[str, Call]:
    rows, cols, lengths, node = edges(free, moves)
    many, source = int(free.sum()), int(node[goal[1], goal[0]])
    matrix = csr_matrix((lengths, (rows, cols)), shape=(many, many))
    calls: dict[str, Call] = {"scipy": partial(dijkstra, matrix, directed=True, indices=source)}
    if slow:
        import networkx as nx
        import rustworkx as rx

        weighted = list(zip(rows.tolist(), cols.tolist(), lengths.tolist(), strict=True))
        rust = rx.PyDiGraph()
        rust.add_nodes_from(range(many))
        rust.add_edges_from(weighted)
        plain = nx.DiGraph()
        plain.add_nodes_from(range(many))
        plain.add_weighted_edges_from(weighted)
        calls["rustworkx"] = partial(rx.dijkstra_shortest_path_lengths, rust, source, float)
        calls["networkx"] = partial(nx.single_source_dijkstra_path_length, plain, source)
    return calls


class Pathfinding:
    """A call of the library ``pathfinding``; its grid remembers a search, and is cleaned by :meth:`clean`."""

    def __init__(self, free: np.ndarray, goal: tuple[int, int]) -> None:
        from pathfinding.core.diagonal_movement import DiagonalMovement
        from pathfinding.core.grid import Grid
        from pathfinding.finder.dijkstra import DijkstraFinder

        ys, xs = np.nonzero(free)
        k = int(np.argmax((xs - goal[0]) ** 2 + (ys - goal[1]) ** 2))
        self._goal, self.end = goal, (int(xs[k]), int(ys[k]))
        self._grid = Grid(matrix=free.astype(int).tolist())
        rule = DiagonalMovement.only_when_no_obstacle
        self._finder = DijkstraFinder(diagonal_movement=rule, time_limit=float("inf"))

    def clean(self) -> None:
        """As if nothing had been looked for."""
        self._grid.cleanup()
        self._grid.dirty = False

    def __call__(self) -> list[tuple[int, int]]:
        begin, end = (self._grid.node(*cell) for cell in (self._goal, self.end))
        return [(node.x, node.y) for node in self._finder.find_path(begin, end, self._grid)[0]]


def check(free: np.ndarray, moves: Moves, goal: tuple[int, int], calls: dict[str, Call]) -> int:
    """How many cells are reached; every answer of everybody is compared with ours by the same rules.

    scikit-image and dijkstra3d cut corners at 1 and sqrt 2: their costs must be those of our octile moves
    with corners cut. dijkstra3d adds up in 32 bits, and may be off by the rounding of each step.

    Raises
    ------
    AssertionError : somebody is wrong.
    """
    field: Field = calls["lampyris"]()
    ours = np.where(field.exact >= 0, field.cost, np.inf)
    cutting = ours
    if moves.diagonal and {"scikit-image", "dijkstra3d"} & calls.keys():
        cutting = solve(free, replace(MOVES["octile"], corner_cutting=True), goal).cost
    near = np.testing.assert_allclose
    for name in calls.keys() - {"lampyris"}:
        got = calls[name]()
        if name == "scipy":
            near(got, ours[free], rtol=1e-9, err_msg=name)
        elif name == "tcod":
            np.testing.assert_array_equal(got, _in_tens(free, field), err_msg=name)
        elif name == "scikit-image":
            # Without diagonals it counts the cell where it begins, too.
            near(got[0] - got[0][goal[::-1]], cutting, rtol=1e-9, err_msg=name)
        elif name == "dijkstra3d":
            steps = float(cutting[np.isfinite(cutting)].max())
            near(got[..., 0][free], cutting[free], rtol=1e-6 + steps * 2.0**-24, err_msg=name)
        elif name == "pathfinding":
            end = calls[name].end  # type: ignore[attr-defined]
            near(_length(got), ours[end[::-1]], rtol=1e-9, err_msg=name)
        else:
            costs = np.full(int(free.sum()), np.inf)
            costs[list(got.keys())] = list(got.values())
            costs[int(free[: goal[1]].sum() + free[goal[1], : goal[0]].sum())] = 0.0
            near(costs, ours[free], rtol=1e-9, err_msg=name)
    return int(field.expansions)


def _in_tens(free: np.ndarray, field: Field) -> np.ndarray:
    """What tcod must find: 10 and 14, corners cut, or 10 for each of four moves; and the most there is."""
    if not field.moves.diagonal:
        exact, price = field.exact, 10
    else:
        same = field.moves.name == "dissertation"
        exact, price = (field if same else solve(free, MOVES["dissertation"], field.goal)).exact, 1
    return np.where(exact >= 0, price * exact, np.iinfo(np.int32).max)


def _length(cells: list[tuple[int, int]]) -> float:
    """Of a way; there may be none."""
    return float(np.hypot(*np.diff(np.array(cells), axis=0).T).sum()) if cells else np.inf
