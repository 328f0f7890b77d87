"""Compiled periods: a drive's state as arrays, on which a kernel does many periods at once.

The rules are those of :mod:`lampyris.sim.continuous.drive`, which tests hold equal to the kernel. The arrays are made of a
drive between two periods, and written back before Python looks at it. The kernel comes back where Python has something to
do: a law that it does not know decides, traffic that it does not know begins a tick, an obstacle is so near that it stands in
the way or may touch the robot, the drive may end or the planner has to be asked.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lampyris._core import cancellation
from lampyris.kernels.simulation import drive as k
from lampyris.kernels.simulation import drive_obstacles as o
from lampyris.model.drive import AT_GOAL
from lampyris.model.grid import frozen
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.motion.safety.passive_acceleration import rails_of
from lampyris.sim.continuous.control import Decision
from lampyris.sim.continuous.controllers import Follow, Wheel
from lampyris.sim.continuous.safe_controller import MARGIN, PARKED, SafeController
from lampyris.sim.continuous.sight import Sight
from lampyris.sim.continuous.state import DriveState, Log
from lampyris.sim.continuous.tracking import Perfect, Train
from lampyris.sim.sensor import ObstacleMessage, ObstacleSensor, PerfectSensor, SensorMonitor
from lampyris.sim.traffic.motion_sources import ROUNDING
from lampyris.sim.traffic.obstacle_draws import steps
from lampyris.sim.traffic.obstacle_set import ObstacleSet
from lampyris.sim.world.cell_index import SMALL_CELLS, Shape
from lampyris.sim.world.targets import Targets
from lampyris.sim.world.trajectory import CurveLookup, Segment, Trajectory
from lampyris.sim.world.waiting import Waiting
from lampyris.typing import Floats

CHUNK = 64
"""Periods that the kernel does before what it has written is taken in."""
TICKS = 64
"""Ticks whose draws are made at once."""
MOST_WIDE = 1e9
"""Metres of an obstacle's radius: larger ones are no message that can be trusted."""
MOST_POINTS = 100_000
"""Points ahead of the robot that obstacles may look at."""
MOST_WORK = 1 << 22
"""Numbers of working memory."""

CAUSES = ("acceleration", "limit", "braking", "turn", "moving obstacle", "obstacle", "wait")
"""Causes by the kernel's numbers; those of the ceiling follow."""
_RESTING = ("goal", "turn", "start")

Ints = NDArray[np.int64]


class RunningDrive(Protocol):
    """What is needed of a drive; see :class:`lampyris.sim.continuous.drive.DriveSimulation`."""

    scene: Scene
    settings: DriveSettings
    sensor: ObstacleSensor
    watch: SensorMonitor
    train: Train
    others: ObstacleSet
    sight: Sight | None
    wheel: Wheel
    visits: Targets
    log: Log
    state: DriveState
    waiting: Waiting
    time_limit: float

    def decide(self, period: float) -> Decision:
        """What to do until the next period."""
        ...

    def finish(self, trajectory: Trajectory) -> None:
        """Look for contacts, write down what was driven and go to its end."""
        ...

    def afterwards(self, before: float) -> None:
        """End the drive or ask the planner, where that is due after a period."""
        ...

    def period(self) -> None:
        """One period."""
        ...


def supported(run: RunningDrive) -> bool:
    """Whether the kernel knows the rules of the next period: a robot that follows its path exactly by a known map, discs
    that the scene's traffic moves, and data that can be trusted."""
    state, others = run.state, run.others
    if (
        run.sight is not None
        or run.settings.noise
        or type(run.sensor) is not PerfectSensor
        or type(run.train) is not Perfect
        or type(state.leg.route) is not CurveLookup
        or state.fault_since >= 0.0
        or state.map_changed
        or others.touching
    ):
        return False
    traffic = others.traffic
    if len(others.running) > 1 or traffic.appears or others.outlined.any():
        return False
    if len(others.radius) and not others.radius.max() <= MOST_WIDE:
        return False
    return _points(run) <= MOST_POINTS and 20 * _parts(run) * max(len(others.xy), 1) <= MOST_WORK


