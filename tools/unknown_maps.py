"""Print what it costs not to know the map: full knowledge beside a sensor, and a new search beside going on.

    python tools/unknown_maps.py          # both tables of docs/unknown_maps.md
    python tools/unknown_maps.py bundled  # one of them
    python tools/unknown_maps.py large

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
MAPS = ("guide", "env-1", "env-2", "env-3", "env-4", "env-5", "env-6")
LARGE = (
    ("maze", {"corridor": 8}),
    ("maze", {"corridor": 3, "loops": 0.1}),
    ("rooms", {}),
    ("office", {}),
    ("caves", {}),
    ("random", {}),
)
SIDE, RANGE = 512, 20.0
SEEDS = 3


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


def bundled() -> None:
    """Full knowledge beside a sensor of 6 cells, on the bundled maps."""
    print("| planner | drives | path: sensor / known | replans | expansions known | sensor |")
    print("|---|---|---|---|---|---|")
    scenes = []
    for name in MAPS:
        grid, rng = lampyris.load_grid(name), np.random.default_rng(1)
        scenes += [lampyris.Scene(grid, *ends(grid, rng, 0.5)) for _ in range(SEEDS)]
    for label, planner in planners():
        pairs = [
            (driven(scene, planner, None), driven(scene, planner, lampyris.Sensor(6 * scene.grid.resolution)))
            for scene in scenes
        ]
        if not all(run.arrived for pair in pairs for run in pair):
            raise SystemExit(f"{label} did not arrive everywhere")
        ratio = sorted(sensed.cost / known.cost for known, sensed in pairs)
        replans = np.mean([sensed.replans for _, sensed in pairs])
        work = [np.mean([run[k].expansions for run in pairs]) for k in (0, 1)]
        mean = f"{np.mean(ratio):.2f} (median {ratio[len(ratio) // 2]:.2f}, most {ratio[-1]:.2f})"
        print(
            f"| {label} | {len(pairs)} | {mean} | {replans:.1f} | {work[0]:,.0f} | {work[1]:,.0f} |",
            flush=True,
        )


def large() -> None:
    """Expansions on maps of 512 x 512 cells with a sensor of 20 cells."""
    print(
        "| map | planner | moves driven | replans | expansions | A* again / it | Dijkstra again / it | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for recipe, settings in LARGE:
        grid = lampyris.Grid(make(recipe, SIDE, SIDE, 0, **settings))
        scene = lampyris.Scene(grid, *ends(grid, np.random.default_rng(2), 0.7))
        rows: list[tuple[str, lampyris.Trace, float]] = []
        recipe += "".join(f" {key}={value}" for key, value in settings.items())
        for label, planner in planners():
            began = time.process_time()
            trace = driven(scene, planner, lampyris.Sensor(RANGE))
            rows.append((label, trace, time.process_time() - began))
        anew, wide = (rows[k][1].expansions for k in (-1, -2))
        for label, trace, seconds in rows:
            times = f"{anew / trace.expansions:.2g} | {wide / trace.expansions:.2g}"
            moves = f"{trace.ticks}{'' if trace.arrived else ' (' + trace.outcome.value + ')'}"
            work = f"{trace.replans} | {trace.expansions:,} | {times} | {seconds:.1f}"
            print(f"| {recipe} | {label} | {moves} | {work} |", flush=True)


if __name__ == "__main__":
    asked = sys.argv[1:] or ["bundled", "large"]
    for what in asked:
        {"bundled": bundled, "large": large}[what]()
        print()
