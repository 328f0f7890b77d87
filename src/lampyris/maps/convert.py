"""From one map format to another, and what is lost on the way.

What a format cannot hold is not looked up in a table: the new file is read again and compared. So the answer
is right for every pair of formats, and nothing is said to be kept that was not.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lampyris.errors import InternalFault
from lampyris.maps.document import MapDocument, plural
from lampyris.maps.load import load_map
from lampyris.maps.map_hash import map_hash
from lampyris.maps.save import save_map

ROS_ENDINGS = (".yaml", ".yml")


@dataclass(frozen=True, slots=True, eq=False)
class Conversion:
    """What became of a map.

    Parameters
    ----------
    document : the map as the new file has it.
    files : what was written.
    lost : a sentence for each thing that the new file does not hold.
    hash : of the new file's cells.
    """

    document: MapDocument
    files: tuple[Path, ...]
    lost: tuple[str, ...]
    hash: str


def files_of(target: str | os.PathLike[str]) -> tuple[Path, ...]:
    """The files that writing a map to ``target`` writes: a ROS map is a YAML file and its picture."""
    path = Path(target)
    return (path, path.with_suffix(".pgm")) if path.suffix.lower() in ROS_ENDINGS else (path,)


def convert(
    source: str | os.PathLike[str], target: str | os.PathLike[str], *, resolution: float | None = None
) -> Conversion:
    """Write the map of a file, or a bundled map, in the format that the ending of ``target`` names.

    Parameters
    ----------
    source : a file or a bundled name.
    target : is overwritten.
    resolution : metres a cell, for a source that does not say.

    Raises
    ------
    FileError, LimitError : the source cannot be read, or the target not written.
    UsageError : an ending no format has.
    """
    return write_and_compare(load_map(source, resolution=resolution), target)


def write_and_compare(before: MapDocument, target: str | os.PathLike[str]) -> Conversion:
    """Write a map, read it again, and say what the file does not hold.

    Raises
    ------
    UsageError, FileError : as :func:`lampyris.maps.save.save_map`.
    InternalFault : the file says something else of a cell; a bug of ours.
    """
    save_map(before, target)
    after = load_map(Path(target))
    if not np.array_equal(before.grid.blocked, after.grid.blocked):
        raise InternalFault("MAP_CHANGED", "other cells are blocked than in the original", where=str(target))
    return Conversion(after, files_of(target), losses(before, after), map_hash(after.grid))


def losses(before: MapDocument, after: MapDocument) -> tuple[str, ...]:
    """A sentence for each thing that one document holds and the other, of the same cells, does not."""
    was, now = before.grid, after.grid
    lost = []
    unknown = np.zeros_like(was.blocked) if was.unknown is None else was.unknown
    kept = np.zeros_like(unknown) if now.unknown is None else now.unknown
    if n := int(np.count_nonzero(unknown & ~kept)):
        lost.append(f"{plural(n, 'unknown cell')} became blocked")
    for what, cell, other in (("start", before.start, after.start), ("goal", before.goal, after.goal)):
        if cell != other:
            lost.append(f"the {what} ({cell[0]}, {cell[1]}) was left out" if cell else f"a {what} was added")
    if before.bodies != after.bodies:
        lost.append(f"{plural(len(before.bodies), 'moving obstacle')} left out")
    if before.queries and not after.queries:
        stored = f"{len(before.queries)} stored queries" if len(before.queries) > 1 else "1 stored query"
        lost.append(f"{stored} left out")
    if was.resolution != now.resolution:
        lost.append(f"the resolution, {was.resolution:g} m a cell, was left out")
    if was.origin != now.origin:
        x, y, yaw = was.origin
        lost.append(f"the origin ({x:g}, {y:g}, {yaw:g}) was left out")
    if before.occupancy is not None:
        between = (before.occupancy > 0) & (before.occupancy < 100)
        same = after.occupancy is not None and np.array_equal(before.occupancy, after.occupancy)
        if between.any() and not same:
            lost.append(
                f"{plural(int(np.count_nonzero(between)), 'cell')} of an occupancy of 1 to 99 became blocked"
            )
    return tuple(lost)
