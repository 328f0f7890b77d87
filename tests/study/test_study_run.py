"""Running a study: the same rows from one process, several, in any order, and whatever the workers do."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
import study_hands as hands

from lampyris.errors import LampyrisError, SettingError, UsageError
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Job, Study, StudyMap, StudyTraffic, canonical
from lampyris.study.execution import batches as batching
from lampyris.study.execution import run as running
from lampyris.study.execution.batches import Batch, Batches, Letters, shuffled
from lampyris.study.execution.execution import Execution, Finished, Progress
from lampyris.study.execution.pool import Processes
from lampyris.study.execution.run import results_of, run

HERE = Path(__file__).resolve().parent


def ran(study: Study, work: Any = hands.work, **more: Any) -> tuple[dict[str, Row], Finished]:
    """The rows of a study by key, each of them once."""
    rows: list[Row] = []
    finished = run(study, rows.extend, _work=work, _judge=hands.Judge(), **more)
    assert len(rows) == finished.ran
    by_key = {row.key: row for row in rows}
    assert len(by_key) == len(rows), "a row came twice"
    return by_key, finished


@pytest.fixture
def trouble(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder where workers of all processes count."""
    monkeypatch.setattr("lampyris.study.execution.pool._warm", [])  # those know another environment
    monkeypatch.setenv(hands.TROUBLE, str(tmp_path))
    return tmp_path


# ---- the same rows --------------------


@pytest.mark.commit(2)
@pytest.mark.parametrize(
    "where",
    [Execution(2), Execution(4), Execution(shuffle=1), Execution(2, shuffle=2)],
    ids=["2", "4", "shuffled", "2 shuffled"],
)
def test_rows_are_the_same_wherever_and_in_whatever_order(where: Execution) -> None:
    study = hands.study_of(30)
    straight, finished = ran(study)
    assert set(straight) == {job.key for job in study.jobs()}
    assert (finished.total, finished.before, finished.ran) == (480, 0, 480)
    assert ran(study, where=where)[0] == straight


@pytest.mark.nightly
def test_shuffled_is_another_order_with_nothing_lost() -> None:
    jobs = list(hands.study_of(400).jobs())
    assert len(jobs) > batching.WINDOW
    drawn = list(shuffled(iter(jobs), 7))
    assert [job.index for job in drawn] != [job.index for job in jobs]
    assert sorted(job.index for job in drawn) == list(range(len(jobs)))
    assert [job.index for job in shuffled(iter(jobs), 7)] == [job.index for job in drawn]


def test_what_is_done_is_not_asked_again() -> None:
    study = hands.study_of(10)
    every, _ = ran(study)
    done = sorted(every)[:97]
    for kind in (list, set, dict.fromkeys):
        rest, finished = ran(study, done=kind(done))
        assert set(rest) == set(every) - set(done)
        assert (finished.total, finished.before, finished.ran) == (160, 97, 63)
    nothing, finished = ran(study, hands.raises, done=set(every), where=Execution(2))
    assert not nothing
    assert finished.before == finished.total == 160


def test_equal_settings_under_two_labels_are_one_run() -> None:
    study = hands.study_of(3)
    twice = Study(
        "twice", "simulate", (*study.worlds, study.worlds[1]),
        (Config("a"), Config("b", {"n": 1}), Config("b", {"n": 1}, "again"), Config("b", {"n": 1}, "guest", "g 1.0")),
        (Config("law"), Config("law", label="other name")),
        traffic_cases=(StudyTraffic(), StudyTraffic("random-walk", 3), StudyTraffic()),
        seeds=(0, 1, 2),
    )  # fmt: skip
    keys = {job.key for job in twice.jobs()}
    assert len(twice) == 5 * 3 * 3 * 4 * 2
    rows, finished = ran(twice)
    assert set(rows) == keys
    assert finished.total == len(keys) == 4 * 2 * 3 * 3


def test_workers_are_other_processes_with_one_thread_each() -> None:
    rows, _ = ran(hands.study_of(5), hands.stranger, where=Execution(2))
    pids = {row.metrics["pid"] for row in rows.values()}
    assert len(pids) == 2
    assert os.getpid() not in pids
    assert {row.metrics["threads"] for row in rows.values()} == {"1"}


# ---- nothing more is held than is worked on --------------------


