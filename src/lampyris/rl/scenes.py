"""What environments are about: a scene from a scenario or a map, and the tasks in it."""

from __future__ import annotations

import os

from lampyris import api
from lampyris._core.scalars import is_whole
from lampyris.errors import SettingError, UsageError, of_kind, shown
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import free_cells, largest_region
from lampyris.scenarios import load_scenario
from lampyris.sim.episodes.tasks import Tasks

MAP = "env-1"
"""Map of environments that name none."""
GOALS = 16
"""Goals that are drawn where no scenario names one."""


def tasks_of(
    map: str | os.PathLike[str] | Grid | None = None,
    scenario: str | os.PathLike[str] | Scenario | Scene | None = None,
    robot: Robot | None = None,
    moves: str | None = None,
    goals: int | None = None,
    random_start: bool | None = None,
    task_seed: int = 0,
) -> Tasks:
    """The tasks of an environment.

    Parameters
    ----------
    map : a map file, the name of a bundled map, or a grid; None: ``env-1``, unless a scenario is given.
    scenario : a scenario file, a scenario or a scene: its map, robot and moves, its goal and, unless
        ``random_start``, its start. Its traffic, edits and speed zones are left aside.
    robot, moves : with a map; None: a point, and octile moves.
    goals : how many goals are drawn; 0: the goal of the scenario. None: 16, or 0 with a scenario.
    random_start : whether episodes begin anywhere. None: only without a scenario.
    task_seed : of the goals that are drawn.

    Raises
    ------
    UsageError : ``OPTIONS``: a scenario beside what it states itself, or of a fleet.
    LampyrisError : see :func:`lampyris.load_grid`, :func:`lampyris.load_scenario` and :class:`lampyris.sim.episodes.tasks.Tasks`.
    """
    if goals is not None and not is_whole(goals):
        raise SettingError("EPISODE_SETTING", shown(goals), where="goals", allowed="a whole number")
    if scenario is not None:
        for name, given in (("map", map), ("robot", robot), ("moves", moves)):
            if given is not None:
                raise UsageError("OPTIONS", "the scenario states it", where=name, allowed="either of the two")
        scene = _scene(scenario)
        start = bool(goals) if random_start is None else random_start
        return Tasks.of(scene, goals or 0, start, task_seed)
    grid = map if isinstance(map, Grid) else api.load_grid(MAP if map is None else map)
    robot = Robot() if robot is None else robot
    of_kind("robot", robot, Robot)
    wanted = GOALS if goals is None else goals
    if wanted == 0:
        raise UsageError(
            "OPTIONS", "0 goals without a scenario", where="goals", allowed="1 or more, or a scenario"
        )
    region = largest_region(free_cells(grid, robot.radius))
    end = (int(region[0][0]), int(region[0][1])) if len(region) else (0, 0)
    scene = Scene(grid, end, end, moves="octile" if moves is None else moves, robot=robot)
    return Tasks.of(scene, wanted, random_start is not False, task_seed)


def _scene(given: str | os.PathLike[str] | Scenario | Scene) -> Scene:
    if isinstance(given, Scene):
        return given
    held = given if isinstance(given, Scenario) else load_scenario(given)
    if not isinstance(held, Scenario):
        raise UsageError(
            "OPTIONS", "a scenario of a fleet", where="scenario", allowed="one of a single robot"
        )
    return held.scene
