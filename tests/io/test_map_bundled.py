"""Every bundled map: as its recipe makes it, its hash, its stored queries, its thumbnail."""

from __future__ import annotations

import hashlib
import heapq
import io
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PIL import Image

import lampyris.io.maps.library as library
from lampyris import api
from lampyris.errors import FileError
from lampyris.io.maps.formats.document import MapQuery
from lampyris.io.maps.load import load_map
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.recipes.make import RECIPES
from lampyris.io.maps.thumbnail import SIDE, thumbnail_pixels
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning.field.solve import solve
from lampyris.typing import Cell
from sizes import some

NAMES = library.names()
LARGE_FROM = 300 * 300
SMALL = [n for n in NAMES if library.describe(n).width * library.describe(n).height < LARGE_FROM]
LARGE = [n for n in NAMES if n not in SMALL]
WEIGHTED = [n for n in NAMES if library.describe(n).terrain is not None]

# Fixed when the maps were made. Published results name maps by these.
HASHES = {
    "guide": "49a7fe7bf63156ba",
    "env-1": "8d992d9e3083ed35",
    "env-2": "57852a7afe328cb6",
    "env-3": "a9ff144bba1fb86c",
    "env-4": "90753876dac48b65",
    "env-5": "999e0fd600895159",
    "env-6": "353771df4885fec6",
    "rooms-20": "9d256a9b39a20dd9",
    "maze-31": "a9604685f40fe351",
    "caves-64": "cfff241b4da9e173",
    "hills-48": "498065adcce3b81d",
    "rooms-100": "5c4570168c72d96a",
    "maze-101": "92e9bbe28d5c1598",
    "hills-100": "7a2fc277242a79ed",
    "office-120": "71ae581993a3a243",
    "warehouse-200": "a11b8044ffbfde93",
    "street-256": "f4a15dfcfe46bc8d",
    "hills-256": "47859f296c3cd76c",
    "caves-256": "6eac1763b57c2e16",
    "gates-256": "c5b82639449bfc1d",
    "office-400": "3684904b35517c67",
    "maze-512": "8b7154489a4d1f65",
    "random-512": "57a0f0cf0f876813",
    "street-512": "337d5eeb478adda3",
    "caves-1024": "955a194d7f461456",
    "hills-1024": "7709b6d3ae2b76f2",
    "warehouse-1024": "a842776d09c17dcb",
    "street-1024": "60c10fe1ce2be6d2",
    "rooms-2048": "52fda3abf9e9a045",
}


def test_there_are_enough_from_small_to_large() -> None:
    assert len(NAMES) >= 20
    sizes = [(i.width, i.height) for i in map(library.describe, NAMES)]
    assert min(sizes) == (10, 10)
    assert max(sizes) == (2048, 2048)
    kinds = {library.describe(n).recipe.split(",")[0] for n in NAMES} - {""}
    assert kinds == set(RECIPES)
    assert len(WEIGHTED) >= 3
    for name in NAMES:
        info = library.describe(name)
        assert info.title
        assert info.description
        assert len(info.queries) >= 3
        assert all(q.cost is not None and q.label for q in info.queries)
        assert all((q.weighed is None) == (name not in WEIGHTED) for q in info.queries)
        assert all((q.octile is None) == (name in WEIGHTED) for q in info.queries)
    assert len({library.describe(n).title for n in NAMES}) == len(NAMES)


@pytest.mark.commit(7)
@pytest.mark.parametrize("name", [n for n in NAMES if n != "guide"])
def test_made_again_from_its_recipe(name: str) -> None:
    made, grid = library.remake_ground(name), load_map(name).grid
    assert np.array_equal(made.blocked, grid.blocked)
    assert (made.terrain is None) == (grid.terrain is None) == (name not in WEIGHTED)
    assert made.terrain is None or np.array_equal(made.terrain, grid.terrain)


