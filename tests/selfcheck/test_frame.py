"""The frame of the checks: parts, workers, ranges, the ledger, and what the command prints."""

from __future__ import annotations

import json
import math
import shlex
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris.errors import FileError, UsageError
from lampyris_selfcheck import ledger, registry, runner
from lampyris_selfcheck.check import Ask, Check, Failure, Kind, Outcome, Part, Tally
from lampyris_selfcheck.command import SelfcheckRequest, run_checks
from lampyris_selfcheck.ledger import Ledger
from lampyris_selfcheck.runner import Range, spread
from lampyris_selfcheck.serialize import plain

KINDS = {
    "drawn": Kind("draws", commit=10, nightly=100, release=1000, chunk=4),
    "all": Kind("every one", commit=7, nightly=25, release=25, chunk=10, whole=25),
}
ran: list[Part] = []


def _run(ask: Ask, part: Part) -> Outcome:
    ran.append(part)
    tally = Tally(part)
    for number in part.numbers:
        draw = int(ask.rng("toy", part.kind, number).integers(1000))
        tally.case("odd" if draw % 2 else "even")
        tally.measure("draw", draw)
        if number == 17:
            tally.fail(number, "seventeen", value=draw)
            tally.fail(number, "seventeen again")
    return tally.outcome()


TOY = Check("toy", ("G0",), "a toy", KINDS, _run)


@pytest.fixture(autouse=True)
def _fresh() -> None:
    ran.clear()


def test_the_cases_are_the_sizes() -> None:
    assert runner.run(TOY, Ask()).outcome.cases == 17
    assert runner.run(TOY, Ask(size="nightly"), Range(only="drawn")).outcome.cases == 100
    assert runner.run(TOY, Ask(), Range(only="drawn", first=3, cases=6)).outcome.cases == 6


def test_an_exhaustive_kind_ends_where_it_ends() -> None:
    assert runner.run(TOY, Ask(), Range(only="all", first=20, cases=100)).outcome.cases == 5
    with pytest.raises(UsageError, match="25 cases"):
        runner.run(TOY, Ask(), Range(only="all", first=25))


def test_pieces_give_what_the_whole_gives() -> None:
    whole = runner.run(TOY, Ask(), Range(only="drawn", cases=30)).outcome
    pieces = [runner.run(TOY, Ask(), Range("drawn", first, 6)).outcome for first in range(0, 30, 6)]
    total = Outcome()
    for piece in pieces:
        total += piece
    assert total == whole


def test_a_failure_counts_once_and_breaks_the_check() -> None:
    result = runner.run(TOY, Ask(), Range(only="drawn", cases=20))
    assert not result.holds
    assert result.bound is None
    assert result.outcome.failed == 1
    assert [f.what for f in result.outcome.failures] == ["seventeen"]


def test_nothing_asked_is_nothing_proved() -> None:
    result = runner.run(TOY, Ask(), Range(only="drawn", cases=0))
    assert not result.holds
    assert result.bound is None


def _with_least(**least: float) -> Check:
    return replace(TOY, kinds={"all": replace(KINDS["drawn"], chunk=100, least=least)}, run=_even_run)


def _even_run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        tally.case("even" if number % 2 == 0 else "odd")
    return tally.outcome()


@pytest.mark.parametrize(
    ("least", "said"),
    [
        ({"even": 0.5}, ""),
        ({"even": 0.51}, "all: even in 100 of 200 cases; it must be in 0.51 of them"),
        ({"even": 0.1, "never": 0.001}, "all: never in 0 of 200 cases; it must be in 0.001 of them"),
    ],
)
def test_cases_that_reach_too_little_break_the_check(least: dict[str, float], said: str) -> None:
    result = runner.run(_with_least(**least), Ask(), Range(cases=200))
    assert result.lacks == ((said,) if said else ())
    assert result.holds == (not said)
    assert not result.outcome.failed


def test_of_few_cases_no_share_is_asked() -> None:
    assert runner.run(_with_least(even=0.9), Ask(), Range(cases=199)).holds


def test_the_bound_is_three_over_the_drawn_cases() -> None:
    assert runner.run(TOY, Ask()).bound == 3 / 10
    assert runner.run(TOY, Ask(), Range("drawn", cases=2)).bound == 1.0
    assert runner.run(TOY, Ask(), Range("all")).bound is None


