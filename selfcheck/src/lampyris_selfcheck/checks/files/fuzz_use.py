"""Mutated inputs that are read *and used*: planned on, timed, simulated, driven, each within limits.

A case reads one mutated input (a map, a path, what moves, zones, a scenario, or the options of a robot and
its law), draws the rest (ends, robot, planner, law) and does one verb with it through the public calls, the
referee with them. What comes is an answer or a typed error, within :data:`CPU_S` and :data:`MEMORY`.

Memory is judged by the peak of resident memory, not by the size of the address space: compiled code and its
compiler map far more than they touch. An address space of :data:`SPACE` more than there was is the limit that
ends what runs away before it takes the machine along.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from lampyris import api
from lampyris.errors import LampyrisError
from lampyris.io.fleet_scenario.scenario import FleetScenario
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris.io.maps.zones import read_zones
from lampyris.io.paths import read_path_points
from lampyris.io.scenario.scenario import PRESETS
from lampyris.io.tracks.csv_tracks import read_track
from lampyris.io.tracks.obstacle_states import read_obstacle_states
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, ObstacleSpec, RandomWalk, Recorded
from lampyris.motion.geometry.deviation import deviation
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.compare import compare
from lampyris.planning import registry
from lampyris.report.data.serialize import plan_record, profile_record, trace_record
from lampyris.scenarios import load_scenario
from lampyris.scenarios import run as run_scenario
from lampyris.typing import Cell
from lampyris_selfcheck.checks.files.fuzz_valid import must, words
from lampyris_selfcheck.reference.files import corpora, use_files
from lampyris_selfcheck.reference.files.mutator import NUMBERS, Corpus, pick

CPU_S = 10.0
"""CPU seconds that no case may take."""
BREAK_S = 40.0
"""CPU seconds after which a case is broken off."""
MEMORY = 2**30
"""Bytes that no case may take."""
SPACE = 3 * 2**30
"""Bytes of address space that a case may ask for beyond what the process has."""

LIMITS = {"MEMORY": 1024, "NODES": 50_000, "TICKS": 2_000, "DECISIONS": 10_000}
"""Limits of use (:mod:`lampyris._core.limits`) that keep a case within its time; see docs/performance.md."""

KINDS: Mapping[str, str] = {
    "use-map": "a mutated map of each format: planned on, timed, simulated, driven",
    "use-path": "a mutated path (CSV, ROS, a plan's JSON): made a curve and timed by the laws",
    "use-beside": "mutated tracks, obstacles and zones beside a good map: timed, simulated, driven",
    "use-scenario": "a mutated scenario, run as long as it says",
    "use-robot": "odd numbers for the robot, the spacing, the law's settings and the obstacles",
}
SEVERAL = 0.3
"""Share of cases in which the robot is drawn from the ends of its ranges."""


@contextmanager
def limits_of_use() -> Iterator[None]:
    """Our own limits, as documented for strangers' files, are those of :data:`LIMITS`."""
    before = dict(os.environ)
    os.environ.update({f"LAMPYRIS_MAX_{name}": str(most) for name, most in LIMITS.items()})
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


