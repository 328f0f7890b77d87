"""Scene: everything a planner is asked about."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core.defaults import VIA_ORDER, VIA_ORDERS
from lampyris._core.predicates import array_of, cell_of, numbers
from lampyris._core.scalars import is_word
from lampyris._core.values import Value
from lampyris.errors import LimitError, SceneError, SettingError, shown
from lampyris.model.edit import Edit, check_edits
from lampyris.model.grid import Grid, frozen
from lampyris.model.moves import Moves, moves_named
from lampyris.model.path import Pose
from lampyris.model.robot import LEAST, Robot
from lampyris.model.traffic import ObstacleSpec, Patrol, RandomWalk, Recorded
from lampyris.typing import Cell, CellLike, FloatGrid

MAX_RADIUS = 250
"""Maximum radius of a robot or an obstacle, in cells."""
MAX_VIA = 100
"""Most via points of a scene."""
_ROBOT = Robot()


@dataclass(frozen=True, slots=True, eq=False, repr=False, init=False)
class Scene(Value):
    """A grid with start and goal, a robot with its moves, moving obstacles and speed zones.

    Parameters
    ----------
    grid : the map.
    start, goal : cells (x, y); None: given in metres instead.
    moves : a :class:`Moves` or its name.
    robot : size and limits.
    traffic : specifications of moving obstacles; one alone is taken as a list of one.
    zones : float64 (height, width): speed limit of each cell, m/s, > 0, infinity where there is none. It
        holds while the robot's centre touches the cell. None: no limits.
    edits : walls that appear and disappear during a simulation, from tick 1 on, in order of time. They are not known
        in advance; plans and profiles of the scene ignore them, drives refuse them.
    start_m, goal_m : in place of ``start`` and ``goal``: points of the map frame, metres (x to the right, y up); the
        cells that hold them are the ends.
    start_pose, goal_pose : in place of these: (x, y, yaw), metres of the map frame and radians counterclockwise from
        its x axis. The cells that hold the points are the ends; planners that plan headings keep to the poses.
        None: any heading, at the centre of the cell.
    via : cells (x, y) that a path passes through between the ends; see :meth:`through`.
    via_order : ``given``: in the order given; ``best``: in the order that makes the shortest path short.

    Raises
    ------
    SceneError : an end, a via point, a waypoint or an edited cell outside the map. (A blocked end is an answer, not a
        mistake: see :class:`lampyris.model.plan.Status`.)
    SettingError : an end that is not two numbers, or is given twice or not at all, unknown moves, something of the wrong type;
        ``ZONES``: not one number a cell, or a limit that is not positive; ``EDIT_TICK``: an edit before tick
        1, or not after the one before.
    LimitError : a radius of more than 250 cells; more than 10,000 edits; more than 100 via points.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2), moves="octile")
    >>> scene.start, scene.goal, scene.robot.v_max
    ((1, 8), (8, 2), 1.0)
    """

    grid: Grid
    start: Cell
    goal: Cell
    moves: Moves
    robot: Robot
    traffic: tuple[ObstacleSpec, ...]
    zones: FloatGrid | None
    edits: tuple[Edit, ...]
    start_pose: Pose | None
    goal_pose: Pose | None
    via: tuple[Cell, ...]
    via_order: str

    def __init__(
        self,
        grid: Grid,
        start: CellLike | None = None,
        goal: CellLike | None = None,
        moves: Moves | str = "octile",
        robot: Robot = _ROBOT,
        traffic: ObstacleSpec | Sequence[ObstacleSpec] | None = (),
        zones: ArrayLike | None = None,
        edits: Edit | Sequence[Edit] | None = (),
        *,
        start_m: Sequence[float] | FloatGrid | None = None,
        goal_m: Sequence[float] | FloatGrid | None = None,
        start_pose: Sequence[float] | FloatGrid | None = None,
        goal_pose: Sequence[float] | FloatGrid | None = None,
        via: Sequence[CellLike] = (),
        via_order: str = VIA_ORDER,
    ) -> None:
        for what, part, kind in (("grid", grid, Grid), ("robot", robot, Robot)):
            if not isinstance(part, kind):
                given = type(part).__name__
                raise SettingError("TYPE", f"a {given}", where=what, allowed=f"a {kind.__name__}")
        object.__setattr__(self, "grid", grid)
        object.__setattr__(self, "robot", robot)
        object.__setattr__(self, "moves", moves_named(moves))
        for what, cell, metres, pose in (
            ("start", start, start_m, start_pose),
            ("goal", goal, goal_m, goal_pose),
        ):
            held = None if pose is None else _pose(f"{what}_pose", pose)
            if held is not None and cell is not None and cell_of(cell) == grid.to_cell(*held[:2]):
                cell = None  # as in a copy of a scene
            object.__setattr__(self, f"{what}_pose", held)
            object.__setattr__(self, what, self._end(what, cell, metres, held))
        object.__setattr__(self, "via", self._via(via))
        if not is_word(via_order, VIA_ORDERS):
            raise SettingError(
                "VIA_ORDER", shown(via_order), where="via_order", allowed=", ".join(VIA_ORDERS)
            )
        object.__setattr__(self, "via_order", via_order)
        listed: Any = traffic
        if not isinstance(listed, tuple | list):
            listed = () if listed is None else (listed,)
        object.__setattr__(self, "traffic", tuple(listed))
        _small_enough(self.grid, "robot", self.robot.radius, "robot.radius")
        for k, one in enumerate(self.traffic):
            obstacle: object = one
            if not isinstance(obstacle, ObstacleSpec):
                allowed = "RandomWalk, Patrol, Crossing or Recorded"
                raise SettingError(
                    "TYPE", f"a {type(obstacle).__name__}", where=f"traffic[{k}]", allowed=allowed
                )
            check_obstacle(self.grid, k, one)
        object.__setattr__(self, "zones", None if zones is None else _zones(grid, zones))
        object.__setattr__(self, "edits", check_edits(grid, edits, first=1))

    @property
    def start_m(self) -> tuple[float, float]:
        """Centre of the start cell, metres of the map frame."""
        x, y = self.grid.to_metres(self.start).tolist()
        return x, y

    @property
    def goal_m(self) -> tuple[float, float]:
        """Centre of the goal cell, metres of the map frame."""
        x, y = self.grid.to_metres(self.goal).tolist()
        return x, y

    def through(self, via: Sequence[CellLike], order: str = VIA_ORDER) -> Scene:
        """The same scene with via points, which :func:`lampyris.plan` passes on the way to the goal.

        Parameters
        ----------
        via : cells (x, y), at most 100.
        order : ``given``, or ``best``: the planner's legs are put in the order in which the shortest paths between
            the points are the least in sum; exact for up to 12 points, a heuristic with a lower bound
            (``Plan.via_lower_bound``) beyond.

        Raises
        ------
        SettingError, SceneError, LimitError : see the class.

        Examples
        --------
        >>> import lampyris
        >>> scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
        >>> scene.through([(20, 30), (40, 40)], order="best").via
        ((20, 30), (40, 40))
        """
        return replace(self, via=self._via(via), via_order=order)

    def _via(self, given: Any) -> tuple[Cell, ...]:
        """The via points, each a cell of the map."""
        if not isinstance(given, list | tuple) and (not isinstance(given, np.ndarray) or given.ndim != 2):
            raise SettingError("TYPE", shown(given), where="via", allowed="a list of cells")
        listed = list(given)
        if len(listed) > MAX_VIA:
            raise LimitError("VIA", f"{len(listed)} via points", allowed=f"at most {MAX_VIA}", setting="via")
        cells = [cell_of(one) for one in listed]
        for k, cell in enumerate(cells):
            if cell is None:
                what = f"{shown(listed[k])} is not a cell"
                raise SettingError("TYPE", what, where=f"via[{k}]", allowed="two whole numbers x, y")
            if not self.grid.contains(cell):
                allowed = f"x 0 to {self.grid.width - 1}, y 0 to {self.grid.height - 1}"
                what = f"{cell} is outside the map"
                raise SceneError("VIA_OUTSIDE", what, where=f"via[{k}]", allowed=allowed)
        return tuple(cell for cell in cells if cell is not None)

    def _brief(self) -> str:
        more = [
            f"{len(given)} {name}{'s' if len(given) > 1 else ''}"
            for given, name in (
                (self.via, "via point"),
                (self.traffic, "obstacle spec"),
                (self.edits, "edit"),
            )
            if given
        ]
        name = self.grid.name[:40] or f"{self.grid.width} x {self.grid.height} cells"
        words = [f"<Scene {name}: {self.start} to {self.goal}", f"{self.moves.name} moves", *more]
        return ", ".join([*words, "zones"] if self.zones is not None else words) + ">"

    def _end(self, what: str, given: Any, metres: Any, pose: Pose | None) -> Cell:
        """An end as a cell of the map, from a cell, from metres or from a pose."""
        times = sum(one is not None for one in (given, metres, pose))
        if times != 1:
            raise SettingError(
                "ENDS",
                f"{what} is given {'more than once' if times else 'neither in cells nor in metres'}",
                where=what,
                allowed=f"one of {what} (cell), {what}_m (metres), {what}_pose (metres and yaw)",
            )
        if metres is not None:
            given = self._cell_at(f"{what}_m", metres)
        elif pose is not None:
            given = self.grid.to_cell(*pose[:2])
        cell = cell_of(given)
        if cell is None:
            raise SettingError(
                "TYPE", f"{shown(given)} is not a cell", where=what, allowed="two whole numbers x, y"
            )
        if not self.grid.contains(cell):
            raise SceneError.of(
                f"{what.upper()}_OUTSIDE",
                what,
                f"{cell} is outside the map",
                allowed=f"x 0 to {self.grid.width - 1}, y 0 to {self.grid.height - 1}",
            )
        return cell

    def _cell_at(self, what: str, metres: Any) -> Cell:
        """The cell that holds a point of the map frame."""
        point = numbers(metres, (2,))
        if point is None or not np.isfinite(point).all():
            raise SettingError("TYPE", shown(metres), where=what, allowed="two finite numbers x, y: metres")
        return self.grid.to_cell(*point.tolist())


def _pose(what: str, given: Any) -> Pose:
    """A pose, its yaw in (-pi, pi]."""
    array = numbers(given, (3,))
    if array is None or not np.isfinite(array).all():
        allowed = "three finite numbers x, y, yaw: metres and radians"
        raise SettingError("TYPE", shown(given), where=what, allowed=allowed)
    x, y, yaw = array.tolist()
    if not -math.pi < yaw <= math.pi:
        yaw = math.remainder(yaw, 2 * math.pi)
    return x, y, yaw


def check_obstacle(grid: Grid, k: int, one: ObstacleSpec) -> None:
    """Refuse obstacle ``k`` of a scene if it does not fit the map, whatever else is in the scene.

    Raises
    ------
    SceneError : OBSTACLE_TRACK: a waypoint or a cell of its track outside the map.
    LimitError : RADIUS: more than 250 cells.
    """
    _small_enough(grid, f"obstacle {k}", one.radius, "traffic.radius")
    cells: tuple[Cell, ...] = ()
    if isinstance(one, Patrol):
        cells = one.waypoints
    elif isinstance(one, Recorded):
        cells = one.track
    elif isinstance(one, RandomWalk):
        cells = one.starts
    for t, cell in enumerate(cells):
        if not grid.contains(cell):
            raise SceneError(
                "OBSTACLE_TRACK",
                f"obstacle {k} is at {cell} at step {t}",
                allowed=f"cells of the map, {grid.width} x {grid.height}",
            )


def _zones(grid: Grid, given: Any) -> FloatGrid | None:
    """Speed limits, checked; None where they limit nothing."""
    array = array_of(given)
    if array is None or array.shape != grid.blocked.shape or array.dtype.kind not in "fiu":
        raise SettingError(
            "ZONES",
            shown(given) if array is None else f"shape {array.shape} of {array.dtype}",
            where="zones",
            allowed=f"m/s, one number a cell: shape {grid.blocked.shape}",
        )
    limits = np.array(array, dtype=np.float64, order="C")
    wrong = ~(limits >= LEAST)
    if wrong.any():
        y, x = divmod(int(wrong.argmax()), grid.width)
        raise SettingError(
            "ZONES",
            f"{shown(float(limits[y, x]))} m/s at ({x}, {y})",
            where="zones",
            allowed=f"at least {LEAST:g} m/s, or infinity: no limit",
            todo="block the cells of a map where the robot must not drive",
        )
    return None if np.isinf(limits).all() else frozen(limits)


def _small_enough(grid: Grid, who: str, radius: float, setting: str) -> None:
    """A disc of more cells is a wrong unit or resolution; it would cost memory by its square."""
    if radius > MAX_RADIUS * grid.resolution:
        raise LimitError(
            "RADIUS",
            f"{who}: radius {radius:g} m is {radius / grid.resolution:.3g} cells",
            allowed=f"at most {MAX_RADIUS} cells",
            setting=setting,
        )
