"""Nouns as plain data: what ``--json`` prints and what a page or a store may keep.

Everything here is decided by map, settings and seed, save the one object ``timing``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.field import Gate
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.model.plan import Jump, MapModel, Plan, PlanningRound
from lampyris.model.profile import NodeTable, Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Obstacle
from lampyris.report.data.following import following
from lampyris.report.data.metrics import CauseShare, drive_shares, path_metrics

if TYPE_CHECKING:
    from lampyris.model.drive import Drive
    from lampyris.model.trace import Trace

STEP_WORDS = ("straight", "diagonal", "knight")


def plan_record(
    plan: Plan,
    scene: Scene,
    profile: Profile | None,
    *,
    seed: int = 0,
    gates: bool = True,
    nodes: NodeTable | None = None,
) -> dict[str, Any]:
    """A plan and its speeds; ``cells``, ``cost``, ``gap`` and ``speed`` are null when no path was found.

    ``gates``: those of the whole map as well; scattered maps have thousands. ``nodes``: what stands around each node.
    """
    return {
        "status": plan.status.value,
        "sentence": plan.sentence,
        "planner": plan.planner,
        "seed": seed,
        "map": grid_record(scene.grid),
        "moves": scene.moves.name,
        "robot": robot_record(scene),
        "start": list(scene.start),
        "goal": list(scene.goal),
        "cells": None if plan.cells is None else plan.cells.tolist(),
        "schedule": None if plan.schedule is None else plan.schedule.tolist(),
        "cost": _finite(plan.cost),
        "steps": None if plan.steps is None else dict(zip(STEP_WORDS, plan.steps, strict=False)),
        "optimal_cost": plan.optimal_cost,
        "gap": plan.gap,
        "length_m": plan.length_m,
        **({} if plan.waypoints is None else lines_record(plan)),
        "sum_cost_to_go": plan.sum_cost_to_go,
        "iterations": plan.iterations,
        "expansions": plan.expansions,
        "gates": {
            "count": len(plan.gates_in_map),
            "on_path": [gate_record(g) for g in plan.gates_on_path],
            "in_map": [gate_record(g) for g in plan.gates_in_map] if gates else [],
            "replanned_at": [list(c) for c in plan.gates_met],
        },
        "jumps": [jump_record(j) for j in plan.jumps],
        **(
            {"best_by_iteration": [_finite(v) for v in plan.best_by_iteration]}
            if plan.tree is not None
            else {}
        ),
        **({"rounds": [round_record(one) for one in plan.rounds]} if plan.rounds else {}),
        **({} if plan.map_model is None else {"map_model": model_record(plan, plan.map_model)}),
        "attributes": dict(plan.attributes),
        "notes": list(plan.notes),
        "corners": corners_record(plan, scene, profile),
        **({} if plan.pose_path is None else pose_record(plan.pose_path)),
        **(via_record(plan, scene) if scene.via else {}),
        **({} if plan.time_lower_bound is None else {"time_lower_bound_s": plan.time_lower_bound}),
        **({} if nodes is None else {"nodes": nodes.columns()}),
        "speed": None if profile is None else profile_record(profile),
        "timing": dict(plan.timing),
    }


def lines_record(plan: Plan) -> dict[str, Any]:
    """Straight lines of a path: where they begin and end, and their length, cells; null without lines."""
    points = plan.waypoints
    return {
        "waypoints": None if points is None else points.tolist(),
        "any_angle_length": plan.any_angle_length,
    }


def model_record(plan: Plan, model: MapModel) -> dict[str, Any]:
    """What a planner of a model of the map found, cells; without the model's edges, ridges and leaves."""
    return {
        "kind": model.kind,
        **lines_record(plan),
        "bound": model.bound,
        "clearance": model.clearance,
        "ridge_clearance": model.ridge_clearance,
        "counts": dict(model.counts),
    }


def via_record(plan: Plan, scene: Scene) -> dict[str, Any]:
    """Via points in the order of visits, and where they are among the cells of the path."""
    places = plan.via_at or (None,) * len(plan.via)
    return {
        "via": [{"cell": list(cell), "node": k} for cell, k in zip(plan.via, places, strict=True)],
        "via_order": scene.via_order,
        "via_lower_bound": plan.via_lower_bound,
    }


def pose_record(path: PosePath) -> dict[str, Any]:
    """A path of poses: metres of the map frame and radians."""
    prices = {} if path.prices is None else {"prices": path.prices.tolist()}
    times = {} if path.times is None else {"times_s": path.times.tolist()}
    return {
        **prices,
        **times,
        "poses": path.poses.tolist(),
        "gears": path.gears.tolist(),
        "cost_m": path.cost_m,
        "lower_bound_m": path.lower_bound_m,
        "bound": _finite(path.bound),
        "reversals": path.reversals,
    }


