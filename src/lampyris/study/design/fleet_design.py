"""Studies of fleets: maps x fleets x numbers of robots x seeds x planners of fleets, from a study file.

A fleet is a list of robots; each number of robots is the first so many of it, as the MovingAI benchmark has it. Robots may
drive their plans (``execute``), or get new tasks continually (``lifelong``); sizes of cells, radii and chances of delays are
swept as numbers of robots are.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any

from lampyris import fleets
from lampyris.errors import FileError, LampyrisError
from lampyris.fleet_drives import robots_of
from lampyris.io.fleet_files import read_scen_fleet
from lampyris.io.maps.coarse import coarse_cell, coarse_fleet, coarse_grid
from lampyris.io.maps.load import load_map
from lampyris.io.scenario.robot_table import robot_of
from lampyris.io.scenario.validation_errors import Document
from lampyris.io.text.strict_yaml import KeyPath, shown
from lampyris.lifelong import keeps_apart
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.model.settings.inflation import Inflation
from lampyris.planning.fleet import registry
from lampyris.sim.fleet.lifelong import PLANNERS
from lampyris.study.design import schema as form
from lampyris.study.design.config import Made, Tried, planners_of
from lampyris.study.design.study import (
    ROBOTS,
    Config,
    Study,
    StudyMap,
    StudyTraffic,
    World,
    canonical,
    fleet_query,
)
from lampyris.study.design.study_size import check_size, name_of
from lampyris.study.design.worlds import Worlds, listed_queries, scen_files, spread

MOVES = "four-connected"
LIMITS = ("radius", "drive", "v_max", "a_max", "d_max", "yaw_rate_max")
"""Settings of a robot that drives which count in a fleet."""
_ALONE = ("laws", "traffic", "ticks", "patience", "drive", "preset", "inflation", "sensors")
"""Keys of studies of one robot."""


def fleet_study(parsed: Document, file: form.StudyFile, files: Any, has_folder: bool) -> Study:
    """The study of fleets that a file says; see :func:`lampyris.study.design.study_file.load_study`.

    Raises
    ------
    LampyrisError : the first mistake in the file; the others are its notes.
    """
    tried = Tried(parsed)
    for key in _ALONE:
        if key in file.model_fields_set and getattr(file, key) is not None:
            tried.refuse((key,), FileError("KEY", f"`{key}` with kind fleet", allowed="with one robot"))
    numbers = _numbers(file, tried)
    radii = _several(file.radius, "radius", tried)
    if radii and file.robot.model_fields_set & {"radius", "footprint", "rectangle"}:
        tried.refuse(
            ("radius",), FileError("KEY", "`radius` together with the size in `robot`", allowed="one of them")
        )
    moves = MOVES if file.moves is None else file.moves
    planners = planners_of(file.planners, tried, fleets=True)
    budget = file.budget if "budget" in file.model_fields_set else None
    if budget is not None and not budget.model_fields_set:
        fault = FileError("BUDGET", "an empty table", allowed="expansions, seconds or both; null: no limit")
        tried.refuse(("budget",), fault)
    if budget is None:
        _check_endless(planners, tried)
    robot = tried(("robot",), robot_of, file.robot.model_dump()) or Robot()
    drive = _drive(file, planners, moves, tried)
    if "lifelong" in drive and budget is not None and budget.expansions is not None:
        fault = FileError("KEY", "`expansions` with `lifelong`", allowed="seconds, of the whole run")
        tried.refuse(("budget", "expansions"), fault)
    delayed = _delays(file, drive, tried)
    sizes_of = [value for value, _ in radii] or [0.0]
    rates: list[float | None] = [rate for rate, _ in delayed]
    cases = tuple(
        StudyTraffic(ROBOTS, count, rate, radius)
        for count, radius, rate in product(numbers, sizes_of, rates or [None])
    )
    many = file.seeds if isinstance(file.seeds, int) else len(file.seeds)
    if isinstance(file.seeds, list):
        numbered: Made[int] = [(seed, ("seeds", k)) for k, seed in enumerate(file.seeds)]
        tried.each_once(numbered, lambda seed: seed, "DUPLICATE", "the same seed a second time")
    if tried.faults:
        tried.faults.give()
    sizes = {"seeds": many, "planners": len(planners), "numbers of robots": len(cases)}
    check_size(parsed, sizes)
    large = replace(robot, footprint=None, radius=max(value for value, _ in radii)) if radii else robot
    reader = FleetWorlds(files, tried, large, moves, file.seed, has_folder, max(numbers))
    reader.sizes = _several(file.cell, "cell", tried)
    worlds = reader.of(file.maps)
    if not tried.faults:
        place: KeyPath = max(radii)[1] if radii else ("robot",)
        _check_robots(worlds, planners, large, place, moves, drive, tried)
    if tried.faults:
        tried.faults.give()
    check_size(parsed, {"fleets": len(worlds), **sizes})
    return Study(
        name=name_of(parsed, file),
        kind="fleet",
        worlds=tuple(w for w, _ in worlds),
        planners=tuple(w for w, _ in planners),
        laws=(Config("none"),),
        traffic_cases=cases,
        seeds=tuple(range(many)) if isinstance(file.seeds, int) else tuple(file.seeds),
        moves=moves,
        robot={key: getattr(robot, key) for key in LIMITS}
        if "execute" in drive
        else {"radius": robot.radius},
        drive=drive,
        expansions=None if budget is None else budget.expansions,
        seconds=None if budget is None else budget.seconds,
        root=file.seed,
        memory=file.memory,
        about=" ".join(file.about.split()),
        notes=(*_idle(file.robot, LIMITS if "execute" in drive else LIMITS[:2]), *reader.notes),
    )


def _idle(robot: Any, kept: Sequence[str]) -> tuple[str, ...]:
    """A sentence on limits of the robot that have no effect."""
    idle = sorted(robot.model_fields_set - {*kept, "footprint", "rectangle"})
    why = "fleets know no such limit" if len(kept) > 2 else "the fleets of this study do not drive"
    return (f"robot: {', '.join(idle)} without effect: {why}",) if idle else ()


def _several(given: Any, key: str, tried: Tried) -> Made[float]:
    """The values of a key that takes one or several, with their places; none where it is not given."""
    if given is None:
        return []
    if not isinstance(given, list):
        return [(float(given), (key,))]
    made: Made[float] = [(float(value), (key, k)) for k, value in enumerate(given)]
    tried.each_once(made, lambda value: value, "DUPLICATE", "the same value a second time")
    return made


def _delays(file: form.StudyFile, drive: Mapping[str, Any], tried: Tried) -> Made[float]:
    """The chances of delays that are compared, with their places."""
    delayed = _several(file.delays, "delays", tried)
    if delayed and file.execute is None:
        tried.refuse(
            ("delays",), FileError("KEY", "`delays` of robots that do not drive", allowed="with `execute`")
        )
    elif (
        delayed
        and drive
        and drive["execute"]["settings"]["policy"] == "orca"
        and any(rate for rate, _ in delayed)
    ):
        tried.refuse(
            ("delays",), FileError("KEY", "`delays` with orca", allowed="policy: order; orca knows no delays")
        )
    return delayed


def _drive(file: form.StudyFile, planners: Made[Config], moves: str, tried: Tried) -> dict[str, Any]:
    """How the robots drive, as a study holds it; empty: they do not."""
    if file.execute is not None and file.lifelong is not None:
        fault = FileError("KEY", "`lifelong` together with `execute`", allowed="one of them")
        tried.refuse(("lifelong",), fault)
        return {}
    if file.execute is not None:
        given: dict[str, Any] = file.execute.model_dump()
        delays = tried(("execute", "delays"), lambda: Delays(**given.pop("delays")))
        settings = tried(("execute",), FleetDriveSettings.of, given)
        if delays is None or settings is None:
            return {}
        if settings.policy == "orca" and delays.probability:
            fault = FileError("KEY", "`delays` with orca", allowed="policy: order; orca knows no delays")
            tried.refuse(("execute", "delays"), fault)
        return {"execute": {"settings": asdict(settings), "delays": asdict(delays)}}
    if file.lifelong is None:
        return {}
    if moves != MOVES:
        tried.refuse(("moves",), FileError("MOVES", f"{moves} with `lifelong`", allowed=MOVES))
    for planner, place in planners:
        made = registry.make(planner.name, {})
        if planner.name not in PLANNERS:
            fault = FileError("PLANNER", f"{planner.name} plans no windows", allowed=", ".join(PLANNERS))
            tried.refuse(place, fault)
        elif any(getattr(made, key) != value for key, value in planner.settings.items()):
            fault = FileError(
                "KEY", "settings of a planner of windows", allowed="its name alone, with `lifelong`"
            )
            tried.refuse(place, fault)
    return {"lifelong": {"ticks": file.lifelong.ticks, "window": file.lifelong.window}}


def _numbers(file: form.StudyFile, tried: Tried) -> list[int]:
    given = file.robots
    if given is None:
        fault = FileError("KEY", "`robots` is missing", allowed="a number of robots, or a list of them")
        tried.refuse((), fault)
        return [1]
    if isinstance(given, int):
        return [given]
    numbered: Made[int] = [(count, ("robots", k)) for k, count in enumerate(given)]
    tried.each_once(numbered, lambda count: count, "DUPLICATE", "the same number a second time")
    return list(given)


def _check_endless(planners: Made[Config], tried: Tried) -> None:
    """Planners that may search until the memory is full need a limit."""
    for planner, key_path in planners:
        traits = registry.planner_class(planner.name).traits
        if traits.optimal or traits.bounded:
            fault = FileError(
                "BUDGET", f"{planner.name} without a budget: its search may not end",
                allowed="budget: {expansions: N}, {seconds: S} or both",
            )  # fmt: skip
            tried.refuse(key_path, fault)


def _check_robots(
    worlds: Made[World], planners: Made[Config], robot: Robot, at: KeyPath, moves: str, drive: Mapping[str, Any],
    tried: Tried,
) -> None:  # fmt: skip
    """See that each planner plans for such robots and such moves, on every map, and that they can drive; ``at``: their place."""
    seen: set[tuple[str, float]] = set()
    for world, _ in worlds:
        for planner, key_path in planners:
            mark = (canonical([planner.name, dict(planner.settings)]).decode(), world.ground.grid.resolution)
            if mark in seen or world.fleet is None:
                continue
            seen.add(mark)
            x, y, *goal = world.fleet.ends[0].tolist()
            one = tried(at, Fleet, world.ground.grid, [Agent((x, y), (goal[0], goal[1]), robot)])
            if one is None:
                return
            if "execute" in drive and robot.radius and tried(at, robots_of, one, None, moves) is None:
                return
            if "lifelong" in drive and tried(at, keeps_apart, one) is None:
                return
            made = registry.make(planner.name, planner.settings)
            tried(key_path, fleets.check_known, made, one, moves)


class FleetWorlds(Worlds):
    """Makes the worlds of a study of fleets: maps with fleets that are drawn, listed, or of MovingAI benchmarks.

    Parameters
    ----------
    files, tried, robot, moves, root, has_folder : see :class:`Worlds`.
    most : robots that each fleet must have.
    """

    def __init__(
        self, files: Any, tried: Tried, robot: Robot, moves: str, root: int, has_folder: bool, most: int
    ) -> None:
        super().__init__(files, tried, robot, moves, Inflation(), root, has_folder)
        self.most = most
        self.sizes: Made[float] = []
        """Sides of larger cells, metres; none: those of the maps."""

    def _map(self, spec: Any, key_path: KeyPath) -> None:
        if isinstance(spec, form.StudyFileMap):
            self._need_folder()
        queries: Any = "stored" if isinstance(spec, str) else spec.queries
        _, drawn, _ = self._read(spec, key_path)
        for ground in self._grounds(drawn, key_path):
            self._queries(spec, queries, ground, drawn.grid, key_path)

    def _grounds(self, ground: StudyMap, key_path: KeyPath) -> list[StudyMap]:
        """The map in each size of cells."""
        made = []
        for size, place in self.sizes:
            grid = self.tried(place, coarse_grid, ground.grid, size)
            if grid is not None:
                name = ground.name if grid is ground.grid else f"{ground.name}, cells of {size:.6g} m"
                made.append(ground if grid is ground.grid else self._ground(name, grid, key_path))
        return made if self.sizes else [ground]

    def _queries(self, spec: Any, queries: Any, ground: StudyMap, fine: Grid, key_path: KeyPath) -> None:
        """The fleets on a map; ``fine``: the map before its cells were made larger."""
        at = (*key_path, "queries")
        if isinstance(queries, form.RandomTable):
            for key in ("least", "headings"):
                if key in queries.model_fields_set and getattr(queries, key):
                    self.tried.refuse(
                        (*at, key), FileError("KEY", f"`{key}` of fleets", allowed="{random: N}")
                    )
            numbers = spread(range(queries.random), spec.limit)
            for k in numbers:
                drawn = self.tried(at, self._drawn_fleet, ground, k)
                if drawn is None:
                    return
                self._keep(ground, drawn, f"random {k}", at)
        elif queries == "stored":
            raise FileError(
                "QUERIES", f"map {shown(ground.name)} has no fleets of its own",
                allowed="queries: {random: N}, the robots of one fleet as a list of {start: [x, y], goal: [x, y]}, or "
                "an entry with scen",
            )  # fmt: skip
        else:
            ends = []
            for start, goal, place in listed_queries(queries, fine, at):
                if start.pose is not None or goal.pose is not None:
                    fault = FileError(
                        "KEY", "a heading of a robot of a fleet", allowed="[x, y] or {m: [x, y]}"
                    )
                    self.tried.refuse(place, fault)
                cells = (coarse_cell(end.cell, fine, ground.grid) for end in (start, goal))
                ends.append(tuple(number for cell in cells for number in cell))
            if len(ends) < self.most:
                self.tried.refuse(at, self._too_few(len(ends)))
                return
            listed = self.tried(at, self._fleet, ground, ends)
            if listed is not None:
                self._keep(ground, listed, "listed", at)

    def _drawn_fleet(self, ground: StudyMap, k: int) -> Fleet:
        seed = hashlib.sha256(canonical([self.root, "fleets", ground.hash, k])).digest()
        robot = self.robot if self.robot.radius else None
        return fleets.random_fleet(
            ground.grid, self.most, seed=int.from_bytes(seed[:8], "big") >> 1, robot=robot
        )

    def _fleet(self, ground: StudyMap, ends: Sequence[tuple[int, int, int, int]]) -> Fleet:
        robot = self.robot if self.robot.radius else None
        return Fleet(ground.grid, [Agent((a, b), (c, d), robot) for a, b, c, d in ends])

    def _keep(self, ground: StudyMap, fleet: Fleet, name: str, key_path: KeyPath) -> None:
        query = fleet_query(name, [(*one.start, *one.goal) for one in fleet.robots])
        first = fleet.robots[0]
        self._add(World(ground, first.start, first.goal, fleet=query), key_path)

    def _too_few(self, there: int) -> LampyrisError:
        return FileError(
            "ROBOTS", f"a fleet of {there:,}; `robots` asks for {self.most:,}", allowed="as many as the smallest fleet has",
            todo="ask for fewer, or make a study of its own for the larger fleets",
        )  # fmt: skip

    def _benchmarks(self, spec: form.ScenTable, key_path: KeyPath) -> None:
        self._need_folder()
        path = self.files.path(spec.scen, (*key_path, "scen"))
        chosen = None if spec.map is None else self.files.path(spec.map, (*key_path, "map"))
        for one in spread(scen_files(path), spec.limit):
            found = load_map(self._map_for(one, chosen, key_path), max_cells=self.files.max_cells)
            drawn = self._ground(found.grid.name, found.grid, key_path)
            try:
                read = read_scen_fleet(one, found, self.most)
            except LampyrisError as fault:
                if fault.code == "SCEN_LINES":
                    fault.todo = "ask for fewer `robots`, or make a study of its own for the larger fleets"
                self.tried.refuse((*key_path, "scen"), fault)
                continue
            self.notes += read.notes
            for ground in self._grounds(drawn, key_path):
                coarse = self.tried((*key_path, "scen"), self._on, read.fleet, ground)
                if coarse is not None:
                    fleet = self._fleet(ground, [(*robot.start, *robot.goal) for robot in coarse.robots])
                    self._keep(ground, fleet, Path(one).stem, key_path)

    @staticmethod
    def _on(fleet: Fleet, ground: StudyMap) -> Fleet:
        """The fleet in the cells of a map."""
        return fleet if fleet.grid.resolution == ground.grid.resolution else coarse_fleet(fleet, ground.grid)
