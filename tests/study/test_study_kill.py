"""A study that is killed, and whose workers are, loses nothing that was acknowledged."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import study_hands as hands

from lampyris.study.batches import Batch, Batches

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
study_kill = pytest.importorskip("study_kill", reason="the tools are not part of a wheel")
pytestmark = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="finds workers in /proc")


def check(folder: Path, kills: int, seed: int, workers: int) -> None:
    found = study_kill.Hunt(folder, kills, seed, workers).all()
    told = study_kill.told(found, seed)
    print(told)
    assert found.failures == 0, told
    assert found.kills.total() == kills, told
    assert 0 < found.acknowledged <= found.runs, told
    for who in ("study", "worker"):
        assert found.kills[who] > 0, told


def test_nothing_is_lost_in_six_kills(tmp_path: Path) -> None:
    check(tmp_path, 6, 2, 2)


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
def test_nothing_is_lost_in_fifty_kills(tmp_path: Path) -> None:
    check(tmp_path, 50, 0, 2)


def test_a_lost_row_a_changed_one_and_one_stored_twice_are_seen(tmp_path: Path) -> None:
    """Without this the test above might see nothing at all."""
    hunt = study_kill.Hunt(tmp_path, 0, 0, 1)
    found = hunt.all()
    assert found.failures == 0, study_kill.told(found, 0)
    lines = hunt.log.read_text().split("\n")
    first = next(line for line in lines if line)
    hunt.log.write_text("\n".join([*lines, f"{'0' * 64} {'0' * 64} .", "torn off"]) + "\n")
    hunt._compare()
    assert (hunt.found.lost, hunt.found.twice, hunt.found.identical) == (1, 0, True)
    key, _, _ = first.split(" ")
    hunt.log.write_text("\n".join([*lines, f"{key} {'0' * 64} ."]) + "\n")
    hunt._compare()
    assert (hunt.found.lost, hunt.found.twice, hunt.found.identical) == (1, 1, True)
