"""Three speeds: slow, normal or fast, chosen by a small POMDP against what obstacles may be about to do.

After Foka and Trahanias (dissertation, related work, [68]): the three speeds, chosen on line against
predicted motion by a POMDP, are theirs; states, rewards and observations could not be found and are ours.
Model, equations and limits: docs/speed/three_speeds.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.settings import check_settings, number, under_code, whole
from lampyris.errors import SettingError, shown
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.setting_checks import number as checked_number
from lampyris.motion.setting_checks import whole as checked_whole
from lampyris.typing import FloatGrid, Floats, Points

_SAME = 1e-9
"""Displacements (metres) and values (steps of full speed) that differ by less are equal."""
_PARTS = 4
"""Pieces of a decision step between whose ends robot and obstacles go straight."""


@dataclass(frozen=True, slots=True)
class ThreeSpeed:
    """Settings of the law.

    Parameters
    ----------
    paces : slow, normal and fast in whole units of progress a decision step, rising, up to 16; fast is v_max.
    step : seconds between two decisions.
    depth : decisions looked ahead, 1 to 6.
    ahead : seconds of predicted motion in which the law speaks; later nodes may be driven fast.
    cost : of a decision step with contact at full speed, in steps of full speed; at a lower speed so much
        less.
    prior : shares of the intents keeps, stops, comes before anything was seen.
    accuracy : chance that what is seen of an obstacle in a step tells its intent rightly; 1/3 to 1.
    forget : share of the prior mixed into the belief after every step seen: intents change.
    margin : metres between the surfaces that count as contact.
    near : how many obstacles are weighed together, those that come nearest first; 1 to 3.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    paces: tuple[int, int, int] = (1, 2, 4)
    step: float = number(1.0, 1e-3, 1e3, unit="s", title="time between decisions")
    depth: int = whole(3, 1, 6, title="decisions ahead")
    ahead: float = number(8.0, 0.0, 1e3, unit="s", title="time ahead")
    cost: float = number(10.0, 0.0, 1e6, title="cost of a contact")
    prior: tuple[float, float, float] = (0.8, 0.15, 0.05)
    accuracy: float = number(0.8, 1.0 / 3.0, 1.0, title="chance of seeing intent")
    forget: float = number(0.1, 0.0, 1.0, title="share of the prior mixed in")
    margin: float = number(0.1, 0.0, 1e3, unit="m", title="distance of a contact")
    near: int = whole(2, 1, 3, title="obstacles weighed together")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "physical.three_speed."))
        paces = _three("paces", self.paces)
        where = "physical.three_speed.paces"
        object.__setattr__(self, "paces", tuple(checked_whole(where, pace, 1, 16) for pace in paces))
        if not self.paces[0] < self.paces[1] < self.paces[2]:
            raise SettingError("LAW_SETTING", f"{self.paces}", where=where, allowed="rising whole numbers")
        where = "physical.three_speed.prior"
        shares = tuple(checked_number(where, share, 0.0, 1.0) for share in _three("prior", self.prior))
        if abs(math.fsum(shares) - 1.0) > 1e-9:
            raise SettingError("LAW_SETTING", f"{shares}", where=where, allowed="shares that add up to 1")
        object.__setattr__(self, "prior", shares)

    @property
    def likelihood(self) -> FloatGrid:
        """Chance of each observation (column) given each intent (row), (3, 3)."""
        other = (1.0 - self.accuracy) / 2.0
        return np.where(np.eye(3, dtype=np.bool_), self.accuracy, other)


def _three(name: str, value: object) -> Sequence[object]:
    if not isinstance(value, tuple | list) or len(value) != 3:
        raise SettingError(
            "LAW_SETTING", shown(value), where=f"physical.three_speed.{name}", allowed="three numbers"
        )
    return value


