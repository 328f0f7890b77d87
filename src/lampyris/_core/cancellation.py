"""Cancellation: stopping a call early, on a time limit, a cancel token or Ctrl-C.

A limited call opens a :class:`CancelScope`, and the code inside polls it. The scope's flag is one word of memory,
0 until the call is to stop. Compiled loops read that word every few hundred cells
(:mod:`lampyris.kernels._jit`); other code calls :func:`checkpoint`. A timer thread sets the word when the time
is out; compiled loops release the interpreter lock, so the thread can always run. Without a limit there is no
thread, and results are the same as without cancellation.

Scopes nest: cancelling an outer scope cancels the inner one, not the other way round.

A time limit does not count the time in which machine code is loaded or compiled (:func:`paused`).

Some work must not be interrupted halfway: a library whose import was interrupted stays broken for the rest of
the process. :func:`uninterrupted` defers signals until it is done.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache
from types import FrameType
from typing import TYPE_CHECKING, Any, cast

from lampyris._core.system import has_threads, wakeup_pipe

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Word = NDArray[np.int64]
    """int64, (1,): 0, or 1 once the call is to stop."""


PAUSE_LOOK = 0.005
"""Seconds between two checks of the timer while a limit is paused."""


class Cancelled(BaseException):
    """The call was stopped. Raised by :func:`checkpoint` and by kernels; the code that opened the scope catches it.

    Not an ``Exception``: a third-party planner that turns every exception into a result would swallow this one,
    and its call would never end as cancelled.
    """


def _new() -> Word:
    # NumPy is imported when a loop first needs the word: the command line handles Ctrl-C from the start,
    # and its help must not wait for NumPy.
    import numpy as np

    return np.zeros(1, dtype=np.int64)


@cache
def _never() -> Word:
    """The word of calls without a limit. It is never written."""
    return _new()


class CancelToken:
    """Cancels every call it was passed to, now and later: ``Budget(stop=stop)``.

    ``set`` may be called from any thread. It also works in a handler of :mod:`signal`, but Python runs those
    between two bytecodes, not within a compiled loop; use :func:`interrupts` for that.

    Examples
    --------
    >>> import lampyris
    >>> stop = lampyris.CancelToken()
    >>> stop.set()
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> lampyris.plan(scene, "astar", budget=lampyris.Budget(stop=stop)).status.value
    'cancelled'
    """

    __slots__ = ("_is_set", "_watches")

    def __init__(self) -> None:
        self._is_set = False
        self._watches: dict[int, CancelScope] = {}

    @property
    def is_set(self) -> bool:
        """Whether :meth:`set` has been called."""
        return self._is_set

    def set(self) -> None:
        """Cancel. Takes no lock, so it can be called anywhere at any time."""
        # In this order, and the reverse in join: a scope that joins meanwhile is cancelled by one of the two.
        self._is_set = True
        for watch in list(self._watches.values()):
            watch.cancel()

    def join(self, watch: CancelScope) -> None:
        """Cancel a scope, too, when this token is set."""
        self._watches[id(watch)] = watch
        if self._is_set:
            watch.cancel()

    def leave(self, watch: CancelScope) -> None:
        """Remove a scope."""
        self._watches.pop(id(watch), None)


class _Interrupt(CancelToken):
    """The token that Ctrl-C sets."""

    __slots__ = ("is_left",)

    def __init__(self) -> None:
        super().__init__()
        self.is_left = False
        """Whether the next Ctrl-C is handled elsewhere."""


class _TimedWord:
    """The word of a scope where no thread can set it: reading it looks at the clock."""

    def __init__(self, scope: CancelScope) -> None:
        self._scope = scope

    def __getitem__(self, index: int) -> int:
        return int(self._scope.is_over)

    def __setitem__(self, index: int, value: int) -> None:
        """Nothing is kept: the scope knows."""


class CancelScope:
    """The limits of one call.

    Parameters
    ----------
    seconds : from now on, pauses not counted; None: no limit of its own.
    stop : token that cancels it; None: no token of its own.
    outer : the enclosing scope.
    """

    __slots__ = (
        "_is_cancelled",
        "_lock",
        "_over",
        "_paused_at",
        "_pauses",
        "_word",
        "deadline",
        "outer",
        "stop",
        "stops",
    )
    deadline: float
    stops: tuple[CancelToken, ...]

    def __init__(self, seconds: float | None, stop: CancelToken | None, outer: CancelScope | None) -> None:
        self.outer = outer
        self.stop = stop
        self._is_cancelled = False
        self._word: Word | None = None
        own = math.inf if seconds is None else time.perf_counter() + seconds
        self.deadline = own if outer is None else min(own, outer.deadline)
        self.stops = (*(() if outer is None else outer.stops), *(() if stop is None else (stop,)))
        self._over: threading.Event | None = None
        self._lock = threading.Lock()
        self._pauses, self._paused_at = 0, 0.0

    def begin(self) -> None:
        """Start the timer and register with the tokens."""
        for stop in self.stops:
            stop.join(self)
        if self.deadline < math.inf and not has_threads():
            # Kernels run in plain Python there, and read any word.
            self._word = cast("Word", _TimedWord(self))
        elif self.deadline < math.inf:
            self._over = threading.Event()
            threading.Thread(
                target=self._wait, args=(self._over,), name="lampyris-limit", daemon=True
            ).start()

    def end(self) -> None:
        """Stop the timer and unregister."""
        for stop in self.stops:
            stop.leave(self)
        if self._over is not None:
            self._over.set()

    def _wait(self, over: threading.Event) -> None:
        while True:
            with self._lock:
                paused, left = self._pauses > 0, self.deadline - time.perf_counter()
                if not paused and left <= 0.0:
                    self.cancel()
                    return
            # A timeout must fit the system's clock.
            if over.wait(PAUSE_LOOK if paused else min(left, 1e6)):
                return

    def pause(self) -> None:
        """Stop the clock of the limit until :meth:`resume`; from several threads: until the last of them resumes."""
        with self._lock:
            self._pauses += 1
            if self._pauses == 1:
                self._paused_at = time.perf_counter()

    def resume(self) -> None:
        """End a pause: the deadline is later by its length."""
        with self._lock:
            if self._pauses == 1:
                self.deadline += max(time.perf_counter() - self._paused_at, 0.0)
            # After the deadline: other threads read first the pauses and then the deadline, without the lock.
            self._pauses -= 1

    def cancel(self) -> None:
        """Cancel the call."""
        # In this order, and the reverse in word: the second of the two sets it.
        self._is_cancelled = True
        if self._word is not None:
            self._word[0] = 1

    @property
    def word(self) -> Word:
        """The word that compiled loops poll."""
        if self._word is None:
            self._word = _new()
            if self._is_cancelled:
                self._word[0] = 1
        return self._word

    @property
    def is_over(self) -> bool:
        """Whether the call is to stop."""
        if not self._is_cancelled and not self._pauses and time.perf_counter() >= self.deadline:
            self.cancel()
        return self._is_cancelled

    @property
    def was_cancelled(self) -> bool:
        """Whether this call's own token was set, as opposed to its time running out."""
        return self.stop is not None and self.stop.is_set


