"""Robot: size and limits, in SI units."""

from __future__ import annotations

from dataclasses import dataclass, fields

from lampyris._core.predicates import in_range
from lampyris._core.values import Noun
from lampyris.errors import SettingError, shown

LEAST, GREATEST = 1e-6, 1e6
"""Range of every limit: what lies beyond is a wrong unit."""


@dataclass(frozen=True, slots=True, repr=False)
class Robot(Noun):
    """A disc that drives.

    Parameters
    ----------
    radius : metres, >= 0. 0 means "fits any free cell".
    v_max : greatest speed, m/s, > 0.
    a_max : greatest acceleration, m/s2, > 0.
    d_max : greatest braking, m/s2, > 0.
    a_lat_max : greatest lateral acceleration in a bend, m/s2, > 0.
    turn_radius : the smallest radius it can drive, metres, >= 0. Where no arc of that radius fits, it must
        stand still and turn on the spot. 0: it drives any bend, as slowly as a_lat_max asks.
    jerk_max : greatest change of acceleration, m/s3; None: no limit.

    Raises
    ------
    SettingError : a limit that is not a number from 1e-6 to 1e6 (a radius: from 0).
    """

    radius: float = 0.0
    v_max: float = 1.0
    a_max: float = 0.5
    d_max: float = 1.0
    a_lat_max: float = 1.0
    turn_radius: float = 0.0
    jerk_max: float | None = None

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name == "jerk_max" and value is None:
                continue
            least = 0.0 if f.name.endswith("radius") else LEAST
            if not in_range(value, least, GREATEST):
                raise SettingError(
                    "ROBOT_LIMIT",
                    f"{shown(value)}",
                    where=f"robot.{f.name}",
                    allowed=f"a number from {least:g} to {GREATEST:g}",
                )
            object.__setattr__(self, f.name, float(value))
