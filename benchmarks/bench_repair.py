"""The repaired field and D* Lite after k cells changed, compared with solving from scratch by our own fast field."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.maps import middle, random_map
from benchmarks.motion_planning import DStarLite as TheirDStarLite

from lampyris.kernels._jit import prefer_compiled
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import solve
from lampyris.planning.graph.astar import AStar
from lampyris.planning.incremental.dstar_lite import DStarLite

TITLE = "Replanning"
HOW = """What a change of k cells takes, in microseconds of this thread's processor time:

- repair: `FieldRepairer.repair`, the whole public call, cells in a list; cost, parents and luciferin of every cell.
- solve: `lampyris.planning.field.solve.solve` of the changed map, the rival of the former and equal to it.
- D* Lite: `session.plan(change)`, the whole public call, path included.
- to robot: `solve(..., stop=robot)`, the field as far as the robot, and
- A*: `session.plan(change)` of `astar`: two ways to the same path from scratch; D* Lite is compared with the
  quicker of them. (In clutter and mazes that is the field, in the open A*.)

Random maps, 10 % blocked, the goal in the middle, the robot half-way to a corner. Each round blocks k free
cells and frees them again, and the mean of both counts: near the robot (within some cells of it), far (as
far on the other side of the goal, where the robot does not go) or anywhere. After each of the two changes all
answers are checked against each other, the whole field of them.

Cold: just before every call, ours or rival, another field of {other} x {other} cells is solved, as in a
program that does something else between two changes; the claims and the ratios of the first table are of
this. Warm: each has just made the same change and reverted it, so that its data are in the caches. Repairing
touches little and gains most by that, many times over for one cell.

Where repair loses, the table says so. On 50 x 50 little is to be had: the whole field is solved in the time
that a few dozen cells take to repair, D* Lite is the slower way even for one cell, and cold all of them mostly
wait for memory. On large maps repair loses from some hundreds of scattered cells on. `FieldRepairer` sees that
coming and solves anew; D* Lite, which does not, then takes longer than A* would.

The rivals are our own, but for one: python-motion-planning 1.1.1 has a D* Lite in plain Python (later
releases have none), by our rules. It stands on a small map alone, for it looks through its whole list of open
cells for each that it takes; it is given a cell as its own handler of mouse clicks does it, and wrong paths
of it are counted, not repaired. Its picture of the map is not drawn, nor counted."""

OTHER = 1024
"""Cells a side of the map of the other field."""
WHO = ("repair", "solve", "D* Lite", "to robot", "A*")
ASKED = {50: 1.0, 128: 3.0, 512: 30.0, 1024: 40.0, 2048: 60.0}
"""How many times as quick as solving anew repairing one cell anywhere shall be, by size of the map."""
ASKED_OF_PATHS = {1024: 2.0, 2048: 4.0}
"""The same of D* Lite's path and the quicker of A* and the field to the robot."""
Cells = list[tuple[int, int]]


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """A call's result and the microseconds it took."""
    begin = time.thread_time_ns()
    result = call()
    return result, (time.thread_time_ns() - begin) / 1e3


def other_field() -> Callable[[], Any]:
    """Something else to do, that leaves nothing of ours in the caches."""
    free = random_map(OTHER, 0.1)
    free.setflags(write=False)
    return partial(solve, free, MOVES["octile"], middle(free))


