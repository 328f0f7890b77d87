"""Ways side by side on one map: what is drawn, where, and the same bytes each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris.errors import UsageError
from lampyris.report.pictures.compare_picture import LOOKS, DrawnPath, Speeds, beside, draw_paths, look_of


def test_every_look_is_its_own() -> None:
    looks = [look_of(k) for k in range(len(LOOKS) * (len(LOOKS) - 1))]
    assert len(set(looks)) == len(looks)
    assert len({dash for _, dash in LOOKS}) == len({colour for colour, _ in LOOKS}) == len(LOOKS)


def test_a_line_beside_a_straight_one_is_on_its_right() -> None:
    xy = np.array([[0.0, 5.0], [4.0, 5.0], [9.0, 5.0]])  # to the right; rows grow downwards
    assert beside(xy, 0.5).tolist() == [[0.0, 5.5], [4.0, 5.5], [9.0, 5.5]]
    assert beside(xy, -0.5)[:, 1].tolist() == [4.5] * 3
    assert beside(xy[::-1], 0.5)[:, 1].tolist() == [4.5] * 3
    assert beside(xy, 0.0) is xy


def test_beside_keeps_its_distance_from_every_piece() -> None:
    rng = np.random.default_rng(5)
    steps = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (1, -1)])
    for _ in range(50):
        xy = np.cumsum(steps[rng.integers(0, 2, 12)], axis=0).astype(np.float64)
        moved = beside(xy, 0.3)
        assert len(moved) == len(xy)
        for k in range(len(xy) - 1):
            along = (xy[k + 1] - xy[k]) / np.hypot(*(xy[k + 1] - xy[k]))
            for point in moved[k : k + 2]:
                off = point - xy[k]
                assert along[0] * off[1] - along[1] * off[0] == pytest.approx(0.3)


def test_a_way_that_turns_back_and_one_that_waits() -> None:
    back = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 0.0]])
    moved = beside(back, 0.2)
    assert np.isfinite(moved).all()
    assert np.hypot(*(moved - back).T).max() <= 0.3 + 1e-12
    waits = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]])
    assert beside(waits, 0.2).tolist() == [[0.0, 0.2], [1.0, 0.2]]
    assert len(beside(waits[:2], 0.2)) == 1


def _draw(out: Path) -> None:
    grid = lampyris.load_grid("guide")
    way = np.array([[0.0, 9.0], [3.0, 6.0], [7.0, 0.0]])
    line = Speeds("one", "8 s", np.linspace(0, 8, 9), np.full(9, 0.5), "m/s", path=0)
    other = Speeds("two", "", np.linspace(0, 8, 9), np.full(9, 2.0), "VU")
    draw_paths(
        grid, (0, 9), (7, 0), [DrawnPath("one", "cost 1", way), DrawnPath("two", "no path", np.zeros((0, 2)))], out,
        title="two planners on a map", subtitle="words", speeds=[line, other], speeds_title="speeds",
        tracks=[way[::-1]],
    )  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("suffix", [".png", pytest.param(".svg", marks=pytest.mark.nightly)])
def test_the_same_bytes_twice(tmp_path: Path, suffix: str) -> None:
    for name in ("a", "b"):
        _draw(tmp_path / f"{name}{suffix}")
    first = (tmp_path / f"a{suffix}").read_bytes()
    assert first == (tmp_path / f"b{suffix}").read_bytes()
    assert len(first) > 5000


def test_another_suffix_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="SUFFIX"):
        _draw(tmp_path / "a.jpg")
