"""Compile every kernel ahead of time, and keep the machine code on disk.

Small jobs of every kind run once in plain form, and the types of the arguments that each kernel met are
noted. That is what is compiled: no list of signatures has to be kept up by hand, and a test holds the jobs
against every kernel there is and against what planning, simulating and driving ask for.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import pkgutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lampyris import api, chains, curves, fleet_drives, fleets, kernels, lifelong, swarms
from lampyris.errors import FileError, LampyrisError, UsageError
from lampyris.kernels import _jit, _machine, kept_code
from lampyris.model.chain.chain import Chain
from lampyris.model.edit import Edit
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.grid import Grid, frozen
from lampyris.model.moves import MOVES
from lampyris.model.obstacles import ObstacleStates, Track
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.episodes import CellEpisodeSettings, DriveEpisodeSettings
from lampyris.model.settings.fleet_drive import OBSTACLE_INFO
from lampyris.model.settings.sensor import Sensor
from lampyris.model.settings.steering import CONTROLLERS
from lampyris.model.settings.swarm import METHODS
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.motion.laws import registry as laws
from lampyris.motion.safety.blind_areas import visible_cells
from lampyris.motion.timing.path_time import through_tracks
from lampyris.planning import registry
from lampyris.planning.base import Budget
from lampyris.planning.chain.rrt import PLANNERS
from lampyris.planning.field.cost_tables import KINDS, cost_tables
from lampyris.planning.field.layers import clearance
from lampyris.planning.field.solve import checked, fill, solve
from lampyris.planning.fleet import registry as fleet_planners
from lampyris.planning.fleet.distance_tables import wide_tables
from lampyris.planning.graph.fastest_search import FieldSearch
from lampyris.planning.graph.jps_search import JumpSearch
from lampyris.sim.episodes.cells import CellEpisodes
from lampyris.sim.episodes.drives import DriveEpisodes
from lampyris.sim.episodes.tasks import Tasks
from lampyris.study.execution.obstacle_tracks import Replay

Wanted = tuple[_jit.Kernel, tuple[Any, ...]]
"""A kernel and the numba types of its arguments."""


@dataclass(frozen=True, slots=True)
class Warmed:
    """What was done.

    Parameters
    ----------
    kernels : kernels that are called from outside of kernels; those that only kernels call are in them.
    versions : for how many lists of argument types there is machine code.
    made : how many of them were compiled now; the others had been kept.
    folders : where machine code is kept.
    size : bytes of ours in them.
    """

    kernels: int
    versions: int
    made: int
    folders: tuple[Path, ...]
    size: int


Progress = Callable[[int, int, str], None]
"""Called with how many are done, of how many, and which kernel is next."""


def warm(progress: Progress | None = None, workers: int = 1, *, rare: bool = True) -> Warmed:
    """Compile what there is not yet, or is damaged, and delete what other versions of the kernels left.

    Parameters
    ----------
    progress : called with how many are done, of how many, and which kernel is next.
    workers : processes that compile. More than one start afresh, as :mod:`multiprocessing` has it: call this under
        ``if __name__ == "__main__":`` in a script.
    rare : whether also for types that only the largest maps ask for.

    Raises
    ------
    UsageError : ``NUMBA_DISABLE_JIT`` is set, or there is no numba: nothing would be compiled.
    FileError : machine code cannot be kept on disk; everything works, but each process recompiles.
    """
    if not _jit.load_numba():
        why = _jit.why_plain()
        raise UsageError(
            "JIT",
            f"{why}, so that kernels are never compiled",
            todo="unset it, and ask again" if "is set" in why else "pip install numba",
        )
    asked = wanted(rare)
    ahead = _ahead(asked, min(workers, len(asked)), progress) if workers > 1 else 0
    try:
        made, folders = _prepare(asked, None if ahead else progress)
    except _jit.DAMAGE:
        damaged = {file for k, _ in asked for file in k.damaged()}
        if not damaged:
            raise
        for file in damaged:
            file.unlink(missing_ok=True)
        _jit.forget()
        made, folders = _prepare(asked, progress)
    if progress:
        progress(len(asked), len(asked), "")
    folders |= dict.fromkeys(folder for folder in kept_code.folders() if folder.is_dir())
    unfinished = f"*{kept_code.SUFFIX}.*.part"  # of a process that ended meanwhile
    for file in [file for folder in folders for file in (*_kept(folder), *folder.glob(unfinished))]:
        if _machine.edition() not in file.name:
            file.unlink(missing_ok=True)
    size = sum(file.stat().st_size for folder in folders for file in _kept(folder))
    return Warmed(len({k for k, _ in asked}), len(asked), ahead + made, tuple(folders), size)


def _prepare(asked: Sequence[Wanted], progress: Progress | None) -> tuple[int, dict[Path, None]]:
    """How many were compiled, and where all are kept."""
    made = 0
    folders: dict[Path, None] = {}
    for done, (kernel, types) in enumerate(asked):
        if progress:
            progress(done, len(asked), kernel.__name__)
        try:
            made += kernel.prepare(types)
        except OSError as error:
            raise _nowhere(str(error)) from None
        folder = kernel.cache_folder()
        if folder is None:
            raise _nowhere("no folder for it can be written to")
        folders[Path(folder)] = None
    return made, folders


Job = tuple[str, str, tuple[Any, ...]]
"""A kernel by its module and name, and the types of its arguments."""
GLANCE = 0.1
"""Seconds between two looks at how far the processes are."""


def _ahead(asked: Sequence[Wanted], workers: int, progress: Progress | None) -> int:
    """Compile in several processes; how many were compiled. What fails there is left to this process.

    The kernels of a folder call the same others, so one process takes them all.
    """
    folders: dict[str, list[Job]] = {}
    for kernel, types in asked:
        module = kernel.plain.__module__
        folders.setdefault(module.rpartition(".")[0], []).append((module, kernel.__name__, types))
    # Those with most to compile first: the processes then end at about the same time.
    jobs = sorted(folders.values(), key=lambda one: -sum(len(types) for *_, types in one))
    method = multiprocessing.get_context("spawn")
    taken, done, made = (method.Value("i", 0) for _ in range(3))
    others = [method.Process(target=_share, args=(jobs, taken, done, made)) for _ in range(workers)]
    for other in others:
        other.start()
    for other in others:
        while other.is_alive():
            other.join(GLANCE)
            if progress:
                progress(done.value, len(asked), "")
    return int(made.value)


def _share(jobs: Sequence[Sequence[Job]], taken: Any, done: Any, made: Any) -> None:
    """Compile one folder after another that no other process has taken."""
    while True:
        with taken.get_lock():
            k, taken.value = taken.value, taken.value + 1
        if k >= len(jobs):
            return
        for module, name, types in jobs[k]:
            new = False
            with suppress(Exception):  # the process that started this one will meet it, and say so
                new = getattr(importlib.import_module(module), name).prepare(types)
            for counter in (done, made) if new else (done,):
                with counter.get_lock():
                    counter.value += 1


def _nowhere(why: str) -> FileError:
    return FileError(
        "FILE_WRITE",
        f"compiled code cannot be kept on disk ({why})",
        where=os.environ.get("NUMBA_CACHE_DIR", ""),
        allowed="the folder of the package, the user's folder for caches, or NUMBA_CACHE_DIR",
        todo="set NUMBA_CACHE_DIR to a folder that can be written to",
    )


def _kept(folder: Path) -> list[Path]:
    return sorted({*folder.glob("*.nb[ic]"), *folder.glob(f"*{kept_code.SUFFIX}")})


def wanted(rare: bool = True) -> tuple[Wanted, ...]:
    """Every kernel, with each list of argument types that it is called with; ``rare`` as in :func:`warm`."""
    for module in pkgutil.walk_packages(kernels.__path__, f"{kernels.__name__}."):
        importlib.import_module(module.name)
    with _jit.recorded() as found:
        for job in jobs(rare):
            job()
    return tuple(found)


def jobs(rare: bool = True) -> Iterator[Callable[[], object]]:
    """Small work of every kind; ``rare`` as in :func:`warm`."""
    for moves in MOVES:
        for terrain in (False, True):
            yield partial(_fields, moves, terrain)
            for name in registry.names():
                if not registry.origin_of(name):
                    yield partial(_cells, name, moves, terrain)
        yield partial(_studied, moves)
    yield _attributes
    yield _sampled
    yield _poses
    yield _crowded
    for law in laws.names():
        yield partial(_speeds, law)
        yield partial(_driven, law)
    yield _watched
    yield partial(_fleets, rare)
    yield _fleet_drives
    yield _swarms
    yield _chains
    yield _episodes


def _grid(terrain: bool = False) -> Grid:
    """A small hall: a wall with two doors, a shelf, a gate, and a corner that nobody has seen."""
    blocked = np.zeros((12, 18), dtype=bool)
    blocked[:, 8] = True
    blocked[[3, 9], 8] = False
    blocked[5, 2:6] = True
    unknown = np.zeros_like(blocked)
    unknown[0, 14:] = True
    ground = np.where(blocked | unknown, 0, np.arange(blocked.size).reshape(blocked.shape) % 60)
    return Grid(blocked | unknown, unknown, terrain=ground.astype(np.uint8) if terrain else None)


def _scene(moves: str = "octile", *, terrain: bool = False, **more: Any) -> Scene:
    return Scene(_grid(terrain), start=(2, 2), goal=(15, 10), moves=MOVES[moves], **more)


def _fields(moves: str, terrain: bool) -> None:
    """Fields, to the end and with an early one; also by steps and prices of a caller's own."""
    scene = _scene(moves, terrain=terrain)
    kinds = [scene.moves]
    if moves == "octile":
        kinds.append(replace(scene.moves, name="own", costs=(141,) * 4 + (100,) * 4, unit=100))
    if moves == "sixteen-connected":
        own = (23,) * 4 + scene.moves.costs[4:]
        kinds.append(replace(scene.moves, name="own", costs=own))
        kinds.append(replace(kinds[-1], costs=tuple(c << 28 for c in own), unit=10 << 28))
    for kind in kinds:
        paid = kind.weighed() if terrain else kind
        for stop in (None, scene.start):
            solve(~scene.grid.blocked, paid, scene.goal, terrain=scene.grid.terrain, stop=stop)
        free, terrain_of, goal = checked(~scene.grid.blocked, scene.grid.terrain, paid, scene.goal, 0.4, 0.6)
        # As fields of large maps are laid out.
        fill(free, terrain_of, paid, goal, (0.6, 0.6, float(paid.unit)), sparing=True)
        for costs in KINDS:
            for job in (
                cost_tables(~scene.grid.blocked, paid, [scene.goal], terrain=terrain_of, kind=np.dtype(costs))
                if moves == "four-connected"
                else ()
            ):
                job()


