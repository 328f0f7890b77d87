"""The check of one answer everywhere sees a setting that was asked for and is not in force."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import pytest

from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.process import determinism

CHANGED = ("processor", "threads", "place", "plain kernels", "compiled kernels")


def told(kind: str, signs: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Outcome:
    """What comes of a setting whose process shows these signs; no case is asked."""
    monkeypatch.setattr(determinism, "hashed", lambda *_: {"cases": [], "signs": signs})
    return determinism.run(Ask(), Part(kind, 0, 0))


@pytest.mark.nightly
def test_what_is_not_in_force_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    as_it_is = determinism.plain_signs()
    assert told("as it is", as_it_is, monkeypatch).failed == 0
    for kind in CHANGED:
        if kind == "processor" and not determinism.extensions():
            continue
        found = told(kind, as_it_is, monkeypatch)
        assert found.failed == 1, kind
        assert "not in force" in found.failures[0].what


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["processor", "threads", "place", "plain kernels"])
def test_what_is_set_is_in_force(kind: str) -> None:
    found = determinism.run(Ask(), Part(kind, 0, 0))
    assert [one.what for one in found.failures] == []


@pytest.mark.nightly
@pytest.mark.skipif(
    not (shutil.which("localedef") and Path("/usr/share/i18n/locales/tr_TR").is_file()),
    reason="no localedef, or nothing to make a locale of",
)
def test_turkish_is_made_where_the_system_does_not_speak_it() -> None:
    found = determinism.run(Ask(), Part("place", 0, 0))
    assert found.counts["locale tr_TR.UTF-8 UTF-8"] == 1, found.counts


@pytest.mark.nightly
def test_what_was_set_beside_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that keeps more of its surroundings than it was told to."""
    for name, other in (("jit", "off"), ("numba threads", "2"), ("zone", "05:45")):
        found = told("as it is", {**determinism.plain_signs(), name: other}, monkeypatch)
        assert f"not in force: {name}" in found.failures[0].what
        monkeypatch.undo()


@pytest.mark.nightly
def test_a_setting_that_is_left_out_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    idle = dataclasses.replace(determinism.SETTINGS["threads"], env={})
    monkeypatch.setitem(determinism.SETTINGS, "threads", idle)
    found = determinism.run(Ask(), Part("threads", 0, 0))
    assert "not in force: numba threads '1'" in found.failures[0].what


def test_studies_run_on_one_two_four_and_eight_workers() -> None:
    assert {workers for _, seeds, workers, _ in determinism.STUDIES if seeds > 1} == {0, 1, 2, 4, 8}
    studies = determinism.CHECK.kinds_for(Ask())["studies"]
    assert studies.nightly == studies.whole == len(determinism.STUDIES)
