"""The check of the monitors: every fault is seen; one that nobody sees, or a deaf judge, makes it fail."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from lampyris.model.trace import Trace
from lampyris.referee import check_drive
from lampyris.referee.verdict import Violation
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.traffic import monitor
from lampyris_selfcheck.checks.traffic import monitor_drives as drives
from lampyris_selfcheck.checks.traffic import monitor_faults as traces
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes
from lampyris_selfcheck.checks.traffic.monitor import CHECK
from lampyris_selfcheck.reference.motion import quick_monitor
from lampyris_selfcheck.reference.motion.drive_monitor import watch
from lampyris_selfcheck.reference.motion.sim_monitor import disc
from sizes import some

ALL = tuple(traces.FAULTS.values())


def run(kind: str, count: int, first: int = 0) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, cases=count, first=first)).outcome


@pytest.mark.nightly
def test_every_fault_is_seen() -> None:
    seen = run("traces", 2 * len(traces.FAULTS))
    assert not seen.failures
    assert dict(seen.counts) == dict.fromkeys(traces.FAULTS, 2)
    seen = run("drives", len(drives.FAULTS))
    assert not seen.failures
    assert dict(seen.counts) == dict.fromkeys(drives.FAULTS, 1)


@pytest.mark.parametrize("number", [2629, 3445, 3850, 4497, 4705, 6156, 13785])
def test_a_fault_breaks_its_own_rule_first(number: int) -> None:
    """The nightly found these: beside the corner that the robot cut a body stood in the new wall or cut it
    too, a long step led over who was to meet another, a run without a step, walls that turned otherwise.
    """
    seen = run("traces", 1, first=number)
    assert not seen.failures
    assert seen.cases == 1


def spoilt(rounds: int = 2) -> list[tuple[str, Trace]]:
    """Traces with each fault in them, as the check puts them in."""
    found: list[tuple[str, Trace]] = []
    for number in range(rounds * len(traces.FAULTS)):
        name = tuple(traces.FAULTS)[number % len(traces.FAULTS)]
        rng = Ask().rng("monitor", "traces", number)
        runs = (monitor._trace(1, number // len(traces.FAULTS) + attempt) for attempt in range(150))
        wrong = (traces.FAULTS[name].put(one, rng) for one in runs if one is not None)
        found.append((name, next(one for one in wrong if one is not None)))
    return found


def unheard(pattern: str, judge: Callable[..., list[str]]) -> Callable[..., list[str]]:
    return lambda *given, **more: [one for one in judge(*given, **more) if not re.search(pattern, one)]


@pytest.fixture(scope="module")
def wrong_traces() -> list[tuple[str, Trace]]:
    return spoilt()


@pytest.mark.parametrize(
    ("judge", "who", "word"),
    [
        *(("breaches", "the quick monitor", word) for word in sorted({f.quick for f in ALL} - {""})),
        *(("_slowly", "the slow monitor", word) for word in sorted({f.slow for f in ALL})),
    ],
)
def test_a_monitor_that_has_lost_a_rule_is_told(
    judge: str, who: str, word: str, wrong_traces: list[tuple[str, Trace]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever else breaks with it does not count: nearly every fault made a body jump; that was enough."""
    monkeypatch.setattr(monitor, judge, unheard(word, getattr(monitor, judge)))
    mine = {n for n, f in traces.FAULTS.items() if (f.quick if judge == "breaches" else f.slow) == word}
    told = [monitor.deaf_to(traces.FAULTS[name], wrong) for name, wrong in wrong_traces if name in mine]
    assert told == [[who]] * len(told)
    assert told


@pytest.mark.parametrize("pairs", ["_small_pairs", "_sized_pairs"])
def test_a_quick_monitor_without_its_rules_of_pairs_fails(
    pairs: str, wrong_traces: list[tuple[str, Trace]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(quick_monitor, pairs, lambda trace, crowd: iter(()))
    seen = run("traces", 2 * len(traces.FAULTS))
    assert len({f.data["fault"] for f in seen.failures}) >= (6 if pairs == "_small_pairs" else 2)


@pytest.mark.parametrize(("kind", "judge"), some([("traces", "check_trace"), ("drives", "check_drive")]))
def test_another_rule_of_the_referee_does_not_count(
    kind: str, judge: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong, honest = Violation("numbers", "trace", "something else"), getattr(monitor, judge)
    monkeypatch.setattr(monitor, judge, lambda run: honest(run) and wrong)
    faults = traces.FAULTS if kind == "traces" else drives.FAULTS
    asked = sum(bool(kind == "drives" or fault.referee) for fault in faults.values())
    assert run(kind, len(faults)).failed == asked > (20 if kind == "traces" else 8)


def test_traces_are_of_every_kind_that_is_judged(wrong_traces: list[tuple[str, Trace]]) -> None:
    scenes_ = [trace.scene for _, trace in wrong_traces]
    assert {s.moves.name for s in scenes_} >= {"octile", "sixteen-connected"}
    assert any(s.edits for s in scenes_)
    assert any(b.kind == "recorded" for _, trace in wrong_traces for b in trace.obstacle_specs)
    assert any(s.robot.radius > 0 for s in scenes_)


@pytest.mark.parametrize("resolution", [0.25, 0.3, 1.0])
def test_both_monitors_find_the_same_footprints_each_its_own_way(resolution: float) -> None:
    for k in range(0, 60, 3):
        radius = k / 20
        cells = set(map(tuple, quick_monitor.footprint(radius, resolution).tolist()))
        assert cells == disc(radius, resolution)  # type: ignore[no-untyped-call]


def test_a_fault_that_is_none_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = traces.Fault(lambda trace, rng: replace(trace), "jumps", "jumps", "step")
    monkeypatch.setattr(traces, "FAULTS", MappingProxyType({"nothing": nothing}))
    told = "nothing: not seen by the quick monitor, the slow monitor, the referee"
    assert [f.what for f in run("traces", 3).failures] == [told] * 3
    never = nothing._replace(put=lambda trace, rng: None)
    monkeypatch.setattr(traces, "FAULTS", MappingProxyType({"never": never}))
    assert run("traces", 1).failures[0].what == "never: no occasion in 150 runs"


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
            assert check_drive(wrong) is not None
    assert found > 1
