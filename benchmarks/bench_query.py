"""One query after another on one map: jump point search beside our other searches and what people use today.

    python -m benchmarks.bench_query [--quick] [--maps FOLDER] [--json FILE]

The maps and queries are MovingAI's (N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE TCIAIG
4(2), 2012); they are not part of the project. Without --maps they are looked for in maps/movingai of the
folder that LAMPYRIS_SHARED names, or of a folder "shared" beside the project.

What is timed, a query, path included
-------------------------------------
* jps: ``JumpSearch.way``: the search and the path's cells. Packing the map into bits comes before, once for
  a map, and is told apart.
* jps plan: ``session.plan(Change(robot=start))`` of the planner ``jps``: the same in a whole public call,
  with its checks and its Plan.
* astar, both ends: the searches of ``astar`` and ``bidirectional-astar``.
* field: ``lampyris.field.solve.solve(free, moves, goal, stop=start)``, without a path.
* fastest: the search that the planner ``fastest`` picks for the map.
* theta, lazy: the searches of ``theta-star`` and ``lazy-theta-star``, which find other, shorter ways.
* nano-astar: ``nano_astar.astar(grid, start, goal)``: the same rules; its lengths are checked, too.
* tcod: ``tcod.path.AStar(cost, 1.41).get_path``; cuts corners; the object is made outside the timing.
* scikit-image: ``skimage.graph.route_through_array``, fully connected, geometric; cuts corners.

Everybody answers the queries of a map one after the other, round after round, so that each works with the
caches that it has filled itself. Times are of this thread's processor time; of each query the middle of
its rounds counts; ratios are geometric means over queries.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.bench_field import machine, maze, random_map

from lampyris.api import load_grid
from lampyris.field.solve import solve
from lampyris.maps.movingai import read_scen
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planners._any_angle import AnyAngleSearch
from lampyris.planners._bidirectional import TwoSearches
from lampyris.planners._fastest import suited
from lampyris.planners._graph import GridSearch
from lampyris.planners._jps import JumpSearch, PackedMap
from lampyris.planners.jps import JumpPointSearch

MAPS = ("arena2", "AR0011SR", "Berlin_0_256", "16room_000", "ht_0_hightown", "maze512-32-0", "random512-10-0")
OURS = ("jps", "jps plan", "astar", "both ends", "field", "fastest", "theta", "lazy")
RIVALS = ("nano-astar", "tcod", "scikit-image")
SAME_RULES = ("jps", "jps plan", "astar", "both ends", "fastest", "nano-astar")
"""Whose lengths must be the published ones."""
LEAST = 30.0
"""Jump point search shall be so many times as quick as nano-astar, in geometric mean over the queries."""

Cell = tuple[int, int]
Query = tuple[Cell, Cell, float, float]
"""Start, goal, length, and how far off the length may be."""


def folder_of(given: str | None) -> Path | None:
    """Where the maps are, or None."""
    root = Path(__file__).resolve().parents[1]
    shared = Path(os.environ.get("LAMPYRIS_SHARED") or root.parent / "shared")
    folder = Path(given) if given else shared / "maps" / "movingai"
    return folder if folder.is_dir() else None


def published(folder: Path, name: str, count: int) -> tuple[np.ndarray, list[Query]]:
    """A map's free cells and ``count`` of its queries, evenly spread over the lengths."""
    free = ~load_grid(folder / f"{name}.map").blocked
    lines = read_scen(folder / f"{name}.map.scen")
    chosen = [lines[k] for k in np.linspace(0, len(lines) - 1, min(count, len(lines))).astype(int)]
    return free, [(q.start, q.goal, q.length, max(1e-5 * q.length, 0.5 * 10.0**-q.decimals)) for q in chosen]


