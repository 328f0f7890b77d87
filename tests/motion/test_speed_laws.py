"""Laws by name: the table, what each puts into a Profile, and words that nobody knows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris import Grid, Scene
from lampyris.errors import SettingError, UsageError
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.motion.laws import physical
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.dissertation import DissertationLaw, dissertation_profile
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.laws.rings import ring_counts
from lampyris.referee import check_profile

RNG = np.random.default_rng(21)
BLOCKED = RNG.random((20, 20)) < 0.25
WAY = [
    (0, 5),
    (1, 5),
    (2, 6),
    (3, 7),
    (4, 7),
    (5, 7),
    (6, 6),
    (6, 5),
    (7, 4),
    (8, 4),
    (9, 4),
    (10, 4),
    (11, 5),
]
for _x, _y in WAY:
    BLOCKED[_y, _x] = False
SCENE = Scene(Grid(BLOCKED), WAY[0], WAY[-1], moves="dissertation")
PATH = path_of(np.array(WAY), MOVES["dissertation"])
BODIES = [(5, 5), (3, 5), (8, 6), (9, 3)]


def test_the_table_lists_itself() -> None:
    related = ("blind", "cloud", "three-speed", "uncertainty")
    assert set(laws.names()) == {"constant", "dissertation", "optimum", "physical", "rpp", *related}
    assert list(laws.names()) == sorted(laws.names())
    for name, row in laws.LAWS.items():
        assert row.name == name
        assert row.summary
        assert row.source
        assert laws.profile(PATH, SCENE, law=name).units == row.units


@pytest.mark.parametrize(
    "law", ["dissertation", DissertationLaw(), DissertationLaw(ring2="all", outside1=False)]
)
def test_the_dissertations_profile_is_its_speeds_with_counted_rings(law: Any) -> None:
    settings = law if isinstance(law, DissertationLaw) else DissertationLaw()
    made = laws.profile(PATH, SCENE, law=law, obstacles=BODIES)
    n1, n2 = ring_counts(
        WAY, BLOCKED, BODIES, ring1=settings.ring1, ring2=settings.ring2,
        outside1=settings.outside1, outside2=settings.outside2,
    )  # fmt: skip
    v, cause = dissertation_profile(WAY, n1.tolist(), n2.tolist(), law=settings)
    assert (made.v.tolist(), made.cause) == (v.tolist(), cause)
    assert made.s.tolist() == PATH.arc.tolist()
    assert made.t.tolist() == list(range(len(WAY)))
    assert made.a.tolist() == [*np.diff(v).tolist(), 0.0]
    assert made.duration == len(WAY) - 1


def test_readings_change_what_is_counted() -> None:
    plain = laws.profile(PATH, SCENE, law="dissertation", obstacles=BODIES).v.tolist()
    for other in ({"ring1": "ahead"}, {"ring2": "all"}):
        assert laws.profile(PATH, SCENE, law=DissertationLaw(**other), obstacles=BODIES).v.tolist() != plain
    edge = path_of(np.array([(x, 0) for x in range(8)]), MOVES["dissertation"])
    free = Scene(Grid(np.zeros((9, 20), dtype=np.bool_)), (0, 0), (7, 0), moves="dissertation")
    assert laws.profile(edge, free, law="dissertation").cause[4] == "ring 1"
    assert laws.profile(edge, free, law=DissertationLaw(outside1=False)).cause[4] == "limit"
    assert laws.profile(edge, free, law=DissertationLaw(outside1=False, outside2=True)).cause[4] == "ring 2"


def test_the_dissertations_law_driven_on_cell_by_cell() -> None:
    whole = laws.profile(PATH, SCENE, law="dissertation", obstacles=BODIES)
    for k in range(1, len(WAY)):
        rest = path_of(PATH.cells[k:], PATH.moves)
        tail = laws.profile(
            rest, SCENE, law="dissertation", obstacles=BODIES, v0=float(whole.v[k]), previous=WAY[k - 1]
        )
        assert tail.v.tolist() == whole.v[k:].tolist()


def test_adding_an_obstacle_never_raises_a_speed_of_the_dissertations_law() -> None:
    rng = np.random.default_rng(22)
    for _ in range(100):
        some = [(int(x), int(y)) for x, y in rng.integers(0, 20, (8, 2))]
        before = laws.profile(PATH, SCENE, law="dissertation", obstacles=some[:4])
        assert (laws.profile(PATH, SCENE, law="dissertation", obstacles=some).v <= before.v).all()


@pytest.mark.parametrize("law", ["physical", "dissertation"])
def test_the_stranger_passes_both_laws(law: str) -> None:
    assert check_profile(laws.profile(PATH, SCENE, law=law, obstacles=BODIES), PATH, SCENE) is None


def test_settings_stand_for_their_law() -> None:
    assert laws.profile(PATH, SCENE, law=PhysicalLaw()).v.tolist() == laws.profile(PATH, SCENE).v.tolist()


def test_an_unknown_law_is_a_usage_error_that_helps() -> None:
    with pytest.raises(UsageError) as raised:
        laws.profile(PATH, SCENE, law="phisical")
    assert raised.value.code == "LAW"
    assert ", ".join(laws.names()) in str(raised.value)
    assert "did you mean physical?" in str(raised.value)
    with pytest.raises(UsageError):
        laws.profile(PATH, SCENE, law=None)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="ON_INFEASIBLE"):
        laws.profile(PATH, SCENE, on_infeasible="ignore")  # type: ignore[arg-type]


@pytest.mark.source
def test_every_page_that_a_law_cites_is_there() -> None:
    root = Path(__file__).resolve().parents[2]
    cited = {
        (row.name, page) for row in laws.LAWS.values() for page in re.findall(r"docs/\S+\.md", row.source)
    }
    assert len(cited) >= 6
    assert [one for one in sorted(cited) if not (root / one[1]).is_file()] == []


@pytest.mark.parametrize("word", ["on", True, {}])
def test_a_rule_is_switched_by_a_word(word: object) -> None:
    assert laws.with_settings("physical", {"approach": word}).approach == physical.Approach()
    off = laws.with_settings("blind", {"blind": "off"})
    assert off.blind is None
    assert laws.rules_of("physical")["approach"] == {"approach.distance": 1.0, "approach.speed": 0.05}
    assert laws.rules_of("rpp") == {}


def test_a_rule_that_is_no_number_names_its_settings() -> None:
    with pytest.raises(SettingError) as raised:
        laws.with_settings("physical", {"approach": 1})
    assert raised.value.where == "physical.approach"
    assert "approach.distance, approach.speed" in str(raised.value.allowed)
