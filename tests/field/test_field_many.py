"""Fields of many goals at once are those of one goal after the other."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris._core import cancellation
from lampyris.errors import SceneError, SettingError
from lampyris.model.field import Field
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.field import many
from lampyris.planning.field.many import solve_many
from lampyris.planning.field.solve import solve
from reference.kernel_forms import use
from sizes import some


@pytest.mark.nightly
@pytest.mark.parametrize("workers", some([2, 1, 5]))
@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_same_fields_in_the_order_of_the_goals(
    form: str, workers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    use(monkeypatch, form)
    rng = np.random.default_rng(3)
    free = rng.random((40, 50)) >= 0.2
    free.setflags(write=False)
    terrain = rng.integers(0, 253, free.shape).astype(np.uint8)
    goals = [(int(x), int(y)) for x, y in zip(rng.integers(0, 50, 30), rng.integers(0, 40, 30), strict=True)]
    for name in ("dissertation", "octile"):
        for moves, ground in ((MOVES[name], None), (MOVES[name].weighed(), terrain)):
            got = list(solve_many(free, moves, goals, terrain=ground, workers=workers))
            assert [f.goal for f in got] == goals
            for field in got:
                alone = solve(free, moves, field.goal, terrain=ground)
                for what in ("exact", "step", "luciferin"):
                    assert getattr(field, what).tobytes() == getattr(alone, what).tobytes()


def test_the_map_of_a_scene() -> None:
    rng = np.random.default_rng(8)
    blocked = rng.random((20, 30)) < 0.2
    blocked[0, 0] = blocked[19, 29] = False
    ground = np.where(blocked, 0, rng.integers(0, 200, blocked.shape)).astype(np.uint8)
    goals = [(0, 0), (29, 19), (3, 3)]
    for terrain, radius in ((None, 0.0), (ground, 0.0), (None, 1.2)):
        scene = Scene(Grid(blocked, terrain=terrain), (0, 0), (29, 19), robot=Robot(radius=radius))
        for goal, field in zip(goals, lampyris.solve_fields(scene, goals, gamma=0.5), strict=True):
            alone = lampyris.solve_field(replace(scene, goal=goal), gamma=0.5)
            assert field.goal == goal
            assert field.luciferin.tobytes() == alone.luciferin.tobytes()
            assert np.array_equal(field.exact, alone.exact)


def test_goals_are_drawn_as_fields_are_taken() -> None:
    free = np.ones((9, 9), dtype=bool)
    drawn = []

    def endless() -> Iterator[tuple[int, int]]:
        k = 0
        while True:
            drawn.append(k)
            yield k % 9, k // 9 % 9
            k += 1

    fields = solve_many(free, MOVES["octile"], endless(), workers=2)
    for k in range(5):
        assert next(fields).goal == (k, 0)
    assert len(drawn) <= 5 + 2 + 1
    fields.close()  # type: ignore[attr-defined]
    assert not [t for t in threading.enumerate() if t.name.startswith("lampyris-field")]


def test_a_goal_off_the_map_is_told_at_its_turn() -> None:
    fields = solve_many(np.ones((5, 5), dtype=bool), MOVES["octile"], [(1, 1), (7, 1)])
    assert next(fields).goal == (1, 1)
    with pytest.raises(SceneError, match="outside the map"):
        next(fields)


@pytest.mark.parametrize("workers", [0, -1, True, 1.5])
def test_workers_are_at_least_one(workers: int) -> None:
    with pytest.raises(SettingError, match="workers"):
        solve_many(np.ones((5, 5), dtype=bool), MOVES["octile"], [(1, 1)], workers=workers)


def test_the_limit_of_the_call_is_heard_by_the_threads_that_solve(monkeypatch: pytest.MonkeyPatch) -> None:
    free, stop = np.ones((30, 30), dtype=np.bool_), cancellation.CancelToken()
    first: list[Field] = []
    begun = threading.Barrier(2)

    def stopped_meanwhile(*args: Any, **how: Any) -> Field:
        if first:
            return solve(*args, **how)
        begun.wait(30)
        stop.set()
        return solve(*args, **how)

    monkeypatch.setattr(many, "solve", stopped_meanwhile)
    fields = many.solve_many(free, MOVES["octile"], [(0, 0), (5, 5)], workers=2)
    with cancellation.watching(stop=stop), pytest.raises(cancellation.Cancelled):
        first.append(next(fields))


def test_a_field_asked_for_in_a_call_that_is_over_is_solved_for_who_takes_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    free, stop, late = np.ones((30, 30), dtype=np.bool_), cancellation.CancelToken(), threading.Event()

    def held(*args: Any, **how: Any) -> Field:
        if args[2] == (5, 5) and not late.is_set():
            late.wait(30)
        return solve(*args, **how)

    monkeypatch.setattr(many, "solve", held)
    fields = many.solve_many(free, MOVES["octile"], [(x, x) for x in (0, 5, 9, 12)], workers=1)
    with cancellation.watching(stop=stop):
        assert next(fields).goal == (0, 0)
        stop.set()
    late.set()
    assert [field.goal for field in fields] == [(5, 5), (9, 9), (12, 12)]
