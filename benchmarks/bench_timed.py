"""Earliest arrival among 200 moving obstacles: SIPP compared with space-time A*, in one run."""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, judge
from benchmarks.limits import STATES
from benchmarks.turns import take_turns

from lampyris.kernels._jit import prefer_compiled
from lampyris.model.change import Change, ObstacleTrack
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning.spacetime.prediction import Forecaster
from lampyris.planning.spacetime.search import TimedSearch
from lampyris.planning.spacetime.sipp import Sipp
from lampyris.planning.spacetime.space_time_astar import SpaceTimeAStar

TITLE = "Among moving obstacles"
HOW = """One call of `session.plan` in an open session: the forecast (here: known tracks of 600 ticks) is laid
out anew and searched; then the search alone, over what was laid out before. What is known of the bare map,
which a session finds out once, is not counted. Milliseconds of this thread's processor time, code compiled.

- sipp, space-time-astar: ours.
- textbook: space-time A* as one writes it in Python, heapq and sets, eight steps, given the same bound (steps
  left on the bare map), of equal sums the later tick first; it lays out occupied cells and forbidden steps in
  sets, as ours do in arrays. Its lists of the map are made before, as what ours know of the map is.
- w9-pathfinding: `SpaceTimeAStar(grid).find_path`, C++. Its `ReservationTable` knows occupied cells and
  swaps; crossings are added edge by edge. It arrives only where no obstacle passes the goal later, which lampyris
  does not require, and so is left out on the small map, where one does.

All must arrive at the same tick. Ours prefer the cheaper of states that are as early, so that a path is not needlessly
long; the textbook's takes the first that it comes to."""

RIVALS = ("space-time-astar", "textbook", "w9-pathfinding")
ASKED = {
    ("search alone", "textbook"): 5.0,
    ("search alone", "w9-pathfinding"): 1.5,
    ("whole call", "textbook"): 1.5,
    ("whole call", "w9-pathfinding"): 3.0,
}
"""How many times as quick SIPP shall be at 512 x 512."""
STEPS = MOVES["octile"].offsets


def walks(free: np.ndarray, count: int, ticks: int, rng: np.random.Generator) -> list[ObstacleTrack]:
    """Random walkers with their tracks known; they stay where they end."""
    height, width = free.shape
    ys, xs = np.nonzero(free)
    seen = []
    for k in range(count):
        i = int(rng.integers(len(xs)))
        x, y = int(xs[i]), int(ys[i])
        track = [(x, y)]
        for dx, dy in rng.integers(-1, 2, (ticks, 2)).tolist():
            u, v = x + dx, y + dy
            if 0 <= u < width and 0 <= v < height and free[v, u]:
                x, y = u, v
            track.append((x, y))
        seen.append(ObstacleTrack(k, tuple(track), 0, 1))
    return seen


def textbook(
    free: list[list[bool]], left: list[list[int]], start: tuple[int, int], goal: tuple[int, int],
    taken: set[tuple[int, int, int]], banned: set[tuple[int, int, int, int, int]], last: int,
) -> tuple[int, int]:  # fmt: skip
    """The first tick at which the goal can be reached, -1 if never; and how many states were expanded."""
    height, width = len(free), len(free[0])
    # Of equal sums the later tick first: the other way round every tick's plateau would be opened.
    heap = [(left[start[1]][start[0]], 0, start)]
    closed = set()
    while heap:
        _, before, (x, y) = heapq.heappop(heap)
        t = -before
        if (x, y) == goal:
            return t, len(closed)
        state = (x, y, min(t, last + 1))
        if state in closed:
            continue
        closed.add(state)
        t += 1
        for dx, dy in ((0, 0), *STEPS):
            u, v = x + dx, y + dy
            if not (0 <= u < width and 0 <= v < height and free[v][u] and free[y][u] and free[v][x]):
                continue
            when = min(t, last + 1)
            if (u, v, when) in taken or (x, y, dx, dy, t) in banned or (u, v, when) in closed:
                continue
            heapq.heappush(heap, (t + left[v][u], -t, (u, v)))
    return -1, len(closed)


def what_is_forbidden(seen: list[ObstacleTrack], last: int) -> tuple[set[Any], set[Any]]:
    """Occupied cells by tick (one tick more stands for all that follow), and steps that swap or cross."""
    taken, banned = set(), set()
    for one in seen:
        for t in range(last + 2):
            x, y = one.track[min(t, len(one.track) - 1)]
            taken.add((x, y, t))
            if 0 < t < len(one.track):
                a, b = one.track[t - 1]
                dx, dy = x - a, y - b
                banned.add((x, y, -dx, -dy, t))
                if dx and dy:
                    banned.add((a + dx, b, -dx, dy, t))
                    banned.add((a, b + dy, dx, -dy, t))
    return taken, banned


class Reserved:
    """Somebody else's space-time A* on one map, with our rules told to it."""

    def __init__(self, free: np.ndarray) -> None:
        from w9_pathfinding.envs import DiagonalMovement, Grid
        from w9_pathfinding.mapf import SpaceTimeAStar

        self._grid = Grid(
            np.where(free, 1.0, -1.0).tolist(),
            diagonal_movement=DiagonalMovement.only_when_no_obstacle,
            edge_collision=True,
        )
        self._search = SpaceTimeAStar(self._grid)

    def lay_out(self, seen: list[ObstacleTrack]) -> Any:
        """Cells and swaps by track, crossings edge by edge."""
        from w9_pathfinding.mapf import ReservationTable

        table = ReservationTable(self._grid)
        for one in seen:
            table.add_path(list(one.track), reserve_destination=True)
            for t, ((a, b), (x, y)) in enumerate(pairwise(one.track)):
                if a != x and b != y:
                    table.add_edge_constraint(t, (x, b), (a, y))
                    table.add_edge_constraint(t, (a, y), (x, b))
        return table

    def arrives(self, table: Any, start: tuple[int, int], goal: tuple[int, int]) -> int:
        """The tick of arrival."""
        return len(self._search.find_path(start, goal, max_length=1200, reservation_table=table)) - 1


