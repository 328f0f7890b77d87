"""``lampyris study`` as its users meet it: one small file, one store, killed and continued, and told of."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bad_inputs.case import Outcome, inside
from bad_inputs.case import run as here
from lampyris.cli.progress import clock
from lampyris.cli.text import plural
from lampyris.cli.verbs.study import running, tables
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, World
from lampyris.study.store.store import Store

SMALL = """\
version: 1
name: small
about: Does it run?
maps:
  - {bundled: guide, queries: [{start: [0, 9], goal: [7, 0]}]}
planners: [astar, ad-gso]
seeds: 2
"""
SLOW = """\
version: 1
name: slow
maps:
  - bundled: env-1
    queries: {random: 20, least: 20}
planners: [astar, dstar-lite, theta-star]
traffic:
  - {kind: random-walk, count: 20}
seeds: 100
"""


def study(folder: Path, *words: str) -> Outcome:
    """``lampyris study`` in this process, in a folder."""
    with inside(folder):
        return here("study", *words)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "small.yaml").write_text(SMALL)
    return tmp_path


def test_a_study_runs_and_is_told(folder: Path) -> None:
    done = study(folder, "small.yaml", "--workers", "1", "--csv", "small.csv")
    assert done.exit == 0, done.err
    assert "2 seeds x 2 planners x 1 law = 4 runs (plan)" in done.err
    assert "kept in small.study.db" in done.err
    assert "4 of 4 runs: 4 done; 4 new" in done.out
    assert "wrote small.csv" in done.out
    assert len((folder / "small.csv").read_text().splitlines()) == 5
    assert (folder / "small.study.db").exists()


def test_a_second_call_has_nothing_left_to_do(folder: Path) -> None:
    study(folder, "small.yaml", "--workers", "1", "--csv", "a.csv")
    again = study(folder, "small.yaml", "--workers", "1", "--csv", "b.csv")
    assert again.exit == 0
    assert "4 of 4 there already" in again.err
    assert "4 of 4 runs: 4 done; 0 new" in again.out
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()


def test_options_may_stand_before_the_name_and_run_may_be_said(folder: Path) -> None:
    for words in (("--workers", "1", "--dry-run", "small.yaml"), ("run", "small.yaml", "--dry-run")):
        done = study(folder, *words)
        assert done.exit == 0, done.err
        assert "small.study.db, new" in done.out
    assert not (folder / "small.study.db").exists()


def test_json_is_all_there_is_on_stdout(folder: Path) -> None:
    done = study(folder, "small.yaml", "--workers", "1", "--json", "--csv", "a.csv")
    record = json.loads(done.out)
    assert done.err == ""
    assert (record["study"], record["runs"], record["done"], record["new"]) == ("small", 4, 4, 4)
    assert record["endings"] == {"done": 4, "refused": 0, "timeout": 0, "failed": 0}
    assert record["files"] == ["a.csv"]
    assert record["summary"]["entrants"] == ["astar", "ad-gso"]
    assert set(record["timing"]) == {"wall_s"}
    dry = json.loads(study(folder, "small.yaml", "--json", "--dry-run").out)
    assert (dry["done"], dry["runs"]) == (4, 4)


def test_another_study_does_not_go_into_the_store(folder: Path) -> None:
    study(folder, "small.yaml", "--workers", "1")
    (folder / "small.yaml").write_text(SMALL.replace("seeds: 2", "seeds: 3"))
    for more in ((), ("--dry-run",)):
        done = study(folder, "small.yaml", "--workers", "1", *more)
        assert done.exit == 3
        assert "error[STORE_OTHER]" in done.err
        assert "seeds" in done.err
    fresh = study(folder, "small.yaml", "--workers", "1", "--fresh")
    assert fresh.exit == 0
    assert "6 of 6 runs: 6 done; 6 new" in fresh.out


def test_beginning_anew_can_be_killed_anywhere_and_asked_for_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed once the store was gone and its log was not, neither `--fresh` nor the study alone went on."""
    study(folder, "small.yaml", "--workers", "1")
    store, log = folder / "small.study.db", folder / "small.study.db-wal"
    unlink = Path.unlink
    for point in range(3):
        log.write_bytes(b"what a killed writer left")
        left = [point]

        def killed(self: Path, missing_ok: bool = False, left: list[int] = left) -> None:
            if not left[0]:
                raise KeyboardInterrupt
            left[0] -= 1
            unlink(self, missing_ok)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "unlink", killed)
            with pytest.raises(KeyboardInterrupt):
                running._discard(store)
        done = study(folder, "small.yaml", "--workers", "1", "--fresh")
        assert (done.exit, "4 new" in done.out) == (0, True), (point, done.err)


