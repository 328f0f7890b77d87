"""The dissertation's law against its own tables, a closed-form reference, and hand-worked ties."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import SettingError
from lampyris.model.path import path_of
from lampyris.motion import caps
from lampyris.motion.laws.dissertation import DissertationLaw, dissertation_profile, dissertation_speeds
from lampyris.reproduce.tables import printed_data, velocity
from lampyris.reproduce.tables.verdict import short
from lampyris_selfcheck.reference.motion import speed_laws

TABLES = {table: printed_data.velocity_rows(table) for table in printed_data.VELOCITY_TABLES}
# Rows whose printed velocity is not what the law gives on the printed cells and counts.
PRINTED_OTHERWISE = {
    "4.12": {10}, "4.13": {5, 10}, "4.16": {5, 7, 8, 15, 19, 20, 21}, "4.17": {1, 3, 22}
}  # fmt: skip
STRAIGHT = [(x, 0) for x in range(8)]
STEPS = [(dx, dy) for dx in range(-2, 3) for dy in range(-2, 3) if math.gcd(dx, dy) == 1]


def cells(rows: list[dict[str, str]]) -> list[tuple[int, int]]:
    return [(int(r["x"]), int(r["y"])) for r in rows]


def column(rows: list[dict[str, str]], name: str) -> list[str]:
    return [r[name] for r in rows]


def test_all_six_tables_are_here() -> None:
    assert [(name, len(rows)) for name, rows in TABLES.items()] == [
        ("4.12", 13), ("4.13", 13), ("4.14", 14), ("4.15", 19), ("4.16", 24), ("4.17", 25)
    ]  # fmt: skip


@pytest.mark.parametrize("table", TABLES)
def test_every_row_with_its_cause(table: str) -> None:
    rows = TABLES[table]
    v, cause = dissertation_profile(cells(rows), column(rows, "ring1"), column(rows, "ring2"))
    got = [(float(s), c) for s, c in zip(v, cause, strict=True)]
    assert got == [(float(r["rule_velocity"]), r["rule_cause"]) for r in rows]
    differ = {k for k, r in enumerate(rows) if float(r["adaptive_velocity"]) != v[k]}
    assert differ == PRINTED_OTHERWISE.get(table, set())


@pytest.mark.parametrize("table", TABLES)
def test_angles_of_the_tables_are_those_of_their_cells(table: str) -> None:
    rows = TABLES[table]
    way = np.array(cells(rows))
    for k in range(1, len(way) - 1):
        into, out = way[k] - way[k - 1], way[k + 1] - way[k]
        turn = speed_laws.angle_between(tuple(into.tolist()), tuple(out.tolist()))
        assert round(180 - turn) == int(rows[k]["interior_angle"])


@pytest.mark.parametrize(("table", "mean"), [("4.14", "48.58"), ("4.15", "55.06")])
def test_means_as_recomputed(table: str, mean: str) -> None:
    rows = TABLES[table]
    v = lampyris.dissertation_speeds(cells(rows), column(rows, "ring1"), column(rows, "ring2"))
    assert f"{v[v > 0].mean():.2f}" == mean


def random_way(rng: np.random.Generator, steps: list[tuple[int, int]]) -> list[tuple[int, int]]:
    way = [(0, 0)]
    for k in rng.integers(0, len(steps), rng.integers(0, 30)).tolist():
        way.append((way[-1][0] + steps[k][0], way[-1][1] + steps[k][1]))
    return way


def test_equals_the_closed_form_on_random_ways_with_knights_steps_and_turns_back() -> None:
    rng = np.random.default_rng(1)
    for _ in range(500):
        way = random_way(rng, STEPS)
        n1 = rng.integers(0, 9, len(way)).tolist()
        n2 = rng.integers(0, 17, len(way)).tolist() if rng.random() < 0.5 else [0] * len(way)
        assert dissertation_speeds(way, n1, n2).tolist() == speed_laws.dissertation(way, n1, n2)


def expected_cause(v: list[float], i: int, rise: float, n1: int, n2: int, angle: float) -> str:
    """The first in the stated order whose value is the speed at an inner node."""
    rings = max(20.0, 80.0 - 6 * n1 - 3 * n2)
    by = [
        ("limit", 80.0),
        ("acceleration", v[i - 1] + rise),
        ("ring 1" if 6 * n1 >= 3 * n2 else "ring 2", rings),
        ("angle", angle),
        ("braking", v[i + 1] + 40.0),
    ]
    return next(name for name, value in by if value == v[i])


def test_causes_are_the_first_whose_value_is_the_speed() -> None:
    rng = np.random.default_rng(2)
    seen = set()
    for _ in range(300):
        way = random_way(rng, [(1, 0)] * 6 + [(0, 1), (1, 1), (1, -1)])
        if len(way) < 3:
            continue
        free = rng.random() < 0.3
        n1 = [0] * len(way) if free else rng.integers(0, 5, len(way)).tolist()
        n2 = [0] * len(way) if free else rng.integers(0, 9, len(way)).tolist()
        speeds, cause = dissertation_profile(way, n1, n2)
        v = speeds.tolist()
        assert (cause[0], cause[-1]) == ("start", "goal")
        for i in range(1, len(way) - 1):
            into = (way[i][0] - way[i - 1][0], way[i][1] - way[i - 1][1])
            out = (way[i + 1][0] - way[i][0], way[i + 1][1] - way[i][1])
            turn = speed_laws.angle_between(into, out)
            angle = 80.0 if turn < 22.5 else 60.0 if turn < 67.5 else 20.0
            rise = 28.0 if into[0] and into[1] else 20.0
            # The speed before is known after braking only; where acceleration binds, that is the same.
            assert cause[i] == expected_cause(v, i, rise, n1[i], n2[i], angle)
            seen.add(cause[i])
    assert seen == {"limit", "acceleration", "ring 1", "ring 2", "angle", "braking"}


@pytest.mark.parametrize(
    ("node", "n1", "n2", "v", "cause"),
    [
        (4, 0, 0, 80, "limit"),  # no obstacle, and accelerating to 80 exactly: the limit comes first
        (4, 1, 0, 74, "ring 1"),
        (4, 0, 1, 77, "ring 2"),
        (4, 1, 2, 68, "ring 1"),  # 6 and 6
        (4, 1, 3, 65, "ring 2"),
        (4, 8, 16, 20, "ring 1"),  # 48 and 48
        (4, 7, 16, 20, "ring 2"),  # the floor
        (1, 8, 0, 20, "acceleration"),  # accelerating and obstacles both say 20
    ],
)
def test_ties(node: int, n1: int, n2: int, v: float, cause: str) -> None:
    one, two = [0] * 8, [0] * 8
    one[node], two[node] = n1, n2
    speeds, causes = dissertation_profile(STRAIGHT, one, two)
    assert (speeds[node], causes[node]) == (v, cause)


def test_ring_wins_a_tie_with_angle_and_acceleration_wins_it_over_both() -> None:
    law = DissertationLaw(v_135=62.0)
    bend = [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (5, 1), (6, 2), (7, 3), (8, 4)]
    one = [0, 0, 0, 0, 3, 0, 0, 0, 0]
    v, cause = dissertation_profile(bend, one, [0] * 9, law=law)
    assert (v[4], cause[4]) == (62.0, "ring 1")
    v, cause = dissertation_profile(bend, [0] * 9, [0] * 9, law=law)
    assert (v[4], cause[4]) == (62.0, "angle")
    v, cause = dissertation_profile(bend, [0] * 9, [0] * 9, law=DissertationLaw(a_straight=15.0))
    assert (v[4], cause[4]) == (60.0, "acceleration")


@pytest.mark.parametrize(
    ("into", "out", "v"),
    [
        ((1, 0), (1, 0), 80.0),
        ((1, 0), (1, 1), 60.0),
        ((1, 0), (0, 1), 20.0),
        ((1, 0), (-1, 1), 20.0),
        ((1, 0), (-1, 0), 20.0),
        ((1, 1), (2, 1), 80.0),  # 18.4 degrees
        ((1, 0), (2, 1), 60.0),  # 26.6
        ((2, 1), (1, 2), 60.0),  # 36.9
        ((1, 0), (1, 2), 60.0),  # 63.4
        ((-1, 1), (1, 2), 20.0),  # 71.6
    ],
)
def test_angle_goes_to_the_nearest_of_three(into: tuple[int, int], out: tuple[int, int], v: float) -> None:
    law = DissertationLaw(a_straight=80, a_diagonal=80, a_knight=80, braking=80)
    way = [(0, 0), into, (into[0] + out[0], into[1] + out[1])]
    assert dissertation_profile(way, [0] * 3, [0] * 3, law=law)[0][1] == v


@pytest.mark.parametrize(
    ("turn", "v"), [(0, 80), (22.4, 80), (22.6, 60), (67.4, 60), (67.6, 20), (90, 20), (180, 20)]
)
def test_borders_of_the_angle_are_half_way(turn: float, v: float) -> None:
    cosine = np.array([math.cos(math.radians(turn))])
    assert caps.angle(cosine, v_180=80.0, v_135=60.0, v_90=20.0).tolist() == [v]


def test_a_tail_driven_on_from_its_own_speed_is_the_tail() -> None:
    rng = np.random.default_rng(3)
    for _ in range(100):
        way = random_way(rng, STEPS)
        n1, n2 = rng.integers(0, 5, len(way)).tolist(), rng.integers(0, 4, len(way)).tolist()
        v, cause = dissertation_profile(way, n1, n2)
        for k in range(1, len(way)):
            tail, why = dissertation_profile(way[k:], n1[k:], n2[k:], v0=float(v[k]), previous=way[k - 1])
            assert tail.tolist() == v[k:].tolist()
            assert why[1:] == cause[k + 1 :]


def test_a_start_velocity_gives_way_to_the_caps_at_once() -> None:
    v, cause = dissertation_profile(STRAIGHT, [8] + [0] * 7, [0] * 8, v0=80.0)
    assert (v[0], cause[0]) == (32.0, "ring 1")
    v, cause = dissertation_profile(STRAIGHT, [0, 8] + [0] * 6, [0] * 8, v0=80.0)
    assert (v[:2].tolist(), cause[:2]) == ([72.0, 32.0], ("braking", "ring 1"))
    v, cause = dissertation_profile(STRAIGHT, [0] * 8, [0] * 8, v0=80.0, previous=(0, 1))
    assert (v[0], cause[0]) == (20.0, "angle")
    slow = DissertationLaw(v_180=50.0)
    assert dissertation_profile(STRAIGHT, [0] * 8, [0] * 8, law=slow, v0=80.0)[0][0] == 80.0
    v, cause = dissertation_profile(STRAIGHT, [0] * 8, [0] * 8, v0=90.0)
    assert (v[0], cause[0]) == (80.0, "limit")


def test_one_and_two_nodes_stand_still() -> None:
    assert dissertation_profile([(3, 3)], [None], [None], v0=40.0)[0].tolist() == [0.0]
    assert dissertation_profile([(3, 3)], [None], [None])[1] == ("start",)
    v, cause = dissertation_profile([(3, 3), (4, 4)], ["", ""], ["", ""])
    assert (v.tolist(), cause) == ([0.0, 0.0], ("start", "goal"))


@pytest.mark.parametrize("blank", [None, math.nan, np.nan, "", "  "])
def test_counts_of_the_ends_may_be_blank_and_are_ignored(blank: Any) -> None:
    inner = [0] * 6
    want = dissertation_speeds(STRAIGHT, [0, *inner, 0], [0, *inner, 0]).tolist()
    assert dissertation_speeds(STRAIGHT, [blank, *inner, blank], [8, *inner, 8]).tolist() == want
    with pytest.raises(SettingError, match=r"RING_COUNT.*node 3"):
        dissertation_speeds(STRAIGHT, [0, 0, 0, blank, 0, 0, 0, 0], [0] * 8)


@pytest.mark.parametrize(
    ("way", "one", "two", "code"),
    [
        ([], [], [], "PATH_CELLS"),
        ([(0.5, 0.0), (1.0, 0.0)], [0, 0], [0, 0], "PATH_CELLS"),
        ([0, 1], [0, 0], [0, 0], "PATH_CELLS"),
        ([(0, 0), (0, 0)], [0, 0], [0, 0], "PATH_STEP"),
        ([(0, 0), (3, 0)], [0, 0], [0, 0], "PATH_STEP"),
        ([(0, 0), (2, 0)], [0, 0], [0, 0], "PATH_STEP"),
        ([(0, 0), (2, 2)], [0, 0], [0, 0], "PATH_STEP"),
        ([(0, 0), (1, 0)], [0], [0, 0], "RING_COUNT"),
        (STRAIGHT, [0, 9, 0, 0, 0, 0, 0, 0], [0] * 8, "RING_COUNT"),
        (STRAIGHT, [0] * 8, [0, 17, 0, 0, 0, 0, 0, 0], "RING_COUNT"),
        (STRAIGHT, [0, 1.5, 0, 0, 0, 0, 0, 0], [0] * 8, "RING_COUNT"),
        (STRAIGHT, [0, -1, 0, 0, 0, 0, 0, 0], [0] * 8, "RING_COUNT"),
        (STRAIGHT, [0, "many", 0, 0, 0, 0, 0, 0], [0] * 8, "RING_COUNT"),
        (STRAIGHT, [0, math.inf, 0, 0, 0, 0, 0, 0], [0] * 8, "RING_COUNT"),
    ],
)
def test_nonsense_is_a_typed_error(way: Any, one: Any, two: Any, code: str) -> None:
    with pytest.raises(SettingError) as raised:
        dissertation_speeds(way, one, two)
    assert raised.value.code == code
    assert raised.value.allowed


@pytest.mark.parametrize("v0", [-1.0, math.nan, math.inf, True, "fast", 1e-200])
def test_start_velocity_must_be_a_speed(v0: Any) -> None:
    with pytest.raises(SettingError, match="START_SPEED"):
        dissertation_profile(STRAIGHT, [0] * 8, [0] * 8, v0=v0)


@pytest.mark.parametrize(
    "settings",
    [
        {"v_max": 0},
        {"v_max": -80},
        {"v_max": math.nan},
        {"v_max": "80"},
        {"braking": True},
        {"v_min": 81},
        {"ring1_drop": -1},
        {"ring1": "some"},
        {"ring2": None},
        {"outside1": 1},
        {"v_90": math.inf},
    ],
)
def test_settings_out_of_range_name_themselves(settings: dict[str, Any]) -> None:
    with pytest.raises(SettingError) as raised:
        DissertationLaw(**settings)
    assert raised.value.code == "LAW_SETTING"
    assert raised.value.where == f"dissertation.{next(iter(settings))}"


def test_every_setting_is_used() -> None:
    way = [(0, 0), (2, 1), (3, 2), (4, 2), (5, 2), (6, 3), (7, 3), (7, 4), (7, 5), (7, 6), (7, 7), (7, 8)]
    one = [0, 0, 0, 0, 0, 0, 0, 0, 2, 8, 0, 0]
    two = [0, 0, 0, 1, 0, 0, 0, 0, 1, 8, 0, 0]
    usual = dissertation_profile(way, one, two, law=DissertationLaw(v_180=78.0))[0]
    changed: dict[str, float] = {
        "v_max": 75,
        "v_min": 15,
        "ring1_drop": 12,
        "ring2_drop": 12,
        "a_straight": 8,
        "a_diagonal": 4,
        "a_knight": 2,
        "braking": 8,
        "v_180": 40,
        "v_135": 30,
        "v_90": 10,
    }
    for name, value in changed.items():
        law = DissertationLaw(**({"v_180": 78.0} | {name: value}))
        assert not np.array_equal(dissertation_profile(way, one, two, law=law)[0], usual), name


@pytest.mark.parametrize("table", TABLES)
def test_the_table_of_every_node_has_what_the_reproduction_finds(table: str) -> None:
    """On the corrected cells; the counts are put there as obstacles, since the maps of these tables are lost."""
    rows, way = velocity.corrected(table), np.array(velocity.cells(table))
    way = way - way.min(axis=0) + 4
    scene = lampyris.Scene(lampyris.Grid(np.zeros((60, 60), dtype=bool)), (0, 0), (0, 0), "dissertation")
    path = path_of(way.astype(np.int32), scene.moves)
    made = {}
    for k in range(1, len(way) - 1):
        counted = [int(rows[k]["ring1"]), int(rows[k]["ring2"])]
        made[k] = lampyris.node_table(scene, path, obstacles=around(way, k, *counted))
        assert [made[k].ring1[k], made[k].ring2[k]] == counted
        assert np.isnan(made[k].angle_deg[[0, -1]]).all()
        assert made[k].columns()["angle_velocity"][0] is None
    compared = 0
    for figure, verdict in zip(printed_data.figures(table), velocity.velocity(table), strict=True):
        name = {"angle": "angle_deg"}.get(figure.column, figure.column)
        if name in ("obstacle_velocity", "angle_deg", "angle_velocity") and figure.index in made:
            compared += 1
            assert short(getattr(made[figure.index], name)[figure.index]) == verdict.ours
    assert compared == 3 * (len(way) - 2)


def around(way: np.ndarray, k: int, one: int, two: int) -> list[tuple[int, int]]:
    """So many cells of ring 1, and of ring 2 ahead of the step into node k."""
    square = [(dx, dy) for dx in range(-2, 3) for dy in range(-2, 3)]
    step = (way[k] - way[k - 1]).tolist()
    near = [o for o in square if max(map(abs, o)) == 1][:one]
    far = [
        o for o in square
        if max(map(abs, o)) == 2 and o[0] * step[0] + o[1] * step[1] >= math.hypot(*o) * math.hypot(*step) * 0.7071
    ][:two]  # fmt: skip
    return [(int(way[k][0] + dx), int(way[k][1] + dy)) for dx, dy in (*near, *far)]