class _ThreadScope(threading.local):
    watch: CancelScope | None = None


_here = _ThreadScope()
_listening: _Interrupt | None = None
"""The token of :func:`interrupts`, while it is active."""


def word() -> Word:
    """The word that loops of this thread poll now."""
    here = _here.watch
    return _never() if here is None else here.word


def watch() -> CancelScope | None:
    """The innermost scope of this thread."""
    return _here.watch


def checkpoint() -> None:
    """Raise if the call is cancelled: for Python loops, and between two long steps.

    Raises
    ------
    Cancelled : the call is to stop.
    KeyboardInterrupt : because of Ctrl-C.
    """
    here = _here.watch
    if here is not None and here.is_over:
        raise_cancelled()


def raise_cancelled() -> None:
    """Stop the call.

    Raises
    ------
    Cancelled, or KeyboardInterrupt : always.
    """
    here = _here.watch
    if here is not None and any(isinstance(s, _Interrupt) and s.is_set for s in here.stops):
        raise KeyboardInterrupt
    raise Cancelled


@contextlib.contextmanager
def watching(seconds: float | None = None, stop: CancelToken | None = None) -> Iterator[CancelScope | None]:
    """Limit what is done inside, in this thread.

    Parameters
    ----------
    seconds : of wall time; None: no limit.
    stop : stops it when it is set.

    The scope of this call; None where it has neither limit: then the outer scope, if any, applies.
    """
    if seconds is None and stop is None:
        yield None
        return
    outer = _here.watch
    made = CancelScope(seconds, stop, outer)
    try:
        made.begin()
        _here.watch = made
        yield made
    finally:
        _here.watch = outer
        made.end()


@contextlib.contextmanager
def shielded() -> Iterator[None]:
    """Ignore cancellation inside: for short work that must not be left half done."""
    was = _here.watch
    _here.watch = None
    try:
        yield
    finally:
        _here.watch = was


@contextlib.contextmanager
def paused() -> Iterator[None]:
    """Do not count what is done inside for the time limits of this thread's calls; they can still be cancelled."""
    scope, held = _here.watch, []
    try:
        while scope is not None:
            if scope.deadline < math.inf:
                scope.pause()
                held.append(scope)
            scope = scope.outer
        yield
    finally:
        for one in held:
            one.resume()


@contextlib.contextmanager
def under(watch: CancelScope | None) -> Iterator[None]:
    """Run the code inside, in this thread, under the scope of another thread's call that it belongs to.

    Parameters
    ----------
    watch : scope of that call (:func:`watch`), its word created there before; None: no limit.
    """
    was = _here.watch
    _here.watch = watch
    try:
        yield
    finally:
        _here.watch = was