class User:
    """Does one case after another in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for file, data in {**corpora.SCENARIO_BESIDE, **use_files.BESIDE}.items():
            (folder / file).write_bytes(data)

    def input_of(self, kind: str, rng: np.random.Generator) -> tuple[str, bytes]:
        """The mutated file of a case: its name and its bytes; no name where none is read."""
        if kind == "use-robot":
            return "", b""
        name, corpus = pick(rng, tuple(use_files.CORPORA[kind].items()))
        return name, _small(corpus, rng)

    def use(self, kind: str, name: str, data: bytes, rng: np.random.Generator) -> str:
        """What came of it: ``refused`` when it was read, ``not used`` for a typed error later, or ``used``.

        Raises
        ------
        Exception : what should not have come.
        """
        path = self.folder / name
        if name:
            path.write_bytes(data)
        try:
            go = _READ[kind](path, rng)
        except LampyrisError as problem:
            return _typed(problem, "refused")
        try:
            go()
        except LampyrisError as problem:
            return _typed(problem, "not used")
        return "used"


def _small(corpus: Corpus, rng: np.random.Generator) -> bytes:
    """A mutant; every fifth is a good file, so that what follows its reading is tried in any case."""
    return pick(rng, corpus.seeds) if rng.random() < 0.2 else corpus.mutant(rng)


def _typed(problem: LampyrisError, word: str) -> str:
    must(problem.exit_code in (2, 3, 4, 5), f"exit code {problem.exit_code}: {problem}")
    for text in (str(problem), *getattr(problem, "__notes__", ())):
        words(text)
    return word


Go = Callable[[], None]


def _map(path: Path, rng: np.random.Generator) -> Go:
    values = "costmap" if rng.random() < 0.2 else "occupancy"
    found = load_map(path, values=values, colour="luminance" if rng.random() < 0.2 else "legend")
    resolution = None if rng.random() < 0.6 else float(10.0 ** rng.uniform(-6, 3))
    grid = found.grid if resolution is None else replace(found.grid, resolution=resolution)
    return lambda: _any_verb(_scene(grid, rng, found), rng)


def _path(path: Path, rng: np.random.Generator) -> Go:
    way = read_path_points(path, pick(rng, (None, "metres", "cells")))
    size = float(10.0 ** rng.uniform(-3, 3)) if rng.random() < 0.3 else 1.0
    grid = Grid(pick(rng, use_files.GRIDS), resolution=size)
    points = way.on(grid)

    def go() -> None:
        scene = _scene(grid, rng)
        _time(points, scene, rng, smooth=pick(rng, (None, "straight", "arcs", "none")))

    return go


def _beside(path: Path, rng: np.random.Generator) -> Go:
    grid = Grid(use_files.GRIDS[0])
    scene = _scene(grid, rng)
    if path.suffix == ".npy" or path.name.startswith("zones"):
        zones, notes = read_zones(path, grid, scene.robot.v_max)
        for note in notes:
            words(note)
        zoned = replace(scene, zones=zones)
        return lambda: _any_verb(zoned, rng)
    if path.name.startswith("movers"):
        movers = read_obstacle_states(path, grid)
        return lambda: _time(None, scene, rng, obstacle_states=movers)
    body = Recorded(read_track(path), float(rng.choice([0.0, 0.3, 2.0])))
    return lambda: _any_verb(scene, rng, (body,))


def _scenario(path: Path, rng: np.random.Generator) -> Go:
    scenario = load_scenario(path)
    if isinstance(scenario, FleetScenario):
        fleet = scenario
        return lambda: words(str(run_scenario(fleet)))
    return lambda: _told(run_scenario(scenario, record=False), scenario.scene)


def _robot(_: Path, rng: np.random.Generator) -> Go:
    size = float(10.0 ** rng.uniform(-6, 3)) if rng.random() < 0.5 else 1.0
    grid = Grid(pick(rng, use_files.GRIDS), resolution=size)
    robot = Robot(**_odd({f.name: 1.0 for f in fields(Robot)}, rng))
    scene = replace(_scene(grid, rng), robot=robot)
    law = pick(rng, tuple(laws.LAWS))
    changed = laws.with_settings(law, _odd(laws.settings_of(law), rng) if rng.random() < 0.5 else {})
    traffic = RandomWalk(int(rng.integers(0, 6)), radius=size * float(rng.choice([0.0, 0.3, 1.2])))
    verb = rng.random()

    def go() -> None:
        if verb < 0.5:
            course = api.smooth(scene, api.plan(scene, record=False), spacing=_number(rng, None))
            api.speed_profile(scene, course, changed, v0=_number(rng, 0.0))
        elif verb < 0.8:
            _told(api.simulate(scene, traffic=traffic, law=law), scene)
        else:
            api.drive(scene, traffic=traffic, law=changed)

    return go


_READ: Mapping[str, Callable[[Path, np.random.Generator], Go]] = {
    "use-map": _map,
    "use-path": _path,
    "use-beside": _beside,
    "use-scenario": _scenario,
    "use-robot": _robot,
}


def _odd(settings: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A few of the settings that are numbers, made odd; the others left out."""
    numbers = [k for k, v in settings.items() if isinstance(v, int | float) and not isinstance(v, bool)]
    some = [k for k in numbers if rng.random() < 0.3]
    return {k: _number(rng, settings[k]) for k in some}


