"""Maps packed as JSON: the same map again to the last bit, and nothing unpacked that should not be."""

from __future__ import annotations

import base64
import json
import zlib
from typing import Any

import numpy as np
import pytest

from lampyris.errors import LampyrisError
from lampyris.io.maps import library
from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.study.design.study_map import pack, unpack
from lampyris_selfcheck.reference.files.watching import memory


def grids(seed: int, many: int) -> list[Grid]:
    """Maps of all sizes, with and without unknown cells and terrain."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(many):
        height, width = (int(v) for v in rng.integers(1, 40, 2))
        blocked = rng.random((height, width)) < rng.random()
        unknown = blocked & (rng.random((height, width)) < 0.3) if k % 3 == 0 else None
        terrain = rng.integers(0, 253, (height, width)) if k % 4 == 0 else None
        origin = tuple(float(v) for v in rng.normal(0, 100, 3))
        made.append(
            Grid(blocked, unknown, float(rng.uniform(1e-6, 1000)), origin, f"m{k} \u00e9\u2028\n", terrain)  # type: ignore[arg-type]
        )
    return made


def same(a: Grid, b: Grid) -> bool:
    """Whether two maps are the same in all they say."""
    layers = all(
        (x is None) == (y is None) and (x is None or y is None or np.array_equal(x, y))
        for x, y in ((a.blocked, b.blocked), (a.unknown, b.unknown), (a.terrain, b.terrain))
    )
    return layers and (a.resolution, a.origin, a.name) == (b.resolution, b.origin, b.name)


def test_every_map_comes_back_the_same_through_json() -> None:
    for grid in (*grids(1, 150), *(library.load(name).grid for name in ("guide", "hills-48", "office-120"))):
        sent = json.dumps(pack(grid))
        back = unpack(json.loads(sent), map_hash(grid))
        assert same(grid, back)
        assert json.dumps(pack(back)) == sent
        assert not back.blocked.flags.writeable


def test_other_cells_than_expected_are_refused() -> None:
    one, other = grids(2, 2)
    with pytest.raises(LampyrisError, match=rf"^error\[PACKED_HASH\].*{map_hash(one)}.*{map_hash(other)}"):
        unpack(pack(one), map_hash(other))


def squeezed(raw: bytes) -> str:
    """As cells are packed."""
    return base64.b64encode(zlib.compress(raw, 9)).decode()


GOOD = pack(Grid(np.eye(20, dtype=bool), name="g"))
BAD: list[tuple[dict[str, Any], str]] = [
    ({"format": 2}, "PACKED_MAP"),
    ({"format": True}, "PACKED_MAP"),
    ({"width": 0}, "PACKED_MAP"),
    ({"width": -20, "height": -20}, "PACKED_MAP"),
    ({"width": 20.0}, "PACKED_MAP"),
    ({"width": True}, "PACKED_MAP"),
    ({"width": 21}, "PACKED_MAP"),
    ({"height": 19}, "PACKED_MAP"),
    ({"width": 2**20, "height": 2**20}, "MAP_TOO_LARGE"),
    ({"width": 10**40}, "MAP_TOO_LARGE"),
    ({"resolution": 0}, "MAP_RESOLUTION"),
    ({"resolution": float("nan")}, "MAP_RESOLUTION"),
    ({"resolution": "1"}, "PACKED_MAP"),
    ({"resolution": True}, "PACKED_MAP"),
    ({"origin": [0, 0]}, "PACKED_MAP"),
    ({"origin": [0, 0, "x"]}, "PACKED_MAP"),
    ({"origin": [0, 0, float("inf")]}, "MAP_ORIGIN"),
    ({"origin": None}, "PACKED_MAP"),
    ({"name": 5}, "PACKED_MAP"),
    ({"name": "x" * 5000}, "PACKED_MAP"),
    ({"blocked": None}, "PACKED_MAP"),
    ({"blocked": "not base64!"}, "PACKED_MAP"),
    ({"blocked": "\u00e9"}, "PACKED_MAP"),
    ({"blocked": base64.b64encode(b"not zlib").decode()}, "PACKED_MAP"),
    ({"blocked": squeezed(bytes(49))}, "PACKED_MAP"),
    ({"blocked": squeezed(bytes(51))}, "PACKED_MAP"),
    ({"blocked": base64.b64encode(zlib.compress(bytes(50)) + b"more").decode()}, "PACKED_MAP"),
    ({"blocked": base64.b64encode(zlib.compress(bytes(50))[:-1]).decode()}, "PACKED_MAP"),
    ({"blocked": "A" * 10_000_000}, "PACKED_MAP"),
    ({"unknown": ""}, "PACKED_MAP"),
    ({"terrain": squeezed(bytes([253]) * 400)}, "GRID_TERRAIN"),
    ({"terrain": squeezed(bytes(50))}, "PACKED_MAP"),
    ({"more": 1}, "PACKED_MAP"),
]


@pytest.mark.parametrize(("change", "code"), BAD, ids=lambda c: str(c)[:40])
def test_what_was_not_packed_by_us_is_refused(change: dict[str, Any], code: str) -> None:
    assert same(unpack(GOOD), Grid(np.eye(20, dtype=bool), name="g"))
    if code == "GRID_TERRAIN":
        change = {**change, "blocked": squeezed(bytes(50))}
    with pytest.raises(LampyrisError) as caught:
        unpack({**GOOD, **change})
    assert caught.value.code == code
    assert len(str(caught.value)) < 400
    assert caught.value.exit_code == (5 if code == "MAP_TOO_LARGE" else 3)


@pytest.mark.parametrize("value", [None, 5, [], "x", {}, {"width": 1}, {**GOOD, "width": None}])
def test_other_data_is_refused(value: Any) -> None:
    with pytest.raises(LampyrisError, match=r"^error\[PACKED_MAP\]"):
        unpack(value)
    for key in GOOD:
        with pytest.raises(LampyrisError, match=rf"^error\[PACKED_MAP\].*allowed: .*{key}"):
            unpack({k: v for k, v in GOOD.items() if k != key})


def test_what_unfolds_to_gigabytes_is_not_unfolded() -> None:
    """16 MB of zeros in 16 KB, where 20 KB of cells are said to be."""
    bomb = squeezed(bytes(2**24))
    assert len(bomb) < 25_000
    big = {**GOOD, "width": 400, "height": 400, "blocked": bomb}
    with memory() as grown, pytest.raises(LampyrisError, match="more, or cut short"):
        unpack(big)
    assert grown[0] < 2**22, "16 MB were not made of it"
    with pytest.raises(LampyrisError, match="MAP_TOO_LARGE"):
        unpack(GOOD, max_cells=399)


def test_no_damage_to_the_text_of_the_cells_gives_another_map() -> None:
    grid = grids(3, 1)[0]
    packed = pack(grid)
    rng = np.random.default_rng(4)
    refused = 0
    for _ in range(300):
        text = list(packed["blocked"])
        text[int(rng.integers(len(text)))] = chr(int(rng.integers(32, 127)))
        try:
            assert same(unpack({**packed, "blocked": "".join(text)}), grid)
        except LampyrisError:
            refused += 1
    assert refused > 200
