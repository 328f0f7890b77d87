"""How the process of the command line ends: at once, and as usual where something is to happen after it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

TOLD = """
import os, sys
leave = os._exit
def told(code):
    os.write(2, b"at once\\n")
    leave(code)
os._exit = told
"""
ASKED = 'sys.argv = ["lampyris", "--version"]\n'
PROGRAM = "from lampyris.cli import program\nprogram()\n"
ANOTHER = """
import runpy
def other():
    runpy.run_module("lampyris", run_name="__main__")
try:
    other()
except SystemExit as done:
    print("after it", done.code)
"""
WATCHED = """
from types import SimpleNamespace
sys.monitoring = SimpleNamespace(get_tool=lambda k: "profiler" if k == 2 else None)
"""
THREAD = """
import threading, time
threading.Thread(target=lambda: (time.sleep(0.2), print("a thread's last words"))).start()
"""


def end(code: str, *words: str) -> subprocess.CompletedProcess[str]:
    """What a process with this code says."""
    return subprocess.run(
        [sys.executable, *words, "-c", TOLD + ASKED + code],
        capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL,
    )  # fmt: skip


def test_it_ends_at_once() -> None:
    done = end("import atexit\natexit.register(print, 'registered')\n" + PROGRAM)
    assert (done.returncode, done.stderr) == (0, "at once\n")
    assert done.stdout.splitlines()[-1] == "registered"


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("sys.setprofile(lambda *args: None)\n" + PROGRAM, ()),
        (WATCHED + PROGRAM, ()),
        ("def caller():\n    from lampyris.cli import program\n    program()\ncaller()\n", ()),
        (PROGRAM, ("-i",)),
    ],
    ids=["a profiler", "a profiler of Python 3.12", "a function", "python -i"],
)
def test_what_waits_for_its_end_goes_on(code: str, words: tuple[str, ...]) -> None:
    done = end(code, *words)
    assert done.returncode == 0
    assert done.stdout.startswith("lampyris ")
    assert "at once" not in done.stderr


def test_a_program_that_runs_it_goes_on() -> None:
    """A profiler that runs a module, such as one of memory, writes its file afterwards."""
    done = end(ANOTHER)
    assert (done.returncode, done.stdout.splitlines()[-1], done.stderr) == (0, "after it 0", "")


def test_other_threads_are_waited_for() -> None:
    done = end(THREAD + PROGRAM)
    assert done.stdout.splitlines()[-1] == "a thread's last words"


@pytest.mark.parametrize("module", [True, False], ids=["python -m", "a script"])
def test_both_ways_to_start_it_end_at_once(module: bool, tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(TOLD)
    script = tmp_path / "lampyris-script.py"
    script.write_text("import sys\nfrom lampyris.cli import program\nsys.exit(program())\n")
    words = ["-m", "lampyris"] if module else [str(script)]
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, *words, "--version"],
        capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": path},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "at once\n")
