"""The mended field and D* Lite after k cells changed, beside solving from scratch by our own fast field.

    python -m benchmarks.bench_repair [--quick] [--json FILE]

What is timed
-------------
* mend: ``Mender.mend``, the whole public call, cells in a list; cost, parents and luciferin of every cell.
* solve: ``lampyris.field.solve.solve`` of the changed map, the rival of the former and equal to it.
* D* Lite: ``session.plan(change)``, the whole public call, path included.
* to robot: ``solve(..., stop=robot)``, the field as far as the robot, and
* A*: ``session.plan(change)`` of ``astar``: two ways to the same path from scratch; what D* Lite is held
  against is the quicker of them. (In clutter and mazes that is the field, in the open A*.)

Random maps, 10 % blocked, the goal in the middle, the robot half-way to a corner. Each round blocks k free
cells and frees them again, and both are counted: near the robot (within some cells of it), far (as far on the
other side of the goal, where the robot does not go) or anywhere. All answers are checked against each other.

Contestants take turns, and each makes the change, and takes it back, once untimed just before: what it works
on is in the caches, for all alike. (Right after somebody else has filled them, mending one cell of 512 x 512
takes several times as long.) Times are of this thread's processor time, the middle of all rounds.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.bench_field import machine, middle, random_map

from lampyris.field.repair import Mender
from lampyris.field.solve import solve
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.scene import Scene
from lampyris.planners.astar import AStar
from lampyris.planners.dstar_lite import DStarLite

Cells = list[tuple[int, int]]
WHO = ("mend", "solve", "D* Lite", "to robot", "A*")


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """A call's result and the microseconds it took."""
    begin = time.thread_time_ns()
    result = call()
    return result, (time.thread_time_ns() - begin) / 1e3


