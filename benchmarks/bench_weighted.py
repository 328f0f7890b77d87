"""Fields over terrain: cells of different weight compared with cells that all cost the same, and compared with rivals."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from benchmarks.about import versions
from benchmarks.field_rivals import edges
from benchmarks.figures import Figure, Section, Spread, Table, judge_cost
from benchmarks.maps import middle, random_map
from benchmarks.turns import Call, take_turns
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from lampyris.kernels._jit import prefer_compiled
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT
from lampyris.model.moves import MOVES, Moves
from lampyris.planning.field.solve import solve

TITLE = "Weighted cells"
HOW = """The whole field (cost, parents, luciferin) by `lampyris.planning.field.solve.solve`, goal in the middle, code
compiled, nanoseconds of this thread's processor time for each cell reached: first where every free cell costs
the same, then over terrain, integer weights from 1 to 5 in steps of 1/63 of the price of a step. Flat terrain
is 0 everywhere; smooth is hills some hundred cells wide; noise is a number drawn for each cell. By turns, the
rivals too where they are there (at 10 %: one share of blocked cells is enough to tell).

- scikit-image: `MCP_Geometric(costs)`, made beforehand, and of it `find_costs`, which gives the traceback
  too; a step costs the mean of its two cells, and cuts corners (`MCP` without diagonals, where a step costs
  the cell that the search enters).
- tcod: `path.dijkstra2d`, int32, costs alone; a step costs the cell that the search enters, and cuts corners.
- scipy: `csgraph.dijkstra` on a graph, made beforehand, of exactly our moves and prices (a step costs the
  cell that the robot enters); costs alone. All our costs are compared with its."""

MOST = 3.0
"""Times of what cells of one price take."""
RIVALS = ("scikit-image", "tcod", "scipy")
KINDS = ("four-connected", "dissertation", "octile", "sixteen-connected")


def bench(quick: bool) -> Section:
    """Every step set and terrain."""
    prefer_compiled()
    figures: list[Figure] = []
    rows = []
    for size in (512,) if quick else (512, 1024):
        for share in (0.1,) if quick else (0.0, 0.1, 0.3):
            free = random_map(size, share)
            free.setflags(write=False)
            for kind in KINDS:
                rows += _rows(free, f"{size} at {share:.0%}", kind, figures, 3 if quick else 5)
    heads = ("map", "moves", "terrain", "ns a cell", "cells of one price", "times that", *RIVALS)
    verdicts = [
        judge_cost("weighted cells compared with cells of one price", [f for f in figures if f.asked])
    ]
    about = versions(["numpy", "numba", *RIVALS])
    table = Table(heads, tuple(rows), "Over terrain")
    return Section("weighted", TITLE, HOW, (table,), tuple(figures), tuple(verdicts), about)


def grounds(size: int) -> Iterator[tuple[str, np.ndarray]]:
    """Terrain by name, uint8, read-only."""
    rng = np.random.default_rng(size)
    across = np.arange(size)
    hills = np.add.outer(np.sin(across / 40), np.cos(across / 37)) + 2
    for name, heights in (
        ("flat", np.zeros((size, size))),
        ("smooth", hills * (MAX_TERRAIN / 4)),
        ("noise", rng.integers(0, MAX_TERRAIN + 1, (size, size))),
    ):
        terrain = np.clip(heights, 0, MAX_TERRAIN).astype(np.uint8)
        terrain.setflags(write=False)
        yield name, terrain


def _rows(
    free: np.ndarray, title: str, kind: str, figures: list[Figure], rounds: int
) -> Iterator[tuple[str, ...]]:
    moves, goal = MOVES[kind], middle(free)
    weighed = moves.weighed()
    grounds_here = dict(grounds(len(free)))
    calls: dict[str, Call] = {"one price": partial(solve, free, moves, goal)}
    for name, terrain in grounds_here.items():
        calls[name] = partial(solve, free, weighed, goal, terrain=terrain)
        rivals = _rivals(free, terrain, weighed, goal)
        _check(rivals, calls[name], free, weighed)
        # Rivals are slow: one share of blocked cells is enough to tell.
        calls |= {f"{name}, {who}": call for who, call in rivals.items() if title.endswith("10%")}
    times = take_turns(calls, rounds=rounds, per=calls["one price"]().expansions)
    for name in grounds_here:
        task, base = f"{title}, {kind}, {name}", times["one price"]
        figure = Figure(task, "ns a cell", times[name], "cells of one price", base, asked=1 / MOST)
        figures.append(figure)
        cell = [title, kind, name, _text(times[name]), _text(base), f"{times[name].middle / base.middle:.2f}"]
        for who in RIVALS:
            theirs = times.get(f"{name}, {who}")
            beside = Figure(task, "ns a cell", times[name], who, theirs)
            if theirs:
                figures.append(beside)
            cell.append(f"{theirs.middle:.0f} = {beside.ratio:.1f} x" if theirs else "")
        yield tuple(cell)


def _rivals(free: np.ndarray, terrain: np.ndarray, moves: Moves, goal: tuple[int, int]) -> dict[str, Call]:
    """Who can do it, prepared; prices in those of a plain cell."""
    from skimage.graph import MCP, MCP_Geometric

    x, y = goal
    toll = 1.0 + terrain / TERRAIN_UNIT
    rows, cols, lengths, node = edges(free, moves)
    many = int(free.sum())
    # The field's costs are to the goal: anyone who starts there walks every step backwards, and pays for the
    # cell that the step comes from.
    graph = csr_matrix((lengths * toll[free][cols], (cols, rows)), shape=(many, many))
    calls: dict[str, Call] = {"scipy": partial(dijkstra, graph, directed=True, indices=int(node[y, x]))}
    if moves.reach == 1:
        prices = np.where(free, toll, -1.0)
        kind, full = (MCP_Geometric, True) if moves.diagonal else (MCP, False)
        calls["tcod"] = _by_tcod(free, terrain, bool(moves.diagonal), goal)
        calls["scikit-image"] = partial(kind(prices, fully_connected=full).find_costs, [(y, x)])
    return calls


def _by_tcod(free: np.ndarray, terrain: np.ndarray, diagonals: bool, goal: tuple[int, int]) -> Call:
    import tcod.path

    prices = np.where(free, TERRAIN_UNIT + terrain.astype(np.int32), 0)
    begin = np.full(free.shape, np.iinfo(np.int32).max, dtype=np.int32)
    begin[goal[::-1]] = 0
    out = begin.copy()
    return lambda: tcod.path.dijkstra2d(begin, prices, 10, 14 if diagonals else 0, out=out)


def _check(rivals: dict[str, Call], ours: Call, free: np.ndarray, moves: Moves) -> None:
    """Our costs must be scipy's."""
    field = ours()
    theirs = np.full(free.shape, np.inf)
    theirs[free] = rivals["scipy"]()
    np.testing.assert_allclose(field.cost, theirs, rtol=1e-9)


def _text(s: Spread) -> str:
    return f"{s.middle:.1f} ({s.low:.1f} to {s.high:.1f})"