@pytest.mark.parametrize("name", NAMES)
def test_described_as_it_is(name: str) -> None:
    info, found = library.describe(name), load_map(name)
    blocked = found.grid.blocked
    assert (info.width, info.height) == (found.grid.width, found.grid.height)
    assert info.free == 1 - blocked.mean()
    pad = np.pad(blocked, 1)
    gate = ~blocked & ((pad[1:-1, :-2] & pad[1:-1, 2:]) | (pad[:-2, 1:-1] & pad[2:, 1:-1]))
    assert info.gates == gate.sum()
    if (terrain := found.grid.terrain) is not None:
        assert info.terrain is not None
        assert info.terrain.cells == (terrain > 0).sum()
        assert (info.terrain.lowest, info.terrain.highest) == (terrain[terrain > 0].min(), terrain.max())
    assert found.queries == info.queries
    assert found.notes == ()
    assert (found.start, found.goal) == (info.queries[0].start, info.queries[0].goal)


@pytest.mark.parametrize("name", NAMES)
def test_hash_is_stable(name: str) -> None:
    assert map_hash(load_map(name).grid) == library.describe(name).hash
    assert library.describe(name).hash[:16] == HASHES[name]


def test_hashes_are_all_there() -> None:
    assert tuple(HASHES) == NAMES
    assert len(set(HASHES.values())) == len(HASHES)


def slow_hash(
    blocked: list[list[int]], unknown: list[list[int]], terrain: list[list[int]] | tuple[()] = ()
) -> str:
    """The hash as its docstring defines it, bit by bit."""

    def bits(rows: list[list[int]]) -> bytes:
        flat = [b for row in rows for b in row]
        flat += [0] * (-len(flat) % 8)
        return b"".join(
            struct.pack("B", sum(bit << (7 - k) for k, bit in enumerate(flat[i : i + 8])))
            for i in range(0, len(flat), 8)
        )

    text = f"lampyris map 1\nsize {len(blocked[0])} {len(blocked)}\nblocked\n".encode() + bits(blocked)
    if any(map(any, unknown)):
        text += b"unknown\n" + bits(unknown)
    if any(map(any, terrain)):
        text += b"terrain\n" + bytes(v for row in terrain for v in row)
    return hashlib.sha256(text).hexdigest()


def test_hash_is_over_size_blocked_and_unknown_cells() -> None:
    blocked, unknown = [[1, 0, 0], [0, 1, 1]], [[0, 0, 0], [0, 0, 1]]
    none = [[0] * 3] * 2
    assert map_hash(Grid(blocked)) == slow_hash(blocked, none)
    assert map_hash(Grid(blocked, unknown=unknown)) == slow_hash(blocked, unknown)
    assert map_hash(Grid(blocked, unknown=none)) == map_hash(Grid(blocked))
    terrain = [[0, 252, 0], [7, 0, 0]]
    weighted = Grid(blocked, unknown=unknown, terrain=terrain)
    assert map_hash(weighted) == slow_hash(blocked, unknown, terrain)
    assert map_hash(Grid(blocked, terrain=none)) == map_hash(Grid(blocked))
    same = Grid(blocked, resolution=0.05, origin=(1.0, 2.0, 0.5), name="other")
    assert map_hash(same) == map_hash(Grid(blocked))
    others = [
        Grid(np.reshape(blocked, (3, 2))),
        Grid(np.reshape(blocked, (1, 6))),
        Grid([[1, 0, 0], [0, 1, 0]]),
        Grid(blocked, unknown=unknown),
        Grid(blocked, unknown=blocked),
    ]
    assert len({map_hash(g) for g in [Grid(blocked), *others]}) == 6


def best_of(query: MapQuery) -> int:
    pair = query.octile or query.weighed
    assert pair is not None
    return MOVES["octile"].exact(pair)