def round_record(one: PlanningRound) -> dict[str, Any]:
    """One round of planning with adaptive dimensionality: metres, and counts of expanded states."""
    return {
        "spheres": [{"cell": list(cell), "radius_cells": radius} for cell, radius in one.spheres],
        "tunnel_cells": one.tunnel,
        "planned_m": one.planned_m,
        "tracked_m": one.tracked_m,
        "lower_bound_m": one.lower_bound_m,
        "low_expansions": one.low_expansions,
        "high_expansions": one.high_expansions,
        "tracking_expansions": one.tracking_expansions,
    }


def corners_record(plan: Plan, scene: Scene, profile: Profile | None) -> dict[str, int] | None:
    """How the corners of a path of cells are driven; None where its speeds are not in m/s at its cells.

    ``turns`` of the path; ``stops``: in so many the robot stands still to turn, in the others it is taken to
    round the corner within half a step.
    """
    if plan.path is None or profile is None or not profile.metric or profile.xy is not None:
        return None
    return {"turns": int(path_metrics(plan.path, scene.grid)["turns"]), "stops": profile.cause.count("turn")}


def drive_corners(drive: Drive) -> dict[str, int]:
    """The corners of all curves that a drive set off on; ``stops``: in so many it stands still to turn."""
    stops = sum(len(curve.stops) for curve in drive.curves)
    return {
        "turns": stops + sum(int((curve.curvature != 0.0).sum()) for curve in drive.curves),
        "stops": stops,
    }


def trace_record(trace: Trace) -> dict[str, Any]:
    """A simulation; ``obstacles``: a list a tick, in order of appearance; ``edits``: what really turned."""
    return {
        "outcome": trace.outcome.value,
        "sentence": trace.sentence,
        "planner": trace.planner,
        "seed": trace.seed,
        "map": grid_record(trace.scene.grid),
        "moves": trace.scene.moves.name,
        "start": list(trace.scene.start),
        "goal": list(trace.scene.goal),
        "ticks": trace.ticks,
        "cost": trace.cost,
        "steps": None if trace.path is None else dict(zip(STEP_WORDS, trace.path.steps, strict=False)),
        "collisions": trace.collisions,
        "hits": trace.hits,
        "replans": trace.replans,
        "waits": trace.waits,
        "path_switches": trace.path_switches,
        "iterations": trace.iterations,
        "expansions": trace.expansions,
        "notes": list(trace.notes),
        "law": trace.law,
        "units": trace.units,
        "robot": trace.robot.tolist(),
        "speed": trace.speed.tolist(),
        "cause": list(trace.cause),
        "obstacle_specs": [
            {"kind": b.kind, "radius": b.radius, "yields": b.yields, **_outline(b)}
            for b in trace.obstacle_specs
        ],
        "obstacles": [[list(c) for c in trace.obstacles_at(t)] for t in range(trace.ticks + 1)],
        "events": [
            {"tick": e.tick, "word": e.word, "cell": list(e.cell), "sentence": e.sentence}
            for e in trace.events
        ],
        "edits": [
            {"tick": e.tick, "blocked": list(map(list, e.blocked)), "freed": list(map(list, e.freed))}
            for e in trace.edits
        ],
        "sensor": None if trace.sensor is None else asdict(trace.sensor),
        "seen": None if trace.seen is None else trace.seen.tolist(),
        "goals": None
        if trace.goal_track is None
        else [list(trace.goal_at(t)) for t in range(trace.ticks + 1)],
        **(
            {"via": [list(cell) for cell in trace.via], "via_ticks": list(trace.via_ticks)}
            if trace.via
            else {}
        ),
        "timing": dict(trace.timing),
    }


def _kept(drive: Drive) -> dict[str, Any]:
    """Planned times and how late the robot was, where times were planned."""
    late = drive.lateness
    if late is None:
        return {}
    tables = [
        None if one is None else {name: getattr(one, name).tolist() for name in ("s", "reach", "leave")}
        for one in drive.timetables
    ]
    return {
        "planned_arrival": drive.planned_arrival,
        "latest": float(late.max()),
        "late_at_end": float(late[-1]),
        "timetables": tables,
    }


