"""Measured: the memory that planners keep, and the time that their parts take, on our maps.

Both depend on the machine and on the Python; the page says so. Memory is counted by tracemalloc, which knows
of every array: what a session still holds once its plan is made and thrown away, and the peak meanwhile.
"""

from __future__ import annotations

import gc
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

from lampyris.io.maps import library
from lampyris.model.moves import moves_named
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.field.solve import solve_field
from lampyris.reproduce.runs.runs import MAPS

PLANNERS = ("ad-gso", "dstar-lpso", "dstar16-lpso", "dijkstra", "astar")
SWARMS = ("dstar-lpso", "dstar16-lpso")
WARM = 12
"""Plans made before anything is measured: some loops are compiled once they have been asked for often. The
swarms, which have no such loops of their own, make two."""
WINDOW = 48
"""Cells of three rings: the most that one iteration looks at."""


@dataclass(frozen=True, slots=True)
class MemoryUse:
    """Bytes that a planner's session holds after a plan, and at most while it plans; medians over queries."""

    planner: str
    kept: float
    peak: float


@dataclass(frozen=True, slots=True)
class Costs:
    """What was measured.

    Parameters
    ----------
    queries : behind the medians of times; those of memory are over the first query of each map.
    cells : of a map.
    kept : by planner.
    costs_alone : bytes of a field's costs, steps and free cells; what any exact planner to a goal keeps.
    luciferin : bytes more, for luciferin.
    window : bytes of the cells of three rings with cost and luciferin: what one iteration looks at.
    field_s, plan_s, jump_s, astar_s : seconds, medians: the field alone, a whole AD-GSO plan, one jump of it
        (plan less field, over jumps), a whole A* plan.
    """

    queries: int
    cells: int
    kept: tuple[MemoryUse, ...]
    costs_alone: int
    luciferin: int
    window: int
    field_s: float
    plan_s: float
    jump_s: float
    astar_s: float


def measure(quick: bool = False) -> Costs:
    """Measure on the stored queries of ``env-1`` to ``env-6``. ``quick``: one query a map, not five.

    Memory is measured on one query a map in any case: counting every allocation of a swarm takes a second or
    more a plan.
    """
    each = [
        [Scene(d.grid, q.start, q.goal, moves_named("dissertation")) for q in d.queries[: 1 if quick else 5]]
        for d in map(library.load, MAPS)
    ]
    scenes = [scene for some in each for scene in some]
    firsts = [some[0] for some in each]
    for name in PLANNERS:
        for k in range(2 if name in SWARMS else WARM):
            _plan(name, scenes[k % len(scenes)])
    field = solve_field(scenes[0])
    times = [_times(scene, 3 if quick else 7) for scene in scenes]
    return Costs(
        queries=len(scenes),
        cells=field.free.size,
        kept=tuple(_kept(name, firsts) for name in PLANNERS),
        costs_alone=field.free.nbytes + field.exact.nbytes + field.step.nbytes,
        luciferin=field.luciferin.nbytes,
        window=WINDOW * (field.exact.itemsize + field.luciferin.itemsize),
        field_s=median(t[0] for t in times),
        plan_s=median(t[1] for t in times),
        jump_s=median(t[2] for t in times),
        astar_s=median(t[3] for t in times),
    )


def _plan(name: str, scene: Scene) -> tuple[Any, Plan]:
    session = registry.make(name).open(scene, np.random.default_rng(0))
    return session, session.plan()


def _kept(name: str, scenes: list[Scene]) -> MemoryUse:
    """Memory of one planner; garbage of the planner before is collected first."""
    kept, peak = [], []
    for scene in scenes:
        gc.collect()
        tracemalloc.start()
        try:
            before = tracemalloc.get_traced_memory()[0]
            session, plan = _plan(name, scene)
            peak.append(tracemalloc.get_traced_memory()[1] - before)
            del plan
            gc.collect()
            kept.append(tracemalloc.get_traced_memory()[0] - before)
            del session
        finally:
            tracemalloc.stop()
    return MemoryUse(name, median(kept), median(peak))


def _times(scene: Scene, repeats: int) -> tuple[float, float, float, float]:
    """Seconds of the field, of a plan, of a jump and of A*: the least of some tries each."""
    jumps = max(1, _plan("ad-gso", scene)[1].iterations)
    field = _least(lambda: solve_field(scene), repeats)
    plan = _least(lambda: _plan("ad-gso", scene), repeats)
    return field, plan, max(0.0, plan - field) / jumps, _least(lambda: _plan("astar", scene), repeats)


def _least(work: Callable[[], object], repeats: int) -> float:
    best = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - began)
    return best
