"""Our controller: as fast as the ceiling allows, and never so that it could not stand before any contact."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from lampyris._core.settings import default_of
from lampyris.kernels.motion.curve_motion import travelled
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.motion.cap_values import Around
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.safety.danger_cloud import cloud_cap
from lampyris.motion.safety.passive_acceleration import Near, Rails, push, rails_of
from lampyris.motion.safety.three_speed import ThreeSpeedControl
from lampyris.sim.continuous.control import Decision, State, towards, under_ceiling
from lampyris.sim.continuous.leg import Leg
from lampyris.sim.continuous.lookahead import Foresight
from lampyris.sim.continuous.timetable import punctual
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.typing import Floats

MARGIN = 1e-6
"""Metres kept from every contact, so that rounding is none."""

PARKED = 2.0
"""Seconds after which an obstacle that has not moved is taken to go on standing."""

_CANDIDATES = 8
"""Pushes that are tried between the wish and full braking where commands are late."""

_LEVELS, _HALVINGS = 9, 7
"""Pushes that are tried where a footprint is driven, and how often the gap below the first safe one is halved."""


def swept_gaps(state: State, s0: float, s1: float) -> Floats:
    """Least distance from each obstacle's rim to the robot's, wherever it is between two distances; (m,).

    On an arc the path is at most ``kappa ds^2 / 8`` from the chord between two nodes. Of a footprint it is a lower bound.
    """
    leg, message = state.leg, state.message
    if isinstance(leg.route, PoseLookup):
        return leg.route.least_gaps(s0, s1, message.xy) - (message.radius + state.noise)
    samples, resolution = leg.samples, leg.samples.resolution
    inside = np.flatnonzero((samples.s > s0) & (samples.s < s1))
    ends = np.array([leg.route.at(s0), leg.route.at(s1)])
    points = np.concatenate((ends[:1], samples.xy[inside], ends[1:])) * resolution
    a, d = points[:-1], np.diff(points, axis=0)
    length = np.maximum((d * d).sum(axis=1), 1e-300)
    q = message.xy[:, None, :] * resolution - a
    along = np.clip((q * d).sum(axis=2) / length, 0.0, 1.0)
    e = q - along[:, :, None] * d
    last = min(int(inside[-1]) + 1 if len(inside) else state.at + 1, len(samples) - 1)
    bend = 0.125 * float(samples.curvature[state.at : last + 1].max(initial=0.0)) * float(length.max())
    nearest: Floats = np.sqrt((e * e).sum(axis=2).min(axis=1))
    return nearest - (message.radius + state.robot.radius + state.noise + bend)


def room_to_stand(state: State, s: float, quick: float, push: float) -> tuple[float, int]:
    """What is left, at worst, when the robot has pushed for its reaction time and braked: metres, and whose.

    The robot is taken to be anywhere on the path it covers, at any time until it stands, and the obstacles to
    come from anywhere at their top speeds. That is more than is needed where the motion is known exactly, and
    just right where commands come late and what the robot does meanwhile is known as a range.
    """
    message, robot = state.message, state.robot
    if not len(message.xy):
        return math.inf, -1
    fast = max(quick + push * state.reaction, 0.0)
    ahead = float(travelled.linked()(quick, push, state.reaction)) + 0.5 * fast * fast / robot.d_max
    seconds = state.reaction + fast / robot.d_max + max(state.t - message.stamp, 0.0)
    near = swept_gaps(state, s, s + ahead)
    apart = np.minimum(berth(state), gaps(state) - 2.0 * MARGIN)
    left = np.minimum(near - message.top_speed * seconds, near - apart)
    worst = int(left.argmin())
    return float(left[worst]) - MARGIN, worst


def late_push(state: State, wish: Decision) -> Decision:
    """The push under late commands: the hardest of a few from which full braking is still safe.

    Until a command given now takes effect, and until the next one does, the robot may be as fast as any
    command on its way says; so braking less than fully is no promise, and pushes below 0 are only made where
    going on at that speed would be safe too.
    """
    s, quick = state.real
    who = -1
    for k in range(_CANDIDATES):
        push = wish.a - (wish.a + state.robot.d_max) * k / _CANDIDATES
        fast = max(quick, state.haste * max(state.v, state.v + push * state.period))
        left, who = room_to_stand(state, s, fast, 0.0)
        if left >= 0.0:
            return wish if k == 0 else Decision(push, "moving obstacle", who)
        if fast == quick:
            break  # nothing slower would make it slower until then
    return Decision(-state.robot.d_max, "moving obstacle", who)


def safe_push(state: State, wish: Decision, rails: Rails, above: Floats) -> Decision:
    """The hardest push up to the wish from which full braking stays safe, under perfect tracking.

    Parameters
    ----------
    rails : the sampled path.
    above : a ceiling over all speeds: the wish has been compared with the real one.
    """
    message, robot = state.message, state.robot
    m = len(message.xy)
    if not m:
        return wish
    age = max(state.t - message.stamp, 0.0)
    places = message.xy * rails.resolution
    reach = message.radius + (robot.radius + state.noise + rails.slack + MARGIN)
    apart = np.minimum(berth(state), gaps(state) - MARGIN - rails.slack)
    near = Near(
        np.concatenate((places[:, 0], places[:, 0])),
        np.concatenate((places[:, 1], places[:, 1])),
        np.concatenate((reach + message.top_speed * age, reach + apart)),
        np.concatenate((message.top_speed, np.zeros(m))),
    )
    made = push(rails, above, state.s, state.v, near, state.period, wish.a, robot.d_max)
    return wish if made.cause_index < 0 else Decision(made.a, made.cause, made.cause_index % m)


def footprint_push(state: State, wish: Decision, route: PoseLookup) -> Decision:
    """As :func:`safe_push` for a robot with a footprint, between the wish and full braking.

    A push is tried at :data:`_LEVELS` places from the wish down, then the gap to the next unsafe one is halved
    :data:`_HALVINGS` times. Every answer but the last resort has been compared with all obstacles. The last resort is to
    brake fully, or to stay: the rest of the motion that was safe a period ago.
    """
    message, robot = state.message, state.robot
    rest = 0.0 if state.v == 0.0 else -robot.d_max
    m = len(message.xy)
    if not m or wish.a <= rest:
        return wish
    age = max(state.t - message.stamp, 0.0)
    reach = message.radius + (state.noise + MARGIN)
    apart = np.minimum(berth(state), gaps(state) - MARGIN)
    near = np.concatenate((message.xy, message.xy))
    far = np.concatenate((reach + message.top_speed * age, reach + apart))
    speed = np.concatenate((message.top_speed, np.zeros(m)))

    def unsafe(push: float) -> int:
        return route.first_unsafe(state.s, state.v, push, state.period, robot.d_max, near, far, speed)

    who = bad = unsafe(wish.a)
    if bad < 0:
        return wish
    low, high = rest, wish.a
    for k in range(1, _LEVELS):
        push = wish.a - (wish.a - rest) * k / _LEVELS
        bad = unsafe(push)
        if bad < 0:
            low = push
            break
        who, high = bad, push
    for _ in range(_HALVINGS):
        push = 0.5 * (low + high)
        bad = unsafe(push)
        if bad < 0:
            low = push
        else:
            who, high = bad, push
    return Decision(low, "moving obstacle", who % m)


def berth(state: State) -> Floats:
    """Metres that the robot leaves to an obstacle as it stands, so that it could set off again; (m,).

    Standing nearer than ``V T`` it could not move at all as long as the obstacle stayed: it may come at V
    for a whole period before the robot can change its mind. Safe, and stuck forever before an obstacle that
    only stands there. So it keeps what a first push and the braking after it take, and a quarter more. One
    that has come nearer by itself is not neared further. With every new path that does not lead anywhere it
    is a fifth less: at the very border a way round that begins a little towards the obstacle is none.

    An obstacle that has stood on the way for two seconds is kept farther off: the robot will have to go
    round it. Not any that is there at the moment: that made drives among ten walkers up to a tenth longer.
    """
    robot, message = state.robot, state.message
    share = 1.25
    for _ in range(min(state.tries, 10)):
        share *= 0.8
    wide: Floats = share * state.reaction * (1.0 + robot.a_max / robot.d_max) * message.top_speed
    parked = state.still >= PARKED
    if not parked.any():
        return wide
    # Far enough to drive round at a fair speed, and to begin with it.
    fair = share * message.top_speed * (state.reaction + 0.6 * robot.v_max / robot.d_max)
    look = 0.5 * state.v * state.v / robot.d_max + robot.v_max * state.reaction
    if not (parked & (gaps(state) < look + fair)).any():
        return wide
    stands = swept_gaps(state, state.real[0], state.real[0] + look + float(fair.max())) <= 0.0
    return np.where(parked & stands, np.maximum(wide, fair), wide)


def gaps(state: State) -> Floats:
    """Distance between the robot's rim and each obstacle's, as they stand; metres, (m,)."""
    if isinstance(state.leg.route, PoseLookup):
        return state.leg.route.gaps(state.real[0], state.message.xy) - (state.message.radius + state.noise)
    away = (state.message.xy - state.leg.route.at(state.real[0])) * state.leg.samples.resolution
    distance: Floats = np.sqrt((away * away).sum(axis=1))
    return distance - (state.message.radius + state.robot.radius + state.noise)


@dataclass
class SafeController:
    """``physical`` and its variants.

    Parameters
    ----------
    scene, law : what is driven and by which settings.
    obstacle_info : what is used of the obstacles: ``positions``, ``velocities`` or ``tracks``.
    foresight : what is wished where more than positions is known.
    """

    scene: Scene
    law: PhysicalLaw
    obstacle_info: str = default_of(DriveSettings, "obstacle_info")
    foresight: Foresight | None = None
    _speeds: ThreeSpeedControl | None = field(default=None, init=False)
    _last: float = field(default=0.0, init=False)
    _chosen: tuple[float, float] = field(default=(-math.inf, math.inf), init=False)
    _leg: Leg | None = field(default=None, init=False)
    _rails: Rails = field(init=False)
    _above: Floats = field(init=False)

    def __post_init__(self) -> None:
        if self.law.three_speed is not None:
            self._speeds = ThreeSpeedControl(self.law.three_speed)

    @property
    def simple(self) -> bool:
        """Whether it looks at nothing but the ceiling and room to stand."""
        return self.law.cloud is None and self._speeds is None and self.foresight is None

    def decide(self, state: State) -> Decision:
        """The least of: the ceiling, what the variant's rule says here and now, room to stand."""
        if state.leg is not self._leg:
            self._leg, self._rails = state.leg, rails_of(state.leg.samples)
            self._above = np.full(len(self._rails.s), 1e30)
        wish = under_ceiling(state)
        for cause, v in self._now(state):
            slower = towards(state, v, cause)
            if slower.a < wish.a:
                wish = slower
        wish = punctual(state, wish)
        if self.foresight is not None:
            wish = self.foresight.wish(state, wish)
        if state.late:
            return late_push(state, wish)
        if isinstance(state.leg.route, PoseLookup):
            return footprint_push(state, wish, state.leg.route)
        return safe_push(state, wish, self._rails, self._above)

    def _now(self, state: State) -> list[tuple[str, float]]:
        """The caps at the present place of rules that look at what moves."""
        law = self.law
        found = []
        if law.cloud is not None and len(state.message.xy):
            near = state.obstacle_states(self.obstacle_info, (2.0 * law.cloud.horizon, law.cloud.near))
            here = state.ahead(0.0)
            caps = cloud_cap(here, self.scene, law.cloud, Around(obstacle_states=near))
            found += [(c.cause, float(c.v[0])) for c in caps]
        if self._speeds is not None:
            found.append(("three speeds", self._choice(state, self._speeds)))
        return found

    def _choice(self, state: State, speeds: ThreeSpeedControl) -> float:
        """The speed chosen; chosen again when the time of one decision is over."""
        until, v = self._chosen
        if state.t < until - 1e-9:
            return v
        settings = speeds.settings
        here = state.ahead(self.scene.robot.v_max * settings.ahead)
        obstacle_states = state.obstacle_states(self.obstacle_info)
        speeds.update(obstacle_states, state.t - self._last, here)
        caps = speeds.cap(here, self.scene, Around(obstacle_states=obstacle_states))
        v = float(caps[0].v[0]) if caps else math.inf
        self._last, self._chosen = state.t, (state.t + settings.step, v)
        return v
