"""Regulated Pure Pursuit, a baseline: the three speed rules of Nav2's controller along a whole path.

Source: Nav2, ``nav2_regulated_pure_pursuit_controller`` (regulation_functions.hpp and its README). What is
read into it so that a command becomes a profile is described in docs/speed/rpp.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.settings import check_settings, number, under_code
from lampyris.kernels.motion.lookahead_nodes import BLOCK, advance_to_distance, bound_blocks
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Cap
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.geometry.sampled_path import SampledPath, places, sample_path
from lampyris.motion.laws.rings import as_cells
from lampyris.motion.lowest import lowest
from lampyris.motion.profile import OnInfeasible, feasible_profile, start_speed
from lampyris.motion.safety.surroundings import cells_distance
from lampyris.typing import Cell, Floats, Points

INSCRIBED = 253
"""Cost of a cell where the robot's centre would make it touch an obstacle."""


@dataclass(frozen=True, slots=True)
class Rpp:
    """Settings of Regulated Pure Pursuit; the defaults are Nav2's.

    Parameters
    ----------
    desired : m/s, the speed it would like; the robot's v_max where that is less.
    lookahead : metres to the point of the path that it steers for; 0: the curvature of the path itself counts.
    min_radius : metres: bends that are tighter are slowed down for.
    min_speed : m/s: neither bends nor obstacles slow it below this.
    scaling_distance : metres: obstacles that are nearer are slowed down for.
    scaling_gain : how much of the speed is left at that distance, at most 1.
    inflation_factor : 1/m: how fast the costmap's cost falls with distance.
    inflation_radius : metres: beyond, the costmap has no cost.
    approach_distance : metres before the goal where it begins to slow down.
    approach_speed : m/s, never less for the goal's sake.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    desired: float = number(0.5, 1e-6, 1e6, unit="m/s", title="desired speed")
    lookahead: float = number(0.6, 0.0, 1e6, unit="m")
    min_radius: float = number(0.9, 1e-6, 1e6, unit="m")
    min_speed: float = number(0.25, 1e-6, 1e6, unit="m/s")
    scaling_distance: float = number(0.6, 1e-6, 1e6, unit="m")
    scaling_gain: float = number(1.0, 1e-6, 1.0)
    inflation_factor: float = number(3.0, 1e-6, 1e6, unit="1/m")
    inflation_radius: float = number(0.55, 0.0, 1e6, unit="m")
    approach_distance: float = number(1.0, 1e-6, 1e6, unit="m")
    approach_speed: float = number(0.05, 1e-6, 1e6, unit="m/s")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "rpp."))


def curvature_rule(v: float, kappa: Floats, settings: Rpp) -> Floats:
    """``v r / r_min`` where the radius r = 1 / |kappa| is below r_min, v elsewhere."""
    bend = np.abs(kappa) * settings.min_radius
    return np.where(bend > 1.0, v / np.maximum(bend, 1.0), v)


def cost_of(distance: Floats, radius: float, settings: Rpp) -> NDArray[np.int64]:
    """What the inflated costmap says at a distance (metres) from the nearest surface: 0 to 252, or 253.

    ``252 exp(-factor (distance - radius))``, cut to a whole number as Nav2 does; 253 within the radius.
    """
    inside = np.where(distance <= settings.inflation_radius, distance, radius)
    cost = 252.0 * elementary.exp(-settings.inflation_factor * np.maximum(inside - radius, 0.0))
    out = np.where(distance <= settings.inflation_radius, np.floor(cost), 0.0)
    return np.where(distance <= radius, INSCRIBED, out).astype(np.int64)


def proximity_rule(v: float, cost: NDArray[np.int64], radius: float, settings: Rpp) -> Floats:
    """``v gain d / scaling_distance`` where the distance d that the cost stands for is below that distance.

    ``d = radius - ln(cost / 252) / factor``; v where the cost is 0, and where it is 255, unknown.
    """
    known = (cost > 0) & (cost < 255)
    share = np.where(known, cost, 252.0) / 252.0
    d = radius - elementary.log(share) / settings.inflation_factor
    near = known & (d < settings.scaling_distance)
    return np.where(near, v * settings.scaling_gain * np.maximum(d, 0.0) / settings.scaling_distance, v)


def approach_rule(v: Floats, left: Floats, settings: Rpp) -> Floats:
    """``min(v, max(v left / D, v_app))`` where less than D metres are left."""
    slower = np.maximum(v * (left / settings.approach_distance), settings.approach_speed)
    return np.where(left < settings.approach_distance, np.minimum(v, slower), v)


def regulate(
    v: float, kappa: Floats, cost: NDArray[np.int64], left: Floats, radius: float, settings: Rpp
) -> list[Cap]:
    """The rules as caps, ``limit``, ``curvature``, ``clearance``, ``approach``; the least is the command.

    Neither of the middle two falls below ``min_speed``, the last has a floor of its own, and nothing is above
    ``desired``.

    Parameters
    ----------
    v : m/s, the speed asked for.
    kappa : 1/m, of the arc to the point steered for; (n,).
    cost : of the costmap where the robot is; (n,).
    left : metres of the path that are left; (n,).
    """
    one = settings
    bend = np.maximum(curvature_rule(v, kappa, one), one.min_speed)
    near = np.maximum(proximity_rule(v, cost, radius, one), one.min_speed)
    regulated = np.minimum(bend, near)
    last = approach_rule(regulated, left, one)
    return [
        Cap("limit", np.full(len(kappa), one.desired)),
        Cap("curvature", bend),
        Cap("clearance", near),
        Cap("approach", np.where(last < regulated, last, np.inf)),
    ]


def steered(samples: SampledPath, lookahead: float) -> Floats:
    """Curvature of the arc from each node to the point ``lookahead`` metres away, 1/m, >= 0; (n,).

    The robot is on the path and heads along it. In its frame the point lies at (x, y); the arc that touches
    the heading and meets the point has the curvature ``2 y / (x^2 + y^2)``. The point is the first of the path
    that is so far off as the crow flies, on the straight line between two nodes; near the goal, the goal.
    """
    xy, s, n = samples.xy * samples.resolution, samples.s, len(samples)
    if n == 1:
        return np.zeros(1)
    j = np.minimum(np.searchsorted(s, s + lookahead * (1.0 - 1e-9)), n - 1)
    j = nodes_ahead(xy, lookahead, j)
    a, b = xy[np.maximum(j - 1, 0)] - xy, xy[j] - xy
    carrot = b + (a - b) * _beyond(a, b, lookahead)[:, None]
    h = samples.heading
    aside = np.abs(h[:, 0] * carrot[:, 1] - h[:, 1] * carrot[:, 0])
    square = (carrot * carrot).sum(axis=1)
    out: Floats = 2.0 * aside / np.where(square > 0.0, square, 1.0)
    return out


def nodes_ahead(xy: Points, distance: float, first: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each node the first, from ``first`` on, that is at least ``distance`` away; the last if there is none.

    Parameters
    ----------
    xy : float64 (n, 2), metres.
    distance : metres.
    first : int64 (n,): where the search of each node begins.
    """
    x, y = np.ascontiguousarray(xy[:, 0]), np.ascontiguousarray(xy[:, 1])
    boxes = _boxes(x, y)
    wide = (*_boxes(boxes[0], boxes[1])[:2], *_boxes(boxes[2], boxes[3])[2:])
    node = first.copy()
    advance_to_distance(x, y, distance, node, *boxes, *wide)
    return node


