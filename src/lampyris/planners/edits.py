"""What a Change does to a scene, the same for every planner that keeps one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.typing import ByteGrid, Cell


def edited(scene: Scene, change: Change) -> Scene:
    """The scene with the cells of ``change.blocked``, ``freed`` and ``terrain`` as they are now; itself if
    there are none.

    A cell named in both is blocked. Planners with a robot of some radius make their free space anew from
    it: one wall takes more than one cell from them.

    Raises
    ------
    SceneError : the robot or a changed cell is outside the map.
    """
    grid = scene.grid
    require_inside(grid, change)
    if not (change.blocked or change.freed or change.terrain):
        return scene
    walls = grid.blocked.copy()
    unknown = None if grid.unknown is None else grid.unknown.copy()
    for cells, blocked in ((change.freed, False), (change.blocked, True)):
        for x, y in cells:
            walls[y, x] = blocked
            if unknown is not None:
                unknown[y, x] = False
    return replace(scene, grid=replace(grid, blocked=walls, unknown=unknown, terrain=_graded(grid, change)))


def require_inside(grid: Grid, change: Change) -> None:
    """Refuse a Change that names cells outside the map.

    Raises
    ------
    SceneError : the robot or a changed cell is outside the map.
    """
    if change.robot is not None:
        _require(grid, "robot", (change.robot,))
    # Most calls change nothing, and a search of a few microseconds should not wait for this.
    if change.blocked or change.freed or change.terrain:
        _require(grid, "blocked", change.blocked)
        _require(grid, "freed", change.freed)
        _require(grid, "terrain", tuple(cell for cell, _ in change.terrain))


def _require(grid: Grid, what: str, cells: tuple[Cell, ...]) -> None:
    height, width = grid.blocked.shape
    for x, y in cells:
        if not (0 <= x < width and 0 <= y < height):
            raise SceneError(
                "CHANGE_OUTSIDE",
                f"cell {(x, y)} is outside the map",
                where=f"change.{what}",
                allowed=f"x 0 to {width - 1}, y 0 to {height - 1}",
            )


def _graded(grid: Grid, change: Change) -> ByteGrid | None:
    """The terrain after a change."""
    if not change.terrain:
        return grid.terrain
    values = np.zeros(grid.blocked.shape, np.int64) if grid.terrain is None else grid.terrain.astype(np.int64)
    for (x, y), value in change.terrain:
        values[y, x] = value
    return values  # type: ignore[return-value]  # Grid refuses what is out of range
