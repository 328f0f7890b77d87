"""Whom planners that sample are compared with: OMPL in the plane, on the same free cells and ends."""

from __future__ import annotations

import multiprocessing
import time
from typing import Any, cast

import numpy as np
from benchmarks.pose_rivals import Taken

CHECKED = 0.5
"""Cells between two points of a line that OMPL looks at."""


class OmplPlane:
    """A planner of OMPL in the plane, lengths in cells; its check is a lookup in the map of free cells."""

    def __init__(self, planner: str, free: np.ndarray, seconds: float) -> None:
        from ompl import base, geometric, util

        util.noOutputHandler()
        self._geometric, self._planner, self._seconds = geometric, planner, seconds
        self._space = base.RealVectorStateSpace(2)
        bounds = base.RealVectorBounds(2)
        high, wide = free.shape
        for axis, end in enumerate((wide, high)):
            bounds.setLow(axis, 0.0)
            bounds.setHigh(axis, end - 1e-9)
        self._space.setBounds(bounds)
        rows = free.tolist()

        def is_free(state: Any) -> bool:
            return rows[int(state[1])][int(state[0])]

        self._is_free = is_free

    def apart(self, start: tuple[int, int], goal: tuple[int, int]) -> Taken:
        """The answer of a process that was forked for it; one that crashes has none."""
        context = multiprocessing.get_context("fork")
        receiver, sender = context.Pipe(duplex=False)
        child = context.Process(target=lambda: sender.send(self(start, goal)))
        child.start()
        sender.close()
        try:
            return cast(Taken, receiver.recv())
        except EOFError:
            return Taken(self._seconds, None)
        finally:
            child.join()

    def __call__(self, start: tuple[int, int], goal: tuple[int, int]) -> Taken:
        setup = self._geometric.SimpleSetup(self._space)
        setup.setStateValidityChecker(self._is_free)
        ends = []
        for cell in (start, goal):
            state = self._space.allocState()
            state[0], state[1] = cell[0] + 0.5, cell[1] + 0.5
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        setup.getSpaceInformation().setStateValidityCheckingResolution(
            CHECKED / self._space.getMaximumExtent()
        )
        setup.setPlanner(getattr(self._geometric, self._planner)(setup.getSpaceInformation()))
        begin = time.thread_time_ns()
        setup.solve(self._seconds)
        spent = (time.thread_time_ns() - begin) / 1e9
        if not setup.haveExactSolutionPath():
            return Taken(max(spent, self._seconds), None)
        return Taken(spent, float(setup.getSolutionPath().length()))
