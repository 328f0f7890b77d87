"""The frame of the checks: parts, workers, ranges, the ledger, and what the command prints."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from lampyris.errors import FileError, UsageError
from lampyris.selfcheck import registry, runner
from lampyris.selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris.selfcheck.ledger import Ledger
from lampyris.selfcheck.runner import Range, spread

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


def test_the_bound_is_three_over_n() -> None:
    assert runner.run(TOY, Ask()).bound == 3 / 17


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


def test_the_command_refuses_what_it_does_not_know() -> None:
    assert _lampyris("gridz").returncode == 2
    assert _lampyris("--size", "huge").returncode == 2
    assert _lampyris("--only", "drawn").returncode == 2
