"""From one map format to another, and what is lost on the way.

What a format cannot hold is not looked up in a table: the new file is read again and compared. So the answer
is right for every pair of formats, and nothing is said to be kept that was not.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lampyris._core import defaults
from lampyris._core.limits import MAX_CELLS
from lampyris.errors import InternalFault, UsageError, plural
from lampyris.io.maps.formats.costmap import FROM_OCCUPANCY, TO_OCCUPANCY
from lampyris.io.maps.formats.document import MapDocument, MapQuery, look_up
from lampyris.io.maps.formats.movingai import SWAMP, TREES, WATER, read_scen, write_scen
from lampyris.io.maps.formats.ros_write import save_ros
from lampyris.io.maps.load import load_map
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.save import holds_terrain, save_map, values_for
from lampyris.model.grid import Grid

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
    notes : sentences about how the old file was read.
    """

    document: MapDocument
    files: tuple[Path, ...]
    lost: tuple[str, ...]
    hash: str
    notes: tuple[str, ...] = ()


def files_of(target: str | os.PathLike[str], *, scen: bool = False) -> tuple[Path, ...]:
    """The files that writing a map to ``target`` writes: a ROS map is a YAML file and its picture, and with
    ``scen`` a MovingAI map has its queries in ``target.scen``.

    Raises
    ------
    UsageError : ``scen`` for another format.
    """
    path = Path(target)
    ending = path.suffix.lower()
    if scen and ending != ".map":
        raise UsageError("OPTIONS", f"queries next to a {ending or 'file'}", where=str(path), allowed=".map")
    if scen:
        return (path, path.with_name(f"{path.name}.scen"))
    return (path, path.with_suffix(".pgm")) if ending in ROS_ENDINGS else (path,)


def convert(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    resolution: float | None = None,
    values: str = defaults.VALUES,
    to_values: str | None = None,
    colour: str = defaults.COLOUR,
    max_cells: int = MAX_CELLS,
    allow_outside: bool = False,
    strict: bool = False,
    scen: bool = False,
) -> Conversion:
    """Write the map of a file, or a bundled map, in the format that the ending of ``target`` names.

    Parameters
    ----------
    source : a file or a bundled name.
    target : is overwritten.
    resolution, colour, max_cells, allow_outside, strict : how to read the source, as
        :func:`lampyris.io.maps.load.load_map`.
    values : what the source's numbers are, ``occupancy`` or ``costmap``.
    to_values : what the target's numbers shall be, as :func:`lampyris.io.maps.save.save_map`. The two are apart:
        ``values`` without ``to_values`` turns a costmap into a plain map, and says what terrain is lost.
    scen : write the stored queries of the source beside a ``.map``, as ``target.scen``.

    Raises
    ------
    FileError, LimitError : the source cannot be read, or the target not written.
    SettingError : costmap values of a source without numbers.
    UsageError : an ending no format has, costmap values or queries for a target that cannot have them.
    """
    files_of(target, scen=scen)
    before = load_map(
        source,
        resolution=resolution,
        values=values,
        colour=colour,
        max_cells=max_cells,
        allow_outside=allow_outside,
        strict=strict,
    )
    return write_and_compare(before, target, values=to_values, scen=scen)


def write_and_compare(
    before: MapDocument, target: str | os.PathLike[str], *, values: str | None = None, scen: bool = False
) -> Conversion:
    """Write a map, read it again, and say what the file does not hold.

    Parameters
    ----------
    before : the map.
    target : is overwritten.
    values : what the target's numbers shall be, as :func:`lampyris.io.maps.save.save_map`.
    scen : write the stored queries beside a ``.map``.

    Raises
    ------
    UsageError, FileError : as :func:`lampyris.io.maps.save.save_map`.
    InternalFault : the file says something else of a cell; a fault of lampyris.
    """
    path = Path(target)
    files = files_of(path, scen=scen)
    values = values_for(before, path, values)
    save_map(before, path, values=values)
    after = load_map(path, values=values)
    if not np.array_equal(before.grid.blocked, after.grid.blocked):
        raise InternalFault("MAP_CHANGED", "other cells are blocked than in the original", where=str(path))
    expected = np.zeros_like(_terrain(before.grid)) if values == "occupancy" else _terrain(before.grid)
    if path.suffix.lower() in ROS_ENDINGS:
        expected = look_up(FROM_OCCUPANCY, look_up(TO_OCCUPANCY.view(np.uint8), expected))
    if not np.array_equal(expected, _terrain(after.grid)):
        raise InternalFault("MAP_CHANGED", "the terrain is not what was written", where=str(path))
    if scen:
        after = replace(after, queries=_with_queries(before, files[-1]))
    lost = losses(before, after)
    if before.grid.terrain is not None and values == "occupancy" and holds_terrain(path):
        lost = (*lost, "costmap values would hold the terrain (--to-values costmap)")
    return Conversion(after, files, lost, map_hash(after.grid), before.notes)


