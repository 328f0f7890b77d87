"""Calls of ``plan`` that end in time, and sessions that are as good as new after one that was stopped."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled, CancelScope
from lampyris.model.change import Change
from lampyris.model.plan import Plan, Status
from lampyris.planning.base import Budget


class Limited(Protocol):
    """A session whose calls can be stopped."""

    def drop(self, anywhere: bool) -> str:
        """Let go of what a stopped call may have left half done; the planner's name.

        What the session was given (the robot's place, the map) stays.

        Parameters
        ----------
        anywhere : it may have been stopped between any two steps of Python's, not only where it looks.
        """
        ...


S = TypeVar("S", bound=Limited)
Ask = Callable[[S, Change | None, Budget | None], Plan]


def limited(plan: Ask[S]) -> Callable[..., Plan]:
    """Make a session's ``plan`` keep to the seconds and the stop of its budget.

    After a call that was stopped the session gives the answers of one that never had that call, save that
    it knows the Change: what may be half done is made again, draws are taken back.
    """

    @functools.wraps(plan)
    def asked(session: S, change: Change | None = None, budget: Budget | None = None) -> Plan:
        seconds, stop = (None, None) if budget is None else (budget.seconds, budget.stop)
        if seconds is None and stop is None and cancellation.watch() is None:
            try:
                return plan(session, change, budget)
            except (Cancelled, KeyboardInterrupt) as why:
                session.drop(isinstance(why, KeyboardInterrupt))
                raise
        with cancellation.watching(seconds, stop) as own:
            rng = getattr(session, "_rng", None) if cancellation.watch() is not None else None
            drawn = rng.bit_generator.state if isinstance(rng, np.random.Generator) else {}
            try:
                return plan(session, change, budget)
            except (Cancelled, KeyboardInterrupt) as why:
                name = session.drop(isinstance(why, KeyboardInterrupt))
                if isinstance(rng, np.random.Generator):
                    rng.bit_generator.state = drawn
                if own is None or isinstance(why, KeyboardInterrupt) or _outer(own):
                    raise
                return stopped_plan(name, own, seconds)

    return asked


def _outer(own: CancelScope) -> bool:
    """Whether it is not this call alone that is to stop."""
    return own.outer is not None and own.outer.is_over


def stopped_plan(name: str, own: CancelScope, seconds: float | None) -> Plan:
    """The answer of a call that was stopped.

    Progress is not reported: it would differ from run to run.
    """
    if own.was_cancelled:
        return Plan(Status.CANCELLED, name)
    sentence = f"Stopped after {seconds:g} s, its limit, before the search was over."
    return Plan(Status.LIMIT, name, detail=sentence)


def within(budget: Budget | None, name: str, answer: Callable[[], Plan]) -> Plan:
    """An answer within the seconds and the stop of a budget."""
    if budget is None:
        return answer()
    with cancellation.watching(budget.seconds, budget.stop) as own:
        try:
            return answer()
        except Cancelled:
            if own is None or _outer(own):
                raise
            return stopped_plan(name, own, budget.seconds)
