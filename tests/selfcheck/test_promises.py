"""Every promise at its commit size: what ``lampyris selfcheck`` proves, as tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from _pytest.mark.structures import ParameterSet

from lampyris_selfcheck import registry, runner
from lampyris_selfcheck.check import Ask

ASK = Ask()


FROM_SOURCE = {"flake"}
"""Checks that say of an installed package that it has no tests."""


def _cases() -> list[ParameterSet]:
    return [
        pytest.param(name, kind, marks=[pytest.mark.source] if name in FROM_SOURCE else [])
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
