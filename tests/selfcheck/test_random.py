"""The check of drawn maps: its reference agrees with a slower one; it fails when the product is broken."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris.model.plan import Plan, Status
from lampyris.planning.graph.session import GraphSession
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.paths import drawn_maps
from lampyris_selfcheck.checks.paths import random as check
from lampyris_selfcheck.checks.paths import worlds as _worlds
from lampyris_selfcheck.checks.paths.answers import exact, own
from lampyris_selfcheck.checks.paths.grid_costs import Q, cost_at, costs_to, room_for
from lampyris_selfcheck.reference.paths.changing_map import ChangingMap, costs
from lampyris_selfcheck.reference.paths.search import cost_of
from lampyris_selfcheck.runner import Range, run


def outcome(kind: str, cases: int, first: int = 0) -> Outcome:
    return run(check.CHECK, Ask(), Range(kind, first, cases)).outcome


def test_the_exact_ones_are_all_here() -> None:
    assert set(exact()) >= {
        "astar", "dijkstra", "jps", "bidirectional-astar", "fastest",
        "dstar", "focussed-dstar", "lpa-star", "dstar-lite", "ad-gso choice=exact",
    }  # fmt: skip
    assert set(own(False)) >= {"ad-gso", "theta-star", "lazy-theta-star", "sipp", "space-time-astar", "gso"}


def test_the_quick_reference_agrees_with_a_plain_one_in_every_cell() -> None:
    seen = 0
    for case in range(120):
        rng = np.random.default_rng([14, case])
        width, height = (int(n) for n in rng.integers(2, 16, size=2))
        blocked = drawn_maps.walls(rng, width, height)
        terrain = drawn_maps.terrain(rng, blocked) if case % 2 else None
        radius = float(rng.choice([0.0, *_worlds.RADII]))
        name = check.MOVES[case // 2 % 4]
        world = ChangingMap(blocked.tolist(), None if terrain is None else terrain.tolist(), radius)
        free = room_for(blocked, radius)
        assert free.tolist() == world.free()
        if not free.any():
            continue
        y, x = np.argwhere(free)[-1].tolist()
        quick = costs_to([(x, y)], free, name, wide=radius > 0, terrain=terrain)[0]
        slow = costs(world.free(), world.terrain, name, (x, y), wide=radius > 0)
        for v in range(height):
            for u in range(width):
                counts = slow.get((u, v))
                if counts is not None and terrain is None:
                    assert not any(n % 63 for n in counts)
                    counts = (counts[0] // 63, counts[1] // 63, counts[2] // 63)
                due = None if counts is None else cost_of(counts, name)
                assert cost_at(quick, (u, v), name) == due
                seen += due is not None
    assert seen > 2_000


def test_costs_beyond_what_is_exact_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lampyris_selfcheck.checks.paths.grid_costs._EXACT", 10.0 * Q)
    with pytest.raises(OverflowError):
        costs_to([(0, 0)], np.ones((1, 20), dtype=bool), "octile")


def test_pieces_are_the_whole_and_a_seed_is_another_run() -> None:
    whole = outcome("plain", 45)
    pieces = Outcome()
    for first, cases in ((0, 13), (13, 20), (33, 12)):
        pieces += outcome("plain", cases, first)
    assert pieces == whole
    worlds = [check._world(Ask(seed=seed), "plain", 0) for seed in (1, 2)]
    assert not np.array_equal(worlds[0].free, worlds[1].free)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", check.KINDS)
def test_the_cases_are_as_varied_as_promised(kind: str) -> None:
    shapes, words, styles = set(), [], 0
    for number in range(40 * check.SHARED[kind]):
        ask = Ask()
        world = check._world(ask, kind, number // check.SHARED[kind])
        question = check._question(ask, kind, number, world)
        words.append(_worlds.truth(world, question.start, question.goal, question.index).word)
        shapes.add(world.free.shape)
        styles += world.terrain is not None
    low, high = (65, 512) if kind == "large" else (5, 32 if kind == "others" else 64)
    assert all(low <= side <= high for shape in shapes for side in shape)
    assert any(h != w for h, w in shapes)
    blocked = sum(word.endswith("occupied") for word in words)
    assert 0.05 < blocked / len(words) < 0.3
    assert words.count("no-path") > 20
    assert words.count("found") > 300
    assert (styles > 0) is (kind != "plain")


def test_large_sides_are_drawn_by_whole_numbers_as_many_from_each_octave() -> None:
    class Whole:
        """A generator that draws nothing but whole numbers."""

        def __init__(self, number: int) -> None:
            self.integers = np.random.default_rng(number).integers

    sides = [side for n in range(3_000) for side in check._sides(Whole(n), "large")]
    assert (min(sides), max(sides)) == (65, 512)
    for low, high in ((65, 129), (130, 259), (260, 512)):
        assert 1_850 < sum(low <= side <= high for side in sides) < 2_150
    assert "np.exp" not in Path(check.__file__).read_text()
    assert "np.log" not in Path(check.__file__).read_text()


# ---- broken on purpose -------------------------------------------------------------------------


def spoil(monkeypatch: pytest.MonkeyPatch, change: Any) -> None:
    """Every answer of the searches that plan anew is changed on its way out."""
    genuine = GraphSession._answer

    def answer(self: GraphSession, *args: Any) -> Plan:
        return change(genuine(self, *args))

    monkeypatch.setattr(GraphSession, "_answer", answer)


@pytest.mark.parametrize("kind", ["plain", "rough"])
def test_a_way_denied_is_seen(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    spoil(monkeypatch, lambda p: Plan(Status.NO_PATH, p.planner) if p and len(p.path.cells) > 9 else p)
    made = outcome(kind, 60)
    assert made.failed > 3
    assert all("answers no-path, the reference found" in f.what for f in made.failures)
    assert {"rows", "terrain", "start", "goal", "planner", "moves", "radius", "resolution"} == set(
        made.failures[0].data
    )


def test_an_optimum_that_is_not_one_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    spoil(monkeypatch, lambda p: replace(p, optimal_exact=p.optimal_exact - 1) if p.optimal_exact else p)
    assert any("says the optimum is" in f.what for f in outcome("plain", 60).failures)


@pytest.mark.nightly
def test_a_robot_taken_for_a_point_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lampyris.planning.graph.session.free_space", lambda scene: ~scene.grid.blocked)
    made = outcome("plain", 600)
    assert 0 < made.failed <= made.counts["robot with a size"]


def test_ground_that_is_not_paid_for_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "lampyris.planning.graph.session.path_of",
        lambda cells, moves, terrain: replace(check_path_of(cells, moves, terrain), paid=63 * len(cells)),
    )
    from lampyris.model.path import path_of as check_path_of

    assert outcome("rough", 60).failed > 5


def test_a_field_with_one_wrong_cell_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = check.solve_field

    def off(scene: Any) -> Any:
        field = genuine(scene)
        told = field.exact.copy()
        told[0, 0] += told[0, 0] > 0
        return replace(field, exact=told)

    monkeypatch.setattr(check, "solve_field", off)
    assert "the field has" in outcome("plain", 60).failures[0].what


@pytest.mark.nightly
def test_an_inexact_planner_that_denies_a_way_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = check.asked
    monkeypatch.setattr(
        check,
        "asked",
        lambda *args: Plan(Status.NO_PATH, args[0]) if args[0] == "sipp" else genuine(*args),
    )
    made = outcome("others", 200)
    assert made.failed > 0
    assert all(f.data["planner"] == "sipp" for f in made.failures)


@pytest.mark.parametrize("status", [Status.ITERATION_LIMIT, Status.LIMIT])
def test_a_planner_that_gives_up_is_seen(status: Status, monkeypatch: pytest.MonkeyPatch) -> None:
    """None of those asked here may, exact or not."""
    genuine = check.asked

    def given_up(*args: Any) -> Plan:
        plan = genuine(*args)
        return Plan(status, plan.planner) if plan else plan

    monkeypatch.setattr(check, "asked", given_up)
    made = outcome("others", 60)
    assert made.failed == made.counts["found"] > 20
    assert all(f"answers {status.value}, the reference found" in f.what for f in made.failures)
