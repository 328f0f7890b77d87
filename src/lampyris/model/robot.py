"""Robot: size and limits, in SI units."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.noun import Noun
from lampyris._core.settings import check_settings, number, under_code

LEAST, GREATEST = 1e-6, 1e6
"""Range of every limit: what lies beyond is a wrong unit."""


@dataclass(frozen=True, slots=True, repr=False)
class Robot(Noun):
    """A disc that drives.

    Parameters
    ----------
    radius : radius of its disc; 0 fits any free cell.
    v_max : greatest speed.
    a_max : greatest acceleration.
    d_max : greatest braking.
    a_lat_max : greatest lateral acceleration in a bend.
    turn_radius : smallest turning radius. Where no arc of that radius fits, it stands still and turns on the
        spot. 0: any bend, as slowly as a_lat_max requires.
    jerk_max : greatest jerk; it limits profiles, not drives.

    Raises
    ------
    SettingError : ``ROBOT_LIMIT``: a limit out of its range (beyond 1e6 it is a wrong unit).
    """

    radius: float = number(0.0, 0.0, GREATEST, unit="m")
    v_max: float = number(1.0, LEAST, GREATEST, unit="m/s")
    a_max: float = number(0.5, LEAST, GREATEST, unit="m/s2")
    d_max: float = number(1.0, LEAST, GREATEST, unit="m/s2")
    a_lat_max: float = number(1.0, LEAST, GREATEST, unit="m/s2")
    turn_radius: float = number(0.0, 0.0, GREATEST, unit="m")
    jerk_max: float | None = number(None, LEAST, GREATEST, unit="m/s3", none="no limit")

    def __post_init__(self) -> None:
        check_settings(self, under_code("ROBOT_LIMIT", "robot."))
