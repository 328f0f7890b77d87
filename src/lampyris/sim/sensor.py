"""The sensor: what the robot knows of the obstacles, faults put into it, and the monitor that judges it.

The robot has nothing but messages: a time stamp, and where each obstacle was then. In every period it
expects at least one that is newer than the last it trusted. A message is *not* trusted if

* its stamp is no number, lies in the future, or is not newer than the last trusted one;
* it is older than ``max_age``: a younger one is used, and its age counts as time in which the obstacles may
  have moved on;
* a position, radius, speed or velocity in it is no number, negative where it cannot be, or beyond 1e9; its
  lists are not equally long; or obstacles are missing that were there before;
* an obstacle is farther from where it was last trusted to be than its stated top speed allows. Either the
  place is wrong or the speed is, and every promise rests on both. So after a jump the data are trusted
  again only once the new place *could* have been reached: a robot that believed the second message of a
  jump would believe everything a period later;
* an obstacle is said to overlap the robot while the robot moves: then one of the two is not where it is said
  to be. (A standing robot may be run into; that is no fault of the data.)

Without a trusted message the robot brakes with d_max at once, which takes v / d seconds at most; it has
always kept the room for that. If trusted messages come back within ``data_timeout`` seconds it continues, otherwise it
ends with the outcome ``stopped`` and the reason.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol, get_args

import numpy as np

from lampyris._core.defaults import MAX_AGE
from lampyris._core.scalars import is_word
from lampyris.errors import SettingError, did_you_mean, shown
from lampyris.typing import Cell, Floats, Points


@dataclass(frozen=True, slots=True, eq=False)
class ObstacleMessage:
    """One message.

    Parameters
    ----------
    stamp : when this was so, seconds.
    xy : (m, 2), cells; the same obstacle keeps its place in the list.
    radius, top_speed : (m,), metres and m/s.
    velocity : (m, 2), m/s, or None.
    blocked : cells of the map that are newly known to be blocked.
    """

    stamp: float
    xy: Points
    radius: Floats
    top_speed: Floats
    velocity: Points | None = None
    blocked: tuple[Cell, ...] = ()


class ObstacleSensor(Protocol):
    """What reports obstacles to the robot."""

    def tell(self, now: float, truth: ObstacleMessage, robot: tuple[float, float]) -> list[ObstacleMessage]:
        """The messages that arrive now, the newest last.

        Parameters
        ----------
        now : seconds.
        truth : what a perfect sensor would report.
        robot : where the robot is, cells.
        """
        ...


@dataclass(frozen=True)
class PerfectSensor:
    """Everything, at once."""

    def tell(self, now: float, truth: ObstacleMessage, robot: tuple[float, float]) -> list[ObstacleMessage]:
        """The truth."""
        return [truth]


FaultKind = Literal[
    "stops", "jumps", "duplicates", "back-in-time", "nan", "in-robot", "goal-gone", "late", "missing"
]

_MOST = 1e9
"""Cells, metres, m/s: nothing real is beyond, and its square is still far from overflowing."""

FAULTS: tuple[str, ...] = get_args(FaultKind)
"""Every fault that a :class:`FaultySensor` can put in."""


@dataclass
class FaultySensor:
    """A perfect sensor with one injected fault.

    Parameters
    ----------
    kind : ``stops``: no message any more; ``jumps``: an obstacle is said to be elsewhere; ``duplicates``: the
        last message again and again; ``back-in-time``: stamps run backwards; ``nan``: a coordinate is no
        number; ``in-robot``: an obstacle is said to be where the robot is; ``goal-gone``: an update of the
        map blocks the goal; ``late``: messages take ``by`` seconds; ``missing``: obstacles are left out.
    at : when it begins, seconds.
    lasts : how long, seconds.
    obstacle : the obstacle it is about.
    by : how far it jumps (metres), or how late messages are (seconds); None: 5 of either.
    goal : for ``goal-gone``.

    Raises
    ------
    SettingError : ``FAULT``.
    """

    kind: str
    at: float
    lasts: float = math.inf
    obstacle: int = 0
    by: float | None = None
    goal: Cell | None = None
    _kept: list[ObstacleMessage] = field(default_factory=list, repr=False)

    def __post_init__(self) -> None:
        if not is_word(self.kind, FAULTS):
            raise SettingError(
                "FAULT",
                f"{shown(self.kind)}",
                where="kind",
                allowed=", ".join(FAULTS),
                todo=did_you_mean(self.kind, FAULTS),
            )
        if self.kind == "goal-gone" and self.goal is None:
            raise SettingError("FAULT", "no cell", where="goal", allowed="the cell that is blocked")

    def fresh(self) -> FaultySensor:
        """The same fault without the messages of an earlier drive; every drive takes one of its own."""
        return replace(self, _kept=[])

    def tell(self, now: float, truth: ObstacleMessage, robot: tuple[float, float]) -> list[ObstacleMessage]:
        """The truth, or what the fault makes of it."""
        faulty = self.at <= now < self.at + self.lasts
        if self.kind == "late":
            self._kept.append(truth)
            late = (5.0 if self.by is None else self.by) if faulty else 0.0
            come = [m for m in self._kept if m.stamp + late <= now + 1e-9]
            self._kept = self._kept[len(come) :]
            return come
        if not faulty:
            self._kept = [truth]
            return [truth]
        return self._spoilt(truth, robot)

    def _spoilt(self, truth: ObstacleMessage, robot: tuple[float, float]) -> list[ObstacleMessage]:
        kind, obstacle = self.kind, self.obstacle
        if kind == "stops":
            return []
        if kind == "duplicates":
            return list(self._kept[-1:])
        if kind == "back-in-time":
            return [replace(truth, stamp=2.0 * self.at - truth.stamp)]
        if kind == "goal-gone":
            assert self.goal is not None
            return [replace(truth, blocked=(self.goal,))]
        if kind == "missing":
            return [_only(truth, obstacle)]
        if kind == "in-robot" and not len(truth.xy):
            return [_one_more(truth, robot)]
        if obstacle >= len(truth.xy):
            return [truth]
        xy = truth.xy.copy()
        if kind == "nan":
            xy[obstacle, 0] = np.nan
        elif kind == "in-robot":
            xy[obstacle] = robot
        else:  # jumps, and stays there
            xy[obstacle, 0] += 5.0 if self.by is None else self.by
        return [replace(truth, xy=xy)]


def _only(truth: ObstacleMessage, obstacle: int) -> ObstacleMessage:
    kept = np.arange(len(truth.xy)) != obstacle
    velocity = None if truth.velocity is None else truth.velocity[kept]
    return replace(
        truth,
        xy=truth.xy[kept],
        radius=truth.radius[kept],
        top_speed=truth.top_speed[kept],
        velocity=velocity,
    )


def _one_more(truth: ObstacleMessage, robot: tuple[float, float]) -> ObstacleMessage:
    return ObstacleMessage(
        truth.stamp, np.array([robot]), np.array([0.5]), np.array([1.0]), np.zeros((1, 2)), truth.blocked
    )


def _nonsense(m: ObstacleMessage) -> str:
    """What in a message cannot be, whatever the world is like; an empty string if nothing."""
    n = len(m.xy)
    columns = [m.xy, m.radius[:, None], m.top_speed[:, None]]
    columns += [] if m.velocity is None else [m.velocity]
    if any(len(column) != n for column in columns):
        return f"a message has {n} places and another number of sizes, speeds or velocities"
    table = np.concatenate(columns, axis=1)
    bad = ~(np.abs(table) <= _MOST).all(axis=1)
    if bad.any():
        what = f"has a place, size or speed that is no number, or beyond {_MOST:g}"
        return f"obstacle {int(np.argmax(bad))} {what}"
    bad = (table[:, 2:4] < 0.0).any(axis=1)
    return f"obstacle {int(np.argmax(bad))} has a size or speed below 0" if bad.any() else ""


@dataclass
class SensorMonitor:
    """The robot's own monitor of the data it receives.

    Parameters
    ----------
    resolution : metres a cell.
    radius : of the robot, metres.
    max_age : seconds; older data are not trusted.
    noise : metres that a reported position may be off.

    Attributes
    ----------
    last : the last message that was trusted.
    blocked : cells that messages said are blocked, in order.
    since : since when each obstacle has been where it is, seconds, (m,).
    """

    resolution: float
    radius: float
    max_age: float = MAX_AGE
    noise: float = 0.0
    last: ObstacleMessage | None = None
    blocked: list[Cell] = field(default_factory=list)
    since: Floats = field(default_factory=lambda: np.zeros(0))

    def hear(
        self, now: float, messages: list[ObstacleMessage], robot: tuple[float, float], moving: bool
    ) -> str:
        """Take in the messages of this period; what is wrong with them, or an empty string.

        The newest decides; an older one is asked only if the newest is not trusted.
        """
        why = "no message has arrived"
        for message in reversed(messages):
            why = self._judge(now, message, robot, moving)
            if not why:
                self._note(message)
                self.last = message
                self.blocked += [c for c in message.blocked if c not in self.blocked]
                break
        return why

    def _note(self, m: ObstacleMessage) -> None:
        """Remember since when each obstacle has been where it is."""
        n = 0 if self.last is None else len(self.last.xy)
        since = np.full(len(m.xy), m.stamp)
        if self.last is not None and n:
            away = (m.xy[:n] - self.last.xy) * self.resolution
            limit = 2.0 * self.noise + 1e-9
            stays = (away * away).sum(axis=1) <= limit * limit
            since[:n] = np.where(stays, self.since[:n], m.stamp)
        self.since = since

    def _judge(self, now: float, m: ObstacleMessage, robot: tuple[float, float], moving: bool) -> str:
        if not math.isfinite(m.stamp):
            return "a message's time stamp is no number"
        if m.stamp > now + 1e-9:
            return f"a message is stamped {m.stamp - now:.3g} s in the future"
        last = self.last
        if last is not None and m.stamp <= last.stamp:
            how = "again" if m.stamp == last.stamp else f"after {last.stamp:.3g} s"
            return f"a message is not newer than the last: it is stamped {m.stamp:.3g} s {how}"
        if now - m.stamp > self.max_age + 1e-9:
            return f"the newest data are {now - m.stamp:.3g} s old; at most {self.max_age:g} s are trusted"
        return _nonsense(m) or self._jump(m) or (self._inside(m, robot) if moving else "")

    def _jump(self, m: ObstacleMessage) -> str:
        last = self.last
        if last is None:
            return ""
        n = len(last.xy)
        if len(m.xy) < n:
            return f"{n - len(m.xy)} of {n} obstacles are missing"
        if not n:
            return ""
        went = (m.xy[:n] - last.xy) * self.resolution
        squared = went[:, 0] * went[:, 0] + went[:, 1] * went[:, 1]
        may = m.top_speed[:n] * ((m.stamp - last.stamp) * (1.0 + 1e-9)) + (2.0 * self.noise + 1e-9)
        over = squared > may * may
        if not over.any():
            return ""
        obstacle = int(np.argmax(over))
        return (
            f"obstacle {obstacle} jumps {math.sqrt(float(squared[obstacle])):.3g} m in {m.stamp - last.stamp:.3g} s, "
            f"with a stated top speed of {float(m.top_speed[obstacle]):.3g} m/s"
        )

    def _inside(self, m: ObstacleMessage, robot: tuple[float, float]) -> str:
        if not len(m.xy):
            return ""
        dx, dy = (m.xy[:, 0] - robot[0]) * self.resolution, (m.xy[:, 1] - robot[1]) * self.resolution
        reach = m.radius + (self.radius - self.noise - 1e-6)
        inside = dx * dx + dy * dy < reach * reach
        if not inside.any():
            return ""
        return f"obstacle {int(np.argmax(inside))} is reported within the robot's own disc"
