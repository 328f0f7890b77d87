"""Relations among obstacles, between a robot and a quicker one, and between names for one thing."""

from __future__ import annotations

import math
import os
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from lampyris import api
from lampyris.errors import SettingError
from lampyris.io.maps.load import load_map
from lampyris.io.maps.save import save_map
from lampyris.model.change import Change, ObstacleTrack
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.planning.spacetime.sipp import Sipp
from lampyris.planning.spacetime.space_time_astar import SpaceTimeAStar
from lampyris.typing import Cell
from lampyris_selfcheck.checks.changes.metamorphic_draw import (
    CaseResult,
    ask,
    data,
    differ,
    drawn,
    exact_name,
    field_of,
    loose_name,
)
from lampyris_selfcheck.checks.changes.reuse_life import essence
from lampyris_selfcheck.checks.paths.answers import planner

TIMED: tuple[Planner, ...] = (Sipp(margin=0), SpaceTimeAStar(margin=0))
RNG = np.random.default_rng(0)
"""Never drawn from: these planners are deterministic."""
ROUNDING = 1e-9
"""Share by which a time may rise that should not: sums of thousands of rounded steps."""
FORMATS = (".txt", ".png", ".npy", ".csv", ".pgm", ".map")
LIMITS = ("v_max", "a_max", "d_max")


def _track(rng: np.random.Generator, scene: Scene) -> tuple[Cell, ...]:
    """Somebody's way from anywhere but the robot's start."""
    width, height = scene.grid.width, scene.grid.height
    x, y = int(rng.integers(width)), int(rng.integers(height))
    track = []
    for dx, dy in rng.integers(-1, 2, (int(rng.integers(1, 12)), 2)).tolist():
        x, y = min(max(x + dx, 0), width - 1), min(max(y + dy, 0), height - 1)
        track.append((x, y))
    return tuple(track)


def _plan(chosen: Planner, scene: Scene, bodies: tuple[ObstacleTrack, ...]) -> Plan:
    return chosen.open(scene, RNG).plan(Change(robot=scene.start, obstacle_tracks=bodies))


def _arrival(plan: Plan) -> int | None:
    return None if plan.schedule is None else int(plan.schedule[-1])


def mover_more(rng: np.random.Generator, number: int) -> CaseResult:
    """A moving obstacle more: the arrival is no earlier."""
    scene = drawn(rng, most=12)
    chosen = TIMED[number % 2]
    bodies = tuple(ObstacleTrack(k, _track(rng, scene), 0, 1) for k in range(int(rng.integers(0, 6))))
    first = _plan(chosen, scene, bodies)
    before = _arrival(first)
    track = _track(rng, scene)
    if first.path is not None and len(first.path.cells) > 2 and rng.random() < 0.8:
        # It comes to meet the robot: along its way, backwards.
        way = [(int(x), int(y)) for x, y in first.path.cells[1:].tolist()]
        track = tuple(way[::-1][int(rng.integers(len(way))) :])
    bodies = (*bodies, ObstacleTrack(9, track, 0, 1))
    after = _arrival(_plan(chosen, scene, bodies))
    wrong = ""
    if after is not None and (before is None or after < before):
        wrong = f"{chosen.name} arrives at {before}, with one obstacle more at {after}"
    word = (
        "never"
        if before is None
        else "shut out"
        if after is None
        else "later"
        if after > before
        else "as soon"
    )
    return CaseResult(word, wrong, data(scene, tracks=[b.track for b in bodies]))


