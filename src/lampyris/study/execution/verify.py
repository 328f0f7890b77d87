"""Verification: a worker's word becomes a row, or is refused.

A worker may be on another machine, and may be wrong. What it sends is a claim: the judge puts it on a scene
of its own, has the referee look at it by other means than those that made it, compares what it can know
itself (where the obstacles of this world are, what the best path costs, how many ticks there are), and
measures what is left. Nothing that is stored was measured by a worker, but seconds and bytes.

What it cannot see: counts that leave no trace (expansions, iterations, path_switches), notes of the planner, speeds
of a simulation that are within the law's range, whether a planner that may miss a path really has missed it,
whether a run that is said to have failed could not have succeeded, and the paths that a controller that steers had
planned (what it drove is judged). Plans of poses: :mod:`lampyris.study.execution.verify_poses`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from lampyris import referee
from lampyris.errors import LampyrisError
from lampyris.model.plan import Status
from lampyris.model.robot import LEAST
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Obstacle
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.planning import registry
from lampyris.report.data.fleets.measures import costs_by_seconds
from lampyris.report.data.measures import Known, Metrics, drive_metrics, plan_metrics, trace_metrics
from lampyris.sim.traffic.continuous_traffic import DIAGONAL
from lampyris.study.design.row import Ending, Row
from lampyris.study.design.study import FleetQuery, Job, StudyMap
from lampyris.study.execution.drive_evidence import drive_of
from lampyris.study.execution.evidence import plan_of, trace_of
from lampyris.study.execution.fleets.verify_fleets import verified_fleet
from lampyris.study.execution.rejected import RejectedResult, demand, refuse
from lampyris.study.execution.site import Place, StudyWorld, goal_track_of, sensor_of, world_of
from lampyris.study.execution.verify_poses import goal_tolerance, room_of, verified_plan

MAX_WORDS = 500
TIMING = ("cpu_s", "wall_s", "plan_s", "memory_b")
"""What of a worker's word on seconds and bytes is kept."""
COSTS = "cost_by_s"
"""Of plans of fleets: how the cost fell with the CPU seconds. When is the worker's word; the last cost is the plan's."""


class ResultVerifier:
    """The judge of a study's results."""

    def row(
        self, job: Job, result: Mapping[str, Any], ground: StudyMap, fleet: FleetQuery | None = None
    ) -> Row:
        """The row of a job.

        Parameters
        ----------
        job : what was asked.
        result : one of the results of :func:`lampyris.study.execution.worker.work`; anything at all is borne.
        ground : the job's map.
        fleet : its robots, in a study of fleets.

        Returns
        -------
        Row : ``failed`` with ``REFEREE`` and why, where the result does not stand.
        """
        try:
            ending, error = _ending(job, result)
            timing = _timing(result)
            if ending != "done":
                return Row(job.key, ending, {}, timing, error)
            metrics = self._measured(job, result["evidence"], ground, fleet)
            _demand_last_cost(timing, metrics)
            return Row(job.key, "done", metrics, timing)
        except RejectedResult as lie:
            return Row(job.key, "failed", {}, {}, _line(f"REFEREE: {lie}"))
        except LampyrisError as wrong:
            words = str(wrong).removeprefix("error")
            return Row(job.key, "failed", {}, {}, _line(f"REFEREE: {words}"))
        except (ArithmeticError, LookupError, TypeError, ValueError) as wrong:
            # Claims of the right form that no noun was made for, such as a cost of 0 where there is a path.
            what = f"cannot be judged: {type(wrong).__name__}: {wrong}"
            return Row(job.key, "failed", {}, {}, _line(f"REFEREE: {what}"))

    def _measured(self, job: Job, evidence: Any, ground: StudyMap, fleet: FleetQuery | None) -> Metrics:
        plain = job.plain
        if fleet is not None:
            return verified_fleet(plain, evidence, ground, fleet)
        world = world_of(plain, ground.grid)
        measure = {"plan": _plan, "simulate": _simulated, "drive": _driven}[plain["kind"]]
        return measure(plain, evidence, world, job.labels.get("published"))


def place_facts(place: Place) -> Known:
    """Facts about a place that measures need, known before planning."""
    room = room_of(place.scene) if place.poses else None
    return Known(place.optimal_exact, place.to_go, place.clearance, room)


# ---- what a result is --------------------


_ENDINGS: Mapping[Any, Ending] = {word: word for word in get_args(Ending)}


def _ending(job: Job, result: Any) -> tuple[Ending, str]:
    if not isinstance(result, Mapping):
        raise RejectedResult(f"a {type(result).__name__} is no result")
    if result.get("key") != job.key:
        raise RejectedResult(f"the result is of another job, {str(result.get('key'))[:64]!r}")
    word, error = result.get("ending"), result.get("error")
    if not isinstance(word, str) or word not in _ENDINGS:
        raise RejectedResult(f"{str(word)[:64]!r} is no ending")
    ending = _ENDINGS[word]
    if ending == "timeout" and job.plain["budget"]["seconds"] is None:
        raise RejectedResult("a timeout without a budget in seconds")
    return ending, _line(error if isinstance(error, str) else "")


