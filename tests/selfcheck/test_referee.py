"""The check of the referee: it finds a referee that lost a rule, or that refuses too much."""

from __future__ import annotations

from typing import Any

import pytest

from lampyris import referee as judge
from lampyris.referee import Violation
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.paths import referee
from lampyris_selfcheck.checks.paths.referee_cases import TWELVE
from lampyris_selfcheck.reference.paths.competition import first_wrong, moves_of, turns_of
from sizes import some

LOST = {
    "empty": {"paths"},
    "start": {"paths", "wild"},
    "goal": {"paths", "wild"},
    "outside": {"paths", "wild"},
    "wall": {"paths", "wild"},
    "step": {"paths", "wild"},
    "corner": {"paths", "wild"},
    "knight": {"paths"},
    "steps": {"paths"},
    "cost": {"paths", "wide"},
    "sweep": {"wide"},
}
"""Rules, and the kinds of cases that miss each."""


def ran(kind: str, cases: int = 400) -> Outcome:
    return referee.run(Ask(), Part(kind, 0, min(cases, referee.KINDS[kind].whole or cases)))


@pytest.mark.nightly
@pytest.mark.parametrize("rule", some(LOST, 3))
def test_a_lost_rule_is_found(rule: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def blind(*words: Any) -> Violation | None:
        found = judge.check_path(*words)
        return None if found is not None and found.rule == rule else found

    monkeypatch.setattr(referee, "check_path", blind)
    found = {kind for kind in referee.KINDS if ran(kind, {"wide": 60}.get(kind, 240)).failed}
    assert found == LOST[rule]


@pytest.mark.nightly
def test_a_referee_that_refuses_too_much_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """It refuses to visit a cell twice, which no rule forbids."""

    def strict(path: Any, *words: Any) -> Violation | None:
        cells = path.cells.tolist()
        twice = any(cell in cells[:k] for k, cell in enumerate(cells))
        return Violation("twice", "path", "a cell twice") if twice else judge.check_path(path, *words)

    monkeypatch.setattr(referee, "check_path", strict)
    assert ran("paths").failed
    assert ran("wild").failed


def test_a_referee_that_raises_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(referee, "check_path", lambda *words: 1 // 0)
    outcome = ran("paths", 10)
    assert outcome.failed == 10
    assert outcome.failures[0].what.startswith("ZeroDivisionError")


@pytest.mark.nightly
def test_half_is_refused_in_each_of_twelve_ways() -> None:
    outcome = ran("paths", 480)
    assert (outcome.cases, outcome.failed) == (480, 0)
    assert outcome.counts["accepted"] == outcome.counts["lawful"] == 240
    assert len(TWELVE) == 12
    assert all(outcome.counts[name] == 20 for name, _, _ in TWELVE)
    assert outcome.counts["judged by both"] > 150


def test_the_public_rules() -> None:
    open_ = [[False] * 4 for _ in range(4)]
    corner = [[False, True, False], [False] * 3, [False] * 3]
    assert first_wrong(open_, [(0, 0), (3, 3)]) == -1
    assert first_wrong(open_, [(0, 0), (3, 2)]) == 0
    assert first_wrong(open_, [(0, 0), (0, 3), (0, 4)]) == 1
    assert first_wrong(open_, [(1, 1), (1, 1)]) == 0
    assert first_wrong(corner, [(0, 1), (1, 0)]) == 0
    assert first_wrong(corner, [(0, 0), (1, 1)]) == 0
    assert first_wrong(corner, [(0, 0), (0, 1), (1, 1)]) == -1
    assert first_wrong(corner, []) == -1
    assert first_wrong(corner, [(0, 0)]) == 0
    assert moves_of([(0, 0), (3, 3), (3, 0)]) == (3, 3)
    assert turns_of([(0, 0), (1, 1), (2, 2), (2, 1), (2, 0)]) == [(0, 0), (2, 2), (2, 0)]
