"""What a piece of code does to the world: files opened, programs run, sockets, pickles; time and memory."""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

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
_folders: tuple[Path, ...] = ()
_seen: list[str] = []


def _hook(event: str, args: tuple[Any, ...]) -> None:
    if not _folders:
        return
    if event == "open":
        if isinstance(args[0], int):
            return  # opened by its name before
        where = os.path.realpath(os.fsdecode(args[0]))
        mode, flags = args[1], args[2]
        if not any(Path(where).is_relative_to(folder) for folder in _folders):
            _seen.append(f"opens {where}")
        elif (mode is not None and set(mode) & set("wax+")) or (isinstance(flags, int) and flags & _WRITES):
            _seen.append(f"writes {where}")
    elif event.startswith(_NEVER):
        _seen.append(f"{event} {args!r:.100}")


sys.addaudithook(_hook)


@contextmanager
def watched(*folders: Path) -> Iterator[list[str]]:
    """What is done meanwhile beyond reading files of the folders: a list of words, empty if it is nothing."""
    global _folders
    _seen.clear()
    _folders = tuple(Path(os.path.realpath(folder)) for folder in folders)
    try:
        yield _seen
    finally:
        _folders = ()


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


def _reset_mark() -> bool:
    try:
        with open("/proc/self/clear_refs", "w") as marks:
            marks.write("5")
    except OSError:
        return False
    return True


def _resident(what: str) -> int | None:
    try:
        with open("/proc/self/status") as status:
            found = re.search(rf"^{what}:\s+(\d+) kB", status.read(), re.MULTILINE)
    except OSError:
        return None
    return None if found is None else int(found[1]) * 1024


class Hangs(BaseException):
    """Too much CPU time."""


@contextmanager
def no_longer_than(cpu_s: float) -> Iterator[None]:
    """Raise :class:`Hangs` when this much CPU time has gone, where the system can tell."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def stop(signum: int, frame: FrameType | None) -> None:
        raise Hangs(f"more than {cpu_s} s of CPU time")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, cpu_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)
