"""LNS: large neighbourhood search, which improves a plan by planning a few of its robots again."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled, checkpoint
from lampyris._core.settings import check_settings, under_name, whole, word
from lampyris.kernels.fleet import neighbourhoods as kernels
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.planning.fleet.base import FleetTraits, Progress
from lampyris.planning.fleet.distance_tables import FleetTables, tables_of
from lampyris.planning.fleet.lacam import Lacam
from lampyris.planning.fleet.pibt import Pibt, is_stopped
from lampyris.planning.fleet.space_time import FullError, SpaceTime, TimedPath
from lampyris.planning.fleet.work import generator

UNTIMED = 1000
"""Neighbourhoods that are tried if there is no budget of any kind."""
SHOWN = 100
"""Neighbourhoods between two calls of ``progress``."""
WALKS, VISITS = 10, 400
STATES, FEW = 100, 50
"""A search gives up after so many states for each step of the shortest path, and of so many more: where it takes longer, time
is better spent on other robots."""
DECAY, LEAST_WEIGHT = 0.01, 0.01
"""How fast kinds of neighbourhoods are judged again, and what the worst of them is still worth."""


@dataclass(frozen=True, slots=True)
class Lns:
    """Large neighbourhood search: robots that are in each other's path are planned again, until the budget is used.

    It begins with the plan of another planner and is never worse. Some robots are taken out and planned one after another, in
    random order, each on its cheapest path that collides with nobody (safe-interval path planning); what is not cheaper in sum is
    undone. Which ones: a late robot and those in its path, those that come by one crossing, or random ones; kinds that
    helped lately are drawn more often. What the first planner does not solve is not solved.

    Parameters
    ----------
    start : the planner of the first plan.
    neighbours : robots that are planned again at once.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    start: str = word("lacam", ("lacam", "pibt"))
    neighbours: int = whole(8, 2, 1000, unit="robots")

    name: ClassVar[str] = "lns"
    traits: ClassVar[FleetTraits] = FleetTraits(anytime=True, stochastic=True)
    summary: ClassVar[str] = (
        "LNS: improves the first plan of lacam or pibt, a few robots at a time, until the budget is used."
    )
    source: ClassVar[str] = (
        "Li, Chen, Harabor, Stuckey, Koenig, IJCAI 2021. SIPP: Phillips, Likhachev, ICRA 2011. Ours: the tables of paths as bits."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def plan(
        self, fleet: Fleet, seed: int, iterations: int | None = None, progress: Progress | None = None
    ) -> FleetPlan:
        """See :class:`lampyris.planning.fleet.base.FleetPlanner`; an iteration is a neighbourhood. The first plan takes what
        it takes."""
        first: FleetPlan = (Lacam(improve=False) if self.start == "lacam" else Pibt()).plan(fleet, seed)
        if not first:
            return replace(first, planner=self.name, paths=())
        most = iterations
        watch = cancellation.watch()
        if most is None and (watch is None or watch.deadline == float("inf")):
            most = UNTIMED
        detail = "All robots reach their goals; stopped improving at the budget."
        search = None
        try:
            search = _Search(tables_of(fleet), first, self.neighbours, seed)
            if search.cost == first.lower_bound:
                detail = ""
            search.run(most, progress)
            if search.cost == first.lower_bound:
                detail = "All robots reach their goals, each on a shortest path."
        except Cancelled:
            if is_stopped():
                raise
            detail = "All robots reach their goals; stopped improving at the time limit."
        except FullError:
            detail = (
                "All robots reach their goals; the memory that is allowed leaves no room to improve the plan."
            )
        if search is None:
            return replace(first, planner=self.name, detail=detail)
        places = search.tables.graph.places
        return replace(
            first,
            planner=self.name,
            paths=tuple(places[np.array(path.cells, dtype=np.int64)] for path in search.best),
            iterations=search.iterations,
            expansions=search.space.expansions,
            improvements=tuple(search.improvements),
            detail=detail,
        )


class _Search:
    """The present plan, and how it is improved."""

    def __init__(self, tables: FleetTables, first: FleetPlan, neighbours: int, seed: int) -> None:
        graph, robots = tables.graph, len(tables.goals)
        self.tables = tables
        self._neighbours = min(neighbours, robots)
        self._rng = generator(seed)
        self._random = np.array([int(self._rng.integers(1, 2**32))], dtype=np.int64)
        self._distance: list[int] = tables.distance.tolist()
        self.best = [
            TimedPath(graph.number[path[:, 1], path[:, 0]].tolist(), low, [])
            for path, low in zip(first.paths, self._distance, strict=True)
        ]
        """The paths of the best plan."""
        self.cost = sum(int(path.cost) for path in self.best)
        self.improvements = [(0, self.cost)]
        self.iterations = 0
        longest = max(path.cost for path in self.best)
        self.space = SpaceTime(tables, longest + longest // 4 + 8, hard=True)
        for k, path in enumerate(self.best):
            self.space.put(k, path)
        self._weights = [1.0, 1.0, 1.0]
        self._tabu = np.zeros(robots, dtype=bool)
        self._chosen = np.zeros(self._neighbours, dtype=np.int32)
        self._is_chosen = np.zeros(robots, dtype=np.uint8)
        self._queue, self._seen = np.zeros(graph.cells, dtype=np.int32), np.zeros(graph.cells, dtype=np.uint8)
        self._crossings = np.flatnonzero(graph.degree >= 3)

    def run(self, most: int | None, progress: Progress | None) -> None:
        """Improve until so many neighbourhoods were tried, or nothing can be improved."""
        low = int(self.tables.distance.sum())
        while self.cost > low and (most is None or self.iterations < most):
            checkpoint()
            self.iterations += 1
            kind = self._drawn_kind()
            chosen = self._neighbourhood(kind)
            gain = self._planned_again(chosen) if len(chosen) > 1 else 0
            self._weights[kind] = max(
                LEAST_WEIGHT, (1.0 - DECAY) * self._weights[kind] + DECAY * gain / max(1, len(chosen))
            )
            if gain > 0:
                self.cost -= gain
                self.improvements.append((self.iterations, self.cost))
            if progress is not None and self.iterations % SHOWN == 0:
                progress(self.iterations, self.cost)

    def _drawn_kind(self) -> int:
        left = float(self._rng.random()) * math.fsum(self._weights)
        for kind, weight in enumerate(self._weights):
            left -= weight
            if left < 0.0:
                return kind
        return len(self._weights) - 1

    def _neighbourhood(self, kind: int) -> list[int]:
        """Robots to plan again."""
        graph, space = self.tables.graph, self.space
        arrays = (
            space.where,
            space.last,
            space.head,
            space.chain,
            space.settled,
            space.horizon,
            space.longest,
        )
        if kind == 0:
            robot = self._late()
            if robot is None:
                return []
            n = kernels.around_robot(
                graph.edge, graph.degree, self.tables.table, *arrays, robot, self._neighbours, WALKS, self._chosen,
                self._is_chosen, self._random,
            )  # fmt: skip
        elif kind == 1 and len(self._crossings):
            cell = int(self._crossings[int(self._rng.integers(len(self._crossings)))])
            n = kernels.around_cell(
                graph.edge, graph.degree, *arrays, cell, self._neighbours, VISITS, self._chosen, self._is_chosen,
                self._queue, self._seen, self._random,
            )  # fmt: skip
        else:
            drawn = self._rng.choice(len(self.best), self._neighbours, replace=False)
            return [int(k) for k in drawn]
        return [int(k) for k in self._chosen[:n]]

    def _late(self) -> int | None:
        """The robot that is latest, of those that were not chosen since all were; None: none is late."""
        delays = self.space.last - self.tables.distance
        if not (delays > 0).any():
            return None
        delays[self._tabu] = 0
        robot = int(delays.argmax())
        if delays[robot] <= 0:
            self._tabu[:] = False
            return self._late()
        self._tabu[robot] = True
        return robot

    def _planned_again(self, chosen: list[int]) -> int:
        """Plan these robots again; by how much they became cheaper, 0 if they are as they were."""
        old = sum(int(self.best[k].cost) for k in chosen)
        rest = sum(int(self._distance[k]) for k in chosen)
        if old == rest:
            return 0
        space = self.space
        for k in chosen:
            space.take(k)
        found: dict[int, TimedPath] = {}
        spent = 0
        for i in self._rng.permutation(len(chosen)).tolist():
            k = chosen[i]
            rest -= self._distance[k]
            path = space.find_free(k, old - spent - rest, STATES * (self._distance[k] + FEW))
            if path is None:
                break
            spent += path.cost
            found[k] = path
            space.put(k, path)
        if len(found) == len(chosen) and spent <= old:
            for k, path in found.items():
                self.best[k] = path
            return old - spent
        for k in found:
            space.take(k)
        for k in chosen:
            space.put(k, self.best[k])
        return 0