def drive_record(drive: Drive) -> dict[str, Any]:
    """A drive in continuous time: its stretches, the curves they are on, and where each obstacle was.

    Places are in cells, y down; stretch k begins at ``t[k]`` and has the acceleration ``a[k]`` until
    ``t[k + 1]``.
    """
    n = len(drive.cause)
    return {
        "outcome": drive.outcome.value,
        "sentence": drive.sentence,
        "planner": drive.planner,
        "law": drive.law,
        "seed": drive.seed,
        "map": grid_record(drive.scene.grid),
        "moves": drive.scene.moves.name,
        "robot": robot_record(drive.scene),
        "start": list(drive.scene.start),
        "goal": list(drive.scene.goal),
        "notes": list(drive.notes),
        "period": drive.period,
        "duration": drive.duration,
        "optimum": drive.optimum,
        **_kept(drive),
        "replans": drive.replans,
        "expansions": drive.expansions,
        "error": drive.error,
        "t": drive.t.tolist(),
        "s": drive.s.tolist(),
        "v": drive.v.tolist(),
        "a": drive.a.tolist(),
        "leg": drive.leg.tolist(),
        "cause": list(drive.cause),
        "cause_index": drive.cause_index.tolist(),
        "why": [drive.why(k) for k in range(n)],
        "limited_by": shares_record(drive_shares(drive)),
        "corners": drive_corners(drive),
        "curves": [curve_record(c) for c in drive.curves],
        **({} if drive.goal_tolerance is None else _followed(drive)),
        **(
            {"via": [list(cell) for cell in drive.via], "via_times": list(drive.via_times)}
            if drive.via
            else {}
        ),
        **(
            {}
            if drive.sensor is None or drive.seen is None
            else {"sensor": asdict(drive.sensor), "seen": drive.seen.tolist()}
        ),
        "obstacle_specs": [
            {
                "kind": obstacle.kind,
                "radius": track.radius,
                "top_speed": track.top_speed,
                "yields": obstacle.yields,
                "t": track.t.tolist(),
                "xy": track.xy.tolist(),
                **_outline(obstacle),
                **({} if track.yaw is None else {"yaw": track.yaw.tolist()}),
            }
            for obstacle, track in zip(drive.obstacle_specs, drive.tracks, strict=True)
        ],
        "moments": [
            {"t": m.t, "word": m.word, "xy": list(m.xy), "sentence": m.sentence, "obstacle": m.obstacle}
            for m in drive.moments
        ],
        "timing": dict(drive.timing),
    }


def _outline(obstacle: Obstacle) -> dict[str, Any]:
    """The outline of a polygon: vertices, metres, x ahead and y to the left; nothing of a disc."""
    return {} if obstacle.outline is None else {"outline": [list(p) for p in obstacle.outline]}


def _followed(drive: Drive) -> dict[str, Any]:
    """What is recorded of drives along poses alone: who steered, along which paths, and how well it followed them."""
    steered = {
        "paths": [curve_record(c) for c in drive.paths],
        "path_times": list(drive.path_times),
        "safety_filter": drive.safety_filter,
    }
    return {
        "poses": drive.poses(drive.t).tolist(),
        "controller": drive.controller,
        "following": following(drive),
        **(steered if drive.paths else {}),
    }


def curve_record(curve: Curve) -> dict[str, Any]:
    """Straight pieces and arcs; of a curve of poses also the yaw where each begins, and how it turns."""
    turning = {"yaw": curve.yaw.tolist(), "turn": curve.turn.tolist()} if isinstance(curve, PoseCurve) else {}
    return {
        "xy": curve.xy.tolist(),
        "heading": curve.heading.tolist(),
        "lengths": curve.lengths.tolist(),
        "curvature": curve.curvature.tolist(),
        "end": list(curve.end),
        "stops": curve.stops.tolist(),
        **turning,
    }


def grid_record(grid: Grid) -> dict[str, Any]:
    """What a map is called and how large it is."""
    return {
        "name": grid.name,
        "width": grid.width,
        "height": grid.height,
        "resolution": grid.resolution,
        "origin": list(grid.origin),
    }


def robot_record(scene: Scene) -> dict[str, float | None]:
    """Size and limits, SI units."""
    return {f.name: getattr(scene.robot, f.name) for f in fields(Robot)}


def gate_record(gate: Gate) -> dict[str, Any]:
    """A gate."""
    return {"cell": list(gate.cell), "axis": gate.axis, "width_m": gate.width_m, "dead_end": gate.dead_end}


def jump_record(jump: Jump) -> dict[str, Any]:
    """One AD-GSO iteration."""
    return {
        "at": list(jump.at),
        "luciferin": jump.luciferin,
        "rings": jump.rings,
        "accepted": [
            {
                "cell": list(c.cell),
                "ring": c.ring,
                "luciferin": c.luciferin,
                "probability": c.probability,
            }
            for c in jump.candidates
        ],
        "chosen": list(jump.chosen),
        "subpath": [list(c) for c in jump.subpath],
        "by_parents": jump.by_parents,
    }


def profile_record(profile: Profile, *, caps: bool = False) -> dict[str, Any]:
    """A speed profile, one entry a node.

    ``xy`` (cells, where it has places of its own) and ``caps`` (if asked for; null where a rule says nothing)
    come last.
    """
    record: dict[str, Any] = {
        "law": profile.law,
        "units": profile.units,
        "s": profile.s.tolist(),
        "v": profile.v.tolist(),
        "a": profile.a.tolist(),
        "t": profile.t.tolist(),
        "cause": list(profile.cause),
        "cause_index": profile.cause_index.tolist(),
        "why": [profile.why(k) for k in range(len(profile.cause))],
        "mean": profile.mean,
        "duration": profile.duration,
    }
    if profile.xy is not None:
        record["xy"] = profile.xy.tolist()
    if caps:
        record["caps"] = [
            {"cause": cause, "v": [_finite(v) for v in speeds.tolist()]} for cause, speeds in profile.caps
        ]
    return record


def shares_record(some: Sequence[CauseShare]) -> list[dict[str, Any]]:
    """What limited the robot, the longest first."""
    return [{"cause": c.cause, "distance": c.distance, "time": c.time} for c in some]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
