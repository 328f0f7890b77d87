"""The check of small grids: its lists are whole, and it fails when the product is broken."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.planning.graph.session import GraphSession
from lampyris.planning.incremental.search import SearchMap
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.paths import grid_lists as lists
from lampyris_selfcheck.checks.paths import grids
from lampyris_selfcheck.checks.paths.answers import exact
from lampyris_selfcheck.reference.paths.path_cost import walked
from lampyris_selfcheck.reference.paths.search import distances, verdict
from lampyris_selfcheck.runner import Range, run

VERDICTS = {"start-occupied": 20_736, "goal-occupied": 9_216, "found": 9_096, "no-path": 2_424}
"""Half of all 41,472 starts are blocked; 11,520 ordered pairs of free cells remain, start = goal included.

That 9,096 of them are connected is known from another all-pairs count of the same model: it judges the reference.
"""


def outcome(kind: str, cases: int, first: int = 0) -> Outcome:
    return run(grids.CHECK, Ask(), Range(kind, first, cases)).outcome


def test_the_twin_gives_the_known_verdicts_of_all_3x3() -> None:
    words: Counter[str] = Counter()
    cells = [(x, y) for y in range(3) for x in range(3)]
    for bits in range(512):
        _, free = grids._grid(3, 3, bits)
        for goal in cells:
            known = distances(free, "octile", goal)
            words.update(verdict(free, start, known, goal) for start in cells)
    assert words == VERDICTS


def test_the_sizes_are_those_that_were_promised() -> None:
    kinds = grids.CHECK.kinds_for(Ask())
    twelve = {"3x3": 12 * 41_472, "2x4": 12 * 16_384, "4x2": 12 * 16_384, "1xn": 12 * 26_106}
    assert {kind: kinds[kind].nightly for kind in twelve} == twelve
    assert kinds["4x4-classes"].nightly == 582_464
    assert kinds["4x4"].release == 4_456_448
    assert kinds["5x5-classes"].release == 4_211_744


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["3x3", "2x4", "4x2", "1xn"])
def test_a_round_has_every_query_once_and_all_rounds_ask_everybody(kind: str) -> None:
    queries = (grids.CHECK.kinds_for(Ask())[kind].whole or 0) // lists.rounds()
    ends = {
        (q.width, q.height, q.bits, q.start, q.goal)
        for q in (grids._query(Ask(), kind, k) for k in range(queries))
    }
    if kind != "1xn":
        assert len(ends) == queries
        asked = lists.rounds()
    else:  # Lying or standing by turns; a single cell is both.
        assert queries - 2 <= len(ends) <= queries
        asked = 2 * lists.rounds()
    some = queries // 3
    who = {
        (q.width, q.moves, q.planner)
        for q in (grids._query(Ask(), kind, some + turn * queries) for turn in range(asked))
    }
    assert len(who) == asked
    assert len({moves for _, moves, _ in who}) == 4
    assert {planner for _, _, planner in who} == set(exact())


def test_every_class_is_one_and_every_pair_is_met() -> None:
    met = {
        (q.bits, q.start, q.goal) for q in (lists.pair(k, classes=False) for k in range(4_000_000, 4_003_000))
    }
    assert len(met) == 3_000
    assert all(bits >> (4 * y + x) & 1 for bits, *ends in met for x, y in ends)
    last = lists.pair(grids.ALL_PAIRS - 1, classes=False)
    assert (last.bits, last.start, last.goal, last.moves) == (0xFFFF, (3, 3), (3, 3), "octile")
    assert lists.pair(grids.ALL_PAIRS, classes=False).moves == "dissertation"


@pytest.mark.nightly  # 3 s
def test_every_class_of_5x5_is_met_once_a_round() -> None:
    heads = lists.class_heads(5)
    assert len(set(heads.tolist())) == lists.CLASSES_5X5
    made = outcome("5x5-classes", 300, 3_000_000)
    assert (made.failed, made.counts["fields, every cell"]) == (0, 300)
    met = {lists.field(3_000_000 + turn * lists.CLASSES_5X5) for turn in range(100)}
    assert {q.bits for q in met} == {int(heads[3_000_000])}
    free = {(c % 5, c // 5) for c in range(25) if int(heads[3_000_000]) >> c & 1}
    assert {(q.goal, q.moves) for q in met} == {(cell, moves) for cell in free for moves in lists.MOVES}


@pytest.mark.nightly
def test_a_sample_of_the_large_kinds_holds() -> None:
    for kind, first in (("4x4", 3_000_000), ("4x4-classes", 400_000), ("4x4", 2 * grids.ALL_PAIRS + 77)):
        made = outcome(kind, 150, first)
        assert made.failed == 0
        assert made.counts["found"] > 20


def test_the_judge_of_walks_knows_the_rules() -> None:
    free = [[True, True, True], [True, False, True], [True, True, True]]
    assert walked(free, [(0, 0), (1, 0), (2, 0), (2, 1)], "octile") == ("", (3, 0, 0))
    assert walked(free, [(0, 1), (1, 0)], "dissertation") == ("", (0, 1, 0))
    assert "needs" in walked(free, [(0, 1), (1, 0)], "octile")[0]
    assert "needs" in walked(free, [(0, 1), (1, 0)], "dissertation", wide=True)[0]
    assert "needs" in walked(free, [(0, 0), (2, 1)], "sixteen-connected")[0]
    assert "no step" in walked(free, [(0, 0), (2, 0)], "octile")[0]
    assert "outside" in walked(free, [(0, 0), (-1, 0)], "four-connected")[0]
    assert "not free" in walked(free, [(1, 0), (1, 1)], "four-connected")[0]
    terrain = [[0, 7, 0], [0, 0, 9], [0, 0, 0]]
    paid = walked(free, [(0, 0), (1, 0), (2, 0), (2, 1)], "four-connected", terrain=terrain)[1]
    assert paid == (63 + 7 + 63 + 63 + 9, 0, 0)


# ---- broken on purpose -------------------------------------------------------------------------


def spoil(monkeypatch: pytest.MonkeyPatch, change: Any) -> None:
    """Every answer of the searches that plan anew is changed on its way out."""
    genuine = GraphSession._answer

    def answer(self: GraphSession, *args: Any) -> Plan:
        return change(self, genuine(self, *args))

    monkeypatch.setattr(GraphSession, "_answer", answer)


@pytest.mark.nightly
def test_a_way_denied_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    spoil(monkeypatch, lambda s, p: Plan(Status.NO_PATH, p.planner) if p and len(p.path.cells) > 3 else p)
    made = outcome("4x4-drawn", 300)
    assert made.failed > 5
    assert any("answers no-path, the reference found" in f.what for f in made.failures)


@pytest.mark.nightly
def test_a_legal_way_that_is_too_long_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def back_and_forth(session: GraphSession, plan: Plan) -> Plan:
        if not plan or len(plan.path.cells) < 2:
            return plan
        cells = plan.path.cells
        path = path_of(np.concatenate((cells[:2], cells)), plan.path.moves)
        return replace(plan, path=path, optimal_exact=path.exact)

    spoil(monkeypatch, back_and_forth)
    made = outcome("3x3", 3000, 20_000)
    assert made.failed > 50
    assert all("the least is" in f.what for f in made.failures)
    assert {"rows", "start", "goal", "moves", "planner"} == set(made.failures[0].data)


def test_an_error_is_a_failure_and_does_not_stop_the_check(monkeypatch: pytest.MonkeyPatch) -> None:
    def crash(*args: Any) -> None:
        raise ZeroDivisionError("as if")

    monkeypatch.setattr(SearchMap, "extract_path", crash)
    made = outcome("4x4-drawn", 200)
    assert made.cases == 200
    assert 0 < made.failed < 200
    assert "raises ZeroDivisionError: as if" in made.failures[0].what


@pytest.mark.nightly
def test_a_field_that_is_off_by_one_in_one_cell_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = grids.solve_field

    def off(scene: Any) -> Any:
        field = genuine(scene)
        exact = field.exact.copy()
        exact[-1, -1] += exact[-1, -1] > 0
        return replace(field, exact=exact)

    monkeypatch.setattr(grids, "solve_field", off)
    assert any("the field has" in f.what for f in outcome("2x4", 2000, 9_000).failures)
    # The classes are listed in 3 s: some grids stand in for them.
    monkeypatch.setattr(lists, "class_heads", lambda side: np.arange(2**25 - 50, 2**25))
    monkeypatch.setattr(lists, "CLASSES_5X5", 50)
    assert "field, octile moves, " in outcome("5x5-classes", 50).failures[0].what


def test_an_index_that_wraps_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Grid, "contains", lambda self, cell: cell[0] < self.width and cell[1] < self.height)
    assert outcome("outside", 60).failed > 10


def test_a_list_that_lacks_a_pair_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lists, "parted_pairs", lambda: grids.PARTED - 1)
    assert "1,507,847, should be 1,507,848" in outcome("counts", 1).failures[0].what
