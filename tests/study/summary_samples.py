"""Studies with made-up results: what a summary must say of them is known beforehand."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from lampyris.model.grid import Grid
from lampyris.study.analysis.runs import Runs, runs_of
from lampyris.study.design.row import Ending, Row
from lampyris.study.design.study import Config, Job, Study, StudyMap, StudyTraffic, World

Made = tuple[Ending, Mapping[str, Any]]


def study(
    planners: Sequence[str] = ("a", "b", "c"),
    *,
    maps: int = 2,
    queries: int = 3,
    seeds: int = 2,
    traffic_cases: Sequence[StudyTraffic] = (StudyTraffic(), StudyTraffic("random-walk", 5)),
    laws: Sequence[str] = ("dissertation",),
    **more: Any,
) -> Study:
    """A study of empty maps."""
    worlds = []
    for m in range(maps):
        grid = Grid(np.zeros((6, 8 + m), dtype=np.bool_))
        ground = StudyMap(f"map {m}", grid, f"{m:064x}")
        worlds += [World(ground, (0, 0), (7, q)) for q in range(queries)]
    return Study(
        **{"name": "made up", "kind": "simulate"} | more,
        worlds=tuple(worlds),
        planners=tuple(Config(p) for p in planners),
        laws=tuple(Config(law) for law in laws),
        traffic_cases=tuple(traffic_cases),
        seeds=tuple(range(seeds)),
    )


def metrics(cost: float, arrived: bool = True, **more: Any) -> dict[str, Any]:
    """What a run has; of one that did not arrive, no way."""
    way = {"cost": cost, "gap": cost / 10 - 1, "ticks": int(cost), "cost_to_go": 5 * cost} if arrived else {}
    none = dict.fromkeys(("cost", "gap", "ticks", "cost_to_go"))
    told = {"outcome": "arrived" if arrived else "stuck", "found": True, "arrived": arrived, "collisions": 0}
    return none | way | told | {"expansions": int(10 * cost), "iterations": 3} | more


def place(one: Study, job: Job) -> tuple[int, int, int, int]:
    """World, crowd, seed and entrant of a job."""
    shape = (len(one.worlds), len(one.traffic_cases), len(one.seeds), len(one.planners) * len(one.laws))
    w, c, s, e = (int(k) for k in np.unravel_index(job.index, shape))
    return w, c, s, e


def rows(one: Study, make: Callable[[int, int, int, int], Made | None]) -> dict[str, Row]:
    """Rows by what ``make(world, crowd, seed, entrant)`` says; None: no row yet."""
    out = {}
    for job in one.jobs():
        made = make(*place(one, job))
        if made is not None:
            error = "" if made[0] == "done" else f"error[{made[0].upper()}]: made up"
            out[job.key] = Row(job.key, made[0], made[1], {"cpu_s": 0.25}, error)
    return out


def runs(one: Study, make: Callable[[int, int, int, int], Made | None]) -> Runs:
    """The same as arrays."""
    records = []
    for job in one.jobs():
        made = make(*place(one, job))
        if made is not None:
            records.append((job.index, made[0], "" if made[0] == "done" else made[0].upper(), made[1]))
    return runs_of(one, records)


def by_chance(seed: int, failing: float = 0.2) -> Callable[[int, int, int, int], Made | None]:
    """Results drawn by chance, some of them failures of every kind."""
    rng = np.random.default_rng(seed)
    known: dict[tuple[int, ...], Made] = {}

    def make(*at: int) -> Made:
        if at not in known:
            chance = rng.uniform()
            cost = float(rng.uniform(10, 30))
            if chance < failing / 4:
                known[at] = ("refused", {})
            elif chance < failing / 3:
                known[at] = ("timeout", {})
            else:
                known[at] = ("done", metrics(cost, chance > failing))
        return known[at]

    return make


def finite(value: Any) -> bool:
    """Whether plain data holds no number that is not one."""
    if isinstance(value, Mapping):
        return all(map(finite, value.values()))
    if isinstance(value, list | tuple):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)
