"""From what a file says of a map to the map: bundled, from another file, made by a recipe, or written out."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from lampyris.errors import FileError, LampyrisError, LimitError, SettingError, UsageError
from lampyris.io.maps import library
from lampyris.io.maps.formats.document import FileSource, MapDocument, document
from lampyris.io.maps.formats.plain_text import read_text
from lampyris.io.maps.formats.ros_yaml import plain_path
from lampyris.io.maps.load import load_map
from lampyris.io.maps.recipes.make import make_ground, recipe_named
from lampyris.io.scenario import schema as form
from lampyris.io.scenario.scenario import Bundled, Made, MapFile, MapSource
from lampyris.io.scenario.validation_errors import MOST, Document, in_order, raise_all, spot
from lampyris.io.text.strict_yaml import KeyPath, shown
from lampyris.model.grid import Grid


class Files:
    """The files that a file may name.

    Parameters
    ----------
    parsed : the file, read.
    allow_outside : whether it may name files outside the folder.
    max_cells : maps of more cells are refused.
    what : what kind of file it is, for messages.
    folder : what names are relative to; None: the file's own folder.
    """

    def __init__(
        self,
        parsed: Document,
        allow_outside: bool,
        max_cells: int,
        what: str = "scenario",
        folder: str | None = None,
    ) -> None:
        self.parsed, self.allow_outside, self.max_cells, self.what = parsed, allow_outside, max_cells, what
        self.folder = os.path.dirname(parsed.where) if folder is None else folder

    def path(self, name: str, key_path: KeyPath) -> str:
        """A path named in the file, as it can be opened; its form is looked at before anything is.

        Raises
        ------
        FileError : PATH_FORM, PATH_OUTSIDE, at its place in the file.
        """
        if not plain_path(name):
            raise FileError(
                "PATH_FORM",
                f"{shown(name)} is not a plain file name",
                where=spot(self.parsed, key_path),
                allowed="a path with / between its parts; no address, drive, pipe or share",
            )
        path = os.path.join(self.folder, os.path.normpath(name))
        inside = Path(os.path.realpath(path)).is_relative_to(os.path.realpath(self.folder or "."))
        if not (inside or self.allow_outside):
            raise FileError(
                "PATH_OUTSIDE",
                f"{shown(name)} is outside the {self.what}'s folder",
                where=spot(self.parsed, key_path),
                todo=f"put the file next to it, or give allow_outside=True if you trust the {self.what}",
            )
        return path

    def map_of(self, spec: Any, key_path: KeyPath) -> tuple[MapDocument, MapSource | None]:
        """The map that a table or a name says, and where it comes from; None: from its own rows.

        Raises
        ------
        LampyrisError : what is wrong with it.
        """
        if isinstance(spec, str | form.BundledMap):
            name, resolution = (spec, None) if isinstance(spec, str) else (spec.bundled, spec.resolution)
            return self._bundled(name, resolution, key_path), Bundled(name)
        if isinstance(spec, form.FileMap):
            path = self.path(spec.file, (*key_path, "file"))
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

    def _bundled(self, name: str, resolution: float | None, key_path: KeyPath) -> MapDocument:
        if name not in library.names() and ("/" in name or "." in name):
            key = "map: " if key_path == ("map",) else ""
            raise FileError(
                "FILE_MISSING",
                f"no bundled map is called {shown(name)}",
                allowed=", ".join(library.names()),
                todo=f"for a file write {key}{{file: {name}}}",
            )
        return library.load(name, resolution=resolution, max_cells=self.max_cells)

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
        source = FileSource("\n".join(spec.rows).encode(), "rows", self.max_cells)
        found = document(read_text(source), source, name=spec.name, format="text", resolution=spec.resolution)
        if found.grid.height != len(spec.rows):
            raise FileError("MAP_ROW", f"{len(spec.rows)} rows", allowed="rows of cells, without line breaks")
        x, y, yaw = spec.origin
        return replace(found, grid=replace(found.grid, origin=(x, y, yaw)))


class NoFiles(Files):
    """For what is in no file itself, such as the app's scenarios: nothing is opened by name.

    Parameters
    ----------
    given, source : the map, whatever is said of it, and where it comes from.
    """

    def __init__(
        self, parsed: Document, max_cells: int, given: MapDocument | None, source: MapSource | None
    ) -> None:
        super().__init__(parsed, False, max_cells, folder="")
        self._given, self._source = given, source

    def path(self, name: str, key_path: KeyPath) -> str:
        """Refuse.

        Raises
        ------
        FileError : PATH_OUTSIDE.
        """
        raise FileError(
            "PATH_OUTSIDE",
            "a file, and no files are opened here",
            where=spot(self.parsed, key_path),
            todo="write out what it holds, or run the scenario's file with the command line",
        )

    def map_of(self, spec: Any, key_path: KeyPath) -> tuple[MapDocument, MapSource | None]:
        """The given map; see :meth:`Files.map_of` where none is given."""
        return super().map_of(spec, key_path) if self._given is None else (self._given, self._source)


def setting_path(fault: LampyrisError, settings: Mapping[str, Any]) -> KeyPath:
    """The keys of the setting that a mistake is about, within a table of settings; empty: it is about none of them.

    The mistake names a setting with or without its owner (``physical.moving.margin``); the table may hold it under a
    dotted name or in tables within it.
    """
    names = fault.setting.split(".")
    for k, name in enumerate(names):
        dotted = ".".join(names[k:])
        if dotted in settings:
            return (dotted,)
        inner = settings.get(name)
        if isinstance(inner, Mapping):
            rest = ".".join(names[k + 1 :])
            return (name, rest) if rest in inner else (name,)
    return ()


def placed(fault: LampyrisError, parsed: Document, key_path: KeyPath) -> LampyrisError:
    """A mistake with its place in the file; an unknown word is bad input here, exit code 3."""
    where = "" if fault.where in key_path else fault.where
    if not where.startswith(f"{parsed.where}:"):
        where = f"{spot(parsed, key_path)}: {where}" if where else spot(parsed, key_path)
    kind = SettingError if isinstance(fault, UsageError) else type(fault)
    return kind(fault.code, fault.what, where=where, allowed=fault.allowed, todo=fault.todo)


class Mistakes:
    """What is wrong with a file: the first hundred mistakes with their places, of the others the number.

    Parameters
    ----------
    parsed : the file.
    """

    def __init__(self, parsed: Document) -> None:
        self.parsed = parsed
        self._first: list[LampyrisError] = []
        self._count = 0

    def keep(self, key_path: KeyPath, fault: Callable[[], LampyrisError] | LampyrisError) -> None:
        """Keep a mistake; one that takes time to tell of may be given as what makes it."""
        self._count += 1
        if len(self._first) < 5 * MOST:
            self._first.append(
                placed(fault if isinstance(fault, LampyrisError) else fault(), self.parsed, key_path)
            )

    def __len__(self) -> int:
        return self._count

    def give(self) -> NoReturn:
        """Raise them, in the order of the file."""
        raise_all(in_order(self.parsed, self._first), self._count)