def test_beginning_anew_through_a_link_begins_its_store_anew(folder: Path) -> None:
    """The lock and the log lie beside the store, not beside the link."""
    study(folder, "small.yaml", "--workers", "1")
    (folder / "real").mkdir()
    link, real = folder / "small.study.db", folder / "real" / "a.db"
    link.rename(real)
    link.symlink_to(real)
    before = real.read_bytes()
    with Store.open(real):
        done = study(folder, "small.yaml", "--workers", "1", "--fresh")
        assert (done.exit, "error[STORE_BUSY]" in done.err) == (3, True), done.err
    assert (link.is_symlink(), real.read_bytes()) == (True, before)
    (folder / "real" / "a.db-wal").write_bytes(b"what a killed writer left")
    done = study(folder, "small.yaml", "--workers", "1", "--fresh")
    assert (done.exit, "4 new" in done.out) == (0, True), done.err
    assert link.is_symlink()
    assert [one.name for one in (folder / "real").iterdir()] == ["a.db"]


def test_fresh_throws_nothing_away_but_stores(folder: Path) -> None:
    (folder / "thesis.txt").write_text("years of work, and longer than a hundred bytes " * 4)
    done = study(folder, "small.yaml", "--store", "thesis.txt", "--fresh")
    assert done.exit == 3
    assert "error[STORE_FORMAT]" in done.err
    assert (folder / "thesis.txt").read_text().startswith("years")


def test_outputs_are_checked_before_anything_runs(folder: Path) -> None:
    (folder / "there.csv").write_text("kept")
    for words, code in (
        (("--csv", "there.csv"), "EXISTS"),
        (("--report", "page.pdf"), "SUFFIX"),
        (("--csv", "small.study.db", "--store", "small.study.db"), "OPTIONS"),
        (("--csv", "small.yaml", "--force"), "OPTIONS"),
        (("--workers", "2", "--dask", "tcp://127.0.0.1:1"), "OPTIONS"),
        (("--dask", "http://127.0.0.1:1"), "CLUSTER_ADDRESS"),
        (("--workers", "0"), "TYPE"),
    ):
        done = study(folder, "small.yaml", *words)
        assert done.exit in (2, 3), words
        assert f"error[{code}]" in done.err, (words, done.err)
    assert (folder / "there.csv").read_text() == "kept"
    assert not (folder / "small.study.db").exists()


def test_a_store_is_shown_exported_and_reported(folder: Path) -> None:
    study(folder, "small.yaml", "--workers", "1", "--csv", "a.csv")
    shown = study(folder, "show", "small.study.db")
    assert shown.exit == 0, shown.err
    assert "4 of 4: 4 done" in shown.out
    assert "Does it run?" in shown.out
    record = json.loads(study(folder, "show", "small.study.db", "--json").out)
    assert (record["study"], record["done"]) == ("small", 4)
    done = study(folder, "export", "small.study.db", "--csv", "b.csv", "--latex", "b.tex")
    assert done.exit == 0, done.err
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()
    assert "tabular" in (folder / "b.tex").read_text()
    pages = []
    for name in ("small.html", "again.html"):
        made = study(folder, "report", "small.study.db", "--no-films", *([name] * (name != "small.html")))
        assert made.exit == 0, made.err
        pages.append((folder / name).read_bytes())
    assert pages[0] == pages[1]
    assert b"<script" not in pages[0]


def test_export_needs_something_to_write(folder: Path) -> None:
    study(folder, "small.yaml", "--workers", "1")
    done = study(folder, "export", "small.study.db")
    assert (done.exit, "error[OPTIONS]: nothing to write" in done.err) == (2, True)


