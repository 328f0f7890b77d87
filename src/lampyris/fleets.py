"""Many robots on one map: plan_fleet, load_fleet, random_fleet.

Nothing leaves through :func:`plan_fleet` that the referee has not re-checked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lampyris import referee
from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_whole
from lampyris.errors import SettingError, UsageError, callable_or_none, file_name, of_kind, shown
from lampyris.io.fleet_export import write_fleet
from lampyris.io.fleet_files import FleetFile, read_agents, read_scen_fleet
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris.kernels import loading
from lampyris.model.fleet.fleet import FORGIVEN, Agent, Fleet, most_radius
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES as STEPS
from lampyris.model.moves import moves_named, octile_pair
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris.planning.base import Budget
from lampyris.planning.field.layers import free_cells, largest_region
from lampyris.planning.field.solve import solve
from lampyris.planning.fleet import registry
from lampyris.planning.fleet.base import FleetPlanner
from lampyris.planning.fleet.separation import apart
from lampyris.typing import CellLike

PLANNER = "lacam"
"""The planner by default."""
MOVES = "four-connected"
"""The step set by default."""


def plan_fleet(
    fleet: Fleet,
    planner: str | FleetPlanner = PLANNER,
    *,
    moves: str = MOVES,
    seed: int = 0,
    budget: Budget | None = None,
    progress: Callable[[int, int | None], None] | None = None,
    planner_settings: Mapping[str, Any] | None = None,
    **settings: Any,
) -> FleetPlan:
    """Plan paths for all robots of a fleet that never collide; re-checked by the referee.

    ::

        fleet = lampyris.Fleet(grid, robots=[lampyris.Agent((0, 0), (9, 9)), lampyris.Agent((9, 9), (0, 0))])
        found = lampyris.plan_fleet(fleet, budget=lampyris.Budget(seconds=2))
        found.sum_of_costs, found.lower_bound, found.paths[0]

    Parameters
    ----------
    fleet : the map, and each robot's start and goal.
    planner : a name (see :func:`lampyris.planning.fleet.registry.list_fleet_planners`) or a planner object.
    moves : ``four-connected`` or ``octile``. A step to a neighbour or a wait takes a tick and costs 1, a diagonal step, too; it
        needs both cells beside it free of walls, and no two robots cross diagonally in a tick.
    seed : seed of all random draws: the same seed gives the same plan, unless seconds end the search.
    budget : ``seconds`` and ``stop`` end the call; ``expansions`` limits the planner's iterations
        (:attr:`lampyris.model.fleet.fleet_plan.FleetPlan.iterations`). ``lacam`` and ``lns`` improve their plans until the
        budget is used; without one ``lacam`` returns its first.
    progress : called from time to time with the iterations so far and the sum of costs of the best plan, or None.
    planner_settings : the planner's settings by name.
    **settings : the same as keywords.

    Raises
    ------
    UsageError : no such planner; ``SETTING_CLASH``: a setting that is given twice; ``MOVES``: a step set that it does not know.
    SettingError : a setting it does not have, or out of its range; ``FLEET_ROBOT``: a robot larger than it can plan for.
    SceneError : ``START_OCCUPIED``, ``GOAL_OCCUPIED``: a robot reaches into a wall there.
    LimitError : ``MEMORY``: the distance tables would take more memory than is allowed.
    InternalFault : the referee refused the plan; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> plan = lampyris.plan_fleet(fleet, seed=1)
    >>> plan.status.value, len(plan.paths)
    ('found', 4)
    """
    of_kind("fleet", fleet, Fleet)
    of_kind("budget", budget, Budget, none=True)
    of_kind("planner_settings", planner_settings, Mapping, none=True)
    callable_or_none("progress", progress)
    for name in settings.keys() & (planner_settings or {}).keys():
        raise UsageError("SETTING_CLASH", f"{name} is set twice", where=name, allowed="once")
    chosen = registry.chosen(planner, {**settings, **(planner_settings or {})})
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    began, loaded = loading.wall(), loading.seconds()
    found = unchecked_plan(fleet, chosen, moves=moves, seed=int(seed), budget=budget, progress=progress)
    planned = loading.wall()
    referee.demand(referee.check_fleet_plan(found, fleet, factor=promised_factor(chosen)))
    ended, loaded = loading.wall(), loading.seconds() - loaded
    timing = {"plan_s": planned - began, "referee_s": ended - planned}
    return replace(
        found,
        frame=fleet.grid.frame,
        timing={**timing, "total_s": ended - began + loaded, "loading_s": loaded},
    )


def unchecked_plan(
    fleet: Fleet, planner: FleetPlanner, *, moves: str, seed: int, budget: Budget | None, progress: Any = None
) -> FleetPlan:
    """The planner's own answer, which the referee has not seen; for callers that have it judged elsewhere.

    Raises
    ------
    LampyrisError : as :func:`plan_fleet`.
    """
    steps = moves_named(moves).name
    check_known(planner, fleet, steps)
    return replace(_within(planner, fleet, seed, budget, progress, steps), moves=steps)


def check_known(chosen: FleetPlanner, fleet: Fleet, moves: str) -> None:
    """See that a planner knows the steps and the sizes of a fleet.

    Raises
    ------
    UsageError : ``MOVES``. SettingError : ``FLEET_ROBOT``.
    """
    known = chosen.traits.moves
    if moves not in known:
        raise UsageError.of(
            "MOVES", "moves", shown(moves), allowed=", ".join(known),
            todo=f"{chosen.name} knows no conflicts of robots that take other steps",
        )  # fmt: skip
    radii = fleet.radii
    most = most_radius(moves)
    k = int(radii.argmax())
    if radii[k] > most * (1.0 + FORGIVEN) and not chosen.traits.sizes:
        able = ", ".join(name for name, row in registry.list_fleet_planners().items() if row.traits.sizes)
        raise SettingError(
            "FLEET_ROBOT", f"a radius of {radii[k] * fleet.grid.resolution:g} m, {radii[k]:.3g} cells",
            where=f"robots[{k}].robot", setting="robot.radius",
            allowed=f"at most {most:.3g} cells, {most * fleet.grid.resolution:.4g} m, with {chosen.name} and {moves} moves: "
            "it keeps robots apart by their cells, and larger ones touch at corners",
            todo=f"take {able}, or larger cells (--cell METRES, or `cell` in a scenario)",
        )  # fmt: skip


def promised_factor(chosen: FleetPlanner) -> float | None:
    """How many times its lower bound a plan of this planner costs at most, as it promises."""
    if chosen.traits.optimal:
        return 1.0
    return getattr(chosen, "weight", None) if chosen.traits.bounded else None


def _within(
    chosen: FleetPlanner, fleet: Fleet, seed: int, budget: Budget | None, progress: Any, moves: str
) -> FleetPlan:
    """The planner's answer within the seconds and the stop of a budget."""
    iterations = None if budget is None else budget.expansions
    seconds, stop = (None, None) if budget is None else (budget.seconds, budget.stop)
    with cancellation.watching(seconds, stop) as own:
        try:
            return chosen.plan(fleet, seed, iterations, progress, moves)
        except Cancelled:
            if own is None or (own.outer is not None and own.outer.is_over):
                raise
            status = Status.CANCELLED if own.was_cancelled else Status.LIMIT
            return FleetPlan(status, chosen.name, seed=seed)


