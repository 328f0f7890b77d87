"""Every edit of every small grid: one cell turns from what it is into what it is not."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner, Session
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import solve
from lampyris_selfcheck.checks.changes.repair_story import RNG, demand, reference_costs
from lampyris_selfcheck.reference.paths.changing_map import Cell, ChangingMap
from lampyris_selfcheck.reference.paths.path_cost import walked


@lru_cache(maxsize=2)
def edits(side: int) -> np.ndarray:
    """All of them, int32 (cells * 2 ** cells, 2): the grid with the cell blocked, and the cell. Two of the
    cases are one row: first the cell is freed, then blocked again."""
    cells = side * side
    bits = np.arange(1 << cells, dtype=np.int32)
    rows = [np.stack((shut, np.full_like(shut, k)), axis=1)
            for k in range(cells) for shut in [bits[bits >> k & 1 == 0]]]  # fmt: skip
    found = np.concatenate(rows)
    return found[np.lexsort((found[:, 1], found[:, 0]))]


@lru_cache(maxsize=1 << 18)
def truth(side: int, bits: int, name: str, goal: Cell) -> tuple[bytes, bytes, bytes]:
    """Cost, parent and luciferin of every cell, solved from scratch; the costs are the reference's, too."""
    free = free_of(side, bits)
    field = solve(free, MOVES[name], goal)
    right = reference_costs(ChangingMap((~free).tolist(), None), name, goal, MOVES[name])
    demand(np.array_equal(field.exact, right), f"{name} moves, goal {goal}: solved from scratch it is wrong")
    return field.exact.tobytes(), field.step.tobytes(), field.luciferin.tobytes()


def free_of(side: int, bits: int) -> np.ndarray:
    """A grid's free cells."""
    return np.array([bits >> k & 1 for k in range(side * side)], np.bool_).reshape(side, side)


@lru_cache(maxsize=1 << 10)
def free_rows(side: int, bits: int) -> list[list[bool]]:
    """The same as lists, for the walk."""
    rows: list[list[bool]] = free_of(side, bits).tolist()
    return rows


class Group:
    """All edits of one grid: repairers and sessions that live through them.

    Parameters
    ----------
    side, bits : the grid before each edit.
    fields : step set and goal of each repairer.
    asked : planner, step set, start and goal of each session.
    """

    def __init__(
        self,
        side: int,
        bits: int,
        fields: Sequence[tuple[str, Cell]],
        asked: Sequence[tuple[Planner, str, Cell, Cell]],
    ) -> None:
        self.bits, self._side = bits, side
        free = free_of(side, bits)
        self._repairers = [(name, goal, FieldRepairer(free, MOVES[name], goal)) for name, goal in fields]
        self._sessions: list[tuple[Planner, str, Cell, Cell, Session]] = []
        for planner, name, start, goal in asked:
            session = planner.open(Scene(Grid(~free), start, goal, MOVES[name]), RNG)
            session.plan()
            self._sessions.append((planner, name, start, goal, session))

    def edit(self, cell: int, freed: bool) -> set[str]:
        """Make one edit and judge every answer; the statuses that were right.

        Raises
        ------
        AssertionError : an answer is wrong.
        """
        now = self.bits | 1 << cell if freed else self.bits
        at = ((cell % self._side, cell // self._side),)
        for name, goal, repairer in self._repairers:
            field = repairer.repair(freed=at) if freed else repairer.repair(blocked=at)
            found = field.exact.tobytes(), field.step.tobytes(), field.luciferin.tobytes()
            right = truth(self._side, now, name, goal)
            if found != right:
                demand(False, f"{name} moves, goal {goal}: the repaired field is not the one solved anew")
        return {self._ask(k, now, at, freed) for k in range(len(self._sessions))}

    def _ask(self, k: int, now: int, at: tuple[Cell, ...], freed: bool) -> str:
        planner, name, start, goal, session = self._sessions[k]
        plan = session.plan(Change(freed=at) if freed else Change(blocked=at))
        side = self._side

        def is_free(cell: Cell) -> bool:
            return bool(now >> (cell[1] * side + cell[0]) & 1)

        cost = -1
        if not is_free(start):
            word = "start-occupied"
        elif not is_free(goal):
            word = "goal-occupied"
        else:
            costs = np.frombuffer(truth(side, now, name, goal)[0], dtype=_dtype(side, name, goal))
            cost = int(costs[start[1] * side + start[0]])
            word = "found" if cost >= 0 else "no-path"
        found = -1 if plan.path is None else plan.path.exact
        if (plan.status, found) != (word, cost):
            what = f"{planner.name}, {name} moves, {start} to {goal}: {plan.status} at {found}"
            demand(False, f"{what}, should be {word} at {cost}")
        if plan.path is not None:
            wrong = misled(plan.path.cells, free_rows(side, now), name, start, goal, cost)
            demand(not wrong, f"{planner.name}, {name} moves, {start} to {goal}: {wrong}")
        return word


def misled(cells: np.ndarray, free: list[list[bool]], name: str, start: Cell, goal: Cell, cost: int) -> str:
    """What is wrong with a way, cell by cell; nothing: an empty word. What its plan says is no matter."""
    way = [(int(x), int(y)) for x, y in cells.tolist()]
    if (*way[:1], *way[-1:]) != (start, goal):
        return f"it goes from {way[:1]} to {way[-1:]}"
    wrong, counts = walked(free, way, name)
    moves = MOVES[name]
    paid = counts[0] * moves.straight + counts[1] * moves.diagonal + counts[2] * moves.knight
    return wrong or ("" if paid == cost else f"the way costs {paid}, should be {cost}")


@lru_cache(maxsize=512)
def _dtype(side: int, name: str, goal: Cell) -> np.dtype:
    return solve(free_of(side, (1 << side * side) - 1), MOVES[name], goal).exact.dtype
