"""Verification of plans of poses, and what drives with a heading are judged by.

Prices and tolerances come from the settings of the job, never from the worker. A path is judged by the referee, its speeds
are worked out again, and its lower bound is compared with what can be proven without a search.

What cannot be seen: of a planner on a lattice, a lower bound between cost / weight and cost, and a ``no-path`` of a robot
that does not turn in place or has no wide way to the goal.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lampyris import api, referee
from lampyris.model.plan import Plan, Status
from lampyris.model.profile import Profile
from lampyris.model.robot import disc
from lampyris.model.scene import Scene
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.planning.base import Planner
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.solve import solve
from lampyris.referee.caps import footprint_room
from lampyris.referee.profile import wall_distance_of_points
from lampyris.report.data.measures import PoseRoom
from lampyris.study.execution.pose_evidence import pose_plan_of
from lampyris.study.execution.rejected import demand, refuse
from lampyris.study.execution.site import Place
from lampyris.typing import Floats

BESIDE = 1.5
"""Cells by which the pose at which a planner begins or ends may miss the one that was asked for."""
WIDER = 1.0
"""Cells that a disc around the robot is wider, where it shows that a robot that turns in place has a path."""
ROUNDING = 1e-9
"""Share by which numbers that are worked out a second time may differ."""
BOUNDED = 1e-6
"""The same of a bound: planners count in whole units."""
UNITS = 1e-5
"""Cells by which a cost may miss its bound for the same reason."""


def judged_by(planner: Planner, resolution: float) -> Mapping[str, float]:
    """Attributes by which the poses of a planner are judged: as the planner states them, or its settings of those names."""
    own = getattr(planner, "judged_by", None)
    if own is not None:
        found: Mapping[str, float] = own(resolution)
        return found
    names = (
        "goal_tolerance",
        "goal_yaw_tolerance",
        "reverse_cost",
        "turn_cost",
        "switch_cost",
        "cost_penalty",
    )
    return {name: float(getattr(planner, name)) for name in names if hasattr(planner, name)}


def verified_plan(
    plain: Mapping[str, Any], evidence: Any, place: Place, scene: Scene
) -> tuple[Plan, Profile | None]:
    """The plan of poses of a job and its speeds, on a scene of one's own.

    Parameters
    ----------
    scene : the place's, with the tracks that the planner was given.

    Raises
    ------
    RejectedResult, LampyrisError, ArithmeticError, LookupError, TypeError, ValueError : they do not stand.
    """
    planner = _planner(plain)
    plan, profile = pose_plan_of(evidence, scene, planner.name, judged_by(planner, scene.grid.resolution))
    if (plan.path is None) != (profile is None):
        refuse("a path without speeds, or speeds without a path")
    if plan.pose_path is None:
        _without_path(plan, place, planner, plain)
        if plan.status is Status.HEMMED_IN and not scene.traffic:
            refuse("hemmed-in, where the planner was given no moving obstacle")
        return plan, None
    if (plan.pose_path.times is not None) != planner.traits.sees_traffic:
        refuse("times of a planner that plans none, or none of one that does")
    demand(referee.check_plan(plan, scene))
    _bound(plan, scene, planner)
    assert profile is not None
    law = laws.with_settings(plain["law"]["name"], plain["law"]["settings"])
    ours = api.speed_profile(scene, plan, law)
    if (profile.law, profile.units, profile.cause) != (ours.law, ours.units, ours.cause):
        refuse(f"speeds of the law {profile.law!r} in {profile.units!r}, or for other causes")
    for name in ("s", "v", "a", "t", "xy"):
        if not _same(getattr(profile, name), getattr(ours, name)):
            refuse(f"speeds whose {name} is not that of the law on these poses")
    return plan, ours


def goal_tolerance(plain: Mapping[str, Any], scene: Scene) -> tuple[float, float]:
    """Metres and radians from the goal within which the planner of a job may end."""
    attributes = judged_by(_planner(plain), scene.grid.resolution)
    return attributes.get("goal_tolerance", 0.0), attributes.get("goal_yaw_tolerance", 0.0)


def _planner(plain: Mapping[str, Any]) -> Planner:
    return registry.make(plain["planner"]["name"], plain["planner"]["settings"])


def _same(claimed: Floats | None, ours: Floats | None) -> bool:
    if claimed is None or ours is None:
        return claimed is ours
    return claimed.shape == ours.shape and np.allclose(claimed, ours, rtol=ROUNDING, atol=ROUNDING)


def _bound(plan: Plan, scene: Scene, planner: Planner) -> None:
    """Refuse a lower bound that is more than is proven, and a bound that the planner would not have left."""
    path = plan.pose_path
    assert path is not None
    proven, promised = getattr(planner, "proven_bound", None), getattr(planner, "promised_bound", None)
    if proven is not None and path.lower_bound_m > proven(scene) * (1 + ROUNDING) + ROUNDING:
        refuse(f"a lower bound of {path.lower_bound_m!r} m; {proven(scene)!r} m is proven")
    most = (
        0.0
        if promised is None
        else promised * path.lower_bound_m * (1 + BOUNDED) + UNITS * scene.grid.resolution
    )
    if promised is not None and path.cost_m > most:
        refuse(f"a bound of {path.bound!r}; the planner keeps to {promised!r}")


def _without_path(plan: Plan, place: Place, planner: Planner, plain: Mapping[str, Any]) -> None:
    """Refuse a verdict that is wrong as far as discs and budgets can tell."""
    if plan.status is Status.FOUND:
        refuse("found without a path")
    if plan.status is Status.CANCELLED:
        refuse("cancelled; nobody cancels a run of a study")
    if plan.status is Status.LIMIT and plain["budget"]["expansions"] is None:
        refuse("limit without a budget of expansions")
    scene = place.scene
    robot, cell = scene.robot, scene.grid.resolution
    for status, (x, y) in ((Status.START_OCCUPIED, scene.start), (Status.GOAL_OCCUPIED, scene.goal)):
        if plan.status is status and place.clearance[y, x] > robot.radius + BESIDE * cell:
            refuse(f"{status.value}; the circle around the robot is clear of walls at ({x}, {y})")
    if plan.status is not Status.NO_PATH:
        return
    if getattr(planner, "finds_disc_paths", False) and robot.drive != "ackermann" and _disc_path(scene):
        refuse("no-path; there is one for a disc wider than the robot, which turns in place")


def _disc_path(scene: Scene) -> bool:
    """Whether a disc that is a cell wider than the circle around the robot gets from the start to the goal."""
    wide = Scene(
        scene.grid, scene.start, scene.goal, "octile",
        disc(scene.robot, scene.robot.radius + WIDER * scene.grid.resolution),
    )  # fmt: skip
    free = free_space(wide)
    if not all(free[y, x] for x, y in (wide.start, wide.goal)):
        return False
    x, y = wide.start
    return bool(solve(free, moves_for(wide), wide.goal).exact[y, x] >= 0)


def room_of(scene: Scene) -> PoseRoom:
    """Metres from the robot to the nearest wall at poses of the map frame; see :data:`PoseRoom`."""
    grid, robot = scene.grid, scene.robot
    far = float(grid.width + grid.height) * grid.resolution

    def room(poses: Floats) -> Floats:
        points = grid.frame.to_points(poses[:, 0], poses[:, 1])
        if robot.footprint is None:
            return wall_distance_of_points(grid, points, far) - robot.radius
        yaws = poses[:, 2] - grid.origin[2]
        return footprint_room(yaws, points, scene, np.full(len(poses), far))

    return room
