"""The planner ``lattice-sipp``: the earliest arrival of a robot with a shape among obstacles with known tracks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from lampyris._core.settings import number
from lampyris.kernels.lattice.search import EXHAUSTED, FOUND, LIMIT
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.planning.base import Traits
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.lattice_planner import LatticeSession
from lampyris.planning.lattice.search import LatticeSearch
from lampyris.planning.lattice.settings import LatticeSettings
from lampyris.planning.lattice.timed.discs import motion_discs
from lampyris.planning.lattice.timed.obstacles import known_obstacles
from lampyris.planning.lattice.timed.search import IntervalSearch, TimedFound
from lampyris.planning.lattice.timed.times import pose_times
from lampyris.typing import Floats

_CLOSED = "There is a path without moving obstacles, but these block every path at all times."
_AT_START = (
    "A moving obstacle is on the footprint at the start, or nearer to it than the discs that cover it allow."
)


@dataclass(frozen=True, slots=True)
class LatticeSipp(LatticeSettings):
    """SIPP on the state lattice: poses and times among recorded obstacles, with waits.

    A motion takes as long as its cost in ``lattice`` says: a metre in reverse ``reverse_cost`` times as long as one ahead,
    a radian turned in place as long as ``turn_cost`` metres. The robot starts, stops and waits at once, at any pose of the
    lattice. Time is planned only where an obstacle of the scene (:class:`lampyris.Recorded`) ever passes; obstacles of
    other kinds are left out, which a note says. The arrival is at most ``weight`` times the earliest, counted from the
    start.

    Parameters
    ----------
    speed_fraction : share of the robot's top speed at which it drives.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    weight: float = number(1.1, 1.0, 1e3)
    speed_fraction: float = number(1.0, 0.01, 1.0)

    name: ClassVar[str] = "lattice-sipp"
    traits: ClassVar[Traits] = Traits(optimal=False, sees_traffic=True, plans_headings=True)
    summary: ClassVar[str] = "SIPP on the state lattice: poses and times among obstacles with known tracks."
    source: ClassVar[str] = (
        "Phillips, Likhachev 2011; continuous time, footprints and the bound on the lattice are ours."
    )

    @property
    def promised_bound(self) -> float:
        """No path that it finds has a greater :attr:`lampyris.PosePath.bound`."""
        return self.weight

    def judged_by(self, resolution: float) -> dict[str, float]:
        """See :meth:`LatticeSettings.judged_by`."""
        return {**LatticeSettings.judged_by(self, resolution), "speed_fraction": self.speed_fraction}

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> LatticeSippSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return LatticeSippSession(self, scene)


class LatticeSippSession(LatticeSession):
    """Remembers the map, the robot and the heuristic of the goal.

    Parameters
    ----------
    settings : the planner.
    scene : what to plan in; its recorded obstacles are where they are at ``Change.time_s``.
    """

    def __init__(self, settings: LatticeSipp, scene: Scene) -> None:
        super().__init__(settings, scene)
        self._sipp = settings
        self._recorded = [one for one in scene.traffic if isinstance(one, Recorded)]
        self._unknown = len(scene.traffic) > len(self._recorded)

    def _searched(self, search: LatticeSearch, query: Query, limit: int | None) -> Plan:
        heuristic, query = self._known_goals(search, query)
        if not query.goals:
            return self._none_found(EXHAUSTED, 0)
        found = self._timed(search).find(heuristic, query.starts, query.goals, self._settings.weight, limit)
        if found.path is not None:
            return self._timed_plan(found, search)
        return self._closed(search, query, found.outcome, found.expansions)

    def _timed(self, search: LatticeSearch) -> IntervalSearch:
        """What searches among the obstacles."""
        discs = motion_discs(self._lattice, self._sipp.speed_fraction)
        cell = self._scene.grid.resolution
        obstacles = known_obstacles(self._recorded, cell, self._time_s * self._scene.robot.v_max / cell)
        made = IntervalSearch(search.lattice_map, discs, obstacles, self._sipp.speed_fraction)
        made.expanded = search.expanded
        return made

    def _closed(self, search: LatticeSearch, query: Query, outcome: int, expansions: int) -> Plan:
        """The answer where no path was found: is it walls, or moving obstacles?"""
        if outcome == LIMIT:
            return self._none_found(LIMIT, expansions)
        heuristic, query = self._known_goals(search, query)
        search.expanded = None  # what this expands is counted nowhere
        search.begin(heuristic, query.starts, query.goals)
        if search.improve(1e3, None) == FOUND:
            detail = _AT_START if expansions == 0 else _CLOSED
            return Plan(Status.HEMMED_IN, self._settings.name, expansions=expansions, detail=detail)
        return self._none_found(EXHAUSTED, expansions)

    def _timed_plan(self, found: TimedFound, search: LatticeSearch, detail: str = "") -> Plan:
        """The plan of a path with its times."""
        assert found.path is not None
        plan = self._plan_of(found.path, detail, search)
        assert plan.pose_path is not None
        scene, lattice = self._scene, self._lattice
        tick = scene.grid.resolution / scene.robot.v_max
        arm = scene.robot.radius / scene.grid.resolution
        times: Floats = tick * pose_times(
            found, lattice, motion_discs(lattice, self._sipp.speed_fraction).duration, arm
        )
        notes = plan.notes
        if self._unknown:
            notes = (*notes, "moving obstacles whose tracks are not known are left out")
        metres = self._sipp.speed_fraction * scene.grid.resolution
        path = replace(
            plan.pose_path,
            times=times,
            cost_m=found.arrivals[-1] * metres,
            lower_bound_m=min(found.lower_bound, found.arrivals[-1]) * metres,
        )
        waits = float((times[:, 1] - times[:, 0]).sum())
        attributes = dict(plan.attributes) | {"waits_s": waits}
        return replace(plan, pose_path=path, notes=notes, attributes=attributes, expansions=found.expansions)
