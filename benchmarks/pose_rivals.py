"""Whom planners of poses are compared with: OMPL and pathplanning, on the same map, footprint and ends."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

LENGTH, WIDTH, RADIUS = 1.2, 0.5, 1.25
"""Metres: the robot's rectangle, its base in the middle, and the least radius of its turns."""
SLOWEST = 20
"""By how much a busy machine may stretch a call."""
BINS = 72
"""Yaws for which OMPL's map of free poses is made."""
TOLERANCE, YAW_TOLERANCE = 0.5, 0.35
"""Metres and radians: what pathplanning allows at the goal by itself."""
WHEELBASE = 1.0
CLOSE = 8
"""Poses for each cell of OMPL's path at which it is judged."""

Pose = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Taken:
    """What one query took.

    Parameters
    ----------
    seconds : of processor time of this thread; of a query without an answer, the limit.
    length : metres; None: no path.
    expansions : of ours, what :class:`lampyris.model.plan.Plan` counts; 0 of others.
    """

    seconds: float
    length: float | None
    expansions: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged(Taken):
    """What one query of OMPL took.

    Parameters
    ----------
    free : whether its path is one: no shorter than the straight line, and free where it is looked at closely.
    """

    free: bool = True


def length_of(poses: np.ndarray) -> float:
    """Metres along the base of a path of poses."""
    return float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())


def free_poses(blocked: np.ndarray, cell: float) -> np.ndarray:
    """For each yaw and cell (rows upwards): whether the rectangle, its base in the cell's middle, touches no wall."""
    occupied = blocked[::-1]
    free = np.ones((BINS, *occupied.shape), dtype=bool)
    along = np.arange(-LENGTH / 2, LENGTH / 2 + 1e-9, cell / 8)
    across = np.arange(-WIDTH / 2, WIDTH / 2 + 1e-9, cell / 8)
    xs, ys = (part.ravel() for part in np.meshgrid(along, across))
    high, wide = occupied.shape
    for k in range(BINS):
        yaw = 2 * math.pi * k / BINS
        dx = np.floor((xs * math.cos(yaw) - ys * math.sin(yaw)) / cell + 0.5).astype(int)
        dy = np.floor((xs * math.sin(yaw) + ys * math.cos(yaw)) / cell + 0.5).astype(int)
        for u, v in set(zip(dx.tolist(), dy.tolist(), strict=True)):
            there = occupied[max(v, 0) : high + min(v, 0), max(u, 0) : wide + min(u, 0)]
            free[k, max(-v, 0) : high + min(-v, 0), max(-u, 0) : wide + min(-u, 0)] &= ~there
    return free


def touches(blocked: np.ndarray, cell: float, poses: np.ndarray) -> bool:
    """Whether the rectangle is on a wall, or off the map, at one of the poses: looked up every eighth of a cell of it.

    Parameters
    ----------
    blocked : bool (height, width), rows downwards.
    poses : float64 (n, 3): x, y (y up) and yaw of its middle.
    """
    occupied = np.pad(blocked[::-1], 1, constant_values=True)
    sides = [np.linspace(-side / 2, side / 2, 1 + math.ceil(side / cell * 8)) for side in (LENGTH, WIDTH)]
    xs, ys = (part.ravel() for part in np.meshgrid(*sides))
    high, wide = blocked.shape
    for x, y, yaw in poses:
        cos, sin = math.cos(yaw), math.sin(yaw)
        columns = np.floor((x + cos * xs - sin * ys) / cell).astype(int).clip(-1, wide)
        rows = np.floor((y + sin * xs + cos * ys) / cell).astype(int).clip(-1, high)
        if occupied[rows + 1, columns + 1].any():
            return True
    return False


