"""How what things take grows: with cells, moving obstacles, changed cells and the length of a way."""

from __future__ import annotations

import gc
import io
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.about import versions
from benchmarks.bench_timed import walks
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.maps import middle, random_map

import lampyris
from lampyris import referee
from lampyris.io.maps.load import load_map
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning.field import gates, layers
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import solve, solve_field
from lampyris.planning.incremental.dstar_lite import DStarLite
from lampyris.planning.spacetime.sipp import Sipp
from lampyris.report.pictures.plan_picture import draw_plan

TITLE = "Scaling"
HOW = """What each thing takes, in this thread's processor time, at growing sizes, and the slope of a straight
line through the logarithms with its standard error (least squares; R2 is the share of the spread that it
explains); then the slope from each size to the next. 1 is proportional. n log n shows as up to {said:g} over
such ranges, and maps that outgrow a cache after the other as up to {most:g}: what is above {said:g} is
explained in the table, and what is above {most:g} and is not explained is judged worse than n log n.

Maps are random, 10 % blocked, the ends in opposite corners; for the length of a way they are strips 64 cells
high. Everything is past the referee where the public call has it so. Code compiled; each the middle of
several.

Where nothing is asked of the whole map the slope is below 1. Swarm planners look at a share of the map for
each individual and iteration; how often is their settings', not the map's."""
MOST = 1.3
SAID = 1.1
"""What grows faster has its reason in the table."""
OUTGROWS = "1 while the arrays fit a cache; the steps from 512 x 512 on leave it"
Call = Callable[[], Any]
Make = Callable[[int], Call]


@dataclass(frozen=True, slots=True)
class Series:
    """One thing at several sizes.

    Parameters
    ----------
    name : of the thing.
    of : what grows: ``cells``, ``obstacles``, ``changed cells`` or ``cells of the way``.
    sizes, quick : what ``make`` is asked for: at length, and with --quick.
    make : from a size to the call that is timed; what it prepares is not.
    amount : from a size to how many of ``of`` that is.
    why : where it grows faster, the reason.
    times : from a size to how often the call does it.
    """

    name: str
    of: str
    sizes: tuple[int, ...]
    quick: tuple[int, ...]
    make: Make
    amount: Callable[[int], int] = lambda size: size
    why: str = ""
    times: Callable[[int], int] = lambda size: 1


def bench(quick: bool) -> Section:
    """Every series; a verdict for each kind."""
    prefer_compiled()
    figures, rows = [], []
    steep: dict[str, list[tuple[str, float]]] = {}
    told: dict[str, str] = {}
    for series in everything():
        sizes = series.quick if quick else series.sizes
        if not sizes:
            continue
        amounts, took = measured(series, sizes, 0.04 if quick else 0.6)
        slope, error, fit = line(amounts, took)
        spread = Spread(slope, slope - error, slope + error, len(amounts))
        figures.append(Figure(f"{series.name}, by {series.of}", "slope", spread))
        steep.setdefault(series.of, []).append((series.name, slope))
        told[series.name] = series.why
        each = took[-1] / amounts[-1] * 1e9
        rows.append(
            (
                series.name, series.of, f"{amounts[0]:,} to {amounts[-1]:,}", f"{slope:.2f} +- {error:.2f}",
                f"{fit:.3f}", steps(amounts, took), f"{took[-1] * 1e3:.3g}", f"{each:,.0f}",
                (series.why or "not known") if slope > SAID else "",
            )
        )  # fmt: skip
    heads = (
        "what", "by", "range", "slope", "R2", "from size to size", "ms at the end", "ns for each",
        f"why, above {SAID:g}",
    )  # fmt: skip
    verdicts = [_verdict(of, slopes, told) for of, slopes in steep.items()]
    return Section(
        "scaling", TITLE, HOW.format(most=MOST, said=SAID), (Table(heads, tuple(rows)),), tuple(figures),
        tuple(verdicts), versions(["numpy", "numba"]),
    )  # fmt: skip


def _verdict(of: str, slopes: Sequence[tuple[str, float]], told: dict[str, str]) -> Verdict:
    over = [(name, slope) for name, slope in slopes if slope > MOST]
    unsaid = [name for name, _ in over if not told[name]]
    text = f"by {of}: slopes {min(s for _, s in slopes):.2f} to {max(s for _, s in slopes):.2f}; "
    text += f"{len(slopes) - len(over)} of {len(slopes)} at most {MOST:g}"
    if over:
        text += ", the others explained: " if not unsaid else ", worse: "
        text += ", ".join(f"{name} {slope:.2f}" for name, slope in over)
    return Verdict(not unsaid, text)


def measured(series: Series, sizes: Sequence[int], share: float) -> tuple[list[int], list[float]]:
    """Amounts, and seconds of each: the middle of as many calls as ``share`` seconds have room for."""
    amounts, took = [], []
    for size in sizes:
        call = series.make(size)
        call()
        times: list[float] = []
        gc.collect()
        gc.disable()
        try:
            while len(times) < 3 or (sum(times) < share and len(times) < 25):
                began = time.thread_time_ns()
                call()
                times.append((time.thread_time_ns() - began) / 1e9)
                if times[-1] > 4 * share:
                    break
        finally:
            gc.enable()
        amounts.append(series.amount(size))
        took.append(float(np.median(times)) / series.times(size))
    return amounts, took


