"""Pursuit: a goal that moves by a track, and what the planner is given of it.

At the beginning of tick t the goal moves to its cell of that tick; the robot has caught it when both are in one cell at the
end of a tick, or when the goal comes to the robot's cell. The goal is no obstacle: it meets nobody but the robot.

Planners that see traffic know the whole track (:attr:`lampyris.Change.goal_track`), but for ``tracks=hidden``; all others
are asked again whenever it has moved, by a new session that knows the map as it is known and the goal's present cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lampyris.errors import SceneError, SettingError
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.planning.base import Planner
from lampyris.planning.field.layers import free_space
from lampyris.typing import Cell

MOVED = "The goal has moved; replanned."


class GoalPursuit:
    """A goal with a track.

    Parameters
    ----------
    scene : as it is; its goal is where the track begins.
    track : the goal's cell at each tick from 0; after the last it stays.
    planner : who pursues it.

    Attributes
    ----------
    cells : the track.
    known : whether the planner knows the track.

    Raises
    ------
    SettingError : no track; ``GOAL_EDITS``: the scene has edits; ``OBSTACLE_SPEED``: farther than to a neighbour in a tick.
    SceneError : ``GOAL_TRACK``: a cell off the map or where the robot cannot be; a track that does not begin at the scene's
        goal.
    """

    def __init__(self, scene: Scene, track: Recorded | Sequence[Any], planner: Planner) -> None:
        if scene.edits:
            raise SettingError.of(
                "GOAL_EDITS", "goal_track", "walls that come and go during the run", where="scene.edits",
                allowed="a goal that moves, or edits after tick 0; not both",
            )  # fmt: skip
        self.cells = checked_track(scene, track)
        self.known = planner.traits.sees_traffic and getattr(planner, "tracks", "known") != "hidden"

    def at(self, tick: int) -> Cell:
        """The goal's cell at a tick."""
        return self.cells[min(tick, len(self.cells) - 1)]

    def ahead(self, tick: int) -> tuple[Cell, ...]:
        """The goal's cells from a tick on, the last where it stays."""
        return self.cells[min(tick, len(self.cells) - 1) :]


def checked_track(scene: Scene, track: Recorded | Sequence[Any]) -> tuple[Cell, ...]:
    """A goal's cells from tick 0 on.

    Raises
    ------
    SettingError, SceneError : as :class:`GoalPursuit`.
    """
    cells = (track if isinstance(track, Recorded) else Recorded(tuple(track))).track
    if cells[0] != scene.goal:
        raise SceneError(
            "GOAL_TRACK",
            f"the track begins at {cells[0]}",
            where="goal_track",
            allowed=f"the goal, {scene.goal}",
        )
    free = free_space(scene)
    for k, (x, y) in enumerate(cells):
        if not scene.grid.contains((x, y)) or not free[y, x]:
            what, may = f"cell {(x, y)} at tick {k}", "cells of the map on which the robot can stand"
            raise SceneError("GOAL_TRACK", what, where="goal_track", allowed=may)
    return cells
