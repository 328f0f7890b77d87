"""What benchmarks compare while they time: who answers wrongly is found. Nothing is timed here."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lampyris.model.moves import MOVES

ROOT = Path(__file__).parents[1]
pytestmark = [
    pytest.mark.source,
    pytest.mark.skipif(not (ROOT / "benchmarks").is_dir(), reason="benchmarks are not shipped"),
]


@pytest.fixture(autouse=True)
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))


def test_a_mender_that_does_nothing_is_found() -> None:
    """Its field is right again once the cells are free again; in between it is not."""
    from benchmarks.bench_repair import Bench

    bench, rng = Bench(20, MOVES["octile"]), np.random.default_rng(1)
    cells = bench.pick(5, "near", rng)
    assert set(bench.round(cells)) == {"mend", "solve", "to robot", "D* Lite", "A*"}
    mend = bench.mender.mend
    bench.mender = SimpleNamespace(mend=lambda **_: mend())  # type: ignore[assignment]
    with pytest.raises(AssertionError):
        bench.round(cells)


def test_a_session_that_is_deaf_is_found() -> None:
    from benchmarks.bench_repair import Bench

    bench = Bench(20, MOVES["octile"])
    x, y = bench.robot
    around = [(x + dx, y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]
    cells = [(u, v) for u, v in around if bench.free[v, u]]
    plan = bench.sessions["D* Lite"].plan()
    deaf: Any = SimpleNamespace(plan=lambda change: plan)
    bench.sessions["D* Lite"] = deaf
    with pytest.raises(AssertionError):
        bench.round(cells)
