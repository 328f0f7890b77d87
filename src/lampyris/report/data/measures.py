"""Measures of one run: the columns of a study's table, by the same names for plans, simulations and drives.

A measure that is not defined for a run is None, never a number in its place. What a run did not reach has no
length and no time: ``length``, ``cost``, ``gap``, ``cost_to_go``, ``ticks``, ``time_s``, turns and clearance
are those of a whole path, and None where there is none. What was counted on the way (collisions, hits, near
misses, replans, waits, path_switches, iterations, expansions) is reported for every run.

Distances between obstacles are between discs. In a simulation in ticks an obstacle, or the robot, that is smaller
than its cell counts as the disc that fills the cell: its radius is half a cell. In a drive discs have the
radii by which contact is judged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from lampyris.model.curve import PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome, Trace
from lampyris.report.data.gaps import gaps_between
from lampyris.report.data.metrics import line_metrics, path_metrics
from lampyris.report.data.pose_measures import driven_measures, pose_measures
from lampyris.typing import Cells, FloatGrid, Floats

Metrics: TypeAlias = dict[str, Any]
"""Numbers, words and None by name, every name of :data:`METRICS`."""

METRICS = (
    "outcome", "found", "arrived", "collisions", "hits", "near_misses", "near_m", "length_cells", "length_m",
    "length_any_angle", "cost", "optimal", "gap", "cost_m", "lower_bound_m", "bound", "reversals",
    "cost_to_go", "ticks", "time_s", "speed_mean", "speed_least", "turns", "turn_deg", "smoothness",
    "clearance_mean_m", "clearance_least_m", "iterations", "expansions", "replans", "waits", "path_switches",
    "path_switches_per_100", "reference_ok", "notes",
)  # fmt: skip
"""In the order of the columns.

* ``outcome``: the word of the status or outcome. ``found``: a path was planned; ``arrived``: the robot stands
  on the goal (of a plan: the same as found).
* Of a simulation with edits the optimum, the gap, the cost-to-go and the clearance are by the map at tick 0:
  a gap can be less than 0 then.
* Of a simulation whose goal moves there is no optimum, gap or cost-to-go.
* ``collisions``: of the robot's own making. ``hits``: obstacles that ran into the standing robot.
* ``near_m``: the least free distance between the robot's rim and an obstacle's over the whole run, metres, 0
  where they touch; None without obstacles. Of a simulation at its ticks, of a drive every :data:`LOOK`
  seconds. ``near_misses``: of a simulation the ticks at which that distance to an obstacle is under one cell
  (between two obstacles of one cell: neighbours, diagonal ones too); of a drive how often an obstacle comes
  under half a cell, once for each time that it comes.
* ``length_cells``, ``length_m``: of the path driven, a diagonal the square root of 2; of an any-angle plan, of
  its straight lines, and so are its turns. ``length_any_angle``: the length of these lines, cells, of such
  plans only: what may be set beside the least cost, below which it can be. ``cost``: by the prices of the
  moves, cells; of an any-angle plan that of its walk by cells along the lines, never below the least, and so
  are its gap, time, ticks, clearance and cost-to-go: tables must say so. A simulation in ticks goes from cell
  to cell with every planner: an any-angle planner is driven along that walk, and all measures are of it.
* ``optimal``: the least cost on the map as it is, cells, reported for every run; None: no path. ``gap``: cost /
  optimal - 1. A drive leaves the cells: it has no cost and no gap.
* ``cost_m``, ``lower_bound_m``, ``bound``: of a plan of poses: what the planner minimised (length with its prices, metres),
  the cost that no path undercuts, and their ratio (see :class:`lampyris.model.path.PosePath`). Planners of other prices, or
  of bounds that speak of other paths, are not compared by them. ``reversals``: changes between driving ahead and in reverse
  of a plan of poses, or of a drive of one. Such plans and drives have no cost in cells, no optimum and no gap.
* ``cost_to_go``: the cost to the goal summed up over the cells of the path, both ends, cells: what the
  dissertation prints as the baselines' path cost. Not of drives.
* ``ticks``: until arrival; of a plan its steps, and its waits if it has a schedule. ``time_s``: until
  arrival; of a plan by its profile, if that is in seconds.
* ``speed_mean``: over the nodes, or ticks, at which it moves, as the dissertation counts; of a drive metres
  over seconds in motion. ``speed_least``: the least at a node, a tick or the beginning of a stretch at which
  it moves. In the law's own units.
