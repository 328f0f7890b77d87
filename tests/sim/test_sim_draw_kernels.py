"""Draws by kernels are those of the functions in NumPy, in the plain form and compiled."""

from collections.abc import Callable

import numpy as np
import pytest

from lampyris.kernels.simulation import draws
from lampyris.sim.traffic.obstacle_draws import WALKERS, key_of, places, steps

FORMS = (lambda kernel: kernel.run_plain, lambda kernel: kernel.compiled())


@pytest.mark.parametrize("form", FORMS, ids=["plain", "compiled"])
def test_steps(form: Callable) -> None:
    keys, counts = [key_of(7, WALKERS, k) for k in range(3)], [5, 1, 12]
    out = np.empty(9 * (sum(counts) + 6))
    form(draws.draw_steps)(np.array(keys, dtype=np.uint64), np.array(counts), 4, 9, out)
    expected = [steps(key, count, 4, 9) for key, count in zip(keys, counts, strict=True)]
    assert np.array_equal(out, np.concatenate(expected, axis=1).reshape(-1))


@pytest.mark.parametrize("form", FORMS, ids=["plain", "compiled"])
@pytest.mark.parametrize("share", [0.9, 0.05, 0.004])
def test_places(form: Callable, share: float) -> None:
    """With few open cells chance does not find one, and with fewer than walkers some have none."""
    width, height, count = 40, 30, 12
    for seed in range(4):
        opened = np.zeros((height + 2, width + 2), dtype=np.uint8)
        opened[1:-1, 1:-1] = np.random.default_rng(seed).random((height, width)) < share
        opened, key = opened.reshape(-1), key_of(seed, WALKERS, 0)
        left = set(np.flatnonzero(opened).tolist())
        expected = []
        for number in places(
            key, 3, count, (width, height), left.__contains__, lambda left=left: np.array(sorted(left))
        ):
            left.discard(number)
            expected.append(number)
        found = np.zeros(count, dtype=np.int64)
        keys = np.array([key], dtype=np.uint64)
        placed = form(draws.place)(keys, 3, width, height, opened.copy(), found)
        assert found[:placed].tolist() == expected
        assert (placed < count) == (share == 0.004)
