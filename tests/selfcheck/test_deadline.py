"""The check of deadlines sees a limit not kept, a wrong answer, and a session that a stop has harmed."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import pytest

from lampyris._core import cancellation
from lampyris.model.plan import Plan, Status
from lampyris.planning.base import Budget, Session
from lampyris.planning.graph.session import GraphSession
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.process import deadline
from lampyris_selfcheck.checks.process import deadline_processes as processes
from lampyris_selfcheck.checks.process.deadline_calls import SIDES, call_of, session_of
from sizes import some


def outcome(kind: str, cases: int = 12) -> Outcome:
    return deadline.CHECK.run(Ask(), Part(kind, 0, cases))


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["limit", "cancel"])
def test_a_call_that_goes_on_is_seen(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    halt = cancellation.halt

    def late() -> None:
        until = time.process_time() + 0.1
        while time.process_time() < until:
            pass
        halt()

    monkeypatch.setattr(cancellation, "halt", late)
    monkeypatch.setattr(deadline._Judge, "PAUSES_S", (0.0, 0.0, 0.0))
    found = outcome(kind)
    assert found.failed > 0
    assert "ms late" in found.failures[0].what


class Holding:
    """A session that lets no other thread of this process run for a while, and says that it was stopped."""

    def plan(self, change: object, budget: Budget) -> Plan:
        began, used = time.perf_counter(), time.process_time()
        sum(range(10**7))
        self.wall, self.cpu = time.perf_counter() - began, time.process_time() - used
        return Plan(Status.LIMIT if budget.stop is None else Status.CANCELLED, "holding")


@pytest.mark.nightly
@pytest.mark.parametrize("by_hand", [False, True])
def test_a_call_that_keeps_every_other_thread_from_waking_is_seen(by_hand: bool) -> None:
    holding = Holding()
    began = time.perf_counter()
    done = deadline._timed(holding, 0.01, by_hand=by_hand)  # type: ignore[arg-type]
    # All but the 0.01 s that it had.
    assert min(holding.wall, holding.cpu) - 0.01 <= done.cpu <= done.wall < time.perf_counter() - began
    assert done.wall > 0.05


@pytest.mark.nightly
def test_a_long_call_is_stopped_and_one_that_ends_before_tries_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def soon(session: Session, seconds: float, *, by_hand: bool) -> deadline._Timed:
        assert 1.5 <= seconds <= 4.0
        return deadline._Timed(Plan(Status.ITERATION_LIMIT, "gso"), 0.0, 0.0, False)

    found = outcome("long", 1)
    assert (found.failed, found.counts["stopped"], len(found.spreads["long_ms"])) == (0, 1, 1)
    monkeypatch.setattr(deadline, "_timed", soon)
    assert "tries nothing" in outcome("long", 1).failures[0].what


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["limit", "cancel"])
def test_most_calls_are_at_work_when_they_are_to_end(kind: str) -> None:
    # All of them, as a rule. When nobody made them end sooner it was 26 of these, and 16 where CI ran.
    found = deadline.CHECK.run(Ask(), Part(kind, 60, 30))
    assert found.counts["stopped"] >= 0.8 * 30
    assert deadline.CHECK.kinds_for(Ask())[kind].least == {"stopped": 0.9}


@pytest.mark.parametrize(("kind", "by_hand"), some([("limit", False), ("cancel", True)]))
@pytest.mark.parametrize("over", [0, 1, deadline.SOONER, deadline.SOONER + 1])
def test_a_call_that_is_over_too_soon_is_made_to_end_sooner(
    kind: str, by_hand: bool, over: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    call = call_of(Ask().rng("deadline", kind, 0))
    asked: list[float] = []
    ended = Status.CANCELLED if by_hand else Status.LIMIT

    def timed(session: Session, seconds: float, *, by_hand: bool) -> deadline._Timed:
        asked.append(seconds)
        is_over = len(asked) <= over
        plan = session.plan() if is_over else Plan(ended, call.planner)
        return deadline._Timed(plan, 0.0, 0.0, False)

    monkeypatch.setattr(deadline, "_moment", lambda call: 0.5)
    monkeypatch.setattr(deadline, "_timed", timed)
    found = outcome(kind, 1)
    sooner = min(over, deadline.SOONER)
    assert asked == [0.5 / 2**k for k in range(sooner + 1)]
    assert (found.failed, found.cases) == (0, 1)
    assert found.counts.get("made to end sooner", 0) == sooner
    assert found.counts.get("stopped", 0) == (over <= deadline.SOONER)
    assert found.counts.get("ended before", 0) == (over > deadline.SOONER)


@pytest.mark.parametrize(("kind", "by_hand"), some([("limit", False), ("cancel", True)]))
@pytest.mark.parametrize(("size", "readings"), [("commit", 2), ("nightly", 1)])
def test_a_call_that_answers_late_is_not_made_to_end_sooner(
    kind: str, by_hand: bool, size: str, readings: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that is deaf while it writes its answer down must not be let off for being stopped before."""
    asked: list[float] = []
    monkeypatch.setattr(deadline._Judge, "PAUSES_S", (0.0, 0.0, 0.0))

    def timed(session: Session, seconds: float, *, by_hand: bool) -> deadline._Timed:
        asked.append(seconds)
        return deadline._Timed(session.plan(), 0.2, 0.2, False)

    monkeypatch.setattr(deadline, "_moment", lambda call: 0.5)
    monkeypatch.setattr(deadline, "_timed", timed)
    found = deadline.CHECK.run(Ask(size=size), Part(kind, 0, 1))
    assert asked == [0.5] * readings
    assert [failure.what for failure in found.failures] == ["200.0 ms late, 50 allowed"]


