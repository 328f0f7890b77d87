"""Every promise at its commit size: what ``lampyris selfcheck`` proves, as tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from _pytest.mark.structures import ParameterSet

from lampyris_selfcheck import registry, runner
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.process import mutants

ASK = Ask()


MARKS = {"flake": [pytest.mark.source, pytest.mark.nightly], "deadline": [pytest.mark.nightly]}
"""Marks of a check's tests. An installed package has no tests to shuffle, and the suite runs once with every commit.
What judges by time is for the night: ``tests/planning/test_deadlines.py`` counts the work between two looks at the
clock.
"""


def _cases() -> list[ParameterSet]:
    return [
        pytest.param(name, kind, marks=MARKS.get(name, []))
        for name in registry.NAMES
        for kind in registry.check(name).kinds_for(ASK)
    ]


@pytest.mark.parametrize(("name", "kind"), _cases())
def test_the_promise_holds(name: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    check = registry.check(name)
    if not check.kinds_for(ASK)[kind].commit:
        pytest.skip("this kind has larger sizes only")
    result = runner.run(check, ASK, runner.Range(only=kind))
    told = [f"{f.kind} {f.number}: {f.what}" for f in result.outcome.failures[:5]]
    assert result.holds, "\n".join([*told, *result.lacks])


def test_every_seeded_defect_is_detected_by_what_runs_with_every_commit() -> None:
    """That its cases are within the commit size of the check is said where the defects are tested."""
    judges = {defect.check for group in mutants.GROUPS for defect in mutants.defects(group)}
    assert judges
    assert not judges & MARKS.keys()
