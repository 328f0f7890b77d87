"""Moving obstacles whose top speed is known: slow enough to stop before any of them could be there.

Derivations and measurements: docs/speed/moving_obstacles.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.defaults import MAX_AGE
from lampyris._core.settings import check_settings, number, under_code
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.typing import Floats, Points

_BLOCK = 32
"""Edges of a sampled path that are tested for nearness together: of 8 to 64, the quickest for 1,000 nodes."""

_STANDING = 1e-9
"""m/s: a cap below it is 0."""


@dataclass(frozen=True, slots=True)
class MovingObstacles:
    """Settings of the moving obstacles' cap.

    Parameters
    ----------
    reaction : seconds until braking begins, >= 0.
    max_age : seconds after which what is known of the obstacles is no knowledge any more, >= 0.
    margin : metres to be left between the robot and any obstacle, >= 0.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    reaction: float = number(0.1, 0.0, 1e6, unit="s")
    max_age: float = number(MAX_AGE, 0.0, 1e6, unit="s")
    margin: float = number(0.0, 0.0, 1e6, unit="m")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "physical.moving."))


def fresh(obstacle_states: ObstacleStates, max_age: float) -> bool:
    """Whether what is known of the obstacles may be used; an age that is no number, or below 0, is refused."""
    return 0.0 <= obstacle_states.age <= max_age


def moving(
    distance: Floats, *, top_speed: Floats, reaction: float, age: float, d_max: float, margin: float = 0.0
) -> Floats:
    """Slow enough to stand before the obstacle could be there: m/s, same shape as ``distance``.

    Parameters
    ----------
    distance : metres between the robot's edge and the obstacle's.
    top_speed : m/s, of the obstacle; broadcast against ``distance``.
    reaction : seconds until the robot brakes.
    age : seconds since the obstacle was seen.
    d_max : m/s2.
    margin : metres to be left.

    The greatest v with ``v T + v^2 / (2 d_max) + u (age + T + v / d_max) <= distance - margin``; 0 where
    there is none.
    """
    room = distance - margin - top_speed * (age + reaction)
    b = d_max * reaction + top_speed
    v = np.sqrt(b * b + 2.0 * d_max * np.maximum(room, 0.0))
    v -= b
    # The greatest whole number of ulps below: subtracting b may have rounded up.
    v -= 4.4e-16 * (v + 2.0 * b)
    return np.where(v > _STANDING, v, 0.0)


def moving_cap(samples: SampledPath, scene: Scene, settings: MovingObstacles, around: Around) -> list[Cap]:
    """The cap ``moving obstacle`` of a sampled path, its ``cause_index`` the number of the obstacle that binds.

    The distance at a node is the least on the edges that touch it, so what holds at two neighbours holds
    between them. Obstacles too far to slow the robot at its v_max are left out. What is known of the
    obstacles is that of now: a profile is made again as they move.

    Obstacles seen more than ``max_age`` ago, or at a time to come: 0 everywhere, cause ``no data``.
    """
    obstacle_states, robot = around.obstacle_states, scene.robot
    if obstacle_states is None:
        return []
    if not fresh(obstacle_states, settings.max_age):
        return [Cap("no data", np.zeros(len(samples)))]
    far = _binding_distance(obstacle_states, robot, settings)
    edges = _edges(samples)
    pairs = _near(edges, obstacle_states.xy * samples.resolution, far + robot.radius + obstacle_states.radius)
    if len(pairs.block) == 0:
        return []
    m = pairs.obstacle[:, None]
    distance = _to_edges(edges, pairs, obstacle_states.xy * samples.resolution) - (
        robot.radius + obstacle_states.radius[m]
    )
    v = moving(
        distance,
        top_speed=obstacle_states.top_speed[m],
        reaction=settings.reaction,
        age=obstacle_states.age,
        d_max=robot.d_max,
        margin=settings.margin,
    )
    v[distance > far[m]] = np.inf
    return _least(edges, pairs, v, len(samples))


def _binding_distance(obstacle_states: ObstacleStates, robot: Robot, settings: MovingObstacles) -> Floats:
    """Distance from edge to edge beyond which v_max is slow enough; metres, (m,)."""
    seconds = settings.reaction + robot.v_max / robot.d_max
    stopping = robot.v_max * (settings.reaction + 0.5 * robot.v_max / robot.d_max)
    out: Floats = stopping + settings.margin + obstacle_states.top_speed * (obstacle_states.age + seconds)
    return out


