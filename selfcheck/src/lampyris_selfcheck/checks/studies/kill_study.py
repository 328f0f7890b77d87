"""A study that is killed at drawn moments, itself or one of its workers, as it is used: by its command.

The study runs as ``lampyris study`` in a process group of its own. Whenever its store has said that rows are
there, their keys and contents are written to a log beside it and synced: that is what was acknowledged. Then
SIGKILL hits the process, or all of the group, or a worker, and the study goes on, until it has been killed so
often; at last it is left to end. Needs Linux: workers are found in /proc.
"""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lampyris_selfcheck.check import Tally
from lampyris_selfcheck.checks.studies import sittings as _sittings
from lampyris_selfcheck.checks.studies.sitting_child import digest
from lampyris_selfcheck.checks.studies.sittings import acknowledged
from lampyris_selfcheck.scratch import folder

KILLS, WORKERS = 3, 2
JOBS_A_KILL = 40
"""Runs of the study for each kill: it must not end before it was killed so often."""
GONE_IN = 20.0
"""Seconds in which the workers of a killed study must have ended by themselves."""
STUCK = 300.0
"""Seconds without a sign of life that end the test."""

LINE = 132
"""Bytes of the log for each run."""

STUDY = """
version: 1
name: killed
preset: dissertation
maps:
  - {{bundled: guide, limit: 1}}
  - {{bundled: rooms-20, queries: {{random: 1, least: 12}}}}
planners:
  - {{name: ad-gso, grid: {{choice: [greedy, roulette]}}}}
  - astar
traffic:
  - {{kind: random-walk, count: 5, grid: {{tracks: [live, replayed]}}}}
  - {{kind: random-walk, count: 77}}
seeds: {seeds}
"""
"""18 runs a seed; among 77 walkers they are refused."""

Process = tuple[int, str]
"""A process and when it began: numbers are given again."""


@dataclass
class KillResult:
    """What came of it."""

    kills: Counter[str] = field(default_factory=Counter)
    sittings: int = 0
    acknowledged: int = 0
    lost: int = 0
    twice: int = 0
    runs: int = 0
    identical: bool = False
    left_over: int = 0
    seconds: float = 0.0
    words: list[str] = field(default_factory=list)

    @property
    def failures(self) -> int:
        """How much is not as it should be."""
        return self.lost + self.twice + (not self.identical) + self.left_over + len(self.words)


