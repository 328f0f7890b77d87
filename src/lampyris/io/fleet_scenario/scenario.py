"""FleetScenario: everything that decides a run of a fleet, and where its map comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lampyris._core.scalars import MAX_SEED, SEED_RANGE, in_range, is_whole
from lampyris.errors import SettingError, of_kind, shown
from lampyris.io.scenario.scenario import MapSource
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.lifelong import FleetTask
from lampyris.model.grid import Grid

PLANNER = "lacam"
"""The planner where none is named."""
LIFELONG_PLANNER = "pibt"
"""The same of lifelong fleets."""
MOVES = "four-connected"
MAX_ITERATIONS = 10**12
MAX_TIME = 1e12
"""Faults happen before this second or tick."""


@dataclass(frozen=True, slots=True)
class Lifelong:
    """That robots which have arrived get new tasks.

    Parameters
    ----------
    ticks : how long.
    window : ticks that are driven before planning again; None: the planner's own default.
    tasks : see :func:`lampyris.lifelong_fleet`; None: random cells.
    """

    ticks: int
    window: int | None = None
    tasks: tuple[FleetTask, ...] | None = None


@dataclass(frozen=True, slots=True)
class FleetExecution:
    """That the robots drive in continuous time.

    Parameters
    ----------
    settings : of the drive, by name: :class:`lampyris.model.settings.fleet_drive.FleetDriveSettings`.
    delays : random delays.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    delays: Delays = field(default_factory=Delays)


@dataclass(frozen=True, slots=True)
class FleetScenario:
    """Everything that determines a run of a fleet; equal scenarios give the same bytes, unless seconds end a search.

    Parameters
    ----------
    fleet : the map with all robots.
    planner, settings : name of the planner, and its settings.
    moves : ``four-connected`` or ``octile``.
    seed : seed of all random draws.
    iterations, seconds : limits of the planner; None: none. See :func:`lampyris.plan_fleet`.
    execution : settings of the drive in continuous time; None: the plan is not driven.
    lifelong : settings of lifelong tasks; None: there are none. Not together with ``execution``.
    faults : pairs (robot, time): robots that stop permanently, at a second of the drive or a tick of the lifelong fleet.
    name : what to call it.
    map : where the map comes from; None: from its cells. Left out of comparisons, like the last two.
    ground : the map before its cells were made larger; None: the fleet's own.
    notes : notes for the user.
    where : the file it was read from.

    Raises
    ------
    SettingError : ``TYPE``: no fleet; ``SEED``; ``FLEET_SCENARIO``: an execution together with a lifelong fleet, or faults
        with neither.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> scenario = lampyris.FleetScenario(fleet, planner="pibt", seed=3)
    >>> lampyris.run(scenario).status.value
    'found'
    """

    fleet: Fleet
    planner: str = PLANNER
    settings: Mapping[str, Any] = field(default_factory=dict)
    moves: str = MOVES
    seed: int = 0
    iterations: int | None = None
    seconds: float | None = None
    execution: FleetExecution | None = None
    lifelong: Lifelong | None = None
    faults: tuple[tuple[int, float], ...] = ()
    name: str = ""
    map: MapSource | None = field(default=None, compare=False)
    ground: Grid | None = field(default=None, compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)
    where: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        of_kind("fleet", self.fleet, Fleet)
        of_kind("execution", self.execution, FleetExecution, none=True)
        of_kind("lifelong", self.lifelong, Lifelong, none=True)
        of_kind("settings", self.settings, Mapping)
        for name in ("planner", "moves", "name", "where"):
            of_kind(name, getattr(self, name), str)
        if not is_whole(self.seed, 0, MAX_SEED):
            raise SettingError.of("SEED", "seed", shown(self.seed), allowed=SEED_RANGE)
        if self.iterations is not None and not is_whole(self.iterations, 1, MAX_ITERATIONS):
            allowed = f"a whole number, 1 to {MAX_ITERATIONS:,}, or None"
            raise SettingError.of("BUDGET", "iterations", shown(self.iterations), allowed=allowed)
        if self.seconds is not None and not (in_range(self.seconds, 0.0, 1e6) and self.seconds > 0.0):
            allowed = "more than 0 and at most 1e6, or None"
            raise SettingError.of("BUDGET", "seconds", shown(self.seconds), allowed=allowed)
        object.__setattr__(self, "faults", _faults(self.faults))
        if self.execution is not None and self.lifelong is not None:
            raise SettingError.of(
                "FLEET_SCENARIO", "lifelong", "`execute` and `lifelong`", allowed="one of them"
            )
        if self.faults and self.execution is None and self.lifelong is None:
            raise SettingError.of(
                "FLEET_SCENARIO", "faults", "faults of a fleet that does not drive", allowed="with `execute` or `lifelong`"
            )  # fmt: skip

    @property
    def reactive(self) -> bool:
        """Whether the robots drive without a plan (policy ``orca``)."""
        return self.execution is not None and self.execution.settings.get("policy") == "orca"

    @property
    def drawn(self) -> Grid:
        """The map as it was drawn: what ``map`` and its hash are of."""
        return self.fleet.grid if self.ground is None else self.ground


def _faults(given: Any) -> tuple[tuple[int, float], ...]:
    """Pairs of a robot and a time.

    Raises
    ------
    SettingError : ``FAULTS``: others.
    """
    made = []
    for k, one in enumerate(given if isinstance(given, tuple | list) else (given,)):
        pair = one if isinstance(one, tuple | list) and len(one) == 2 else (None, None)
        if not is_whole(pair[0], 0) or not in_range(pair[1], 0.0, MAX_TIME) or pair[1] == MAX_TIME:
            allowed = f"pairs (robot, time), 0 <= time < {MAX_TIME:g}"
            raise SettingError("FAULTS", shown(one), where=f"faults[{k}]", allowed=allowed, setting="faults")
        made.append((int(pair[0]), pair[1]))
    return tuple(made)