def test_the_ready_studies_are_listed_and_copied(folder: Path) -> None:
    names = [row["name"] for row in json.loads(study(folder, "list", "--json").out)["studies"]]
    assert names
    listed = study(folder, "list").out
    for name in names:
        assert name in listed
        assert study(folder, "write", name, f"{name}.yaml").exit == 0
        assert "version: 1" in (folder / f"{name}.yaml").read_text()
    again = study(folder, "write", names[0], f"{names[0]}.yaml")
    assert (again.exit, "error[EXISTS]" in again.err) == (2, True)
    missing = study(folder, "write", "no-such", "x.yaml")
    assert missing.exit in (2, 3)
    assert "no-such" in missing.err


def test_the_schema_is_one() -> None:
    schema = json.loads(here("study", "schema").out)
    assert schema["title"]
    assert "planners" in schema["properties"]


def test_what_is_neither_a_file_nor_a_ready_study(folder: Path) -> None:
    done = study(folder, "no-such")
    assert done.exit in (2, 3)
    assert done.err.startswith("error[")
    assert "no-such" in done.err


@pytest.mark.nightly
def test_ctrl_c_keeps_what_was_done_and_says_how_to_go_on(tmp_path: Path) -> None:
    (tmp_path / "slow.yaml").write_text(SLOW)
    # A suite that runs in the background hands down that SIGINT is ignored.
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    words = [sys.executable, "-c", f"{heard}; from lampyris.cli import main; main()", "study", "slow.yaml"]
    process = subprocess.Popen(
        [*words, "--workers", "1"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "COLUMNS": "100"},
    )  # fmt: skip
    kept = tmp_path / "slow.study.db-wal"
    began = time.monotonic()
    while time.monotonic() - began < 60 and not (kept.exists() and kept.stat().st_size > 30_000):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert out == ""
    last = err.splitlines()[-1]
    assert last.startswith("interrupted: ")
    assert "continue with: lampyris study slow.yaml --workers 1" in last
    assert err.count("interrupted") == 1
    assert "Traceback" not in err
    there = int(last.split()[1].replace(",", ""))
    assert 0 < there < 6_000
    record = json.loads(study(tmp_path, "show", "slow.study.db", "--json").out)
    assert record["done"] == there


# ---- what is seen while it runs --------------------


def _study(kind: str = "plan", laws: int = 1) -> Study:
    import lampyris

    ground = StudyMap("guide", lampyris.load_grid("guide"), "0" * 64)
    world = World(ground, (0, 9), (7, 0))
    by = tuple(Config(f"law-{k}") for k in range(laws))
    who = (Config("astar"), Config("ad-gso", {"rho": 0.5}, "gso, slow"))
    return Study("s", kind, (world,), who, by, (StudyTraffic(),), (0, 1, 2))  # type: ignore[arg-type]


def test_sizes_are_said_in_words() -> None:
    said = "1 query on 1 map x 1 traffic case x 3 seeds x 2 planners x 1 law = 6 runs (plan)"
    assert tables.sizes(_study()) == said
    assert plural(1, "query") == "1 query"
    assert plural(2700, "run") == "2,700 runs"


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(None, "-:--"), (float("inf"), "-:--"), (0.2, "0:00"), (59.6, "1:00"), (3723, "1:02:03")],
)
def test_the_clock(seconds: float | None, said: str) -> None:
    assert clock(seconds) == said


def test_the_tally_keeps_failures_in_the_denominator() -> None:
    one = _study()
    jobs = list(one.jobs())
    tally = tables.Tally(one)
    rows = [
        Row(jobs[0].key, "done", {"found": True, "gap": 0.0}),
        Row(jobs[2].key, "done", {"found": False, "gap": None}),
        Row(jobs[4].key, "failed", error="FAULT: x"),
        Row(jobs[1].key, "done", {"found": True, "gap": 0.5}),
        Row("f" * 64, "done", {"found": True}),
    ]
    tally.add(rows)
    astar, gso = tally.counts["astar", "law-0"], tally.counts["gso, slow", "law-0"]
    assert (astar.runs, astar.good, astar.failed, astar.gaps) == (3, 1, 1, 1)
    assert (gso.runs, gso.good, gso.gap) == (1, 1, 0.5)
    table = tally.table()
    assert [c.header for c in table.columns] == ["planner", "runs", "found", "mean gap", "failed"]
    assert list(table.columns[2].cells) == ["33.3%", "100.0%"]
    assert [c.header for c in tables.Tally(_study(laws=2)).table().columns][1] == "law"


