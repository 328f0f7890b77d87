"""The check of sessions that are used again can fail: what a session forgets, keeps or shares is seen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from lampyris._core import exclusive
from lampyris.model.change import Change
from lampyris.planning import registry
from lampyris.planning.adgso.session import AdGsoSession
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.graph.grid_graph import PaddedMap
from lampyris.planning.graph.jps_search import PackedMap
from lampyris.planning.incremental.session import IncrementalSession
from lampyris.planning.living_map import LivingMap
from lampyris.planning.swarm.session_memory import Memory
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.changes import reuse


def lives(*names: str, each: int = 4) -> Outcome:
    """Lives of the planners of these names, with all their settings."""
    planners = reuse.who()
    total = Outcome()
    for k, (planner, _) in enumerate(planners):
        if planner.name in names:
            for turn in range(each):
                total += reuse.run(Ask(), Part("sessions", k + turn * len(planners), 1))
    return total


def test_every_planner_of_ours_is_asked() -> None:
    ours = {name for name in registry.names() if not registry.origin_of(name)}
    assert {planner.name for planner, _ in reuse.who()} == ours


@pytest.mark.nightly
def test_lives_are_eventful() -> None:
    seen = lives("ad-gso", "dstar-lite")
    assert not seen.failed
    for word in (
        "pickled", "copy", "deep copy", "cancelled", "cleared", "asked again", "edited", "fresh sessions",
        "answers: found", "answers: no-path", "answers: hemmed-in", "answers: limit",
    ):  # fmt: skip
        assert seen.counts[word] > 3, word


@pytest.mark.nightly
def test_a_field_that_travels_without_its_views(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(FieldRepairer, "_own_state")
    monkeypatch.delattr(FieldRepairer, "_take_state")
    assert lives("ad-gso", each=1).failed


@pytest.mark.nightly
def test_a_packed_map_that_travels_without_its_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    def state(self: PackedMap) -> dict[str, Any]:
        return {**self.__dict__, "columns": np.zeros_like(self.columns)}

    monkeypatch.setattr(PackedMap, "__getstate__", state)
    assert lives("jps", each=6).failed


@pytest.mark.nightly
def test_copies_that_share(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exclusive, "_copied_state", lambda one, memo: one._own_state())
    assert lives("dstar", "gso").failed


@pytest.mark.nightly
def test_a_map_that_does_not_hear_of_walls_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    right = LivingMap.take

    def take(self: LivingMap, change: Change) -> Any:
        return right(self, Change(change.robot, change.obstacles, change.blocked, (), change.terrain))

    monkeypatch.setattr(LivingMap, "take", take)
    assert lives("dstar-lite", "ad-gso").failed


def test_obstacles_that_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def closing(self: PaddedMap, cells: Iterable[Any]) -> Iterator[None]:
        for c in cells:
            self.free[self.flat(c)] = 0
        yield

    monkeypatch.setattr(PaddedMap, "closing", closing)
    assert lives("astar").failed


def test_obstacles_that_an_incremental_search_keeps(monkeypatch: pytest.MonkeyPatch) -> None:
    right = IncrementalSession._take

    def take(self: IncrementalSession, change: Change) -> None:
        right(self, change)
        self._covered = frozenset()

    monkeypatch.setattr(IncrementalSession, "_take", take)
    assert lives("lpa-star").failed


@pytest.mark.nightly
def test_walls_that_ad_gso_never_takes_down(monkeypatch: pytest.MonkeyPatch) -> None:
    right = AdGsoSession._travel

    def travel(self: AdGsoSession, bodies: Any, look: int) -> Any:
        self._walled |= getattr(self, "kept", frozenset())
        found = right(self, bodies, look)
        self.kept = self._walled  # type: ignore[attr-defined]
        return found

    monkeypatch.setattr(AdGsoSession, "_travel", travel)
    assert lives("ad-gso", each=6).failed


@pytest.mark.nightly
def test_a_swarm_that_plans_on_the_ground_of_before(monkeypatch: pytest.MonkeyPatch) -> None:
    right = Memory._see

    def see(self: Memory) -> None:
        kept = getattr(self, "_grounds", {})
        right(self)
        self._grounds = kept

    monkeypatch.setattr(Memory, "_see", see)
    assert lives("pso", "dstar-lpso", each=2).failed


def test_a_session_that_repairs_a_shared_field_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not reuse.run(Ask(), Part("shared", 0, 3)).failed
    monkeypatch.setattr(FieldRepairer, "copy_on_write", lambda self: self)
    assert reuse.run(Ask(), Part("shared", 0, 3)).failed
