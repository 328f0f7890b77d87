"""Study files: read, checked, and unfolded into a study, every mistake reported with its place.

YAML, or JSON where the name ends in ``.json``, read by the same machinery as scenario files.
"""

from __future__ import annotations

import os
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import FileError, UsageError, did_you_mean, file_name, of_kind
from lampyris.io.scenario.read import read_document
from lampyris.io.scenario.robot_table import robot_of
from lampyris.io.scenario.scenario import PRESETS
from lampyris.model.robot import Robot
from lampyris.model.settings.inflation import Inflation
from lampyris.model.settings.sensor import Sensor
from lampyris.study.design import bundled
from lampyris.study.design.study import Config, Kind, Study, StudyTraffic, World
from lampyris.study.design.study_size import check_size, name_of

if TYPE_CHECKING:
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.io.scenario.validation_errors import Document
    from lampyris.study.design.config import Made, Tried
    from lampyris.study.design.schema import StudyFile


def load_study(
    path: str | os.PathLike[str],
    *,
    data: str | os.PathLike[str] | None = None,
    allow_outside: bool = False,
    max_cells: int = MAX_CELLS,
) -> Study:
    """Read a study file, and the maps and queries that it names.

    Parameters
    ----------
    path : the file, or the name of a ready study (:mod:`lampyris.study.design.bundled`) where no such file exists.
    data : the folder that files are looked up in by their relative names; None: the study file's own. A ready
        study has none of its own.
    allow_outside : whether it may name files outside that folder; only for studies you trust.
    max_cells : maps of more cells are refused.

    Raises
    ------
    LampyrisError : the first mistake in the file, with its place; the others are its ``__notes__``.
        LimitError: more than 10,000,000 jobs, reported before anything is expanded.

    Examples
    --------
    >>> import lampyris
    >>> from pathlib import Path
    >>> _ = Path("s.yaml").write_text("{version: 1, maps: [{bundled: guide}], planners: [astar]}")
    >>> len(list(lampyris.load_study("s.yaml").jobs()))
    4
    """
    from lampyris.io.maps.formats.document import check_limit
    from lampyris.io.scenario.map_source import Files

    check_limit(max_cells)
    of_kind("allow_outside", allow_outside, bool)
    folder = None if data is None else file_name("data", data)
    parsed, is_ready = _parsed(file_name("path", path))
    file = _checked(parsed)
    files = Files(parsed, allow_outside, max_cells, "study", folder)
    return _study(parsed, file, files, folder is not None or not is_ready)


def plain_study(path: str) -> dict[str, Any]:
    """What a study file, or a ready study, says, as plain data that was checked.

    Raises
    ------
    LampyrisError : see :func:`load_study`.
    """
    parsed, _ = _parsed(path)
    _checked(parsed)
    return dict(parsed.data)


def study_from(data: dict[str, Any], given: MapDocument, *, where: str = "study") -> Study:
    """A study from plain data that is in no file; nothing that it names is opened.

    Parameters
    ----------
    data : what a study file holds.
    given : the map that all its entries of maps mean, whatever they say.
    where : what to call it in messages, before the JSON pointer.

    Raises
    ------
    LampyrisError : the first mistake; the others are its notes.
    """
    from lampyris.io.scenario.map_source import NoFiles
    from lampyris.io.scenario.validation_errors import PlainDocument

    parsed = PlainDocument(data, where)
    return _study(parsed, _checked(parsed), NoFiles(parsed, MAX_CELLS, given, None), False)


def _checked(parsed: Document) -> StudyFile:
    """The file's tables, checked by their models."""
    from pydantic import ValidationError

    from lampyris.io.scenario.validation_errors import faults_of, raise_all
    from lampyris.study.design.schema import StudyFile

    try:
        return StudyFile.model_validate(parsed.data)
    except ValidationError as problem:
        raise_all(faults_of(parsed, problem, StudyFile), problem.error_count())


def json_schema() -> dict[str, Any]:
    """The JSON Schema of study files."""
    from lampyris.study.design import schema as form

    return form.json_schema()


def _parsed(name: str) -> tuple[Document, bool]:
    """The file, and whether it is a ready one."""
    from lampyris.io.text.strict_yaml import read_yaml
    from lampyris.study.design.schema import VERSION

    if name in bundled.names() and not os.path.isfile(name):
        return read_yaml(bundled.text(name), f"{name}.yaml (ready)"), True
    try:
        return read_document(name, VERSION), False
    except FileError as fault:
        if fault.code == "FILE_MISSING":
            fault.allowed = "a file, or a ready study: " + ", ".join(bundled.names())
            fault.todo = did_you_mean(name, bundled.names())
        raise


