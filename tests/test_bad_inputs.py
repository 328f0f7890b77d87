"""The hundred bad inputs: each has its named error, at its place; what looks wrong and is not, is read.

Each case goes through the command line's own ``main``: in this process, with its memory measured, and every
night as a process of its own, with its CPU time.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

import pytest

import lampyris
from bad_inputs import CASES, DEFERRED, ELSEWHERE, studies
from bad_inputs.case import LAUNCHER, Case, Outcome, inside, run, warm
from lampyris.errors import LampyrisError
from lampyris.io.maps.load import load_map
from sizes import some

CPU_S = 1.0
MEMORY = 256 * 2**20

MAPS = [c for c in CASES if c.words[0] == "plan" and c.row <= 60]
REFUSED_MAPS = [c for c in MAPS if c.code and "--max-cells" not in c.words]
READ_MAPS = [c for c in MAPS if c.cells]
IN_THIRDS = [c for third in range(3) for c in REFUSED_MAPS[third::3]]
"""For what all verbs have in common a commit takes the first third: one of each few rows."""


def judge(case: Case, done: Outcome) -> None:
    """The rules that hold for every case."""
    assert done.exit == case.exit, done.err
    assert "Traceback" not in done.out + done.err
    lines = done.err.splitlines()
    if case.code:
        assert done.out == ""
        assert len(lines) == 1, done.err
        assert lines[0].startswith(f"error[{case.code}]: ")
        assert len(lines[0]) < 1500
        assert lines[0].isprintable(), "a file's bytes must not reach the terminal raw"
    else:
        assert all(line.startswith("note: ") for line in lines), done.err
        assert not (case.silent and lines), done.err
        if "--json" in case.words:
            json.loads(done.out)
    for fragment in case.prints:
        assert fragment in done.out, done.out
    for fragment in case.says:
        assert fragment in done.err, done.err


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.id)
def test_each_case(tmp_path: Path, case: Case) -> None:
    warm()
    case.prepare(tmp_path)
    there = {p: p.stat().st_size for p in tmp_path.rglob("*")}
    with inside(tmp_path):
        done = run(*case.words)
    judge(case, done)
    assert {p: p.stat().st_size for p in tmp_path.rglob("*")} == there, "nothing is written"
    assert done.grown < MEMORY


@pytest.mark.parametrize("case", READ_MAPS, ids=lambda c: c.id)
def test_what_is_accepted_is_read_as_it_should_be(tmp_path: Path, case: Case) -> None:
    warm()
    case.prepare(tmp_path)
    with inside(tmp_path):
        done = run("maps", "convert", case.words[1], "read-as.txt")
        assert done.exit == 0, done.err
        found = load_map("read-as.txt")
        written = tuple(Path("read-as.txt").read_text().split())
        assert written == case.cells
        assert found.grid.blocked.tolist() == [[c != "." for c in row] for row in case.cells]
        if case.strict:
            with pytest.raises(LampyrisError, match=rf"^error\[{case.strict}\]: ") as caught:
                load_map(case.words[1], strict=True)
            assert caught.value.exit_code == 3


def with_options(text: str) -> str:
    """Advice as the command line gives it: its options in place of Python's arguments."""
    text = re.sub(r'\b(\w+)="(\w+)"', r"--\1 \2", text)
    return re.sub(r"\b(\w+)=True", lambda found: f"--{found[1].replace('_', '-')}", text)


@pytest.mark.parametrize("case", some(IN_THIRDS, len(REFUSED_MAPS) // 3), ids=lambda c: c.id)
def test_every_verb_refuses_a_map_in_the_same_words(tmp_path: Path, case: Case) -> None:
    warm()
    case.prepare(tmp_path)
    file = case.words[1]
    with inside(tmp_path):
        said = run(*case.words).err
        for words in (
            ("simulate", file, "--start", "0,0", "--goal", "0,0", "--json"),
            ("maps", "convert", file, "read-as.txt"),
        ):
            done = run(*words)
            assert (done.exit, done.err, done.out) == (case.exit, said, "")
        assert not Path("read-as.txt").exists()
        with pytest.raises(LampyrisError) as caught:
            load_map(file)
    assert f"{with_options(str(caught.value))}\n" == said
    assert caught.value.where
    assert re.fullmatch("[A-Z][A-Z_]+", caught.value.code)


def test_row_89_a_start_too_fast_to_stop_from() -> None:
    scene = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0))
    found = lampyris.plan(scene)
    with pytest.raises(
        LampyrisError, match=r"^error\[PROFILE_INFEASIBLE\]: v0: 9 m/s .* needs 40 m"
    ) as caught:
        lampyris.speed_profile(scene, found, v0=9.0)
    assert caught.value.exit_code == 3


