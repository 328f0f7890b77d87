"""What a piece of code does to the world: files opened, programs run, sockets, pickles; time and memory."""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

T = TypeVar("T")
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_NEVER = (
    *(
        "socket.",
        "subprocess.",
        "os.system",
        "os.exec",
        "os.posix_spawn",
        "os.spawn",
        "os.fork",
        "os.startfile",
    ),
    *(
        "pickle.",
        "ctypes.",
        "shutil.",
        "tempfile.",
        "os.remove",
        "os.rename",
        "os.mkdir",
        "os.rmdir",
        "os.chmod",
    ),
    *("os.link", "os.symlink", "os.truncate", "os.putenv", "urllib.", "http.", "ftplib.", "webbrowser."),
    *("compile", "exec"),
)
_IMPORTS = ("open", "compile", "exec")
"""What an import does: it reads code and runs it."""
_MOVES = {"os.remove": 1, "os.rename": 2, "os.link": 2, "os.mkdir": 1}
"""What a writer may do with its own files, and how many of its words are their names. filelock makes sure that
the folder of its file is there."""
_folders: tuple[str, ...] = ()
_plain: frozenset[str] = frozenset()
_may_write = False
_seen: list[str] = []


def _hook(event: str, args: tuple[Any, ...]) -> None:
    if not _folders:
        return
    if event == "open":
        what = _of_open(args)
    elif event.startswith(_NEVER):
        if _may_write and all(map(_inside, args[: _MOVES.get(event, 0)] or ("",))):
            return
        what = f"{event} {args!r:.100}"
    else:
        return
    if what and not (event in _IMPORTS and not what.startswith("writes") and _importing()):
        _seen.append(what)


def _of_open(args: tuple[Any, ...]) -> str:
    """What is wrong with opening a file; nothing, if nothing is."""
    name, mode, flags = args
    if isinstance(name, int):
        return ""  # opened by its name before
    writes = (mode is not None and set(mode) & set("wax+")) or (isinstance(flags, int) and flags & _WRITES)
    if name in _plain and not writes:
        return ""
    if not _inside(name) or (writes and not _may_write):
        return f"{'writes' if writes else 'opens'} {os.path.realpath(os.fsdecode(name))}"
    return ""


def _inside(name: str | bytes | os.PathLike[str]) -> bool:
    """Whether a file's name leads into one of the folders."""
    where = os.path.realpath(os.fsdecode(name)) if name else ""
    return any(where == folder or where.startswith(folder + os.sep) for folder in _folders)


