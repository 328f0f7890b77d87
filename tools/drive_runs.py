"""Runs of drives for the acceptance of the speed issue: scenes, one row a run, and many runs at once.

A run is decided by its number, the root seed and the law: neither how many run at once nor in which order
changes a row.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from lampyris.io.maps.library import load
from lampyris.model.change import Change
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, RandomWalk
from lampyris.motion.geometry.sampled_path import sample_curve
from lampyris.motion.laws.registry import SpeedLaw, profile
from lampyris.motion.laws.rpp import Rpp
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Planner
from lampyris.planning.graph.astar import AStar
from lampyris.referee import check_drive
from lampyris.referee.drive import measure
from lampyris.sim.continuous.drive import drive
from lampyris.sim.traffic.adversary import Adversary

ROBOT = Robot(radius=0.4, v_max=1.0, a_max=0.5, d_max=1.0)
"""0.4 of a cell at a metre a cell."""

RADIUS, TOP_SPEED = 0.4, 0.5
"""Of the obstacles: metres, m/s."""

LAWS: dict[str, SpeedLaw] = {
    "physical": "physical",
    "dissertation": "dissertation",
    "rpp": "rpp",
    "rpp-fast": Rpp(desired=ROBOT.v_max),
}
"""``rpp`` has Nav2's desired speed, 0.5 m/s; ``rpp-fast`` the robot's v_max."""

SIDE = 24
"""Cells of the small maps' sides."""

PLANNERS: dict[str, Planner] = {"astar": AStar(), "ad-gso": AdGso()}

_One = TypeVar("_One")
_Row = TypeVar("_Row")


@dataclass(frozen=True, slots=True)
class Row:
    """One run.

    Parameters
    ----------
    name, law, number : what was run.
    outcome, detail : how it ended.
    refused : what the referee said against it, or an empty string.
    collisions, hits : bodies touched while the robot moved, and while it stood.
    ratio : seconds over those of the time optimum of the first way; infinity if it did not arrive.
    own : seconds over those of the same law's profile on that way with nobody about; for ``physical`` only.
    gap : least distance between the rims while it moved, metres.
    stood : seconds it stood.
    lateral : maximum acceleration to the side, m/s2.
    replans : how often it planned anew.
    """

    name: str
    law: str
    number: int
    outcome: str
    detail: str
    refused: str
    collisions: int
    hits: int
    ratio: float
    own: float
    gap: float
    stood: float
    lateral: float
    replans: int


def row_of(made: Drive, name: str, law: str, number: int) -> Row:
    """A drive, judged and measured."""
    verdict = check_drive(made)
    seen = measure(made)
    ratio = seen["ratio"] if made.arrived else None
    alone = alone_seconds(made, law) if made.arrived else 0.0
    return Row(
        name=name,
        law=law,
        number=number,
        outcome=made.outcome.value,
        detail=made.sentence,
        refused="" if verdict is None else str(verdict),
        collisions=seen["collisions"],
        hits=seen["hits"],
        ratio=float("inf") if ratio is None else ratio,
        own=made.duration / alone if alone > 0 else float("inf"),
        gap=seen["gap"],
        stood=seen["stood"],
        lateral=seen["lateral"],
        replans=made.replans,
    )


def alone_seconds(made: Drive, law: str) -> float:
    """How long our law's profile of the first way takes; 0 for other laws."""
    if law != "physical" or not made.curves:
        return 0.0
    way = sample_curve(made.curves[0], 0.1 * made.scene.grid.resolution)
    return profile(way, made.scene, law=law).duration


