"""Chain: links joined by hinges, from a base that does not move."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lampyris._core import predicates as checks
from lampyris._core.noun import Noun
from lampyris._core.scalars import is_real
from lampyris.errors import SettingError, shown
from lampyris.typing import Floats

MOST_LINKS = 64
MOST_METRES = 1e6
MOST_TURN = 4 * 3.141592653589793
"""Angles of joints are within two turns: beyond that a limit is in degrees."""


@dataclass(frozen=True, slots=True, repr=False)
class Chain(Noun):
    """A planar chain of rectangular links on a fixed base, such as a manipulator seen from above.

    A configuration is one angle for each joint, radians counterclockwise: the first is the heading of the first link in
    the map frame, each other one the angle between its link and the link before.

    Parameters
    ----------
    base : x, y of the first joint, metres of the map frame.
    links : length of each link from joint to joint, metres, > 0; 1 to 64 of them.
    widths : width of each link, metres, > 0; one number holds for all.
    joint_limits : least and greatest angle of each joint, radians; one pair holds for all. Joints do not wrap around: from
        -3 to 3 a joint turns by 6 radians. None: -pi to pi.

    Raises
    ------
    SettingError : ``CHAIN``.

    Examples
    --------
    >>> arm = Chain((5.0, 5.0), links=[1.0, 1.0, 0.5], widths=0.2)
    >>> arm.joints, arm.reach
    (3, 2.5)
    """

    base: tuple[float, float]
    links: tuple[float, ...]
    widths: tuple[float, ...] = (0.1,)
    joint_limits: tuple[tuple[float, float], ...] = ((-3.141592653589793, 3.141592653589793),)

    if TYPE_CHECKING:

        def __init__(
            self,
            base: Sequence[float],
            links: Sequence[float],
            widths: float | Sequence[float] = ...,
            joint_limits: Sequence[float] | Sequence[Sequence[float]] | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        base = _row("base", self.base, 2, -MOST_METRES, MOST_METRES)
        links = _row("links", self.links, None, 1e-6, MOST_METRES)
        n = len(links)
        if not 1 <= n <= MOST_LINKS:
            raise SettingError("CHAIN", f"{n} links", where="chain.links", allowed=f"1 to {MOST_LINKS}")
        given = self.widths
        widths = (given,) * n if is_real(given) else given
        widths = _row("widths", widths, None, 1e-6, MOST_METRES)
        widths = widths * n if len(widths) == 1 else widths
        if len(widths) != n:
            raise SettingError("CHAIN", f"{len(widths)} widths", where="chain.widths", allowed=f"1, or {n}")
        object.__setattr__(self, "base", base)
        object.__setattr__(self, "links", links)
        object.__setattr__(self, "widths", widths)
        object.__setattr__(self, "joint_limits", _limits(self.joint_limits, n))

    @property
    def joints(self) -> int:
        """How many joints there are, as many as links."""
        return len(self.links)

    @property
    def reach(self) -> float:
        """Length of the outstretched chain, metres."""
        return math.fsum(self.links)

    def joint_points(self, configuration: Sequence[float] | Floats) -> Floats:
        """Where the joints and, last, the tip are; metres of the map frame, float64 (joints + 1, 2).

        Raises
        ------
        SettingError : ``CONFIGURATION``: not one angle for each joint, or one beyond its limits.
        """
        q = configuration_of(self, configuration, "configuration")
        from lampyris._core import elementary

        angles = np.cumsum(q)
        steps = (
            np.stack((elementary.cos(angles), elementary.sin(angles)), axis=1) * np.array(self.links)[:, None]
        )
        points: Floats = np.cumsum(np.concatenate(([list(self.base)], steps)), axis=0)
        return points


def configuration_of(chain: Chain, value: object, name: str) -> Floats:
    """One angle for each joint within its limits, float64 (joints,), read-only.

    Raises
    ------
    SettingError : ``CONFIGURATION``.
    """
    array = checks.numbers(value, (chain.joints,))
    if array is None or not np.isfinite(array).all():
        allowed = f"{chain.joints} finite angles in radians"
        raise SettingError("CONFIGURATION", shown(value), where=name, allowed=allowed)
    low, high = np.array(chain.joint_limits).T
    outside = (array < low) | (array > high)
    if outside.any():
        k = int(outside.argmax())
        raise SettingError(
            "CONFIGURATION",
            f"{array[k]:.6g} rad",
            where=f"{name}, joint {k}",
            allowed=f"{low[k]:.6g} to {high[k]:.6g}",
        )
    array.setflags(write=False)
    return array


def _row(name: str, value: object, n: int | None, low: float, high: float) -> tuple[float, ...]:
    """Numbers of a range as a tuple."""
    array = checks.numbers(value, (n,))
    if array is None or not np.isfinite(array).all() or (array < low).any() or (array > high).any():
        count = "numbers" if n is None else f"{n} numbers"
        raise SettingError(
            "CHAIN", shown(value), where=f"chain.{name}", allowed=f"{count}, {low:g} to {high:g}"
        )
    return tuple(array.tolist())


def _limits(value: object, n: int) -> tuple[tuple[float, float], ...]:
    """A pair of limits for each joint."""
    if value is None:
        value = (-np.pi, np.pi)
    one = checks.numbers(value, (2,))
    pairs = np.tile(one, (n, 1)) if one is not None else checks.numbers(value, (None, 2))
    if pairs is not None and len(pairs) == 1:
        pairs = np.tile(pairs, (n, 1))
    fits = pairs is not None and len(pairs) == n and np.isfinite(pairs).all()
    if pairs is None or not fits or (pairs[:, 0] >= pairs[:, 1]).any() or (np.abs(pairs) > MOST_TURN).any():
        allowed = f"least < greatest angle, radians within {MOST_TURN:.4g}, for all joints or for each of {n}"
        raise SettingError("CHAIN", shown(value), where="chain.joint_limits", allowed=allowed)
    return tuple((low, high) for low, high in pairs.tolist())
