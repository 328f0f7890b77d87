"""The check of repaired fields and incremental planners can fail."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris.planning.field import repair as repairing
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.incremental.search import Estimates, Waves
from lampyris.planning.incremental.session import IncrementalSession
from lampyris.planning.living_map import LivingMap
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.changes import repair, repair_every
from sizes import some


def ask(kind: str, first: int, cases: int) -> Outcome:
    return repair.run(Ask(), Part(kind, first, cases))


@pytest.mark.nightly
@pytest.mark.parametrize(("side", "count"), [(3, repair.EVERY_3), (4, repair.EVERY_4)])
def test_every_edit_is_there_once(side: int, count: int) -> None:
    rows = repair_every.edits(side)
    assert 2 * len(rows) == count
    assert len(np.unique(rows[:, 0] << 5 | rows[:, 1])) == len(rows)
    assert not (rows[:, 0] >> rows[:, 1] & 1).any()


def test_a_sample_of_what_the_commit_size_leaves_out() -> None:
    seen = ask("4x4", 700_000, 200)
    assert (seen.cases, seen.failed) == (200, 0)


def test_a_part_that_begins_anywhere_says_the_same() -> None:
    whole = ask("3x3", 1000, 60)
    assert whole == ask("3x3", 1000, 17) + ask("3x3", 1017, 43)


@pytest.mark.nightly
def test_small_maps_are_repaired_and_the_rule_is_put_back() -> None:
    before = repairing.GIVE_UP, repairing.HOPELESS
    seen = ask("stories", 0, 20)
    assert seen.counts["fields repaired"] > 5 * seen.counts["fields solved anew"]
    assert before == (repairing.GIVE_UP, repairing.HOPELESS)


# ---- what is wrong is seen --------------------------------------------------------------------------------


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["3x3", "stories"])
@pytest.mark.parametrize("deaf", ["freed", "blocked"])
def test_a_repairer_that_does_not_hear(kind: str, deaf: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = FieldRepairer.repair

    def repair(self: FieldRepairer, **given: Any) -> Any:
        return right(self, **{**given, deaf: ()})

    monkeypatch.setattr(FieldRepairer, "repair", repair)
    assert ask(kind, 0, {"3x3": 300, "stories": 20}[kind]).failed


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["3x3", "stories"])
@pytest.mark.parametrize("search", [Waves, Estimates])
def test_a_search_that_does_not_hear(kind: str, search: type, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "edit", lambda *_: None)
    seen = ask(kind, 0, {"3x3": 600, "stories": 20}[kind])
    assert seen.failed
    words = ("dstar-lite", "lpa-star") if search is Estimates else ("dstar", "focussed-dstar")
    assert any(word in f.what for word in words for f in seen.failures)


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", some(["3x3", "4x4"]))
@pytest.mark.parametrize("wrong", ["through a wall", "turned round", "another way of that length"])
def test_a_way_that_cannot_be_driven(kind: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Status and cost are right, as they are told; the way is not."""
    honest = IncrementalSession.plan

    def plan(self: Any, *given: Any) -> Any:
        told = honest(self, *given)
        if told.path is None or len(told.path.cells) < 2:
            return told
        cells = told.path.cells.copy()
        if wrong == "turned round":
            cells = cells[::-1]
        elif wrong == "through a wall":
            cells[1:-1] = 0
        else:
            cells = np.concatenate((cells[:1], cells[:-1]))
        return replace(told, path=replace(told.path, cells=cells))

    monkeypatch.setattr(IncrementalSession, "plan", plan)
    assert ask(kind, {"3x3": 4000, "4x4": 900_000}[kind], 200).failed > 10


@pytest.mark.nightly
def test_a_map_that_forgets_terrain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LivingMap, "_grade", lambda *_: [])
    assert ask("stories", 0, 20).failed


def test_an_exception_is_a_failure_and_no_end(monkeypatch: pytest.MonkeyPatch) -> None:
    def repair(self: FieldRepairer, **given: Any) -> Any:
        raise RuntimeError("out of order")

    monkeypatch.setattr(FieldRepairer, "repair", repair)
    for kind, cases in (("3x3", 20), ("stories", 3)):
        seen = ask(kind, 0, cases)
        assert (seen.cases, seen.failed) == (cases, cases)
        assert "RuntimeError: out of order" in seen.failures[0].what