def _number(rng: np.random.Generator, plain: Any) -> Any:
    """A number: as it is, of any size, or one of those that parsers stumble on."""
    kind = rng.random()
    if kind < 0.4:
        return plain
    if kind < 0.98:
        return float(10.0 ** rng.uniform(-6, 6)) if kind < 0.94 else float(rng.choice([0.0, 1.0, 1e7, -1.0]))
    try:
        return float(pick(rng, NUMBERS))
    except ValueError:
        return int(rng.integers(-3, 4))


def _scene(grid: Grid, rng: np.random.Generator, found: MapDocument | None = None) -> Scene:
    """Ends and a robot on a map; mostly free ends, and what the map marks."""
    free = np.flatnonzero(~grid.blocked.ravel())

    def end(marked: Cell | None) -> Cell:
        if marked is not None and rng.random() < 0.7:
            return marked
        some = free if len(free) and rng.random() < 0.95 else np.arange(grid.blocked.size)
        y, x = divmod(int(some[int(rng.integers(len(some)))]), grid.width)
        return x, y

    start, goal = end(None if found is None else found.start), end(None if found is None else found.goal)
    moves: Any = pick(
        rng, [moves for moves, _ in PRESETS.values()] + ["four-connected", "sixteen-connected", "octile"]
    )
    wide = rng.random() < SEVERAL
    size = grid.resolution
    robot = Robot(
        radius=_drawn(rng, wide, 0.0, size * float(rng.choice([0.0, 0.3, 0.5, 0.8]))),
        v_max=_drawn(rng, wide, 1e-6, size * float(rng.uniform(0.5, 4.0))),
        a_max=_drawn(rng, wide, 1e-6, size),
        d_max=_drawn(rng, wide, 1e-6, size),
        a_lat_max=_drawn(rng, wide, 1e-6, size),
        turn_radius=_drawn(rng, wide, 0.0, size * float(rng.choice([0.0, 0.0, 0.5, 3.0]))),
        jerk_max=None if rng.random() < 0.7 else _drawn(rng, wide, 1e-6, size),
    )
    return Scene(grid, start, goal, moves, robot)


def _drawn(rng: np.random.Generator, wide: bool, least: float, plain: float) -> float:
    if wide and rng.random() < 0.4:
        return float(rng.choice([least, 1e6])) if rng.random() < 0.2 else float(10.0 ** rng.uniform(-6, 6))
    return float(min(max(plain, least), 1e6))


def _any_verb(scene: Scene, rng: np.random.Generator, traffic: tuple[ObstacleSpec, ...] = ()) -> None:
    """Plan, time, simulate or drive."""
    if rng.random() < 0.5:
        some: tuple[ObstacleSpec, ...] = (RandomWalk(3), RandomWalk(2, radius=0.3), Crossing(2))
        traffic = (*traffic, pick(rng, some))
    planner = "ad-gso" if rng.random() < 0.4 else pick(rng, registry.names())
    verb = rng.random()
    if verb < 0.4:
        found = api.plan(scene, planner, record=False)
        profile = api.speed_profile(scene, found) if found.path is not None else None
        plan_record(found, scene, profile)
    elif verb < 0.6:
        _time(None, scene, rng)
    elif verb < 0.9:
        _told(api.simulate(scene, planner, traffic=traffic), scene)
    else:
        api.drive(scene, planner, traffic=traffic)


def _time(
    points: Any,
    scene: Scene,
    rng: np.random.Generator,
    *,
    smooth: Any = None,
    obstacle_states: ObstacleStates | None = None,
) -> None:
    """What ``speed`` does: a curve along a path, and some laws on it."""
    if points is None:
        found = api.plan(scene, record=False)
        if found.path is None:
            return
        points = found.path.cells.astype(np.float64)
        course = api.smooth(scene, found, method=smooth)
    else:
        course = api.smooth(scene, points, method=smooth)
    deviation(points, course.xy, 0.25)
    chosen = [name for name in laws.LAWS if rng.random() < 0.4] or ["physical"]

    def make(law: laws.SpeedLaw) -> Any:
        return api.speed_profile(scene, course, law, obstacle_states=obstacle_states)

    refused: dict[str, str] = {}
    for entry in compare(course, scene, chosen, make=make, refused=refused):
        profile_record(entry.profile, caps=True)


def _told(done: Any, scene: Scene) -> None:
    """What a verb prints of it, where it is long."""
    if hasattr(done, "obstacles_at"):
        trace_record(done)
    elif hasattr(done, "plan"):
        plan_record(done.plan, scene, done.profile)
