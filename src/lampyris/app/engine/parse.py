"""Said: the scenario of a question, from the page's JSON and the map that the server put beside it.

What the page says is what a scenario file says. No file is opened for it: maps come from the package,
from a recipe, from rows, or packed beside the question.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps import library
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.scenario.scenario import Bundled, Made, MapSource, Scenario
from lampyris.model.grid import Grid
from lampyris.scenarios import scenario_of
from lampyris.study.design import study_map
from lampyris.typing import Cell

MOST_SIDE: Final = 8192
"""Neither side of a map may be longer: cells go over the wire as 16 bits, and browsers draw no more."""
KEPT: Final = 4
"""Maps that are kept as nouns, so that a drag does not unpack one at each step."""
ENDS: Final = ("start", "goal")

PAINTED: Final = ("plan", "layer")
"""What is asked at each step of a drag, and needs the map with its walls, however it came by them."""

_maps: dict[str, MapDocument] = {}
_walls: dict[tuple[int, str], tuple[MapDocument, Grid]] = {}
"""Maps with painted walls, by the map and these, so that a drag does not read them at each step: 25,000 cells
took a quarter of a second. With each the map itself, so that no other takes its place."""


def scenario_of_request(question: Mapping[str, Any]) -> Scenario:
    """The scenario of a question.

    Parameters
    ----------
    question : ``scenario`` is what the page says; ``ground``, if it is there, a map as
        :func:`lampyris.study.design.study_map.pack` makes it, perhaps with its own ``start`` and ``goal``. It is taken
        whatever the scenario's ``map`` says, unless that is the name of a bundled map.

    Raises
    ------
    LampyrisError : the first mistake, at its JSON pointer; the others are its notes.
    LimitError : MAP_SIDE.
    """
    data = question.get("scenario")
    if not isinstance(data, dict):
        raise FileError("KEY", "no scenario", where="scenario", allowed="a table")
    given, source = _map(data.get("map"), question.get("ground"))
    if given is not None:
        data = {**data, "map": source.name if isinstance(source, Bundled) else "map"}
    if not data.get("edits"):
        # The page always has the list; what is empty says nothing.
        data = _plain(data)
    painted = None if given is None or question.get("verb") not in PAINTED else _painted(data)
    known = _walls.get((id(given), painted or ""))
    if given is not None and known is not None:
        made = scenario_of(_plain(data), given=replace(given, grid=known[1]), source=source)
    else:
        made = scenario_of(data, given=given, source=source)
        if given is not None and painted is not None:
            _walls[id(given), painted] = (given, made.scene.grid)
            while len(_walls) > KEPT:
                del _walls[next(iter(_walls))]
    grid = made.scene.grid
    if max(grid.width, grid.height) > MOST_SIDE:
        raise LimitError(
            "MAP_SIDE",
            f"{grid.width} x {grid.height}",
            where="scenario: /map",
            allowed=f"sides up to {MOST_SIDE:,}",
        )
    return made


def _plain(data: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key != "edits"}


def _painted(data: Mapping[str, Any]) -> str | None:
    """A scenario's walls as one word, if all of them are there from the start and nothing else speaks of the
    map without them; else None."""
    edits = data.get("edits")
    if not edits or not isinstance(edits, list) or data.get("map_hash") is not None or data.get("drive"):
        return None
    if not all(isinstance(one, dict) and one.get("tick") == 0 for one in edits):
        return None
    return json.dumps(edits)


def _map(spec: Any, packed: Any) -> tuple[MapDocument | None, MapSource | None]:
    """The map that is given, and where it comes from; None: the scenario says it itself."""
    if isinstance(spec, str) and spec in library.names():
        return _kept(f"bundled {spec}", lambda: library.load(spec)), Bundled(spec)
    if packed is None:
        return _by_recipe(spec)
    if not isinstance(packed, Mapping):
        raise FileError("PACKED_MAP", "no packed map", where="ground")
    key = hashlib.sha256(json.dumps(packed, sort_keys=True).encode()).hexdigest()
    return _kept(key, lambda: unpacked(packed)), None


def _by_recipe(spec: Any) -> tuple[MapDocument | None, MapSource | None]:
    """A map by a recipe, made once and not at each step of a drag. The scenario tells mistakes."""
    if not isinstance(spec, dict) or "recipe" not in spec:
        return None, None
    ends = {"start": [0, 0], "goal": [1, 1]}

    def make() -> MapDocument:
        scene = scenario_of({"version": 1, "map": spec, **ends}).scene
        return MapDocument(scene.grid, format="recipe")

    try:
        found = _kept(f"recipe {json.dumps(spec, sort_keys=True)}", make)
    except (LampyrisError, ValueError, TypeError):
        return None, None
    width, height = spec["size"]
    source = Made(spec["recipe"], (width, height), spec.get("seed", 0), spec.get("settings", {}))
    return found, source


def unpacked(packed: Mapping[str, Any]) -> MapDocument:
    """The map of a packed one, with its ends if it has any.

    Raises
    ------
    FileError : PACKED_MAP; LimitError : MAP_TOO_LARGE.
    """
    grid = study_map.unpack({key: value for key, value in packed.items() if key not in ENDS})
    start, goal = (_cell(packed.get(end)) for end in ENDS)
    return MapDocument(grid, start, goal, format="packed")


def _cell(given: Any) -> Cell | None:
    if not isinstance(given, list | tuple) or len(given) != 2 or not all(type(c) is int for c in given):
        return None
    return (given[0], given[1])


def _kept(key: str, make: Any) -> MapDocument:
    found = _maps.pop(key, None)
    made: MapDocument = make() if found is None else found
    _maps[key] = made
    while len(_maps) > KEPT:
        del _maps[next(iter(_maps))]
    return made
