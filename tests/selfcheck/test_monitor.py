"""The check of the monitors: every fault is seen; one that is not seen, or a judge without a rule, makes it fail."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from lampyris.model.trace import Trace
from lampyris.referee import check_drive
from lampyris.referee.verdict import Violation
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.traffic import monitor
from lampyris_selfcheck.checks.traffic import monitor_drives as drives
from lampyris_selfcheck.checks.traffic import monitor_traces as traces
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes
from lampyris_selfcheck.checks.traffic.monitor import CHECK
from lampyris_selfcheck.reference.motion.drive_monitor import watch
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor


def run(kind: str, count: int, first: int = 0) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, cases=count, first=first)).outcome


@pytest.fixture(scope="module")
def wrong_traces() -> list[tuple[str, Trace]]:
    """A trace with each fault in it."""
    found = []
    for number, (name, fault) in enumerate(traces.FAULTS.items()):
        rng = Ask().rng("monitor", "traces", number)
        found.append((name, monitor.spoilt(fault.put, partial(monitor.trace_of, 1), 0, rng)))
    return found


@pytest.mark.parametrize("words", sorted({fault.words for fault in traces.FAULTS.values()}))
def test_a_monitor_that_has_lost_a_rule_fails(
    words: str, wrong_traces: list[tuple[str, Trace]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever else breaks with it does not count."""
    honest = Monitor.faults
    monkeypatch.setattr(
        Monitor, "faults", lambda self: [one for one in honest(self) if not re.search(words, one)]
    )
    mine = [(name, wrong) for name, wrong in wrong_traces if traces.FAULTS[name].words == words]
    assert mine
    assert all("the monitor" in monitor.missed(traces.FAULTS[name], wrong) for name, wrong in mine)


def test_a_referee_that_accepts_all_fails(
    wrong_traces: list[tuple[str, Trace]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(monitor, "check_trace", lambda trace: None)
    for name, wrong in wrong_traces:
        due = ["the referee"] if traces.FAULTS[name].referee else []
        assert monitor.missed(traces.FAULTS[name], wrong) == due


@pytest.mark.nightly
def test_another_rule_of_the_referee_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = Violation("numbers", "trace", "something else")
    monkeypatch.setattr(monitor, "check_drive", lambda run: check_drive(run) and wrong)
    assert run("drives", len(drives.FAULTS)).failed == len(drives.FAULTS)


def test_traces_are_of_every_kind_that_is_judged(wrong_traces: list[tuple[str, Trace]]) -> None:
    scenes_ = [trace.scene for _, trace in wrong_traces]
    assert len({s.moves.name for s in scenes_}) >= 2
    assert any(s.edits for s in scenes_)
    assert any(b.kind == "recorded" for _, trace in wrong_traces for b in trace.obstacle_specs)
    assert any(s.robot.radius > 0 for s in scenes_)


@pytest.mark.nightly
def test_a_fault_that_is_none_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = traces.Fault(lambda trace, rng: replace(trace), "jumps")
    monkeypatch.setattr(traces, "FAULTS", {"nothing": nothing})
    found = [f.what for f in run("traces", 3).failures]
    assert found == ["nothing: not seen by the monitor, the referee"] * 3
    monkeypatch.setattr(traces, "FAULTS", {"never": replace(nothing, put=lambda trace, rng: None)})
    assert run("traces", 1).failures[0].what == "never: no occasion in 150 runs"


@pytest.mark.nightly
def test_the_watcher_sees_how_deep_a_robot_without_size_is_in_a_wall() -> None:
    """Its distance to the wall and its radius were both 0, and nothing was wrong with that."""
    found = 0
    for number in range(14):
        rng = np.random.default_rng((number, 8))
        made = scenes.harsh_drive(rng, number, time_limit=10.0)
        if made is None or not made.curves or made.scene.robot.radius > 0.0:
            continue
        assert watch(made, every=0.05).wall >= -1e-9
        wrong = drives.FAULTS["through a wall"].put(made, rng)
        if wrong is not None:
            found += 1
            assert watch(wrong, every=0.02).wall < -0.02
