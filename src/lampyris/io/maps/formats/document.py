"""MapDocument: a map as its file has it, marks and warnings included; and the codes all readers share."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core import defaults
from lampyris._core.limits import MAX_CELLS
from lampyris.errors import FileError, LimitError, SettingError, shown
from lampyris.model.grid import TERRAIN_UNIT, Grid
from lampyris.model.traffic import MAX_OBSTACLES, ObstacleSpec, RandomWalk
from lampyris.typing import ByteGrid, Cell

CodeGrid: TypeAlias = NDArray[np.uint8]
"""uint8, (height, width): one of the codes below."""
Occupancy: TypeAlias = NDArray[np.int8]
"""int8, (height, width), row 0 on top: 0 free to 100 occupied, -1 unknown, as in nav_msgs/OccupancyGrid."""

BYTES_PER_CELL = 8
"""A file may have so many bytes for each cell allowed (16-bit colour with alpha), and a megabyte besides."""

FREE, BLOCKED, UNKNOWN, START, GOAL, OBSTACLE = range(6)
BAD = 255
"""What a reader's table gives for a value it does not know; never leaves the reader."""


@dataclass(frozen=True, slots=True)
class MapQuery:
    """A start and a goal worth asking about.

    Parameters
    ----------
    start, goal : cells (x, y).
    gates : how many gate cells every optimal path passes, where that is known.
    label : where it comes from.
    octile : straight and diagonal steps of the shortest path by octile moves, where that is known.
    weighed : the same on a map with terrain, in 63rds, each step weighed by the cell it enters: the cheapest
        path costs ``(n + m sqrt 2) / 63``. Such a query has no ``octile``.
    """

    start: Cell
    goal: Cell
    gates: int | None = None
    label: str = ""
    octile: tuple[int, int] | None = None
    weighed: tuple[int, int] | None = None

    @property
    def cost(self) -> float | None:
        """Cost of the best path by octile moves, in cells of plain ground; None where that is not known."""
        if self.weighed is not None:
            return (self.weighed[0] + self.weighed[1] * math.sqrt(2.0)) / TERRAIN_UNIT
        return None if self.octile is None else self.octile[0] + self.octile[1] * math.sqrt(2.0)


@dataclass(frozen=True, slots=True, eq=False)
class MapDocument:
    """What a map file says.

    Parameters
    ----------
    grid : the occupancy grid; marks (start, goal, moving obstacles) are free cells in it.
    start, goal : the cells marked so, or None.
    obstacle_cells : the cells where moving obstacles are drawn, by rows.
    queries : stored start and goal pairs.
    format : ``png``, ``bmp``, ``pgm``, ``movingai``, ``text``, ``numpy``, ``csv``, ``ros`` or ``bundled``.
    notes : notes for the user (what was read as unknown, what was left out).
    occupancy : what a ROS map says of each cell, 0 to 100 and -1, or None. In the grid, 0 is free and all
        else is blocked.
    surface : what a MovingAI map says a cell is made of (codes in :mod:`lampyris.io.maps.formats.movingai`), or None
        where there is nothing to say besides free and blocked.
    """

    grid: Grid
    start: Cell | None = None
    goal: Cell | None = None
    obstacle_cells: tuple[Cell, ...] = ()
    queries: tuple[MapQuery, ...] = ()
    format: str = ""
    notes: tuple[str, ...] = ()
    occupancy: Occupancy | None = None
    surface: CodeGrid | None = None

    def traffic(self, radius: float = 0.0) -> tuple[ObstacleSpec, ...]:
        """The moving obstacles drawn in the map: random walkers that begin on their cells.

        Parameters
        ----------
        radius : metres, of each.
        """
        if not self.obstacle_cells:
            return ()
        return (RandomWalk(len(self.obstacle_cells), None, radius, self.obstacle_cells),)


@dataclass(frozen=True, slots=True)
class FileSource:
    """A file's bytes on the way into a reader.

    Parameters
    ----------
    data : all of the file.
    name : the file as the caller named it, for messages.
    max_cells : more cells than this are refused from the header.
    allow_outside : whether a file may name another one that is not below its own folder.
    strict : whether what is only doubtful is refused too, and not just noted.
    values : ``occupancy``, or ``costmap``: grey samples and numbers are costmap values of ROS 2 (0 free, 1 to
        252 terrain, 253 and 254 blocked, 255 unknown).
    colour : ``legend``, or ``luminance``: colours that are not of the legend are read as grey.
    confined : whether absolute paths, and links that lead out of the file's folder, are refused as well.
    quotes : whether messages may quote the file's content: not if another file named it, which may name any
        file that the user can read.
    """

    data: bytes
    name: str
    max_cells: int = MAX_CELLS
    allow_outside: bool = False
    strict: bool = False
    values: str = defaults.VALUES
    colour: str = defaults.COLOUR
    confined: bool = False
    quotes: bool = True

    def quoted(self, token: str) -> str:
        """A token of the file for a message, or a word that stands for it."""
        return repr(token) if self.quotes else "what stands there"

    def error(self, code: str, what: str, at: str = "", allowed: str = "", todo: str = "") -> FileError:
        """A FileError about this file, to be raised; ``at`` is a line, column or pixel."""
        where = f"{self.name}: {at}" if at else self.name
        return FileError(code, what, where=where, allowed=allowed, todo=todo)

    def check_size(self, width: int, height: int, code: str = "MAP_TOO_LARGE") -> None:
        """Refuse a map of more cells than allowed, before anything is made for it.

        Raises
        ------
        LimitError : too many cells.
        """
        if width * height > self.max_cells:
            raise LimitError(
                code,
                f"{width} x {height} is {width * height:,} cells",
                where=self.name,
                allowed=f"at most {self.max_cells:,} cells",
                todo="crop it or make it coarser",
            )


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """What a reader hands back: codes (height, width), notes, and for formats that say so the metres a cell,
    the origin (x, y, yaw), the occupancy, the terrain (see :class:`lampyris.model.grid.Grid`) and the surface
    (see :class:`MapDocument`).
    """

    codes: CodeGrid
    notes: tuple[str, ...] = ()
    resolution: float | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    occupancy: Occupancy | None = None
    terrain: ByteGrid | None = None
    surface: CodeGrid | None = None


