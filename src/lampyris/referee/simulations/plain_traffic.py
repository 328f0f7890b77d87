"""Obstacles of one cell, all there from the beginning: most simulations, whose soundness can be seen at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import any_true
from lampyris.model.trace import Trace
from lampyris.referee.geometry.shapes import Ints, disc_cells
from lampyris.referee.path import plain_codes

_NARROW = 2**28
"""Cells of a map whose numbers, and sums of two of them, have 32 bits."""


@dataclass(frozen=True, slots=True)
class PlainDrive:
    """The robot's drive in a simulation that breaks no rule of obstacles.

    Parameters
    ----------
    at : numbers of its cells, row by row of the map, tick by tick; (ticks,).
    dx, dy : its steps and 1, which is 0, 1 or 2; (ticks - 1,).
    driven : the ticks at whose end it is on another cell than before, and the first; bool (ticks,).
    """

    at: Ints
    dx: Ints
    dy: Ints
    driven: NDArray[np.bool_]

    def codes(self, trace: Trace) -> Ints | None:
        """The look-up codes of its steps, waits left out, where one check of all of them finds them legal; None: undecided."""
        if trace.scene.robot.radius > 0:
            return None
        moved = self.driven[1:]
        at, dx, dy = self.at[self.driven], self.dx[moved], self.dy[moved]
        return plain_codes(at, dx, dy, trace.scene.grid, trace.scene.moves)


def plainly_legal(trace: Trace) -> PlainDrive | None:
    """Whether robot and obstacles can be seen at once to break no rule of obstacles, nor any of two; None says nothing.

    On a map without edits each is on free cells of the map and makes steps to neighbours alone. Nobody is in one cell
    with another, so the cells of a tick are all different. Two that change places, and two that cross in a block of four
    cells, have one point in common half way: the middles of all steps of a tick are different, too.
    """
    grid = trace.scene.grid
    height, width = grid.blocked.shape
    if not trace.tracks or any(trace.appears) or not _of_one_cell(trace) or height * width > _NARROW:
        return None
    flat = np.concatenate((trace.robot, *trace.tracks))
    if flat.dtype != np.int32 or flat.shape[1] != 2:
        return None
    # As numbers without a sign those left of the map and above it are very large.
    at = np.ascontiguousarray(flat.T)
    if any_true(at.view(np.uint32) >= np.array(((width,), (height,)), dtype=np.uint32)):
        return None
    x, y = at
    rows = y * np.int32(width)
    cell = rows + x
    if any_true(grid.blocked.take(cell)):
        return None
    ticks, count = len(trace.robot), 1 + len(trace.tracks)
    lines = at.reshape(2, count, ticks)
    step = lines[..., 1:] - lines[..., :-1]
    step += 1
    if any_true(step.view(np.uint32) > 2):
        return None
    robot = cell[:ticks].astype(np.int64)
    cell += rows  # a row counts twice the width, so that sums of two say both coordinates
    place = cell.reshape(count, ticks)
    both = np.empty((count, 2 * ticks - 1), dtype=np.int32)
    both[:, :ticks] = place
    np.add(place[:, 1:], place[:, :-1], out=both[:, ticks:])
    seen = np.ascontiguousarray(both.T)
    seen.sort(axis=1)
    # Where the last of one row and the first of the next are equal, nothing is said either.
    line = seen.reshape(-1)
    if any_true(line[1:] == line[:-1]):
        return None
    driven = np.ones(ticks, dtype=np.bool_)
    np.not_equal(robot[1:], robot[:-1], out=driven[1:])
    return PlainDrive(robot, step[0, 0].astype(np.int64), step[1, 0].astype(np.int64), driven)


def _of_one_cell(trace: Trace) -> bool:
    """Whether the robot and all obstacles, by their radius and by what they state, cover one cell."""
    resolution = trace.scene.grid.resolution
    if len(disc_cells(trace.scene.robot.radius, resolution)) != 1:
        return False
    kinds = {id(one): one for one in trace.obstacle_specs}  # bits: only tells them apart
    return all(
        one.footprint == ((0, 0),) and len(disc_cells(one.radius, resolution)) == 1 for one in kinds.values()
    )
