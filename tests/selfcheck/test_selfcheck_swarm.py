"""The check of swarms: it fails when a bound is broken."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lampyris.model.plan import Plan, Status
from lampyris.planning.swarm.session import FitnessEvaluator, SwarmSession
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.paths import swarm
from lampyris_selfcheck.runner import Range, run


def outcome(kind: str, cases: int, first: int = 0) -> Outcome:
    return run(swarm.CHECK, Ask(), Range(kind, first, cases)).outcome


def test_every_swarm_is_asked() -> None:
    from lampyris.planning import registry

    drawing = {
        n
        for n, row in registry.list_planners().items()
        if row.traits.stochastic
        and not registry.origin_of(n)
        # Paths of planners that sample are straight lines at any angle: tests/planning/test_sampling.py judges them.
        and ".sampling." not in registry.planner_class(n).__module__
    }
    assert set(swarm.CHECK.kinds_for(Ask())) == drawing


@pytest.mark.nightly
def test_the_cases_are_varied_and_pieces_give_the_whole() -> None:
    whole = outcome("lpso", 60)
    assert outcome("lpso", 23) + outcome("lpso", 37, 23) == whole
    assert {"found, seeded", "found, with slack", "found, without a seed", "no-path, seeded"} <= set(
        whole.counts
    )


@pytest.mark.nightly
def test_a_way_longer_than_the_seed_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = FitnessEvaluator.__init__

    def generous(self: FitnessEvaluator, *args: Any) -> None:
        genuine(self, *args)
        self._most = np.inf

    monkeypatch.setattr(FitnessEvaluator, "__init__", generous)
    made = outcome("gso", 250)
    assert made.failed > 0
    assert any("the least is" in f.what or "with its slack" in f.what for f in made.failures)


@pytest.mark.nightly
def test_slack_that_is_overdrawn_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = swarm._settings

    def told_less(rng: np.random.Generator, seed: int) -> dict[str, Any]:
        return genuine(rng, seed) | {"slack": 5.0, "clearance": 20.0, "seeded": True}

    judge = swarm.bounds_wrong
    monkeypatch.setattr(swarm, "_settings", told_less)
    monkeypatch.setattr(swarm, "bounds_wrong", lambda plan, truth, s: judge(plan, truth, s | {"slack": 0.01}))
    made = outcome("lpso", 200)
    assert any("with its slack" in f.what for f in made.failures)


def test_a_best_that_gets_worse_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = FitnessEvaluator.__call__

    def forgetful(self: FitnessEvaluator, asked: Any) -> Any:
        fitness = genuine(self, asked)
        if len(self.trace) > 1:
            self.trace[-1] += 1.0
        return fitness

    monkeypatch.setattr(FitnessEvaluator, "__call__", forgetful)
    assert any("the best so far rose" in f.what for f in outcome("pso", 50).failures)


@pytest.mark.nightly
def test_a_way_denied_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = SwarmSession.plan

    def hopeless(self: SwarmSession, *args: Any) -> Plan:
        plan = genuine(self, *args)
        return Plan(Status.NO_PATH, plan.planner) if plan.status is Status.ITERATION_LIMIT else plan

    monkeypatch.setattr(SwarmSession, "plan", hopeless)
    made = outcome("igso", 250)
    assert made.failed > 0
    assert all("answers no-path, the reference found" in f.what for f in made.failures)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["ad-gso", "dstar-lpso", "igso"])
def test_only_a_swarm_without_a_seed_and_without_repairing_may_give_up(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    may, genuine = [], swarm.wrong

    def given_up(plan: Plan, *args: Any, **told: Any) -> str:
        if not plan:
            return genuine(plan, *args, **told)
        fault = genuine(Plan(Status.ITERATION_LIMIT, plan.planner), *args, **told)
        may.append(not fault)
        return fault

    monkeypatch.setattr(swarm, "wrong", given_up)
    made = outcome(kind, 100)
    assert made.failed == may.count(False) > 30
    assert all("iteration-limit, the reference found" in f.what for f in made.failures)
    told = [f.data["settings"] for f in made.failures]
    if kind == "igso":
        assert 0 < may.count(True) < 20  # one run of five is without a seed, half of these repair
        assert all(how.get("seeded", True) or how["repair"] for how in told)
    else:
        assert may.count(True) == 0
