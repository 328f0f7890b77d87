"""Foresight: what the robot would like to do, if the obstacles go on as they are known to.

The wish comes from the fastest path in time through the tracks that are known
(:func:`lampyris.motion.timing.path_time.through_tracks`): slow down, wait, or pass first. It is only a wish.
Whatever is wished, the push stays passively safe, so a wrong prediction costs time and nothing else.

It looks as far along the path as the robot can come within the horizon, and as if the path ended there; being
made again twice a second, it never gets near that end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lampyris._core import elementary
from lampyris.errors import LampyrisError
from lampyris.model.obstacles import Track
from lampyris.model.profile import Profile
from lampyris.motion.timing.path_time import through_tracks
from lampyris.sim.continuous.control import Decision, State
from lampyris.sim.traffic.motion_sources import Roster
from lampyris.typing import Floats

_MET = ("wait", "moving obstacle")


@dataclass
class Foresight:
    """A wish by known or predicted tracks.

    Parameters
    ----------
    roster : whose recorded tracks are known; None: nobody's are, velocities only.
    horizon : seconds of driving that are looked at.
    refresh : seconds after which the wish is computed again, as the obstacles move.
    """

    roster: Roster | None
    horizon: float = 5.0
    refresh: float = 0.5
    _profile: Profile | None = field(default=None, init=False)
    _who: list[int] = field(default_factory=list, init=False)
    _made: float = field(default=-math.inf, init=False)
    _from: tuple[object, float] = field(default=(None, 0.0), init=False)

    def wish(self, state: State, free: Decision) -> Decision:
        """What the tracks leave of the push that is wished without them."""
        if not len(state.message.xy):
            return free
        old = state.leg is not self._from[0] or state.t - self._made >= self.refresh - 1e-9
        if old or self._strayed(state):
            self._profile = self._plan(state)
            self._made, self._from = state.t, (state.leg, state.s)
        if self._profile is None:
            return free
        _, v, node = self._at(state.t + state.period - self._made)
        a = (v - state.v) / state.period
        if a >= free.a:
            return free
        cause, cause_index = self._profile.cause[node], int(self._profile.cause_index[node])
        if cause not in _MET:
            cause, cause_index = "moving obstacle", self._first()
        return Decision(max(a, -state.robot.d_max), cause, cause_index)

    def _strayed(self, state: State) -> bool:
        if self._profile is None:
            return False
        s, _, _ = self._at(state.t - self._made)
        return abs(s - (state.s - self._from[1])) > 0.1 * state.leg.samples.resolution

    def _at(self, t: float) -> tuple[float, float, int]:
        """Distance, speed and next node of the wish after ``t`` seconds."""
        made = self._profile
        assert made is not None
        k = min(max(int(np.searchsorted(made.t, t, side="right")) - 1, 0), len(made.t) - 1)
        d = t - float(made.t[k])
        v, a = float(made.v[k]), float(made.a[k])
        return float(made.s[k]) + d * (v + 0.5 * a * d), max(v + a * d, 0.0), min(k + 1, len(made.t) - 1)

    def _first(self) -> int:
        """The obstacle that limits the wish first."""
        made = self._profile
        assert made is not None
        found = [
            int(n)
            for c, n in zip(made.cause, made.cause_index, strict=True)
            if c in ("wait", "moving obstacle")
        ]
        return found[0] if found else -1

    def _plan(self, state: State) -> Profile | None:
        leg, robot = state.leg, state.robot
        reach = robot.v_max * self.horizon + 0.5 * robot.v_max * robot.v_max / robot.d_max
        tracks = self._tracks(state, reach)
        samples = state.ahead(reach)
        if not tracks or len(samples) < 3:
            return None
        squares = elementary.interp(state.s + samples.s, leg.nodes, leg.squares)
        squares[0] = max(float(squares[0]), state.v * state.v)
        # It stands at the end of what it looks at and where it turns, whatever the cap there. One of 0 at
        # both would forbid the edge between them.
        halts = np.append(np.flatnonzero(samples.stop), len(samples) - 1)
        beside = np.pad(squares, 1)
        squares[halts] = np.maximum(squares, np.maximum(beside[2:], beside[:-2]))[halts]
        cap: Floats = np.sqrt(squares)
        try:
            made = through_tracks(samples, cap, robot, tracks, margin=state.noise, v0=state.v)
        except LampyrisError:
            return None  # no path through is known: as fast as is safe, then
        cause_index = np.array(
            [self._who[n] if c in _MET else n for c, n in zip(made.cause, made.cause_index, strict=True)]
        )
        return replace(made, cause_index=cause_index)

    def _tracks(self, state: State, reach: float) -> Sequence[Track]:
        """Where those will be who can come near to so much of the path, from now on at time 0."""
        message, res = state.message, state.leg.samples.resolution
        age = max(state.t - message.stamp, 0.0)
        made: list[Track] = []
        away = (message.xy - state.leg.route.at(state.s)) * res
        near = reach + message.radius + state.robot.radius + message.top_speed * (self.horizon + age)
        self._who = np.flatnonzero((away * away).sum(axis=1) < near * near).tolist()
        for k in self._who:
            whole = None if self.roster is None else self.roster.whole.get(k)
            radius, top = float(message.radius[k]), float(message.top_speed[k])
            if whole is not None:
                ahead = whole.t > state.t
                t = np.concatenate(([0.0], whole.t[ahead] - state.t))
                xy = np.concatenate((whole.at(np.array([state.t])), whole.xy[ahead]))
                made.append(Track(t, xy, radius, top))
                continue
            step = (message.velocity[k] if message.velocity is not None else np.zeros(2)) / res
            # Twice the horizon: the robot is at the end of what it looks at long before.
            now, then = message.xy[k] + step * age, message.xy[k] + step * (age + 2.0 * self.horizon)
            made.append(Track(np.array([0.0, 2.0 * self.horizon]), np.array([now, then]), radius, top))
        return made