def leave_next(is_left: bool) -> None:
    """Leave the next Ctrl-C to a handler that the caller sets; later ones cancel loops again.

    The caller's handler alone is not enough: it may be restored before the listening thread reads the
    signal.

    Parameters
    ----------
    is_left : False once the caller no longer handles it, unless it has arrived.
    """
    if _listening is not None:
        _listening.is_left = is_left


@contextlib.contextmanager
def interrupts() -> Iterator[None]:
    """Let Ctrl-C interrupt compiled loops, which otherwise notice it only when they are done.

    For the main thread, where Ctrl-C raises :class:`KeyboardInterrupt`; elsewhere it does nothing. A signal
    wakes a thread through a pipe, and the thread sets the word that the loops poll.

    Where Python cannot raise it (in a callback from C, as while LLVM loads code, or in a finaliser) it would be
    printed and dropped; the word is set all the same, so nothing is printed.
    """
    default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not default or threading.current_thread() is not threading.main_thread():
        yield
        return
    reader, writer = wakeup_pipe()
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    if before != -1:
        # Another wakeup file descriptor is in use.
        signal.set_wakeup_fd(before)
        os.close(reader)
        os.close(writer)
        yield
        return
    global _listening
    _listening = interrupt = _Interrupt()
    threading.Thread(target=_listen, args=(reader, interrupt), name="lampyris-ctrl-c", daemon=True).start()
    report = sys.unraisablehook
    sys.unraisablehook = lambda lost: None if lost.exc_type is KeyboardInterrupt else report(lost)
    try:
        with watching(stop=interrupt):
            yield
    finally:
        sys.unraisablehook = report
        _listening = None
        signal.set_wakeup_fd(-1)
        os.close(writer)  # the thread reads to the end and exits


def _listen(reader: int, interrupt: _Interrupt) -> None:
    while received := os.read(reader, 64):
        for _ in range(received.count(signal.SIGINT)):
            _on_interrupt(interrupt)
    os.close(reader)


def _on_interrupt(interrupt: _Interrupt) -> None:
    """Handle one Ctrl-C, unless another handler has been set meanwhile."""
    if interrupt.is_left:
        interrupt.is_left = False
    elif _handler(signal.SIGINT) is signal.default_int_handler:
        interrupt.set()


Handler = Callable[[int, FrameType | None], Any]


_NAMES = "INT TERM BREAK HUP QUIT ALRM VTALRM PROF USR1 USR2 XCPU"
_RAISING = tuple(getattr(signal, f"SIG{n}") for n in _NAMES.split() if hasattr(signal, f"SIG{n}"))
"""Signals whose handlers are known to raise, to end a program or a call that takes too long."""


class _Waiting:
    """Deferred signals.

    Attributes
    ----------
    handlers : what is called for each signal afterwards.
    came : the signals that have arrived.
    is_over : whether signals are no longer deferred.
    """

    def __init__(self) -> None:
        self.handlers: dict[int, Handler] = {}
        self.came: list[tuple[int, FrameType | None]] = []
        self.is_over = False

    def note(self, number: int, frame: FrameType | None) -> None:
        """The handler of signals while they are deferred."""
        if self.is_over:  # an exception came before the former handler was back in its place
            self.handlers[number](number, frame)
        else:
            self.came.append((number, frame))

    def begin(self) -> None:
        """Take the place of every handler written in Python."""
        for number in _RAISING:
            handler = signal.getsignal(number)
            if callable(handler):
                self.handlers[number] = handler
                signal.signal(number, self.note)

    def end(self) -> None:
        """Give the handlers their places back, and call those that were waited with."""
        self.is_over = True
        try:
            for number, handler in self.handlers.items():
                if signal.getsignal(number) == self.note:
                    signal.signal(number, handler)
        finally:
            self._call()

    def _call(self) -> None:
        if self.came:
            number, frame = self.came.pop(0)
            try:
                self.handlers[number](number, frame)
            finally:
                self._call()


_waiting: _Waiting | None = None
"""The signals of the main thread that wait now."""


def _handler(number: int) -> Any:
    """What is called for a signal, now or later."""
    waiting = _waiting
    if waiting is not None and number in waiting.handlers:
        return waiting.handlers[number]
    return signal.getsignal(number)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Let no signal come between what is done inside; its handler is called afterwards.

    For importing libraries, and for compiling or loading machine code: work of a second or two. Ctrl-C raises
    KeyboardInterrupt between any two steps of Python's, and a library imported by half is of no more use in
    this process.

    Python calls handlers in the main thread only; elsewhere this does nothing. Handlers of a user wait, too,
    and are called afterwards; a signal that has no handler in Python acts at once.
    """
    global _waiting
    if _waiting is not None or threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting = _Waiting()
    try:
        # A sub-interpreter has a main thread, too, but may set no handlers: none of its own are called.
        with contextlib.suppress(ValueError):
            _waiting = waiting
            waiting.begin()
        yield
    finally:
        _waiting = None
        waiting.end()
