"""Driving in continuous time: the robot between cells, obstacles as discs, decisions period by period.

In every period, in this order:

1. **The robot receives** where the obstacles are now (:mod:`lampyris.sim.sensor`), and its watch judges that.
2. **The law decides** how hard to push until the next decision (:mod:`lampyris.sim.continuous.controllers`). Without
   data that can be trusted the robot brakes.
3. **The robot drives** (:mod:`lampyris.sim.continuous.tracking`): stretches of constant acceleration.
4. **The obstacles move**, seeing what the robot really does (:mod:`lampyris.sim.traffic.motion_sources`).
5. **Contacts** are looked for in continuous time. One while the robot moves is a ``collision`` and the end;
   one while it stands is a ``hit``.

A robot that has stood for ``patience`` seconds because of obstacles asks its planner again from where it
stands, with the cells that obstacles cover.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np

from lampyris._core.exclusive import Exclusive, one_call
from lampyris._core.limits import DECISIONS, NODES
from lampyris._core.scalars import MOST_WHOLE, is_whole
from lampyris.errors import SettingError, UsageError, shown
from lampyris.kernels import loading
from lampyris.model.curve import Curve
from lampyris.model.drive import AT_GOAL, Drive
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.trace import Outcome
from lampyris.motion.laws.registry import SpeedLaw, name_of
from lampyris.planning.base import Budget, Planner
from lampyris.planning.least_steps import demand_at_least, least_metres
from lampyris.planning.selection import plans_times
from lampyris.sim.continuous.compiled_periods import CompiledPeriods, supported
from lampyris.sim.continuous.control import Decision, State, node_at
from lampyris.sim.continuous.controllers import wheel
from lampyris.sim.continuous.leg import covered_cells
from lampyris.sim.continuous.pose_replanner import PoseReplanner, for_steering
from lampyris.sim.continuous.replanner import Replanner, spacing_of
from lampyris.sim.continuous.sight import Sight
from lampyris.sim.continuous.state import DriveState, Log
from lampyris.sim.continuous.timed_replanner import TimedReplanner
from lampyris.sim.continuous.tracking import CATCH_UP, STEP, Perfect, train_of
from lampyris.sim.sensor import FaultySensor, ObstacleSensor, PerfectSensor, SensorMonitor
from lampyris.sim.traffic.motion_sources import MotionSource
from lampyris.sim.traffic.obstacle_set import ObstacleSet
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.sim.world.targets import REACHED, Targets, aimed
from lampyris.sim.world.trajectory import Trajectory
from lampyris.sim.world.waiting import WAITS, Waiting

SEEN = "Walls seen on the path."
UNKNOWING_LAWS = ("dissertation", "rpp")
"""Laws whose controllers look at all walls."""
UNTIMED_LAWS = ("rpp",)
"""Laws whose controllers look at no planned times."""
MANY, FEW = 1 << 40, 20
"""Periods that are driven between two reports of progress, without and with a function that is called."""
_LONGER = "choose a longer period"
_NEVER = {
    Status.NO_PATH: Outcome.NO_PATH,
    Status.START_OCCUPIED: Outcome.START_OCCUPIED,
    Status.GOAL_OCCUPIED: Outcome.GOAL_OCCUPIED,
}


def drive(
    scene: Scene,
    planner: Planner,
    *,
    law: SpeedLaw = "physical",
    seed: int = 0,
    sources: Sequence[MotionSource] = (),
    sensor: ObstacleSensor | None = None,
    budget: Budget | None = None,
    progress: Callable[[float], None] | None = None,
    **settings: object,
) -> Drive:
    """Drive from start to goal through the scene's traffic, in continuous time; the whole story as a Drive.

    Parameters
    ----------
    scene : where, with its traffic.
    planner : the planner.
    law : a speed law's name, or its settings.
    seed : seed of all random draws, >= 0. The planner has the stream ``SeedSequence((seed, 0))``, specification k
        of the traffic ``(seed, 1 + k)``, then come ``sources``, then the noise.
    sources : obstacles beside the scene's traffic, such as :class:`lampyris.sim.traffic.adversary.Adversary`.
    sensor : what reports obstacles to the robot; None: a perfect sensor.
    budget : of every single call of the planner; None: no limit.
    progress : called every 20 periods with the seconds that are over.
    settings : those of :class:`lampyris.model.settings.drive.DriveSettings`.

    Raises
    ------
    SceneError : obstacles that do not fit the map.
    SettingError : a setting it does not have, or out of range; ``OBSTACLE_SPEED`` (traffic too quick for
        the period); ``EDITS`` (a scene whose walls change).
    UsageError : no such law.
    """
    simulation = DriveSimulation(
        scene, planner, law=law, seed=seed, sources=sources, sensor=sensor, budget=budget, **settings
    )
    return simulation.run(progress)


class DriveSimulation(Exclusive):
    """A drive that can be stopped between two periods and looked at. For one thread at a time.

    Attributes
    ----------
    state : where the robot is and what it is about to do.
    others : all obstacles.
    steers : whether controllers that steer are at home here.
    """

    steers: ClassVar[bool] = False

    def __init__(
        self,
        scene: Scene, planner: Planner, *, law: SpeedLaw = "physical", seed: int = 0,
        sources: Sequence[MotionSource] = (), sensor: ObstacleSensor | None = None, budget: Budget | None = None,
        **settings: object,
    ) -> None:  # fmt: skip
        began, loaded = time.perf_counter(), loading.seconds()
        if scene.edits:
            allowed = "a map that stays as it is; simulations in ticks know edits"
            raise SettingError("EDITS", f"{len(scene.edits)} edits", where="scene.edits", allowed=allowed)
        self.settings = one = DriveSettings.of(settings)
        one.check_traffic(scene)
        self._demand_controller(planner)
        self.scene = scene
        self._demand_room()
        self.seed = _seed(seed)
        self.sensor: ObstacleSensor = (
            sensor.fresh() if isinstance(sensor, FaultySensor) else sensor or PerfectSensor()
        )
        poses, timed = planner.traits.plans_headings, plans_times(planner)
        self._demand_law(law, poses)
        if timed:
            self._demand_times_can_be_kept(planner, law)
        # An obstacle may be within the circle around a footprint and not on the robot.
        radius = scene.robot.inscribed_radius if poses else scene.robot.radius
        self.watch = SensorMonitor(scene.grid.resolution, radius, one.max_age, one.noise)
        self.train = train_of(scene.robot, one.tracking, one.delay, one.lag, one.decision_period)
        self.others = ObstacleSet(scene, self.seed, one.obstacle_speed, one.noise)
        self.sight = self._sight_of(planner, law)
        known = None if self.sight is None else self._known
        self.wheel = wheel(scene, law, one.obstacle_info, self.others.roster, poses=poses, known=known)
        kind = TimedReplanner if timed else PoseReplanner if poses else Replanner
        opened = scene if self.sight is None else self.sight.map.given
        self.visits = self._visits_of(planner, opened)
        opened = aimed(opened, self.visits.target)
        followed = planner if one.controller == "exact" else for_steering(planner)
        self.replanner = kind(opened, followed, self.seed, one.smooth, one.spacing, budget)
        if self.sight is not None:
            self.replanner.learn(self.sight.scene, [], ())
        if isinstance(self.replanner, TimedReplanner):
            self.replanner.known = frozenset(self.others.roster.whole)
        self._walls_ahead = False
        self.log = Log()
        self.state = DriveState(self.replanner.nowhere(self.wheel.ceiling))
        cell = scene.grid.resolution
        self.waiting = Waiting(0.1 * min(cell, scene.robot.v_max * one.patience), cell)
        self._begin()
        self.others.open(sources, None if self.state.leg.nowhere else self.state.leg.route)
        self.optimum = self.state.leg.seconds if not (self.state.leg.nowhere or self.visits.via) else None
        self._cut: tuple[str, ...] = ()
        limit = self._ample() if one.time_limit is None else one.time_limit
        self.time_limit = self._within_decisions(limit)
        self.state.total_s = time.perf_counter() - began
        self.state.loading_s = loading.seconds() - loaded

    @property
    def t(self) -> float:
        """Seconds that are over."""
        return self.state.t

    @property
    def outcome(self) -> Outcome | None:
        """How it ended; None while it has not."""
        return self.state.outcome

    @property
    def xy(self) -> tuple[float, float]:
        """Where the robot is, cells."""
        return self.state.leg.route.at(self.state.s)

    def _sight_of(self, planner: Planner, law: SpeedLaw) -> Sight | None:
        """What the robot sees of a map that it does not know; None: it knows the map.

        Raises
        ------
        UsageError : ``CONTROLLER``, ``LAW``, ``SENSOR_TRACKING``: what a robot without the map does not go with.
        """
        one = self.settings
        if one.map_sensor is None:
            return None
        if planner.traits.plans_headings or one.steering is not None:
            raise UsageError(
                "PLANNER", f"{planner.name}, which plans poses, and a map that is not known", setting="planner",
                allowed="a planner on cells, such as dstar-lite, with sensor_range",
            )  # fmt: skip
        if name_of(law) in UNKNOWING_LAWS:
            raise UsageError(
                "LAW", f"the law {name_of(law)} and a map that is not known", where="law",
                allowed="physical and its variants, optimum, constant",
            )  # fmt: skip
        if one.tracking != "perfect":
            raise UsageError(
                "SENSOR_TRACKING", f"tracking {one.tracking} and a map that is not known", setting="tracking",
                allowed="perfect, with sensor_range",
            )  # fmt: skip
        return Sight(self.scene, one.map_sensor, spacing_of(one.spacing, self.scene))

    def _visits_of(self, planner: Planner, scene: Scene) -> Targets:
        """The via points and the goal, in the order of visits.

        Raises
        ------
        UsageError : ``VIA``: a planner of poses.
        """
        visits = Targets(scene, planner)
        visits.reach(scene.start, 0.0)
        return visits

    def _known(self) -> Scene:
        """The scene as far as it has been seen."""
        assert self.sight is not None
        return self.sight.scene

    def _ample(self) -> float:
        """A time limit that no drive needs: of a robot without the map, or with via points, time for ways not yet planned."""
        limit = 60.0 + 10.0 * self.state.leg.seconds
        if self.sight is None and not self.visits.via:
            return limit
        grid, robot = self.scene.grid, self.scene.robot
        across = (grid.width + grid.height) * grid.resolution / robot.v_max
        return limit + 10.0 * across * (1 + len(self.visits.via))

    # ---- paths --------------------

    def _begin(self) -> None:
        """The first plan, and whether there is anything to drive at all."""
        message = self.others.truth(0.0)
        plan = verdict = self.replanner.first(message)
        if not plan:
            if self.others.roster.obstacles:
                verdict = self.replanner.without_traffic()
            if verdict.status in _NEVER:
                own = self.visits.done or verdict.status is Status.START_OCCUPIED
                self._end(
                    _NEVER[verdict.status] if own else Outcome.NO_PATH, self.visits.sentence_of(verdict)
                )
                return
        curve = self.replanner.curve(plan, self.xy, message) if plan else None
        if curve is None:
            self.state.leg = self.replanner.nowhere(self.wheel.ceiling, verdict)
            self.state.curves.append(self.state.leg.route.curve)
            self.state.timetables.append(None)
            self.train.begin(self.state.leg)
        else:
            self._take(curve)
        if isinstance(self.state.leg.route, PoseLookup):
            self._know_goal(verdict)
            there = curve is not None and self.state.leg.nowhere
        else:
            there = self.scene.start == self.scene.goal and self.visits.done
        if there:
            self._arrive()

    def _know_goal(self, plan: Plan) -> None:
        """How near to the goal's pose counts as there."""
        names = ("goal_tolerance", "goal_yaw_tolerance")
        position, yaw = (float(plan.attributes.get(name, 0.0)) for name in names)
        self.state.goal_tolerance = (position, yaw)

    def _demand_controller(self, planner: Planner) -> None:
        """Refuse controllers that steer where they cannot.

        Raises
        ------
        UsageError : ``CONTROLLER``.
        """
        name = self.settings.controller
        if self.settings.steering is not None and not (self.steers and planner.traits.plans_headings):
            why = f"the controller {name} and the planner {planner.name}, which plans no headings"
            if planner.traits.plans_headings:
                why = f"the controller {name} in a drive that follows the path exactly"
            allowed = "exact, or a planner of poses: lattice, pad, hybrid-astar"
            raise UsageError("CONTROLLER", why, where="controller", allowed=allowed)

    def _demand_law(self, law: SpeedLaw, poses: bool) -> None:
        """Refuse the dissertation's law on a path of poses.

        Raises
        ------
        UsageError : ``LAW``.
        """
        if poses and name_of(law) == "dissertation":
            why = "it looks at the cells that a disc passes, and a path of poses is driven by a footprint"
            raise UsageError(
                "LAW", f"the law dissertation and a planner of poses: {why}", where="law", allowed="physical"
            )

    def _demand_times_can_be_kept(self, planner: Planner, law: SpeedLaw) -> None:
        """Refuse what planned times do not go with: controllers that steer, other laws, obstacles at another speed.

        Raises
        ------
        UsageError : ``CONTROLLER``, ``LAW``.
        SettingError : ``OBSTACLE_SPEED``.
        """
        one, name = self.settings, planner.name
        if one.steering is not None:
            raise UsageError(
                "CONTROLLER",
                f"the controller {one.controller} and {name}, which plans times: it does not keep these",
                where="controller",
                allowed="exact, or a planner without times, such as lattice",
            )
        if name_of(law) in UNTIMED_LAWS:
            raise UsageError(
                "LAW",
                f"the law {name_of(law)} and {name}, which plans times: it does not keep these",
                where="law",
                allowed="physical and its variants, optimum, constant",
            )
        speed, top = one.obstacle_speed, self.scene.robot.v_max
        if self.scene.traffic and speed is not None and speed != top:
            raise SettingError(
                "OBSTACLE_SPEED",
                f"{shown(speed)} m/s; {name} plans for obstacles that pass a cell in the time of the robot",
                where="obstacle_speed",
                allowed=f"the robot's top speed, {shown(top)} m/s",
                todo="leave it out",
            )

    def _take(self, curve: Curve) -> None:
        """Follow a path from its beginning."""
        self.state.leg = self.replanner.leg(curve, self.wheel.ceiling)
        self.state.s = self.state.v = 0.0
        self.waiting.begin()
        self.train.begin(self.state.leg)
        self.state.curves.append(curve)
        self.state.timetables.append(self.state.leg.timetable)

    def _replan(self, why: str) -> None:
        """Ask again from where the robot stands; the old path stays if there is no new one."""
        xy, message = self.xy, self.watch.last
        self.log.tell(self.state.t, "replan", xy, why)
        self.state.map_changed = False
        hidden, self._walls_ahead = self._walls_ahead, False
        self.waiting.asked()
        leg, s = self.state.leg, self.state.s
        if isinstance(self.replanner, TimedReplanner):
            self.replanner.now = self.state.t
        plan, curve = self.replanner.again(leg, s, message, self._reaction(self.settings.decision_period))
        self._end_without_path(plan)
        if curve is not None and len(curve.lengths):
            self._take(curve)
        elif hidden and self.state.outcome is None:
            self.state.map_changed = self._walls_ahead = True  # the old path leads through them: ask again

    def _end_without_path(self, plan: Plan) -> None:
        """End the drive if an update of the map has left no path."""
        if not plan and self.replanner.blocked and plan.status in _NEVER:
            self._end(Outcome.STOPPED, f"The map was updated while the robot drove. {plan.sentence}")
        elif not plan and (self.sight is not None or self.visits.via) and plan.status in _NEVER:
            verdict = self.replanner.without_traffic() if self.others.roster.obstacles else plan
            if verdict.status in _NEVER:
                seen = (
                    "By what the robot has seen there is no path."
                    if self.sight
                    else "From there no path leads on."
                )
                self._end(Outcome.STOPPED, f"{seen} {self.visits.sentence_of(verdict)}")

    def _demand_room(self) -> None:
        """Refuse, before anything is planned, what the straight line to the goal alone makes too much.

        Raises
        ------
        LimitError : it takes more nodes or decisions than are allowed.
        """
        one, metres = self.settings, least_metres(self.scene)
        nodes = metres / spacing_of(one.spacing, self.scene)
        instead = "choose a larger spacing"
        demand_at_least(NODES, self.scene, nodes, "even a straight path", instead=instead)
        seconds = metres / self.scene.robot.v_max
        if one.time_limit is not None:
            seconds = min(seconds, one.time_limit)
        needed = seconds / one.decision_period
        demand_at_least(DECISIONS, self.scene, needed, "even a straight drive", instead=_LONGER)

    def _within_decisions(self, limit: float) -> float:
        """A time limit, at most that of the decisions that are allowed.

        Raises
        ------
        LimitError : the path alone takes more of them.
        """
        period = self.settings.decision_period
        needed = 0.0 if self.state.leg.nowhere else min(limit, self.state.leg.seconds) / period
        DECISIONS.demand(int(min(needed, 1e15)), "the drive", instead=_LONGER)
        most = DECISIONS.allowed * period
        if limit > most:
            why = f"{DECISIONS.variable} allows {DECISIONS.allowed:,} {DECISIONS.unit}"
            self._cut = (f"the time limit of {limit:.15g} s was cut to {most:.15g} s: {why}",)
        return min(limit, most)

    # ---- one period --------------------

    @one_call
    def step(self) -> None:
        """One period. Does nothing once there is an outcome.

        Raises
        ------
        BusyError : another call is at work on this drive.
        """
        if self.state.outcome is not None:
            return
        began, loaded = time.perf_counter(), loading.seconds()
        self.period()
        self.state.total_s += time.perf_counter() - began
        self.state.loading_s += loading.seconds() - loaded

    @one_call
    def advance(self, periods: int) -> None:
        """So many periods, or all that are left until there is an outcome: what as many calls of :meth:`step` do, by
        compiled code where that knows the rules (:mod:`lampyris.sim.continuous.compiled_periods`).

        Raises
        ------
        BusyError : another call is at work on this drive.
        """
        began, loaded = time.perf_counter(), loading.seconds()
        last = self.state.periods + periods
        while self.state.outcome is None and self.state.periods < last:
            if not self.steers and supported(self):
                CompiledPeriods(self, last).go()
            else:
                self.period()
        self.state.total_s += time.perf_counter() - began
        self.state.loading_s += loading.seconds() - loaded

    def run(self, progress: Callable[[float], None] | None = None) -> Drive:
        """Drive to the end; the whole story.

        Parameters
        ----------
        progress : called every 20 periods with the seconds that are over.
        """
        while self.outcome is None:
            self.advance(MANY if progress is None else FEW)
            if progress is not None:
                progress(self.t)
        return self.drive()

    def period(self) -> None:
        """One period; to be called between two periods alone."""
        self.state.periods += 1
        end = self.state.periods * self.settings.decision_period
        self._listen()
        if self.state.outcome is None:
            trajectory = self._move(end)
            self._cut_at_goal(trajectory)
            for obstacle in self.others.move(self.state.t, end, trajectory):
                at, x, y, _ = self.others.roster.corners[obstacle][0]
                self.log.tell(max(at, self.state.t), "appear", (x, y), "An obstacle appeared.", obstacle)
            self.finish(trajectory)

    def finish(self, trajectory: Trajectory) -> None:
        """Look for contacts, write down what was driven and go to its end."""
        self._contacts(trajectory)
        self._go(trajectory)

    def _move(self, end: float) -> Trajectory:
        """Decide, and drive until ``end``."""
        self.state.decision = self._decide(end - self.state.t)
        segments = self.train.drive(self.state.t, end, self.state.s, self.state.v, self.state.decision)
        return Trajectory(self.state.leg.route, segments)

    def _listen(self) -> None:
        """Take in the robot's data, and react to faults in them."""
        t, xy = self.state.t, self.xy
        messages = self.sensor.tell(t, self.others.truth(t), xy)
        fault = self.watch.hear(t, messages, xy, self.state.v > 0.0)
        if self.replanner.update(self.watch.blocked):
            self.state.map_changed = True
            self.log.tell(t, "fault", xy, "An update of the map blocks cells; the path is replanned.")
        if self.sight is not None:
            self._look(self.sight)
        if fault and self.state.fault_since < 0.0:
            self.state.fault, self.state.fault_since = f"{fault[0].upper()}{fault[1:]}", t
            self.log.tell(t, "fault", xy, f"{self.state.fault}.")
        elif not fault and self.state.fault_since >= 0.0:
            self.state.fault_since = -1.0
            self.log.tell(t, "fault", xy, "The data can be trusted again.")
        elif (
            fault and self.state.v == 0.0 and t - self.state.fault_since >= self.settings.data_timeout - 1e-9
        ):
            self._end(Outcome.STOPPED, f"{self.state.fault}, from {self.state.fault_since:.4g} s on.")

    def _look(self, sight: Sight) -> None:
        """See more of the map, and brake if a wall is in the path."""
        leg, at = self.state.leg, node_at(self.state.leg, self.state.s)
        walls = sight.look(leg, self.state.s, self.state.periods - 1)
        if walls or sight.map.ground:
            self.replanner.learn(sight.scene, walls, sight.map.ground)
        if walls and sight.blocks(walls, leg, at):
            self.state.map_changed = self._walls_ahead = True
            self.log.tell(self.state.t, "wall", self.xy, "Walls seen on the path; it is planned again.")

    def _must_brake(self) -> Decision | None:
        """Full braking, where there is a reason for it that no controller is asked about."""
        brake = -self.scene.robot.d_max
        if self.state.fault_since >= 0.0:
            return Decision(brake, "no data")
        if self.state.map_changed:
            return Decision(brake, "obstacle")
        if self.others.touching:
            return Decision(brake, "moving obstacle", min(self.others.touching))
        if self.state.leg.nowhere or self.waiting.stood >= self.settings.patience:
            return Decision(brake, "wait")
        return None

    def decide(self, period: float) -> Decision:
        """What to do until the next period."""
        return self._decide(period)

    def _decide(self, period: float) -> Decision:
        brake = self._must_brake()
        if brake is not None:
            return brake
        made = self.wheel.controller.decide(self._state(period))
        # A message may list more obstacles than there are: nobody whom the drive could name.
        named = made.cause not in WAITS or made.cause_index < len(self.others.roster.obstacles)
        return made if named else made._replace(cause_index=-1)

    def _state(self, period: float) -> State:
        one, last, leg = self.settings, self.watch.last, self.state.leg
        assert last is not None
        if self.sight is not None:
            leg = self.sight.capped(leg, self.wheel.ceiling, self.scene.robot.d_max)
        s, v = self.train.commanded(self.state.s, self.state.v)
        return State(
            t=self.state.t,
            s=s,
            v=v,
            at=node_at(self.state.leg, s),
            leg=leg,
            robot=self.scene.robot,
            message=last,
            still=last.stamp - self.watch.since,
            cells=covered_cells(self.scene, last) if self.wheel.cells else [],
            period=period,
            reaction=self._reaction(period),
            real=(self.state.s, self.train.quickest(self.state.s, self.state.v)),
            late=not isinstance(self.train, Perfect),
            haste=CATCH_UP if one.tracking == "position" else 1.0,
            noise=one.noise,
            tries=self.waiting.tries,
        )

    def _reaction(self, period: float) -> float:
        """Seconds until the next decision has an effect."""
        return period if isinstance(self.train, Perfect) else period + self.settings.delay + STEP

    def _cut_at_goal(self, trajectory: Trajectory) -> None:
        """A robot that comes to rest at the goal has arrived there and then."""
        for k, one in enumerate(trajectory.segments):
            if k and one.v == 0.0 and self._at_goal(one.s):
                one.end = one.t
                del trajectory.segments[k + 1 :]
                return

    def _at_goal(self, s: float) -> bool:
        """Whether a robot that stands there has arrived; the referee says the same."""
        route = self.state.leg.route
        if isinstance(route, PoseLookup):
            left = (route.length - s) / self.scene.grid.resolution
            return not self.state.leg.nowhere and left <= AT_GOAL
        (x, y), (gx, gy) = self.state.leg.route.at(s), self.visits.target
        return not self.state.leg.nowhere and max(abs(x - gx), abs(y - gy)) <= AT_GOAL

    def _contacts(self, trajectory: Trajectory) -> None:
        """The first contact that ends the drive, and every hit before it."""
        while (met := self.others.contact(trajectory)) is not None:
            t, obstacle = met
            one = next((k for k in trajectory.segments if t < k.end), trajectory.segments[-1])
            xy = trajectory.route.at(one.after(t)[0])
            moves = one.v > 0.0 or one.a > 0.0
            if moves:
                self.log.tell(t, "contact", xy, Outcome.COLLISION.sentence, obstacle)
                self._end(Outcome.COLLISION, f"The robot drove into obstacle {obstacle} at {t:.3f} s.")
                if (
                    t <= one.t and one.v == 0.0
                ):  # it sets off with an obstacle on it: a millisecond of that is seen
                    t = min(t + 1e-3, one.end)
            else:
                self.log.tell(t, "hit", xy, "An obstacle ran into the standing robot.", obstacle)
                self.others.touching.add(obstacle)
                if self.settings.on_hit == "go-on":
                    continue
                where = f"obstacle {obstacle} ran into the robot, which stood still"
                self._end(Outcome.HIT, f"At {t:.3f} s {where}.")
            trajectory.cut(t)
            return

    def _go(self, trajectory: Trajectory) -> None:
        """Write down what was driven and go to its end."""
        leg, decision = max(len(self.state.curves) - 1, 0), self.state.decision
        for one in trajectory.segments:
            cause = decision.cause
            if one.v == 0.0 and one.a == 0.0 and cause in ("acceleration", "limit", "braking"):
                cause = "turn"
            self.log.add(one, leg, cause, decision.cause_index)
        last, before = trajectory.segments[-1], self.state.t
        self.state.t = last.end
        self.state.s, self.state.v = last.after(self.state.t)
        self.others.arrive(self.state.t)
        self.others.let_go(self.state.leg.route, self.state.s)
        if self.state.outcome is None:
            self.afterwards(before)

    def afterwards(self, before: float) -> None:
        """End the drive or ask the planner, where that is due after a period.

        Parameters
        ----------
        before : seconds that were over before it.
        """
        if self.state.v == 0.0 and self._at_goal(self.state.s):
            if self.visits.done:
                self._arrive()
            else:
                self._pass()
        elif self.state.t >= self.time_limit:
            self._end(Outcome.TIMEOUT, f"The robot had not arrived after {self.state.t:.6g} s, the limit.")
        else:
            self._wait(self.state.t - before)

    def _pass(self) -> None:
        """Turn to the next target from the via point that the robot stands on."""
        here = self.visits.target
        self.visits.reach(here, self.state.t)
        self.log.tell(self.state.t, "via", self.xy, REACHED)
        self.replanner.aim(self.visits.target)
        self._replan(REACHED)

    def _wait(self, seconds: float) -> None:
        """Ask again, or give up, when obstacles have kept the robot from getting on for long."""
        one, waiting = self.settings, self.waiting
        kept = waiting.count(self.state.s, self.state.decision.cause, seconds)
        if self.state.v > 0.0:
            return
        if self.state.map_changed:
            self._replan(SEEN if self._walls_ahead else "An update of the map blocks cells.")
        elif kept:
            if not waiting.reported:
                waiting.reported = True
                self.log.tell(
                    self.state.t,
                    "wait",
                    self.xy,
                    "The robot waits for obstacles.",
                    self.state.decision.cause_index,
                )
            if waiting.waited > one.give_up:
                where = f"at {self._here()}; the limit is {one.give_up:g} s"
                self._end(Outcome.BLOCKED, f"Waited {waiting.waited:.4g} s {where}.")
            elif waiting.stood >= one.patience - 1e-9:
                self._replan(f"Asked again after {waiting.stood:.4g} s without getting on.")

    def _here(self) -> str:
        x, y = self.xy
        return f"({x:.4g}, {y:.4g})"

    # ---- the story --------------------

    def _arrive(self) -> None:
        self.log.tell(self.state.t, "arrive", self.xy, Outcome.ARRIVED.sentence)
        self._end(Outcome.ARRIVED, "")

    def _end(self, outcome: Outcome, detail: str) -> None:
        self.state.outcome, self.state.detail = outcome, detail

    @one_call
    def drive(self) -> Drive:
        """What has happened so far; before the end its outcome is ``timeout``.

        Raises
        ------
        BusyError : another call is at work on this drive.
        """
        log, replanner = self.log.copy(), self.replanner
        cause = "goal" if self.state.outcome is Outcome.ARRIVED else self.state.decision.cause
        cause_index = -1 if self.state.outcome is Outcome.ARRIVED else self.state.decision.cause_index
        log.close(
            self.state.t, self.state.s, self.state.v, max(len(self.state.curves) - 1, 0), cause, cause_index
        )
        return Drive(
            scene=self.scene,
            planner=replanner.planner.name,
            law=self.wheel.name,
            seed=self.seed,
            outcome=Outcome.TIMEOUT if self.state.outcome is None else self.state.outcome,
            curves=tuple(self.state.curves),
            t=np.array(log.t),
            s=np.array(log.s),
            v=np.array(log.v),
            a=np.array(log.a),
            leg=np.array(log.leg, dtype=np.int64),
            cause=tuple(log.cause),
            cause_index=np.array(log.cause_index, dtype=np.int64),
            tracks=self.others.tracks(self.state.t),
            obstacle_specs=tuple(self.others.roster.obstacles),
            moments=tuple(sorted((m for m in log.moments if m.t <= self.state.t), key=lambda m: m.t)),
            period=self.settings.decision_period,
            optimum=self.optimum,
            replans=replanner.replans,
            expansions=replanner.expansions,
            error=self.train.error,
            detail=self.state.detail,
            timing={
                "total_s": self.state.total_s,
                "planning_s": replanner.seconds,
                "loading_s": self.state.loading_s,
            },
            notes=(*replanner.notes.all(), *self._cut),
            goal_tolerance=self.state.goal_tolerance,
            timetables=tuple(self.state.timetables) if any(self.state.timetables) else (),
            sensor=None if self.sight is None else self.settings.map_sensor,
            via=self.visits.via,
            via_times=tuple(self.visits.times),
            seen=None if self.sight is None else self.sight.map.seen.reshape(self.scene.grid.blocked.shape),
        )


def _seed(seed: int) -> int:
    if not is_whole(seed, 0):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=f"a whole number, 0 to {MOST_WHOLE}")
    return int(seed)
