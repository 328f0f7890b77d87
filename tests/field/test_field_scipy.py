"""The field equals SciPy's on 2,000 random grids, and the distance to the wall equals SciPy's transform."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.planning.field.layers import clearance
from lampyris.planning.field.solve import solve
from sizes import sized


def _shifted(free: np.ndarray, dx: int, dy: int) -> np.ndarray:
    """Whether the cell at (x + dx, y + dy) is free."""
    height, width = free.shape
    out = np.zeros_like(free)
    ys, xs = slice(max(0, -dy), height - max(0, dy)), slice(max(0, -dx), width - max(0, dx))
    to_ys, to_xs = slice(max(0, dy), height - max(0, -dy)), slice(max(0, dx), width - max(0, -dx))
    out[ys, xs] = free[to_ys, to_xs]
    return out


def _costs(free: np.ndarray, name: str, goal: tuple[int, int]) -> np.ndarray:
    moves = MOVES[name]
    height, width = free.shape
    rows, cols, weights = [], [], []
    for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
        ok = free & _shifted(free, dx, dy)
        if abs(dx) == 2:
            ok &= _shifted(free, dx // 2, 0) & _shifted(free, dx // 2, dy)
        elif abs(dy) == 2:
            ok &= _shifted(free, 0, dy // 2) & _shifted(free, dx, dy // 2)
        elif dx and dy and name != "dissertation":
            ok &= _shifted(free, dx, 0) & _shifted(free, 0, dy)
        at = np.flatnonzero(ok)
        rows.append(at)
        cols.append(at + dy * width + dx)
        octile = 2**0.5 if dx and dy else 1.0
        weights.append(np.full(at.size, octile if name == "octile" else float(cost)))
    size = height * width
    graph = csr_matrix((np.concatenate(weights), (np.concatenate(rows), np.concatenate(cols))), (size, size))
    found = dijkstra(graph, indices=goal[1] * width + goal[0]).reshape(height, width)
    return found if free[goal[1], goal[0]] else np.full(free.shape, np.inf)


@pytest.mark.nightly
@sized("cases", 500, 2000)
def test_two_thousand_grids(cases: int) -> None:
    rng = np.random.default_rng(2000)
    reached = 0
    for k in range(cases):
        height, width = rng.integers(5, 61, 2)
        free = rng.random((height, width)) >= 0.5 * rng.random()
        goal = (int(rng.integers(width)), int(rng.integers(height)))
        name = tuple(MOVES)[k % 4]
        field = solve(free, MOVES[name], goal)
        theirs = _costs(free, name, goal)
        if name == "octile":
            np.testing.assert_allclose(field.cost, theirs, rtol=1e-12)
        else:
            # Whole numbers below 2^53: SciPy's floats are exact too.
            np.testing.assert_array_equal(np.where(field.exact < 0, np.inf, field.exact), theirs)
        reached += field.expansions
    assert reached > 500 * cases


def test_clearance_is_the_transform_of_the_doubled_map() -> None:
    """On a lattice of half cells, centres at odd places, a wall is the 3x3 points around its centre."""
    rng = np.random.default_rng(2001)
    for _ in range(100):
        height, width = rng.integers(1, 50, 2)
        blocked = rng.random((height, width)) < rng.random() ** 2
        blocked[int(rng.integers(height)), int(rng.integers(width))] = True
        lattice = np.ones((2 * height + 1, 2 * width + 1), dtype=np.bool_)
        for dy in range(3):
            for dx in range(3):
                lattice[dy : dy + 2 * height : 2, dx : dx + 2 * width : 2] &= ~blocked
        theirs = 0.5 * distance_transform_edt(lattice)[1::2, 1::2]
        np.testing.assert_allclose(clearance(Grid(blocked, resolution=0.25)), 0.25 * theirs, rtol=1e-12)
