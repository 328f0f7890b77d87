"""Studies as plain data: the same jobs again, and the first thing in which two studies differ."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris.errors import LampyrisError
from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.study.design.serialize import differing, study_of, study_plain
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, World


def ground(name: str, seed: int, resolution: float = 1.0) -> StudyMap:
    """A map."""
    grid = Grid(np.random.default_rng(seed).random((8, 9)) < 0.2, name=name, resolution=resolution)
    return StudyMap(name, grid, map_hash(grid))


A, B = ground("a", 1), ground("b", 2, 0.05)
STUDY = Study(
    name="s",
    about="words",
    kind="simulate",
    worlds=(World(A, (0, 0), (5, 5)), World(A, (0, 0), (5, 6), 7.5), World(B, (1, 1), (2, 2))),
    planners=(
        Config("astar", {}),
        Config("ad-gso", {"nt": 10, "rho": 0.4, "iter_max": None}, "ours", "dist 1.0"),
    ),
    laws=(Config("physical", {"creep": 0.1}), Config("dissertation", {})),
    traffic_cases=(StudyTraffic(), StudyTraffic("random-walk", 5, 0.1, 0.2, "live")),
    seeds=(3, 1),
    moves="octile",
    robot={"radius": 0.0, "jerk_max": None},
    expansions=10,
    seconds=1.5,
    ticks=100,
    patience=3,
    drive={"period": 0.1},
    root=7,
    memory=True,
)
GRIDS = {one.hash: one.grid for one in (A, B)}


def sent(study: Study) -> dict[str, Any]:
    """A study through JSON."""
    plain: dict[str, Any] = json.loads(json.dumps(study_plain(study)))
    return plain


def jobs(study: Study) -> list[tuple[int, str, dict[str, Any], dict[str, Any]]]:
    """All that a job says."""
    return [(j.index, j.key, dict(j.plain), dict(j.labels)) for j in study.jobs()]


def test_the_same_jobs_come_back() -> None:
    for study in (STUDY, replace(STUDY, seconds=None, expansions=None, kind="plan", drive={}, memory=False)):
        back = study_of(sent(study), GRIDS)
        assert jobs(back) == jobs(study)
        assert len(back) == 48
        assert (back.name, back.about, back.memory) == (study.name, study.about, study.memory)
        assert sent(back) == sent(study)
        assert not differing(sent(back), sent(study))
        assert back.worlds[0].ground is back.worlds[1].ground


EIGHT = replace(STUDY.planners[1], settings={"nt": 8, "rho": 0.4, "iter_max": None})
CHANGES: list[tuple[dict[str, Any], str]] = [
    ({"kind": "drive"}, "kind: 'simulate' and 'drive'"),
    ({"moves": "four-connected"}, "moves: 'octile' and 'four-connected'"),
    ({"robot": {"radius": 0.5, "jerk_max": None}}, "robot.radius: 0.0 and 0.5"),
    ({"robot": {"radius": 0, "jerk_max": None}}, "robot.radius: 0.0 and 0"),
    ({"robot": {"radius": 0.0}}, "robot.jerk_max: None and None"),
    ({"expansions": None}, "expansions: 10 and None"),
    ({"seconds": 2.0}, "seconds: 1.5 and 2.0"),
    ({"ticks": 99}, "ticks: 100 and 99"),
    ({"patience": 4}, "patience: 3 and 4"),
    ({"drive": {"period": 0.2}}, "drive.period: 0.1 and 0.2"),
    ({"root": 8}, "root: 7 and 8"),
    ({"memory": False}, "memory: True and False"),
    ({"worlds": STUDY.worlds[:2]}, "maps: 2 values and 1 values"),
    ({"worlds": (STUDY.worlds[0], STUDY.worlds[2])}, "worlds: 3 values and 2 values"),
    (
        {"worlds": (World(ground("c", 3), (0, 0), (5, 5)), *STUDY.worlds[1:])},
        "maps: 2 values and 3 values",
    ),
    ({"worlds": (STUDY.worlds[0], replace(STUDY.worlds[1], goal=(5, 7)), STUDY.worlds[2])},
     "worlds.1.goal.1: 6 and 7"),
    ({"worlds": (STUDY.worlds[0], replace(STUDY.worlds[1], published=7.6), STUDY.worlds[2])},
     "worlds.1.published: 7.5 and 7.6"),
    ({"planners": (STUDY.planners[1], STUDY.planners[0])}, "planners.0.name: 'astar' and 'ad-gso'"),
    (
        {"planners": (STUDY.planners[0], EIGHT)},
        "planners.1.settings.nt: 10 and 8",
    ),
    ({"planners": (STUDY.planners[0], replace(STUDY.planners[1], origin="dist 1.1"))},
     "planners.1.origin: 'dist 1.0' and 'dist 1.1'"),
    ({"laws": (STUDY.laws[0],)}, "laws: 2 values and 1 values"),
    ({"traffic_cases": (StudyTraffic(), StudyTraffic("random-walk", 6, 0.1, 0.2, "live"))}, "traffic_cases.1.count: 5 and 6"),
    ({"seeds": (3, 2)}, "seeds.1: 1 and 2"),
    ({"seeds": (3, 1, 2)}, "seeds: [3, 1] and [3, 1, 2]"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "said"), CHANGES, ids=lambda c: str(c)[:30])
def test_the_first_difference_is_named(change: dict[str, Any], said: str) -> None:
    other = replace(STUDY, **change)
    found = differing(sent(STUDY), sent(other))
    assert found.replace("[{'hash': ", "") == said or found.startswith(said.split(":")[0] + ": "), found
    if not said.startswith(("maps", "worlds")):
        assert found == said
    assert differing(study_plain(STUDY), sent(STUDY)) == ""
    if "memory" not in change and "published" not in said:
        # What differs in this sense has other jobs, and what has other jobs differs.
        assert [j.key for j in STUDY.jobs()] != [j.key for j in other.jobs()]


def test_names_decide_nothing() -> None:
    other = replace(
        STUDY, name="t", about="", planners=(STUDY.planners[0], replace(STUDY.planners[1], label="theirs"))
    )
    assert differing(sent(STUDY), sent(other)) == ""
    assert [j.key for j in STUDY.jobs()] == [j.key for j in other.jobs()]
    assert sent(STUDY) != sent(other)


def test_another_release_is_refused() -> None:
    for version in (["0.0.0", 1], [sent(STUDY)["version"][0], 99]):
        with pytest.raises(LampyrisError, match=rf"^error\[STUDY_VERSION\].*lampyris {version[0]}, results"):
            study_of({**sent(STUDY), "version": version}, GRIDS)
    with pytest.raises(LampyrisError, match=r"^error\[STUDY_VERSION\].*format 1; allowed.*format 2"):
        study_of({**sent(STUDY), "format": 1}, GRIDS)


def test_other_maps_are_refused() -> None:
    coarse = Grid(B.grid.blocked, name="b", resolution=0.1)
    cases: list[tuple[Mapping[str, Grid], str]] = [
        ({A.hash: A.grid}, "'b' is missing"),
        ({A.hash: A.grid, B.hash: A.grid}, "'b' has other cells"),
        ({A.hash: A.grid, B.hash: coarse}, r"'b' has 0\.1 metres a cell, not 0\.05"),
    ]
    for grounds, says in cases:
        with pytest.raises(LampyrisError, match=rf"^error\[STUDY_MAP\].*{says}"):
            study_of(sent(STUDY), grounds)


@pytest.mark.parametrize("key", ["worlds", "planners", "laws", "traffic_cases", "seeds"])
def test_a_study_that_has_something_twice_is_refused(key: str) -> None:
    plain = sent(STUDY)
    plain[key] = [*plain[key], plain[key][0]]
    if key in plain["called"]:
        plain["called"][key] = [*plain["called"][key], "again"]
    with pytest.raises(LampyrisError, match=rf"^error\[STUDY_PLAIN\].*a {key.removesuffix('s')} twice"):
        study_of(plain, GRIDS)


def parts(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The ways to all parts of plain data."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield (*way, key)
        yield from parts(inner, (*way, key))


def altered(way: tuple[Any, ...], change: Callable[[Any, Any], None]) -> dict[str, Any]:
    """The plain study with one part changed."""
    plain = sent(STUDY)
    at: Any = plain
    for step in way[:-1]:
        at = at[step]
    change(at, way[-1])
    return plain


def test_damaged_data_is_a_study_or_a_typed_error() -> None:
    """Of whatever part, taken away or of another kind: never anything but an error of ours."""
    ways = list(parts(sent(STUDY)))
    assert len(ways) > 80
    refused = 0
    for way in ways:

        def taken(at: Any, key: Any) -> None:
            del at[key]

        for junk in (None, "x", -1, [], {}, 1e308):

            def put(at: Any, key: Any, junk: Any = junk) -> None:
                at[key] = junk

            for plain in (altered(way, put), altered(way, taken)):
                try:
                    list(study_of(plain, GRIDS).jobs())
                except LampyrisError:
                    refused += 1
                except (TypeError, ValueError) as fault:
                    raise AssertionError(f"{way} {junk!r}: {fault!r}") from fault
    assert refused > 200
