"""The planner pose-rrt-star: a path of RRT-Connect over poses that costs less with every batch of samples."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.settings import flag, redeclared, whole
from lampyris.model.scene import Scene
from lampyris.planning.hybrid.map import HybridMap
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.shortcut import LEAST_SAVING
from lampyris.planning.sampling.pose_rrt import PoseRrtConnect, PoseRrtSession, PoseRun
from lampyris.planning.sampling.pose_seed import LatticeSeed
from lampyris.planning.sampling.pose_star_tree import PoseStarTree
from lampyris.planning.sampling.pose_trees import PoseTask
from lampyris.typing import Cell

_STEP, _LEAST_STEP = 2.0, 1 / 64
"""Cells by which poses of the best path are moved at first, and at least."""
SEED_WEIGHT = 1.5
"""Weight of the lattice search whose path a seeded tree begins with."""


@dataclass(frozen=True, slots=True)
class PoseRrtStar(PoseRrtConnect):
    """RRT* over poses: a path of :class:`PoseRrtConnect`, and a tree around it that is rewired as it grows.

    The tree begins with the first path. A sample is a pose that a cheaper path may lead through; half of the samples are near
    the best path. It is joined to the node around it from which it costs least, and nodes around it to it where they cost
    less then. After each batch that lowered the cost the path is made shorter by exact curves, and these are taken into the
    tree. Poses of the path (the middles of every other segment) are moved by small steps that make it cheaper, 2 cells at
    first, and half as far when none does.

    Parameters
    ----------
    rounds : batches of samples at most, the first path counted as one.
    batch : samples of a batch.
    seeded : begin with the path of ``lattice`` (its cost at most 1.5 times the least in that lattice), joined to the poses that
        are asked for by exact curves and made shorter; where there is none, as without. What the lattice expands counts as
        expansions, not as samples.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    rounds: int = redeclared(PoseRrtConnect, "rounds", 100)
    batch: int = whole(100, 1, 1_000_000)
    seeded: bool = flag(False)

    name: ClassVar[str] = "pose-rrt-star"
    summary: ClassVar[str] = (
        "RRT* for a footprint: a path of exact curves that costs less with every batch of samples."
    )
    source: ClassVar[str] = (
        "Karaman, Frazzoli 2011; Gammell, Srinivasa, Barfoot 2014; samples near the path: Nasir et al. 2013; first path as "
        "pose-rrt-connect; shortcuts in the tree and steps of poses are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> PoseRrtStarSession:
        """Start a session; with ``record`` its plans hold the cost after each batch, and the tree."""
        return PoseRrtStarSession(self, scene, rng, record=record)


class PoseRrtStarSession(PoseRrtSession):
    """As :class:`PoseRrtSession`; the tree of each call is new."""

    def __init__(
        self, settings: PoseRrtStar, scene: Scene, rng: np.random.Generator, *, record: bool
    ) -> None:
        super().__init__(settings, scene, rng, record=record)
        self._batch = settings.batch
        reverse, turn = settings.reverse_cost, settings.turn_cost
        lattice = LatticePlanner(
            weight=SEED_WEIGHT, reverse_cost=reverse, reverse=settings.reverse, turn_cost=turn
        )
        self._lattice = LatticeSeed(lattice) if settings.seeded else None

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        if self._lattice is not None:
            self._lattice.forget()
        return PoseRrtSession.drop(self, anywhere)

    def _new_search(self, obstacles: Iterable[Cell] = ()) -> HybridMap:
        """The map as it is now."""
        if self._lattice is not None:
            self._lattice.take(self._scene, obstacles)
        return super()._new_search(obstacles)

    def _grow(self, task: PoseTask, run: PoseRun, cells: NDArray[np.int32]) -> None:
        """Find a first path, and improve it."""
        self._find_first(task, run, cells)
        if run.best is None:
            return
        tree = PoseStarTree(task, cells, int(self._rng.integers(2**32)), self._prices(task))
        tree.take(*run.best)
        begun, step = run.spent, _STEP
        while len(run.trace) < self._settings.rounds and run.is_open:
            tree.run(min(self._batch, run.total - run.spent))
            run.spent = begun + tree.taken
            before = run.most
            if tree.cost < run.most - LEAST_SAVING:
                self._keep(task, run, *tree.path())
                step = _STEP
            step = self._step(task, run, tree, step)
            assert run.best is not None
            if run.most < before:
                if run.most < tree.cost - LEAST_SAVING:
                    tree.take(*run.best)
                else:
                    tree.follow(*run.best)
            run.trace.append(run.most)
        if self._record:
            run.edges = tree.edges()

    def _step(self, task: PoseTask, run: PoseRun, tree: PoseStarTree, step: float) -> float:
        """Move the poses of the best path by steps of so many cells that make it cheaper; the steps of the next round."""
        if step < _LEAST_STEP or run.best is None or not self._settings.shortcut:
            return step
        before = run.most
        # Where segments of a car meet, both are arcs of one radius or a straight line: a step there costs more.
        for which in range(2 if self._shape.drive == "ackermann" else 3):
            first, segments = run.best
            stepped = tree.stepped(first, segments, step, which) if len(segments) > 1 else None
            if stepped is not None:
                self._keep(task, run, first, stepped)
        return step if run.most < before - LEAST_SAVING else step / 2.0

    def _find_first(self, task: PoseTask, run: PoseRun, cells: NDArray[np.int32]) -> None:
        """Find a path: in the lattice, or by two trees."""
        if self._lattice is not None:
            prices = self._prices(task)
            seed, expansions = self._lattice.path(task, prices, self._robot, self._pose, run.total)
            run.charge(expansions)
            if seed is not None:
                self._keep(task, run, *seed)
                run.trace.append(run.most)
                return
        self._grow_pair(task, run, cells)
