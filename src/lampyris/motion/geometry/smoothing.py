"""From a path to the curve that is driven: by how much it may leave the path, and with how much room."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core.defaults import Smooth
from lampyris.errors import SettingError
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot, disc
from lampyris.motion.geometry.arc_sampling import circled
from lampyris.motion.geometry.curve import curve_of
from lampyris.motion.geometry.string_pulling import distinct, lines_of
from lampyris.typing import Points

_SAME = 1e-9
"""Squared cells: what is forgiven to a clearance."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a curve keeps of what its path was planned for.

    Parameters
    ----------
    room : metres, >= 0, to the walls beyond the robot's radius; less only where the path itself has less.
    shaped : whether the path leads where it is better, not where it is shorter: nothing is drawn straight.
    reach : metres, >= 0: so near to the path, walls made it what it is.
    """

    room: float = 0.0
    shaped: bool = False
    reach: float = 0.0


def shaping(plan: Plan) -> tuple[str, ...]:
    """The attributes of a plan that shaped its path, so that it is not drawn straight."""
    return tuple(
        name
        for name in ("obstacle_density_weight", "traffic_density_weight")
        if plan.attributes.get(name, 0.0) > 0.0
    )


def rounded_alone(plan: Plan) -> str:
    """Why a plan's path is not drawn straight; empty where it is."""
    names = shaping(plan)
    return (
        f"the path was planned with {' and '.join(names)}, so only its corners are rounded" if names else ""
    )


def wanted_of(plan: Plan, resolution: float) -> Wanted:
    """What a plan's attributes ask of the curve that is made of its path."""
    asked = plan.attributes
    if not asked:
        return Wanted()
    shaped = bool(shaping(plan))
    reach = resolution * asked.get("window", 0.0) if shaped else 0.0
    return Wanted(resolution * asked.get("min_clearance", 0.0), shaped, reach)


def drawn(
    points: ArrayLike, grid: Grid, robot: Robot, smooth: Smooth, wanted: Wanted | None = None
) -> tuple[Curve, Points]:
    """A path as a curve, and the polyline that the curve was made of; nothing else promises its clearance.

    That is the path itself, save for ``arcs`` where it is sampled from circles: there it has the corners of
    :func:`lampyris.motion.geometry.arc_sampling.circled`. They are no nearer to a wall than the robot may be, or than the
    path comes anywhere; or else they are not used.

    ``smooth`` : see :data:`lampyris._core.defaults.SMOOTHING`.
    ``wanted`` : what a plan asks of it; None: points given by the user.

    Raises
    ------
    SettingError : see :func:`lampyris.motion.geometry.curve.curve_of`.
    """
    given = np.asarray(points, dtype=np.float64)
    if smooth == "straight":
        return smooth_curve(given, grid, robot, wanted=wanted), given
    if smooth == "none":
        return curve_of(given, grid, robot, smooth="none", shortcut=False), given
    if wanted is not None and (wanted.shaped or wanted.room > 0.0):
        return smooth_curve(given, grid, robot, wanted=replace(wanted, shaped=True)), given
    bent = _bent(given, grid, robot)
    return (curve_of(given, grid, robot, shortcut=False), given) if bent is None else bent


def _bent(given: Points, grid: Grid, robot: Robot) -> tuple[Curve, Points] | None:
    """The curve of a path that is sampled from circles; None: it is not, or they would not fit in."""
    if given.ndim != 2 or given.shape[1:] != (2,) or len(given) < 4 or not np.isfinite(given).all():
        return None
    xy, tangent = circled(given[distinct(given)])
    if not np.isfinite(tangent).any():
        return None
    reach = robot.radius / grid.resolution
    try:
        need = lines_of(xy, grid, reach).need
        curve = curve_of(xy, grid, robot, shortcut=False, tangent=tangent)
    except SettingError:
        return None
    try:
        own = lines_of(given, grid, reach).need
    except SettingError:
        return curve, xy  # chords cut a corner that the circle goes round
    return (curve, xy) if need.min() >= own.min() - _SAME else None


def smooth_curve(points: Points, grid: Grid, robot: Robot, *, wanted: Wanted | None = None) -> Curve:
    """A string-pulled curve that leaves the robot room to stop beside walls, where the polyline does.

    It is drawn for a robot that is larger by ``v_max^2 / (2 d_max)``, at most a cell: beyond that no wall
    slows it down (:func:`lampyris.motion.caps.clearance`). Drawn for the robot itself it is pulled straight, leads along
    the very corners, and is crept there. Measured on the 30 queries of env-1 to env-6 (robot of 0.4 cells,
    nodes a tenth of a cell apart): paths 0.7 % longer, drives by our law 6 % quicker. Where the larger one
    would have to stop and turn more often, it is drawn for the robot itself, and what is ``wanted``.
    """
    wanted = Wanted() if wanted is None else wanted
    margin = min(0.5 * robot.v_max * robot.v_max / robot.d_max, grid.resolution)
    margin = max(margin, wanted.room, wanted.reach)
    pulled = not wanted.shaped
    wide = curve_of(points, grid, disc(robot, robot.radius + margin), shortcut=pulled)
    if len(wide.stops) == 0:
        return wide
    narrow = curve_of(points, grid, disc(robot, robot.radius + wanted.room), shortcut=pulled)
    return wide if len(wide.stops) <= len(narrow.stops) else narrow
