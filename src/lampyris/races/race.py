"""Races: several planners in one scene, with what each looked at on its way to its path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import median
from typing import Any, Final

import numpy as np

from lampyris import api
from lampyris.errors import LimitError
from lampyris.kernels._jit import compiled_only
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.model.profile import Profile
from lampyris.model.race.race import MOST_RACERS, Race, Racer
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.planning.exploration import exploration
from lampyris.typing import Floats

MOST_CALLS: Final = 9
"""Planning calls that are timed, at most."""
TIMED_S: Final = 0.3
"""Seconds of planning after which no further call is timed."""


def racer(
    label: str,
    scene: Scene,
    planner: Planner,
    law: Any,
    seed: int,
    *,
    look: Callable[[], None] = lambda: None,
) -> tuple[Racer, Profile | None]:
    """One planner's part of a race, and its speeds.

    It plans once for nobody, so that no time contains loading or compiling, and then until :data:`TIMED_S` seconds are
    used; the median counts.

    Raises
    ------
    LampyrisError : as :func:`lampyris.plan`.
    """
    times: list[float] = []
    with compiled_only():
        plan = api.plan(scene, planner, seed=seed, record=True)
        look()
        while len(times) < MOST_CALLS and (not times or sum(times) < TIMED_S):
            times.append(float(api.plan(scene, planner, seed=seed, record=False).timing["plan_s"]))
            look()
    profile = api.speed_profile(scene, plan, law) if plan.path is not None else None
    nodes, at = np.zeros((0, 2)), np.zeros(0)
    if profile is not None and plan.path is not None:
        nodes = np.asarray(plan.path.cells if profile.xy is None else profile.xy, dtype=np.float64)
        at = profile.t
    looked = exploration(planner, scene, plan)
    return Racer(
        label,
        plan,
        looked,
        median(times),
        nodes,
        at,
        0.0 if profile is None else profile.mean,
        scene.grid.resolution,
        np.zeros(0) if plan.pose_path is None else _headings(nodes, plan.pose_path, scene.grid),
    ), profile


def _headings(nodes: Floats, path: PosePath, grid: Grid) -> Floats:
    """The heading at each node, radians counterclockwise from the rows: the pose as far along the path as the node."""
    places = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
    along, of_poses = _along(nodes), _along(places)
    yaws = np.unwrap(path.poses[:, 2] - grid.origin[2])
    scale = of_poses[-1] / along[-1] if len(along) and along[-1] > 0 else 1.0
    found: Floats = np.interp(along * scale, of_poses, yaws)
    return found


def _along(points: Floats) -> Floats:
    """Distance along a line of points at each of them, in the unit of the points."""
    steps = np.diff(points, axis=0)
    lengths: Floats = np.sqrt(steps[:, 0] ** 2 + steps[:, 1] ** 2)
    return np.concatenate((np.zeros(min(len(points), 1)), np.cumsum(lengths)))


def race(
    scene: Scene,
    planners: Sequence[tuple[str, Planner]],
    law: Any,
    *,
    seed: int = 0,
    look: Callable[[], None] = lambda: None,
) -> Race:
    """Planners with their labels, one after another in the same scene.

    Raises
    ------
    LimitError : RACERS: more than :data:`MOST_RACERS`.
    LampyrisError : as :func:`lampyris.plan`.
    """
    check_racers(len(planners))
    made = [racer(label, scene, planner, law, seed, look=look) for label, planner in planners]
    seconds = all(profile is None or profile.units.startswith("m/s") for _, profile in made)
    return Race(scene, tuple(one for one, _ in made), seconds)


def check_racers(many: int) -> None:
    """Refuse a race of nobody, or of more than :data:`MOST_RACERS`."""
    if not 1 <= many <= MOST_RACERS:
        raise LimitError(
            "RACERS", f"{many}", where="planners", allowed=f"1 to {MOST_RACERS} planners in a race"
        )
