"""Seeded defects: the engine on a toy package, and that the real ones still have their place."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

import lampyris
from lampyris.errors import FileError
from lampyris_selfcheck import registry, runner
from lampyris_selfcheck.check import Ask, Part, Tally
from lampyris_selfcheck.checks.process import mutants
from lampyris_selfcheck.checks.process.mutants_engine import (
    Defect,
    MutantRun,
    MutationEngine,
    load,
    times_found,
)
from lampyris_selfcheck.runner import Range

SOURCE = Path(lampyris.__file__).parent
MAIN = """
import json, sys
from toy import sums
cases = int(sys.argv[sys.argv.index("--cases") + 1])
wrong = [n for n in range(cases) if sums.double(n) != n + n]
failed = [{"what": f"double({n})"} for n in wrong]
unfinished = getattr(sums, "UNFINISHED", 0)
print(json.dumps({"cases": cases, "failures": len(wrong), "unfinished": unfinished, "failed": failed}))
sys.exit(6 if wrong else 0)
"""
SUMS = '''
STEP = 2
def double(n):
    """Twice n."""
    return STEP * n if n < 50 else n + n
'''


@pytest.fixture
def toy(tmp_path: Path) -> Path:
    package = tmp_path / "toy"
    (package / "data").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "__main__.py").write_text(MAIN)
    (package / "sums.py").write_text(SUMS)
    (package / "data" / "table.txt").write_text("1 2 3")
    return package


def _defect(find: str, replace: str, *, cases: int = 10, equivalent: str = "") -> Defect:
    return Defect("d", "sums.py", find, replace, "a slip", "sums", "all", cases, equivalent=equivalent)


@pytest.mark.parametrize(
    ("find", "replace", "cases", "fate"),
    [
        ("STEP = 2", "STEP = 3", 10, "killed"),
        ("STEP * n", "STEP * n + (n == 9)", 10, "killed"),
        ("STEP * n", "STEP * n + (n == 9)", 9, "survived"),  # the one case that shows it is not among them
        ('"""Twice n."""', '"""Half of n."""', 10, "survived"),
        ("STEP = 2", "STEP = two", 10, "broken"),  # the check cannot even be imported: that is no kill
        ("STEP = 2", "STEP = 2 ** (", 10, "broken"),
        ("STEP = 2", "STEP = 3\nUNFINISHED = 1", 10, "broken"),  # a part of the check raised: no kill either
        ("STEP = 4", "STEP = 3", 10, "misplaced"),
        ("n", "m", 10, "misplaced"),
        ("STEP = 2", "STEP = 2", 10, "misplaced"),
    ],
)
def test_what_becomes_of_a_defect(toy: Path, find: str, replace: str, cases: int, fate: str) -> None:
    assert MutationEngine(toy).judge(_defect(find, replace, cases=cases))[0] == fate


def test_each_defect_is_alone_in_the_copy_though_both_are_as_long_and_made_in_the_same_second(
    toy: Path,
) -> None:
    engine = MutationEngine(toy)
    fates = [engine.judge(_defect("STEP = 2", f"STEP = {n}"))[0] for n in (3, 4, 5)]
    fates.append(engine.judge(_defect("n + n", "n + 9"))[0])  # beyond the cases
    assert fates == ["killed", "killed", "killed", "survived"]


def test_a_check_that_fails_without_the_defect_proves_nothing(toy: Path) -> None:
    (toy / "sums.py").write_text(SUMS.replace("STEP = 2", "STEP = 5"))
    assert MutationEngine(toy).judge(_defect("n < 50", "n < 60"))[0] == "unsound"


@pytest.mark.nightly
def test_a_check_that_does_not_end_has_not_seen_the_defect(
    toy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lampyris_selfcheck.checks.process.mutants_engine.MORE", 0.5)
    defect = _defect("return STEP", "while n == 3: pass\n    return STEP")
    assert MutationEngine(toy).judge(defect)[0] == "endless"


def test_the_package_itself_is_left_alone(toy: Path) -> None:
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in toy.rglob("*.*")}
    MutationEngine(toy).judge(_defect("STEP = 2", "STEP = 3"))
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in toy.rglob("*.*")} == before


@pytest.mark.parametrize(
    ("fate", "equivalent", "failed"),
    [
        ("killed", "", 0),
        ("survived", "", 1),
        ("broken", "", 1),
        ("endless", "", 1),
        ("survived", "no case can", 0),
        ("killed", "no case can", 1),
    ],
)
def test_what_counts_as_a_failure(fate: str, equivalent: str, failed: int) -> None:
    tally = Tally(Part("planner", 0, 1))
    mutants.told(tally, 0, _defect("a", "b", equivalent=equivalent), fate, MutantRun(fate, "said", 1.0))
    assert tally.outcome().failed == failed


def test_a_defect_that_nobody_sees_fails_the_check(toy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    both = (_defect("STEP = 2", "STEP = 3"), _defect("Twice", "Half"))
    monkeypatch.setattr(mutants, "defects", lambda group: both if group == "sim" else ())
    engine = MutationEngine(toy)
    monkeypatch.setattr(mutants, "_engine", lambda: engine)
    result = runner.run(mutants.CHECK, Ask(workers=2), Range(only="sim", cases=2))
    assert (result.outcome.cases, result.outcome.failed) == (2, 1)
    assert result.outcome.counts["killed by sums"] == 1
    assert "survived, not killed" in result.outcome.failures[0].what


WHOLE = """
[[defect]]
id = "x"
file = "a.py"
find = "a"
replace = "b"
why = "c"
check = "d"
kind = "e"
cases = 1
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [("[[defect]]", "[[defect]"), ('why = "c"\n', ""), ('"x"', "3"), ("cases = 1", "cases = 1\nmore = 1")],
)
def test_a_file_of_defects_is_whole(tmp_path: Path, old: str, new: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(WHOLE)
    assert load(path)[0].judge == ("d", "e", 0, 1)
    path.write_text(WHOLE.replace(old, new))
    with pytest.raises(FileError, match="DEFECTS"):
        load(path)


REAL = [(group, defect) for group in mutants.GROUPS for defect in mutants.defects(group)]


@pytest.mark.parametrize(("group", "defect"), REAL, ids=[d.id for _, d in REAL])
def test_each_defect_has_its_place_and_its_check(group: str, defect: Defect) -> None:
    assert times_found(SOURCE, defect) == 1
    assert defect.find != defect.replace
    assert defect.why.strip()
    if defect.file.endswith(".py"):
        text = (SOURCE / defect.file).read_text(encoding="utf-8")
        compile(text.replace(defect.find, defect.replace), defect.file, "exec")
    kinds = registry.check(defect.check).kinds_for(Ask())
    assert defect.kind in kinds
    assert defect.first + defect.cases <= kinds[defect.kind].commit  # each commit would see it
    whole = kinds[defect.kind].whole
    assert whole is None or defect.first + defect.cases <= whole


def test_there_are_as_many_as_promised_and_each_has_a_name() -> None:
    count = Counter(group for group, defect in REAL if not defect.equivalent)
    promised = {
        "planner": 30,
        "repair": 15,
        "profile": 15,
        "sim": 10,
        "parsers": 10,
        "fleets": 20,
        "plans": 25,
    }
    promised |= dict.fromkeys(("metamorphic", "swarm", "store", "determinism"), 2)
    assert {group: count[group] >= least for group, least in promised.items()} == dict.fromkeys(
        promised, True
    )
    names = [defect.id for _, defect in REAL]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) for name in names)
    files = {path.stem for path in mutants.FOLDER.glob("*.toml")}
    assert files <= mutants.GROUPS.keys()


def test_the_check_that_must_see_a_defect_is_not_this_one() -> None:
    assert all(defect.check != mutants.CHECK.name for _, defect in REAL)


@pytest.mark.source
def test_the_docs_and_the_changelog_count_the_defects_right() -> None:
    root = Path(__file__).parents[2]
    none = sum(bool(defect.equivalent) for _, defect in REAL)
    words = " ".join((root / "docs" / "verification.md").read_text(encoding="utf-8").split())
    assert f"of {len(REAL)} seeded defects {len(REAL) - none} are detected by" in words
    words = " ".join((root / "CHANGELOG.md").read_text(encoding="utf-8").split())
    assert f"{len(REAL)} seeded defects (four of them" in words
    assert none == 4
