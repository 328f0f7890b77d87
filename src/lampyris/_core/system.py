"""What only some operating systems have, each with what is done where it is missing.

No other module asks which system this is, or calls what is not there on Linux, macOS and Windows alike.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, NoReturn

NONBLOCKING_READ: Final = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Flags of ``os.open`` for bytes of a file; a pipe that nobody writes to is not waited for, where that can be said."""


# ---- this process --------------------


def processors() -> int:
    """Those that the process is allowed to run on, 1 or more; where that cannot be asked, all there are."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


def has_threads() -> bool:
    """Whether threads can be started; not in a browser."""
    return sys.platform != "emscripten"


def links_elf() -> bool:
    """Whether machine code comes in ELF files of 64 bits, little-endian: on Linux."""
    return sys.platform == "linux" and sys.maxsize > 2**32 and sys.byteorder == "little"


def thread_seconds() -> float:
    """CPU seconds of this thread; where threads have no clock (as in a browser), of the process."""
    return getattr(time, "thread_time", time.process_time)()


def user() -> int:
    """The number of the user; 0 where users have none."""
    return os.getuid() if hasattr(os, "getuid") else 0


def belongs_to_user(info: os.stat_result) -> bool:
    """Whether a file is this user's; True where files have no owner's number."""
    return not hasattr(os, "getuid") or info.st_uid == os.getuid()


def data_folder() -> Path:
    """Where programs of this user keep their data.

    Raises
    ------
    RuntimeError : the user has no home folder.
    """
    given = {"win32": "LOCALAPPDATA", "darwin": ""}.get(sys.platform, "XDG_DATA_HOME")
    if given and os.environ.get(given):
        return Path(os.environ[given])
    below = {"win32": "AppData/Local", "darwin": "Library/Application Support"}
    return Path.home() / below.get(sys.platform, ".local/share")


def lower_priority(steps: int) -> None:
    """Let other processes run before this one (0 to 19), where processes have such ranks."""
    if hasattr(os, "nice"):
        os.nice(steps)


# ---- limits --------------------


def more_open_files(most: int) -> None:
    """Let this process open as many files as it may ask for, up to ``most``: some systems begin with 256.

    Windows has no such limit for sockets.
    """
    try:
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = most if hard == resource.RLIM_INFINITY else min(hard, most)
        if soft != resource.RLIM_INFINITY and soft < wanted:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    except (ImportError, OSError, ValueError):
        pass


def limit_memory(more: int) -> None:
    """Let this process map so many bytes more than it does now; systems that know no such limit keep none."""
    try:
        import resource

        now = _mapped()
        resource.setrlimit(resource.RLIMIT_AS, (now + more, now + more))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, OSError, ValueError):
        pass


@contextmanager
def limited_memory(more: int) -> Iterator[None]:
    """:func:`limit_memory` for what is done inside."""
    try:
        import resource

        before = resource.getrlimit(resource.RLIMIT_AS)
        most = _mapped() + more
        soft = most if before[1] == resource.RLIM_INFINITY else min(most, before[1])
        resource.setrlimit(resource.RLIMIT_AS, (soft, before[1]))
    except (ImportError, OSError, ValueError):
        yield
        return
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def limit_seconds(more: int) -> None:
    """Let this process use so many CPU seconds more; then the system ends it, where it knows such a limit."""
    try:
        import resource

        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        resource.setrlimit(resource.RLIMIT_CPU, (int(used) + more + 1, hard))
    except (ImportError, OSError, ValueError):
        pass


def limit_file_size(most: int) -> None:
    """Let this process write no file larger than ``most`` bytes; what is refused is an error, not its end.

    Raises
    ------
    OSError : the system knows no such limit.
    """
    try:
        import resource

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    except ImportError:
        raise OSError(errno.ENOTSUP, "this system has no limit of the size of files") from None


def _mapped() -> int:
    """Bytes of address space that this process has mapped."""
    import resource

    with open("/proc/self/statm", encoding="ascii") as statm:
        return int(statm.read().split()[0]) * resource.getpagesize()


# ---- other processes --------------------


def can_fork() -> bool:
    """Whether a process can be copied as it is: on Linux and macOS."""
    return hasattr(os, "fork")


def end_group(leader: int) -> None:
    """End a group of processes, which outlives its leader; without groups each ends by itself.

    A group's number is nobody else's while it has a member.
    """
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(leader, signal.SIGKILL)


def leave() -> NoReturn:
    """End now, and with this process the group that it leads, if it leads one."""
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(0)


def was_killed(code: int | None) -> bool:
    """Whether an exit code says that a process was killed (by SIGKILL, where there are signals)."""
    return code == -getattr(signal, "SIGKILL", 9)


def ran_out_of_seconds(code: int | None) -> bool:
    """Whether an exit code says that a process used the CPU seconds it was given (:func:`limit_seconds`)."""
    return code == -getattr(signal, "SIGXCPU", 24)


def has_parent(parent: int) -> bool:
    """Whether the process that started this one is there. Windows keeps its number permanently: there it always is."""
    return os.name == "nt" or os.getppid() == parent


def killed_for_memory() -> int:
    """How many processes the system has ended for want of memory, where it says so (Linux); otherwise 0."""
    total = 0
    for name, word in MEMORY_KILLS:
        with suppress(OSError, ValueError):
            rows = dict(row.split(" ", 1) for row in Path(name).read_text().splitlines() if " " in row)
            total += int(rows.get(word, 0))
    return total


MEMORY_KILLS: Final = (("/proc/vmstat", "oom_kill"), ("/sys/fs/cgroup/memory.events", "oom_kill"))
"""Files that count them, and under which word; a kill may be in both."""


# ---- files, pipes, ports --------------------


def wakeup_pipe() -> tuple[int, int]:
    """A pipe for ``signal.set_wakeup_fd``: its ends to read from and to write to.

    Writing never waits, where that can be set; Windows asks it of sockets alone, and cannot set it for a pipe before
    Python 3.12.
    """
    reader, writer = os.pipe()
    if hasattr(os, "set_blocking"):
        with suppress(OSError):
            os.set_blocking(writer, False)
    return reader, writer


_NO_SYNC: Final = frozenset((errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.EBADF))
"""What file systems say that know no waiting for a folder (network and FAT drivers, among others)."""


def sync_folder(folder: Path) -> None:
    """Wait until the folder's names are on the disk, where folders can be waited for.

    Windows opens no folder, and some file systems know no such waiting: then there is nothing to wait for.

    Raises
    ------
    OSError : the system refuses, for any other reason.
    """
    if os.name == "nt":
        return
    fd = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(fd)
    except OSError as error:
        if error.errno not in _NO_SYNC:
            raise
    finally:
        os.close(fd)


def reuses_ports() -> bool:
    """Whether SO_REUSEADDR gives a server the port of the one before. On Windows it would let others share it."""
    return os.name == "posix"
