"""Fast runs: a whole simulation in one kernel, for when many are wanted and none is watched.

What comes out is the Trace that :func:`lampyris.sim.grid.loop.run` gives, to the last bit but its timing; a test
compares them. Where the kernel's rules end, the loop is run.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core.exclusive import Exclusive, one_call
from lampyris.kernels.adgso import simulate as k
from lampyris.kernels.adgso import walk as w
from lampyris.kernels.adgso.lookahead_walk import KNOWN
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.model.path import path_of
from lampyris.model.plan import Status
from lampyris.model.scene import Scene
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Obstacle, RandomWalk
from lampyris.motion.laws.dissertation import DEFAULT, DissertationLaw
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.adgso.walk import NO_LIMIT, Walker, walls
from lampyris.planning.base import Budget, Planner
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.field.gates import gate_mask
from lampyris.planning.field.layers import moves_for, moves_on
from lampyris.planning.field.repair import Padded
from lampyris.planning.field_cache import FieldCache
from lampyris.planning.living_map import LivingMap
from lampyris.sim.grid import loop
from lampyris.sim.grid.tick_speed import SpeedLaw, TickSpeed, law_tables
from lampyris.sim.traffic.obstacle_draws import WALKERS, key_of, places, steps
from lampyris.sim.traffic.placing import Placing
from lampyris.sim.traffic.traffic import open_traffic
from lampyris.sim.world.cell_index import EIGHT, CellIndex, robot_shape
from lampyris.sim.world.endings import gave_up, too_late
from lampyris.sim.world.world import Occupancy
from lampyris.typing import BoolGrid, Cell, Cells, Floats

BLOCK = 64
"""Ticks whose draws are made at once."""

_CAUSES = ("start", "limit", "ring 1", "ring 2", "angle", "goal", "acceleration", "braking", "waiting")
_OUTCOMES = {k.AT_GOAL: Outcome.ARRIVED, k.BLOCKED: Outcome.BLOCKED, k.TIMEOUT: Outcome.TIMEOUT}
_ALL_THERE = 2.0
"""In place of a rate: nobody appears."""

_WALKER = Obstacle("random-walk", 0.0, True, ((0, 0),))
_EVENTS = (
    (k.EVENT_WAITED, "replan", "Asked again after waiting."),
    (k.EVENT_BLOCKED, "replan", "The next cell, {}, cannot be entered now; chose again."),
    (k.EVENT_HEMMED, "wait", Status.HEMMED_IN.sentence),
    (k.EVENT_WAIT, "wait", "The next cell cannot be entered now."),
)
"""What the bits of ``events`` mean, in the order in which the loop says it."""

Ints: TypeAlias = NDArray[np.int64]
Bytes: TypeAlias = NDArray[np.uint8]


def run(
    scene: Scene, planner: Planner, *, seed: int = 0, ticks: int | None = None, law: SpeedLaw = "physical",
    patience: int | None = None, budget: Budget | None = None,
) -> Trace:  # fmt: skip
    """As :func:`lampyris.sim.grid.loop.run`, by whichever way is quicker: the result is the same."""
    timed = budget is not None and (budget.seconds is not None or budget.stop is not None)
    if not timed and isinstance(planner, AdGso) and supported(scene, planner, law):
        found = FastRuns(scene, planner, law, patience).run(seed, ticks, budget=budget)
        if found is not None:
            return found
    return loop.run(scene, planner, seed=seed, ticks=ticks, law=law, patience=patience, budget=budget)


def supported(scene: Scene, planner: Planner, law: SpeedLaw) -> bool:
    """Whether the kernel knows these rules.

    AD-GSO on its field alone, gates ignored or closed; random walkers of one specification; obstacles of one
    cell; single steps over plain ground that nobody edits; the dissertation's speed law.
    """
    if type(planner) is not AdGso or not (law == "dissertation" or isinstance(law, DissertationLaw)):
        return False
    if scene.edits or scene.via:
        return False
    plain = planner.gates != "replan" and planner.choice != "roulette" and planner.iter_max is None
    plain = plain and not (
        planner.obstacle_density_weight or planner.traffic_density_weight or planner.min_clearance
    )
    if not plain or len(scene.traffic) != 1 or scene.robot.radius > 0 or scene.moves.reach > 1:
        return False
    spec = scene.traffic[0]
    small = isinstance(spec, RandomWalk) and spec.count > 0 and spec.radius == 0 and not spec.starts
    return small and scene.grid.terrain is None and scene.start != scene.goal


class FastRuns(Exclusive):
    """Runs of one scene by one planner, each with a seed of its own; what they share is made once.

    For one thread at a time.

    Parameters
    ----------
    scene, planner, law, patience : as for :func:`lampyris.sim.grid.loop.run`; :func:`supported`.

    Raises
    ------
    SceneError, LimitError : as :func:`lampyris.sim.traffic.traffic.open_traffic`.
    """

    def __init__(
        self, scene: Scene, planner: AdGso, law: SpeedLaw = "dissertation", patience: int | None = None
    ) -> None:
        spec = scene.traffic[0]
        assert isinstance(spec, RandomWalk)
        self.scene, self.planner, self._spec = scene, planner, spec
        self._patience = loop.PATIENCE if patience is None else patience
        self._space, moves = CellIndex(scene.grid), moves_for(scene)
        self._path_moves = moves_on(scene.grid, scene.moves)
        self._start = self._space.number(scene.start)
        stride = self._space.stride
        living = LivingMap(scene)
        free = bordered(living.free)
        self._room = len(free)
        self._cells, traffic = self._traffic(free, stride)
        may_begin = np.zeros(len(free), dtype=np.uint8)
        may_begin[self._cells] = 1
        self._may_begin = may_begin.tobytes()
        robot = np.array([dy * stride + dx for dx, dy in moves.offsets], dtype=np.int64)
        self._given = (
            *traffic, free, stride, int(moves.corner_cutting), robot, self._space.number(scene.goal),
            *self._pace(law),
        )  # fmt: skip
        grounds = FieldCache(living, moves, scene.goal, rho=planner.rho, gamma=planner.gamma)
        self._field, self._lower = self._walk(grounds.sealed(_closed(scene, planner)), living.free, moves)
        self._solved = grounds.spent
        # What is written again by every run, and what is known of the field: the same for all of them.
        self._known = np.zeros(KNOWN * self._room, dtype=np.int64)
        self._log = _RunLog(4 * BLOCK, spec.count)
        y, x = np.divmod(np.arange(self._room), stride)
        self._xy = np.stack((x - 1, y - 1), axis=1).astype(np.int32)

    def _traffic(self, free: Bytes, stride: int) -> tuple[Ints, tuple[Any, ...]]:
        """Cells on which walkers may begin, and what the kernel takes of them."""
        world = Occupancy(self._space, robot_shape(self.scene, self._space), self._start)
        open_traffic(self.scene, world, 0)  # for its errors: they do not depend on the seed
        plans = Placing(self.scene, world, 0)
        shape = plans.shape(0.0)
        opened = bordered(shape.open)
        open_steps = walker_steps(opened, free, stride, shape.corner_cutting)
        rate = _ALL_THERE if self._spec.rate is None else self._spec.rate
        return self._space.numbers(plans.trial.room(shape)), (self._spec.count, opened, open_steps, rate)

    def _pace(self, law: SpeedLaw) -> tuple[Any, ...]:
        """The law, as the kernel takes it, and its room."""
        own = law if isinstance(law, DissertationLaw) else DEFAULT
        horizon, grid = TickSpeed(self.scene, law).horizon + 1, self.scene.grid
        room = np.zeros(horizon + 2), np.zeros(horizon + 2, dtype=np.int64)
        return horizon, *law_tables(own), bordered(grid.blocked), grid.height, *room

    def _walk(self, ground: Padded, free: BoolGrid, moves: Moves) -> tuple[tuple[Any, ...], int]:
        """The field and the walker's room, as the kernels take them; whether steps look at no side cells."""
        scene, planner = self.scene, self.planner
        walker = Walker(
            BorderedMap(free, moves), scene.goal, moves, choice=planner.choice, nt=planner.nt, mvr=planner.mvr,
            rng=np.random.Generator(np.random.PCG64(0)), record=False,
        )  # fmt: skip
        trip = walker.start(walker.flat(scene.start))
        trip.tally[w.ALLOWED] = NO_LIMIT
        setup, tally, _, path, _, *rest = walker.kernel_setup(trip)
        shut = walls(ground).astype(np.int64)
        cost = frozen(ground.cost.astype(np.int64))  # one width: compiling this kernel takes several seconds
        field = (cost, ground.luciferin, ground.step, shut, ground.terrain)
        lower = moves.corner_cutting or not any(dx and dy for dx, dy in moves.offsets)
        return (*field, setup, tally, path, *rest), int(lower)

    @one_call
    def run(self, seed: int, ticks: int | None = None, *, budget: Budget | None = None) -> Trace | None:
        """The trace of one run; None: it needs what only the loop can do.

        Seconds are the loop's to count: see :func:`run`. Expansions: if all calls of the planner together
        have spent no more than each of them may, the budget has bound none of them; otherwise it is the
        loop's to say, too.
        """
        began = time.perf_counter()
        count = self._spec.count
        key = key_of(seed, WALKERS, 0)
        there = self._begin(key) if self._spec.rate is None else self._cells[:0]
        state = np.zeros(k.STATE, dtype=np.int64)
        state[k.OBSTACLES], state[k.ROBOT], state[k.PATIENCE] = len(there), self._start, self._patience
        state[k.HEMMED_AT], state[k.STEPS] = -1, k.NOT_ASKED
        state[k.EXPANSIONS], state[k.LAST_TICK] = self._solved, -1 if ticks is None else ticks
        where, step_x, step_y, gone = np.zeros((4, count), dtype=np.int64)
        taken, left = np.zeros((2, self._room), dtype=np.int64)
        where[: len(there)] = there
        taken[there] = np.arange(1, len(there) + 1)
        obstacles = (state, where, step_x, step_y, taken, left, gone)
        rest = (
            *self._given,
            *self._field,
            self._known,
            np.zeros(2 * count + 16, dtype=np.int64),
            self._lower,
        )
        code = k.MORE_DRAWS
        while code == k.MORE_DRAWS:
            log = self._log = self._log.with_room(int(state[k.NOW]) + BLOCK + 1)
            draws = steps(key, count, int(state[k.NOW]) + 1, BLOCK).ravel()
            code = int(k.drive_ticks(*obstacles, *log.arrays, draws, *rest))
        spent = int(state[k.EXPANSIONS])
        bound = budget is not None and budget.expansions is not None and spent > budget.expansions
        if code == k.ELSEWHERE or bound:
            return None
        return self._trace(seed, _OUTCOMES[code], state, began)

    def _begin(self, key: int) -> Ints:
        """Where walkers begin, as :meth:`lampyris.sim.traffic.placing.Placing.walkers` puts them."""
        taken: dict[int, None] = {}
        space, may = self._space, self._may_begin

        def fits(number: int) -> bool:
            return may[number] != 0 and number not in taken

        def left() -> Ints:
            return np.array([c for c in self._cells.tolist() if c not in taken], dtype=np.int64)

        for number in places(key, 0, self._spec.count, (space.width, space.height), fits, left):
            taken[number] = None
        return np.array(list(taken), dtype=np.int64)

    def _trace(self, seed: int, outcome: Outcome, state: Ints, began: float) -> Trace:
        """The kernel's numbers as a noun."""
        now, scene, log = int(state[k.NOW]), self.scene, self._log
        obstacles = int(state[k.OBSTACLES])
        robots = log.robots[: now + 1]
        cells = self._xy.take(robots, axis=0)
        tracks = log.tracks[: (now + 1) * self._spec.count].reshape(now + 1, -1)[:, :obstacles].T
        appears = (0,) * obstacles
        if self._spec.rate is not None:
            appears = tuple((tracks != 0).argmax(axis=1).tolist())
        moved = np.flatnonzero(robots[1:] != robots[:-1]) + 1
        driven_cells = cells[np.concatenate(([0], moved))]
        return Trace(
            scene=scene,
            planner=self.planner.name,
            seed=seed,
            outcome=outcome,
            robot=cells,
            tracks=tuple(map(_since, self._xy.take(tracks, axis=0), appears)),
            appears=appears,
            obstacle_specs=(_WALKER,) * obstacles,
            speed=log.speeds[: now + 1],
            cause=("start", *map(_CAUSES.__getitem__, log.causes[1 : now + 1].tolist())),
            law="dissertation",
            units="velocity units",
            events=tuple(self._events(outcome, now, cells, appears, tracks)),
            replans=int(state[k.REPLANS]),
            waits=int(state[k.WAITS]),
            iterations=int(state[k.ITERATIONS]),
            expansions=int(state[k.EXPANSIONS]),
            path=path_of(driven_cells, self._path_moves, scene.grid.terrain),
            detail=self._detail(outcome, now, state),
            timing={"total_s": time.perf_counter() - began},
            last_tick=int(state[k.LAST_TICK]),
            path_switches=int(state[k.PATH_SWITCHES]),
        )

    def _events(
        self, outcome: Outcome, now: int, cells: Cells, appears: tuple[int, ...], tracks: Ints
    ) -> Iterator[Event]:
        """What is worth telling, in the loop's words and order."""
        born: dict[int, list[int]] = {}
        for obstacle, tick in enumerate(appears):
            if tick:
                born.setdefault(tick, []).append(obstacle)
        cell, log = self._space.cell, self._log
        for tick in sorted({*(np.flatnonzero(log.events[1 : now + 1]) + 1).tolist(), *born}):
            x, y = cells[tick - 1].tolist()
            for obstacle in born.get(tick, ()):
                yield Event(tick, "appear", cell(int(tracks[obstacle, tick])), "An obstacle appeared.")
            bits = int(log.events[tick])
            for bit, word, sentence in _EVENTS:
                if bits & bit:
                    if bit == k.EVENT_BLOCKED:
                        sentence = sentence.format(cell(int(log.aims[tick])))
                    yield Event(tick, word, (x, y), sentence)
        if outcome is Outcome.ARRIVED:
            yield Event(now, "arrive", self.scene.goal, Outcome.ARRIVED.sentence)

    def _detail(self, outcome: Outcome, now: int, state: Ints) -> str:
        """Why it ended so."""
        if outcome is Outcome.TIMEOUT:
            return too_late(now)
        if outcome is Outcome.BLOCKED:
            word = "" if state[k.STEPS] >= 0 else Status.HEMMED_IN.sentence
            here = self._space.cell(int(state[k.ROBOT]))
            return gave_up(int(state[k.PATIENT]), here, self._patience, word)
        return ""