class Bench:
    """One map, everybody on it, and the places where it changes."""

    def __init__(self, size: int, moves: Moves) -> None:
        free = random_map(size, 0.1)
        self.goal = middle(free)
        self.robot = self._nearest(free, size // 4, size // 4)
        self.moves = moves
        self.mender = Mender(free, moves, self.goal)
        scene = Scene(Grid(~free), self.robot, self.goal, moves)
        rng = np.random.default_rng(0)
        self.sessions = {"D* Lite": DStarLite().open(scene, rng), "A*": AStar().open(scene, rng)}
        for session in self.sessions.values():
            session.plan()
        self.free = free
        self.centres = {"near": self.robot, "far": self._nearest(free, size - size // 4, size - size // 4)}

    @staticmethod
    def _nearest(free: np.ndarray, x: int, y: int) -> tuple[int, int]:
        ys, xs = np.nonzero(free)
        k = int(np.argmin((ys - y) ** 2 + (xs - x) ** 2))
        return int(xs[k]), int(ys[k])

    def pick(self, k: int, place: str, rng: np.random.Generator) -> Cells:
        """k free cells, neither the robot's nor the goal."""
        allowed = self.free.copy()
        if place != "anywhere":
            # A square around the place with about five times as many cells.
            x, y = self.centres[place]
            reach = 2 + int(np.sqrt(5 * k) / 2)
            near = np.zeros_like(allowed)
            near[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = True
            allowed &= near
        for x, y in (self.robot, self.goal):
            allowed[y, x] = False
        ys, xs = np.nonzero(allowed)
        chosen = rng.choice(len(xs), min(k, len(xs)), replace=False)
        return [(int(xs[i]), int(ys[i])) for i in chosen]

    def round(self, cells: Cells) -> dict[str, float]:
        """Block the cells and free them again: microseconds of a change, the mean of the two."""
        closed = self.free.copy()
        for x, y in cells:
            closed[y, x] = False
        maps = [closed, self.free.copy()]
        for free in maps:
            free.setflags(write=False)
        changes = [Change(blocked=tuple(cells)), Change(freed=tuple(cells))]
        solving = [partial(solve, free, self.moves, self.goal) for free in maps]
        calls: dict[str, list[Callable[[], Any]]] = {
            "mend": [partial(self.mender.mend, blocked=cells), partial(self.mender.mend, freed=cells)],
            "solve": list(solving),
            "to robot": [partial(call, stop=self.robot) for call in solving],
        }
        for who, session in self.sessions.items():
            calls[who] = [partial(session.plan, change) for change in changes]
        spent = {}
        for who, pair in calls.items():
            for call in pair:
                call()
            spent[who] = sum(timed(call)[1] for call in pair) / 2
        self._check([[call() for call in pair] for pair in zip(*calls.values(), strict=True)])
        return spent

    def _check(self, answers: list[list[Any]]) -> None:
        x, y = self.robot
        for mended, solved, part, *plans in answers:
            for what in ("exact", "step", "luciferin"):
                # The later of the two mends has written over the earlier.
                if mended is answers[-1][0]:
                    np.testing.assert_array_equal(getattr(mended, what), getattr(solved, what))
            best = int(solved.exact[y, x])
            assert best == int(part.exact[y, x])
            for plan in plans:
                assert (plan.path.exact if plan else -1) == best, (plan.planner, plan.status)


def run(quick: bool) -> list[dict[str, Any]]:
    """Every size, place and number of cells; prints a line for each as it is done."""
    print(
        f"{'map':<20}{'cells changed':<20}"
        + "".join(f"{who:>12}" for who in WHO)
        + "   microseconds a change"
    )
    rows = []
    for size in (50, 512) if quick else (50, 128, 512, 1024, 2048):
        for kind in ("octile",) if quick else ("dissertation", "octile"):
            bench = Bench(size, MOVES[kind])
            rng = np.random.default_rng(size)
            for _ in range(20 if size <= 128 else 2):
                bench.round(bench.pick(1, "anywhere", rng))  # everything compiled, everything touched once
            for place in ("near", "far", "anywhere"):
                for k in (1, 10, 100, 1000):
                    rounds = (9 if quick else 25) if size <= 128 else 9 if size <= 512 else 5
                    before = bench.mender.solved
                    times = [bench.round(bench.pick(k, place, rng)) for _ in range(rounds)]
                    us = {who: statistics.median(t[who] for t in times) for who in WHO}
                    anew = (bench.mender.solved - before) / (6 * rounds)
                    rows.append(
                        {"size": size, "moves": kind, "place": place, "k": k, "us": us, "solved_anew": anew}
                    )
                    print(line(rows[-1]), flush=True)
    return rows


def line(row: dict[str, Any]) -> str:
    """One row for people."""
    us = row["us"]
    text = f"{row['size']:>4} {row['moves']:<15}{row['k']:>5} {row['place']:<14}"
    text += "".join(f"{us[who]:12.1f}" for who in WHO)
    gave_up = f"  ({row['solved_anew']:.0%} solved anew)" if row["solved_anew"] else ""
    return text + f"   mend {gain(row, 'mend'):6.1f} x, D* Lite {gain(row, 'D* Lite'):6.1f} x" + gave_up


def gain(row: dict[str, Any], who: str) -> float:
    """How many times as long it takes from scratch."""
    us = row["us"]
    rival = us["solve"] if who == "mend" else min(us["to robot"], us["A*"])
    return float(rival / us[who])


def verdicts(rows: list[dict[str, Any]]) -> list[str]:
    """Where repair gains and, above all, where it loses."""
    out = []
    for who in ("mend", "D* Lite"):
        rival = "solving anew" if who == "mend" else "the quicker of A* and the field to the robot"
        for k in (1, 10, 100, 1000):
            mine = [r for r in rows if r["k"] == k]
            gains = [gain(r, who) for r in mine]
            lost = [
                f"{r['size']} {r['moves']} {r['place']} ({gain(r, who):.2f})"
                for r in mine
                if gain(r, who) < 1
            ]
            text = f"{who}, {k} cells: {min(gains):.2f} to {max(gains):.0f} times as quick as {rival}, "
            out.append(
                text
                + f"middle {statistics.median(gains):.1f}"
                + (f"; LOSES on {', '.join(lost)}" if lost else "")
            )
    return out


def main() -> int:
    """Run, print, judge. The exit code is 0 whatever comes out: a benchmark informs, it does not gate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two sizes, octile moves, fewer rounds")
    parser.add_argument("--json", metavar="FILE", help="write everything there")
    args = parser.parse_args()
    about = machine()
    print(", ".join(f"{k} {v}" for k, v in about.items()))
    rows = run(args.quick)
    judged = verdicts(rows)
    print("\n".join(judged))
    if args.json:
        report = {"machine": about, "rows": rows, "verdicts": judged}
        Path(args.json).write_text(json.dumps(report, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
