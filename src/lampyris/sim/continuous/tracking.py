"""Tracking: how the robot follows what it is commanded, at once or late, by speed or by place.

* ``perfect``: the push decided is the push driven.
* ``velocity``: at every decision a speed is sent. It arrives ``delay`` seconds later, and the drive follows
  the last that has arrived with a lag of first order, within the robot's own acceleration and braking.
  Nothing corrects the place; it is where the speeds have led.
* ``position``: at every decision a place is sent, that of the next decision. The drive measures where it is
  and goes so as to be there when the next command is due, with the same lag.

Common to both: a command to stand is the brake, at full; but one that ends where the path ends, or where the
robot must stop and turn, is to land there: the drive goes on slowly until it is there. The drive keeps the
robot's own limits (top speed, bends, stops, the end of the path) by itself, at its own short step, as a
robot's base does; the obstacles and the law are the commander's. So what late commands cost is seen in the
room that must be kept, and in the distance between where the robot is commanded to be and where it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

from lampyris.kernels.motion.curve_motion import ceiling_push
from lampyris.model.robot import Robot
from lampyris.model.settings.drive import Tracking
from lampyris.sim.continuous.control import Decision, node_at
from lampyris.sim.continuous.leg import Leg
from lampyris.sim.world.trajectory import Segment, split

STEP = 0.02
"""Seconds of the drive's own control loop."""

CATCH_UP = 1.2
"""How much faster than commanded the drive may be in order to be in place on time."""

LANDING, LANDING_TIME = 0.1, 2.0
"""The drive goes the last bit, to a place where it has been commanded to stand, so that it would be there in
so many seconds, and at no less than this share of v_max.

Without that a slow drive stands short of it; commands for what is left make it stand short again, by a share
of that. With a lag of 1 s and 20 commands a second the last metre took 80 s.
"""


class Train(Protocol):
    """From decisions to motion.

    Attributes
    ----------
    error : maximum distance so far between where the robot was and where it was commanded to be, metres.
    """

    error: float

    def begin(self, leg: Leg) -> None:
        """The robot stands at the beginning of a new path."""
        ...

    def commanded(self, s: float, v: float) -> tuple[float, float]:
        """Where the robot is commanded to be now, and how fast, if it is at ``s`` with speed ``v``."""
        ...

    def quickest(self, s: float, v: float) -> float:
        """The maximum speed that it may have because of commands on their way and of the next to land."""
        ...

    def drive(self, t: float, end: float, s: float, v: float, decision: Decision) -> list[Segment]:
        """What it does with a decision, until the next."""
        ...


@dataclass
class Perfect:
    """The push decided is the push driven."""

    robot: Robot
    error: float = 0.0
    _leg: Leg | None = None

    def begin(self, leg: Leg) -> None:
        """Remember where stops are."""
        self._leg = leg

    def commanded(self, s: float, v: float) -> tuple[float, float]:
        """Where it is."""
        return s, v

    def quickest(self, s: float, v: float) -> float:
        """As fast as it is."""
        return v

    def drive(self, t: float, end: float, s: float, v: float, decision: Decision) -> list[Segment]:
        """One push; cut where it comes to rest."""
        assert self._leg is not None
        stop = float(self._leg.nodes[decision.rest]) if decision.rest >= 0 else None
        return split(t, end, s, v, decision.a, stop)


@dataclass(slots=True)
class _Command:
    """What was sent: when it arrives, a speed, a place and when to be there, the maximum speed for it,
    and whether it is to land there."""

    arrives: float
    v: float
    s: float
    due: float
    most: float
    lands: bool = False