def test_a_range_beyond_every_kind_is_refused() -> None:
    only = replace(TOY, kinds={"all": KINDS["all"]})
    with pytest.raises(UsageError, match=r"no case 25.*all 25 cases"):
        runner.run(only, Ask(), Range(first=25))
    assert runner.run(TOY, Ask(), Range(first=25, cases=2)).outcome.cases == 2


# ---- checks that are at fault themselves -------------------------------------------------------------------


def _raises(ask: Ask, part: Part) -> Outcome:
    if part.first == 4:
        raise RuntimeError("no such thing")
    return _run(ask, part)


def test_a_check_that_raises_is_broken_and_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "ledger"
    result = runner.run(replace(TOY, run=_raises), Ask(), Range("drawn", cases=12), Ledger(path))
    assert [part.first for part in ran] == [0, 8]
    assert not result.holds
    assert (result.outcome.cases, result.outcome.unfinished) == (8, 1)
    (failure,) = result.outcome.failures
    assert (failure.kind, failure.number, failure.cases) == ("drawn", 4, 4)
    assert "RuntimeError: no such thing" in failure.what
    assert "raise RuntimeError" in failure.what
    ran.clear()
    assert runner.run(TOY, Ask(), Range("drawn", cases=12), Ledger(path)).holds
    assert [part.first for part in ran] == [4]


