"""The replanner of a robot with a heading: begins new paths at poses of the planner, and joins them to the present one.

Some planners begin a path at any pose (``begins_anywhere``), and are asked for one from where the robot stands. Others begin
at one of their own states, the centre of a cell with one of 16 headings: a robot that has stopped between two of them
reaches one along the path that it is on, the next one ahead, or the last one behind, backing up. So does a robot that stands
where no curve to the states around it is free. Both parts are of a path whose walls have been checked, and the robot follows
them exactly.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lampyris.model.change import Change
from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.path import Pose
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import disc
from lampyris.model.scene import Scene
from lampyris.motion.geometry.pose_curve import (
    CENTRE,
    backwards,
    curve_of_poses,
    joined,
    part_of,
    pose_at,
    standing_at,
)
from lampyris.planning.base import Planner
from lampyris.planning.lattice.settings import LatticeSettings
from lampyris.sim.continuous.leg import Ceiling, Leg, comfort, leg_of, squares_near
from lampyris.sim.continuous.replanner import Replanner
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.typing import Cell, Floats


def outlined(scene: Scene) -> Scene:
    """The scene as speed laws are to see it on a curve of poses, which has the robot's outline: its radius is 0."""
    return replace(scene, robot=disc(scene.robot, 0.0))


def for_steering(planner: Planner) -> Planner:
    """The planner whose path a controller that steers follows: a lattice without shortcuts.

    Shortcuts pass close to the corners of walls in arcs of the least radius; a controller that cuts bends is stopped there.
    """
    if not isinstance(planner, LatticeSettings) or not getattr(planner, "shortcut", False):
        return planner
    plain: Planner = replace(planner, shortcut=False)  # type: ignore[call-arg]
    return plain


_BESIDE = 0.75
"""Cells: the middle of a square is at most so far from any place in it, and a little farther."""

_HERE = 1e-9
"""Metres along the path within which a robot is at a state."""

_ASIDE = (1.0, 2.0, 4.0)
"""Cells along the path, ahead and back, of poses where a path is asked for if none begins where the robot stands."""


_CLOSE = 500
"""Expansions up to which a search without a path has seen the surroundings of the robot alone."""


def _is_final(plan: Plan) -> bool:
    """Whether there will be no path from a pose a little farther on, either.

    There may be one where the robot cannot stand, or where a search has ended close around it: the states that it begins at are
    few, and from another pose there are others. A search that expands nothing knows from its heuristic that there is no way.
    """
    return not plan and plan.status is not Status.START_OCCUPIED and not 0 < plan.expansions <= _CLOSE