@pytest.mark.nightly
def test_jobs_unfold_as_they_are_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    study = hands.study_of(100_000, maps=1)
    unfolded, stored = 0, 0
    every = Study.jobs

    def counted(self: Study) -> Iterator[Job]:
        nonlocal unfolded
        for job in every(self):
            unfolded += 1
            yield job

    class Enough(Exception):
        pass

    def sink(rows: Sequence[Row]) -> None:
        nonlocal stored
        stored += len(rows)
        assert unfolded - stored <= 2 * batching.MAX_JOBS + 1
        if stored > 3000:
            raise Enough

    monkeypatch.setattr(Study, "jobs", counted)
    monkeypatch.setattr(running, "EVERY", 0.0)
    with pytest.raises(Enough):
        run(study, sink, _work=hands.work, _judge=hands.Judge())
    assert len(study) == 800_000
    assert 3000 < stored <= unfolded < 10_000


def test_batches_grow_to_their_time_and_shrink_towards_the_end() -> None:
    sizes: list[int] = []
    made = Batches(hands.study_of(250), (), 2, None)
    while (batch := made.take()) is not None:
        sizes.append(len(batch.jobs))
        made.learn(len(batch.jobs), 0.01 * len(batch.jobs))
    assert sum(sizes) == 4000
    assert sizes[:6] == [1, 2, 4, 8, 16, 32]
    assert max(sizes) <= 50
    assert sizes[-1] == 1
    assert all(a >= b for a, b in zip(sizes[-8:], sizes[-7:], strict=False))


def test_a_slow_first_job_is_soon_forgotten_and_slow_jobs_go_alone() -> None:
    made = Batches(hands.study_of(250), (), 1, None)
    made.learn(1, 5.0)
    assert len((made.take() or Batch(())).jobs) == 1
    for _ in range(4):
        made.learn(1, 0.001)
    assert len((made.take() or Batch(())).jobs) >= 16
    for _ in range(8):
        made.learn(1, 60.0)
    assert len((made.take() or Batch(())).jobs) == 1


def test_jobs_of_one_world_stay_together() -> None:
    study = hands.study_of(25, maps=4)
    assert len(study) == 8 * 100
    made = Batches(study, (), 1, None)
    for _ in range(8):
        made.learn(60, 0.5)
    batches = list(iter(made.take, None))
    assert [len(batch.jobs) for batch in batches] == [60, 40] * 8
    assert all(len({batching._world(job) for job in batch.jobs}) == 1 for batch in batches)


# ---- workers that do not do as they should --------------------


@pytest.mark.nightly
def test_a_job_that_kills_its_worker_is_a_row_and_the_others_go_on(trouble: Path) -> None:
    study = hands.study_of(4)
    killers = {job.key for job in study.jobs() if hands.marked(job.plain)}
    assert 1 <= len(killers) <= 4
    rows, finished = ran(study, hands.dies_of_marked, where=Execution(2))
    assert {key for key, row in rows.items() if row.ending == "failed"} == killers
    assert all(rows[key].error.startswith("WORKER_DIED: ") for key in killers)
    assert finished.failed == len(killers)
    assert finished.died >= running.MAX_DEATHS * len(killers)
    straight, _ = ran(study)
    assert {k: r for k, r in rows.items() if k not in killers} == {
        k: r for k, r in straight.items() if k not in killers
    }


def test_a_job_of_which_a_worker_died_waits_until_nothing_else_is_left() -> None:
    """Or a worker that somebody kills while it starts is counted against it a second time."""
    study = hands.study_of(2)
    made = Batches(study, (), 2, None)
    first = made.take()
    assert first is not None
    made.at_last(Batch(first.jobs, 1))
    others = []
    while (batch := made.take()) is not None and not batch.deaths:
        others += batch.jobs
        if len(others) == 5:
            made.again([Batch(others[:1])])
            assert made.take() is not None
    assert len(others) == len(study) - 1
    assert batch is not None
    assert (batch.jobs, batch.deaths, made.more) == (first.jobs, 1, False)


@pytest.mark.nightly
def test_workers_that_die_of_something_else_cost_no_row(trouble: Path) -> None:
    study = hands.study_of(30)
    rows, finished = ran(study, hands.dies_five_times, where=Execution(2))
    assert finished.died == 5
    assert rows == ran(study)[0]


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    "work", [hands.garbage_at_first, hands.leaves_out_at_first], ids=["garbage", "too few"]
)
@pytest.mark.parametrize("workers", [1, 2])
def test_an_answer_that_cannot_be_used_is_asked_for_again(trouble: Path, work: Any, workers: int) -> None:
    study = hands.study_of(30)
    rows, _ = ran(study, work, where=Execution(workers))
    assert rows == ran(study)[0]
    assert list(trouble.iterdir()), "no answer was spoilt"


@pytest.mark.parametrize("work", [hands.other_key, hands.other_number], ids=["key", "number"])
def test_a_job_that_is_never_answered_for_fails_alone(work: Any) -> None:
    study = hands.study_of(10)
    marked = {job.key for job in study.jobs() if hands.marked(job.plain)}
    rows, finished = ran(study, work)
    assert {key for key, row in rows.items() if row.ending == "failed"} == marked
    assert all(rows[key].error.startswith("WORKER_ANSWER: ") for key in marked)
    assert finished.failed == len(marked) > 0


