"""The check of fleets: its references agree with each other, and it fails when an answer is wrong."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.planning.fleet import registry
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.fleets import fleet_answers, fleet_spoiled, fleets, swarm_cases
from lampyris_selfcheck.checks.fleets.fleet_draws import STYLES, draw
from lampyris_selfcheck.reference.fleets.biconnected import is_biconnected
from lampyris_selfcheck.reference.fleets.discs import closest, wall_gap
from lampyris_selfcheck.reference.fleets.fleet_rules import broken, distances
from lampyris_selfcheck.reference.fleets.joint_space import (
    is_solvable,
    least_sum_of_costs,
    least_sum_of_loss,
)
from lampyris_selfcheck.reference.fleets.one_by_one import earliest_arrival
from lampyris_selfcheck.reference.paths.joint_plans import least_sum_of_costs as least_by_shares
from lampyris_selfcheck.runner import Range, run
from sizes import some

OPEN = [[False] * 4 for _ in range(3)]


def outcome(kind: str, cases: int, first: int = 0) -> Outcome:
    return run(fleets.CHECK, Ask(), Range(kind, first, cases)).outcome


def test_every_planner_is_asked() -> None:
    assert set(registry.names()) <= set(fleets.CHECK.kinds_for(Ask()))


@pytest.mark.parametrize("kind", ["pibt", "related"])
def test_parts_give_the_whole(kind: str) -> None:
    assert outcome(kind, 5) + outcome(kind, 4, 5) == outcome(kind, 9)


@pytest.mark.parametrize(
    ("rules", "one", "other"),
    [
        (set(), [(0, 0), (1, 0), (2, 0)], [(1, 0), (2, 0), (3, 0)]),
        ({"vertex"}, [(0, 0), (1, 0)], [(2, 1), (2, 0), (1, 0), (1, 1)]),
        ({"swap"}, [(0, 0), (1, 0)], [(1, 0), (0, 0)]),
        ({"step"}, [(0, 0), (1, 1)], [(3, 2)]),
        ({"outside"}, [(0, 0), (-1, 0)], [(3, 2)]),
        ({"arrival"}, [(0, 0), (1, 0), (1, 0)], [(3, 2)]),
    ],
)
def test_rules_by_hand(rules: set[str], one: Any, other: Any) -> None:
    starts, goals = [one[0], other[0]], [one[-1], other[-1]]
    assert broken(OPEN, starts, goals, [one, other]) == rules
    assert "start" in broken(OPEN, [(3, 1), other[0]], goals, [one, other])
    assert "goal" in broken(OPEN, starts, [(3, 1), other[-1]], [one, other])
    assert broken(OPEN, starts, goals, [one]) == {"paths"}


def test_octile_rules_by_hand() -> None:
    def rules(one: Any, other: Any, rows: Any = OPEN) -> set[str]:
        ends = [one[0], other[0]], [one[-1], other[-1]]
        return broken(rows, *ends, [one, other], octile=True)

    step = [(0, 0), (1, 1)]
    assert rules(step, [(3, 2)]) == set()
    assert rules(step, [(1, 0), (0, 1)]) == rules(step, [(0, 1), (1, 0)]) == {"crossing"}
    assert rules(step, [(1, 0), (1, 0), (0, 1)]) == set()  # a tick later
    assert rules(step, [(1, 0), (2, 1)]) == set()  # beside it
    assert rules(step, step[::-1]) == {"swap"}
    assert rules([(0, 0), (2, 1)], [(3, 2)]) == {"step"}
    wall = [[False, True], [False, False]]
    assert rules(step, [(0, 1)], wall) == {"wall"}
    assert distances(wall, (1, 1), octile=True)[0, 0] == 2
    assert distances(OPEN, (3, 2), octile=True)[0, 0] == 3
    assert earliest_arrival(OPEN, (0, 0), (1, 1), [[(1, 0), (0, 1)]], last=5, octile=True) == 2


@pytest.mark.parametrize("octile", [False, True])
@pytest.mark.parametrize("seed", some(range(40), 8))
def test_the_searches_of_the_joint_space_agree(seed: int, octile: bool) -> None:
    drawn = draw(np.random.default_rng(seed), "tiny")
    rows, starts, goals = drawn.rows, drawn.fleet.starts, drawn.fleet.goals
    least = least_sum_of_costs(rows, starts, goals, octile=octile)
    loss = least_sum_of_loss(rows, starts, goals, octile=octile)
    assert is_solvable(rows, starts, goals, octile=octile) == (least is not None) == (loss is not None)
    if least is not None and loss is not None:
        alone = sum(distances(rows, b, octile=octile)[a] for a, b in zip(starts, goals, strict=True))
        assert alone <= loss <= least
        by_shares = least_by_shares(rows, starts, goals, 3, octile=octile)
        assert by_shares == (least if least <= alone + 3 else None)


def test_one_robot_among_others() -> None:
    rows = [[False] * 5]
    assert earliest_arrival(rows, (0, 0), (4, 0), [], last=9) == 4
    assert earliest_arrival(rows, (0, 0), (4, 0), [[(2, 0)]], last=20) is None
    rows = [[False] * 5, [True, False, True, True, True]]
    # The other one comes the other way: wait in the bay until it has passed.
    other = [(3, 0), (2, 0), (1, 0), (0, 0)]
    assert earliest_arrival(rows, (1, 0), (4, 0), [other], last=20) == 6
    # It does not enter its goal before the last visitor has left.
    assert earliest_arrival(OPEN, (1, 1), (1, 0), [[(0, 0), (0, 0), (1, 0), (2, 0)]], last=9) == 3


@pytest.mark.parametrize("seed", range(60))
def test_biconnected_by_leaving_out_each_cell(seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocked = rng.random((4, 4)) < 0.25
    free = [(int(x), int(y)) for y, x in np.argwhere(~blocked)]

    def connected(rows: Any, cells: list[Any]) -> bool:
        return not cells or len(distances(rows, cells[0])) == len(cells)

    whole = len(free) >= 3 and connected(blocked.tolist(), free)
    for x, y in free:
        less = blocked.copy()
        less[y, x] = True
        whole = whole and connected(less.tolist(), [c for c in free if c != (x, y)])
    assert is_biconnected(blocked.tolist()) == whole


def test_discs_by_hand() -> None:
    assert closest((0, 0), (2, 0), (2, 1), (0, 1)) == 1.0
    assert closest((0, 0), (0, 0), (3, 4), (3, 4)) == 5.0
    assert closest((0, 0), (4, 0), (2, 2), (2, -2)) == 0.0
    wall = [[False, False, False], [False, True, False], [False, False, False]]
    assert wall_gap((0.5, 0.5), (0.5, 2.5), wall, 1.0) == pytest.approx(0.5)
    assert wall_gap((0.8, 0.8), (0.8, 0.8), wall, 1.0) == pytest.approx(0.08**0.5)


def _spoil(monkeypatch: pytest.MonkeyPatch, change: Any) -> None:
    genuine = fleet_answers.plan_fleet

    def wrong(*args: Any, **words: Any) -> FleetPlan:
        plan = genuine(*args, **words)
        return change(plan) if plan else plan

    monkeypatch.setattr(fleet_answers, "plan_fleet", wrong)


def _through_each_other(plan: FleetPlan) -> FleetPlan:
    """Every robot takes its path without the waits."""
    paths = []
    for path in plan.paths:
        moved = np.append(True, (np.diff(path, axis=0) != 0).any(axis=1))
        paths.append(path[moved])
    return replace(plan, paths=tuple(paths), improvements=())


def _more_costly(plan: FleetPlan) -> FleetPlan:
    """One robot comes, goes back and comes again where it has a step to do so."""
    longest = max(range(len(plan.paths)), key=lambda k: len(plan.paths[k]))
    path = plan.paths[longest]
    if len(path) < 2:
        return plan
    made = [*plan.paths]
    made[longest] = np.concatenate((path[:1], path[:1], path[:1], path[1:]))
    return replace(plan, paths=tuple(made), improvements=(), bound=None)


@pytest.mark.parametrize(
    ("kind", "change", "words"),
    [
        ("lacam", _through_each_other, "breaks"),
        ("cbs", _more_costly, "its bound is|the least is|breaks"),
        ("eecbs", lambda p: replace(p, bound=p.sum_of_costs + 1), "has the lower bound"),
        (
            "lns",
            lambda p: replace(p, improvements=((1, p.sum_of_costs), (2, p.sum_of_costs))),
            "improvements",
        ),
        ("pibt", lambda p: replace(p, shortest=p.shortest + 1), "shortest paths"),
        ("lacam", lambda p: FleetPlan(Status.NO_PATH, p.planner, (), p.shortest), "there is a plan"),
        ("prioritised-sipp", _more_costly, "it can at|breaks"),
        ("octile", _through_each_other, "breaks"),
        ("octile", lambda p: replace(p, shortest=p.shortest + 1), "shortest paths"),
    ],
)
def test_a_wrong_answer_is_seen(kind: str, change: Any, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    _spoil(monkeypatch, change)
    made = outcome(kind, 30)
    assert made.failed > 0
    assert any(re.search(words, f.what) for f in made.failures)


def test_a_referee_that_passes_everything_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet_spoiled, "check_fleet_plan", lambda *args, **words: None)
    made = outcome("referee", 60)
    assert any("passes paths" in f.what for f in made.failures)
    assert any("says nothing" in f.what for f in made.failures)


def test_a_referee_of_swarms_that_passes_everything_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(swarm_cases, "check_swarm", lambda *args, **words: None)
    monkeypatch.setattr(swarm_cases.SwarmMotion, "see", lambda self, path: None)
    made = outcome("swarm-referee", 30)
    assert any("passes a trace" in f.what for f in made.failures)
    assert any("the judge says None" in f.what for f in made.failures)


def test_every_style_is_drawn() -> None:
    for style in set(STYLES):
        drawn = draw(np.random.default_rng(3), style)
        assert drawn.style == style
        assert not broken(
            drawn.rows, drawn.fleet.starts, drawn.fleet.starts, [[c] for c in drawn.fleet.starts]
        )
