"""A planner of lampyris in the shape of IR-SIM's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris import api
from lampyris._core import defaults
from lampyris._core.scalars import in_range, is_real
from lampyris.errors import SettingError, shown
from lampyris.irsim.maps import grid_of
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.typing import Floats


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

    def __init__(
        self, env_map: Any, planner: Any = defaults.PLANNER, radius: float = 0.0, **settings: Any
    ) -> None:
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
