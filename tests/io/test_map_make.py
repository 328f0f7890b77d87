"""Recipes: the same seed gives the same cells, settings are checked, gates are only where they are meant."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pytest

from lampyris.errors import LampyrisError
from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.make import RECIPES, RectangleEdit, make, make_ground


def test_draws_are_the_raw_stream() -> None:
    raw = np.random.PCG64(np.random.SeedSequence(7)).random_raw(4)
    draw = Draw(7)
    assert draw.below(1000) == (int(raw[0]) >> 32) * 1000 // 2**32
    assert draw.unit() == (int(raw[1]) >> 11) / 2**53
    assert draw.units(1, 2).tolist() == [[(int(r) >> 11) / 2**53 for r in raw[2:]]]
    assert {Draw(s).between(2, 4) for s in range(50)} == {2, 3, 4}


# Fixed when the recipes were written: a change here changes every map that somebody made by its seed.
STABLE = {
    "caves": "301dbfe4",
    "gates": "665fd712",
    "hills": "9682a79c",
    "maze": "4d327ba2",
    "office": "acc6ff59",
    "random": "f13059e9",
    "rooms": "8b764a03",
    "street": "7b1a7460",
    "warehouse": "e23f412b",
}


@pytest.mark.parametrize("recipe", RECIPES)
def test_same_seed_same_cells(recipe: str) -> None:
    one, two, other = (make(recipe, 40, 30, seed) for seed in (5, 5, 6))
    assert one.shape == (30, 40)
    assert (one == two).all()
    assert (one != other).any()
    assert hashlib.sha256(np.packbits(one).tobytes()).hexdigest()[:8] == STABLE[recipe]


def test_same_seed_same_terrain() -> None:
    one, two, other = (make_ground("hills", 40, 30, seed) for seed in (5, 5, 6))
    assert one.terrain is not None
    assert two.terrain is not None
    assert other.terrain is not None
    assert one.terrain.dtype == np.uint8
    assert (one.terrain == two.terrain).all()
    assert (one.terrain != other.terrain).any()
    assert hashlib.sha256(one.terrain.tobytes()).hexdigest()[:8] == "32c82bca"
    assert (make("hills", 40, 30, 5) == one.blocked).all()
    assert {r for r in RECIPES if make_ground(r, 40, 30, 5).terrain is not None} == {"hills"}


@pytest.mark.parametrize("density", [0.0, 0.1, 0.5, 1.0])
def test_random_has_its_density(density: float) -> None:
    share = make("random", 200, 200, 1, density=density).mean()
    assert abs(share - density) < 0.02


def _gates(blocked: np.ndarray) -> list[tuple[int, int]]:
    height, width = blocked.shape
    return [
        (x, y)
        for y in range(height)
        for x in range(width)
        if not blocked[y, x]
        and (
            (0 < x < width - 1 and blocked[y, x - 1] and blocked[y, x + 1])
            or (0 < y < height - 1 and blocked[y - 1, x] and blocked[y + 1, x])
        )
    ]


@pytest.mark.parametrize("seed", range(12))
def test_gates_only_where_openings_are_narrow(seed: int) -> None:
    assert _gates(make("gates", 60, 45, seed, narrow=0.0, clutter=400)) == []
    assert _gates(make("gates", 60, 45, seed, narrow=1.0, clutter=400))


@pytest.mark.parametrize("seed", range(6))
def test_rooms_are_connected_and_kept_cells_free(seed: int) -> None:
    from scipy.ndimage import label

    keep = ((0, 0), (59, 44), (30, 20))
    blocked = make("gates", 60, 45, seed, clutter=400, keep=keep)
    assert label(~blocked)[1] == 1
    for x, y in keep:
        assert not blocked[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].any()


@pytest.mark.parametrize("seed", range(6))
def test_large_things_first_block_more_and_make_no_gates(seed: int) -> None:
    small = make("gates", 60, 45, seed, narrow=0.0, clutter=2000, bulk=8)
    large = make("gates", 60, 45, seed, narrow=0.0, clutter=2000, bulk=8, large=2000)
    assert large.mean() > small.mean() + 0.01
    assert _gates(large) == []


def test_edits_are_written_last() -> None:
    blocked = make(
        "random",
        8,
        8,
        0,
        density=0.0,
        edits=[RectangleEdit(1, 2, 3, 2, True), RectangleEdit(2, 2, 1, 1, False)],
    )
    assert np.argwhere(blocked).tolist() == [[2, 1], [2, 3], [3, 1], [3, 2], [3, 3]]


@pytest.mark.parametrize(
    ("call", "code", "says"),
    [
        ({"recipe": "gatez"}, "RECIPE", "did you mean gates?"),
        ({"denisty": 0.1}, "RECIPE", "did you mean density?"),
        ({"density": 1.5}, "RECIPE", "density 1.5"),
        ({"density": float("nan")}, "RECIPE", "nan"),
        ({"width": 3}, "MAP_SIZE", "width 3"),
        ({"height": 2.0}, "MAP_SIZE", "height 2.0"),
        ({"seed": -1}, "SEED", "-1"),
        ({"seed": True}, "SEED", "True"),
        ({"width": 4097, "height": 4096}, "MAP_TOO_LARGE", "4097 x 4096"),
        ({"recipe": "gates", "room": 2}, "RECIPE", "room 2"),
        ({"recipe": "gates", "wide": 2}, "RECIPE", "wide 2"),
        ({"recipe": "gates", "large": -1}, "RECIPE", "large -1"),
    ],
)
def test_refused(call: dict[str, Any], code: str, says: str) -> None:
    given = {"recipe": "random", "width": 10, "height": 10, "seed": 0, **call}
    with pytest.raises(LampyrisError) as caught:
        make(**given)
    assert caught.value.code == code
    assert says in str(caught.value)


def test_recipes_tell_their_settings() -> None:
    assert dict(RECIPES["random"].settings) == {"density": 0.2}
    assert RECIPES["gates"].settings["room"] == 8
