"""Elementary functions: within two units in the last place of the mathematics library, and the edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris import elementary

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
