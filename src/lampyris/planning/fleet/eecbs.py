"""EECBS: conflict-based search for plans that cost at most a given factor more than the best."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.settings import check_settings, flag, number, under_name
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.planning.fleet.base import BOTH, FOUR, FleetTraits, Progress
from lampyris.planning.fleet.cbs import SHOWN, searched
from lampyris.planning.fleet.constraint_tree import ConstraintTree, Node
from lampyris.planning.fleet.distance_tables import FleetTables

SURE = 0.99
"""The greatest share of conflicts that may be new ones when costs are estimated."""


@dataclass(frozen=True, slots=True)
class Eecbs:
    """Explicit estimation CBS: plans that cost at most ``weight`` times the lower bound that comes with them.

    Robots look for paths with few conflicts within the factor; of the nodes of the tree, those with few conflicts
    that are estimated to stay within the factor come first, otherwise the one with the least bound, which raises the bound.
    It solves several times as many robots as ``cbs``. As with ``cbs``, a search by LaCAM* comes first, which detects
    small fleets without a plan.

    Parameters
    ----------
    weight : greatest ratio of the cost of a plan to the lower bound.
    disjoint, bypass : as for :class:`lampyris.planning.fleet.cbs.Cbs`; paths that are taken over may cost more here, as
        long as they keep to the factor.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    weight: float = number(1.1, 1.0, 100.0)
    disjoint: bool = flag(False)
    bypass: bool = flag(True)

    name: ClassVar[str] = "eecbs"
    traits: ClassVar[FleetTraits] = FleetTraits(moves=BOTH, complete=True, bounded=True)
    summary: ClassVar[str] = (
        "EECBS: cost at most a given factor of the lower bound; for some hundreds of robots."
    )
    source: ClassVar[str] = (
        "Li, Ruml, Koenig, AAAI 2021; focal low level: Barer, Sharon, Stern, Felner, SoCS 2014. Ours: nodes are estimated "
        "once, when they are made."
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
            tree = ConstraintTree(tables, self.weight, disjoint=self.disjoint)
            return _Search(tree, self.weight, self.bypass)

        return searched(self.name, fleet, moves, seed, opened, iterations, progress)


class _Entry:
    """An open node: ``estimate`` of the cost of a plan below it, and when it was made."""

    __slots__ = ("estimate", "is_open", "made", "node")

    def __init__(self, node: Node, estimate: float, made: int) -> None:
        self.node, self.estimate, self.made, self.is_open = node, estimate, made, True


_Heap = list[tuple[float, float, int, _Entry]]


class _Search:
    """Three orders of the open nodes: by bound, by estimate, and by conflicts of those whose estimate is good enough."""

    def __init__(self, tree: ConstraintTree, weight: float, bypass: bool) -> None:
        self.tree = tree
        self._weight, self._bypass = weight, bypass
        self._by_bound: _Heap = []
        self._by_estimate: _Heap = []
        self._waiting: _Heap = []
        self._focal: _Heap = []
        self._made = 0
        self._steps, self._cost_errors, self._conflict_errors = 0, 0.0, 0.0
        self.expanded = 0
        self.bound: int | None = None
        self.solution: Node | None = None

    def _estimate(self, node: Node) -> float:
        """Cost of a plan below a node: each conflict costs, and brings new ones, as many as it did so far."""
        if not self._steps:
            return float(max(node.cost, node.least))
        each = self._cost_errors / self._steps
        more = min(SURE, max(0.0, self._conflict_errors / self._steps))
        return max(node.cost + len(node.conflicts) * max(0.0, each) / (1.0 - more), float(node.least))

    def _push(self, node: Node) -> None:
        self._made += 1
        made = self._made
        one = _Entry(node, self._estimate(node), made)
        heapq.heappush(self._by_bound, (node.least, one.estimate, made, one))
        heapq.heappush(self._by_estimate, (one.estimate, len(node.conflicts), made, one))
        heapq.heappush(self._waiting, (one.estimate, 0, made, one))

    def run(self, iterations: int | None, progress: Progress | None) -> None:
        """Search until there is a solution, or for so many nodes."""
        self._push(self.tree.root())
        while True:
            one = self._chosen()
            if one is None:
                return
            if not one.node.conflicts:
                self.solution = one.node
                return
            if iterations is not None and self.expanded >= iterations:
                return
            if progress is not None and self.expanded % SHOWN == 0:
                progress(self.expanded, None)
            one.is_open = False
            self._expand(one.node)

    def _chosen(self) -> _Entry | None:
        """The node to expand next; None: there is none."""
        for heap in (self._by_bound, self._by_estimate, self._waiting, self._focal):
            while heap and not heap[0][-1].is_open:
                heapq.heappop(heap)
        if not self._by_bound:
            return None
        least = self._by_bound[0][-1]
        self.bound = max(self.bound or 0, least.node.least)
        most = self._weight * self.bound + 1e-9
        best = self._by_estimate[0][-1]
        within = self._weight * best.estimate + 1e-9
        while self._waiting and self._waiting[0][0] <= within:
            one = heapq.heappop(self._waiting)[-1]
            if one.is_open:
                heapq.heappush(self._focal, (len(one.node.conflicts), one.estimate, -one.made, one))
        while self._focal and (not self._focal[0][-1].is_open or self._focal[0][-1].estimate > within):
            one = heapq.heappop(self._focal)[-1]
            if one.is_open:
                heapq.heappush(self._waiting, (one.estimate, 0, one.made, one))
        if self._focal and self._focal[0][-1].estimate <= most:
            return self._focal[0][-1]
        return best if best.estimate <= most else least

    def _expand(self, node: Node) -> None:
        while True:
            self.expanded += 1
            children = self.tree.children(node)
            self._learn(node, children)
            if self._bypass:
                most = self._weight * (self.bound or 0) + 1e-9
                fewer = [
                    c
                    for c in children
                    if len(c.conflicts) < len(node.conflicts) and c.cost <= most and self._keeps(node, c)
                ]
                if fewer:
                    self.tree.adopt(node, min(fewer, key=lambda c: (len(c.conflicts), c.cost)))
                    if node.conflicts and node.least <= (self.bound or 0):
                        continue
                    self._push(node)
                    return
            for child in children:
                child.extra = max(child.extra, node.least - child.bound)
                self._push(child)
            return

    def _keeps(self, node: Node, child: Node) -> bool:
        """Whether each path that the child changed is within the factor of the node's own bound."""
        return all(
            new is old or new.cost <= self._weight * old.bound + 1e-9
            for old, new in zip(node.paths, child.paths, strict=True)
        )

    def _learn(self, node: Node, children: list[Node]) -> None:
        """Note by how much a step to the best child cost more than thought, and left more conflicts."""
        if children:
            best = min(children, key=lambda c: (len(c.conflicts), c.cost))
            self._steps += 1
            self._cost_errors += best.cost - node.cost
            self._conflict_errors += len(best.conflicts) - (len(node.conflicts) - 1)
