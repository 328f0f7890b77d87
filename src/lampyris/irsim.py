"""IR-SIM (``pip install ir-sim``): its maps as grids, and our planners in the shape of its own.

Nothing of IR-SIM is imported: what its planners are given is taken by its attributes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris import api
from lampyris._core.scalars import in_range, is_real
from lampyris.errors import SettingError, shown
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.typing import BoolGrid, Floats

OCCUPIED = 50.0
"""Occupancy, 0 to 100, above which IR-SIM takes a cell as occupied."""
_SQUARE = 1e-6
"""Relative difference of the two sides of a cell."""


def grid_of(env_map: Any, resolution: float | None = None) -> Grid:
    """The map of an IR-SIM environment as a grid; see :meth:`lampyris.Grid.from_irsim`.

    Parameters
    ----------
    env_map : what ``env.get_map(resolution)`` returns, or the environment.
    resolution : metres a cell, with an environment; None: 0.1.

    Raises
    ------
    SettingError : ``IRSIM``: something else, or cells that are not squares.
    """
    if hasattr(env_map, "get_map"):
        env_map = env_map.get_map(0.1 if resolution is None else resolution)
    elif resolution is not None:
        raise SettingError("IRSIM", shown(resolution), where="resolution", allowed="None: the map has one")
    if not all(hasattr(env_map, name) for name in ("width", "height", "resolution", "obstacle_list")):
        allowed = "an environment of IR-SIM, or what its get_map() returns"
        raise SettingError("IRSIM", f"a {type(env_map).__name__}", where="env_map", allowed=allowed)
    width, height, step = (float(getattr(env_map, name)) for name in ("width", "height", "resolution"))
    x0, y0 = (float(value) for value in np.asarray(getattr(env_map, "world_offset", (0.0, 0.0))).ravel()[:2])
    occupancy = getattr(env_map, "grid", None)
    if occupancy is None:
        columns, rows = max(round(width / step), 1), max(round(height / step), 1)
        blocked = np.zeros((rows, columns), dtype=np.bool_)
    else:
        values = np.asarray(occupancy, dtype=np.float64)
        blocked = np.ascontiguousarray(values.T[::-1] > OCCUPIED)
        rows, columns = blocked.shape
        step = width / columns
        if abs(height / rows - step) > _SQUARE * step:
            what = f"cells of {step:g} x {height / rows:g} m"
            raise SettingError("IRSIM", what, where="env_map", allowed="square cells")
    for obstacle in env_map.obstacle_list:
        _cover(blocked, getattr(obstacle, "_geometry", obstacle), x0, y0, step)
    return Grid(blocked, resolution=step, origin=(x0, y0, 0.0), name="ir-sim")


def _cover(blocked: BoolGrid, geometry: Any, x0: float, y0: float, step: float) -> None:
    """Block every cell that a shapely geometry touches."""
    import shapely  # what made the geometry

    rows, columns = blocked.shape
    left, low, right, high = geometry.bounds
    i = np.arange(max(int((left - x0) / step) - 1, 0), min(int((right - x0) / step) + 2, columns))
    j = np.arange(max(int((low - y0) / step) - 1, 0), min(int((high - y0) / step) + 2, rows))
    if not len(i) or not len(j):
        return
    x, y = np.meshgrid(x0 + i * step, y0 + j * step)
    touched = shapely.intersects(shapely.box(x, y, x + step, y + step), geometry)
    blocked[np.ix_(rows - 1 - j, i)] |= touched


class IrsimPlanner:
    """A planner of lampyris in the shape of IR-SIM's: ``IrsimPlanner(env.get_map(0.1)).planning(start, goal)``.

    Parameters
    ----------
    env_map : see :func:`grid_of`.
    planner : a name or a planner object, of planners on cells.
    radius : of the robot, metres.
    settings : of the planner, as for :func:`lampyris.plan`.

    Raises
    ------
    LampyrisError : see :func:`grid_of` and :func:`lampyris.plan`.

    Examples
    --------
    >>> planner = IrsimPlanner(env.get_map(0.1), "theta-star", radius=0.2)  # doctest: +SKIP
    >>> path = planner.planning(robot.state, robot.goal)  # doctest: +SKIP
    """

    def __init__(self, env_map: Any, planner: Any = "ad-gso", radius: float = 0.0, **settings: Any) -> None:
        if not in_range(radius, 0.0, 1e6):
            raise SettingError(
                "ROBOT_LIMIT", shown(radius), where="radius", allowed="a number from 0 to 1e+06 m"
            )
        self.grid = grid_of(env_map)
        self.plan: Any = None
        self._planner, self._robot, self._settings = planner, Robot(radius=radius), settings

    def planning(self, start_pose: Any, goal_pose: Any, show_animation: bool = False) -> Floats | None:
        """A path between two poses (x, y, ...), metres; float64 (2, n), from the goal to the start as IR-SIM has it.

        None where there is no path; ``self.plan`` then says why. ``show_animation`` has no effect.

        Raises
        ------
        SceneError : an end outside the map.
        """
        ends = [_point(what, pose) for what, pose in (("start_pose", start_pose), ("goal_pose", goal_pose))]
        scene = Scene(self.grid, start_m=ends[0], goal_m=ends[1], robot=self._robot)
        self.plan = api.plan(scene, self._planner, **self._settings)
        if self.plan.path is None:
            return None
        lines = self.plan.path.cells if self.plan.waypoints is None else self.plan.waypoints
        return np.ascontiguousarray(self.grid.to_metres(lines)[::-1].T)


def _point(what: str, pose: Any) -> tuple[float, float]:
    values: NDArray[Any] = np.asarray(pose).ravel()
    if values.size < 2 or not all(is_real(value) for value in values[:2].tolist()):
        raise SettingError(
            "TYPE", shown(pose), where=what, allowed="x, y in metres, and what else a pose has"
        )
    return float(values[0]), float(values[1])