def write_with_yaml(before: MapDocument, picture: str | os.PathLike[str]) -> Conversion:
    """Write a ROS map by the name of its picture: the picture, and beside it the YAML file; read it again.

    Parameters
    ----------
    before : the map.
    picture : ends in .png or .pgm; is overwritten, as is the .yaml beside it.

    Raises
    ------
    UsageError, FileError : as :func:`lampyris.io.maps.formats.ros_write.save_ros`.
    InternalFault : the file says something else of a cell; a fault of lampyris.
    """
    path = Path(picture)
    yaml = path.with_suffix(".yaml")
    save_ros(before, yaml, image_format=path.suffix[1:])
    after = load_map(yaml)
    if not np.array_equal(before.grid.blocked, after.grid.blocked):
        raise InternalFault("MAP_CHANGED", "other cells are blocked than in the original", where=str(yaml))
    return Conversion(after, (path, yaml), losses(before, after), map_hash(after.grid), before.notes)


def _with_queries(before: MapDocument, path: Path) -> tuple[MapQuery, ...]:
    """Write the queries whose shortest path is known, and read them again."""
    known = [q for q in before.queries if q.octile is not None]
    write_scen(path, known, map_name=path.name.removesuffix(".scen"), grid=before.grid)
    read = read_scen(path)
    if [(q.start, q.goal) for q in read] != [(q.start, q.goal) for q in known]:
        raise InternalFault("MAP_CHANGED", "the queries are not what was written", where=str(path))
    return tuple(known)


def _terrain(grid: Grid) -> np.ndarray:
    return np.zeros_like(grid.blocked, dtype=np.uint8) if grid.terrain is None else grid.terrain


def losses(before: MapDocument, after: MapDocument) -> tuple[str, ...]:
    """A sentence for each thing that one document holds and the other, of the same cells, does not."""
    was, now = before.grid, after.grid
    lost = []
    unknown = np.zeros_like(was.blocked) if was.unknown is None else was.unknown
    kept = np.zeros_like(unknown) if now.unknown is None else now.unknown
    if n := int(np.count_nonzero(unknown & ~kept)):
        lost.append(f"{plural(n, 'unknown cell')} became blocked")
    lost += _ground_lost(before, after)
    for what, cell, other in (("start", before.start, after.start), ("goal", before.goal, after.goal)):
        if cell != other:
            lost.append(f"the {what} ({cell[0]}, {cell[1]}) was left out" if cell else f"a {what} was added")
    if before.obstacle_cells != after.obstacle_cells:
        lost.append(f"{plural(len(before.obstacle_cells), 'moving obstacle')} left out")
    if n := len(before.queries) - len(after.queries):
        lost.append(f"{f'{n} stored queries' if n > 1 else '1 stored query'} left out")
    if was.resolution != now.resolution:
        lost.append(f"the resolution, {was.resolution:g} m a cell, was left out")
    if was.origin != now.origin:
        x, y, yaw = was.origin
        lost.append(f"the origin ({x:g}, {y:g}, {yaw:g}) was left out")
    if before.occupancy is not None:
        between = was.blocked & (before.occupancy > 0) & (before.occupancy < 100)
        same = after.occupancy is not None and np.array_equal(before.occupancy, after.occupancy)
        if between.any() and not same:
            lost.append(
                f"{plural(int(np.count_nonzero(between)), 'cell')} of an occupancy of 1 to 99 became blocked"
            )
    return tuple(lost)


def _ground_lost(before: MapDocument, after: MapDocument) -> list[str]:
    """What became of terrain, and of what a MovingAI map says that cells are made of."""
    lost = []
    was, now = _terrain(before.grid).astype(np.int16), _terrain(after.grid).astype(np.int16)
    if not now.any() and was.any():
        low, high = int(was[was > 0].min()), int(was.max())
        n = plural(int(np.count_nonzero(was)), "cell")
        lost.append(f"the terrain of {n} ({f'{low} to {high}' if low < high else f'all {low}'}) was left out")
    elif n_changed := int(np.count_nonzero(was != now)):
        most = int(np.abs(was - now).max())
        lost.append(f"the terrain of {plural(n_changed, 'cell')} was rounded, by {most} of 252 at most")
    if before.surface is not None:
        kept = np.zeros_like(before.surface) if after.surface is None else after.surface
        for kind, what, other in (
            (SWAMP, "swamp", "ground"),
            (WATER, "water", "walls"),
            (TREES, "trees", "walls"),
        ):
            if n_lost := int(np.count_nonzero((before.surface == kind) & (kept != kind))):
                lost.append(f"{plural(n_lost, 'cell')} of {what} became plain {other}")
    return lost
