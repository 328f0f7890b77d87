"""A map that changes under a session: walls, free space and terrain kept up to date cell by cell."""

from __future__ import annotations

import numpy as np

from lampyris._core.cancellation import shielded
from lampyris.errors import SettingError
from lampyris.model.change import Change
from lampyris.model.grid import MAX_TERRAIN, Grid
from lampyris.model.scene import Scene
from lampyris.planning.edits import require_inside
from lampyris.planning.field.layers import free_cells
from lampyris.typing import BoolGrid, ByteGrid, Cell


class LivingMap:
    """What :func:`lampyris.planning.edits.edited` makes of a scene, without a copy of the map at each Change.

    For a robot of some radius one wall takes a disc of cells: free space is made again in a window around what
    changed, twice as wide as the robot reaches, which is all that can matter there.

    Parameters
    ----------
    scene : the map as given; it is never written to.
    """

    def __init__(self, scene: Scene) -> None:
        grid = scene.grid
        self.given = grid
        """The map as given."""
        self.radius = scene.robot.radius
        """The robot's, metres."""
        self._walls: BoolGrid = grid.blocked  # copied before it is first written to
        self.free: BoolGrid = free_cells(grid, self.radius)
        self.free.setflags(write=True)
        """Where the robot's centre may be; bool, (height, width)."""
        self.terrain: ByteGrid | None = None if grid.terrain is None else grid.terrain.copy()
        """What cells cost to enter; None as long as no cell of the map has ever had a value."""
        self._graded = 0 if grid.terrain is None else int(np.count_nonzero(grid.terrain))
        self._under_walls: dict[Cell, int] = {}  # terrain of cells that a Change has blocked
        self.revision = 0
        """How many Changes altered the map."""

    @property
    def has_terrain(self) -> bool:
        """Whether any cell has a terrain value now, so that :attr:`Grid.terrain` would not be None."""
        return self._graded > 0

    def take(self, change: Change) -> list[Cell]:
        """Take in what turned blocked, free or other ground; cells whose free space or terrain is other now.

        Raises
        ------
        SceneError : the robot or a changed cell is outside the map. SettingError : a terrain value out of its
            range. Nothing is taken in then.
        """
        require_inside(self.given, change)
        for (x, y), value in change.terrain:
            if not (isinstance(value, int | np.integer) and 0 <= value <= MAX_TERRAIN):
                raise SettingError(
                    "GRID_TERRAIN", f"{value} at ({x}, {y})", where="terrain", allowed=f"0 to {MAX_TERRAIN}"
                )
        if not (change.blocked or change.freed or change.terrain):
            return []
        with shielded():
            return self._write(change)

    def _write(self, change: Change) -> list[Cell]:
        self.revision += 1
        turned = dict.fromkeys(change.freed, False) | dict.fromkeys(change.blocked, True)
        if self._walls is self.given.blocked:
            self._walls = self.given.blocked.copy()
        width, walls = self._walls.shape[1], _bytes(self._walls)
        turned = {(int(x), int(y)): b for (x, y), b in turned.items() if walls[y * width + x] != b}
        for (x, y), blocked in turned.items():
            walls[y * width + x] = blocked
        ground = {cell: 0 for cell, blocked in turned.items() if blocked} if self.has_terrain else {}
        ground |= self._uncovered(turned)
        ground |= {(int(x), int(y)): int(v) for (x, y), v in change.terrain if not walls[y * width + x]}
        altered = self._open(turned)
        return list(dict.fromkeys(altered + self._grade(ground))) if ground else altered

    def _uncovered(self, turned: dict[Cell, bool]) -> dict[Cell, int]:
        """Note the terrain of cells that turn into walls; what freed cells had before they were walls."""
        if self.terrain is None:
            return {}
        known = self._under_walls
        known |= {(x, y): int(self.terrain[y, x]) for (x, y), blocked in turned.items() if blocked}
        freed = [cell for cell, blocked in turned.items() if not blocked]
        return {cell: known[cell] for cell in freed if known.get(cell)}

    def _grade(self, ground: dict[Cell, int]) -> list[Cell]:
        """Write terrain values; the cells where they differ."""
        if self.terrain is None:
            if not any(ground.values()):
                return []
            self.terrain = np.zeros(self._walls.shape, dtype=np.uint8)
        out = []
        for (x, y), value in ground.items():
            old = int(self.terrain[y, x])
            if old != value:
                self._graded += (value > 0) - (old > 0)
                self.terrain[y, x] = value
                out.append((x, y))
        return out

    def _open(self, turned: dict[Cell, bool]) -> list[Cell]:
        """Renew free space around walls that were built or taken away; the cells where it differs."""
        if not turned:
            return []
        reach = int(self.radius / self.given.resolution) + 1
        if 2.0 * self.radius <= self.given.resolution:
            width, free = self._walls.shape[1], _bytes(self.free)
            for (x, y), blocked in turned.items():
                free[y * width + x] = not blocked
            return list(turned)
        xs, ys = [x for x, _ in turned], [y for _, y in turned]
        together = (max(xs) - min(xs) + 1 + 4 * reach) * (max(ys) - min(ys) + 1 + 4 * reach)
        if together <= len(turned) * (1 + 4 * reach) ** 2:
            return self._renew(min(xs), min(ys), max(xs), max(ys), reach)
        return [cell for x, y in turned for cell in self._renew(x, y, x, y, reach)]

    def _renew(self, x0: int, y0: int, x1: int, y1: int, reach: int) -> list[Cell]:
        """Renew free space within ``reach`` of a box of cells, from the walls within twice that."""
        height, width = self._walls.shape
        top, left = max(0, y0 - reach), max(0, x0 - reach)
        inner = (slice(top, min(height, y1 + reach + 1)), slice(left, min(width, x1 + reach + 1)))
        up, back = max(0, y0 - 2 * reach), max(0, x0 - 2 * reach)
        outer = self._walls[up : y1 + 2 * reach + 1, back : x1 + 2 * reach + 1]
        around = free_cells(Grid(outer, resolution=self.given.resolution), self.radius)
        now = around[top - up :, left - back :][: inner[0].stop - top, : inner[1].stop - left]
        rows, columns = np.nonzero(now != self.free[inner])
        self.free[inner] = now
        return list(zip((columns + left).tolist(), (rows + top).tolist(), strict=True))


def _bytes(cells: BoolGrid) -> memoryview:
    """The array's own bytes, row by row: a few cells are read and written three times as quickly so."""
    return cells.view(np.uint8).reshape(-1).data