def line(amounts: Sequence[int], took: Sequence[float]) -> tuple[float, float, float]:
    """Slope of a straight line through the logarithms, its standard error, and R2."""
    x, y = np.log(amounts), np.log(took)
    slope, at = np.polyfit(x, y, 1)
    spread = float(((y - y.mean()) ** 2).sum())
    left = float(((y - at - slope * x) ** 2).sum())
    free = len(amounts) - 2
    error = float(np.sqrt(left / free / ((x - x.mean()) ** 2).sum())) if free > 0 else 0.0
    return float(slope), error, 1.0 - left / spread if spread else 1.0


def steps(amounts: Sequence[int], took: Sequence[float]) -> str:
    """The slope from each size to the next."""
    return " ".join(f"{v:.2f}" for v in np.diff(np.log(took)) / np.diff(np.log(amounts)))


def everything() -> list[Series]:
    """All series."""
    return [*of_cells(), *of_obstacles(), *of_changes(), *of_ways()]


# ---- cells ----

SIDES = (128, 256, 512, 1024, 2048)
SHORT = (160, 320, 640)
KINDS = ("dissertation", "octile", "sixteen-connected")
SMALLEST = "the map of 128 x 128 fits the nearest caches; 1 from there on"
SWARMS = ("pso", "gso", "mmas-dstar")


def scene_of(side: int, width: int | None = None) -> Scene:
    """A random map, both ends free."""
    wide = side if width is None else width
    blocked = np.random.default_rng(side + wide).random((side, wide)) < 0.1
    blocked[:2, :2] = blocked[-2:, -2:] = False
    return Scene(Grid(blocked), (0, 0), (wide - 1, side - 1))


def of_cells() -> list[Series]:
    """Whole maps."""

    def series(name: str, make: Make, sides: tuple[int, ...] = SIDES, why: str = "", **more: Any) -> Series:
        quick = more.pop("quick", SHORT)
        return Series(name, "cells", sides, quick, make, lambda side: side * side, why)

    def field(kind: str, side: int) -> Call:
        free = random_map(side, 0.1)
        free.setflags(write=False)
        return partial(solve, free, MOVES[kind], middle(free))

    def over(side: int) -> Call:
        free = random_map(side, 0.1)
        terrain = np.random.default_rng(side).integers(0, 200, (side, side)).astype(np.uint8)
        return partial(solve, free, MOVES["octile"].weighed(), middle(free), terrain=terrain)

    def found(side: int) -> Call:
        grid = scene_of(side).grid
        return lambda: gates.find_gates(Grid(grid.blocked))

    def plan(planner: str, side: int) -> Call:
        scene = scene_of(side)
        return lambda: lampyris.plan(scene, planner)

    def picture(side: int) -> Call:
        scene = scene_of(side)
        seen, field = lampyris.plan(scene, "jps"), solve_field(scene)
        into = Path(tempfile.mkdtemp()) / "m.png"
        return lambda: draw_plan(scene.grid, seen, field=field, out=into)

    def load(side: int) -> Call:
        grid = scene_of(side).grid
        path, out = Path(tempfile.mkdtemp()) / "m.npy", io.BytesIO()
        np.save(out, grid.blocked)
        path.write_bytes(out.getvalue())
        return partial(load_map, path)

    few = (128, 256, 512, 1024)
    swarm = (64, 128, 256, 512)
    return [
        series("load (npy)", load),
        *(series(f"field, {kind}", partial(field, kind), why=OUTGROWS) for kind in KINDS),
        series("field over terrain, octile", over, why=OUTGROWS),
        series("gates", found),
        series("clearance", lambda side: partial(layers.clearance, scene_of(side).grid), why=SMALLEST),
        series("inflation", lambda side: partial(layers.free_cells, scene_of(side).grid, 2.3), why=SMALLEST),
        *(
            series(f"plan, {name}", partial(plan, name), SIDES if name in ("ad-gso", "jps") else few)
            for name in (
                "ad-gso", "astar", "dijkstra", "jps", "bidirectional-astar", "theta-star", "dstar-lite",
                "dstar", "sipp",
            )
        ),
        *(series(f"plan, {name}", partial(plan, name), swarm, quick=()) for name in SWARMS),
        series("picture", picture, few, quick=()),
    ]  # fmt: skip


# ---- moving obstacles ----


