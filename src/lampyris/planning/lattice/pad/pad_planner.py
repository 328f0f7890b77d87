"""The planner ``pad``: planning with adaptive dimensionality on the lattice of states."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from lampyris._core.limits import PER_STATE, demand_states
from lampyris._core.settings import number
from lampyris.kernels.lattice.search import EXHAUSTED
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.lattice.lattice import StateLattice
from lampyris.planning.lattice.lattice_planner import LatticeSession, State
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
    sphere_radius : of a new sphere, in which poses are planned.
    sphere_growth : factor by which a sphere grows where it is too small.
    tunnel : half the width of the tunnel around the planned path, in which a path of poses is searched.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    sphere_radius: float | None = sphere_radius_setting(SPHERE)
    sphere_growth: float = sphere_growth_setting()
    tunnel: float | None = tunnel_setting()

    name: ClassVar[str] = "pad"
    traits: ClassVar[Traits] = Traits(optimal=False, incremental=True, plans_headings=True)
    summary: ClassVar[str] = (
        "Adaptive dimensionality: cells where they do, poses where they must; with a bound."
    )
    source: ClassVar[str] = (
        "Gochev, Cohen, Butzke, Safonova, Likhachev 2011 and 2013; the low graph, the bound and the order are ours."
    )

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
        super().__init__(settings, scene)
        self._pad = settings
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

    def _searched(
        self, search: LatticeSearch, starts: list[State], goals: list[State], limit: int | None
    ) -> Plan:
        assert isinstance(search, PadSearch)
        lattice_map = search.lattice_map
        known = [(lattice_map.index(cell), h) for cell, h in starts]
        wanted = [(lattice_map.index(cell), h) for cell, h in goals]
        goal_cells = tuple(sorted({cell for cell, _ in wanted}))
        if search.field is None or search.field.goals != goal_cells:
            search.field = LowField(lattice_map, goal_cells)
        costs = search.field.costs({cell for cell, _ in known})
        known = [one for one in known if costs[one[0]] >= 0]
        if not known:
            return self._none_found(EXHAUSTED, 0)
        radius = cells_of(self._pad.sphere_radius, SPHERE, self._lattice, self._scene.grid)
        spheres = Spheres(radius, self._pad.sphere_growth)
        spheres.all = list(self._spheres)
        width = cells_of(self._pad.tunnel, TUNNEL, self._lattice, self._scene.grid)
        rounds = Rounds(search, costs, known, wanted, self._settings.weight, spheres, width, limit)
        old = self._tunnel
        if old is not None and not any(cell in old for cell, _ in known):
            old = None
        outcome = rounds.run(old)
        found = rounds.result()
        if found is None:
            return self._none_found(outcome, rounds.expansions)
        tunnel = rounds.tunnel
        self._tunnel = tunnel
        self._spheres = tuple(one for one in spheres.all if tunnel is not None and tunnel.meets(one))
        plan = self._plan_of(found, search, "" if rounds.enough() else AT_BUDGET)
        record = tuple(recorded(one, lattice_map) for one in rounds.records)
        return replace(plan, expansions=rounds.expansions, iterations=len(record), rounds=record)

    @property
    def settled(self) -> int:
        """Cells to which the field of the projected graph has given a cost since it was made."""
        search = self._search
        return search.field.settled if isinstance(search, PadSearch) and search.field is not None else 0
