"""Elementary functions that give the same bits on every machine.

The mathematics library of a system, and NumPy's own vector loops, round ``exp``, ``log``, ``sin``, ``cos``
and ``atan2`` as they please: one machine's last bit is not another's, and a swarm that compares two such
numbers takes another way from there. So do ``hypot``, and ``np.interp``, whose product and sum a compiler may
round once instead of twice. Code that decides calls these instead. They use ``+ - * /``, rounding to
whole numbers, and taking a number apart into mantissa and exponent: all exactly defined (IEEE 754), in a
stated order, one NumPy operation at a time, so that nothing can be contracted.

Method: the argument is reduced with a constant split into parts short enough that multiples of them are exact
(Cody and Waite, "Software Manual for the Elementary Functions", 1980), then a Taylor sum by Horner's rule.
Accuracy: within 2 units in the last place of the true value; the tests measure it against ``math``. About
five times slower than NumPy's own, and not for code where only the picture counts.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Reals = NDArray[np.float64]
"""float64, any shape."""

_LOG2_E = 1.4426950408889634
# ln 2 = high + low, the high part with 32 trailing zero bits: its multiples by an exponent are exact.
_LN2_HIGH = float.fromhex("0x1.62e42feep-1")
_LN2_LOW = float.fromhex("0x1.a39ef35793c76p-33")
_HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
"""pi / 2 in three parts, the first two of 33 bits."""

TURNS = 2**20
"""Quarter turns up to which ``sin`` and ``cos`` are reduced exactly: arguments to 1.6 million."""

_EXP = tuple(1.0 / math.factorial(k) for k in range(13, 1, -1))
_ATANH = tuple(1.0 / k for k in range(23, 1, -2))
_SIN = tuple((1 - k // 2 % 2 * 2) / math.factorial(k) for k in range(17, 1, -2))
_COS = tuple((1 - k // 2 % 2 * 2) / math.factorial(k) for k in range(18, 2, -2))
_ATAN = tuple((1 - k // 2 % 2 * 2) / k for k in range(15, 1, -2))

# atan(k / 8) for k = 0 to 8, and 0, pi / 2 and pi: the nearest double, and what it leaves over.
_EIGHTHS = np.array(
    [
        [0.0, 0.0],
        [0.12435499454676144, -3.1253241424539383e-18],
        [0.24497866312686414, 1.0698755618734451e-17],
        [0.35877067027057225, -2.4623815582638635e-17],
        [0.4636476090008061, 2.2698777452961687e-17],
        [0.5585993153435624, -5.4556305485916264e-18],
        [0.6435011087932844, 1.5834785051444286e-17],
        [0.7188299996216245, -2.1478388444456983e-17],
        [0.7853981633974483, 3.061616997868383e-17],
    ]
)
_QUARTERS = np.array([[0.0, 0.0], [1.5707963267948966, 6.123233995736766e-17]])
_QUARTERS = np.concatenate((_QUARTERS, 2.0 * _QUARTERS[1:]))


def _sum(coefficients: tuple[float, ...], z: Reals) -> Reals:
    """Horner's rule, the coefficient of the highest power first."""
    total = np.full_like(z, coefficients[0])
    for c in coefficients[1:]:
        total *= z
        total += c
    return total


def exp(x: ArrayLike) -> Reals:
    """e to the power of x, float64, same shape: infinity from 709.79, 0 from -745.14 on."""
    given = np.asarray(x, dtype=np.float64)
    near = np.clip(given, -746.0, 710.0)
    times = np.rint(near * _LOG2_E)
    times = np.where(np.isnan(times), 0.0, times)
    r = (near - times * _LN2_HIGH) - times * _LN2_LOW
    whole = 1.0 + (r + r * r * _sum(_EXP, r))
    with np.errstate(over="ignore", under="ignore"):
        out: Reals = np.ldexp(whole, times.astype(np.int32))
    return out


def log(x: ArrayLike) -> Reals:
    """Natural logarithm, float64, same shape: minus infinity at 0, not a number below."""
    given = np.asarray(x, dtype=np.float64)
    inside = (given > 0.0) & (given < np.inf)
    mantissa, exponent = np.frexp(np.where(inside, given, 1.0))
    low = mantissa < 0.7071067811865476
    mantissa = np.where(low, 2.0 * mantissa, mantissa)
    times = exponent - low.astype(np.float64)
    # log m = 2 atanh(f), f = (m - 1) / (m + 1), |f| <= 0.172; m - 1 is exact.
    f = (mantissa - 1.0) / (mantissa + 1.0)
    z = f * f
    rest = 2.0 * f * (z * _sum(_ATANH, z))
    out = times * _LN2_HIGH + (2.0 * f + (rest + times * _LN2_LOW))
    edge = np.where(given == 0.0, -np.inf, np.where(given == np.inf, np.inf, np.nan))
    return np.where(inside, out, edge)


def sin(x: ArrayLike) -> Reals:
    """Sine of x in radians, float64, same shape; not a number beyond a million quarter turns."""
    r, quarter = _reduced(x)
    return _by_quarter(r, quarter)


def cos(x: ArrayLike) -> Reals:
    """Cosine of x in radians, float64, same shape; not a number beyond a million quarter turns."""
    r, quarter = _reduced(x)
    return _by_quarter(r, quarter + 1)


