"""What a Change does to a scene, the same for every planner that keeps one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.typing import ByteGrid, Cell


def edited(scene: Scene, change: Change, under_walls: dict[Cell, int] | None = None) -> Scene:
    """The scene with the cells of ``change.blocked``, ``freed`` and ``terrain`` as they are now; itself if
    there are none.

    A cell named in both is blocked. Planners with a robot of some radius make their free space again from
    it: one wall takes more than one cell from them.

    Parameters
    ----------
    under_walls : terrain values of cells that a Change has blocked, so that a cell freed later has its own
        terrain again. A session keeps one such dictionary, empty at first, and passes it to every call; it
        is updated here. None: a freed cell is plain ground.

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
    terrain = _graded(grid, change, under_walls or {})
    now = replace(scene, grid=replace(grid, blocked=walls, unknown=unknown, terrain=terrain))
    if under_walls is not None:
        _remember(grid, change, under_walls)
    return now


def _remember(grid: Grid, change: Change, under_walls: dict[Cell, int]) -> None:
    """Note the terrain of free cells that turn into walls.

    Nothing is ever removed: a call that is stopped after this and repeated must find what it needs.
    """
    for x, y in change.blocked:
        if not grid.blocked[y, x]:
            value = 0 if grid.terrain is None else int(grid.terrain[y, x])
            if value or (x, y) in under_walls:
                under_walls[int(x), int(y)] = value


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


def _graded(grid: Grid, change: Change, under_walls: dict[Cell, int]) -> ByteGrid | None:
    """The terrain after a change: what was under a wall, then what the change says."""
    uncovered = {(x, y): under_walls.get((x, y), 0) for x, y in change.freed if grid.blocked[y, x]}
    if not change.terrain and not any(uncovered.values()):
        return grid.terrain
    values = np.zeros(grid.blocked.shape, np.int64) if grid.terrain is None else grid.terrain.astype(np.int64)
    for (x, y), value in uncovered.items():
        values[y, x] = value
    for (x, y), value in change.terrain:
        values[y, x] = value
    return values  # type: ignore[return-value]  # Grid refuses what is out of range
