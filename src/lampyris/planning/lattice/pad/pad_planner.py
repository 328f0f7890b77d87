"""The planner ``pad``: planning with adaptive dimensionality on the lattice of states."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import PER_STATE, demand_states
from lampyris._core.settings import flag, number
from lampyris.kernels.lattice.search import EXHAUSTED
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.lattice.ends.joined_end import JoinedEnd, lowered
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.lattice import StateLattice
from lampyris.planning.lattice.lattice_planner import LatticeSession
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.field import LowField
from lampyris.planning.lattice.pad.regions import Sphere, Spheres, Tunnel
from lampyris.planning.lattice.pad.rounds import PadSearch, Rounds, recorded
from lampyris.planning.lattice.search import LatticeSearch
from lampyris.planning.lattice.settings import LatticeSettings
from lampyris.typing import Cell, Cells

SPHERE = 4.0
"""Radius of a new sphere, in displacements of the longest motion."""
TUNNEL = 1.5
"""Half the width of a tunnel, in displacements of the longest motion."""
AT_BUDGET = "Stopped at the budget before the path was as good as the weight asks."
_LEAST = 4
"""Cells that either has at least."""


def cells_of(metres: float | None, motions: float, lattice: StateLattice, grid: Grid) -> float:
    """A length in cells, or so many displacements of the longest motion."""
    if metres is not None:
        return metres / grid.resolution
    return max(motions * float(np.abs(lattice.cell).max()), _LEAST)


def sphere_radius_setting(motions: float) -> Any:
    """The setting ``sphere_radius`` of both planners; by default so many displacements of the longest motion."""
    return number(None, 1e-3, 1e4, unit="m", none=f"{motions:g} times the lattice's longest motion")


def sphere_growth_setting() -> Any:
    """The setting ``sphere_growth`` of both planners."""
    return number(1.5, 1.05, 10.0)


def tunnel_setting() -> Any:
    """The setting ``tunnel`` of both planners."""
    return number(None, 1e-3, 1e4, unit="m", none="1.5 times the lattice's longest motion")


@dataclass(frozen=True, slots=True)
class PadPlanner(LatticeSettings):
    """Planning with adaptive dimensionality: cells almost everywhere, poses in spheres and along a tunnel.

    Parameters
    ----------
    sphere_radius : radius of a new sphere, in which poses are planned.
    sphere_growth : factor by which a sphere grows where it is too small.
    tunnel : half the width of the tunnel around the planned path, in which a path of poses is searched.
    shortcut : as of ``lattice``: exact curves to both ends, and in place of pieces that cost more.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    sphere_radius: float | None = sphere_radius_setting(SPHERE)
    sphere_growth: float = sphere_growth_setting()
    tunnel: float | None = tunnel_setting()
    shortcut: bool = flag(True, title="shortcuts")

    name: ClassVar[str] = "pad"
    traits: ClassVar[Traits] = Traits(optimal=False, incremental=True, plans_headings=True)
    summary: ClassVar[str] = (
        "Adaptive dimensionality: cells where they do, poses where they must; with a bound."
    )
    source: ClassVar[str] = (
        "Gochev, Cohen, Butzke, Safonova, Likhachev 2011 and 2013; the low graph, the bound and the order are ours."
    )

    def begins_anywhere(self, scene: Scene) -> bool:
        """Whether paths in a scene begin at exactly the pose that is asked for, where a curve to the lattice is free."""
        return self.shortcut

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> PadSession:
        """Start a session. Nothing is drawn from ``rng``; the rounds are recorded always (:attr:`Plan.rounds`)."""
        return PadSession(self, scene)


