"""Judgement of a path of poses: ends, footprint, curvature, gears, density, cost."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from lampyris.model.grid import MAX_TERRAIN
from lampyris.model.path import Pose, PosePath
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.referee.geometry.footprint import along_arc, overlapped, placed
from lampyris.referee.geometry.pose_times import check_pose_times
from lampyris.referee.profile import wall_distance_of_points
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

DENSE = 0.5
"""Cells that a point of the robot may move between two poses."""
FINE = 0.25
"""Cells that it moves at most between two places where its footprint is laid on the map."""
DISC_VERTICES = 32
SLACK = 1e-6
"""Share of a length, and radians, by which rounding may miss a rule."""
COST_SLACK = 1e-4
"""Share of a cost: planners count in whole units."""
TERRAIN_SLACK = 2e-3
"""The same on terrain: arcs are cut into chords where they pass from cell to cell."""
SAMPLED_DRIFT, SAMPLED_LOOSE, SAMPLED_DIGIT = 0.16, 0.021, 1.1e-4
"""Paths of primitives given by poses with few digits (``attributes["sampled"]``): radians that the direction of travel
may miss the heading by, share of a turning radius, and metres or radians of the last digit."""
EDGE = 2e-3
"""Share by which a footprint is larger or smaller where its touching a wall is to be beyond doubt."""
CHORDS = 8
"""Chords of a step that terrain is looked up along."""


def check_pose_path(plan: Plan, scene: Scene) -> Violation | None:
    """Judge the poses of a plan.

    Ends: the first pose within ``attributes["end_error"]`` (metres; a cell and a half if it is not stated) of the start,
    the last within that and ``attributes["goal_tolerance"]`` (metres) of the goal; yaws, where the scene has poses,
    within 0.3 rad, of the goal within ``attributes["goal_yaw_tolerance"]`` if that is more. If the error is stated and
    below half a cell, yaws must be exact to 0.001 rad, but for a goal with a tolerance. Prices of ``attributes``:
    ``reverse_cost``, ``turn_cost`` (metres a radian), ``switch_cost`` (metres a change of gear), ``cost_penalty`` (a
    length on terrain of value c costs 1 + cost_penalty * c / 252 times as much).
    """
    path, grid = plan.pose_path, scene.grid
    assert path is not None
    for check in (_check_ends, _check_steps, _check_footprint, _check_cost):
        found = check(path, plan, scene)
        if found is not None:
            return found
    inside = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
    outside = (inside < -0.5 - SLACK) | (inside > np.array([grid.width, grid.height]) - 0.5 + SLACK)
    if outside.any():
        k = int(outside.any(axis=1).argmax())
        return Violation("outside", f"pose {k}", f"the base at {path.poses[k, :2].tolist()} is off the map")
    return None


def exact_ends_violation(plan: Plan, scene: Scene) -> str:
    """What of the ends contradicts a plan without a path, by its attributes (see :func:`check_pose_path`); empty: nothing."""
    grid, stated = scene.grid, plan.attributes
    start, goal = scene.start_pose, scene.goal_pose
    error = stated.get("end_error", 1.5 * grid.resolution)
    is_exact = error < 0.5 * grid.resolution
    for status, what, pose in ((Status.START_OCCUPIED, "start", start), (Status.GOAL_OCCUPIED, "goal", goal)):
        if pose is None or not is_exact:
            continue
        reach = stated.get("goal_tolerance", 0.0) if what == "goal" else 0.0
        if plan.status is status and _stands(pose, scene, 1 + EDGE):
            return f"the footprint is free of walls at the {what}"
        if plan.status is Status.NO_PATH and reach == 0.0 and not _stands(pose, scene, 1 - EDGE):
            return f"the footprint touches a wall at the {what}"
    if plan.status is Status.NO_PATH and start is not None and goal is not None:
        away = math.hypot(start[0] - goal[0], start[1] - goal[1])
        turned = abs(math.remainder(start[2] - goal[2], 2 * math.pi)) + (1e-3 if is_exact else 0.3)
        if away + error <= stated.get("goal_tolerance", 0.0) and turned <= stated.get(
            "goal_yaw_tolerance", 0.0
        ):
            return "the start is within the tolerances of the goal"
    return ""


def _stands(pose: Pose, scene: Scene, scale: float) -> bool:
    """Whether the footprint, made larger or smaller around its base, touches no wall at a pose."""
    grid = scene.grid
    x, y = grid.frame.to_points(pose[0], pose[1]).tolist()
    return overlapped(placed(_polygon(scene) * scale, x, y, pose[2] - grid.origin[2]), grid.blocked) is None


def _polygon(scene: Scene) -> Floats:
    """The footprint, or a polygon within the disc of the robot; cells."""
    grid, robot = scene.grid, scene.robot
    if robot.footprint is not None:
        return np.array(robot.footprint) / grid.resolution
    turns = 2 * math.pi * np.arange(DISC_VERTICES) / DISC_VERTICES
    return np.column_stack((np.cos(turns), np.sin(turns))) * (robot.radius / grid.resolution)


def _angle(turn: Floats) -> Floats:
    """An angle in [-pi, pi)."""
    return np.remainder(turn + math.pi, 2 * math.pi) - math.pi


def _check_ends(path: PosePath, plan: Plan, scene: Scene) -> Violation | None:
    grid = scene.grid
    tolerance = plan.attributes.get("goal_tolerance", 0.0)
    error = plan.attributes.get("end_error", 1.5 * grid.resolution)
    swing = 1e-3 if error < 0.5 * grid.resolution else 0.3
    angle = max(swing, plan.attributes.get("goal_yaw_tolerance", 0.0) + SLACK)
    for what, pose, asked, cell, more, turn in (
        ("start", path.poses[0], scene.start_pose, scene.start, 0.0, swing),
        ("goal", path.poses[-1], scene.goal_pose, scene.goal, tolerance, angle),
    ):
        wanted: Pose | None = asked
        x, y = wanted[:2] if wanted is not None else grid.to_metres(cell).tolist()
        away = math.hypot(pose[0] - x, pose[1] - y)
        if away > error + more + SLACK:
            return Violation(what, "pose_path", f"it is {away:.6g} m from the {what}")
        if wanted is not None and abs(float(_angle(pose[2] - wanted[2]))) > turn:
            return Violation(
                what, "pose_path", f"the yaw {pose[2]:.6g} is not that of the {what}, {wanted[2]:.6g}"
            )
    return None


def _check_steps(path: PosePath, plan: Plan, scene: Scene) -> Violation | None:
    """Density, gears, and the curvature of every step."""
    robot, cell = scene.robot, scene.grid.resolution
    poses, gears, lengths = path.poses, path.gears, path.step_lengths
    d = np.diff(poses, axis=0)
    turn = _angle(d[:, 2])
    moved = lengths + np.abs(turn) * robot.radius
    if (moved >= DENSE * cell * (1 + SLACK)).any():
        k = int(moved.argmax())
        return Violation("dense", f"step {k}", f"a point of the robot moves {moved[k] / cell:.4g} cells")
    still = lengths <= SLACK * cell
    wrong = (gears == 0) != still
    if wrong.any():
        k = int(wrong.argmax())
        return Violation("gear", f"step {k}", f"gear {gears[k]} on a step of {lengths[k]:.4g} m")
    if robot.drive == "ackermann" and still.any():
        return Violation("drive", f"step {int(still.argmax())}", "an ackermann robot turns in place")
    # An arc's chord lies halfway between its headings.
    travel = np.arctan2(d[:, 1], d[:, 0]) - np.where(gears < 0, math.pi, 0.0)
    drift = np.abs(_angle(travel - (poses[:-1, 2] + turn / 2)))
    drift_most, loose, digit = 1e-4, 1e-4, 0.0
    if plan.attributes.get("sampled"):
        drift_most, loose, digit = SAMPLED_DRIFT, SAMPLED_LOOSE, SAMPLED_DIGIT
    sideways = ~still & (drift > drift_most + digit / np.maximum(lengths, SLACK * cell))
    if robot.drive != "omnidirectional" and sideways.any():
        k = int(sideways.argmax())
        return Violation(
            "drive", f"step {k}", f"it moves {math.degrees(drift[k]):.4g} degrees off its heading"
        )
    least = lengths * (1 + loose) + SLACK * cell + digit * (1.0 + robot.turn_radius)
    tight = np.abs(turn) * robot.turn_radius > least
    tight &= ~still
    if tight.any():
        k = int(tight.argmax())
        radius = lengths[k] / abs(turn[k])
        return Violation(
            "turn_radius", f"step {k}", f"an arc of radius {radius:.6g} m, below {robot.turn_radius:g}"
        )
    return None


def _check_footprint(path: PosePath, plan: Plan, scene: Scene) -> Violation | None:
    """The footprint at every pose and between them."""
    grid, robot = scene.grid, scene.robot
    polygon = _polygon(scene)
    points = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
    yaws = path.poses[:, 2] - grid.origin[2]
    turn = _angle(np.diff(yaws))
    arm = robot.radius / grid.resolution
    parts = 1 + np.floor((path.step_lengths / grid.resolution + np.abs(turn) * arm) / FINE).astype(int)
    # Where the base is farther from every wall than the farthest point and the way to the next pose, nothing can touch.
    reach = robot.radius + DENSE * grid.resolution * (1 + SLACK)
    near = wall_distance_of_points(grid, points, reach) <= reach
    for k, (point, yaw) in enumerate(zip(points, yaws, strict=True)):
        if not near[k]:
            continue
        n = int(parts[k]) if k < len(parts) else 1
        for i in range(n):
            x, y = point
            heading = float(yaw)
            if i:
                heading += float(turn[k]) * i / n
                x, y = along_arc(point, points[k + 1], float(turn[k]), i / n)
            hit = overlapped(placed(polygon, float(x), float(y), heading), grid.blocked)
            if hit is not None:
                return Violation("footprint", f"pose {k}", f"the robot overlaps the blocked cell {hit}")
    return None


def _check_cost(path: PosePath, plan: Plan, scene: Scene) -> Violation | None:
    """The cost is the length with its prices, or the time of arrival, and not below the bound."""
    lengths = path.step_lengths
    turned = np.abs(_angle(np.diff(path.poses[:, 2])))
    reverse = plan.attributes.get("reverse_cost", 1.0)
    price = np.where(path.gears < 0, reverse, 1.0)
    if path.prices is not None:
        if not (path.prices > 0).all():
            return Violation("cost", "pose_path", "a step whose price is not above 0")
        price, turned = price * path.prices, turned * path.prices
    costs = lengths * price + plan.attributes.get("turn_cost", 0.0) * np.where(path.gears == 0, turned, 0.0)
    penalty, slack = plan.attributes.get("cost_penalty", 0.0), COST_SLACK
    if scene.grid.terrain is not None and penalty:
        costs, slack = costs * (1.0 + penalty * _mean_terrain(path, scene) / MAX_TERRAIN), TERRAIN_SLACK
    if path.lower_bound_m > path.cost_m:
        return Violation("bound", "pose_path", "the lower bound is above the cost")
    if path.times is not None:
        return check_pose_times(path, costs, plan, scene)
    cost = math.fsum(costs.tolist())
    driven = path.gears[path.gears != 0]
    cost += plan.attributes.get("switch_cost", 0.0) * int(np.count_nonzero(driven[1:] != driven[:-1]))
    if abs(cost - path.cost_m) > slack * max(cost, scene.grid.resolution):
        return Violation("cost", "pose_path", f"it says {path.cost_m:.9g} m, its poses come to {cost:.9g}")
    return None


def _mean_terrain(path: PosePath, scene: Scene) -> Floats:
    """The mean terrain value under the base during each step, by length; float64 (n - 1,)."""
    grid = scene.grid
    assert grid.terrain is not None
    points = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
    turn = _angle(np.diff(path.poses[:, 2]))
    means = np.zeros(len(turn))
    for k in range(len(turn)):
        marks = [along_arc(points[k], points[k + 1], float(turn[k]), i / CHORDS) for i in range(CHORDS + 1)]
        total = weighed = 0.0
        for (ax, ay), (bx, by) in pairwise(marks):
            stops = {0.0, 1.0}
            for a, b in ((ax, bx), (ay, by)):
                for line in range(math.floor(min(a, b) - 0.5), math.ceil(max(a, b) + 0.5) + 1):
                    if min(a, b) < line + 0.5 < max(a, b):
                        stops.add((line + 0.5 - a) / (b - a))
            shares = sorted(stops)
            for t0, t1 in pairwise(shares):
                middle = (t0 + t1) / 2
                x, y = math.floor(ax + middle * (bx - ax) + 0.5), math.floor(ay + middle * (by - ay) + 0.5)
                part = (t1 - t0) * math.hypot(bx - ax, by - ay)
                inside = 0 <= x < grid.width and 0 <= y < grid.height
                total += part
                weighed += part * float(grid.terrain[y, x]) if inside else 0.0
        if total > 0:
            means[k] = weighed / total
        else:
            x, y = np.floor(points[k] + 0.5).astype(int)
            means[k] = float(grid.terrain[y, x])
    return means
