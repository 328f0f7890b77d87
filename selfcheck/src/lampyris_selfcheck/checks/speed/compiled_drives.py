"""Compiled periods of drives, whole and stopped at random, beside the loop in Python: every field, to the last bit."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.moves import moves_named
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk
from lampyris.sim.continuous.compiled_periods import supported
from lampyris.sim.continuous.drive import DriveSimulation
from lampyris_selfcheck.check import Ask, Tally
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes

_LAWS = ("physical", "physical", "physical", "optimum", "constant", "dissertation", "rpp")


def drawn(rng: np.random.Generator, seed: int) -> tuple[Scene, dict[str, Any]]:
    """A small map with traffic and what the drive is asked for."""
    blocked = rng.random(tuple(rng.integers(8, 24, 2).tolist())) < rng.choice([0.0, 0.1, 0.2])
    resolution = float(rng.choice([0.1, 0.5, 1.0]))
    free = np.argwhere(~blocked)
    (sy, sx), (gy, gx), *others = free[rng.integers(len(free), size=5)].tolist()
    robot = Robot(
        radius=float(rng.choice([0.0, 0.2, 0.45, 0.6])) * resolution,
        v_max=float(rng.uniform(0.2, 2.0)),
        a_max=float(rng.uniform(0.2, 2.0)),
        d_max=float(rng.uniform(0.3, 2.0)),
        turn_radius=float(rng.choice([0.0, 0.0, 0.5])) * resolution,
    )
    size = float(rng.choice([0.0, 0.0, 0.0, 0.4, 0.9])) * resolution
    spec: list[ObstacleSpec] = [RandomWalk(int(rng.integers(0, 14)), radius=size)]
    if rng.random() < 0.25:
        spec.append(RandomWalk(int(rng.integers(1, 4))))
    if rng.random() < 0.25:
        spec.append(Crossing(int(rng.integers(1, 3))))
    if rng.random() < 0.2:
        spec.append(Patrol(tuple((x, y) for y, x in others)))
    moves = moves_named(("octile", "dissertation")[int(rng.integers(2))])
    scene = Scene(Grid(blocked, resolution=resolution), (sx, sy), (gx, gy), moves, robot, tuple(spec))
    return scene, {
        "law": _LAWS[int(rng.integers(len(_LAWS)))],
        "obstacle_speed": float(rng.uniform(0.2, 2.5)) * robot.v_max,
        "time_limit": 60.0,
        "give_up": float(rng.choice([30.0, 5.0])),
        "on_hit": ("end", "go-on")[int(rng.integers(2))],
        "period": float(rng.choice([0.1, 0.05, 0.3, 1.7])),
        "patience": float(rng.choice([5.0, 1.0, 0.5])),
        "obstacle_info": ("positions", "positions", "positions", "velocities")[int(rng.integers(4))],
        "seed": seed,
    }


def by_period(run: DriveSimulation) -> Drive:
    """The whole drive by the loop in Python."""
    while run.outcome is None:
        run.step()
    return run.drive()


def by_pieces(run: DriveSimulation, rng: np.random.Generator) -> Drive:
    """The whole drive, some of it period by period, some of it compiled."""
    while run.outcome is None:
        if rng.random() < 0.3:
            run.step()
        else:
            run.advance(int(rng.integers(1, 40)))
    return run.drive()


def difference(a: Drive, b: Drive) -> str:
    """The first field in which two drives differ, but for their timing; empty: none."""
    for name in (f.name for f in fields(Drive)):
        x, y = getattr(a, name), getattr(b, name)
        equal = x.tobytes() == y.tobytes() if isinstance(x, np.ndarray) else name == "timing" or x == y
        if not equal:
            return name
    return ""


def judge(ask: Ask, number: int, tally: Tally) -> None:
    """One drive, three times."""
    rng = ask.rng("sim", "periods", number)
    scene, settings = drawn(rng, number)
    who = scenes.planner(("astar", "ad-gso", "theta-star")[int(rng.integers(3))])
    data = {"planner": who.name, "law": settings["law"]}
    try:
        known = by_period(DriveSimulation(scene, who, **settings))
    except SceneError as refused:
        tally.count(f"refused: {refused.code}")
        return
    tally.count("steps", max(len(known.t) - 1, 0))
    tally.count(known.outcome.value)
    run = DriveSimulation(scene, who, **settings)
    tally.count("compiled" if supported(run) else "left to the loop")
    for how, made in (
        ("compiled", run.run()),
        ("in pieces", by_pieces(DriveSimulation(scene, who, **settings), rng)),
    ):
        where = difference(made, known)
        if where:
            tally.fail(number, f"{how} and period by period the drives differ in {where}", **data)
