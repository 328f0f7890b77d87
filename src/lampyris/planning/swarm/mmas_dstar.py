"""MMAS-D*: a max-min ant system led by the exact cost-to-go."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import checkpoint
from lampyris._core.settings import number, whole, word
from lampyris.kernels.swarm.ant_walks import COST, LOGGED, RISE, TURN, USED, WALKING, ant_walks
from lampyris.planning.swarm.optimisers.box import Values, norms
from lampyris.planning.swarm.optimisers.glowworm import roulette
from lampyris.planning.swarm.optimisers.loop import Swarm
from lampyris.planning.swarm.pheromone import Pheromone, trails_of
from lampyris.planning.swarm.search_space import Flags, Ints, SearchSpace
from lampyris.planning.swarm.session import Decode, SwarmPlanner, Task
from lampyris.planning.swarm.walks import PART, Paths, parts

DRAWS = 1 << 14
"""Numbers drawn at once for walks in a kernel, or on a small map."""
TABLE = 1 << 18
"""Steps of a map up to which the weights of all are made once a round: two milliseconds."""
ALL_CELLS = 1 << 21
"""Cells of a map, counted for each ant, up to which that is done: 16 MB."""
FEW = 4
"""Ants that walk one by one: an operation on arrays of so many takes as long."""


@dataclass(frozen=True, slots=True)
class MmasDstar(SwarmPlanner):
    """Max-min ant system over the steps of the map, with D*'s cost-to-go as heuristic.

    Each ant walks from the start, never to a cell where it has been, until it reaches the goal or is stuck.
    From a cell it takes step k with probability in proportion to ``tau_k eta_k^beta``.

    Published (Stuetzle and Hoos, "MAX-MIN ant system", FGCS 16(8), 2000): after each round all pheromone
    ``tau`` shrinks by ``rho``, the best ant alone adds ``1/C``, C its fitness, and tau is kept between
    ``tau_min = tau_max / spread`` and ``tau_max = 1 / (rho C_best)``; it begins at tau_max and goes back
    there after ``patience`` rounds without a better path. That D*'s costs lead the ants is Hasan's (Res. J.
    Appl. Sci. 11(10), 2016), whose formulas could not be found.

    Ours: ``eta = 1 / (1 + rise)``, where the rise of a step, in cells, is its cost plus the cost-to-go at its
    end minus that at its beginning: 0 on a cheapest path. With ``guide = "cost"`` it is 1 / (1 + cost-to-go at
    its end), which hardly tells far cells apart. Every other round the best ant of all adds, not that of the
    round. The number of ants is ``swarm``.

    Parameters
    ----------
    rho : evaporation, > 0 to 1.
    beta : weight of the heuristic, 0 to 20.
    spread : tau_max / tau_min, 1 to 1e6.
    patience : rounds without a better path after which pheromone is reset, 1 to 100,000.
    guide : ``rise`` or ``cost``.
    """

    rho: float = number(0.1, 1e-6, 1.0, title="evaporation")
    beta: int = whole(3, 0, 20, title="weight of the heuristic")
    spread: float = number(50.0, 1.0, 1e6, title="ratio of pheromone limits")
    patience: int = whole(15, 1, 100_000, unit="rounds")
    guide: str = word("rise", ("rise", "cost"), title="heuristic")

    name: ClassVar[str] = "mmas-dstar"
    summary: ClassVar[str] = "MMAS with D*: a max-min ant system led by D*'s cost-to-go."
    source: ClassVar[str] = (
        "Stuetzle and Hoos 2000: MMAS. D* costs as the ants' guide after Hasan 2016, formulas not found: the "
        "heuristic by rise is ours."
    )

    def begin(self, task: Task, rng: np.random.Generator) -> tuple[Swarm[Any], Decode]:
        """See :meth:`SwarmPlanner.begin`."""
        return MaxMinAnts(self, task, rng), lambda paths: paths


class Ants(ABC):
    """One run of an ant system: asked, it says whole paths. Abstract: how pheromone changes is of each kind.

    Attributes
    ----------
    tau : pheromone of every step.
    """

    def __init__(self, ants: int, task: Task, rng: np.random.Generator) -> None:
        ground = task.ground
        self._ants = ants
        self._ground = ground
        self._rng = rng
        self._start = int(ground.flat(task.start))
        self._goal = int(ground.flat(np.array(ground.scene.goal)))
        self._steps = len(ground.jump)
        self._every: Ints = np.arange(self._steps, dtype=np.int64)[np.newaxis]
        self.tau = Pheromone(1.0)
        self._seen = np.zeros((ants, ground.free.size), dtype=np.bool_)
        unit = float(ground.moves.unit)
        self._scale = unit
        self._longest = 3 * int(task.best_possible / min(ground.moves.costs)) + 20
        self._seed = None if task.seed is None else self._written(ground, ground.flat(task.seed))
        self._asked: Paths
        self._log: Ints = np.empty((4, 0), dtype=np.int64)
        self._table: _Table | None = None
        self._round = 0

    @staticmethod
    def _written(ground: SearchSpace, flat: Ints) -> tuple[Ints, Ints]:
        """A path, given as flat cells, as the cells left and the steps taken."""
        order = np.argsort(ground.jump, kind="stable")
        return flat[:-1], order[np.searchsorted(ground.jump[order], np.diff(flat))]

    def ask(self) -> Paths:
        """The paths of all ants, that of ant 0 being the seed in the first round."""
        self._asked = self._walk()
        return self._asked

    def tell(self, values: Values) -> None:
        """Take in minus the fitness of each path, and change the pheromone."""
        self._round += 1
        arrived = np.flatnonzero(self._asked.missing == 0)
        self.renew(arrived, self._asked, values)

    @abstractmethod
    def renew(self, arrived: Ints, paths: Paths, values: Values) -> None:
        """Change the pheromone after a round: ``arrived`` are the ants that reached the goal, ``values`` minus the
        fitness of all ``paths``."""

    @property
    @abstractmethod
    def guide(self) -> tuple[int, int, int]:
        """What :meth:`weights` computes, for :func:`lampyris.kernels.swarm.ant_walks.ant_walks`: guide, weights of
        pheromone and guide."""

    @abstractmethod
    def weights(self, tau: Values, eta: Eta) -> Values:
        """What the choice of a step is in proportion to: its pheromone and its heuristic, (n, steps) both."""

    def trails(self, path: Paths) -> Ints:
        """The steps of one walk; see :func:`lampyris.planning.swarm.pheromone.trails_of`."""
        return trails_of(path, self._ground.free.size, self._steps)

    def _walk(self) -> Paths:
        """Every ant's walk; the cells that they saw are forgotten."""
        ants = self._ants
        here = np.full(ants, self._start, dtype=np.int64)
        walking = np.arange(ants)
        # A row lies far from the next: the system gives these pages now, 50 MB on 512 x 512 in 0.1 s.
        rows = max(1, 16 * PART // self._ground.free.size)
        for ant in range(0, ants, rows):
            checkpoint()
            self._seen[ant : ant + rows, self._start] = True
        pieces = self._compiled_turns(here)
        if pieces is None:
            small = self._ground.free.size * self._steps <= TABLE and self._seen.size <= ALL_CELLS
            pieces = self._small_turns(here) if small else self._turns(here, walking)
        return self._gathered(here, pieces)

    def _turns(self, here: Ints, walking: NDArray[np.intp]) -> list[Ints]:
        """Walk by operations over all ants; ``here`` are the cells of each, at last those where it ends. Returns what
        :meth:`_gathered` takes."""
        ground, log = self._ground, _Log(here.size)
        for turn in range(self._longest):
            checkpoint()
            weights = self._weights(walking, here[walking])
            chosen = roulette(weights, self._rng.random(walking.size))
            goes = weights[np.arange(walking.size), chosen] > 0.0
            walking, step = walking[goes], chosen[goes].astype(np.int64)
            log.add(here[walking], step, walking, turn)
            here[walking] = here[walking] + ground.jump[step]
            self._seen[walking, here[walking]] = True
            walking = walking[here[walking] != self._goal]
            if not walking.size:
                break
        return log.pieces()

    def _small_turns(self, here: Ints) -> list[Ints]:
        """The same on a small map, where the weights of all its steps are made once a round; the last few ants walk one
        by one. Draws and sums are those of :meth:`_turns`."""
        if self._table is None:
            self._table = _Table(self._ground, self._steps, here.size)
        table, jump = self._table, self._ground.jump
        weights = table.weights(self.tau, self.weights)
        unseen = table.unseen
        unseen[:] = 1.0
        draws, turns = _Draws(self._rng, here.size * self._longest), _TurnLog()
        walking = np.arange(here.size, dtype=np.int64)
        at, place = (
            here.copy(),
            walking * self._ground.free.size + here,
        )  # in the map, in the maps of all ants
        unseen[place] = 0.0
        while walking.size > FEW and turns.many < self._longest:
            if turns.many % 32 == 0:
                checkpoint()
            sums = weights.take(at, 0)
            sums *= unseen.take(place[:, np.newaxis] + jump)
            sums = sums.cumsum(1)
            last = sums[:, -1]
            threshold = draws.take(walking.size) * last
            step = (sums > threshold[:, np.newaxis]).argmax(1)
            goes = threshold < last
            if b"\0" in goes.tobytes():  # not all of them
                raised = np.flatnonzero(~goes & (last > 0.0))
                step[raised] = (sums[raised] >= last[raised, np.newaxis]).argmax(1)
                goes[raised] = True
                here[walking] = at
                walking, at, place, step = walking[goes], at[goes], place[goes], step[goes]
            turns.add(at, step, walking)
            move = jump.take(step)
            at = at + move
            place = place + move
            unseen[place] = 0.0
            goes = at != self._goal
            if b"\0" in goes.tobytes():
                here[walking] = at
                walking, at, place = walking[goes], at[goes], place[goes]
        here[walking] = at
        self._last_turns(here, walking, weights, draws, turns)
        draws.give_back()
        return turns.pieces()

    def _last_turns(self, here: Ints, walking: Ints, weights: Values, draws: _Draws, turns: _TurnLog) -> None:
        """Walk the last few ants to their ends, by Python's numbers."""
        assert self._table is not None
        weight, jumps = weights.reshape(-1).data, self._ground.jump.tolist()
        fresh = bytearray(self._table.unseen.astype(np.int8))
        cells, many, goal = self._ground.free.size, self._steps, self._goal
        ants = [(who, int(here[who])) for who in walking.tolist()]
        log: list[tuple[int, int, int, int]] = []
        turn = turns.many
        while ants and turn < self._longest:
            if turn % 32 == 0:
                checkpoint()
            still = []
            for (who, at), draw in zip(ants, draws.take(len(ants)).tolist(), strict=True):
                edge, place = at * many, who * cells + at
                row = zip(weight[edge : edge + many].tolist(), jumps, strict=True)
                sums = list(accumulate([w if fresh[place + jump] else 0.0 for w, jump in row]))
                last = sums[-1]
                if last > 0.0:
                    threshold = draw * last
                    k = bisect_right(sums, threshold if threshold < last else math.nextafter(last, 0.0))
                    log.append((at, k, who, turn))
                    at += jumps[k]
                    here[who] = at
                    fresh[place + jumps[k]] = False
                    if at != goal:
                        still.append((who, at))
            ants = still
            turn += 1
        turns.few = log

    def _compiled_turns(self, here: Ints) -> list[Ints] | None:
        """The same by a kernel; None where it is not worth loading. Draws and sums are those of :meth:`_turns`."""
        ground, ants, m = self._ground, here.size, self._steps
        draws = np.empty(min(ants * self._longest, DRAWS))
        room = min(ants * self._longest, max(PART, ants))
        walking, state = np.arange(ants, dtype=np.int64), np.array([ants, 0, 0, 0], dtype=np.int64)
        none: Ints = np.zeros(0, dtype=np.int64)
        price, heavy, jump, via, across, _ = ground.tables
        x, y = ground.scene.goal
        settings = (*self.guide, self._scale, self._goal, x, y, ground.stride, ground.pad, self._longest)
        given = (
            ground.free, ground.to_go, none if ground.terrain is None else ground.terrain,
            price, heavy, jump, via, across, self.tau.trails, self.tau.values, self.tau.rest, *settings,
        )  # fmt: skip
        rest = (self._seen.reshape(-1), here, walking, np.empty(m), np.empty(m))
        if not ant_walks.pays(*given, draws, *rest, none, state):
            return None
        if self._log.shape[1] < room:
            self._log = np.empty((4, room), dtype=np.int64)  # for every round: its pages are fetched once
        log, pieces = self._log[:, :room], []
        stream, left = self._rng.bit_generator, draws[:0]
        while state[WALKING] and state[TURN] < self._longest:
            since = stream.state
            drawn = np.concatenate((left, self._rng.random(max(draws.size, ants))))
            state[USED] = 0
            ant_walks(*given, drawn, *rest, log.reshape(-1), state)
            while int(state[LOGGED] + state[WALKING]) > room:
                pieces.append(log[:, : int(state[LOGGED])])
                log, state[LOGGED] = np.empty((4, room), dtype=np.int64), 0
                ant_walks(*given, drawn, *rest, log.reshape(-1), state)
            used, before = int(state[USED]), left.size
            left = drawn[used:]
        # As if no more had been drawn than was needed.
        stream.state = since
        self._rng.random(used - before)
        return [*pieces, log[:, : int(state[LOGGED])]]

    def _weights(self, ants: Ints, here: Ints) -> Values:
        """The weight of every step of some ants, (n, steps); 0 where it may not be made."""
        ground = self._ground
        at, step = here[:, np.newaxis], self._every
        there = at + ground.jump
        may = ground.legal(at, step) & ~self._seen[ants[:, np.newaxis], there]
        tau = np.where(may, self.tau.at(at * self._steps + step), 0.0)
        return self.weights(tau, Eta(self._ground, at, step, there, may))

    def _gathered(self, last: Ints, pieces: list[Ints]) -> Paths:
        """The walks ant by ant, of steps that were logged turn by turn; the seed in place of ant 0's."""
        ground = self._ground
        seed = self._seed if self._round == 0 else None
        many = np.zeros(last.size, dtype=np.int64)
        for piece in pieces:
            checkpoint()
            many += np.bincount(index_array(piece[2]), minlength=last.size)
        if seed is not None:
            many[0] = seed[0].size
        first = np.concatenate(([0], np.cumsum(many))).astype(np.int64)
        at, step = (np.empty(int(first[-1]), dtype=np.int64) for _ in range(2))
        self._seen[:, self._start] = False
        for left, taken, who, turn in pieces:
            checkpoint()
            self._seen[who, left + ground.jump[taken]] = False
            own = slice(None) if seed is None else who > 0
            place = first[who[own]] + turn[own]  # an ant goes on until it stops permanently
            at[place], step[place] = left[own], taken[own]
        short = np.maximum(ground.to_go[last] // int(self._scale), 1)
        missing = np.where(last == self._goal, 0, short)
        if seed is not None:
            missing[0] = 0
            for part in parts(seed[0].size):
                at[part], step[part] = seed[0][part], seed[1][part]
        legal = np.empty(at.size, dtype=np.bool_)
        for part in parts(at.size):
            legal[part] = True
        return Paths(first, at, step, legal, missing)


class Eta:
    """Heuristics of the steps of some ants, each (n, steps); 1 where a step may not be made.

    Parameters
    ----------
    ground : where.
    at, step, there : flat cells the steps leave, their numbers, the flat cells they lead to.
    may : whether each may be made.
    """

    def __init__(self, ground: SearchSpace, at: Ints, step: Ints, there: Ints, may: Flags) -> None:
        self._ground, self._at, self._step, self._there, self._may = ground, at, step, there, may

    @cached_property
    def rise(self) -> Values:
        """``1 / (1 + rise)``: see :class:`MmasDstar`."""
        return self._of(self._ground.to_go[self._there] + self._paid() - self._ground.to_go[self._at])

    @cached_property
    def cost(self) -> Values:
        """1 / (1 + cost-to-go where the step ends)."""
        return self._of(self._ground.to_go[self._there])

    @cached_property
    def step(self) -> Values:
        """1 / d, d what the step costs in cells of plain ground."""
        unit = self._ground.moves.unit
        return float(unit) / np.where(self._may, self._paid(), unit)

    @cached_property
    def line(self) -> Values:
        """1 / (1 + straight distance from where the step ends to the goal, cells)."""
        cells = self._ground.cells(np.where(self._may, self._there, self._at).ravel())
        away = (cells - np.array(self._ground.scene.goal)).astype(np.float64)
        return 1.0 / (1.0 + norms(away).reshape(self._there.shape))

    def _paid(self) -> Ints:
        return self._ground.plain(self._step) + self._ground.toll(self._at, self._step)

    def _of(self, cost: Ints) -> Values:
        return 1.0 / (1.0 + np.where(self._may, cost, 0) / float(self._ground.moves.unit))


def power(weights: Values, base: Values, exponent: int) -> Values:
    """``weights * base ** exponent``, multiplied one by one, so that the bits are the same everywhere."""
    for _ in range(exponent):
        weights = weights * base
    return weights


class MaxMinAnts(Ants):
    """One run of the max-min ant system."""

    def __init__(self, settings: MmasDstar, task: Task, rng: np.random.Generator) -> None:
        super().__init__(settings.swarm, task, rng)
        self._settings = settings
        self._best: tuple[float, Ints] | None = None
        self._stale = 0

    def renew(self, arrived: Ints, paths: Paths, values: Values) -> None:
        """Evaporate, let the best ant add, keep within the limits."""
        s = self._settings
        self._stale += 1
        if not arrived.size:
            return
        k = int(arrived[values[arrived].argmax()])
        now = (-float(values[k]), self.trails(paths[k]))
        restart = self._best is None or self._stale > s.patience
        if self._best is None or now[0] < self._best[0]:
            self._best, self._stale = now, 0
        most = 1.0 / (s.rho * self._best[0])
        if restart:
            self.tau = Pheromone(most)
            self._stale = 0
        cost, trails = self._best if self._round % 2 == 0 else now
        self.tau.renew(s.rho, trails, 1.0 / cost, most / s.spread, most)

    @property
    def guide(self) -> tuple[int, int, int]:
        """See :meth:`Ants.guide`."""
        return (RISE if self._settings.guide == "rise" else COST), 1, self._settings.beta

    def weights(self, tau: Values, eta: Eta) -> Values:
        """``tau eta^beta``."""
        s = self._settings
        return power(tau, eta.rise if s.guide == "rise" else eta.cost, s.beta)


class _Log:
    """What ants did, turn by turn, in a few arrays, each twice as large as the one before, up to
    :data:`PART` steps. (To let go of a hundred thousand small ones took 0.1 s.)"""

    def __init__(self, ants: int) -> None:
        self._full: list[Ints] = []
        self._open(max(1024, ants))

    def _open(self, size: int) -> None:
        self._now = np.empty((4, size), dtype=np.int64)
        self._size, self._end = size, 0

    def add(self, left: Ints, taken: Ints, who: Ints, turn: int) -> None:
        """Add steps of one turn: the cells they begin at, their numbers, the ants."""
        if self._end + who.size > self._size:
            self._full.append(self._now[:, : self._end])
            self._open(max(self._size, min(2 * self._size, PART)))
        since, self._end = self._end, self._end + who.size
        row = self._now[:, since : self._end]
        row[0], row[1], row[2], row[3] = left, taken, who, turn

    def pieces(self) -> list[Ints]:
        """All of it, (4, n) each, :data:`PART` steps or so at a time."""
        return [*self._full, self._now[:, : self._end]]


class _Table:
    """The weights of all steps of a small map, and which cells each ant has not seen.

    Attributes
    ----------
    unseen : float64 (ants * cells,); 1 where an ant has not been, else 0.
    """

    def __init__(self, ground: SearchSpace, steps: int, ants: int) -> None:
        self._own = np.flatnonzero(ground.free)
        at, step = self._own[:, np.newaxis], np.arange(steps, dtype=np.int64)[np.newaxis]
        self._may = ground.legal(at, step)
        self._eta = Eta(ground, at, step, at + ground.jump, self._may)
        self._tau = np.empty(ground.free.size * steps)
        self._weights = np.zeros((ground.free.size, steps))
        self.unseen = np.empty(ants * ground.free.size)

    def weights(self, tau: Pheromone, rule: Callable[[Values, Eta], Values]) -> Values:
        """The weight of each step by a rule such as :meth:`Ants.weights`, (cells, steps); 0 where none may be made."""
        self._tau[:] = tau.rest
        self._tau[tau.trails] = tau.values
        own = self._tau.reshape(self._weights.shape)[self._own]
        self._weights[self._own] = rule(np.where(self._may, own, 0.0), self._eta)
        return self._weights


class _Draws:
    """Numbers drawn block by block; afterwards the generator is as if no more had been drawn than was needed."""

    def __init__(self, rng: np.random.Generator, most: int) -> None:
        self._rng, self._block = rng, min(most, DRAWS)
        self._since = rng.bit_generator.state
        self._drawn, self._used, self._before = np.empty(0), 0, 0

    def take(self, n: int) -> Values:
        """The next n."""
        if self._used + n > self._drawn.size:
            left = self._drawn[self._used :]
            self._since = self._rng.bit_generator.state
            self._drawn = np.concatenate((left, self._rng.random(max(self._block, n))))
            self._used, self._before = 0, left.size
        since, self._used = self._used, self._used + n
        return self._drawn[since : self._used]

    def give_back(self) -> None:
        """Put back what was not taken."""
        self._rng.bit_generator.state = self._since
        self._rng.random(self._used - self._before)


class _TurnLog:
    """What ants did, turn by turn, on a small map.

    Attributes
    ----------
    many : turns.
    few : steps of later turns: the cells that they begin at, their numbers, the ants and the turns.
    """

    def __init__(self) -> None:
        self.many = 0
        self._rows: list[tuple[Ints, Ints, Ints]] = []
        self.few: list[tuple[int, int, int, int]] = []

    def add(self, left: Ints, taken: Ints, who: Ints) -> None:
        """Add a turn: the cells that its steps begin at, their numbers, the ants."""
        self._rows.append((left, taken, who))
        self.many += 1

    def pieces(self) -> list[Ints]:
        """See :meth:`Ants._gathered`."""
        made = []
        if self._rows:
            many = [who.size for _, _, who in self._rows]
            rows = [np.concatenate(row) for row in zip(*self._rows, strict=True)]
            made.append(np.stack((*rows, np.repeat(np.arange(len(many)), many))))
        if self.few:
            made.append(np.array(self.few, dtype=np.int64).T)
        return made or [np.empty((4, 0), dtype=np.int64)]
