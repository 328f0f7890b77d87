"""A limit is kept: calls on hard maps end in time with a valid answer, and at once when somebody stops them.

What runs after the limit is counted in CPU time of this process at the commit size: on a machine that others
use too, wall time says how busy they are. At the larger sizes it is wall time, as a robot would count.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lampyris import halting, referee
from lampyris.kernels import _jit
from lampyris.model.plan import Plan, Status
from lampyris.planners import registry
from lampyris.planners.base import Budget, Session
from lampyris.selfcheck._deadline_calls import Call, call_of, session_of
from lampyris.selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally

LATE_S, LATE_SHARE = 0.050, 0.05
"""An answer may be so much later than its limit: seconds, or a share of the limit if that is more."""
CANCEL_S = 0.050
"""After so many seconds a call that was stopped has answered."""
AGAIN = 60
"""A call that had to load compiled code is made again, so many times at most: each time it gets further."""

_KINDS = {
    "limit": Kind(
        "a hard call with a drawn limit ends within it + max(50 ms, 5 %), found and valid, or limit",
        commit=380, nightly=7600, release=38_000, chunk=20,
    ),
    "cancel": Kind(
        "a hard call that another thread stops at a drawn moment answers within 50 ms",
        commit=120, nightly=2400, release=12_000, chunk=20,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class _Timed:
    """One call: its answer, and how long it went on after it should have ended, in seconds; 0: not at all.

    Parameters
    ----------
    loaded : whether compiled code was loaded or made during the call.
    """

    plan: Plan
    wall: float
    cpu: float
    loaded: bool


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        rng = ask.rng("deadline", part.kind, number)
        call = call_of(rng)
        seconds = call.seconds
        try:
            _one(ask, part.kind, number, call, seconds, tally)
        except Exception as fault:
            tally.case("raised")
            tally.fail(number, f"{type(fault).__name__}: {fault}", call=call.said)
    return tally.outcome()


def _one(ask: Ask, kind: str, number: int, call: Call, seconds: float, tally: Tally) -> None:
    for _ in range(AGAIN):
        session = session_of(call)
        done = _timed(session, seconds, by_hand=kind == "cancel")
        if not done.loaded:
            break
    late = done.cpu if ask.size == "commit" else done.wall
    allowed = CANCEL_S if kind == "cancel" else max(LATE_S, LATE_SHARE * seconds)
    tally.case(f"status:{done.plan.status}", f"map:{call.map}", f"planner:{call.planner}")
    name = "cancel" if kind == "cancel" else "late"
    if done.plan.status in (Status.LIMIT, Status.CANCELLED):
        tally.measure(f"{name}_ms", 1e3 * done.wall)
        tally.measure(f"{name}_cpu_ms", 1e3 * done.cpu)
    if late > allowed:
        tally.fail(number, f"{1e3 * late:.1f} ms late, {1e3 * allowed:.0f} allowed", call=call.said)
    wrong = _wrong(done.plan, call, Status.CANCELLED if kind == "cancel" else Status.LIMIT)
    if wrong:
        tally.fail(number, wrong, call=call.said)
    if done.plan.status in (Status.LIMIT, Status.CANCELLED) and call.small:
        tally.count("asked again")
        unlike = _unlike(session.plan(), session_of(call).plan())
        if unlike:
            tally.fail(number, f"asked again after it was stopped: {unlike}", call=call.said)


def _wrong(plan: Plan, call: Call, stopped: Status) -> str:
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
    stop = halting.Stop()
    budget = Budget(stop=stop) if by_hand else Budget(seconds=seconds)
    over, mark = threading.Event(), [0.0, 0.0]
    before = _machine_code()

    def note() -> None:
        if not over.wait(seconds):
            mark[:] = time.perf_counter(), time.process_time()
            if by_hand:
                stop.set()

    thread = threading.Thread(target=note, daemon=True)
    thread.start()
    plan = session.plan(None, budget)
    wall, cpu = time.perf_counter(), time.process_time()
    over.set()
    thread.join()
    late = (wall - mark[0], cpu - mark[1]) if 0.0 < mark[0] < wall else (0.0, 0.0)
    return _Timed(plan, *late, _machine_code() != before)


def _machine_code() -> int:
    """How many forms of kernels are compiled and loaded."""
    made: list[Callable[..., Any]] = [k._compiled for k in _jit.KERNELS if k._compiled is not None]
    return sum(len(getattr(one, "overloads", ())) for one in made)


CHECK = Check(
    "deadline",
    ("G8",),
    "A limit is kept, whatever the map: the answer comes in time, and at once when the call is stopped",
    _KINDS,
    _run,
    alone=True,
    by_size=True,
)
