"""The session of planners that sample: one loop over batches of samples, whatever takes them."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled
from lampyris._core.settings import check_settings, under_name
from lampyris.kernels import loading
from lampyris.kernels.graph.search import LIMIT
from lampyris.kernels.sampling.sweep import FAR
from lampyris.model.change import Change
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.graph.no_path_reason import why_not
from lampyris.planning.graph.terrain_graph import search_of
from lampyris.planning.sampling import settings
from lampyris.planning.sampling.ground import Chain, Lines, SamplingMap
from lampyris.planning.sampling.trees import Query, SampledSearch
from lampyris.planning.sampling.turns import Walls
from lampyris.planning.session_limits import limited
from lampyris.typing import BoolGrid, Cell, Cells, Floats

PROVE = 2000
"""Samples without a path after which it is looked up whether walls separate the ends."""
_STRAIGHT = 1.0 + 1e-12
"""A path no longer than so many times the straight line is the shortest."""
EDGES = 40_000
"""Lines of trees that a plan keeps for pictures, at most."""


class SamplingPlanner:
    """What planners that sample discs' paths have alike; the fields of each are its settings.

    Attributes
    ----------
    samples : that a call takes at most.
    batch : samples of one iteration.
    narrow : share of samples in narrow places.
    shortcut : whether the path is made shorter at the end.
    improves : whether it goes on when it has a path.
    seeded : whether it begins with a path of the grid.
    seed_after : samples after which it goes on from a path of the grid, if it has no shorter one.
    near_path : share of samples near the best path.
    turns : where the path may turn.
    reach : the share of the map's diagonal that a step is if not set, of diagonals of 40 to 640 cells.
    """

    __slots__ = ()

    samples: int
    batch: int
    narrow: float
    shortcut: bool

    name: ClassVar[str]
    improves: ClassVar[bool]
    reach: ClassVar[float] = 0.1
    seeded = False
    seed_after: int | None = None
    near_path = 0.0
    turns = settings.CENTRES

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    @abstractmethod
    def begin(self, query: Query) -> SampledSearch:
        """The search of one call."""

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> SamplingSession:
        """Start a session; with ``record`` its plans hold the length after each batch, and the trees."""
        return SamplingSession(self, scene, rng, record=record)


@dataclass(slots=True)
class _Run:
    """What a call has done so far."""

    spent: int = 0
    trace: tuple[float, ...] = ()
    chain: Chain | None = None
    ended: str = ""
    tree: Floats | None = None
    notes: tuple[str, ...] = ()


class SamplingSession(SessionBase):
    """A session that runs a new search at every call and remembers the map and where the robot was.

    ``Plan.expansions`` counts samples, and where no path was found the cells that were looked through for the reason.

    Parameters
    ----------
    planner : its settings.
    scene : what to plan in.
    rng : 32 bits of it are the key of all draws of a call.
    record : keep the length after each batch, and the trees.
    """

    def __init__(
        self, planner: SamplingPlanner, scene: Scene, rng: np.random.Generator, *, record: bool
    ) -> None:
        self._planner, self._scene, self._rng, self._record = planner, scene, rng, record
        self._robot = scene.start
        self._under_walls: dict[Cell, int] = {}
        self._ground: SamplingMap | None = None
        self._finder: Any = None
        self._walls: Walls | None = None
        self._see()

    def _see(self) -> None:
        self._finder = self._walls = None
        self._moves, self._free = moves_for(self._scene), free_space(self._scene)
        self._ground = SamplingMap(self._free, self._moves, wide=self._scene.robot.radius > 0)

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`. Kernels that stop leave the map as it was before."""
        if anywhere:
            self._ground = self._finder = self._walls = None
        return self._planner.name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """A path from where the robot is to the goal; the shortest that was found in time and budget.

        Obstacles count as blocked for this call, save on the robot's own cell and on the goal.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        began = loading.wall()
        change = change or Change()
        scene = edited(self._scene, change, self._under_walls)
        if change.robot is not None:
            self._robot = (int(change.robot[0]), int(change.robot[1]))
        if scene is not self._scene or self._ground is None:
            self._scene, self._ground = scene, None
            self._see()
        timing: dict[str, float] = {}
        made = self._answer(change.obstacles, None if budget is None else budget.expansions, timing)
        timing["search_s"] = loading.wall() - began
        return made if made.timing is timing else replace(made, timing=timing)

    def _answer(self, obstacles: Iterable[Cell], limit: int | None, timing: dict[str, float]) -> Plan:
        start, goal, ground, name = self._robot, self._scene.goal, self._ground, self._planner.name
        assert ground is not None
        for (x, y), status in ((start, Status.START_OCCUPIED), (goal, Status.GOAL_OCCUPIED)):
            if not self._free[y, x]:
                return Plan(status, name)
        contains = self._scene.grid.contains
        closed = sorted(c for c in obstacles if c not in (start, goal) and contains(c))
        key = int(self._rng.integers(2**32))
        run = _Run()
        if start == goal:
            run.chain = np.array([ground.flat(start)], dtype=np.int32)
            return self._found(run, ground, closed, timing)
        query = Query(
            ground,
            ground.flat(start),
            ground.flat(goal),
            key,
            self._planner.samples,
            self._step(ground),
            self._planner.narrow,
            self._planner.near_path,
            self._planner.seeded or self._planner.seed_after is not None,
        )
        with ground.board.closing(closed) if closed else nullcontext():
            failed = self._sample(query, run, closed, limit)
            if failed is not None:
                return failed
            return self._found(run, ground, closed, timing)

    def _step(self, ground: SamplingMap) -> float:
        step: float | None = getattr(self._planner, "step", None)  # bit-star has none
        if step is not None:
            return float(step)
        share = self._planner.reach
        return min(max(share * ground.diagonal(), 40.0 * share), 640.0 * share)

    def _sample(self, query: Query, run: _Run, closed: list[Cell], limit: int | None) -> Plan | None:
        """Take samples until there are enough; a plan without a path, if that is how it ends."""
        planner, best, used, trace, proven = self._planner, math.inf, 0, [], False
        straight = query.ground.distance(query.start, query.goal)
        search, seed_after = planner.begin(query), planner.seed_after
        try:
            if planner.seeded:
                self._seed(query, search, run, closed, limit)
                best = search.best
            while True:
                left = planner.samples - used
                if limit is not None and limit - run.spent < left:
                    left, run.ended = limit - run.spent, "Stopped improving at the budget."
                if left <= 0:
                    break
                some = min(planner.batch, left)
                search.run(some)
                run.spent += search.taken - used
                used = search.taken
                trace.append(search.best)
                if search.best < best:
                    best, run.chain = search.best, search.chain()
                run.trace = tuple(trace)
                if best <= straight * _STRAIGHT or (best < math.inf and not planner.improves):
                    run.ended = ""
                    break
                if best == math.inf and used >= PROVE and not proven:
                    proven = True
                    failed = self._separated(query, run, closed, limit)
                    if failed is not None:
                        return failed
                if seed_after is not None and used >= seed_after and not planner.seeded:
                    seed_after = None
                    if self._seed(query, search, run, closed, limit):
                        was = "no path" if best == math.inf else "a longer path"
                        run.notes = (
                            f"{was} after {used} samples: went on from the cheapest path of the grid",
                        )
                    best = search.best
        except Cancelled:
            scope = cancellation.watch()
            if run.chain is None or scope is None or any(stop.is_set for stop in scope.stops):
                raise
            run.ended = "Stopped improving at the time limit."
        else:
            if run.chain is None:
                return self._none(query, run, closed, limit, proven)
        if self._record:
            run.tree = self._edges(search)
        return None

    def _seed(
        self, query: Query, search: SampledSearch, run: _Run, closed: list[Cell], limit: int | None
    ) -> bool:
        """Let a search go on from the path of A*, pulled straight, where it finds a shorter one within the budget.

        If there is a path already, at most half of what is left of the budget is spent on A*. Returns whether the search went
        on from the path of A*.
        """
        if self._finder is None:
            self._finder = search_of(self._free, None, self._moves)
        before = search.best
        left = None if limit is None else (limit - run.spent) // (1 if before == math.inf else 2)
        found = self._finder.find_path(self._robot, self._scene.goal, left, closed)
        run.spent += found.expansions
        if found.cells is None:
            return False
        ground = query.ground
        turns = ground.pulled(np.array([ground.flat(cell) for cell in found.cells.tolist()]))
        length = math.fsum(ground.distance(a, b) for a, b in pairwise(turns.tolist()))
        if len(turns) > query.samples or length >= before:
            return False
        search.go_on_from(turns)
        run.chain = search.chain()
        return search.best < before

    def _edges(self, search: SampledSearch) -> Floats | None:
        edges = search.edges()
        pad = self._moves.reach
        return edges[:: max(1, -(-len(edges) // EDGES))] - pad

    def _separated(self, query: Query, run: _Run, closed: list[Cell], limit: int | None) -> Plan | None:
        """The answer if walls or obstacles leave no path; None if there is one."""
        if query.ground.joined(query.start, query.goal):
            return None
        finder = search_of(self._free, self._scene.grid.terrain, self._moves)
        left = None if limit is None else limit - run.spent
        start, goal, name = self._robot, self._scene.goal, self._planner.name
        if left is not None and left <= 0:
            return Plan(Status.LIMIT, name, iterations=len(run.trace), expansions=run.spent)
        here = None
        if not closed:
            region = finder.region(start, left)
            run.spent += region.expansions
            if region.ending == LIMIT:
                return Plan(Status.LIMIT, name, iterations=len(run.trace), expansions=run.spent)
            here = region.expansions
        plan = why_not(name, finder, start, goal, spent=run.spent, budget=limit, here=here)
        return replace(plan, iterations=len(run.trace))

    def _none(self, query: Query, run: _Run, closed: list[Cell], limit: int | None, proven: bool) -> Plan:
        """The answer of a search whose samples, or budget, have run out."""
        rounds = len(run.trace)
        if not proven:
            failed = self._separated(query, run, closed, limit)
            if failed is not None:
                return failed
        if run.ended:
            return Plan(Status.LIMIT, self._planner.name, iterations=rounds, expansions=run.spent)
        detail = f"No path was found with {self._planner.samples} samples. There is one."
        return Plan(
            Status.ITERATION_LIMIT, self._planner.name, iterations=rounds, expansions=run.spent, detail=detail
        )

    def _turning_anywhere(self, lines: Lines, ground: SamplingMap, closed: list[Cell]) -> Lines:
        """The same made shorter by turns between cell centres."""
        if self._walls is None:
            grid, radius = self._scene.grid, self._scene.robot.radius
            self._walls = Walls(grid.blocked, radius / grid.resolution, ground.rule, ground.diagonals)

        def walking(among: BoolGrid) -> Cells | None:
            finder = search_of(self._free & among, None, self._moves)
            return finder.find_path(self._robot, self._scene.goal, None, closed).cells

        return self._walls.shortened(lines, closed, walking)

    def _found(self, run: _Run, ground: SamplingMap, closed: list[Cell], timing: dict[str, float]) -> Plan:
        assert run.chain is not None
        with cancellation.shielded():
            lines = ground.lines(run.chain, shorter=self._planner.shortcut)
            if self._planner.turns == settings.ANYWHERE and len(lines.turns) > 2:
                lines = self._turning_anywhere(lines, ground, closed)
        notes = run.notes
        if self._walls is not None and self._walls.far:
            notes += (f"turns stay at cell centres: the map has {FAR:,} cells or more from corner to corner",)
        if self._scene.grid.terrain is not None:
            notes += ("terrain is ignored by planners that sample",)
        more: dict[str, Any] = {}
        if self._record:
            more = {"best_by_iteration": run.trace, "tree": run.tree}
        return Plan(
            Status.FOUND, self._planner.name, path_of(lines.walk, self._moves, self._scene.grid.terrain),
            iterations=len(run.trace), expansions=run.spent, waypoints=lines.turns, detail=run.ended,
            notes=notes, timing=timing, **more,
        )  # fmt: skip
