"""The page of promises is what was recorded, and every check serves a goal."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from lampyris_selfcheck import registry
from lampyris_selfcheck.check import Ask

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.source


def _module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look there for their module
    try:
        spec.loader.exec_module(module)
    finally:
        del sys.modules[name]
    return module


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    return _module("promises")


def test_the_page_is_made_of_the_records(tool: ModuleType) -> None:
    assert (ROOT / "docs" / "promises.md").read_text(encoding="utf-8") == tool.page(), (
        "python tools/promises.py page"
    )


def test_every_goal_is_there_once(tool: ModuleType) -> None:
    names = [goal["id"] for goal in tool.goals()]
    assert names == [f"G{n}" for n in range(1, len(names) + 1)]
    assert len(names) >= 30


def test_every_check_serves_the_goal_that_names_it(tool: ModuleType) -> None:
    serves = [(goal["check"], goal["id"]) for goal in tool.goals() if "check" in goal]
    assert {name for name, _ in serves} == set(registry.NAMES)
    for name, goal in serves:
        assert goal in registry.check(name).goals


def test_every_test_that_a_goal_names_is_there(tool: ModuleType) -> None:
    for goal in tool.goals():
        for word in re.findall(r"(?:tests|tools)/\S+", goal["command"]):
            assert (ROOT / word).exists(), f"{goal['id']}: {word}"


def test_every_guarantee_has_a_command_that_exists() -> None:
    page = (ROOT / "docs" / "verification.md").read_text(encoding="utf-8")
    lines = re.split(r"^- ", page.partition("## Guarantees")[2].partition("\n## ")[0], flags=re.MULTILINE)[1:]
    assert len(lines) >= 20
    for line in lines:
        command = re.findall(r"`((?:lampyris selfcheck|python) [^`]+)`", line)[-1:]
        assert command, line
        checks = re.findall(r"[a-z-]+", command[0].partition(" --")[0].removeprefix("lampyris selfcheck"))
        assert command[0].startswith("python") or {*checks} <= {*registry.NAMES}, command
        for file in re.findall(r"(?:tests|tools)/[\w/.]+", command[0]):
            assert (ROOT / file).exists(), file


def test_what_was_recorded_as_broken_is_told(tool: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = {"goal": "G21", "cases": 100, "failures": 2, "seconds": 3.0, "date": "2026-11-22"}
    monkeypatch.setattr(tool, "records", lambda: [broken])
    assert "**2 failures**" in tool.page()


# ---- which record serves which goal -----------------------------------------------------------------------

Said = dict[str, Any]


def _goal(tool: ModuleType, name: str) -> Said:
    return next(goal for goal in tool.goals() if goal["id"] == name)


def _kind(cases: int, *, first: int = 0, failures: int = 0) -> Said:
    told = {"first": first, "cases": cases, "failures": failures, "drawn": True, "seconds": 1.0}
    return told | {"counts": {"seen": cases}, "spreads": {}}


def _record(check: str, *, seed: int = 1, size: str = "nightly", code: str = "c", **kinds: Said) -> Said:
    figures = list(kinds.values())
    return {
        "check": check, "size": size, "seed": seed, "code": code, "date": "2026-11-22", "workers": 2,
        "kinds": {name.replace("_", "-"): kind for name, kind in kinds.items()}, "seconds": 9.0,
        "cases": sum(kind["cases"] for kind in figures), "failures": sum(k["failures"] for k in figures),
        "bound": None, "counts": {}, "spreads": {}, "failed": [], "lacks": [],
    }  # fmt: skip


def _measured(tool: ModuleType, name: str, *known: Said) -> str:
    row: str = tool._row(_goal(tool, name), list(known))
    return row.split("|")[4].strip()


def test_a_test_of_one_goal_is_none_of_another(tool: ModuleType) -> None:
    record = {"goal": "G21", "cases": 100, "failures": 0, "seconds": 3.0, "date": "2026-11-22", "skipped": 4}
    assert _measured(tool, "G21", record).startswith("100 cases, 0 failures, 4 skipped")
    for other in ("G15", "G20", "G24", "G29", "G30", "G1"):
        assert _measured(tool, other, record) == "not run yet"


def test_goals_that_share_a_check_have_their_own_kinds(tool: ModuleType) -> None:
    store = _record("store", noise=_kind(10), resume=_kind(7, failures=2))
    assert _measured(tool, "G17", store).startswith("nightly: 10 cases, 0 failures, 1 s")
    assert _measured(tool, "G19", store).startswith("nightly: 7 cases, **2 failures**")
    maps = _record("maps", closed=_kind(3), closed_ros=_kind(4), round_trip=_kind(50), one_hash=_kind(60))
    assert _measured(tool, "G23", maps).startswith("nightly: 110 cases")
    assert _measured(tool, "G25", maps).startswith("nightly: 7 cases")


def test_the_kinds_that_goals_name_are_those_of_the_check(tool: ModuleType) -> None:
    for check in ("store", "maps"):
        named = [k for goal in tool.goals() if goal.get("check") == check for k in goal["kinds"]]
        assert sorted(named) == sorted(registry.check(check).kinds_for(Ask()))


def test_pieces_without_a_common_case_are_summed(tool: ModuleType) -> None:
    one, two = (_record("grids", size="part", a=_kind(10, first=first)) for first in (0, 10))
    assert _measured(tool, "G1", one, two).startswith("part: 20 cases")
    over = _record("grids", size="part", a=_kind(12, first=5))
    assert _measured(tool, "G1", one, two, over).startswith("part: 12 cases")
    newer = _record("grids", size="part", code="d", a=_kind(3, first=50))
    assert _measured(tool, "G1", one, two, newer).startswith("part: 3 cases")


def test_another_seed_stands_beside(tool: ModuleType) -> None:
    one, two = (_record("grids", seed=seed, a=_kind(cases)) for seed, cases in ((1, 10), (2, 20)))
    said = _measured(tool, "G1", one, two)
    assert "10 cases" in said
    assert "20 cases" in said
    again = _record("grids", a=_kind(30))
    assert "10 cases" not in _measured(tool, "G1", one, two, again)


def test_a_record_that_a_later_one_has_whole_is_left_out(tool: ModuleType) -> None:
    two = _record("grids", a=_kind(10), b=_kind(20))
    three = _record("grids", a=_kind(10), b=_kind(25), c=_kind(5))
    assert _measured(tool, "G1", two, three).count("0 failures") == 1
    assert _measured(tool, "G1", three, two).count("0 failures") == 2
    fewer = _record("grids", a=_kind(10), b=_kind(19), c=_kind(5))
    assert _measured(tool, "G1", two, fewer).count("0 failures") == 2
    other = _record("grids", size="part", a=_kind(10), b=_kind(20), c=_kind(5))
    assert _measured(tool, "G1", two, other).count("0 failures") == 2


def test_what_too_few_cases_reached_is_told(tool: ModuleType) -> None:
    record = _record("grids", a=_kind(300)) | {"lacks": ["a: read in 0 of 300 cases"]}
    assert "**a: read in 0 of 300 cases**" in _measured(tool, "G1", record)


def test_what_was_not_run_of_a_size_and_what_is_of_earlier_code_is_told(tool: ModuleType) -> None:
    commit = _record("store", size="commit", resume=_kind(7))
    assert _measured(tool, "G19", commit).endswith("2026-11-22<br>nightly: not run yet")
    cut = _record("store", noise=_kind(10))
    rest = _measured(tool, "G17", cut).partition("<br>")[2]
    assert rest == "nightly, not run yet: bit, page, processes, writers"
    later = _record("store", code="d", resume=_kind(3))
    assert _measured(tool, "G17", cut, later).partition("<br>")[0].endswith("2026-11-22, *earlier code*")
    assert "earlier code" not in _measured(tool, "G19", cut, later)


def test_percent_does_not_hide_failures(tool: ModuleType) -> None:
    record = {"goal": "G29", "cases": 9, "failures": 1, "percent": 97.0, "seconds": 3.0, "date": "2026-11-22"}
    assert _measured(tool, "G29", record).startswith("97.0 %, **1 failures** in")
    assert "failures" not in _measured(tool, "G29", record | {"failures": 0})


def test_half_a_record_is_told_and_passed_over(
    tool: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(tool, "RECORDS", tmp_path / "r.jsonl")
    (tmp_path / "r.jsonl").write_text('{"goal": "G21"}\n{"goal": "G2')
    assert tool.records() == [{"goal": "G21"}]
    assert "line 2: half a record" in capsys.readouterr().err
    tool._keep({"goal": "G24"})
    assert tool.records() == [{"goal": "G21"}, {"goal": "G24"}]


def test_the_folder_of_maps_is_that_of_this_machine(
    tool: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(tool, "PAGE", tmp_path / "page.md")
    ran: list[str] = []
    monkeypatch.setattr(tool, "_run", lambda goal, command: ran.append(command) is None)
    monkeypatch.setenv("LAMPYRIS_SHARED", str(tmp_path / "nowhere"))
    assert tool.run(["G5"]) == 1
    assert not ran
    assert "cannot be run" in capsys.readouterr().out
    monkeypatch.setenv("LAMPYRIS_SHARED", str(tmp_path))
    assert tool.run(["G5", "G23", "G25"]) == 0
    maps = "lampyris selfcheck maps --size nightly"
    assert ran == [f"lampyris selfcheck scen --size nightly --folder {tmp_path}", maps]


def test_coverage_is_of_branches_and_of_a_suite_that_passed() -> None:
    tool = _module("coverage_rooms")
    names = ("covered_branches", "num_branches", "covered_lines", "num_statements")
    files = {
        f"src/lampyris/{room}/x.py": {"summary": dict(zip(names, (96, 100, 1, 1000), strict=True))}
        for room in tool.ROOMS
    }
    assert tool.measured(tool.by_room(files), failed=False) == {"cases": 700, "failures": 0, "percent": 96.0}
    assert tool.measured(tool.by_room(files), failed=True)["failures"] == 1
    files["src/lampyris/io/x.py"]["summary"]["covered_branches"] = 94
    assert tool.measured(tool.by_room(files), failed=False)["failures"] == 1


def test_what_coverage_leaves_out_is_there() -> None:
    """pytest says nothing of a test that it was to leave out and that has another name."""
    there = {
        f"tests/selfcheck/test_promises.py::test_the_promise_holds[{name}-{kind}]"
        for name in registry.NAMES
        for kind in registry.check(name).kinds_for(Ask())
    }
    assert set(_module("coverage_rooms").TIMED) <= there


def test_the_nightly_runs_to_its_end_and_tells_of_a_failure(tmp_path: Path) -> None:
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    (tmp_path / "Makefile").write_text(text.replace("@tools/browser.sh", "@true"))
    folder = tmp_path / ".venv" / "bin"
    folder.mkdir(parents=True)
    for name, code in (("python", 1), ("lampyris", 0)):
        (folder / name).write_text(f'#!/bin/sh\necho "$@" >> ran\nexit {code}\n')
        (folder / name).chmod(0o755)
    for name in (".made", ".run", ".dev", ".nightly"):
        (tmp_path / ".venv" / name).touch()
    made = ["make", "-o", ".venv/.nightly", "check-nightly"]
    done = subprocess.run(made, cwd=tmp_path, capture_output=True, text=True, check=False)
    ran = (tmp_path / "ran").read_text().splitlines()
    tools = ["tools/coverage_rooms.py", "tools/check_floors.py"]
    assert [line.split()[0] for line in ran] == ["-m", "-m", "selfcheck", *tools]
    assert "--record build/promises.jsonl" in ran[2]
    assert done.returncode != 0
    (folder / "python").write_text("#!/bin/sh\nexit 0\n")
    assert subprocess.run(made, cwd=tmp_path, capture_output=True, check=False).returncode == 0
