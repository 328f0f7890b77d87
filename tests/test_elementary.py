"""Elementary functions: within two units in the last place of the mathematics library, and the edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris._core import elementary

RANGES = [
    ("exp", -708.0, 709.7),
    ("exp", -2.0, 2.0),
    ("exp", -1e-8, 1e-8),
    ("log", 1e-300, 1e-290),
    ("log", 0.5, 2.0),
    ("log", 0.999, 1.001),
    ("log", 1.0, 1e308),
    ("sin", -4.0, 4.0),
    ("cos", -4.0, 4.0),
    ("sin", -1.6e6, 1.6e6),
    ("cos", -1.6e6, 1.6e6),
]


@pytest.mark.parametrize(("name", "low", "high"), RANGES)
def test_within_two_units_in_the_last_place(name: str, low: float, high: float) -> None:
    x = np.random.default_rng(1).uniform(low, high, 20_000)
    known = np.array([getattr(math, name)(v) for v in x.tolist()])
    # The library may itself be one unit off.
    off = np.abs(getattr(elementary, name)(x) - known) / np.spacing(np.abs(known))
    assert off.max() <= 2.0


@pytest.mark.parametrize("spread", [0.0, 1.0, 20.0, 300.0])
def test_angles_within_two_units_in_the_last_place(spread: float) -> None:
    rng = np.random.default_rng(2)
    y, x = (rng.uniform(-1, 1, 20_000) * 10.0 ** rng.uniform(-spread, spread, 20_000) for _ in range(2))
    # Every other one beside a ratio where the eighths change, or on a diagonal.
    y[::2] = x[::2] * (rng.integers(-33, 34, 10_000) / 16 + rng.integers(-2, 3, 10_000) * 1e-16)
    known = np.array([math.atan2(a, b) for a, b in zip(y.tolist(), x.tolist(), strict=True)])
    with np.errstate(all="raise"):
        angle = elementary.atan2(y, x)
    off = np.abs(angle - known) / np.spacing(np.abs(known))
    assert off.max() <= 2.0


def test_angles_at_the_edges() -> None:
    values = [0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1.7e308, -1.7e308, math.inf, -math.inf]
    with np.errstate(all="raise"):
        for y in values:
            for x in values:
                got, known = float(elementary.atan2(y, x)), math.atan2(y, x)
                assert got == pytest.approx(known, rel=3e-16, abs=0.0), (y, x)
                assert math.copysign(1.0, got) == math.copysign(1.0, known), (y, x)
                assert abs(got) <= math.pi
        assert np.isnan(elementary.atan2([math.nan, 1.0, math.nan], [1.0, math.nan, math.nan])).all()
    assert elementary.atan2(np.ones((3, 1)), np.ones(2)).shape == (3, 2)
    assert elementary.atan2(1.0, 1.0).shape == ()


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_close_to_the_zeros_nothing_is_lost(name: str) -> None:
    quarters = np.arange(-50_000, 50_000, 7) * (math.pi / 2)
    known = np.array([getattr(math, name)(v) for v in quarters.tolist()])
    off = np.abs(getattr(elementary, name)(quarters) - known) / np.spacing(np.abs(known))
    assert off.max() <= 2.0


def test_edges() -> None:
    with np.errstate(all="raise"):
        assert elementary.exp([0.0, -0.0, 800.0, -800.0]).tolist() == [1.0, 1.0, math.inf, 0.0]
        assert elementary.exp([math.inf, -math.inf]).tolist() == [math.inf, 0.0]
        assert np.isnan(elementary.exp(math.nan))
        assert elementary.log([1.0, 0.0, math.inf]).tolist() == [0.0, -math.inf, math.inf]
        assert np.isnan(elementary.log([-1.0, math.nan])).all()
        assert elementary.sin(0.0) == 0.0
        assert elementary.cos(0.0) == 1.0
        assert np.isnan(elementary.sin([2e6, math.inf, math.nan])).all()
    least = elementary.exp(-744.5)
    assert 0 < least <= 2 * np.nextafter(0.0, 1.0) + math.exp(-744.5)


def test_shapes_are_kept() -> None:
    for f in (elementary.exp, elementary.log, elementary.sin, elementary.cos):
        assert f(np.ones((2, 3))).shape == (2, 3)
        assert f(1.0).shape == ()


def test_the_bits_are_these() -> None:
    # Written down once: another machine, another NumPy must give the very same bits.
    x = np.linspace(-20.0, 20.0, 4001)
    got = [f(x) for f in (elementary.exp, elementary.sin, elementary.cos)] + [elementary.log(x + 20.5)]
    assert _digest(got) == 1246083479956840651
    got = [elementary.atan2(x, y) for y in (1.0, -0.3, 7.0)]
    assert _digest(got) == 75736930366447475


def _digest(got: list[np.ndarray]) -> int:
    total = 0
    for values in got:
        for bits in values.view(np.uint64).tolist():
            total = (total * 1_000_003 + bits) % 2**61
    return total


def line(x: float, xp: list[float], fp: list[float]) -> float:
    """The line through points, one product and one sum at a time."""
    if x < xp[0]:
        return fp[0]
    k = max(j for j in range(len(xp)) if xp[j] <= x)
    if k == len(xp) - 1 or x == xp[k]:
        return fp[k]
    return (fp[k + 1] - fp[k]) / (xp[k + 1] - xp[k]) * (x - xp[k]) + fp[k]


@pytest.mark.parametrize("seed", range(20))
def test_the_line_between_points_bit_by_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 12))
    # Whole numbers: some points are one above the other, and some x are just at a point.
    xp = np.sort(rng.integers(0, 9, n)) * float(rng.choice([1.0, 0.37]))
    fp = rng.normal(size=n)
    x = np.concatenate((rng.uniform(-2.0, 11.0, 40), xp, [-np.inf, np.inf]))
    got = elementary.interp(x, xp, fp)
    assert got.tolist() == [line(at, xp.tolist(), fp.tolist()) for at in x.tolist()]
    np.testing.assert_allclose(got, np.interp(x, xp, fp), rtol=1e-12, atol=1e-12)


def test_the_line_between_points_at_the_edges() -> None:
    inf, nan = np.inf, np.nan
    assert elementary.interp([0.5, 1.0, 1.5, 2.0, 2.5], [0, 1, 2, 3], [5, 6, inf, inf]).tolist() == [
        5.5, 6.0, inf, inf, inf,
    ]  # fmt: skip
    assert elementary.interp([0.5], [0, 1], [inf, 5]).tolist() == [inf]
    assert np.isnan(elementary.interp([nan, nan], [0, 1], [inf, inf])).all()
    assert np.isnan(elementary.interp(nan, [0], [1]))
    assert elementary.interp(np.zeros((2, 3)), [1], [4]).tolist() == [[4.0] * 3] * 2
    assert elementary.interp(0.25, [0, 1], [0, 4]) == 1.0


def test_lengths() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 1000))
    assert elementary.hypot(x, y).tolist() == [
        math.sqrt(a * a + b * b) for a, b in zip(x.tolist(), y.tolist(), strict=True)
    ]
    assert elementary.hypot(3, -4) == 5.0
    assert elementary.hypot(1e200, 1.0) == np.inf


def test_directions() -> None:
    assert elementary.direction(0.0) == (1.0, 0.0)
    assert elementary.direction(-0.5) == (float(elementary.cos(-0.5)), float(elementary.sin(-0.5)))
    # Beyond the range of sin and cos it is still a direction, near enough.
    cos, sin = elementary.direction(1e9)
    assert (cos, sin) == pytest.approx((math.cos(1e9), math.sin(1e9)), abs=1e-7)
    cos, sin = elementary.direction(-1e300)
    assert cos * cos + sin * sin == pytest.approx(1.0)
