"""Many fields at once, crowds, queries on a map that changes, and shortest paths in the plane."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.maps import published_maps, random_map

import lampyris
from lampyris._core.system import processors
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning import registry
from lampyris.planning.graph.grid_graph import SearchResult
from lampyris.planning.graph.jps_search import JumpSearch
from lampyris.planning.map_models.polyanya_search import PolyanyaSearch
from lampyris.sim.grid.loop import Simulation

TITLE = "Many fields, crowds, maps that change, paths in the plane"
HOW = """Processor time of this process, code compiled.

- many fields: `lampyris.solve_fields`, 256 x 256 cells, 10 % blocked, four-connected moves, `dtype="uint16"` (costs alone),
  goals spread over the map; by one thread, and by the clock with one thread a processor.
- crowds: ticks of a simulation on 512 x 512 cells among walkers, from the second tick on; planner `astar`.
- edits: `JumpSearch` on a map of 512 x 512: some cells turn, then one query; the search is kept and repaired, or made anew.
  Answers are compared.
- Polyanya: one query in an open search between random cells, the turning points alone and the whole answer with its walk;
  making the mesh. By map."""

FIELDS, FIELDS_S = 1024, 0.25
CROWDS, CROWD_FLAT = (10, 100, 1000), 1.5
EDITS, EDITS_TIMES = (1, 10, 100), 2.0
QUERY_US, MESH_MS = 50.0, 50.0


def bench(quick: bool) -> Section:
    """All four."""
    prefer_compiled()
    figures: list[Figure] = []
    verdicts: list[Verdict] = []
    tables = [part(quick, figures, verdicts) for part in (_fields, _crowds, _edits, _polyanya)]
    return Section(
        "calls", TITLE, HOW, tuple(tables), tuple(figures), tuple(verdicts), versions(["numpy", "numba"])
    )


def _seconds(call: Callable[[], object], clock: Callable[[], float] = time.process_time) -> float:
    began = clock()
    call()
    return clock() - began


def _fields(quick: bool, figures: list[Figure], verdicts: list[Verdict]) -> Table:
    many, rounds = (128, 2) if quick else (FIELDS, 5)
    free = random_map(256, 0.1)
    cells = np.argwhere(free)
    goals = [(int(x), int(y)) for y, x in cells[np.linspace(0, len(cells) - 1, many).astype(int)]]
    scene = Scene(lampyris.Grid(~free), goals[0], goals[-1], moves="four-connected")

    def solve(workers: int | None) -> None:
        for _ in lampyris.solve_fields(scene, goals, workers=workers, dtype="uint16"):
            pass

    solve(None)
    cpu, clock = [], []
    for _ in range(rounds):
        cpu.append(_seconds(lambda: solve(1)))
        clock.append(_seconds(lambda: solve(None), time.perf_counter))
    one, all_of_them = Spread.of(cpu), Spread.of(clock)
    task = f"{many:,} fields of 256 x 256"
    figures += [
        Figure(f"{task}, one thread", "s", one),
        Figure(f"{task}, all processors, by the clock", "s", all_of_them),
    ]
    share = one.middle / processors()
    text = (
        f"{task}, four moves, costs: {one.middle:.2f} s of processor time, {share:.2f} s for each of {processors()} "
        f"processors, {all_of_them.middle:.2f} s by the clock; {FIELDS_S:g} s asked for on two cores"
    )
    if not quick:
        verdicts.append(Verdict(share <= FIELDS_S, text))
    each = 1e9 * one.middle / many / len(cells)
    rows = ((task, f"{one.middle:.3f}", f"{all_of_them.middle:.3f}", f"{each:.2f}"),)
    return Table(("what", "processor time, s", "by the clock, s", "ns a cell"), rows, "Many fields")


def _crowds(quick: bool, figures: list[Figure], verdicts: list[Verdict]) -> Table:
    free = random_map(512, 0.1)
    free[:3, :3] = free[-3:, -3:] = True
    grid = lampyris.Grid(~free)
    rows, each = [], []
    for count in CROWDS:
        scene = Scene(grid, (0, 0), (511, 511), traffic=(RandomWalk(count),))
        times = []
        for seed in range(2 if quick else 8):
            run = Simulation(scene, registry.make("astar"), seed=seed)
            run.advance(1)
            spent = _seconds(lambda r=run: r.advance(400), time.thread_time)
            if seed:
                times.append(1e6 * spent / (run.now - 1))
        tick = Spread.of(times)
        each.append(tick.middle / count)
        figures.append(Figure(f"a tick among {count:,}, 512 x 512", "us", tick))
        rows.append(
            (f"{count:,}", f"{tick.middle:.1f} ({tick.low:.1f} to {tick.high:.1f})", f"{each[-1]:.3f}")
        )
    flat = max(each[1:]) / each[0]
    text = f"cost of a tick and obstacle, 100 and 1,000 compared with 10 obstacles on 512 x 512: at most {CROWD_FLAT:g} times: "
    text += f"{flat:.2f}"
    verdicts.append(Verdict(flat <= CROWD_FLAT, text))
    return Table(("obstacles", "us a tick", "us a tick and obstacle"), tuple(rows), "Crowds on 512 x 512")


Ends = tuple[tuple[int, int], tuple[int, int]]


def _mended(kept: JumpSearch, free: np.ndarray, ends: Ends, found: list[SearchResult]) -> None:
    kept.take(free, None)
    found.append(kept.find_path(*ends))


def _anew(free: np.ndarray, ends: Ends, found: list[SearchResult]) -> None:
    found.append(JumpSearch(free, MOVES["octile"]).find_path(*ends))


def _edits(quick: bool, figures: list[Figure], verdicts: list[Verdict]) -> Table:
    moves, rng = MOVES["octile"], np.random.default_rng(7)
    rows, wrong, asked = [], 0, 0
    grounds = [("random 10 %", random_map(512, 0.1))]
    grounds += [(name, free) for name, free in published_maps() if name in ("arena2", "maze512-32-0")]
    ratios: dict[str, float] = {}
    for name, given in grounds:
        for edits in EDITS:
            free = given.copy()
            kept = JumpSearch(free.copy(), moves)
            mended, anew = [], []
            for k in range(4 if quick else 40):
                free = free.copy()
                y, x = rng.integers(0, free.shape[0], edits), rng.integers(0, free.shape[1], edits)
                free[y, x] = ~free[y, x]
                cells = np.argwhere(free)
                (ay, ax), (by, bx) = cells[rng.integers(0, len(cells), 2)].tolist()
                ends = (ax, ay), (bx, by)
                found: list[SearchResult] = []
                calls = (partial(_mended, kept, free, ends, found), partial(_anew, free, ends, found))
                times = [_seconds(call, time.thread_time) for call in calls]
                if k:
                    mended.append(1e6 * times[0])
                    anew.append(1e6 * times[1])
                costs = [None if f.cells is None else path_of(f.cells, moves).exact for f in found]
                wrong, asked = wrong + (costs[0] != costs[1]), asked + 1
            ours, theirs = Spread.of(mended), Spread.of(anew)
            task = f"{name}, {edits} cells turned, then a query"
            figures.append(Figure(task, "us", ours, "opened anew", theirs, asked=EDITS_TIMES))
            ratios[task] = theirs.middle / ours.middle
            rows.append(
                (name, f"{edits}", f"{ours.middle:,.0f}", f"{theirs.middle:,.0f}", f"{ratios[task]:.1f}")
            )
    short = [f"{task} ({ratio:.1f})" for task, ratio in ratios.items() if ratio < EDITS_TIMES]
    text = (
        f"queries after edits compared with a newly opened search: at least {EDITS_TIMES:g} times as quick: "
    )
    text += f"{min(ratios.values()):.1f} to {max(ratios.values()):.1f}, in {len(ratios) - len(short)} of {len(ratios)}"
    verdicts.append(Verdict(not short, text + (f"; short of it: {', '.join(short)}" if short else "")))
    verdicts.append(Verdict(not wrong, f"{wrong} of {asked} lengths after edits differ"))
    heads = ("map", "cells turned", "repaired, us", "opened anew, us", "times")
    return Table(heads, tuple(rows), "Queries after edits, jump point search")


def _polyanya(quick: bool, figures: list[Figure], verdicts: list[Verdict]) -> Table:
    moves, rng = MOVES["octile"], np.random.default_rng(3)
    rows, medians, meshes = [], [], []
    grounds = [("random 10 %, 512", random_map(512, 0.1)), *published_maps()]
    for name, free in grounds[:2] if quick else grounds:
        PolyanyaSearch(free, moves, wide=False)
        mesh = Spread.of(
            [1e3 * _seconds(lambda f=free: PolyanyaSearch(f, moves, wide=False)) for _ in range(3)]
        )
        search = PolyanyaSearch(free, moves, wide=False)
        cells = np.argwhere(free)
        turning, whole, nodes = [], [], []
        for k in range(20 if quick else 100):
            (ay, ax), (by, bx) = cells[rng.integers(0, len(cells), 2)].tolist()
            ends = (ax, ay), (bx, by)
            spent = _seconds(lambda e=ends, s=search: s.turning_points(*e), time.thread_time)
            answer = _seconds(lambda e=ends, s=search: s.find_path(*e), time.thread_time)
            if k:
                turning.append(1e6 * spent)
                whole.append(1e6 * answer)
                nodes.append(search.turning_points(*ends)[1])
        middle = statistics.median(turning)
        medians.append((name, middle))
        meshes.append((name, mesh.middle))
        figures += [
            Figure(f"{name}, turning points of a query", "us", Spread.of(turning)),
            Figure(f"{name}, nodes of a query", "nodes", Spread.of(nodes)),
            Figure(f"{name}, each node", "ns", Spread.of([1e3 * sum(turning) / sum(nodes)])),
            Figure(f"{name}, a query's whole answer", "us", Spread.of(whole)),
            Figure(f"{name}, mesh", "ms", mesh),
        ]
        rectangles = len(search.mesh.rects) // 4
        rows.append(
            (
                name,
                f"{rectangles:,}",
                f"{statistics.median(nodes):,.0f}",
                f"{middle:,.0f}",
                f"{statistics.median(whole):,.0f}",
                f"{mesh.middle:.1f}",
            )
        )
    for what, unit, most, told in (
        ("median query", "us", QUERY_US, medians),
        ("mesh", "ms", MESH_MS, meshes),
    ):
        short = [f"{name} ({value:,.0f})" for name, value in told if value > most]
        text = f"Polyanya, {what}: at most {most:g} {unit}: in {len(told) - len(short)} of {len(told)} maps"
        verdicts.append(Verdict(not short, text + (f"; more: {', '.join(short)}" if short else "")))
    heads = ("map", "rectangles", "nodes expanded", "turning points, us", "whole answer, us", "mesh, ms")
    return Table(heads, tuple(rows), "Polyanya by map")
