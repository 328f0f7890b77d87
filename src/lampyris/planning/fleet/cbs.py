"""CBS: conflict-based search for plans of least sum of costs."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import Cancelled
from lampyris._core.settings import check_settings, flag, under_name
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.planning.fleet.base import BOTH, FOUR, FleetTraits, Progress
from lampyris.planning.fleet.constraint_tree import ConstraintTree, Node
from lampyris.planning.fleet.distance_tables import FleetTables, tables_of
from lampyris.planning.fleet.lacam import LacamSearch
from lampyris.planning.fleet.pibt import is_stopped, unreachable
from lampyris.planning.fleet.space_time import FullError

SHOWN = 100
"""Nodes between two calls of ``progress``."""
TRIED = 400_000
"""Configurations times robots that LaCAM tries, to find out whether there is a plan at all."""


@dataclass(frozen=True, slots=True)
class Cbs:
    """Conflict-based search: each robot's cheapest path; where two collide, two branches, best bound first.

    The plan has the least sum of costs. It takes time exponential in the number of conflicts that cannot be avoided for free;
    dense fleets, and fleets that have to change places in narrow aisles, may take too long: the result is then
    the bound that was proved. Without a plan it never ends, so a search by LaCAM* comes first, which ends for small
    fleets (``no-path``).

    Parameters
    ----------
    disjoint : split a conflict into "this robot is there" and "it is not", so that no plan is in both branches;
        otherwise into one ban for each robot.
    bypass : take over a child's paths if they cost as much and have fewer conflicts, instead of branching.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    disjoint: bool = flag(True)
    bypass: bool = flag(True)

    name: ClassVar[str] = "cbs"
    traits: ClassVar[FleetTraits] = FleetTraits(moves=BOTH, complete=True, optimal=True)
    summary: ClassVar[str] = "CBS: least sum of costs; for some dozens of robots."
    source: ClassVar[str] = (
        "Sharon, Stern, Felner, Sturtevant, AIJ 219, 2015; cardinal conflicts and bypass: Boyarski et al., IJCAI 2015; "
        "estimate: Felner et al., ICAPS 2018; disjoint splitting: Li et al., ICAPS 2019; targets: Li et al., AIJ 301, 2021."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def plan(
        self,
        fleet: Fleet,
        seed: int,
        iterations: int | None = None,
        progress: Progress | None = None,
        moves: str = FOUR,
    ) -> FleetPlan:
        """See :class:`lampyris.planning.fleet.base.FleetPlanner`; an iteration is a node of the tree that is expanded."""

        def opened(tables: FleetTables) -> _Search:
            return _Search(ConstraintTree(tables, 1.0, disjoint=self.disjoint), self.bypass)

        return searched(self.name, fleet, moves, seed, opened, iterations, progress)


class _Search:
    """Best-first search of the tree."""

    def __init__(self, tree: ConstraintTree, bypass: bool) -> None:
        self.tree = tree
        self._bypass = bypass
        self._open: list[tuple[int, int, int, Node]] = []
        self._made = 0
        self.expanded = 0
        self.bound: int | None = None
        self.solution: Node | None = None

    def _push(self, node: Node) -> None:
        self._made += 1
        heapq.heappush(self._open, (node.least, len(node.conflicts), -self._made, node))

    def run(self, iterations: int | None, progress: Progress | None) -> None:
        """Search until there is a solution, or for so many nodes."""
        self._push(self.tree.root())
        while self._open:
            node = self._open[0][-1]
            self.bound = node.least
            if not node.conflicts:
                self.solution = node
                return
            if iterations is not None and self.expanded >= iterations:
                return
            if progress is not None and self.expanded % SHOWN == 0:
                progress(self.expanded, None)
            heapq.heappop(self._open)
            self._expand(node)

    def _expand(self, node: Node) -> None:
        while True:
            self.expanded += 1
            children = self.tree.children(node)
            if self._bypass:
                same = [c for c in children if c.cost == node.cost and len(c.conflicts) < len(node.conflicts)]
                if same:
                    self.tree.adopt(node, min(same, key=lambda c: len(c.conflicts)))
                    if not node.conflicts or node.least > (self.bound or 0):
                        self._push(node)
                        return
                    continue
            for child in children:
                child.extra = max(child.extra, node.least - child.bound)
                self._push(child)
            return


def is_unsolvable(tables: FleetTables, seed: int) -> bool:
    """Whether LaCAM* finds in some time that there is no plan. False: there is one, or it is not known."""
    search = LacamSearch(tables, True, 1, seed)
    search.go_on(max(1, TRIED // len(tables.goals)))
    return search.exhausted and search.best is None


class TreeSearch(Protocol):
    """What a search of a constraint tree has found so far."""

    tree: ConstraintTree
    expanded: int
    bound: int | None
    solution: Node | None

    def run(self, iterations: int | None, progress: Progress | None) -> None:
        """Search until there is a solution, or for so many nodes."""
        ...


def searched(
    name: str,
    fleet: Fleet,
    moves: str,
    seed: int,
    opened: Callable[[FleetTables], TreeSearch],
    iterations: int | None,
    progress: Progress | None,
) -> FleetPlan:
    """The plan that a search finds, or what is known when time, memory or nodes end it.

    Parameters
    ----------
    opened : makes the search, whose tables take memory, when LaCAM* has not found that there is no plan.
    """
    tables = tables_of(fleet, moves)
    if tables.cut_off is not None:
        return unreachable(name, tables.cut_off, seed)
    search: TreeSearch | None = None
    why = ""
    try:
        if is_unsolvable(tables, seed):
            return FleetPlan(Status.NO_PATH, name, shortest=tables.distance, seed=seed)
        search = opened(tables)
        search.run(iterations, progress)
    except Cancelled:
        if is_stopped():
            raise
    except FullError:
        why = " The memory that is allowed is used."
    bound = None if search is None else search.bound
    expanded, states = (0, 0) if search is None else (search.expanded, search.tree.space.expansions)
    if search is None or search.solution is None:
        proved = "" if bound is None else f": every plan costs at least {bound:,}"
        detail = f"Stopped before a plan was found{proved}.{why}"
        return FleetPlan(
            Status.LIMIT, name, (), tables.distance, expanded, states, seed=seed, detail=detail, bound=bound
        )
    paths = tuple(tables.graph.places[_arriving(path.cells)] for path in search.solution.paths)
    cost = sum(len(path) - 1 for path in paths)
    return FleetPlan(
        Status.FOUND, name, paths, tables.distance, expanded, states, ((expanded, cost),), seed, bound=bound
    )  # fmt: skip


def _arriving(cells: list[int]) -> NDArray[np.int64]:
    """A path without waits at its end: who must not arrive before some tick may have waited on the goal."""
    last = len(cells) - 1
    while last > 0 and cells[last - 1] == cells[last]:
        last -= 1
    return np.array(cells[: last + 1], dtype=np.int64)
