"""Queries, the smaller comparisons: what `fastest` chooses; path and field; an A* in plain Python."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from benchmarks.figures import Figure, Spread, Table
from benchmarks.maps import maze, published_map, random_map
from benchmarks.motion_planning import astar
from benchmarks.query_rivals import WITH_FIELD, Contest, length_of, with_field
from benchmarks.turns import take_turns

from lampyris.model.moves import MOVES, Moves
from lampyris.planning.graph.fastest_search import FieldSearch, suited
from lampyris.planning.graph.grid_graph import GridSearch
from lampyris.planning.graph.jps_search import JumpSearch

NAMES = (
    "arena2", "AR0011SR", "Berlin_0_256", "16room_000", "ht_0_hightown", "maze512-32-0", "random512-10-0",
)  # fmt: skip
NEAR = 1.3
"""And `fastest` shall take at most so many times the time of the best search for the map."""
WAYS = {"jps": "the search alone", "jps call": "the public call", "jps anew": "a session opened anew"}
"""How our jump point search is asked, and what is said of it."""

Cell = tuple[int, int]
Query = tuple[Cell, Cell, float, float]
"""Start, goal, length, and how far off the length may be."""


def made_queries(free: np.ndarray, count: int, moves: Moves) -> list[Query]:
    """``count`` queries between random cells of a map that can reach each other; lengths by our own A*."""
    rng = np.random.default_rng(free.shape[0])
    search = GridSearch(free, moves, informed=True)
    cells = np.argwhere(free)
    queries: list[Query] = []
    while len(queries) < count:
        (sy, sx), (gy, gx) = cells[rng.integers(len(cells), size=2)].tolist()
        answer = search.find_path((sx, sy), (gx, gy))
        if answer.cells is not None:
            queries.append(((sx, sy), (gx, gy), length_of(answer.cells), 1e-6))
    return queries


# ---- choosing --------------------


def choice(figures: list[Figure], quick: bool) -> Table:
    """Does `fastest` choose well? Mean times, for a mean is what a day of queries takes."""
    rows = []
    size = 256 if quick else 512
    for title, free in _kinds(size, quick):
        for kind in ("octile", "dissertation"):
            moves = MOVES[kind]
            jumps = JumpSearch(free, moves)
            searches = {
                "jps": jumps,
                "astar": GridSearch(free, moves, informed=True),
                "field": FieldSearch(free, moves, jumps),
                "fastest": suited(free, None, moves),
            }
            ends = [q[:2] for q in made_queries(free, 10 if quick else 40, moves)]

            def over(search: Any, ends: Any = ends) -> Any:
                return lambda: [search.find_path(*pair) for pair in ends]

            times = take_turns(
                {name: over(search) for name, search in searches.items()},
                rounds=3 if quick else 5,
                per=1e3 * len(ends),
            )
            best = min(("jps", "astar", "field"), key=lambda name: times[name].middle)
            figure = Figure(
                f"choice, {title}, {kind}", "us a query", times["fastest"], "the best search for the map",
                times[best], asked=1 / NEAR,
            )  # fmt: skip
            figures.append(figure)
            assert figure.ratio is not None
            mean = (f"{times[name].middle:.0f}" for name in ("jps", "astar", "field"))
            rows.append(
                (title, kind, *mean, f"{times['fastest'].middle:.0f}", best, f"{1 / figure.ratio:.2f}")
            )
    heads = ("map", "moves", "jps", "astar", "field to the start", "fastest", "best", "fastest / best")
    return Table(heads, tuple(rows), "What `fastest` chooses: mean us a query between random cells")


def _kinds(size: int, quick: bool) -> Iterator[tuple[str, np.ndarray]]:
    for share in (10, 40) if quick else (0, 10, 20, 30, 35, 40):
        yield f"{size} random {share} %", random_map(size, share / 100)
    yield f"{size} maze, corridor 1", maze(size)
    if not quick:
        yield f"{size} maze, branching", maze(size, 1 / 3)
        for name in NAMES:
            free = published_map(name)
            if free is not None:
                yield name, free


# ---- path and field --------------------


def path_and_field(figures: list[Figure], quick: bool) -> Table:
    """The path of one query with the costs of every cell: what is wanted where the robot may stray."""
    rows = []
    several: list[tuple[str, np.ndarray]] = [("512 random 10 %", random_map(512, 0.1))]
    if not quick:
        several += [(name, free) for name in NAMES if (free := published_map(name)) is not None]
        several.append(("512 maze, corridor 1", maze(512)))
    for title, free in several:
        free.setflags(write=False)
        ends = [q[:2] for q in made_queries(free, 2 if quick else 6, MOVES["octile"])]
        ways = with_field(free)
        calls = {
            name: (lambda way=way, pairs=ends: [way(*pair) for pair in pairs]) for name, way in ways.items()
        }
        compare_ways(calls["lampyris"](), calls["scipy"](), ends)
        times = take_turns(calls, rounds=2 if quick else 3, per=1e6 * len(ends))
        row = [title, f"{times['lampyris'].middle:.2f}"]
        for name in list(ways)[1:]:
            figure = Figure(f"path and field, {title}", "ms a query", times["lampyris"], name, times[name])
            figures.append(figure)
            row.append(f"{times[name].middle:.1f} = {figure.ratio:.1f} x")
        rows.append(tuple(row))
    return Table(("map", "ours, ms", *list(WITH_FIELD)[1:]), tuple(rows), "Path and field, octile moves")


def compare_ways(ours: list[Any], theirs: list[Any], ends: list[tuple[Cell, Cell]]) -> None:
    """Two ways of each query, as cells: from start to goal, and as long as each other.

    Raises
    ------
    AssertionError : they are not.
    """
    for mine, other, (start, goal) in zip(ours, theirs, ends, strict=True):
        for way in (mine, other):
            first, last = tuple(np.asarray(way)[0].tolist()), tuple(np.asarray(way)[-1].tolist())
            assert (first, last) == (start, goal), f"{first} to {last} is not {start} to {goal}"
        a, b = length_of(mine), length_of(other)
        assert abs(a - b) <= 1e-9 * b, f"{start} to {goal}: {a}, not {b}"


# ---- plain Python --------------------


def plain(figures: list[Figure], quick: bool) -> Table:
    """Beside an A* in plain Python, on maps that it can do."""
    rows = []
    for size in (50,) if quick else (50, 100):
        free = random_map(size, 0.1)
        free.setflags(write=False)
        contest = Contest(free)
        us: dict[str, list[float]] = {"jps": [], "jps call": [], "theirs": []}
        wrong = 0
        queries = made_queries(free, 4 if quick else 12, MOVES["octile"])
        for k, (start, goal, length, off) in enumerate([queries[0], *queries]):
            calls = {who: contest.call(who, start, goal) for who in ("jps", "jps call")}
            calls["theirs"] = astar(free, start, goal).plan
            for who, call in calls.items():
                began = time.thread_time_ns()
                answer = call()
                if k:  # the first is asked again
                    us[who].append((time.thread_time_ns() - began) / 1e3)
                mine = answer[0] if who == "theirs" else Contest.length(who, answer)
                wrong += not isinstance(mine, float) or abs(mine - length) > off
        row = [f"{size} x {size} random 10 %", str(len(queries)), ""]
        theirs = Spread.of(us["theirs"])
        row[-1] = f"{theirs.middle:.0f}"
        for who in ("jps", "jps call"):
            figure = Figure(
                f"query by {WAYS[who]}, {size} random 10 %", "us a query", Spread.of(us[who]),
                "python-motion-planning", theirs,
            )  # fmt: skip
            figures.append(figure)
            row.append(f"{figure.ours.middle:.1f}: {figure.ratio:.0f} x")
        rows.append((*row, str(wrong)))
    heads = (
        "map",
        "queries",
        "python-motion-planning, us",
        *(f"{WAYS[who]}, us" for who in ("jps", "jps call")),
    )
    return Table(
        (*heads, "wrong lengths"), tuple(rows), "Compared with A* in plain Python, middle of the queries"
    )
