"""The mesh of rectangles: operations on whole arrays and the loops give the same, and what is counted is there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE
from lampyris.kernels.map_models import rectangle_mesh as loops
from lampyris.kernels.map_models import rectangle_mesh_arrays as arrays
from lampyris.kernels.map_models.corner_flags import LINE_X, LINE_Y, PORT, TOWARDS_X, TOWARDS_Y, TURN
from lampyris.planning.map_models.polyanya_search import Mesh
from lampyris.typing import BoolGrid


def _maps(count: int, seed: int) -> list[BoolGrid]:
    rng = np.random.default_rng(seed)
    shapes = [tuple(rng.integers(1, 26, 2).tolist()) for _ in range(count)]
    return [rng.random(shape) >= 0.8 * rng.random() for shape in shapes]


def _listed(mesh: Mesh, form: Any) -> list[bytes]:
    made = [np.full_like(a, -7) for a in (mesh.first, mesh.sides, mesh.port_first, mesh.ports)]
    form(mesh.corner, mesh.stride, mesh.owner, mesh.rects, *made, np.zeros(1, dtype=np.int64))
    return [array.tobytes() for array in made]


@pytest.mark.parametrize("rule", [CUT, TOUCH, WIDE])
def test_sides_by_whole_arrays_are_those_of_the_loops(rule: int) -> None:
    compiled = loops.list_sides.compiled()
    some = 0
    for free in _maps(40, 3):
        mesh = Mesh(free, rule)
        first = _listed(mesh, loops.list_sides.linked())
        assert _listed(mesh, arrays.list_sides) == first == _listed(mesh, compiled)
        sides, ports = int(mesh.first[-1]), int(mesh.port_first[-1])
        assert arrays.count_sides(mesh.owner, mesh.stride) == sides
        assert arrays.count_ports(mesh.corner, mesh.owner, mesh.stride) == ports
        some += sides + ports
    assert some > 500


def test_each_side_is_listed_from_both_of_its_rectangles() -> None:
    for free in _maps(20, 4):
        mesh = Mesh(free, CUT)
        if not mesh.rects.size:
            continue
        whose = np.repeat(np.arange(len(mesh.first) - 1), np.diff(mesh.first))
        table = mesh.sides[: 5 * len(whose)].reshape(-1, 5)
        there = {(int(p), *map(int, row)) for p, row in zip(whose, table, strict=True)}
        for p, rx, ry, lx, ly, q in there:
            assert (q, lx, ly, rx, ry, p) in there
        assert len(there) == len(whose)


def _flags(square: BoolGrid, centre: BoolGrid | None, passing: bool, r: int, c: int) -> int:
    """What is said of one corner, from the four squares around it."""
    a, b, e, d = (bool(square[r + dr, c + dc]) for dr, dc in ((-1, -1), (-1, 0), (0, -1), (0, 0)))
    flags = 0
    if a + b + e + d == 3:
        flags = TURN | (0 if b and d else TOWARDS_X) | (0 if e and d else TOWARDS_Y)
    elif passing and a == d and b == e and a != b:
        flags = PORT
    if centre is not None and centre[r, c]:
        high, wide = centre.shape
        right = c + 1 < wide and centre[r, c + 1] and not b and not d
        down = r + 1 < high and centre[r + 1, c] and not e and not d
        left = centre[r, c - 1] and not a and not e
        up = centre[r - 1, c] and not a and not b
        flags |= (LINE_X if right else 0) | (LINE_Y if down else 0)
        if right or down or left or up:
            flags = (flags | PORT) & ~TURN
    return flags


@pytest.mark.parametrize("lines", [False, True])
@pytest.mark.parametrize("passing", [False, True])
def test_corners_are_marked_by_the_squares_around_them(lines: bool, passing: bool) -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        shape = tuple(rng.integers(4, 14, 2).tolist())
        square, centre = (np.pad(rng.random(shape) < 0.6, ((1, 2), (1, 2))) for _ in range(2))
        given = centre.astype(np.uint8).ravel() if lines else np.zeros(1, dtype=np.uint8)
        high, wide = square.shape
        found = arrays.mark_corners(square.astype(np.uint8).ravel(), given, wide, passing).reshape(high, wide)
        wanted = np.zeros_like(found)
        for r in range(1, high):
            for c in range(1, wide):
                wanted[r, c] = _flags(square, centre if lines else None, passing, r, c)
        assert np.array_equal(found, wanted)


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_dead_ends_lead_out(form: str) -> None:
    """From a rectangle in a dead end the exits lead to where there is more than one, and pass each rectangle once."""
    many = 0
    for free in _maps(30, 6):
        mesh = Mesh(free, TOUCH)
        if not mesh.rects.size:
            continue
        doors = np.diff(mesh.first)
        single = np.flatnonzero((doors == 1) & (np.diff(mesh.port_first) == 0)).astype(np.int32)
        out = np.full_like(mesh.out, -1)
        exits_of = loops.exits_of.run_plain if form == "plain" else loops.exits_of.compiled()
        exits_of(
            single, mesh.first, mesh.sides, mesh.port_first, out, doors.copy(), np.zeros(1, dtype=np.int64)
        )
        assert np.array_equal(out, mesh.out)
        behind = [
            set(mesh.sides[4::5][mesh.first[p] : mesh.first[p + 1]].tolist()) for p in range(len(doors))
        ]
        for p in np.flatnonzero(out >= 0).tolist():
            many += 1
            seen = set()
            while out[p] >= 0:
                assert p not in seen
                seen.add(p)
                assert int(out[p]) in behind[p]
                p = int(out[p])
    assert many > 100