def atan2(y: ArrayLike, x: ArrayLike) -> Reals:
    """Angle of the point (x, y) in radians, -pi to pi, float64, shape of both together; as ``math.atan2``.

    The ratio of the lesser to the greater is taken to the nearest eighth c by atan t = atan c + atan((t - c)
    / (1 + c t)), which leaves at most 1/16 for the series.
    """
    y, x = np.broadcast_arrays(np.asarray(y, dtype=np.float64), np.asarray(x, dtype=np.float64))
    high, wide = np.abs(y), np.abs(x)
    steep = high > wide
    less, more = np.where(steep, wide, high), np.where(steep, high, wide)
    both = np.isinf(less)  # Two infinities lie on the diagonal.
    less, more = np.where(both, 1.0, less), np.where(both, 1.0, np.where(more == 0.0, 1.0, more))
    with np.errstate(under="ignore"):
        ratio = less / more
        eighth = np.rint(8.0 * np.where(np.isnan(ratio), 0.0, ratio)).astype(np.int64)
        # Scaled, so that what is added up neither overflows nor loses digits.
        more, exponent = np.frexp(np.where(np.isinf(more), 1.0, more))
        less = np.ldexp(less, -exponent)
        c = 0.125 * eighth
        z = np.where(eighth == 0, ratio, (less - c * more) / (more + c * less))
        zz = z * z
        rest = _EIGHTHS[eighth, 1] + z * (zz * _sum(_ATAN, zz))
    # The angle is base plus or minus atan t, base a quarter or two: 0 + t, 1 - t, 1 + t or 2 - t.
    base = np.where(steep, 1, np.where(np.signbit(x), 2, 0))
    sign = np.where(steep != np.signbit(x), -1.0, 1.0)
    near = _QUARTERS[base, 0] + sign * _EIGHTHS[eighth, 0]
    lost = sign * _EIGHTHS[eighth, 0] - (near - _QUARTERS[base, 0])
    whole = near + sign * z
    lost = (lost + (sign * z - (whole - near))) + (_QUARTERS[base, 1] + sign * rest)
    angle: Reals = np.copysign(whole + lost, y)
    return angle


def hypot(x: ArrayLike, y: ArrayLike) -> Reals:
    """``sqrt(x x + y y)``, float64, shape of both together; infinite where a square is."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    with np.errstate(over="ignore", under="ignore"):
        out: Reals = np.sqrt(x * x + y * y)
    return out


@lru_cache(maxsize=256)
def direction(angle: float) -> tuple[float, float]:
    """Cosine and sine of one finite angle in radians; kept, because a map asks for its own again and again.

    Angles too far for :func:`cos` lose whole turns first, of the nearest double to 2 pi.
    """
    near = angle if abs(angle) < TURNS else math.fmod(angle, 4.0 * _QUARTERS.item(1, 0))
    return float(cos(near)), float(sin(near))


def interp(x: ArrayLike, xp: ArrayLike, fp: ArrayLike) -> Reals:
    """Values at x of the line through the points (xp, fp), float64, shape of x; as ``np.interp``.

    Parameters
    ----------
    x : where; values before the first point and after the last are those of these points.
    xp : (n,), rising, n >= 1; of several points with one xp the last counts.
    fp : (n,), values.
    """
    given = np.asarray(x, dtype=np.float64)
    at, value = np.asarray(xp, dtype=np.float64), np.asarray(fp, dtype=np.float64)
    if len(at) == 1:
        return np.where(np.isnan(given), np.nan, value[0])
    k = np.minimum(np.maximum(at.searchsorted(given, side="right") - 1, 0), len(at) - 2)
    left, low, high = at[k], value[k], value[k + 1]
    with np.errstate(all="ignore"):
        slope = (high - low) / (at[k + 1] - left)
        out = slope * (given - left) + low
        if not np.isfinite(value).all():
            out = np.where(np.isnan(out), slope * (given - at[k + 1]) + high, out)
            out = np.where(np.isnan(out) & (low == high), low, out)
            out = np.where(np.isnan(given), np.nan, out)
    out = np.where(given == left, low, out)
    out = np.where(given < at[0], value[0], out)
    return np.where(given >= at[-1], value[-1], out)


def _reduced(x: ArrayLike) -> tuple[Reals, NDArray[np.int64]]:
    """What is left of x within an eighth of a turn, and how many quarter turns were taken off."""
    given = np.asarray(x, dtype=np.float64)
    near = np.where(np.abs(given) <= TURNS * _HALF_PI[0], given, np.nan)
    turns = np.rint(near / _HALF_PI[0])
    r = near
    for part in _HALF_PI:
        r = r - turns * part
    return r, np.where(np.isnan(turns), 0.0, turns).astype(np.int64)


def _by_quarter(r: Reals, quarter: NDArray[np.int64]) -> Reals:
    z = r * r
    sine = r + r * (z * _sum(_SIN, z))
    cosine = 1.0 - (0.5 * z - z * z * _sum(_COS, z))
    value = np.where(quarter % 2 == 0, sine, cosine)
    return np.where(quarter % 4 >= 2, -value, value)
