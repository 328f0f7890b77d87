"""Fast runs: a whole simulation in one kernel, for when many are wanted and none is watched.

What comes out is the Trace that :func:`lampyris.sim.loop.run` gives, to the last bit but its timing; a test
compares them. Where the kernel's rules end, the loop is run.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.field.frame import Frame
from lampyris.field.gates import gate_mask
from lampyris.field.layers import moves_for, moves_on
from lampyris.kernels import simulate as k
from lampyris.kernels import window as w
from lampyris.model.path import path_of
from lampyris.model.plan import Status
from lampyris.model.scene import Scene
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Body, RandomWalk
from lampyris.motion.caps import COS_22_5, COS_67_5
from lampyris.motion.dissertation import DEFAULT, DissertationLaw
from lampyris.motion.rings import counted_around
from lampyris.planners._grounds import Grounds
from lampyris.planners._living import LivingMap
from lampyris.planners.ad_gso import AdGso
from lampyris.planners.ad_gso_walk import NO_LIMIT, Walker, walls
from lampyris.planners.base import Planner
from lampyris.sim import loop
from lampyris.sim.endings import gave_up, too_late
from lampyris.sim.pace import Pace, SpeedLaw
from lampyris.sim.space import Space, robot_shape
from lampyris.sim.traffic import Walkers, open_traffic
from lampyris.sim.world import World
from lampyris.typing import Cell, Cells, Floats

BLOCK = 128
"""Ticks whose draws are made at once."""

_CAUSES = ("start", "limit", "ring 1", "ring 2", "angle", "goal", "acceleration", "braking", "waiting")
_OUTCOMES = {k.AT_GOAL: Outcome.ARRIVED, k.BLOCKED: Outcome.BLOCKED, k.TIMEOUT: Outcome.TIMEOUT}
_ALL_THERE = 2.0
"""In place of a rate: nobody appears."""

Ints: TypeAlias = NDArray[np.int64]


def run(
    scene: Scene, planner: Planner, *, seed: int = 0, ticks: int | None = None, law: SpeedLaw = "physical",
    patience: int | None = None,
) -> Trace:  # fmt: skip
    """As :func:`lampyris.sim.loop.run`, by whichever way is quicker: the result is the same."""
    if isinstance(planner, AdGso) and supported(scene, planner, law):
        found = FastRuns(scene, planner, law, patience).run(seed, ticks)
        if found is not None:
            return found
    return loop.run(scene, planner, seed=seed, ticks=ticks, law=law, patience=patience)


def supported(scene: Scene, planner: Planner, law: SpeedLaw) -> bool:
    """Whether the kernel knows these rules.

    AD-GSO on its field alone, gates ignored or closed; random walkers of one specification; bodies of one
    cell; single steps over plain ground; the dissertation's speed law.
    """
    if type(planner) is not AdGso or not (law == "dissertation" or isinstance(law, DissertationLaw)):
        return False
    plain = planner.gates != "replan" and planner.choice != "roulette" and planner.iter_max is None
    plain = plain and not (planner.crowding or planner.warmth or planner.keep_away)
    if not plain or len(scene.traffic) != 1 or scene.robot.radius > 0 or scene.moves.reach > 1:
        return False
    spec = scene.traffic[0]
    small = isinstance(spec, RandomWalk) and spec.count > 0 and spec.radius == 0
    return small and scene.grid.terrain is None and scene.start != scene.goal


class FastRuns:
    """Runs of one scene by one planner, each with a seed of its own; what they share is made once.

    Parameters
    ----------
    scene, planner, law, patience : as for :func:`lampyris.sim.loop.run`; :func:`supported`.
    """

    def __init__(
        self, scene: Scene, planner: AdGso, law: SpeedLaw = "dissertation", patience: int | None = None
    ) -> None:
        spec = scene.traffic[0]
        assert isinstance(spec, RandomWalk)
        self.scene, self.planner, self._spec = scene, planner, spec
        self._patience = loop.PATIENCE if patience is None else patience
        self._space, self._moves = Space(scene.grid), moves_for(scene)
        self._start, self._goal = (self._space.number(c) for c in (scene.start, scene.goal))
        living = LivingMap(scene)
        grounds = Grounds(living, self._moves, scene.goal, rho=planner.rho, gamma=planner.gamma)
        self._ground = grounds.sealed(_closed(scene, planner))
        self._solved = grounds.spent
        self._walker = Walker(
            Frame(living.free, self._moves), scene.goal, self._moves, choice=planner.choice, nt=planner.nt,
            mvr=planner.mvr, rng=np.random.default_rng(0), record=False,
        )  # fmt: skip
        self._shut = walls(self._ground).astype(np.int64)
        stride = self._space.stride
        self._free = _bordered(living.free)
        self._walks = (
            self._free, stride, int(self._moves.corner_cutting),
            np.array([dy * stride + dx for dx, dy in self._moves.offsets], dtype=np.int64),
        )  # fmt: skip
        own = law if isinstance(law, DissertationLaw) else DEFAULT
        horizon = Pace(scene, law).horizon + 1
        self._pace = (
            horizon, *_law_tables(own), _bordered(scene.grid.blocked), scene.grid.height,
            np.zeros(horizon + 2), np.zeros(horizon + 2, dtype=np.int64),
        )  # fmt: skip

    def run(self, seed: int, ticks: int | None = None) -> Trace | None:
        """The trace of one run; None: it needs what only the loop can do."""
        began = time.perf_counter()
        scene, count, free = self.scene, self._spec.count, self._free
        world = World(self._space, robot_shape(scene, self._space), self._start)
        walkers = open_traffic(scene, world, seed).walkers[0]
        there = len(world.where)
        state = np.zeros(k.STATE, dtype=np.int64)
        state[k.BODIES], state[k.ROBOT], state[k.PATIENCE] = there, self._start, self._patience
        state[k.HEMMED_AT] = state[k.STEPS] = -1
        state[k.EXPANSIONS] = self._solved
        where, step_x, step_y, gone = (np.zeros(count, dtype=np.int64) for _ in range(4))
        taken, left = (np.zeros(len(free), dtype=np.int64) for _ in range(2))
        where[:there] = world.where
        taken[where[:there]] = np.arange(1, there + 1)
        field = self._field()
        if not k.ask(state, where, taken, left, step_x, step_y, *self._walks, *field) or state[k.STEPS] < 0:
            return None
        state[k.FLIPS] = 0
        if ticks is None:
            ticks = 10 * (scene.grid.height + scene.grid.width) + 4 * int(state[k.STEPS])
        state[k.LAST_TICK] = ticks
        told = _Told(ticks + BLOCK + 1, count)
        told.robots[0] = self._start
        told.tracks[:there] = world.where
        bodies = (state, where, step_x, step_y, taken, left, gone)
        given = (*bodies, *self._crowd(walkers), *self._walks)
        rest = (count, self._goal, *told.arrays, *self._pace, *field)
        code = k.MORE_DRAWS
        while code == k.MORE_DRAWS:
            code = int(k.drive_ticks(*given, walkers.rng.random(BLOCK * (count + 2)), *rest))
        if code == k.ELSEWHERE:
            return None
        return self._trace(seed, _OUTCOMES[code], state, told, began)

    def _field(self) -> tuple[Any, ...]:
        """The field and the walker's room, as the kernels take them; a tally and a path of its own."""
        trip = self._walker.start(self._walker.flat(self.scene.start))
        trip.tally[w.ALLOWED] = NO_LIMIT
        g = self._ground
        return (
            g.cost, g.luciferin, g.step, self._shut, g.terrain, *self._walker.kernel_setup(trip),
        )  # fmt: skip

    def _crowd(self, walkers: Walkers) -> tuple[Any, ...]:
        rate = _ALL_THERE if self._spec.rate is None else self._spec.rate
        return _bordered(walkers.shape.open), int(walkers.shape.corner_cutting), rate

    def _trace(self, seed: int, outcome: Outcome, state: Ints, told: _Told, began: float) -> Trace:
        """The kernel's numbers as a noun."""
        now, scene = int(state[k.NOW]), self.scene
        cells = self._cells(told.robots[: now + 1])
        tracks = told.tracks.reshape(-1, self._spec.count)[: now + 1, : int(state[k.BODIES])]
        appears = tuple((tracks != 0).argmax(axis=0).tolist())
        moved = np.flatnonzero(told.robots[1 : now + 1] != told.robots[:now]) + 1
        way = cells[np.concatenate(([0], moved))]
        body = Body("random-walk", 0.0, True, ((0, 0),))
        return Trace(
            scene=scene,
            planner=self.planner.name,
            seed=seed,
            outcome=outcome,
            robot=cells,
            tracks=tuple(self._cells(tracks[a:, b]) for b, a in enumerate(appears)),
            appears=appears,
            bodies=(body,) * len(appears),
            speed=told.speeds[: now + 1],
            cause=("start", *(_CAUSES[c] for c in told.causes[1 : now + 1].tolist())),
            law="dissertation",
            units="velocity units",
            events=tuple(self._events(outcome, now, cells, told, appears, tracks)),
            replans=int(state[k.REPLANS]),
            waits=int(state[k.WAITS]),
            iterations=int(state[k.ITERATIONS]),
            expansions=int(state[k.EXPANSIONS]),
            path=path_of(way, moves_on(scene.grid, scene.moves), scene.grid.terrain),
            detail=self._detail(outcome, now, state),
            timing={"total_s": time.perf_counter() - began},
            last_tick=int(state[k.LAST_TICK]),
            flips=int(state[k.FLIPS]),
        )

    def _events(
        self, outcome: Outcome, now: int, cells: Cells, told: _Told, appears: tuple[int, ...], tracks: Ints
    ) -> Iterator[Event]:
        """What is worth telling, in the loop's words and order."""
        born: dict[int, list[int]] = {}
        for body, tick in enumerate(appears):
            if tick:
                born.setdefault(tick, []).append(body)
        cell = self._space.cell
        for tick in sorted({*np.flatnonzero(told.told[: now + 1]).tolist(), *born}):
            x, y = cells[tick - 1].tolist()
            for body in born.get(tick, ()):
                yield Event(tick, "appear", cell(int(tracks[tick, body])), "An obstacle appeared.")
            bits, aim = int(told.told[tick]), cell(int(told.aims[tick]))
            for bit, word, sentence in (
                (k.TOLD_WAITED, "replan", "Asked again after waiting."),
                (k.TOLD_BLOCKED, "replan", f"The next cell, {aim}, cannot be entered now; chose anew."),
                (k.TOLD_HEMMED, "wait", Status.HEMMED_IN.sentence),
                (k.TOLD_WAIT, "wait", "The next cell cannot be entered now."),
            ):
                if bits & bit:
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

    def _cells(self, numbers: Ints) -> Cells:
        y, x = np.divmod(numbers, self._space.stride)
        return np.stack((x - 1, y - 1), axis=1).astype(np.int32)


