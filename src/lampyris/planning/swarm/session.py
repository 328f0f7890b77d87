"""The session of the swarm planners that judge whole paths: one loop, one judge, whatever moves the swarm."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.settings import check_settings, default_of, flag, number, under_name, whole
from lampyris.kernels import loading
from lampyris.model.change import Change
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase, Traits
from lampyris.planning.session_limits import limited
from lampyris.planning.swarm.fitness_terms import Weights, score
from lampyris.planning.swarm.optimisers.loop import StoppingRule, Swarm, minimise
from lampyris.planning.swarm.search_space import Ints, SearchSpace
from lampyris.planning.swarm.session_memory import Memory
from lampyris.planning.swarm.walks import Paths, WalkBatch, walk_of
from lampyris.typing import Cells


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """What one call of ``plan`` asks a swarm to do.

    Parameters
    ----------
    ground : where.
    start : the robot's cell, int64 (2,).
    seed : the exact path, int32 (n, 2), if the swarm is to start with it; else None.
    best_possible : exact cost of a cheapest path.
    """

    ground: SearchSpace
    start: Ints
    seed: Cells | None
    best_possible: int


Decode = Callable[[Any], WalkBatch]
"""From what a swarm asks to the paths it means."""


@dataclass(frozen=True, slots=True)
class SwarmPlanner:
    """Settings that all planners of this kind share. Abstract: each planner says how its swarm is made.

    Parameters
    ----------
    swarm : number of glowworms, particles or ants. 1 to 2000.
    iterations : greatest number of rounds. 1 to 100,000.
    seeded : start with the exact path (as D* finds it) in the swarm. The result is then never longer,
        so the swarm can only choose among cheapest paths, or accept a longer one if ``slack`` allows it.
    slack : share by which the result may be longer than the exact path, when seeded. 0 to 10.
    repair : if there is no legal path at the end, replace the blocked legs of the best one by exact paths (ours).
    terrain, blocked, clearance, turns : weights, see :class:`lampyris.planning.swarm.fitness_terms.Weights`.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    swarm: int = whole(30, 1, 2000, title="swarm size")
    iterations: int = whole(40, 1, 100_000, title="iterations")
    seeded: bool = flag(True, title="start with the exact path")
    slack: float = number(0.0, 0.0, 10.0, title="extra length allowed")
    repair: bool = flag(False, title="repair blocked legs")
    terrain: float = number(default_of(Weights, "terrain"), 0.0, 1e6, title="weight of terrain")
    blocked: float = number(
        default_of(Weights, "blocked"), 0.0, 1e6, above=True, title="weight of blocked cells"
    )
    clearance: float = number(default_of(Weights, "clearance"), 0.0, 1e6, title="weight of clearance")
    turns: float = number(default_of(Weights, "turns"), 0.0, 1e6, title="weight of turns")

    name: ClassVar[str]
    traits: ClassVar[Traits] = Traits(optimal=False, stochastic=True)
    summary: ClassVar[str]
    source: ClassVar[str]

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    @property
    def weights(self) -> Weights:
        """The weights of the fitness terms."""
        return Weights(self.terrain, self.blocked, self.clearance, self.turns)

    @abstractmethod
    def begin(self, task: Task, rng: np.random.Generator) -> tuple[Swarm[Any], Decode]:
        """A swarm at its first iteration, and how to read what it asks."""

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> SwarmSession:
        """Start a session; with ``record`` its plans hold the best fitness after each iteration."""
        return SwarmSession(self, scene, rng, record=record)


class FitnessEvaluator:
    """Scores what a swarm asks, counts it, and remembers the best path that may be an answer.

    An answer is legal and, if the swarm is seeded, costs no more than the exact path and its slack.

    Attributes
    ----------
    best, fitness : the best answer so far and its fitness; None and infinity before there is one.
    nearest, gap : the path of best fitness, legal or not, and its fitness.
    trace : ``fitness`` after each round.
    over : whether the last round was refused: it would have passed the budget.
    """

    def __init__(self, planner: SwarmPlanner, task: Task, memory: Memory, decode: Decode) -> None:
        self._task, self._memory, self._decode = task, memory, decode
        self._weights = planner.weights
        self._most: float = math.inf
        self._bound = -math.inf
        if planner.seeded:
            self._most = task.best_possible + math.floor(planner.slack * task.best_possible)
            if planner.terrain >= 1:
                # No legal path is fitter than a cheapest one that is straight and far from walls.
                self._bound = task.best_possible / float(task.ground.moves.unit)
        self.best: WalkBatch | None = None
        self.nearest: WalkBatch | None = None
        self.fitness = self.gap = math.inf
        self.trace: list[float] = []
        self.over = False

    def __call__(self, asked: Any) -> NDArray[np.float64]:
        """Fitness of each row, (n,)."""
        paths = self._decode(asked)
        if self._memory.spent + paths.steps > self._memory.most:
            self.over = True
            return np.zeros(len(paths))
        self._memory.spent += paths.steps
        judged = score(self._task.ground, paths, self._weights)
        k = int(judged.fitness.argmin())
        if judged.fitness[k] < self.gap:
            self.gap, self.nearest = float(judged.fitness[k]), paths[k]
        worth = np.where(judged.legal & (judged.exact <= self._most), judged.fitness, np.inf)
        k = int(worth.argmin())
        if worth[k] < self.fitness:
            self.fitness, self.best = float(worth[k]), paths[k]
        self.trace.append(self.fitness)
        return judged.fitness

    def enough(self) -> bool:
        """Whether the budget is spent, or nothing better can be found."""
        return self.over or self.fitness <= self._bound


