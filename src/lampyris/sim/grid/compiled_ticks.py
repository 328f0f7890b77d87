"""Compiled ticks: a simulation's state as arrays, on which a kernel does many ticks at once.

The rules are those of the loop (:mod:`lampyris.sim.grid.loop`), which tests hold equal to the kernel. The arrays are made of
a simulation between two ticks, and written back to it before it is looked at or changed; what neither needs is never
made. The kernel comes back where the planner has to be asked. Speeds of laws that it does not know are filled in
afterwards: a robot makes one step a tick, however fast it is.
"""

from __future__ import annotations

import weakref
from functools import lru_cache
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels import loading
from lampyris.kernels.adgso.tick_speed import OF_GOAL
from lampyris.kernels.simulation import ticks as k
from lampyris.kernels.simulation.asking import (
    ANSWERS,
    CLOCK_ALL,
    CLOCK_ASKED,
    EXPANSIONS,
    FROM,
    PENDING,
    SWITCHES,
)
from lampyris.kernels.simulation.tick_speed import RINGS, UNKNOWN
from lampyris.model.change import Change
from lampyris.model.grid import GridKey, frozen
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.trace import Event, Outcome
from lampyris.planning.base import AnswersInTicks, Budget, Planner, Session
from lampyris.sim.grid.editing import Walls
from lampyris.sim.grid.following import Following, follow
from lampyris.sim.grid.pursuit import GoalPursuit
from lampyris.sim.grid.sensing import observed_obstacles
from lampyris.sim.grid.state import SimulationState
from lampyris.sim.grid.tick_speed import TickSpeed
from lampyris.sim.traffic.obstacle_draws import steps_of_all
from lampyris.sim.traffic.traffic import Recording, Shuttle, Traffic, Walkers
from lampyris.sim.world.cell_index import COMPILED_CELLS, KEPT, CellIndex, bordered, shared
from lampyris.sim.world.endings import gave_up, too_late
from lampyris.sim.world.targets import Targets
from lampyris.sim.world.world import Occupancy
from lampyris.typing import Cell, Floats

BLOCK = 64
"""Ticks whose draws are made at once, and for which there is room at first."""
DRAWS = 65_536
"""Draws that are made at once, at most; those of one tick in any case."""
APPEAR_NS = 300
"""Nanoseconds that a cell takes in plain Python when the map is looked through for one at which an obstacle appears."""

CAUSES = (
    "start", "limit", "ring 1", "ring 2", "angle", "goal", "acceleration", "braking", "waiting", "clearance", "obstacle",
    "",
)  # fmt: skip
"""Causes by the kernel's numbers; those of other laws follow."""

Ints: TypeAlias = NDArray[np.int64]
_NOTHING: Ints = np.zeros(1, dtype=np.int64)


class AnswersKernel(Protocol):
    """A session that a kernel can ask by itself; see :class:`lampyris.planning.adgso.session.AdGsoSession`."""

    def answers(self, wanted: int, limit: int | None, obstacles: int, live: bool) -> AnswersInTicks | None:
        """How it is asked for the next steps, and ``wanted`` more, among so many obstacles at most; ``live``: all of one
        cell, and of unknown future. None: a plan has to be asked for."""
        ...

    def first_answers(
        self, wanted: int, limit: int | None, obstacles: int, live: bool
    ) -> tuple[AnswersInTicks, int] | None:
        """The same before the first call, with the states that were expanded to begin with."""
        ...

    def answered(self, asked: Ints) -> None:
        """Take in what was asked and answered."""
        ...

    def whole_plan(self, change: Change) -> Plan:
        """The plan that the last answer is a part of."""
        ...