* ``turns``, ``turn_deg``, ``smoothness``: see :class:`lampyris.report.data.metrics.PathMetrics`. Of a drive the
  turns are arcs, and turns in place or at a corner; the length is that of the curves. Of poses: changes of the yaw, each
  arc and each turn in place one turn.
* ``clearance_mean_m``, ``clearance_least_m``: from the robot's rim to the nearest wall, metres, over the
  cells of the path; of a drive every :data:`LOOK` seconds. A robot without a radius is a point here, and a
  place between cells has the clearance of the nearest cell's centre. Of plans and drives of poses: from the footprint,
  at every pose of a plan. None on a map without walls.
* ``iterations``, ``expansions``, ``replans``, ``waits`` (ticks; of a drive seconds standing), ``path_switches``: as
  the run counts them. ``path_switches_per_100``: path_switches in each hundred ticks of the whole run; None of a run without
  a tick. Not path_switches in each replan: AD-GSO asks again at each jump, which no replan is, and may change its
  mind there, so that it had more path_switches than replans.
* ``reference_ok``: whether ``optimal`` is the published length; None where none is published, or the moves
  are not those that it is of.
* ``notes``: what was done otherwise than asked, such as attributes that were weakened (``Plan.notes``,
  ``Trace.notes``, ``Drive.notes``), the sentences joined by ``; ``; None where there is none.