def weighed_twin(grid: Grid, start: Cell, goal: Cell) -> tuple[int, int]:
    """63rds of straights and diagonals of the cheapest way, by a plain Dijkstra that knows nothing of us."""
    assert grid.terrain is not None
    free, price = ~np.pad(grid.blocked, 1, constant_values=True), 63 + np.pad(grid.terrain, 1).astype(int)
    wide, cells = free.shape[1], free.ravel().tolist()
    price = price.ravel().tolist()
    sides, corners = (1, -1, wide, -wide), [(a + b, a, b) for a in (1, -1) for b in (wide, -wide)]
    first, last = ((y + 1) * wide + x + 1 for x, y in (start, goal))
    best, done, queue = {first: 0.0}, set(), [(0.0, 0, 0, first)]
    while True:
        _, n, m, c = heapq.heappop(queue)
        if c == last:
            return n, m
        if c in done:
            continue
        done.add(c)
        ways = [(c + s, n + price[c + s], m) for s in sides if cells[c + s]]
        ways += [
            (c + d, n, m + price[c + d])
            for d, a, b in corners
            if cells[c + d] and cells[c + a] and cells[c + b]
        ]
        for to, straights, diagonals in ways:
            cost = straights + diagonals * 2**0.5
            if cost < best.get(to, cost + 1):
                best[to] = cost
                heapq.heappush(queue, (cost, straights, diagonals, to))


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", [n for n in WEIGHTED if n != "hills-1024"])
def test_stored_costs_over_terrain_are_a_twin_s(name: str) -> None:
    info, grid = library.describe(name), load_map(name).grid
    for query in info.queries[: 4 if name in SMALL and info.width < 200 else 1]:
        assert query.weighed == weighed_twin(grid, query.start, query.goal)


@pytest.mark.nightly
@pytest.mark.parametrize("name", WEIGHTED)
def test_every_stored_cost_over_terrain_is_a_twin_s(name: str) -> None:
    grid = load_map(name).grid
    for query in library.describe(name).queries:
        assert query.weighed == weighed_twin(grid, query.start, query.goal)


@pytest.mark.parametrize("name", some(WEIGHTED))
def test_stored_costs_over_terrain_are_the_field_s(name: str) -> None:
    grid = load_map(name).grid
    moves = MOVES["octile"].weighed()
    for query in library.describe(name).queries:
        exact = solve(~grid.blocked, moves, query.goal, terrain=grid.terrain).exact
        assert exact[query.start[1], query.start[0]] == best_of(query)
        assert query.cost == moves.value(best_of(query))


def solve_all(name: str, planners: dict[str, dict[str, str]], count: int | None = None) -> None:
    """Each stored query by each planner: the stored length by octile moves, a way by the dissertation's."""
    grid = load_map(name).grid
    for query in library.describe(name).queries[:count]:
        for planner, settings in planners.items():
            scene = Scene(grid, query.start, query.goal, moves="octile")
            found = api.plan(scene, planner, record=False, **settings)
            assert found.path is not None, (planner, query)
            assert found.path.exact == best_of(query), (planner, query)
        scene = Scene(grid, query.start, query.goal, moves="dissertation")
        assert api.plan(scene, next(iter(planners)), record=False).path is not None, query


@pytest.mark.commit(6)
@pytest.mark.parametrize("name", SMALL)
def test_every_query_of_the_small_maps_by_every_planner(name: str) -> None:
    solve_all(name, {"astar": {}, "dijkstra": {}, "ad-gso": {"choice": "exact"}})


@pytest.mark.commit(3)
@pytest.mark.parametrize("name", LARGE)
def test_the_first_query_of_the_large_maps(name: str) -> None:
    solve_all(name, {"astar": {}}, 1)


@pytest.mark.nightly
@pytest.mark.parametrize("name", LARGE)
def test_every_query_of_the_large_maps_by_every_planner(name: str) -> None:
    solve_all(name, {"astar": {}, "dijkstra": {}, "ad-gso": {"choice": "exact"}})