def off_the_way(rng: np.random.Generator, number: int) -> CaseResult:
    """Obstacles and walls off the swept corridor of a cheapest way change nothing."""
    scene = drawn(rng)
    name = exact_name(number)
    whole = ask(name, scene)
    if whole.word != "found":
        return CaseResult(whole.word, "", data(scene))
    grid = scene.grid
    # Whatever a step may touch: as far as the longest step, and the robot's body.
    far = 2 + int(scene.robot.radius / grid.resolution + 1)
    swept = np.zeros(grid.blocked.shape, dtype=np.bool_)
    for x, y in whole.cells:
        swept[max(0, y - far) : y + far + 1, max(0, x - far) : x + far + 1] = True
    more = ~swept & (rng.random(swept.shape) < rng.choice([0.1, 0.5, 1.0]))
    walled = replace(scene, grid=replace(grid, blocked=grid.blocked | more))
    wrong = differ(name, whole, ask(name, walled))
    bodies = frozenset((int(x), int(y)) for y, x in np.argwhere(more))
    plan = planner(name).open(scene, RNG).plan(Change(obstacles=bodies))
    cost = None if plan.path is None else plan.path.exact * (63 // plan.path.moves.scale)
    if not wrong and cost != whole.cost:
        wrong = f"{name}: costs {whole.cost}, with obstacles off the way {cost}"
    (x, y) = scene.start
    if not wrong and int(field_of(walled)[y, x]) != whole.cost:
        wrong = "the field's cost of the start is another with walls off the way"
    timed = TIMED[number % 2]
    alone = _plan(timed, scene, ())
    if not wrong and alone.path is not None and bodies:
        near = {(int(x), int(y)) for x, y in alone.path.cells.tolist()}
        standing = sorted(c for c in bodies if all(max(abs(c[0] - x), abs(c[1] - y)) > far for x, y in near))
        seen = tuple(ObstacleTrack(k, (c,), 0, 1) for k, c in enumerate(standing[:40]))
        if _arrival(_plan(timed, scene, seen)) != _arrival(alone):
            wrong = f"{timed.name} arrives at another tick with obstacles off its way"
    return CaseResult("nothing added" if not bodies else "added", wrong, data(scene, added=sorted(bodies)))


def quicker(rng: np.random.Generator, number: int) -> CaseResult:
    """A robot with a greater v_max, a_max or d_max does not take longer."""
    scene = drawn(rng, most=14)
    limits = {name: float(rng.choice([0.1, 0.3, 0.7, 1.0, 2.5])) for name in LIMITS}
    robot = replace(Robot(radius=0.0, a_lat_max=float(rng.choice([0.5, 2.0]))), **limits)  # type: ignore[arg-type]
    scene = replace(scene, robot=robot)
    plan = planner(exact_name(number)).open(scene, RNG).plan()
    if plan.path is None or len(plan.path.cells) < 2:
        return CaseResult("no way to drive", "", data(scene))
    what = LIMITS[int(rng.integers(3))]
    better = replace(robot, **{what: getattr(robot, what) * float(rng.choice([1.01, 1.5, 4.0]))})
    law = ("physical", "optimum")[number // 2 % 2]
    told = data(scene, limits=limits, raised=what, to=getattr(better, what), law=law)
    times, refused = [math.inf, math.inf], ["", ""]
    for k, one in enumerate((robot, better)):
        try:
            times[k] = api.speed_profile(replace(scene, robot=one), plan, law).duration
        except SettingError as error:
            refused[k] = error.code
    if any(refused):
        wrong = "" if refused[0] else f"{law}: {refused[1]} with a greater {what}, and {times[0]!r} s without"
        return CaseResult(f"refused: {refused[0] or refused[1]}", wrong, told)
    wrong = ""
    if times[1] > times[0] * (1 + ROUNDING):
        wrong = f"{law}: {times[0]!r} s, and with a greater {what} {times[1]!r} s"
    word = f"{what}: " + ("quicker" if times[1] < times[0] * (1 - ROUNDING) else "as quick")
    return CaseResult(word, wrong, told)


def relabel(rng: np.random.Generator, number: int) -> CaseResult:
    """Other numbers and another order of movers, another format of the map's file: the same answer."""
    scene = drawn(rng, most=12, terrain=False)
    data_of = data(scene)
    name = loose_name(number) or exact_name(number)
    suffix = FORMATS[number % len(FORMATS)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"m{suffix}"
        save_map(scene.grid, os.fspath(path))
        read = replace(scene, grid=replace(load_map(os.fspath(path)).grid, resolution=1.0))
    one, two = (planner(name).open(s, np.random.default_rng(0)).plan() for s in (scene, read))
    if essence(one) != essence(two):
        return CaseResult(suffix, f"{name}: another answer on the map read from {suffix}", data_of)
    bodies = [ObstacleTrack(k, _track(rng, scene), 0, 1) for k in range(int(rng.integers(2, 6)))]
    mixed = tuple(
        replace(bodies[k], obstacle=90 - i) for i, k in enumerate(rng.permutation(len(bodies)).tolist())
    )
    timed = TIMED[number % 2]
    one, two = (_plan(timed, scene, some) for some in (tuple(bodies), mixed))
    wrong = "" if essence(one) == essence(two) else f"{timed.name}: another answer with obstacles renamed"
    return CaseResult(suffix, wrong, {**data_of, "tracks": [b.track for b in bodies]})