class SwarmSession(SessionBase):
    """A session of a :class:`SwarmPlanner`; see :class:`lampyris.planning.base.Session`.

    Every call runs a new search. Moving obstacles count as walls for the call, save on the robot's own cell and
    on the goal. The exact field is solved first (and kept while the map and the obstacles stay the same): it
    tells whether there is a path at all, and where waypoints may stand.

    ``Plan.expansions`` counts the cells settled by fields solved in the call, and every step of every path
    whose fitness was worked out; a round that would pass the budget is not looked at and ends the search.
    """

    def __init__(
        self, planner: SwarmPlanner, scene: Scene, rng: np.random.Generator, *, record: bool
    ) -> None:
        self._planner = planner
        self._rng = rng
        self._record = record
        self._memory = Memory(scene, planner.name)

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        return self._memory.drop(anywhere)

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """A path from where the robot is to the goal; see :meth:`lampyris.planning.base.Session.plan`.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        began = loading.wall()
        occupied = self._memory.begin(change or Change(), budget)
        made = self._search() if occupied is None else occupied
        return replace(made, timing={"search_s": loading.wall() - began})

    def _search(self) -> Plan:
        memory, planner = self._memory, self._planner
        ground = memory.ground(memory.occupied)
        if memory.over:
            return memory.failed(Status.LIMIT)
        x, y = memory.robot
        exact = int(ground.exact[y, x])
        if exact < 0:
            return memory.cut_off()
        if exact == 0:
            return memory.found(np.array([memory.robot], dtype=np.int32), iterations=0)
        seed = ground.shortest_path(memory.robot) if planner.seeded else None
        task = Task(ground, np.array(memory.robot, dtype=np.int64), seed, exact)
        swarm, decode = planner.begin(task, self._rng)
        judge = FitnessEvaluator(planner, task, memory, decode)
        minimise(swarm, judge, StoppingRule(planner.iterations), judge.enough)
        made = self._conclude(ground, judge)
        return replace(made, best_by_iteration=tuple(judge.trace)) if self._record else made

    def _conclude(self, ground: SearchSpace, judge: FitnessEvaluator) -> Plan:
        memory, rounds = self._memory, len(judge.trace)
        if judge.best is not None:
            return memory.found(walk_of(ground, judge.best.whole()), iterations=rounds)
        if judge.over or judge.nearest is None:
            return memory.failed(Status.LIMIT, iterations=rounds)
        if self._planner.repair:
            cells, legs = self._repaired(ground, judge.nearest.whole())
            if memory.over:
                return memory.failed(Status.LIMIT, iterations=rounds)
            sentence = f"A path was found by replacing {legs} blocked stretches of the swarm's best path."
            return memory.found(cells, iterations=rounds, detail=sentence)
        sentence = (
            f"No legal path was among those a swarm of {self._planner.swarm} tried in {rounds} iterations."
        )
        return memory.failed(Status.ITERATION_LIMIT, iterations=rounds, detail=f"{sentence} There is one.")

    def _repaired(self, ground: SearchSpace, path: Paths) -> tuple[Cells, int]:
        """The path with every blocked stretch, and what it lacks to the goal, replaced by an exact path."""
        cells = walk_of(ground, path)
        reached = ground.to_go[ground.flat(cells)] >= 0
        bad = ~path.legal | ~reached[:-1] | ~reached[1:]
        edges = np.flatnonzero(np.diff(np.concatenate(([False], bad, [False])).astype(np.int8)))
        parts, at = [], 0
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            ends = [(int(x), int(y)) for x, y in cells[[a, b]]]
            between, settled = ground.exact_between(ends[0], ends[1])
            self._memory.spent += settled
            parts += [cells[at:a], between[:-1]]
            at = b
        parts.append(cells[at:-1])
        x, y = cells[-1].tolist()
        parts.append(ground.shortest_path((x, y)))
        return np.concatenate(parts), len(edges) // 2
