"""The exported bytes of a study are the same wherever and in whatever order it was run, at once or not."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest
import study_small

from lampyris.study.design import Study
from lampyris.study.row import Row
from lampyris.study.run import run
from lampyris.study.store import Store
from lampyris.study.where import Progress, Where

HERE = Path(__file__).resolve().parent
KINDS = tuple(study_small.TEXTS)


class Enough(Exception):
    """Raised by a sink that takes no more."""


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


def through_store(made: Study, path: Path, where: Where) -> bytes:
    """Runs what the store has not; the bytes of all that it has then."""
    store = Store.open(path) if path.exists() else Store.create(path, made)
    with store:
        run(made, store.add, done=store.keys(), where=where)
        return study_small.exported(made, store.rows())


def test_the_studies_have_every_ending_and_outcome_that_does_not_hang_on_a_clock() -> None:
    words = b"".join(known(kind) for kind in KINDS)
    for word in (b"arrived", b"found", b"no-path", b"limit", b"hit", b"refused,OBSTACLE_ROOM"):
        assert word in words, word
    assert b"failed" not in words, "a result that our own referee refuses"


@pytest.mark.parametrize(
    ("kind", "where"),
    [
        ("plan", Where(4)),
        ("plan", Where(2, shuffle=3)),
        ("simulate", Where(2)),
        ("drive", Where(2, shuffle=1)),
    ],
)
def test_workers_and_order_do_not_show(kind: str, where: Where, tmp_path: Path) -> None:
    assert through_store(study(kind), tmp_path / "s.db", where) == known(kind)


@pytest.mark.parametrize("kind", KINDS)
def test_sittings_do_not_show(kind: str, tmp_path: Path) -> None:
    made, path = study(kind), tmp_path / "s.db"
    for sitting in range(3):
        with Store.open(path) if sitting else Store.create(path, made) as store:
            had = len(store)
            left = len(made) // 4

            def sink(rows: Sequence[Row], store: Store = store, stop: int = had + left) -> None:
                store.add(rows[: stop - len(store)])
                if len(store) == stop:
                    raise Enough

            with pytest.raises(Enough):
                run(made, sink, done=store.keys(), where=Where(shuffle=sitting))
            assert had < len(store) < len(made)
            assert study_small.exported(made, store.rows()) != known(kind)
    assert through_store(made, path, Where()) == known(kind)


def test_hashes_of_words_do_not_show() -> None:
    """Sets of words have another order in each process, unless somebody says otherwise."""
    code = (
        "import sys; import study_small as s; from lampyris.study.run import run\n"
        f"for kind in {KINDS!r}:\n"
        "    made, rows = s.study(kind, 1), []\n"
        "    run(made, rows.extend)\n"
        "    sys.stdout.buffer.write(s.exported(made, {row.key: row for row in rows}))\n"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, cwd=HERE,
        env={**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": str(HERE)},
    ).stdout  # fmt: skip
    assert told == b"".join(known(kind) for kind in KINDS)


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


@pytest.mark.nightly
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
        finished = run(made, store.add, where=Where(dask=address), progress=kill)
        assert study_small.exported(made, store.rows()) == known(kind, seeds)
    assert finished.ran == finished.total
    assert 0 < killed_at[0] < finished.total


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("workers", [1, 2, 4])
def test_more_seeds(kind: str, workers: int, tmp_path: Path) -> None:
    made = study(kind, 4)
    assert through_store(made, tmp_path / "a.db", Where(workers, shuffle=workers)) == known(kind, 4)
    assert through_store(made, tmp_path / "b.db", Where(workers)) == known(kind, 4)
