"""Lifelong fleets: tasks that arrive over time, and what the robots made of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.noun import Noun
from lampyris._core.predicates import cell_of, cells, numbers
from lampyris._core.scalars import is_whole
from lampyris._core.values import Value
from lampyris.errors import SettingError, plural, shown
from lampyris.model.grid import Grid, frozen
from lampyris.model.plan import Status
from lampyris.typing import Cell, CellLike, Cells

MAX_RELEASE = 10**9
MAX_WINDOW = 10_000
_SENTENCES = {
    Status.FOUND: "All ticks were driven.",
    Status.LIMIT: "Stopped at the budget.",
    Status.CANCELLED: "Stopped on request.",
}


@dataclass(frozen=True, slots=True, repr=False)
class FleetTask(Noun):
    """A task for one robot: cells to visit in the given order, such as pickup and delivery.

    Parameters
    ----------
    stops : one or more cells (x, y).
    release : the tick from which on a robot may have it.
    robot : the robot that has to do it; None: whichever is free.

    Raises
    ------
    SettingError : ``TASK``.

    Examples
    --------
    >>> import lampyris
    >>> task = lampyris.FleetTask(stops=((1, 8), (8, 2)), release=5)
    >>> task.stops, task.release
    (((1, 8), (8, 2)), 5)
    """

    stops: tuple[Cell, ...]
    release: int = 0
    robot: int | None = None

    if TYPE_CHECKING:

        def __init__(
            self, stops: Sequence[CellLike], release: int = ..., robot: int | None = ...
        ) -> None: ...

    def __post_init__(self) -> None:
        given: Any = self.stops
        made = [cell_of(one) for one in given] if isinstance(given, tuple | list) else []
        if not made or any(one is None for one in made):
            raise SettingError(
                "TASK", shown(given), where="stops", allowed="a list of one or more cells (x, y)"
            )
        object.__setattr__(self, "stops", tuple(made))
        if not is_whole(self.release, 0, MAX_RELEASE):
            raise SettingError(
                "TASK", shown(self.release), where="release", allowed="a tick, a whole number >= 0"
            )
        if self.robot is not None and not is_whole(self.robot, 0):
            raise SettingError(
                "TASK", shown(self.robot), where="robot", allowed="the number of a robot, or None"
            )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LifelongTrace(Value):
    """The motion of n robots over T ticks with k tasks.

    Parameters
    ----------
    status : ``found``: all ticks were driven; ``limit`` or ``cancelled``: the budget ended it.
    grid : the map.
    planner, window, seed : the planner of each window, the ticks that were driven before it planned again, the seed.
    xy : int32 (T + 1, n, 2): the cell of every robot at every tick.
    tasks : all that were released, in the order in which they were; drawn ones as they were needed.
    robot : int32 (k,): who had each task; -1: nobody.
    assigned, done : int32 (k,), ticks; -1: not.
    stop_ticks : for each task the ticks at which its stops were visited, as far as they were.
    faults : robots that stopped permanently, and the tick: pairs.
    windows, fallbacks : how often was planned, and how often of these by PIBT, because the
        planner had found nothing within its limit.
    notes : notes for the user.
    timing : seconds by stage; the only part that differs from run to run.

    Raises
    ------
    SettingError : ``LIFELONG_TRACE``: an array of another kind or shape.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> trace = lampyris.lifelong_fleet(fleet, ticks=50)
    >>> trace.planner, int((trace.done >= 0).sum()) > 0
    ('pibt', True)
    """

    status: Status
    grid: Grid
    planner: str
    window: int
    seed: int
    xy: NDArray[np.int32]
    tasks: tuple[FleetTask, ...]
    robot: NDArray[np.int32]
    assigned: NDArray[np.int32]
    done: NDArray[np.int32]
    stop_ticks: tuple[tuple[int, ...], ...]
    faults: tuple[tuple[int, int], ...] = ()
    windows: int = 0
    fallbacks: int = 0
    notes: tuple[str, ...] = ()
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        for name, kind in (("status", Status), ("grid", Grid)):
            if not isinstance(getattr(self, name), kind):
                raise SettingError(
                    "LIFELONG_TRACE", shown(getattr(self, name)), where=name, allowed=kind.__name__
                )
        given: Any = self.tasks
        if not isinstance(given, tuple | list) or not all(isinstance(one, FleetTask) for one in given):
            raise SettingError("LIFELONG_TRACE", shown(given), where="tasks", allowed="a list of tasks")
        object.__setattr__(self, "tasks", tuple(given))
        xy = numbers(self.xy, (None, None, 2))
        flat = None if xy is None else cells(xy.reshape(-1, 2).astype(np.int64))
        if xy is None or flat is None or not len(xy):
            raise SettingError("LIFELONG_TRACE", shown(self.xy), where="xy", allowed="cells (T + 1, n, 2)")
        object.__setattr__(self, "xy", frozen(flat.reshape(xy.shape).astype(np.int32)))
        for name in ("robot", "assigned", "done"):
            array = numbers(getattr(self, name), (len(self.tasks),))
            if array is None or not ((array % 1 == 0) & (np.abs(array) < 2**31)).all():
                allowed = f"whole numbers ({len(self.tasks)},)"
                raise SettingError("LIFELONG_TRACE", shown(getattr(self, name)), where=name, allowed=allowed)
            object.__setattr__(self, name, frozen(array.astype(np.int32)))
        for name in ("stop_ticks", "faults"):
            rows: Any = getattr(self, name)
            right = isinstance(rows, tuple | list) and all(isinstance(one, tuple | list) for one in rows)
            if not right or not all(is_whole(tick, 0) for one in rows for tick in one):
                raise SettingError(
                    "LIFELONG_TRACE", shown(rows), where=name, allowed="lists of whole numbers"
                )
            object.__setattr__(self, name, tuple(tuple(one) for one in rows))

    def _brief(self) -> str:
        return (
            f"<LifelongTrace {self.status} by {self.planner}: {plural(self.robots, 'robot')}, {plural(self.ticks, 'tick')}, "
            f"{self.completed} tasks done, throughput {self.throughput:.3f} a tick>"
        )

    def __bool__(self) -> bool:
        return bool(self.status)

    @property
    def sentence(self) -> str:
        """What a person should read."""
        return _SENTENCES.get(self.status, self.status.sentence)

    @property
    def robots(self) -> int:
        """How many."""
        return len(self.xy[0])

    @property
    def ticks(self) -> int:
        """How many were driven."""
        return len(self.xy) - 1

    @property
    def completed(self) -> int:
        """Tasks that were done."""
        return int(np.count_nonzero(self.done >= 0))

    @property
    def throughput(self) -> float:
        """Tasks done a tick."""
        return self.completed / self.ticks if self.ticks else 0.0

    @property
    def service_times(self) -> NDArray[np.int32]:
        """Ticks from release to completion of the tasks that were done, int32; empty where none was."""
        finished = self.done >= 0
        release = np.array([one.release for one in self.tasks], dtype=np.int32)
        return frozen((self.done - release)[finished])

    @property
    def mean_service_time(self) -> float | None:
        """Mean of :attr:`service_times`; None where no task was done."""
        times = self.service_times
        return float(times.mean()) if len(times) else None

    @property
    def utilisation(self) -> float:
        """Share of robots and ticks with a task."""
        held = self.assigned >= 0
        end = np.where(self.done >= 0, self.done, self.ticks)
        total = self.ticks * self.robots
        return float((end - self.assigned)[held].sum()) / total if total else 0.0

    @property
    def moving(self) -> float:
        """Share of robots and ticks in which a robot moved."""
        moved = (np.diff(self.xy, axis=0) != 0).any(axis=2)
        return float(moved.mean()) if moved.size else 0.0

    @property
    def paths(self) -> tuple[Cells, ...]:
        """The cells of each robot, int32 (T + 1, 2)."""
        return tuple(self.xy[:, k] for k in range(self.robots))