def test_the_row_of_another_job_is_none_of_this_one() -> None:
    class Confused(hands.Judge):
        def row(self, job: Job, result: Mapping[str, Any], ground: StudyMap) -> Row:
            right = super().row(job, result, ground)
            return replace(right, key="f" * 64) if hands.marked(job.plain) else right

    study, rows = hands.study_of(10), list[Row]()
    finished = run(study, rows.extend, _work=hands.work, _judge=Confused())
    assert {row.key for row in rows} == {job.key for job in study.jobs()}
    assert finished.failed == sum(hands.marked(job.plain) for job in study.jobs()) > 0


@pytest.mark.parametrize("workers", [1, 2])
def test_workers_without_one_usable_answer_end_the_study_and_store_nothing(workers: int) -> None:
    rows: list[Row] = []
    with pytest.raises(LampyrisError, match="a worker with a fault") as caught:
        run(hands.study_of(), rows.extend, where=Execution(workers), _work=hands.raises, _judge=hands.Judge())
    assert caught.value.code == "WORKER_ANSWER"
    assert not rows


def test_a_small_study_without_one_usable_answer_has_its_rows() -> None:
    study = Study("s", "plan", hands.study_of().worlds[:1], (Config("a"),), (Config("law"),))
    rows, finished = ran(study, hands.raises)
    assert finished.failed == len(rows) == 1


@pytest.mark.nightly
def test_processes_that_cannot_start_are_a_typed_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lampyris.study.execution.pool._warm", [])
    monkeypatch.setattr("lampyris.study.execution.pool.begin", hands.dies_at_once)
    with pytest.raises(LampyrisError) as caught:
        run(hands.study_of(), list, where=Execution(2), _work=hands.work, _judge=hands.Judge())
    assert caught.value.code == "WORKER_START"


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff",
        b"{}",
        b"[]",
        b"null",
        b'{"results": {}}',
        b'{"results": [1, null, [], {"key": []}]}',
        b"[" * 9999,
    ],
)
def test_garbage_is_no_result(data: bytes) -> None:
    batch = Batch(tuple(islice(hands.study_of().jobs(), 4)))
    assert results_of(data, batch) == [None] * 4


def test_an_answer_of_more_bytes_than_any_honest_one_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """One of a gigabyte took several of memory before it was refused."""
    jobs = tuple(hands.study_of().jobs())[:1]
    answer = canonical({"results": [{"key": jobs[0].key, "more": "x" * 1000}]})
    assert results_of(answer, Batch(jobs)) != [None]
    monkeypatch.setattr(running, "MAX_ANSWER", 1000)
    monkeypatch.setattr(running.json, "loads", None)
    assert results_of(answer, Batch(jobs)) == [None]


def test_results_are_found_by_key_and_no_more_than_were_asked() -> None:
    batch = Batch(tuple(islice(hands.study_of().jobs(), 3)))
    results = [hands.one(job.plain) for job in batch.jobs]
    assert results_of(canonical({"results": results[::-1]}), batch) == results
    assert results_of(canonical({"results": results[1:]}), batch) == [None, *results[1:]]
    assert results_of(canonical({"results": [*results, results[0]]}), batch) == [None] * 3


@pytest.mark.nightly
@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_processes_that_are_stopped_right_after_they_were_asked_end_quietly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("lampyris.study.execution.pool._warm", [])
    study = hands.study_of(10)
    letters = Letters(study.grounds, False)
    before = set(threading.enumerate())
    for wait in (False, True, True):
        made, pools = Batches(study, (), 2, None), Processes(hands.slow, 2)
        while wait and pools.workers < 2:
            assert pools.answers(0.1) == []
        for _ in range(3):
            batch = made.take()
            assert batch is not None
            pools.ask(batch, letters(batch))
        pools.stop(True)
    for thread in set(threading.enumerate()) - before:
        thread.join(20)
        assert not thread.is_alive()


# ---- the sink, and what is told --------------------


@pytest.mark.parametrize("workers", [1, 2])
def test_a_sink_that_raises_ends_the_study_and_is_not_called_again(workers: int) -> None:
    calls = 0

    def full(rows: Sequence[Row]) -> None:
        nonlocal calls
        calls += 1
        raise OSError("no space left")

    with pytest.raises(OSError, match="no space left"):
        run(hands.study_of(50), full, where=Execution(workers), _work=hands.slow, _judge=hands.Judge())
    assert calls == 1


