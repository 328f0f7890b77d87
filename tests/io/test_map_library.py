"""The bundled maps: made again from their recipes, judged by a Dijkstra that shares no code with them."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

import lampyris.io.maps.library as library
from lampyris.errors import FileError
from lampyris.io.maps.load import load_map

ENVS = [f"env-{k}" for k in range(1, 7)]

# Table 4.11, the rows of AD-GSO: start x, y, goal x, y, gates.
TABLE_4_11 = {
    "env-1": [
        (37, 8, 5, 38, 3),
        (45, 6, 19, 41, 4),
        (0, 42, 6, 2, 3),
        (3, 2, 2, 48, 3),
        (21, 14, 21, 37, 4),
    ],
    "env-2": [
        (24, 24, 35, 38, 3),
        (34, 38, 25, 13, 2),
        (18, 21, 32, 42, 2),
        (33, 18, 25, 35, 1),
        (42, 3, 0, 37, 0),
    ],
    "env-3": [
        (28, 7, 26, 26, 2),
        (14, 48, 33, 16, 1),
        (43, 47, 23, 15, 1),
        (8, 0, 48, 46, 0),
        (48, 24, 1, 24, 0),
    ],
    "env-4": [
        (3, 6, 47, 14, 2),
        (25, 22, 47, 14, 1),
        (41, 1, 2, 3, 1),
        (5, 49, 18, 0, 0),
        (27, 1, 16, 48, 0),
    ],
    "env-5": [
        (22, 13, 27, 17, 1),
        (33, 36, 22, 12, 1),
        (11, 42, 31, 8, 1),
        (1, 48, 49, 1, 0),
        (26, 4, 23, 48, 0),
    ],
    "env-6": [
        (48, 49, 1, 49, 0),
        (0, 49, 0, 3, 0),
        (0, 0, 49, 49, 0),
        (0, 49, 49, 0, 0),
        (39, 2, 15, 37, 0),
    ],
}

# Blocked cells of Table 4.2, row by row, x and y from the upper left.
GUIDE = [
    "#.........",
    "#.......##",
    "...##....#",
    "...#......",
    "...#..###.",
    "...#..#.#.",
    "..##....#.",
    ".....#..##",
    ".....#....",
    "..........",
]

# 8119/5741 is a convergent of sqrt 2: these integers order lengths of fewer than 5741 diagonals exactly.
MOVES = {"dissertation": (10, 14, True), "octile": (5741, 8119, False)}


def is_gate(blocked: np.ndarray, x: int, y: int) -> bool:
    height, width = blocked.shape
    if blocked[y, x]:
        return False
    across = 0 < x < width - 1 and blocked[y, x - 1] and blocked[y, x + 1]
    return bool(across or (0 < y < height - 1 and blocked[y - 1, x] and blocked[y + 1, x]))


def neighbours(blocked: np.ndarray, x: int, y: int, moves: str) -> Iterator[tuple[int, int, int]]:
    straight, diagonal, cutting = MOVES[moves]
    height, width = blocked.shape
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            u, v = x + dx, y + dy
            if (dx, dy) == (0, 0) or not (0 <= u < width and 0 <= v < height) or blocked[v, u]:
                continue
            if dx and dy and not cutting and (blocked[y, u] or blocked[v, x]):
                continue
            yield u, v, diagonal if dx and dy else straight


def gates_on_optimal_paths(
    blocked: np.ndarray, start: tuple[int, int], goal: tuple[int, int], moves: str
) -> tuple[int, int]:
    """Fewest and most gate cells on any optimal path."""
    cost = {start: 0}
    queue = [(0, start)]
    settled: list[tuple[int, int]] = []
    seen = set()
    while queue:
        c, cell = heapq.heappop(queue)
        if cell in seen:
            continue
        seen.add(cell)
        settled.append(cell)
        if cell == goal:
            break
        for u, v, step in neighbours(blocked, *cell, moves):
            if c + step < cost.get((u, v), c + step + 1):
                cost[u, v] = c + step
                heapq.heappush(queue, (c + step, (u, v)))
    count: dict[tuple[int, int], tuple[int, int]] = {}
    for cell in settled:
        here = is_gate(blocked, *cell)
        before = [
            count[u, v]
            for u, v, step in neighbours(blocked, *cell, moves)
            if (u, v) in count and cost[u, v] + step == cost[cell]
        ]
        low, high = min((b[0] for b in before), default=0), max((b[1] for b in before), default=0)
        count[cell] = (low + here, high + here)
    return count[goal]


def test_names() -> None:
    assert library.names()[:7] == ("guide", *ENVS)


def test_guide_is_table_4_2() -> None:
    guide = load_map("guide")
    assert ["".join("#" if b else "." for b in row) for row in guide.grid.blocked.tolist()] == GUIDE
    assert (guide.start, guide.goal, guide.format) == ((0, 9), (7, 0), "bundled")
    assert [(x, y) for y in range(10) for x in range(10) if is_gate(guide.grid.blocked, x, y)] == [(7, 5)]
    assert guide.queries[0].gates == 0
    for moves in MOVES:
        assert gates_on_optimal_paths(guide.grid.blocked, (0, 9), (7, 0), moves) == (0, 0)


@pytest.mark.parametrize("name", ENVS)
def test_made_again_from_its_recipe(name: str) -> None:
    assert (library.remake(name) == load_map(name).grid.blocked).all()


@pytest.mark.parametrize("name", ENVS)
def test_queries_are_those_of_table_4_11(name: str) -> None:
    found = load_map(name)
    assert [(*q.start, *q.goal, q.gates) for q in found.queries] == TABLE_4_11[name]
    assert (found.start, found.goal) == (found.queries[0].start, found.queries[0].goal)
    assert found.grid.blocked.shape == (50, 50)


@pytest.mark.commit(3)
@pytest.mark.parametrize("moves", MOVES)
@pytest.mark.parametrize("name", ENVS)
def test_every_optimal_path_passes_so_many_gates(name: str, moves: str) -> None:
    blocked = load_map(name).grid.blocked
    for x0, y0, x1, y1, gates in TABLE_4_11[name]:
        assert not is_gate(blocked, x0, y0)
        assert not is_gate(blocked, x1, y1)
        assert gates_on_optimal_paths(blocked, (x0, y0), (x1, y1), moves) == (gates, gates)


def with_gates_sealed(blocked: np.ndarray) -> np.ndarray:
    height, width = blocked.shape
    sealed = blocked.copy()
    for y in range(height):
        for x in range(width):
            sealed[y, x] |= is_gate(blocked, x, y)
    return sealed


def reached(blocked: np.ndarray, start: tuple[int, int], moves: str) -> set[tuple[int, int]]:
    """The cells a robot can get to, by a flood fill."""
    seen, todo = {start}, [start]
    while todo:
        for u, v, _ in neighbours(blocked, *todo.pop(), moves):
            if (u, v) not in seen:
                seen.add((u, v))
                todo.append((u, v))
    return seen


def shortest(blocked: np.ndarray, start: tuple[int, int], goal: tuple[int, int], moves: str) -> int | None:
    """Length of the shortest way in the units of MOVES; None where there is none."""
    cost = {start: 0}
    queue = [(0, start)]
    while queue:
        c, cell = heapq.heappop(queue)
        if cell == goal:
            return c
        if c > cost[cell]:
            continue
        for u, v, step in neighbours(blocked, *cell, moves):
            if c + step < cost.get((u, v), c + step + 1):
                cost[u, v] = c + step
                heapq.heappush(queue, (c + step, (u, v)))
    return None


@pytest.mark.commit(1)
@pytest.mark.parametrize("moves", MOVES)
@pytest.mark.parametrize("name", ENVS)
def test_sealing_the_gates_costs_a_longer_way_and_never_the_way(name: str, moves: str) -> None:
    blocked = load_map(name).grid.blocked
    sealed = with_gates_sealed(blocked)
    for x0, y0, x1, y1, gates in TABLE_4_11[name]:
        assert not sealed[y0, x0]  # no start and no goal is a gate itself
        way, round_about = (shortest(b, (x0, y0), (x1, y1), moves) for b in (blocked, sealed))
        assert round_about is not None, "every way leads through a gate"
        assert round_about > way if gates else round_about == way
        # More than the pairs need: wherever a user puts the ends, closing the gates leaves a way.
        assert len(reached(sealed, (x0, y0), moves)) == (~sealed).sum()


def test_the_judge_tells_fewest_from_most() -> None:
    #  Two ways of equal length from S to G, one of them through a gate.
    rows = ["..#..", ".....", "..#..", ".....", "....."]
    blocked = np.array([[c == "#" for c in row] for row in rows])
    assert gates_on_optimal_paths(blocked, (0, 2), (4, 2), "octile") == (0, 1)
    assert gates_on_optimal_paths(blocked, (0, 1), (4, 1), "octile") == (1, 1)


@pytest.mark.parametrize("name", ["guide", *ENVS])
def test_described(name: str) -> None:
    info, grid = library.describe(name), load_map(name).grid
    assert (info.width, info.height) == (grid.width, grid.height)
    assert info.free == 1 - grid.blocked.mean()
    cells = ((x, y) for y in range(grid.height) for x in range(grid.width))
    assert info.gates == sum(is_gate(grid.blocked, x, y) for x, y in cells)
    assert info.title
    assert info.description
    assert info.recipe == "" if name == "guide" else info.recipe.startswith("gates, seed ")


def test_from_crowded_to_open() -> None:
    free = [library.describe(name).free for name in ENVS]
    # Two points apart at the least: a map of the next number is to look emptier, not to be so by a cell.
    assert all(b - a > 0.02 for a, b in pairwise(free))
    assert free[0] < 0.77
    assert free[-1] > 0.95


def test_refused() -> None:
    with pytest.raises(FileError, match=r"FILE_MISSING.*env-1"):
        library.describe("env-9")
    with pytest.raises(FileError, match="RECIPE"):
        library.remake("guide")


@pytest.mark.parametrize("name", ["guide", *ENVS])
def test_no_free_cell_is_cut_off(name: str) -> None:
    from scipy.ndimage import label

    assert label(~load_map(name).grid.blocked)[1] == 1