class Ompl:
    """A planner of OMPL in the space of Reeds-Shepp curves, its check a lookup in the map of free poses.

    Parameters
    ----------
    seconds : its limit; of processor time if ``of_processor``, else of wall time.
    """

    def __init__(
        self, planner: str, blocked: np.ndarray, cell: float, seconds: float, *, of_processor: bool = False
    ) -> None:
        from ompl import base, geometric, util

        util.noOutputHandler()
        self._geometric = geometric
        self._planner, self._seconds = planner, seconds
        self._space = base.ReedsSheppStateSpace(RADIUS)
        bounds = base.RealVectorBounds(2)
        high, wide = blocked.shape
        for axis, end in enumerate((wide * cell, high * cell)):
            bounds.setLow(axis, 0.0)
            bounds.setHigh(axis, end - 1e-9)
        self._space.setBounds(bounds)
        free, scale, step = free_poses(blocked, cell).tolist(), 1 / cell, BINS / (2 * math.pi)

        def is_free(state: Any) -> bool:
            x, y, k = (
                int(state.getX() * scale),
                int(state.getY() * scale),
                round(state.getYaw() * step) % BINS,
            )
            return 0 <= x < wide and 0 <= y < high and free[k][y][x]

        self._is_free = is_free
        self._blocked, self._cell, self._of_processor = blocked, cell, of_processor

    def __call__(self, start: Pose, goal: Pose) -> Judged:
        setup = self._geometric.SimpleSetup(self._space)
        setup.setStateValidityChecker(self._is_free)
        ends = []
        for pose in (start, goal):
            state = self._space.allocState()
            state.setXY(pose[0], pose[1])
            state.setYaw(math.remainder(pose[2], 2 * math.pi))
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        setup.getSpaceInformation().setStateValidityCheckingResolution(0.05 / self._space.getMaximumExtent())
        setup.setPlanner(getattr(self._geometric, self._planner)(setup.getSpaceInformation()))
        begin = time.thread_time_ns()
        solve_within(setup, self._seconds, of_processor=self._of_processor)
        spent = (time.thread_time_ns() - begin) / 1e9
        if not setup.haveExactSolutionPath():
            return Judged(max(spent, self._seconds), None)
        path = setup.getSolutionPath()
        length = float(path.length())
        path.interpolate(2 + math.ceil(length / self._cell * CLOSE))
        poses = np.array([(one.getX(), one.getY(), one.getYaw()) for one in path.getStates()])
        straight = math.dist(start[:2], goal[:2])
        clear = length > straight - 1e-6 and not touches(self._blocked, self._cell, poses)
        return Judged(spent, length, free=clear)


def solve_within(setup: Any, seconds: float, *, of_processor: bool) -> None:
    """Have OMPL solve within seconds of processor time of this thread, or of wall time.

    Processor time ends at :data:`SLOWEST` times as long by the clock, too: OMPL sleeps while it waits for an end that is
    free, and takes no processor time.
    """
    if not of_processor:
        setup.solve(seconds)
        return
    from ompl import base

    end, last = time.thread_time() + seconds, time.monotonic() + SLOWEST * seconds
    setup.solve(
        base.PlannerTerminationCondition(lambda: time.thread_time() >= end or time.monotonic() >= last)
    )


class Pathplanning:
    """Hybrid A* of pathplanning, with its own tolerance at the goal and our price of driving in reverse."""

    def __init__(self, blocked: np.ndarray, cell: float, seconds: float) -> None:
        import pathplanning
        from pathplanning.spaces import AckermannGridSpace

        self._module, self._seconds = pathplanning, seconds
        self._space = AckermannGridSpace(
            np.ascontiguousarray(blocked[::-1]), resolution=cell, wheelbase=WHEELBASE,
            max_steering_angle=math.atan(WHEELBASE / RADIUS), footprint_length=LENGTH, footprint_width=WIDTH,
        )  # fmt: skip

    def __call__(self, start: Pose, goal: Pose) -> Taken:
        from pathplanning.core import ContinuousProblem, GoalState

        settings = self._module.HybridAStarParams(
            max_expansions=100_000_000, time_budget_s=self._seconds, xy_resolution=0.25, heuristic_weight=1.5,
            goal_xy_tolerance=TOLERANCE, goal_yaw_tolerance=YAW_TOLERANCE,
        )  # fmt: skip
        problem = ContinuousProblem(self._space, np.array(start), GoalState(np.array(goal)))
        begin = time.thread_time_ns()
        try:
            found = self._module.plan_continuous(problem, planner="hybrid_astar", params=settings)
        except (
            RuntimeError
        ):  # poses between walls that others can leave: "start pose is invalid or its footprint collides"
            return Taken(self._seconds, None)
        spent = (time.thread_time_ns() - begin) / 1e9
        if not found.success:
            return Taken(max(spent, self._seconds), None)
        return Taken(spent, length_of(np.asarray(found.path)))
