"""The check of published lengths: every line is asked, and what disagrees or cannot be read is listed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from lampyris.errors import UsageError
from lampyris.model.plan import Plan, Status
from lampyris.planning.graph.session import GraphSession
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.paths import scen as check
from lampyris_selfcheck.runner import Range, run

MAP = "type octile\nheight 2\nwidth 4\nmap\n....\n.@..\n"


def line(start: tuple[int, int], goal: tuple[int, int], length: str) -> str:
    return f"0\ta.map\t4\t2\t{start[0]}\t{start[1]}\t{goal[0]}\t{goal[1]}\t{length}\n"


def files(folder: Path, *lines: str, maps: str = ".") -> Ask:
    (folder / maps).mkdir(exist_ok=True)
    (folder / maps / "a.map").write_text(MAP)
    (folder / "scens").mkdir(exist_ok=True)
    (folder / "scens" / "a.map.scen").write_text("version 1\n" + "".join(lines))
    return Ask(folder=folder)


def outcome(ask: Ask, cases: int | None = None) -> Outcome:
    return run(check.CHECK, ask, Range(cases=cases)).outcome


def fresh() -> None:
    """Forget the files of the test before."""
    for known in (check._files, check._maps, check._lines, check._tried, check._made):
        known.cache_clear()


@pytest.fixture(autouse=True)
def _fresh() -> None:
    fresh()


@pytest.mark.parametrize("maps", ["scens", "."])
def test_every_line_of_a_folder_is_a_case(tmp_path: Path, maps: str) -> None:
    good = [line((0, 0), (3, 0), "3.00000"), line((0, 1), (2, 1), "4.00000"), line((0, 0), (3, 1), "3.41421")]
    ask = files(tmp_path, *good * 10, maps=maps)
    kinds = check.CHECK.kinds_for(ask)
    assert [(name, kind.commit, kind.release) for name, kind in kinds.items()] == [
        ("scens/a.map.scen", 30, 30)
    ]
    made = outcome(ask)
    assert (made.cases, made.failed) == (30, 0)
    assert sum(n for name, n in made.counts.items() if name.startswith("by ")) == 30


def test_all_that_disagree_are_listed(tmp_path: Path) -> None:
    off = [line((0, 0), (3, 0), length) for length in ("3.00040", "2.99960", "3.5", "2")]
    made = outcome(files(tmp_path, *off * 10, line((0, 0), (3, 0), "3.00002")))
    assert made.cases == 41
    assert made.failed == len(made.failures) == 40
    assert "line 2, (0, 0) to (3, 0), astar: 3.0 cells, published 3.0004" in made.failures[0].what


def test_a_file_that_cannot_be_read_fails_with_all_its_lines(tmp_path: Path) -> None:
    made = outcome(files(tmp_path, line((0, 0), (3, 0), "3"), line((1, 1), (3, 0), "3")))
    assert (made.cases, made.failed) == (2, 2)
    assert "START_OCCUPIED" in made.failures[0].what
    (tmp_path / "a.map").unlink()
    fresh()
    assert "FILE_MISSING" in outcome(Ask(folder=tmp_path)).failures[0].what


def test_a_folder_without_queries_is_a_mistake(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"holds no \.scen file"):
        check.CHECK.kinds_for(Ask(folder=tmp_path))


def test_files_of_our_own_hold_and_differ() -> None:
    made = outcome(Ask(), 200)
    assert made.failed == 0
    maps = {check._made(Ask(), k).document.grid.blocked.shape for k in range(8)}
    assert len(maps) > 5


@pytest.mark.nightly
def test_a_planner_that_goes_astray_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = GraphSession._answer

    def denied(self: GraphSession, *args: Any) -> Plan:
        plan = genuine(self, *args)
        return Plan(Status.NO_PATH, plan.planner) if plan and len(plan.path.cells) > 5 else plan

    monkeypatch.setattr(GraphSession, "_answer", denied)
    made = outcome(Ask(), 200)
    assert made.failed > 20
    assert all("answers no-path, published" in f.what for f in made.failures)


@pytest.mark.nightly
def test_a_sample_of_the_published_files(movingai: Path) -> None:
    ask = Ask(folder=movingai)
    made = outcome(ask, 20)
    assert made.cases == 20 * len(check.CHECK.kinds_for(ask))
    assert made.failed == 0