def _timing(result: Mapping[str, Any]) -> dict[str, Any]:
    timing = result.get("timing")
    if not isinstance(timing, Mapping):
        raise RejectedResult("no timing")
    out: dict[str, Any] = {}
    for name in TIMING:
        value = timing.get(name)
        if value is None:
            continue
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise RejectedResult(f"{name} of {value!r}")
        if not (math.isfinite(value) and value >= 0):
            raise RejectedResult(f"{name} of {value!r}")
        out[name] = value
    fell = timing.get(COSTS)
    if fell is not None:
        if not isinstance(fell, str):
            raise RejectedResult(f"{COSTS} of a {type(fell).__name__}")
        try:
            costs_by_seconds(fell)
        except ValueError as wrong:
            raise RejectedResult(f"{COSTS}: {_line(str(wrong))}") from None
        out[COSTS] = fell
    return out


def _demand_last_cost(timing: Mapping[str, Any], metrics: Metrics) -> None:
    """The costs over seconds that a worker tells end at the cost of its plan."""
    if COSTS not in timing:
        return
    last, cost = costs_by_seconds(timing[COSTS])[-1][1], metrics.get("sum_of_costs")
    if last != cost:
        raise RejectedResult(f"{COSTS} ends at {last}, and the sum of costs is {cost}")


def _line(text: str) -> str:
    shown = "".join(c if c.isprintable() else "?" for c in text)
    return shown if len(shown) <= MAX_WORDS else f"{shown[: MAX_WORDS - 4]} ..."


# ---- the three kinds --------------------


def _plan(plain: Mapping[str, Any], evidence: Any, world: StudyWorld, published: float | None) -> Metrics:
    place = world.place
    if place.poses:
        seen = place.scene
        if world.replayed and registry.planner_class(plain["planner"]["name"]).traits.sees_traffic:
            seen = world.among(world.last_tick(plain["ticks"]))
        plan, profile = verified_plan(plain, evidence, place, seen)
        return plan_metrics(plan, place.scene, place_facts(place), profile)
    plan, profile = plan_of(evidence, place.scene, plain["planner"]["name"])
    scene = place.scene
    if plan.schedule is not None and world.replayed:
        scene = world.among(world.last_tick(plain["ticks"]))
    best = place.optimal_exact
    if plan.optimal_exact is not None and plan.optimal_exact != best:
        refuse(f"claims the optimal cost {plan.optimal_exact}; it is {best}")
    demand(referee.check_plan(plan, scene))
    if plan.path is not None and (best is None or plan.path.exact < best):
        refuse(f"a path of cost {plan.path.exact}; the best costs {best}")
    if plan.status is Status.NO_PATH and best is not None and _settles(plain):
        refuse(f"no-path by a planner that misses none; there is a path of cost {best}")
    if (plan.path is None) != (profile is None):
        refuse("a path without speeds, or speeds without a path")
    if profile is not None and plan.path is not None:
        law = _law(plain)
        if profile.law != plain["law"]["name"] or profile.units != laws.named(profile.law).units:
            refuse(f"speeds of the law {profile.law!r} in {profile.units!r}")
        ours = law if isinstance(law, PhysicalLaw) else PhysicalLaw()
        creep = getattr(law, "creep", ours.creep) if ours.clearance else 1.0
        slowest = None if ours == PhysicalLaw(creep=ours.creep) else LEAST
        found = referee.check_profile(
            profile, plan.path, place.scene, creep=creep, slowest=slowest, corners=ours.curvature, stops=True
        )
        demand(found)
    return plan_metrics(plan, place.scene, place_facts(place), profile, published)


def _settles(plain: Mapping[str, Any]) -> bool:
    """Whether a ``no-path`` of this planner must be true: it is optimal on every map.

    One that sees traffic may find every path closed by the tracks it was given.
    """
    traits = registry.planner_class(plain["planner"]["name"]).traits
    return traits.optimal and not traits.sees_traffic


def _law(plain: Mapping[str, Any]) -> Any:
    return laws.with_settings(plain["law"]["name"], plain["law"]["settings"])


def _simulated(
    plain: Mapping[str, Any], evidence: Any, world: StudyWorld, published: float | None
) -> Metrics:
    name = plain["law"]["name"]
    last = world.last_tick(plain["ticks"])

    def replayed(ticks: int) -> NDArray[np.int32]:
        if ticks > last:
            refuse(f"{ticks} ticks; the last is {last}")
        return world.replay.upto(ticks)

    trace = trace_of(
        evidence,
        world.scene,
        planner=plain["planner"]["name"],
        law=(name, laws.named(name).units),
        seed=world.seed,
        obstacles=lambda count: _obstacles(world, count),
        replayed=replayed if world.replayed else None,
        sensor=sensor_of(plain),
        goal_track=goal_track_of(plain),
    )
    if trace.ticks > last or (trace.outcome is Outcome.TIMEOUT and trace.ticks < last):
        refuse(f"{trace.outcome.value} after {trace.ticks} ticks; the last is {last}")
    if not world.replayed:
        _begin_where_they_must(trace, world)
    demand(referee.check_trace(trace))
    _no_path_stands(plain, trace.outcome, world)
    return trace_metrics(trace, place_facts(world.place), published)