@pytest.mark.parametrize(
    ("late", "asked", "failed"),
    [("", 1, 0), ("y", 4, 0), ("yy", 2, 1), ("yny", 3, 1), ("ynny", 4, 1), ("ynnny", 4, 0)],
)
@pytest.mark.parametrize("kind", some(["ctrl-c", "app", "limit", "cancel"], 3))
def test_an_answer_of_the_commit_size_is_late_if_it_is_so_twice(
    kind: str, late: str, asked: int, failed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Others at work make it late, too, and CPU time tells of them in part."""
    times = [0.2 if one == "y" else 0.001 for one in late.ljust(5, "n")]
    waiting = iter(times)

    def timed(session: Session, after: float, *, by_hand: bool) -> deadline._Timed:
        took = next(waiting)
        return deadline._Timed(Plan(Status.CANCELLED if by_hand else Status.LIMIT, "x"), took, took, False)

    def ended(call: processes.Long, stopped: object) -> processes.ProcessEnding:
        took = next(waiting)
        return processes.ProcessEnding(took, took, "")

    monkeypatch.setattr(deadline._Judge, "PAUSES_S", (0.0, 0.0, 0.0))
    monkeypatch.setattr(deadline, "_timed", timed)
    monkeypatch.setattr(deadline, "_ended", ended)
    found = outcome(kind, 1)
    assert 5 - len(list(waiting)) == asked
    assert found.counts.get("late at first", 0) == bool(late)
    assert [one.what for one in found.failures] == ["200.0 ms late, 50 allowed"] * failed


def test_a_late_answer_is_not_let_off_by_calls_that_were_over_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[float] = []

    def timed(session: Session, seconds: float, *, by_hand: bool) -> deadline._Timed:
        asked.append(seconds)
        late = 0.2 if len(asked) == 1 else 0.0
        return deadline._Timed(Plan(Status.LIMIT, "x") if late else session.plan(), late, late, False)

    monkeypatch.setattr(deadline, "_moment", lambda call: 0.5)
    monkeypatch.setattr(deadline._Judge, "PAUSES_S", (0.0, 0.0, 0.0))
    monkeypatch.setattr(deadline, "_timed", timed)
    found = outcome("limit", 1)
    assert asked == [0.5] * 4
    assert [one.what for one in found.failures] == ["200.0 ms late, 50 allowed"]


def test_a_wrong_answer_is_not_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        deadline, "_ended", lambda call, stopped: processes.ProcessEnding(9.0, 9.0, "exit code 1")
    )
    found = outcome("ctrl-c", 1)
    assert [one.what for one in found.failures] == ["exit code 1"]
    assert "late at first" not in found.counts


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
        "import os, time\nfrom lampyris._core import cancellation as halting\n"
        "def after(real):\n    def late(*given):\n        until = time.process_time() + 0.8\n"
        "        while time.process_time() < until: pass\n        real(*given)\n    return late\n"
    )
    whose = {"_COMMAND": "os._exit = after(os._exit)\n", "_ENGINE": "halting.halt = after(halting.halt)\n"}
    for code, words in whose.items():
        monkeypatch.setattr(processes, code, late + words + getattr(processes, code))
    monkeypatch.setattr(deadline._Judge, "PAUSES_S", (0.0,))
    found = outcome(kind, 1)
    assert "ms late" in found.failures[0].what
    other = {"_COMMAND": "\nimport sys; sys.exit(1)\n", "_ENGINE": "\nprint(); raise SystemExit\n"}
    for code, words in other.items():
        monkeypatch.setattr(processes, code, words)
    assert "late" not in outcome(kind, 1).failures[0].what


def test_an_engine_that_went_wrong_is_not_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []

    class OfWhichTheFirstIsWrong:
        def __init__(self) -> None:
            made.append(self)
            self.closed = 0

        def cancelled(self, call: processes.Long) -> processes.ProcessEnding:
            return processes.ProcessEnding(0.0, 0.0, "wrong" if self is made[0] else "")

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

    monkeypatch.setattr(GraphSession, "_answer", wrong)
    # Whether a call is over before the limit drawn for it is the machine's affair; these always are.
    monkeypatch.setattr(deadline, "_moment", lambda call: 60.0)
    calls = {n: call_of(Ask().rng("deadline", "limit", n)) for n in range(40)}
    searching = [n for n, call in calls.items() if call.reachable and type(session_of(call)) is GraphSession]
    found = [deadline.CHECK.run(Ask(), Part("limit", n, 1)) for n in searching[:4]]
    assert [one.counts["ended before"] for one in found] == [1] * 4
    assert ["no-path, where there is a way" in one.failures[0].what for one in found] == [True] * 4


@pytest.mark.nightly
def test_a_session_that_a_stop_has_harmed_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    drop = GraphSession.drop

    def harmed(self: GraphSession, anywhere: bool) -> str:
        self._robot = self._scene.goal
        return drop(self, anywhere)

    def at_its_first_look(session: Session, seconds: float, *, by_hand: bool) -> deadline._Timed:
        # Whether a call is still at work when a thread stops it is the machine's affair; this one always is.
        stop = cancellation.CancelToken()
        stop.set()
        return deadline._Timed(session.plan(None, Budget(stop=stop)), 0.0, 0.0, False)

    monkeypatch.setattr(deadline, "_timed", at_its_first_look)
    assert not outcome("cancel", 40).failed
    monkeypatch.setattr(GraphSession, "drop", harmed)
    found = outcome("cancel", 40)
    assert any("asked again after it was stopped" in failure.what for failure in found.failures)


def test_a_call_is_the_same_each_time() -> None:
    one, other = (call_of(Ask().rng("deadline", "limit", 5)) for _ in range(2))
    assert one.said == other.said
    assert session_of(one) is not session_of(other)
    drawn = {call_of(Ask().rng("deadline", "limit", n)).map for n in range(60)}
    assert drawn == set(SIDES)
