"""The check of one answer everywhere can fail: it sees a last bit, an order, an idle setting."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

from lampyris.io.maps.recipes.make import RECIPES
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.process import determinism, determinism_run
from lampyris_selfcheck.checks.process import determinism_cases as corpus
from lampyris_selfcheck.checks.process.canonical import canonical, digest
from lampyris_selfcheck.checks.studies import small_studies

pytestmark = pytest.mark.nightly  # minutes: it breaks the product in processes of its own

LAST_BIT = """
import numpy as np
from lampyris._core import elementary
elementary.exp = lambda x: np.exp(np.asarray(x, dtype=np.float64))
"""
HASHED = """
from lampyris import api
real = api._seed
api._seed = lambda seed: real(seed) ^ (hash("seed") & 1023)
"""
ORDERED = """
from lampyris import api
asked = []
real = api._seed
api._seed = lambda seed: asked.append(seed) or real(seed) ^ len(asked)
"""
PLAIN_ALONE = """
import os
from lampyris import api
real = api._seed
api._seed = lambda seed: real(seed) ^ int(os.environ.get("NUMBA_DISABLE_JIT", "0"))
"""


@dataclasses.dataclass
class Told:
    value: object
    timing: float = 0.0


class Word(Enum):
    ONE = "one"


def broken(code: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have every process that is started from here on run this before all else."""
    (folder / "sitecustomize.py").write_text(code, encoding="utf-8")
    paths = [str(folder), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    determinism.plain_signs.cache_clear()


def run(kind: str, cases: int, first: int = 0) -> Outcome:
    return determinism.run(Ask(), Part(kind, first, cases))


@pytest.mark.skipif(not determinism.extensions(), reason="nothing of this processor can be switched off")
def test_an_exp_that_rounds_as_the_processor_likes_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("processor", 2, 3).failed == 0
    broken(LAST_BIT, tmp_path, monkeypatch)
    seen = run("processor", 2, 3)
    assert [failure.number for failure in seen.failures] == [4]  # a field takes no exponent, numbers do
    assert "without the setting" in seen.failures[0].what


@pytest.mark.parametrize(
    ("kind", "code"), [("hash seed", HASHED), ("order", ORDERED), ("plain kernels", PLAIN_ALONE)]
)
def test_what_a_setting_changes_is_seen(
    kind: str, code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken(code, tmp_path, monkeypatch)
    seen = run(kind, 20)
    assert seen.failed >= 2
    assert all("without the setting" in failure.what for failure in seen.failures)


def test_another_answer_than_was_kept_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = determinism.golden()
    other = (("plan ad-gso four found", "0" * 64), *kept.cases[1:])
    monkeypatch.setattr(determinism, "golden", lambda: dataclasses.replace(kept, cases=other))
    seen = run("as it is", 3)
    assert (seen.cases, seen.failed) == (3, 1)
    assert seen.failures[0].number == 0
    assert f"made by {kept.made}" in seen.failures[0].what
    # What another machine gives is told once, not by every setting.
    seen = run("threads", 3)
    assert (seen.failed, seen.counts["not as kept, and not because of the setting"]) == (0, 1)


def test_a_setting_that_is_not_in_force_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    idle = dataclasses.replace(determinism.SETTINGS["hash seed"], env={})
    monkeypatch.setitem(determinism.SETTINGS, "hash seed", idle)
    seen = run("hash seed", 2)
    assert "not in force: words" in seen.failures[0].what


def test_an_exception_is_a_failure_of_its_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken("from lampyris import api\ndel api.assess\n", tmp_path, monkeypatch)
    seen = run("as it is", 4)
    assert seen.failed == 3  # cases 0 to 3: two plans, a profile and a field, which plans nothing
    assert "NameError" in seen.failures[0].what
    assert run("threads", 1).failed == 1  # there as much as without the setting


@pytest.mark.parametrize(("number", "how"), [(2, "workers"), (3, "sittings")])
def test_a_study_that_is_another_is_seen(number: int, how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    real = small_studies.exported
    monkeypatch.setattr(
        small_studies, "exported", lambda made, rows: real(made, dict(list(rows.items())[1:]))
    )
    seen = run("studies", 1, number)
    assert seen.failed == 1
    assert how in seen.failures[0].what


def test_the_corpus_has_all_there_is_and_ends_in_every_way() -> None:
    built_in = [name for name in registry.names() if not registry.origin_of(name)]
    assert sorted(corpus.PLANNERS + corpus.LATER) == sorted(built_in)
    assert sorted(corpus.LAWS) == sorted(laws.LAWS)
    assert sorted(corpus.RECIPES) == sorted(RECIPES)
    kept = determinism.golden()
    assert len(kept.cases) == determinism.CASES
    labels = [label for label, _ in kept.cases]
    first = labels[: determinism.COMMIT]
    for planner in corpus.PLANNERS:
        assert any(f"plan {planner} " in label for label in first)
    for planner in corpus.PLANNERS + corpus.LATER:
        assert sum(f"plan {planner} " in label for label in labels) >= 3
    for law in corpus.LAWS:
        assert sum(label.startswith(f"profile {law} ") for label in labels) >= 3
        assert any(label.startswith(f"drive {law}") for label in labels)
    ends = {label.rpartition(" ")[2] for label in labels}
    assert ends >= {"found", "no-path", "start-occupied", "goal-occupied", "arrived", "timeout", "refused"}
    assert len({kept for _, kept in kept.cases}) > 0.98 * len(labels)
    assert sum(label.endswith("refused") for label in labels) < 0.03 * len(labels)


def test_a_case_is_the_same_whatever_was_done_before_it() -> None:
    request = {"numbers": [3, 8, 17], "shuffle": None, "compiled": False}
    told = determinism_run.answer(request)["cases"]
    backwards = [[number, *corpus.case(number)] for number in (17, 8, 3)]
    assert told == backwards[::-1]
    kept = determinism.golden().cases
    assert [(label, one) for _, label, one in told] == [kept[number] for number in (3, 8, 17)]


def test_every_bit_is_said() -> None:
    same = [
        (1.0, np.float64(1.0)),
        ({1, 2, 3}, {3, 2, 1}),
        ((1, 2), [1, 2]),
        (Told(1, 0.5), Told(1, 0.7)),
        (Word.ONE, "one"),
        (np.arange(6).reshape(2, 3).T, np.ascontiguousarray(np.arange(6).reshape(2, 3).T)),
        (np.arange(3, dtype=">i4"), np.arange(3, dtype="<i4")),
    ]
    for a, b in same:
        assert digest(a) == digest(b), (a, b)
    other = [
        (1.0, math.nextafter(1.0, 2.0)),
        (0.0, -0.0),
        (1, 1.0),
        (1, True),
        (np.zeros(3), np.zeros(3, dtype=np.float32)),
        (np.zeros(3), -np.zeros(3)),
        (np.zeros((1, 3)), np.zeros((3, 1))),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}),
        (Told(1), Told(2)),
        (b"a", b"b"),
    ]
    for a, b in other:
        assert digest(a) != digest(b), (a, b)
    for odd in (object(), np.array([object()]), Told):
        with pytest.raises(TypeError, match="no canonical form"):
            canonical(odd)


def test_hashes_are_renewed_by_a_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fresh = {"made": "here", "cases": [["plan", "a"], ["field", "b"]], "studies": {"plan 1": "c"}}
    file = tmp_path / "golden.json"
    monkeypatch.setattr(determinism, "GOLDEN", file)
    monkeypatch.setattr(determinism, "renewed", lambda: fresh)
    assert determinism.main(["--renew"]) == 0
    assert json.loads(file.read_text(encoding="utf-8")) == fresh
    capsys.readouterr()
    fresh["cases"][1] = ["field", "d"]  # type: ignore[index]
    assert determinism.main(["--renew"]) == 0
    assert capsys.readouterr().out == "1: ['field', 'b'] -> ['field', 'd']\n"
    with pytest.raises(SystemExit):
        determinism.main([])
