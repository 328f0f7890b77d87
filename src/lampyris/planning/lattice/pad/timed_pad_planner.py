"""The planner ``pad-sipp``: planning with adaptive dimensionality among obstacles with known tracks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from lampyris._core.limits import PER_STATE, demand_states
from lampyris.kernels.lattice.search import EXHAUSTED
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.field import LowField
from lampyris.planning.lattice.pad.pad_planner import (
    AT_BUDGET,
    TUNNEL,
    cells_of,
    sphere_growth_setting,
    sphere_radius_setting,
    tunnel_setting,
)
from lampyris.planning.lattice.pad.regions import Spheres
from lampyris.planning.lattice.pad.rounds import recorded
from lampyris.planning.lattice.pad.timed_rounds import ROUNDING, TimedRounds
from lampyris.planning.lattice.search import LatticeSearch
from lampyris.planning.lattice.timed.timed_planner import LatticeSipp, LatticeSippSession

TIMED_SPHERE = 2.5
"""Radius of a new sphere, in displacements of the longest motion: a pose in it has many intervals of time."""


@dataclass(frozen=True, slots=True)
class PadSipp(LatticeSipp):
    """Adaptive dimensionality among recorded obstacles: cells almost everywhere, poses and times where they are needed.

    It plans in the lattice of ``lattice-sipp``, with the same times, obstacles and guarantee: the arrival is at most
    ``weight`` times the earliest one of that lattice.

    Parameters
    ----------
    sphere_radius : of a new sphere, in which poses and times are planned.
    sphere_growth : factor by which a sphere grows where it is too small.
    tunnel : half the width of the tunnel around the planned path, in which a path of poses and times is searched.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    sphere_radius: float | None = sphere_radius_setting(TIMED_SPHERE)
    sphere_growth: float = sphere_growth_setting()
    tunnel: float | None = tunnel_setting()

    name: ClassVar[str] = "pad-sipp"
    traits: ClassVar[Traits] = Traits(optimal=False, sees_traffic=True, plans_headings=True)
    summary: ClassVar[str] = (
        "Adaptive dimensionality in time: poses and times only where known tracks ask for them."
    )
    source: ClassVar[str] = (
        "Gochev et al. 2011; Vemula, Muelling, Oh 2016; Phillips, Likhachev 2011; the bound and its proof are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> PadSippSession:
        """Start a session. Nothing is drawn from ``rng``; the rounds are recorded always (:attr:`Plan.rounds`)."""
        return PadSippSession(self, scene)


class PadSippSession(LatticeSippSession):
    """Remembers the map and the robot.

    Parameters
    ----------
    settings : the planner.
    scene : what to plan in; its recorded obstacles are where they are at ``Change.time_s``.
    """

    def __init__(self, settings: PadSipp, scene: Scene) -> None:
        super().__init__(settings, scene)
        self._pad = settings

    def _new_search(self, obstacles: Iterable[tuple[int, int]] = ()) -> LatticeSearch:
        """The map as it is now.

        Raises
        ------
        LimitError : ``MEMORY``.
        """
        grid, lattice = self._scene.grid, self._lattice
        demand_states(
            grid.height, grid.width, lattice.border, len(lattice.angles) + 1, self._settings.name,
            each=PER_STATE + 12,
        )  # fmt: skip
        return LatticeSearch(LatticeMap(grid, lattice, obstacles))

    def _searched(self, search: LatticeSearch, query: Query, limit: int | None) -> Plan:
        lattice_map, grid = search.lattice_map, self._scene.grid
        field = LowField(lattice_map, {cell for cell, _ in query.goals})
        costs = field.costs({cell for cell, _ in query.starts})
        query = query.starting_at([k for k, (cell, _) in enumerate(query.starts) if costs[cell] >= 0])
        if not query.starts:
            return self._none_found(EXHAUSTED, 0)
        radius, width = (
            cells_of(metres, motions, self._lattice, grid)
            for metres, motions in ((self._pad.sphere_radius, TIMED_SPHERE), (self._pad.tunnel, TUNNEL))
        )
        rounds = TimedRounds(
            self._timed(search), lattice_map, field, costs, query.starts, query.goals, self._settings.weight,
            Spheres(radius, self._pad.sphere_growth), width, limit,
        )  # fmt: skip
        outcome = rounds.run()
        found = rounds.best
        record = tuple(recorded(one, lattice_map) for one in rounds.records)
        if found is None or found.path is None:
            plan = self._closed(search, query, outcome, rounds.expansions)
            return replace(plan, iterations=len(record), rounds=record)
        arrival, bound = found.arrivals[-1], rounds.lower_bound
        least = arrival if arrival <= bound * (1 + ROUNDING) else bound
        found = replace(found, expansions=rounds.expansions, lower_bound=least)
        plan = self._timed_plan(found, search, "" if rounds.enough() else AT_BUDGET)
        return replace(plan, iterations=len(record), rounds=record)