class PadSession(LatticeSession):
    """Remembers, besides the map, the field of the projected graph, and the spheres and the tunnel of the last plan.

    Parameters
    ----------
    settings : the planner.
    scene : what to plan in.
    """

    def __init__(self, settings: PadPlanner, scene: Scene) -> None:
        super().__init__(settings, scene, shortcut=settings.shortcut)
        self._pad = settings
        self._lowered: tuple[NDArray[np.int64], JoinedEnd, NDArray[np.int64]] | None = None
        self._walls = scene.grid.blocked
        self._spheres: tuple[Sphere, ...] = ()
        self._tunnel: Tunnel | None = None

    def _new_search(self, obstacles: Iterable[Cell] = ()) -> PadSearch:
        """The memory of a search on the map as it is now.

        Raises
        ------
        LimitError : ``MEMORY``.
        """
        grid, lattice = self._scene.grid, self._lattice
        # Two searches, and the order of one.
        demand_states(
            grid.height, grid.width, lattice.border, lattice.shape.headings + 1, self._settings.name,
            each=2 * PER_STATE + 8,
        )  # fmt: skip
        return PadSearch(LatticeMap(grid, lattice, obstacles))

    def _noted(self, search: LatticeSearch) -> list[Cells]:
        assert isinstance(search, PadSearch)
        noted: list[Cells] = []
        search.expanded = search.hybrid.expanded = noted
        return noted

    def _forget_map(self) -> None:
        """Nothing: the next search takes over what still holds."""

    def _search_among(self, obstacles: frozenset[Cell]) -> LatticeSearch:
        walls = self._scene.grid.blocked
        if obstacles:
            walls = walls.copy()
            for x, y in sorted(obstacles):
                walls[y, x] = True
        search = self._search
        if not isinstance(search, PadSearch):
            self._walls = walls
            return self._new_search(obstacles)
        changed = np.argwhere(walls != self._walls)
        if len(changed):
            search.take_over(
                LatticeMap(self._scene.grid, self._lattice, obstacles), [(x, y) for y, x in changed.tolist()]
            )
            self._walls = walls
        return search

    def _searched(self, search: LatticeSearch, query: Query, limit: int | None) -> Plan:
        assert isinstance(search, PadSearch)
        lattice_map = search.lattice_map
        costs, query = self._projected(search, query)
        if not query.starts or not query.goals:
            return self._none_found(EXHAUSTED, 0)
        radius = cells_of(self._pad.sphere_radius, SPHERE, self._lattice, self._scene.grid)
        spheres = Spheres(radius, self._pad.sphere_growth)
        spheres.all = list(self._spheres)
        width = cells_of(self._pad.tunnel, TUNNEL, self._lattice, self._scene.grid)
        rounds = Rounds(search, costs, query, self._settings.weight, spheres, width, limit)
        old = self._tunnel
        if old is not None and not any(cell in old for cell, _ in query.starts):
            old = None
        outcome = rounds.run(old)
        found = rounds.result()
        if found is None:
            return self._none_found(outcome, rounds.expansions)
        tunnel = rounds.tunnel
        self._tunnel = tunnel
        self._spheres = tuple(one for one in spheres.all if tunnel is not None and tunnel.meets(one))
        plan = self._plan_of(found, "" if rounds.enough() else AT_BUDGET, search, query.ends)
        record = tuple(recorded(one, lattice_map) for one in rounds.records)
        return replace(plan, expansions=rounds.expansions, iterations=len(record), rounds=record)

    def _projected(self, search: PadSearch, query: Query) -> tuple[NDArray[np.int64], Query]:
        """Costs to the goal in the projected graph, and the query with those of its ends that they are known at.

        To a joined goal they are those to the cheapest of its states, lowered; where walls separate that from the starts, to the
        next one.
        """
        goal, starts = query.ends.goal, {cell for cell, _ in query.starts}
        cells = dict.fromkeys(cell for cell, _ in query.goals)
        bases: list[tuple[int, ...]] = [tuple(sorted(cells))] if goal is None else [(cell,) for cell in cells]
        if search.field is not None and search.field.goals in bases:
            bases.insert(0, search.field.goals)
        reached: NDArray[np.bool_] = np.zeros(search.lattice_map.walls.size, dtype=np.bool_)
        for base in bases:
            if reached[list(base)].any():
                continue
            if search.field is None or search.field.goals != base:
                search.field = LowField(search.lattice_map, base)
            costs = search.field.costs(starts)
            reached |= costs >= 0
            if any(costs[cell] >= 0 for cell in starts):
                break
        ends = [k for k, (cell, _) in enumerate(query.goals) if costs[cell] >= 0]
        if goal is not None and ends:
            if self._lowered is None or self._lowered[0] is not costs or self._lowered[1] is not goal:
                self._lowered = costs, goal, lowered(costs, goal.only(ends))
            costs = self._lowered[2]
        begun = [k for k, (cell, _) in enumerate(query.starts) if costs[cell] >= 0]
        return costs, query.starting_at(begun).ending_at(ends)

    @property
    def settled(self) -> int:
        """Cells to which the field of the projected graph has given a cost since it was made."""
        search = self._search
        return search.field.settled if isinstance(search, PadSearch) and search.field is not None else 0
