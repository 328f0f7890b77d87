"""Random maps to be written and read again, and what each format can hold of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from lampyris.io.maps.formats.costmap import FROM_OCCUPANCY
from lampyris.io.maps.formats.document import MapDocument
from lampyris.model.grid import Grid

Way: TypeAlias = tuple[str, str]
"""A file's ending, and what its numbers mean."""

HOLDS: Mapping[Way, frozenset[str]] = {
    (".png", "occupancy"): frozenset({"unknown", "marks"}),
    (".txt", "occupancy"): frozenset({"unknown", "marks"}),
    (".pgm", "occupancy"): frozenset({"unknown"}),
    (".npy", "occupancy"): frozenset({"unknown"}),
    (".csv", "occupancy"): frozenset({"unknown"}),
    (".map", "occupancy"): frozenset(),
    (".yaml", "occupancy"): frozenset({"unknown", "frame"}),
    (".png", "costmap"): frozenset({"unknown", "terrain"}),
    (".pgm", "costmap"): frozenset({"unknown", "terrain"}),
    (".npy", "costmap"): frozenset({"unknown", "terrain"}),
    (".csv", "costmap"): frozenset({"unknown", "terrain"}),
    (".yaml", "costmap"): frozenset({"unknown", "terrain", "frame"}),
}
"""What each format holds besides size and blocked cells, by the formats' own definitions."""
_EXACT = sorted({int(FROM_OCCUPANCY[v]) for v in range(1, 99)})
"""Of the two or three costs that share an occupancy in a ROS map, the one that comes back."""


def drawn(rng: np.random.Generator, wanted: frozenset[str], *, shared: bool) -> MapDocument:
    """A map of 1 to 24 cells a side with some of the wanted things in it.

    Parameters
    ----------
    rng : the case's.
    wanted : what the format holds.
    shared : whether a ROS map must be able to hold its terrain exactly.
    """
    height, width = (int(n) for n in np.minimum(rng.integers(1, 25, 2), rng.integers(1, 25, 2)))
    kind = rng.choice(3 if "unknown" in wanted else 2, (height, width))
    marks: dict[str, Any] = {}
    if "marks" in wanted:
        places = rng.permutation(height * width)[: int(rng.integers(1, 7))]
        spots = [(int(k % width), int(k // width)) for k in places]
        for x, y in spots:
            kind[y, x] = 0
        bodies = tuple(sorted(spots[2:], key=lambda c: (c[1], c[0])))
        marks = {"start": spots[0], "goal": spots[1] if len(spots) > 1 else None, "obstacle_cells": bodies}
    # Metres a cell and origins that are written and read as fractions: to the last bit all the same.
    east, north, yaw = (float(v) for v in rng.normal(0, 30, 3))
    frame = (float(rng.uniform(0.001, 10)), (east, north, yaw))
    resolution, origin = frame if "frame" in wanted else (1.0, (0.0, 0.0, 0.0))
    levels = [0, *(_EXACT if shared else range(1, 253))]
    terrain = rng.choice(levels, (height, width)) if "terrain" in wanted else None
    grid = Grid(kind > 0, unknown=kind == 2, terrain=terrain, resolution=resolution, origin=origin)
    return MapDocument(grid, **marks)


def facts(found: MapDocument) -> dict[str, Any]:
    """A map as plain values."""
    grid = found.grid
    unknown = None if grid.unknown is None or not grid.unknown.any() else grid.unknown.tolist()
    return {
        "blocked": grid.blocked.tolist(),
        "unknown": unknown,
        "marks": (found.start, found.goal, found.obstacle_cells),
        "frame": (grid.resolution, grid.origin),
        "terrain": None if grid.terrain is None else grid.terrain.tolist(),
    }