class _RunLog:
    """What a run tells tick by tick; room for so many ticks. Used again and again."""

    def __init__(self, ticks: int, count: int) -> None:
        self._ticks, self._count = ticks, count
        self.robots, self.events, self.aims, self.causes = np.zeros((4, ticks), dtype=np.int64)
        self.tracks = np.zeros(ticks * count, dtype=np.int64)
        self.speeds = np.zeros(ticks)

    @property
    def arrays(self) -> tuple[Ints, Ints, Ints, Ints, Floats, Ints]:
        return self.robots, self.tracks, self.events, self.aims, self.speeds, self.causes

    def with_room(self, ticks: int) -> _RunLog:
        """Itself, or twice as much room with the same in it."""
        if ticks <= self._ticks:
            return self
        more = _RunLog(max(ticks, 2 * self._ticks), self._count)
        for mine, theirs in zip(self.arrays, more.arrays, strict=True):
            theirs[: len(mine)] = mine
        return more


def _since(track: Cells, tick: int) -> Cells:
    """An obstacle's cells from the tick it appeared."""
    return track[tick:]


def _closed(scene: Scene, planner: AdGso) -> frozenset[Cell]:
    """The gates that the planner seals in its analysis."""
    if planner.gates != "close":
        return frozenset()
    ys, xs = np.nonzero(gate_mask(scene.grid, scene.robot))
    return frozenset(zip(xs.tolist(), ys.tolist(), strict=True)) - {scene.start, scene.goal}


def bordered(mask: BoolGrid) -> Bytes:
    """A mask by cell number."""
    return np.pad(mask, 1).ravel().astype(np.uint8)


def walker_steps(opened: Bytes, free: Bytes, stride: int, cutting: bool) -> Ints:
    """A bit for each of the eight neighbours into which walls let a walker step, by cell number."""
    open_steps = np.zeros(len(free), dtype=np.int64)
    inner = np.arange(stride + 1, len(free) - stride - 1)
    for bit, (dx, dy) in enumerate(EIGHT):
        may = opened[inner + dy * stride + dx] != 0
        if dx and dy and not cutting:
            may = may & (free[inner + dx] != 0) & (free[inner + dy * stride] != 0)
        open_steps[inner] |= may.astype(np.int64) << bit
    return open_steps
