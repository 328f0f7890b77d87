"""Stopping a call before it is done: when its time is out, when somebody says so, on Ctrl-C.

Anyone who limits a call opens a *watch*; whatever runs inside looks at it. A watch is one word of memory, 0
until the call is to stop. Compiled loops read that word every few hundred cells
(:mod:`lampyris.kernels._jit`), others ask :func:`checkpoint`. A thread of its own sets the word when the time is
out: the loops let go of the interpreter, so it is never kept from doing so. Without a limit there is no
thread, and every result is what it would be without any of this.

Watches lie inside each other: what stops the outer one stops the inner one, not the other way round.

Some work must not be stopped halfway: a library whose import was left half done stays broken for the rest of
the process. :func:`uninterrupted` has signals wait until it is done.
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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Word = NDArray[np.int64]
    """int64, (1,): 0, or 1 once the call is to stop."""


class Cancelled(BaseException):
    """The call was stopped. Raised by :func:`checkpoint` and by kernels; the code that opened the scope catches it.

    Not an ``Exception``: a guest's planner that makes an answer of whatever goes wrong inside it would make
    one of this, too, and its call would never end as stopped.
    """


def _new() -> Word:
    # NumPy is imported when a loop first asks for its word: the command line listens from its first moment
    # on, and its help must not wait for NumPy.
    import numpy as np

    return np.zeros(1, dtype=np.int64)


@cache
def _never() -> Word:
    """The word of calls that nobody limits. Nobody writes to it."""
    return _new()


class CancelToken:
    """Stops every call that was given it, now and later: ``Budget(stop=stop)``.

    ``set`` may be called from any thread. In a handler of :mod:`signal` it works too, but Python runs those
    between two of its own steps, not within a compiled loop; :func:`interrupts` is for that.
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
        """Stop. It takes no lock, so that it can be called anywhere at any moment."""
        # In this order, and the other way round in join: a watch that joins meanwhile is told by one of both.
        self._is_set = True
        for watch in list(self._watches.values()):
            watch.tell()

    def join(self, watch: CancelScope) -> None:
        """Have a watch told, too, when this is."""
        self._watches[id(watch)] = watch
        if self._is_set:
            watch.tell()

    def leave(self, watch: CancelScope) -> None:
        """Let go of a watch."""
        self._watches.pop(id(watch), None)


class _Interrupt(CancelToken):
    """What Ctrl-C sets."""

    __slots__ = ("is_left",)

    def __init__(self) -> None:
        super().__init__()
        self.is_left = False
        """Whether the next Ctrl-C is handled elsewhere; the code that reads it reports it."""


class CancelScope:
    """One call's limit.

    Parameters
    ----------
    seconds : from now on; None: no limit of its own.
    stop : what may stop it; None: nothing of its own.
    outer : the watch that this one lies in.
    """

    __slots__ = ("_is_told", "_over", "_word", "deadline", "outer", "stop", "stops")
    deadline: float
    stops: tuple[CancelToken, ...]

    def __init__(self, seconds: float | None, stop: CancelToken | None, outer: CancelScope | None) -> None:
        self.outer = outer
        self.stop = stop
        self._is_told = False
        self._word: Word | None = None
        own = math.inf if seconds is None else time.perf_counter() + seconds
        self.deadline = own if outer is None else min(own, outer.deadline)
        self.stops = (*(() if outer is None else outer.stops), *(() if stop is None else (stop,)))
        self._over: threading.Event | None = None

    def begin(self) -> None:
        """Start to count the time, and to listen."""
        for stop in self.stops:
            stop.join(self)
        if self.deadline < math.inf:
            self._over = threading.Event()
            threading.Thread(
                target=self._wait, args=(self._over,), name="lampyris-limit", daemon=True
            ).start()

    def end(self) -> None:
        """Nobody looks at it any more."""
        for stop in self.stops:
            stop.leave(self)
        if self._over is not None:
            self._over.set()

    def _wait(self, over: threading.Event) -> None:
        left = self.deadline - time.perf_counter()
        # A timeout must fit the system's clock; nobody waits for months.
        while left > 0.0 and not over.wait(min(left, 1e6)):
            left = self.deadline - time.perf_counter()
        if left <= 0.0:
            self.tell()

    def tell(self) -> None:
        """The call is to stop."""
        # In this order, and the other way round in word: the second of the two sets it.
        self._is_told = True
        if self._word is not None:
            self._word[0] = 1

    @property
    def word(self) -> Word:
        """What compiled loops look at."""
        if self._word is None:
            self._word = _new()
            if self._is_told:
                self._word[0] = 1
        return self._word

    @property
    def is_over(self) -> bool:
        """Whether the call is to stop."""
        if not self._is_told and time.perf_counter() >= self.deadline:
            self.tell()
        return self._is_told

    @property
    def was_told(self) -> bool:
        """Whether somebody stopped this very call, and it did not merely run out of time."""
        return self.stop is not None and self.stop.is_set