class PoseReplanner(Replanner):
    """A session of a planner of poses with what it has cost; see :class:`Replanner`."""

    def first(self, message: ObstacleMessage) -> Plan:
        """The first plan, with the obstacles where they are."""
        return self._ask_from(None, squares_near(self.scene, message))

    def _start(self) -> Change:
        return Change()

    def leg(self, curve: Curve, ceiling: Ceiling) -> Leg:
        """The path with its ceiling of speeds; room is that of the footprint."""
        return leg_of(curve, outlined(self.scene), ceiling, self.spacing)

    def curve(
        self, plan: Plan, xy: tuple[float, float], message: ObstacleMessage | None, more: Floats | None = None
    ) -> Curve | None:
        """The path of a plan."""
        assert plan.pose_path is not None
        return curve_of_poses(plan.pose_path, self.scene.grid, self.scene.robot)

    def nowhere(self, ceiling: Ceiling, verdict: Plan | None = None) -> Leg:
        """Standing at the first pose that the planner would drive, or else on the start."""
        grid, scene = self.scene.grid, self.scene
        pose = scene.start_pose
        if verdict is not None and verdict.pose_path is not None:
            x, y, yaw = verdict.pose_path.poses[0].tolist()
            pose = (x, y, yaw)
        if pose is None:
            x, y = grid.to_metres(scene.start).tolist()
            pose = (x, y, grid.origin[2])
        return self.leg(standing_at(pose, grid, scene.robot), ceiling)

    def again(
        self, leg: Leg, s: float, message: ObstacleMessage | None, reaction: float
    ) -> tuple[Plan, Curve | None]:
        """A plan from a state that the robot can reach, and the path there and on; None if there is none.

        The obstacles are kept as far away as in :meth:`Replanner.again`.
        """
        self.replans += 1
        route = leg.route
        assert isinstance(route, PoseLookup)
        wide = comfort(self.scene, message, route.at(s), reaction)
        joins = self._joins(route, s, message)
        plan: Plan | None = None
        for more in (wide, 0.5 * wide, None) if wide is not None else (None,):
            shut = squares_near(self.scene, message, more)
            for at, lead in joins:
                pose = pose_at(route.poses, at, self.scene.grid)
                plan = self._ask_from(pose, shut - self._beneath(route, at, shut), lead)
                if plan and plan.pose_path is not None and self._same(pose, plan.pose_path.poses[0]):
                    curve = curve_of_poses(plan.pose_path, self.scene.grid, self.scene.robot)
                    return plan, curve if lead is None else joined(lead, curve)
                if self._begins_anywhere and _is_final(plan):
                    break
        if plan is None:
            plan = self._ask_from(pose_at(route.poses, s, self.scene.grid), squares_near(self.scene, message))
        return plan, None

    def from_pose(
        self, pose: Pose, xy: tuple[float, float], message: ObstacleMessage | None, reaction: float
    ) -> tuple[Plan, Curve | None]:
        """A plan from the state nearest to a pose of the map frame, and its path, for a robot that steers there itself.

        Parameters
        ----------
        xy : the same place, cells.
        """
        self.replans += 1
        wide = comfort(self.scene, message, xy, reaction)
        here = PoseLookup(standing_at(pose, self.scene.grid, self.scene.robot))
        plan: Plan | None = None
        for more in (wide, 0.5 * wide, None) if wide is not None else (None,):
            shut = squares_near(self.scene, message, more)
            plan = self._ask_from(pose, shut - self._beneath(here, 0.0, shut))
            if plan and plan.pose_path is not None:
                return plan, curve_of_poses(plan.pose_path, self.scene.grid, self.scene.robot)
        assert plan is not None
        return plan, None

    def _joins(
        self, route: PoseLookup, s: float, message: ObstacleMessage | None
    ) -> list[tuple[float, PoseCurve | None]]:
        """Distances at which a new path may begin, and the path there from ``s``; None: the robot is there."""
        curve, states = route.poses, route.poses.states
        if self._begins_anywhere:
            steps = np.array(_ASIDE) * curve.resolution
            near = [one for step in steps.tolist() for one in (s + step, s - step)]
            near += [*states[states > s][:1].tolist(), *states[states < s][-1:].tolist()]
            near = [at for at in near if 0.0 <= at <= curve.length and abs(at - s) > _HERE]
            return [(s, None), *self._along(route, s, near, message)]
        here = states[np.abs(states - s) <= _HERE]
        if len(here) or not len(states):
            return [(float(here[0]) if len(here) else s, None)]
        near = [*states[states > s][:1].tolist(), *states[states < s][-1:].tolist()]
        return self._along(route, s, near, message)

    @property
    def _begins_anywhere(self) -> bool:
        """Whether the planner begins a path at exactly the pose that it is asked for."""
        asked = getattr(self.planner, "begins_anywhere", None)
        return asked is not None and bool(asked(self.scene))

    def _along(
        self, route: PoseLookup, s: float, near: list[float], message: ObstacleMessage | None
    ) -> list[tuple[float, PoseCurve | None]]:
        """Of the distances near ``s`` those that the robot can reach along the path, and the path there."""
        curve = route.poses
        found: list[tuple[float, PoseCurve | None]] = []
        for at in near:
            if at > s:
                found.append((at, part_of(curve, s, at)))
            elif self._may_back(curve, at, s):
                found.append((at, backwards(part_of(curve, at, s))))
        return [(at, lead) for at, lead in found if self._clear(route, s, at, message)]

    def _may_back(self, curve: PoseCurve, low: float, high: float) -> bool:
        """Whether the planner drives in reverse, or the robot would not."""
        if getattr(self.planner, "reverse", True):
            return True
        return bool((part_of(curve, low, high).gears < 1).all())

    def _clear(self, route: PoseLookup, s: float, at: float, message: ObstacleMessage | None) -> bool:
        """Whether no obstacle that stands as reported is on the path between."""
        if message is None or not len(message.xy) or not np.isfinite(message.xy).all():
            return True
        gaps = route.least_gaps(min(s, at), max(s, at), message.xy) - message.radius
        now = route.gaps(s, message.xy) - message.radius
        return bool((gaps > np.minimum(0.0, now - 1e-6)).all())

    def _beneath(self, route: PoseLookup, at: float, cells: frozenset[Cell]) -> frozenset[Cell]:
        """Those squares that the footprint at a state may touch: it stands there, and must be able to leave."""
        listed = sorted(cells)
        if not listed:
            return cells
        gaps = route.gaps(at, np.array(listed, dtype=np.float64)) / self.scene.grid.resolution
        return frozenset(cell for cell, gap in zip(listed, gaps.tolist(), strict=True) if gap <= _BESIDE)

    def _same(self, pose: Pose, begin: Floats) -> bool:
        """Whether a path begins at a pose."""
        away = np.abs(begin[:2] - pose[:2]).max() / self.scene.grid.resolution
        return bool(away < CENTRE) and abs(math.remainder(float(begin[2]) - pose[2], 2 * math.pi)) < CENTRE

    def _ask_from(self, pose: Pose | None, shut: frozenset[Cell], lead: PoseCurve | None = None) -> Plan:
        """A plan from a pose; None: from the scene's start.

        Parameters
        ----------
        lead : what the robot drives before it is there.
        """
        return self._answer(Change(pose=pose, obstacles=shut, blocked=self._news()))
