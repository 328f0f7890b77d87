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
    total = 0
    for values in got:
        for bits in values.view(np.uint64).tolist():
            total = (total * 1_000_003 + bits) % 2**61
    assert total == 1246083479956840651
