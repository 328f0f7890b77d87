"""What a parser's result must be like, whatever the file was: fields in their ranges, words printable."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lampyris import movingai
from lampyris._core.limits import MAX_CELLS
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.paths import PathPoints
from lampyris.io.scenario.scenario import Scenario
from lampyris.io.text import strict_json, strict_yaml
from lampyris.model.grid import Grid
from lampyris.model.lattice.motion_primitives import MAX_HEADINGS, MotionPrimitives
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.photos.segmented_photo import SegmentedPhoto
from lampyris.model.robot import DRIVES, Robot
from lampyris.typing import Cell
from lampyris_selfcheck.reference.files.map_sizes import Uneven, size

PLAIN = Grid(np.zeros((6, 7), dtype=bool))
"""A map for files that are read beside one."""
SMALL = Grid(np.zeros((2, 3), dtype=bool))
MAX_WORDS = 1500
"""Characters of one message or note."""


class NotValid(AssertionError):
    """A result that is not what its parser promises."""


def must(holds: object, what: str) -> None:
    """Raise :class:`NotValid` unless it holds."""
    if not holds:
        raise NotValid(what)


def words(text: str) -> None:
    """A sentence for a terminal: one line, nothing that a terminal obeys, no book."""
    must(text.isprintable(), f"not printable: {text!r:.300}")
    must(len(text) < MAX_WORDS, f"{len(text):,} characters of words: {text[:200]!r}")


def grid(found: Grid) -> None:
    """A grid."""
    must(found.blocked.dtype == np.bool_ and found.blocked.ndim == 2, "blocked is no table of yes and no")
    must(0 < found.blocked.size <= MAX_CELLS, f"{found.blocked.size} cells")
    must(not found.blocked.flags.writeable, "blocked may be written")
    if found.unknown is not None:
        must((found.blocked | ~found.unknown).all(), "an unknown cell is not blocked")
    if found.terrain is not None:
        must(found.terrain.max() <= 252, "terrain beyond 252")
        must(not found.terrain[found.blocked].any(), "terrain where it is blocked")
    must(1e-6 <= found.resolution <= 1000, f"resolution {found.resolution}")
    must(all(map(math.isfinite, found.origin)), f"origin {found.origin}")


def document(found: MapDocument) -> None:
    """A map as it was loaded."""
    grid(found.grid)
    blocked = found.grid.blocked
    if found.occupancy is not None:
        must(-1 <= found.occupancy.min() <= found.occupancy.max() <= 100, "occupancy out of range")
        must(not blocked[found.occupancy == 0].any(), "occupancy 0 is blocked")
        must(
            found.grid.terrain is not None or blocked[found.occupancy != 0].all(),
            "occupied or unknown is free",
        )
    for cell in (found.start, found.goal, *found.obstacle_cells):
        if cell is not None:
            must(
                found.grid.contains(cell) and not blocked[cell[1], cell[0]], f"{cell} is outside or in a wall"
            )
    for note in found.notes:
        words(note)


def as_the_file_says(found: MapDocument, data: bytes) -> None:
    """A map is as large as its file says, and the file has all of it: read anew by another reader."""
    try:
        width, height = size(data, found.format)
    except Uneven as problem:
        raise NotValid(f"taken all the same: {problem}") from None
    taken = found.grid
    said = f"{width} x {height} in the file, {taken.width} x {taken.height} read"
    must((taken.width, taken.height) == (width, height), said)


def benchmark(found: movingai.Benchmark) -> None:
    """A ``.scen`` with its map."""
    document(found.document)
    must(found.queries, "no query")
    for one in found.queries:
        inside = found.document.grid.contains
        must(inside(one.start) and inside(one.goal), f"an end outside: {one}")
        must(0 <= one.length < 1e115 and one.bucket >= 0, f"length or bucket: {one}")


def data(found: strict_yaml.YamlDocument | strict_json.JsonDocument) -> None:
    """Plain data, finite where it is JSON, and every value's place can be told."""
    left: list[tuple[tuple[str | int, ...], Any]] = [((), found.data)]
    count = 0
    while left:
        way, value = left.pop()
        count += 1
        if count < 100:
            words(found.at(*way))
        if isinstance(value, dict):
            must(all(isinstance(key, str) for key in value), "a key that is no text")
            left += [((*way, key), inner) for key, inner in value.items()]
        elif isinstance(value, list):
            left += [((*way, k), inner) for k, inner in enumerate(value)]
        else:
            must(value is None or type(value) in (bool, int, float, str), f"a {type(value).__name__}")
            if isinstance(value, float) and isinstance(found, strict_json.JsonDocument):
                must(math.isfinite(value), "not finite")
    must(count <= max(strict_yaml.MAX_VALUES, strict_json.MAX_VALUES), f"{count:,} values")