def process(*words: str, **how: Any) -> subprocess.Popen[bytes]:
    """The command line as a process."""
    call = "from lampyris.cli import main; main()"
    return subprocess.Popen([sys.executable, "-c", call, *words], stderr=subprocess.PIPE, **how)


def test_row_100_a_reader_that_leaves() -> None:
    """As in ``lampyris maps make ... | head -1``: quiet, and not a failure."""
    reader, writer = os.pipe()
    os.close(reader)
    with process("plan", "guide", "--json", stdout=writer) as running:
        os.close(writer)
        _, said = running.communicate(timeout=120)
    assert (running.returncode, said) == (0, b"")


def test_row_100_ctrl_c() -> None:
    """A simulation that would not end soon, interrupted when it is under way."""
    words = ("simulate", "caves-64", "--obstacles", "60", "--patience", "1000000000", "--json", "--seed", "1")
    started = (
        "import signal, sys; from lampyris.sim.grid import loop; run = loop.run\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it\n"
        "def begun(*given, **how):\n    sys.stdout.write('begun'); sys.stdout.flush()\n"
        "    signal.raise_signal(signal.SIGINT)\n    return run(*given, **how)\n"
        "loop.run = begun; from lampyris.cli import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", started, *words], capture_output=True, timeout=120, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, b"begun", b"interrupted\n")


@pytest.mark.nightly
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks Linux what a process has used")
def test_each_case_as_a_process(tmp_path: Path) -> None:
    """CPU time beside a call that does nothing, and the peak of memory, both as the system counts them."""
    call = [str(Path(sysconfig.get_path("scripts")) / "lampyris")]
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # its threads reserve more address space than we use
    with subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", LAUNCHER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=env,
    ) as launcher:
        assert launcher.stdin is not None
        assert launcher.stdout is not None

        def measured(folder: Path, *words: str) -> Outcome:
            job = {"folder": str(folder), "words": [*call, *words], "address_space": 4 * 2**30}
            print(json.dumps(job), file=launcher.stdin, flush=True)
            return Outcome(*json.loads(launcher.stdout.readline()))

        base = sorted(measured(tmp_path, "plan", "guide", "--json").cpu_s for _ in range(5))[2]
        used = []
        for case in CASES:
            folder = tmp_path / case.id.replace("/", "_") / "here"
            folder.mkdir(parents=True)
            case.prepare(folder)
            done = measured(folder, *case.words)
            judge(case, done)
            used.append((done.cpu_s - base, done.grown, case.id))
            shutil.rmtree(folder.parent)
        launcher.stdin.close()
    slowest, largest = max(used), max(used, key=lambda u: u[1])
    print(
        f"\n{len(used)} bad inputs as processes; a plan on a small map takes {base:.2f} s of CPU; the slowest"
        f" {slowest[0]:+.2f} s ({slowest[2]}); the largest {largest[1] / 2**20:.0f} MiB ({largest[2]})"
    )
    assert slowest[0] < CPU_S, slowest
    assert largest[1] < MEMORY, largest


def test_the_table_is_whole() -> None:
    rows = [*{c.row for c in CASES}, *ELSEWHERE, *DEFERRED]
    assert sorted(rows) == list(range(1, 101))
    assert len({c.id for c in CASES}) == len(CASES)


def test_nothing_is_deferred() -> None:
    """A row that waits for what is to be built says for what."""
    assert not DEFERRED


def test_row_96_a_store_that_another_process_writes_to(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_bytes(studies.STUDY)
    (tmp_path / "s.study.db").write_bytes(studies.store_of())
    with inside(tmp_path), studies.hold(tmp_path / "s.study.db") as held:
        try:
            for more in ((), ("--fresh",)):
                done = run(*studies.RUN, *more)
                assert (done.exit, done.out) == (3, "")
                assert done.err.startswith("error[STORE_BUSY]: ")
                assert f"pid {held.pid}" in done.err
            assert run(*studies.SHOW).exit == 0, "it may be read meanwhile"
        finally:
            held.communicate()
    with inside(tmp_path):
        assert run(*studies.RUN).exit == 0
