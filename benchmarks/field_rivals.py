"""Whom fields are held against: what each does, prepared but for the call itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from lampyris.field.solve import solve
from lampyris.model.moves import Moves

RULES = {
    "scikit-image": "`MCP_Geometric(costs).find_costs`; 1 and sqrt 2, cuts corners (`MCP` without diagonals)",
    "tcod": "`path.dijkstra2d`, int32; 10 and 14, cuts corners; its arrays made beforehand",
    "scipy": "`csgraph.dijkstra` on a graph, made beforehand, of exactly our moves",
    "dijkstra3d": "`euclidean_distance_field` of one slice; 1 and sqrt 2, cuts corners",
    "rustworkx": "`dijkstra_shortest_path_lengths` on such a graph; an edge's price is a Python call",
    "networkx": "`single_source_dijkstra_path_length` on such a graph",
    "pathfinding": "`DijkstraFinder` as far as the farthest cell, no corner cut",
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
    free: np.ndarray, moves: Moves, goal: tuple[int, int], *, slow: bool = False
) -> dict[str, Call]:
    """Name and call of everybody who can do it by these moves, or by some near enough (see ``RULES``)."""
    rows, cols, lengths, node = edges(free, moves)
    many = int(free.sum())
    matrix = csr_matrix((lengths, (rows, cols)), shape=(many, many))
    source = int(node[goal[1], goal[0]])
    calls: dict[str, Call] = {
        "lampyris": lambda: solve(free, moves, goal),
        "scipy": lambda: dijkstra(matrix, directed=True, indices=source),
    }
    if moves.reach == 1:
        calls |= _by_steps(free, bool(moves.diagonal), goal)
    if slow:
        calls |= _graphs(rows, cols, lengths, many, source)
        calls |= _pathfinding(free, goal)
    return calls


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
    if diagonals:
        calls["scikit-image"] = lambda: MCP_Geometric(prices, fully_connected=True).find_costs([(y, x)])[0]
        calls["dijkstra3d"] = lambda: dijkstra3d.euclidean_distance_field(ground, (y, x, 0))
    else:
        calls["scikit-image"] = lambda: MCP(prices, fully_connected=False).find_costs([(y, x)])[0]
    return calls


def _graphs(
    rows: np.ndarray, cols: np.ndarray, lengths: np.ndarray, many: int, source: int
) -> dict[str, Call]:
    import networkx as nx
    import rustworkx as rx

    weighted = list(zip(rows.tolist(), cols.tolist(), lengths.tolist(), strict=True))
    rust = rx.PyDiGraph()
    rust.add_nodes_from(range(many))
    rust.add_edges_from(weighted)
    plain = nx.DiGraph()
    plain.add_weighted_edges_from(weighted)
    return {
        "rustworkx": lambda: rx.dijkstra_shortest_path_lengths(rust, source, float),
        "networkx": lambda: nx.single_source_dijkstra_path_length(plain, source),
    }


def _pathfinding(free: np.ndarray, goal: tuple[int, int]) -> dict[str, Call]:
    from pathfinding.core.diagonal_movement import DiagonalMovement
    from pathfinding.core.grid import Grid
    from pathfinding.finder.dijkstra import DijkstraFinder

    matrix = free.astype(int).tolist()
    ys, xs = np.nonzero(free)
    k = int(np.argmax((xs - goal[0]) ** 2 + (ys - goal[1]) ** 2))

    def run() -> Any:
        grid = Grid(matrix=matrix)
        finder = DijkstraFinder(diagonal_movement=DiagonalMovement.only_when_no_obstacle)
        return finder.find_path(grid.node(*goal), grid.node(int(xs[k]), int(ys[k])), grid)

    return {"pathfinding": run}


def check(free: np.ndarray, moves: Moves, goal: tuple[int, int], calls: dict[str, Call]) -> int:
    """How many cells are reached. Our costs must be scipy's, and tcod's where the rules are the same."""
    field = calls["lampyris"]()
    theirs = np.full(free.shape, np.inf)
    theirs[free] = calls["scipy"]()
    np.testing.assert_allclose(field.cost, theirs, rtol=1e-9)
    reached = field.exact >= 0
    if moves.name in ("dissertation", "four"):
        price = 10 if moves.name == "four" else 1
        np.testing.assert_array_equal(calls["tcod"]().astype(np.int64)[reached], price * field.exact[reached])
    return int(field.expansions)