class _ThreadScope(threading.local):
    watch: CancelScope | None = None


_here = _ThreadScope()
_listening: _Interrupt | None = None
"""What :func:`interrupts` sets, while it listens."""


def word() -> Word:
    """The word that loops of this thread are to look at now."""
    here = _here.watch
    return _never() if here is None else here.word


def watch() -> CancelScope | None:
    """The innermost watch of this thread."""
    return _here.watch


def checkpoint() -> None:
    """Go on, or not: for loops in Python, and between two steps that take a while.

    Raises
    ------
    Cancelled : the call is to stop.
    KeyboardInterrupt : because of Ctrl-C.
    """
    here = _here.watch
    if here is not None and here.is_over:
        halt()


def halt() -> None:
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

    The watch of this call; None where it has neither limit: then the outer one, if any, goes on.
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
    """Finish what is done inside, whatever the watch says: it is short and must not be left half done."""
    was = _here.watch
    _here.watch = None
    try:
        yield
    finally:
        _here.watch = was


@contextlib.contextmanager
def under(watch: CancelScope | None) -> Iterator[None]:
    """Do what is done inside, in this thread, under the watch of another thread's call that it is a part of.

    Parameters
    ----------
    watch : of that call (:func:`watch`), its word asked for there before; None: nobody limits it.
    """
    was = _here.watch
    _here.watch = watch
    try:
        yield
    finally:
        _here.watch = was


def leave_next(is_left: bool) -> None:
    """Leave the next Ctrl-C to a handler that the caller sets; loops are stopped by those after it.

    The caller cannot be told by its handler alone: it may have given it back before the thread that listens
    reads of the signal.

    Parameters
    ----------
    is_left : False once no handler waits for it any more, unless it has come.
    """
    if _listening is not None:
        _listening.is_left = is_left


@contextlib.contextmanager
def interrupts() -> Iterator[None]:
    """Have Ctrl-C heard within compiled loops, which else hear of it when they are done.

    For the main thread, where Ctrl-C raises :class:`KeyboardInterrupt`; elsewhere it does nothing. The system
    tells of a signal through a pipe that a thread reads, and which sets the word that the loops look at.

    Where Python cannot raise it (in a function that C calls, as LLVM does while code is loaded, or as an
    object goes), it would be printed and forgotten; the word has it, so that nothing is said.
    """
    heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not heard or threading.current_thread() is not threading.main_thread():
        yield
        return
    told, tell = os.pipe()
    os.set_blocking(tell, False)
    before = signal.set_wakeup_fd(tell, warn_on_full_buffer=False)
    if before != -1:
        # Somebody else listens already.
        signal.set_wakeup_fd(before)
        os.close(told)
        os.close(tell)
        yield
        return
    global _listening
    _listening = interrupt = _Interrupt()
    threading.Thread(target=_listen, args=(told, interrupt), name="lampyris-ctrl-c", daemon=True).start()
    say = sys.unraisablehook
    sys.unraisablehook = lambda lost: None if lost.exc_type is KeyboardInterrupt else say(lost)
    try:
        with watching(stop=interrupt):
            yield
    finally:
        sys.unraisablehook = say
        _listening = None
        signal.set_wakeup_fd(-1)
        os.close(tell)  # the thread reads to the end, and ends


def _listen(told: int, interrupt: _Interrupt) -> None:
    while said := os.read(told, 64):
        for _ in range(said.count(signal.SIGINT)):
            _hear(interrupt)
    os.close(told)


def _hear(interrupt: _Interrupt) -> None:
    """One Ctrl-C. Who has set another handler meanwhile wants to hear of it in another way."""
    if interrupt.is_left:
        interrupt.is_left = False
    elif _handler(signal.SIGINT) is signal.default_int_handler:
        interrupt.set()


Handler = Callable[[int, FrameType | None], Any]


_NAMES = "INT TERM BREAK HUP QUIT ALRM VTALRM PROF USR1 USR2 XCPU"
_RAISING = tuple(getattr(signal, f"SIG{n}") for n in _NAMES.split() if hasattr(signal, f"SIG{n}"))
"""Signals whose handlers are known to raise: to end a program, or what takes it too long."""


class _Waiting:
    """Signals that wait.

    Attributes
    ----------
    handlers : what is to be called for each signal, then.
    came : the signals that have come.
    is_over : whether signals need wait no longer.
    """

    def __init__(self) -> None:
        self.handlers: dict[int, Handler] = {}
        self.came: list[tuple[int, FrameType | None]] = []
        self.is_over = False

    def note(self, number: int, frame: FrameType | None) -> None:
        """The handler of a signal meanwhile."""
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
