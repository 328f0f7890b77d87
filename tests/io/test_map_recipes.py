"""Each recipe: one region whatever its settings, and what makes it what its name says."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import label

from lampyris.errors import SettingError
from lampyris.io.maps.recipes.make import RECIPES, make, make_ground
from lampyris.io.maps.recipes.recipe import RecipeSetting

CONNECTED = [name for name, row in RECIPES.items() if row.connected]
SETTINGS = [(name, s) for name, row in RECIPES.items() for s in row.table]
NUMBERS = [(name, s) for name, s in SETTINGS if s.least is not None]


def made_or_too_small(recipe: str, width: int, height: int, seed: int, **settings: Any) -> np.ndarray | None:
    """The map, or None where it was refused for its size, with the size it needs."""
    try:
        return make(recipe, width, height, seed, **settings)
    except SettingError as refused:
        if refused.code != "MAP_SIZE" or "or more" not in refused.allowed:
            raise
        return None


def is_gate(blocked: np.ndarray) -> np.ndarray:
    """Free cells between two walls that face each other."""
    pad = np.pad(blocked, 1)
    gate: np.ndarray = ~blocked & ((pad[1:-1, :-2] & pad[1:-1, 2:]) | (pad[:-2, 1:-1] & pad[2:, 1:-1]))
    return gate


def test_all_the_kinds_are_there_and_only_random_may_fall_apart() -> None:
    kinds = {"caves", "gates", "hills", "maze", "office", "random", "rooms", "street", "warehouse"}
    assert set(RECIPES) == kinds
    assert set(RECIPES) - set(CONNECTED) == {"random"}
    assert label(~make("random", 60, 60, 1, density=0.3))[1] > 1


@pytest.mark.commit(24)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("recipe", CONNECTED)
def test_one_region_at_many_sizes(recipe: str, seed: int) -> None:
    width, height = 27 + 13 * seed, 27 + 11 * ((5 * seed) % 12)
    blocked = make(recipe, width, height, seed)
    assert blocked.shape == (height, width)
    assert blocked.dtype == np.bool_
    assert label(~blocked)[1] == 1
    assert 0.1 < 1 - blocked.mean() < 0.98


@pytest.mark.parametrize("recipe", CONNECTED)
@pytest.mark.parametrize("shape", [(4, 4), (5, 30), (30, 5), (10, 10), (200, 30), (13, 27)])
def test_small_and_long_maps_are_made_or_refused_by_name(recipe: str, shape: tuple[int, int]) -> None:
    for seed in range(5):
        blocked = made_or_too_small(recipe, *shape, seed)
        assert blocked is None or label(~blocked)[1] == 1


@pytest.mark.commit(15)
@pytest.mark.parametrize(
    ("recipe", "setting"), NUMBERS, ids=lambda p: p.name if isinstance(p, RecipeSetting) else p
)
def test_one_region_at_both_ends_of_every_setting(recipe: str, setting: RecipeSetting) -> None:
    for value in (setting.least, setting.most):
        if setting.name in ("clutter", "large") and value == setting.most:
            value = 2000  # the most there may be takes half a minute and is no other case
        value = int(value or 0) if setting.kind == "whole number" else value
        for seed in range(3):
            blocked = made_or_too_small(recipe, 90, 70, seed, **{setting.name: value})
            assert blocked is None or label(~blocked)[1] == 1 or recipe == "random"


@pytest.mark.commit(50)
@pytest.mark.parametrize("seed", range(25))
@pytest.mark.parametrize("recipe", CONNECTED)
def test_one_region_with_any_settings(recipe: str, seed: int) -> None:
    rng = np.random.Generator(np.random.PCG64(seed))
    given: dict[str, Any] = {}
    for s in RECIPES[recipe].table:
        if s.kind == "number":
            given[s.name] = float(rng.random())
        elif s.kind == "whole number":
            most = min(int(max(2 * s.default, s.least or 0, 3)), int(s.most or 0))
            given[s.name] = int(rng.integers(int(s.least or 0), most + 1))
    blocked = made_or_too_small(recipe, int(rng.integers(20, 150)), int(rng.integers(20, 150)), seed, **given)
    assert blocked is None or label(~blocked)[1] == 1


@pytest.mark.parametrize(
    ("recipe", "setting"), SETTINGS, ids=lambda p: p.name if isinstance(p, RecipeSetting) else p
)
def test_settings_have_a_range_and_keep_it(recipe: str, setting: RecipeSetting) -> None:
    assert setting.what
    assert setting.check(setting.default) == setting.default
    wrong: list[Any] = [None, "x", [[1, 2, 3]]]
    if setting.least is not None and setting.most is not None:
        step = 1 if setting.kind == "whole number" else 1e-9
        wrong += [True, float("nan"), setting.least - step, setting.most + step]
        wrong += [float(setting.default) + 0.5] if setting.kind == "whole number" else []
        assert f"{setting.least:g} to {setting.most:g}" in setting.range
    for value in wrong:
        with pytest.raises(SettingError, match=setting.name) as caught:
            make(recipe, 60, 60, 0, **{setting.name: value})
        assert caught.value.code == "RECIPE"
        assert caught.value.allowed == setting.range


def test_settings_are_read_from_words() -> None:
    row = RECIPES["gates"]
    assert row.setting("room").read("7") == 7
    assert row.setting("narrow").read("0.25") == 0.25
    assert row.setting("keep").read("1,2;30,4") == ((1, 2), (30, 4))
    for name, word in (("room", "7.5"), ("narrow", "nan"), ("keep", "1,2,3"), ("keep", "a")):
        with pytest.raises(SettingError, match=name):
            row.setting(name).read(word)


@pytest.mark.parametrize(("corridor", "wall", "size"), [(1, 1, 41), (3, 1, 45), (4, 2, 62), (2, 3, 50)])
def test_a_perfect_maze_is_a_tree(corridor: int, wall: int, size: int) -> None:
    for seed in range(4):
        blocked = make("maze", size, size, seed, corridor=corridor, wall=wall)
        pitch = corridor + wall
        n = (size - wall) // pitch
        left = wall + (size - wall - n * pitch) // 2
        # One cell of each lattice cell and of each possible opening says it all.
        cells = ~blocked[left::pitch, left::pitch][:n, :n]
        right = ~blocked[left::pitch, left + corridor :: pitch][:n, : n - 1]
        below = ~blocked[left + corridor :: pitch, left::pitch][: n - 1, :n]
        assert cells.all()
        assert int(right.sum() + below.sum()) == n * n - 1  # with one region: a tree
        assert label(~blocked)[1] == 1
        assert (~blocked).sum() == n * n * corridor**2 + (n * n - 1) * corridor * wall


def test_loops_open_a_maze() -> None:
    free = [(~make("maze", 61, 61, 3, loops=v)).sum() for v in (0.0, 0.3, 1.0)]
    assert free[0] == 2 * 30 * 30 - 1
    assert free[0] < free[1] < free[2] == 30 * 30 + 2 * 30 * 29


def test_rooms_have_no_door_more_than_asked_for() -> None:
    for seed in range(8):
        blocked = make("rooms", 80, 60, seed, room=3, door=1, loops=0.0)
        doors = is_gate(blocked)
        rooms = label(~blocked & ~doors)[1]
        assert doors.sum() == rooms - 1
        more = make("rooms", 80, 60, seed, room=3, door=1, loops=1.0)
        assert is_gate(more).sum() > rooms
        assert label(~more & ~is_gate(more))[1] == rooms


@pytest.mark.parametrize("recipe", ["rooms", "office", "maze", "warehouse"])
def test_buildings_have_walls_around(recipe: str) -> None:
    blocked = make(recipe, 150, 110, 4)
    assert blocked[0].all()
    assert blocked[:, 0].all()
    assert blocked[:, -1].all()
    if recipe == "warehouse":  # its docks
        docks = label(~blocked[-1])[1]
        assert 5 < docks < 20
        assert ((~blocked[-1]).sum(), (~blocked[-3]).sum()) == (4 * docks, 4 * docks)
    else:
        assert blocked[-1].all()


def test_wide_doors_and_spread_desks_make_no_gates() -> None:
    for seed in range(6):
        assert not is_gate(make("office", 160, 100, seed)).any()


def test_caves_are_smooth() -> None:
    blocked = make("caves", 120, 120, 3, rounds=8)
    pad = np.pad(blocked, 1, constant_values=True)
    alone = ~blocked & pad[1:-1, :-2] & pad[1:-1, 2:] & pad[:-2, 1:-1] & pad[2:, 1:-1]
    assert not alone.any()
    assert make("caves", 20, 20, 0, fill=1.0).sum() == 399
    # Doubled caves have wider halls: less of their floor lies at a wall.
    at_wall = []
    for doublings in range(4):
        free = ~make("caves", 200, 200, 3, fill=0.44, doublings=doublings)
        inner = free[1:-1, 1:-1] & free[:-2, 1:-1] & free[2:, 1:-1] & free[1:-1, :-2] & free[1:-1, 2:]
        at_wall.append(1 - inner.sum() / free.sum())
    assert all(b < 0.8 * a for a, b in pairwise(at_wall))


def test_streets_cut_and_bend() -> None:
    straight = {"bend": 0, "avenues": 0, "rings": 0, "merged": 0.0, "alleys": 0.0, "parks": 0.0}
    plain = make("street", 200, 200, 5, **straight)
    # Without bends, avenues and houses that are missing, a street is a whole row or column.
    crossing = np.outer((~plain).all(axis=1), np.ones(200)) + np.outer(np.ones(200), (~plain).all(axis=0))
    assert ((crossing > 0) == ~plain).all()
    for more in (
        {"bend": 12},
        {"avenues": 2},
        {"rings": 1},
        {"alleys": 1.0},
        {"merged": 0.4},
        {"parks": 1.0},
    ):
        other = make("street", 200, 200, 5, **{**straight, **more})
        assert (other != plain).mean() > 0.01, more
    assert make("street", 200, 200, 5, **{**straight, "parks": 1.0}).mean() < 0.1


def hills(seed: int = 3, **settings: Any) -> tuple[np.ndarray, np.ndarray]:
    made = make_ground("hills", 160, 120, seed, **settings)
    assert made.terrain is not None
    return made.blocked, made.terrain


def test_hills_have_the_shares_asked_for() -> None:
    bare = {"rocks": 0.0, "roads": 0}
    blocked, terrain = hills(**bare, water=0.0, plain=0.4, levels=4, dearest=252)
    assert not blocked.any()
    values, counts = np.unique(terrain, return_counts=True)
    assert values.tolist() == [0, 63, 126, 189, 252]
    # Heights that are equal go to the same side of a cut.
    assert np.allclose(counts / terrain.size, [0.4, 0.15, 0.15, 0.15, 0.15], atol=0.002)
    # From a cell to the next, terrain hardly ever changes by more than a level; noise would in half of all.
    for axis in (0, 1):
        assert (np.abs(np.diff(terrain.astype(int), axis=axis)) > 63).mean() < 0.01
    wet, _ = hills(**bare, water=0.3)
    assert 0.29 < wet.mean() < 0.45  # and what the water cuts off
    assert hills(**bare, water=0.0, plain=1.0)[1].max() == 0
    assert hills(**bare, water=1.0)[0].sum() == 160 * 120 - 1
    assert set(np.unique(hills(levels=1, dearest=7)[1])) == {0, 7}
    assert abs(hills(roads=0, water=0.0, rocks=0.1)[0].mean() - 0.1) < 0.02


@pytest.mark.parametrize("seed", range(6))
def test_roads_are_plain_ground_from_side_to_side(seed: int) -> None:
    without, hilly = hills(seed, water=0.4, plain=0.0, rocks=0.05, roads=0)
    blocked, terrain = hills(seed, water=0.4, plain=0.0, rocks=0.05, roads=1)
    road = label(~blocked & (terrain == 0))[0] == 1
    rows, columns = road.any(axis=1), road.any(axis=0)
    assert rows.all() or columns.all()
    assert label(road)[1] == 1
    assert (without & road).any() or (hilly[road] > 0).any()
    same = ~blocked & ~road & ~without
    assert same.any()
    assert (terrain[same] == hilly[same]).all()


@pytest.mark.nightly
@pytest.mark.parametrize("recipe", [r for r in RECIPES if r != "gates"])
def test_four_million_cells_take_seconds(recipe: str, timed: Callable[..., Any]) -> None:
    make(recipe, 60, 60, 1)  # what there is to import
    blocked = timed(5, make, recipe, 2048, 2048, 1)
    assert label(~blocked)[1] == 1 or recipe == "random"