def _importing() -> bool:
    """Whether Python's own import is at work: a module needed for the first time is no file's doing."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        code = frame.f_code
        if code.co_name == "_find_and_load" and code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


sys.addaudithook(_hook)


@lru_cache(maxsize=16)
def _real(folder: Path) -> str:
    """Where a folder is; asked once, for it stays there while files are read in it."""
    return os.path.realpath(folder)


@contextmanager
def watched(*folders: Path, plain: Collection[str] = (), may_write: bool = False) -> Iterator[list[str]]:
    """What is done meanwhile beyond reading files of the folders: a list of words, empty if it is nothing.

    Parameters
    ----------
    folders : where files may be read.
    plain : names of files known to lie there and to be no links: looked at no further when they are read.
    may_write : whether files of the folders may be written, too, be given other names there, and go.
    """
    global _folders, _plain, _may_write
    _seen.clear()
    before = sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    _plain, _may_write = frozenset(plain), may_write
    _folders = tuple(map(_real, folders))
    try:
        yield _seen
    finally:
        _folders = ()
        sys.dont_write_bytecode = before


@contextmanager
def memory() -> Iterator[list[int]]:
    """The greatest growth of resident memory within, in bytes, as ``[bytes]``; ``[-1]`` if unknown here.

    The kernel keeps the mark; it can be set back where the system is Linux and lets us.
    """
    found = [-1]
    before = _resident("VmRSS") if _reset_mark() else None
    yield found
    after = _resident("VmHWM")
    if before is not None and after is not None:
        found[0] = max(0, after - before)


class Growth:
    """The growth of resident memory over many small steps, at the price of one read each.

    The kernel's mark is set back after a step that grew by :data:`SMALL`, and after :data:`EVERY` steps; so a
    step is told what all since then grew to at most, which is never less than its own growth.
    """

    SMALL = 2**22
    EVERY = 64

    def __init__(self) -> None:
        self._low: int | None = None
        self._steps = 0
        self._reset()

    def step(self) -> int:
        """Bytes; -1 where the system does not tell."""
        now = None if self._low is None else _status()
        if now is None or self._low is None:
            return -1
        grown = max(0, now["VmHWM"] - self._low)
        self._low = min(self._low, now["VmRSS"])
        self._steps += 1
        if grown >= self.SMALL or self._steps >= self.EVERY:
            self._reset()
        return grown

    def _reset(self) -> None:
        self._low, self._steps = (_resident("VmRSS") if _reset_mark() else None), 0


def _reset_mark() -> bool:
    try:
        with open("/proc/self/clear_refs", "w") as marks:
            marks.write("5")
    except OSError:
        return False
    return True


def _resident(what: str) -> int | None:
    now = _status()
    return None if now is None else now[what]


def _status() -> dict[str, int] | None:
    """Resident memory and its mark, in bytes."""
    try:
        said = os.pread(_status_file(os.getpid()), 8192, 0)
        return {
            name: int(said[(at := said.index(b"\n%b:" % name.encode()) + 7) : said.index(b"kB", at)]) * 1024
            for name in ("VmHWM", "VmRSS")
        }
    except (OSError, ValueError, AttributeError):
        return None


@lru_cache(maxsize=1)
def _status_file(process: int) -> int:
    """The file in which the kernel tells of a process, opened once: a step reads it, and does no more."""
    return os.open(f"/proc/{process}/status", os.O_RDONLY)


class Hangs(BaseException):
    """Too much time."""


@contextmanager
def no_longer_than(seconds: float, *, wall: bool = False) -> Iterator[None]:
    """Raise :class:`Hangs` after this much CPU time, or time by the clock, where the system can tell."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return
    timer, told = (signal.ITIMER_REAL, signal.SIGALRM) if wall else (signal.ITIMER_VIRTUAL, signal.SIGVTALRM)

    def stop(signum: int, frame: FrameType | None) -> None:
        raise Hangs(f"more than {seconds} s{'' if wall else ' of CPU time'}")

    before = signal.signal(told, stop)
    signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        signal.setitimer(timer, 0)
        signal.signal(told, before)


@contextmanager
def old_left_alone() -> Iterator[None]:
    """What this process held before is not looked through for garbage meanwhile: nobody's time here.

    Where something was left alone before, as in a run of tests, it stays so: looking through all tests takes as long
    as reading some hundred files.
    """
    before = gc.get_freeze_count()
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        if not before:
            gc.unfreeze()


PAUSES_S = (0.5, 2.0, 6.0)
"""Seconds before each further reading of a time that was too long: others are not always at work."""


class Readings:
    """The least of some readings of a time, where the first is too much.

    For what takes the same steps each time, and has been done before: anyone who else is at work makes a reading
    longer, and nothing makes one shorter than the steps take. Where CI runs, files of 0.1 s were once read in
    1.7 s of CPU time.

    Attributes
    ----------
    again : how many readings there were after a first one.
    """

    PAUSES_S = PAUSES_S
    VAIN = 3
    """After so many times that no reading was short enough the first one is believed."""

    def __init__(self) -> None:
        self.again = 0
        self._vain = 0

    def least(self, read: Callable[[], T], seconds: Callable[[T], float], most: float) -> T:
        """What was read in the least time; nothing is read again once it took less than ``most`` seconds."""
        found = read()
        for pause in self.PAUSES_S if self._vain < self.VAIN else ():
            if seconds(found) < most:
                return found
            time.sleep(pause)
            self.again += 1
            found = min(found, read(), key=seconds)
        self._vain += seconds(found) >= most
        return found