def random_fleet(grid: Grid, robots: int, *, seed: int = 0, robot: Robot | None = None) -> Fleet:
    """A fleet with random starts and goals in the largest connected region of a map.

    Robots larger than a cell are at least their radius away from walls, and overlap neither at their starts nor at their goals.

    Parameters
    ----------
    grid : the map.
    robots : how many.
    seed : of the draws; of two fleets with the same seed the smaller consists of the first robots of the larger.
    robot : all of them; None: robots small enough for their cells.

    Raises
    ------
    SettingError : ``ROBOTS``: fewer than one, more than the region has cells, or more than found room beside each other.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> len(fleet.robots), fleet.grid.name
    (4, 'env-1')
    """
    of_kind("robot", robot, Robot, none=True)
    bare = bare_fleet(grid, robots, seed, 0.0 if robot is None else robot.radius)
    return Fleet(grid, [Agent(one.start, one.goal, robot) for one in bare.robots])


def bare_fleet(grid: Grid, robots: int, seed: int, radius: float) -> Fleet:
    """The starts and goals of :func:`random_fleet`, for discs of a radius in metres; its robots have no size."""
    of_kind("grid", grid, Grid)
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    region = largest_region(free_cells(grid, radius))
    if not is_whole(robots, 1, len(region)):
        what = "the free cells of the largest region"
        if 2.0 * radius > grid.resolution:
            what = f"the cells of the largest region that are {radius:g} m or more from walls"
        allowed = f"a whole number, 1 to {len(region):,}: {what}"
        if not len(region):
            allowed = f"smaller robots or another map: no cell is {radius:g} m or more from walls"
        raise SettingError.of("ROBOTS", "robots", shown(robots), allowed=allowed)
    rng = np.random.Generator(np.random.PCG64(int(seed)))
    ends: list[list[CellLike]] = []
    for where in ("starts", "goals"):
        placed = apart(region[rng.permutation(len(region))], int(robots), 2.0 * radius / grid.resolution)
        if len(placed) < robots:
            found = f"only {len(placed):,} discs of radius {radius:g} m found room at their {where}"
            raise SettingError.of(
                "ROBOTS", "robots", f"{robots}: {found}", allowed=f"1 to {len(placed):,} with this seed",
                todo="take fewer or smaller robots, another seed, or a larger map",
            )  # fmt: skip
        ends.append(placed.tolist())
    return Fleet(grid, [Agent(start, goal) for start, goal in zip(*ends, strict=True)])


