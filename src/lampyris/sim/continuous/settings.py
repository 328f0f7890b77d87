"""Settings of a drive in continuous time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

from lampyris._core.predicates import in_range, is_word
from lampyris.errors import SettingError, UnknownSettingError, did_you_mean, shown
from lampyris.model.scene import Scene
from lampyris.motion.geometry.curve import Smooth
from lampyris.sim.continuous.tracking import Tracking

ObstacleInfo = Literal["positions", "velocities", "tracks"]
OnHit = Literal["end", "go-on"]

_WORDS: Mapping[str, tuple[str, ...]] = {
    "obstacle_info": get_args(ObstacleInfo),
    "tracking": get_args(Tracking),
    "on_hit": get_args(OnHit),
    "smooth": get_args(Smooth),
}
_MAY_BE_NONE = ("time_limit", "obstacle_speed", "command_period", "spacing")
_MAY_BE_ZERO = ("delay", "lag", "noise", "patience", "data_timeout")
MAX_PASSED = 100
"""Cells an obstacle of the traffic may pass between two decisions: each is a step that is decided, and kept
until the next decision. No robot avoids what is a hundred cells farther whenever it decides."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How a drive is simulated.

    Parameters
    ----------
    period : seconds between two decisions.
    time_limit : seconds after which it ends in any case; None: a minute, and ten times what the robot's own
        limits would need on its first way. At most :data:`lampyris._core.limits.DECISIONS` periods.
    obstacle_speed : m/s of a straight step of the scene's traffic; None: the robot's top speed. At most
        :data:`MAX_PASSED` cells between two decisions.
    obstacle_info : what our law uses of the obstacles: their ``positions``; their ``velocities`` too; or whole
        ``tracks`` where they are recorded. It is safe with positions alone, and drives better with more.
    tracking : see :mod:`lampyris.sim.continuous.tracking`.
    command_period : seconds between two commands unless tracking is perfect; None: ``period``.
    delay : seconds a command takes to arrive, unless tracking is perfect; known to our law.
    lag : seconds of the drive's lag, unless tracking is perfect.
    noise : metres that a told position may be off, known to our law.
    patience : seconds the robot stands because of obstacles before it asks its planner again.
    give_up : seconds of that in a row after which the drive ends as ``blocked``.
    on_hit : whether the drive ends when an obstacle runs into the standing robot.
    smooth : ``arcs``: plans are drawn taut, their corners rounded as widely as there is room. ``none``: the
        planned cells as they are, each corner rounded within half a step, or a stop.
    data_timeout : seconds without data that can be trusted after which a standing robot gives up.
    max_age : seconds; older data are not trusted.
    spacing : metres between two nodes of the way; None:
        :data:`lampyris._core.defaults.DRIVE_SPACING` cells. What walls ask for is bounded between nodes, so
        the farther apart the slower: half a cell costs 14 % on env-1 to env-6.

    Raises
    ------
    SettingError : ``DRIVE_SETTING``.
    """

    period: float = 0.1
    time_limit: float | None = None
    obstacle_speed: float | None = None
    obstacle_info: ObstacleInfo = "positions"
    tracking: Tracking = "perfect"
    command_period: float | None = None
    delay: float = 0.0
    lag: float = 0.1
    noise: float = 0.0
    patience: float = 5.0
    give_up: float = 60.0
    on_hit: OnHit = "end"
    smooth: Smooth = "arcs"
    data_timeout: float = 2.0
    max_age: float = 0.5
    spacing: float | None = None

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name in _WORDS:
                ok, allowed = is_word(value, _WORDS[f.name]), ", ".join(_WORDS[f.name])
            elif value is None and f.name in _MAY_BE_NONE:
                continue
            else:
                least = 0.0 if f.name in _MAY_BE_ZERO else 1e-6
                ok = in_range(value, least, 1e6)
                allowed = f"{least:g} to 1e6"
                if ok:
                    object.__setattr__(self, f.name, float(value))
            if not ok:
                raise SettingError("DRIVE_SETTING", shown(value), where=f.name, allowed=allowed)

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Settings:
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
    names = [f.name for f in fields(Settings)]
    ours = {key: value for key, value in given.items() if key in names}
    return ours, {key: value for key, value in given.items() if key not in names}
