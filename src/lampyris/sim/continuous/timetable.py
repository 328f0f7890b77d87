"""Driving by planned times: never ahead of them, and behind them as little as the robot's limits and obstacles allow.

A plan with times starts and stops at once; a robot does not. So it may be late, which the drive tells, but it is never
early: where the plan waits the robot waits. Times are kept by lowering the push that is wished; whatever is wished then
passes the rule that keeps the robot able to stop before any contact.
"""

from __future__ import annotations

import math

import numpy as np

from lampyris.model.drive import AT_PLACE, PlannedTimes
from lampyris.model.path import PosePath
from lampyris.sim.continuous.control import Decision, State
from lampyris.typing import Floats

CAUSE = "planned time"
_EARLY = 1e-7
"""Metres ahead of the planned times that are rounding."""
_HALVINGS = 12


def timetable_of(path: PosePath, arm: float, begin: float, offset: float) -> PlannedTimes:
    """The times of a path of poses along its curve.

    Parameters
    ----------
    arm : metres that a radian turned in place counts as.
    begin : seconds from the start of the drive at which the times of the path begin.
    offset : metres of the curve before the path.
    """
    assert path.times is not None
    s = offset + np.concatenate(([0.0], np.cumsum(path.steps_in(arm))))
    return PlannedTimes(s, begin + path.times[:, 0], begin + path.times[:, 1])


def punctual(state: State, wish: Decision) -> Decision:
    """The hardest push up to the wish after which the robot, braking fully, is never ahead of its planned times."""
    table, robot = state.leg.timetable, state.robot
    if table is None:
        return wish
    end = state.t + state.period
    near = AT_PLACE * state.leg.samples.resolution
    room = float(table.farthest(np.array([end]))[0]) - state.s
    if state.v == 0.0 and wish.a > 0.0 and room < near and state.s < float(table.s[-1]) - near:
        return Decision(0.0, CAUSE)
    if not early(table, state, wish.a):
        return wish
    if state.v < 0.01 * robot.v_max and room < near:
        return Decision(-robot.d_max, CAUSE)
    low, high = -robot.d_max, wish.a
    for _ in range(_HALVINGS):
        push = 0.5 * (low + high)
        low, high = (low, push) if early(table, state, push) else (push, high)
    return Decision(low, CAUSE)


def early(table: PlannedTimes, state: State, push: float) -> bool:
    """Whether a push for one period and full braking after it lead ahead of the planned times at any time."""
    v, period, brake = state.v, state.period, state.robot.d_max
    rest = v / -push if push < 0.0 and v + push * period < 0.0 else period
    fast = max(v + push * rest, 0.0)
    stop = rest + fast / brake
    if stop <= 0.0:
        return False
    times = np.column_stack((table.reach, table.leave)).ravel() - state.t
    places = np.repeat(table.s, 2)
    first = max(int(np.searchsorted(times, 0.0, side="right")) - 1, 0)
    last = int(np.searchsorted(times, stop, side="left")) + 1
    times, places = times[first:last], places[first:last]
    # It is farthest ahead of a stretch of one planned speed at its ends, or when it has that speed.
    lasts = np.diff(times)
    speed = np.where(lasts > 0.0, np.diff(places) / np.where(lasts > 0.0, lasts, 1.0), math.inf)
    at = [times, np.array([rest, stop]), rest + (fast - speed) / brake]
    if push < 0.0:
        at.append((v - speed) / -push)
    tau = np.concatenate(at)
    tau = tau[np.isfinite(tau)]
    tau = np.clip(tau, 0.0, stop)
    driven = np.minimum(tau, rest)
    braked = np.maximum(tau - rest, 0.0)
    ahead: Floats = state.s + driven * (v + 0.5 * push * driven) + braked * (fast - 0.5 * brake * braked)
    return bool((ahead > table.farthest(state.t + tau) + _EARLY).any())
