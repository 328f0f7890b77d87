"""Settings of the drives of a fleet in continuous time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from lampyris._core.settings import check_settings, number, under_code, whole, word
from lampyris.errors import SettingError, UnknownSettingError, did_you_mean, shown

POLICIES = ("order", "orca")
"""How robots keep out of each other's way."""
OBSTACLE_INFO = ("speed", "track")


@dataclass(frozen=True, slots=True)
class FleetDriveSettings:
    """How the robots of a fleet drive; see docs/fleets_running.md for the equations.

    Parameters
    ----------
    policy : ``order``: drive the plan, in its order of visits at every cell; ``orca``: without a plan, each robot avoids
        what is near (optimal reciprocal collision avoidance).
    obstacles : moving obstacles, discs that walk at random.
    obstacle_radius : radius of the moving obstacles.
    obstacle_speed : speed of the moving obstacles.
    obstacle_info : what robots know about moving obstacles: ``speed``: present positions and top speeds; ``track``: also
        future positions.
    period : seconds between two observations of the obstacles; with ``orca`` the length of a step.
    drive_limit : simulated seconds after which the drive ends.
    robot_horizon : with ``orca``, seconds for which velocities are free of collisions with robots.
    wall_horizon : with ``orca``, the same with walls.
    neighbours : with ``orca``, nearest robots that each avoids.

    Raises
    ------
    SettingError : ``FLEET_DRIVE``.
    """

    policy: str = word(POLICIES[0], POLICIES)
    obstacles: int = whole(0, 0, 1000)
    obstacle_radius: float | None = number(None, 1e-6, 1e6, unit="m", none="0.3 of a cell")
    obstacle_speed: float = number(0.5, 0.0, 1e6, unit="m/s")
    obstacle_info: str = word(OBSTACLE_INFO[0], OBSTACLE_INFO)
    period: float = number(0.1, 1e-3, 10.0, unit="s")
    drive_limit: float | None = number(
        None, 1e-3, 1e9, unit="s", none="ten times as long as planned, and a minute"
    )
    robot_horizon: float = number(2.0, 1e-3, 1e3, unit="s")
    wall_horizon: float = number(0.5, 1e-3, 1e3, unit="s")
    neighbours: int = whole(10, 1, 64)

    def __post_init__(self) -> None:
        check_settings(self, under_code("FLEET_DRIVE"))

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> FleetDriveSettings:
        """Settings by name.

        Raises
        ------
        SettingError : ``FLEET_DRIVE``: one that drives of fleets do not have, or out of its range.
        """
        names = [f.name for f in fields(cls)]
        for name in given:
            if name not in names:
                raise UnknownSettingError(
                    "FLEET_DRIVE", f"drives of fleets have no setting {shown(name)}", allowed=", ".join(names),
                    todo=did_you_mean(name, names), setting=str(name),
                )  # fmt: skip
        made = cls(**given)
        if made.policy == "orca" and made.obstacles:
            raise SettingError.of(
                "FLEET_DRIVE", "obstacles", f"{made.obstacles} with policy orca", allowed="0",
                todo="moving obstacles are avoided by policy order alone",
            )  # fmt: skip
        return made
