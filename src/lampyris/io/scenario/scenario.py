"""Scenario: everything that decides a run, from a file to nouns.

A file is read as YAML or JSON, checked by the models of :mod:`lampyris.io.scenario.schema`, and made into
nouns by :mod:`lampyris.io.scenario.build`. Both need pydantic and are imported when a file is read.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import FileError, LimitError, SettingError, file_name, of_kind, shown
from lampyris.io.files import read_regular
from lampyris.io.text.csv_table import MAX_BYTES
from lampyris.model.edit import MAX_EDITS, Edit, applied, check_edits
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.traffic import MAX_BODIES

if TYPE_CHECKING:
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.io.scenario.map_source import Files
    from lampyris.io.scenario.validation_errors import Document

MAX_SEED = 2**63 - 1
PRESETS = {"robot": ("octile", "physical"), "dissertation": ("dissertation", "dissertation")}
"""Moves and speed law by the name of the preset."""


@dataclass(frozen=True, slots=True)
class Bundled:
    """A bundled map, by its name."""

    name: str


@dataclass(frozen=True, slots=True)
class MapFile:
    """A map file: its path as it can be opened from here, and how it is read."""

    path: str
    values: str = "occupancy"
    colour: str = "legend"


@dataclass(frozen=True, slots=True)
class Made:
    """A map made by a recipe."""

    recipe: str
    size: tuple[int, int]
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)


MapSource: TypeAlias = Bundled | MapFile | Made


@dataclass(frozen=True, slots=True, eq=False)
class Scenario:
    """Everything that decides a run; equal scenarios give the same bytes.

    Parameters
    ----------
    scene : map, ends, moves, robot and moving obstacles.
    planner, settings : who plans, by name, and its settings.
    law, law_settings : the speed law, by name, and its settings.
    seed : root of every draw.
    simulated : whether to simulate; otherwise to plan.
    ticks, patience : of a simulation; None: its own defaults.
    name : what to call it.
    map : where the map comes from; None: from its cells. Left out of comparisons, like the last two.
    notes : sentences a person should read.
    where : the file it was read from.
    zones : the file that the scene's speed zones are from; None: there are none, or they are in no file.
    drive : settings of a drive in continuous time; None: it is none.
    edits : walls that come and go, all of them, in order of time; None: those of the scene. The scene follows
        them: what is of tick 0 is in its grid, the later ones are its edits.
    ground : the map before the edit of tick 0; None: the scene's grid. The scene's grid is made from it.

    Raises
    ------
    SettingError, SceneError, LimitError : as :func:`lampyris.model.edit.check_edits`.
    """

    scene: Scene
    planner: str = "ad-gso"
    settings: Mapping[str, Any] = field(default_factory=dict)
    law: str = "physical"
    law_settings: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    simulated: bool = False
    ticks: int | None = None
    patience: int | None = None
    name: str = ""
    map: MapSource | None = None
    notes: tuple[str, ...] = ()
    where: str = ""
    zones: str | None = None
    drive: Mapping[str, Any] | None = None
    edits: tuple[Edit, ...] = None  # type: ignore[assignment]
    ground: Grid | None = None

    def __post_init__(self) -> None:
        for what, value, kind in (("scene", self.scene, Scene), ("ground", self.ground, Grid)):
            if not isinstance(value, kind) and not (what == "ground" and value is None):
                raise SettingError("TYPE", shown(value), where=what, allowed=f"a {kind.__name__}")
        scene, given = self.scene, self.ground
        edits = scene.edits if self.edits is None else check_edits(scene.grid, self.edits)
        object.__setattr__(self, "edits", edits)
        now = edits[:1] if edits and edits[0].tick == 0 else ()
        later = edits[len(now) :]
        if now and given is None:
            object.__setattr__(self, "ground", scene.grid)
        elif given is not None and not now:
            object.__setattr__(self, "ground", None)
        grid = scene.grid if given is None and not now else applied(given or scene.grid, now)
        if grid is not scene.grid or later != scene.edits:
            object.__setattr__(self, "scene", replace(scene, grid=grid, edits=later))

    @property
    def drawn(self) -> Grid:
        """The map before any edit: what ``map`` and its hash are of."""
        return self.scene.grid if self.ground is None else self.ground

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scenario):
            return NotImplemented
        a, b = self.scene, other.scene
        return (
            (a.start, a.goal, a.moves, a.robot, a.traffic) == (b.start, b.goal, b.moves, b.robot, b.traffic)
            and _decided(self) == _decided(other)
            and _same_map(self.drawn, other.drawn)
            and _same(a.zones, b.zones)
        )

    __hash__ = None  # type: ignore[assignment]


def _decided(one: Scenario) -> tuple[Any, ...]:
    who = (one.planner, dict(one.settings), one.law, dict(one.law_settings), one.seed)
    drive = None if one.drive is None else dict(one.drive)
    return (*who, one.simulated, one.ticks, one.patience, one.name, drive, one.edits)


def _same_map(a: Grid, b: Grid) -> bool:
    return (
        (a.resolution, a.origin, a.name) == (b.resolution, b.origin, b.name)
        and np.array_equal(a.blocked, b.blocked)
        and _same(a.unknown, b.unknown)
        and _same(a.terrain, b.terrain)
    )


def _same(a: NDArray[Any] | None, b: NDArray[Any] | None) -> bool:
    return np.array_equal(a, b) if a is not None and b is not None else a is b


class Names(Protocol):
    """What rooms above this one know by name: asked, not imported. All raise what is wrong."""

    def planner(self, name: str, settings: Mapping[str, Any]) -> object:
        """Whether there is such a planner with such settings."""
        ...

    def law(self, name: str, settings: Mapping[str, Any]) -> object:
        """Whether there is such a speed law with such settings."""
        ...

    def drive(self, settings: Mapping[str, Any]) -> object:
        """Whether a drive has such settings."""
        ...


def read_scenario(
    path: str | os.PathLike[str], names: Names, *, allow_outside: bool = False, max_cells: int = MAX_CELLS
) -> Scenario:
    """Read a scenario file: JSON if its name ends in ``.json``, YAML otherwise.

    Parameters
    ----------
    path : the file. What it names is relative to its folder.
    names : who knows planners and laws.
    allow_outside : whether it may name files outside its folder.
    max_cells : maps of more cells are refused.

    Raises
    ------
    LampyrisError : the first mistake in the file; the others are its notes, a line each.
    """
    from lampyris.io.maps.formats.document import check_limit
    from lampyris.io.scenario.map_source import Files
    from lampyris.io.scenario.schema import VERSION

    check_limit(max_cells)
    of_kind("allow_outside", allow_outside, bool)
    said = read_document(file_name("path", path), VERSION)
    return _built(said, names, lambda: Files(said, allow_outside, max_cells))


def scenario_of(
    data: dict[str, Any],
    names: Names,
    *,
    where: str = "scenario",
    given: MapDocument | None = None,
    source: MapSource | None = None,
    max_cells: int = MAX_CELLS,
) -> Scenario:
    """A scenario from plain data that is in no file; nothing that it names is opened.

    Parameters
    ----------
    data : what a scenario file holds. Lists of tracks and maps in files of their own are refused.
    names : who knows planners and laws.
    where : what to call it in messages, before the JSON pointer.
    given : the map, whatever ``data`` says of it; None: bundled, made by a recipe or written out in rows.
    source : where the given map comes from; None: from its cells.
    max_cells : maps of more cells are refused.

    Raises
    ------
    LampyrisError : the first mistake; the others are its notes.
    """
    from lampyris.io.scenario.map_source import NoFiles
    from lampyris.io.scenario.schema import VERSION
    from lampyris.io.scenario.validation_errors import PlainDocument

    said = PlainDocument(data, where)
    check_version(said, VERSION)
    return _built(said, names, lambda: NoFiles(said, max_cells, given, source))


def _built(said: Document, names: Names, files: Callable[[], Files]) -> Scenario:
    from pydantic import ValidationError

    from lampyris.io.scenario.build import build
    from lampyris.io.scenario.schema import ScenarioFile
    from lampyris.io.scenario.validation_errors import faults_of, raise_all, spot

    for key, most in (("obstacles", MAX_BODIES), ("edits", MAX_EDITS)):
        given = said.data.get(key)
        if isinstance(given, list) and len(given) > most:
            what = f"{len(given):,} {key}"
            raise LimitError("LIMIT", what, where=spot(said, (key,)), allowed=f"at most {most:,}")
    try:
        file = ScenarioFile.model_validate(said.data)
    except ValidationError as problem:
        raise_all(faults_of(said, problem), problem.error_count())
    return build(said, file, names, files())


def read_document(name: str, version: int) -> Document:
    """A file as plain data, every value with its place: JSON if its name ends in ``.json``, YAML otherwise.

    Raises
    ------
    FileError : what is wrong with it; VERSION: it has another version than this. Of no other key is said
        anything then: each might be called unknown.
    LimitError : it is too large.
    """
    said = _read(name)
    check_version(said, version)
    return said


def check_version(said: Document, version: int) -> None:
    """Refuse another version than this.

    Raises
    ------
    FileError : VERSION.
    """
    from lampyris.io.scenario.validation_errors import brief, spot

    given = said.data.get("version", version)
    if isinstance(given, bool) or given != version:
        newer = isinstance(given, int) and given > version
        raise FileError(
            "VERSION",
            brief(given) + (": made for a newer release" if newer else ""),
            where=spot(said, ("version",)),
            allowed=f"version {version}",
        )


def _read(name: str) -> Document:
    as_json = Path(name).suffix.lower() == ".json"
    try:
        data = read_regular(name, MAX_BYTES)
    except LimitError as large:
        code = "JSON_SIZE" if as_json else "YAML_SIZE"
        raise LimitError(code, large.what, where=large.where, allowed=large.allowed) from None
    if as_json:
        from lampyris.io.text.strict_json import read_json

        return read_json(data, name)
    from lampyris.io.text.strict_yaml import read_yaml

    return read_yaml(data, name)