def _cells(planner: str, moves: str, terrain: bool) -> None:
    """A plan, and a simulation among moving obstacles and walls that come and go."""
    edits = (Edit(2, blocked=((8, 3), (4, 8))), Edit(4, freed=((8, 3), (5, 5))))
    scene = _scene(moves, terrain=terrain, edits=edits, traffic=(RandomWalk(3), Crossing(1)))
    known = registry.settings_of(registry.planner_class(planner))
    if {"swarm", "particles", "samples"} & set(known) and moves != "octile":
        return  # these call the same kernels by any step set
    few: dict[str, Any] = {
        name: 2 for name in ("swarm", "iterations", "particles", "rounds") if name in known
    }
    if "samples" in known:
        few["samples"] = 400
    with suppress(LampyrisError):  # not every planner serves every step set and ground
        api.plan(scene, planner, **few)
        api.simulate(scene, planner, ticks=6, **few)
        if planner == "astar":
            api.simulate(replace(scene, edits=()), planner, ticks=12, sensor=Sensor(4.0))
        if planner == "ad-gso":
            api.plan(scene, planner, gates="replan", choice="exact")


def _attributes() -> None:
    """Room to walls, and AD-GSO that considers more than length."""
    scene = _scene()
    clearance(scene.grid)
    api.plan(scene, "ad-gso", obstacle_density_weight=1.0, min_clearance=1)
    api.plan(_scene(robot=Robot(radius=0.6)), "astar")