def bench(quick: bool) -> Section:
    """Three maps."""
    prefer_compiled()
    figures: list[Figure] = []
    rows = []
    maps = ((128, 0.1, 50), (512, 0.1, 200), (512, 0.3, 200))
    for size, share, count in maps[:2] if quick else maps:
        rows.append(_map(size, share, count, 3 if quick else 9, figures))
    heads = ("map", "obstacles", "arrives at", "sipp, ms", *RIVALS, "search alone: sipp, ms", *RIVALS)
    verdicts = [
        judge(
            f"SIPP compared with {rival}, 512 x 512, {what}",
            [f for f in figures if f.asked and f.rival == rival and f.task.startswith(what)],
        )
        for what, rival in ASKED
    ]
    table = Table(heads, tuple(rows), "Earliest arrival, and how many times as long the others take")
    return Section(
        "timed",
        TITLE,
        HOW,
        (table,),
        tuple(figures),
        tuple(verdicts),
        versions(["numpy", "numba", "w9-pathfinding"]),
    )


def _map(size: int, share: float, count: int, rounds: int, figures: list[Figure]) -> tuple[str, ...]:
    """One map; its row."""
    rng = np.random.default_rng(size + count)
    free = rng.random((size, size)) >= share
    free[0, 0] = free[-1, -1] = True
    free.setflags(write=False)
    start, goal, last = (0, 0), (size - 1, size - 1), 600
    seen = walks(free, count, last, rng)
    search = TimedSearch(free, MOVES["octile"], goal, None)
    left = [[search.steps_left((x, y)) for x in range(size)] for y in range(size)]
    forbidden = Forecaster(free, ((0, 0),), guess="still", growth=0.0).forbidden(seen, 0, 0, 0)
    table, plain = search.timetable(forbidden), free.tolist()
    taken, banned = what_is_forbidden(seen, last)
    alone = {
        "sipp": lambda: search.by_intervals(table, start, 0, None),
        "space-time-astar": lambda: search.by_ticks(table, start, 0, None),
        "textbook": lambda: textbook(plain, left, start, goal, taken, banned, last),
    }
    reserved = Reserved(free) if size == 512 else None
    if reserved is not None:
        alone["w9-pathfinding"] = partial(reserved.arrives, reserved.lay_out(seen), start, goal)
    arrival, expanded = textbook(plain, left, start, goal, taken, banned, last)
    times = take_turns(alone, rounds=rounds, per=1e6)
    whole = _whole(free, plain, seen, (start, goal), left, reserved, rounds)
    assert whole.pop("arrival").middle == arrival
    title = f"{size} at {share:.0%}, {count} obstacles"
    states = search.by_intervals(table, start, 0, None).expansions
    figures.append(
        Figure(
            f"{STATES}, {title}", "in one search", Spread.of([float(states)]), "textbook",
            Spread.of([float(expanded)]),
        )
    )  # fmt: skip
    cells = [f"{size} x {size}, {share:.0%} blocked", str(count), str(arrival)]
    for what, spent in (("whole call", whole), ("search alone", times)):
        cells.append(f"{spent['sipp'].middle:.2f}")
        for rival in RIVALS:
            if rival not in spent:
                cells.append("")
                continue
            figure = Figure(
                f"{what}, {title}", "ms", spent["sipp"], rival, spent[rival],
                asked=ASKED.get((what, rival)) if size == 512 else None,
            )  # fmt: skip
            figures.append(figure)
            cells.append(f"{spent[rival].middle:.2f} = {figure.ratio:.2f} x")
    return tuple(cells)


def _whole(
    free: np.ndarray, plain: list[list[bool]], seen: list[ObstacleTrack],
    ends: tuple[tuple[int, int], tuple[int, int]], left: list[list[int]], reserved: Reserved | None,
    rounds: int,
) -> dict[str, Spread]:  # fmt: skip
    """Milliseconds of whole calls, by turns, each in a session of its own; and when all arrive."""
    rng = np.random.default_rng(0)
    start, goal = ends
    scene, change, last = (
        Scene(Grid(~free), start, goal),
        Change(robot=start, obstacle_tracks=tuple(seen)),
        600,
    )
    ms: dict[str, list[float]] = {}
    arrivals: set[int] = set()

    def timed(name: str, call: Callable[[], Any]) -> Any:
        began = time.thread_time_ns()
        out = call()
        ms.setdefault(name, []).append((time.thread_time_ns() - began) / 1e6)
        return out

    def by_the_book() -> int:
        return textbook(plain, left, start, goal, *what_is_forbidden(seen, last), last)[0]

    def reserving() -> int:
        assert reserved is not None
        return reserved.arrives(reserved.lay_out(seen), start, goal)

    for _ in range(rounds + 1):
        for planner in (Sipp(), SpaceTimeAStar()):
            session = planner.open(scene, rng)
            session.plan(Change(robot=start))  # the bare map
            plan = timed(planner.name, partial(session.plan, change))
            assert plan.schedule is not None
            arrivals.add(int(plan.schedule[-1]))
        arrivals.add(timed("textbook", by_the_book))
        if reserved is not None:
            arrivals.add(timed("w9-pathfinding", reserving))
    assert len(arrivals) == 1, f"they arrive at {sorted(arrivals)}"
    # The first round warms up.
    return {name: Spread.of(took[1:]) for name, took in ms.items()} | {
        "arrival": Spread.of([float(arrivals.pop())])
    }
