"""The braking rule as a filter: what a controller wants is driven only if the robot could still stand before any contact.

A period's motion is an arc with one acceleration. It is *safe* if the robot, braking fully after the period **on the same
arc**, stands before its outline touches a wall, and at every time until then is farther from each obstacle than that can
have moved at its top speed in any direction. This is the rule of the law ``physical`` on an arc in place of the path, and
the same induction holds: the rest of a motion that was safe a period ago is safe now, so that braking on the last arc is
always possible. What is driven is the hardest safe acceleration on the arc that was asked for, else on arcs between that
and the last one, else full braking on the last one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lampyris.kernels.motion.curve_motion import travelled
from lampyris.sim.continuous.safe_controller import MARGIN
from lampyris.sim.steering.arc import Arc
from lampyris.sim.steering.control import Steer, View, towards
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.typing import Floats

_LEVELS, _HALVINGS = 6, 5
"""Accelerations that are tried between the wish and full braking, and how often the gap below the first safe one is halved."""

_BETWEEN = (0.5, 0.0)
"""Arcs that are tried if the one that was asked for is not safe: this share from the last one to it."""


class FilteredPush(NamedTuple):
    """What is driven for one period.

    Parameters
    ----------
    arc : where to.
    a : acceleration, m/s2.
    cause, cause_index : what limits it.
    """

    arc: Arc
    a: float
    cause: str
    cause_index: int = -1


class _Near(NamedTuple):
    """Obstacles as they are to be kept from: places (cells), metres, and m/s by which these grow; twice each."""

    xy: Floats
    reach: Floats
    speed: Floats
    obstacles: int


def wished(view: View, steer: Steer) -> FilteredPush:
    """The acceleration that a command asks for, within the robot's limits on that arc."""
    return _limited(
        view, FilteredPush(steer.arc, towards(view.v, steer.v, view), steer.cause, steer.cause_index)
    )


def _limited(view: View, push: FilteredPush) -> FilteredPush:
    """No faster at the end of the period than the arc allows."""
    most = view.shape.most_speed(push.arc)
    if view.v + push.a * view.period <= most:
        return push
    a = max((most - view.v) / view.period, -view.shape.robot.d_max)
    return push._replace(a=a, cause="curvature", cause_index=-1)


def filtered(view: View, steer: Steer) -> FilteredPush:
    """What of a command is safe; see the module."""
    near = _near(view)
    wish = wished(view, steer)
    made, blamed = _hardest(view, wish, near)
    if made is not None and (made.a > -view.shape.robot.d_max or view.v == 0.0):
        return made
    if view.v == 0.0 or view.arc is None:
        # It stands, and stays.
        return blamed._replace(arc=steer.arc, a=0.0)
    best = made
    for share in _BETWEEN if not (view.arc.in_place or steer.arc.in_place) else ():
        arc = _between(view.arc, steer.arc, share)
        found, _ = _hardest(view, _limited(view, wish._replace(arc=arc)), near)
        if found is not None and (best is None or found.a > best.a):
            best = found._replace(cause=blamed.cause, cause_index=blamed.cause_index)
    if best is not None:
        return best
    return FilteredPush(view.arc, -view.shape.robot.d_max, blamed.cause, blamed.cause_index)


def _between(last: Arc, wanted: Arc, share: float) -> Arc:
    """An arc from where the last one leads, bent between both."""
    bend, turn = (
        (1.0 - share) * a + share * b for a, b in ((last.bend, wanted.bend), (last.turn, wanted.turn))
    )
    return Arc(last.direction, bend, turn)


def _near(view: View) -> _Near:
    """How far to keep from each obstacle: what it can reach, and room to set off again."""
    message, robot = view.message, view.shape.robot
    age = max(view.t - message.stamp, 0.0)
    reach = message.radius + (view.noise + MARGIN)
    # A robot nearer than that to an obstacle that stands could not move at all as long as it stays; see ``berth``.
    share = 1.25
    for _ in range(min(view.tries, 10)):
        share *= 0.8
    wide = share * view.period * (1.0 + robot.a_max / robot.d_max) * message.top_speed
    here = view.shape.route(view.pose, Arc(view.pose.yaw, 0.0, 0.0), 1e-3)
    apart = np.minimum(wide, here.gaps(0.0, message.xy) - (message.radius + view.noise + MARGIN))
    m = len(message.xy)
    return _Near(
        np.concatenate((message.xy, message.xy)),
        np.concatenate((reach + message.top_speed * age, reach + apart)),
        np.concatenate((message.top_speed, np.zeros(m))),
        m,
    )


def _hardest(view: View, wish: FilteredPush, near: _Near) -> tuple[FilteredPush | None, FilteredPush]:
    """The hardest safe acceleration on an arc up to the wish, None if even braking is not; and what limits it."""
    robot = view.shape.robot
    rest = 0.0 if view.v == 0.0 else -robot.d_max
    if wish.a <= 0.0 and view.v == 0.0:
        return wish._replace(a=0.0), wish
    far = _stops_after(view, wish.a)
    free = view.walls.free(view.pose, wish.arc, far)
    route = view.shape.route(view.pose, wish.arc, far + 1e-9)
    blamed = wish

    def safe(a: float) -> bool:
        nonlocal blamed
        if _stops_after(view, a) > free:
            blamed = wish._replace(cause="clearance", cause_index=-1)
            return False
        who = _first_unsafe(view, route, a, near)
        if who >= 0:
            blamed = wish._replace(cause="moving obstacle", cause_index=who % near.obstacles)
        return who < 0

    if safe(wish.a):
        return wish, wish
    low, high = None, wish.a
    for k in range(1, _LEVELS + 1):
        a = wish.a - (wish.a - rest) * k / _LEVELS
        if (a <= 0.0 and view.v == 0.0) or safe(a):
            low = a
            break
        high = a
    if low is None:
        return None, blamed
    for _ in range(_HALVINGS):
        a = 0.5 * (low + high)
        if safe(a):
            low = a
        else:
            high = a
    return blamed._replace(a=low), blamed


def _stops_after(view: View, a: float) -> float:
    """Metres until the robot stands if it accelerates for the period and then brakes fully."""
    v1 = max(view.v + a * view.period, 0.0)
    return float(travelled.linked()(view.v, a, view.period)) + 0.5 * v1 * v1 / view.shape.robot.d_max


def _first_unsafe(view: View, route: PoseLookup, a: float, near: _Near) -> int:
    if not near.obstacles:
        return -1
    return route.first_unsafe(
        0.0, view.v, a, view.period, view.shape.robot.d_max, near.xy, near.reach, near.speed
    )
