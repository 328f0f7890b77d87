"""The push of a period, asked for as the drive asks for it, of obstacles as they are told."""

from __future__ import annotations

import numpy as np

from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.motion.safety import passive_acceleration
from lampyris.motion.safety.passive_acceleration import Near, Push, Rails
from lampyris.typing import Floats


def push(
    rails: Rails,
    ceiling: Floats,
    s: float,
    v: float,
    movers: ObstacleStates | None,
    robot: Robot,
    period: float,
    margin: float = 0.0,
) -> Push:
    """The greatest safe push among discs that may have gone anywhere since they were seen."""
    if movers is None:
        near = Near(*np.zeros((4, 0)))
    else:
        xy, speed = movers.xy * rails.resolution, movers.top_speed + 0.0
        reach = movers.radius + (robot.radius + margin + rails.slack) + speed * movers.age
        near = Near(xy[:, 0].copy(), xy[:, 1].copy(), reach, speed)
    return passive_acceleration.push(rails, ceiling, s, v, near, period, robot.a_max, robot.d_max)
