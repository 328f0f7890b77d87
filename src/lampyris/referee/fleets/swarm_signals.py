"""The signal of sources a second time, from their definitions, and what it can be near a point."""

from __future__ import annotations

import numpy as np

from lampyris.model.swarm.sources import AnySource, InverseSquare, Plume, ThreePeaks
from lampyris.typing import Floats

_STEEPEST = 14.0
"""No less than the greatest slope of J1 on its square of half width 3, which is 13.98."""


def signal_at(sources: tuple[AnySource, ...], x: Floats, y: Floats, t: float) -> Floats:
    """What the sources send, from their definitions."""
    total = np.zeros_like(x)
    for one in sources:
        if isinstance(one, ThreePeaks):
            u, v = 6.0 * (x - one.centre[0]) / one.width, 6.0 * (y - one.centre[1]) / one.height
            total += 3 * (1 - u) ** 2 * np.exp(-(u**2) - (v + 1) ** 2)
            total -= 10 * (u / 5 - u**3 - v**5) * np.exp(-(u**2) - v**2) + np.exp(-((u + 1) ** 2) - v**2) / 3
        elif isinstance(one, InverseSquare):
            ((px, py),) = one.places(t)
            total += one.strength / (1 + ((x - px) ** 2 + (y - py) ** 2) / one.core**2)
        elif isinstance(one, Plume):
            ((px, py),) = one.places(t)
            offset = ((x - px) + 1j * (y - py)) * np.exp(-1j * one.towards)
            down, beside = offset.real, offset.imag
            deviation = np.sqrt(one.width**2 + 2 * one.spread * np.where(down > 0, down, 0))
            behind = np.where(down < 0, down, 0)
            total += (
                one.strength * one.width / deviation * np.exp(-(beside**2 + behind**2) / (2 * deviation**2))
            )
    return total


def signal_range(
    sources: tuple[AnySource, ...], x: Floats, y: Floats, t: float, away: float
) -> tuple[Floats, Floats]:
    """Bounds of the signal within a distance of some points: nothing less, nothing more; not always attained.

    Parameters
    ----------
    x, y : float64 (n,), metres of the map frame.
    t : seconds.
    away : metres.
    """
    low, high = np.zeros_like(x), np.zeros_like(x)
    for one in sources:
        if isinstance(one, ThreePeaks):
            here = signal_at((one,), x, y, t)
            give = _STEEPEST * away * 6.0 / min(one.width, one.height)
            low, high = low + here - give, high + here + give
            continue
        ((px, py),) = one.places(t)
        if isinstance(one, InverseSquare):
            gap = np.hypot(x - px, y - py)
            near, far = np.maximum(gap - away, 0.0), gap + away
            high = high + one.strength / (1 + (near / one.core) ** 2)
            low = low + one.strength / (1 + (far / one.core) ** 2)
        elif isinstance(one, Plume):
            offset = ((x - px) + 1j * (y - py)) * np.exp(-1j * one.towards)
            down, beside = offset.real, np.abs(offset.imag)
            thin, wide = (
                np.sqrt(one.width**2 + 2 * one.spread * np.maximum(d, 0.0))
                for d in (down - away, down + away)
            )
            behind = [np.maximum(-d, 0.0) for d in (down + away, down - away)]
            near, far = (
                np.maximum(beside - away, 0.0) ** 2 + behind[0] ** 2,
                (beside + away) ** 2 + behind[1] ** 2,
            )
            high = high + one.strength * one.width / thin * np.exp(-near / (2 * wide**2))
            low = low + one.strength * one.width / wide * np.exp(-far / (2 * thin**2))
    return low, high