def of_obstacles() -> list[Series]:
    """Ever more of them on a map that stays."""

    def simulated(side: int, number: int) -> Call:
        scene = scene_of(side)
        return lambda: lampyris.simulate(
            scene, "ad-gso", traffic=RandomWalk(number), seed=3, ticks=30, patience=1000
        )

    def waited(side: int) -> Call:
        scene = scene_of(side)
        return lambda: lampyris.simulate(
            scene, "sipp", traffic=RandomWalk(50), seed=3, ticks=30, patience=1000
        )

    def checked(number: int) -> Call:
        trace = simulated(256, number)()
        return lambda: referee.demand(referee.check_trace(trace))

    def timed(side: int, number: int) -> Call:
        scene = scene_of(side)
        change = Change(robot=scene.start, obstacle_tracks=_seen(scene, number))
        session = Sipp().open(scene, np.random.default_rng(0))
        return lambda: session.plan(change)

    many, some = (30, 100, 300, 1000, 3000), (30, 100)
    return [
        Series("simulation, 30 ticks of 256 x 256", "obstacles", many, some, partial(simulated, 256)),
        Series("referee of that simulation", "obstacles", many, some, checked),
        Series("sipp with known tracks, 256 x 256", "obstacles", many[:-1], some, partial(timed, 256)),
        Series(
            "simulation, 30 ticks of sipp among 50", "cells", (128, 256, 512, 1024), (), waited,
            lambda side: side * side,
        ),
        Series(
            "sipp with 200 known tracks", "cells", (128, 256, 512, 1024), (), lambda side: timed(side, 200),
            lambda side: side * side,
        ),
    ]  # fmt: skip


def _seen(scene: Scene, number: int) -> tuple[Any, ...]:
    return tuple(walks(~scene.grid.blocked, number, 600, np.random.default_rng(5)))


# ---- changed cells ----


def of_changes() -> list[Series]:
    """So many cells of 1024 x 1024 blocked and freed again."""

    def often(number: int) -> int:
        # A single cell may cost nothing or a quarter of the map: so there are as many as there is time for.
        return max(1, 64 // number)

    def groups(scene: Scene, number: int) -> list[list[tuple[int, int]]]:
        ys, xs = np.nonzero(~scene.grid.blocked[8:-8, 8:-8])
        pick = np.random.default_rng(7).choice(len(xs), (often(number), number), replace=False)
        return [[(int(xs[k]) + 8, int(ys[k]) + 8) for k in row] for row in pick]

    def repaired(number: int) -> Call:
        scene = scene_of(1024)
        kept, some = FieldRepairer(~scene.grid.blocked, MOVES["octile"], scene.goal), groups(scene, number)

        def run() -> None:
            for cells in some:
                kept.repair(blocked=cells)
                kept.repair(freed=cells)

        return run

    def replanned(number: int) -> Call:
        scene = scene_of(1024)
        session, some = DStarLite().open(scene, np.random.default_rng(0)), groups(scene, number)
        session.plan()

        def run() -> None:
            for cells in some:
                session.plan(Change(blocked=tuple(cells)))
                session.plan(Change(freed=tuple(cells)))

        return run

    sizes, short = (1, 4, 16, 64, 256, 1024, 4096), (1, 16, 128)
    return [
        Series("repaired field", "changed cells", sizes, short, repaired, times=often),
        Series("D* Lite", "changed cells", sizes, short, replanned, times=often),
    ]


# ---- the length of a way ----


def of_ways() -> list[Series]:
    """Ways through strips 64 cells high, ever longer."""
    lengths, short = (250, 1000, 4000, 16000), (250, 1000)
    known: dict[int, tuple[Scene, Any]] = {}

    def way(length: int) -> tuple[Scene, Any]:
        if length not in known:
            scene = scene_of(64, length)
            known[length] = scene, lampyris.plan(scene, "jps")
        return known[length]

    def nodes(length: int) -> int:
        return len(way(length)[1].path.cells)

    def to_the_end(length: int) -> Call:
        scene = way(length)[0]
        return lambda: lampyris.simulate(scene, "sipp", traffic=RandomWalk(20), seed=3)

    def series(name: str, call: Callable[[Scene, Any], Any], why: str = "") -> Series:
        def make(length: int) -> Call:
            scene, plan = way(length)
            return lambda: call(scene, plan)

        return Series(name, "cells of the way", lengths, short, make, nodes, why)

    drawn: dict[int, Any] = {}

    def course(length: int) -> Any:
        scene, plan = way(length)
        if length not in drawn:
            drawn[length] = lampyris.smooth(scene, plan)
        return drawn[length]

    def along(length: int) -> Call:
        scene, made = way(length)[0], course(length)
        return lambda: lampyris.speed_profile(scene, made)

    return [
        series("plan through a strip, ad-gso", lambda scene, plan: lampyris.plan(scene, "ad-gso")),
        series("referee of a plan", lambda scene, plan: referee.demand(referee.check_plan(plan, scene))),
        series("speeds on a path", lambda scene, plan: lampyris.speed_profile(scene, plan)),
        series(
            "speeds by the dissertation's law",
            lambda scene, plan: lampyris.speed_profile(scene, plan, law="dissertation"),
        ),
        series("course, taut", lambda scene, plan: lampyris.smooth(scene, plan)),
        Series("speeds on a course", "cells of the way", lengths, short, along, nodes),
        Series(
            "whole simulation of sipp among 20",
            "cells of the way",
            (125, 250, 500, 1000, 2000),
            (),
            to_the_end,
            nodes,
            "it asks anew at each tick, for the way that is left",
        ),
    ]
