"""The check of the monitors: every fault is seen; one that nobody sees, or a deaf judge, makes it fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from lampyris.selfcheck import _monitor_drives as drives
from lampyris.selfcheck import _monitor_traces as traces
from lampyris.selfcheck import _sim_scenes as scenes
from lampyris.selfcheck import monitor, runner
from lampyris.selfcheck.check import Ask, Outcome
from lampyris.selfcheck.monitor import CHECK
from lampyris.selfcheck.twins.drive_monitor import watch


def run(kind: str, count: int) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, cases=count)).outcome


def test_every_fault_is_seen() -> None:
    seen = run("traces", 2 * len(traces.FAULTS))
    assert not seen.failures
    assert dict(seen.counts) == dict.fromkeys(traces.FAULTS, 2)
    seen = run("drives", len(drives.FAULTS))
    assert not seen.failures
    assert dict(seen.counts) == dict.fromkeys(drives.FAULTS, 1)


@pytest.mark.parametrize(
    ("judge", "deaf", "who"),
    [
        ("breaches", lambda trace: [], "the quick monitor"),
        ("check_trace", lambda trace: None, "the referee"),
    ],
)
def test_a_deaf_judge_is_told(
    judge: str, deaf: Callable[[Any], Any], who: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(monitor, judge, deaf)
    seen = run("traces", len(traces.FAULTS))
    assert seen.failed == len(traces.FAULTS)
    assert all(f.what.endswith(f"not seen by {who}") for f in seen.failures)


def test_a_fault_that_is_none_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(traces, "FAULTS", MappingProxyType({"nothing": lambda trace, rng: replace(trace)}))
    assert run("traces", 3).failed == 3
    monkeypatch.setattr(traces, "FAULTS", MappingProxyType({"never": lambda trace, rng: None}))
    assert run("traces", 1).failures[0].what == "never: no occasion in 40 runs"


def test_the_watcher_sees_how_deep_a_robot_without_size_is_in_a_wall() -> None:
    """Its distance to the wall and its radius were both 0, and nothing was wrong with that."""
    found = 0
    for number in range(14):
        rng = np.random.default_rng((number, 8))
        made = scenes.harsh_drive(rng, number, time_limit=10.0)
        if made is None or not made.curves or made.scene.robot.radius > 0.0:
            continue
        assert watch(made, every=0.05).wall >= -1e-9
        wrong = drives.robot_without_size_in_a_wall(made, rng)
        if wrong is not None:
            found += 1
            assert watch(wrong, every=0.02).wall < -0.02
            assert monitor.check_drive(wrong) is not None
    assert found > 1