def test_a_lost_worker_breaks_what_was_left(monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(**_: object) -> object:
        def pool(tasks: Iterable[tuple[Any, tuple[str, Ask, Part], object]]) -> Iterator[object]:
            _, (_, ask, part), _ = next(iter(tasks))
            yield runner._timed(TOY, ask, part)
            raise RuntimeError("a worker died")

        return pool

    monkeypatch.setattr("joblib.Parallel", lost)
    result = runner.run(TOY, Ask(workers=2), Range("drawn", cases=12))
    assert result.outcome.cases == 4
    assert [(f.number, "a worker died" in f.what) for f in result.outcome.failures] == [(4, True), (8, True)]


def _skips(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers[:-1]:
        tally.case()
        tally.count(f"seen {number}")
    return tally.outcome()


def _fails_before_it_counts(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        if number == part.first:
            tally.fail(number, "first")
        else:
            tally.case()
    return tally.outcome()


def test_each_case_is_tried_or_the_part_fails() -> None:
    result = runner.run(replace(TOY, run=_skips), Ask(), Range("drawn", cases=4))
    (failure,) = result.outcome.failures
    assert failure.what.startswith("of 4 cases 3 were counted")
    assert not result.holds
    result = runner.run(replace(TOY, run=_fails_before_it_counts), Ask(), Range("drawn", cases=4))
    assert result.outcome.cases == 4
    assert [f.what for f in result.outcome.failures] == ["first"]


def test_a_ledger_is_gone_on_with(tmp_path: Path) -> None:
    path = tmp_path / "ledger"
    first = runner.run(TOY, Ask(), Range(only="drawn", cases=8), Ledger(path))
    done = len(ran)
    ran.clear()
    longer = runner.run(TOY, Ask(), Range(only="drawn", cases=12), Ledger(path))
    assert done == 2
    assert ran == [Part("drawn", 8, 4)]
    assert longer.outcome == runner.run(TOY, Ask(), Range(only="drawn", cases=12)).outcome
    assert longer.seconds >= first.seconds - 0.002  # a ledger rounds to milliseconds


def test_another_seed_or_code_is_another_run(tmp_path: Path) -> None:
    path = tmp_path / "ledger"
    runner.run(TOY, Ask(), Range(only="drawn", cases=4), Ledger(path))
    ran.clear()
    runner.run(TOY, Ask(seed=2), Range(only="drawn", cases=4), Ledger(path))
    assert len(ran) == 1
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    path.write_text(json.dumps(lines[0] | {"code": "elsewhere"}) + "\n")
    ran.clear()
    runner.run(TOY, Ask(), Range(only="drawn", cases=4), Ledger(path))
    assert len(ran) == 1


def test_half_a_line_is_done_again_and_does_not_spoil_the_next(tmp_path: Path) -> None:
    path = tmp_path / "ledger"
    runner.run(TOY, Ask(), Range(only="drawn", cases=8), Ledger(path))
    path.write_bytes(path.read_bytes()[:-30])
    ran.clear()
    runner.run(TOY, Ask(), Range(only="drawn", cases=8), Ledger(path))
    assert ran == [Part("drawn", 4, 4)]
    ran.clear()
    runner.run(TOY, Ask(), Range(only="drawn", cases=8), Ledger(path))
    assert not ran


def test_a_foreign_file_is_no_ledger(tmp_path: Path) -> None:
    path = tmp_path / "ledger"
    path.write_text('{"name": "something else"}\n')
    with pytest.raises(FileError, match="line 1 is no part of a selfcheck"):
        Ledger(path)
    assert path.read_text() == '{"name": "something else"}\n'


def test_a_text_is_no_ledger(tmp_path: Path) -> None:
    path = tmp_path / "README"
    path.write_text("# Something else\n")
    with pytest.raises(FileError, match="line 1 is no part of a selfcheck"):
        Ledger(path)


def test_another_input_is_another_run(tmp_path: Path) -> None:
    path = tmp_path / "ledger"
    for word, parts in (("one", 1), ("one", 0), ("other", 1)):
        ran.clear()
        check = replace(TOY, inputs=lambda _, word=word: word)
        runner.run(check, Ask(), Range("drawn", cases=4), Ledger(path))
        assert len(ran) == parts, word


def test_no_check_asks_for_the_size() -> None:
    folder = Path(runner.__file__).parent
    asks = {path.stem for path in folder.rglob("*.py") if "ask.size" in path.read_text(encoding="utf-8")}
    assert asks <= {"runner", "ledger", "command"}


def test_the_fingerprint_is_of_all_that_is_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def now() -> str:
        return ledger.fingerprint.__wrapped__(tmp_path)

    seen = [now()]
    for name in ("a.py", "cli/verb.py", "app/x.py", "maps/guide.json", "selfcheck/defects/sim.toml"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
        seen.append(now())
        path.write_text("2")
        seen.append(now())
    monkeypatch.setattr(ledger, "version", lambda name: "0.0")
    seen.append(now())
    assert len(set(seen)) == len(seen)
    for name in ("__pycache__/a.txt", "a.pyc", "a.nbi", "a.nbc"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
        assert now() == seen[-1], name


def test_the_files_of_a_folder_are_an_input(tmp_path: Path) -> None:
    inputs = registry.check("scen").inputs
    assert inputs is not None
    (tmp_path / "a.map.scen").write_text("version 1\n")
    first = inputs(Ask(folder=tmp_path))
    (tmp_path / "a.map.scen").write_text("version 2\n")
    assert inputs(Ask(folder=tmp_path)) != first
    assert inputs(Ask()) == ""


@pytest.mark.source
def test_the_tests_are_an_input_of_flake() -> None:
    check = registry.check("flake")
    assert check.inputs is not None
    assert len(check.inputs(Ask())) == 16


def test_words_of_json_hold_what_a_check_may_keep(tmp_path: Path) -> None:
    told = plain(
        {"n": np.int64(3), "x": np.float32(0.5), "rows": np.eye(2, dtype=bool), 4: (math.nan, -math.inf),
         "at": Path("a"), "set": {2, 1}, "odd": object}
    )  # fmt: skip
    assert told["n"] == 3
    assert type(told["n"]) is int
    assert told == {
        "n": 3, "x": 0.5, "rows": [[True, False], [False, True]], "4": ["nan", "-inf"],
        "at": "a", "set": [1, 2], "odd": "<class 'object'>",
    }  # fmt: skip
    path = tmp_path / "ledger"
    seen = Outcome(1, 1, (Failure("k", 0, "w", {"n": np.int64(1)}, 4),), {}, {"gap": (math.nan, 1.0)})
    Ledger(path).add("toy", seen, 0.5)
    found = Ledger(path).done("toy")
    assert found is not None
    assert found[0].failures == (Failure("k", 0, "w", {"n": 1}, 4),)
    assert math.isnan(found[0].spreads["gap"][0])


def test_a_spread_tells_least_to_greatest() -> None:
    assert spread(tuple(float(n) for n in range(100, -1, -1))) == {
        "least": 0.0,
        "middle": 50.0,
        "95 %": 95.0,
        "greatest": 100.0,
    }
    assert spread(()) == {}
    assert set(spread((3.0,)).values()) == {3.0}


def test_a_name_nobody_knows() -> None:
    with pytest.raises(UsageError, match="no check is called 'gridz'"):
        registry.check("gridz")


def test_every_check_keeps_to_the_frame() -> None:
    for name in registry.NAMES:
        check = registry.check(name)
        assert check.name == name
        assert check.goals
        assert all(goal.startswith("G") for goal in check.goals)
        for kind in check.kinds_for(Ask()).values():
            assert 0 <= kind.commit <= kind.nightly <= kind.release
            assert kind.whole is None or kind.release <= kind.whole
            assert kind.chunk > 0
            assert all(0 < share <= 1 for share in kind.least.values())


def _lampyris(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "lampyris", "selfcheck", *words], capture_output=True, text=True, check=False
    )


@pytest.mark.nightly
def test_the_command_refuses_what_it_does_not_know() -> None:
    assert _lampyris("gridz").returncode == 2
    assert _lampyris("--size", "huge").returncode == 2
    assert _lampyris("--only", "drawn").returncode == 2
    assert _lampyris("grids", "--folder", ".").returncode == 2


@pytest.mark.nightly
def test_a_wrong_folder_is_found_before_the_first_check_runs(tmp_path: Path) -> None:
    done = _lampyris("grids", "scen", "--folder", str(tmp_path / "mistyped"))
    assert done.returncode == 2
    assert "holds no .scen file" in done.stderr
    assert not done.stdout


def test_help_says_what_a_broken_promise_exits_with() -> None:
    assert "with 6 if a guarantee is violated" in " ".join(_lampyris("--help").stdout.split())


# ---- what the command does with what came of it ------------------------------------------------------------

ODD = "a/b c"


def _odd_run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        tally.case()
        tally.measure("gap", math.nan)
        tally.fail(number, "odd", value=np.int64(7), gap=np.float64("nan"), at=Path("x"))
    return tally.outcome()


def _broken_run(ask: Ask, part: Part) -> Outcome:
    raise RuntimeError("beyond help")


@pytest.fixture
def toys(monkeypatch: pytest.MonkeyPatch) -> None:
    made = {
        "raises": replace(TOY, name="raises", run=_broken_run),
        "odd": replace(TOY, name="odd", kinds={ODD: KINDS["drawn"]}, run=_odd_run),
        "toy": TOY,
    }
    monkeypatch.setattr(registry, "check", made.__getitem__)


@pytest.mark.usefixtures("toys")
@pytest.mark.parametrize("which", ["ledger", "failures", "record"])
def test_what_cannot_be_written_is_told_before_anything_runs(tmp_path: Path, which: str) -> None:
    (tmp_path / "file").write_text("")
    ran.clear()
    request = replace(SelfcheckRequest(("toy",), Ask(), Range(cases=2)), **{which: tmp_path / "file" / "x"})
    with pytest.raises(FileError) as refused:
        run_checks(request)
    assert (refused.value.code, ran) == ("FILE_WRITE", [])


@pytest.mark.usefixtures("toys")
def test_what_came_of_it_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record, failures = tmp_path / "record", tmp_path / "failures"
    request = SelfcheckRequest(
        ("raises", "odd", "toy"), Ask(size="nightly"), Range(cases=2), None, failures, record, json=False
    )
    assert run_checks(request) == 6
    told = capsys.readouterr().out
    assert "toy: cases=4 failures=0" in told
    assert "size=part" in told
    assert "size=nightly" not in told.replace("--size nightly", "")
    assert "failed: raises, odd" in told
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    assert [(line["check"], line["holds"]) for line in lines] == [
        ("raises", False), ("odd", False), ("toy", True)
    ]  # fmt: skip
    assert lines[2]["kinds"]["all"] | {"seconds": 0, "spreads": {}, "counts": {}} == {
        "first": 0, "cases": 2, "failures": 0, "drawn": False, "seconds": 0, "spreads": {}, "counts": {},
    }  # fmt: skip
    assert lines[2]["wall"] >= 0
    assert lines[2]["versions"]["numpy"] == np.__version__
    assert lines[2]["versions"]["python"] == f"{sys.version_info.major}.{sys.version_info.minor}"
    assert lines[1]["spreads"]["gap"]["least"] == "nan"
    kept = sorted(failures.glob("odd-a-b-c-*-seed1-1.json"))
    assert len(kept) == 1
    words = json.loads(kept[0].read_text())
    assert words["data"] == {"value": 7, "gap": "nan", "at": "x"}
    assert shlex.split(words["command"]) == [
        "lampyris", "selfcheck", "odd", "--only", ODD, "--first", "1", "--cases", "1",
        "--seed", "1", "--size", "nightly",
    ]  # fmt: skip
    assert sorted(failures.glob("raises-drawn-seed1-0.json"))


@pytest.mark.usefixtures("toys")
def test_json_holds_what_a_check_may_keep(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_checks(SelfcheckRequest(("odd",), Ask(), Range(cases=1), json=True)) == 6
    assert json.loads(capsys.readouterr().out)["failed"][0]["data"]["gap"] == "nan"