class _Edges(NamedTuple):
    """A sampled path's edges in blocks, metres: where each begins, its vector, what the path leaves it by at most.

    The last block is filled up with the last point. A sampled path of one node is one edge of no length.
    """

    x: Floats
    y: Floats
    dx: Floats
    dy: Floats
    square: Floats
    bend: Floats


class _Pairs(NamedTuple):
    """Blocks and obstacles that are near each other, by block, then by obstacle."""

    block: NDArray[np.int64]
    obstacle: NDArray[np.int64]


def _edges(samples: SampledPath) -> _Edges:
    points = samples.xy * samples.resolution
    ends = points[1:] if len(points) > 1 else points
    begins = points[: len(ends)]
    ds = (samples.s[1:] - samples.s[:-1]) if len(points) > 1 else np.zeros(1)
    bend = 0.125 * np.minimum(samples.curvature[: len(ends)], samples.curvature[-len(ends) :]) * ds * ds
    size = (-(-len(ends) // _BLOCK), _BLOCK)
    d = ends - begins

    def shaped(values: Floats, fill: float) -> Floats:
        out = np.full(size, fill)
        out.reshape(-1)[: len(values)] = values
        return out

    x, y = (shaped(begins[:, k], float(points[-1, k])) for k in (0, 1))
    dx, dy = (shaped(d[:, k], 0.0) for k in (0, 1))
    return _Edges(x, y, dx, dy, np.maximum(dx * dx + dy * dy, 1e-300), shaped(bend, 0.0))


def _near(edges: _Edges, xy: Points, reach: Floats) -> _Pairs:
    """Pairs of a block and an obstacle whose centre is within reach of the block's box."""
    far = 0.0
    for k, (begin, d) in enumerate(((edges.x, edges.dx), (edges.y, edges.dy))):
        end = begin + d
        low = np.minimum(begin, end).min(axis=1)[:, None] - xy[None, :, k]
        high = xy[None, :, k] - np.maximum(begin, end).max(axis=1)[:, None]
        gap = np.maximum(np.maximum(low, high), 0.0)
        far = far + gap * gap
    r = reach + float(edges.bend.max())
    return _Pairs(*np.nonzero(far <= r * r))


def _to_edges(edges: _Edges, pairs: _Pairs, xy: Points) -> Floats:
    """A lower bound of the distance from each pair's obstacle to each edge of its block; metres."""
    b, m = pairs
    qx = xy[m, :1] - edges.x[b]
    qy = xy[m, 1:] - edges.y[b]
    dx, dy = edges.dx[b], edges.dy[b]
    along = np.clip((qx * dx + qy * dy) / edges.square[b], 0.0, 1.0)
    qx -= along * dx
    qy -= along * dy
    out: Floats = np.sqrt(qx * qx + qy * qy) - edges.bend[b]
    return out


def _least(edges: _Edges, pairs: _Pairs, v: Floats, nodes: int) -> list[Cap]:
    """The least over the obstacles at each edge, then over the edges at each node."""
    first = np.flatnonzero(np.diff(pairs.block, prepend=-1))
    least = np.minimum.reduceat(v, index_array(first), axis=0)
    count = np.diff(first, append=len(v))
    holds = v == np.repeat(least, index_array(count), axis=0)
    who = np.minimum.reduceat(
        np.where(holds, pairs.obstacle[:, None], np.iinfo(np.int64).max), index_array(first), axis=0
    )
    bound = np.full(edges.x.shape, np.inf)
    cause_index = np.full(edges.x.shape, -1, dtype=np.int64)
    bound[pairs.block[first]], cause_index[pairs.block[first]] = least, who
    n = max(nodes - 1, 1)
    bound, cause_index = bound.reshape(-1)[:n], cause_index.reshape(-1)[:n]
    if not np.isfinite(bound).any():
        return []
    if nodes == 1:
        return [Cap("moving obstacle", bound, np.where(np.isfinite(bound), cause_index, -1))]
    leaving, coming = np.append(bound, np.inf), np.insert(bound, 0, np.inf)
    v = np.minimum(leaving, coming)
    number = np.where(leaving <= coming, np.append(cause_index, -1), np.insert(cause_index, 0, -1))
    return [Cap("moving obstacle", v, np.where(np.isfinite(v), number, -1))]