class Running(Protocol):
    """What is needed of a simulation; see :class:`lampyris.sim.grid.loop.Simulation`."""

    scene: Scene
    planner: Planner
    session: Session
    state: SimulationState
    world: Occupancy
    traffic: Traffic
    walls: Walls
    tick_speed: TickSpeed
    patience: int
    budget: Budget | None
    sensor: Sensor | None
    pursuit: GoalPursuit | None
    visits: Targets

    def ask(self, change: Change, here: Cell, ahead: Cell | None) -> None:
        """Ask the planner, and follow its plan from here on."""
        ...

    def end(self, outcome: Outcome, detail: str = "") -> None:
        """The simulation is over."""
        ...


def supported(run: Running) -> bool:
    """Whether the kernel knows a simulation's rules: a robot and obstacles of one cell that step to neighbours, a known
    map, a goal that stands still, no via points, and no more cells than :data:`COMPILED_CELLS`."""
    if (
        run.scene.grid.blocked.size > COMPILED_CELLS
        or run.sensor is not None
        or run.pursuit is not None
        or run.visits.via
        or not run.world.robot_shape.single
    ):
        return False
    return all(shape.single for shape in (*run.world.shapes, *(w.shape for w in run.traffic.walkers)))


class CompiledTicks:
    """A simulation as arrays, between two ticks.

    Parameters
    ----------
    run : the simulation; while the arrays are ahead of it, nobody else may change it.
    """

    def __init__(self, run: Running) -> None:
        # A simulation refers to its arrays: without a weak reference back both would be left to the garbage collector.
        self._run: Running = weakref.proxy(run)
        world, state = run.world, run.state
        self._space: CellIndex = world.space
        self._goal = self._space.number(run.scene.goal)
        self._synced = self._base = state.now
        st = self._st = np.zeros(k.STATE, dtype=np.int64)
        self._room = (self._space.height + 2) * self._space.stride
        self._walkers = run.traffic.walkers
        more = sum(
            w.spec.count - len(w.own) for w in self._walkers if w.spec.rate is not None
        )  # bits: whole numbers
        self._capacity, self._appearing = max(len(world.where) + more, 1), more > 0
        # One by one: a list of places takes several times as long.
        st[k.NOW], st[k.BASE] = state.now, state.now
        st[k.LAST_TICK] = -1 if state.last_tick is None else state.last_tick
        st[k.PATIENCE], st[k.WAITING], st[k.HOLDING] = run.patience, state.waiting, state.holding
        st[k.OBSTACLES], st[k.CAPACITY] = len(world.where), self._capacity
        st[k.ROBOT], st[k.GOAL], st[k.ROOM] = world.robot, self._goal, self._room
        st[k.STRIDE], st[k.HEIGHT] = self._space.stride, self._space.height
        st[k.DRAWN_FROM] = state.now + 1
        self._drawn_until = state.now
        self._obstacles = self._pack_obstacles()
        self._tables = self._pack_tables()
        self._traffic = self._pack_traffic()
        self._law = self._pack_law()
        self._marks = np.zeros(self._capacity + 8, dtype=np.int64)
        self._events = np.zeros(3 * (4 * BLOCK + len(self._walkers) * BLOCK), dtype=np.int64)
        self._words = list(CAUSES)
        self._draws: Floats = np.zeros(1)
        self._tracks = np.zeros((BLOCK + 1) * self._capacity, dtype=np.int64)
        self._robots, self._causes = np.zeros((2, BLOCK + 1), dtype=np.int64)
        self._speeds: Floats = np.zeros(BLOCK + 1)
        self._robots[0] = world.robot
        self._speeds[0] = run.tick_speed.v
        self._tracks[: len(world.where)] = world.where
        self._paced = state.now
        self._partial = False
        self._asked_at = (0, 0)
        self._live = run.traffic.recording is None
        self._follow(state.following, None if state.plan is None else state.plan)

    # ---- arrays --------------------

    def _pack_obstacles(self) -> tuple[Any, ...]:
        """Where obstacles are and what they did: ``where`` to ``gone`` of the kernel."""
        world, st = self._run.world, self._st
        where, step_x, step_y, gone = np.zeros((4, self._capacity), dtype=np.int64)
        taken, left = np.zeros((2, self._room), dtype=np.int16)  # room for more than MAX_OBSTACLES
        count = len(world.where)
        where[:count] = world.where
        if world.left:
            steps_made = np.array(world.step, dtype=np.int64).T
            step_x[:count], step_y[:count] = steps_made
            gone[: len(world.left)] = list(world.left)
            left[list(world.left)] = [obstacle + 1 for obstacle in world.left.values()]
        st[k.LEFT] = len(world.left)
        taken[where[:count]] = np.arange(1, count + 1)
        return where, step_x, step_y, taken, left, gone

    def _pack_tables(self) -> tuple[Any, ...]:
        """Where obstacles may be and step, by shape, and where the robot may step."""
        given = (*self._run.world.shapes, *[w.shape for w in self._walkers])
        shapes = {id(shape): shape for shape in given}  # bits: only tells them apart
        self._place = {key: place for place, key in enumerate(shapes)}
        opened = np.zeros(1, dtype=np.uint8)
        if any(w.spec.rate is not None for w in self._walkers):
            masks = [bordered(shape.open).reshape(-1).view(np.uint8) for shape in shapes.values()]
            opened = np.concatenate(masks)
        bits = [shape.step_bits() for shape in shapes.values()] or [np.zeros(1, dtype=np.uint8)]
        open_steps = bits[0] if len(bits) == 1 else np.concatenate(bits)
        return frozen(opened), frozen(open_steps), self._run.world.robot_shape.step_bits()

    def _pack_traffic(self) -> tuple[Any, ...]:
        """Walkers, shuttles and recordings: ``walkers`` to ``rates`` and ``shuttles`` to ``recorded`` of the kernel."""
        st, traffic, place = self._st, self._run.traffic, self._place
        first = drawn = 0
        rows, rates = [], []
        for w in self._walkers:
            table = place[id(w.shape)]  # bits: only tells them apart
            rows.append((table, first, len(w.own), w.spec.count, drawn))
            rates.append(-1.0 if w.spec.rate is None else w.spec.rate)
            first += w.spec.count
            drawn += w.spec.count + 2
        own = np.zeros(max(first, 1), dtype=np.int64)
        for w, row in zip(self._walkers, rows, strict=True):
            own[row[1] : row[1] + row[2]] = w.own
        st[k.PER_TICK], st[k.WALKERS] = drawn, len(rows)
        self._shuttles = [one for one in traffic.drivers if isinstance(one, Shuttle)]
        routes: list[int] = []
        drives = []
        for one in self._shuttles:
            turn = -1 if one.turn_after is None else one.turn_after
            table = place[id(self._run.world.shapes[one.obstacle])]  # bits: only tells them apart
            drives.append(
                (
                    one.obstacle,
                    table,
                    len(routes),
                    len(one.route),
                    one.at,
                    one.ahead,
                    one.waited,
                    int(one.yields),
                    turn,
                )
            )
            routes += one.route
        tracks: list[int] = []
        recordings = []
        recording: Recording | None = traffic.recording
        for obstacle, recorded in () if recording is None else recording.tracks:
            recordings.append((obstacle, len(tracks), len(recorded.track)))
            tracks += map(self._space.number, recorded.track)
        st[k.SHUTTLES], st[k.RECORDINGS] = len(drives), len(recordings)
        self._drives = _flat(drives)
        self._kinds = _flat(rows)
        self._keys = (
            np.array([w.key for w in self._walkers], dtype=np.uint64),
            np.array([w.spec.count for w in self._walkers], dtype=np.int64),
        )
        self._own = own
        return np.array(rates or [-1.0]), self._drives, _flat(routes), _flat(recordings), _flat(tracks)

    def _pack_law(self) -> tuple[Any, ...]:
        """The speed law: ``law`` to ``why`` of the kernel."""
        speed = self._run.tick_speed
        known = speed.for_kernel()
        self._st[k.HORIZON] = speed.horizon
        if known is None:
            self._st[k.LAW] = k.LAW_OUTSIDE
            none = frozen(np.zeros(1, dtype=np.uint8))
            return (
                frozen(np.zeros(1)),
                none,
                none,
                np.zeros(1, dtype=np.int32),
                np.zeros(1),
                np.zeros(1, np.int64),
            )
        law, numbers, counted, walls = known
        self._st[k.LAW] = law
        nodes = speed.horizon + 2
        scene = self._run.scene
        if shared(scene) and speed.scene.grid is scene.grid:
            blocked, near = _walls(GridKey(scene.grid), int(numbers[RINGS]) if law == k.LAW_PHYSICAL else -1)
        else:
            blocked = frozen(bordered(walls).reshape(-1).view(np.uint8))
            near = np.full(self._room if law == k.LAW_PHYSICAL else 1, UNKNOWN, dtype=np.int32)
        return numbers, counted, blocked, near, np.zeros(3 * nodes), np.zeros(2 * nodes, dtype=np.int64)

    def _log(self, ticks: int) -> None:
        """Room for so many ticks, with what is written already."""
        tracks = np.zeros(ticks * self._capacity, dtype=np.int64)
        robots, causes = np.zeros((2, ticks), dtype=np.int64)
        speeds = np.zeros(ticks)
        for old, new in (
            (self._tracks, tracks), (self._robots, robots), (self._causes, causes), (self._speeds, speeds),
        ):  # fmt: skip
            new[: len(old)] = old
        self._tracks, self._robots, self._causes, self._speeds = tracks, robots, causes, speeds

    def _follow(self, following: Following, plan: Plan | None) -> None:
        """Take a plan from Python."""
        st = self._st
        self._following: Following | None = following
        steps_left = len(following.route) - 1
        st[k.PLACE], st[k.UNTIL], st[k.STEPS] = following.at, following.until, steps_left
        timed = following.ticks is not None
        st[k.TIMED], st[k.UNTIL_TICK], st[k.COUNTED] = timed, following.until_tick, following.counted
        st[k.COMMITS] = plan is not None and plan.commit is not None
        st[k.ROUNDS] = 1 if plan is None or plan.commit is not None else plan.iterations
        st[k.ANSWERED] = 0
        self._sentence = "" if plan is None or plan else plan.sentence
        self._enter_at = _flat(following.ticks) if following.ticks is not None else _NOTHING
        self._route = _NOTHING
        if steps_left >= 0:
            cells = np.array(following.route if following.cells is None else following.cells, dtype=np.int64)
            self._route = (cells[:, 1] + 1) * self._space.stride + cells[:, 0] + 1

    # ---- ticks --------------------

    @property
    def last_tick(self) -> int:
        """The tick with which the simulation ends."""
        return int(self._st[k.LAST_TICK])

    @last_tick.setter
    def last_tick(self, tick: int) -> None:
        self._st[k.LAST_TICK] = tick

    def begin(self) -> int:
        """Have a kernel answer the first question, before the first tick: the steps of the whole path; 0: a plan has to be
        asked for, of another session.
        """
        st, run = self._st, self._run
        if not self._may_answer():
            return 0
        session: AnswersKernel = run.session  # type: ignore[assignment]
        began = loading.cpu()
        found = session.first_answers(run.tick_speed.horizon + 2, self._limit(), self._capacity, self._live)
        if found is None:
            return 0
        answers, spent = found
        where = self._obstacles[0][: int(st[k.OBSTACLES])]
        closed = where[where != run.world.robot]
        self._marks[: len(closed)] = closed
        st[k.MARKED], st[k.AHEAD], st[k.STOP_AT] = len(closed), -1, st[k.NOW]
        answers.asked[PENDING] = 1
        self._call(answers)
        if not st[k.ANSWERED] or st[k.STEPS] < 1:
            return 0
        run.state.expansions += spent
        run.state.planning_s += loading.cpu() - began
        self._take(answers, 0.0)
        return int(st[k.STEPS])

    def go(self, last: int) -> None:
        """Tick on, to the end of tick ``last`` or to an outcome."""
        st, run = self._st, self._run
        while True:
            stop = self._prepare(last)
            st[k.STOP_AT] = stop
            answers = self._answers()
            began = loading.cpu()
            code = self._call(answers)
            if answers is not None:
                self._take(answers, loading.cpu() - began)
            self._read()
            if code == k.ASK:
                if answers is None or not answers.asked[PENDING]:
                    self._ask()
                continue
            if code != k.PAUSED:
                self._end(code)
                return
            if run.state.now >= last:
                return

    def _call(self, answers: AnswersInTicks | None) -> int:
        """Call the kernel; the reason to stop."""
        kernel = k.advance if answers is None else answers.kernel
        given = (
            self._st, *self._obstacles, self._draws, self._kinds, self._own, self._traffic[0], *self._tables[:2],
            *self._traffic[1:], self._tables[2], self._route, self._enter_at,
            self._robots, self._tracks, self._speeds, self._causes, self._events, self._marks, *self._law,
            *(() if answers is None else (answers.asked, *answers.rest)),
        )  # fmt: skip
        appear = self._to_appear()
        if appear:
            kernel.expect(1 + appear * self._room * APPEAR_NS // kernel.price(given), *given)
        return int(kernel(*given))

    def _to_appear(self) -> int:
        """Obstacles that may appear in this call, at most: the whole map is looked through for each."""
        st = self._st
        if not self._appearing:
            return 0
        ticks = int(st[k.STOP_AT]) - int(st[k.NOW])
        return max(min(self._capacity - int(st[k.OBSTACLES]), ticks * int(st[k.WALKERS])), 0)

    def _prepare(self, last: int) -> int:
        """Draws and room for the next ticks; the tick to stop at."""
        st = self._st
        now = int(st[k.NOW])
        if now >= self._drawn_until and st[k.PHASE] == k.BEGIN:
            each = int(st[k.PER_TICK])
            ticks = max(1, min(BLOCK, DRAWS // max(each, 1)))
            if each:
                self._draws = steps_of_all(*self._keys, now + 1, ticks)
            st[k.DRAWN_FROM] = now + 1
            self._drawn_until = now + ticks
        stop = min(last, self._drawn_until)
        room = stop - self._base + 1
        if room > len(self._robots):
            self._log(max(room, 2 * len(self._robots)))
        return stop

    def _read(self) -> None:
        """Take in what the kernel has written: events, counts, and speeds that it has left out."""
        st, run = self._st, self._run
        state = run.state
        over = int(st[k.NOW]) - int(st[k.PHASE] != k.BEGIN)
        if st[k.LAW] == k.LAW_OUTSIDE:
            self._fill_in(over)
        count = int(st[k.EVENTS])
        if count:
            rows = self._events[: 3 * count].tolist()
            st[k.EVENTS] = 0
            for n in range(0, 3 * count, 3):
                self._report(rows[n], rows[n + 1], rows[n + 2])
        state.now = int(st[k.NOW])
        state.replans += int(st[k.REPLANS])
        state.waits += int(st[k.WAITS])
        state.iterations += int(st[k.ITERATIONS])
        st[k.REPLANS] = st[k.WAITS] = st[k.ITERATIONS] = 0

    def _report(self, tick: int, word: int, number: int) -> None:
        """An event in the loop's words."""
        if word == k.APPEARED:
            self._appeared(tick, self._walkers[number])
            return
        at = self._space.cell(number)
        here = self._space.cell(int(self._robots[tick - 1 - self._base])) if word == k.NOT_NOW else at
        what, sentence = {
            k.AFTER_WAIT: ("replan", "Asked again after waiting."),
            k.NOT_NOW: ("replan", f"The next cell, {at}, cannot be entered now; chose again."),
            k.MET: ("replan", "An obstacle came onto the robot; asked once more."),
            k.SCHEDULED: ("wait", "The plan waits here for the path to be clear."),
            k.WAS_HIT: ("hit", Outcome.HIT.sentence),
            k.WAITED: ("wait", self._sentence or "The next cell cannot be entered now."),
            k.NO_ENTRY: ("wait", "The next cell cannot be entered now."),
            k.HEMMED_IN: ("wait", Status.HEMMED_IN.sentence),
        }[word]
        self._run.state.events.append(Event(tick, what, here, sentence))

    def _appeared(self, tick: int, walkers: Walkers) -> None:
        """One more random walker."""
        traffic, state = self._run.traffic, self._run.state
        place = (tick - self._base) * self._capacity + len(traffic.obstacles)
        number = int(self._tracks[place])
        walkers.own.append(traffic.add(walkers.shape, number, "random-walk", walkers.spec, tick))
        state.tracks.append([])
        state.events.append(Event(tick, "appear", self._space.cell(number), "An obstacle appeared."))

    def _fill_in(self, over: int) -> None:
        """Speeds and causes of the ticks that are over, by a law that the kernel does not know."""
        speed, base = self._run.tick_speed, self._base
        done = self._paced
        causes = self._causes[done + 1 - base : over + 1 - base].tolist()
        self._paced = over
        driven = sum(cause in (OF_GOAL, k.OF_OUTSIDE) for cause in causes)
        at = int(self._st[k.PLACE]) - driven
        route = self._route_cells()
        for tick, cause in enumerate(causes, done + 1):
            if cause == OF_GOAL:
                at += 1
            elif cause != k.OF_OUTSIDE:
                speed.stop()
            else:
                at += 1
                v, word = speed.drive([route[at - 1], *route[at:]], self._there(tick))
                self._speeds[tick - base], self._causes[tick - base] = v, self._code(word)

    def _code(self, word: str) -> int:
        if word not in self._words:
            self._words.append(word)
        return self._words.index(word)

    def _there(self, tick: int) -> list[Cell]:
        """The cells of obstacles at a tick."""
        first = (tick - self._base) * self._capacity
        row = self._tracks[first : first + int(self._st[k.OBSTACLES])].tolist()
        return self._space.pairs(number for number in row if number)

    def _route_cells(self) -> list[Cell]:
        """The plan's cells, as far as they are known here."""
        if self._following is not None:
            return self._following.route
        count = int(self._st[k.STEPS]) + 1
        if not self._st[k.TIMED]:
            count = min(count, int(self._st[k.UNTIL]) + self._run.tick_speed.horizon + 2)
        return self._space.pairs(self._route[:count].tolist())

    # ---- the planner --------------------

    def _ask(self) -> None:
        """Ask the planner from where the robot stands."""
        st, run = self._st, self._run
        ahead = int(st[k.AHEAD])
        here = self._space.cell(int(st[k.ROBOT]))
        change = self._sensed(here, int(st[k.MARKED]))
        run.ask(change, here, None if ahead < 0 else self._space.cell(ahead))
        self._partial = False
        self._follow(run.state.following, run.state.plan)

    def _sensed(self, here: Cell, count: int) -> Change:
        """What the robot senses now."""
        run, now = self._run, int(self._st[k.NOW])
        tracks = None
        if run.planner.traits.sees_traffic:
            self._write_obstacles()
            tracks = observed_obstacles(run.traffic, now)
        closed = self._space.pairs(self._marks[:count].tolist())
        return Change(robot=here, obstacles=frozenset(closed), tick=max(now - 1, 0), obstacle_tracks=tracks)

    def _answers(self) -> AnswersInTicks | None:
        """How a kernel asks the session by itself; None: it cannot."""
        run = self._run
        find = getattr(run.session, "answers", None)
        if find is None or not self._may_answer():
            return None
        found: AnswersInTicks | None = find(
            run.tick_speed.horizon + 2, self._limit(), self._capacity, self._live
        )
        return found

    def _may_answer(self) -> bool:
        """Whether a kernel may answer in place of the session: it keeps to no seconds, and knows no news of the map."""
        budget = self._run.budget
        timed = budget is not None and (budget.seconds is not None or budget.stop is not None)
        return not timed and self._run.walls.reported

    def _limit(self) -> int | None:
        """States that one answer may expand."""
        return None if self._run.budget is None else self._run.budget.expansions

    def _take(self, answers: AnswersInTicks, seconds: float) -> None:
        """Take in what a kernel has asked, in a call of so many seconds."""
        st, run, asked = self._st, self._run, answers.asked
        session: AnswersKernel = run.session  # type: ignore[assignment]
        session.answered(asked)
        state, row = run.state, asked.tolist()
        state.planning_s += seconds * row[CLOCK_ASKED] / max(row[CLOCK_ALL], 1)
        state.expansions += row[EXPANSIONS]
        state.path_switches += row[SWITCHES]
        if row[ANSWERS]:
            state.repaired = False
        if st[k.ANSWERED]:
            self._route, self._following, self._partial = answers.path, None, True
            self._enter_at = _NOTHING if answers.enter is None else answers.enter
            if row[ANSWERS]:
                self._asked_at = row[FROM], int(st[k.MARKED])
        asked[:PENDING] = asked[PENDING + 1 :] = 0

    # ---- the end --------------------

    def _end(self, code: int) -> None:
        """The simulation is over."""
        run, st = self._run, self._st
        here, now = self._space.cell(int(st[k.ROBOT])), int(st[k.NOW])
        sentence = self._sentence
        if st[k.ANSWERED]:
            sentence = Status.HEMMED_IN.sentence if st[k.STEPS] < 0 else ""
        if code == k.AT_GOAL:
            run.end(Outcome.ARRIVED)
        elif code == k.HIT:
            what = f"An obstacle that does not yield ran into the robot, which stood still at {here}."
            run.end(Outcome.HIT, what)
        elif code == k.TIMEOUT:
            run.end(Outcome.TIMEOUT, too_late(now))
        else:
            waited = int(st[k.HOLDING if code == k.HELD else k.WAITING])
            run.end(Outcome.BLOCKED, gave_up(waited, here, run.patience, sentence))

    # ---- looking --------------------

    def places(self) -> tuple[Ints, Ints, Floats, list[str]]:
        """Since the tick of which the arrays were made: the robot's cells, those of all obstacles (with that tick; ticks,
        obstacles; 0: not there yet), speeds and causes."""
        ticks = int(self._st[k.NOW]) - self._base
        tracks = self._tracks[: (ticks + 1) * self._capacity].reshape(ticks + 1, -1)
        words = self._words
        causes = [words[code] for code in self._causes[1 : ticks + 1].tolist()]
        tracks = tracks[:, : int(self._st[k.OBSTACLES])]
        return self._robots[1 : ticks + 1], tracks, self._speeds[1 : ticks + 1], causes

    @property
    def base(self) -> int:
        """The tick of which the arrays were made."""
        return self._base

    def history(self) -> tuple[Ints, Ints, Floats, tuple[str, ...]]:
        """The same as :meth:`places` with the first tick, whole: numbers of cells, speeds (a new array) and causes."""
        ticks = int(self._st[k.NOW]) + 1 - self._base
        words = self._words
        tracks = self._tracks[: ticks * self._capacity].reshape(ticks, -1)[:, : int(self._st[k.OBSTACLES])]
        causes = ("start", *[words[code] for code in self._causes[1:ticks].tolist()])
        speeds = self._speeds[:ticks].copy()
        speeds[0] = 0.0
        return self._robots[:ticks], tracks, speeds, causes

    def write_back(self) -> None:
        """Bring the simulation up to the arrays."""
        run, st = self._run, self._st
        state, world = run.state, run.world
        robots, tracks, speeds, causes = self.places()
        new = self._synced - self._base
        state.cells += self._space.pairs(robots[new:].tolist())
        state.speeds += speeds[new:].tolist()
        state.causes += causes[new:]
        for track, column in zip(state.tracks, tracks[new + 1 :].T.tolist(), strict=True):
            track += [number for number in column if number]
        self._synced = int(st[k.NOW])
        state.waiting, state.holding = int(st[k.WAITING]), int(st[k.HOLDING])
        self._write_obstacles()
        world.put_robot(int(st[k.ROBOT]))
        rows = self._drives.tolist()
        for n, one in enumerate(self._shuttles):
            one.at, one.ahead, one.waited = rows[k.SHUTTLE * n + k.AT : k.SHUTTLE * n + k.STOOD + 1]
        if self._partial:
            self._whole_plan()
        assert self._following is not None
        self._following.at, self._following.counted = int(st[k.PLACE]), bool(st[k.COUNTED])
        state.following = self._following
        if st[k.LAW] != k.LAW_OUTSIDE:
            last = int(self._causes[state.now - self._base]) if state.now > self._base else -1
            speed = float(self._speeds[state.now - self._base])
            if CAUSES[last] in ("start", "waiting"):
                run.tick_speed.stop()
            elif last >= 0 and CAUSES[last] != "goal":
                at = int(st[k.PLACE])
                before = float(self._speeds[state.now - 1 - self._base])
                run.tick_speed.resume(before, speed, self._following.route[at - 1 :], self._there(state.now))

    def _whole_plan(self) -> None:
        """In place of the planner's next steps the plan that they are a part of."""
        run = self._run
        robot, count = self._asked_at
        closed = frozenset(self._space.pairs(self._marks[:count].tolist()))
        session: AnswersKernel = run.session  # type: ignore[assignment]
        run.state.plan = session.whole_plan(Change(robot=self._space.cell(robot), obstacles=closed))
        at = int(self._st[k.PLACE]), bool(self._st[k.COUNTED])
        self._following = follow(run.state.plan, self._space.cell(robot))
        self._st[k.UNTIL] = self._following.until
        self._following.at, self._following.counted = at
        self._follow(self._following, run.state.plan)
        self._partial = False

    def _write_obstacles(self) -> None:
        """Bring the world's obstacles up to the arrays."""
        world, count = self._run.world, int(self._st[k.OBSTACLES])
        where, step_x, step_y, _, left, gone = self._obstacles
        numbers = where[:count].tolist()
        world.where[:] = numbers
        world.step[:] = zip(step_x[:count].tolist(), step_y[:count].tolist(), strict=True)
        world.taken = {number: obstacle for obstacle, number in enumerate(numbers)}
        cells = gone[: int(self._st[k.LEFT])]
        owners = (left[cells] - 1).tolist()
        world.left = dict(zip(cells.tolist(), owners, strict=True))
        world.moved(owners)


@lru_cache(maxsize=KEPT)
def _walls(key: GridKey, rings: int) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Walls by cell number, and how near they are, as far as it was looked up: the same for every simulation on a map."""
    blocked = frozen(bordered(key.grid.blocked).reshape(-1).view(np.uint8))
    return blocked, np.full(len(blocked) if rings >= 0 else 1, UNKNOWN, dtype=np.int32)


def _flat(rows: Any) -> Ints:
    """Whole numbers as one row, at least one."""
    return np.array(rows, dtype=np.int64).reshape(-1) if rows else np.zeros(1, dtype=np.int64)
