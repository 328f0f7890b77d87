"""Check: a study that is killed loses nothing that it acknowledged, and ends with the same bytes.

A warm process is killed at drawn moments (``random``); so is the command as it is used, with workers, which are
killed too (``study``). Needs Linux: workers are found in /proc.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from lampyris.errors import LampyrisError
from lampyris.study.store.store import Store
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.studies.sitting_child import digest
from lampyris_selfcheck.checks.studies.sittings import Bench, forks_needed, judged
from lampyris_selfcheck.scratch import folder

KINDS = {
    "random": Kind(
        "a warm process is killed up to four times at drawn moments: no acknowledged row lost, changed or "
        "stored twice; at the end the table has the bytes of an undisturbed one",
        8, 1200, 10_000, 20,
    ),
    "study": Kind(
        "`lampyris study` with two workers, it and they killed three times at drawn moments; no process is "
        "left over",
        1, 60, 334, 1,
    ),
}  # fmt: skip
KILLS, RUNS = 3, 126
"""Kills of the command, and runs of its study, of which the next forty come before the next kill."""
ATTEMPTS = 5
"""Studies begun, at most, until one is killed that often before it ends."""
GONE_IN_S, STUCK_S = 20.0, 300.0
"""Seconds in which the workers of a killed study end by themselves; without a sign of life."""
STUDY = """
version: 1
name: killed
preset: dissertation
maps:
  - {bundled: guide, limit: 1}
  - {bundled: rooms-20, queries: {random: 1, least: 12}}
planners:
  - {name: ad-gso, grid: {choice: [greedy, roulette]}}
  - astar
traffic:
  - {kind: random-walk, count: 5, grid: {tracks: [live, replayed]}}
  - {kind: random-walk, count: 77}
