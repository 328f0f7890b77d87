"""A first path for trees of poses: that of the lattice, joined to the poses that are asked for."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from lampyris.model.path import Pose
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice_planner import LatticePlanner, LatticeSession
from lampyris.planning.lattice.search import LatticeSearch
from lampyris.planning.lattice.shortcut import ShortcutShape, joined
from lampyris.planning.sampling.pose_trees import CellPose, PoseTask
from lampyris.typing import Cell, Floats


class LatticeSeed:
    """Finds paths in the lattice on the map that a session of trees has.

    Parameters
    ----------
    planner : the lattice planner, with the prices of the trees.
    """

    def __init__(self, planner: LatticePlanner) -> None:
        self._planner = planner
        self._known: tuple[LatticeSession, LatticeSearch] | None = None

    def forget(self) -> None:
        """Let go of the map."""
        self._known = None

    def take(self, scene: Scene, obstacles: Iterable[Cell]) -> None:
        """Take in a map, with obstacles."""
        session = LatticeSession(self._planner, scene)
        self._known = session, session.search_among(obstacles)

    def path(
        self, task: PoseTask, robot: ShortcutShape, cell: Cell, pose: Pose | None, limit: int | None
    ) -> tuple[tuple[CellPose, Floats] | None, int]:
        """The first pose and the segments of a path between poses of the task, None if the lattice has none; and the expansions.

        Parameters
        ----------
        robot : prices of segments.
        cell, pose : where the robot is; no pose: any yaw will do.
        limit : expansions at most.
        """
        if self._known is None:
            return None, 0
        session, search = self._known
        session.stand(cell, pose)
        found, expansions = session.found_segments(search, limit)
        if found is None:
            return None, expansions
        first, segments = found
        end = first[2] + float(segments[:, 1].sum())
        start, goal = _like(first[2], task.starts), _like(end, task.goals)
        path = joined(np.array(start), np.array(first), segments, np.array(goal), robot, task.hybrid_map)
        return None if path is None else (start, path), expansions


def _like(yaw: float, poses: tuple[CellPose, ...]) -> CellPose:
    """Of poses at one place that with the yaw nearest to one, its yaw written as near to it as whole turns allow."""
    x, y, turned = min(poses, key=lambda pose: abs(math.remainder(pose[2] - yaw, 2 * math.pi)))
    return x, y, yaw + math.remainder(turned - yaw, 2 * math.pi)
