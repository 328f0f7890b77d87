"""The constraint tree that CBS and EECBS search: nodes, conflicts, and how a conflict is resolved in two children."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from lampyris._core.cancellation import checkpoint
from lampyris._core.limits import MEMORY
from lampyris.kernels.fleet.space_time import (
    AT_MOST,
    IS_PASSED,
    LONGER,
    MUST_AT,
    NOT_AT,
    NOT_FROM,
    NOT_STEP,
    PASSES,
    VERTEX,
)
from lampyris.planning.fleet.distance_tables import MIB, FleetTables
from lampyris.planning.fleet.space_time import Constraint, FullError, SpaceTime, TimedPath

PER_NODE, PER_ENTRY, PER_CONFLICT, PER_TICK = 400, 8, 200, 60
"""Bytes that a node takes: itself, for each robot and conflict, for each new conflict, and for each tick of new paths."""
COVERED = 12
"""Robots up to which the least vertex cover of a group in conflict is exact; of larger groups it is a lower bound."""


class Pair(NamedTuple):
    """A conflict of two robots.

    Parameters
    ----------
    kind : ``VERTEX``, ``SWAP``, ``CROSSING``, or ``IS_PASSED``: ``one`` stands on its goal, and ``other`` is there, too.
    one, other : the robots.
    u, v : ``one`` goes from ``u`` to ``v``, or is on the cell if they are equal.
    p, q : the same of ``other``.
    tick : of the arrival.
    rank : how many of the two have to pay for giving path.
    """

    kind: int
    one: int
    other: int
    u: int
    v: int
    p: int
    q: int
    tick: int
    rank: int


@dataclass(slots=True, eq=False)
class Node:
    """A node of the tree.

    Parameters
    ----------
    parent : the node it was made from.
    made : the constraints that it adds, each with its robot.
    paths : a path for each robot.
    conflicts : of these paths.
    cost, bound : sums of the paths' costs and of their lower bounds.
    extra : by how much at least conflicts raise the bound.
    """

    parent: Node | None
    made: tuple[tuple[int, Constraint], ...]
    paths: list[TimedPath]
    conflicts: list[Pair]
    cost: int
    bound: int
    extra: int = 0

    @property
    def least(self) -> int:
        """No plan in its subtree costs less."""
        return self.bound + self.extra


class ConstraintTree:
    """Makes nodes.

    Parameters
    ----------
    tables : the fleet.
    weight : of the paths' searches.
    disjoint : see :class:`lampyris.planning.fleet.cbs.Cbs`.

    Raises
    ------
    LimitError : ``MEMORY``: the tables of paths would take more memory than is allowed.
    """

    def __init__(self, tables: FleetTables, weight: float, *, disjoint: bool) -> None:
        self.robots = len(tables.goals)
        self._goals: list[int] = tables.goals.tolist()
        self._disjoint = disjoint
        self._kept = 0  # bytes that nodes take
        try:
            self.space = SpaceTime(tables, 2 * (int(tables.distance.max()) + 8), weight=weight)
        except FullError as error:
            what = f"the tables of paths of {self.robots:,} robots on {tables.graph.cells:,} free cells"
            MEMORY.demand(error.needed, what, instead="take fewer robots or a smaller map")
            raise

    def root(self) -> Node:
        """Paths without constraints, one after another, with few conflicts."""
        for k in range(self.robots):
            checkpoint()
            path = self.space.find(k)
            assert path is not None  # the caller has seen that none is cut off
            self.space.put(k, path)
        paths = [path for path in self.space.paths if path is not None]
        found = [one for k in range(self.robots) for one in self._conflicts_of(k, paths)]
        return self._weighed(Node(None, (), paths, _unique(found), 0, 0))

    def _weighed(self, node: Node) -> Node:
        """Set the node's sums from its paths and conflicts."""
        node.cost = sum(len(path.cells) for path in node.paths) - len(node.paths)
        node.bound = sum(int(path.bound) for path in node.paths)
        node.extra = _extra(node.conflicts)
        return node

    def adopt(self, node: Node, child: Node) -> None:
        """Give a node the paths of its child, without the child's constraints.

        Bounds and levels stay the node's: the child's hold under more constraints.
        """
        paths = [
            old if new is old else TimedPath(new.cells, old.bound, old.single)
            for old, new in zip(node.paths, child.paths, strict=True)
        ]
        node.paths = paths
        node.conflicts = [
            c._replace(rank=_rank(paths[c.one], paths[c.other], (c.u, c.v), (c.p, c.q), c.tick))
            for c in child.conflicts
        ]
        extra = node.extra
        self._weighed(node)
        node.extra = max(extra, node.extra)

    def _conflicts_of(self, robot: int, paths: list[TimedPath]) -> list[Pair]:
        found = []
        for kind, other, u, v, tick, p, q in self.space.conflicts(robot):
            one, two, kind_ = robot, other, kind
            if kind == PASSES:
                one, two, kind_ = other, robot, IS_PASSED
            rank = _rank(paths[one], paths[two], (u, v), (p, q), tick)
            found.append(Pair(kind_, one, two, u, v, p, q, tick, rank))
        return found

    def load(self, node: Node) -> None:
        """Enter a node's paths into the tables."""
        space = self.space
        for k, path in enumerate(node.paths):
            if space.paths[k] is not path:
                space.put(k, path)

    def children(self, node: Node) -> list[Node]:
        """The children that resolve the most promising conflict: each plan of the node is in one of them.

        Raises
        ------
        FullError : the tree would take more memory than is allowed.
        """
        chosen = max(node.conflicts, key=lambda c: (c.rank, c.kind == IS_PASSED, -c.tick, -c.one, -c.other))
        made = []
        for constraints in self._split(chosen):
            child = self._child(node, constraints)
            if child is not None:
                made.append(child)
        return made

    def _split(self, c: Pair) -> tuple[tuple[tuple[int, Constraint], ...], ...]:
        if c.kind == IS_PASSED:
            goal = self._goals[c.one]
            return ((c.one, (LONGER, goal, goal, c.tick)),), ((c.one, (AT_MOST, goal, goal, c.tick)),)
        if c.kind == VERTEX:
            mine = (c.one, (NOT_AT, c.u, c.u, c.tick))
            if self._disjoint:
                return (mine,), ((c.one, (MUST_AT, c.u, c.u, c.tick)),)
            return (mine,), ((c.other, (NOT_AT, c.u, c.u, c.tick)),)
        mine = (c.one, (NOT_STEP, c.u, c.v, c.tick))
        if self._disjoint:
            there = (c.one, (MUST_AT, c.u, c.u, c.tick - 1)), (c.one, (MUST_AT, c.v, c.v, c.tick))
            # The other robot's cells are not taken by that, so it is kept from its step by name; a third one that
            # swaps or crosses there is a conflict of its own, found later.
            return (mine,), (*there, (c.other, (NOT_STEP, c.p, c.q, c.tick)))
        return (mine,), ((c.other, (NOT_STEP, c.p, c.q, c.tick)),)

    def _child(self, node: Node, made: tuple[tuple[int, Constraint], ...]) -> Node | None:
        checkpoint()
        self.load(node)
        space = self.space
        child = Node(node, made, node.paths.copy(), [], node.cost, node.bound)
        affected = self._affected(node.paths, made)
        for k in affected:
            space.take(k)
            path = space.find(k, _constraints(child, k))
            if path is None:
                return None
            bound = max(path.bound, node.paths[k].bound)
            child.paths[k] = path if bound == path.bound else TimedPath(path.cells, bound, path.single)
            space.put(k, child.paths[k])
            child.cost += child.paths[k].cost - node.paths[k].cost
            child.bound += bound - node.paths[k].bound
        changed = set(affected)
        kept = [c for c in node.conflicts if c.one not in changed and c.other not in changed]
        fresh = [c for k in affected for c in self._conflicts_of(k, child.paths)]
        child.conflicts = kept + (_unique(fresh) if len(affected) > 1 else fresh)
        self._kept += PER_NODE + PER_ENTRY * (self.robots + len(kept)) + PER_CONFLICT * len(fresh)
        self._kept += PER_TICK * sum(len(child.paths[k].cells) for k in affected)
        taken = space.mebibytes + self._kept // MIB + 1
        if taken > MEMORY.allowed:
            raise FullError(taken)
        child.extra = _extra(child.conflicts)
        return child

    def _affected(self, paths: list[TimedPath], made: tuple[tuple[int, Constraint], ...]) -> list[int]:
        """The robots whose paths do not keep to new constraints."""
        found = set()
        for holder, (kind, u, v, tick) in made:
            path = paths[holder]
            if kind in (NOT_AT, MUST_AT):
                broken = (path.at(tick) == u) == (kind == NOT_AT)
            elif kind == NOT_STEP:
                broken = path.at(tick - 1) == u and path.at(tick) == v
            else:
                broken = (path.cost <= tick) == (kind == LONGER)
            if broken:
                found.add(holder)
            if kind == MUST_AT:
                found |= {k for k, path in enumerate(paths) if k != holder and path.at(tick) == u}
            elif kind == AT_MOST:
                found |= {k for k, path in enumerate(paths) if k != holder and path.visits(u, tick)}
        return sorted(found)


