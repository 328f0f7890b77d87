"""From a checked scenario file to nouns, piece by piece: every mistake is reported at once, with its place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol, TypeVar

from lampyris._core.settings import settings_of
from lampyris.errors import FileError, LampyrisError, LimitError, SceneError, SettingError
from lampyris.io.files import read_regular
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.zones import read_zones
from lampyris.io.scenario import schema as form
from lampyris.io.scenario.map_source import Files, Mistakes, setting_path
from lampyris.io.scenario.robot_table import robot_of, with_footprint
from lampyris.io.scenario.scenario import PRESETS, MapSource, Scenario
from lampyris.io.scenario.validation_errors import Document, spot
from lampyris.io.text.csv_table import MAX_BYTES
from lampyris.io.text.strict_yaml import KeyPath
from lampyris.io.tracks import dob
from lampyris.io.tracks.csv_tracks import MAX_TICKS, read_headed_track, read_track
from lampyris.io.tracks.timed_tracks import TimedTrack, recorded_from, timed_track
from lampyris.model.edit import Edit, check_edit
from lampyris.model.grid import Grid
from lampyris.model.robot import Polygon, Robot
from lampyris.model.scene import Scene, check_obstacle
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.inflation import Inflation
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.model.traffic import MAX_OBSTACLES, Crossing, ObstacleSpec, Patrol, RandomWalk, Recorded
from lampyris.typing import Cell, FloatGrid

T = TypeVar("T")

MAX_COVERED = 1 << 22
"""Cells that the polygons of a file cover, each polygon counted by itself: what half a gigabyte of memory holds."""


class Names(Protocol):
    """What rooms above this one know by name: asked, not imported. All raise what is wrong."""

    def planner(self, name: str, settings: Mapping[str, Any]) -> object:
        """Whether there is such a planner with such settings."""
        ...

    def files(self, name: str) -> tuple[str, ...]:
        """The settings of a planner that are names of files; none of one that is not known."""
        ...

    def law(self, name: str, settings: Mapping[str, Any]) -> object:
        """Whether there is such a speed law with such settings."""
        ...

    def drive(self, settings: Mapping[str, Any]) -> object:
        """Whether a drive has such settings."""
        ...


def build(parsed: Document, file: form.ScenarioFile, names: Names, files: Files) -> Scenario:
    """The scenario that a file says; see :func:`lampyris.io.scenario.read.read_scenario`.

    Raises
    ------
    LampyrisError : the first mistake in the file; the others are its notes.
    """
    return _Build(parsed, file, names, files).scenario()


class _Build:
    """Makes nouns of a checked file, and collects what is wrong with them."""

    def __init__(self, parsed: Document, file: form.ScenarioFile, names: Names, files: Files) -> None:
        self.parsed, self.file, self.names, self.files = parsed, file, names, files
        self.faults = Mistakes(parsed)
        self.notes: list[str] = []
        self.room = 10 * MAX_TICKS
        self.covered = 0  # cells of polygons so far

    def scenario(self) -> Scenario:
        """The scenario, or every mistake at once."""
        file, map_ = self.file, self.tried(("map",), self._map)
        moves, default_law = PRESETS[file.preset]
        planner, settings = _named(file.planner)
        law, law_settings = _named(file.law or default_law)
        settings = self._with_files(planner, settings)
        self._known("planner", file.planner, self.names.planner, settings)
        self._known("law", file.law or default_law, self.names.law, law_settings)
        robot = self.tried(("robot",), robot_of, file.robot.model_dump()) or Robot()
        traffic = self._traffic(map_[0] if map_ else None, robot)
        start, goal = (map_ and self.tried((what,), self._end, what, map_[0]) for what in ("start", "goal"))
        via = self._via(map_[0].grid) if map_ else []
        zones = map_ and self.tried(("zones",), self._zones, map_[0].grid, robot)
        edits = self._edits(map_[0].grid if map_ else None)
        scene = None
        if map_ and start and goal and not self.faults:
            make = partial(
                Scene,
                moves=file.moves or moves,
                robot=robot,
                traffic=traffic,
                zones=zones,
                via=via,
                via_order=file.via_order,
                **start,
                **goal,
            )
            scene = self.tried(("robot", "radius"), make, map_[0].grid)
        drive = self._drive()
        if scene is not None and drive is not None and not self.faults:
            self._check_traffic(DriveSettings.of(drive), scene)
        if map_ is None or scene is None or self.faults:
            self.faults.give()
        how: Any = file.simulate
        if traffic and how is None and drive is None:
            self.notes.append(
                "nothing is simulated (no `simulate` or `drive`): the obstacles are ignored, "
                "but for recorded ones by planners that see traffic"
            )
        if any(edit.tick for edit in edits) and how is None:
            self.notes.append("nothing is simulated (no `simulate`): edits after tick 0 are left aside")
        simulation = SimulationSettings() if how is None else self._simulation(how)
        goal_track = None if how is None else self._goal_track(how)
        if simulation is None or self.faults:
            self.faults.give()
        return Scenario(
            scene, planner, settings, law, law_settings, file.seed, how is not None,
            simulation.ticks, simulation.patience,
            file.name or "", map_[1], tuple(self.notes), self.parsed.where,
            self.files.path(file.zones, ("zones",)) if file.zones is not None else None, drive, edits,
            inflation=Inflation(**file.inflation.model_dump()), sensor_range=simulation.sensor_range,
            field_of_view=simulation.field_of_view, unseen_cost=simulation.unseen_cost, goal_track=goal_track,
        )  # fmt: skip

    def _simulation(self, how: Any) -> Any:
        """The settings of a simulation."""
        given = [getattr(how, name) for name in settings_of(SimulationSettings)]
        return self.tried(("simulate", "field_of_view"), SimulationSettings, *given)

    def _goal_track(self, how: Any) -> tuple[Cell, ...] | None:
        """The goal's cells, from the scenario or from a file that it names."""
        at: KeyPath = ("simulate", "goal_track_file" if how.goal_track is None else "goal_track")
        if how.goal_track is not None:
            cells: tuple[Cell, ...] | None = _cells(how.goal_track)
        elif how.goal_track_file is not None:
            path = self.tried(at, self.files.path, how.goal_track_file, at)
            cells = None if path is None else self.tried(at, read_track, path)
        else:
            return None
        made = None if cells is None else self.tried(at, Recorded, cells)
        return None if made is None else made.track

    def _with_files(self, planner: str, settings: Mapping[str, Any]) -> Mapping[str, Any]:
        """A planner's settings with the files that they name, found from the scenario's folder."""
        found = dict(settings)
        for key in self.names.files(planner):
            if isinstance(found.get(key), str):
                at: KeyPath = ("planner", "settings", key)
                found[key] = self.tried(at, self.files.path, found[key], at)
        return found

    def _known(
        self,
        key: str,
        given: Any,
        make: Callable[[str, Mapping[str, Any]], object],
        settings: Mapping[str, Any],
    ) -> None:
        """See that there is such a planner or law with such settings; a mistake is kept at its name or setting."""
        try:
            make(_named(given)[0], settings)
        except LampyrisError as fault:
            path = setting_path(fault, settings)
            if path:
                self.faults.keep((key, "settings", *path), fault)
            else:
                self.faults.keep(
                    (key,) if isinstance(given, str) or fault.setting != key else (key, "name"), fault
                )

    def _check_traffic(self, settings: DriveSettings, scene: Scene) -> None:
        """See that the traffic is no faster than a drive can follow."""
        try:
            settings.check_traffic(scene)
        except SettingError as fault:
            table = "drive" if fault.setting == "obstacle_speed" else "robot"
            self.faults.keep((table, fault.setting), fault)

    def _drive(self) -> dict[str, Any] | None:
        """Settings of a drive in continuous time; None: it is none."""
        given: Any = self.file.drive
        if given is None:
            return None
        settings: dict[str, Any] = given.model_dump()
        if self.file.simulate is not None:
            fault = FileError("KEY", "`drive` and `simulate`", allowed="one of them")
            self.faults.keep(("drive",), fault)
        self.tried(("drive",), self.names.drive, settings)
        return settings

    def _edits(self, grid: Grid | None) -> tuple[Edit, ...]:
        """Walls that come and go, each checked by itself and against the one before."""
        made: list[Edit] = []
        for k, spec in enumerate(self.file.edits):
            key_path: KeyPath = ("edits", k)
            edit = self.tried(key_path, self._edit, spec, grid)
            if edit is None:
                continue
            if grid is not None:
                self.tried(key_path, check_edit, grid, edit, "")
            if made and edit.tick <= made[-1].tick:
                allowed = f"later than {made[-1].tick}, the edit before"
                fault = SettingError("EDIT_TICK", f"tick {edit.tick}", allowed=allowed)
                self.faults.keep((*key_path, "tick"), fault)
                continue
            if edit.tick and self.file.drive is not None:
                fault = SettingError("EDITS", "an edit in a drive", allowed="edits of tick 0, or `simulate`")
                self.faults.keep(key_path, fault)
            made.append(edit)
        return tuple(made)

    def _edit(self, spec: form.EditTable, grid: Grid | None) -> Edit:
        """An edit with the cells of its polygons."""
        blocked = _cells(spec.blocked)
        if spec.polygons and grid is not None:
            found = dict.fromkeys(blocked)
            for vertices in spec.polygons:
                cells = grid.polygon_cells(vertices)
                self.covered += len(cells)
                if self.covered > MAX_COVERED:
                    allowed = f"at most {MAX_COVERED:,} cells of all polygons together"
                    raise LimitError("LIMIT", f"{self.covered:,} covered cells", allowed=allowed)
                found.update(dict.fromkeys((x, y) for x, y in cells.tolist()))
            blocked = tuple(found)
        return Edit(spec.tick, blocked, _cells(spec.freed))

    def tried(self, key_path: KeyPath, make: Callable[..., T], *given: Any) -> T | None:
        """What ``make(*given)`` makes; None, with the mistake kept, if it cannot."""
        try:
            return make(*given)
        except LampyrisError as fault:
            self.faults.keep(key_path, fault)
        return None

    # ---- the map --------------------

    def _map(self) -> tuple[MapDocument, MapSource | None]:
        found, source = self.files.map_of(self.file.map, ("map",))
        self.notes += found.notes
        if self.file.map_hash is not None and (given := map_hash(found.grid)) != self.file.map_hash:
            raise SettingError(
                "MAP_HASH",
                f"the map's hash is {given}",
                allowed=f"{self.file.map_hash}, the scenario's map_hash",
                todo="the map has changed; give the old one back, or take map_hash out",
            )
        return found, source

    def _zones(self, grid: Grid, robot: Robot) -> FloatGrid | None:
        """The speed zones of a file."""
        if self.file.zones is None:
            return None
        path = self.files.path(self.file.zones, ("zones",))
        outside = self.files.allow_outside
        zones, notes = read_zones(path, grid, robot.v_max, allow_outside=outside, confined=not outside)
        self.notes += notes
        return zones

    # ---- ends and traffic --------------------

    def _end(self, what: str, found: MapDocument) -> dict[str, Any]:
        """An end as the argument of a scene: a cell, or a pose."""
        given = getattr(self.file, what)
        cell: Any = None
        if isinstance(given, form.Pose):
            cell = found.grid.to_cell(*given.pose[:2])
        elif isinstance(given, form.Point):
            cell = found.grid.to_cell(*given.m)
        elif isinstance(given, form.CellPose):
            cell = (given.cell[0], given.cell[1])
        elif given is not None:
            cell = (given[0], given[1])
        else:
            cell = getattr(found, what)
            if cell is None and found.queries:
                cell = getattr(found.queries[0], what)
        if cell is None:
            raise FileError("KEY", f"`{what}` is missing, and the map has none of its own", allowed="[x, y]")
        if not found.grid.contains(cell):
            raise SceneError(
                f"{what.upper()}_OUTSIDE",
                f"{what} {cell} is outside the map",
                allowed=f"x 0 to {found.grid.width - 1}, y 0 to {found.grid.height - 1}",
            )
        if isinstance(given, form.CellPose):
            return {f"{what}_pose": (*found.grid.to_metres(cell).tolist(), given.yaw)}
        return {f"{what}_pose": given.pose} if isinstance(given, form.Pose) else {what: cell}

    def _via(self, grid: Grid) -> list[Cell]:
        """The via points, each a cell of the map."""
        cells: list[Cell] = []
        for k, given in enumerate(self.file.via):
            cell = grid.to_cell(*given.m) if isinstance(given, form.Point) else (given[0], given[1])
            if grid.contains(cell):
                cells.append(cell)
                continue
            allowed = f"x 0 to {grid.width - 1}, y 0 to {grid.height - 1}"
            self.faults.keep(
                ("via", k), SceneError("VIA_OUTSIDE", f"{cell} is outside the map", allowed=allowed)
            )
        return cells

    def _traffic(self, found: MapDocument | None, robot: Robot) -> tuple[ObstacleSpec, ...]:
        """What the file lists; if it has no list, what is drawn in the map."""
        grid, drawn = (None, ()) if found is None else (found.grid, found.obstacle_cells)
        if found is not None and "obstacles" not in self.file.model_fields_set:
            return found.traffic()
        made: list[ObstacleSpec] = []
        for k, spec in enumerate(self.file.obstacles):
            # One that cannot be made keeps its place, so that the others are called by theirs.
            for one in self.tried(("obstacles", k), self._obstacle, spec, k, grid, robot) or (RandomWalk(0),):
                if grid is not None:
                    self.tried(("obstacles", k), check_obstacle, grid, len(made), one)
                made.append(one)
        counts = [s.count if isinstance(s, RandomWalk | Crossing) else 1 for s in made]
        total = sum(counts)  # bits: whole numbers
        if total > MAX_OBSTACLES:
            fault = LimitError("LIMIT", f"{total:,} obstacles in all", allowed=f"at most {MAX_OBSTACLES:,}")
            self.faults.keep(("obstacles",), fault)
        left = set(drawn).difference(*(one.starts for one in made if isinstance(one, RandomWalk)))
        if left:
            self.notes.append(
                f"{len(left)} of {len(drawn)} moving obstacles drawn in the map are left aside: `obstacles` "
                "does not list them"
            )
        return tuple(made)

    def _obstacle(self, spec: Any, k: int, grid: Grid | None, robot: Robot) -> tuple[ObstacleSpec, ...]:
        shape: dict[str, Any] = {name: getattr(spec, name) for name in ("radius", "footprint", "rectangle")}
        shape = with_footprint(shape, "traffic", "TRAFFIC_FOOTPRINT")
        if isinstance(spec, form.WalkTable):
            return (RandomWalk(spec.count, spec.rate, starts=_cells(spec.starts), **shape),)
        if isinstance(spec, form.CrossingTable):
            return (Crossing(spec.count, **shape),)
        if isinstance(spec, form.PatrolTable):
            return (Patrol(_cells(spec.waypoints), **shape),)
        if isinstance(spec, form.TrackTable):
            return (Recorded(_cells(spec.track), yaw=spec.yaw, **shape),)
        if self.room < 0:
            return ()
        path = self.files.path(spec.file, ("obstacles", k, "file"))
        data = read_regular(path, MAX_BYTES)
        if not dob.looks_like(data):
            timed = timed_track(path)
            self._csv_only(spec, k, ("id",) if timed is not None else ("id", "tick_s"))
            if timed is not None:
                return () if grid is None else (self._timed(spec, timed, grid, robot, shape["footprint"]),)
            if shape["footprint"] is None:
                made = (Recorded(read_track(path), spec.radius or 0.0),)
            else:
                track, yaw = read_headed_track(path)
                made = (Recorded(track, footprint=shape["footprint"], yaw=yaw),)
            self._count(made[0])
            return made
        if grid is None:
            return ()
        return self._from_dob(spec, k, dob.read_dob(data, path), grid, robot, shape["footprint"])

    def _count(self, one: Recorded) -> None:
        """Refuse more tracks than memory should be spent on: one file may be named ten thousand times."""
        self.room -= len(one.track)
        if self.room < 0:
            raise LimitError("LIMIT", "longer tracks", allowed=f"{10 * MAX_TICKS:,} ticks in all files")

    def _timed(
        self,
        spec: form.TrackFileTable,
        found: TimedTrack,
        grid: Grid,
        robot: Robot,
        footprint: Polygon | None,
    ) -> ObstacleSpec:
        tick_s = grid.resolution / robot.v_max if spec.tick_s is None else spec.tick_s
        made = recorded_from(
            found, grid, tick_s, name=spec.file, radius=spec.radius or 0.0, footprint=footprint,
            faster="give a shorter tick_s",
        )  # fmt: skip
        self._count(made)
        return made

    def _csv_only(self, spec: form.TrackFileTable, k: int, keys: tuple[str, ...]) -> None:
        for key in keys:
            if getattr(spec, key) is not None:
                where = spot(self.parsed, ("obstacles", k, key))
                raise FileError("KEY", f"`{key}` with a CSV", where=where, allowed="with a .dob file")

    def _from_dob(
        self,
        spec: form.TrackFileTable,
        k: int,
        found: tuple[dob.DobObstacle, ...],
        grid: Grid,
        robot: Robot,
        footprint: Polygon | None,
    ) -> tuple[ObstacleSpec, ...]:
        if spec.id is not None and spec.id >= len(found):
            where = spot(self.parsed, ("obstacles", k, "id"))
            raise FileError("OBSTACLE_ID", f"{spec.id}", where=where, allowed=f"0 to {len(found) - 1}")
        tick_s = grid.resolution / robot.v_max if spec.tick_s is None else spec.tick_s
        made: list[ObstacleSpec] = []
        for number in range(len(found)) if spec.id is None else (spec.id,):
            one, notes = dob.recorded(found[number], number, grid, tick_s, spec.file)
            self._count(one)
            radius = one.radius if spec.radius is None else spec.radius
            made.append(Recorded(one.track, radius, footprint))
            self.notes += notes
        return tuple(made)


def _named(given: Any) -> tuple[str, Mapping[str, Any]]:
    return (given, {}) if isinstance(given, str) else (given.name, given.settings)


def _cells(pairs: list[list[int]]) -> tuple[Cell, ...]:
    return tuple((x, y) for x, y in pairs)
