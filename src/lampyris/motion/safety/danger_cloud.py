"""Speed by danger: the velocity obstacle's two indices, each judged by a normal cloud.

After Xue et al. (dissertation, related work, [72]), whose formulas could not be found: the velocity obstacle
and the normal cloud are the literature's, what is danger and how it lowers the speed is ours. See
docs/speed/cloud.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lampyris._core import elementary
from lampyris._core.defaults import CREEP
from lampyris._core.settings import check_settings, number, under_code
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.setting_checks import number as checked_number
from lampyris.typing import FloatGrid, Floats, Points

NODES = (
    (0.0, 0.4063492063492064),
    (0.7235510187528376, 0.2440975028949394),
    (1.468553289216668, 0.04991640676521791),
    (2.266580584531843, 0.0027891413212317653),
    (3.1909932017815277, 2.2345844007746576e-05),
)
"""Gauss and Hermite's rule with nine nodes for a mean over a normal law: (node, share), the others mirrored.

Written out: a library finds them as eigenvalues, with other last bits on other machines.
"""

_BEYOND = 1e9
"""A width so far under the distance that the membership is 0."""


@dataclass(frozen=True, slots=True)
class Cloud:
    """A normal cloud: a bell whose width is itself uncertain.

    Parameters
    ----------
    ex : expectation: where the membership is 1.
    en : entropy: the bell's width, > 0.
    he : hyper-entropy: spread of that width, 0 <= he <= en / 3. Beyond, the drops are a mist and no concept.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    ex: float
    en: float
    he: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "ex", checked_number("cloud.ex", self.ex, -1e9, 1e9))
        object.__setattr__(self, "en", checked_number("cloud.en", self.en, 1e-9, 1e9))
        object.__setattr__(self, "he", checked_number("cloud.he", self.he, 0.0, self.en / 3.0))


def cloud_between(low: float, high: float, he: float) -> Cloud:
    """The cloud of an interval: ``Ex = (low + high) / 2``, ``En = (high - low) / 6``.

    Source: the cloud model's literature (docs/speed/cloud.md, "Sources"): the ends are three widths
    away.
    """
    return Cloud((low + high) / 2.0, (high - low) / 6.0, he)


