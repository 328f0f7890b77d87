"""Worlds: maps of a study file with their queries, stored, listed, drawn, or of MovingAI benchmarks."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from lampyris import movingai
from lampyris.errors import FileError, LimitError, SceneError, plural
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.formats.movingai import grid_for, read_scen
from lampyris.io.maps.inflation import inflated
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.map_source import Files
from lampyris.io.scenario.schema import CellPose, Point, Pose
from lampyris.io.scenario.validation_errors import spot
from lampyris.io.text.strict_yaml import KeyPath, shown
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.inflation import Inflation
from lampyris.planning.field.layers import free_cells
from lampyris.planning.lattice.standing import Standing
from lampyris.sim.grid.pursuit import checked_track
from lampyris.study.design import schema as form
from lampyris.study.design.config import Made, Tried
from lampyris.study.design.random_queries import QueryEnd, draw_queries
from lampyris.study.design.study import StudyMap, World, canonical
from lampyris.typing import BoolGrid, Cell

T = TypeVar("T")
_Read: TypeAlias = tuple[MapDocument, StudyMap, BoolGrid]
MAX_ALL_CELLS = 2**27
"""Cells of all maps of a study together: 128 MiB."""
MAX_WORLDS = 1_000_000
_FILES = 10_000
"""Most ``.scen`` files of a folder."""


class Worlds:
    """Makes the worlds of a study file; what is wrong is kept by ``tried``.

    Parameters
    ----------
    files : where the files are that it names.
    tried : keeps what is wrong.
    robot, moves, inflation : of the study.
    root : its seed.
    has_folder : whether there is a folder that names of files are relative to.
    poses : whether any planner of the study is one of poses. Then an end is free where the footprint is, in its heading;
        without a heading, where the disc within the footprint is. Else it is free where the disc around it is.
    """

    def __init__(
        self,
        files: Files,
        tried: Tried,
        robot: Robot,
        moves: str,
        inflation: Inflation,
        root: int,
        has_folder: bool,
        poses: bool = False,
    ) -> None:
        self.notes: list[str] = []
        self.files, self.tried, self.robot, self.moves, self.root = files, tried, robot, moves, root
        self.has_folder, self.inflation, self.poses = has_folder, inflation, poses
        self._standing: dict[str, Standing] = {}
        self.made: Made[World] = []
        self._names: dict[str, tuple[StudyMap, KeyPath]] = {}
        self._hashes: dict[str, str] = {}
        self._read_maps: dict[bytes, _Read] = {}
        self._cells = 0

    def of(self, given: list[Any]) -> Made[World]:
        """The worlds of all maps, in the order of the file, each once."""
        for k, one in enumerate(given):
            key_path: KeyPath = ("maps", k)
            if isinstance(one, form.ScenTable):
                self.tried(key_path, self._benchmarks, one, key_path)
            else:
                self.tried(key_path, self._map, one, key_path)
        same = "the same query a second time"
        self.tried.each_once(self.made, attrgetter("ground.hash", "identity"), "DUPLICATE", same)
        return self.made

    # ---- one map --------------------

    def _map(self, spec: Any, key_path: KeyPath) -> None:
        if isinstance(spec, form.StudyFileMap):
            self._need_folder()
        queries: Any = "stored" if isinstance(spec, str) else spec.queries
        found, ground, free = self._read(spec, key_path)
        pairs: list[tuple[QueryEnd, QueryEnd, KeyPath]]
        if isinstance(queries, form.RandomTable):
            drawn = self._drawn(ground, free, queries)
            pairs = [(start, goal, (*key_path, "queries")) for start, goal in drawn]
        elif queries == "stored":
            pairs = [(QueryEnd(start), QueryEnd(goal), key_path) for start, goal in _stored(found)]
        else:
            pairs = list(listed_queries(queries, ground.grid, (*key_path, "queries")))
        for start, goal, at in spread(pairs, None if isinstance(spec, str) else spec.limit):
            scene = self.tried(at, self._check, ground, free, start, goal)
            if scene is not None:
                track = goal.track
                if track is not None and self.tried((*at, "goal_track"), checked_track, scene, track) is None:
                    continue
                poses = (scene.start_pose, scene.goal_pose)
                self._add(World(ground, scene.start, scene.goal, None, *poses, goal_track=track), at)

    def _read(self, spec: Any, key_path: KeyPath) -> _Read:
        """A map, its ground, and where the robot fits; maps that are said alike are read once.

        A small file can name one large map a thousand times.
        """
        plain = spec if isinstance(spec, str) else spec.model_dump(mode="json", exclude={"queries", "limit"})
        key = canonical(plain)
        if key not in self._read_maps:
            found, _ = self.files.map_of(spec, key_path)
            name = (None if isinstance(spec, str) else spec.name) or found.grid.name
            ground = self._ground(name, found.grid, key_path)
            if found.obstacle_cells:
                drawn = plural(len(found.obstacle_cells), "moving obstacle")
                why = "the obstacles of a study are those under `traffic`"
                self.notes.append(f"map {ground.name}: {drawn} drawn in it left out; {why}")
            kept = MapDocument(ground.grid, found.start, found.goal, queries=found.queries)
            radius = self.robot.inscribed_radius if self.poses else self.robot.radius
            self._read_maps[key] = (kept, ground, free_cells(ground.grid, radius))
        return self._read_maps[key]

    def _check(self, ground: StudyMap, free: BoolGrid, start: QueryEnd, goal: QueryEnd) -> Scene:
        """Whether a robot can stand on both ends."""
        grid = ground.grid
        ends: dict[str, Any] = {}
        for what, end in (("start", start), ("goal", goal)):
            ends |= {what: end.cell} if end.pose is None else {f"{what}_pose": end.pose}
        scene = Scene(grid, moves=self.moves, robot=self.robot, **ends)
        poses = {"start": scene.start_pose, "goal": scene.goal_pose}
        for what, (x, y) in (("start", scene.start), ("goal", scene.goal)):
            pose = poses[what] if self.poses else None
            stands = free[y, x] if pose is None else self._standing_on(ground).at(pose)
            if not stands:
                why = "is blocked" if grid.blocked[y, x] else "is too near to a wall for the robot"
                allowed = "a free cell" if pose is None else "a pose at which the footprint touches no wall"
                raise SceneError(f"{what.upper()}_OCCUPIED", f"{what} ({x}, {y}) {why}", allowed=allowed)
        return scene

    def _standing_on(self, ground: StudyMap) -> Standing:
        """Where the robot stands free on a map."""
        if ground.hash not in self._standing:
            self._standing[ground.hash] = Standing(ground.grid, self.robot)
        return self._standing[ground.hash]

    def _add(self, world: World, key_path: KeyPath) -> None:
        if len(self.made) >= MAX_WORLDS:
            raise LimitError("LIMIT", "too many queries", allowed=f"at most {MAX_WORLDS:,} in a study")
        self.made.append((world, key_path))

    def _ground(self, name: str, grid: Grid, key_path: KeyPath) -> StudyMap:
        """The map under its name; one that is known already, if it is the same."""
        grid = inflated(grid, self.robot, self.inflation)
        cells = map_hash(grid)
        if name in self._names:
            known, first = self._names[name]
            if (known.hash, known.grid.resolution) == (cells, grid.resolution):
                return known
            raise FileError(
                "MAP_NAME",
                f"another map is called {shown(name)}, at {spot(self.tried.parsed, first)}",
                allowed="one map of a name",
                todo="give this one a `name`",
            )
        if cells in self._hashes:
            other = self._hashes[cells]
            first = self._names[other][1]
            raise FileError(
                "MAP_TWICE",
                f"map {shown(name)} has the cells of {shown(other)}, at {spot(self.tried.parsed, first)}",
                allowed="one name and one resolution for the same cells",
                todo="give both the same `name` and resolution",
            )
        self._cells += grid.width * grid.height
        if self._cells > MAX_ALL_CELLS:
            what = f"{self._cells:,} cells up to this map"
            raise LimitError("LIMIT", what, allowed=f"at most {MAX_ALL_CELLS:,} in all maps of a study")
        ground = StudyMap(name, grid, cells)
        self._names[name], self._hashes[cells] = (ground, key_path), name
        return ground

    def _need_folder(self) -> None:
        if not self.has_folder:
            raise FileError(
                "FILE_MISSING",
                "a ready study that needs files of yours",
                todo="say in which folder they are with data=FOLDER",
            )

    def _drawn(
        self, ground: StudyMap, free: BoolGrid, asked: form.RandomTable
    ) -> list[tuple[QueryEnd, QueryEnd]]:
        """Queries drawn from the study's seed; see :func:`lampyris.study.design.random_queries.draw_queries`.

        Without headings cells are free for the disc around the robot, whichever planner is asked.
        """
        if asked.headings and not self.poses:
            raise FileError(
                "KEY",
                "`headings` without a planner of poses",
                allowed="with lattice, lattice-sipp, pad, pad-sipp or hybrid-astar",
            )
        if not asked.headings:
            return draw_queries(ground, free_cells(ground.grid, self.robot.radius), asked, self.root)
        return draw_queries(ground, free, asked, self.root, self._standing_on(ground))

    # ---- MovingAI --------------------

    def _benchmarks(self, spec: form.ScenTable, key_path: KeyPath) -> None:
        self._need_folder()
        path = self.files.path(spec.scen, (*key_path, "scen"))
        chosen = None if spec.map is None else self.files.path(spec.map, (*key_path, "map"))
        seen: set[tuple[str, Cell, Cell]] = set()
        for one in scen_files(path):
            found = movingai.load(one, self._map_for(one, chosen, key_path), max_cells=self.files.max_cells)
            # Published lengths are of octile moves on plain ground, of a robot that fits wherever a cell is free.
            compared = self.moves == "octile" and 2.0 * self.robot.radius <= found.document.grid.resolution
            compared &= self.inflation.inflation_radius == 0
            grounds: dict[bool, StudyMap] = {}
            for query in spread(found.queries, spec.limit):
                grid = grid_for(found.document, query.start)
                wet = grid is not found.document.grid
                if wet not in grounds:
                    grounds[wet] = self._ground(f"{grid.name} (water)" if wet else grid.name, grid, key_path)
                ground = grounds[wet]
                # A few published files have a query twice: it is asked once.
                key = (ground.hash, query.start, query.goal)
                if key not in seen:
                    seen.add(key)
                    length = query.length if compared else None
                    self._add(World(ground, query.start, query.goal, length), key_path)

    def _map_for(self, one: str, chosen: str | None, key_path: KeyPath) -> Path:
        """The map of a ``.scen``: the one given, or of the folder given, or beside it; no link leads out."""
        queries = read_scen(one)
        if chosen is None or not queries:
            found = movingai.beside(one, queries) if queries else Path(one)
        elif os.path.isdir(chosen):
            stem = Path(chosen, re.sub(r"\.scen$", "", Path(one).name, flags=re.IGNORECASE))
            found = stem if stem.is_file() else Path(chosen, re.split(r"[/\\]", queries[0].map)[-1])
        else:
            found = Path(chosen)
        # Its name is known only now; what is named in the file itself was looked at before.
        inside = Path(os.path.realpath(found)).is_relative_to(os.path.realpath(self.files.folder or "."))
        if not (inside or self.files.allow_outside):
            raise FileError(
                "PATH_OUTSIDE",
                f"map {shown(found.name)} is outside the study's folder",
                where=spot(self.tried.parsed, key_path),
                todo="put the file there, or give allow_outside=True if you trust the study",
            )
        return found


def spread(items: Sequence[T], limit: int | None) -> list[T]:
    """At most ``limit`` items: the first, the last, and evenly between."""
    n = len(items)
    if limit is None or n <= limit:
        return list(items)
    return [items[0]] if limit == 1 else [items[k * (n - 1) // (limit - 1)] for k in range(limit)]


def _stored(found: MapDocument) -> list[tuple[Cell, Cell]]:
    if found.queries:
        return [(q.start, q.goal) for q in found.queries]
    if found.start is None or found.goal is None:
        raise FileError(
            "QUERIES",
            f"map {shown(found.grid.name)} has no queries of its own",
            allowed="queries: {random: N}, or a list of {start: [x, y], goal: [x, y]}",
        )
    return [(found.start, found.goal)]


def listed_queries(
    queries: list[form.QueryTable], grid: Grid, key_path: KeyPath
) -> Iterator[tuple[QueryEnd, QueryEnd, KeyPath]]:
    """Both ends of each query of a list, and its place in the file."""
    for k, query in enumerate(queries):
        start, goal = (_end_of(end, grid) for end in (query.start, query.goal))
        if query.goal_track is not None:
            goal = goal._replace(track=tuple((x, y) for x, y in query.goal_track))
        yield start, goal, (*key_path, k)


def _end_of(end: list[int] | Point | Pose | CellPose, grid: Grid) -> QueryEnd:
    if isinstance(end, Pose):
        x, y, yaw = end.pose
        return QueryEnd(grid.to_cell(x, y), (x, y, yaw))
    if isinstance(end, CellPose):
        cell = (end.cell[0], end.cell[1])
        x, y = grid.to_metres(cell).tolist()
        return QueryEnd(cell, (x, y, end.yaw))
    return QueryEnd(grid.to_cell(*end.m) if isinstance(end, Point) else (end[0], end[1]))


def scen_files(path: str) -> list[str]:
    """The files: one, or all of a folder, by name."""
    if not os.path.isdir(path):
        return [path]
    try:
        names = sorted(name for name in os.listdir(path) if name.lower().endswith(".scen"))
    except OSError as problem:
        raise FileError("FILE_READ", problem.strerror or "cannot be read", where=repr(path[:200])) from None
    if not names:
        raise FileError("FILE_MISSING", "no .scen file is in the folder", where=repr(path[:200]))
    if len(names) > _FILES:
        raise LimitError("LIMIT", f"{len(names):,} .scen files", where=path, allowed=f"at most {_FILES:,}")
    return [os.path.join(path, name) for name in names]
