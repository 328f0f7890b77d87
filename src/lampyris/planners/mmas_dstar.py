"""MMAS-D*: a max-min ant system led by the exact cost-to-go."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from lampyris.halting import look
from lampyris.planners import swarm_settings as check
from lampyris.planners.swarm_ground import Ground, Ints
from lampyris.planners.swarm_session import Decode, SwarmPlanner, Task
from lampyris.planners.swarm_ways import PART, Ways
from lampyris.swarm.box import Values
from lampyris.swarm.glowworm import roulette
from lampyris.swarm.loop import Swarm


@dataclass(frozen=True, slots=True)
class MmasDstar(SwarmPlanner):
    """Max-min ant system over the steps of the map, with D*'s cost-to-go as heuristic.

    Each ant walks from the start, never to a cell where it has been, until it reaches the goal or is stuck.
    From a cell it takes step k with probability in proportion to ``tau_k eta_k^beta``.

    Published (Stuetzle and Hoos, "MAX-MIN ant system", FGCS 16(8), 2000): after each round all pheromone
    ``tau`` shrinks by ``rho``, the best ant alone adds ``1/C``, C its fitness, and tau is kept between
    ``tau_min = tau_max / spread`` and ``tau_max = 1 / (rho C_best)``; it begins at tau_max and goes back
    there after ``patience`` rounds without a better way. That D*'s costs lead the ants is Hasan's (Res. J.
    Appl. Sci. 11(10), 2016), whose formulas could not be found.

    Ours: ``eta = 1 / (1 + rise)``, where the rise of a step, in cells, is its cost plus the cost-to-go at its
    end minus that at its beginning: 0 on a cheapest way. With ``guide = "cost"`` it is 1 / (1 + cost-to-go at
    its end), which hardly tells far cells apart. Every other round the best ant of all adds, not that of the
    round. The number of ants is ``swarm``.

    Parameters
    ----------
    rho : evaporation, > 0 to 1.
    beta : weight of the heuristic, 0 to 20.
    spread : tau_max / tau_min, 1 to 1e6.
    patience : rounds without a better way after which pheromone begins anew, 1 to 100,000.
    guide : ``rise`` or ``cost``.
    """

    rho: float = 0.1
    beta: int = 3
    spread: float = 50.0
    patience: int = 15
    guide: str = "rise"

    name: ClassVar[str] = "mmas-dstar"
    summary: ClassVar[str] = "Max-min ant system led by D*'s cost-to-go"
    source: ClassVar[str] = (
        "Stuetzle and Hoos 2000: MMAS. D* costs as the ants' guide after Hasan 2016, formulas not found: the "
        "heuristic by rise is ours."
    )

    def __post_init__(self) -> None:
        SwarmPlanner.__post_init__(self)
        check.number(self.name, "rho", self.rho, 1e-6, 1.0)
        check.whole(self.name, "beta", self.beta, 0, 20)
        check.number(self.name, "spread", self.spread, 1.0, 1e6)
        check.whole(self.name, "patience", self.patience, 1, 100_000)
        check.one_of(self.name, "guide", self.guide, ("rise", "cost"))

    def begin(self, task: Task, rng: np.random.Generator) -> tuple[Swarm[Any], Decode]:
        """See :meth:`SwarmPlanner.begin`."""
        return _Ants(self, task, rng), lambda ways: ways


class Pheromone:
    """tau of every step of a map, of which few ever differ from the rest.

    Evaporation and limits are the same for all, so steps to which no ant has added share one value, and only
    the others are kept: a map of four million cells takes no more memory than the ways that were found.

    Attributes
    ----------
    rest : tau of every step not in ``trails``.
    trails, values : int64 (n,), ascending, and float64 (n,); steps as cell * steps + step, and their tau.
    """

    def __init__(self, tau: float) -> None:
        self.rest = tau
        self.trails: Ints = np.zeros(0, dtype=np.int64)
        self.values: Values = np.zeros(0)

    def at(self, trails: Ints) -> Values:
        """tau of steps, same shape."""
        if not self.trails.size:
            return np.full(trails.shape, self.rest)
        k = np.minimum(np.searchsorted(self.trails, trails), self.trails.size - 1)
        return np.where(self.trails[k] == trails, self.values[k], self.rest)

    def renew(self, rho: float, trails: Ints, more: float, least: float, most: float) -> None:
        """Evaporate, add ``more`` to some steps (each named once), and keep all within the limits."""
        known = np.union1d(self.trails, trails)
        values = self.at(known) * (1.0 - rho)
        values[np.searchsorted(known, trails)] += more
        self.trails, self.values = known, np.minimum(np.maximum(values, least), most)
        self.rest = min(max(self.rest * (1.0 - rho), least), most)


class _Ants:
    """One run of the ant system: asked, it says whole ways."""

    def __init__(self, settings: MmasDstar, task: Task, rng: np.random.Generator) -> None:
        ground = task.ground
        self._settings = settings
        self._ground = ground
        self._rng = rng
        self._start = int(ground.flat(task.start))
        self._goal = int(ground.flat(np.array(ground.scene.goal)))
        self._steps = len(ground.jump)
        self._every: Ints = np.arange(self._steps, dtype=np.int64)[np.newaxis]
        self.tau = Pheromone(1.0)
        self._seen = np.zeros((settings.swarm, ground.free.size), dtype=np.bool_)
        unit = float(ground.moves.unit)
        self._scale = unit
        self._longest = 3 * int(task.best_possible / min(ground.moves.costs)) + 20
        self._best: tuple[float, Ints] | None = None
        self._seed = None if task.seed is None else self._written(ground, ground.flat(task.seed))
        self._asked: Ways
        self._stale = self._round = 0

    @staticmethod
    def _written(ground: Ground, flat: Ints) -> tuple[Ints, Ints]:
        """A way, given as flat cells, as the cells left and the steps taken."""
        order = np.argsort(ground.jump, kind="stable")
        return flat[:-1], order[np.searchsorted(ground.jump[order], np.diff(flat))]

    def ask(self) -> Ways:
        """The ways of all ants, that of ant 0 being the seed in the first round."""
        ways = self._walk()
        if self._round == 0 and self._seed is not None:
            own, end = self._seed, int(ways.first[1])
            at, step = (np.concatenate((o, w[end:])) for o, w in zip(own, (ways.at, ways.step), strict=True))
            first = np.append(0, ways.first[1:] + (own[0].size - end))
            ways = Ways(first, at, step, np.ones(at.size, dtype=np.bool_), np.append(0, ways.missing[1:]))
        self._asked = ways
        return ways

    def tell(self, values: Values) -> None:
        """Take in minus the fitness of each way; evaporate, let the best ant add, keep within the limits."""
        s, ways = self._settings, self._asked
        self._round += 1
        self._stale += 1
        arrived = np.flatnonzero(ways.missing == 0)
        if not arrived.size:
            return
        k = int(arrived[values[arrived].argmax()])
        way = ways[k]
        now = (-float(values[k]), way.at * self._steps + way.step)
        anew = self._best is None or self._stale > s.patience
        if self._best is None or now[0] < self._best[0]:
            self._best, self._stale = now, 0
        most = 1.0 / (s.rho * self._best[0])
        if anew:
            self.tau = Pheromone(most)
            self._stale = 0
        cost, trails = self._best if self._round % 2 == 0 else now
        self.tau.renew(s.rho, trails, 1.0 / cost, most / s.spread, most)

    def _walk(self) -> Ways:
        """Every ant's walk; the cells that they saw are forgotten."""
        ants, ground = self._settings.swarm, self._ground
        here = np.full(ants, self._start, dtype=np.int64)
        on_way = np.arange(ants)
        self._seen[:, self._start] = True
        log = _Log()
        for turn in range(self._longest):
            look()
            weights = self._weights(on_way, here[on_way])
            chosen = roulette(weights, self._rng.random(on_way.size))
            goes = weights[np.arange(on_way.size), chosen] > 0.0
            on_way, step = on_way[goes], chosen[goes].astype(np.int64)
            log.add(here[on_way], step, on_way, np.full(on_way.size, turn, dtype=np.int64))
            here[on_way] = here[on_way] + ground.jump[step]
            self._seen[on_way, here[on_way]] = True
            on_way = on_way[here[on_way] != self._goal]
            if not on_way.size:
                break
        return self._gathered(here, log.pieces())

    def _weights(self, ants: Ints, here: Ints) -> np.ndarray[Any, np.dtype[np.float64]]:
        """tau eta^beta of every step of some ants, (n, steps); 0 where it may not be made."""
        ground, s = self._ground, self._settings
        at, step = here[:, np.newaxis], self._every
        there = at + ground.jump
        may = ground.legal(at, step) & ~self._seen[ants[:, np.newaxis], there]
        cost = ground.to_go[there]
        if s.guide == "rise":
            cost = cost + ground.plain(step) + ground.toll(at, step) - ground.to_go[at]
        eta = 1.0 / (1.0 + np.where(may, cost, 0) / self._scale)
        weights = np.where(may, self.tau.at(at * self._steps + step), 0.0)
        for _ in range(s.beta):
            weights = weights * eta
        return weights

    def _gathered(self, last: Ints, pieces: list[tuple[Ints, ...]]) -> Ways:
        """The walks ant by ant, of steps that were logged turn by turn."""
        ground = self._ground
        many = np.zeros(last.size, dtype=np.int64)
        for _, _, who, _ in pieces:
            many += np.bincount(who, minlength=last.size)
        first = np.concatenate(([0], np.cumsum(many))).astype(np.int64)
        at, step = (np.empty(int(first[-1]), dtype=np.int64) for _ in range(2))
        self._seen[:, self._start] = False
        for left, taken, who, turn in pieces:
            look()
            place = first[who] + turn  # an ant goes on until it stops for good
            at[place], step[place] = left, taken
            self._seen[who, left + ground.jump[taken]] = False
        short = np.maximum(ground.to_go[last] // int(self._scale), 1)
        missing = np.where(last == self._goal, 0, short)
        return Ways(first, at, step, np.ones(at.size, dtype=np.bool_), missing)


class _Log:
    """What ants did, turn by turn: a few large arrays. (To let go of a hundred thousand small ones took
    0.1 s.)"""

    def __init__(self) -> None:
        self._rows: list[tuple[Ints, ...]] = []
        self._pieces: list[tuple[Ints, ...]] = []
        self._steps = 0

    def add(self, *row: Ints) -> None:
        """Cells left, steps taken, by whom, in which turn."""
        self._rows.append(row)
        self._steps += row[0].size
        if self._steps >= PART:
            self.pieces()

    def pieces(self) -> list[tuple[Ints, ...]]:
        """All of it, :data:`PART` steps or so at a time."""
        if self._rows:
            self._pieces.append(tuple(np.concatenate(part) for part in zip(*self._rows, strict=True)))
            self._rows, self._steps = [], 0
        return self._pieces
