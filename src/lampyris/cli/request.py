"""From the words of a call to the nouns of a scene."""

from __future__ import annotations

import csv
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.errors import FileError, SettingError, UsageError
from lampyris.field.layers import moves_for
from lampyris.maps.document import MapDocument
from lampyris.maps.load import load_map
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded, Traffic
from lampyris.planners import registry
from lampyris.typing import Cell

PRESETS = {"robot": ("octile", "physical"), "dissertation": ("dissertation", "dissertation")}
MOBILITIES = ("random-walk", "patrol", "crossing", "mixed")


@dataclass(frozen=True)
class Request:
    """The options that ``plan`` and ``simulate`` share, as they were typed."""

    map_: str
    start: str | None
    goal: str | None
    start_m: str | None
    goal_m: str | None
    planner: str
    preset: str
    moves: str | None
    law: str | None
    settings: list[str]
    seed: int
    resolution: float | None
    radius: float
    v_max: float
    a_max: float
    d_max: float

    def load(self) -> MapDocument:
        """The map."""
        return load_map(self.map_, resolution=self.resolution)

    def preset_of(self) -> tuple[str, str]:
        """Moves and speed law: those given, or the preset's."""
        if self.preset not in PRESETS:
            raise UsageError("PRESET", f"no preset is called {self.preset!r}", allowed=", ".join(PRESETS))
        moves, law = PRESETS[self.preset]
        return self.moves or moves, self.law or law

    def scene(self, document: MapDocument) -> Scene:
        """The scene without traffic."""
        moves, _ = self.preset_of()
        return Scene(
            document.grid,
            self._end("start", self.start, self.start_m, document),
            self._end("goal", self.goal, self.goal_m, document),
            moves=moves,  # type: ignore[arg-type]
            robot=Robot(self.radius, self.v_max, self.a_max, self.d_max),
        )

    def about(self, scene: Scene) -> tuple[str, ...]:
        """What a person should know of how the request is understood."""
        if moves_for(scene) == scene.moves:
            return ()
        return (
            f"a robot with a radius drives {scene.moves.name} moves without cut corners or knight's steps",
        )

    def planner_settings(self) -> dict[str, Any]:
        """The ``--set`` words, each read as its setting's type."""
        return parse_settings(self.planner, self.settings)

    def _end(self, what: str, cell: str | None, metres: str | None, document: MapDocument) -> Cell:
        if cell is not None and metres is not None:
            raise UsageError("OPTIONS", f"--{what} and --{what}-m both given", allowed="one of them")
        if cell is not None:
            x, y = _pair(cell, f"--{what}", int)
            return (x, y)
        if metres is not None:
            x, y = _pair(metres, f"--{what}-m", float)
            return document.grid.to_cell(x, y)
        own = getattr(document, what)
        if own is None and document.queries:
            own = getattr(document.queries[0], what)
        if own is None:
            raise UsageError(
                "OPTIONS",
                f"{self.map_} has no {what} of its own",
                todo=f"give --{what} X,Y (a cell) or --{what}-m X,Y (metres)",
            )
        return typing.cast(Cell, own)


@dataclass(frozen=True)
class TrafficRequest:
    """The options that say what moves besides the robot."""

    count: int
    mobility: str
    rate: float | None
    radius: float
    tracks: tuple[Path, ...]

    def traffic(self, grid: Grid, seed: int) -> tuple[Traffic, ...]:
        """The specifications."""
        if self.mobility not in MOBILITIES:
            raise UsageError(
                "MOBILITY", f"no mobility is called {self.mobility!r}", allowed=", ".join(MOBILITIES)
            )
        if self.rate is not None and self.mobility not in ("random-walk", "mixed"):
            raise UsageError("OPTIONS", f"--rate with --mobility {self.mobility}", allowed="random walkers")
        walk, patrol, crossing = {
            "random-walk": (self.count, 0, 0),
            "patrol": (0, self.count, 0),
            "crossing": (0, 0, self.count),
            "mixed": (self.count - 2 * (self.count // 3), self.count // 3, self.count // 3),
        }[self.mobility]
        RandomWalk(self.count)  # refuses a count that is negative or too large, whatever the mobility
        made: list[Traffic] = [Recorded(read_track(p), self.radius) for p in self.tracks]
        made += [Crossing(crossing, self.radius)] if crossing else []
        made += self._patrols(patrol, grid, seed)
        made += [RandomWalk(walk, self.rate, self.radius)] if walk else []
        return tuple(made)

    def _patrols(self, count: int, grid: Grid, seed: int) -> list[Traffic]:
        """Patrols between random cells of one region, a dozen cells or so apart."""
        if not count:
            return []
        from scipy.ndimage import label

        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, 0x9A7901))))
        region, _ = label(~grid.blocked, structure=np.ones((3, 3)))
        ys, xs = np.nonzero(region)
        made: list[Traffic] = []
        taken: set[Cell] = set()
        for _ in range(count * 200):
            if len(made) == count:
                return made
            i = int(rng.integers(len(xs)))
            a = (int(xs[i]), int(ys[i]))
            near = np.nonzero(
                (np.maximum(np.abs(xs - a[0]), np.abs(ys - a[1])) <= 12)
                & (region[ys, xs] == region[a[1], a[0]])
            )[0]
            j = int(near[int(rng.integers(len(near)))])
            b = (int(xs[j]), int(ys[j]))
            if a == b or {a, b} & taken:
                continue
            taken |= {a, b}
            made.append(Patrol((a, b), self.radius))
        raise UsageError("OPTIONS", f"{count} patrols do not fit this map", allowed=f"about {len(made)}")


