"""The earliest tick at which a robot can be where a moving goal is, and how.

All cells that the robot can be on after 0, 1, 2, ... ticks, layer by layer: exact, because nothing but the tick matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lampyris._core.cancellation import checkpoint
from lampyris.kernels.spacetime.timed_search import EXHAUSTED, FOUND, LIMIT
from lampyris.model.moves import Moves
from lampyris.planning.graph.terrain_graph import search_of
from lampyris.planning.spacetime.prediction import Forbidden
from lampyris.planning.spacetime.search import TimedSearchResult
from lampyris.typing import BoolGrid, Cell, Cells

MOST_BYTES = 1 << 28
"""Bytes of layers that are kept to read the path off."""


@dataclass(slots=True)
class _Bars:
    """What obstacles forbid at one tick: cells, and steps (cell and kind)."""

    cells: list[int]
    steps: list[tuple[int, int, int]]


def earliest_meeting(
    free: BoolGrid, moves: Moves, start: Cell, tick: int, goals: Sequence[Cell], given: Forbidden, budget: int | None
) -> TimedSearchResult:  # fmt: skip
    """The first tick at which the robot and the goal can be in one cell.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    moves : steps to neighbours; each takes a tick, and so does waiting.
    start, tick : where the robot is, and when.
    goals : the goal's cell at ``tick``, ``tick + 1``, ...; after the last it stays.
    given : what moving obstacles forbid.
    budget : most cells of layers; None: no limit.

    Returns
    -------
    ``cut`` where obstacles move beyond what was forecast. Of all ways to be there in time the shortest path of the grid, if
    it is one; otherwise any. Either waits at its end.
    """
    width = free.shape[1]
    bars: dict[int, _Bars] = {}
    for cell, t in given.at.tolist():
        bars.setdefault(t, _Bars([], [])).cells.append(cell)
    for cell, t, dx, dy in given.steps.tolist():
        bars.setdefault(t, _Bars([], [])).steps.append((cell, dx, dy))
    forever = given.forever[np.argsort(given.forever[:, 1], kind="stable")]
    allowed = free.copy()
    gone = 0
    now = np.zeros_like(free)
    now[start[1], start[0]] = True
    layers = [np.packbits(now)]
    spent = 1
    last = tick + len(goals) - 1
    t = tick
    while True:
        x, y = goals[min(t - tick, len(goals) - 1)]
        if now[y, x]:
            left = None if budget is None else max(budget - spent, 0)
            found = search_of(free, None, moves).find_path(start, (x, y), left)
            walk = found.cells
            if walk is not None and _in_time(walk, layers, width, tick, bars):
                cells, ticks = walk, tick + np.arange(len(walk), dtype=np.int64)
            else:
                cells, ticks = _backwards(layers, free, moves, (x, y), tick, bars)
            return TimedSearchResult(FOUND, spent + found.expansions, False, cells, ticks)
        checkpoint()
        if (budget is not None and spent > budget) or len(layers) * len(layers[0]) > MOST_BYTES:
            return TimedSearchResult(LIMIT, spent)
        if t >= given.until:
            return TimedSearchResult(EXHAUSTED, spent, cut=True)
        t += 1
        while gone < len(forever) and forever[gone, 1] <= t:
            v, u = divmod(int(forever[gone, 0]), width)
            allowed[v, u] = False
            gone += 1
        bar = bars.get(t)
        then = _stepped(now, free, moves, bar, width)
        then &= allowed
        if bar is not None and bar.cells:
            then.ravel()[bar.cells] = False
        if t > max(last, given.still) and gone == len(forever) and np.array_equal(then, now):
            return TimedSearchResult(EXHAUSTED, spent)
        now = then
        spent += int(np.count_nonzero(now))
        if not now.any():
            return TimedSearchResult(EXHAUSTED, spent)
        layers.append(np.packbits(now))


def _stepped(now: BoolGrid, free: BoolGrid, moves: Moves, bar: _Bars | None, width: int) -> BoolGrid:
    """Where a robot that is on one of these cells can be a tick later, as far as walls and forbidden steps go."""
    height = len(now)
    then = now.copy()
    for dx, dy in moves.offsets:
        source = now
        barred = [] if bar is None else [cell for cell, u, v in bar.steps if (u, v) == (dx, dy)]
        if barred:
            source = now.copy()
            source.ravel()[barred] = False
        to_y, to_x = _span(dy, height), _span(dx, width)
        from_y, from_x = _span(-dy, height), _span(-dx, width)
        part = source[from_y, from_x]
        if dx and dy and not moves.corner_cutting:
            part = part & free[from_y, to_x] & free[to_y, from_x]
        then[to_y, to_x] |= part
    return then


def _span(d: int, size: int) -> slice:
    """The rows or columns that a shift by d fills."""
    return slice(max(d, 0), size + min(d, 0))


def _in_time(
    walk: Cells, layers: Sequence[np.ndarray], width: int, tick: int, bars: dict[int, _Bars]
) -> bool:
    """Whether a walk that begins at once, and then waits, ends in the last layer and obstacles let it pass."""
    if len(walk) > len(layers):
        return False
    cells = (walk[:, 1].astype(np.int64) * width + walk[:, 0]).tolist()
    cells += [cells[-1]] * (len(layers) - len(cells))
    if any(not layer[cell >> 3] >> (7 - (cell & 7)) & 1 for cell, layer in zip(cells, layers, strict=True)):
        return False
    steps = np.diff(walk, axis=0).tolist()
    return all(
        (cells[k], dx, dy) not in bars[tick + k + 1].steps
        for k, (dx, dy) in enumerate(steps)
        if tick + k + 1 in bars
    )


def _backwards(
    layers: Sequence[np.ndarray], free: BoolGrid, moves: Moves, end: Cell, tick: int, bars: dict[int, _Bars]
) -> tuple[np.ndarray, np.ndarray]:
    """The cells of a path through the layers, no cell twice in a row, and when each is entered."""
    height, width = free.shape
    cells, ticks = [end], [tick + len(layers) - 1]
    x, y = end
    for k in range(len(layers) - 2, -1, -1):
        before = np.unpackbits(layers[k], count=height * width).view(np.bool_).reshape(height, width)
        ticks[-1] = tick + k + 1
        if before[y, x]:
            continue
        bar = bars.get(tick + k + 1)
        x, y = next(
            (x - dx, y - dy)
            for dx, dy in moves.offsets
            if 0 <= x - dx < width
            and 0 <= y - dy < height
            and before[y - dy, x - dx]
            and (not (dx and dy) or moves.corner_cutting or (free[y - dy, x] and free[y, x - dx]))
            and (bar is None or ((y - dy) * width + x - dx, dx, dy) not in bar.steps)
        )
        cells.append((x, y))
        ticks.append(tick)
    ticks[-1] = tick
    return np.array(cells[::-1], dtype=np.int32), np.array(ticks[::-1], dtype=np.int64)
