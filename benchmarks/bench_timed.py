"""Earliest arrival among 200 moving obstacles: SIPP beside space-time A*, in one run.

    python -m benchmarks.bench_timed [--quick] [--json FILE]

What is timed
-------------
One call of ``session.plan`` in an open session: the forecast (here: known tracks of 600 ticks) is laid out
anew and searched. The field of the bare map, which a session solves once, is told apart as ``open``.

* sipp, space-time-astar: ours, compiled code warm.
* textbook: space-time A* as one writes it in Python, heapq and sets, eight steps, given the same bound
  (steps left on the bare map); it lays out occupied cells and forbidden steps in sets, as ours do in arrays.

A second line tells of the search alone, over what was laid out before.

No installable rival plans among moving obstacles on eight neighbours without cut corners, swaps or
crossings; so the textbook is the rival that can be named. All three must arrive at the same tick.
"""

from __future__ import annotations

import argparse
import heapq
import json
import platform
import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.model.change import Change, Seen
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planners._timed_search import TimedSearch
from lampyris.planners.forecast import Forecaster
from lampyris.planners.sipp import Sipp
from lampyris.planners.space_time_astar import SpaceTimeAStar

STEPS = MOVES["octile"].offsets


def walks(free: np.ndarray, count: int, ticks: int, rng: np.random.Generator) -> list[Seen]:
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
        seen.append(Seen(k, tuple(track), 0, 1))
    return seen


def textbook(
    free: list[list[bool]], left: list[list[int]], start: tuple[int, int], goal: tuple[int, int],
    taken: set[tuple[int, int, int]], banned: set[tuple[int, int, int, int, int]], last: int,
) -> int:  # fmt: skip
    """The first tick at which the goal can be reached; -1 if never."""
    height, width = len(free), len(free[0])
    heap = [(left[start[1]][start[0]], 0, start)]
    closed = set()
    while heap:
        _, t, (x, y) = heapq.heappop(heap)
        if (x, y) == goal:
            return t
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
            heapq.heappush(heap, (t + left[v][u], t, (u, v)))
    return -1


def what_is_forbidden(seen: list[Seen], last: int) -> tuple[set[Any], set[Any]]:
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


def measure(size: int, share: float, count: int, rounds: int) -> dict[str, Any]:
    """One map: milliseconds of each contestant, and how often SIPP is quicker."""
    rng = np.random.default_rng(size + count)
    free = rng.random((size, size)) >= share
    free[0, 0] = free[-1, -1] = True
    start, goal = (0, 0), (size - 1, size - 1)
    seen = walks(free, count, 600, rng)
    scene = Scene(Grid(~free), start, goal)
    change = Change(robot=start, bodies=tuple(seen))
    sessions, arrival, opened = {}, set(), 0.0
    for planner in (Sipp(), SpaceTimeAStar()):
        session = planner.open(scene, rng)
        began = time.perf_counter()
        plan = session.plan(change)  # compiles, solves the bare map
        opened = time.perf_counter() - began
        assert plan.schedule is not None
        arrival.add(int(plan.schedule[-1]))
        sessions[planner.name] = (planner, plan.expansions)
    search = TimedSearch(free, scene.moves, goal, None)
    left = [[search.steps_left((x, y)) for x in range(size)] for y in range(size)]
    last = 600
    forbidden = Forecaster(free, ((0, 0),), guess="still", growth=0.0).forbidden(seen, 0, 0, 0)
    table = search.timetable(forbidden)
    taken, banned = what_is_forbidden(seen, last)
    rows = free.tolist()
    alone: dict[str, list[float]] = {"sipp": [], "space-time-astar": [], "textbook": []}
    asks = (
        lambda: search.by_intervals(table, start, 0, None),
        lambda: search.by_ticks(table, start, 0, None),
        lambda: textbook(rows, left, start, goal, taken, banned, last),
    )
    for _ in range(rounds):
        for name, ask in zip(alone, asks, strict=True):
            began = time.perf_counter()
            ask()
            alone[name].append(1e3 * (time.perf_counter() - began))
    times: dict[str, list[float]] = {name: [] for name in (*sessions, "textbook")}
    for _ in range(rounds):
        for name, (planner, _) in sessions.items():
            session = planner.open(scene, rng)
            session.plan(Change(robot=start))  # the bare map
            began = time.perf_counter()
            session.plan(change)
            times[name].append(1e3 * (time.perf_counter() - began))
        began = time.perf_counter()
        taken, banned = what_is_forbidden(seen, last)
        arrival.add(textbook(free.tolist(), left, start, goal, taken, banned, last))
        times["textbook"].append(1e3 * (time.perf_counter() - began))
    assert len(arrival) == 1, f"they arrive at {sorted(arrival)}"
    middle = {name: statistics.median(t) for name, t in times.items()}
    return {
        "size": size,
        "blocked": share,
        "obstacles": count,
        "arrival": arrival.pop(),
        "first_ms": 1e3 * opened,
        "ms": middle,
        "expansions": {name: n for name, (_, n) in sessions.items()},
        "search_ms": {name: statistics.median(t) for name, t in alone.items()},
        "ratio": {name: middle[name] / middle["sipp"] for name in middle},
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--json", type=Path, help="write the figures there")
    given = parser.parse_args()
    rows = []
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}")
    print("map         obstacles  arrival    sipp ms  space-time A* ms (ratio)  textbook ms (ratio)")
    for size, share, count in ((128, 0.1, 50), (512, 0.1, 200), (512, 0.3, 200)):
        row = measure(size, share, count, 3 if given.quick else 9)
        rows.append(row)
        ms, ratio = row["ms"], row["ratio"]
        print(
            f"{size:4d}^2 {share:4.0%}  {count:8d} {row['arrival']:8d} {ms['sipp']:10.2f}"
            f" {ms['space-time-astar']:14.2f} ({ratio['space-time-astar']:.1f})"
            f" {ms['textbook']:18.1f} ({ratio['textbook']:.1f})"
        )
        bare = row["search_ms"]
        told = ", ".join(f"{name} {t:.2f} ({t / bare['sipp']:.1f})" for name, t in bare.items())
        print(f"            the search alone, ms (ratio): {told}")
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