def _constraints(node: Node | None, robot: int) -> list[Constraint]:
    """What a robot must keep to at a node."""
    found: list[Constraint] = []
    while node is not None:
        for holder, (kind, u, v, tick) in node.made:
            if holder == robot:
                found.append((kind, u, v, tick))
            elif kind == MUST_AT:
                found.append((NOT_AT, u, u, tick))
            elif kind == AT_MOST:
                found.append((NOT_FROM, u, u, tick))
        node = node.parent
    return found


def _rank(
    one: TimedPath, other: TimedPath, step: tuple[int, int], other_step: tuple[int, int], tick: int
) -> int:
    """How many of two robots have to pass where they conflict, on all of their cheapest paths."""
    return int(one.must_pass(*step, tick)) + int(other.must_pass(*other_step, tick))


def _extra(conflicts: list[Pair]) -> int:
    """By how much conflicts raise the bound: in each where both have to pass, one of the two pays."""
    return _cover({(min(c.one, c.other), max(c.one, c.other)) for c in conflicts if c.rank == 2})


def _unique(conflicts: list[Pair]) -> list[Pair]:
    """Each conflict once, though it was found for both of its robots."""
    found = {}
    for c in conflicts:
        if c.kind == IS_PASSED or c.one < c.other:
            found[c.kind, c.one, c.other, c.u, c.tick] = c
        else:
            found[c.kind, c.other, c.one, c.p, c.tick] = c
    return list(found.values())


