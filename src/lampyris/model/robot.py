"""Robot: size and limits, in SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from lampyris.errors import SettingError


@dataclass(frozen=True, slots=True)
class Robot:
    """A disc that drives.

    Parameters
    ----------
    radius : metres, >= 0. 0 means "fits any free cell".
    v_max : greatest speed, m/s, > 0.
    a_max : greatest acceleration, m/s2, > 0.
    d_max : greatest braking, m/s2, > 0.

    Raises
    ------
    SettingError : a limit that is not finite or not in its range.
    """

    radius: float = 0.0
    v_max: float = 1.0
    a_max: float = 0.5
    d_max: float = 1.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            low_ok = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
            if not low_ok or value < 0 or (value == 0 and f.name != "radius"):
                allowed = "a finite number >= 0" if f.name == "radius" else "a finite number > 0"
                raise SettingError("ROBOT_LIMIT", f"{value!r}", where=f"robot.{f.name}", allowed=allowed)
            object.__setattr__(self, f.name, float(value))
