"""Fleets with tasks that arrive over time: lifelong_fleet, load_tasks.

Nothing leaves :func:`lifelong_fleet` that the referee has not re-checked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lampyris import referee
from lampyris._core import cancellation
from lampyris._core.arrays import index_array
from lampyris._core.cancellation import Cancelled
from lampyris._core.limits import MEMORY
from lampyris._core.predicates import cell_of
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_whole
from lampyris.errors import SettingError, UsageError, callable_or_none, file_name, of_kind, shown
from lampyris.io.task_files import read_tasks
from lampyris.kernels import loading
from lampyris.model.fleet.fleet import FORGIVEN, MOST_RADIUS, Fleet
from lampyris.model.fleet.lifelong import MAX_WINDOW, FleetTask, LifelongTrace
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.model.settings.simulation import MAX_TICKS
from lampyris.planning.base import Budget
from lampyris.sim.fleet.detours import late_faults
from lampyris.sim.fleet.lifelong import PLANNERS, WINDOWS, LifelongRun, drive_on
from lampyris.sim.fleet.task_queue import TaskQueue
from lampyris.typing import Cells

_EACH = 24
"""Bytes of a robot and a tick."""


def lifelong_fleet(
    fleet: Fleet,
    ticks: int,
    *,
    tasks: Sequence[FleetTask] | None = None,
    planner: str = PLANNERS[0],
    window: int | None = None,
    faults: Sequence[tuple[int, int]] = (),
    seed: int = 0,
    budget: Budget | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> LifelongTrace:
    """Robots that get a new task whenever they have completed one, planned window by window; re-checked by the referee.

    In every window a planner plans for all robots, ``window`` ticks of the plan are driven, robots that have completed
    their tasks get new ones, and it plans again (rolling-horizon collision resolution, Li et al. 2021).

    ::

        fleet = lampyris.random_fleet(lampyris.load_grid("warehouse-200"), 100)
        trace = lampyris.lifelong_fleet(fleet, 500)
        trace.throughput, trace.utilisation, trace.mean_service_time

        lampyris.lifelong_fleet(fleet, 500, tasks=[lampyris.FleetTask([(3, 4), (60, 20)], release=10)], planner="lacam")

    Parameters
    ----------
    fleet : the map and the starts; each robot's goal is its first task.
    ticks : how many to drive.
    tasks : released over time; the oldest goes to the nearest free robot. None: a robot without a task gets a random
        cell of the largest region.
    planner : ``pibt``: fastest, plans for one window at a time; ``lacam``: plans complete paths to the goals, or near
        them where two robots have the same goal.
    window : ticks driven before it plans again; None: 1 with ``pibt``, 5 with ``lacam``.
    faults : pairs (robot, tick): each stops permanently and becomes a wall for the others; another robot gets its task.
    seed : of the planner and the random tasks.
    budget : ``seconds`` and ``stop`` end the call; what was driven is returned.
    progress : called after each window with the ticks driven and their total.

    Raises
    ------
    SettingError : ``TICKS``, ``TASK``, ``PLANNER``, ``WINDOW``, ``FAULTS``, ``SEED``, ``FLEET_ROBOT``: an invalid
        argument.
    LimitError : ``MEMORY``: the tables or the trace would take more memory than is allowed.
    InternalFault : the referee refused the trace; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> trace = lampyris.lifelong_fleet(fleet, ticks=50)
    >>> trace.xy.shape
    (51, 4, 2)
    """
    of_kind("fleet", fleet, Fleet)
    of_kind("budget", budget, Budget, none=True)
    callable_or_none("progress", progress)
    if not is_whole(ticks, 1, MAX_TICKS):
        raise SettingError.of("TICKS", "ticks", shown(ticks), allowed=f"a whole number, 1 to {MAX_TICKS:,}")
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    if not isinstance(planner, str) or planner not in PLANNERS:
        raise UsageError(
            "PLANNER", f"{shown(planner)} plans no windows", allowed=", ".join(PLANNERS), setting="planner"
        )
    keeps_apart(fleet)
    if window is not None and not is_whole(window, 1, MAX_WINDOW):
        allowed = f"a whole number, 1 to {MAX_WINDOW:,}, or None"
        raise SettingError.of("WINDOW", "window", shown(window), allowed=allowed)
    n, grid = len(fleet.robots), fleet.grid
    given = _tasks(tasks, fleet)
    chains = _tasks(
        [FleetTask((stop,), 0, k) for k, one in enumerate(fleet.robots) for stop in one.tasks], fleet
    )
    failures = _faults(faults, n)
    needed = -(-int(ticks) * n * _EACH // 2**20)
    MEMORY.demand(needed, f"the trace of {n:,} robots and {ticks:,} ticks", instead="take fewer")
    began, loaded = loading.wall(), loading.seconds()
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(seed), spawn_key=(2,))))
    # The goals of the fleet and the tasks of its agents are the first that each robot has.
    first = [FleetTask((one.goal,), 0, k) for k, one in enumerate(fleet.robots) if one.goal != one.start]
    first = sorted([*first, *chains], key=lambda one: one.robot or 0)
    queue = TaskQueue([*first, *given], n, _region(grid) if tasks is None else None, rng)
    wide = WINDOWS[planner] if window is None else int(window)
    run = LifelongRun(grid, fleet.starts, queue, planner, wide, int(seed), failures)
    seconds, stop = (None, None) if budget is None else (budget.seconds, budget.stop)
    status = Status.FOUND
    with cancellation.watching(seconds, stop) as own:
        try:
            drive_on(run, int(ticks), progress)
        except Cancelled:
            if own is None or (own.outer is not None and own.outer.is_over):
                raise
            status = Status.CANCELLED if own.was_cancelled else Status.LIMIT
    trace = _trace(status, run, queue, grid, planner, wide, int(seed), failures)
    driven = loading.wall()
    referee.demand(referee.check_lifelong(trace))
    ended, loaded = loading.wall(), loading.seconds() - loaded
    timing = {
        "simulate_s": driven - began, "referee_s": ended - driven, "total_s": ended - began + loaded,
        "loading_s": loaded,
    }  # fmt: skip
    return replace(trace, timing=timing)


def load_tasks(path: str | os.PathLike[str], grid: Grid) -> tuple[FleetTask, ...]:
    """The tasks of a table (CSV); see :func:`lampyris.io.task_files.read_tasks`.

    Parameters
    ----------
    path : the table.
    grid : the map that its cells belong to.

    Raises
    ------
    FileError, LimitError : see there.

    Examples
    --------
    >>> import lampyris
    >>> from pathlib import Path
    >>> _ = Path("tasks.csv").write_text("release,x,y\\n0,1,8\\n4,8,2\\n")
    >>> lampyris.load_tasks("tasks.csv", lampyris.load_grid("guide"))[0].stops
    ((1, 8),)
    """
    of_kind("grid", grid, Grid)
    return read_tasks(file_name("path", path), grid)


def _trace(
    status: Status, run: LifelongRun, queue: TaskQueue, grid: Grid, planner: str, window: int, seed: int,
    faults: list[tuple[int, int]],
) -> LifelongTrace:  # fmt: skip
    notes = []
    if run.counts.fallbacks:
        notes.append(
            f"{run.counts.fallbacks} of {run.counts.windows} windows were planned by PIBT: "
            f"{planner} had found no plan within its limit"
        )
    late = [one for one in faults if one[1] >= run.tick]
    if late:
        notes.append(late_faults(late, "ticks", run.tick))
    whole = np.int32
    return LifelongTrace(
        status, grid, planner, window, seed, np.array(run.xy), tuple(queue.tasks), np.array(queue.robot, whole),
        np.array(queue.assigned, whole), np.array(queue.done, whole), tuple(tuple(one) for one in queue.stops),
        tuple(one for one in faults if one[1] < run.tick), run.counts.windows, run.counts.fallbacks, tuple(notes),
    )  # fmt: skip


def _tasks(given: Any, fleet: Fleet) -> list[FleetTask]:
    if given is None:
        return []
    if not isinstance(given, tuple | list) or not all(isinstance(one, FleetTask) for one in given):
        raise SettingError.of("TASK", "tasks", shown(given), allowed="a list of lampyris.FleetTask, or None")
    grid = fleet.grid
    for k, one in enumerate(given):
        if one.robot is not None and one.robot >= len(fleet.robots):
            raise SettingError(
                "TASK", f"robot {one.robot}", where=f"tasks[{k}]", allowed=f"0 to {len(fleet.robots) - 1}"
            )
        for stop in one.stops:
            if not grid.contains(stop) or grid.blocked[stop[1], stop[0]]:
                raise SettingError(
                    "TASK", f"{stop}", where=f"tasks[{k}].stops", allowed="free cells of the map"
                )
    return list(given)


def keeps_apart(fleet: Fleet) -> Fleet:
    """The fleet, if the cells of its robots keep them apart.

    Raises
    ------
    SettingError : ``FLEET_ROBOT``: a robot too large for that.
    """
    radii = fleet.radii
    k = int(radii.argmax())
    if radii[k] > MOST_RADIUS * (1.0 + FORGIVEN):
        cell = fleet.grid.resolution
        raise SettingError(
            "FLEET_ROBOT", f"a radius of {radii[k] * cell:g} m, {radii[k]:.3g} cells", where=f"robots[{k}].robot",
            setting="robot.radius", allowed=f"at most {MOST_RADIUS:.3g} cells, {MOST_RADIUS * cell:.4g} m, in lifelong fleets",
        )  # fmt: skip
    return fleet


def _faults(given: Any, robots: int) -> list[tuple[int, int]]:
    allowed = f"pairs (robot, tick), robot 0 to {robots - 1}, each once"
    if not isinstance(given, tuple | list):
        raise SettingError.of("FAULTS", "faults", shown(given), allowed=allowed)
    made: dict[int, int] = {}
    for k, one in enumerate(given):
        pair = cell_of(one)
        if pair is None or not 0 <= pair[0] < robots or pair[1] < 0:
            raise SettingError("FAULTS", shown(one), where=f"faults[{k}]", allowed=allowed, setting="faults")
        if pair[0] in made:
            raise SettingError(
                "FAULTS", f"robot {pair[0]} twice", where=f"faults[{k}]", allowed=allowed, setting="faults"
            )
        made[pair[0]] = pair[1]
    return sorted(made.items(), key=lambda one: (one[1], one[0]))


def _region(grid: Grid) -> Cells:
    """The cells (x, y) of the largest connected region."""
    from scipy import ndimage  # bits: labels, whole numbers

    labels = ndimage.label(~grid.blocked)[0]
    sizes = np.bincount(index_array(labels.ravel()))[1:]
    y, x = np.nonzero(labels == 1 + int(sizes.argmax()))
    return np.stack((x, y), axis=1).astype(np.int32)
