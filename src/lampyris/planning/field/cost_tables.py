"""Costs to many goals as compact integers, without parents and luciferin."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import LimitError, SceneError
from lampyris.kernels.fleet.distances import distance_rows
from lampyris.model.moves import MOVES, Moves
from lampyris.planning.field.frame import framed
from lampyris.planning.field.solve import exact_costs
from lampyris.typing import BoolGrid, ByteGrid, Cell

KINDS = ("uint16", "uint32")
"""Types that costs may be asked for in."""
TOGETHER = 8
"""Goals of one call of the kernel: threads change hands less often."""

_Tables = list[NDArray[Any]]


def cost_tables(
    free: BoolGrid, moves: Moves, goals: Iterable[Cell], *, terrain: ByteGrid | None, kind: np.dtype[Any]
) -> Iterator[Callable[[], _Tables]]:
    """Calls that make the tables of the goals, in their order, a few goals each.

    Parameters
    ----------
    free, moves, terrain : as for :func:`lampyris.planning.field.solve.solve`.
    kind : one of :data:`KINDS`.
    """
    if terrain is not None or moves.offsets != MOVES["four-connected"].offsets or set(moves.costs) != {1}:
        for goal in goals:
            yield partial(_of_field, free, moves, goal, terrain, kind)
        return
    ground = framed(free, 1, False).view(np.uint8)
    number = framed(np.arange(free.size, dtype=np.int32).reshape(free.shape), 1, -1)
    rest = iter(goals)
    while some := list(islice(rest, TOGETHER)):
        yield partial(_steps, ground, number, free, some, kind)


def _of_field(
    free: BoolGrid, moves: Moves, goal: Cell, terrain: ByteGrid | None, kind: np.dtype[Any]
) -> _Tables:
    exact, _ = exact_costs(free, moves, goal, terrain=terrain)
    never = int(np.iinfo(kind).max)
    if int(exact.max()) >= never:
        raise _too_long(kind)
    table = exact.astype(kind)
    table[exact < 0] = never
    table.setflags(write=False)
    return [table]


def _steps(
    ground: NDArray[np.uint8],
    number: NDArray[np.int32],
    free: BoolGrid,
    goals: list[Cell],
    kind: np.dtype[Any],
) -> _Tables:
    height, width = free.shape
    for x, y in goals:
        if not (0 <= x < width and 0 <= y < height):
            allowed = f"x 0 to {width - 1}, y 0 to {height - 1}"
            raise SceneError("GOAL_OUTSIDE", f"goal {(x, y)} is outside the map", allowed=allowed)
    never = int(np.iinfo(kind).max)
    tables = np.full((len(goals), free.size), never, dtype=kind)
    # A blocked goal has no cost anywhere.
    rows = [k for k, (x, y) in enumerate(goals) if free[y, x]]
    part = tables if len(rows) == len(goals) else np.full((len(rows), free.size), never, dtype=kind)
    ends = np.array([(goals[k][1] + 1) * (width + 2) + goals[k][0] + 1 for k in rows], dtype=np.int32)
    order, fresh = np.empty(free.size + 9, dtype=np.uint32), np.empty(len(ground), dtype=np.uint8)
    done = len(rows)
    if done:
        flat = part.reshape(-1)
        done = int(
            distance_rows(ground, number, ends, flat, order, fresh, width + 2, free.size, never, False)
        )
    if done < len(rows):
        raise _too_long(kind)
    if part is not tables:
        tables[rows] = part
    tables.setflags(write=False)
    return list(tables.reshape(-1, height, width))


def _too_long(kind: np.dtype[Any]) -> LimitError:
    return LimitError(
        "COST_TABLE",
        f"a cost does not fit into {kind.name}",
        where="dtype",
        allowed=f"below {np.iinfo(kind).max:,}",
    )