def _boxes(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Least x and y and greatest x and y of each block of numbers."""
    low_x, low_y, high_x, high_y = np.empty((4, -(-len(x) // BLOCK)))
    bound_blocks(x, y, low_x, low_y, high_x, high_y)
    return low_x, low_y, high_x, high_y


def _beyond(a: Points, b: Points, radius: float) -> Floats:
    """How far back from b towards a the circle around the origin lies, 0 to 1; 0 where b is inside it."""
    d = a - b
    square, along = (d * d).sum(axis=1), (b * d).sum(axis=1)
    out = (b * b).sum(axis=1) - radius * radius
    root = np.sqrt(np.maximum(along * along - square * out, 0.0))
    share = np.where(out > 0.0, (-along - root) / np.where(square > 0.0, square, 1.0), 0.0)
    return np.clip(share, 0.0, 1.0)


def rpp_commands(
    samples: SampledPath,
    scene: Scene,
    settings: Rpp,
    obstacles: NDArray[np.int64],
    obstacle_states: ObstacleStates | None = None,
) -> list[Cap]:
    """What the controller would command at each node of a sampled path, as caps; see :func:`regulate`.

    What moves is a surface where it is now, as in Nav2's obstacle layer.
    """
    radius = scene.robot.radius
    reach = max(settings.inflation_radius, radius)
    distance = wall_distance(samples.xy, scene.grid, reach)
    cells = cells_distance(samples.xy, obstacles, samples.resolution, reach) if len(obstacles) else None
    if cells is not None:
        distance = np.minimum(distance, cells)
    for k in range(0 if obstacle_states is None else len(obstacle_states)):
        assert obstacle_states is not None
        gap = samples.xy - obstacle_states.xy[k]
        far = np.sqrt((gap * gap).sum(axis=1)) * samples.resolution - obstacle_states.radius[k]
        distance = np.minimum(distance, np.maximum(far, 0.0))
    kappa = steered(samples, settings.lookahead) if settings.lookahead > 0.0 else samples.curvature
    desired = min(settings.desired, scene.robot.v_max)
    one = replace(settings, desired=desired)
    left = samples.s[-1] - samples.s
    return regulate(desired, kappa, cost_of(distance, radius, one), left, radius, one)


def rpp_profile(
    route: Path | SampledPath,
    scene: Scene,
    law: Rpp,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """The commands of Regulated Pure Pursuit, followed as well as the robot's acceleration and braking allow.

    The speed at a node is the command there, or what comes nearest to it from the speed at the node before:
    nothing farther ahead is braked for, so that the robot may be faster at a bend or a wall than the command
    there. The goal, and places where it must turn in place, are braked for in time: Nav2 leaves that to
    its goal checker and to turning in place. ``cause_index`` of a braking node: where the braking ends, because
    the command is met or the robot stands; -1 where the command rises again before that. ``previous`` says
    nothing here.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED``.
    """
    samples = route if isinstance(route, SampledPath) else sample_path(route, scene.grid.resolution)
    commands = rpp_commands(samples, scene, law, as_cells(obstacles), obstacle_states)
    low = lowest(commands)
    followed = _tracked(samples, low.v, low.words, scene, start_speed(v0))
    robot = scene.robot
    # The controller ignores limits ahead, but the robot cannot drive faster than it can.
    followed.v[0] = min(float(followed.v[0]), robot.v_max)
    made = feasible_profile(
        samples.s,
        [Cap("limit", followed.v)],
        a_max=robot.a_max,
        d_max=robot.d_max,
        v0=v0,
        on_infeasible=on_infeasible,
        stop=samples.stop,
    )
    # A start too fast for the next halt, if it may be so, is braked for as hard as can be, past the halt.
    hard = made.v > np.where(samples.stop, 0.0, followed.v) * (1.0 + 1e-9)
    hard[0] = False
    cause = tuple("braking" if over else why for over, why in zip(hard, followed.cause, strict=True))
    cause_index = np.where(hard, made.cause_index, followed.cause_index)
    caps = tuple((cap.cause, cap.v) for cap in commands)
    return Profile("rpp", samples.s, made.v, made.a, made.t, cause, "m/s", cause_index, caps, places(route))


class _Tracked(NamedTuple):
    """Speeds that may be driven, but at halts, their causes, and the nodes that are braked for."""

    v: Floats
    cause: list[str]
    cause_index: NDArray[np.int64]


def _tracked(
    samples: SampledPath, command: Floats, words: tuple[str, ...], scene: Scene, v0: float
) -> _Tracked:
    """Speeds that follow the command from behind, and why; the next halt is braked for at the last moment."""
    s, robot, n = samples.s, scene.robot, len(samples)
    halts = np.append(np.flatnonzero(samples.stop), n - 1)
    ahead = s[halts[np.searchsorted(halts, np.arange(n))]]
    halt = (2.0 * robot.d_max * (ahead - s)).tolist()
    ds = s[1:] - s[:-1]
    up, down = (2.0 * robot.a_max * ds).tolist(), (2.0 * robot.d_max * ds).tolist()
    wanted = (command * command).tolist()
    x, cause = [v0 * v0], ["start"]
    for i in range(n - 1):
        most, least = x[i] + up[i], x[i] - down[i]
        at, why = wanted[i + 1], words[i + 1]
        if at > most:
            at, why = most, "acceleration"
        elif at < least:
            at, why = least, "braking"
        if halt[i + 1] < at:
            at, why = halt[i + 1], "turn" if samples.stop[i + 1] else "braking"
        x.append(at)
        cause.append(why)
    if n > 1:
        cause[-1] = "goal"
    # It stands there anyway. What it is commanded there bounds edges from rest to rest.
    for k in halts.tolist():
        x[k] = wanted[k]
    x[0] = max(x[0], wanted[0])
    return _Tracked(np.sqrt(np.maximum(x, 0.0)), cause, _braked_for(cause))


def _braked_for(cause: list[str]) -> NDArray[np.int64]:
    """For each braking node the one whose command or halt ends the braking; (n,).

    -1 where there is none: the command rose again before it was met.
    """
    cause_index, met = np.full(len(cause), -1, dtype=np.int64), -1
    for k in range(len(cause) - 1, -1, -1):
        if cause[k] == "braking":
            cause_index[k] = met
        else:
            met = -1 if cause[k] == "acceleration" else k
    return cause_index
