"""Settings of the controllers that steer: pure pursuit, regulated pure pursuit, DWA and MPPI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any, ClassVar

from lampyris._core.settings import check_settings, flag, number, settings_of, under_code, whole
from lampyris.errors import SettingError, UnknownSettingError, did_you_mean, shown

EXACT = "exact"
"""The controller that follows the planned path exactly, at the speed of the speed law."""
BRAKING = "braking"
"""The safety filter that passes a command only if the robot can still stop before any contact."""

_REFUSE = "CONTROLLER_SETTING"


@dataclass(frozen=True, slots=True, kw_only=True)
class Steering:
    """What every controller that steers has.

    Parameters
    ----------
    goal_tolerance : distance from the end of the path within which a robot at rest has arrived.
    goal_yaw_tolerance : difference from the yaw at the end of the path within which a robot at rest has arrived.
    rotate_angle : angle between the robot's heading and the path above which a robot that can turn in place stops and turns.

    Raises
    ------
    SettingError : ``CONTROLLER_SETTING``.
    """

    name: ClassVar[str] = ""
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""

    goal_tolerance: float = number(0.25, 1e-3, 1e6, unit="m")
    goal_yaw_tolerance: float = number(0.25, 1e-3, 4.0, unit="rad")
    rotate_angle: float = number(0.785, 0.05, 4.0, unit="rad")

    def __post_init__(self) -> None:
        check_settings(self, under_code(_REFUSE, f"{self.name}."))


@dataclass(frozen=True, slots=True, kw_only=True)
class PurePursuit(Steering):
    """Pure pursuit: the arc through a point of the path ahead, at the speed that the speed law allows there.

    Parameters
    ----------
    lookahead_time : time in which the robot drives the lookahead distance at its speed.
    lookahead_min : least lookahead distance.
    lookahead_max : maximum lookahead distance.
    """

    name: ClassVar[str] = "pure-pursuit"
    summary: ClassVar[str] = "the arc through a point of the path ahead, at the speed law's ceiling there"
    source: ClassVar[str] = "Coulter 1992"

    lookahead_time: float = number(0.8, 0.0, 60.0, unit="s")
    lookahead_min: float = number(0.3, 1e-3, 1e6, unit="m")
    lookahead_max: float = number(1.2, 1e-3, 1e6, unit="m")


@dataclass(frozen=True, slots=True, kw_only=True)
class RegulatedPurePursuit(PurePursuit):
    """Regulated pure pursuit: pure pursuit whose speed falls in bends, near obstacles and before the goal.

    Parameters
    ----------
    desired : speed where nothing regulates it.
    min_radius : in bends that are tighter, the speed falls with the radius.
    min_speed : neither bends nor obstacles reduce the speed below this.
    scaling_distance : where a wall or an obstacle is nearer than this to the robot's outline, the speed falls with the
        distance.
    scaling_gain : factor of the speed at that distance.
    approach_distance : distance before the end of the path from which the speed falls with the remaining distance.
    approach_speed : least speed on the approach.
    collision_time : the robot stops if it would touch a wall, or an obstacle where it is now, within this time.
    """

    name: ClassVar[str] = "rpp"
    summary: ClassVar[str] = "pure pursuit whose speed falls in bends, near obstacles and before the goal"
    source: ClassVar[str] = "Macenski, Singh, Martin, Gines 2023"

    desired: float | None = number(
        None, 1e-6, 1e6, unit="m/s", none="the robot's top speed", title="desired speed"
    )
    min_radius: float = number(0.9, 1e-6, 1e6, unit="m")
    min_speed: float = number(0.25, 1e-6, 1e6, unit="m/s")
    scaling_distance: float = number(0.6, 1e-6, 1e6, unit="m")
    scaling_gain: float = number(1.0, 1e-6, 1.0)
    approach_distance: float = number(0.6, 1e-6, 1e6, unit="m")
    approach_speed: float = number(0.05, 1e-6, 1e6, unit="m/s")
    collision_time: float = number(1.0, 0.0, 60.0, unit="s")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sampling(Steering):
    """What controllers that compare simulated motions have.

    Parameters
    ----------
    path_weight : cost of a metre beside the path, on average over the motion.
    progress_weight : cost of a metre of the path that is left at the end of the motion.
    yaw_weight : cost of a radian between the robot's yaw and that of the path, on average over the motion.
    obstacle_weight : cost of a motion that is within `margin` of a wall or an obstacle all the time; it falls with the
        distance.
    margin : distance from walls and obstacles that costs nothing.
    collision_cost : cost of a motion that touches a wall or an obstacle all the time; a shorter contact costs its share.
    """

    path_weight: float = number(20.0, 0.0, 1e6)
    progress_weight: float = number(5.0, 0.0, 1e6)
    yaw_weight: float = number(3.0, 0.0, 1e6)
    obstacle_weight: float = number(3.0, 0.0, 1e6)
    margin: float = number(0.3, 0.0, 1e6, unit="m")
    collision_cost: float = number(1000.0, 0.0, 1e6)


@dataclass(frozen=True, slots=True, kw_only=True)
class Dwa(_Sampling):
    """The dynamic window approach: the best of a grid of constant commands that can be reached soon.

    Parameters
    ----------
    window : time within which a speed that is tried must be reached.
    speeds : how many speeds are tried.
    yaw_rates : how many yaw rates.
    directions : how many directions of travel, of an omnidirectional robot.
    steps : how many steps of `step` seconds each command is simulated for.
    step : length of a step.
    """

    name: ClassVar[str] = "dwa"
    summary: ClassVar[str] = "the best of a grid of constant commands that can be reached soon"
    source: ClassVar[str] = "Fox, Burgard, Thrun 1997"

    window: float = number(0.5, 1e-3, 60.0, unit="s", title="speed window")
    speeds: int = whole(9, 2, 200)
    yaw_rates: int = whole(21, 3, 400)
    directions: int = whole(9, 1, 100)
    steps: int = whole(20, 1, 400)
    step: float = number(0.1, 1e-3, 10.0, unit="s", title="step length")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mppi(_Sampling):
    """Model predictive path integral control: the mean of random commands, weighted by the cost of their motions.

    Parameters
    ----------
    samples : how many sequences of commands are simulated in every period.
    steps : how many steps of `step` seconds each of them has.
    step : length of a step.
    temperature : difference in cost at which a motion counts a factor of e less.
    hold : steps for which each random deviation lasts; longer ones lead farther away.
    speed_noise : standard deviation of the acceleration, as a share of the robot's greatest.
    yaw_noise : standard deviation of the yaw rate, as a share of the greatest.
    rate_weight : cost of a deviation from the last commands, which keeps them smooth (gamma of the paper).
    smooth : whether the sequence is smoothed over neighbouring steps before it is driven.
    """

    name: ClassVar[str] = "mppi"
    summary: ClassVar[str] = "the mean of random sequences of commands, weighted by the cost of their motions"
    source: ClassVar[str] = "Williams, Wagener, Goldfain, Drews, Rehg, Boots, Theodorou 2017"

    samples: int = whole(1000, 10, 100_000, title="sampled motions")
    steps: int = whole(56, 2, 400)
    step: float = number(0.05, 1e-3, 10.0, unit="s", title="step length")
    temperature: float = number(0.3, 1e-6, 1e6)
    hold: int = whole(4, 1, 100, title="steps of a deviation")
    speed_noise: float = number(1.0, 1e-6, 10.0)
    yaw_noise: float = number(0.3, 1e-6, 10.0)
    rate_weight: float = number(0.015, 0.0, 1e6)
    smooth: bool = flag(True)


CONTROLLERS: Mapping[str, type[Steering]] = MappingProxyType(
    {kind.name: kind for kind in (PurePursuit, RegulatedPurePursuit, Dwa, Mppi)}
)
"""Settings of each controller that steers, by its name."""


def names() -> tuple[str, ...]:
    """Every controller: ``exact``, then those that steer."""
    return (EXACT, *CONTROLLERS)


def controller_settings(name: str, given: Mapping[str, Any]) -> Steering | None:
    """The settings of a controller, some of them changed; None for ``exact``, which has none.

    Raises
    ------
    SettingError : ``CONTROLLER_SETTING``: a setting it does not have, or out of its range.
    """
    kind = CONTROLLERS.get(name)
    allowed = list(settings_of(kind)) if kind is not None else []
    for key in given:
        if key not in allowed:
            raise UnknownSettingError(
                _REFUSE,
                f"the controller {name} has no setting {shown(key)}",
                allowed=", ".join(allowed) or "none",
                todo=did_you_mean(key, allowed),
                setting=str(key),
            )
    return None if kind is None else kind(**given)


def changed_settings(one: Steering) -> dict[str, Any]:
    """All settings of a controller by name."""
    return {f.name: getattr(one, f.name) for f in fields(one)}


def check_name(name: object) -> None:
    """See that a controller exists.

    Raises
    ------
    SettingError : ``DRIVE_SETTING``.
    """
    if not isinstance(name, str) or name not in names():
        todo = did_you_mean(name, names()) if isinstance(name, str) else ""
        raise SettingError(
            "DRIVE_SETTING", shown(name), where="controller", allowed=", ".join(names()), todo=todo
        )