seeds: 7
"""
"""18 runs a seed; among 77 walkers they are refused."""
COMMAND = (sys.executable, "-m", "lampyris", "study", "run", "s.yaml", "--force", "--csv")


def _random(ask: Ask, one: Bench, number: int) -> tuple[list[str], str]:
    """Killed up to four times."""
    rng = ask.rng("kill", "random", number)
    kills = 0
    for _ in range(int(rng.integers(1, 5))):
        ended = one.sit(kill_after=float(rng.random()) * one.whole.seconds)
        if ended.code == 0:
            break
        if ended.code != -signal.SIGKILL or ended.late:
            return [], f"it ended with {ended.code}: {ended.errors[-300:]}"
        kills += 1
        if wrong := one.kept():
            return [], f"after {kills} kills: {wrong}"
    return [f"killed {kills} times"], one.finish()


# ---- the command, with workers --------------------


def _command(ask: Ask, number: int, at: Path) -> tuple[list[str], str]:
    """What was read in the store before each kill is there at the end, and the bytes are as undisturbed."""
    forks_needed()
    rng = ask.rng("kill", "study", number)
    (at / "s.yaml").write_text(STUDY)
    for attempt in range(ATTEMPTS):
        store = at / f"a{attempt}.db"
        killed, wrong = _killed_study(rng, at, store)
        if wrong or len(killed) == KILLS:
            return [f"{who} killed" for who in set(killed)], wrong
    return [], f"it ended before the third kill, {ATTEMPTS} times"


def _killed_study(rng: np.random.Generator, at: Path, store: Path) -> tuple[list[str], str]:
    """Kill a study until it is done; what was killed, and what is wrong.

    On a busy machine it may be done before it was killed three times: nothing is wrong with that, but it is repeated.
    """
    acknowledged: dict[str, str] = {}
    killed: list[str] = []
    orphans: list[tuple[int, str]] = []
    words = [*COMMAND, "a.csv", "--store", store.name, "--workers", "2"]
    while True:
        with (at / "errors").open("wb") as errors:
            process = subprocess.Popen(
                words, cwd=at, stdout=subprocess.DEVNULL, stderr=errors, start_new_session=True
            )
        try:
            while len(killed) < KILLS and process.poll() is None:
                row = len(acknowledged) + int(rng.integers(1, RUNS // (KILLS + 1)))
                _wait(partial(_has_rows, process, store, row))
                time.sleep(float(rng.random()) * 0.2)
                if process.poll() is not None:
                    break
                acknowledged |= _rows(store)
                orphans += _below(process.pid)
                killed.append(_kill(process, rng))
            code = process.wait(timeout=STUCK_S)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        if code == 0:
            break
        if code != -signal.SIGKILL:
            return killed, f"it ended with {code}: {(at / 'errors').read_text()[-300:]}"
    stored = _rows(store)
    lost = [key for key, was in acknowledged.items() if stored.get(key) != was]
    if lost or len(stored) != RUNS:
        return killed, f"{len(lost)} of {len(acknowledged)} rows lost or changed, {len(stored)} stored"
    subprocess.run([*COMMAND, "b.csv", "--workers", "1"], cwd=at, check=True, capture_output=True)
    if (at / "a.csv").read_bytes() != (at / "b.csv").read_bytes():
        return killed, "its table is not that of the study run at once"
    if not _wait(lambda: not any(_began(pid) == began for pid, began in orphans), GONE_IN_S):
        return killed, "processes are left over"
    return killed, ""


def _kill(process: subprocess.Popen[bytes], rng: np.random.Generator) -> str:
    """Kill a worker, the study, or all of its processes; which."""
    workers = [pid for pid, _ in _below(process.pid) if _is_worker(pid)]
    victim = ("worker", "study", "study and workers")[int(rng.integers(3))]
    if victim == "worker" and workers:
        os.kill(workers[int(rng.integers(len(workers)))], signal.SIGKILL)
        return victim
    if victim == "study":
        process.kill()
    else:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return "study" if victim == "study" else "study and workers"


def _has_rows(process: subprocess.Popen[bytes], path: Path, count: int) -> bool:
    return process.poll() is not None or len(_rows(path)) >= count


def _wait(done: Callable[[], bool], seconds: float = STUCK_S) -> bool:
    """Whether it was done in time."""
    until = time.monotonic() + seconds
    while not done() and time.monotonic() < until:
        time.sleep(0.02)
    return done()


def _rows(path: Path) -> dict[str, str]:
    """The digest of every row that a reader finds, by its key; none before there is a store."""
    if not path.exists():
        return {}
    try:
        with Store.open(path, writable=False) as store:
            return {row.key: digest(row) for row in store.rows().values()}
    except LampyrisError as error:
        if error.code == "STORE_READ":
            return {}
        raise


def _began(pid: int) -> str | None:
    """When a process began, for numbers are given again; None: it is not there, or is dead already."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return None if words[0] in "ZX" else words[19]


def _below(pid: int) -> list[tuple[int, str]]:
    """All processes that a process began, and those that they did, with when they began."""
    found: list[tuple[int, str]] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            for child in map(int, task.read_text().split()):
                if (began := _began(child)) is not None:
                    found += [(child, began), *_below(child)]
    return found


def _is_worker(pid: int) -> bool:
    """Whether a process does jobs; the others look after what processes share."""
    try:
        return b"popen_loky" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def _run(ask: Ask, part: Part) -> Outcome:
    if part.kind == "random":
        return judged(part, partial(_random, ask))
    tally = Tally(part)
    for number in part.numbers:
        with folder() as at:
            try:
                properties, wrong = _command(ask, number, at)
                tally.case(*properties)
            except Exception as fault:
                wrong = f"{type(fault).__name__}: {fault!s:.300}"
        if wrong:
            tally.fail(number, wrong)
    return tally.outcome()


CHECK = Check(
    "kill",
    ("G16",),
    "a study killed at any time loses no acknowledged result and ends with the same bytes",
    KINDS,
    _run,
)
