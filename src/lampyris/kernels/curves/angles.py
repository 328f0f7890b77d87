"""Sine, cosine and arc tangent of one number in kernels, with the same bits in both forms and on every machine.

The method is that of :mod:`lampyris._core.elementary`: an exact reduction of the argument, then a Taylor sum by
Horner's rule, in ``+ - * /`` alone. The compiler contracts nothing.
"""

from __future__ import annotations

from math import floor, sqrt

from lampyris.kernels._jit import kernel

PI = 3.141592653589793
TURN = 6.283185307179586
QUARTER = 1.5707963267948966

# pi / 2 in three parts, the first two of 33 bits: multiples of them are exact.
_HIGH, _MIDDLE, _LOW = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
_ATAN_EIGHTHS = (
    0.0,
    0.12435499454676144,
    0.24497866312686414,
    0.35877067027057225,
    0.4636476090008061,
    0.5585993153435624,
    0.6435011087932844,
    0.7188299996216245,
    0.7853981633974483,
)
"""atan(k / 8)."""


@kernel(inline=True)
def sine_cosine(x):
    """Sine and cosine of an angle within a million quarter turns."""
    k = floor(x * 0.6366197723675814 + 0.5)
    r = ((x - k * _HIGH) - k * _MIDDLE) - k * _LOW
    z = r * r
    s = -7.647163731819816e-13
    s = s * z + 1.6059043836821613e-10
    s = s * z - 2.505210838544172e-08
    s = s * z + 2.7557319223985893e-06
    s = s * z - 1.984126984126984e-04
    s = s * z + 8.333333333333333e-03
    s = s * z - 1.6666666666666666e-01
    s = r + r * (z * s)
    c = 4.779477332387385e-14
    c = c * z - 1.1470745597729725e-11
    c = c * z + 2.08767569878681e-09
    c = c * z - 2.755731922398589e-07
    c = c * z + 2.48015873015873e-05
    c = c * z - 1.388888888888889e-03
    c = c * z + 4.1666666666666664e-02
    c = 1.0 - (0.5 * z - z * z * c)
    quarter = int(k) & 3
    if quarter == 0:
        return s, c
    if quarter == 1:
        return c, -s
    if quarter == 2:
        return -s, -c
    return -c, s


@kernel(inline=True)
def atan2(y, x):
    """Angle of the point (x, y), in [-pi, pi]; 0 for the origin."""
    high = abs(y)
    wide = abs(x)
    steep = high > wide
    less = wide if steep else high
    more = high if steep else wide
    if more == 0.0:
        return 0.0
    # atan t = atan c + atan((t - c) / (1 + c t)) with the nearest eighth c leaves at most 1/16.
    k = int(8.0 * (less / more) + 0.5)
    c = 0.125 * k
    t = (less - c * more) / (more + c * less)
    z = t * t
    a = -6.666666666666667e-02
    a = a * z + 7.692307692307693e-02
    a = a * z - 9.090909090909091e-02
    a = a * z + 1.1111111111111111e-01
    a = a * z - 1.4285714285714285e-01
    a = a * z + 2.0e-01
    a = a * z - 3.333333333333333e-01
    angle = _ATAN_EIGHTHS[k] + (t + t * (z * a))
    if steep:
        angle = QUARTER - angle
    if x < 0.0:
        angle = PI - angle
    return -angle if y < 0.0 else angle


@kernel(inline=True)
def acos(x):
    """Angle in [0, pi] of a cosine in [-1, 1]."""
    return atan2(sqrt((1.0 - x) * (1.0 + x)), x)


@kernel(inline=True)
def wrapped(angle):
    """The same angle in [-pi, pi)."""
    return angle - TURN * floor((angle + PI) / TURN)