def export_fleet(plan: FleetPlan, fleet: Fleet, path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Write a fleet, or its plan, for other programs.

    Parameters
    ----------
    plan : a plan of the fleet; written to ``.txt`` alone.
    fleet : the robots.
    path : is overwritten. ``.scen``: MovingAI scenario; ``.json``: problem of the League of Robot Runners, with ``.map``,
        ``.agents`` and ``.tasks`` of the same name beside it; ``.txt``: the log of LaCAM, which its visualiser reads.

    Returns
    -------
    The files that were written.

    Raises
    ------
    UsageError : ``SUFFIX``: another ending; ``EXPORT``: no paths to write.
    SettingError : ``SCEN_LENGTH``: a robot that walls keep from its goal, in a ``.scen``.
    FileError : ``FILE_WRITE``.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> files = lampyris.export_fleet(lampyris.plan_fleet(fleet), fleet, "plan.txt")
    >>> [file.name for file in files]
    ['plan.txt']
    """
    of_kind("plan", plan, FleetPlan)
    of_kind("fleet", fleet, Fleet)
    name = file_name("path", path)
    lengths: list[tuple[int, int] | None] = []
    if name.lower().endswith(".scen"):
        free = ~fleet.grid.blocked
        for one in fleet.robots:
            exact = int(solve(free, STEPS["octile"], one.goal).exact[one.start[1], one.start[0]])
            lengths.append(None if exact < 0 else octile_pair(exact))
    return write_fleet(plan, fleet, name, lengths)


def load_fleet(
    path: str | os.PathLike[str],
    map_: str | os.PathLike[str] | Grid,
    robots: int | None = None,
) -> Fleet:
    """A fleet from a MovingAI ``.scen`` (its first lines) or from a list of agents.

    Parameters
    ----------
    path : a file whose name ends in ``.scen``, a list of agents (YAML, JSON, CSV), or a problem of the League of Robot
        Runners (JSON), see :func:`lampyris.io.fleet_files.read_agents`.
    map_ : the map: a file, a bundled name or a grid.
    robots : how many; None: all.

    Raises
    ------
    FileError, SceneError, LimitError : see :mod:`lampyris.io.fleet_files`.
    SettingError : ``ROBOTS``: no whole number of at least 1.

    Examples
    --------
    >>> import lampyris
    >>> from pathlib import Path
    >>> _ = Path("agents.csv").write_text("start_x,start_y,goal_x,goal_y\\n1,8,8,2\\n8,2,1,8\\n")
    >>> lampyris.load_fleet("agents.csv", "guide").robots[0].goal
    (8, 2)
    """
    name = file_name("path", path)
    if robots is not None and not is_whole(robots, 1):
        raise SettingError.of("ROBOTS", "robots", shown(robots), allowed="a whole number >= 1, or None")
    document = MapDocument(map_) if isinstance(map_, Grid) else load_map(map_)
    return read_fleet(name, document, robots).fleet


def read_fleet(path: str, document: MapDocument, robots: int | None) -> FleetFile:
    """The fleet of a file, by its suffix; see :func:`load_fleet`."""
    if path.lower().endswith(".scen"):
        return read_scen_fleet(path, document, robots)
    return read_agents(path, document.grid, robots)