def _pair(text: str, where: str, kind: type[Any]) -> tuple[Any, Any]:
    parts = text.split(",")
    try:
        if len(parts) != 2:
            raise ValueError
        return kind(parts[0]), kind(parts[1])
    except ValueError:
        allowed = "two whole numbers X,Y" if kind is int else "two numbers X,Y"
        raise UsageError("TYPE", f"{text!r}", where=where, allowed=allowed) from None


def parse_settings(planner: str, words: list[str]) -> dict[str, Any]:
    """``KEY=VALUE`` words as the types the planner's settings declare.

    Raises
    ------
    UsageError : a word without ``=``, or a value of the wrong type.
    SettingError : a setting the planner does not have.
    """
    kind = registry.planner_class(planner)
    hints = typing.get_type_hints(kind)
    known = {f.name: hints[f.name] for f in dataclass_fields(kind)}  # type: ignore[arg-type]
    given: dict[str, Any] = {}
    for word in words:
        key, equals, value = word.partition("=")
        key = key.strip().replace("-", "_")
        if not equals or not key:
            raise UsageError("SET", f"{word!r}", where="--set", allowed="KEY=VALUE")
        given[key] = _value(planner, key, value.strip(), known)
    return given


def _value(planner: str, key: str, text: str, known: Mapping[str, Any]) -> Any:
    if key not in known:
        registry.make(planner, {key: None})  # raises, naming the settings there are
        raise SettingError("SETTING", f"{planner} has no setting {key!r}")
    options = _plain_types(known[key])
    if type(None) in options and text.lower() in ("none", "null"):
        return None
    if bool in options and text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        if kind in options:
            try:
                return kind(text)
            except ValueError:
                continue
    if str in options:
        return text
    allowed = " or ".join(k.__name__ for k in options if k is not type(None))
    raise UsageError("TYPE", f"{text!r}", where=f"--set {key}", allowed=allowed)


def _plain_types(hint: Any) -> set[type]:
    """The plain types in an annotation: int | None -> {int, NoneType}; Literal["a"] -> {str}."""
    origin = typing.get_origin(hint)
    if origin is typing.Literal:
        return {type(v) for v in typing.get_args(hint)}
    if origin in (typing.Union, types.UnionType):
        return set().union(*(_plain_types(h) for h in typing.get_args(hint)))
    return {hint} if isinstance(hint, type) else {str}


def read_track(path: Path) -> tuple[Cell, ...]:
    """A recorded track: a CSV with columns x and y, one row a tick.

    Raises
    ------
    FileError : it cannot be read, has no such columns, or a row is not two whole numbers.
    """
    if not path.is_file():
        raise FileError("FILE_MISSING", "no such track file", where=str(path))
    try:
        rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FileError("TRACK", f"cannot be read: {error}", where=str(path)) from None
    cells = []
    for line, row in enumerate(rows, start=2):
        try:
            cells.append((int(row["x"]), int(row["y"])))
        except (KeyError, TypeError, ValueError):
            raise FileError(
                "TRACK", f"{dict(row)}", where=f"{path}:{line}", allowed="columns x and y, whole numbers"
            ) from None
    return tuple(cells)
