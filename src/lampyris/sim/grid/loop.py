"""The loop: sense, plan, step, record. One tick at a time, and every tick can be looked at.

From tick t to t + 1, in this order:

0. **Walls come and go**, where the scene has an edit of tick t + 1 (:mod:`lampyris.sim.grid.editing`). A goal that
   moves does so now (:mod:`lampyris.sim.grid.pursuit`). Via points are driven to one after the other, each by a new
   session of the planner; the goal is the last (:mod:`lampyris.sim.world.targets`).
1. **Obstacles move**: recorded ones (whatever the others do), crossing ones, patrols, random walkers; within
   a kind in order of index. Each sees the new places of those that have moved and the old places of the
   rest.
2. **The robot senses** all places, and each obstacle's last step.
3. **The robot steps** to the next cell of its plan if that is legal now; otherwise it asks its planner
   again from where it stands and takes the new plan's first step if that is legal; otherwise it waits, and
   asks again in the next tick. A plan with a schedule says itself when to step, and when to wait.
4. **The tick is recorded**, with the robot's speed and what bound it. A robot with a sensor looks around from its new
   cell (:mod:`lampyris.sim.world.seen_map`); it is asked again in the next tick where a new wall is in its path.

Legal, for every two obstacles: never two in one cell, never a swap, never both diagonals of one 2x2 block in
one tick; for footprints alike (:mod:`lampyris.sim.world.world`). A step of the robot is legal only if walls allow
it too. One step takes one tick, a knight's step as well.

The planner is asked at tick 0, whenever the steps that its plan commits to have been driven (not a replan),
and whenever the next step is not legal or there is none because the robot waits (a replan). A gate that the
plan reports as met is a replan too, and so is to be asked because walls have come into the path, or gone.
Where the old plan's next step was legal and the new plan goes another way, the robot changed its mind, a
*path switch*: many of them are what people call dithering.

Obstacles of our own making yield to the robot or run into it; the robot never moves into any obstacle. If an
obstacle that does not yield has come onto the robot, the robot may still leave in the same tick, by its
planned or re-chosen step. There the planner is asked twice if need be: once to choose again, and once more in
place of the step it has no time to wait (AD-GSO then repairs its field; without it, one run in eight among
twenty crossing obstacles was a hit instead of one in forty). If the robot cannot leave, it was hit while it
stood still: the outcome ``hit``, and the end. ``collision`` cannot come about.

Draws: the planner has the stream ``SeedSequence((seed, 0))``, specification k of the traffic
``SeedSequence((seed, 1 + k))``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from lampyris._core.defaults import SIMULATION_PATIENCE
from lampyris._core.exclusive import Exclusive, one_call
from lampyris._core.limits import TICKS
from lampyris._core.scalars import MOST_WHOLE, is_whole
from lampyris._core.values import unchecked
from lampyris.errors import SettingError, shown
from lampyris.kernels import loading
from lampyris.model.change import Change
from lampyris.model.grid import frozen
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Recorded
from lampyris.planning.base import Budget, Planner, Session, SessionBase
from lampyris.planning.field.layers import moves_on
from lampyris.planning.selection import demand_cells
from lampyris.planning.through import not_free
from lampyris.sim.grid.compiled_ticks import CompiledTicks, supported
from lampyris.sim.grid.editing import Walls
from lampyris.sim.grid.following import follow
from lampyris.sim.grid.pursuit import MOVED, GoalPursuit
from lampyris.sim.grid.sensing import observed_obstacles, seen_cells, sense
from lampyris.sim.grid.state import SimulationState
from lampyris.sim.grid.tick_speed import SpeedLaw, TickSpeed
from lampyris.sim.traffic.obstacle_draws import seeded
from lampyris.sim.traffic.traffic import open_traffic
from lampyris.sim.world.cell_index import CellIndex, Step, robot_shape, shared
from lampyris.sim.world.endings import gave_up, too_late
from lampyris.sim.world.notes import Notes
from lampyris.sim.world.targets import REACHED, Targets, aimed
from lampyris.sim.world.world import Occupancy
from lampyris.typing import Cell, Cells, Floats

PATIENCE = SIMULATION_PATIENCE
"""Consecutive ticks the robot waits before it gives up.

