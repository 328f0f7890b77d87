"""Plan: a planner's answer, with everything needed to judge it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from lampyris._core.arrays import cells_of, numbers_of, whole_of
from lampyris._core.noun import Noun, Tabular
from lampyris._core.predicates import array_of
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.model.field import Gate
from lampyris.model.grid import Grid, MapFrame
from lampyris.model.path import Path, PosePath
from lampyris.typing import Cell, Cells, Floats, Ticks

if TYPE_CHECKING:
    import pandas


class Status(StrEnum):
    """How a search ended: a word for programs, :attr:`sentence` for people. Only ``found`` is true.

    Examples
    --------
    >>> import lampyris
    >>> bool(lampyris.Status("found")), lampyris.Status("found").sentence
    (True, 'A path was found.')
    """

    FOUND = "found"
    NO_PATH = "no-path"
    START_OCCUPIED = "start-occupied"
    GOAL_OCCUPIED = "goal-occupied"
    HEMMED_IN = "hemmed-in"
    ITERATION_LIMIT = "iteration-limit"
    LIMIT = "limit"
    CANCELLED = "cancelled"

    @property
    def sentence(self) -> str:
        """The sentence a person reads."""
        return _SENTENCES[self]

    def __bool__(self) -> bool:
        return self is Status.FOUND


_SENTENCES = {
    Status.FOUND: "A path was found.",
    Status.NO_PATH: "No path: walls separate the start from the goal.",
    Status.START_OCCUPIED: "The start is not a free cell for this robot.",
    Status.GOAL_OCCUPIED: "The goal is not a free cell for this robot.",
    Status.HEMMED_IN: "Moving obstacles stand on every acceptable neighbour of the robot.",
    Status.ITERATION_LIMIT: "Stopped at iter_max before the goal was reached.",
    Status.LIMIT: "Stopped at the budget before the search was over.",
    Status.CANCELLED: "Stopped on request.",
}


@dataclass(frozen=True, slots=True, repr=False)
class Candidate(Noun):
    """One accepted neighbour of an AD-GSO iteration; ``probability`` is its share of the difference."""

    cell: Cell
    ring: int
    luciferin: float
    probability: float


@dataclass(frozen=True, slots=True, repr=False)
class Jump(Noun):
    """One AD-GSO iteration: the accepted set, the choice and the sub-path to it (both ends included).

    ``rings`` : how many rings around ``at`` were opened; the outer ones may hold no accepted cell.
    """

    at: Cell
    luciferin: float
    candidates: tuple[Candidate, ...]
    chosen: Cell
    subpath: tuple[Cell, ...]
    by_parents: bool
    rings: int


@dataclass(frozen=True, slots=True, repr=False)
class PlanningRound(Noun):
    """One round of the planner ``pad``.

    Parameters
    ----------
    spheres : where its planning phase had headings: centre, and radius in cells.
    planned : cells at which the motions of the planned path begin and end; empty: nothing was planned.
    tracked : the same of the path of poses that was found in the tunnel; empty: none was.
    tunnel : half the width of the tunnel around the planned path, cells.
    planned_m, tracked_m : their costs, metres; None where they are empty.
    lower_bound_m : no path costs less, by what is proven up to this round; metres.
    low_expansions : cells that the planning phase expanded.
    high_expansions : poses that it expanded.
    tracking_expansions : poses that the tracking phase expanded.
    """

    spheres: tuple[tuple[Cell, float], ...]
    planned: tuple[Cell, ...]
    tracked: tuple[Cell, ...]
    tunnel: float
    planned_m: float | None
    tracked_m: float | None
    lower_bound_m: float
    low_expansions: int
    high_expansions: int
    tracking_expansions: int


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MapModel(Value):
    """The model of the map that a planner searched, for pictures and tables.

    Parameters
    ----------
    kind : ``visibility-graph``, ``polyanya``, ``voronoi`` or ``quadtree``.
    lines : float64 (n, 4): x0, y0, x1, y1, cells: edges of the graph that were looked along; at most 20,000.
    points : float64 (n, 2), cells: corners that were expanded, or the cells of the ridges.
    boxes : int32 (n, 4): x, y of the upper left cell, side in cells, and 1 if free: the leaves of a quadtree.
    bound : of ``visibility-graph`` and ``polyanya``: no path of straight lines is shorter, wherever it turns; cells. Else None.
    clearance : of ``voronoi``: least distance of the path's cells from walls, cells; no path has more. Else None.
    ridge_clearance : of ``voronoi``: the same without the climbs from the ends, on which it only grows. Else None.
    counts : how many corners, rectangles, ridge cells or leaves there are, and how many were expanded, by name.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> plan = lampyris.plan(scene, "quadtree")
    >>> plan.map_model.kind, len(plan.map_model.boxes) > 0
    ('quadtree', True)
    """

    kind: str
    lines: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    points: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    boxes: Cells = field(default_factory=lambda: np.zeros((0, 4), dtype=np.int32))
    bound: float | None = None
    clearance: float | None = None
    ridge_clearance: float | None = None
    counts: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, width in (("lines", 4), ("points", 2)):
            value = _rows(getattr(self, name), width)
            object.__setattr__(self, name, numbers_of("map_model", name, value, (None, width)))
        boxes = whole_of("map_model", "boxes", _rows(self.boxes, 4), (None, 4)).astype(np.int32)
        boxes.setflags(write=False)
        object.__setattr__(self, "boxes", boxes)


def _rows(value: object, width: int) -> object:
    """The same, but no rows at all as an array that has its columns, which dictionaries do not keep."""
    array = array_of(value)
    empty = array is not None and array.size == 0 and array.ndim <= 2
    return np.zeros((0, width), dtype=np.int64) if empty else value


def _places(value: object) -> Cells | Floats:
    """Waypoints: cells, or places between cell centres."""
    array = array_of(value)
    if array is not None and array.dtype.kind == "f":
        return numbers_of("plan", "waypoints", value, (None, 2))
    return cells_of("plan", "waypoints", value)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Plan(Value, Tabular):
    """The result of a planner.

    Parameters
    ----------
    status : how the search ended.
    planner : the planner's name.
    path : the path, None unless found.
    iterations : the planner's own rounds (AD-GSO: jumps; A*: 1).
    expansions : cells it expanded.
    commit : number of steps to drive before the planner is called again (None: the whole path). AD-GSO decides at each jump.
    jumps : AD-GSO's record, when asked for.
    best_by_iteration : the record of a swarm, or of a planner that samples, when asked for: the fitness of its best answer
        so far (length of its best path), in cells, after each iteration (infinity before there is one); it never rises.
    gates_met : cells at which the ``replan`` gate policy sealed a gate and replanned.
    optimal_exact : exact cost of the best path in the same map, None where unknown or there is none.
    sum_cost_to_go : sum of cost-to-go over the visited cells, in cells: what the dissertation prints as the
        baselines' "path cost".
    repaired : whether moving obstacles count as walls in it, because there was no other path.
    gates_on_path, gates_in_map : openings too narrow for the robot, in the map as given. With ``min_clearance``
        the gates that ad-gso closes or meets are others: those of the cells that are left for the robot's
        centre, see :func:`lampyris.planning.field.gates.find_gates`.
    timing : seconds by stage; the only part that differs from run to run. ``loading_s`` (loading and
        compiling machine code, once for a process) is a part of ``total_s`` and of no other.
    detail : why, in words, where there is more to say than the status's own sentence.
    attributes : what the path considers besides its length, with the values in effect: ``min_clearance`` (cells to
        walls), ``obstacle_density_weight``, ``window`` (cells), ``traffic_density_weight``; empty: nothing.
        What makes a curve of the path keeps to them.
    notes : notes for the user, such as which of the attributes were weakened, and why.
    waypoints : of an any-angle planner: the turning points, int32 (k, 2), both ends included; straight lines
        between their centres can be driven.
        ``path`` is a walk by single steps along these lines. float64 (k, 2), places between cell centres, of ``polyanya``
        for a point robot, and with ``turns=anywhere`` of planners that sample (where a disc turns, ``path`` may be up to 2
        cells away along either axis: it needs cells at whose centres the disc has room). Else None.
    tree : of a planner that samples, when asked for: the straight lines of its trees, float64 (m, 4): x, y of either end,
        in cells. Else None.
    schedule : the tick at which the robot is to stand on each cell of the path, int64 (n,), rising; it waits
        where two follow by more than 1. None: one step a tick, whenever it is driven. ``commit`` counts ticks
        where there is a schedule.
    frame : where the map's cells lie in metres; None: unknown (plans of a session).
    pose_path : of a planner of poses: what is driven. ``path`` then holds the cells that the base passes through.
    rounds : of the planner ``pad``: its rounds, in order.
    via : the scene's via points in the order in which they are visited; empty: there are none.
    via_at : where each is on the path: rising indices of ``cells``.
    via_lower_bound : where the order was to be the best: no path through the via points costs less, cells. Else None.
    map_model : of ``visibility-graph``, ``polyanya``, ``voronoi`` and ``quadtree``: what was searched. Else None.
    time_lower_bound : of the planner ``fastest-time``: no path of the scene's moves (through the via points in this order)
        is driven in less time under the caps that its settings name, seconds. Else None.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> plan = lampyris.plan(scene, "astar")
    >>> bool(plan), plan.planner, plan.path.cells.shape[1]
    (True, 'astar', 2)
    """

    status: Status
    planner: str
    path: Path | None = None
    iterations: int = 0
    expansions: int = 0
    commit: int | None = None
    jumps: tuple[Jump, ...] = ()
    best_by_iteration: tuple[float, ...] = ()
    gates_met: tuple[Cell, ...] = ()
    optimal_exact: int | None = None
    sum_cost_to_go: float | None = None
    repaired: bool = False
    gates_on_path: tuple[Gate, ...] = ()
    gates_in_map: tuple[Gate, ...] = ()
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)
    detail: str = ""
    attributes: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    waypoints: Cells | Floats | None = None
    tree: Floats | None = None
    schedule: Ticks | None = None
    frame: MapFrame | None = None
    pose_path: PosePath | None = None
    rounds: tuple[PlanningRound, ...] = ()
    via: tuple[Cell, ...] = ()
    via_at: tuple[int, ...] = ()
    via_lower_bound: float | None = None
    map_model: MapModel | None = None
    time_lower_bound: float | None = None

    def __post_init__(self) -> None:
        held = self.path if self.status is Status.FOUND else None
        if held is not self.path or (self.status is Status.FOUND and not isinstance(held, Path)):
            what, allowed = f"status {shown(self.status)}", "a Path exactly when the status is found"
            raise SettingError("PLAN", what, where="plan.path", allowed=allowed)
        if self.waypoints is not None:
            object.__setattr__(self, "waypoints", _places(self.waypoints))
        if self.tree is not None:
            object.__setattr__(self, "tree", numbers_of("plan", "tree", self.tree, (None, 4)))

    def _brief(self) -> str:
        if self.path is None:
            return f"<Plan {self.status} by {self.planner}>"
        if self.pose_path is not None:
            poses = self.pose_path
            size = f"{len(poses.poses)} poses, {poses.length_m:.6g} m, bound {poses.bound:.4g}"
            return f"<Plan found by {self.planner}: {size}>"
        gap = "" if self.gap is None else f", gap {self.gap:.2%}"
        return (
            f"<Plan {self.status} by {self.planner}: {len(self.path.cells)} cells, cost {self.cost:.6g}{gap}>"
        )

    def to_pandas(self, grid: Grid | None = None) -> pandas.DataFrame:
        """The path as a table, a row a cell: metres of the map frame (y up) and radians.

        Columns ``x_m``, ``y_m``, ``yaw`` (of the step that leaves the cell), ``s`` (metres from the start), ``x``,
        ``y`` (the cell) and, with a schedule, ``tick``.

        Parameters
        ----------
        grid : the map of the plan; None: that of :attr:`frame`, which plans of :func:`lampyris.plan` have.

        Raises
        ------
        UsageError : ``PANDAS``: pandas is not installed; the plan has no path; no frame is known.
        """
        return self._table(frame=self.frame if grid is None else grid.frame)

    @property
    def cells(self) -> Cells | None:
        """int32 (n, 2), or None when not found."""
        return None if self.path is None else self.path.cells

    @property
    def cost(self) -> float:
        """Cost of the path in cells; infinity when not found."""
        return math.inf if self.path is None else self.path.cost

    @property
    def length_m(self) -> float | None:
        """Length of what is driven, in metres: of the poses, the straight lines between the waypoints, or the cells.

        None when not found, or without a :attr:`frame` (plans of a session, unless they have poses).

        Examples
        --------
        >>> import lampyris
        >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
        >>> round(lampyris.plan(scene, "astar").length_m, 3)
        11.243
        """
        if self.pose_path is not None:
            return self.pose_path.length_m
        if self.path is None or self.frame is None:
            return None
        lines = self.any_angle_length
        return (float(self.path.arc[-1]) if lines is None else lines) * self.frame.resolution

    @property
    def reversals(self) -> int | None:
        """How often a path of poses changes between driving forwards and in reverse; None on cells."""
        return None if self.pose_path is None else self.pose_path.reversals

    @property
    def any_angle_length(self) -> float | None:
        """Length of the straight lines between the waypoints, in cells; None without waypoints."""
        if self.waypoints is None:
            return None
        whole = self.waypoints.dtype.kind == "i"
        d = np.diff(self.waypoints.astype(np.int64) if whole else self.waypoints, axis=0)
        return math.fsum(math.sqrt(dx * dx + dy * dy) for dx, dy in d.tolist())

    @property
    def poses(self) -> Floats | None:
        """x, y (metres of the map frame) and yaw (radians), float64 (n, 3), of a planner that plans headings."""
        return None if self.pose_path is None else self.pose_path.poses

    @property
    def bound(self) -> float | None:
        """How many times the least cost the path costs at most (see :attr:`PosePath.lower_bound_m`); None on cells."""
        return None if self.pose_path is None else self.pose_path.bound

    @property
    def steps(self) -> tuple[int, ...] | None:
        """Straights and diagonals (and knight's steps): the exact cost."""
        return None if self.path is None else self.path.steps

    @property
    def optimal_cost(self) -> float | None:
        """Cost of the best path in cells, None where unknown."""
        if self.optimal_exact is None or self.path is None:
            return None
        return self.path.moves.value(self.optimal_exact)

    @property
    def gap(self) -> float | None:
        """How much longer than the best path, as a fraction: 0 is optimal. None where unknown.

        The best path is that of the map as given: with gates closed the gap is the price of closing them.
        """
        if self.optimal_exact is None or self.path is None:
            return None
        excess = self.path.exact - self.optimal_exact
        return 0.0 if excess == 0 else excess / self.optimal_exact

    @property
    def sentence(self) -> str:
        """What a person should read."""
        return self.detail or self.status.sentence

    def __bool__(self) -> bool:
        return bool(self.status)