def _cover(edges: set[tuple[int, int]]) -> int:
    """The least number of robots that touch all edges, or a lower bound of it."""
    if not edges:
        return 0
    around: dict[int, set[int]] = {}
    for a, b in sorted(edges):
        around.setdefault(a, set()).add(b)
        around.setdefault(b, set()).add(a)
    total = 0
    left = set(around)
    while left:
        group, front = set(), [min(left)]
        while front:
            k = front.pop()
            if k not in group:
                group.add(k)
                front.extend(around[k])
        left -= group
        total += (
            _least_cover({k: set(around[k]) for k in group})
            if len(group) <= COVERED
            else _matching(group, around)
        )
    return total


def _least_cover(around: dict[int, set[int]]) -> int:
    if not around:
        return 0
    most = max(around, key=lambda k: (len(around[k]), -k))
    degree = len(around[most])
    if degree == 0:
        return 0
    if degree == 1:
        return sum(len(n) for n in around.values()) // 2
    with_it = 1 + _least_cover({k: n - {most} for k, n in around.items() if k != most})
    gone = around[most]
    without = degree + _least_cover({k: n - gone for k, n in around.items() if k != most and k not in gone})
    return min(with_it, without)


def _matching(group: set[int], around: dict[int, set[int]]) -> int:
    """Edges that share no robot: each needs one of its own."""
    used: set[int] = set()
    count = 0
    for _, k in sorted((len(around[k]), k) for k in group):
        if k in used:
            continue
        for n in sorted(around[k]):
            if n not in used:
                used |= {k, n}
                count += 1
                break
    return count