def draws(*numbers: int) -> np.random.Generator:
    """A stream of its own for a run."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(numbers)))


def small_scene(seed: int, number: int) -> Scene:
    """A map of 24 x 24 cells with a few blocks, and two ends at least 10 cells apart with a way between."""
    rng = draws(seed, number)
    while True:
        blocked = np.zeros((SIDE, SIDE), dtype=bool)
        for _ in range(int(rng.integers(0, 9))):
            x, y, w, h = (*rng.integers(0, SIDE, 2), *rng.integers(1, 5, 2))
            blocked[y : y + h, x : x + w] = True
        (x0, y0), (x1, y1) = rng.integers(1, SIDE - 1, (2, 2)).tolist()
        if np.hypot(x1 - x0, y1 - y0) < 10 or blocked[y0, x0] or blocked[y1, x1]:
            continue
        scene = Scene(Grid(blocked, name="small"), (x0, y0), (x1, y1), robot=ROBOT)
        if AStar().open(scene, rng).plan(Change(robot=scene.start)):
            return scene


def cutter(rng: np.random.Generator) -> Adversary:
    """One obstacle that cuts in once or more, at a random time, from a random place near the way."""
    return Adversary(
        top_speed=TOP_SPEED, count=1, radius=RADIUS, wait=1.0 + 8.0 * float(rng.random()), near=6.0
    )


def cut_in(seed: int, number: int, law: str, planner: str = "astar") -> Drive:
    """One run of the stop test."""
    scene = small_scene(seed, number)
    source = cutter(draws(seed, number, 1))
    return drive(scene, PLANNERS[planner], law=LAWS[law], seed=number, sources=(source,))


def queries() -> list[tuple[str, Scene]]:
    """Every stored query of the six 50 x 50 maps."""
    found = []
    for name in (f"env-{k}" for k in range(1, 7)):
        document = load(name)
        for k, query in enumerate(document.queries):
            found.append((f"{name} {k}", Scene(document.grid, query.start, query.goal, robot=ROBOT)))
    return found


TRAFFIC = ("walk", "crossing", "cutters")
"""The dissertation's, which wait for the robot; some that cross the map and do not; adversaries that
run at the robot's way again and again."""


def crowded(seed: int, number: int, law: str, traffic: str, count: int, planner: str = "astar") -> Drive:
    """One run among ``count`` obstacles on a stored query."""
    every = queries()
    _, scene = every[number % len(every)]
    sources: tuple[Adversary, ...] = ()
    if traffic == "cutters":
        sources = (Adversary(top_speed=TOP_SPEED, count=count, radius=RADIUS, wait=10.0),)
    else:
        kind = RandomWalk if traffic == "walk" else Crossing
        scene = replace(scene, traffic=(kind(count, radius=RADIUS),))
    return drive(
        scene,
        PLANNERS[planner],
        law=LAWS[law],
        seed=seed + number,
        sources=sources,
        obstacle_speed=TOP_SPEED,
        on_hit="go-on",
    )


def many(work: Callable[[_One], _Row], todo: Sequence[_One], jobs: int, what: str) -> list[_Row]:
    """Every piece of work, in order, ``jobs`` at once."""
    began = time.perf_counter()
    rows: list[_Row] = []

    def take(done: Iterable[_Row]) -> None:
        for row in done:
            rows.append(row)
            if len(rows) % max(1, len(todo) // 20) == 0:
                spent = time.perf_counter() - began
                print(f"{what}: {len(rows)} of {len(todo)}, {spent:.0f} s", file=sys.stderr, flush=True)

    if jobs <= 1:
        take(map(work, todo))
    else:
        with multiprocessing.get_context("spawn").Pool(jobs) as pool:
            take(pool.imap(work, todo, chunksize=max(1, min(50, len(todo) // (4 * jobs)))))
    return rows


def header(**more: object) -> str:
    """Everything that decides the numbers below it."""
    told = {
        "robot radius": f"{ROBOT.radius:g} m",
        "v_max": f"{ROBOT.v_max:g} m/s",
        "a_max": f"{ROBOT.a_max:g} m/s2",
        "d_max": f"{ROBOT.d_max:g} m/s2",
        "a_lat_max": f"{ROBOT.a_lat_max:g} m/s2",
        "resolution": "1 m a cell",
        "obstacle radius": f"{RADIUS:g} m",
        "obstacle top speed": f"{TOP_SPEED:g} m/s",
        **more,
    }
    return "; ".join(f"{k} {v}" for k, v in told.items())


def claim(holds: bool, sentence: str) -> str:
    """One line of the verdict."""
    return f"{'HOLDS' if holds else 'SHORT'}: {sentence}"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table for the docs."""
    lines = [list(head), ["---"] * len(head), *([str(v) for v in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