def made(free: np.ndarray, count: int) -> tuple[np.ndarray, list[Query]]:
    """``count`` queries between random cells of a map that can reach each other; lengths by our own A*."""
    rng = np.random.default_rng(free.shape[0])
    search = GridSearch(free, MOVES["octile"], informed=True)
    cells = np.argwhere(free)
    queries: list[Query] = []
    while len(queries) < count:
        (sy, sx), (gy, gx) = cells[rng.integers(len(cells), size=2)].tolist()
        answer = search.way((sx, sy), (gx, gy))
        if answer.cells is not None:
            queries.append(((sx, sy), (gx, gy), length_of(answer.cells), 1e-6))
    return free, queries


def length_of(cells: Any) -> float:
    """Length of a walk, or of straight lines, in cells."""
    d = np.diff(np.asarray(cells, dtype=np.float64), axis=0)
    return float(np.sqrt((d**2).sum(axis=1)).sum())


class Contest:
    """Everybody on one map."""

    def __init__(self, free: np.ndarray) -> None:
        import tcod.path

        moves = MOVES["octile"]
        begin = time.perf_counter()
        PackedMap(free, moves.corner_cutting)
        self.pack_ms = (time.perf_counter() - begin) * 1e3
        self._free = free
        self._grid = Grid(~free)
        self._ways = {
            "jps": JumpSearch(free, moves).way,
            "astar": GridSearch(free, moves, informed=True).way,
            "both ends": TwoSearches(free, moves).way,
            "fastest": suited(free, None, moves).way,
            "theta": AnyAngleSearch(free, None, moves, wide=False, lazy=0).way,
            "lazy": AnyAngleSearch(free, None, moves, wide=False, lazy=2).way,
        }
        self._walls = np.ascontiguousarray(~free).view(np.uint8)
        self._prices = np.where(free, 1.0, -1.0)
        self._tcod = tcod.path.AStar(free.astype(np.int8), 1.41)

    def call(self, who: str, start: Cell, goal: Cell) -> Callable[[], Any]:
        """Somebody's search for one query; called, it answers with cells x, y, or with a field."""
        if who in self._ways:
            return partial(self._ways[who], start, goal)
        if who == "jps plan":
            session = JumpPointSearch().open(Scene(self._grid, start, goal), np.random.default_rng(0))
            session.plan()
            return partial(session.plan, Change(robot=start))
        if who == "field":
            return partial(solve, self._free, MOVES["octile"], goal, stop=start)
        if who == "nano-astar":
            import nano_astar

            return partial(nano_astar.astar, self._walls, start[::-1], goal[::-1])
        if who == "tcod":
            return partial(self._tcod.get_path, start[1], start[0], goal[1], goal[0])
        from skimage.graph import route_through_array

        return partial(route_through_array, self._prices, start[::-1], goal[::-1], fully_connected=True)

    @staticmethod
    def length(who: str, answer: Any) -> float:
        """Length of an answer; -1: no way."""
        if who == "nano-astar":
            return -1.0 if answer is None else length_of(answer[0])
        cells = answer.waypoints if who in ("theta", "lazy") else answer.cells
        return -1.0 if cells is None else length_of(cells)


def measure(contest: Contest, queries: list[Query], rounds: int) -> tuple[dict[str, list[float]], list[str]]:
    """Microseconds of each query (the middle of the rounds) by contestant, and every wrong length."""
    times: dict[str, list[float]] = {}
    wrong = []
    for who in (*OURS, *RIVALS):
        mine: list[list[float]] = [[] for _ in queries]
        # The first round warms up, and is checked.
        for k in range(rounds + 1):
            for spent, (start, goal, length, off) in zip(mine, queries, strict=True):
                call = contest.call(who, start, goal)
                begin = time.thread_time_ns()
                answer = call()
                took = (time.thread_time_ns() - begin) / 1e3
                if k > 0:
                    spent.append(took)
                elif who in SAME_RULES and abs(contest.length(who, answer) - length) > off:
                    wrong.append(f"{who}: {start} to {goal} {contest.length(who, answer)!r}, not {length!r}")
                elif who in ("theta", "lazy") and contest.length(who, answer) > length + off:
                    wrong.append(f"{who}: {start} to {goal} is longer than the walk")
        times[who] = [statistics.median(spent) for spent in mine]
    return times, wrong