def choose(belief: FloatGrid, contact: FloatGrid, settings: ThreeSpeed) -> tuple[int, Floats]:
    """The best of three speeds and the value of each, by exact expectimax over beliefs.

    Parameters
    ----------
    belief : float64 (m, 3): share of each intent for each obstacle; they are independent. m >= 0.
    contact : float64 (depth, places, 3, m, 3): 1 where decision step n, begun ``place`` units of progress
        from here at one of three speeds, touches obstacle m if it has that intent, 0 where not. There are
        ``depth * fast + 1`` places or more.

    Returns
    -------
    index (0 slow, 1 normal, 2 fast) and the three values, in steps of full speed: progress, less cost times
    share of full speed of each expected contact. Of equal values the faster wins.

    A belief depends on how often each observation was made, not on their order. So the tree of
    ``(3 * 3^m)^depth`` leaves has only ``C(n + 2, 2)^m`` different beliefs after n steps, and the recursion
    runs over those, backward. Beliefs are kept unnormalised (``b_i prod_o P(o | i)^count``): the sum over
    observations then needs no division, and the maximum is the same.
    """
    m, depth = len(belief), settings.depth
    paces = np.array(settings.paces)
    share = (paces / paces[2]).reshape((3,) + (1,) * m)
    later: NDArray[np.float64] | None = None
    for n in range(depth - 1, -1, -1):
        weight = [_weights(belief[k], settings.likelihood, _counts(n)) for k in range(m)]
        total = [_along(_summed(w), k, m) for k, w in enumerate(weight)]
        # Axes: place, speed, then what was seen of each obstacle so far.
        places = np.arange(n * paces[2] + 1)
        value: NDArray[np.float64] = np.ones((len(places), 3) + (1,) * m)
        for one in total:
            value = value * one
        for k in range(m):
            touched = _along(_summed(weight[k] * contact[n, : len(places), :, k, None, :]), k, m)
            for other in (*total[:k], *total[k + 1 :]):
                touched = touched * other
            value = value - settings.cost * touched
        value = value * share
        if later is not None:
            value = value + _after(later[places[:, None] + paces], _followers(n), m)
        later = value.max(axis=1)
        if n == 0:
            values = value.reshape(3)
    return _best(values), values


def _best(values: Floats) -> int:
    """The index of the greatest value; of equal ones the last, which is the fastest."""
    best = 2
    for a in (1, 0):
        if values[a] > values[best] + _SAME:
            best = a
    return best