@dataclass(frozen=True, slots=True)
class CloudModel:
    """Settings of the law.

    Parameters
    ----------
    horizon : seconds: what happens later is no danger.
    near : metres between the surfaces: what passes farther away is no danger.
    hyper : hyper-entropy of both clouds as a share of their entropy, 0 to 1/3: how little the two borders
        are known.
    creep : share of v_max that danger never takes away, 0 < creep <= 1.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    horizon: float = number(6.0, 1e-3, 1e3, unit="s")
    near: float = number(1.5, 1e-3, 1e3, unit="m", title="distance of danger")
    hyper: float = number(0.1, 0.0, 1.0 / 3.0, title="hyper-entropy")
    creep: float = number(CREEP, 1e-6, 1.0, title="share of speed always left")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "physical.cloud."))

    @property
    def time_cloud(self) -> Cloud:
        """How dangerous a time to contact is: of the interval from -horizon to horizon."""
        en = self.horizon / 3.0
        return Cloud(0.0, en, self.hyper * en)

    @property
    def gap_cloud(self) -> Cloud:
        """How dangerous a gap is: of the interval from -near to near."""
        en = self.near / 3.0
        return Cloud(0.0, en, self.hyper * en)


def membership(cloud: Cloud, x: Floats) -> Floats:
    """Expected membership of x: the mean of ``exp(-(x - Ex)^2 / (2 En'^2))`` over ``En' ~ N(En, He^2)``.

    No closed form is known to us; nine fixed nodes of Gauss and Hermite's rule instead: within 2e-11 of the
    integral at He = En / 10, 3e-6 at En / 5, 1.3e-3 at En / 3 (docs/speed/cloud.md). The same bits
    everywhere.
    """
    away = np.asarray(x, dtype=np.float64) - cloud.ex
    mean = np.zeros_like(away)
    for node, share in NODES:
        for side in (1.0, -1.0) if node else (1.0,):
            width = cloud.en + side * math.sqrt(2.0) * cloud.he * node
            z = away / width if width else np.where(away == 0.0, 0.0, _BEYOND)
            mean += share * elementary.exp(-0.5 * np.minimum(z * z, _BEYOND))
    return mean


def degree(cloud: Cloud, x: Floats) -> Floats:
    """The half cloud: 1 up to Ex, the expected membership above; falls with x. Infinity gives 0."""
    x = np.asarray(x, dtype=np.float64)
    far = np.minimum(np.maximum(x, cloud.ex), cloud.ex + _BEYOND * cloud.en)
    return np.where(x <= cloud.ex, 1.0, membership(cloud, far))


def drops(cloud: Cloud, count: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Forward normal cloud generator: drops x and their memberships, (count,) each.

    ``En' ~ N(En, He^2)``, ``x ~ N(Ex, En'^2)``, ``mu = exp(-(x - Ex)^2 / (2 En'^2))``. For tests and
    pictures: the law itself draws nothing. Whatever the cloud, the mean of mu is 1 / sqrt 2.
    """
    width = cloud.en + cloud.he * rng.standard_normal(count)  # bits: for tests and pictures
    z = rng.standard_normal(count)  # bits: for tests and pictures
    return cloud.ex + np.abs(width) * z, elementary.exp(-0.5 * z * z)


def drops_at(cloud: Cloud, x: float, count: int, rng: np.random.Generator) -> Floats:
    """Memberships of drops at x, by the same ``En' ~ N(En, He^2)``; their mean is :func:`membership`."""
    width = cloud.en + cloud.he * rng.standard_normal(count)  # bits: for tests and pictures
    z = (x - cloud.ex) / np.where(width == 0.0, 1e-300, width)
    return elementary.exp(-0.5 * np.minimum(z * z, _BEYOND))


def approach(p: Points, r: Points, radius: float | Floats, horizon: float) -> tuple[Floats, Floats]:
    """Time and gap of two discs' closest approach, or of their contact, within a time; (n,) each.

    Parameters
    ----------
    p : float64 (n, 2), metres: from the robot to the obstacle.
    r : float64 (n, 2), m/s: the robot's velocity less the obstacle's.
    radius : metres: both radii together.
    horizon : seconds.

    With ``q = p - r t``: contact is the first t with ``|q| = radius``; so the robot's velocity lies in the
    velocity obstacle ``VO = {v : the ray p + t (w - v) meets the disc, 0 <= t <= horizon}`` exactly where
    the gap is 0. Obstacles that it does not come nearer to have time infinity.
    """
    closing = (p * r).sum(axis=1)
    rr = (r * r).sum(axis=1)
    pp = (p * p).sum(axis=1)
    rho2 = np.square(np.asarray(radius, dtype=np.float64))
    moving = closing > 0.0
    safe = np.where(moving, rr, 1.0)
    nearest = np.minimum(closing / safe, horizon)
    q = p - r * nearest[:, None]
    gap = np.maximum(np.sqrt((q * q).sum(axis=1)) - radius, 0.0)
    # The lesser root of rr t^2 - 2 closing t + pp - rho2 = 0, without cancellation.
    root = np.sqrt(np.maximum(closing * closing - rr * (pp - rho2), 0.0))
    touch = np.maximum(pp - rho2, 0.0) / np.where(moving, closing + root, 1.0)
    time = np.where(gap == 0.0, np.minimum(touch, nearest), nearest)
    time = np.where(moving, time, np.inf)
    gap = np.where(moving, gap, np.inf)
    inside = pp <= rho2
    return np.where(inside, 0.0, time), np.where(inside, 0.0, gap)


def slowed(danger: Floats, *, v_max: float, creep: float) -> Floats:
    """``v = max(creep, v_max (1 - danger))``, m/s. Ours."""
    return np.maximum(creep, v_max * (1.0 - danger))


def cloud_cap(samples: SampledPath, scene: Scene, settings: CloudModel, around: Around) -> list[Cap]:
    """Slower the more dangerous the most dangerous obstacle is at a node; no cap without obstacles.

    Node k is judged for a robot that comes there at full speed, at ``s / v_max``, in its direction of travel;
    obstacles go on as they were seen to. One whose velocity is not known comes straight at the node at its
    top speed. Nodes later than the horizon are not judged: infinity. ``cause_index`` is the obstacle.
    """
    obstacle_states, robot = around.obstacle_states, scene.robot
    if obstacle_states is None or len(obstacle_states) == 0:
        return []
    n = int(np.searchsorted(samples.s, settings.horizon * robot.v_max, side="right"))
    found = dangers(samples, n, scene, settings, obstacle_states)
    worst = found.argmax(axis=1)
    danger = found[np.arange(n), worst]
    v, cause_index = np.full(len(samples), np.inf), np.full(len(samples), -1, dtype=np.int64)
    v[:n] = np.where(
        danger > 0.0, slowed(danger, v_max=robot.v_max, creep=settings.creep * robot.v_max), np.inf
    )
    cause_index[:n] = np.where(danger > 0.0, worst, -1)
    return [Cap("danger", v, cause_index)]


def dangers(
    samples: SampledPath, n: int, scene: Scene, settings: CloudModel, obstacle_states: ObstacleStates
) -> FloatGrid:
    """Danger of each obstacle at each of the first n nodes, 0 to 1, (n, m).

    Degree of the time times degree of the gap: only what is both soon and near is dangerous.
    """
    robot, m = scene.robot, len(obstacle_states)
    there = (samples.s[:n] / robot.v_max + obstacle_states.age)[:, None, None]
    p = (obstacle_states.xy[None, :, :] - samples.xy[:n, None, :]) * samples.resolution
    if obstacle_states.velocity is not None:
        w = np.broadcast_to(obstacle_states.velocity, (n, m, 2))
        p = p + w * there
    else:
        size = np.sqrt((p * p).sum(axis=2, keepdims=True))
        share = obstacle_states.top_speed[None, :, None] / np.where(size > 0.0, size, 1.0)
        w = -p * share
        p = p * np.maximum(0.0, 1.0 - share * there)
    r = robot.v_max * samples.heading[:n, None, :] - w
    both = np.tile(robot.radius + obstacle_states.radius, n)
    time, gap = approach(p.reshape(-1, 2), r.reshape(-1, 2), both, settings.horizon)
    danger = np.zeros(n * m)
    near = np.isfinite(time)
    danger[near] = degree(settings.time_cloud, time[near]) * degree(settings.gap_cloud, gap[near])
    return danger.reshape(n, m)