def _study(parsed: Document, file: StudyFile, files: Any, has_folder: bool) -> Study:
    from lampyris.study.design.config import Tried, laws_of, planners_of, sensors_of, traffic_cases_of
    from lampyris.study.design.worlds import Worlds

    if file.kind == "fleet" or (file.kind is None and file.robots is not None):
        from lampyris.study.design.fleet_design import fleet_study

        return fleet_study(parsed, file, files, has_folder)
    tried = Tried(parsed)
    for key in ("cell", "radius", "execute", "delays", "lifelong"):
        if getattr(file, key) is not None:
            tried.refuse((key,), FileError("KEY", f"`{key}` without fleets", allowed="with `robots`"))
    if file.robots is not None:
        fault = FileError("KEY", f"`robots` with kind {file.kind}", allowed="with kind fleet")
        tried.refuse(("robots",), fault)
    moves, law = PRESETS[file.preset]
    moves = file.moves or moves
    planners = with_sensors(planners_of(file.planners, tried), sensors_of(file.sensors, tried))
    laws = laws_of(file.laws, law, tried)
    traffic_cases = traffic_cases_of(file.traffic, tried)
    many = file.seeds if isinstance(file.seeds, int) else len(file.seeds)
    if isinstance(file.seeds, list):
        numbered: Made[int] = [(seed, ("seeds", k)) for k, seed in enumerate(file.seeds)]
        tried.each_once(numbered, lambda seed: seed, "DUPLICATE", "the same seed a second time")
    if tried.faults:
        tried.faults.give()
    sizes = {"seeds": many, "planners": len(planners), "laws": len(laws), "traffic cases": len(traffic_cases)}
    check_size(parsed, {"queries": _least_queries(file), **sizes})
    robot = tried(("robot",), robot_of, file.robot.model_dump()) or Robot()
    sensed = any(planner.sensor is not None for planner, _ in planners)
    moving = _goals_that_move(file)
    driven = sensed or moving or any(c.count for c, _ in traffic_cases)
    kind = file.kind or ("simulate" if driven else "plan")
    _check_kind(file, kind, traffic_cases, tried)
    inflation = Inflation(**file.inflation.model_dump())
    _check_sensors(kind, sensed, moving, inflation, tried)
    poses = _check_poses(planners, kind, tried)
    reader = Worlds(files, tried, robot, moves, inflation, file.seed, has_folder, poses)
    worlds = reader.of(file.maps)
    _check_traffic(worlds, traffic_cases, tried)
    if tried.faults:
        tried.faults.give()
    check_size(parsed, {"queries": len(worlds), **sizes})
    return Study(
        name=name_of(parsed, file),
        kind=kind,
        worlds=tuple(w for w, _ in worlds),
        planners=tuple(w for w, _ in planners),
        laws=tuple(w for w, _ in laws),
        traffic_cases=tuple(c for c, _ in traffic_cases),
        seeds=tuple(range(many)) if isinstance(file.seeds, int) else tuple(file.seeds),
        moves=moves,
        robot=_settings_of(robot),
        expansions=None if file.budget is None else file.budget.expansions,
        seconds=None if file.budget is None else file.budget.seconds,
        ticks=file.ticks,
        patience=file.patience,
        drive=_drive(file) if kind == "drive" else {},
        root=file.seed,
        memory=file.memory,
        about=" ".join(file.about.split()),
        notes=tuple(reader.notes),
    )


def _settings_of(robot: Robot) -> dict[str, Any]:
    """The robot's settings; those that planners on cells do not look at only where given."""
    usual = asdict(Robot())
    unread = ("drive", "footprint", "yaw_rate_max")
    return {
        name: value for name, value in asdict(robot).items() if name not in unread or value != usual[name]
    }


def with_sensors(planners: Made[Config], sensors: Made[Sensor | None]) -> Made[Config]:
    """Every planner with every sensor."""
    return [(replace(p, sensor=sensor), key_path) for p, key_path in planners for sensor, _ in sensors]


def _goals_that_move(file: StudyFile) -> bool:
    """Whether some query has a goal that moves."""
    listed: Any = (getattr(one, "queries", None) for one in file.maps)
    return any(q.goal_track is not None for some in listed if isinstance(some, list) for q in some)


def _least_queries(file: StudyFile) -> int:
    """How many queries there will be at least, as far as that can be said before a map is read."""
    from lampyris.study.design.schema import RandomTable

    least = 0
    for one in file.maps:
        asked: Any = getattr(one, "queries", None)
        many = (
            asked.random if isinstance(asked, RandomTable) else len(asked) if isinstance(asked, list) else 1
        )
        limit = getattr(one, "limit", None)
        least += many if limit is None else min(many, limit)
    return least


