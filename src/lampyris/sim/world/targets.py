"""Targets: via points that a robot passes one after the other, and which of them is next."""

from __future__ import annotations

from dataclasses import replace

from lampyris.errors import SettingError, UsageError
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.planning.field.layers import free_space
from lampyris.planning.through import not_free, visiting_order
from lampyris.typing import Cell

REACHED = "A via point was reached; planned on to the next."


class Targets:
    """The targets of a run: the via points in the order of visits, then the goal.

    Parameters
    ----------
    scene : with its via points and goal, as it is known at the beginning; the best order is chosen by it.
    planner : who plans from each to the next.
    goal_moves : whether the goal moves.

    Attributes
    ----------
    via : the via points in the order of visits.
    times : when each was reached, as far as they have been.

    Raises
    ------
    UsageError : ``VIA``: a planner of poses. SettingError : ``VIA``: a goal that moves.
    """

    def __init__(self, scene: Scene, planner: Planner, goal_moves: bool = False) -> None:
        self.via: tuple[Cell, ...] = ()
        self.times: list[float] = []
        self._goal = scene.goal
        if not scene.via:
            return
        if planner.traits.plans_headings:
            raise UsageError(
                "VIA", f"{planner.name} plans poses and takes no via points", where="planner",
                allowed="a planner of paths of cells",
            )  # fmt: skip
        if goal_moves:
            raise SettingError.of(
                "VIA", "via", "via points and a goal that moves", where="scene.via", allowed="one of them"
            )
        self.via = visiting_order(scene)

    @property
    def target(self) -> Cell:
        """Where the robot is to drive next."""
        return self._goal if self.done else self.via[len(self.times)]

    @property
    def done(self) -> bool:
        """Whether all via points have been reached."""
        return len(self.times) == len(self.via)

    def sentence_of(self, plan: Plan) -> str:
        """What a plan to the target that is next says; where that is a via point it is named as one."""
        if self.done or plan.status is not Status.GOAL_OCCUPIED:
            return plan.sentence
        return not_free(self.target)

    def is_walled(self, known: Scene) -> bool:
        """Whether the target that is next is a via point on which walls that are known leave the robot no room."""
        if self.done:
            return False
        x, y = self.target
        return not free_space(known)[y, x]

    def reach(self, cell: Cell, time: float) -> bool:
        """Note that the robot is on a cell; whether it is the via point that was next."""
        before = len(self.times)
        while not self.done and self.target == cell:
            self.times.append(time)
        return len(self.times) > before


def aimed(scene: Scene, target: Cell) -> Scene:
    """The scene as a planner is given it that plans to a target alone."""
    return replace(scene, goal=target, via=()) if scene.via or target != scene.goal else scene
