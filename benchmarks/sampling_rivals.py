"""Whom planners that sample are compared with: OMPL in the plane, with the same walls, disc and ends."""

from __future__ import annotations

import multiprocessing
import time
from itertools import pairwise
from typing import Any, cast

import numpy as np
from benchmarks.pose_rivals import Judged, solve_within
from scipy import ndimage

from lampyris.kernels.graph.any_angle import TOUCH, WIDE
from lampyris.kernels.sampling.sweep import UNITS, clear

PARTS = 8
"""Parts of a cell's side, in whose squares OMPL looks up whether the disc has room."""
CLOSE = 1 / 16
"""Cells between two points at which its paths are judged."""


def room_for(walls: np.ndarray, radius: float) -> np.ndarray:
    """For each square of an eighth of a cell: whether a disc (radius in cells), its centre in the middle, touches no wall.

    As for our planners the edge of the map is no wall: only the centre of the disc must be on the map.
    """
    fine = np.kron(walls, np.ones((PARTS, PARTS), dtype=bool))
    where = ndimage.distance_transform_edt(~fine, return_distances=False, return_indices=True)
    apart = [np.maximum(np.abs(w - i) - 0.5, 0.0) for w, i in zip(where, np.indices(fine.shape), strict=True)]
    return cast(np.ndarray, ~fine & (np.hypot(*apart) >= radius * PARTS))


class ExactLines:
    """Whether a disc, or a point that must touch no wall, may move along a line, by compiled code that is exact.

    Parameters
    ----------
    walls : bool (height, width).
    radius : of the disc, cells.
    """

    def __init__(self, walls: np.ndarray, radius: float) -> None:
        framed = np.pad(walls, 1).astype(np.uint8)
        self._walls, self._stride = framed.ravel(), framed.shape[1]
        self._radius, self._rule = radius * UNITS * (1.0 - 1e-9), WIDE if radius else TOUCH
        self._clear = clear.compiled()

    def __call__(self, ax: float, ay: float, bx: float, by: float) -> bool:
        """Places as of :class:`OmplPlane`: the cell (0, 0) reaches from 0 to 1. They are rounded to 2^-16 of a cell."""
        ends = [round((v - 0.5) * UNITS) for v in (ax, ay, bx, by)]
        return bool(self._clear(self._walls, self._stride, *ends, self._radius, self._rule))


class OmplPlane:
    """A planner of OMPL in the plane, lengths in cells; its check is a lookup in a map of where the disc has room.

    Parameters
    ----------
    planner : its name.
    room : of :func:`room_for`.
    seconds : its limit, of processor time.
    checked : cells between two points of a line that it looks at.
    exact : decides on lines in place of ``checked``; None: nothing does.
    """

    def __init__(
        self, planner: str, room: np.ndarray, seconds: float, checked: float, exact: ExactLines | None = None
    ) -> None:
        from ompl import base, geometric, util

        util.noOutputHandler()
        self._geometric, self._planner, self._seconds, self._checked = geometric, planner, seconds, checked
        self._space = base.RealVectorStateSpace(2)
        bounds = base.RealVectorBounds(2)
        high, wide = room.shape
        for axis, end in enumerate((wide, high)):
            bounds.setLow(axis, 0.0)
            bounds.setHigh(axis, end / PARTS - 1e-9)
        self._space.setBounds(bounds)
        self._room = room
        free = room.astype(np.uint8).tobytes()

        def is_free(state: Any) -> bool:
            return free[int(state[1] * PARTS) * wide + int(state[0] * PARTS)] == 1

        self._is_free = is_free
        self._exact = exact

    def apart(self, start: tuple[int, int], goal: tuple[int, int]) -> Judged:
        """The answer of a process that was forked for it; one that crashes has none."""
        context = multiprocessing.get_context("fork")
        receiver, sender = context.Pipe(duplex=False)
        child = context.Process(target=lambda: sender.send(self(start, goal)))
        child.start()
        sender.close()
        try:
            return cast(Judged, receiver.recv())
        except EOFError:
            return Judged(self._seconds, None)
        finally:
            child.join()

    def __call__(self, start: tuple[int, int], goal: tuple[int, int]) -> Judged:
        setup = self._geometric.SimpleSetup(self._space)
        if self._exact is None:
            setup.setStateValidityChecker(self._is_free)
        else:
            exact, information = self._exact, setup.getSpaceInformation()
            setup.setStateValidityChecker(lambda at: exact(at[0], at[1], at[0], at[1]))
            information.setMotionValidator(_motions(exact, information))
        ends = []
        for cell in (start, goal):
            state = self._space.allocState()
            state[0], state[1] = cell[0] + 0.5, cell[1] + 0.5
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        setup.getSpaceInformation().setStateValidityCheckingResolution(
            self._checked / self._space.getMaximumExtent()
        )
        setup.setPlanner(getattr(self._geometric, self._planner)(setup.getSpaceInformation()))
        begin = time.thread_time_ns()
        solve_within(setup, self._seconds, of_processor=True)
        spent = (time.thread_time_ns() - begin) / 1e9
        if not setup.haveExactSolutionPath():
            return Judged(max(spent, self._seconds), None)
        path = setup.getSolutionPath()
        points = np.array([(state[0], state[1]) for state in path.getStates()])
        length = float(path.length())
        straight = float(np.hypot(start[0] - goal[0], start[1] - goal[1]))
        return Judged(spent, length, free=length > straight - 1e-6 and self._is_clear(points))

    def _is_clear(self, points: np.ndarray) -> bool:
        if self._exact is not None:
            return all(self._exact(*a, *b) for a, b in pairwise(points))
        for a, b in pairwise(points):
            parts = np.linspace(0.0, 1.0, 2 + int(np.hypot(*(b - a)) / CLOSE))
            x, y = ((a + (b - a) * parts[:, None]) * PARTS).astype(int).T
            if not self._room[y, x].all():
                return False
        return True


def _motions(exact: ExactLines, information: Any) -> Any:
    """What decides on lines for OMPL."""
    from ompl import base

    class Motions(base.MotionValidator):  # type: ignore[misc]
        def checkMotion(self, a: Any, b: Any) -> bool:
            return exact(a[0], a[1], b[0], b[1])

    return Motions(information)
