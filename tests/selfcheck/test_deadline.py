"""The check of deadlines sees a limit not kept, a wrong answer, and a session that a stop has harmed."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import pytest

from lampyris._core import cancellation
from lampyris.model.plan import Plan, Status
from lampyris.planning.base import Budget
from lampyris.planning.graph.session import GraphSession
from lampyris_selfcheck.check import Ask, Outcome, Part, Tally
from lampyris_selfcheck.checks.process import deadline
from lampyris_selfcheck.checks.process import deadline_processes as processes
from lampyris_selfcheck.checks.process.deadline import Answer
from lampyris_selfcheck.checks.process.deadline_calls import SIDES, DeadlineCall, call_of, session_of


def outcome(kind: str, cases: int = 12) -> Outcome:
    return deadline.CHECK.run(Ask(), Part(kind, 0, cases))


def drawn(number: int) -> DeadlineCall:
    return call_of(Ask().rng("deadline", "limit", number), large=False)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["limit", "cancel"])
def test_a_call_that_goes_on_is_seen(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    halt = cancellation.raise_cancelled

    def late() -> None:
        until = time.process_time() + 0.1
        while time.process_time() < until:
            pass
        halt()

    monkeypatch.setattr(cancellation, "raise_cancelled", late)
    monkeypatch.setattr(deadline, "PAUSES_S", (0.0,))
    found = outcome(kind)
    assert found.failed > 0
    assert "ms late" in found.failures[0].what


@pytest.mark.parametrize("cancels", [False, True])
def test_a_call_that_keeps_every_other_thread_from_waking_is_seen(
    cancels: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Holding:
        def plan(self, change: object, budget: Budget) -> Plan:
            sum(range(10**7))
            return Plan(Status.LIMIT if budget.stop is None else Status.CANCELLED, "holding")

    monkeypatch.setattr(deadline, "session_of", lambda call: Holding())
    began = time.perf_counter()
    done = deadline.timed(drawn(0), 0.01, cancels=cancels)
    assert 0.05 < done.late < time.perf_counter() - began
    assert not done.wrong


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("late", "calls", "failed"), [("", 1, 0), ("y", 2, 0), ("yyn", 3, 0), ("yyyy", 4, 1)]
)
@pytest.mark.parametrize("kind", ["limit", "cancel", "ctrl-c"])
def test_the_least_late_of_some_calls_counts(
    kind: str, late: str, calls: int, failed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = iter([0.2 if one == "y" else 0.001 for one in late.ljust(5, "n")])

    def timed(call: DeadlineCall, seconds: float, *, cancels: bool) -> Answer:
        plan = Plan(Status.CANCELLED if cancels else Status.LIMIT, call.planner)
        return Answer(next(times), "", session_of(call), plan)

    monkeypatch.setattr(deadline, "PAUSES_S", (0.0, 0.0, 0.0))
    monkeypatch.setattr(deadline, "moment", lambda call: 0.5)
    monkeypatch.setattr(deadline, "timed", timed)
    monkeypatch.setattr(deadline, "interrupted", lambda call: processes.ProcessEnding(next(times)))
    found = outcome(kind, 1)
    assert 5 - len(list(times)) == calls
    assert found.counts.get("made again", 0) == calls - 1
    assert [one.what for one in found.failures] == ["200.0 ms late, 50 allowed"] * failed


def test_a_wrong_answer_is_not_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deadline, "interrupted", lambda call: processes.ProcessEnding(9.0, "exit code 1"))
    found = outcome("ctrl-c", 1)
    assert [one.what for one in found.failures] == ["exit code 1"]
    assert "made again" not in found.counts


def test_a_wrong_answer_counts_more_than_a_late_one() -> None:
    answers = iter([Answer(0.2), Answer(0.1, "wrong")])
    found = deadline.least_late(lambda: next(answers), 0.05, Tally(Part("limit", 0, 1)))
    assert found.wrong == "wrong"


@pytest.mark.nightly  # it breaks the product in processes of its own
@pytest.mark.skipif(sys.platform == "win32", reason="no signals")
@pytest.mark.parametrize("kind", ["ctrl-c", "app"])
def test_processes_are_stopped_and_one_that_is_late_or_answers_otherwise_is_seen(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = outcome(kind, 2)
    assert (found.cases, len(found.spreads[f"{kind}_ms"])) == (2, 2)
    assert not [one.what for one in found.failures if "late" not in one.what]  # the machine may be busy
    late = (
        "import os, time\nfrom lampyris._core import cancellation\n"
        "def after(real):\n    def late(*given):\n        until = time.process_time() + 0.8\n"
        "        while time.process_time() < until: pass\n        real(*given)\n    return late\n"
    )
    whose = {
        "COMMAND": "os._exit = after(os._exit)\n",
        "ENGINE": "cancellation.raise_cancelled = after(cancellation.halt)\n",
    }
    monkeypatch.setattr(deadline, "PAUSES_S", (0.0,))
    for code, words in whose.items():
        monkeypatch.setattr(processes, code, late + words + getattr(processes, code))
    assert "ms late" in outcome(kind, 1).failures[0].what
    other = {"COMMAND": "\nimport sys; sys.exit(1)\n", "ENGINE": "\nprint(); raise SystemExit\n"}
    for code, words in other.items():
        monkeypatch.setattr(processes, code, words)
    assert "late" not in outcome(kind, 1).failures[0].what


def test_an_engine_that_went_wrong_is_not_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []

    class OfWhichTheFirstIsWrong:
        def __init__(self) -> None:
            made.append(self)
            self.closed = 0

        def cancelled(self, call: processes.ProcessCall) -> processes.ProcessEnding:
            return processes.ProcessEnding(0.0, "wrong" if self is made[0] else "")

        def close(self) -> None:
            self.closed += 1

    monkeypatch.setattr(deadline, "AppEngine", OfWhichTheFirstIsWrong)
    found = outcome("app", 4)
    assert [failure.what for failure in found.failures] == ["wrong"]
    assert [one.closed for one in made] == [1, 1]


@pytest.mark.nightly
def test_a_wrong_answer_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    answer = GraphSession._answer

    def wrong(self: GraphSession, *args: Any) -> Plan:
        return replace(answer(self, *args), status=Status.NO_PATH, path=None, waypoints=None)

    # Whether a call is over before the limit drawn for it is the machine's affair; these always are.
    monkeypatch.setattr(deadline, "moment", lambda call: 60.0)
    calls = {n: drawn(n) for n in range(60)}
    searching = [n for n, call in calls.items() if call.reachable and type(session_of(call)) is GraphSession]
    monkeypatch.setattr(GraphSession, "_answer", wrong)
    found = [deadline.CHECK.run(Ask(), Part("limit", n, 1)) for n in searching[:4]]
    assert [one.counts["ended before"] for one in found] == [1] * 4
    assert ["no-path, where there is a path" in one.failures[0].what for one in found] == [True] * 4


@pytest.mark.nightly
def test_a_session_that_a_stop_has_harmed_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    drop = GraphSession.drop

    def harmed(self: GraphSession, anywhere: bool) -> str:
        self._robot = self._scene.goal
        return drop(self, anywhere)

    def at_its_first_look(call: DeadlineCall, seconds: float, *, cancels: bool) -> Answer:
        # Whether a call is still at work when a thread stops it is the machine's affair; this one always is.
        stop, session = cancellation.CancelToken(), session_of(call)
        stop.set()
        return Answer(0.0, "", session, session.plan(None, Budget(stop=stop)))

    monkeypatch.setattr(deadline, "timed", at_its_first_look)
    monkeypatch.setattr(deadline, "moment", lambda call: 0.5)
    assert not outcome("limit", 60).failed
    monkeypatch.setattr(GraphSession, "drop", harmed)
    found = outcome("limit", 60)
    assert any("asked again after it was stopped" in failure.what for failure in found.failures)


@pytest.mark.nightly
def test_a_call_is_the_same_each_time() -> None:
    one, other = drawn(5), drawn(5)
    assert one.said == other.said
    assert session_of(one) is not session_of(other)
    assert {drawn(n).map for n in range(60)} == set(SIDES)
