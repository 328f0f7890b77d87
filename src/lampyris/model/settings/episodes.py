"""Settings of episodes that an agent drives action by action."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.settings import check_settings, flag, number, under_code, whole
from lampyris.errors import SettingError

MAX_PATCH = 31
"""Greatest side of the observed patch, cells."""


@dataclass(frozen=True, slots=True)
class EpisodeSettings:
    """What an agent observes, and what it is rewarded for.

    Parameters
    ----------
    patch : side of the observed square of cells around the robot; odd.
    shaped : whether rewards contain the difference of potentials, the exact cost-to-go. Without a discount the rewards
        of an episode on cells then sum to minus its regret.
    discount : of the potential: that of the agent, so that shaping changes no optimal policy (Ng, Harada, Russell 1999).

    Raises
    ------
    SettingError : ``EPISODE_SETTING``.
    """

    patch: int = whole(7, 1, MAX_PATCH, unit="cells")
    shaped: bool = flag(True)
    discount: float = number(1.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        check_settings(self, under_code("EPISODE_SETTING"))
        if self.patch % 2 == 0:
            raise SettingError("EPISODE_SETTING", str(self.patch), where="patch", allowed="an odd number")


@dataclass(frozen=True, slots=True)
class CellEpisodeSettings(EpisodeSettings):
    """Settings of episodes on cells (``lampyris/GridNav-v0``).

    Parameters
    ----------
    bump_cost : cost of an action that is no legal step, in straight steps; the robot stays where it is.
    """

    bump_cost: int = whole(1, 1, 1000, unit="cells")


@dataclass(frozen=True, slots=True)
class DriveEpisodeSettings(EpisodeSettings):
    """Settings of episodes in continuous time (``lampyris/Drive-v0``).

    Parameters
    ----------
    period : duration of a step.
    yaw_rate_max : maximum yaw rate, where the robot does not state one.
    goal_tolerance : distance from the goal at which the robot has arrived.
    collision_cost : what touching a wall costs, besides the time to go; it ends the episode.
    """

    period: float = number(0.1, 1e-3, 10.0, unit="s")
    yaw_rate_max: float = number(2.0, 1e-3, 1e3, unit="rad/s")
    goal_tolerance: float = number(0.5, 1e-3, 100.0, unit="cells")
    collision_cost: float = number(10.0, 0.0, 1e6, unit="s")
