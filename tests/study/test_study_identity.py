"""The exported bytes of a study are the same on a cluster, one of whose workers is lost.

Workers of this machine, other orders and sittings are the check ``determinism`` of lampyris_selfcheck.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from lampyris.study.design.row import Row
from lampyris.study.design.study import Study
from lampyris.study.execution.execution import Execution, Progress
from lampyris.study.execution.run import run
from lampyris.study.store.store import Store
from lampyris_selfcheck.checks.studies import small_studies as study_small

pytestmark = pytest.mark.nightly

KINDS = tuple(study_small.TEXTS)


@cache
def study(kind: str, seeds: int = 1) -> Study:
    return study_small.study(kind, seeds)


@cache
def known(kind: str, seeds: int = 1) -> bytes:
    """The bytes of one sitting in this process."""
    rows: list[Row] = []
    finished = run(study(kind, seeds), rows.extend)
    assert finished.ran == finished.total == len(rows)
    return study_small.exported(study(kind, seeds), {row.key: row for row in rows})


def test_the_studies_have_every_ending_and_outcome_that_does_not_hang_on_a_clock() -> None:
    words = b"".join(known(kind) for kind in KINDS)
    for word in (b"arrived", b"found", b"no-path", b"limit", b"hit", b"refused,OBSTACLE_ROOM"):
        assert word in words, word
    assert b"failed" not in words, "a result that our own referee refuses"


# ---- on a cluster --------------------


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A Dask scheduler and two workers, processes of their own on loopback."""
    pytest.importorskip("distributed")
    told = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    work = [sys.executable, "-m", "distributed.cli.dask_worker"]
    begun = [
        subprocess.Popen(
            [*dask, "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(told)],
            cwd=tmp_path, **quiet,
        )
    ]  # fmt: skip
    try:
        while not told.exists():
            assert begun[0].poll() is None, "the scheduler does not start"
            time.sleep(0.1)
        begun += [
            subprocess.Popen(
                [*work, "--scheduler-file", str(told), "--no-nanny", "--nthreads", "1", "--no-dashboard",
                 "--local-directory", str(tmp_path / f"worker-{k}")],
                cwd=tmp_path, **quiet,
            )
            for k in range(2)
        ]  # fmt: skip
        import json

        yield json.loads(told.read_text())["address"], begun[1:]
    finally:
        for process in reversed(begun):
            process.kill()
            process.wait()


@pytest.mark.parametrize("kind", KINDS)
def test_a_cluster_does_not_show(
    kind: str, cluster: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    """One of the two workers is killed midway."""
    address, workers = cluster
    seeds = 4
    made, path = study(kind, seeds), tmp_path / "s.db"
    killed_at: list[int] = []

    def kill(progress: Progress) -> None:
        if not killed_at and progress.done >= progress.total // 4:
            workers[0].send_signal(signal.SIGKILL)
            killed_at.append(progress.done)

    with Store.create(path, made) as store:
        finished = run(made, store.add, where=Execution(dask=address), progress=kill)
        assert study_small.exported(made, store.rows()) == known(kind, seeds)
    assert finished.ran == finished.total
    assert 0 < killed_at[0] < finished.total
