"""Settings of a swarm of robots that looks for sources."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from lampyris._core.defaults import BETA, GAMMA, LUCIFERIN, NEIGHBOURS, RHO
from lampyris._core.settings import check_settings, flag, number, under_code, whole, word
from lampyris.errors import SettingError, UnknownSettingError, did_you_mean, shown

if TYPE_CHECKING:
    from lampyris.model.grid import Grid

METHODS = ("gso", "gradient")
"""How robots decide where to drive."""

MAX_SMALL_STEPS = 10_000
"""Small steps of an iteration, at most."""
_SMALL_STEPS = 4
"""Small steps in which a robot drives the step of an iteration, at least."""


@dataclass(frozen=True, slots=True)
class SwarmSettings:
    """How the robots of a swarm decide and drive; see docs/swarm_robots.md for the equations.

    Parameters
    ----------
    method : ``gso``, glowworm swarm optimisation; ``gradient``, each robot climbs the signal by its own four sensors.
    iterations : how often all robots measure, broadcast, choose and drive.
    radius : of a robot, a disc.
    v_max : speed of a robot that drives.
    yaw_rate_max : rate at which a robot turns in place.
    step : distance that a robot drives in an iteration, s.
    sensor_range : distance at which robots hear each other at the most, r_s, and the decision range at first.
    line_of_sight : whether walls block what robots broadcast.
    noise : standard deviation of a measurement, as a share of the strongest source.
    rho, gamma : decay and renewal of luciferin.
    beta : how fast the decision range adapts, metres for each neighbour missing or too many.
    nt : desired number of neighbours.
    luciferin : at first.
    capture_radius : robots nearer to a source than this count for it.
    capture_robots : a source is held if at least so many robots are within the capture radius.
    small_step : distance of a small step of the motion at the most.

    Raises
    ------
    SettingError : ``SWARM_SETTING``.
    """

    method: str = word(METHODS[0], METHODS)
    iterations: int = whole(500, 1, 1_000_000)
    radius: float | None = number(None, 1e-6, 1e6, unit="m", none="a quarter of a cell")
    v_max: float = number(0.5, 1e-6, 1e6, unit="m/s")
    yaw_rate_max: float = number(3.0, 1e-3, 1e6, unit="rad/s")
    step: float | None = number(
        None, 1e-6, 1e6, unit="m", none="0.005 of the map's shorter side, and a radius at least"
    )
    sensor_range: float | None = number(None, 1e-6, 1e9, unit="m", none="half of the map's shorter side")
    line_of_sight: bool = flag(True)
    noise: float = number(0.0, 0.0, 1e6)
    rho: float = number(RHO, 0.0, 1.0)
    gamma: float = number(GAMMA, 1e-6, 1e6)
    beta: float | None = number(None, 0.0, 1e9, unit="m", none="0.08 / 3 of the sensor range")
    nt: int = whole(NEIGHBOURS, 0, 100_000)
    luciferin: float = number(LUCIFERIN, -1e9, 1e9)
    capture_radius: float | None = number(None, 1e-6, 1e9, unit="m", none="six radii and a step")
    capture_robots: int = whole(3, 1, 100_000)
    small_step: float | None = number(
        None, 1e-9, 1e6, unit="m", none="a quarter of the step, and half a radius at most"
    )

    def __post_init__(self) -> None:
        check_settings(self, under_code("SWARM_SETTING"))

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> SwarmSettings:
        """Settings by name.

        Raises
        ------
        SettingError : ``SWARM_SETTING``: one that a swarm does not have, or out of its range.
        """
        names = [f.name for f in fields(cls)]
        for name in given:
            if name not in names:
                raise UnknownSettingError(
                    "SWARM_SETTING", f"a swarm has no setting {shown(name)}", allowed=", ".join(names),
                    todo=did_you_mean(name, names), setting=str(name),
                )  # fmt: skip
        return cls(**given)

    def on(self, grid: Grid) -> SwarmSettings:
        """The same with the defaults of lengths resolved, which follow from the map.

        Raises
        ------
        SettingError : ``SWARM_SETTING``: an iteration would have more than MAX_SMALL_STEPS small steps.
        """
        side = min(grid.width, grid.height) * grid.resolution
        radius = grid.resolution / 4 if self.radius is None else self.radius
        step = max(0.005 * side, radius) if self.step is None else self.step
        reach = side / 2 if self.sensor_range is None else self.sensor_range
        made = {f.name: getattr(self, f.name) for f in fields(self)}
        made |= {"radius": radius, "step": step, "sensor_range": reach}
        for name, value in (
            ("beta", BETA / 3 * reach),
            ("capture_radius", 6 * radius + step),
            ("small_step", min(step / _SMALL_STEPS, radius / 2)),
        ):
            if made[name] is None:
                made[name] = value
        filled = type(self)(**made)
        if filled.steps > MAX_SMALL_STEPS:
            raise SettingError.of(
                "SWARM_SETTING", "small_step", f"{filled.small_step:g} m",
                allowed=f"at most {MAX_SMALL_STEPS:,} small steps an iteration; here it is {filled.steps:,}",
                todo="a longer small_step, a shorter step, a lower v_max or a higher yaw_rate_max",
            )  # fmt: skip
        return filled

    @property
    def steps(self) -> int:
        """Small steps of an iteration, of resolved settings: ample to turn round and drive the step."""
        assert self.small_step is not None
        assert self.step is not None
        turn = math.pi / self.yaw_rate_max * self.v_max
        return math.ceil((turn + self.step) / self.small_step * (1 - 1e-12)) + 1

    @property
    def period(self) -> float:
        """Seconds of an iteration, of resolved settings."""
        assert self.small_step is not None
        return self.steps * (self.small_step / self.v_max)