def _check_kind(file: StudyFile, kind: Kind, traffic_cases: Made[StudyTraffic], tried: Tried) -> None:
    """Settings of another kind of run would be left aside without a word."""
    others = {"ticks": "simulate", "patience": "simulate", "drive": "drive"}
    for key, its in others.items():
        if getattr(file, key) is not None and kind != its:
            tried.refuse((key,), FileError("KEY", f"`{key}` with kind {kind}", allowed=f"with kind {its}"))
    if file.budget is not None and not file.budget.model_fields_set:
        fault = FileError("BUDGET", "an empty table", allowed="expansions, seconds or both; null: no limit")
        tried.refuse(("budget",), fault)
    if kind == "plan":
        for traffic, key_path in traffic_cases:
            if traffic.count and traffic.tracks == "live":
                fault = FileError("TRACKS", "live tracks with kind plan", allowed="replayed")
                tried.refuse((*key_path, "tracks"), fault)
    if kind == "drive":
        from lampyris.model.settings.drive import DriveSettings

        made = tried(("drive",), DriveSettings.of, {} if file.drive is None else file.drive.model_dump())
        if made is not None and made.sensor_range is not None:
            fault = FileError(
                "KEY", "`sensor_range` in a study of drives", allowed="`sensors`, with kind simulate"
            )
            tried.refuse(("drive", "sensor_range"), fault)


def _check_sensors(kind: Kind, sensed: bool, moving: bool, inflation: Inflation, tried: Tried) -> None:
    """Sensors and goals that move are of simulations; costs near walls are of known ones."""
    may = "with kind simulate"
    if sensed and kind != "simulate":
        tried.refuse(("sensors",), FileError("KEY", f"`sensors` with kind {kind}", allowed=may))
    if moving and kind != "simulate":
        tried.refuse(("maps",), FileError("KEY", f"`goal_track` with kind {kind}", allowed=may))
    if sensed and inflation.inflation_radius > 0:
        fault = FileError(
            "SENSOR_INFLATION", "sensors with inflation, whose costs are those of all walls of the map",
            allowed="sensors, or inflation; not both",
        )  # fmt: skip
        tried.refuse(("sensors",), fault)


def _check_poses(planners: Made[Config], kind: Kind, tried: Tried) -> bool:
    """Whether any planner is one of poses; each is a mistake where cells are driven from tick to tick.

    One that plans times is a mistake in drives, too.
    """
    from lampyris.planning.registry import planner_class
    from lampyris.study.design.config import plans_poses

    of_poses = [(planner, key_path) for planner, key_path in planners if plans_poses(planner)]
    for planner, key_path in of_poses if kind == "simulate" else ():
        fault = UsageError(
            "PLANNER",
            f"{planner.name} plans poses; a study of kind simulate drives cells, tick by tick",
            allowed="a planner on cells, such as astar",
            todo="set `kind: plan`, or (without planned times) `kind: drive` for a study among obstacles",
            setting="planner",
        )
        tried.refuse(key_path, fault)
    for planner, key_path in of_poses if kind == "drive" else ():
        if planner_class(planner.name).traits.sees_traffic:
            fault = UsageError(
                "PLANNER",
                f"{planner.name} plans poses with times; studies of drives do not follow these",
                allowed="a planner without times, such as lattice, or `kind: plan`",
                setting="planner",
            )
            tried.refuse(key_path, fault)
    return bool(of_poses)


def _check_traffic(worlds: Made[World], traffic_cases: Made[StudyTraffic], tried: Tried) -> None:
    """Obstacles that are too wide for a map."""
    from lampyris.model.scene import check_obstacle
    from lampyris.model.traffic import RandomWalk

    grounds = {world.ground.hash: world.ground for world, _ in worlds}.values()
    for traffic, key_path in traffic_cases:
        for ground in grounds:
            wide, before = (
                RandomWalk(traffic.count, None, traffic.radius, footprint=traffic.footprint),
                len(tried.faults),
            )
            tried(key_path, check_obstacle, ground.grid, 0, wide)
            if len(tried.faults) > before:
                break


def _drive(file: StudyFile) -> dict[str, Any]:
    """Every setting of a drive."""
    from lampyris.model.settings.drive import DriveSettings

    settings = asdict(DriveSettings.of({} if file.drive is None else file.drive.model_dump()))
    # No study has drives with a sensor: keys of runs do not speak of it.
    return {
        key: value
        for key, value in settings.items()
        if key not in ("sensor_range", "field_of_view", "unseen_cost")
    }