@dataclass
class Late:
    """Commands that arrive late, followed with a lag; see the module.

    Parameters
    ----------
    robot : its limits.
    position : by place; else by speed.
    delay, lag : seconds.
    period : seconds between two commands.
    """

    robot: Robot
    position: bool
    delay: float
    lag: float
    period: float
    error: float = 0.0
    _leg: Leg | None = None
    _rests: list[float] = field(default_factory=list)
    _s: float = 0.0
    _v: float = 0.0
    _sent: list[_Command] = field(default_factory=list)

    def begin(self, leg: Leg) -> None:
        """Nothing is on its way, and the robot stands where it should."""
        self._leg, self._s, self._v = leg, 0.0, 0.0
        self._rests = leg.nodes[leg.limits == 0.0].tolist()
        self._sent.clear()

    def commanded(self, s: float, v: float) -> tuple[float, float]:
        """What has been commanded so far. Where both stand, what is is made what should be."""
        if v == 0.0 and self._v == 0.0 and all(c.v == 0.0 for c in self._sent):
            self._s = s
        return self._s, self._v

    def quickest(self, s: float, v: float) -> float:
        """The greatest of its speed, of commands on their way, and of landing if that may be the next."""
        ahead = next((x for x in self._rests if x > self._s), self._s)
        may_land = ahead - self._s <= self.robot.v_max * self.period
        land = self._landing(s, ahead) if may_land else 0.0
        return min(max([v, land, *(c.most for c in self._sent)]), self.robot.v_max)

    def drive(self, t: float, end: float, s: float, v: float, decision: Decision) -> list[Segment]:
        """Send the command, then follow what has arrived, step by step."""
        assert self._leg is not None
        push = split(t, end, self._s, self._v, decision.a, None)
        later, fast = push[-1].after(end)
        later = min(later, self._leg.route.length)
        brake = decision.a <= -self.robot.d_max or fast == 0.0
        most = 0.0 if brake else (CATCH_UP * max(fast, self._v) if self.position else max(fast, 0.0))
        sent = 0.0 if brake else fast
        lands = self._lands(decision)
        if lands:
            later = self._s if decision.rest < 0 else float(self._leg.nodes[decision.rest])
            fast = 0.0
            sent = self._landing(s, later)
            most = max(most, sent)
        period = end - t
        arrives = t + self.delay
        self._sent.append(_Command(arrives, sent, later, arrives + period, most, lands))
        made: list[Segment] = []
        count = max(math.ceil(period / STEP - 1e-9), 1)
        for k in range(count):
            now, then = t + period * k / count, end if k + 1 == count else t + period * (k + 1) / count
            made += self._step(now, then, s, v)
            s, v = made[-1].after(then)
            self._compare(push, then, s)
        self._s, self._v = later, fast
        return _joined(made)

    def _landing(self, s: float, rest: float) -> float:
        """How fast to go to the place where it is to stand."""
        return min(max(LANDING * self.robot.v_max, (rest - s) / LANDING_TIME), self.robot.v_max)

    def _lands(self, decision: Decision) -> bool:
        """Whether a decision is to stand exactly where the path, or a part of it, ends."""
        assert self._leg is not None
        there = self._s >= self._leg.route.length and decision.cause == "braking"
        return decision.rest >= 0 or there

    def _step(self, now: float, then: float, s: float, v: float) -> list[Segment]:
        leg, robot, h = self._leg, self.robot, then - now
        assert leg is not None
        while len(self._sent) > 1 and self._sent[1].arrives <= now + 1e-9:
            del self._sent[0]
        one = self._sent[0]
        if one.arrives > now + 1e-9 or one.most == 0.0:
            a = -robot.d_max
        else:
            wanted = one.v
            if self.position:
                # A command to land has a speed of its own; others have theirs only from the place.
                least = one.v if one.lands else 0.0
                wanted = min(max((one.s - s) / max(one.due - now, self.lag), least), one.most)
            a = min(max((wanted - v) / max(self.lag, h), -robot.d_max), robot.a_max)
        limit, _, rest = ceiling_push(
            leg.nodes, leg.limits, len(leg.nodes), node_at(leg, s), s, v, h, robot.a_max, robot.d_max
        )
        if limit <= a:
            return split(now, then, s, v, limit, float(leg.nodes[rest]) if rest >= 0 else None)
        return split(now, then, s, v, a, None)

    def _compare(self, push: list[Segment], t: float, s: float) -> None:
        for one in push:
            if t <= one.end or one is push[-1]:
                self.error = max(self.error, abs(one.after(t)[0] - s))
                return


def _joined(segments: list[Segment]) -> list[Segment]:
    """The same with standing reported once."""
    out: list[Segment] = []
    for one in segments:
        if out and one.v == 0.0 and one.a == 0.0 and out[-1].v == 0.0 and out[-1].a == 0.0:
            out[-1].end = one.end
        else:
            out.append(one)
    return out


def train_of(robot: Robot, tracking: Tracking, delay: float, lag: float, period: float) -> Train:
    """What drives a robot."""
    if tracking == "perfect":
        return Perfect(robot)
    return Late(robot, tracking == "position", delay, lag, period)
