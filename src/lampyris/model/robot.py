"""Robot: shape, drive and limits, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lampyris._core.noun import Noun
from lampyris._core.settings import check_settings, number, under_code, word
from lampyris.errors import SettingError
from lampyris.model.footprint import Polygon, circumscribed_radius, footprint_of, inscribed_radius

LEAST, GREATEST = 1e-6, 1e6
"""Range of every limit: what lies beyond is a wrong unit."""


DRIVES = ("differential", "ackermann", "omnidirectional")


@dataclass(frozen=True, slots=True, repr=False)
class Robot(Noun):
    """A robot: a disc, or a polygon with a heading.

    Parameters
    ----------
    radius : radius of its disc; 0 fits any free cell. With a footprint it is the distance from the base to the
        farthest vertex, and set from it: what plans for discs keeps that far from walls.
    v_max : greatest speed.
    a_max : greatest acceleration.
    d_max : greatest braking.
    a_lat_max : greatest lateral acceleration in a bend.
    turn_radius : smallest radius it drives. Where no arc of that radius fits, it stands still and turns on the
        spot. 0: it drives any bend, as slowly as a_lat_max requires.
    jerk_max : greatest change of acceleration; it binds profiles, not drives.
    drive : how it moves, for planners that plan headings: differential turns in place, ackermann does not,
        omnidirectional also moves sideways. Planners on cells do not look at it.
    footprint : vertices (x ahead, y to the left) of its outline in metres, in order; the origin is its base, the
        point between the wheels that do not steer. None: a disc.

    Raises
    ------
    SettingError : ``ROBOT_LIMIT``: a limit out of its range (beyond 1e6 it is a wrong unit); ``ROBOT_FOOTPRINT``: an
        outline that crosses itself or does not hold the base, or a radius of its own beside a footprint.

    Examples
    --------
    >>> car = Robot(footprint=[(0.9, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.9, -0.3)], drive="ackermann")
    >>> round(car.radius, 3), car.inscribed_radius
    (0.949, 0.3)
    """

    radius: float = number(0.0, 0.0, GREATEST, unit="m")
    v_max: float = number(1.0, LEAST, GREATEST, unit="m/s")
    a_max: float = number(0.5, LEAST, GREATEST, unit="m/s2")
    d_max: float = number(1.0, LEAST, GREATEST, unit="m/s2")
    a_lat_max: float = number(1.0, LEAST, GREATEST, unit="m/s2")
    turn_radius: float = number(0.0, 0.0, GREATEST, unit="m")
    jerk_max: float | None = number(None, LEAST, GREATEST, unit="m/s3", none="no limit")
    drive: str = word("differential", DRIVES)
    footprint: Polygon | None = None

    if TYPE_CHECKING:  # what is accepted; what is held is declared above

        def __init__(
            self,
            radius: float = ...,
            v_max: float = ...,
            a_max: float = ...,
            d_max: float = ...,
            a_lat_max: float = ...,
            turn_radius: float = ...,
            jerk_max: float | None = ...,
            drive: str = ...,
            footprint: Sequence[Sequence[float]] | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_settings(self, under_code("ROBOT_LIMIT", "robot."))
        if self.footprint is None:
            return
        polygon = footprint_of(self.footprint)
        radius = circumscribed_radius(polygon)
        if self.radius not in (0.0, radius):
            raise SettingError(
                "ROBOT_FOOTPRINT",
                f"a radius of {self.radius:g} m beside a footprint",
                where="robot.radius",
                allowed="a footprint or a radius",
            )
        object.__setattr__(self, "footprint", polygon)
        object.__setattr__(self, "radius", radius)

    @property
    def inscribed_radius(self) -> float:
        """Radius of the greatest disc around the base that is within the robot, metres."""
        return self.radius if self.footprint is None else inscribed_radius(self.footprint)


def inscribed_disc(robot: Robot) -> Robot:
    """The same robot as the greatest disc around its base that is within its footprint."""
    return replace(robot, footprint=None, radius=robot.inscribed_radius)
