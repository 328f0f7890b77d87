"""Repairing a field costs what changed. That it equals one solved from scratch is the check ``repair``."""

from __future__ import annotations

import copy
import inspect
import pickle
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from lampyris._core.defaults import GAMMA, RHO
from lampyris.errors import SceneError, SettingError
from lampyris.kernels.field import repair as kernels
from lampyris.model.field import Field
from lampyris.model.moves import MOVES, PELL_P, PELL_Q, Moves
from lampyris.planning.field import repair
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import fill, solve
from lampyris_selfcheck.checks.changes.repair_story import repair_through
from lampyris_selfcheck.reference.paths import field as field_twin
from lampyris_selfcheck.reference.paths.edit_stories import story
from reference.kernel_forms import use

ARRAYS = ("exact", "step", "luciferin", "free")


def same(a: Field, b: Field) -> bool:
    """Every value; not the element type of costs, which may be wider than need be."""
    return all(np.array_equal(getattr(a, what), getattr(b, what)) for what in ARRAYS)


@pytest.fixture(autouse=True)
def _never_gives_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small maps are repaired here, where solving them would be quicker."""
    monkeypatch.setattr(repair, "GIVE_UP", 1)
    monkeypatch.setattr(repair, "HOPELESS", 1)


@pytest.mark.commit(1)
@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_both_forms_of_the_kernels_repair(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    repaired = solved = 0
    for number in range(60 if form == "compiled" else 20):
        repairer = repair_through(story(11, number))
        repaired += repairer.repaired
        solved += repairer.solved - 1
    assert repaired > 10 * solved > 0


DEFECTS = {
    "cells that relied on a loser are not asked": (
        "cost[x] >> shift, cell + jump[k], work)\n            cost[u] = -1\n",
        "cost[x] >> shift, cell + jump[k], work) if False else None\n            cost[u] = -1\n",
    ),
    "only what lost its cost is offered another": (
        "        if free[u] == 0 or cost[u] == 0:\n            continue\n        best",
        "        if free[u] == 0 or cost[u] >= 0:\n            continue\n        best",
    ),
    "a new parent of the same cost next door is not noticed": (
        " or (c >= 0 and c + price[k] * burden == d)",
        "",
    ),
    "children of what changed keep their parent": ("x + u64(jump[step[x]]) == u or (c >= 0", "(c >= 0"),
    "luciferin goes no further than what changed": (
        "            luciferin[u] = glow\n",
        "            luciferin[u] = glow\n            continue\n",
    ),
    "a step is weighed by the cell it leaves": (
        "            if d + price[k] * (ground + weight[v & u64(mask)]) == c:",
        "            if d + price[k] * (ground + weight[u & u64(mask)]) == c:",
    ),
    "what a step touches on its way is not looked at": (
        "== 0:\n                    continue\n                if count > most",
        "== 0:\n                    pass\n                if count > most",
    ),
}


@pytest.mark.parametrize("name", DEFECTS)
def test_seeded_defects_are_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, "plain")  # what is compiled is kept on disk under the name of the true source
    old, new = DEFECTS[name]
    source = inspect.getsource(kernels)
    assert source.count(old) == 1, f"found {source.count(old)} times"
    wrong = ModuleType(kernels.__name__)
    exec(compile(source.replace(old, new), str(kernels.__file__), "exec"), wrong.__dict__)
    monkeypatch.setattr(repair, "repair", wrong)

    def lives() -> None:
        for number in range(100):
            repair_through(story(11, number))

    with pytest.raises((AssertionError, IndexError)):
        lives()


# ---- the choice, the work, the views ----------------------------------------------------------------------


def test_too_much_to_repair_is_solved_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(21)
    monkeypatch.setattr(repair, "GIVE_UP", 24)
    free = rng.random((60, 60)) >= 0.1
    free[30, 30] = True
    repairer = FieldRepairer(free, MOVES["octile"], (30, 30))
    for k in (3, 200, 3, 1500, 3):
        ys, xs = rng.integers(0, 60, (2, k))
        keep_goal = (xs != 30) | (ys != 30)
        cells = np.stack((xs, ys), axis=1)[keep_goal]
        before = free.copy()
        free[cells[:, 1], cells[:, 0]] = False
        assert same(repairer.repair(blocked=cells), solve(free, MOVES["octile"], (30, 30)))
        free = before
        assert same(
            repairer.repair(freed=[(x, y) for x, y in cells.tolist() if free[y, x]]),
            solve(free, MOVES["octile"], (30, 30)),
        )
    assert repairer.solved >= 4
    assert repairer.repaired >= 2
    assert repairer.solved + repairer.repaired == 11


def test_a_goal_that_is_blocked_and_freed() -> None:
    repairer = FieldRepairer(np.ones((4, 5), np.bool_), MOVES["octile"], (2, 1))
    blocked = repairer.repair(blocked=[(2, 1), (0, 0)])
    assert (blocked.exact == -1).all()
    assert np.isinf(blocked.luciferin).all()
    assert (repairer.repair(freed=[(0, 0)]).exact == -1).all()
    again = repairer.repair(freed=[(2, 1)])
    assert same(again, solve(np.ones((4, 5), np.bool_), MOVES["octile"], (2, 1)))
    assert again.revision == 3
    assert (
        FieldRepairer(~np.ones((2, 2), np.bool_), MOVES["four-connected"], (0, 0))
        .repair(freed=[(0, 0)])
        .exact[0, 0]
        == 0
    )


@pytest.mark.parametrize("moves", ["octile", "dissertation"])
@pytest.mark.parametrize("is_free", [True, False])
def test_costs_that_were_worked_out_alone_are_taken_over(moves: str, is_free: bool) -> None:
    """Luciferin is added, and the field is then repaired as one that had it from the beginning."""
    rng = np.random.default_rng(5)
    free = rng.random((23, 31)) > 0.3
    free[9, 12] = is_free
    free.flags.writeable = False
    shares = (1.0 - RHO, GAMMA, float(MOVES[moves].unit))
    solved = fill(free, None, MOVES[moves], (12, 9), shares, last="step")
    one = FieldRepairer(free, MOVES[moves], (12, 9), solved=solved)
    other = FieldRepairer(free, MOVES[moves], (12, 9))
    assert same(one.field, other.field)
    assert one.field.expansions == other.field.expansions
    for _ in range(20):
        cells = [(int(rng.integers(31)), int(rng.integers(23))) for _ in range(2)]
        assert same(
            one.repair(blocked=cells[:1], freed=cells[1:]), other.repair(blocked=cells[:1], freed=cells[1:])
        )


def test_work_is_in_proportion_to_what_changed() -> None:
    """One wall, far from the goal: tens of cells out of ninety thousand."""
    free = np.random.default_rng(22).random((300, 300)) >= 0.1
    free[150, 150] = True
    repairer = FieldRepairer(free, MOVES["octile"], (150, 150))
    assert repairer.field.expansions > 70_000
    work = []
    for x, y in np.random.default_rng(23).integers(0, 300, (200, 2)).tolist():
        if free[y, x] and (x, y) != (150, 150):
            work.append(repairer.repair(blocked=[(x, y)]).expansions)
            work.append(repairer.repair(freed=[(x, y)]).expansions)
    assert repairer.solved == 1
    assert np.median(work) < 30
    assert max(work) < 10_000
    assert repairer.repair().expansions == repairer.repair(blocked=[(0, 0)], freed=[]).expansions * 0
    assert same(repairer.repair(freed=[(0, 0)]), repairer.snapshot())


def test_costs_that_outgrow_32_bits() -> None:
    """A field over terrain begins with narrow costs; one wall makes its ways longer than they can hold."""
    free = np.ones((3, 600), dtype=np.bool_)
    free[1, :-1] = False
    free[1, 0] = True
    moves = Moves("long", MOVES["four-connected"].offsets, (63 * 3000,) * 4, 63 * 3000, False, 63)
    terrain = np.full(free.shape, 252, dtype=np.uint8)
    repairer = FieldRepairer(free, moves, (0, 0), terrain=terrain)
    narrow = repairer.field.exact.dtype
    field = repairer.repair(blocked=[(0, 1)])
    free[1, 0] = False
    assert same(field, solve(free, moves, (0, 0), terrain=terrain))
    assert (narrow, field.exact.dtype) == (np.int32, np.int64)
    free[1, 0] = True
    assert same(repairer.repair(freed=[(0, 1)]), solve(free, moves, (0, 0), terrain=terrain))


def test_fields_are_views_until_the_next_repair_and_snapshots_for_good() -> None:
    free = np.ones((6, 7), dtype=np.bool_)
    repairer = FieldRepairer(free, MOVES["octile"], (3, 3))
    free[:] = False
    first, kept = repairer.field, repairer.snapshot()
    assert first.free.all()
    second = repairer.repair(blocked=[(2, 3)])
    assert first.exact.base is second.exact.base
    assert not same(first, kept)
    assert same(kept, solve(np.ones((6, 7), np.bool_), MOVES["octile"], (3, 3)))
    for what in ARRAYS:
        for field in (second, kept):
            with pytest.raises(ValueError, match="read-only"):
                getattr(field, what)[0, 0] = 0


@pytest.mark.parametrize(
    "way", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one)), FieldRepairer.copy]
)
def test_copies_are_repaired_apart(way: Callable[[FieldRepairer], FieldRepairer]) -> None:
    """What a copy showed, before, was not what it repaired."""
    free = np.random.default_rng(24).random((12, 15)) >= 0.2
    free[4, 4] = True
    first = FieldRepairer(free, MOVES["octile"], (4, 4))
    first.repair(blocked=[(5, 5)])
    second = way(first)
    assert same(second.field, first.field)
    assert (second.field.revision, second.padded.cost.base is None) == (1, False)
    for one, cell in ((second, (3, 4)), (first, (4, 5))):
        one.repair(blocked=[cell])
    for one, cell in ((second, (3, 4)), (first, (4, 5))):
        now = free.copy()
        now[5, 5] = now[cell[1], cell[0]] = False
        assert same(one.field, solve(now, MOVES["octile"], (4, 4)))
        assert np.array_equal(one.padded.frame.inside(one.padded.cost), one.field.exact)
        with pytest.raises(ValueError, match="read-only"):
            one.field.exact[0, 0] = 0


@pytest.mark.parametrize(
    ("given", "error", "word"),
    [
        ({"blocked": [(1, 1), (3, 0)]}, SceneError, "CHANGE_OUTSIDE"),
        ({"freed": [(0, -1)]}, SceneError, "CHANGE_OUTSIDE"),
        ({"terrain": [((0, 2), 3)]}, SceneError, "CHANGE_OUTSIDE"),
        ({"terrain": [((0, 0), 253)]}, SettingError, "GRID_TERRAIN"),
        ({"terrain": [((0, 0), 1.5)]}, SettingError, "GRID_TERRAIN"),
    ],
)
def test_mistakes_change_nothing(given: dict[str, object], error: type[Exception], word: str) -> None:
    repairer = FieldRepairer(
        np.ones((2, 3), np.bool_),
        MOVES["four-connected"].weighed(),
        (0, 0),
        terrain=np.zeros((2, 3), np.uint8),
    )
    before = repairer.snapshot()
    with pytest.raises(error, match=word):
        repairer.repair(**{"blocked": [(1, 0)], **given})  # type: ignore[arg-type]
    assert same(repairer.field, before)
    assert repairer.field.revision == 0


def test_what_a_repairer_cannot_keep() -> None:
    plain = FieldRepairer(np.ones((2, 3), np.bool_), MOVES["four-connected"], (0, 0))
    with pytest.raises(SettingError, match="field that has none"):
        plain.repair(terrain=[((1, 1), 5)])
    with pytest.raises(SettingError, match="opposite"):
        FieldRepairer(np.ones((2, 2), np.bool_), Moves("east", ((1, 0),), (10,), 10, False), (0, 0))
    with pytest.raises(SettingError, match="RHO"):
        FieldRepairer(np.ones((2, 2), np.bool_), MOVES["four-connected"], (0, 0), rho=0.0)
    with pytest.raises(SceneError, match="GOAL_OUTSIDE"):
        FieldRepairer(np.ones((2, 2), np.bool_), MOVES["four-connected"], (2, 0))


@pytest.mark.nightly
def test_pell_costs_stay_exact_far_from_the_goal() -> None:
    """A comb of corridors, thousands of steps long, shortened in the middle by one cell."""
    free = np.ones((41, 400), dtype=np.bool_)
    free[1::4, :-1] = False
    free[3::4, 1:] = False
    repairer = FieldRepairer(free, MOVES["octile"], (0, 0))
    free[21, 10] = True
    field = repairer.repair(freed=[(10, 21)])
    cost, _ = field_twin.field(free.tolist(), "octile", (0, 0))
    longest = max(cost.values())
    assert int(field.exact.max()) == int(longest.n) * PELL_Q + int(longest.m) * PELL_P
    assert same(field, solve(free, MOVES["octile"], (0, 0)))
