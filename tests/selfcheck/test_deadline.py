"""The check of deadlines sees a limit not kept, a wrong answer, and a session that a stop has harmed."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import pytest

from lampyris import halting
from lampyris.model.plan import Plan, Status
from lampyris.planners._session import GraphSession
from lampyris.planners.base import Budget, Session
from lampyris.selfcheck import deadline
from lampyris.selfcheck._deadline_calls import SIDES, call_of, session_of
from lampyris.selfcheck.check import Ask, Outcome, Part


def outcome(kind: str, cases: int = 12) -> Outcome:
    return deadline.CHECK.run(Ask(), Part(kind, 0, cases))


@pytest.mark.parametrize("kind", ["limit", "cancel"])
def test_a_call_that_goes_on_is_seen(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    halt = halting.halt

    def late() -> None:
        until = time.process_time() + 0.1
        while time.process_time() < until:
            pass
        halt()

    monkeypatch.setattr(halting, "halt", late)
    found = outcome(kind)
    assert found.failed > 0
    assert "ms late" in found.failures[0].what


def test_a_wrong_answer_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    answer = GraphSession._answer

    def wrong(self: GraphSession, *args: Any) -> Plan:
        return replace(answer(self, *args), status=Status.NO_PATH, path=None, waypoints=None)

    monkeypatch.setattr(GraphSession, "_answer", wrong)
    found = outcome("limit", 40)
    assert any("no-path, where there is a way" in failure.what for failure in found.failures)


def test_a_session_that_a_stop_has_harmed_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    drop = GraphSession.drop

    def harmed(self: GraphSession, anywhere: bool) -> str:
        self._robot = self._scene.goal
        return drop(self, anywhere)

    def at_its_first_look(session: Session, seconds: float, *, by_hand: bool) -> deadline._Timed:
        # Whether a call is still at work when a thread stops it is the machine's affair; this one always is.
        stop = halting.Stop()
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
