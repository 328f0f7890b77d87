"""What only some operating systems have is asked for in one module, and each has a way without it."""

from __future__ import annotations

import ast
import builtins
import errno
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lampyris._core import cancellation, system

ROOT = Path(__file__).resolve().parents[1]
HOME = ROOT / "src" / "lampyris" / "_core" / "system.py"
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="a limit that Linux has")
MODULES = {
    "fcntl", "grp", "msvcrt", "posix", "pty", "pwd", "resource", "select", "selectors", "syslog", "termios", "tty",
    "winreg", "_winapi",
}  # fmt: skip
"""Modules of Python that some systems do not have."""
NAMES = {
    "os": {
        "O_BINARY", "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "chown", "fchmod", "fork", "forkpty", "getegid", "geteuid",
        "getgid", "getloadavg", "getpgid", "getpgrp", "getppid", "getsid", "getuid", "initgroups", "killpg", "mkfifo", "name",
        "nice", "pipe2", "posix_fadvise", "posix_spawn", "pread", "sched_getaffinity", "sched_setaffinity", "set_blocking",
        "setpgid", "setsid", "sync", "uname", "wait", "waitpid",
    },
    "signal": {
        "SIGALRM", "SIGCHLD", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT", "SIGUSR1", "SIGUSR2", "SIGVTALRM", "SIGXCPU",
        "SIGXFSZ", "alarm", "pause", "pthread_kill", "pthread_sigmask", "setitimer", "siginterrupt", "sigwait",
    },
    "socket": {"AF_UNIX", "SO_REUSEPORT", "socketpair"},
    "time": {"CLOCK_MONOTONIC_RAW", "clock_gettime", "pthread_getcpuclockid", "thread_time", "tzset"},
    "sys": {"getwindowsversion", "platform"},
}  # fmt: skip
"""Names of modules that all systems have, which some systems lack or which say what the system is."""


WORDS = re.compile(r"\w+")
PLACES = re.compile(r"os\.(name|wait)\b|[\"']/(proc|sys|dev)/")
RARE = MODULES.union(*NAMES.values()) - {"name", "wait"}


def worth_parsing(text: str) -> bool:
    """Whether a module has any of these words; parsing all of them takes seconds."""
    return not RARE.isdisjoint(WORDS.findall(text)) or PLACES.search(text) is not None


def platform_only(text: str) -> Iterator[str]:
    """What a module asks for that not every system has, with its line."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else [n.name for n in node.names]
            yield from (f"{node.lineno}: import {name}" for name in names if name.split(".")[0] in MODULES)
            if isinstance(node, ast.ImportFrom):
                few = NAMES.get(node.module or "", set())
                yield from (f"{node.lineno}: {one.name}" for one in node.names if one.name in few)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in NAMES.get(node.value.id, ()):
                yield f"{node.lineno}: {node.value.id}.{node.attr}"
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("getattr", "hasattr"):
            at, word = node.args[0], getattr(node.args[1], "value", "")
            if isinstance(at, ast.Name) and word in NAMES.get(at.id, ()):
                yield f"{node.lineno}: {at.id}.{word}"
        elif isinstance(node, ast.Constant) and str(node.value).startswith(("/proc/", "/sys/", "/dev/")):
            yield f"{node.lineno}: {node.value!r:.40}"


@pytest.mark.source
def test_only_one_module_asks_which_system_this_is() -> None:
    found = [
        f"{file.relative_to(ROOT)}:{what}"
        for file in sorted((ROOT / "src" / "lampyris").rglob("*.py"))
        if file != HOME and worth_parsing(text := file.read_text(encoding="utf-8"))
        for what in platform_only(text)
    ]
    assert found == []
    assert len(list(platform_only(HOME.read_text(encoding="utf-8")))) > 20


def lacking(monkeypatch: pytest.MonkeyPatch, *modules: str) -> None:
    """Importing these fails, as it does on systems that do not have them."""
    before = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name in modules:
            raise ImportError(name)
        return before(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)


def test_processors_where_none_are_set_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 1 <= system.processors() <= (os.cpu_count() or 1)
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert system.processors() == os.cpu_count()
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert system.processors() == 1


def test_clock_where_threads_have_none(monkeypatch: pytest.MonkeyPatch) -> None:
    before = system.thread_seconds()
    assert 0.0 <= before <= time.process_time() + 1.0
    # A browser.
    monkeypatch.delattr(time, "thread_time")
    assert before <= system.thread_seconds() <= time.process_time()


@pytest.mark.parametrize("threads", [True, False])
def test_time_limit_where_there_are_no_threads(threads: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not threads:
        # A browser.
        monkeypatch.setattr(sys, "platform", "emscripten")
        monkeypatch.setattr(threading, "Thread", lambda *_, **__: pytest.fail("no thread can be started"))
        assert not system.has_threads()
    with cancellation.watching(seconds=60.0):
        assert cancellation.word()[0] == 0
        cancellation.checkpoint()
    stop = cancellation.CancelToken()
    with cancellation.watching(seconds=60.0, stop=stop):
        stop.set()
        assert cancellation.word()[0] == 1
    with cancellation.watching(seconds=0.02):
        word, began = cancellation.word(), time.perf_counter()
        while not word[0]:
            assert time.perf_counter() - began < 30.0
        with pytest.raises(cancellation.Cancelled):
            cancellation.checkpoint()


def test_users_where_they_have_no_numbers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    info = tmp_path.stat()
    assert system.belongs_to_user(info)
    if hasattr(os, "getuid"):
        assert system.user() == os.getuid()
        foreign = os.stat_result((*info[:4], info.st_uid + 1, *info[5:10]))
        assert not system.belongs_to_user(foreign)
        monkeypatch.delattr(os, "getuid")
        assert system.belongs_to_user(foreign)
    assert system.user() == 0


@pytest.mark.parametrize(
    ("platform", "variable", "below"),
    [
        ("linux", "XDG_DATA_HOME", ".local/share"),
        ("win32", "LOCALAPPDATA", "AppData/Local"),
        ("darwin", "", "Library/Application Support"),
        ("freebsd14", "XDG_DATA_HOME", ".local/share"),
    ],
)
def test_folder_of_data(
    platform: str, variable: str, below: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    for each in ("XDG_DATA_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(each, "")
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert system.data_folder() == tmp_path / below
    if variable:
        monkeypatch.setenv(variable, str(tmp_path / "x"))
        assert system.data_folder() == tmp_path / "x"


def test_limits_where_there_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    lacking(monkeypatch, "resource")
    system.more_open_files(4096)
    system.limit_memory(1)
    system.limit_seconds(0)
    with system.limited_memory(1):
        assert len(bytes(2**20)) == 2**20
    with pytest.raises(OSError, match="no limit of the size of files"):
        system.limit_file_size(1)


LIMITED = """
import os, sys
from lampyris._core import system
with system.limited_memory(2**28):
    try:
        bytes(2**29)
    except MemoryError:
        print("refused")
