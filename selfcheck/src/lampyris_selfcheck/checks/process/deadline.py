"""A limit is kept: calls on hard maps end in time with a valid answer, and at once when they are cancelled.

Lateness is wall time in the thread that called, from the moment at which the call should have ended: a thread that
a kernel keeps from waking would not see it. Others at work make a call late and nothing makes it early, so a late
one is made again, up to three times, and the least lateness counts. That work between two looks at the clock is
bounded is counted, without a clock, in ``tests/planning/test_deadlines.py``.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lampyris import referee
from lampyris._core import cancellation
from lampyris.model.plan import Plan, Status
from lampyris.planning import registry
from lampyris.planning.base import Budget, Session
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.process.deadline_calls import DeadlineCall, call_of, session_of
from lampyris_selfcheck.checks.process.deadline_processes import (
    AppEngine,
    ProcessCall,
    ProcessEnding,
    interrupted,
    process_call_of,
)
from lampyris_selfcheck.reference.files.watching import old_left_alone

LATE_S, LATE_SHARE = 0.050, 0.05
"""An answer may be so much later than its limit: seconds, or a share of the limit if that is more."""
CANCEL_S = 0.050
"""After so many seconds a call that was cancelled has answered."""
PAUSES_S = (0.5, 2.0, 6.0)
"""Seconds before a late call is made again: others are not always at work."""

KINDS = {
    "limit": Kind(
        "a hard call with a limit within its time ends in it + max(50 ms, 5 %), found and valid, or limit",
        commit=380, nightly=7600, release=38_000, chunk=20, least={"stopped": 0.6},
    ),
    "cancel": Kind(
        "a hard call on up to 2048 x 2048 cells that another thread cancels within its time answers within 50 ms",
        commit=120, nightly=2400, release=12_000, chunk=20, least={"stopped": 0.6},
    ),
    "ctrl-c": Kind(
        "`lampyris plan` that Ctrl-C hits at a drawn moment is gone within 50 ms, exit code 130",
        commit=8, nightly=200, release=400, chunk=4,
    ),
    "app": Kind(
        "an engine of the app whose job is cancelled at a drawn moment has answered so within 50 ms",
        commit=12, nightly=400, release=800, chunk=6,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Answer:
    """How a call ended.

    Parameters
    ----------
    late : seconds from the moment at which it should have ended.
    wrong : what is wrong with what came; empty: nothing.
    session, plan : of a call in this process.
    """

    late: float
    wrong: str = ""
    session: Session | None = None
    plan: Plan | None = None


def least_late(make: Callable[[], Answer], allowed: float, tally: Tally) -> Answer:
    """The least late of some calls; none is made again after one in time, or after a wrong answer."""
    found = make()
    for pause in PAUSES_S:
        if found.wrong or found.late <= allowed:
            break
        time.sleep(pause)
        tally.count("made again")
        found = min(found, make(), key=lambda one: (not one.wrong, one.late))
    return found


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    if part.kind in ("ctrl-c", "app"):
        _processes(ask, part, tally)
        return tally.outcome()
    with old_left_alone():  # a look for garbage at all that this process holds is no share of the call's
        for number in part.numbers:
            call = call_of(ask.rng("deadline", part.kind, number), large=part.kind == "cancel")
            try:
                _one(part.kind, number, call, tally)
            except (Exception, cancellation.Cancelled) as fault:
                tally.case("raised")
                tally.fail(number, f"{type(fault).__name__}: {fault}", call=call.said)
    return tally.outcome()


def _one(kind: str, number: int, call: DeadlineCall, tally: Tally) -> None:
    cancels = kind == "cancel"
    seconds = moment(call)
    allowed = CANCEL_S if cancels else max(LATE_S, LATE_SHARE * seconds)
    done = least_late(lambda: timed(call, seconds, cancels=cancels), allowed, tally)
    assert done.plan is not None
    assert done.session is not None
    stopped = done.plan.status in (Status.LIMIT, Status.CANCELLED)
    tally.case(f"map:{call.map}", f"planner:{call.planner}", "stopped" if stopped else "ended before")
    _tell(tally, kind, number, done, allowed, call)
    if stopped and call.small:
        tally.count("asked again")
        unlike = _unlike(done.session.plan(), session_of(call).plan())
        if unlike:
            tally.fail(number, f"asked again after it was stopped: {unlike}", call=call.said)


def _tell(
    tally: Tally, kind: str, number: int, done: Answer, allowed: float, call: DeadlineCall | ProcessCall
) -> None:
    tally.measure(f"{kind}_ms", 1e3 * done.late)
    if done.wrong:
        tally.fail(number, done.wrong, call=call.said)
    elif done.late > allowed:
        what = f"{1e3 * done.late:.1f} ms late, {1e3 * allowed:.0f} allowed"
        tally.fail(number, what, call=call.said)


def moment(call: DeadlineCall) -> float:
    """Seconds after which a call is to end: as drawn, or a share of its time if it is over sooner.

    It also loads all compiled code that the call needs: who makes it for the first time waits for that.
    """
    for _ in range(2):
        session, began = session_of(call), time.perf_counter()
        plan = session.plan(None, Budget(seconds=call.seconds))
        took = time.perf_counter() - began
    return call.seconds if plan.status is Status.LIMIT else call.share * min(took, call.seconds)


def timed(call: DeadlineCall, seconds: float, *, cancels: bool) -> Answer:
    """A call that is to end after ``seconds``: by its own limit, or because a thread cancels it."""
    session, token, over = session_of(call), cancellation.CancelToken(), threading.Event()

    def cancel() -> None:
        if not over.wait(seconds):
            token.set()

    thread = threading.Thread(target=cancel, daemon=True)
    began = time.perf_counter()
    if cancels:
        thread.start()
    plan = session.plan(None, Budget(stop=token) if cancels else Budget(seconds=seconds))
    late = max(0.0, time.perf_counter() - began - seconds)
    over.set()
    ended = Status.CANCELLED if cancels else Status.LIMIT
    return Answer(late, wrong_with(plan, call, ended), session, plan)


def wrong_with(plan: Plan, call: DeadlineCall, stopped: Status) -> str:
    """What is wrong with an answer; nothing, if it is one that such a call may have."""
    if plan.status is stopped:
        return "" if plan.path is None else "a path with a call that was stopped"
    if plan.status is Status.FOUND:
        violation = referee.check_plan(plan, call.scene)
        return "" if violation is None else f"found, and the referee says: {violation}"
    if plan.status is Status.ITERATION_LIMIT and registry.planner_class(call.planner).traits.stochastic:
        return ""  # a swarm may find none
    if plan.status is Status.NO_PATH and not call.reachable:
        return ""
    return f"{plan.status}, where there is {'a' if call.reachable else 'no'} path"


def _unlike(one: Plan, other: Plan) -> str:
    """How two answers differ; the work that they took may."""
    if one.status is not other.status:
        return f"{one.status}, a fresh session says {other.status}"
    if one.path is None or other.path is None:
        return ""
    same = np.array_equal(one.path.cells, other.path.cells) and one.path.exact == other.path.exact
    return "" if same else f"another path, cost {one.path.exact}; a fresh session's {other.path.exact}"


def _processes(ask: Ask, part: Part, tally: Tally) -> None:
    """Calls in other processes. An engine that went wrong is not asked again."""
    engine: AppEngine | None = None
    try:
        for number in part.numbers:
            call = process_call_of(ask.rng("deadline", part.kind, number))
            tally.case(f"map:{call.map}", f"planner:{call.planner}")
            if part.kind == "app" and engine is None:
                engine = AppEngine()
            done = least_late(_ending(call, engine.cancelled if engine else interrupted), CANCEL_S, tally)
            _tell(tally, part.kind, number, done, CANCEL_S, call)
            if done.wrong and engine is not None:
                engine.close()
                engine = None
    finally:
        if engine is not None:
            engine.close()


def _ending(call: ProcessCall, stop: Callable[[ProcessCall], ProcessEnding]) -> Callable[[], Answer]:
    """Makes the call, each time to be stopped later: a process loads compiled code at first."""
    delays = iter(range(len(PAUSES_S) + 1))

    def make() -> Answer:
        done = stop(call.later(0.5 * next(delays)))
        return Answer(done.late, done.wrong)

    return make


CHECK = Check(
    "deadline",
    ("G8",),
    "a limit is kept, whatever the map: the answer comes in time, and at once when the call is cancelled",
    KINDS,
    _run,
    alone=True,
)