@pytest.mark.nightly
def test_a_sink_that_ctrl_c_hit_gets_its_rows_again() -> None:
    given: list[list[Row]] = []

    def hit(rows: Sequence[Row]) -> None:
        given.append(list(rows))
        if len(given) == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(hands.study_of(50), hit, _work=hands.slow, _judge=hands.Judge())
    assert len(given) == 2
    assert given[0] == given[1]


@pytest.mark.parametrize("workers", [1, 2])
def test_progress_tells_every_row_once_and_ends_complete(workers: int) -> None:
    study = hands.study_of(10)
    told: list[Progress] = []
    done = {job.key for job in islice(study.jobs(), 30)}
    rows, _ = ran(study, hands.slow, done=done, where=Execution(workers), progress=told.append)
    assert [p.done for p in told] == sorted(p.done for p in told)
    assert (told[0].done, told[-1].done, told[-1].total) == (30, 160, 160)
    assert told[-1].seconds_left == 0
    assert Counter(row.key for p in told for row in p.rows) == Counter(rows.keys())
    assert any(p.workers == workers for p in told)
    assert len(told) > 3


@pytest.mark.parametrize("workers", [0, -1, 10_000])
def test_a_number_of_workers_out_of_range_is_refused(workers: int) -> None:
    with pytest.raises(SettingError):
        Execution(workers)


def test_an_address_that_is_none_is_refused() -> None:
    with pytest.raises(UsageError):
        Execution(dask="localhost")
    with pytest.raises(SettingError):
        Execution(shuffle=-1)


# ---- ends from outside --------------------

SCRIPT = """
import json, signal, sys
from lampyris.study.execution.run import run
from lampyris.study.execution.execution import Execution
import study_hands as hands
# A suite in the background hands down that it is ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
def sink(rows):
    for row in rows:
        print(row.key, row.metrics["pid"], flush=True)
try:
    run(hands.study_of(500), sink, where=Execution(int(sys.argv[1])), _work=hands.stranger, _judge=hands.Judge())
except KeyboardInterrupt:
    print("stopped", flush=True)
    sys.exit(130)
"""


def begun(workers: int) -> tuple[subprocess.Popen[bytes], list[str]]:
    """A study in a process group of its own, from which the first rows came."""
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(workers)], cwd=HERE, start_new_session=True, bufsize=0,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    # No buffer: what it reads ahead of a line, communicate would never see; it would begin amid another.
    assert process.stdout is not None
    first = []
    while len({line.split()[1] for line in first}) < workers:
        first.append(process.stdout.readline().decode())
        assert first[-1], process.communicate()[1]
    return process, first


def gone(pids: set[int]) -> bool:
    """Whether these processes end within 20 s."""
    for _ in range(200):
        if not any(map(alive, pids)):
            return True
        time.sleep(0.1)
    return False


def alive(pid: int) -> bool:
    """Whether a process runs. One that ended and that nobody has asked for yet does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="there is no /proc here")


@pytest.mark.commit(1)
@needs_proc
@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_keeps_what_was_done(workers: int) -> None:
    process, lines = begun(workers)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=30)
    lines += out.decode().splitlines()
    assert process.returncode == 130, err
    assert not err
    assert lines[-1] == "stopped"
    keys = [line.split()[0] for line in lines[:-1]]
    assert 0 < len(set(keys)) == len(keys) < 8000
    assert gone({int(line.split()[1]) for line in lines[:-1]})


@needs_proc
def test_workers_do_not_outlive_a_parent_that_was_killed() -> None:
    process, lines = begun(2)
    process.kill()
    out, _ = process.communicate(timeout=30)
    lines += [line for line in out.decode().splitlines() if len(line.split()) == 2]
    assert gone({int(line.split()[1]) for line in lines})


@pytest.mark.nightly
def test_processes_that_are_kept_warm_are_let_go_of_without_a_word() -> None:
    words = ["selfcheck", "determinism", "--only", "studies", "--cases", "1"]
    done = subprocess.run(
        [sys.executable, "-m", "lampyris", *words], capture_output=True, text=True, check=True
    )
    assert "Exception ignored" not in done.stderr


def test_ctrl_c_in_a_function_that_c_calls_comes_after_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """LLVM calls one while code is loaded; Python cannot raise there, and Ctrl-C was lost."""
    import ctypes
    import signal

    from lampyris.study.execution.run import _Calm

    monkeypatch.setattr("sys.unraisablehook", lambda lost: None)
    went_on: list[bool] = []

    def answers() -> None:
        with _Calm(True) as calm:
            with calm.waiting():
                ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()
            went_on.append(True)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            answers()
    finally:
        signal.signal(signal.SIGINT, before)
    assert went_on