def _parts(run: RunningDrive) -> int:
    """Parts that ticks may divide a period into."""
    return math.ceil(run.settings.decision_period / run.others.traffic.tick) + 2


def _points(run: RunningDrive) -> float:
    """Points ahead of the robot, at most."""
    robot, tick = run.scene.robot, run.others.traffic.tick
    ahead = robot.v_max * tick + 0.5 * robot.v_max * robot.v_max / robot.d_max
    return ahead / (0.25 * run.scene.grid.resolution) + 3.0


class CompiledPeriods:
    """A drive as arrays, between two periods.

    Parameters
    ----------
    run : the drive; while the arrays are ahead of it, nobody else may change it.
    last : the period to stop at.
    """

    def __init__(self, run: RunningDrive, last: int) -> None:
        self._run, self._last, self._written = run, last, False
        self._st = np.zeros(o.STATE, dtype=np.int64)
        self._fs = np.zeros(o.NUMBERS)
        self._words = list(CAUSES)
        self._m = len(run.others.xy)
        self._pack_numbers()
        self._path = self._pack_path()
        self._each, self._flags = self._pack_obstacles()
        self._world = self._pack_world()
        self._buffers = self._make_buffers()
        self._draws: Floats = np.zeros(1)

    # ---- arrays --------------------

    def _pack_numbers(self) -> None:
        """The drive's state and limits."""
        run, st, fs = self._run, self._st, self._fs
        state, traffic, robot, settings = run.state, run.others.traffic, run.scene.robot, run.settings
        waiting, watch, route = run.waiting, run.watch, run.state.leg.route
        st[o.PERIODS], st[o.OBSTACLES], st[o.NOW] = state.periods, self._m, traffic.ticks
        st[o.NOWHERE], st[o.PIECES] = state.leg.nowhere, len(route)
        st[o.TRIES], st[o.REPORTED], st[o.WALKS] = waiting.tries, waiting.reported, _parts(run)
        st[o.TRAFFIC] = bool(traffic.traffic.obstacles or traffic.traffic.walkers)
        made = state.decision
        fs[o.PUSH], st[o.CAUSE], st[o.INDEX], st[o.REST] = (
            made.a,
            self._code(made.cause),
            made.cause_index,
            made.rest,
        )
        fs[[o.T, o.S, o.V, o.PERIOD]] = state.t, state.s, state.v, settings.decision_period
        fs[[o.TICK, o.TOP, o.RESOLUTION, o.RADIUS]] = (
            traffic.tick, traffic.top_speed, run.scene.grid.resolution, robot.radius,
        )  # fmt: skip
        fs[o.LENGTH], (fs[o.END_X], fs[o.END_Y]) = route.length, route.curve.end
        (fs[o.GOAL_X], fs[o.GOAL_Y]), fs[o.AT_GOAL] = run.visits.target, AT_GOAL
        fs[[o.A_MAX, o.D_MAX, o.V_MAX]] = robot.a_max, robot.d_max, robot.v_max
        fs[[o.PATIENCE, o.GIVE_UP, o.TIME_LIMIT]] = settings.patience, settings.give_up, run.time_limit
        fs[[o.STOOD, o.WAITED, o.ANCHOR]] = waiting.stood, waiting.waited, waiting.anchor
        fs[[o.STEP, o.FAR]] = waiting.step, waiting.far
        fs[[o.SIDE, o.MARGIN, o.PARKED, o.ROUNDING]] = traffic.world.motions.side, MARGIN, PARKED, ROUNDING
        fs[o.TIGHT] = watch.radius - watch.noise - 1e-6
        log, leg = run.log, self._leg()
        st[o.LAST_CAUSE] = -1
        if log.t and log.leg[-1] == leg:
            st[o.LAST_CAUSE], st[o.LAST_INDEX] = self._code(log.cause[-1]), log.cause_index[-1]
            fs[o.LAST_V], fs[o.LAST_A] = log.v[-1], log.a[-1]

    def _pack_path(self) -> tuple[Any, ...]:
        """The path, its nodes and their ceiling: ``path`` to ``index_of`` of the kernel."""
        run, leg = self._run, self._run.state.leg
        controller = run.wheel.controller
        law = k.OUTSIDE
        if type(controller) is Follow:
            law = k.CEILING
        elif type(controller) is SafeController and controller.simple:
            law = k.SAFE
        self._st[o.LAW] = law if leg.timetable is None else k.OUTSIDE
        rails = rails_of(leg.samples)
        self._fs[o.SLACK] = rails.slack
        codes: list[int] = []
        about: list[int] = []
        for node, (cause, index) in enumerate(
            zip(leg.profile.cause, leg.profile.cause_index.tolist(), strict=True)
        ):
            rests = cause in _RESTING
            codes.append(self._code("braking" if rests else cause))
            about.append(node if rests else index)
        above = np.full(len(rails.s), 1e30)
        pieces = len(leg.route) + 1
        path = frozen(np.concatenate([np.resize(one, pieces) for one in leg.route.lines]))
        return (
            path, rails.s, leg.squares, above, rails.x, rails.y, _ints(codes), _ints(about),
        )  # fmt: skip

    def _pack_obstacles(self) -> tuple[Floats, Ints]:
        """``each`` and ``flags`` of the kernel."""
        run, m = self._run, self._m
        others, traffic, last = run.others, run.others.traffic, run.watch.last
        each = np.zeros((o.EACH, m))
        flags = np.zeros((o.FLAGS, m), dtype=np.int64)
        if m:
            each[o.AT_X : o.AT_Y + 1] = traffic.at.T
            each[o.GO_X : o.GO_Y + 1] = traffic.going.T
            if len(traffic.to) == m:  # none before the first tick
                each[o.TO_X : o.TO_Y + 1] = traffic.to.T
            each[o.SEEN_X : o.SEEN_Y + 1] = others.xy.T
            each[o.SPEED_X : o.SPEED_Y + 1] = others.velocity.T
            each[o.WIDE], each[o.QUICK], each[o.REACH] = others.radius, others.top_speed, traffic.reach
            each[o.DISC] = traffic.world.motions.radii
            flags[o.YIELDS] = traffic.yields
            for row, which in (
                (o.FIXED, traffic.world.motions.fixed), (o.LATE, traffic.world.late), (o.STOPPED, traffic.stopped),
            ):  # fmt: skip
                flags[row, sorted(which)] = 1
        self._st[o.LATE_ONES], self._st[o.STOPPED_ONES] = len(traffic.world.late), len(traffic.stopped)
        if last is not None:
            heard = others.velocity if last.velocity is None else last.velocity
            self._st[o.KNOWN], self._fs[o.STAMP] = 1, last.stamp
            if m:
                each[o.LAST_X : o.LAST_Y + 1], each[o.HEARD_X : o.HEARD_Y + 1] = last.xy.T, heard.T
                each[o.SINCE] = run.watch.since
        return each.reshape(-1), flags.reshape(-1)

    def _pack_world(self) -> tuple[Any, ...]:
        """Who is on which cell, and the random walkers: ``taken`` to ``gone`` and ``walkers`` to ``open_steps`` of the kernel."""
        st, m = self._st, self._m
        running = self._run.others.traffic
        traffic, world = running.traffic, running.world
        walks = len(traffic.drivers) == len(traffic.walkers) and traffic.recording is None
        walks = walks and self._run.scene.grid.blocked.size <= SMALL_CELLS
        walks = walks and all(shape.single for shape in world.shapes)
        st[o.WALKING] = walks
        one, none = np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int32)
        if not walks:
            return none, none, one, one, one, frozen(np.zeros(1, dtype=np.uint8))
        st[o.STRIDE] = world.space.stride
        room = (world.space.height + 2) * world.space.stride
        taken, left = np.zeros((2, room), dtype=np.int32)
        flags = self._flags.reshape(-1, m) if m else np.zeros((o.FLAGS, 0), dtype=np.int64)
        flags[o.CELL], flags[o.CAME] = world.where, running.came
        if m:
            flags[o.STEP_X : o.STEP_Y + 1] = np.array(world.step, dtype=np.int64).T
            taken[flags[o.CELL]] = np.arange(1, m + 1)
        # A cell may be left twice in a tick: by one that goes back, and by one that came after it.
        gone = np.zeros(2 * m + 2, dtype=np.int64)
        st[o.LEFT] = len(world.left)
        gone[: len(world.left)] = list(world.left)
        left[list(world.left)] = [obstacle + 1 for obstacle in world.left.values()]
        tables: dict[int, tuple[int, Shape]] = {}
        rows: list[int] = []
        own: list[int] = []
        drawn = 0
        for w in traffic.walkers:
            place, _ = tables.setdefault(id(w.shape), (len(tables), w.shape))  # bits: only tells them apart
            rows += (place, len(own), len(w.own), drawn)
            own += w.own
            drawn += w.spec.count + 2
        st[o.WALKERS], st[o.PER_TICK] = len(traffic.walkers), drawn
        st[o.DRAWN_UNTIL] = running.ticks
        bits = [shape.step_bits() for _, shape in tables.values()] or [frozen(np.zeros(1, dtype=np.uint8))]
        open_steps = bits[0] if len(bits) == 1 else frozen(np.concatenate(bits))
        return taken, left, gone, _ints(rows), _ints(own), open_steps

    def _make_buffers(self) -> tuple[Any, ...]:
        """Working memory and what the kernel writes: ``near`` to ``went`` of the kernel."""
        st, m = self._st, self._m
        legs = max(int(st[o.WALKS]) * m, 1)
        log = 2 * CHUNK + 2
        # Its size stands for the work, also where there are few obstacles.
        went = 2 * max(m, 4) * (int(st[o.WALKS]) + CHUNK)
        st[o.LEG_ROOM], st[o.LOG_ROOM], st[o.WENT_ROOM] = legs, log, went
        self._legs, self._log = np.zeros(7 * legs), np.zeros(4 * log)
        self._reasons, self._went = np.zeros(2 * log, dtype=np.int64), np.zeros(4 * went)
        self._seg = np.zeros(9)
        self._soon = np.zeros(2 * int(_points(self._run)) + 2 if st[o.WALKING] else 2)
        return (
            np.zeros(8 * m), self._legs, self._seg, self._log, self._reasons, self._went,
        )  # fmt: skip

    def _code(self, word: str) -> int:
        if word not in self._words:
            self._words.append(word)
        return self._words.index(word)

    def _leg(self) -> int:
        return max(len(self._run.state.curves) - 1, 0)

    # ---- periods --------------------

    def go(self) -> None:
        """Drive on until the period to stop at is over, or something has changed that arrays have to be made again.

        Cancellation and signals are answered between two periods, every :data:`CHUNK` of them, where a caller may go on.
        """
        try:
            while not self._written:
                cancellation.checkpoint()
                with cancellation.shielded(), cancellation.uninterrupted():
                    self._chunk()
        except BaseException:
            if not self._written:
                self._write_back()
            raise

    def _chunk(self) -> None:
        """Drive until the kernel pauses between two periods, or Python has brought a period to its end."""
        st, fs, run = self._st, self._fs, self._run
        taken, left, gone, walkers, own, open_steps = self._world
        self._prepare()
        while True:
            code = int(
                k.advance(
                    st, fs, *self._path, self._each, self._flags, *self._buffers, taken, left, gone, self._draws,
                    walkers, own, open_steps, self._soon,
                )
            )  # fmt: skip
            if code == k.DECIDE:
                self._decide()
            elif code == k.DECIDE_TICK:
                self._begin_tick()
            else:
                break
        if code == k.PAUSED and st[o.PERIODS] < self._last:
            self._drain()
            return
        self._write_back()
        if code == k.NEAR:
            run.finish(self._trajectory())
        elif code == k.CAME:
            run.afterwards(float(fs[o.BEFORE]))
        elif code == k.FAULT:
            run.period()

    def _prepare(self) -> None:
        """Draws for the next ticks, and the period to pause at."""
        st = self._st
        st[o.STOP_AT] = min(self._last, int(st[o.PERIODS]) + CHUNK)
        if st[o.WALKING] and st[o.PHASE] == k.LISTEN and st[o.NOW] + st[o.WALKS] > st[o.DRAWN_UNTIL]:
            first, count = int(st[o.NOW]) + 1, max(TICKS, int(st[o.WALKS]))
            parts = [
                steps(w.key, w.spec.count, first, count) for w in self._run.others.traffic.traffic.walkers
            ]
            if parts:
                self._draws = (parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)).reshape(-1)
            st[o.DRAWN_FROM], st[o.DRAWN_UNTIL] = first, first + count - 1

    def _drain(self) -> None:
        """Take in the stretches of the robot and the corners of the obstacles' tracks."""
        st, run = self._st, self._run
        count, words = int(st[o.LOGGED]), self._words
        if count:
            log = self._log.reshape(4, -1)[:, :count].tolist()
            reasons = self._reasons.reshape(2, -1)[:, :count].tolist()
            run.log.extend(log, self._leg(), [words[code] for code in reasons[0]], reasons[1])
            st[o.LOGGED] = 0
        rows = int(st[o.WENT])
        if rows:
            numbers = run.others.traffic.numbers.tolist()
            table = self._went[: 4 * rows].reshape(-1, 4)
            go = run.others.roster.go
            for one, (t, x, y) in zip(
                table[:, 0].astype(np.int64).tolist(), table[:, 1:].tolist(), strict=True
            ):
                go(numbers[one], t, x, y)
            st[o.WENT] = 0

    def _write_back(self) -> None:
        """Bring the drive up to the arrays, which are of no use any more."""
        self._written = True
        self._drain()
        self._write_robot()
        self._write_obstacles()
        if self._st[o.WALKING]:
            self._write_world()

    def _write_robot(self) -> None:
        st, fs, run = self._st, self._fs, self._run
        state, waiting, others = run.state, run.waiting, run.others
        state.periods = int(st[o.PERIODS])
        state.t, state.s, state.v = float(fs[o.T]), float(fs[o.S]), float(fs[o.V])
        state.decision = Decision(
            float(fs[o.PUSH]), self._words[int(st[o.CAUSE])], int(st[o.INDEX]), int(st[o.REST])
        )
        waiting.stood, waiting.waited = float(fs[o.STOOD]), float(fs[o.WAITED])
        waiting.anchor = float(fs[o.ANCHOR])
        waiting.tries, waiting.reported = int(st[o.TRIES]), bool(st[o.REPORTED])
        if st[o.KNOWN]:
            run.watch.last = ObstacleMessage(
                float(fs[o.STAMP]),
                self._rows(o.LAST_X),
                others.radius,
                others.top_speed,
                self._rows(o.HEARD_X),
            )
            run.watch.since = self._row(o.SINCE)

    def _write_obstacles(self) -> None:
        """Bring the obstacles of the drive up to the arrays."""
        st, fs, others = self._st, self._fs, self._run.others
        traffic = others.traffic
        others.xy, others.velocity = self._rows(o.SEEN_X), self._rows(o.SPEED_X)
        rows = int(st[o.LEGS])
        others.legs = np.ascontiguousarray(self._legs.reshape(7, -1)[:, :rows].T)
        others.legs[:, o.OF] = traffic.numbers[others.legs[:, o.OF].astype(np.int64)]
        traffic.at, traffic.going, traffic.to = self._rows(o.AT_X), self._rows(o.GO_X), self._rows(o.TO_X)
        traffic.ticks = int(st[o.NOW])
        traffic.stopped, traffic.world.late = set(self._which(o.STOPPED)), set(self._which(o.LATE))
        traffic.nearest, traffic.halts, traffic.sees = (
            float(fs[o.NEAREST]),
            float(fs[o.HALTS]),
            float(fs[o.SEES]),
        )

    def _write_world(self) -> None:
        """Bring the world of the random walkers up to the arrays."""
        st, m, traffic = self._st, self._m, self._run.others.traffic
        world = traffic.world
        flags = self._flags.reshape(o.FLAGS, m)
        numbers = flags[o.CELL].tolist()
        world.where[:] = numbers
        world.step[:] = zip(flags[o.STEP_X].tolist(), flags[o.STEP_Y].tolist(), strict=True)
        world.taken = {number: obstacle for obstacle, number in enumerate(numbers)}
        _, left, gone, *_ = self._world
        cells = gone[: int(st[o.LEFT])]
        owners = (left[cells] - 1).tolist()
        world.left = dict(zip(cells.tolist(), owners, strict=True))
        world.moved([obstacle for obstacle, step in enumerate(world.step) if step != (0, 0)])
        traffic.came[:] = flags[o.CAME].tolist()

    def _row(self, row: int) -> Floats:
        """A row of ``each``; float64, (m,)."""
        return self._each[row * self._m : (row + 1) * self._m].copy()

    def _rows(self, first: int) -> Floats:
        """Two rows of ``each`` as pairs; float64, (m, 2)."""
        m = self._m
        return np.ascontiguousarray(self._each[first * m : (first + 2) * m].reshape(2, m).T)

    def _which(self, row: int) -> list[int]:
        """The obstacles that a row of ``flags`` marks."""
        marked: list[int] = np.flatnonzero(self._flags[row * self._m : (row + 1) * self._m]).tolist()
        return marked

    # ---- what Python does --------------------

    def _trajectory(self) -> Trajectory:
        """What the robot does in this period."""
        seg = self._seg.tolist()
        t, s, v, a = seg[: o.SEG_S], seg[o.SEG_S :], seg[o.SEG_V :], seg[o.SEG_A :]
        count = int(self._st[o.SEGMENTS])
        made = [Segment(t[n], t[n + 1], s[n], v[n], a[n]) for n in range(count)]
        return Trajectory(self._run.state.leg.route, made)

    def _decide(self) -> None:
        """Have the law decide."""
        st, fs = self._st, self._fs
        self._write_robot()
        made = self._run.decide(float(fs[o.END] - fs[o.T]))
        fs[o.PUSH], st[o.CAUSE], st[o.INDEX], st[o.REST] = (
            made.a,
            self._code(made.cause),
            made.cause_index,
            made.rest,
        )

    def _begin_tick(self) -> None:
        """Have the traffic begin a tick."""
        st, each, traffic = self._st, self._each.reshape(o.EACH, self._m), self._run.others.traffic
        self._drain()
        self._write_obstacles()
        traffic.begin_tick(traffic.ticks * traffic.tick, self._trajectory())
        st[o.NOW], st[o.LATE_ONES], st[o.PHASE] = traffic.ticks, len(traffic.world.late), k.TICK_BEGUN
        each[o.TO_X : o.TO_Y + 1], each[o.GO_X : o.GO_Y + 1] = traffic.to.T, traffic.going.T
        late = self._flags.reshape(o.FLAGS, self._m)[o.LATE]
        late[:] = 0
        late[sorted(traffic.world.late)] = 1


def _ints(rows: list[int]) -> Ints:
    """Whole numbers as one row, at least one."""
    return np.array(rows or [0], dtype=np.int64)