class _Told:
    """What a run tells tick by tick."""

    def __init__(self, ticks: int, count: int) -> None:
        self.robots, self.told, self.aims, self.causes = (np.zeros(ticks, dtype=np.int64) for _ in range(4))
        self.tracks = np.zeros(ticks * count, dtype=np.int64)
        self.speeds = np.zeros(ticks)

    @property
    def arrays(self) -> tuple[Ints, Ints, Ints, Ints, Floats, Ints]:
        return self.robots, self.tracks, self.told, self.aims, self.speeds, self.causes


def _closed(scene: Scene, planner: AdGso) -> frozenset[Cell]:
    """The gates that the planner seals in its analysis."""
    if planner.gates != "close":
        return frozenset()
    ys, xs = np.nonzero(gate_mask(scene.grid, scene.robot))
    return frozenset(zip(xs.tolist(), ys.tolist(), strict=True)) - {scene.start, scene.goal}


def _bordered(mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """A mask by cell number."""
    return np.pad(mask, 1).ravel().astype(np.uint8)


def _law_tables(law: DissertationLaw) -> tuple[Floats, NDArray[np.uint8]]:
    """The law as the kernel takes it: its numbers, and what counts around a node by heading."""
    numbers = (
        law.v_max, law.v_min, law.ring1_drop, law.ring2_drop, law.a_straight, law.a_diagonal, law.braking,
        law.v_180, law.v_135, law.v_90, COS_22_5, COS_67_5,
    )  # fmt: skip
    return np.array(numbers), counted_around(law.ring1, law.ring2, law.outside1, law.outside2)