@dataclass(frozen=True, slots=True)
class Format:
    """One row of the table of formats; adding a format is one reader and one row.

    Parameters
    ----------
    name : what ``MapDocument.format`` says.
    suffixes : the usual endings of such files, for warnings.
    begins : whether the first bytes of a file are of this format, rightly or wrongly written.
    read : the reader.
    """

    name: str
    suffixes: tuple[str, ...]
    begins: Callable[[bytes], bool]
    read: Callable[[FileSource], Reading]


def check_limit(max_cells: int) -> int:
    """The limit itself, checked.

    Raises
    ------
    SettingError : not 1 to 2^24.
    """
    if not isinstance(max_cells, int) or isinstance(max_cells, bool) or not 1 <= max_cells <= MAX_CELLS:
        raise SettingError.of("MAX_CELLS", "max_cells", shown(max_cells), allowed=f"1 to {MAX_CELLS:,}")
    return max_cells


def byte_limit(max_cells: int) -> int:
    """The most bytes a file of so many cells may have."""
    return max_cells * BYTES_PER_CELL + 2**20


def document(
    reading: Reading,
    source: FileSource,
    *,
    name: str,
    format: str,
    resolution: float | None = None,
    queries: tuple[MapQuery, ...] = (),
) -> MapDocument:
    """Turn codes into a document: marks become cells, unknown becomes blocked.

    Raises
    ------
    FileError : two starts or two goals.
    LimitError : more moving obstacles than a scene can hold.
    SettingError : a resolution out of range, or another one than the file's own.
    """
    if reading.resolution is not None:
        if resolution is not None and resolution != reading.resolution:
            raise SettingError.of(
                "MAP_RESOLUTION",
                "resolution",
                f"{resolution!r} given, the file says {reading.resolution!r}",
                where=source.name,
                todo="leave the resolution out",
            )
        resolution = reading.resolution
    codes = reading.codes
    unknown = codes == UNKNOWN
    blocked = (codes == BLOCKED) | unknown
    start = _only(codes, START, "start", source)
    goal = _only(codes, GOAL, "goal", source)
    drawn = places_of(codes, OBSTACLE)
    if drawn.size > MAX_OBSTACLES:
        raise LimitError(
            "LIMIT",
            "too many moving obstacles drawn",
            where=source.name,
            allowed=f"at most {MAX_OBSTACLES:,}",
        )
    obstacles = tuple((int(k % codes.shape[1]), int(k // codes.shape[1])) for k in drawn)
    grid = Grid(
        blocked,
        unknown=unknown if unknown.any() else None,
        resolution=1.0 if resolution is None else resolution,
        origin=reading.origin,
        name=name,
        terrain=reading.terrain,
    )
    for layer in (reading.occupancy, reading.surface):
        if layer is not None:
            layer.setflags(write=False)
    return MapDocument(
        grid, start, goal, obstacles, queries, format, reading.notes, reading.occupancy, reading.surface
    )


def places_of(codes: CodeGrid, code: int) -> NDArray[np.intp]:
    """Numbers of the cells with a code, y * width + x, rising: of most maps none, which is seen sooner than searched."""
    there = codes == code
    return np.flatnonzero(there) if there.any() else np.zeros(0, dtype=np.intp)


def _only(codes: CodeGrid, code: int, what: str, source: FileSource) -> Cell | None:
    found = places_of(codes, code)
    if found.size == 0:
        return None
    cells = [(int(k % codes.shape[1]), int(k // codes.shape[1])) for k in found[:2]]
    if found.size > 1:
        more = "" if found.size == 2 else f" (and {found.size - 2} more)"
        raise source.error(
            f"{what.upper()}_TWICE",
            f"{cells[0]} and {cells[1]}{more} are both marked as {what}",
            allowed=f"one {what}",
            todo=f"mark one cell, or none and say which is the {what}",
        )
    return cells[0]


def grid_codes(grid: Grid) -> CodeGrid:
    """The codes of a grid: free, blocked or unknown. An unknown cell that is not blocked is free."""
    codes = np.where(grid.blocked, np.uint8(BLOCKED), np.uint8(FREE))
    if grid.unknown is not None:
        codes[grid.unknown & grid.blocked] = UNKNOWN
    return codes


def look_up(table: CodeGrid, samples: NDArray[np.uint8]) -> CodeGrid:
    """``table[samples]`` for a table of 256 codes: a new array, three times quicker than NumPy's indexing."""
    codes = bytearray(samples.tobytes().translate(table.tobytes()))
    return np.frombuffer(codes, dtype=np.uint8).reshape(samples.shape)


def first_bad(mask: NDArray[np.bool_]) -> Cell:
    """The first true cell (x, y), by rows."""
    k = int(np.argmax(mask))
    return k % mask.shape[1], k // mask.shape[1]
