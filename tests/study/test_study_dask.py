"""Studies on a Dask cluster: a scheduler and workers as processes of their own, on this machine's loopback.

Dask runs in other processes only: it warns of much, and warnings are errors here.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import study_hands as hands

import lampyris
from lampyris.errors import UsageError
from lampyris.study.design.study import RESULTS, Study
from lampyris.study.design.study_file import load_study
from lampyris.study.execution import cluster as clustering
from lampyris.study.execution.execution import Execution
from lampyris.study.execution.run import run
from sizes import some

HERE = Path(__file__).resolve().parent
needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="distributed is not installed")

QUIET = {
    "DASK_DISTRIBUTED__ADMIN__LOG_FORMAT": "%(name)s %(message)s",
    "DASK_DISTRIBUTED__WORKER__MULTIPROCESSING_METHOD": "spawn",
    "PYTHONPATH": str(HERE),
    "OMP_NUM_THREADS": "1",
}
if "LAMPYRIS_COVERAGE_OF_CHILDREN" in os.environ:  # `make coverage`: see tools/coverage_rooms.py
    QUIET["COVERAGE_PROCESS_START"] = os.environ["LAMPYRIS_COVERAGE_OF_CHILDREN"]

REAL = """
version: 1
name: real
preset: dissertation
maps: [{bundled: guide, queries: {random: 3}}]
planners: [ad-gso, astar]
traffic: [none, {kind: random-walk, count: 3}]
seeds: 4
"""

SCRIPT = """
import json, os, signal, sys
from lampyris.errors import LampyrisError
from lampyris.study.execution import cluster
from lampyris.study.design.study_file import load_study
from lampyris.study.execution.run import run
from lampyris.study.execution.execution import Execution
import study_hands as hands
asked = json.loads(sys.argv[1])
cluster.ANSWERS_IN = asked.get("answers_in", 10.0)
rows = []
def sink(found):
    rows.extend(found)
    if asked.get("kill") and len(rows) >= 40:
        os.kill(asked.pop("kill"), signal.SIGKILL)
ours = {"_work": getattr(hands, asked.get("work", "slow")), "_judge": hands.Judge()}
study = load_study(asked["file"]) if "file" in asked else hands.study_of(15)
out = {}
try:
    finished = run(study, sink, where=Execution(dask=asked["dask"], shuffle=asked.get("shuffle")),
                   **({} if "file" in asked else ours))
    out["died"] = finished.died
except LampyrisError as fault:
    out["code"], out["words"] = fault.code, str(fault)
out["rows"] = [[row.key, row.ending, dict(row.metrics), row.error] for row in rows]
print(json.dumps(out))
"""


@contextmanager
def cluster(workers: int, path: str = "") -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """The address of a scheduler; its process and those of its workers."""
    started: list[subprocess.Popen[str]] = []
    env = {**os.environ, **QUIET}

    def start(*words: str, **more: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", *words, "--host", "127.0.0.1", "--no-dashboard"], cwd=HERE, text=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env={**env, **more},
        )  # fmt: skip
        started.append(process)
        return process

    try:
        lines = []
        for line in start("distributed.cli.dask_scheduler", "--port", "0").stderr or ():
            lines.append(line)
            if "Scheduler at:" in line:
                break
        else:
            raise AssertionError("".join(lines))
        address = lines[-1].split()[-1]
        for _ in range(workers):
            start(
                "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny",
                "--death-timeout", "30", PYTHONPATH=os.pathsep.join([path, str(HERE)]) if path else str(HERE),
            )  # fmt: skip
        yield address, started
    finally:
        for process in started:
            process.kill()
        for process in started:
            process.communicate()


def asked(dask: str, **more: Any) -> dict[str, Any]:
    """What a study on a cluster came to, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps({"dask": dask, **more})], cwd=HERE, text=True,
        capture_output=True, env={**os.environ, **QUIET}, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr, done.stderr
    out: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return out


