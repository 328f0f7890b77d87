"""Test functions of several peaks, numbered as by Krishnanand and Ghose; all are to be maximised.

Definitions as in public copies of their programs; values at the peaks computed here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from lampyris._core.elementary import cos, exp, log, sin
from lampyris.model.swarm.sources import J1_HEIGHTS, J1_PEAKS, j1
from lampyris.planning.swarm.optimisers.box import Box, Points, Values, norms

_PI = np.pi


@dataclass(frozen=True, slots=True, eq=False)
class Function:
    """A test function.

    Parameters
    ----------
    name, formula : what it is called and how it is written.
    f : points (n, 2) to values (n,).
    low, high : the box is low to high in both coordinates.
    peaks : (k, 2), the isolated maxima that are known; none where the maxima are rings or plains.
    heights : (k,), the values there.
    """

    name: str
    formula: str
    f: Callable[[Points], Values]
    low: float
    high: float
    peaks: tuple[tuple[float, float], ...] = ()
    heights: tuple[float, ...] = ()

    @property
    def box(self) -> Box:
        """Where to look."""
        return Box(np.full(2, self.low), np.full(2, self.high))

    def __call__(self, points: Points) -> Values:
        return self.f(np.asarray(points, dtype=np.float64))

    def caught(self, points: Points, within: float = 0.05, enough: int = 3) -> int:
        """How many peaks have at least ``enough`` of the points (n, 2) nearer than ``within``."""
        gaps = norms(np.array(self.peaks)[:, np.newaxis, :] - points[np.newaxis, :, :])
        return int(np.count_nonzero((gaps < within).sum(axis=1) >= enough))


def _j1(p: Points) -> Values:
    return j1(p[:, 0], p[:, 1])


def _j3(p: Points) -> Values:
    square = p[:, 0] * p[:, 0] + p[:, 1] * p[:, 1]
    tenth = exp(log(np.where(square > 0.0, square, 1.0)) / 10.0)
    wave = sin(50.0 * np.where(square > 0.0, tenth, 0.0))
    rings: Values = np.sqrt(np.sqrt(square)) * (wave * wave + 0.1)
    return rings


def _j4(p: Points) -> Values:
    steps: Values = 25.0 - np.floor(p[:, 0]) - np.floor(p[:, 1])
    return steps


def _j5(p: Points) -> Values:
    plain: Values = np.sign(cos(p[:, 0]) + cos(p[:, 1]))
    return plain


def _j9(p: Points) -> Values:
    c, s = cos(p[:, 0]), sin(p[:, 1])
    return c * c + s * s


def _rastrigin(p: Points) -> Values:
    x, y = p[:, 0], p[:, 1]
    return 20.0 + (x * x - 10.0 * cos(2.0 * _PI * x)) + (y * y - 10.0 * cos(2.0 * _PI * y))


_J9_PEAKS = tuple((x, y) for x in (-_PI, 0.0, _PI) for y in (-1.5 * _PI, -0.5 * _PI, 0.5 * _PI, 1.5 * _PI))

FUNCTIONS = MappingProxyType(
    {
        f.name: f
        for f in (
            Function(
                "J1",
                "3 (1-x)^2 exp(-(x^2+(y+1)^2)) - 10 (x/5-x^3-y^5) exp(-(x^2+y^2)) - exp(-((x+1)^2+y^2)) / 3",
                _j1,
                -3.0,
                3.0,
                J1_PEAKS,
                J1_HEIGHTS,
            ),
            Function("J3", "(x^2+y^2)^(1/4) (sin^2(50 (x^2+y^2)^(1/10)) + 1/10)", _j3, -10.0, 10.0),
            Function("J4", "25 - floor(x) - floor(y)", _j4, -3.0, 3.0),
            Function("J5", "sign(cos x + cos y)", _j5, -4.0 * _PI, 4.0 * _PI),
            Function("J9", "cos^2 x + sin^2 y", _j9, -5.0, 5.0, _J9_PEAKS, (2.0,) * 12),
            Function(
                "Rastrigin", "20 + x^2 - 10 cos(2 pi x) + y^2 - 10 cos(2 pi y)", _rastrigin, -5.12, 5.12
            ),
        )
    }
)
"""Peaks J1, Circles J3, Staircase J4 (highest on [-3, -2)^2), Plateaus J5, Equal peaks J9, and Rastrigin,
whose least value is 0 at the origin and which is usually minimised."""