"""

LOOK = 0.05
"""Seconds between two looks at a drive."""

Published: TypeAlias = float | None

PoseRoom: TypeAlias = Callable[[Floats], Floats]
"""Metres from the robot to the nearest wall at poses of the map frame, (n, 3) to (n,); infinity: there is none."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What is known of a place before planning.

    Parameters
    ----------
    optimal_exact : exact cost of the best path; None: there is none.
    to_go : float64 (height, width): least cost to the goal, cells; infinity where there is no path.
    clearance : float64 (height, width): metres from each cell's centre to the nearest wall; infinity: none.
    room : of a planner of poses: metres from the robot to the nearest wall at poses; else None.
    """

    optimal_exact: int | None
    to_go: FloatGrid
    clearance: FloatGrid
    room: PoseRoom | None = None


def plan_metrics(
    plan: Plan, scene: Scene, known: Known, profile: Profile | None = None, published: Published = None
) -> Metrics:
    """Of a plan, and of the speeds on it."""
    out = _blank(plan.status.value, bool(plan), bool(plan), scene, known, published)
    out.update(iterations=plan.iterations, expansions=plan.expansions, replans=len(plan.gates_met))
    out["notes"] = _joined(plan.notes)
    if plan.pose_path is not None:
        pose_measures(out, plan.pose_path, scene.grid.resolution)
        _clearance_at(out, plan.pose_path.poses, known)
    elif plan.path is not None:
        _path_measures(out, plan.path, scene, known)
        if plan.waypoints is not None:
            lines = line_metrics(plan.waypoints, scene.grid)
            for name in ("length_cells", "length_m", "turns", "turn_deg", "smoothness"):
                out[name] = lines[name]
            out["length_any_angle"] = lines["length_cells"]
        out["ticks"] = len(plan.path.cells) - 1
        if plan.schedule is not None and len(plan.schedule):
            out["ticks"] = int(plan.schedule[-1] - plan.schedule[0])
    if profile is not None:
        out["time_s"] = profile.duration if profile.metric else None
        _speeds(out, profile.v)
    if plan.pose_path is not None and plan.pose_path.times is not None:
        out["time_s"] = float(plan.pose_path.times[-1, 0])
    return out


def trace_metrics(trace: Trace, known: Known, published: Published = None) -> Metrics:
    """Of a simulation in ticks."""
    scene = trace.scene
    started = trace.outcome not in _NEVER
    out = _blank(trace.outcome.value, started, trace.arrived, scene, known, published)
    out.update(
        collisions=trace.collisions,
        hits=trace.hits,
        iterations=trace.iterations,
        expansions=trace.expansions,
        replans=trace.replans,
        waits=trace.waits,
        path_switches=trace.path_switches,
        path_switches_per_100=100.0 * trace.path_switches / trace.ticks if trace.ticks else None,
        notes=_joined(trace.notes),
    )
    near = near_by_tick(trace)
    out["near_misses"] = int(np.count_nonzero(near < scene.grid.resolution * (1.0 - _ROUNDING)))
    out["near_m"] = _finite(near.min(initial=math.inf))
    _speeds(out, trace.speed)
    if trace.arrived and trace.path is not None:
        _path_measures(out, trace.path, scene, known)
        out["ticks"] = trace.ticks
    if trace.goal_track is not None:  # the optimum is the cost to where the goal was at first
        out.update(dict.fromkeys(("optimal", "gap", "cost_to_go")))
    return out


def drive_metrics(drive: Drive, known: Known, published: Published = None) -> Metrics:
    """Of a drive in continuous time."""
    scene = drive.scene
    started = drive.outcome not in _NEVER
    out = _blank(drive.outcome.value, started, drive.arrived, scene, known, published)
    out.update(
        collisions=int(drive.outcome is Outcome.COLLISION),
        hits=sum(m.word == "hit" for m in drive.moments),
        expansions=drive.expansions,
        replans=drive.replans,
        notes=_joined(drive.notes),
    )
    if not started or len(drive.t) < 2:
        out["near_misses"] = 0
        return out
    dt = np.diff(drive.t)
    ds = dt * (drive.v[:-1] + 0.5 * drive.a[:-1] * dt)
    moving = ds > 0.0
    rolled, seconds = float(ds[moving].sum()), float(dt[moving].sum())
    out["waits"] = float(dt[~moving].sum())
    out["speed_mean"] = rolled / seconds if seconds else None
    out["speed_least"] = _finite(drive.v[drive.v > 0.0].min(initial=math.inf))
    xy = _near(out, drive)
    if drive.arrived:
        out.update(length_m=rolled, length_cells=rolled / scene.grid.resolution, time_s=drive.duration)
        if known.room is not None and _on_poses(drive):
            driven_measures(out, drive)
            _clearance_at(out, drive.poses(_looks(drive)), known)
        else:
            _curvature_measures(out, drive)
            _clearance(out, np.rint(xy).astype(np.int64), scene, known)
    return out


_NEVER = (Outcome.NO_PATH, Outcome.START_OCCUPIED, Outcome.GOAL_OCCUPIED)
_ROUNDING = 1e-9
"""Share of a cell that a distance of exactly one cell may seem less."""


def near_by_tick(trace: Trace) -> Floats:
    """Metres from the robot's rim to the nearest obstacle's at each tick; infinity where there is nobody."""
    n, res = len(trace.robot), trace.scene.grid.resolution
    near = np.full(n, math.inf)
    if not trace.tracks:
        return near
    robot = trace.robot.astype(np.int64)
    own = disc(trace.scene.robot.radius, res)
    by_radius: dict[float, list[int]] = {}
    for k, obstacle in enumerate(trace.obstacle_specs):
        by_radius.setdefault(disc(obstacle.radius, res), []).append(k)
    for radius, some in by_radius.items():
        squared = np.full(n, _FAR)
        together = [k for k in some if trace.appears[k] == 0]
        if together:
            d = np.stack([trace.tracks[k] for k in together]).astype(np.int64) - robot
            squared = np.minimum(squared, (d * d).sum(axis=2).min(axis=0))
        for k in some:
            if (t0 := trace.appears[k]) > 0:
                d = trace.tracks[k] - robot[t0:]
                squared[t0:] = np.minimum(squared[t0:], (d * d).sum(axis=1))
        free = np.maximum(np.sqrt(squared.astype(np.float64)) * res - (own + radius), 0.0)
        near = np.minimum(near, np.where(squared == _FAR, math.inf, free))
    return near


_FAR = 2**62


def disc(radius: float, resolution: float) -> float:
    """The radius that an obstacle counts with, metres: no smaller than its cell."""
    return max(radius, 0.5 * resolution)


def _blank(
    outcome: str, found: bool, arrived: bool, scene: Scene, known: Known, published: Published
) -> Metrics:
    """Every measure, those that say nothing of the path filled in."""
    out: Metrics = dict.fromkeys(METRICS)
    out.update(outcome=outcome, found=found, arrived=arrived)
    if known.optimal_exact is not None and known.room is None:
        x, y = scene.start
        out["optimal"] = float(known.to_go[y, x])
    if published is not None and known.room is None and _comparable(scene):
        mine = out["optimal"]
        out["reference_ok"] = mine is not None and abs(mine - published) <= slack(published)
    return out


def _joined(notes: Sequence[str]) -> str | None:
    """Notes as one text."""
    return "; ".join(notes) or None


def _comparable(scene: Scene) -> bool:
    """Published lengths are of octile moves, a point, and plain ground."""
    return scene.moves.name == "octile" and scene.robot.radius == 0.0 and scene.grid.terrain is None


def slack(published: float) -> float:
    """How far the optimum may be from a published length: 1e-5 of it, or half a unit of its last digit.

    At most 0.005 of a cell for the digit: a length that ends with zeros has lost them on its way here.
    """
    digits = len(repr(float(published)).partition(".")[2]) if published < 1e15 else 0
    return max(1e-5 * abs(published), min(0.005, 0.5 * 10.0**-digits))


def _path_measures(out: Metrics, path: Path, scene: Scene, known: Known) -> None:
    """What is said of a path of cells from start to goal."""
    of_path = path_metrics(path, scene.grid)
    for name in ("length_cells", "length_m", "turns", "turn_deg", "smoothness"):
        out[name] = of_path[name]
    out["cost"] = path.cost
    if known.optimal_exact is not None:
        excess = path.exact - known.optimal_exact
        out["gap"] = excess / known.optimal_exact if excess else 0.0
    x, y = path.cells[:, 0], path.cells[:, 1]
    out["cost_to_go"] = _finite(float(known.to_go[y, x].sum()))
    _clearance(out, path.cells, scene, known)


def _clearance(out: Metrics, cells: Cells | Any, scene: Scene, known: Known) -> None:
    away = known.clearance[cells[:, 1], cells[:, 0]] - scene.robot.radius
    if len(away) and np.isfinite(away).all():
        out["clearance_mean_m"] = float(away.mean())
        out["clearance_least_m"] = float(away.min())


def _speeds(out: Metrics, v: Floats) -> None:
    moving = v[v > 0.0]
    if len(moving):
        out["speed_mean"] = float(moving.sum() / len(moving))
        out["speed_least"] = float(moving.min())


def _near(out: Metrics, drive: Drive) -> Floats:
    """Free distances over time; where the robot was at each look, cells."""
    looks = _looks(drive)
    xy, _ = drive.at(looks)
    res = drive.scene.grid.resolution
    least, misses = math.inf, 0
    for track in drive.tracks:
        there = looks >= track.t[0]
        if not there.any():
            continue
        free = gaps_between(drive, track, looks[there])
        least = min(least, float(free.min()))
        close = free < 0.5 * res
        misses += int(close[0]) + int(np.count_nonzero(close[1:] & ~close[:-1]))
    out["near_m"] = _finite(max(least, 0.0))
    out["near_misses"] = misses
    return xy


def _looks(drive: Drive) -> Floats:
    """Times at which a drive is looked at, seconds."""
    return np.unique(np.append(np.arange(0.0, drive.duration, LOOK), drive.duration))


def _on_poses(drive: Drive) -> bool:
    """Whether all curves are of poses."""
    return bool(drive.curves) and all(isinstance(curve, PoseCurve) for curve in drive.curves)


def _clearance_at(out: Metrics, poses: Floats, known: Known) -> None:
    """The clearance of a robot with a heading."""
    away = np.zeros(0) if known.room is None else known.room(poses)
    if len(away) and np.isfinite(away).all():
        out["clearance_mean_m"] = float(away.mean())
        out["clearance_least_m"] = float(away.min())


def _curvature_measures(out: Metrics, drive: Drive) -> None:
    """Turning of what was driven of each curve."""
    turns, total, before = 0, 0.0, None
    for leg in np.unique(drive.leg).tolist():
        own = np.flatnonzero(drive.leg == leg)
        curve, s0 = drive.curves[leg], float(drive.s[own[0]])
        s1 = float(drive.s[own[-1]]) if own[-1] + 1 == len(drive.t) else _left_at(drive, int(own[-1]))
        begins = curve.begins
        for k, (b, e) in enumerate(zip(begins[:-1].tolist(), begins[1:].tolist(), strict=True)):
            driven = min(e, s1) - max(b, s0)
            if driven <= 1e-12:
                continue
            first, last = curve.at(np.array([max(b, s0), min(e, s1) - 1e-9 * driven]))[1]
            if before is not None and (turn := _angle(before, first)) > 1e-6:
                turns, total = turns + 1, total + turn
            bend = abs(float(curve.curvature[k])) * driven
            turns, total, before = turns + (bend > 1e-6), total + bend, last
    cells = out["length_cells"]
    out.update(
        turns=turns,
        turn_deg=math.degrees(total),
        smoothness=1.0 / (1.0 + total / cells) if cells else 1.0,
    )


def _left_at(drive: Drive, k: int) -> float:
    """Distance at which a curve is left at the end of stretch ``k``."""
    dt = float(drive.t[k + 1] - drive.t[k])
    return float(drive.s[k]) + dt * (float(drive.v[k]) + 0.5 * float(drive.a[k]) * dt)


def _angle(a: Iterable[float], b: Iterable[float]) -> float:
    (ax, ay), (bx, by) = a, b
    return abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
