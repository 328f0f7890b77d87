"""From a checked scenario file to nouns, piece by piece: every mistake is told of at once, at its place."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from lampyris.errors import FileError, LampyrisError, LimitError, SceneError, SettingError, UsageError
from lampyris.maps import dob, library
from lampyris.maps import scenario_file as form
from lampyris.maps.csv_table import MAX_BYTES
from lampyris.maps.document import MapDocument, Source, document, read_regular
from lampyris.maps.load import load_map
from lampyris.maps.make import make_ground, recipe_named
from lampyris.maps.map_hash import map_hash
from lampyris.maps.ros_yaml import plain_path
from lampyris.maps.scenario import PRESETS, Bundled, Made, MapFile, MapSource, Names, Scenario
from lampyris.maps.scenario_faults import Document, in_order, raise_all, spot
from lampyris.maps.text import read_text
from lampyris.maps.tracks import MAX_TICKS, read_track
from lampyris.maps.yaml_text import Where, shown
from lampyris.maps.zones import read_zones
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene, check_obstacle
from lampyris.model.traffic import MAX_BODIES, Crossing, Patrol, RandomWalk, Recorded, Traffic
from lampyris.typing import Cell, FloatGrid

T = TypeVar("T")


def build(
    said: Document, file: form.ScenarioFile, names: Names, allow_outside: bool, max_cells: int
) -> Scenario:
    """The scenario that a file says; see :func:`lampyris.maps.scenario.read_scenario`.

    Raises
    ------
    LampyrisError : the first mistake in the file; the others are its notes.
    """
    return _Build(said, file, names, allow_outside, max_cells).scenario()


class _Build:
    """Makes nouns of a checked file, and collects what is wrong with them."""

    def __init__(
        self, said: Document, file: form.ScenarioFile, names: Names, allow_outside: bool, max_cells: int
    ) -> None:
        self.said, self.file, self.names = said, file, names
        self.allow_outside, self.max_cells = allow_outside, max_cells
        self.folder = os.path.dirname(said.where)
        self.faults: list[LampyrisError] = []
        self.notes: list[str] = []
        self.room = 10 * MAX_TICKS

    def scenario(self) -> Scenario:
        """The scenario, or every mistake at once."""
        file, map_ = self.file, self.tried(("map",), self._map)
        moves, default_law = PRESETS[file.preset]
        planner, settings = _named(file.planner)
        law, law_settings = _named(file.law or default_law)
        self.tried(("planner",), self.names.planner, planner, settings)
        self.tried(("law",), self.names.law, law, law_settings)
        robot = Robot(**file.robot.model_dump())
        traffic = self._traffic(map_[0].grid if map_ else None, robot)
        start, goal = (map_ and self.tried((what,), self._end, what, map_[0]) for what in ("start", "goal"))
        zones = map_ and self.tried(("zones",), self._zones, map_[0].grid, robot)
        scene = None
        if map_ and start and goal and not self.faults:
            parts = (map_[0].grid, start, goal, file.moves or moves, robot, traffic, zones)
            scene = self.tried(("robot", "radius"), Scene, *parts)
        drive = self._drive()
        if map_ is None or scene is None or self.faults:
            raise_all(in_order(self.said, self.faults))
        how: Any = file.simulate
        if traffic and how is None and drive is None:
            self.notes.append(
                "nothing is simulated (no `simulate` or `drive`): the obstacles are left aside, "
                "but for recorded ones by planners that see traffic"
            )
        ticks, patience = (None, None) if how is None else (how.ticks, how.patience)
        return Scenario(
            scene, planner, settings, law, law_settings, file.seed, how is not None, ticks, patience,
            file.name or "", map_[1], tuple(self.notes), self.said.where,
            self.path(file.zones, ("zones",)) if file.zones is not None else None, drive,
        )  # fmt: skip

    def _drive(self) -> dict[str, Any] | None:
        """Settings of a drive in continuous time; None: it is none."""
        given: Any = self.file.drive
        if given is None:
            return None
        settings: dict[str, Any] = given.model_dump()
        if self.file.simulate is not None:
            fault = FileError("KEY", "`drive` and `simulate`", allowed="one of them")
            self.faults.append(placed(fault, self.said, ("drive",)))
        self.tried(("drive",), self.names.drive, settings)
        return settings

    def tried(self, way: Where, make: Callable[..., T], *given: Any) -> T | None:
        """What ``make(*given)`` makes; None, with the mistake kept, if it cannot."""
        try:
            return make(*given)
        except LampyrisError as fault:
            self.faults.append(placed(fault, self.said, way))
        return None

    # ---- the map --------------------

    def _map(self) -> tuple[MapDocument, MapSource | None]:
        found, source = self._map_of(self.file.map)
        self.notes += found.notes
        if self.file.map_hash is not None and (given := map_hash(found.grid)) != self.file.map_hash:
            raise SettingError(
                "MAP_HASH",
                f"the map's hash is {given}",
                allowed=f"{self.file.map_hash}, the scenario's map_hash",
                todo="the map has changed; give the old one back, or take map_hash out",
            )
        return found, source

    def _map_of(self, spec: Any) -> tuple[MapDocument, MapSource | None]:
        if isinstance(spec, str | form.BundledMap):
            name, resolution = (spec, None) if isinstance(spec, str) else (spec.bundled, spec.resolution)
            if name not in library.names() and ("/" in name or "." in name):
                raise FileError(
                    "FILE_MISSING",
                    f"no bundled map is called {shown(name)}",
                    allowed=", ".join(library.names()),
                    todo=f"for a file write map: {{file: {name}}}",
                )
            return library.load(name, resolution=resolution, max_cells=self.max_cells), Bundled(name)
        if isinstance(spec, form.FileMap):
            path = self.path(spec.file, ("map", "file"))
            found = load_map(
                Path(path),
                resolution=spec.resolution,
                max_cells=self.max_cells,
                allow_outside=self.allow_outside,
                confined=not self.allow_outside,
                values=spec.values,
                colour=spec.colour,
            )
            return found, MapFile(path, spec.values, spec.colour)
        if isinstance(spec, form.RecipeMap):
            made = Made(spec.recipe, (spec.size[0], spec.size[1]), spec.seed, spec.settings)
            return self._made(made, spec.resolution), made
        return self._rows(spec), None

    def _made(self, made: Made, resolution: float) -> MapDocument:
        width, height = made.size
        if width * height > self.max_cells:
            raise LimitError(
                "MAP_TOO_LARGE", f"{width} x {height} cells", allowed=f"at most {self.max_cells:,} cells"
            )
        recipe_named(made.recipe).complete(made.settings)  # before they are taken for arguments
        ground = make_ground(made.recipe, width, height, made.seed, **made.settings)
        grid = Grid(ground.blocked, resolution=resolution, name=made.recipe, terrain=ground.terrain)
        return MapDocument(grid, format="recipe")

    def _rows(self, spec: form.RowsMap) -> MapDocument:
        source = Source("\n".join(spec.rows).encode(), "rows", self.max_cells)
        found = document(read_text(source), source, name=spec.name, format="text", resolution=spec.resolution)
        if found.grid.height != len(spec.rows):
            raise FileError("MAP_ROW", f"{len(spec.rows)} rows", allowed="rows of cells, without line breaks")
        x, y, yaw = spec.origin
        return replace(found, grid=replace(found.grid, origin=(x, y, yaw)))

    def path(self, name: str, way: Where) -> str:
        """A path named in the file, as it can be opened; its form is looked at before anything is."""
        if not plain_path(name):
            raise FileError(
                "PATH_FORM",
                f"{shown(name)} is not a plain file name",
                where=spot(self.said, way),
                allowed="a path with / between its parts; no address, drive, pipe or share",
            )
        path = os.path.join(self.folder, os.path.normpath(name))
        inside = Path(os.path.realpath(path)).is_relative_to(os.path.realpath(self.folder or "."))
        if not (inside or self.allow_outside):
            raise FileError(
                "PATH_OUTSIDE",
                f"{shown(name)} is outside the scenario's folder",
                where=spot(self.said, way),
                todo="put the file beside it, or give --allow-outside if you trust the scenario",
            )
        return path

    def _zones(self, grid: Grid, robot: Robot) -> FloatGrid | None:
        """The speed zones of a file."""
        if self.file.zones is None:
            return None
        path = self.path(self.file.zones, ("zones",))
        outside = self.allow_outside
        zones, notes = read_zones(path, grid, robot.v_max, allow_outside=outside, confined=not outside)
        self.notes += notes
        return zones

    # ---- ends and traffic --------------------

    def _end(self, what: str, found: MapDocument) -> Cell:
        given = getattr(self.file, what)
        cell: Any = None
        if isinstance(given, form.Point):
            cell = found.grid.to_cell(*given.m)
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
        made: Cell = cell
        return made

    def _traffic(self, grid: Grid | None, robot: Robot) -> tuple[Traffic, ...]:
        made: list[Traffic] = []
        for k, spec in enumerate(self.file.obstacles):
            # One that cannot be made keeps its place, so that the others are called by theirs.
            for one in self.tried(("obstacles", k), self._obstacle, spec, k, grid, robot) or (RandomWalk(0),):
                if grid is not None:
                    self.tried(("obstacles", k), check_obstacle, grid, len(made), one)
                made.append(one)
        total = sum(s.count if isinstance(s, RandomWalk | Crossing) else 1 for s in made)
        if total > MAX_BODIES:
            fault = LimitError("LIMIT", f"{total:,} obstacles in all", allowed=f"at most {MAX_BODIES:,}")
            self.faults.append(placed(fault, self.said, ("obstacles",)))
        return tuple(made)

    def _obstacle(self, spec: Any, k: int, grid: Grid | None, robot: Robot) -> tuple[Traffic, ...]:
        if isinstance(spec, form.WalkTable):
            return (RandomWalk(spec.count, spec.rate, spec.radius),)
        if isinstance(spec, form.CrossingTable):
            return (Crossing(spec.count, spec.radius),)
        if isinstance(spec, form.PatrolTable):
            return (Patrol(_cells(spec.waypoints), spec.radius),)
        if isinstance(spec, form.TrackTable):
            return (Recorded(_cells(spec.track), spec.radius),)
        if self.room < 0:
            return ()
        path = self.path(spec.file, ("obstacles", k, "file"))
        data = read_regular(path, MAX_BYTES)
        if not dob.looks_like(data):
            self._csv_only(spec, k)
            made = (Recorded(read_track(path), spec.radius or 0.0),)
            self._count(made[0])
            return made
        if grid is None:
            return ()
        return self._from_dob(spec, k, dob.read_dob(data, path), grid, robot)

    def _count(self, one: Recorded) -> None:
        """Refuse more tracks than memory should be spent on: one file may be named ten thousand times."""
        self.room -= len(one.track)
        if self.room < 0:
            raise LimitError("LIMIT", "longer tracks", allowed=f"{10 * MAX_TICKS:,} ticks in all files")

    def _csv_only(self, spec: form.TrackFileTable, k: int) -> None:
        for key in ("id", "tick_s"):
            if getattr(spec, key) is not None:
                where = spot(self.said, ("obstacles", k, key))
                raise FileError("KEY", f"`{key}` with a CSV", where=where, allowed="with a .dob file")

    def _from_dob(
        self, spec: form.TrackFileTable, k: int, found: tuple[dob.DobObstacle, ...], grid: Grid, robot: Robot
    ) -> tuple[Traffic, ...]:
        if spec.id is not None and spec.id >= len(found):
            where = spot(self.said, ("obstacles", k, "id"))
            raise FileError("OBSTACLE_ID", f"{spec.id}", where=where, allowed=f"0 to {len(found) - 1}")
        tick_s = grid.resolution / robot.v_max if spec.tick_s is None else spec.tick_s
        made: list[Traffic] = []
        for number in range(len(found)) if spec.id is None else (spec.id,):
            one, notes = dob.recorded(found[number], number, grid, tick_s, spec.file)
            self._count(one)
            made.append(one if spec.radius is None else Recorded(one.track, spec.radius))
            self.notes += notes
        return tuple(made)


def placed(fault: LampyrisError, said: Document, way: Where) -> LampyrisError:
    """A mistake with its place in the scenario; an unknown word is bad input here, exit code 3."""
    from lampyris.maps.scenario_faults import spot

    where = "" if fault.where in way else fault.where
    if not where.startswith(f"{said.where}:"):
        where = f"{spot(said, way)}: {where}" if where else spot(said, way)
    kind = SettingError if isinstance(fault, UsageError) else type(fault)
    return kind(fault.code, fault.what, where=where, allowed=fault.allowed, todo=fault.todo)


def _named(given: Any) -> tuple[str, Mapping[str, Any]]:
    return (given, {}) if isinstance(given, str) else (given.name, given.settings)


def _cells(pairs: list[list[int]]) -> tuple[Cell, ...]:
    return tuple((x, y) for x, y in pairs)