def _summed(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum over the three intents, the last axis, in this order on every machine."""
    total: NDArray[np.float64] = weights[..., 0] + weights[..., 1] + weights[..., 2]
    return total


def _along(factor: NDArray[np.float64], axis: int, m: int) -> NDArray[np.float64]:
    """The last axis of an array put at one of m last axes, the others of length 1."""
    last = tuple(factor.shape[-1] if k == axis else 1 for k in range(m))
    return factor.reshape(factor.shape[:-1] + last)


@cache
def _counts(n: int) -> NDArray[np.int64]:
    """Every way in which n observations divide into three kinds, (C(n + 2, 2), 3)."""
    return np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)], dtype=np.int64)


@cache
def _followers(n: int) -> NDArray[np.int64]:
    """Where each division of n, one observation more of each kind, stands among those of n + 1; (., 3)."""
    later = {tuple(c): k for k, c in enumerate(_counts(n + 1).tolist())}
    return np.array(
        [[later[tuple(c[j] + (j == o) for j in range(3))] for o in range(3)] for c in _counts(n).tolist()],
        dtype=np.int64,
    )


def _weights(belief: Floats, likelihood: FloatGrid, counts: NDArray[np.int64]) -> FloatGrid:
    """Unnormalised belief after those observations, (counts, 3 intents)."""
    most = int(counts.max()) if counts.size else 0
    powers = [np.ones((3, 3))]
    for _ in range(most):
        powers.append(powers[-1] * likelihood)
    table = np.array(powers)
    out = np.tile(belief, (len(counts), 1))
    for o in range(3):
        out = out * table[counts[:, o], :, o]
    return out


def _after(value: NDArray[np.float64], follow: NDArray[np.int64], m: int) -> NDArray[np.float64]:
    """Sum over every obstacle's next observation of the value there; its counts are the last m axes."""
    for axis in range(value.ndim - m, value.ndim):
        first, second, third = (np.take(value, follow[:, o], axis=axis) for o in range(3))
        value = first + second + third
    return value


def intended(start: Points, velocity: Points, speed: Floats, path: Points, t: Floats) -> NDArray[np.float64]:
    """Where obstacles are after some times under each intent; metres, (m, 3, k, 2).

    Parameters
    ----------
    start, velocity : (m, 2), metres and m/s.
    speed : m/s, (m,), of one that comes.
    path : (p, 2), metres: the robot's path. One that comes makes straight for the nearest of these points,
        and stays there.
    t : seconds, (k,), 0 or more.
    """
    out = np.repeat(start[:, None, None, :], len(t), axis=2).repeat(3, axis=1)
    out[:, 0] += velocity[:, None, :] * t[None, :, None]
    gap = path[None, :, :] - start[:, None, :]
    near = (gap * gap).sum(axis=2).argmin(axis=1)
    aim = gap[np.arange(len(start)), near]
    size = np.sqrt((aim * aim).sum(axis=1))
    done = np.minimum(speed[:, None] * t / np.where(size > 0.0, size, 1.0)[:, None], 1.0)
    out[:, 2] += aim[:, None, :] * done[:, :, None]
    return out


def observed(moved: Points, expected: NDArray[np.float64], likelihood: FloatGrid) -> FloatGrid:
    """Likelihood of each intent given how far each obstacle was seen to move; (m, 3).

    Parameters
    ----------
    moved : metres, (m, 2).
    expected : metres, (m, 3, 2), under each intent.
    likelihood : chance of each observation (column) given each intent (row).

    The observation is the intent whose expected movement is nearest; if several are equally near, any of
    them, evenly.
    """
    gap = np.sqrt(np.square(expected - moved[:, None, :]).sum(axis=2))
    nearest = gap <= gap.min(axis=1, keepdims=True) + _SAME
    share = nearest / nearest.sum(axis=1, keepdims=True)
    likely: FloatGrid = (share[:, None, :] * likelihood[None, :, :]).sum(axis=2)
    return likely


def updated(belief: FloatGrid, likely: FloatGrid, settings: ThreeSpeed) -> FloatGrid:
    """Bayes: ``b_i P(o | i)`` over its sum; then ``forget`` of the prior mixed in. (m, 3)."""
    joint = belief * likely
    total = joint.sum(axis=1, keepdims=True)
    fresh = np.where(total > 0.0, joint / np.where(total > 0.0, total, 1.0), np.array(settings.prior))
    return (1.0 - settings.forget) * fresh + settings.forget * np.array(settings.prior)


def three_speed_cap(
    samples: SampledPath, scene: Scene, settings: ThreeSpeed, around: Around, belief: FloatGrid | None = None
) -> list[Cap]:
    """The speed chosen now and, step by step along the sampled path, the choices as if the robot stood there.

    Parameters
    ----------
    belief : (m, 3), of every obstacle, such as :attr:`ThreeSpeedControl.belief`; None: the prior.

    At each decision the robot is at the node that the speeds chosen so far lead to, the obstacles where each
    intent takes them by then; the belief is today's. No cap without obstacles: fast everywhere.
    """
    obstacle_states, top = around.obstacle_states, scene.robot.v_max
    n = len(samples)
    if obstacle_states is None or len(obstacle_states) == 0:
        return []
    if belief is None:
        belief = np.tile(np.array(settings.prior), (len(obstacle_states), 1))
    v = np.full(n, np.inf)
    k, t = 0, 0.0
    while k < n and t <= settings.ahead:
        who = _nearest_ones(samples, k, t, scene, settings, obstacle_states)
        contact = contacts(samples, k, t, scene, settings, obstacle_states, who)
        speed, _ = choose(belief[who], contact, settings)
        chosen = top * settings.paces[speed] / settings.paces[2]
        end = samples.s[k] + chosen * settings.step
        later = max(k + 1, int(np.searchsorted(samples.s, end, side="right")))
        v[k:later] = chosen
        t += (float(samples.s[min(later, n - 1)]) - float(samples.s[k])) / chosen
        k = later
    return [Cap("three speeds", v)]


def _seen(samples: SampledPath, obstacle_states: ObstacleStates) -> tuple[Points, Points]:
    """Positions now (metres) and velocities (0 where not known)."""
    velocity = (
        np.zeros((len(obstacle_states), 2)) if obstacle_states.velocity is None else obstacle_states.velocity
    )
    return obstacle_states.xy * samples.resolution + velocity * obstacle_states.age, velocity


def _nearest_ones(
    samples: SampledPath,
    k: int,
    t: float,
    scene: Scene,
    settings: ThreeSpeed,
    obstacle_states: ObstacleStates,
) -> NDArray[np.int64]:
    """The obstacles that matter most at node k: least room after what both can go in the steps ahead."""
    place, velocity = _seen(samples, obstacle_states)
    gap = np.sqrt(np.square(place + velocity * t - samples.xy[k] * samples.resolution).sum(axis=1))
    spare = gap - obstacle_states.radius - obstacle_states.top_speed * (settings.depth * settings.step)
    return np.sort(np.argsort(spare, kind="stable")[: settings.near])


def contacts(
    samples: SampledPath,
    k: int,
    t: float,
    scene: Scene,
    settings: ThreeSpeed,
    obstacle_states: ObstacleStates,
    who: NDArray[np.int64],
) -> FloatGrid:
    """The contacts that :func:`choose` asks for, of a robot at node k in t seconds."""
    fast, depth, parts = settings.paces[2], settings.depth, _PARTS
    unit = scene.robot.v_max * settings.step / fast
    metres = samples.xy * samples.resolution
    begin, velocity = _seen(samples, obstacle_states)
    when: Floats = t + settings.step / parts * np.arange(depth * parts + 1, dtype=np.float64)
    theirs = intended(begin[who], velocity[who], obstacle_states.top_speed[who], metres[k:], when)
    # The robot at every progress that a part of a step may end at; all speeds end on this lattice.
    reach = samples.s[k] + unit / parts * np.arange((depth * fast) * parts + fast * parts + 1)
    own = np.stack([elementary.interp(reach, samples.s, metres[:, c]) for c in (0, 1)], axis=-1)
    places = depth * fast + 1
    enough = scene.robot.radius + settings.margin + obstacle_states.radius[who]
    out = np.zeros((depth, places, 3, len(who), 3))
    index = np.arange(places)[:, None] * parts
    for step in range(depth):
        part = theirs[:, :, step * parts : (step + 1) * parts + 1]
        for a, pace in enumerate(settings.paces):
            here = own[index + pace * np.arange(parts + 1)[None, :]]
            gap = here[:, None, None, :, :] - part[None, :, :, :, :]
            near = _closest(gap[..., :-1, :], gap[..., 1:, :]).min(axis=-1)
            out[step, :, a] = near < enough[None, :, None]
    return out


def _closest(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least distance to the origin on the segments from a to b."""
    d = b - a
    size = (d * d).sum(axis=-1)
    share = np.clip(-(a * d).sum(axis=-1) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
    q = a + d * share[..., None]
    least: NDArray[np.float64] = np.sqrt((q * q).sum(axis=-1))
    return least


@dataclass(slots=True)
class ThreeSpeedControl:
    """What a robot that is on its way believes of each obstacle; one for each drive.

    Parameters
    ----------
    settings : of the law.
    """

    settings: ThreeSpeed
    belief: FloatGrid = field(default_factory=lambda: np.zeros((0, 3)))
    _last: ObstacleStates | None = None

    def update(
        self, obstacle_states: ObstacleStates | None, dt: float, samples: SampledPath, s: float = 0.0
    ) -> None:
        """Take in what was seen ``dt`` seconds after the last time, by a robot at distance s of its sampled path.

        Obstacles are distinguished by their index: if their number changes, all are new.
        """
        count = 0 if obstacle_states is None else len(obstacle_states)
        last = self._last
        if obstacle_states is None or last is None or count != len(last):
            self.belief = np.tile(np.array(self.settings.prior), (count, 1))
        elif count and dt > 0.0:
            metres = samples.xy * samples.resolution
            k = min(int(np.searchsorted(samples.s, s)), len(samples) - 1)
            place, velocity = _seen(samples, last)
            expected = intended(place, velocity, last.top_speed, metres[k:], np.array([dt]))[:, :, 0]
            moved = obstacle_states.xy * samples.resolution - place
            likely = observed(moved, expected - place[:, None, :], self.settings.likelihood)
            self.belief = updated(self.belief, likely, self.settings)
        self._last = obstacle_states

    def cap(self, samples: SampledPath, scene: Scene, around: Around) -> list[Cap]:
        """:func:`three_speed_cap` with what is believed now."""
        known = around.obstacle_states is not None and len(self.belief) == len(around.obstacle_states)
        return three_speed_cap(samples, scene, self.settings, around, self.belief if known else None)
