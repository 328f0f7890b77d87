"""Sources of a signal that robots can measure: where they are over time, and how strong."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from lampyris._core.elementary import exp
from lampyris._core.noun import Noun
from lampyris._core.scalars import is_real
from lampyris._core.settings import check_settings, number, under_code
from lampyris.errors import SettingError, shown
from lampyris.typing import Floats

Point = tuple[float, float]
"""x, y in metres of the map frame."""

MAX_ROUTE = 1000
"""Points of the route of a moving source, at most."""
_FARTHEST = 1e9
"""Metres from the origin of the map frame, at most."""

J1_PEAKS = ((-0.0093, 1.5814), (1.2857, -0.0048), (-0.46, -0.6292))
"""Where J1 has its peaks, on the square of half width 3."""
J1_HEIGHTS = (8.1062, 3.5925, 3.7766)
"""Their heights."""


def j1(x: Floats, y: Floats) -> Floats:
    """The function J1 of Krishnanand and Ghose, at places of the square from -3 to 3, y up."""
    round_ = exp(-(x * x + y * y))
    hill = 3.0 * (1.0 - x) * (1.0 - x) * exp(-(x * x + (y + 1.0) * (y + 1.0)))
    saddle = 10.0 * (x / 5.0 - x * x * x - y * y * y * y * y) * round_
    found: Floats = hill - saddle - exp(-((x + 1.0) * (x + 1.0) + y * y)) / 3.0
    return found


class Source(Noun):
    """Base class of sources; each kind defines ``places`` and ``highest``."""

    __slots__ = ()

    def places(self, t: float) -> tuple[Point, ...]:
        """Where its peaks are after ``t`` seconds, metres of the map frame."""
        raise NotImplementedError

    @property
    def highest(self) -> float:
        """The greatest signal it gives alone."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, repr=False)
class ThreePeaks(Source):
    """The function J1 of Krishnanand and Ghose, stretched over a rectangle of the map: three peaks of different height.

    J1 = 3 (1-x)^2 exp(-(x^2 + (y+1)^2)) - 10 (x/5 - x^3 - y^5) exp(-(x^2 + y^2)) - exp(-((x+1)^2 + y^2)) / 3 on the
    square from -3 to 3, y up.

    Parameters
    ----------
    centre : of the rectangle, metres of the map frame.
    width, height : of the rectangle.

    Raises
    ------
    SettingError : ``SOURCE``.

    Examples
    --------
    >>> import lampyris
    >>> peaks = lampyris.ThreePeaks(centre=(5.0, 5.0), width=10.0, height=10.0)
    >>> peaks.centre
    (5.0, 5.0)
    """

    centre: Point
    width: float = number(50.0, 1e-6, 1e9, unit="m")
    height: float = number(50.0, 1e-6, 1e9, unit="m")

    if TYPE_CHECKING:

        def __init__(self, centre: Sequence[float], width: float = ..., height: float = ...) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", _point(self.centre, "centre"))
        check_settings(self, under_code("SOURCE"))

    def places(self, t: float) -> tuple[Point, ...]:
        """The three peaks; they never move."""
        (cx, cy), w, h = self.centre, self.width / 6.0, self.height / 6.0
        return tuple((cx + x * w, cy + y * h) for x, y in J1_PEAKS)

    @property
    def highest(self) -> float:
        """Height of the highest peak."""
        return max(J1_HEIGHTS)


class _PointSource(Source):
    """What a source at one point has, which may drive along a route. Abstract."""

    __slots__ = ()

    at: Point
    strength: float
    route: tuple[Point, ...]
    speed: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", _point(self.at, "at"))
        object.__setattr__(self, "route", _route(self.route))
        check_settings(self, under_code("SOURCE"))

    def places(self, t: float) -> tuple[Point, ...]:
        """Where it is after ``t`` seconds."""
        return (_along((self.at, *self.route), self.speed * t),)

    @property
    def highest(self) -> float:
        """The signal at the source."""
        return self.strength


