"""Fleet: a map, and the start and goal of each of its robots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.noun import Noun
from lampyris._core.predicates import cell_of
from lampyris.errors import SceneError, SettingError, shown
from lampyris.model.grid import Grid, frozen
from lampyris.model.robot import Robot
from lampyris.typing import Cell, CellLike

MOST_RADIUS = math.sqrt(2) / 4
"""Maximum radius, in cells, of robots that never touch if none are in one cell or change places, with four-connected moves.
Where one robot leaves a cell and another enters it round a corner in the same tick, their centres come within sqrt(2) / 2 cells
of each other."""
OCTILE_RADIUS = math.sqrt(5) / 10
"""The same with octile moves, if no two cross diagonally either. Where one robot leaves a cell by a diagonal step and another
enters it by a straight one at an angle of 45 degrees, their centres come within sqrt(5) / 5 cells."""
FORGIVEN = 1e-9
"""Share of a squared distance that rounding may take: robots that touch at a point do not collide."""


def most_radius(moves: str) -> float:
    """The maximum radius in cells of robots that the conflicts of a step set keep apart; see :data:`MOST_RADIUS`."""
    return OCTILE_RADIUS if moves == "octile" else MOST_RADIUS


@dataclass(frozen=True, slots=True, repr=False)
class Agent(Noun):
    """One robot of a fleet with its start and goal.

    Parameters
    ----------
    start, goal : cells (x, y).
    robot : its size; None: a robot small enough for its cell. Only the radius counts, and it must be able to turn in place
        (all robots take one tick a step). Planners whose traits do not say ``sizes`` take robots up to
        :func:`most_radius`.
    tasks : cells to visit after the goal, one after another, by a lifelong fleet (:func:`lampyris.lifelong_fleet`).

    Raises
    ------
    SettingError : ``TYPE``: no cell, or no robot.

    Examples
    --------
    >>> import lampyris
    >>> agent = lampyris.Agent(start=(1, 8), goal=(8, 2), tasks=((8, 2), (1, 8)))
    >>> agent.start, len(agent.tasks)
    ((1, 8), 2)
    """

    start: Cell
    goal: Cell
    robot: Robot | None = None
    tasks: tuple[Cell, ...] = ()

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self, start: CellLike, goal: CellLike, robot: Robot | None = ..., tasks: Sequence[CellLike] = ...
        ) -> None: ...

    def __post_init__(self) -> None:
        for what in ("start", "goal"):
            given: Any = getattr(self, what)
            cell = cell_of(given)
            if cell is None:
                raise SettingError(
                    "TYPE", f"{shown(given)} is not a cell", where=what, allowed="two whole numbers x, y"
                )
            object.__setattr__(self, what, cell)
        robot: Any = self.robot
        if robot is not None and not isinstance(robot, Robot):
            raise SettingError("TYPE", shown(robot), where="robot", allowed="a lampyris.Robot, or None")
        given = self.tasks
        stops = [cell_of(one) for one in given] if isinstance(given, tuple | list) else [None]
        if None in stops:
            raise SettingError("TYPE", shown(given), where="tasks", allowed="a list of cells (x, y)")
        object.__setattr__(self, "tasks", tuple(stops))


@dataclass(frozen=True, slots=True, repr=False)
class Fleet(Noun):
    """Robots on one map, each with a start and a goal: a multi-agent path finding problem.

    Parameters
    ----------
    grid : the map.
    robots : one or more; no two share a start, no two share a goal.

    Raises
    ------
    SettingError : ``TYPE``: no grid or no agents; ``FLEET``: no robot at all, or two with one start or one goal, or that
        overlap there; ``FLEET_ROBOT``: a robot that cannot turn in place. They name the robot by its index, from 0.
    SceneError : ``START_OUTSIDE``, ``GOAL_OUTSIDE``, ``TASK_OUTSIDE``, ``START_OCCUPIED``, ``GOAL_OCCUPIED``,
        ``TASK_OCCUPIED``, with the robot's index.

    Examples
    --------
    >>> import lampyris
    >>> robots = (lampyris.Agent((1, 8), (8, 2)), lampyris.Agent((8, 2), (1, 8)))
    >>> fleet = lampyris.Fleet(lampyris.load_grid("guide"), robots)
    >>> lampyris.plan_fleet(fleet).makespan
    13
    """

    grid: Grid
    robots: tuple[Agent, ...]

    if TYPE_CHECKING:

        def __init__(self, grid: Grid, robots: Sequence[Agent]) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.grid, Grid):
            raise SettingError("TYPE", f"a {type(self.grid).__name__}", where="grid", allowed="a Grid")
        given: Any = self.robots
        if not isinstance(given, tuple | list):
            raise SettingError("TYPE", shown(given), where="robots", allowed="a list of lampyris.Agent")
        object.__setattr__(self, "robots", tuple(given))
        if not given:
            raise SettingError("FLEET", "no robot", where="robots", allowed="one or more")
        taken: dict[str, dict[Cell, int]] = {"start": {}, "goal": {}}
        for k, one in enumerate(given):
            if not isinstance(one, Agent):
                raise SettingError("TYPE", shown(one), where=f"robots[{k}]", allowed="a lampyris.Agent")
            self._check_size(k, one)
            for i, stop in enumerate(one.tasks):
                self._check_end(k, "task", stop, f"tasks[{i}]")
            for what in ("start", "goal"):
                cell: Cell = getattr(one, what)
                self._check_end(k, what, cell, what)
                other = taken[what].setdefault(cell, k)
                if other != k:
                    raise SettingError(
                        "FLEET", f"{cell} is the {what} of robot {other}, too", where=f"robots[{k}].{what}",
                        allowed=f"a {what} for each robot alone",
                    )  # fmt: skip
        self._check_apart()

    def _check_apart(self) -> None:
        """See that no two robots overlap at their starts, or at their goals."""
        radii = self.radii
        large = np.flatnonzero(radii > 0.5)  # two that are not are apart in different cells
        for what, cells in (("start", self.starts), ("goal", self.goals)):
            at = np.array(cells, dtype=np.int64)
            for k in large.tolist():
                away, need = at - at[k], radii + radii[k]
                squared = away[:, 0] * away[:, 0] + away[:, 1] * away[:, 1]
                near = squared < need * need * (1.0 - FORGIVEN)
                near[k] = False
                if near.any():
                    one, other = sorted((k, int(near.argmax())))
                    raise SettingError(
                        "FLEET", f"overlaps robot {one} at its {what}", where=f"robots[{other}].{what}",
                        allowed=f"a distance of at least {radii[one] + radii[other]:.4g} cells: their radii",
                    )  # fmt: skip

    def _check_size(self, k: int, one: Agent) -> None:
        if one.robot is None:
            return
        if one.robot.drive == "ackermann":
            raise SettingError(
                "FLEET_ROBOT", "an Ackermann drive", where=f"robots[{k}].robot", setting="robot.drive",
                allowed="differential or omnidirectional: paths of fleets turn in place",
            )  # fmt: skip

    def _check_end(self, k: int, what: str, cell: Cell, place: str) -> None:
        where, grid = f"robots[{k}].{place}", self.grid
        if not grid.contains(cell):
            allowed = f"x 0 to {grid.width - 1}, y 0 to {grid.height - 1}"
            raise SceneError(
                f"{what.upper()}_OUTSIDE", f"{cell} is outside the map", where=where, allowed=allowed
            )
        if grid.blocked[cell[1], cell[0]]:
            raise SceneError(
                f"{what.upper()}_OCCUPIED", f"{cell} is blocked", where=where, allowed="a free cell"
            )

    def _brief(self) -> str:
        name = self.grid.name[:40] or f"{self.grid.width} x {self.grid.height} cells"
        return f"<Fleet {name}: {len(self.robots)} robot{'s' if len(self.robots) > 1 else ''}>"

    def __len__(self) -> int:
        return len(self.robots)

    @property
    def radii(self) -> NDArray[np.float64]:
        """The radius of each robot in cells, float64 (robots,); 0 for one without a size."""
        sizes = [0.0 if one.robot is None else one.robot.radius for one in self.robots]
        made: NDArray[np.float64] = frozen(np.array(sizes, dtype=np.float64) / self.grid.resolution)
        return made

    @property
    def starts(self) -> tuple[Cell, ...]:
        """The start of each robot."""
        return tuple(one.start for one in self.robots)

    @property
    def goals(self) -> tuple[Cell, ...]:
        """The goal of each robot."""
        return tuple(one.goal for one in self.robots)
