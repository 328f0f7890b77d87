"""The bundled maps: the dissertation's guide map, and maps of our own made by seeded recipes.

Every map is kept as its cells (text, a PNG of one bit a cell, or with terrain a grey PNG of costmap values),
not only as its recipe: making the large ones takes up to a second besides the import of SciPy, reading them
some hundredths. Its recipe is kept as well, and a test makes each map again and compares every cell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pkgutil import get_data
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import FileError, did_you_mean
from lampyris.io.maps.formats.document import FileSource, MapDocument, MapQuery, Reading, document
from lampyris.typing import BoolGrid

if TYPE_CHECKING:
    from lampyris.io.maps.recipes.make import RecipeCells


@dataclass(frozen=True, slots=True)
class TerrainInfo:
    """What a map's terrain is like.

    Parameters
    ----------
    cells : how many free cells are not plain ground.
    lowest, highest : values among them, 1 to 252.
    """

    cells: int
    lowest: int
    highest: int


@dataclass(frozen=True, slots=True)
class MapInfo:
    """One row of the table of bundled maps.

    Parameters
    ----------
    name, title, description : what to call it and what it is.
    width, height : cells.
    free : share of the cells that are free, 0 to 1.
    gates : gate cells in the whole map (method.md, "Gates").
    queries : stored starts and goals; the first is the map's own.
    recipe : in words, how to make the map again; empty for a map that was not made by a recipe.
    hash : of its cells (:func:`lampyris.io.maps.map_hash.map_hash`).
    terrain : None where all ground is plain.
    """

    name: str
    title: str
    description: str
    width: int
    height: int
    free: float
    gates: int
    queries: tuple[MapQuery, ...]
    recipe: str
    hash: str
    terrain: TerrainInfo | None = None


def names() -> tuple[str, ...]:
    """The names of the bundled maps, in the order in which to show them."""
    return tuple(_index())


def is_bundled(name: str) -> bool:
    """Whether a bundled map is called like this."""
    return "." not in name and "/" not in name and name in _index()  # no such name: no index is read


def load(name: str, *, resolution: float | None = None, max_cells: int = MAX_CELLS) -> MapDocument:
    """A bundled map with its queries; the first query is its start and goal.

    Raises
    ------
    FileError : no bundled map of that name.
    LimitError : it has more cells than ``max_cells``.
    """
    entry = _entry(name)
    data = _data(entry["file"])
    values = "costmap" if entry.get("terrain") else "occupancy"
    source = FileSource(data, name, max_cells, values=values)
    queries = _queries(entry)
    made = document(
        _reading(source, entry["file"]),
        source,
        name=name,
        format="bundled",
        resolution=resolution,
        queries=queries,
    )
    first = queries[0]
    return MapDocument(made.grid, first.start, first.goal, made.obstacle_cells, queries, "bundled")


def describe(name: str) -> MapInfo:
    """What there is to say about a bundled map, without reading its cells.

    Raises
    ------
    FileError : no bundled map of that name.
    """
    entry = _entry(name)
    cells = entry["width"] * entry["height"]
    terrain = entry.get("terrain")
    return MapInfo(
        name,
        entry["title"],
        entry["description"],
        entry["width"],
        entry["height"],
        1.0 - entry["blocked"] / cells,
        entry["gates"],
        _queries(entry),
        _recipe_words(entry["recipe"]),
        entry["hash"],
        None if terrain is None else TerrainInfo(**terrain),
    )


def thumbnail_png(name: str) -> bytes:
    """A small picture of a bundled map, a PNG of at most 128 x 128 pixels.

    Raises
    ------
    FileError : no bundled map of that name.
    """
    _entry(name)
    return _data(f"thumbs/{name}.png")


def remake(name: str) -> BoolGrid:
    """The blocked cells of a bundled map, made again from its recipe and edits: see :func:`remake_ground`."""
    return remake_ground(name).blocked


def remake_ground(name: str) -> RecipeCells:
    """The cells of a bundled map, made again from its recipe and edits.

    Raises
    ------
    FileError : no bundled map of that name, or one that was not made by a recipe.
    """
    from lampyris.io.maps.recipes.make import RectangleEdit, make_ground

    recipe = _entry(name)["recipe"]
    if recipe is None:
        raise FileError("RECIPE", "this map was not made by a recipe", where=name)
    edits = tuple(RectangleEdit(x, y, w, h, bool(wall)) for x, y, w, h, wall in recipe["edits"])
    return make_ground(
        recipe["name"], recipe["width"], recipe["height"], recipe["seed"], edits=edits, **recipe["settings"]
    )


@cache
def _index() -> Mapping[str, Mapping[str, Any]]:
    import json

    return MappingProxyType(json.loads(_data("index.json"))["maps"])


def _data(file: str) -> bytes:
    """What a file of the package holds. (importlib.resources takes 5 ms to import.)"""
    data = get_data("lampyris.io.maps", f"data/{file}")
    assert data is not None
    return data


def _reading(source: FileSource, file: str) -> Reading:
    if file.endswith(".txt"):
        from lampyris.io.maps.formats.plain_text import read_text

        return read_text(source)
    from lampyris.io.maps.formats.png import read_png

    return read_png(source)


def _entry(name: str) -> Mapping[str, Any]:
    try:
        return _index()[name]
    except KeyError:
        raise FileError(
            "FILE_MISSING",
            "no bundled map of that name",
            where=name,
            allowed=", ".join(names()),
            todo=did_you_mean(name, names()),
        ) from None


def _recipe_words(recipe: Mapping[str, Any] | None) -> str:
    """Such as ``maze, seed 7, corridor=2``; kept cells and edits are counted, not listed."""
    if recipe is None:
        return ""
    words = [recipe["name"], f"seed {recipe['seed']}"]
    for key, value in recipe["settings"].items():
        words.append(f"{len(value)} cells kept" if isinstance(value, list) else f"{key}={value}")
    if recipe["edits"]:
        words.append(f"{len(recipe['edits'])} edits")
    return ", ".join(words)


def _queries(entry: Mapping[str, Any]) -> tuple[MapQuery, ...]:
    return tuple(
        MapQuery(
            (q["start"][0], q["start"][1]),
            (q["goal"][0], q["goal"][1]),
            q["gates"],
            q["label"],
            *((q[k][0], q[k][1]) if k in q else None for k in ("octile", "weighed")),
        )
        for q in entry["queries"]
    )