The dissertation's own would be 1: wait one step, repair, then fail.
"""

_USUAL = SimulationSettings()

GoalTrack: TypeAlias = Recorded | Sequence[Any] | None

HOLD: Step = (-1, 0, 0)
"""In place of a step: stay, because the plan says so."""

_NEVER = {
    Status.NO_PATH: Outcome.NO_PATH,
    Status.START_OCCUPIED: Outcome.START_OCCUPIED,
    Status.GOAL_OCCUPIED: Outcome.GOAL_OCCUPIED,
}


def run(
    scene: Scene, planner: Planner, *, seed: int = 0, ticks: int | None = None, law: SpeedLaw = "physical",
    patience: int | None = None, sensor: Sensor | None = None, goal_track: GoalTrack = None, budget: Budget | None = None,
    progress: Callable[[int], None] | None = None,
) -> Trace:  # fmt: skip
    """Drive from start to goal through the scene's traffic; the whole story as a Trace.

    Parameters
    ----------
    scene : where, with its traffic.
    planner : the planner.
    seed : seed of all random draws, >= 0. Every planner meets the same obstacle draws as far as its own deeds
        allow.
    ticks : the last tick; None: ten times (height + width), and four times the steps of the first plan on
        top, but not above :data:`lampyris._core.limits.TICKS`.
    law : the speed law: ``physical``, ``dissertation``, or settings of one of them.
    patience : the robot gives up after more than so many ticks of waiting in a row; None: 50.
    sensor : of a robot that does not know the map; None: it does.
    goal_track : the goal's cell at each tick from 0, after the last of which it stays; None: it stands still.
    budget : of every single call of the planner; None: no limit.
    progress : called with each tick that is over.

    Raises
    ------
    SceneError : obstacles that do not fit the map: see :func:`lampyris.sim.traffic.traffic.open_traffic`.
    SettingError : a setting out of its range.
    UsageError : no such speed law.
    LimitError : too many obstacles.
    InternalFault : a plan that does not begin where the robot stands: a bug of the planner.
    """
    simulation = Simulation(
        scene, planner, seed=seed, ticks=ticks, law=law, patience=patience, sensor=sensor, goal_track=goal_track,
        budget=budget, plan_first=False,
    )  # fmt: skip
    simulation.finish(progress)
    return simulation.trace()


class Simulation(Exclusive):
    """A simulation that can be stopped between two ticks and looked at. For one thread at a time.

    Parameters
    ----------
    scene .. budget : as for :func:`run`.
    plan_first : whether the first plan is made at once. If not, and a kernel can answer the first question, it is made when it
        is needed.

    Attributes
    ----------
    state : all that changes from tick to tick besides the places of the obstacles.
    world : where the robot and all obstacles are.
    """

    def __init__(
        self, scene: Scene, planner: Planner, *, seed: int = 0, ticks: int | None = None,
        law: SpeedLaw = "physical", patience: int | None = None, sensor: Sensor | None = None,
        goal_track: GoalTrack = None, budget: Budget | None = None, plan_first: bool = True,
    ) -> None:  # fmt: skip
        demand_cells(planner, "a simulation in ticks")
        began, loaded = time.perf_counter(), loading.seconds()
        self.scene, self.planner, self.seed = scene, planner, _whole("seed", seed, 0)
        settings = _USUAL if ticks is None and patience is None else SimulationSettings(ticks, patience)
        self.patience = PATIENCE if settings.patience is None else settings.patience
        self.budget = budget
        self.sensor, self.goal = sensor, scene.goal
        self.pursuit = None if goal_track is None else GoalPursuit(scene, goal_track, planner)
        space = CellIndex(scene.grid)
        self.world = Occupancy(space, robot_shape(scene, space), space.number(scene.start))
        self.traffic = open_traffic(scene, self.world, self.seed)
        self.walls = Walls(scene, self.world, self.traffic, sensor)
        self.tick_speed = TickSpeed(scene if sensor is None else self.walls.scene, law)
        self.visits = Targets(self.walls.known, planner, goal_track is not None)
        self.visits.reach(scene.start, 0)
        self.goal = self._aim = self.visits.target
        self.session = self._opened()
        self.notes = Notes()
        self.state = SimulationState([scene.start], [[n] for n in self.world.where], settings.ticks)
        self._arrays: CompiledTicks | None = None
        if plan_first or not self._begin_in_kernel():
            self._begin()
        self.state.total_s += time.perf_counter() - began
        self.state.loading_s += loading.seconds() - loaded

    @property
    def now(self) -> int:
        """The last tick that is over."""
        return self.state.now

    @property
    def outcome(self) -> Outcome | None:
        """How it ended; None while it has not."""
        return self.state.outcome

    @property
    def plan(self) -> Plan:
        """The planner's last answer."""
        if self.state.plan is None:
            self._write_back()
        assert self.state.plan is not None
        return self.state.plan

    def _stream(self) -> np.random.Generator:
        return np.random.Generator(np.random.PCG64(seeded(self.seed, 0)))

    # ---- planning --------------------

    def _opened(self) -> Session:
        """A session that plans to where the robot is to drive now. Simulations on one map share what a session shares."""
        session = self.planner.open(aimed(self.walls.known, self.goal), self._stream())
        if shared(self.scene) and isinstance(session, SessionBase):
            session.share_map()
        return session

    def _begin_in_kernel(self) -> bool:
        """Have a kernel answer the first question; whether it did. Where it did not, nothing has been asked."""
        answers = hasattr(self.session, "first_answers")
        if not answers or self.scene.edits or self.scene.start == self.scene.goal or not supported(self):
            return False
        arrays = CompiledTicks(self)
        steps = arrays.begin()
        if steps < 1:
            # What the session was asked counts: a plan takes one that has not been asked.
            self.session = self._opened()
            return False
        self._arrays = arrays
        arrays.last_tick = self._end_after(steps)
        return True

    def _end_after(self, steps: int) -> int:
        """Fix the last tick, unless it is given, by the steps of the first plan."""
        if self.state.last_tick is None:
            allowed = TICKS.allowed
            if steps > allowed:
                TICKS.demand(steps, "the path", instead="say how many ticks there are")
            grid = self.scene.grid
            most = 10 * (grid.height + grid.width) * (1 + len(self.visits.via)) + 4 * steps
            most += 0 if self.pursuit is None else 2 * len(self.pursuit.cells)
            self.state.last_tick = min(most, allowed)
        return self.state.last_tick

    def _begin(self) -> None:
        """The first plan, and whether there is anything to drive at all."""
        scene = self.scene
        self._ask(self._sense())
        self.state.started = True
        self._end_after(max(len(self.state.following.route) - 1, 0))
        if not self.plan:
            verdict = self._without_traffic() if self.traffic.obstacles else self.plan
            closed = verdict.status is Status.NO_PATH and self.walls.may_open
            closed = closed or (self.pursuit is not None and verdict.status is not Status.START_OCCUPIED)
            if verdict.status in _NEVER and not closed:
                self.state.started = False
                own = self.visits.done or verdict.status is Status.START_OCCUPIED
                self.end(_NEVER[verdict.status] if own else Outcome.NO_PATH, self.visits.sentence_of(verdict))
                return
        if scene.start == scene.goal and self.visits.done:
            self._arrive()

    def _without_traffic(self) -> Plan:
        """What a fresh session says of the bare map: walls in the way are an ending, obstacles are not."""
        began = loading.cpu()
        session = self._opened()
        plan = session.plan(Change(robot=self.scene.start), self.budget)
        self.state.planning_s += loading.cpu() - began
        self.state.expansions += plan.expansions
        return plan

    def _sense(self) -> Change:
        tick = max(self.state.now - 1, 0)  # obstacles have made the step of this tick, the robot has not
        known_tracks = (
            observed_obstacles(self.traffic, self.state.now) if self.planner.traits.sees_traffic else None
        )
        change = sense(self.world, tick=tick, obstacle_tracks=known_tracks)
        if self.pursuit is None or not self.pursuit.known:
            return change
        return replace(change, goal_track=self.pursuit.ahead(tick))

    def _ask(self, change: Change) -> None:
        self.ask(change, self.state.cells[-1], self._ahead())

    def ask(self, change: Change, here: Cell, ahead: Cell | None) -> None:
        """Ask the planner, and follow its plan from here on.

        Parameters
        ----------
        here : the robot's cell.
        ahead : the next cell of the plan so far, if it can be entered now.
        """
        began = loading.cpu()
        if self.goal != self._aim and (self.pursuit is None or not self.pursuit.known):
            # All costs to the goal are other now: a search that went on from them had no less to do.
            self._aim = self.goal
            self.session = self._opened()
        repaired = self.state.repaired
        plan = self.state.plan = self.session.plan(self.walls.as_reported(change), self.budget)
        self.notes.add(plan.notes)
        self.state.repaired = plan.repaired
        if plan.repaired and not repaired:
            self._tell("repair", here, "Obstacles in the way count as walls until they leave.")
        self.state.planning_s += loading.cpu() - began
        self.state.expansions += plan.expansions
        for gate in plan.gates_met:
            x, y = here
            if max(abs(gate[0] - x), abs(gate[1] - y)) > 1:
                continue  # foreseen in the preview; it is found on arrival
            if gate in self.state.gates_met:
                continue  # a planner that looks ahead tells of the same gate in every plan until it is passed
            self.state.gates_met.add(gate)
            self.state.replans += 1
            self._tell("gate", gate, "A gate on the way proved too narrow; replanned.")
        self.state.following = follow(plan, here)
        if ahead is not None and self.state.following.ahead not in (None, ahead):
            self.state.path_switches += 1

    def _ahead(self) -> Cell | None:
        """The next cell of the present plan if it can be entered now, committed to or not."""
        cell = self.state.following.ahead
        return cell if cell is not None and self._step_to(cell) is not None else None

    def _planned(self) -> Step | None:
        """The next step of the plan if it is legal now; HOLD if the plan says to wait and that is safe."""
        if self.state.following.waits(self.state.now):
            return None if self.world.robot_is_met() else HOLD
        cell = self.state.following.ahead
        return self._step_to(cell) if self.state.following.to_be_driven and cell is not None else None

    def _step_to(self, cell: Cell) -> Step | None:
        """The step into a neighbour, if it is legal now."""
        number = self.world.space.number(cell)
        for step in self.world.robot_shape.steps(self.world.robot):
            if step[0] == number:
                return step if self.world.robot_may(step) else None
        return None

    # ---- one tick --------------------

    @one_call
    def tick(self) -> None:
        """One tick. Does nothing once there is an outcome.

        Raises
        ------
        BusyError : another call is at work on this simulation.
        """
        self._write_back()
        self._arrays = None
        if self.state.outcome is None:
            self._tick()

    @one_call
    def advance(self, ticks: int) -> None:
        """So many ticks, or as many as there are before the outcome: as often :meth:`tick`, many times faster.

        Parameters
        ----------
        ticks : how many, >= 1.

        Raises
        ------
        BusyError : another call is at work on this simulation.
        """
        self._go(self.state.now + _whole("ticks", ticks, 1))
        self._write_back()

    @one_call
    def finish(self, progress: Callable[[int], None] | None = None) -> None:
        """Every tick that is left.

        Parameters
        ----------
        progress : called with each tick that is over.

        Raises
        ------
        BusyError : another call is at work on this simulation.
        """
        while self.state.outcome is None:
            self._go(self._last_tick if progress is None else self.state.now + 1)
            if progress is not None:
                progress(self.state.now)

    @property
    def _last_tick(self) -> int:
        assert self.state.last_tick is not None
        return self.state.last_tick

    def _go(self, last: int) -> None:
        """Tick on to the end of a tick, compiled where the kernel knows the rules."""
        while self.state.outcome is None and self.state.now < last:
            edit = self.walls.next_tick
            until = last if edit is None else min(last, edit - 1)
            if self._arrays is None and until > self.state.now and supported(self):
                self._arrays = CompiledTicks(self)
            if self._arrays is None or until <= self.state.now:
                self._write_back()
                self._arrays = None
                self._tick()
                continue
            began, loaded = time.perf_counter(), loading.seconds()
            self._arrays.go(until)
            self.state.total_s += time.perf_counter() - began
            self.state.loading_s += loading.seconds() - loaded

    def _write_back(self) -> None:
        if self._arrays is not None:
            self._arrays.write_back()

    def _tick(self) -> None:
        began, loaded = time.perf_counter(), loading.seconds()
        self.state.now += 1
        self._turn()
        for obstacle in self.traffic.advance(self.state.now):
            self.state.tracks.append([])
            self._tell("appear", self.world.space.cell(self.world.where[obstacle]), "An obstacle appeared.")
        for track, number in zip(self.state.tracks, self.world.where, strict=True):
            track.append(number)
        if self._comes():
            self._stay_here()
            self._arrive()
        elif (step := self._choose()) is None:
            self._stay()
        elif step is HOLD:
            self._hold()
        else:
            self._drive(step)
        if self.state.outcome is None and self.state.now == self.state.last_tick:
            self.end(Outcome.TIMEOUT, too_late(self.state.now))
        self.state.total_s += time.perf_counter() - began
        self.state.loading_s += loading.seconds() - loaded

    def _turn(self) -> None:
        """Walls come and go."""
        turned = self.walls.turn(self.state.now, self.state.following.route[self.state.following.at :])
        if turned is not None:
            self.state.events += turned.events
            self.state.map_news, self.tick_speed.scene = turned.why, self.walls.scene

    def _comes(self) -> bool:
        """Move the goal; whether it has come to the robot's cell, and nothing else has."""
        if self.pursuit is None:
            return False
        before, self.goal = self.goal, self.pursuit.at(self.state.now)
        if self.goal != before and not self.pursuit.known:
            self.state.map_news = self.state.map_news or MOVED
        return self.goal == self.state.cells[-1] and not self.world.robot_is_met()

    def _choose(self) -> Step | None:
        step = None if self.state.map_news else self._planned()
        if step is not None:
            return step
        if (
            self.state.map_news
            or self.state.following.to_be_driven
            or self.state.waiting
            or not self.state.following.route
        ):
            self.state.replans += 1
            self._tell("replan", self.state.cells[-1], self._why())
            self.state.map_news = ""
        change = self._sense()
        self._ask(change)
        step = self._planned()
        if step is None and self.world.robot_is_met():
            # No time to wait a step and ask again: a planner that would repair its field then must do so now.
            self.state.replans += 1
            self._tell("replan", self.state.cells[-1], "An obstacle came onto the robot; asked once more.")
            self._ask(change)
            step = self._planned()
        return step

    def _why(self) -> str:
        if self.state.map_news:
            return self.state.map_news
        if self.state.waiting or not self.state.following.route:
            return "Asked again after waiting."
        return f"The next cell, {self.state.following.ahead}, cannot be entered now; chose again."

    def _drive(self, step: Step) -> None:
        came = self.state.cells[-1]
        self.world.put_robot(step[0])
        on = self.state.following
        on.at += 1
        here = on.route[on.at]
        self.state.cells.append(here)
        self.state.waiting = self.state.holding = 0
        if self.sensor is not None:
            self._look((step[1], step[2]))
        if not on.counted:
            self.state.iterations += self.plan.iterations if self.plan.commit is None else 1
            on.counted = True
        self._pass(here)
        if here == self.goal and self.visits.done:
            self.state.speeds.append(0.0)
            self.state.causes.append("goal")
            self._arrive()
            return
        speed, cause = self.tick_speed.drive([came, *on.route[on.at :]], seen_cells(self.world))
        self.state.speeds.append(speed)
        self.state.causes.append(cause)

    def _pass(self, here: Cell) -> None:
        """Turn to the next target where the robot has come to a via point that was next."""
        if self.visits.done or not self.visits.reach(here, self.now):
            return
        self._tell("via", here, REACHED)
        self.goal = self.visits.target
        self.state.map_news = REACHED

    def _look(self, heading: Cell) -> None:
        """See more of the map from where the robot has just come to stand."""
        found = self.walls.look(self.state.cells[-1], heading, self.now, self.state.following.route)
        self.state.map_news = self.state.map_news or found
        self.tick_speed.scene = self.walls.scene

    def _hold(self) -> None:
        """Wait because the plan says so."""
        self._stay_here()
        self._tell("wait", self.state.cells[-1], "The plan waits here for the path to be clear.")
        if self.plan.commit is None:
            return
        self.state.holding += 1
        if self.state.holding > self.patience:
            self._give_up(self.state.holding)

    def _stay_here(self) -> None:
        self.state.cells.append(self.state.cells[-1])
        self.tick_speed.stop()
        self.state.speeds.append(0.0)
        self.state.causes.append("waiting")
        self.state.waits += 1

    def _stay(self) -> None:
        here = self.state.cells[-1]
        self._stay_here()
        self.state.waiting += 1
        if self.world.robot_is_met():
            self._tell("hit", here, Outcome.HIT.sentence)
            self.end(
                Outcome.HIT,
                f"An obstacle that does not yield ran into the robot, which stood still at {here}.",
            )
            return
        word = "The next cell cannot be entered now." if self.plan else self.visits.sentence_of(self.plan)
        self._tell("wait", here, word)
        if self.plan.status in _NEVER and not self.walls.may_open and self.visits.is_walled(self.walls.known):
            self.end(Outcome.NO_PATH, not_free(self.goal))  # no obstacle that leaves changes that
        elif (
            (self.sensor is not None or self.visits.via)
            and not self.walls.may_open
            and self.plan.status in _NEVER
            and not (self.scene.traffic or self.pursuit)
        ):
            # Nothing moves, and every wall that has been seen is one: waiting changes nothing.
            outcome = _NEVER[self.plan.status]
            self.end(outcome if self.visits.done else Outcome.NO_PATH, self.visits.sentence_of(self.plan))
        elif self.state.waiting > self.patience:
            self._give_up(self.state.waiting)

    def _give_up(self, ticks: int) -> None:
        word = "" if self.plan else self.visits.sentence_of(self.plan)
        self.end(Outcome.BLOCKED, gave_up(ticks, self.state.cells[-1], self.patience, word))

    # ---- the story --------------------

    def _tell(self, word: str, cell: Cell, sentence: str) -> None:
        self.state.events.append(Event(self.state.now, word, cell, sentence))

    def _arrive(self) -> None:
        self.end(Outcome.ARRIVED)

    def end(self, outcome: Outcome, detail: str = "") -> None:
        """The simulation is over."""
        if outcome is Outcome.ARRIVED:
            self._tell("arrive", self.goal, Outcome.ARRIVED.sentence)
        self.state.outcome, self.state.detail = outcome, detail

    @one_call
    def trace(self) -> Trace:
        """What has happened so far; before the end its outcome is ``timeout``.

        Raises
        ------
        BusyError : another call is at work on this simulation.
        """
        robot, tracks, speeds, causes = self._history()
        route = robot
        if self.state.waits:
            moved = np.ones(len(robot), dtype=np.bool_)
            step = robot[1:] != robot[:-1]
            np.logical_or(step[:, 0], step[:, 1], out=moved[1:])
            route = robot[moved]
        grid = self.scene.grid
        fields: dict[str, Any] = {
            "scene": self.scene,
            "planner": self.planner.name,
            "seed": self.seed,
            "outcome": Outcome.TIMEOUT if self.state.outcome is None else self.state.outcome,
            "robot": robot,
            "tracks": tracks,
            "appears": tuple(self.traffic.appears),
            "obstacle_specs": tuple(self.traffic.obstacles),
            "speed": speeds,
            "cause": causes,
            "law": self.tick_speed.name,
            "units": self.tick_speed.units,
            "events": tuple(self.state.events),
            "replans": self.state.replans,
            "waits": self.state.waits,
            "path_switches": self.state.path_switches,
            "iterations": self.state.iterations,
            "expansions": self.state.expansions,
            "path": path_of(route, moves_on(grid, self.scene.moves), grid.terrain)
            if self.state.started
            else None,
            "detail": self.state.detail,
            "timing": {
                "total_s": self.state.total_s,
                "planning_s": self.state.planning_s,
                "loading_s": self.state.loading_s,
            },
            "last_tick": self.state.last_tick,
            "edits": tuple(self.walls.done),
            "notes": self.notes.all(),
            "sensor": self.sensor,
            "via": self.visits.via,
            "via_ticks": tuple(int(tick) for tick in self.visits.times),
            "goal_track": None if self.pursuit is None else np.array(self.pursuit.cells, dtype=np.int32),
            "seen": None if self.walls.seen is None else self.walls.seen.seen.reshape(grid.blocked.shape),
        }
        # Without a sensor and a goal's track all arrays are new, and of the right kind: they need no look at each.
        plain = self.sensor is None and self.pursuit is None
        return unchecked(Trace, fields) if plain else Trace(**fields)

    def _history(self) -> tuple[Cells, tuple[Cells, ...], Floats, tuple[str, ...]]:
        """The robot's cells, the obstacles' from when they appeared, speeds and causes, tick by tick."""
        state, space, arrays = self.state, self.world.space, self._arrays
        if arrays is not None and arrays.base == 0 and len(state.cells) <= 1:
            # Nothing has been written back: these need not become lists first.
            numbers, places, speeds, causes = arrays.history()
            robot, cells = space.cells_of(numbers), frozen(space.cells_of(places.T))
            tracks, appears = tuple(cells), self.traffic.appears
            if any(appears):
                tracks = tuple(track[came:] for track, came in zip(tracks, appears, strict=True))
            return frozen(robot), tracks, frozen(speeds), causes
        self._write_back()
        tracks = tuple(frozen(space.cells(track)) for track in state.tracks)
        robot = np.array(state.cells, dtype=np.int32)
        return frozen(robot), tracks, frozen(np.array(state.speeds)), tuple(state.causes)


def _whole(what: str, value: int, least: int) -> int:
    if not is_whole(value, least):
        allowed = f"a whole number, {least} to {MOST_WHOLE}"
        raise SettingError(what.upper(), shown(value), where=what, allowed=allowed)
    return int(value)