def ratio(times: dict[str, list[float]], who: str, over: str) -> float:
    """Geometric mean over queries of somebody's time as a multiple of another's."""
    pairs = zip(times[who], times[over], strict=True)
    return math.exp(statistics.fmean(math.log(a / b) for a, b in pairs))


def run(folder: Path | None, quick: bool) -> list[dict[str, Any]]:
    """Every map; prints a line for each as it is done."""
    maps: dict[str, tuple[np.ndarray, list[Query]]] = {}
    count, rounds = (12, 1) if quick else (40, 3)
    if folder is not None:
        maps |= {name: published(folder, name, count) for name in (MAPS[:3] if quick else MAPS)}
    size = 256 if quick else 512
    maps["made: random 35 %"] = made(random_map(size, 0.35), count)
    maps["made: maze, corridor 1"] = made(maze(size), count)
    print("median microseconds a query, and in brackets its geometric mean as a multiple of jps")
    print(f"{'map':<24}{'packing':>10}  " + "".join(f"{who:<18}" for who in (*OURS, *RIVALS)))
    rows = []
    for name, (free, queries) in maps.items():
        contest = Contest(free)
        times, wrong = measure(contest, queries, rounds)
        rows.append({"map": name, "pack_ms": contest.pack_ms, "us": times, "wrong": wrong})
        print(line(rows[-1]), flush=True)
    return rows


def line(row: dict[str, Any]) -> str:
    """One row for people."""
    times = row["us"]
    text = f"{row['map']:<24}{row['pack_ms']:7.2f} ms  "
    for who in (*OURS, *RIVALS):
        told = f"{statistics.median(times[who]):.1f}"
        text += (told if who == "jps" else f"{told} ({ratio(times, who, 'jps'):.3g})").ljust(18)
    return text


def verdicts(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The acceptance claims, one line each."""
    out = []
    wrong = [f"{r['map']}: {w}" for r in rows for w in r["wrong"]]
    told = f"lengths: {len(wrong)} wrong of {sum(len(r['us']['jps']) for r in rows)} queries"
    out.append({"claim": "lengths", "holds": not wrong, "text": "; ".join([told, *wrong[:5]])})
    for kind in ("published", "made"):
        mine = [r for r in rows if r["map"].startswith("made") == (kind == "made")]
        if not mine:
            continue
        times = {who: [t for r in mine for t in r["us"][who]] for who in (*OURS, *RIVALS)}
        for rival in ("nano-astar", "astar", "field", "tcod", "scikit-image"):
            mean = ratio(times, rival, "jps")
            each = [ratio(r["us"], rival, "jps") for r in mine]
            text = f"{kind} maps: jps {mean:.3g} times as quick as {rival}"
            text += f" ({min(each):.3g} to {max(each):.3g} by map)"
            holds = mean >= (LEAST if kind == "published" and rival == "nano-astar" else 0.0)
            out.append({"claim": f"{kind} {rival}", "holds": holds, "text": text})
    return out


def main() -> int:
    """Run, print, judge. The exit code is 0 whatever the verdicts: a benchmark informs, it does not gate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer maps, queries and rounds")
    parser.add_argument("--maps", metavar="FOLDER", help="MovingAI's .map and .map.scen files")
    parser.add_argument("--json", metavar="FILE", help="write everything there")
    args = parser.parse_args()
    about = {**machine(), "nano-astar": version("nano-astar")}
    print(", ".join(f"{k} {v}" for k, v in about.items()))
    folder = folder_of(args.maps)
    if folder is None:
        print("MovingAI's maps are not here (--maps FOLDER): only maps made for the purpose are measured")
    rows = run(folder, args.quick)
    judged = verdicts(rows)
    for v in judged:
        print(("HOLDS  " if v["holds"] else "SHORT  ") + v["text"])
    if args.json:
        Path(args.json).write_text(
            json.dumps({"machine": about, "rows": rows, "verdicts": judged}, indent=1) + "\n"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
