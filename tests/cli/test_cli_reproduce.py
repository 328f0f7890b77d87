"""``lampyris reproduce`` on the command line: what it prints, what it keeps, what it refuses.

The work itself is stood in for here; it has tests of its own.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import lampyris.reproduce
from bad_inputs.case import Outcome, inside, run
from lampyris.reproduce import KINDS, Report, RunProgress, Verdict

WORK: list[dict[str, Any]] = []


def _work(out: Path, *, workers: int, quick: bool, progress: Callable[[RunProgress], None] | None) -> Report:
    """Two verdicts, and a page."""
    WORK.append({"out": out, "workers": workers, "quick": quick})
    (out / "runs").mkdir(parents=True, exist_ok=True)
    assert progress is not None
    for done in range(11):
        progress(RunProgress("nt", done, 10, 10.0 - done))
    (out / "index.html").write_text("<p>page</p>")
    some = (
        Verdict("4.2", "row 1", "1.5", "1.5", "exact", "the same"),
        Verdict("4.2", "row 2", "7", "8", "misprint", "a slip"),
    )
    claim = (Verdict("text", "abstract", "300 %", "", "impossible", "why"),)
    counts = dict.fromkeys(KINDS, 0) | {"exact": 1, "misprint": 1, "impossible": 1}
    page = out / "index.html"
    return Report({"4.2": some, "text": claim}, counts, "What it gains.", {"nt": 10}, page, (page,))


@pytest.fixture(autouse=True)
def _stood_in(monkeypatch: pytest.MonkeyPatch) -> None:
    WORK.clear()
    monkeypatch.setattr(lampyris.reproduce, "reproduce", _work)


def reproduce(folder: Path, *words: str) -> Outcome:
    """``lampyris reproduce`` in this process, in a folder."""
    with inside(folder):
        return run("reproduce", *words)


def test_the_verdicts_are_counted_table_by_table(tmp_path: Path) -> None:
    done = reproduce(tmp_path, "--workers", "3", "--quick")
    assert done.exit == 0, done.err
    (asked,) = WORK
    assert asked == {"out": Path("reproduction"), "workers": 3, "quick": True}
    lines = [line.split() for line in done.out.splitlines()]
    assert ["figures", "exact", "misprint", "impossible"] in lines
    assert ["Table", "4.2", "2", "1", "1", "-"] in lines
    assert ["what", "the", "text", "claims", "1", "-", "-", "1"] in lines
    assert ["all", "3", "1", "1", "1"] in lines
    assert "What it gains." in done.out
    assert "10 runs, 0:00; the page: reproduction/index.html" in done.out
    assert "5 of 10 runs, about 0:05 left" in done.err


def test_json(tmp_path: Path) -> None:
    done = reproduce(tmp_path, "--out", "here", "--json")
    assert (done.exit, done.err) == (0, "")
    record = json.loads(done.out)
    assert (record["page"], record["figures"], record["runs"]) == ("here/index.html", 3, {"nt": 10})
    assert record["tables"]["4.2"]["misprint"] == 1
    assert set(record["counts"]) == set(KINDS)


def test_an_earlier_reproduction_is_gone_on_with_and_no_other_folder_is_written_into(tmp_path: Path) -> None:
    for _ in range(2):
        assert reproduce(tmp_path, "--out", "here").exit == 0
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "index.html").write_text("kept")
    done = reproduce(tmp_path, "--out", "mine")
    assert (done.exit, done.out) == (2, "")
    assert done.err.startswith("error[EXISTS]: mine: ")
    assert (tmp_path / "mine" / "index.html").read_text() == "kept"
    assert reproduce(tmp_path, "--out", "mine", "--force").exit == 0
    (tmp_path / "file").write_text("kept")
    done = reproduce(tmp_path, "--out", "file", "--force")
    assert (done.exit, done.err.startswith("error[FILE_WRITE]: file: not a folder")) == (3, True)


def test_ctrl_c_says_how_to_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: Any, **__: Any) -> Report:
        raise KeyboardInterrupt

    monkeypatch.setattr(lampyris.reproduce, "reproduce", stopped)
    done = reproduce(tmp_path, "--out", "here", "--quick")
    assert (done.exit, done.out) == (130, "")
    last = done.err.splitlines()[-1]
    assert last == (
        "interrupted: what was run is kept in here/runs; continue with: lampyris reproduce --out here --quick"
    )