def began(pid: int) -> str | None:
    """When a process began; None: it is not there, or is dead already."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return None if words[0] in "ZX" else words[19]


def below(pid: int) -> list[Process]:
    """All processes that a process began, and those that they did."""
    found: list[Process] = []
    ahead = [pid]
    while ahead:
        parent = ahead.pop()
        for task in Path(f"/proc/{parent}/task").glob("*/children"):
            try:
                children = [int(word) for word in task.read_text().split()]
            except OSError:
                continue
            ahead += children
            found += [(child, at) for child in children if (at := began(child)) is not None]
    return sorted(set(found))


def is_worker(pid: int) -> bool:
    """Whether a process does jobs; the others look after what processes share."""
    try:
        return b"popen_loky" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


class Hunt:
    """One study that is killed ``kills`` times.

    Parameters
    ----------
    folder : where its files go.
    kills : how often. seed : of the moments. workers : processes that do the work.
    """

    def __init__(self, folder: Path, kills: int, seed: int, workers: int) -> None:
        self.file, self.store, self.log = (folder / f"killed.{end}" for end in ("yaml", "db", "log"))
        seeds = max(-(-kills * JOBS_A_KILL // 18), 1)
        self.file.write_text(STUDY.format(seeds=seeds))
        self.wanted, self.workers, self.total = kills, workers, 18 * seeds
        self.rng = np.random.default_rng(seed)
        self.found = KillResult()
        self._alone: list[Process] = []

    def sitting(self) -> bool:
        """Start the study and kill it, and workers of it, as often as wanted; whether it came to its end."""
        words = ("study", "run", self.file, "--store", self.store, "--workers", self.workers)
        child = (sys.executable, *_sittings.CHILD, "--command", self.log)
        self.found.sittings += 1
        with open(self.log.with_suffix(".err"), "ab") as errors:
            process = subprocess.Popen(
                [str(word) for word in (*child, *words)], stdout=subprocess.DEVNULL, stderr=errors,
                cwd=self.log.parent, start_new_session=True,
            )  # fmt: skip
        try:
            while self.found.kills.total() < self.wanted:
                if self._wait(process) is not None:
                    break
                workers = self._workers(process)
                if workers:
                    os.kill(workers[int(self.rng.integers(len(workers)))][0], signal.SIGKILL)
                    self.found.kills["worker"] += 1
                    continue
                self._alone += below(process.pid)
                who = "study and workers" if self.rng.random() < 0.5 else "study"
                if who == "study":
                    process.kill()
                else:
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                self.found.kills[who] += 1
                return False
            code = process.wait(timeout=STUCK)
        finally:
            process.kill()
            process.wait()
        if code != 0:
            self.found.words.append(f"sitting {self.found.sittings} ended with {code}")
        return True

    def _workers(self, process: subprocess.Popen[bytes]) -> list[Process]:
        """Workers of which one is to be killed; none: the study itself is."""
        found: list[Process] = []
        if self.workers > 1 and self.rng.random() < 0.5:
            until = time.monotonic() + STUCK
            while not found and process.poll() is None and time.monotonic() < until:
                found = [p for p in below(process.pid) if is_worker(p[0])]
        return found

    def _wait(self, process: subprocess.Popen[bytes]) -> int | None:
        """Until the next kill: mostly a random while after rows were stored, sometimes after anything."""
        size, pause = self._logged(), 3.0
        if self.rng.random() < 0.8:
            pause = 0.5
            until = time.monotonic() + STUCK
            while self._logged() == size and process.poll() is None and time.monotonic() < until:
                time.sleep(0.002)
        until = time.monotonic() + float(self.rng.random()) * pause
        # Nor after more runs than are drawn: on a quick machine the study would end before the last kill.
        latest = self.total - JOBS_A_KILL * (self.wanted - self.found.kills.total()) + JOBS_A_KILL // 2
        now = self._logged() // LINE
        row = now + int(self.rng.integers(1, max(2, latest - now)))
        while process.poll() is None and time.monotonic() < until and self._logged() < row * LINE:
            time.sleep(0.002)
        return process.poll()

    def _logged(self) -> int:
        return self.log.stat().st_size if self.log.exists() else 0

    def all(self) -> KillResult:
        """The whole test."""
        began_at = time.perf_counter()
        while not self.sitting():
            pass
        found = self.found
        if found.kills.total() < self.wanted:
            found.words.append(f"it ended after {found.kills.total()} kills")
        if not found.words:
            self._compare()
        until = time.monotonic() + GONE_IN
        while (left := [p for p, at in self._alone if began(p) == at]) and time.monotonic() < until:
            time.sleep(0.1)
        found.left_over = len(left)
        found.seconds = time.perf_counter() - began_at
        return found

    def _compare(self) -> None:
        """The store beside the log and beside the same study run at once."""
        from lampyris.study.analysis.export import write_csv
        from lampyris.study.analysis.table import table_of
        from lampyris.study.design.study_file import load_study
        from lampyris.study.execution.run import run
        from lampyris.study.store.store import Store

        found, study = self.found, load_study(self.file)
        with Store.open(self.store, writable=False) as store:
            rows = store.rows()
        logged, again = acknowledged(self.log)
        found.acknowledged = len(logged)
        found.lost = sum(key not in rows or digest(rows[key]) != said for key, said in logged.items())
        connection = sqlite3.connect(self.store)
        try:
            stored, keys = connection.execute("SELECT COUNT(key), COUNT(DISTINCT key) FROM runs").fetchone()
        finally:
            connection.close()
        found.runs, found.twice = stored, again + stored - keys
        fresh: list[Any] = []
        run(study, fresh.extend)
        files = [self.log.with_suffix(f".{name}.csv") for name in ("killed", "whole")]
        write_csv(files[0], table_of(study, rows))
        write_csv(files[1], table_of(study, {row.key: row for row in fresh}))
        found.identical = files[0].read_bytes() == files[1].read_bytes() and stored == len(study)


def hunted(tally: Tally, number: int, seed: int) -> None:
    """One study that is killed :data:`KILLS` times, as a case of the check."""
    with folder() as at:
        try:
            found = Hunt(at, KILLS, seed, WORKERS).all()
        except Exception as fault:
            tally.case()
            tally.fail(number, f"{type(fault).__name__}: {fault!s:.300}", seed=seed)
            return
    tally.case(*(f"{who} killed" for who in found.kills))
    tally.count("kills", found.kills.total())
    tally.count("acknowledged rows", found.acknowledged)
    if found.failures:
        tally.fail(number, told(found), seed=seed)


def told(found: KillResult) -> str:
    """What came of it."""
    return (
        f"acknowledged {found.acknowledged}, lost or changed {found.lost}, stored twice {found.twice}, "
        f"bytes {'the same' if found.identical else 'others'}, processes left over {found.left_over}"
        f"{''.join(f'; {word}' for word in found.words)}"
    )
