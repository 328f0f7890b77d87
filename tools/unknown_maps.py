"""Print how many cells a planner expands that goes on, and one that searches again, on large maps that are not known.

    python tools/unknown_maps.py          # both tables of docs/unknown_maps.md
    python tools/unknown_maps.py free     # one of them: unseen cells count as free
    python tools/unknown_maps.py unseen   # unseen cells cost twice as much until they are seen

What it costs not to know the map is the ready study `unknown-maps`.

Every drive has passed the referee. Expansions are those of all calls of the planner together; for AD-GSO, whose exact choice
walks down a field that is repaired, the cells of the field that were solved or repaired and the cells its window looked at.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import lampyris
from lampyris import referee
from lampyris.io.maps.recipes.make import make
from lampyris.planning import registry
from lampyris.planning.base import Planner
from lampyris.sim.grid import loop

PLANNERS = (
    ("dstar-lite", {}),
    ("lpa-star", {}),
    ("ad-gso", {"choice": "exact"}),
    ("ad-gso", {}),
    ("dijkstra", {}),
    ("astar", {}),
)
LARGE = (
    ("maze", {"corridor": 8}),
    ("maze", {"corridor": 3, "loops": 0.1}),
    ("rooms", {}),
    ("office", {}),
    ("caves", {}),
    ("random", {}),
)
SIDE, RANGE = 512, 20.0


def planners() -> list[tuple[str, Planner]]:
    """The planners, with the settings that they are not named after."""
    return [
        (
            f"`{name}`" + "".join(f" {key}={value}" for key, value in settings.items()),
            registry.make(name, settings),
        )
        for name, settings in PLANNERS
    ]


def driven(scene: lampyris.Scene, planner: Planner, sensor: lampyris.Sensor | None) -> lampyris.Trace:
    """A drive that the referee has accepted."""
    trace = loop.run(scene, planner, law="dissertation", sensor=sensor)
    referee.demand(referee.check_trace(trace))
    return trace


def ends(
    grid: lampyris.Grid, rng: np.random.Generator, far: float
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Two free cells with a path between them, at least ``far`` times the side apart."""
    free = np.argwhere(~grid.blocked)
    while True:
        (y, x), (v, u) = free[rng.choice(len(free), 2, replace=False)].tolist()
        if max(abs(u - x), abs(v - y)) < far * min(grid.blocked.shape):
            continue
        if lampyris.plan(lampyris.Scene(grid, (x, y), (u, v)), "astar"):
            return (x, y), (u, v)


def large(sensor: lampyris.Sensor, some: list[tuple[str, Planner]]) -> None:
    """Expansions on maps of 512 x 512 cells with a sensor; the last two planners are those that search again."""
    print(
        "| map | planner | moves driven | replans | expansions | A* again / it | Dijkstra again / it | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for recipe, settings in LARGE:
        grid = lampyris.Grid(make(recipe, SIDE, SIDE, 0, **settings))
        scene = lampyris.Scene(grid, *ends(grid, np.random.default_rng(2), 0.7))
        rows: list[tuple[str, lampyris.Trace, float]] = []
        recipe += "".join(f" {key}={value}" for key, value in settings.items())
        for label, planner in some:
            began = time.process_time()
            trace = driven(scene, planner, sensor)
            rows.append((label, trace, time.process_time() - began))
        anew, wide = (rows[k][1].expansions for k in (-1, -2))
        for label, trace, seconds in rows:
            times = f"{anew / trace.expansions:.2g} | {wide / trace.expansions:.2g}"
            moves = f"{trace.ticks}{'' if trace.arrived else ' (' + trace.outcome.value + ')'}"
            work = f"{trace.replans} | {trace.expansions:,} | {times} | {seconds:.1f}"
            print(f"| {recipe} | {label} | {moves} | {work} |", flush=True)


if __name__ == "__main__":
    asked = sys.argv[1:] or ["free", "unseen"]
    everyone = planners()
    # Dijkstra and the field expand most of the map at each of the thousand plans: left out where there are so many.
    quick = [one for one in everyone if one[0] in ("`dstar-lite`", "`lpa-star`", "`dijkstra`", "`astar`")]
    for what in asked:
        price = {"free": 1.0, "unseen": 2.0}[what]
        large(lampyris.Sensor(RANGE, unseen_cost=price), everyone if what == "free" else quick)
        print()
