"""A limit is kept: calls on hard maps end in time with a valid answer, and at once when somebody stops them.

Lateness is counted in the thread that called, from the moment at which the call should have ended: a thread
that a kernel keeps from waking would not see it. At the commit size it is the CPU time that was used beyond
that moment, at least: all of the call's beyond its limit. On a machine that others use too, wall time says
how busy they are; and CPU time does in part, so that a call which was late is made again, up to three times,
and fails at the second late answer. At the larger sizes it is wall time, once, as a robot would count.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from lampyris import referee
from lampyris._core import cancellation
from lampyris.kernels import _jit
from lampyris.model.plan import Plan, Status
from lampyris.planning import registry
from lampyris.planning.base import Budget, Session
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.process.deadline_calls import (
    DeadlineCall,
    call_of,
    large_call_of,
    long_call_of,
    session_of,
)
from lampyris_selfcheck.checks.process.deadline_processes import (
    AppEngine,
    Long,
    ProcessEnding,
    interrupted,
    long_of,
)
from lampyris_selfcheck.reference.files.watching import PAUSES_S, old_left_alone

T = TypeVar("T")
LATE_S, LATE_SHARE = 0.050, 0.05
"""An answer may be so much later than its limit: seconds, or a share of the limit if that is more."""
CANCEL_S = 0.050
"""After so many seconds a call that was stopped has answered."""
AGAIN = 60
"""A call that had to load compiled code is made again, so many times at most: each time it gets further."""
SOONER = 4
"""A call that was over before it was to end is made again, at most so many times, to end in half of the time
that it had before."""
STOPPED, LARGE_STOPPED = 0.9, 0.6
"""Share of the cases, at least, in which the call was at work when it was to end."""

_KINDS = {
    "limit": Kind(
        "a hard call with a limit within its time ends in it + max(50 ms, 5 %), found and valid, or limit",
        commit=380, nightly=7600, release=38_000, chunk=20, least={"stopped": STOPPED},
    ),
    "long": Kind(
        "a call of minutes with a limit of 1.5 to 4 s ends within it + max(50 ms, 5 %), and says limit",
        commit=3, nightly=60, release=300, chunk=1,
    ),
    "cancel": Kind(
        "a hard call that another thread stops at a moment within its time answers within 50 ms",
        commit=120, nightly=2400, release=12_000, chunk=20, least={"stopped": STOPPED},
    ),
    "large": Kind(
        "a call on a map of 512 to 2048 cells a side, stopped at any moment of 1.5 s, answers within 50 ms",
        commit=10, nightly=300, release=1500, chunk=5, least={"stopped": LARGE_STOPPED},
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
_DRAWN = {"long": long_call_of, "large": large_call_of}


@dataclass(frozen=True)
class _Timed:
    """One call: its answer, and how long it went on after it should have ended, in seconds; 0: not at all.

    Parameters
    ----------
    wall, cpu : of wall time, and of CPU time of this process, which is no more.
    loaded : whether compiled code was loaded or made during the call.
    slack : seconds from the moment to when the thread that stops it had woken; None: there was no such.
    """

    plan: Plan
    wall: float
    cpu: float
    loaded: bool
    slack: float | None = None


@dataclass(frozen=True)
class _Reading(Generic[T]):
    """One time that a case was tried.

    Parameters
    ----------
    done : what came.
    late : seconds, as the size counts them.
    stopped : whether the call was at work when it was to end.
    wrong : what is wrong with the answer, whenever it came.
    """

    done: T
    late: float
    stopped: bool = True
    wrong: str = ""


class _Judge:
    """Which reading counts, and whether it is late: at the commit size a late case is tried again."""

    PAUSES_S = PAUSES_S

    def __init__(self, part: Part, commit: bool) -> None:
        self.tally = Tally(part)
        self._commit = commit

    def late(self, done: _Timed | ProcessEnding) -> float:
        """Seconds, as this size counts them."""
        return done.cpu if self._commit else done.wall

    def reading(self, ask: Callable[[], _Reading[T]], allowed: float) -> _Reading[T]:
        """The first, unless it is late: at the commit size it is then tried up to three times more.

        Who is deaf for a share of his time is not late each time that he is stopped at a moment of the clock,
        so that a second late one is enough; else the latest of those that were at work counts. If none of
        them was, they say nothing, and the first counts.
        """
        first = ask()
        if not self._commit or first.wrong or first.late <= allowed:
            return first
        self.tally.count("late at first")
        in_time: list[_Reading[T]] = []
        for pause in self.PAUSES_S:
            time.sleep(pause)
            one = ask()
            if one.wrong or one.late > allowed:
                return one
            if one.stopped:
                in_time.append(one)
        return max(in_time, key=lambda one: one.late, default=first)

    def tell(self, number: int, late: float, allowed: float, call: DeadlineCall | Long) -> None:
        """A failure, if it is too late."""
        if late > allowed:
            what = f"{1e3 * late:.1f} ms late, {1e3 * allowed:.0f} allowed"
            self.tally.fail(number, what, call=call.said)

    def measure(self, kind: str, done: _Timed | ProcessEnding) -> None:
        """How late it was, by the clock and by the processor."""
        self.tally.measure(f"{kind}_ms", 1e3 * done.wall)
        self.tally.measure(f"{kind}_cpu_ms", 1e3 * done.cpu)


def _run(ask: Ask, part: Part) -> Outcome:
    judge = _Judge(part, ask.size == "commit")
    if part.kind in ("ctrl-c", "app"):
        _processes(ask, part, judge)
    elif ask.size == "commit":
        # In a process of the suite a look for garbage at all that it holds is no share of the call's (G8).
        with old_left_alone():
            _calls(ask, part, judge)
    else:
        _calls(ask, part, judge)
    return judge.tally.outcome()


def _calls(ask: Ask, part: Part, judge: _Judge) -> None:
    for number in part.numbers:
        rng = ask.rng("deadline", part.kind, number)
        call = _DRAWN.get(part.kind, call_of)(rng)
        try:
            _one(part.kind, number, call, judge)
        except (Exception, cancellation.Cancelled) as fault:
            judge.tally.case("raised")
            judge.tally.fail(number, f"{type(fault).__name__}: {fault}", call=call.said)


def _one(kind: str, number: int, call: DeadlineCall, judge: _Judge) -> None:
    by_hand, tally = kind in ("cancel", "large"), judge.tally
    seconds = call.seconds if kind == "long" else _moment(call)
    ended = Status.CANCELLED if by_hand else Status.LIMIT

    def ask() -> _Reading[tuple[Session, _Timed]]:
        session, done = _asked(call, seconds, by_hand)
        stopped = done.plan.status in (Status.LIMIT, Status.CANCELLED)
        return _Reading((session, done), judge.late(done), stopped, _wrong(done.plan, call, ended))

    # How long a call took the last time says little on a machine that others use too: up to one case in two
    # was over by then, and so tried nothing.
    for again in range(SOONER if kind in ("limit", "cancel") else 0, -1, -1):
        allowed = CANCEL_S if by_hand else max(LATE_S, LATE_SHARE * seconds)
        one = judge.reading(ask, allowed)
        if one.stopped or one.wrong or one.late > allowed or not again:
            break
        tally.count("made to end sooner")
        seconds /= 2.0
    session, done = one.done
    ending = "stopped" if one.stopped else "ended before"
    tally.case(f"status:{done.plan.status}", f"map:{call.map}", f"planner:{call.planner}", ending)
    if done.slack is not None:
        tally.measure(f"{kind}_slack_ms", 1e3 * done.slack)
    if one.stopped:
        judge.measure(kind, done)
    elif kind == "long":
        tally.fail(number, f"{done.plan.status} before its limit: it tries nothing", call=call.said)
    if one.wrong:
        tally.fail(number, one.wrong, call=call.said)
    judge.tell(number, one.late, allowed, call)
    if one.stopped and call.small:
        tally.count("asked again")
        unlike = _unlike(session.plan(), session_of(call).plan())
        if unlike:
            tally.fail(number, f"asked again after it was stopped: {unlike}", call=call.said)


def _asked(call: DeadlineCall, seconds: float, by_hand: bool) -> tuple[Session, _Timed]:
    """A fresh session, and how its call ended; made again as long as it was loading compiled code."""
    for _ in range(AGAIN):
        session = session_of(call)
        done = _timed(session, seconds, by_hand=by_hand)
        if not done.loaded:
            break
    return session, done


def _moment(call: DeadlineCall) -> float:
    """Seconds after which a call is to end: as drawn, or a share of its time if it is over sooner."""
    for _ in range(AGAIN):
        session, before = session_of(call), _machine_code()
        began = time.perf_counter()
        plan = session.plan(None, Budget(seconds=call.seconds))
        took = time.perf_counter() - began
        if _machine_code() == before:
            break
    return call.seconds if plan.status is Status.LIMIT else call.share * min(took, call.seconds)


def _processes(ask: Ask, part: Part, judge: _Judge) -> None:
    """Calls in other processes. An engine that went wrong is not asked again: its fault is told once."""
    engine: AppEngine | None = None
    try:
        for number in part.numbers:
            call = long_of(ask.rng("deadline", part.kind, number))
            judge.tally.case(f"map:{call.map}", f"planner:{call.planner}")
            if part.kind == "app" and engine is None:
                engine = AppEngine()
            stop = interrupted if engine is None else engine.cancelled

            def ended(
                call: Long = call, stop: Callable[[Long], ProcessEnding] = stop
            ) -> _Reading[ProcessEnding]:
                done = _ended(call, stop)
                return _Reading(done, judge.late(done), wrong=done.wrong)

            one = judge.reading(ended, CANCEL_S)
            if one.wrong:
                judge.tally.fail(number, one.wrong, call=call.said)
                if engine is not None:
                    engine.close()
                    engine = None
            else:
                judge.measure(part.kind, one.done)
                judge.tell(number, one.late, CANCEL_S, call)
    finally:
        if engine is not None:
            engine.close()


def _ended(call: Long, stopped: Callable[[Long], ProcessEnding]) -> ProcessEnding:
    """How it ended; made again, and stopped later, as long as it was loading compiled code."""
    for _ in range(AGAIN):
        done = stopped(call)
        if not done.loaded or done.wrong:
            break
        call = call.later
    return done


def _wrong(plan: Plan, call: DeadlineCall, stopped: Status) -> str:
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
    return f"{plan.status}, where there is {'a' if call.reachable else 'no'} way"


def _unlike(one: Plan, other: Plan) -> str:
    """How two answers differ; the work that they took may."""
    if one.status is not other.status:
        return f"{one.status}, a fresh session says {other.status}"
    if one.path is None or other.path is None:
        return ""
    same = np.array_equal(one.path.cells, other.path.cells) and one.path.exact == other.path.exact
    return "" if same else f"another way, cost {one.path.exact}; a fresh session's costs {other.path.exact}"


def _timed(session: Session, seconds: float, *, by_hand: bool) -> _Timed:
    """Make a call that is to end after ``seconds``: by its own limit, or because a thread says so."""
    stop = cancellation.CancelToken()
    budget = Budget(stop=stop) if by_hand else Budget(seconds=seconds)
    over, woken = threading.Event(), [0.0]
    before = _machine_code()

    def tell() -> None:
        if not over.wait(began + seconds - time.perf_counter()):
            woken[0] = time.perf_counter()
            stop.set()

    thread = threading.Thread(target=tell, daemon=True) if by_hand else None
    used, began = time.process_time(), time.perf_counter()
    if thread is not None:
        thread.start()
    plan = session.plan(None, budget)
    wall = max(0.0, time.perf_counter() - began - seconds)
    cpu = min(wall, max(0.0, time.process_time() - used - seconds))
    over.set()
    if thread is not None:
        thread.join()
    slack = woken[0] - began - seconds if woken[0] else None
    return _Timed(plan, wall, cpu, _machine_code() != before, slack)


def _machine_code() -> int:
    """How many forms of kernels are compiled and loaded."""
    made: list[Callable[..., Any]] = [k._compiled for k in _jit.KERNELS if k._compiled is not None]
    return sum(len(getattr(one, "overloads", ())) for one in made)


CHECK = Check(
    "deadline",
    ("G8",),
    "a limit is kept, whatever the map: the answer comes in time, and at once when the call is stopped",
    _KINDS,
    _run,
    alone=True,
    by_size=True,
)
