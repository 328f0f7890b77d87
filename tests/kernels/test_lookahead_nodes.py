"""Nodes at a distance ahead: beside a search node by node, on paths of every kind, in both forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lampyris.motion.geometry import deviation as deviation_of
from lampyris.motion.laws import rpp
from reference.kernel_forms import use

Points = Any


def paths(rng: np.random.Generator) -> list[Points]:
    n = int(rng.integers(2, 300))
    steps = rng.normal(size=(n, 2))
    fold = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
    stays = np.concatenate((fold[np.arange(9000) % 4], np.cumsum(np.full((30, 2), 0.1), axis=0)))
    return [
        np.cumsum(steps, axis=0),
        np.cumsum(np.abs(steps), axis=0),
        0.01 * steps,
        stays[-int(rng.integers(2, 9030)) :],
    ]


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_it_is_the_first_node_that_is_so_far_away(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    rng = np.random.default_rng(1)
    moved = 0
    for _ in range(4):
        for path in paths(rng):
            xy = path[-600:] if form == "plain" else path
            distance = float(rng.choice([0.3, 0.6, 5.0]))
            node = rpp.nodes_ahead(xy, distance, np.arange(len(xy), dtype=np.int64))
            for k in np.unique(rng.integers(0, len(xy), 60)).tolist():
                dx, dy = (xy[k:] - xy[k]).T
                far = dx * dx + dy * dy >= distance * distance
                assert node[k] == (k + int(np.argmax(far)) if far.any() else len(xy) - 1)
                moved += int(node[k] > k)
    assert moved > 300


@pytest.mark.parametrize("n", [63, 64, 65, 128, 4096, 4097, 8256])
@pytest.mark.parametrize("distance", [0.5, 0.6])
def test_blocks_end_where_the_path_leaves(n: int, distance: float) -> None:
    """Ties, lengths of whole blocks, and a path that leaves for one node, the last of a block or any other."""
    for away in sorted({n - 1, n // 2, 63 % n, 64 % n, 4095 % n, 4096 % n}):
        xy = np.array([[0.0, 0.0], [0.5, 0.0]])[np.arange(n) % 2]
        xy[away] = (0.0, 3.0)
        node = rpp.nodes_ahead(xy, distance, np.arange(n, dtype=np.int64))
        for k in sorted({0, 1, away // 2, max(away - 1, 0), away, min(away + 1, n - 1)}):
            dx, dy = (xy[k:] - xy[k]).T
            far = dx * dx + dy * dy >= distance * distance
            assert node[k] == (k + int(np.argmax(far)) if far.any() else n - 1)


class Counted(list[float]):
    """A list that counts how often it is read."""

    reads = 0

    def __getitem__(self, k: Any) -> Any:
        Counted.reads += 1
        return super().__getitem__(k)


def folded(n: int) -> Points:
    """A path to and fro between two points."""
    return np.array([[0.0, 0.0], [0.5, 0.0]])[np.arange(n) % 2]


@pytest.mark.nightly
def test_a_folded_path_takes_no_quadratic_number_of_reads(monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, "plain")
    monkeypatch.setattr(type(rpp.advance_to_distance), "_easy", lambda _, array: Counted(array.tolist()))
    work = []
    for n in (1000, 4000):
        Counted.reads = 0
        rpp.nodes_ahead(folded(n), 0.6, np.arange(n, dtype=np.int64))
        work.append(Counted.reads)
    assert 0 < work[1] < 6 * work[0], work


@pytest.mark.parametrize("noise", [0.0, 1e-12, 1e-6])
def test_the_deviation_of_a_folded_path_compares_no_quadratic_number_of_pairs(
    noise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    squares, work = deviation_of._squares, []
    for n in (1000, 4000):
        pairs: list[int] = []

        def counted(*given: Any, pairs: list[int] = pairs) -> Any:
            pairs.append(len(given[0]))
            return squares(*given)

        monkeypatch.setattr(deviation_of, "_squares", counted)
        path = folded(n) + np.random.default_rng(n).normal(scale=1.0, size=(n, 2)) * noise
        found = deviation_of.deviation(path, path + 0.1, 0.25)
        assert found == pytest.approx(np.hypot(0.1, 0.1), abs=1e-4)
        work.append(sum(pairs))
    assert 0 < work[1] < 6 * work[0], work
