"""Control: what a controller may look at, and what it answers, period by period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from lampyris.kernels.motion.curve_motion import ceiling_push
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.sim.continuous.leg import Leg
from lampyris.sim.sensor import ObstacleMessage
from lampyris.typing import Cell, Floats


class Decision(NamedTuple):
    """An acceleration for one period.

    Parameters
    ----------
    a : m/s2.
    cause, cause_index : what limits it, and the number of the obstacle or node concerned; -1: none.
    rest : the node at which the robot comes to rest within the period, exactly; -1: none.
    """

    a: float
    cause: str
    cause_index: int = -1
    rest: int = -1


@dataclass(slots=True)
class State:
    """The robot's own view at the beginning of a period.

    Parameters
    ----------
    t : seconds.
    s, v : metres along the leg, m/s: where it is commanded to be.
    at : the last node that is not ahead of s.
    leg : the path.
    robot : its limits.
    message : the last trusted message.
    still : for how long each obstacle has been reported to be where it is, seconds, (m,).
    cells : cells that obstacles cover as far as is known, in order.
    period : seconds until the next decision.
    reaction : seconds until the next decision has an effect: the period and the known delay.
    real : where it really is, and the maximum speed it may have before then because of earlier commands;
        (s, v) itself under perfect tracking.
    late : whether commands are late or followed with a lag.
    haste : how much faster than commanded it may be.
    noise : metres that a reported position may be off.
    tries : new paths since the robot last came a cell farther.
    """

    t: float
    s: float
    v: float
    at: int
    leg: Leg
    robot: Robot
    message: ObstacleMessage
    still: Floats
    cells: list[Cell]
    period: float
    reaction: float
    real: tuple[float, float]
    late: bool = False
    haste: float = 1.0
    noise: float = 0.0
    tries: int = 0

    def obstacle_states(
        self, obstacle_info: str, within: tuple[float, float] | None = None
    ) -> ObstacleStates:
        """What is known of the obstacles, as the caps take it.

        Parameters
        ----------
        within : seconds and metres: those that are not that near to the robot then are left out.
        """
        message = self.message
        kept = np.ones(len(message.xy), dtype=np.bool_)
        if within is not None:
            away = (message.xy - self.leg.route.at(self.s)) * self.leg.samples.resolution
            near = (
                within[0] * (message.top_speed + self.robot.v_max)
                + (within[1] + self.robot.radius)
                + message.radius
            )
            kept = (away * away).sum(axis=1) <= near * near
        velocity = (
            None if obstacle_info == "positions" or message.velocity is None else message.velocity[kept]
        )
        radius, age = message.radius[kept] + self.noise, max(self.t - message.stamp, 0.0)
        return ObstacleStates(message.xy[kept], radius, message.top_speed[kept], velocity, age)

    def ahead(self, metres: float) -> SampledPath:
        """The sampled path from the robot on, so many metres of it; its first node is where the robot is."""
        samples, s = self.leg.samples, self.s
        later = np.flatnonzero((samples.s > s + 1e-6) & (samples.s <= s + metres + 1e-9))
        nodes = np.concatenate(([min(self.at, len(samples) - 1)], later))
        xy, places = samples.xy[nodes], samples.s[nodes] - s
        xy[0], places[0] = self.leg.route.at(s), 0.0
        stop = samples.stop[nodes]
        stop[0] = False
        return SampledPath(
            places, xy, samples.heading[nodes], samples.curvature[nodes], stop, samples.resolution
        )


class Controller(Protocol):
    """One law at work."""

    def decide(self, state: State) -> Decision:
        """The push for the next period."""
        ...


def under_ceiling(state: State) -> Decision:
    """The hardest push under the law's static ceiling, and what binds it."""
    leg, robot = state.leg, state.robot
    push, node, rest = ceiling_push(
        leg.nodes,
        leg.squares,
        len(leg.nodes),
        state.at,
        state.s,
        state.v,
        state.period,
        robot.a_max,
        robot.d_max,
    )
    if node < 0:
        return Decision(push, "acceleration")
    cause, cause_index = leg.profile.cause[node], int(leg.profile.cause_index[node])
    if cause in ("goal", "turn", "start"):
        return Decision(push, "braking", int(node), int(rest))
    return Decision(push, cause, cause_index, int(rest))


def towards(state: State, v: float, cause: str, cause_index: int = -1) -> Decision:
    """The push that comes nearest to speed ``v`` by the end of the period, and never above the ceiling."""
    wish = under_ceiling(state)
    a = (v - state.v) / state.period
    if a >= wish.a:
        return wish
    return Decision(max(a, -state.robot.d_max), cause, cause_index)


def node_at(leg: Leg, s: float) -> int:
    """The last node that is not ahead of ``s``."""
    return max(int(np.searchsorted(leg.nodes, s, side="right")) - 1, 0)
