"""Grid: what a map says of each cell, and the only place where cells and metres meet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core import elementary, presentation
from lampyris._core.limits import MAX_CELLS
from lampyris._core.noun import Noun
from lampyris._core.polygon_cells import polygon_cells
from lampyris._core.predicates import array_of, numbers
from lampyris._core.scalars import in_range
from lampyris._core.values import Value
from lampyris.errors import LimitError, SettingError, shown
from lampyris.model.robot import outline_of
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells, Floats

if TYPE_CHECKING:
    import xarray

TERRAIN_UNIT = 63
"""A cell of terrain value c costs ``(63 + c) / 63`` times what plain ground costs to enter."""
MAX_TERRAIN = 252
"""The highest terrain value: five times plain ground."""


def frozen(array: np.ndarray) -> np.ndarray:
    """The same array, made read-only."""
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True, repr=False)
class MapFrame(Noun):
    """Where the cells of a grid lie in metres: x to the right, y up, as ROS has it.

    Parameters
    ----------
    resolution : metres a cell.
    origin : x, y (metres) and yaw (radians) of the lower-left corner of the lower-left cell.
    height : rows of the grid; cells count y down from the top.
    """

    resolution: float
    origin: tuple[float, float, float]
    height: int

    def to_metres(self, cells: ArrayLike) -> Floats:
        """Centres of cells, shape (n, 2) or (2,), in metres of the map frame; same shape."""
        c = np.asarray(cells, dtype=np.float64)
        x0, y0, yaw = self.origin
        local_x = (c[..., 0] + 0.5) * self.resolution
        local_y = (self.height - c[..., 1] - 0.5) * self.resolution
        cos, sin = elementary.direction(yaw)
        return np.stack((x0 + cos * local_x - sin * local_y, y0 + sin * local_x + cos * local_y), axis=-1)

    def to_points(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Points of the map frame, metres, as points of the grid, cells; (n, 2), or (2,) of two numbers.

        The inverse of :meth:`to_metres`, to the last digits: the centre of cell (x, y) is at (x, y).
        """
        x0, y0, yaw = self.origin
        dx, dy = np.asarray(x_m, dtype=np.float64) - x0, np.asarray(y_m, dtype=np.float64) - y0
        cos, sin = elementary.direction(yaw)
        right, up = (cos * dx + sin * dy) / self.resolution, (cos * dy - sin * dx) / self.resolution
        return np.stack((right - 0.5, self.height - up - 0.5), axis=-1)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Grid(Value):
    """An occupancy grid.

    Parameters
    ----------
    blocked : bool, shape (height, width), row 0 on top. True where the robot's centre may not be: walls
        and, unless specified otherwise, unknown cells.
    unknown : bool, same shape, or None. Cells the map knows nothing of; for pictures, not for planning.
        None if there are none.
    resolution : metres a cell.
    origin : x, y (metres) and yaw (radians) of the lower-left corner of the lower-left cell in the map frame.
    name : name of the map in tables and pictures.
    terrain : uint8, same shape, 0 to 252, or None: what a cell costs to enter besides its distance, as a
        costmap of ROS says it. Exactly ``(63 + c) / 63`` times plain ground: 63 is twice, 252 five times,
        as Nav2's NavFn planner weighs costs by default. 0 in blocked cells, whatever was given; None if it
        is 0 everywhere.

    Raises
    ------
    SettingError : not two-dimensional, empty, not boolean, or a resolution or origin that is not finite and
        sensible.

    Examples
    --------
    >>> import lampyris
    >>> import numpy as np
    >>> blocked = np.zeros((20, 30), dtype=bool)
    >>> blocked[5:15, 12] = True
    >>> lampyris.Grid(blocked, resolution=0.05, name="wall")
    <Grid wall: 30 x 20 cells of 0.05 m, 1.7% blocked>
    """

    blocked: BoolGrid
    unknown: BoolGrid | None = None
    resolution: float = 1.0
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    name: str = field(default="")
    terrain: ByteGrid | None = None

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            blocked: ArrayLike,
            unknown: ArrayLike | None = ...,
            resolution: float = ...,
            origin: Sequence[float] = ...,
            name: str = ...,
            terrain: ArrayLike | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "blocked", _bool_grid(self.blocked, "blocked"))
        if self.unknown is not None:
            unknown = _bool_grid(self.unknown, "unknown")
            if unknown.shape != self.blocked.shape:
                raise SettingError(
                    "GRID_SHAPE",
                    f"unknown has shape {unknown.shape}",
                    allowed=f"the shape of blocked, {self.blocked.shape}",
                )
            object.__setattr__(self, "unknown", unknown if unknown.any() else None)
        if self.terrain is not None:
            object.__setattr__(self, "terrain", _terrain(self.terrain, self.blocked))
        if not in_range(self.resolution, 1e-6, 1000):
            raise SettingError.of(
                "MAP_RESOLUTION", "resolution", shown(self.resolution), allowed="1e-6 to 1000 metres a cell"
            )
        object.__setattr__(self, "resolution", float(self.resolution))
        origin = numbers(self.origin, (3,))
        if origin is None or not np.isfinite(origin).all():
            raise SettingError.of(
                "MAP_ORIGIN", "origin", shown(self.origin), allowed="three finite numbers: x, y, yaw"
            )
        object.__setattr__(self, "origin", tuple(origin.tolist()))

    @classmethod
    def from_xy(
        cls,
        occupancy: ArrayLike,
        resolution: float = 1.0,
        origin: Sequence[float] = (0.0, 0.0),
        *,
        above: float = 0.0,
    ) -> Grid:
        """A grid from an array that is indexed ``[x, y]`` with y up, as python_motion_planning and IR-SIM hold maps.

        Parameters
        ----------
        occupancy : shape (width, height): bool, 0 and 1, or degrees of occupancy.
        resolution : metres a cell.
        origin : x, y of the corner of cell [0, 0], metres.
        above : a cell is blocked if its value is above this.

        Raises
        ------
        SettingError : not two axes, or not numbers; what the class itself refuses.

        Examples
        --------
        >>> Grid.from_xy([[0, 1], [0, 0], [0, 0]]).blocked.tolist()
        [[True, False, False], [False, False, False]]
        """
        array = array_of(occupancy)
        if array is None or array.ndim != 2 or array.size == 0 or array.dtype.kind not in "biuf":
            shape = shown(occupancy) if array is None else f"shape {array.shape}, element type {array.dtype}"
            raise SettingError(
                "GRID_SHAPE", f"occupancy has {shape}", allowed="numbers on two axes (width, height)"
            )
        if np.isnan(array).any():
            raise SettingError("GRID_SHAPE", "occupancy has NaN", allowed="numbers")
        x0, y0 = _corner(origin)
        return cls(array.T[::-1] > above, resolution=resolution, origin=(x0, y0, 0.0))

    @classmethod
    def from_points(cls, ox: ArrayLike, oy: ArrayLike, resolution: float = 1.0) -> Grid:
        """A grid from lists of obstacle points in metres, as PythonRobotics holds maps.

        Parameters
        ----------
        ox, oy : x and y of each point, metres. The map reaches from the least to the greatest; its first cell has its
            centre at the least x and y.
        resolution : metres a cell. A cell is blocked if a point is in it; the radius of the robot is the scene's.

        Raises
        ------
        SettingError : lists of unequal lengths, no point, or what is not finite; a resolution out of its range.

        Examples
        --------
        >>> Grid.from_points([0, 0, 2], [0, 1, 0]).blocked.tolist()
        [[True, False, False], [True, False, True]]
        """
        x, y = numbers(ox, (None,)), numbers(oy, (None,))
        if x is None or y is None or len(x) != len(y) or not len(x) or not np.isfinite((x, y)).all():
            raise SettingError(
                "POINT", "ox, oy", where="ox", allowed="two lists of as many finite numbers, one at least"
            )
        if not in_range(resolution, 1e-6, 1000):
            raise SettingError.of(
                "MAP_RESOLUTION", "resolution", shown(resolution), allowed="1e-6 to 1000 metres a cell"
            )
        sides = [(one - one.min()) / resolution for one in (x, y)]
        width, height = (int(np.floor(one.max() + 0.5)) + 1 for one in sides)
        if width * height > MAX_CELLS:
            raise LimitError("MAP_CELLS", f"{width:,} x {height:,} cells", allowed=f"{MAX_CELLS:,} cells")
        column, row = (np.floor(one + 0.5).astype(np.intp) for one in sides)
        blocked = np.zeros((height, width), dtype=np.bool_)
        blocked[height - 1 - row, column] = True
        corner = (float(x.min()) - 0.5 * resolution, float(y.min()) - 0.5 * resolution, 0.0)
        return cls(blocked, resolution=resolution, origin=corner)

    @classmethod
    def from_irsim(cls, env_map: Any, resolution: float | None = None) -> Grid:
        """A grid from an environment of IR-SIM, or from what its ``get_map()`` returns: its occupancy grid, and every cell
        that a static or moving obstacle touches now.

        Parameters
        ----------
        env_map : the map, or the environment.
        resolution : metres a cell, with an environment; None: 0.1.

        Raises
        ------
        SettingError : ``IRSIM``: something else.
        """
        made: Grid = presentation.irsim_grid(env_map, resolution)  # type: ignore[misc]
        return made

    def to_xarray(self) -> xarray.Dataset:
        """The map as an xarray Dataset: ``blocked``, and ``unknown`` and ``terrain`` where there are any, over ``y`` and
        ``x`` in metres of the map frame, y rising. It needs ``pip install 'lampyris[notebook]'``.

        Raises
        ------
        UsageError : ``XARRAY``: xarray is not installed; a map that is turned.
        """
        return presentation.array_of(self)  # type: ignore[misc]

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.blocked.shape[0])

    @property
    def width(self) -> int:
        """Columns."""
        return int(self.blocked.shape[1])

    def _brief(self) -> str:
        cells = f"{self.width} x {self.height} cells of {self.resolution:g} m"
        return f"<Grid {self.name[:40] or 'without a name'}: {cells}, {self.blocked.mean():.1%} blocked>"

    def contains(self, cell: Cell) -> bool:
        """Whether the cell (x, y) is on the map."""
        return 0 <= cell[0] < self.width and 0 <= cell[1] < self.height

    @property
    def frame(self) -> MapFrame:
        """Where the cells lie in the map frame."""
        return MapFrame(self.resolution, self.origin, self.height)

    def to_metres(self, cells: ArrayLike) -> Floats:
        """Centres of cells, shape (n, 2) or (2,), in metres of the map frame; same shape."""
        return self.frame.to_metres(cells)

    def to_points(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Points of the map frame, metres, as points of the grid, cells; see :meth:`MapFrame.to_points`."""
        return self.frame.to_points(x_m, y_m)

    def to_cell(self, x_m: float, y_m: float) -> Cell:
        """The cell that holds a point of the map frame; it may lie outside the map.

        Raises
        ------
        SettingError : a coordinate that is not finite, or too large to be counted in cells.
        """
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise SettingError("POINT", f"({x_m}, {y_m})", allowed="finite metres")
        x0, y0, yaw = self.origin
        dx, dy = x_m - x0, y_m - y0
        cos, sin = elementary.direction(yaw)
        right, up = (cos * dx + sin * dy) / self.resolution, (-sin * dx + cos * dy) / self.resolution
        if not (math.isfinite(right) and math.isfinite(up)):
            raise SettingError("POINT", f"({x_m}, {y_m})", allowed="metres near the map")
        return math.floor(right), self.height - 1 - math.floor(up)

    def polygon_cells(self, vertices: Sequence[Sequence[float]]) -> Cells:
        """Every cell that a polygon covers, however little of it, row by row; int32, (n, 2).

        ``Edit(0, blocked=grid.polygon_cells(vertices))`` puts a static obstacle onto the map of a scenario.

        Parameters
        ----------
        vertices : 3 to 64 points (x, y) in order, metres of the map frame. What lies outside the map is left out.

        Raises
        ------
        SettingError : ``POLYGON``: another number of vertices, two equal ones in a row, or edges that cross.

        Examples
        --------
        >>> grid = Grid(np.zeros((4, 6), dtype=bool), resolution=0.5)
        >>> grid.polygon_cells([(0.5, 0.5), (1.6, 0.5), (1.6, 1.0), (0.5, 1.0)]).tolist()
        [[1, 2], [2, 2], [3, 2]]
        """
        points = np.array(outline_of(vertices, "polygon", "POLYGON", reach=1e9))
        return polygon_cells(self.frame.to_points(*points.T), self.height, self.width)


def _corner(origin: Sequence[float]) -> tuple[float, float]:
    point = numbers(origin, (2,))
    if point is None or not np.isfinite(point).all():
        raise SettingError.of("MAP_ORIGIN", "origin", shown(origin), allowed="two finite numbers: x, y")
    return float(point[0]), float(point[1])


def _terrain(value: ArrayLike, blocked: BoolGrid) -> ByteGrid | None:
    array = array_of(value)
    if array is None or array.shape != blocked.shape:
        raise SettingError(
            "GRID_SHAPE",
            f"terrain has shape {array.shape if array is not None else shown(value)}",
            allowed=f"the shape of blocked, {blocked.shape}",
        )
    if array.dtype.kind not in "iu":
        raise SettingError(
            "GRID_TYPE",
            f"terrain has element type {array.dtype}",
            allowed=f"whole numbers 0 to {MAX_TERRAIN}",
        )
    array = np.where(blocked, 0, array)
    wrong = (array < 0) | (array > MAX_TERRAIN)
    if wrong.any():
        y, x = divmod(int(wrong.argmax()), wrong.shape[1])
        raise SettingError(
            "GRID_TERRAIN", f"{array[y, x]} at ({x}, {y})", where="terrain", allowed=f"0 to {MAX_TERRAIN}"
        )
    return frozen(array.astype(np.uint8)) if array.any() else None


def _bool_grid(value: ArrayLike, what: str) -> BoolGrid:
    array = array_of(value)
    if array is None or array.ndim != 2 or array.size == 0:
        shape = array.shape if array is not None else shown(value)
        raise SettingError(
            "GRID_SHAPE", f"{what} has shape {shape}", allowed="two axes (height, width), not empty"
        )
    if array.dtype != np.bool_:
        if array.dtype.kind not in "iu" or not np.isin(array, (0, 1)).all():
            raise SettingError(
                "GRID_TYPE", f"{what} has element type {array.dtype}", allowed="bool, or integers 0 and 1"
            )
        array = array.astype(np.bool_)
    cells = np.array(array, dtype=np.bool_, order="C", copy=True)
    # A stored bool may be any byte, and one that is not 0 is True; kernels and the referee read bytes, 0 or 1.
    np.not_equal(cells.view(np.uint8), 0, out=cells)
    return frozen(cells)


class GridKey:
    """A map as the key of a cache: equal only to a key of the same object."""

    __slots__ = ("grid",)

    def __init__(self, grid: Grid) -> None:
        self.grid = grid

    def __eq__(self, other: object) -> bool:
        return isinstance(other, GridKey) and other.grid is self.grid

    def __hash__(self) -> int:
        return id(self.grid)  # bits: only tells them apart
