"""Print how many cells a planner expands that goes on, and one that searches again, on large maps that are not known.

    python tools/unknown_maps.py             # the tables of docs/unknown_maps.md
    python tools/unknown_maps.py free        # one of them: unseen cells count as free
    python tools/unknown_maps.py published   # the same on maps of MovingAI, in ../shared/maps or where LAMPYRIS_SHARED says
    python tools/unknown_maps.py unseen      # unseen cells cost twice as much until they are seen

What it costs not to know the map is the ready study `unknown-maps`.

Every drive has passed the referee. Expansions are those of all calls of the planner together; for AD-GSO, whose exact choice
walks down a field that is repaired, the cells of the field that were solved or repaired and the cells its window looked at.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import lampyris
from lampyris import referee
from lampyris.io.maps.recipes.make import make
from lampyris.planning import registry
from lampyris.planning.base import Planner
from lampyris.planning.field.layers import moves_for
from lampyris.planning.graph.terrain_graph import search_of
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
PUBLISHED = ("maze512-32-0", "16room_000", "random512-10-0", "AR0011SR", "ht_0_hightown", "Berlin_0_256")
"""Mazes, rooms, random cells, two games and a city (of 256 x 256 cells, the others of 512 x 512)."""
PAIRS = 3


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


def at_every_sight(trace: lampyris.Trace) -> int:
    """Expansions of A* if it searched again at every tick at which walls came into sight, on the way of this drive."""
    scene, seen = trace.scene, trace.seen
    assert seen is not None
    walls = scene.grid.blocked
    search = search_of(np.ones_like(walls), None, moves_for(scene))
    spent = 0
    for tick in np.unique(seen[walls & (seen >= 0)]).tolist():
        x, y = trace.robot[tick].tolist()
        search.take(~(walls & (seen >= 0) & (seen <= tick)), None)
        spent += search.find_path((x, y), scene.goal).expansions
    return spent


def published_grids() -> Iterator[tuple[str, lampyris.Grid]]:
    """The published maps that are there."""
    shared = Path(os.environ.get("LAMPYRIS_SHARED") or Path(__file__).resolve().parents[2] / "shared")
    for name in PUBLISHED:
        file = shared / "maps" / "movingai" / f"{name}.map"
        if file.exists():
            yield name, lampyris.load_grid(file)
        else:
            print(f"{name} is not there", file=sys.stderr)


def published_unseen(sensor: lampyris.Sensor) -> None:
    """On published maps, one drive each, for a robot to which unseen cells cost more."""
    print("| map | moves | replans | D* Lite expands | A* again | A* again / D* Lite |")
    print("|---|---|---|---|---|---|")
    for name, grid in published_grids():
        scene = lampyris.Scene(grid, *ends(grid, np.random.default_rng(2), 0.5))
        first, anew = (driven(scene, registry.make(one, {}), sensor) for one in ("dstar-lite", "astar"))
        work = f"{first.expansions:,} | {anew.expansions:,} | {anew.expansions / first.expansions:.2g}"
        print(f"| {name} | {first.ticks:,} | {first.replans:,} | {work} |", flush=True)


def published(sensor: lampyris.Sensor) -> None:
    """The same on published maps, several pairs of ends each, and sums."""
    some = [(name, registry.make(name, {})) for name in ("dstar-lite", "dijkstra", "astar")]
    print(
        "| map | moves | replans | D* Lite expands | A* again | Dijkstra again | A* at every sight "
        "| A* again / D* Lite | Dijkstra | A* at every sight |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    every = np.zeros(4, dtype=np.int64)
    for name, grid in published_grids():
        rng = np.random.default_rng(2)
        moves, replans, spent = 0, 0, np.zeros(4, dtype=np.int64)
        for _ in range(PAIRS):
            scene = lampyris.Scene(grid, *ends(grid, rng, 0.5))
            traces = {label: driven(scene, planner, sensor) for label, planner in some}
            first = traces["dstar-lite"]
            moves, replans = moves + first.ticks, replans + first.replans
            spent += [
                *(traces[label].expansions for label in ("dstar-lite", "astar", "dijkstra")),
                at_every_sight(first),
            ]
        every += spent
        _published_row(f"{name}, {PAIRS} drives", f"{moves:,} | {replans:,}", spent)
    _published_row("all together", " | ", every)


def _published_row(name: str, driven_so: str, spent: np.ndarray) -> None:
    work = " | ".join(f"{one:,}" for one in spent.tolist())
    times = " | ".join(f"{one / spent[0]:.2g}" for one in spent[1:].tolist())
    print(f"| {name} | {driven_so} | {work} | {times} |", flush=True)


if __name__ == "__main__":
    asked = sys.argv[1:] or ["free", "published", "unseen"]
    everyone = planners()
    # Dijkstra and the field expand most of the map at each of the thousand plans: left out where there are so many.
    quick = [one for one in everyone if one[0] in ("`dstar-lite`", "`lpa-star`", "`dijkstra`", "`astar`")]
    for what in asked:
        if what == "published":
            published(lampyris.Sensor(RANGE))
            print()
            published_unseen(lampyris.Sensor(RANGE, unseen_cost=2.0))
            print()
            continue
        price = {"free": 1.0, "unseen": 2.0}[what]
        large(lampyris.Sensor(RANGE, unseen_cost=price), everyone if what == "free" else quick)
        print()