def _sampled() -> None:
    """Samplers that start from a path of the grid, and whose turns leave cell centres, for points and discs."""
    for scene in (_scene(), _scene("dissertation"), _scene(robot=Robot(radius=0.6))):
        for planner in ("rrt-star", "bit-star"):
            api.plan(scene, planner, seeded=True, turns="anywhere", samples=200)


def _episodes() -> None:
    """A few actions of episodes on cells and in continuous time."""
    tasks = Tasks.of(_scene(), 2, True, 0)
    cells = CellEpisodes(tasks, 2, CellEpisodeSettings())
    cells.begin()
    cells.step(cells.best_actions())
    drives = DriveEpisodes(tasks, 2, DriveEpisodeSettings())
    drives.begin()
    drives.step(np.ones((2, 2)))


def _poses() -> None:
    """A lattice, searched once and improved, from between its poses, to several; its poses driven, and what the footprint comes
    near to; pad, hybrid A*, curves."""
    robot = Robot(footprint=((0.9, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.9, -0.3)))
    scene = _scene(robot=robot, traffic=(RandomWalk(2), Patrol(((12, 3), (12, 9)))))
    plan = api.plan(scene, "lattice", anytime=True, weight=3.0)
    api.speed_profile(scene, plan)
    api.plan(_scene(robot=robot), "pad", weight=1.0)
    wide = Scene(
        Grid(np.zeros((130, 130), dtype=bool)),
        start_pose=(20.5, 20.5, 0.0),
        goal_pose=(110.5, 110.5, 0.0),
        robot=replace(robot, drive="ackermann", turn_radius=2.0),
    )
    api.plan(wide, "lattice", weight=1.5)
    for begin, end, tolerance in (
        ((8.5, 8.5, 0.0), (20.5, 20.5, 0.0), 1.5),
        ((8.3, 8.6, 0.1), (20.2, 20.4, 0.3), 0.0),
    ):
        small = Scene(Grid(np.zeros((30, 30), dtype=bool)), start_pose=begin, goal_pose=end, robot=wide.robot)
        api.plan(small, "lattice", goal_tolerance=tolerance)
    passing = Recorded(tuple((12, y) for y in (2, 3, 4, 5, 6, 7, 8)))
    api.plan(_scene(robot=robot, traffic=(passing,)), "lattice-sipp")
    late: dict[str, Any] = {"tracking": "velocity", "delay": 0.1}
    x, y = scene.start
    onto = replace(scene, traffic=(Recorded(tuple((x + k, y) for k in (3, 2, 1, 0))),))
    polygon = replace(onto, traffic=(replace(onto.traffic[0], footprint=robot.footprint),))
    for there, more in ((scene, {}), (scene, late), (onto, {}), (polygon, {})):
        with suppress(LampyrisError):
            api.drive(there, "lattice", time_limit=3.0, **more)
    for controller in CONTROLLERS:
        few = {"samples": 10} if controller == "mppi" else {}
        api.drive(scene, "lattice", time_limit=0.5, controller=controller, controller_settings=few)
    for drive in DRIVES:
        turned = _scene(robot=replace(robot, drive=drive, turn_radius=1.0))
        api.plan(turned, "hybrid-astar")
        api.plan(turned, "pose-rrt-connect", samples=400)
        api.plan(turned, "pose-rrt-star", samples=400, rounds=3)
    for curve in (curves.dubins, curves.reeds_shepp):
        curve((0.0, 0.0, 0.0), (3.0, 1.0, 1.0), 1.0).poses(0.5)


