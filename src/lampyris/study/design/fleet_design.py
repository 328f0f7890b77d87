"""Studies of fleets: maps x fleets x numbers of robots x seeds x planners of fleets, from a study file.

A fleet is a list of robots; each number of robots is the first so many of it, as the MovingAI benchmark has it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lampyris import fleets
from lampyris.errors import FileError, LampyrisError
from lampyris.io.fleet_files import read_scen_fleet
from lampyris.io.maps.load import load_map
from lampyris.io.scenario.robot_table import robot_of
from lampyris.io.scenario.validation_errors import Document
from lampyris.io.text.strict_yaml import KeyPath, shown
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.robot import Robot
from lampyris.model.settings.inflation import Inflation
from lampyris.planning.fleet import registry
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
_ALONE = ("laws", "traffic", "ticks", "patience", "drive", "preset", "inflation")
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
    moves = MOVES if file.moves is None else file.moves
    planners = planners_of(file.planners, tried, fleets=True)
    budget = file.budget if "budget" in file.model_fields_set else None
    if budget is not None and not budget.model_fields_set:
        fault = FileError("BUDGET", "an empty table", allowed="expansions, seconds or both; null: no limit")
        tried.refuse(("budget",), fault)
    if budget is None:
        _check_endless(planners, tried)
    robot = tried(("robot",), robot_of, file.robot.model_dump()) or Robot()
    many = file.seeds if isinstance(file.seeds, int) else len(file.seeds)
    if isinstance(file.seeds, list):
        numbered: Made[int] = [(seed, ("seeds", k)) for k, seed in enumerate(file.seeds)]
        tried.each_once(numbered, lambda seed: seed, "DUPLICATE", "the same seed a second time")
    if tried.faults:
        tried.faults.give()
    sizes = {"seeds": many, "planners": len(planners), "numbers of robots": len(numbers)}
    check_size(parsed, sizes)
    reader = FleetWorlds(files, tried, robot, moves, file.seed, has_folder, max(numbers))
    worlds = reader.of(file.maps)
    if not tried.faults:
        _check_robots(worlds, planners, robot, moves, max(numbers), tried)
    if tried.faults:
        tried.faults.give()
    check_size(parsed, {"fleets": len(worlds), **sizes})
    return Study(
        name=name_of(parsed, file),
        kind="fleet",
        worlds=tuple(w for w, _ in worlds),
        planners=tuple(w for w, _ in planners),
        laws=(Config("none"),),
        traffic_cases=tuple(StudyTraffic(ROBOTS, count) for count in numbers),
        seeds=tuple(range(many)) if isinstance(file.seeds, int) else tuple(file.seeds),
        moves=moves,
        robot={"radius": robot.radius},
        expansions=None if budget is None else budget.expansions,
        seconds=None if budget is None else budget.seconds,
        root=file.seed,
        memory=file.memory,
        about=" ".join(file.about.split()),
        notes=(*_idle(file.robot), *reader.notes),
    )


def _idle(robot: Any) -> tuple[str, ...]:
    """A sentence on limits of the robot that plans of fleets do not keep."""
    idle = sorted(robot.model_fields_set - {"radius", "footprint", "rectangle", "drive"})
    return (f"robot: {', '.join(idle)} without effect: fleets of a study do not drive",) if idle else ()


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
    worlds: Made[World], planners: Made[Config], robot: Robot, moves: str, most: int, tried: Tried
) -> None:
    """See that each planner plans for such robots and such moves, on every map."""
    seen: set[tuple[str, float]] = set()
    for world, _ in worlds:
        for planner, key_path in planners:
            mark = (canonical([planner.name, dict(planner.settings)]).decode(), world.ground.grid.resolution)
            if mark in seen or world.fleet is None:
                continue
            seen.add(mark)
            x, y, *goal = world.fleet.ends[0].tolist()
            one = tried(("robot",), Fleet, world.ground.grid, [Agent((x, y), (goal[0], goal[1]), robot)])
            if one is None:
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

    def _map(self, spec: Any, key_path: KeyPath) -> None:
        if isinstance(spec, form.StudyFileMap):
            self._need_folder()
        queries: Any = "stored" if isinstance(spec, str) else spec.queries
        _, ground, _ = self._read(spec, key_path)
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
            for start, goal, place in listed_queries(queries, ground.grid, at):
                if start.pose is not None or goal.pose is not None:
                    fault = FileError(
                        "KEY", "a heading of a robot of a fleet", allowed="[x, y] or {m: [x, y]}"
                    )
                    self.tried.refuse(place, fault)
                ends.append((*start.cell, *goal.cell))
            if len(ends) < self.most:
                self.tried.refuse(at, self._too_few(len(ends)))
                return
            listed = self.tried(at, self._fleet, ground, ends)
            if listed is not None:
                self._keep(ground, listed, "listed", at)

    def _drawn_fleet(self, ground: StudyMap, k: int) -> Fleet:
        seed = hashlib.sha256(canonical([self.root, "fleets", ground.hash, k])).digest()
        robot = self.robot if self.robot.radius else None
        return fleets.random_fleet(ground.grid, self.most, seed=int.from_bytes(seed[:8], "big") >> 1, robot=robot)

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
            ground = self._ground(found.grid.name, found.grid, key_path)
            try:
                read = read_scen_fleet(one, found, self.most)
            except LampyrisError as fault:
                if fault.code == "SCEN_LINES":
                    fault.todo = "ask for fewer `robots`, or make a study of its own for the larger fleets"
                self.tried.refuse((*key_path, "scen"), fault)
                continue
            self.notes += read.notes
            fleet = self._fleet(ground, [(*robot.start, *robot.goal) for robot in read.fleet.robots])
            self._keep(ground, fleet, Path(one).stem, key_path)
