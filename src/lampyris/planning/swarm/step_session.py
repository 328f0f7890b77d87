"""What the baselines share, settings and session: the robot moves by a cell or two an iteration; a small swarm says where."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris._core.settings import check_settings, number, under_name, whole, word
from lampyris.kernels import loading
from lampyris.model.change import Change
from lampyris.model.moves import Moves
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase, Traits
from lampyris.planning.field.gates import gate_mask
from lampyris.planning.session_limits import limited
from lampyris.planning.swarm.optimisers.box import Box, Points
from lampyris.planning.swarm.optimisers.loop import StoppingRule, minimise
from lampyris.planning.swarm.optimisers.particle import PSO
from lampyris.planning.swarm.search_space import Ints, SearchSpace
from lampyris.planning.swarm.session_memory import NONE, Memory
from lampyris.typing import Cell

GATES = ("ignore", "close", "replan")
WORSE = 1000.0
"""Cells by which a candidate that will not do is worse than the cell where the robot stands."""


@dataclass(frozen=True, slots=True, eq=False)
class Fan:
    """The candidates of one iteration, as offsets in compass order, and the paths to them.

    Parameters
    ----------
    offsets : int64 (m, 2).
    target : int64 (paths,); which candidate a path leads to.
    steps : int64 (paths, 2); the moves it takes; the second is -1 if there is one only.
    box : the square in which particles live.
    """

    offsets: Ints
    target: Ints
    steps: Ints
    box: Box


@lru_cache(maxsize=32)
def fan_of(moves: Moves, reach: int) -> Fan:
    """Single steps (``reach`` 1), or the cells of the second ring with the pairs of steps that lead there."""
    paths: dict[Cell, list[tuple[int, int]]] = {}
    for k, (dx, dy) in enumerate(moves.offsets):
        if reach == 1 or max(abs(dx), abs(dy)) == reach:
            paths.setdefault((dx, dy), []).append((k, -1))
        if reach == 1:
            continue
        for j, (ex, ey) in enumerate(moves.offsets):
            end = (dx + ex, dy + ey)
            if max(map(abs, end)) == reach and max(map(abs, (dx, dy, ex, ey))) == 1:
                paths.setdefault(end, []).append((k, j))
    ring = sorted(paths, key=_compass)
    far = max(max(map(abs, offset)) for offset in ring) + 0.5
    return Fan(
        np.array(ring, dtype=np.int64),
        np.array([i for i, offset in enumerate(ring) for _ in paths[offset]], dtype=np.int64),
        np.array([pair for offset in ring for pair in paths[offset]], dtype=np.int64),
        Box(np.full(2, -far), np.full(2, far)),
    )


def _compass(offset: Cell) -> tuple[int, float]:
    """Order of directions around the compass from the east, without an angle: quadrant, then slope."""
    x, y = offset
    quadrant = 0
    while not (x > 0 and y >= 0):
        x, y = y, -x
        quadrant += 1
    return quadrant, y / (x + y)


@dataclass(slots=True)
class StepWalk:
    """How far one plan has walked: cells, iterations, the gates it met, the length of its first move."""

    cells: list[Cell]
    iterations: int = 0
    met: list[Cell] = field(default_factory=list)
    commit: int = 0
    forced: bool = False


@dataclass(frozen=True, slots=True)
class StepPlanner:
    """Settings that both baselines share. Abstract.

    At every cell a particle swarm with a ring neighbourhood (lbest) lives in the square around the robot. A
    particle means the candidate cell nearest to it; its fitness is that cell's cost-to-go plus the share of
    its eight neighbours that are blocked, weighed. A candidate that is blocked or no nearer to the goal loses
    to all that are. The first particles begin on the candidates, one on each, in compass order, so with as
    many particles as candidates none is overlooked; with fewer it is a search, and where it finds nothing
    that is nearer to the goal, D*'s own step is taken. All of this is ours: of the published methods no more
    is known than that D* computes the costs, an lbest swarm moves the robot, and a gate makes it replan.

    Parameters
    ----------
    particles : of the swarm at each cell. 1 to 1000.
    rounds : iterations of that swarm. 1 to 1000.
    obstacles : weight of blocked neighbours, in cells, 0 to 100.
    gates : openings too narrow for the robot: ``ignore`` them, ``close`` them in the analysis, or ``replan``:
        one that is met is closed (D* raises its cost) and the costs are repaired. Where every path leads through
        gates they are passed, and the plan says so.
    """

    particles: int = whole(8, 1, 1000, title="particles at each cell")
    rounds: int = whole(4, 1, 1000, title="iterations at each cell")
    obstacles: float = number(0.1, 0.0, 100.0, unit="cells", title="weight of blocked neighbours")
    gates: str = word("replan", ("ignore", "close", "replan"), title="narrow openings")

    name: ClassVar[str]
    # The costs are solved from scratch where cells were closed, so nothing is reused after a Change.
    traits: ClassVar[Traits] = Traits(optimal=False, stochastic=True)
    summary: ClassVar[str]
    source: ClassVar[str]
    reach: ClassVar[int]
    """Cells moved in an iteration."""

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> StepSession:
        """Start a session. There is no per-iteration record."""
        return StepSession(self, scene, rng)


class StepSession(SessionBase):
    """A session of a :class:`StepPlanner`.

    Moving obstacles count as walls for the call, save on the robot's own cell and on the goal. One iteration
    moves the robot, or finds a gate in its way, which is closed; the costs are then repaired. A gate that the
    preview finds is closed for that plan only; it stays closed once the robot itself stands before it.
    ``Plan.commit`` is the first move: the rest is a preview.

    ``Plan.expansions`` counts cells settled in fields solved by the call, and particles evaluated.
    """

    def __init__(self, planner: StepPlanner, scene: Scene, rng: np.random.Generator) -> None:
        self._planner = planner
        self._rng = rng
        self._memory = Memory(scene, planner.name)
        self._gates = NONE
        if planner.gates != "ignore":
            ys, xs = np.nonzero(gate_mask(scene.grid, scene.robot))
            self._gates = frozenset(zip(xs.tolist(), ys.tolist(), strict=True)) - {scene.start, scene.goal}
        self._closed = self._gates if planner.gates == "close" else NONE
        self._before = self._closed

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        self._closed = self._before
        return self._memory.drop(anywhere)

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """A path from where the robot is to the goal; see :meth:`lampyris.planning.base.Session.plan`.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        began = loading.wall()
        change = change or Change()
        self._gates -= frozenset(change.freed)  # gates are found once, on the map as given
        self._closed -= frozenset(change.freed)
        self._before = self._closed
        made = self._memory.begin(change, budget)
        if made is None:
            made = self._travel()
        return replace(made, timing={"search_s": loading.wall() - began})

    def _travel(self) -> Plan:
        memory, planner = self._memory, self._planner
        trip = StepWalk([memory.robot])
        sealed = self._closed
        ground = self._ground(trip, sealed)
        while not memory.over and ground.exact[trip.cells[-1][1], trip.cells[-1][0]] >= 0:
            checkpoint()
            here = trip.cells[-1]
            if here == memory.scene.goal:
                return self._arrived(trip)
            trip.iterations += 1
            ahead = self._move(ground, here)
            gate = None
            if planner.gates == "replan" and not trip.forced:
                gate = next((c for c in ahead if c in self._gates and c not in sealed), None)
            moved = ahead if gate is None else ahead[: ahead.index(gate)]
            trip.cells += moved
            trip.commit = trip.commit or len(moved)
            if gate is not None:
                trip.met.append(gate)
                sealed = sealed | {gate}
                if trip.cells[-1] == memory.robot:
                    self._closed = self._closed | {gate}
                ground = self._ground(trip, sealed)
        if memory.over:
            return memory.failed(Status.LIMIT, iterations=trip.iterations)
        return memory.cut_off()

    def _ground(self, trip: StepWalk, sealed: frozenset[Cell]) -> SearchSpace:
        """The ground with these gates closed, or with none where they cut the robot off."""
        memory = self._memory
        x, y = trip.cells[-1]
        ground = memory.ground((memory.occupied | sealed) - {memory.robot, (x, y), memory.scene.goal})
        if sealed and ground.exact[y, x] < 0:
            trip.forced = True
            ground = memory.ground(memory.occupied)
        return ground

    def _move(self, ground: SearchSpace, here: Cell) -> list[Cell]:
        """The cells of the next move: what the swarm chose, or D*'s own step if it found nothing."""
        fan = fan_of(ground.moves, self._planner.reach)
        at = int(ground.flat(np.array(here)))
        dx, dy = ground.moves.offsets[ground.parent(at)]
        own = (here[0] + dx, here[1] + dy)
        if own == ground.scene.goal:
            # Otherwise a cell of the second ring, from where the goal is a straight step, would be preferred
            # to the diagonal step that ends it.
            return [own]
        worth, path = self._candidates(ground, fan, at)
        low = float(ground.to_go[at]) / ground.moves.unit
        chosen = self._swarm(fan, worth)
        if worth[chosen] >= low + WORSE:
            return [own]
        cells = [here]
        for k in fan.steps[path[chosen]].tolist():
            if k >= 0:
                dx, dy = ground.moves.offsets[k]
                cells.append((cells[-1][0] + dx, cells[-1][1] + dy))
        return cells[1:]

    def _candidates(self, ground: SearchSpace, fan: Fan, at: int) -> tuple[NDArray[np.float64], Ints]:
        """What each candidate is worth, in cells, the less the better; and the cheapest legal path to it."""
        one, two = fan.steps[:, 0], np.maximum(fan.steps[:, 1], 0)
        second = fan.steps[:, 1] >= 0
        start = np.full(one.size, at, dtype=np.int64)
        middle = start + ground.jump[one]
        legal = ground.legal(start, one)
        # A first step to a blocked cell in the border must not be looked beyond.
        middle = np.where(legal, middle, start)
        legal &= ~second | ground.legal(middle, two)
        cost = ground.plain(one) + ground.toll(start, one)
        cost = cost + np.where(second, ground.plain(two) + ground.toll(middle, two), 0)
        end = middle + np.where(second, ground.jump[two], 0)
        nearer = legal & (ground.to_go[end] >= 0) & (ground.to_go[end] < ground.to_go[at])
        order = np.lexsort((np.arange(one.size), cost, ~nearer, fan.target))
        path = order[np.searchsorted(fan.target[order], np.arange(len(fan.offsets)))]
        unit = float(ground.moves.unit)
        around = np.array([dy * ground.stride + dx for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy])
        beside = np.clip(end[path][:, np.newaxis] + around, 0, ground.free.size - 1)
        shut = ground.shut[beside].sum(axis=1)
        worth = ground.to_go[end[path]] / unit + self._planner.obstacles * (shut / 8.0)
        return np.where(nearer[path], worth, float(ground.to_go[at]) / unit + WORSE), path

    def _swarm(self, fan: Fan, worth: NDArray[np.float64]) -> int:
        """The candidate that the particles found best."""
        planner, memory = self._planner, self._memory
        m = len(fan.offsets)
        first = fan.offsets.astype(np.float64)
        if planner.particles < m:
            first = first[np.sort(self._rng.permutation(m)[: planner.particles])]

        def meant(points: Points) -> Ints:
            away = points[:, np.newaxis, :] - fan.offsets
            nearest: Ints = (away[..., 0] * away[..., 0] + away[..., 1] * away[..., 1]).argmin(axis=1)
            return nearest

        swarm = PSO(n=planner.particles, ring=1).start(fan.box, self._rng, first)
        found = minimise(swarm, lambda points: worth[meant(points)], StoppingRule(planner.rounds))
        memory.spent += found.evaluations
        return int(meant(found.best[np.newaxis])[0])

    def _arrived(self, trip: StepWalk) -> Plan:
        detail = ""
        if trip.forced:
            detail = "A path was found. Every path leads through a gate, so gates were passed."
        made = self._memory.found(
            np.array(trip.cells, dtype=np.int32),
            iterations=trip.iterations,
            commit=max(trip.commit, min(1, len(trip.cells) - 1)),
            detail=detail,
        )
        return replace(made, gates_met=tuple(trip.met))