@dataclass(frozen=True, slots=True, repr=False)
class InverseSquare(_PointSource):
    """A source whose signal falls with the square of the distance, as sound and radiation do: strength / (d^2 + core^2) x core^2.

    Parameters
    ----------
    at : where it is, or begins; metres of the map frame.
    strength : the signal at the source itself.
    core : distance at which the signal is half as strong.
    route : points that it goes to one after the other, and then back to where it began, again and again.
    speed : along the route.

    Raises
    ------
    SettingError : ``SOURCE``.

    Examples
    --------
    >>> import lampyris
    >>> source = lampyris.InverseSquare(at=(3.0, 4.0), strength=2.0)
    >>> source.at, source.strength
    ((3.0, 4.0), 2.0)
    """

    at: Point
    strength: float = number(1.0, 1e-9, 1e9)
    core: float = number(1.0, 1e-6, 1e9, unit="m")
    route: tuple[Point, ...] = ()
    speed: float = number(0.0, 0.0, 1e6, unit="m/s")

    if TYPE_CHECKING:

        def __init__(
            self,
            at: Sequence[float],
            strength: float = ...,
            core: float = ...,
            route: Sequence[Sequence[float]] = ...,
            speed: float = ...,
        ) -> None: ...


@dataclass(frozen=True, slots=True, repr=False)
class Plume(_PointSource):
    """A substance that is carried by a steady wind and spreads across it: an advected Gaussian.

    Downwind at distance d and e beside the axis the signal is strength x (width / s) exp(-e^2 / (2 s^2)), with
    s^2 = width^2 + 2 spread d: in the plane the same amount passes every cross-section. Upwind it is
    strength x exp(-(d^2 + e^2) / (2 width^2)).

    Parameters
    ----------
    at : where it is, or begins; metres of the map frame.
    strength : the signal at the source itself.
    towards : direction to which the wind blows, radians counterclockwise from the x axis.
    width : standard deviation of the plume at the source.
    spread : diffusivity divided by wind speed: how quickly the plume grows wide.
    route : points that it goes to one after the other, and then back to where it began, again and again.
    speed : along the route. The plume is that of a source at rest: the speed must be small beside the wind's.

    Raises
    ------
    SettingError : ``SOURCE``.

    Examples
    --------
    >>> import lampyris
    >>> plume = lampyris.Plume(at=(2.0, 5.0), towards=0.0, width=0.5)
    >>> plume.at, plume.spread
    ((2.0, 5.0), 0.5)
    """

    at: Point
    strength: float = number(1.0, 1e-9, 1e9)
    towards: float = number(0.0, -1e6, 1e6, unit="rad")
    width: float = number(1.0, 1e-6, 1e9, unit="m")
    spread: float = number(0.5, 0.0, 1e9, unit="m")
    route: tuple[Point, ...] = ()
    speed: float = number(0.0, 0.0, 1e6, unit="m/s")

    if TYPE_CHECKING:

        def __init__(
            self,
            at: Sequence[float],
            strength: float = ...,
            towards: float = ...,
            width: float = ...,
            spread: float = ...,
            route: Sequence[Sequence[float]] = ...,
            speed: float = ...,
        ) -> None: ...


AnySource: TypeAlias = ThreePeaks | InverseSquare | Plume
"""The kinds there are."""


def _point(given: Any, where: str) -> Point:
    pair = tuple(given) if isinstance(given, tuple | list) else ()
    if len(pair) != 2 or not all(is_real(v) and abs(v) <= _FARTHEST for v in pair):
        allowed = f"two numbers x, y: metres of the map frame, at most {_FARTHEST:g}"
        raise SettingError("SOURCE", shown(given), where=where, allowed=allowed)
    return float(pair[0]), float(pair[1])


def _route(given: Any) -> tuple[Point, ...]:
    if not isinstance(given, tuple | list) or len(given) > MAX_ROUTE:
        allowed = f"a list of at most {MAX_ROUTE:,} points"
        raise SettingError("SOURCE", shown(given), where="route", allowed=allowed)
    return tuple(_point(one, f"route[{k}]") for k, one in enumerate(given))


def _along(points: tuple[Point, ...], distance: float) -> Point:
    """The point so far along a closed line."""
    legs, round_ = [], 0.0
    for (ax, ay), (bx, by) in zip(points, (*points[1:], points[0]), strict=True):
        legs.append(math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay)))
        round_ += legs[-1]
    if round_ == 0.0 or distance == 0.0:
        return points[0]
    rest = distance - round_ * math.floor(distance / round_)
    for k, leg in enumerate(legs):
        if rest < leg:
            (ax, ay), (bx, by) = points[k], points[(k + 1) % len(points)]
            return ax + (bx - ax) * (rest / leg), ay + (by - ay) * (rest / leg)
        rest -= leg
    return points[0]