@pytest.mark.parametrize("name", NAMES)
def test_queries_are_worth_asking(name: str) -> None:
    info = library.describe(name)
    queries = [q for q in info.queries if q.label == "drawn, far apart"]
    assert len({(q.start, q.goal) for q in info.queries}) == len(info.queries)
    for q in queries:
        # Farther than half the map is wide: nothing that a planner has in its first ring.
        away = max(abs(a - b) for a, b in zip(q.start, q.goal, strict=True))
        assert (sum(q.octile) if q.octile else away) >= min(info.width, info.height) / 2


@pytest.mark.parametrize("name", NAMES)
def test_thumbnail_is_of_this_map(name: str) -> None:
    found = load_map(name)
    data = library.thumbnail_png(name)
    assert len(data) < 8_000
    with Image.open(io.BytesIO(data)) as picture:
        assert max(picture.size) <= SIDE
        assert max(picture.size) > 0.7 * SIDE
        pixels = np.asarray(picture)
    assert np.array_equal(pixels, thumbnail_pixels(found.grid, found.start, found.goal))


def test_thumbnails_show_shares_and_ends() -> None:
    blocked = np.zeros((256, 300), dtype=np.bool_)
    blocked[:, :150] = True
    blocked[:128, 150:] = np.indices((128, 150)).sum(axis=0) % 2
    pixels = thumbnail_pixels(Grid(blocked), (299, 255), None)
    assert pixels.shape == (86, 100)  # each pixel stands for 3 x 3 cells
    assert (pixels[:, :50] == 0).all()
    assert set(np.unique(pixels[:42, 50:])) == {3, 4}
    assert (pixels[43:80, 50:] == 7).all()
    assert (pixels[85, 99], pixels[85, 96]) == (8, 7)
    small = thumbnail_pixels(Grid(np.eye(4, dtype=np.bool_)), (1, 0), (0, 1))
    assert small.shape == (128, 128)
    assert (small[:32, :32] == 0).all()
    assert (small[:32, 32:64] == 8).all()
    assert (small[40:56, :32] == 9).all()


def test_thumbnails_show_terrain_in_shades_of_its_own() -> None:
    terrain = np.array([[0, 1, 42, 43, 126], [127, 251, 252, 252, 63]], dtype=np.uint8)
    blocked = np.array([[0, 0, 0, 0, 0], [0, 0, 0, 1, 0]], dtype=np.bool_)
    small = thumbnail_pixels(Grid(blocked, terrain=terrain), None, None)[::25, ::25]
    assert small.tolist() == [[7, 10, 10, 11, 12], [13, 15, 15, 0, 11]]
    # Of 2 x 2 cells the free ones count, and a pixel of more walls than ground is as dark as ever.
    many = np.zeros((2, 256), dtype=np.bool_)
    many[0, 0] = many[0, 2] = True
    many[:, 3] = True
    grid = Grid(many, terrain=np.where(many, 0, np.uint8(126)))
    assert thumbnail_pixels(grid, None, None)[0, :3].tolist() == [12, 2, 12]
    with Image.open(io.BytesIO(library.thumbnail_png("hills-100"))) as picture:
        rgb = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    assert {(186, 150, 96), (246, 244, 238), (43, 48, 58)} <= set(map(tuple, rgb.tolist()))


def test_loading_is_quick_and_small(timely: Callable[..., Any]) -> None:
    load_map("rooms-20")
    for name in LARGE:
        timely(0.5, load_map, name)
    from importlib.resources import files

    data = files("lampyris.io.maps") / "data"
    assert (
        sum(len(f.read_bytes()) for d in (data, data / "thumbs") for f in d.iterdir() if f.is_file()) < 2**21
    )


def test_a_name_nearly_right() -> None:
    with pytest.raises(FileError, match="did you mean caves-256"):
        library.describe("caves-265")
    with pytest.raises(FileError, match="FILE_MISSING"):
        library.thumbnail_png("../index")