def _crowded() -> None:
    """The planner ``fastest`` where it walks down a field, and what is seen from a cell."""
    scene = _scene()
    free = frozen(~scene.grid.blocked)
    for moves in MOVES.values():
        search = FieldSearch(free, moves, JumpSearch(free, MOVES["octile"]))
        for closed in ((), ((8, 3),)):
            search.find_path(scene.start, scene.goal, closed=closed)
    visible_cells(scene.grid, scene.start, 5.0)


def _studied(moves: str) -> None:
    """Runs as studies make them, and tracks to be replayed."""
    scene = _scene(moves, traffic=(RandomWalk(3),))
    if scene.moves.reach == 1:
        for planner in ("ad-gso", "sipp"):  # those that answer with their next steps alone
            api.simulate(scene, planner, ticks=12)
    else:
        api.simulate(scene, "sipp", ticks=6)  # asked tick by tick
    Replay(scene, 1).upto(10)


def _fleets(rare: bool) -> None:
    """A fleet, by each planner of fleets, also with tables of long distances if asked; and discs larger than cells."""
    grid = _grid()
    disc = Robot(radius=0.5 * grid.resolution)
    for planner, row in fleet_planners.list_fleet_planners().items():
        asked = [fleets.random_fleet(grid, 8)]
        if row.traits.sizes:
            asked.append(Fleet(grid, [Agent((1, 1), (1, 9), disc)]))
        for fleet in asked:
            for tables in (nullcontext(), wide_tables()) if rare else (nullcontext(),):
                with tables:
                    fleets.plan_fleet(fleet, planner, budget=Budget(expansions=200))


