"""Robot: size and limits, in SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from lampyris.errors import SettingError

LEAST, GREATEST = 1e-6, 1e6
"""Range of every limit: what lies beyond is a wrong unit."""


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
    SettingError : a limit that is not a number from 1e-6 to 1e6 (radius: from 0).
    """

    radius: float = 0.0
    v_max: float = 1.0
    a_max: float = 0.5
    d_max: float = 1.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
            least = 0.0 if f.name == "radius" else LEAST
            if not (real and math.isfinite(value) and least <= value <= GREATEST):
                raise SettingError(
                    "ROBOT_LIMIT",
                    f"{value!r}",
                    where=f"robot.{f.name}",
                    allowed=f"a number from {least:g} to {GREATEST:g}",
                )
            object.__setattr__(self, f.name, float(value))
