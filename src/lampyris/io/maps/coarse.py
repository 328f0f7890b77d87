"""Coarse maps: cells as large as a robot, for fleets on maps whose own cells are a few centimetres wide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from lampyris._core.scalars import in_range
from lampyris.errors import FileError, LampyrisError, SceneError, SettingError, of_kind, shown
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.lifelong import FleetTask
from lampyris.model.grid import Grid
from lampyris.typing import BoolGrid, Cell


def coarse_grid(grid: Grid, cell: float) -> Grid:
    """The same map in larger cells: one is free only if all cells of the map in it are, and it lies on the map as a whole.

    Parameters
    ----------
    grid : the map. The lower left corner stays where it is; so does the map frame.
    cell : side of the larger cells in metres, a whole multiple of the map's resolution.

    Raises
    ------
    SettingError : ``CELL``: no such multiple, or no free cell is left.
    """
    of_kind("grid", grid, Grid)
    fine = grid.resolution
    most = fine * min(grid.height, grid.width)  # a larger cell would not lie on the map as a whole
    if not in_range(cell, fine, most * (1 + 1e-9)):
        allowed = f"{fine:g} (the map's resolution) to {most:g} metres (its shorter side)"
        raise SettingError.of("CELL", "cell", shown(cell), allowed=allowed)
    times = round(cell / fine)
    if abs(times * fine - cell) > 1e-6 * cell:
        allowed = f"a whole multiple of the map's resolution {fine:g} m, such as {times * fine:g}"
        raise SettingError.of("CELL", "cell", f"{cell:g} m", allowed=allowed)
    if times == 1:
        return grid
    height, width = -(-grid.height // times), -(-grid.width // times)
    padded = np.ones((height * times, width * times), dtype=np.bool_)
    padded[height * times - grid.height :, : grid.width] = grid.blocked
    blocked: BoolGrid = np.asarray(padded.reshape(height, times, width, times).any(axis=(1, 3)))
    if blocked.all():
        todo = "take smaller cells, or plan with robots of several sizes and prioritised-sipp"
        raise SettingError.of("CELL", "cell", f"{cell:g} m leaves no free cell", allowed="less", todo=todo)
    return Grid(blocked, None, times * fine, grid.origin, grid.name)


def coarse_fleet(fleet: Fleet, coarse: Grid) -> Fleet:
    """A fleet on a coarse map: each start, goal and task is the coarse cell that holds it.

    Raises
    ------
    SceneError : ``START_OCCUPIED`` and its like: a coarse cell that is not free.
    FileError : ``FLEET``: two robots with one start or one goal there.
    """
    inside = partial(coarse_cell, grid=fleet.grid, coarse=coarse)
    try:
        return Fleet(
            coarse,
            [
                Agent(inside(one.start), inside(one.goal), one.robot, [inside(stop) for stop in one.tasks])
                for one in fleet.robots
            ],
        )
    except LampyrisError as fault:
        index, _, end = fault.where.removeprefix("robots[").partition("]")
        if not index.isdigit():
            raise
        kind = SceneError if isinstance(fault, SceneError) else FileError
        end = end.removeprefix(".")
        given = getattr(fleet.robots[int(index)], end, None) if end in ("start", "goal") else None
        what = f"its {end}" if given is None else f"its {end} {given}"
        raise kind(
            fault.code,
            f"robot {index}: {what}, in larger cells: {fault.what}",
            where=f"cells of {coarse.resolution:g} m",
            allowed=fault.allowed,
            todo="move it, or take smaller cells",
        ) from None


def coarse_cell(cell: Cell, grid: Grid, coarse: Grid) -> Cell:
    """The coarse cell that holds a cell of the map."""
    x, y = grid.to_metres(cell).tolist()
    return coarse.to_cell(x, y)


def coarse_tasks(tasks: Sequence[FleetTask], grid: Grid, coarse: Grid) -> tuple[FleetTask, ...]:
    """The same tasks with the coarse cells that hold their stops."""
    return tuple(
        replace(one, stops=tuple(coarse_cell(stop, grid, coarse) for stop in one.stops)) for one in tasks
    )


def coarse_note(grid: Grid, coarse: Grid) -> str:
    """What was done to a map, for a person."""
    times = round(coarse.resolution / grid.resolution)
    area = float((~grid.blocked).sum())
    kept = float((~coarse.blocked).sum()) * times * times
    return (
        f"cells of {coarse.resolution:g} m, each {times} x {times} cells of the map and free only if all of them are: "
        f"{coarse.width} x {coarse.height} cells with {kept / area:.0%} of the free area; starts and goals are cells of these"
    )