def test_without_a_terminal_a_line_for_every_tenth(capsys: pytest.CaptureFixture[str]) -> None:
    from lampyris.study.execution.execution import Progress

    one = _study()
    with tables.StudyProgress(one, tables.Tally(one), quiet=False) as display:
        for done in range(101):
            display.show(Progress(done=done, total=100, failed=1, seconds_left=100.0 - done))
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 10
    assert lines[0] == "10 of 100 runs, 1 failed, about 1:30 left"
    assert lines[-1] == "100 of 100 runs, 1 failed"


def test_at_a_terminal_a_bar_and_a_live_table(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from lampyris.study.execution.execution import Progress

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm")
    one = _study()
    tally = tables.Tally(one)
    with tables.StudyProgress(one, tally, quiet=True) as display:
        tally.add([Row(next(one.jobs()).key, "done", {"found": True, "gap": 0.25})])
        display.show(Progress(done=1, total=6, failed=0, seconds_left=75.0))
    out, err = capsys.readouterr()
    assert out == ""
    for part in ("1 of 6 runs, 0 failed", "1:15 left", "1 of 3", "25.00%", "gso, slow"):
        assert part in err


# ---- runs that are run again, names that are kept --------------------

NAMED = """\
version: 1
name: small
about: first words
maps: [{bundled: guide, queries: [{start: [0, 9], goal: [7, 0]}]}]
planners: [astar, {name: ad-gso, label: worms}]
"""


def test_failed_runs_are_run_again_and_others_are_not(tmp_path: Path) -> None:
    import lampyris
    from lampyris.study.design.row import Row
    from lampyris.study.store.store import Store, open_for

    (tmp_path / "small.yaml").write_text(NAMED)
    asked = lampyris.load_study(tmp_path / "small.yaml")
    jobs = list(asked.jobs())
    with open_for(tmp_path / "small.study.db", asked) as store:
        store.add([Row(jobs[0].key, "failed", error="error[WORKER_DIED]: a worker died")])
    first = study(tmp_path, "small.yaml", "--workers", "1", "--json")
    assert json.loads(first.out)["endings"] == {"done": 1, "failed": 1, "refused": 0, "timeout": 0}
    again = study(tmp_path, "small.yaml", "--workers", "1", "--again", "failed,timeout")
    assert "1 run (failed, timeout) will be run again" in again.err
    with Store.open(tmp_path / "small.study.db", writable=False) as store:
        assert {row.ending for row in store.rows().values()} == {"done"}
    assert study(tmp_path, "small.yaml", "--again", "fialed").exit == 2
    assert study(tmp_path, "small.yaml", "--again", "failed", "--fresh").exit == 2


@pytest.mark.nightly
def test_a_store_keeps_the_names_it_was_made_with(tmp_path: Path) -> None:
    """Or the page of the store would not be the page that the study wrote."""
    (tmp_path / "small.yaml").write_text(NAMED)
    study(tmp_path, "small.yaml", "--workers", "1", "--csv", "a.csv")
    (tmp_path / "small.yaml").write_text(NAMED.replace("worms", "glowworms").replace("first", "other"))
    out = study(
        tmp_path, "small.yaml", "--workers", "1", "--csv", "b.csv", "--report", "b.html", "--no-films"
    )
    assert "keeps the names it was made with" in out.err
    study(tmp_path, "report", "small.study.db", "c.html", "--no-films")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert (tmp_path / "b.html").read_bytes() == (tmp_path / "c.html").read_bytes()
    assert "worms" in (tmp_path / "b.html").read_text()