def here(study: Study, **ours: Any) -> dict[str, list[Any]]:
    """The same rows from this process."""
    rows: list[Any] = []
    run(study, rows.extend, **ours)
    return {
        row.key: json.loads(json.dumps([row.key, row.ending, dict(row.metrics), row.error])) for row in rows
    }


def by_key(out: dict[str, Any]) -> dict[str, list[Any]]:
    """Rows by key, each once."""
    rows = {row[0]: row for row in out["rows"]}
    assert len(rows) == len(out["rows"]), "a row came twice"
    return rows


@pytest.mark.nightly
@needs_dask
def test_a_cluster_gives_the_same_rows_and_so_does_one_that_loses_a_worker(tmp_path: Path) -> None:
    file = tmp_path / "real.yaml"
    file.write_text(REAL)
    with cluster(2) as (address, processes):
        real = asked(address, file=str(file), shuffle=5)
        assert "code" not in real, real
        assert by_key(real) == here(load_study(file))
        assert {row[1] for row in real["rows"]} == {"done"}
        killed = asked(address, kill=processes[1].pid)
        assert processes[1].wait(10) == -signal.SIGKILL
        assert "code" not in killed, killed
        assert by_key(killed) == here(hands.study_of(15), _work=hands.work, _judge=hands.Judge())


@pytest.mark.nightly
@needs_dask
def test_a_scheduler_that_dies_or_that_has_no_workers_is_told() -> None:
    with cluster(1) as (address, processes):
        out = asked(address, kill=processes[0].pid, answers_in=8.0)
    assert out["code"] == "CLUSTER_GONE", out
    assert 40 <= len(by_key(out)) < 240
    out = asked(address, answers_in=1.0)
    assert out["code"] == "CLUSTER_ADDRESS", out
    assert address in out["words"]
    assert "dask scheduler" in out["words"]
    with cluster(0) as (address, _):
        out = asked(address, answers_in=3.0)
    assert out["code"] == "CLUSTER_EMPTY", out
    assert not out["rows"]


@pytest.mark.nightly
@needs_dask
@pytest.mark.parametrize("version", some(["9.9.9", None]), ids=["another", "none"])
def test_a_worker_with_another_version_is_refused(tmp_path: Path, version: str | None) -> None:
    fake = tmp_path / "lampyris"
    fake.mkdir()
    real = str(Path(lampyris.__file__).parent)
    more = "" if version is None else f"__version__ = {version!r}\n__path__.append({real!r})\n"
    (fake / "__init__.py").write_text(more)
    with cluster(1, str(tmp_path)) as (address, _):
        out = asked(address)
    assert out["code"] == "WORKER_VERSION", out
    assert version is None or version in out["words"]
    assert not out["rows"]


def test_an_errand_of_another_version_is_not_done() -> None:
    assert clustering.errand(hands.raises, ["0.0", RESULTS, {}], b"") == clustering.OTHER + repr(
        [lampyris.__version__, RESULTS, {}]
    ).encode("ascii")


@pytest.mark.parametrize(
    ("here", "done"), [("guest 1.0", True), ("guest 2.0", False), ("", False), (None, False)]
)
def test_an_errand_of_a_guest_of_another_version_is_not_done(
    monkeypatch: pytest.MonkeyPatch, here: str | None, done: bool
) -> None:
    def origin(name: str) -> str:
        assert name == "guest-planner"
        if here is None:
            raise UsageError("PLANNER", "no planner is called that")
        return here

    monkeypatch.setattr(clustering, "origin_of", origin)
    expected = [lampyris.__version__, RESULTS, {"guest-planner": "guest 1.0"}]
    answer = clustering.errand(bytes.upper, expected, b"letter")
    assert (answer == b"LETTER") == done
    assert answer.startswith(clustering.OTHER) != done


def test_without_the_package_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clustering, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"pip install 'lampyris\[dask\]'") as caught:
        run(
            hands.study_of(),
            list,
            where=Execution(dask="tcp://127.0.0.1:1"),
            _work=hands.work,
            _judge=hands.Judge(),
        )
    assert caught.value.code == "CLUSTER_MISSING"
