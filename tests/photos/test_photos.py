"""Photographs to maps: criteria, exact thresholds, swarms, cells."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import lampyris
from lampyris.errors import InputError, LampyrisError, SettingError
from lampyris.io.photos.read import median_of
from lampyris.model.settings.photo import CRITERIA
from lampyris.photos.cells import cells_of
from lampyris.photos.criteria import score, worth_of
from lampyris.photos.exact import exact_thresholds
from lampyris.photos.segment import segment_photo

FLOOR = np.full((40, 60), 200, dtype=np.uint8)
FLOOR[10:30, 25:35] = 30


def plain_score(histogram: dict[int, int], thresholds: tuple[int, ...], criterion: str) -> float:
    """The criterion from its definition, level by level; minus infinity with an empty class."""
    n = sum(histogram.values())
    mean = sum(g * h for g, h in histogram.items()) / n
    bounds = (-1, *thresholds, 255)
    total = 0.0
    for low, high in itertools.pairwise(bounds):
        inside = {g: h for g, h in histogram.items() if low < g <= high}
        many = sum(inside.values())
        if not many:
            return -math.inf
        mu = sum(g * h for g, h in inside.items()) / many
        if criterion == "otsu":
            total += many / n * (mu - mean) ** 2
        elif criterion == "kapur":
            total -= sum(h / many * math.log(h / many) for h in inside.values())
        elif mu > 0:
            total += many / n * mu * math.log(mu / mean)
    return total


def drawn(rng: np.random.Generator, levels: int) -> np.ndarray[Any, Any]:
    histogram = np.zeros(256, dtype=np.int64)
    histogram[rng.choice(256, levels, replace=False)] = rng.integers(1, 1000, levels)
    return histogram


@pytest.mark.parametrize("criterion", CRITERIA)
def test_exact_thresholds_are_the_best_of_all(criterion: str) -> None:
    rng = np.random.default_rng(7)
    for k, levels in ((1, 2), (1, 12), (2, 3), (2, 11), (3, 9), (4, 5)):
        for _ in range(4):
            histogram = drawn(rng, levels)
            sparse = {g: int(h) for g, h in enumerate(histogram.tolist()) if h}
            worth = worth_of(histogram, criterion)
            found = exact_thresholds(worth, k)
            assert list(found) == sorted(set(found))
            # A threshold between two levels that occur is worth what the lower of them is.
            best = max(
                plain_score(sparse, some, criterion) for some in itertools.combinations(sorted(sparse), k)
            )
            assert plain_score(sparse, found, criterion) == pytest.approx(best, rel=1e-9, abs=1e-12)
            assert score(worth, found) == pytest.approx(best, rel=1e-9, abs=1e-12)


def test_of_equal_thresholds_the_lowest_are_taken() -> None:
    assert segment_photo(FLOOR).thresholds == (30,)
    assert segment_photo(np.array([[10, 20, 90]], dtype=np.uint8), thresholds=2).thresholds == (10, 20)


def sample(name: str) -> np.ndarray[Any, Any]:
    data = pytest.importorskip("skimage.data")
    picture: np.ndarray[Any, Any] = getattr(data, name)()
    return picture


KNOWN = {
    ("camera", 1): (102,),
    ("camera", 2): (87, 176),
    ("camera", 3): (69, 134, 180),
    ("camera", 4): (46, 100, 145, 182),
    ("coins", 3): (63, 107, 156),
}


@pytest.mark.parametrize(("name", "k"), KNOWN)
def test_known_thresholds_of_sample_pictures(name: str, k: int) -> None:
    made = segment_photo(sample(name), thresholds=k)
    assert made.thresholds == KNOWN[name, k]
    assert made.gap == 0.0


@pytest.mark.parametrize("name", ["camera", "coins", "page", "text"])
def test_thresholds_equal_those_of_scikit_image(name: str) -> None:
    filters = pytest.importorskip("skimage.filters")
    for k in (1, 2, 3):
        theirs = filters.threshold_multiotsu(sample(name), classes=k + 1)
        assert list(segment_photo(sample(name), thresholds=k).thresholds) == theirs.tolist()


@pytest.mark.parametrize("by", ["gso", "igso", "pso"])
def test_swarms_find_few_thresholds_and_come_near_many(by: str) -> None:
    picture = sample("coins")
    for seed in range(2):
        assert segment_photo(picture, thresholds=3, by=by, seed=seed).gap == 0.0
        many = segment_photo(picture, thresholds=5, by=by, seed=seed)
        assert 0.0 <= many.gap <= 0.01
    again = segment_photo(picture, thresholds=5, by=by, seed=1)
    assert again == many


@pytest.mark.nightly
@pytest.mark.parametrize("by", ["gso", "igso", "pso"])
def test_swarms_are_exact_in_nearly_all_runs(by: str) -> None:
    runs = exact = 0
    for name in ("camera", "coins", "page", "text"):
        for k in (1, 2, 3):
            for seed in range(10):
                runs += 1
                exact += segment_photo(sample(name), thresholds=k, by=by, seed=seed).gap == 0.0
    assert runs == 120
    assert exact >= 0.95 * runs
    for name in ("camera", "coins", "page"):
        assert all(
            segment_photo(sample(name), thresholds=5, by=by, seed=seed).gap <= 0.01 for seed in range(10)
        )


def test_a_cell_is_what_more_than_half_of_its_pixels_are() -> None:
    levels = np.array(
        [[9, 9, 0, 0, 9, 0], [9, 0, 0, 9, 0, 9], [9, 9, 9, 9, 0, 0]],
        dtype=np.uint8,
    )  # fmt: skip
    blocked, unknown = cells_of(levels, None, (5,), (1,), 2, 0.5)
    assert blocked.tolist() == [[False, True, True], [True, True, True]]
    # A tie is unknown, and so is a cell of which half reaches beyond the photograph, unless it is a wall for sure.
    assert unknown.tolist() == [[False, False, True], [True, True, True]]
    clear = np.zeros(levels.shape, dtype=bool)
    clear[0, 0] = True
    assert cells_of(levels, clear, (5,), (1,), 2, 0.5)[1][0, 0]
    blocked, unknown = cells_of(levels, None, (5,), (1,), 2, 1.0)
    assert (blocked & unknown)[0, 0], "three quarters are not all"
    assert cells_of(levels, None, (5,), (0, 1), 1, 1.0)[0].sum() == 0


def test_the_median_is_that_of_the_square_with_its_edge_repeated() -> None:
    rng = np.random.default_rng(3)
    levels = rng.integers(0, 256, (7, 9)).astype(np.uint8)
    for side in (3, 5):
        padded = np.pad(levels, side // 2, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, (side, side))
        assert (median_of(levels, side) == np.median(windows, axis=(2, 3))).all()
    assert median_of(levels, 1) is levels


def test_channels_and_classes() -> None:
    colour = np.stack((FLOOR, 255 - FLOOR, np.full_like(FLOOR, 7)), axis=-1)
    red, green = segment_photo(colour, channel="red"), segment_photo(colour, channel="green")
    assert red.thresholds == (30,)
    assert green.thresholds == (55,)
    assert (red.grid.blocked == ~green.grid.blocked).all()
    assert segment_photo(colour, channel="green", free="dark").grid == red.grid
    assert red.counts == (200, 2200)
    assert red.ranges() == ((0, 30, 200), (31, 255, 2200))
    three = segment_photo(np.arange(9, dtype=np.uint8).reshape(3, 3), thresholds=2, free=(2, 1))
    assert three.free == (1, 2)
    assert int(three.grid.blocked.sum()) == three.counts[0]


@pytest.mark.parametrize(
    ("settings", "kind", "part"),
    [
        ({"thresholds": 0}, SettingError, "thresholds"),
        ({"median": 4}, SettingError, "odd"),
        ({"free": (0, 1)}, SettingError, "not all of the classes"),
        ({"free": "grey"}, SettingError, "bright, dark"),
        ({"free": (1, 1)}, SettingError, "each once"),
        (
            {"thresholds": 2},
            InputError,
            "2 grey levels, too few for 2 thresholds; allowed: at most 1 threshold",
        ),
        ({"treshold": 2}, SettingError, "did you mean thresholds?"),
        ({"by": "ga"}, SettingError, "exact, gso, igso, pso"),
        ({"resolution": 0.0}, LampyrisError, "resolution"),
        ({"seed": -1}, SettingError, "seed"),
        ({"max_cells": 100}, LampyrisError, "60 x 40 is 2,400 pixels"),
    ],
)
def test_wrong_arguments_are_named(settings: dict[str, Any], kind: type[Exception], part: str) -> None:
    with pytest.raises(kind, match=part.replace("(", r"\(")):
        segment_photo(FLOOR, **settings)


def test_a_swarm_that_finds_nothing_says_so() -> None:
    two = np.array([[254, 255]], dtype=np.uint8)
    assert segment_photo(two).thresholds == (254,)
    with pytest.raises(InputError, match="found no 3 thresholds"):
        segment_photo(np.array([[0, 1, 2, 3]], dtype=np.uint8), thresholds=3, by="gso")


def test_a_map_of_a_photograph_can_be_planned_on(tmp_path: Path) -> None:
    Image.fromarray(FLOOR).save(tmp_path / "floor.jpg", quality=95)
    made = segment_photo(tmp_path / "floor.jpg", cell=5, resolution=0.05)
    assert made.grid.blocked.sum() == 8
    assert made.grid.name == "floor.jpg"
    plan = lampyris.plan(lampyris.Scene(made.grid, (0, 4), (11, 4)), "astar")
    assert plan
    assert plan.cost > 11
    assert lampyris.SegmentedPhoto.from_dict(made.to_dict()) == made
