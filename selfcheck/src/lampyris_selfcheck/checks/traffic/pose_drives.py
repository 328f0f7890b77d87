"""Robots with a shape and a heading among moving obstacles: no contact while moving, by the referee's footprint."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome as Ending
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.referee import check_drive
from lampyris.referee.drive import measure
from lampyris.sim.continuous.drive import drive
from lampyris.sim.traffic.adversary import Adversary
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally

LAWS = ("physical", "physical", "physical", "cloud", "three-speed", "uncertainty", "blind")
"""Laws that promise not to touch anybody while the robot moves."""

KINDS = {
    "perfect": Kind(
        "maps of 14 to 30 cells a side, robots of three drives with polygons of 3 to 8 corners, random walkers, patrols,"
        " crossing obstacles and adversaries; commands are followed at once",
        commit=4,
        nightly=7_000,
        release=70_000,
        chunk=10,
        least={"arrived": 0.3, "met": 0.3},
    ),
    "late": Kind(
        "the same with delayed commands, lag and noise",
        commit=5,
        nightly=2_000,
        release=20_000,
        chunk=10,
        least={"arrived": 0.2},
    ),
    "disc": Kind(
        "the same with a disc for a robot",
        commit=5,
        nightly=1_000,
        release=10_000,
        chunk=10,
        least={"arrived": 0.3},
    ),
}


class Case(NamedTuple):
    """A drive that is asked for."""

    scene: Scene
    planner: LatticePlanner
    settings: dict[str, Any]


def draw(rng: np.random.Generator, kind: str = "perfect") -> Case:
    """A small map, a robot on it, and everything that moves."""
    resolution = float(rng.choice([0.1, 0.25, 0.5]))
    height, width = (int(n) for n in rng.integers(14, 31, 2))
    blocked = rng.random((height, width)) < rng.choice([0.0, 0.01, 0.04])
    if rng.random() < 0.4:
        wall, door = int(rng.integers(4, width - 4)), int(rng.integers(2, height - 7))
        blocked[:, wall] = True
        blocked[door : door + int(rng.integers(3, 8)), wall] = False
    footprint = None if kind == "disc" else outline(rng, resolution)
    drives = str(rng.choice(DRIVES))
    robot = Robot(
        radius=float(rng.uniform(0.0, 1.2)) * resolution if footprint is None else 0.0,
        v_max=float(rng.uniform(0.3, 2.0)),
        a_max=float(rng.uniform(0.3, 2.0)),
        d_max=float(rng.uniform(0.4, 2.5)),
        a_lat_max=float(rng.uniform(0.3, 2.0)),
        turn_radius=float(rng.uniform(0.5, 3.0) if drives == "ackermann" else rng.choice([0.0, 1.0]))
        * resolution,
        yaw_rate_max=None if rng.random() < 0.5 else float(rng.uniform(0.3, 2.0)),
        drive=drives,
        footprint=footprint,
    )
    cells = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(2)]
    for x, y in cells:  # room to stand at either end
        reach = math.ceil(robot.radius / resolution) + 1
        blocked[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1] = False
    origin = (0.0, 0.0, float(rng.choice([0.0, 0.7])))
    grid = Grid(blocked, resolution=resolution, origin=origin)
    ends = [_pose(grid, cell, rng) for cell in cells]
    size = rng.choice([0.0, 0.45, 0.9]) * resolution
    rate = None if rng.random() < 0.7 else 0.5
    traffic: list[ObstacleSpec] = [RandomWalk(int(rng.integers(0, 6)), rate=rate, radius=float(size))]
    if rng.random() < 0.5:
        traffic.append(Crossing(int(rng.integers(1, 3))))
    if rng.random() < 0.4:
        free = np.argwhere(~blocked)
        (ya, xa), (yb, xb) = free[rng.integers(len(free), size=2)].tolist()
        traffic.append(Patrol(((xa, ya), (xb, yb))))
    scene = Scene(grid, start_pose=ends[0], goal_pose=ends[1], robot=robot, traffic=tuple(traffic))
    settings: dict[str, Any] = {
        "law": str(rng.choice(LAWS)),
        "seed": int(rng.integers(2**31)),
        "obstacle_speed": float(rng.uniform(0.2, 1.5)) * robot.v_max,
        "time_limit": 40.0,
        "give_up": 20.0,
        "patience": float(rng.choice([1.0, 3.0])),
        "on_hit": str(rng.choice(["end", "go-on"])),
    }
    if rng.random() < 0.5:
        speed, count = float(rng.uniform(0.2, 2.0)), int(rng.integers(1, 3))
        settings["sources"] = [Adversary(speed, count=count, wait=4.0)]
    if rng.random() < 0.2:
        settings["obstacle_info"] = "velocities"
    if kind == "late":
        settings["tracking"] = str(rng.choice(["velocity", "position"]))
        settings["delay"] = float(rng.uniform(0.0, 0.2))
        settings["lag"] = float(rng.uniform(0.0, 0.3))
        settings["noise"] = float(rng.choice([0.0, 0.3])) * resolution
    planner = LatticePlanner(weight=2.0, reverse=bool(rng.random() < 0.8))
    return Case(scene, planner, settings)


def _pose(grid: Grid, cell: tuple[int, int], rng: np.random.Generator) -> tuple[float, float, float]:
    at = grid.frame.to_metres(np.array(cell) + rng.uniform(-0.4, 0.4, 2))
    return float(at[0]), float(at[1]), float(rng.uniform(-3.1, 3.1))


def outline(rng: np.random.Generator, resolution: float) -> tuple[tuple[float, float], ...]:
    """A polygon around the base: a rectangle, an L, or a star-shaped one, convex or not."""
    ahead, back, side = (float(n) * resolution for n in rng.uniform((0.4, 0.3, 0.3), (2.6, 1.2, 1.1)))
    shape = int(rng.integers(3))
    if shape == 0:
        return ((ahead, side), (-back, side), (-back, -side), (ahead, -side))
    if shape == 1:
        notch = 0.5 * ahead
        return (
            (ahead, side),
            (-back, side),
            (-back, -side),
            (notch, -side),
            (notch, 0.2 * side),
            (ahead, 0.2 * side),
        )
    count = int(rng.integers(3, 9))
    turns = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * (2 * math.pi / count)
    reach = rng.uniform(0.5, 2.2, count) * resolution
    if np.diff(turns, append=turns[0] + 2 * math.pi).max() >= math.pi - 0.05:
        return ((ahead, 0.0), (-back, side), (-back, -side))
    return tuple(zip((reach * np.cos(turns)).tolist(), (reach * np.sin(turns)).tolist(), strict=True))


def driven(case: Case) -> Drive | None:
    """The drive; None where the obstacles do not fit the map."""
    try:
        return drive(case.scene, case.planner, **case.settings)
    except SceneError:
        return None


def judged(
    part: Part, draw_case: Callable[[int], Case], drive_case: Callable[[Case], Drive | None]
) -> Outcome:
    """Drive some cases and have the referee look at each.

    Parameters
    ----------
    draw_case : the case of a number.
    drive_case : the drive of a case; None: there is no room for its obstacles.
    """
    tally = Tally(part)
    for number in part.numbers:
        case = draw_case(number)
        try:
            made = drive_case(case)
        except Exception as error:
            tally.case("raised")
            tally.fail(number, f"{type(error).__name__}: {error}")
            continue
        if made is None:
            tally.case("no room")
            continue
        found = check_drive(made)
        seen = measure(made)
        met = ["met"] if math.isfinite(seen["gap"]) else []
        tally.case(made.outcome.value, *met)
        of = case.scene.robot.drive
        tally.count(f"{of}: driven")
        if made.outcome is Ending.ARRIVED:
            tally.count(f"{of}: arrived")
        if math.isfinite(seen["gap"]):
            tally.measure("least gap while moving, m", seen["gap"])
        who = f"{made.law}, {case.scene.robot.drive}"
        if found is not None:
            tally.fail(number, f"{who}: {found}")
        elif made.outcome is Ending.COLLISION:
            tally.fail(number, f"{who}: {made.detail}")
    return tally.outcome()


def run(ask: Ask, part: Part) -> Outcome:
    """Drive some cases and have the referee look at each."""
    return judged(part, lambda number: draw(ask.rng("pose-drives", part.kind, number), part.kind), driven)


CHECK = Check(
    "pose-drives",
    ("G32",),
    "a robot with a shape and a heading touches no moving obstacle while it moves, and no wall",
    KINDS,
    run,
)