def _no_path_stands(plain: Mapping[str, Any], outcome: Outcome, world: StudyWorld) -> None:
    if outcome is Outcome.NO_PATH and world.place.optimal_exact is not None and _settles(plain):
        refuse("no-path by a planner that misses none; there is a path")


def _obstacles(world: StudyWorld, count: int) -> Sequence[Obstacle]:
    """What so many obstacles of a world are."""
    if world.replayed:
        made: Sequence[Obstacle] = world.replay.obstacles
    else:
        made, more = world.opened.obstacles, world.opened.to_come
        made = [*made, *more[: max(count - len(made), 0)]]
    if len(made) != count:
        refuse(f"{count} obstacles; this world has another number")
    return made


def _begin_where_they_must(trace: Trace, world: StudyWorld) -> None:
    for k, cell in enumerate(world.opened.places):
        if trace.appears[k] != 0 or tuple(trace.tracks[k][0].tolist()) != cell:
            refuse(f"obstacle {k} does not begin at {cell} in this world")


def _driven(plain: Mapping[str, Any], evidence: Any, world: StudyWorld, published: float | None) -> Metrics:
    one = DriveSettings.of(plain["drive"])
    everybody = world.replay.obstacles if world.replayed else (*world.opened.obstacles, *world.opened.to_come)
    drive = drive_of(
        evidence,
        world.scene,
        planner=plain["planner"]["name"],
        law=plain["law"]["name"],
        seed=world.seed,
        shapes={obstacle.radius: (obstacle.footprint, obstacle.outline) for obstacle in everybody},
        goal_tolerance=goal_tolerance(plain, world.scene) if world.place.poses else None,
        steered=None if one.steering is None else (one.controller, one.safety_filter),
    )
    if one.steering is not None and drive.curves and len(drive.t) > 1 and not drive.paths:
        refuse(f"a drive of the controller {one.controller} without a path that it follows")
    if drive.period != one.decision_period:
        refuse(f"a decision every {drive.period!r} s; asked for was every {one.decision_period!r} s")
    if one.time_limit is not None and drive.duration > one.time_limit + drive.period + 1e-9:
        refuse(f"{drive.duration!r} s; the limit is {one.time_limit!r} s")
    expected = _obstacles(world, len(drive.obstacle_specs))
    for k, (obstacle, own, track) in enumerate(
        zip(drive.obstacle_specs, expected, drive.tracks, strict=True)
    ):
        if (obstacle.kind, obstacle.radius, obstacle.yields) != (own.kind, own.radius, own.yields):
            refuse(f"obstacle {k} is a {obstacle.kind} of {obstacle.radius:g} m; in this world a {own.kind}")
        if track.outline != own.outline:
            refuse(f"obstacle {k} has another outline than in this world")
        cell, speed = world.scene.grid.resolution, one.obstacle_speed
        top = DIAGONAL * (world.scene.robot.v_max if speed is None else speed)
        if track.radius != max(own.radius, 0.5 * cell) or not track.top_speed <= top * (1 + 1e-9):
            refuse(f"obstacle {k} is a disc of {track.radius:g} m, {track.top_speed:g} m/s at most")
    _tracks_of_the_world(drive, world, one)
    if one.on_hit == "end" and any(m.word == "hit" for m in drive.moments) != (drive.outcome is Outcome.HIT):
        refuse(f"{drive.outcome.value}, where the first hit is the end")
    demand(referee.check_drive(drive))
    _no_path_stands(plain, drive.outcome, world)
    return drive_metrics(drive, place_facts(world.place), published)


def _tracks_of_the_world(drive: Any, world: StudyWorld, one: DriveSettings) -> None:
    """Replayed obstacles are where this world has them; others begin there."""
    if not world.replayed:
        for k, cell in enumerate(world.opened.places):
            if drive.tracks[k].t[0] != 0.0 or tuple(drive.tracks[k].xy[0].tolist()) != cell:
                refuse(f"obstacle {k} does not begin at {cell} in this world")
        return
    grid, robot = world.scene.grid, world.scene.robot
    tick = grid.resolution / (robot.v_max if one.obstacle_speed is None else one.obstacle_speed)
    drawn = world.drive_ticks(one)
    over = min(math.floor(drive.duration / tick), drawn)
    at = world.replay.upto(over)
    times = np.arange(over + 1) * tick
    for k, track in enumerate(drive.tracks):
        off = np.abs(track.at(times) - at[:, k]).max(axis=1) > 1e-6
        if off.any():
            refuse(f"obstacle {k} is not where this world has it at {times[int(off.argmax())]:g} s")
