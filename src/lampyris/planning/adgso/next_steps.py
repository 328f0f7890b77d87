"""Next steps: AD-GSO's answer to a simulation that asks again every few ticks, without a whole plan made of it.

Of the path only the first sub-path and a few steps more are walked; its cost, and what is only reported of a plan, is left
out. Where an answer would need more than the field as it is (cells to wall in, gates, a limit, draws), there is none, and
the session is asked for a plan.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.adgso import walk as w
from lampyris.kernels.adgso.lookahead_walk import KNOWN
from lampyris.kernels.adgso.next_steps import next_steps
from lampyris.kernels.simulation.asking import ASKED_STATE, HEMMED_AT, PER_ANSWER, advance_adgso
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.planning.adgso.walk import NO_LIMIT, Walker, walls
from lampyris.planning.base import AnswersInTicks, NextSteps
from lampyris.planning.field.repair import Padded

Spare: TypeAlias = list[tuple[tuple[Any, ...], Any, tuple[Any, ...]]]
MOST_KNOWN = 1 << 12
"""Jumps that are remembered at most; 24 bytes each."""
SPARED = 4
"""Finders whose work is kept on one field with one set of settings."""


class StepFinder:
    """Finds next steps on one field.

    Parameters
    ----------
    walker : its settings and room.
    ground : the field.
    start : any cell.
    moves : the step set.
    wanted : steps after the first sub-path that are wanted.
    spare : where finders on the same field with the same settings, ``wanted`` among them, leave what they have worked out:
        jumps among no obstacles are the same for all of them. Each is used by one finder at a time. None: nowhere.
    """

    def __init__(
        self,
        walker: Walker,
        ground: Padded,
        start: int,
        moves: Moves,
        wanted: int,
        spare: Spare | None = None,
    ) -> None:
        self._spare, self._at_rest = spare, True
        trip = walker.start(start)
        trip.tally[w.ALLOWED] = NO_LIMIT
        self._tally = trip.tally
        self._path = np.zeros(len(trip.path) + wanted, dtype=np.int64)
        self._pairs = np.zeros(64, dtype=np.int64)
        self._answers: AnswersInTicks | None = None
        left = _left_in(spare)
        if left is None:
            shut = walls(ground)
            # One width: compiling the kernel takes seconds. Of a field that has it no copy is made.
            cost = frozen(ground.cost.astype(np.int64, copy=False).view())
            known = np.zeros(KNOWN * min(MOST_KNOWN, 1 << len(cost).bit_length()), dtype=np.int32)
            lower = moves.corner_cutting or not any(dx and dy for dx, dy in moves.offsets)
            field = (cost, ground.luciferin, ground.step, shut, ground.terrain)
            setup, others = walker.arrays()
            left = field, setup, (*others, known, int(lower), wanted)
        self._left = left
        self._field: tuple[Any, ...] = left[0]
        _, setup, rest = left
        self._rest: tuple[Any, ...] = (setup, self._tally, self._path, *rest)

    def __del__(self) -> None:
        # A kernel that was stopped may have left its room in any state.
        spare = self._spare
        if spare is not None and self._at_rest and len(spare) < SPARED:
            spare.append(self._left)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_spare": None}

    def answers(self, hemmed: int, limit: int, closed: int) -> AnswersInTicks:
        """For a kernel that asks by itself.

        Parameters
        ----------
        hemmed : the cell in which the robot was hemmed in, or -1.
        limit : states that an answer may expand; -1: any number.
        closed : cells that obstacles close, at most.
        """
        self._at_rest = False
        if len(self._pairs) < 2 * closed or self._answers is None:
            self._pairs = np.zeros(max(2 * closed, len(self._pairs)), dtype=np.int64)
            asked = np.zeros(ASKED_STATE, dtype=np.int64)
            rest = (self._pairs, *self._field, *self._rest)
            self._answers = AnswersInTicks(advance_adgso, asked, rest, self._path)
        self._answers.asked[HEMMED_AT], self._answers.asked[PER_ANSWER] = hemmed, limit
        return self._answers

    def answered(self) -> None:
        """The kernel has come back."""
        self._at_rest = True

    def find(self, robot: int, closed: NDArray[np.int64], count: int) -> NextSteps | None:
        """The steps from a cell; None: they take a plan.

        Parameters
        ----------
        robot : the cell's number.
        closed, count : cells that obstacles close now, and how many there are.
        """
        if self._field[0][robot] < 0:
            return None
        if len(self._pairs) < 2 * count:
            self._pairs = np.zeros(4 * count, dtype=np.int64)
        self._at_rest = False
        code = next_steps(robot, closed, count, self._pairs, *self._field, *self._rest)
        self._at_rest = True
        tally = self._tally
        if code == w.HEMMED:
            return NextSteps(self._path, -1, 0, int(tally[w.LOOKED]))
        if code != w.ARRIVED:
            return None
        return NextSteps(self._path, int(tally[w.LENGTH]) - 1, int(tally[w.FIRST]), int(tally[w.LOOKED]))


def _left_in(spare: Spare | None) -> tuple[tuple[Any, ...], Any, tuple[Any, ...]] | None:
    """Take the tables that an earlier finder returned, for exclusive use; None if there are none."""
    try:
        return spare.pop() if spare else None
    except IndexError:  # another thread was quicker
        return None
