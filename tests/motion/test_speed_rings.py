"""Ring counts against a plain reference, and the very cells that each heading looks at."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.motion.laws.rings import ring_counts
from lampyris.reproduce.tables import printed_data
from lampyris_selfcheck.reference.motion import speed_laws

STEPS = [(dx, dy) for dx in range(-2, 3) for dy in range(-2, 3) if math.gcd(dx, dy) == 1]
AROUND = [(dx, dy) for dx in range(-2, 3) for dy in range(-2, 3) if (dx, dy) != (0, 0)]


def looked_at(heading: tuple[int, int], ring: int) -> set[tuple[int, int]]:
    """Offsets that count, found by putting one obstacle at a time around the end of one step."""
    free = np.zeros((11, 11), dtype=np.bool_)
    way = [(5 - heading[0], 5 - heading[1]), (5, 5)]
    out = set()
    for dx, dy in AROUND:
        counts = ring_counts(way, free, [(5 + dx, 5 + dy)], ring1="ahead")
        if counts[ring - 1][1]:
            out.add((dx, dy))
    return out


@pytest.mark.parametrize(
    ("heading", "ahead"),
    [
        ((1, 0), {(2, -2), (2, -1), (2, 0), (2, 1), (2, 2)}),
        ((0, -1), {(-2, -2), (-1, -2), (0, -2), (1, -2), (2, -2)}),
        ((1, 1), {(2, 0), (2, 1), (2, 2), (1, 2), (0, 2)}),
        ((-1, 1), {(-2, 0), (-2, 1), (-2, 2), (-1, 2), (0, 2)}),
        ((2, 1), {(2, 0), (2, 1), (2, 2), (1, 2)}),
        ((-1, 2), {(0, 2), (-1, 2), (-2, 2), (-2, 1)}),
    ],
)
def test_ring_2_ahead_is_these_cells(heading: tuple[int, int], ahead: set[tuple[int, int]]) -> None:
    assert looked_at(heading, 2) == ahead


@pytest.mark.parametrize(
    ("heading", "ahead"),
    [((1, 0), {(1, -1), (1, 0), (1, 1)}), ((1, 1), {(1, 0), (1, 1), (0, 1)}), ((2, 1), {(1, 0), (1, 1)})],
)
def test_ring_1_ahead_is_these_cells(heading: tuple[int, int], ahead: set[tuple[int, int]]) -> None:
    assert looked_at(heading, 1) == ahead


def test_table_4_14_needs_the_corners_of_ring_2() -> None:
    """More obstacles ahead of a straight step than there are cells strictly within 45 degrees."""
    strictly = {
        (dx, dy) for dx, dy in looked_at((1, 0), 2) if speed_laws.angle_between((1, 0), (dx, dy)) < 45 - 1e-9
    }
    assert len(strictly) == 3
    counts = []
    for before, row in itertools.pairwise(printed_data.velocity_rows("4.14")):
        if row["ring2"]:
            straight = row["x"] == before["x"] or row["y"] == before["y"]
            counts.append((int(row["ring2"]), straight))
    assert max(n for n, straight in counts if straight) == 5 == len(looked_at((1, 0), 2))


@pytest.mark.parametrize("ring1", ["all", "ahead"])
@pytest.mark.parametrize("ring2", ["all", "ahead"])
@pytest.mark.parametrize("outside", [(True, False), (False, True)])
def test_equals_the_plain_twin(ring1: Any, ring2: Any, outside: tuple[bool, bool]) -> None:
    rng = np.random.default_rng(4 * (ring1 == "all") + 2 * (ring2 == "all") + outside[0])
    for _ in range(40):
        height, width = rng.integers(1, 12, 2).tolist()
        blocked = rng.random((height, width)) < rng.random()
        # Obstacles on walls, twice on one cell (each cell counts once), and off the map (not counted).
        obstacles = [tuple(c) for c in rng.integers(-2, 13, (rng.integers(0, 12), 2)).tolist()]
        way = [(int(rng.integers(-1, width + 1)), int(rng.integers(-1, height + 1)))]
        for k in rng.integers(0, len(STEPS), rng.integers(0, 12)).tolist():
            way.append((way[-1][0] + STEPS[k][0], way[-1][1] + STEPS[k][1]))
        previous = None
        if rng.random() < 0.5:
            step = STEPS[int(rng.integers(len(STEPS)))]
            previous = (way[0][0] - step[0], way[0][1] - step[1])
        heads = [(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(way)]
        first = (0, 0) if not heads else heads[0]
        if previous is not None:
            first = (way[0][0] - previous[0], way[0][1] - previous[1])
        got = ring_counts(
            way, blocked, obstacles, previous=previous, ring1=ring1, ring2=ring2,
            outside1=outside[0], outside2=outside[1],
        )  # fmt: skip
        for ring, reading in ((1, ring1), (2, ring2)):
            want = [
                speed_laws.ring_count(
                    cell, heading, ring, blocked.tolist(), set(obstacles),
                    ahead=reading == "ahead", outside=outside[ring - 1],
                )
                for cell, heading in zip(way, [first, *heads], strict=True)
            ]  # fmt: skip
            assert got[ring - 1].tolist() == want


def test_by_default_the_edge_of_the_map_counts_in_ring_1_alone() -> None:
    free = np.zeros((9, 9), dtype=np.bool_)
    n1, n2 = ring_counts([(2, 4), (1, 4), (0, 4)], free)
    assert n1.tolist() == [0, 0, 3]
    assert n2.tolist() == [0, 0, 0]
    assert ring_counts([(0, 0)], free)[0].tolist() == [5]


def test_what_the_robot_stands_on_and_what_is_three_away_does_not_count() -> None:
    free = np.zeros((9, 9), dtype=np.bool_)
    n1, n2 = ring_counts([(4, 4), (5, 4)], free, [(4, 4), (5, 4), (8, 4), (2, 4)])
    assert n1.tolist() == [1, 1]
    assert n2.tolist() == [0, 0]


@pytest.mark.parametrize(
    "given",
    [
        [(5, 5), (6, 4)],
        ((5, 5), (6, 4)),
        {(5, 5), (6, 4)},
        frozenset({(5, 5), (6, 4)}),
        np.array([[5, 5], [6, 4]]),
        np.array([[5, 5], [6, 4]], dtype=np.int32),
        (cell for cell in [(5, 5), (6, 4)]),
        [(np.int32(5), np.int32(5)), (6, 4)],
    ],
)
def test_obstacles_come_in_any_iterable(given: Any) -> None:
    free = np.zeros((9, 9), dtype=np.bool_)
    n1, n2 = ring_counts([(3, 4), (4, 4)], free, given)
    assert (n1.tolist(), n2.tolist()) == ([0, 1], [1, 1])


def test_the_map_is_not_touched() -> None:
    blocked = np.zeros((6, 6), dtype=np.bool_)
    ring_counts([(2, 2), (3, 2)], blocked, [(3, 3)])
    assert not blocked.any()


def test_without_a_previous_cell_the_first_node_looks_where_it_goes() -> None:
    free = np.zeros((9, 9), dtype=np.bool_)
    assert ring_counts([(4, 4), (5, 4)], free, [(6, 4)])[1][0] == 1
    assert ring_counts([(4, 4), (5, 4)], free, [(6, 4)], previous=(4, 4))[1][0] == 1
    assert ring_counts([(4, 4), (5, 4)], free, [(6, 4)], previous=(4, 5))[1][0] == 0
    assert ring_counts([(4, 4)], free, [(6, 4)])[1][0] == 0
    assert ring_counts([(4, 4)], free, [(6, 4)], ring2="all")[1][0] == 1


@pytest.mark.parametrize(
    ("way", "settings", "code"),
    [
        ([(0, 0), (0, 0)], {}, "PATH_STEP"),
        ([(0, 0), (3, 1)], {}, "PATH_STEP"),
        ([(0, 0), (1, 1)], {"previous": (4, 0)}, "PATH_STEP"),
        ([], {}, "PATH_CELLS"),
        ([(0.0, 0.0)], {}, "PATH_CELLS"),
        ([(0, 0)], {"ring1": "some"}, "READING"),
        ([(0, 0)], {"ring2": ""}, "READING"),
    ],
)
def test_nonsense_is_a_typed_error(way: Any, settings: dict[str, Any], code: str) -> None:
    with pytest.raises(SettingError) as raised:
        ring_counts(way, np.zeros((9, 9), dtype=np.bool_), **settings)
    assert raised.value.code == code
