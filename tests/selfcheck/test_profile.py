"""The check of speed profiles: it holds, and it sees what is broken."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lampyris.motion import profile as product
from lampyris.motion.laws import physical
from lampyris.motion.safety import blind_areas as motion_blind
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.speed import profile_cases as cases
from lampyris_selfcheck.checks.speed.profile import CHECK
from sizes import some


def run(kind: str, count: int) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, cases=count)).outcome


@pytest.mark.nightly
@pytest.mark.parametrize("kind", some(["laws", "free", "exact", "monotone"]))
def test_it_holds_and_the_cases_are_varied(kind: str) -> None:
    seen = run(kind, 200)
    assert (seen.cases, seen.failed) == (200, 0)
    assert min(seen.counts.values()) > 1


Change = Callable[[Any], Any]


def spoilt(monkeypatch: pytest.MonkeyPatch, change: Change) -> None:
    """Every profile comes out changed."""
    sound = product.feasible_profile

    def other(*args: Any, **more: Any) -> Any:
        return change(sound(*args, **more))

    monkeypatch.setattr(cases, "feasible_profile", other)
    monkeypatch.setattr(physical, "feasible_profile", other)


def late(made: Any) -> Any:
    """Brakes a little later than it can."""
    if len(made.v) < 3:
        return made
    v = made.v.copy()
    v[-2] *= 1 + 1e-6
    return made._replace(v=v)


def rolling(made: Any) -> Any:
    v = made.v.copy()
    v[-1] = 1e-30
    return made._replace(v=v)


def stalled(made: Any) -> Any:
    t = made.t.copy()
    t[-1] = t[-2] if len(t) > 1 else math.nan
    return made._replace(t=t)


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["free", "exact", "laws"])
@pytest.mark.parametrize("change", [late, rolling, stalled])
def test_it_sees_a_profile_that_is_wrong(kind: str, change: Change, monkeypatch: pytest.MonkeyPatch) -> None:
    spoilt(monkeypatch, change)
    assert run(kind, 100).failed > 5


def test_it_sees_a_profile_that_is_slower_than_it_must_be(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = product.sweep

    def shy(x: Any, up: Any, down: Any, *rest: Any) -> None:
        sound(x, up, down * (1 - 1e-9), *rest)

    monkeypatch.setattr(product, "sweep", shy)
    assert run("exact", 100).failed > 10


def test_it_sees_a_profile_that_is_clipped_in_place_of_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = product.feasible_profile

    def meek(*args: Any, **more: Any) -> Any:
        return sound(*args, **(more | {"on_infeasible": "brake"}))

    monkeypatch.setattr(cases, "feasible_profile", meek)
    assert run("free", 100).failed > 5


@pytest.mark.nightly
def test_it_sees_a_radius_forgotten_and_a_reach_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(
            physical.caps,
            "clearance",
            lambda distance, *, radius, d_max, creep: np.maximum(creep, np.sqrt(2.0 * d_max * distance)),
        )
        assert run("laws", 200).failed > 0
    assert run("laws", 200).failed == 0


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "factor"), [("hidden_speed", 0.98), ("reaction", 0.95), ("d_max", 0.97)])
def test_it_sees_a_cap_of_blind_areas_off_by_little(
    name: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = motion_blind.stop_within

    def other(distance: Any, **more: float) -> Any:
        return sound(distance, **(more | {name: more[name] * factor}))

    monkeypatch.setattr(motion_blind, "stop_within", other)
    assert run("laws", 200).failed > 0


def test_an_exception_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*args: Any, **more: Any) -> Any:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(cases, "feasible_profile", broken)
    seen = run("monotone", 5)
    assert (seen.cases, seen.failed) == (5, 5)
    assert seen.failures[0].what == "ZeroDivisionError: by zero"
