"""Made: maps by recipes, to be looked at and opened. An engine makes them: large ones take a while."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from lampyris.app.engine.frames import frame, json_frame
from lampyris.app.engine.parse import scenario_of_request
from lampyris.errors import FileError
from lampyris.io.maps.formats.document import grid_codes
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.io.scenario.scenario import Made
from lampyris.model.grid import Grid
from lampyris.typing import Cell


def make(question: Mapping[str, Any], look: Callable[[], None]) -> Iterator[bytes]:
    """A map as the library gives one: ``H``, ``B`` of its cells, with terrain one more; then ``Z``.

    Parameters
    ----------
    question : ``map``: {recipe, size, seed, settings, resolution}, as a scenario says it.

    Raises
    ------
    LampyrisError : what is wrong with it, at its place in a scenario.
    """
    spec = question.get("map")
    if not isinstance(spec, dict) or "recipe" not in spec:
        raise FileError("MAP", f"{spec!r:.60}", where="map", allowed="{recipe, size, seed, settings}")
    # Ends anywhere: what is looked at is the map.
    scenario = scenario_of_request({"scenario": {"version": 1, "map": spec, "start": [0, 0], "goal": [1, 1]}})
    grid, source = scenario.scene.grid, scenario.map
    assert isinstance(source, Made)
    start, goal = far_ends(grid)
    look()
    yield json_frame("H", {
        "id": "", "name": f"{source.recipe}, seed {source.seed}", "kind": "recipe", "width": grid.width,
        "height": grid.height, "resolution": grid.resolution, "origin": list(grid.origin),
        "hash": map_hash(grid), "start": start, "goal": goal, "notes": list(scenario.notes),
        "free": 1.0 - float(np.count_nonzero(grid.blocked)) / grid.blocked.size,
    })  # fmt: skip
    yield frame("B", np.ascontiguousarray(grid_codes(grid)).tobytes())
    if grid.terrain is not None:
        yield frame("B", grid.terrain.tobytes())
    yield json_frame("Z", {})


def far_ends(grid: Grid) -> tuple[Cell, Cell]:
    """A start and a goal that can reach each other, so that there is something to see at once: the cells of
    the largest free region that are nearest to the upper left and to the lower right corner."""
    y, x = np.nonzero(~keep_largest(grid.blocked))
    first, last = int(np.argmin(x + y)), int(np.argmax(x + y))
    return (int(x[first]), int(y[first])), (int(x[last]), int(y[last]))
