"""Acceptance of the speed issue, in small: who moves touches nobody, arrives, and stops on bad data.

The full sizes are nightly; ``tools/stop_test.py`` and ``tools/fault_test.py`` print them as tables.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import pytest

from sizes import sized, some

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
fault_test = pytest.importorskip("fault_test", reason="the tools are not part of a wheel")
stop_test = pytest.importorskip("stop_test", reason="the tools are not part of a wheel")

pytestmark = pytest.mark.source


def cuts(law: str, n: int, jobs: int = 1) -> list:  # type: ignore[type-arg]
    work = partial(stop_test.one_cut, 0, "astar")
    return stop_test.many(work, [(k, law) for k in range(n)], jobs, law)


def crowds(law: str, kind: str, rounds: int) -> list:  # type: ignore[type-arg]
    work = partial(stop_test.one_crowd, 0, "astar", 10)
    count = rounds if rounds < 10 else rounds // 10 * len(stop_test.queries())
    return stop_test.many(work, [(k, law, kind) for k in range(count)], 1, kind)


@sized("cases", 6, 60)
def test_nobody_is_touched_while_the_robot_moves(cases: int) -> None:
    rows = cuts("physical", cases)
    assert [r.refused for r in rows if r.refused] == []
    assert sum(r.collisions for r in rows) == 0
    assert sum(r.outcome == "arrived" for r in rows) > cases * 2 / 3
    # Such as cut in are near enough to matter: some stand in the robot's way, some run into it as it stands.
    assert sum(r.gap < 0.3 for r in rows) > 0.14 * cases
    assert sum(r.hits for r in rows) > cases / 20


@pytest.mark.nightly
@sized("cases", 15, 30)
@pytest.mark.parametrize(("law", "most"), some([("rpp", 0.9), ("dissertation", 0.9)]))
def test_rivals_touch_somebody(law: str, most: float, cases: int) -> None:
    """The same obstacles do hit a robot that keeps no room for them: the test can fail."""
    rows = cuts(law, cases)
    assert [r.refused for r in rows if r.refused] == []
    assert 0 < sum(r.collisions > 0 for r in rows) < most * len(rows)


@pytest.mark.nightly
def test_it_arrives_among_ten_obstacles() -> None:
    rows = crowds("physical", "walk", 8)
    assert [r.refused for r in rows if r.refused] == []
    assert sum(r.collisions for r in rows) == 0
    assert [r.outcome for r in rows] == ["arrived"] * 8
    assert stop_test.in_time(rows) >= 7 / 8
    rows = crowds("physical", "crossing", 4)
    assert sum(r.collisions for r in rows) == 0


@pytest.mark.commit(3)
@pytest.mark.parametrize("kind", fault_test.FAULTS)
def test_bad_data_stop_the_robot(kind: str) -> None:
    rows = [fault_test.one(0, "physical", (kind, k)) for k in range(3)]
    assert [r for r in rows if not fault_test.good(r)] == []
    assert max(r.speed for r in rows) > 0.3


@pytest.mark.nightly
def test_runs_do_not_depend_on_how_many_run_at_once() -> None:
    assert cuts("physical", 4, jobs=2) == cuts("physical", 4)


@pytest.mark.nightly
def test_ten_thousand_obstacles_cut_in() -> None:
    rows = cuts("physical", 10_000, jobs=2)
    assert [r.refused for r in rows if r.refused] == []
    assert sum(r.collisions for r in rows) == 0


@pytest.mark.nightly
def test_it_arrives_among_ten_obstacles_every_time() -> None:
    rows = crowds("physical", "walk", 120)  # those of docs/speed/driving.md
    assert [r.refused for r in rows if r.refused] == []
    assert sum(r.collisions for r in rows) == 0
    assert stop_test.in_time(rows) >= 0.95