def _fleet_drives() -> None:
    """A fleet that drives with delays and obstacles, a ring of robots, one that avoids by ORCA, a lifelong one."""
    fleet = fleets.random_fleet(_grid(), 6)
    for info in OBSTACLE_INFO:
        fleet_drives.simulate_fleet(
            fleet, planner="pibt", delays=Delays(0.5, 0.5), obstacles=2, obstacle_info=info, drive_limit=20.0
        )
    fleet_drives.simulate_fleet(fleet, planner="pibt", faults=[(0, 3.0)])
    square = Grid(np.zeros((2, 2), dtype=bool))
    cells = [(0, 0), (1, 0), (1, 1), (0, 1)]
    turned = Fleet(square, [Agent(a, b) for a, b in zip(cells, cells[1:] + cells[:1], strict=True)])
    fleet_drives.simulate_fleet(turned, planner="pibt")
    fleet_drives.simulate_fleet(fleet, policy="orca", drive_limit=2.0)
    lifelong.lifelong_fleet(fleet, 4)


def _swarms() -> None:
    """A swarm among walls that robots of both methods meet."""
    for method in METHODS:
        swarms.swarm_robots(_grid(), robots=12, iterations=3, method=method)


def _chains() -> None:
    """A chain that turns past a wall."""
    arm = Chain((12.5, 4.5), [1.0, 0.8], 0.2)
    for planner in PLANNERS:
        chains.plan_chain(_grid(), arm, [0.3, 0.0], [0.9, 0.4], planner)


def _speeds(law: str) -> None:
    """Profiles, of the path and of a curve, with zones, obstacles and a limit of the jerk."""
    zones = np.full((12, 18), 0.5)
    for robot in (Robot(), Robot(radius=0.3, turn_radius=0.5), Robot(jerk_max=1.0)):
        scene = _scene(robot=robot, zones=zones)
        path = api.plan(scene, "astar").path
        assert path is not None
        around = ObstacleStates(np.array([[5.0, 5.0], [12.0, 4.0]]), np.full(2, 0.3), np.full(2, 0.5))
        with suppress(LampyrisError):
            laws.profile(path, scene, law=law, v0=0.9, on_infeasible="brake")
            api.speed_profile(scene, path, law)
            api.speed_profile(scene, path, law, obstacle_states=around)
        for smooth in ("straight", "arcs"):
            with suppress(LampyrisError):
                api.speed_profile(scene, path, law, smooth=smooth, obstacle_states=around)


def _driven(law: str) -> None:
    """Drives; by our own law also with corners, and where it knows whole tracks."""
    track = Recorded(tuple((12, y) for y in (2, 3, 4, 5, 6, 7, 8)))
    walkers = (RandomWalk(2), Patrol(((12, 3), (12, 9))))
    paths: list[tuple[Any, float, dict[str, Any]]] = [(walkers, 3.0, {})]
    if law == "physical":
        paths += [(walkers, 3.0, {"smooth": "none"}), ((track,), 12.0, {"obstacle_info": "tracks"})]
        x, y = _scene().start
        paths.append(((Recorded(((x + 1, y), (x, y))),), 3.0, {}))  # runs into the robot
    for traffic, limit, more in paths:
        with suppress(LampyrisError):
            api.drive(_scene(traffic=traffic), "ad-gso", law=law, time_limit=limit, **more)


def _watched() -> None:
    """Speeds through tracks that are known, and a plan with a schedule."""
    scene = _scene()
    path = api.plan(scene, "astar").path
    assert path is not None
    samples = api.smooth(scene, path)
    cap = np.full(len(samples), 1.0)
    cap[-1] = 0.0
    # It stands in the way for half a minute, and then clears off.
    places = np.stack((samples.xy[len(samples) // 2],) * 2 + (np.array([17.0, 0.0]),))
    track = Track(np.array([0.0, 30.0, 60.0]), places, 0.3, 1.0)
    through_tracks(samples, cap, scene.robot, [track])
    waiting = _scene(traffic=(Patrol(((8, 3), (12, 3))), RandomWalk(2)))
    for planner in ("sipp", "space-time-astar"):
        plan = api.plan(waiting, planner)
        api.speed_profile(waiting, plan, tick_seconds=1.0)