print(len(bytes(2**29)))
system.limit_memory(2**28)
try:
    bytes(2**29)
except MemoryError:
    print("refused")
system.limit_file_size(1000)
try:
    with open(sys.argv[1], "wb", buffering=0) as file:
        file.write(bytes(1000))
        file.write(b"x")
except OSError as fault:
    print(fault.errno)
"""


@LINUX
def test_limits_where_there_are_some(tmp_path: Path) -> None:
    command = [sys.executable, "-c", LIMITED, str(tmp_path / "file")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.split() == ["refused", str(2**29), "refused", str(errno.EFBIG)]
    assert done.returncode == 0


@LINUX
@pytest.mark.nightly
def test_process_ends_after_its_seconds() -> None:
    code = "from lampyris._core import system\nsystem.limit_seconds(0)\nwhile True: pass"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=60, check=False)
    assert system.ran_out_of_seconds(done.returncode)
    assert not system.was_killed(done.returncode)


def test_ranks_of_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[int] = []
    monkeypatch.setattr(os, "nice", steps.append, raising=False)
    system.lower_priority(5)
    assert steps == [5]
    monkeypatch.delattr(os, "nice")
    system.lower_priority(5)
    assert steps == [5]


def test_processes_where_they_have_no_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "killpg", raising=False)
    system.end_group(2**22 + 1)
    gone: list[int] = []
    monkeypatch.setattr(os, "_exit", gone.append)
    leave: Any = system.leave  # here it comes back
    leave()
    assert gone == [0]
    monkeypatch.delattr(os, "fork", raising=False)
    assert not system.can_fork()


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no groups of processes")
def test_group_ends_with_its_leader() -> None:
    command = [sys.executable, "-c", "import time; print(flush=True); time.sleep(60)"]
    with subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        system.end_group(process.pid)
        code = process.wait(30)
    assert system.was_killed(code)
    assert not system.ran_out_of_seconds(code)
    assert not system.was_killed(0)
    system.end_group(process.pid)  # it is gone: nothing is said


def test_codes_where_there_are_no_signals(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SIGKILL", "SIGXCPU"):
        monkeypatch.delattr(signal, name, raising=False)
    assert system.was_killed(-9)
    assert system.ran_out_of_seconds(-24)
    assert not system.was_killed(None)


def test_parent_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    assert system.has_parent(os.getppid())
    assert system.has_parent(os.getppid() + 1) == (os.name == "nt")
    monkeypatch.setattr(os, "name", "nt")
    assert system.has_parent(os.getppid() + 1)


def test_kills_for_memory_are_counted_where_the_system_tells(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "events").write_text("low 0\noom_kill 3\nodd\n")
    monkeypatch.setattr(
        system, "MEMORY_KILLS", ((str(tmp_path / "events"), "oom_kill"), ("/nowhere", "oom_kill"))
    )
    assert system.killed_for_memory() == 3
    monkeypatch.setattr(system, "MEMORY_KILLS", (("/nowhere", "oom_kill"),))
    assert system.killed_for_memory() == 0


@pytest.mark.parametrize("settable", [True, False])
def test_pipe_of_signals_where_pipes_cannot_be_set(settable: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if settable:
        reader, writer = system.wakeup_pipe()
        assert not os.get_blocking(writer)
    else:
        # Windows before Python 3.12.
        monkeypatch.delattr(os, "set_blocking")
        reader, writer = system.wakeup_pipe()
    os.write(writer, b"x")
    assert os.read(reader, 2) == b"x"
    os.close(reader)
    os.close(writer)
    if settable:
        with cancellation.interrupts():
            pass


def test_folders_are_not_waited_for_where_they_cannot_be_opened(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    system.sync_folder(tmp_path)
    monkeypatch.setattr(os, "name", "nt")
    monkeypatch.setattr(os, "open", lambda *_: pytest.fail("Windows opens no folder"))
    system.sync_folder(tmp_path)


def test_ports_are_had_again_on_posix_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    assert system.reuses_ports() == (os.name == "posix")
    monkeypatch.setattr(os, "name", "nt")
    assert not system.reuses_ports()
    assert hasattr(socket, "SO_REUSEADDR")