def track(found: tuple[Cell, ...]) -> None:
    """A recorded track."""
    must(found and all(type(x) is int and type(y) is int for x, y in found), f"{found!r:.100}")


def way(found: PathPoints) -> None:
    """A way from a file."""
    must(found.points.ndim == 2 and found.points.shape[0] >= 1, f"shape {found.points.shape}")
    must(np.isfinite(found.points).all() and np.abs(found.points).max() <= 1e9, "a point out of range")
    must(found.frame in ("metres", "cells"), found.frame)
    for note in found.notes:
        words(note)
    if found.map is None:
        must(np.isfinite(found.on(PLAIN)).all(), "not finite on a map")


def movers(found: ObstacleStates) -> None:
    """Moving bodies from a file."""
    must(np.isfinite(found.xy).all(), "a place that is not finite")
    for sizes in (found.radius, found.top_speed):
        must((np.isfinite(sizes) & (sizes >= 0)).all(), "a radius or speed below 0, or none")
    must(found.velocity is None or np.isfinite(found.velocity).all(), "a velocity that is not finite")


def zones(found: tuple[Any, tuple[str, ...]]) -> None:
    """Speed limits by cell."""
    limits, notes = found
    must(
        limits.shape == SMALL.blocked.shape and (limits > 0).all(), "limits of another shape, or not above 0"
    )
    for note in notes:
        words(note)


def obstacles(found: list[Any]) -> None:
    """Recorded obstacles."""
    must(all(body.track and 0 <= body.radius <= 1e6 for body in found), f"{found!r:.100}")


def scenario(found: Scenario) -> None:
    """A scenario."""
    scene = found.scene
    grid(scene.grid)
    must(scene.grid.contains(scene.start) and scene.grid.contains(scene.goal), "an end outside the map")
    must(0 <= found.seed < 2**63, f"seed {found.seed}")
    for note in found.notes:
        words(note)


def primitives(found: MotionPrimitives) -> None:
    """Motion primitives: from a lattice state to another, without jumps."""
    must(1e-6 <= found.resolution <= 1000, f"resolution {found.resolution}")
    must(1 <= len(found.headings) <= MAX_HEADINGS, f"{len(found.headings)} headings")
    must(found.motions, "no motion")
    for one in found.motions:
        must(np.isfinite(one.poses).all() and len(one.poses) >= 2, f"poses of {one.number}")
        must(1e-3 <= one.price <= 1e6, f"price {one.price}")
        ends = [(0.0, 0.0), (one.cell[0] * found.resolution, one.cell[1] * found.resolution)]
        for pose, end, heading in zip(one.poses[[0, -1]], ends, (one.start, one.end), strict=True):
            must(np.abs(pose[:2] - end).max() <= 1e-9 * found.resolution + 1e-12, f"ends of {one.number}")
            off = math.remainder(float(pose[2]) - found.headings[heading], 2 * math.pi)
            must(abs(off) < 1e-9, f"heading of {one.number}")
        must(
            np.abs(np.diff(one.poses[:, :2], axis=0)).max() <= 6 * found.resolution, f"a jump in {one.number}"
        )


def robot(found: Robot) -> None:
    """A robot."""
    must(found.drive in DRIVES, f"drive {found.drive}")
    for value in (found.radius, found.v_max, found.a_max, found.d_max, found.a_lat_max, found.turn_radius):
        must(0 <= value <= 1e9, f"a limit of {value}")
    must(found.inscribed_radius <= found.radius, "the inscribed radius is above the circumscribed")


def photo(found: SegmentedPhoto) -> None:
    """A map made of a photograph."""
    grid(found.grid)
    side = found.settings.cell
    rows, columns = -(-found.height // side), -(-found.width // side)
    must(found.grid.blocked.shape == (rows, columns), "another number of cells than of squares of pixels")
    must(list(found.thresholds) == sorted(set(found.thresholds)), "thresholds are not in ascending order")
    must(all(found.counts), "a class without pixels")
    must(found.gap == 0.0, "the exact thresholds are not the best")
    must(int(found.histogram.sum()) <= found.width * found.height, "more pixels than the photograph has")
    for note in found.notes:
        words(note)
