"""Objects that serve one call at a time.

Planner sessions, simulations and field keepers hold arrays that a call works on, often in compiled code that
lets go of the interpreter. Two calls at once would read and write the same memory: a wrong answer, a loop
without end, a crash of the process. A second call is therefore refused with :class:`BusyError` while another
is at work, from another thread or from within the first (a signal handler, a callback). It is refused and not
kept waiting: a waiting call could not keep to the seconds of its budget, would not hear of ``Budget.stop``,
and one from within the first would wait forever.

Use one object for each thread, or a ``threading.Lock`` around the calls if several threads share one.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from copy import deepcopy
from threading import get_ident
from typing import Any, Concatenate, ParamSpec, Self, TypeVar

from lampyris.errors import BusyError


class Call:
    """A call that has begun. Two calls are equal only if they are the same."""

    __slots__ = ("method", "thread")

    def __init__(self, method: Callable[..., Any]) -> None:
        self.thread = get_ident()
        self.method = method


class Exclusive:
    """An object whose methods marked with :func:`one_call` serve one call at a time.

    ``copy.copy``, ``copy.deepcopy`` and pickling give a whole and independent object, and count as a call:
    nobody gets a copy of what another thread is changing. A copy is not busy.

    Raises
    ------
    BusyError : ``BUSY``: a marked method is called, or a copy taken, during another call.
    """

    __slots__ = ("_calls",)
    _calls: list[Call]
    """The calls that have begun, the one at work first. In a slot, so that it is no part of a copy."""

    def __new__(cls, *args: Any, **kwargs: Any) -> Self:
        made = super().__new__(cls)
        made._calls = []
        return made

    def _own_state(self) -> dict[str, Any]:
        """What a copy is made from: attributes by name."""
        return self.__dict__

    def _take_state(self, state: dict[str, Any]) -> None:
        """Take the state that :meth:`_own_state` returned."""
        self.__dict__.update(state)

    def __copy__(self) -> Self:
        return deepcopy(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        copied = type(self).__new__(type(self))
        memo[id(self)] = copied
        copied._take_state(_copied_state(self, memo))
        return copied

    def __getstate__(self) -> dict[str, Any]:
        # A copy: pickling reads what it is given after this call is over.
        return _copied_state(self, {id(self): self})

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._take_state(state)


P = ParamSpec("P")
R = TypeVar("R")
O = TypeVar("O", bound=Exclusive)  # noqa: E741


def one_call(method: Callable[Concatenate[O, P], R]) -> Callable[Concatenate[O, P], R]:
    """Refuse calls of a method while another marked method of the same object is at work.

    An overriding method may call the one it overrides.
    """

    @functools.wraps(method)
    def alone(self: O, /, *args: P.args, **kwargs: P.kwargs) -> R:
        # Appending, reading the first and taking it off are single steps of the interpreter: no other thread
        # and no signal comes between. Whatever ends the call, Ctrl-C included, takes it off the list.
        calls = self._calls
        call = Call(method)
        try:
            calls.append(call)
            if calls[0] is not call and not _overrides(calls[0], call):
                raise _busy(self, method.__name__)
            return method(self, *args, **kwargs)
        finally:
            if calls and calls[0] is call:
                del calls[0]
            elif call in calls:
                calls.remove(call)

    return alone


def _overrides(first: Call, call: Call) -> bool:
    """Whether a call comes from within an overriding method."""
    one, other = first.method, call.method
    return first.thread == call.thread and one is not other and one.__name__ == other.__name__


def _busy(owner: object, what: str) -> BusyError:
    return BusyError(
        "BUSY",
        f"{what} was called during another call",
        where=type(owner).__name__,
        allowed="one call at a time",
        todo="use one object for each thread, or a lock around the calls",
    )


@one_call
def _copied_state(owner: Exclusive, memo: dict[int, Any]) -> dict[str, Any]:
    return deepcopy(owner._own_state(), memo)
