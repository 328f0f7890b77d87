"""Fleets that drive: simulate_fleet.

Nothing leaves this module that the referee has not re-checked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris import fleets, referee
from lampyris._core import cancellation
from lampyris._core.arrays import index_array
from lampyris._core.cancellation import Cancelled
from lampyris._core.predicates import numbers
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_whole
from lampyris.errors import SettingError, UsageError, callable_or_none, of_kind, plural, shown
from lampyris.kernels import loading
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Agent, Fleet, most_radius
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.obstacles import Track
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.planning.base import Budget
from lampyris.planning.fleet.base import FleetPlanner
from lampyris.sim.fleet.detours import goals_around, late_faults
from lampyris.sim.fleet.execution import Hazards, Stage, drive_plan
from lampyris.sim.fleet.phases import Phases
from lampyris.sim.fleet.reactive import drive_reactively
from lampyris.sim.fleet.walkers import sampled, walkers
from lampyris.typing import Cells, Floats

RADIUS = MappingProxyType({"four-connected": 0.35, "octile": 0.22})
"""Radius of a robot that nobody has stated, in cells, by the moves of the plan."""
OBSTACLE_RADIUS = 0.3
_CAUSES = 6
_LAST = (5, 1, 4, 2, 3)
"""Causes of standing, those first that a robot may have had after it came to its goal for the last time before a new plan."""


def simulate_fleet(
    fleet: Fleet,
    plan: FleetPlan | None = None,
    *,
    planner: str | FleetPlanner = fleets.PLANNER,
    robot: Robot | None = None,
    delays: Delays | None = None,
    faults: Sequence[tuple[int, float]] = (),
    tracks: Sequence[Track] | None = None,
    seed: int = 0,
    budget: Budget | None = None,
    progress: Callable[[int, int], None] | None = None,
    drive_settings: Mapping[str, Any] | FleetDriveSettings | None = None,
    **settings: Any,
) -> FleetTrace:
    """Drive the plan of a fleet in continuous time, with accelerations, delays, faults and moving obstacles; re-checked.

    With the policy ``order`` robots keep the plan's order of visits at every cell: a robot enters a cell only when all that visit
    it before have left it, so that delays make robots late but never collide. With ``orca`` there is no plan: each robot drives
    down its exact distance field and avoids its neighbours; contacts are counted and may happen.

    ::

        fleet = lampyris.random_fleet(lampyris.load_grid("warehouse-200"), 20)
        trace = lampyris.simulate_fleet(fleet, delays=lampyris.Delays(0.1, duration=3.0), seed=1)
        trace.contacts, trace.arrivals.max(), trace.lateness.mean(), trace.wait_totals()

        lampyris.simulate_fleet(fleet, faults=[(3, 20.0)])  # robot 3 stops permanently after 20 s
        lampyris.simulate_fleet(fleet, policy="orca")

    Parameters
    ----------
    fleet : the map and the robots. An agent's own robot states its size and limits.
    plan : the plan to drive, found for this fleet. None: ``planner`` makes one.
    planner : where there is no plan, and after a fault; see :func:`lampyris.plan_fleet`.
    robot : of agents without one; None: a disc of 0.35 of a cell, of 0.22 with an octile plan, with the usual limits.
    delays : random delays; None: none.
    faults : pairs (robot, seconds): each stops permanently then, and the others get a new plan around it.
    tracks : of moving obstacles, discs; None: as many random ones as the setting ``obstacles`` says.
    seed : of all random draws: the same seed gives the same trace, unless seconds end the call.
    budget : ``seconds`` and ``stop`` end the call: what was driven so far is not returned, its status is.
    progress : called with how many robots arrived, of how many, after each plan that was driven.
    drive_settings : settings by name, or all of them; see :class:`lampyris.model.settings.fleet_drive.FleetDriveSettings`.
    **settings : the same as keywords.

    Raises
    ------
    UsageError : ``SETTING_CLASH``: a setting that is given twice; ``FLEET_PLAN``: a plan that is not found.
    SettingError : ``FLEET_DRIVE``, ``DELAYS``, ``FAULTS``, ``SEED``, ``TRACK``, ``FLEET_ROBOT``: what is given is wrong.
    LimitError : ``MEMORY``: the trace or the tables would take more memory than is allowed.
    InternalFault : the referee refused the trace; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> fleet = lampyris.random_fleet(lampyris.load_grid("env-1"), 4)
    >>> trace = lampyris.simulate_fleet(fleet, delays=lampyris.Delays(0.05))
    >>> trace.status.value, len(trace.arrivals)
    ('found', 4)
    """
    of_kind("fleet", fleet, Fleet)
    of_kind("plan", plan, FleetPlan, none=True)
    of_kind("robot", robot, Robot, none=True)
    of_kind("delays", delays, Delays, none=True)
    of_kind("budget", budget, Budget, none=True)
    callable_or_none("progress", progress)
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    chosen = _settings(drive_settings, settings)
    robots = robots_of(fleet, robot, fleets.MOVES if plan is None else plan.moves)
    failures = _faults(faults, len(robots), chosen)
    if chosen.policy == "orca" and delays is not None and delays.probability:
        raise SettingError.of("DELAYS", "delays", shown(delays), allowed="none with policy orca")
    given = None if tracks is None else _tracks(tracks)
    began, loaded = loading.wall(), loading.seconds()
    seconds, stop = (None, None) if budget is None else (budget.seconds, budget.stop)
    run = _Run(fleet, robots, delays or Delays(), failures, given, chosen, int(seed), planner, progress)
    with cancellation.watching(seconds, stop) as own:
        try:
            trace = run.reactive() if chosen.policy == "orca" else run.ordered(plan)
        except Cancelled:
            if own is None or (own.outer is not None and own.outer.is_over):
                raise
            trace = run.empty(Status.CANCELLED if own.was_cancelled else Status.LIMIT)
    driven = loading.wall()
    trace = run.counted(trace)
    referee.demand(referee.check_fleet_trace(trace))
    ended, loaded = loading.wall(), loading.seconds() - loaded
    timing = {
        "plan_s": run.planning, "simulate_s": driven - began - run.planning, "referee_s": ended - driven,
        "total_s": ended - began + loaded, "loading_s": loaded,
    }  # fmt: skip
    return replace(trace, timing=timing)


class _Run:
    """One simulation."""

    def __init__(
        self, fleet: Fleet, robots: tuple[Robot, ...], delays: Delays, faults: list[tuple[int, float]],
        tracks: tuple[Track, ...] | None, settings: FleetDriveSettings, seed: int,
        planner: str | FleetPlanner, progress: Callable[[int, int], None] | None,
    ) -> None:  # fmt: skip
        self._fleet, self._robots, self._delays, self._faults = fleet, robots, delays, faults
        self._tracks, self._settings, self._seed = tracks, settings, seed
        self._planner, self._progress = planner, progress
        self._moves = fleets.MOVES
        self._rng, self._walks = (
            np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(k,))))
            for k in range(2)
        )
        self.planning = 0.0

    def _plan(self, fleet: Fleet) -> FleetPlan:
        began = loading.wall()
        made = fleets.plan_fleet(fleet, self._planner, moves=self._moves, seed=self._seed)
        self.planning += loading.wall() - began
        return made

    def empty(self, status: Status, detail: str = "") -> FleetTrace:
        """A trace in which nobody has moved."""
        return self._trace(status, Phases(self._fleet.grid), tick=self._tick(1.0), detail=detail)

    def _tick(self, longest: float) -> float:
        slowest = min(one.v_max for one in self._robots)
        return self._fleet.grid.resolution * longest / slowest

    def ordered(self, plan: FleetPlan | None) -> FleetTrace:
        """Drive the plan in its order of visits, and after each fault a new one."""
        if plan is None:
            plan = self._plan(self._fleet)
        if not plan:
            return self.empty(plan.status, plan.sentence)
        _fits(plan, self._fleet)
        self._moves = plan.moves
        n, grid = len(self._robots), self._fleet.grid
        tick = self._tick(longest_step(plan.paths))
        makespan = plan.makespan or 0
        limit = self._settings.drive_limit
        if limit is None:
            held = 2.0 * self._delays.duration * self._delays.probability * makespan
            limit = 10.0 * (makespan * tick + held) + 60.0
        hazards = self._hazards(limit)
        phases, waits = Phases(grid), np.zeros((n, _CAUSES))
        paths, times, plans = list(plan.paths), [0.0], [plan.paths]
        planned = np.array([(len(path) - 1) * tick for path in plan.paths])
        delayed, rings, detail = 0, 0, ""
        waiting, done = self._faults, list[tuple[int, float]]()
        under: dict[int, Cells] = {}
        while True:
            stage = drive_plan(
                grid, paths, self._robots, self._delays, self._rng, hazards=hazards, begin=times[-1], limit=limit,
                faults=waiting,
            )  # fmt: skip
            phases.add_stage(stage)
            waits += stage.waits
            delayed, rings = delayed + stage.delayed, rings + stage.rings
            if self._progress is not None:
                self._progress(int(np.count_nonzero(~np.isnan(stage.arrivals))), n)
            now, waiting = waiting[: stage.failed], waiting[stage.failed :]
            done += now
            if stage.limited or not now:
                break
            under |= {k: stage.cells_under(k) for k, _ in now}
            paths, lost = self._around(stage, under)
            names = _names(lost)
            detail = f"Robots that stopped are in the way of {names}." if lost else ""
            times.append(stage.end)
            plans.append(tuple(paths))
        columns = phases.columns()
        arrivals = self._arrivals(columns, np.isnan(stage.arrivals), [k for k, _ in done])
        if done:
            # Robots that stood at their goals, before they had to make way for a new plan or until there was one.
            driven = np.bincount(index_array(columns[0]), weights=columns[2], minlength=n)
            rest = np.nan_to_num(arrivals - driven - waits[:, 1:].sum(axis=1))
            waits[:, -1] += np.maximum(rest, 0.0)
            rest = np.minimum(rest, 0.0)
            for column in _LAST:
                taken = np.maximum(rest, -waits[:, column])
                waits[:, column] += taken
                rest -= taken
        late = np.isnan(arrivals)
        late[[k for k, _ in done]] = False
        status = Status.FOUND
        if late.any():
            status = Status.LIMIT if stage.limited else Status.NO_PATH
            detail = detail if status is Status.NO_PATH else ""
        elif done:
            detail = f"All other robots arrived; {len(done)} stopped permanently."
            if len(done) == n:
                detail = f"All {n} robots stopped permanently." if n > 1 else "The robot stopped permanently."
        notes = []
        if waiting:
            notes.append(late_faults(waiting, "s", stage.end))
        if stage.stalled:
            notes.append(
                f"the drive was cut off at {stage.end:.6g} s: events followed each other without time passing"
            )
        return self._trace(
            status, phases, tick=tick, arrivals=arrivals, planned=planned, waits=waits[:, 1:], plans=tuple(plans),
            plan_times=tuple(times), faults=tuple(done), delayed=delayed, rotations=rings, detail=detail,
            notes=tuple(notes),
        )  # fmt: skip

    def _arrivals(
        self, columns: tuple[NDArray[Any], ...], on_path: NDArray[np.bool_], failed: list[int]
    ) -> Floats:
        """When each robot came to its goal permanently; NaN: it did not, or it failed.

        A robot that is under way may stand on its goal: its path may pass it, to let others through.
        """
        who, t, long, x, y, dx, dy, v, a = columns
        places, ends = self._fleet.grid.to_metres(self._fleet.starts), np.zeros(len(self._robots))
        far = long * (v + 0.5 * a * long)
        places[who] = np.stack((x + far * dx, y + far * dy), axis=1)
        ends[who] = t + long
        gap = np.abs(places - self._fleet.grid.to_metres(self._fleet.goals)).max(axis=1)
        ends[gap > 1e-6 * self._fleet.grid.resolution] = np.nan
        ends[on_path] = np.nan
        ends[failed] = np.nan
        return ends

    def _around(self, stage: Stage, under: Mapping[int, Cells]) -> tuple[list[Cells], list[int]]:
        """New paths around the robots that have stopped, and which robots cannot come to their goals.

        Those go to, or stay on, a free cell where nobody else has to be.

        Parameters
        ----------
        stage : that has just ended.
        under : the one or two cells under each robot that has failed, in this stage or an earlier one.
        """
        grid, n = self._fleet.grid, len(self._robots)
        here = stage.visits.cells[stage.visits.base[:-1] + stage.reached]
        blocked = np.array(grid.blocked)
        for cells in under.values():
            blocked[cells[:, 1], cells[:, 0]] = True
        open_ = [k for k in range(n) if k not in under]
        paths: list[Cells] = [here[k : k + 1] for k in range(n)]
        goals, lost = goals_around(blocked, {k: tuple(here[k].tolist()) for k in open_}, self._fleet.goals)
        if open_:
            agents = [Agent(tuple(here[k].tolist()), goals[k]) for k in open_]
            made = self._plan(Fleet(replace(grid, blocked=blocked), agents))
            if made:
                for k, path in zip(open_, made.paths, strict=True):
                    paths[k] = path
            else:
                lost = [k for k in open_ if tuple(here[k].tolist()) != self._fleet.goals[k]]
        return paths, lost

    def _hazards(self, limit: float) -> Hazards | None:
        s, grid = self._settings, self._fleet.grid
        if self._tracks is None:
            radius = OBSTACLE_RADIUS * grid.resolution if s.obstacle_radius is None else s.obstacle_radius
            self._tracks = walkers(grid, s.obstacles, radius, s.obstacle_speed, limit, self._walks)
        if not self._tracks:
            return None
        return Hazards(
            sampled(self._tracks, grid, s.period, limit), s.period, max(one.radius for one in self._tracks),
            max(one.top_speed for one in self._tracks), s.obstacle_info == "track",
        )  # fmt: skip

    def reactive(self) -> FleetTrace:
        """Drive by optimal reciprocal collision avoidance."""
        made = drive_reactively(self._fleet, self._robots, self._settings, self._progress)
        there = ~np.isnan(made.arrivals)
        status = Status.FOUND if there.all() else Status.LIMIT
        n = len(self._robots)
        detail = (
            ""
            if there.all()
            else f"{int(there.sum())} of {plural(n, 'robot')} arrived within {made.end:.0f} s."
        )
        return self._trace(
            status, made.phases, tick=self._tick(1.0), arrivals=made.arrivals, notes=made.notes, detail=detail
        )

    def _trace(
        self, status: Status, phases: Phases, *, arrivals: Floats | None = None, planned: Floats | None = None,
        waits: Floats | None = None, **rest: Any,
    ) -> FleetTrace:  # fmt: skip
        n = len(self._robots)
        unknown = np.full(n, np.nan)
        return FleetTrace(
            status, self._fleet.grid, self._settings, self._delays, self._seed, self._robots,
            np.array(self._fleet.starts, np.int32), np.array(self._fleet.goals, np.int32), *phases.columns(),
            unknown if arrivals is None else arrivals, unknown if planned is None else planned,
            np.zeros((n, _CAUSES - 1)) if waits is None else waits, obstacles=self._tracks or (), **rest,
        )  # fmt: skip

    def counted(self, trace: FleetTrace) -> FleetTrace:
        """The trace with its contacts counted."""
        from lampyris.referee.fleets.fleet_trace import TracePositions, wall_contacts

        motion = TracePositions(trace)
        met = motion.obstacle_contacts(trace.obstacles)
        made: dict[str, Any] = {"obstacle_contacts": len(met), "moving_contacts": sum(one[3] for one in met)}
        if trace.settings.policy == "orca":
            made |= {"contacts": len(motion.contacts()), "wall_contacts": len(wall_contacts(trace))}
        return replace(trace, **made)


def _settings(given: Any, more: Mapping[str, Any]) -> FleetDriveSettings:
    if isinstance(given, FleetDriveSettings):
        given = {f.name: getattr(given, f.name) for f in fields(given)}
    of_kind("drive_settings", given, Mapping, none=True)
    for name in sorted(more.keys() & (given or {}).keys()):
        raise UsageError("SETTING_CLASH", f"{name} is set twice", where=name, allowed="once")
    return FleetDriveSettings.of({**(given or {}), **more})


def robots_of(fleet: Fleet, robot: Robot | None, moves: str) -> tuple[Robot, ...]:
    """The robots that drive a plan with these moves.

    Raises
    ------
    SettingError : ``FLEET_ROBOT``: one that cannot.
    """
    usual = Robot(radius=RADIUS[moves] * fleet.grid.resolution) if robot is None else robot
    robots = tuple(usual if one.robot is None else one.robot for one in fleet.robots)
    least = most_radius(moves)
    most = least * fleet.grid.resolution
    for k, one in enumerate(robots):
        if one.radius > most * (1.0 + 1e-12):
            raise SettingError(
                "FLEET_ROBOT", f"a radius of {one.radius:g} m", where=f"robots[{k}].robot", setting="robot.radius",
                allowed=f"at most {least:.3g} cells, {most:.4g} m: robots that follow each other must not touch",
            )  # fmt: skip
        if one.drive == "ackermann":
            raise SettingError(
                "FLEET_ROBOT", "an Ackermann drive", where=f"robots[{k}].robot", setting="robot.drive",
                allowed="differential or omnidirectional: robots of fleets turn in place",
            )  # fmt: skip
    return robots


def _faults(given: Any, robots: int, settings: FleetDriveSettings) -> list[tuple[int, float]]:
    allowed = f"pairs (robot, seconds), robot 0 to {robots - 1}, each once, seconds >= 0"
    if not isinstance(given, tuple | list):
        raise SettingError.of("FAULTS", "faults", shown(given), allowed=allowed)
    found: dict[int, float] = {}
    for k, one in enumerate(given):
        pair = numbers(one, (2,))
        right = pair is not None and bool(np.isfinite(pair).all()) and pair[1] >= 0.0 and pair[1] < 1e12
        if (
            pair is None
            or not right
            or not is_whole(float(pair[0]).__trunc__(), 0, robots - 1)
            or pair[0] % 1
        ):
            raise SettingError("FAULTS", shown(one), where=f"faults[{k}]", allowed=allowed, setting="faults")
        if int(pair[0]) in found:
            raise SettingError(
                "FAULTS",
                f"robot {int(pair[0])} twice",
                where=f"faults[{k}]",
                allowed=allowed,
                setting="faults",
            )
        found[int(pair[0])] = float(pair[1])
    if found and settings.policy == "orca":
        raise SettingError.of("FAULTS", "faults", shown(given), allowed="none with policy orca")
    return sorted(found.items(), key=lambda one: (one[1], one[0]))


def _tracks(given: Any) -> tuple[Track, ...]:
    if not isinstance(given, tuple | list) or not all(isinstance(one, Track) for one in given):
        raise SettingError.of("TRACK", "tracks", shown(given), allowed="a list of lampyris.Track, discs")
    for k, one in enumerate(given):
        if one.outline is not None or one.t[0] > 0.0:
            raise SettingError(
                "TRACK", shown(one), where=f"tracks[{k}]", allowed="a disc that is there from second 0"
            )
    return tuple(given)


def _fits(plan: FleetPlan, fleet: Fleet) -> None:
    """Refuse a plan that is not one for this fleet."""
    if not plan:
        raise UsageError("FLEET_PLAN", plan.sentence, where="plan", allowed="a plan that is found")
    bad = referee.check_fleet_plan(plan, fleet, every=False)
    if bad is not None:
        raise SettingError(
            "FLEET_PLAN", str(bad), where="plan", allowed="a plan of this fleet without conflicts"
        )


def _names(robots: Sequence[int]) -> str:
    """Robots in words, the first eight of them."""
    names = ", ".join(str(k) for k in robots[:8]) + (" and more" if robots[8:] else "")
    return f"robot{'s' if robots[1:] else ''} {names}"


def longest_step(paths: Sequence[Cells]) -> float:
    """The longest step of paths, cells."""
    square = max((int((np.diff(path, axis=0) ** 2).sum(axis=1).max(initial=0)) for path in paths), default=0)
    return math.sqrt(max(1, square))
