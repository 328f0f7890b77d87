"""How far two polylines are apart: against every pair of a point and a line, and with near linear work."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from lampyris.motion.geometry import deviation as module
from lampyris.motion.geometry.deviation import deviation
from lampyris.typing import Points

STEP = 0.25


def sampled(points: Points) -> Points:
    out = [points[:1]]
    for a, b in pairwise(points):
        parts = max(1, int(np.ceil(np.sqrt(((b - a) ** 2).sum()) / STEP)))
        out.append(a + (np.arange(1, parts + 1) / parts)[:, None] * (b - a))
    return np.concatenate(out)


def by_all_pairs(a: Points, b: Points) -> float:
    """The same by definition."""
    worst = 0.0
    for points, line in ((sampled(a), b), (sampled(b), a)):
        begin, d = (line[:-1], np.diff(line, axis=0)) if len(line) > 1 else (line, np.zeros((1, 2)))
        for p in points:
            size = np.maximum((d * d).sum(axis=1), 1e-300)
            share = np.clip(((p - begin) * d).sum(axis=1) / size, 0.0, 1.0)
            worst = max(worst, float(np.hypot(*(p - begin - share[:, None] * d).T).min()))
    return worst


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["apart", "beside", "shorter", "on cells", "folded"])
def test_it_is_what_all_pairs_give(kind: str) -> None:
    rng = np.random.default_rng(["apart", "beside", "shorter", "on cells", "folded"].index(kind))
    for _ in range(12):
        n, m = rng.integers(1, 40, 2)
        a, b = rng.uniform(0, 20, (n, 2)), rng.uniform(0, 20, (m, 2))
        if kind == "beside":
            b = a + rng.normal(0, 0.1, a.shape)
        if kind == "shorter":
            a = np.cumsum(rng.normal(0, 1, (n, 2)), axis=0)
            b = a[::3]
        if kind == "on cells":
            a, b = np.round(a), np.round(b)
        if kind == "folded":
            a = a * (1e-6, 0.0)  # all in one place
        # What differs by a ten-thousandth of the step is one.
        near = 1e-4 * STEP if kind == "folded" else 1e-9
        assert deviation(a, b, STEP) == pytest.approx(by_all_pairs(a, b), rel=1e-9, abs=near)


def zigzag(n: int) -> Points:
    """Teeth of half a cell, in rows one and a half cells apart."""
    k = np.arange(n)
    row, along = k // 200, k % 200
    x = np.where(row % 2 == 0, along, 199 - along)
    return np.stack((0.5 * x, 1.5 * row + 0.5 * (k % 2)), axis=1)


@pytest.mark.nightly
@pytest.mark.parametrize("beside", ["near", "same", "scribble"])
def test_work_grows_no_faster_than_the_number_of_points(beside: str, monkeypatch: pytest.MonkeyPatch) -> None:
    done = [0]
    squares = module._squares

    def counted(points: Points, begin: Points, end: Points) -> object:
        done[0] += len(points)
        return squares(points, begin, end)

    monkeypatch.setattr(module, "_squares", counted)
    rng, work = np.random.default_rng(5), []
    for n in (1500, 6000):
        a = rng.uniform(0, 1, (n, 2)) if beside == "scribble" else zigzag(n)
        b = a if beside == "same" else a + rng.normal(0, 0.01, a.shape)
        done[0] = 0
        deviation(a, b, STEP)
        work.append(done[0])
    # Four times the points: all pairs would be sixteen times the work, where all lines cross it is eight.
    assert work[1] < (10 if beside == "scribble" else 8) * work[0]
    assert beside == "scribble" or work[1] < 1000 * 6000