class Bench:
    """One map, everybody on it, and the places where it changes."""

    def __init__(self, size: int, moves: Moves) -> None:
        free = random_map(size, 0.1)
        self.goal = middle(free)
        self.robot = self._nearest(free, size // 4, size // 4)
        self.moves = moves
        self.repairer = FieldRepairer(free, moves, self.goal)
        scene = Scene(Grid(~free), self.robot, self.goal, moves)
        rng = np.random.default_rng(0)
        self.sessions = {"D* Lite": DStarLite().open(scene, rng), "A*": AStar().open(scene, rng)}
        for session in self.sessions.values():
            session.plan()
        self.free = free
        self.centres = {"near": self.robot, "far": self._nearest(free, size - size // 4, size - size // 4)}
        self._between = other_field()

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

    def calls(self, cells: Cells) -> dict[str, list[Callable[[], Any]]]:
        """Of everybody the call after the cells are blocked, and the call after they are freed again."""
        closed = self.free.copy()
        for x, y in cells:
            closed[y, x] = False
        maps = [closed, self.free.copy()]
        for free in maps:
            free.setflags(write=False)
        changes = [Change(blocked=tuple(cells)), Change(freed=tuple(cells))]
        solving = [partial(solve, free, self.moves, self.goal) for free in maps]
        calls: dict[str, list[Callable[[], Any]]] = {
            "repair": [
                partial(self.repairer.repair, blocked=cells),
                partial(self.repairer.repair, freed=cells),
            ],
            "solve": list(solving),
            "to robot": [partial(call, stop=self.robot) for call in solving],
        }
        for who, session in self.sessions.items():
            calls[who] = [partial(session.plan, change) for change in changes]
        return calls

    def round(self, cells: Cells) -> dict[str, float]:
        """Block the cells and free them again, everything warm: microseconds of a change, the mean of both.

        Raises
        ------
        AssertionError : after one of the two changes somebody's answer is another.
        """
        calls = self.calls(cells)
        spent = {}
        for who, pair in calls.items():
            for call in pair:
                call()
            spent[who] = sum(timed(call)[1] for call in pair) / 2
        # What is repaired is written over by the next repair: each change is checked before the next is made.
        for answers in zip(*calls.values(), strict=True):
            self._check([call() for call in answers])
        return spent

    def cold(self, cells: Cells) -> dict[str, float]:
        """The same with another field solved just before every call."""
        spent = {}
        for who, pair in self.calls(cells).items():
            spent[who] = 0.0
            for call in pair:
                self._between()
                spent[who] += timed(call)[1] / 2
        return spent

    def _check(self, answers: list[Any]) -> None:
        x, y = self.robot
        repaired, solved, part, *plans = answers
        for what in ("exact", "step", "luciferin"):
            np.testing.assert_array_equal(getattr(repaired, what), getattr(solved, what))
        best = int(solved.exact[y, x])
        assert best == int(part.exact[y, x])
        for plan in plans:
            assert (plan.path.exact if plan else -1) == best, (plan.planner, plan.status)


@dataclass(frozen=True, slots=True)
class Row:
    """Times of one size, place and number of cells."""

    size: int
    moves: str
    place: str
    k: int
    cold: dict[str, Spread]
    warm: dict[str, Spread]
    anew: float

    def figures(self) -> Iterator[Figure]:
        """Repairing compared with solving, D* Lite compared with the quicker way from scratch: cold, then warm."""
        task = f"{self.size} {self.moves}, {self.k} {self.place}"
        one = self.k == 1 and self.place == "anywhere"
        for how, us in (("cold", self.cold), ("warm", self.warm)):
            claimed = one and how == "cold"
            yield Figure(
                f"repair, {task}, {how}", "us a change", us["repair"], "solving anew", us["solve"],
                asked=ASKED.get(self.size) if claimed else None,
            )  # fmt: skip
            # There are two ways to a path from scratch; the quicker counts.
            scratch = min((us["to robot"], us["A*"]), key=lambda s: s.middle)
            yield Figure(
                f"D* Lite, {task}, {how}", "us a change", us["D* Lite"], "the quicker path from scratch",
                scratch, asked=ASKED_OF_PATHS.get(self.size) if claimed else None,
            )  # fmt: skip


def bench(quick: bool) -> Section:
    """Every size, place and number of cells; then the D* Lite of somebody else."""
    prefer_compiled()
    rows = list(_rows(quick))
    figures = [f for row in rows for f in row.figures()]
    tables = (_table(rows, "cold"), _table(rows, "warm"), _theirs(figures, quick))
    verdicts = _verdicts(figures)
    about = versions(["numpy", "numba", "python-motion-planning"])
    how = HOW.format(other=OTHER)
    return Section("repair", TITLE, how, tables, tuple(figures), tuple(verdicts), about)


def _rows(quick: bool) -> Iterator[Row]:
    for size in (50, 512) if quick else (50, 128, 512, 1024, 2048):
        for kind in ("octile",) if quick else ("dissertation", "octile"):
            bench = Bench(size, MOVES[kind])
            rng = np.random.default_rng(size)
            for _ in range(20 if size <= 128 else 2):
                bench.round(bench.pick(1, "anywhere", rng))  # everything compiled, everything touched once
            for place in ("near", "anywhere") if quick else ("near", "far", "anywhere"):
                for k in (1, 100) if quick else (1, 10, 100, 1000):
                    rounds = (9 if quick else 25) if size <= 128 else 9 if size <= 512 else 5
                    before = bench.repairer.solved
                    warm = [bench.round(bench.pick(k, place, rng)) for _ in range(rounds)]
                    anew = (bench.repairer.solved - before) / (6 * rounds)
                    cold = [
                        bench.cold(bench.pick(k, place, rng)) for _ in range(3 if quick else min(9, rounds))
                    ]
                    yield Row(size, kind, place, k, _spreads(cold), _spreads(warm), anew)


def _spreads(times: list[dict[str, float]]) -> dict[str, Spread]:
    return {who: Spread.of([t[who] for t in times]) for who in WHO}


def _table(rows: list[Row], how: str) -> Table:
    out = []
    for row in rows:
        repair, path = (f.ratio for f in row.figures() if f.task.endswith(how))
        us = row.cold if how == "cold" else row.warm
        told = f"{row.size} x {row.size}", row.moves, str(row.k), row.place
        gains = (
            f"{ratio:.1f} x" if ratio >= 1 else f"**loses, {ratio:.2f} x**"
            for ratio in (repair, path)
            if ratio
        )
        out.append((*told, *(f"{us[who].middle:.1f}" for who in WHO), *gains, f"{row.anew:.0%}"))
    heads = (
        "map",
        "moves",
        "cells",
        "where",
        *WHO,
        "repair / solve",
        "D* Lite / scratch",
        "repaired by solving",
    )
    return Table(heads, tuple(out), f"Microseconds a change, 10 % blocked, {how}")


def _theirs(figures: list[Figure], quick: bool) -> Table:
    """Our D* Lite and the one of python-motion-planning, one cell anywhere of a small map."""
    size, rounds = (32, 5) if quick else (50, 25)
    free = random_map(size, 0.1)
    bench, rng = Bench(size, MOVES["octile"]), np.random.default_rng(size)
    session = bench.sessions["D* Lite"]
    theirs = TheirDStarLite(free, bench.robot, bench.goal)
    theirs.plan()
    us: dict[str, list[float]] = {"ours": [], "theirs": []}
    wrong = 0
    for k in range(rounds + 1):
        cells = bench.pick(1, "anywhere", rng)
        for mine, told in ((Change(blocked=tuple(cells)), "blocked"), (Change(freed=tuple(cells)), "freed")):
            plan, spent = timed(partial(session.plan, mine))
            length, took = timed(partial(theirs.plan, **{told: cells}))
            wrong += abs(length - (plan.path.cost if plan.path else np.inf)) > 1e-6
            if k:  # the first round warms up
                us["ours"].append(spent)
                us["theirs"].append(took)
    made = Figure(
        f"D* Lite, {size} octile, theirs", "us a change", Spread.of(us["ours"]), "python-motion-planning",
        Spread.of(us["theirs"]), note=f"its path was wrong {wrong} times of {2 * (rounds + 1)}",
    )  # fmt: skip
    figures.append(made)
    assert made.theirs is not None
    row = (f"{size} x {size}", f"{made.ours.middle:.1f}", f"{made.theirs.middle:.1f}", f"{made.ratio:.0f} x")
    heads = ("map", "our D* Lite, us", "python-motion-planning 1.1.1, us", "theirs / ours", "its wrong paths")
    wrongs = f"{wrong} of {2 * (rounds + 1)}"
    return Table(
        heads, ((*row, wrongs),), "One cell anywhere, compared with another implementation of D* Lite, warm"
    )


def _verdicts(figures: list[Figure]) -> list[Verdict]:
    out = []
    for what, rival in (("repair", "solving anew"), ("D* Lite", "the quicker path from scratch")):
        for f in figures:
            if f.asked is not None and f.task.startswith(what) and f.ratio is not None:
                text = f"{f.task}: at least {f.asked:g} times as quick as {rival}: {f.ratio:.1f}"
                out.append(Verdict(bool(f.holds), text))
        gains = {k: _gains(figures, what, k) for k in (1, 10, 100, 1000)}
        lost = [f"{k} cells at {', '.join(sizes)}" for k, (_, sizes) in gains.items() if sizes]
        text = (
            f"{what} with one cell changed, cold, never loses against {rival} on maps of 512 x 512 and more"
        )
        text += f" (middle of all: {gains[1][0]:.1f} times as quick)"
        loses_big = [size for size in gains[1][1] if int(size) >= 512]
        out.append(Verdict(not loses_big, text + (f"; it loses with {'; '.join(lost)}" if lost else "")))
    return out


def _gains(figures: list[Figure], what: str, k: int) -> tuple[float, list[str]]:
    """The middle gain with k cells changed, cold, and the sizes of maps where it is a loss somewhere."""
    mine = [
        f for f in figures
        if f.task.startswith(what) and f.task.endswith("cold") and f", {k} " in f.task and f.ratio
    ]  # fmt: skip
    if not mine:
        return 1.0, []
    sizes = {f.task.split(", ")[1].split()[0] for f in mine if (f.ratio or 1) < 1}
    return statistics.median(f.ratio or 1 for f in mine), sorted(sizes, key=int)
