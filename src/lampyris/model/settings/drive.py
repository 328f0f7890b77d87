"""Settings of a drive in continuous time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

from lampyris._core.defaults import DRIVE_SPACING, MAX_AGE, SAMPLE_SMOOTH, UNSEEN_COST, Smooth
from lampyris._core.settings import check_settings, number, under_code, word
from lampyris.errors import SettingError, UnknownSettingError, did_you_mean, shown
from lampyris.model.settings.sensor import MOST_UNSEEN, Sensor
from lampyris.model.settings.simulation import ALL_AROUND
from lampyris.model.settings.steering import BRAKING, EXACT, Steering, controller_settings, names

if TYPE_CHECKING:
    from lampyris.model.scene import Scene

ObstacleInfo: TypeAlias = Literal["positions", "velocities", "tracks"]
OnHit: TypeAlias = Literal["end", "go-on"]
SafetyFilter: TypeAlias = Literal["braking", "none"]
Tracking: TypeAlias = Literal["perfect", "velocity", "position"]

MAX_PASSED = 100
"""Cells an obstacle of the traffic may pass between two decisions: each step is decided, and kept
until the next decision. No robot can avoid what is a hundred cells farther at each of its decisions."""


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """How a drive is simulated.

    Parameters
    ----------
    period : time between two decisions.
    time_limit : the drive ends after this time at the latest. The default is a minute, and ten times what the robot's own
        limits would need on its first path. At most 100,000 periods.
    obstacle_speed : speed of the scene's obstacles along a straight step. At most 100 cells between
        two decisions.
    obstacle_info : what the law knows about obstacles: ``positions``; also ``velocities``; or whole
        ``tracks`` where they are recorded. It is safe with positions alone, and drives better with more.
    tracking : how commands are followed: at once (``perfect``), or with a delay, by ``velocity`` or by ``position``.
    command_period : time between two commands, unless tracking is perfect.
    delay : latency of a command, unless tracking is perfect; known to the law.
    lag : time constant of the motors, unless tracking is perfect.
    noise : maximum error of a reported position; known to the law.
    patience : time the robot stands still because of obstacles before it replans.
    give_up : uninterrupted time standing still after which the drive ends as ``blocked``.
    on_hit : whether the drive ends when an obstacle runs into the standing robot.
    smooth : how planned paths become curves; ``straight``: pulled straight where there is room, corners rounded as
        widely as there is room; ``arcs``: along the path's own lines, corners rounded as widely as there is room;
        ``none``: along the path's own lines, each corner rounded within half a step, or a stop.
    data_timeout : time without trusted data after which a standing robot gives up.
    max_age : age after which data are no longer trusted.
    controller : path following controller: ``exact`` follows the planned path without error, at the speed of the speed law;
        the others compute steering commands, may leave the path, and need a planner of poses.
    safety_filter : filter on the commands of controllers that steer: ``braking`` passes a command only if the robot can still
        stop before any contact; ``none`` passes every command.
    controller_settings : settings of the controller by name.
    spacing : maximum distance between two nodes of the path. What walls require is bounded between nodes, so
        the farther apart the slower: half a cell costs 14 % on env-1 to env-6.
    sensor_range : sensor range: the robot starts without the map, and unseen cells count as free. For planners
        on cells, perfect tracking and laws of the physical family.
    field_of_view : angle that the sensor sees around the direction of travel.
    unseen_cost : what a cell that has not been seen costs to enter, as a multiple of what it costs once it is seen.

    Raises
    ------
    SettingError : ``DRIVE_SETTING``.
    """

    period: float = number(0.1, 1e-6, 1e6, unit="s")
    time_limit: float | None = number(
        None, 1e-6, 1e6, unit="s", none="depends on the length of the first path"
    )
    obstacle_speed: float | None = number(None, 1e-6, 1e6, unit="m/s", none="the robot's top speed")
    obstacle_info: ObstacleInfo = word("positions", get_args(ObstacleInfo))
    tracking: Tracking = word("perfect", get_args(Tracking))
    command_period: float | None = number(None, 1e-6, 1e6, unit="s", none="the period")
    delay: float = number(0.0, 0.0, 1e6, unit="s")
    lag: float = number(0.1, 0.0, 1e6, unit="s")
    noise: float = number(0.0, 0.0, 1e6, unit="m", title="position error")
    patience: float = number(5.0, 0.0, 1e6, unit="s")
    give_up: float = number(60.0, 1e-6, 1e6, unit="s")
    on_hit: OnHit = word("end", get_args(OnHit), title="when an obstacle hits it")
    smooth: Smooth = word(SAMPLE_SMOOTH, get_args(Smooth))
    data_timeout: float = number(2.0, 0.0, 1e6, unit="s")
    max_age: float = number(MAX_AGE, 1e-6, 1e6, unit="s")
    spacing: float | None = number(None, 1e-6, 1e6, unit="m", none=f"{DRIVE_SPACING:g} of a cell")
    controller: str = word(EXACT, names())
    safety_filter: SafetyFilter = word(BRAKING, get_args(SafetyFilter))
    sensor_range: float | None = number(None, 1e-3, 1e6, unit="metres", none="the map is known")
    field_of_view: float = number(ALL_AROUND, 0.0, ALL_AROUND, unit="degrees", above=True)
    unseen_cost: float = number(UNSEEN_COST, 1.0, MOST_UNSEEN)
    controller_settings: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        check_settings(self, under_code("DRIVE_SETTING"))
        given = self.controller_settings
        if not isinstance(given, Mapping):
            raise SettingError(
                "DRIVE_SETTING",
                shown(given),
                where="controller_settings",
                allowed="a mapping of settings by name",
            )
        object.__setattr__(self, "controller_settings", dict(given))
        controller_settings(self.controller, given)
        for name, usual in (("field_of_view", ALL_AROUND), ("unseen_cost", UNSEEN_COST)):
            if self.sensor_range is None and getattr(self, name) != usual:
                raise SettingError(
                    "DRIVE_SETTING", f"{getattr(self, name):g} without a range of the sensor", where=name,
                    allowed="together with sensor_range",
                )  # fmt: skip

    @property
    def map_sensor(self) -> Sensor | None:
        """The sensor of a robot that does not know the map; None: it does."""
        if self.sensor_range is None:
            return None
        return Sensor(self.sensor_range, math.radians(self.field_of_view), self.unseen_cost)

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> DriveSettings:
        """Settings by name.

        Raises
        ------
        SettingError : ``DRIVE_SETTING``: one that a drive does not have, or out of its range.
        """
        names = [f.name for f in fields(cls)]
        for name in given:
            if name not in names:
                raise UnknownSettingError(
                    "DRIVE_SETTING",
                    f"a drive has no setting {shown(name)}",
                    allowed=", ".join(names),
                    todo=did_you_mean(name, names),
                    setting=str(name),
                )
        return cls(**given)

    @property
    def steering(self) -> Steering | None:
        """The settings of the controller that steers; None for ``exact``."""
        return controller_settings(self.controller, self.controller_settings)

    @property
    def decision_period(self) -> float:
        """Seconds between two decisions."""
        return float(getattr(self, self._decided_by))

    @property
    def _decided_by(self) -> str:
        """The setting that says how often."""
        late = self.tracking != "perfect" and self.command_period is not None
        return "command_period" if late else "period"

    def check_traffic(self, scene: Scene) -> None:
        """See that the scene's traffic passes at most MAX_PASSED cells between two decisions.

        Raises
        ------
        SettingError : ``OBSTACLE_SPEED``: it passes more.
        """
        speed = scene.robot.v_max if self.obstacle_speed is None else self.obstacle_speed
        most = MAX_PASSED * scene.grid.resolution / self.decision_period
        if scene.traffic and speed > most:
            raise SettingError(
                "OBSTACLE_SPEED",
                f"at {shown(speed)} m/s obstacles pass more than {MAX_PASSED:,} cells between two decisions",
                where="obstacle_speed" if self.obstacle_speed is not None else "v_max",
                allowed=f"at most {shown(most)} m/s",
                todo=f"slower obstacles (obstacle_speed) or a shorter {self._decided_by}",
            )


def split_settings(given: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Those of a drive, and the rest."""
    names = [f.name for f in fields(DriveSettings)]
    ours = {key: value for key, value in given.items() if key in names}
    return ours, {key: value for key, value in given.items() if key not in names}
