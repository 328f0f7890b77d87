"""D*, Focussed D*, LPA* and D* Lite; that each edit is answered as from scratch is the check ``repair``."""

from __future__ import annotations

import importlib
import inspect
import pickle
import sys
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from lampyris.errors import SceneError, SettingError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Planner
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space
from lampyris.planning.field.solve import solve_field
from lampyris.planning.incremental import search as _incremental_search
from lampyris.planning.incremental.dstar import DStar
from lampyris.planning.incremental.dstar_lite import DStarLite
from lampyris.planning.incremental.focussed_dstar import FocussedDStar
from lampyris.planning.incremental.lpa_star import LpaStar
from lampyris.planning.living_map import LivingMap
from lampyris_selfcheck.checks.changes.repair_story import plan_through
from lampyris_selfcheck.reference.paths.edit_stories import story
from reference.kernel_forms import use

PLANNERS: list[Planner] = [DStar(), FocussedDStar(), LpaStar(), DStarLite()]
RNG = np.random.default_rng(0)  # Never drawn from: these planners are deterministic.

each = pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)


def grid_of(rows: list[str]) -> Grid:
    return Grid(np.array([[c == "#" for c in row] for row in rows]))


@pytest.mark.commit(1)
@each
@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_both_forms_of_the_kernels_do_the_same(
    planner: Planner, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lives() -> list[tuple[object, ...]]:
        out = []
        for number in range(12):
            told = story(3, number)
            scene = Scene(Grid(told.blocked, terrain=told.terrain), told.start, told.goal, told.name)  # type: ignore[arg-type]
            session = planner.open(scene, RNG)
            for edit in told.edits:
                change = Change(edit.robot, edit.obstacles, edit.blocked, edit.freed, edit.terrain)
                plan = session.plan(change)
                cells = None if plan.cells is None else plan.cells.tolist()
                out.append((plan.status, plan.expansions, plan.detail, cells))
        return out

    as_it_comes = lives()
    use(monkeypatch, form)
    assert lives() == as_it_comes


# ---- seeded defects ----------------------------------------------------------------------------------------


CHAIN = [
    "kernels.incremental.queue",
    "kernels.incremental.dstar",
    "kernels.incremental.dstar_lite",
    "planning.living_map",
]
CHAIN += ["planning.incremental.search", "planning.incremental.session"]
"""Modules that a defect may be seeded in, each before those that import it."""


def with_defect(monkeypatch: pytest.MonkeyPatch, planner: Planner, where: str, old: str, new: str) -> Planner:
    """The planner as it would be with one piece of one module's source replaced. Plain kernels only: what is
    compiled is kept on disk under the name of the true source."""
    use(monkeypatch, "plain")
    for name in [*CHAIN, type(planner).__module__.removeprefix("lampyris.")]:
        module = importlib.import_module(f"lampyris.{name}")
        source = inspect.getsource(module)
        if name == where:
            assert source.count(old) == 1, f"{old!r} is in {name} {source.count(old)} times"
            source = source.replace(old, new)
        copy = ModuleType(module.__name__)
        copy.__file__ = module.__file__
        monkeypatch.setitem(sys.modules, module.__name__, copy)
        package, _, last = module.__name__.rpartition(".")
        monkeypatch.setattr(sys.modules[package], last, copy)
        exec(compile(source, str(module.__file__), "exec"), copy.__dict__)
    wrong: Planner = getattr(copy, type(planner).__name__)()
    return wrong


DEFECTS: dict[str, tuple[Planner, str, str, str]] = {
    # The two that the most copied D* has.
    "D*: elif instead of the fresh test": (
        DStar(),
        "kernels.incremental.dstar",
        '        # Not "else"',
        '            continue\n        # Not "else"',
    ),
    "D*: insert(y, x.h)": (
        DStar(),
        "kernels.incremental.dstar",
        "                    _insert(h, low, key, heap, place, setup, cell, h[u])\n            elif",
        "                    _insert(h, low, key, heap, place, setup, there, h[u])\n            elif",
    ),
    "D*: k is the last h, not the least": (
        DStar(),
        "kernels.incremental.dstar",
        "    low[u] = cost if cost < least else least\n",
        "    low[u] = cost\n",
    ),
    "Focussed D*: the bias is forgotten": (
        FocussedDStar(),
        "planning.incremental.search",
        "        ground.bias += ground.place(robot)\n",
        "        ground.place(robot)\n",
    ),
    "D* Lite: k_m is forgotten": (
        DStarLite(),
        "planning.incremental.search",
        "        ground.bias += ground.place(robot)\n",
        "        ground.place(robot)\n",
    ),
    "LPA*: keys are not made anew": (
        LpaStar(),
        "planning.incremental.search",
        "            self._queue.renew(self.ground)\n",
        "            pass\n",
    ),
    "D* Lite: only the changed cell looks ahead": (
        DStarLite(),
        "kernels.incremental.dstar_lite",
        "        for k in range(-1, len(jump)):\n",
        "        for k in range(-1, 0):\n",
    ),
    "D* Lite: a raised cell is not told to those that cost as much through it": (
        DStarLite(),
        "kernels.incremental.dstar_lite",
        "            elif rhs[s] == old + toll and cell + jump[k] != setup[GOAL]:",
        "            elif False:",
    ),
    "the metric is straight distance, for diagonals too": (
        DStarLite(),
        "kernels.incremental.queue",
        "    one = setup[SLOPE] * a + setup[SLOPE + 1] * b\n",
        "    one = setup[SLOPE] * (a + b)\n",
    ),
    "what a step touches on its way is not looked at": (
        LpaStar(),
        "planning.incremental.search",
        "(jump, side, other, prices)",
        "(jump, jump, jump, prices)",
    ),
    "a map takes in walls, not that they are gone": (
        DStarLite(),
        "planning.living_map",
        "        turned = dict.fromkeys(change.freed, False) | dict.fromkeys(change.blocked, True)\n",
        "        turned = dict.fromkeys(change.blocked, True)\n",
    ),
}


@pytest.mark.commit(4)
@pytest.mark.parametrize("name", DEFECTS)
def test_seeded_defects_are_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    planner, where, old, new = DEFECTS[name]
    wrong = with_defect(monkeypatch, planner, where, old, new)

    def lives() -> None:
        for number in range(150):
            plan_through(story(1, number), [wrong], Budget(20_000))

    with pytest.raises(AssertionError):
        lives()


@pytest.mark.nightly
def test_the_machinery_of_defects_leaves_a_planner_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    for planner in PLANNERS:
        with monkeypatch.context() as patch:
            same = with_defect(patch, planner, "kernels.incremental.dstar", "NEW = -2", "NEW = -2")
            for number in range(10):
                plan_through(story(1, number), [same])


# ---- the map ----------------------------------------------------------------------------------------------


def test_a_living_map_is_the_edited_scene() -> None:
    for number in range(80):
        told = story(4, number)
        scene = Scene(Grid(told.blocked, terrain=told.terrain, resolution=0.5), told.start, told.goal)  # type: ignore[arg-type]
        scene = replace(scene, robot=Robot(radius=told.radius))
        living, under_walls = LivingMap(scene), {}
        for edit in told.edits:
            change = Change(edit.robot, edit.obstacles, edit.blocked, edit.freed, edit.terrain)
            free, terrain = (
                living.free.copy(),
                living.terrain if living.terrain is None else living.terrain.copy(),
            )
            altered = living.take(change)
            scene = edited(scene, change, under_walls)
            np.testing.assert_array_equal(living.free, free_space(scene))
            assert living.has_terrain == (scene.grid.terrain is not None)
            if scene.grid.terrain is not None:
                np.testing.assert_array_equal(living.terrain, scene.grid.terrain)
            differ = living.free != free
            if living.terrain is not None:
                differ |= living.terrain != (0 if terrain is None else terrain)
            assert sorted(altered) == sorted((int(x), int(y)) for y, x in np.argwhere(differ))


# ---- sessions ---------------------------------------------------------------------------------------------


@each
def test_planners_are_values(planner: Planner) -> None:
    assert isinstance(planner, Planner)
    assert planner == type(planner)() == pickle.loads(pickle.dumps(planner))
    assert planner.traits.optimal
    assert planner.traits.incremental
    assert not planner.traits.stochastic


@each
def test_the_way_is_the_fields(planner: Planner) -> None:
    rng = np.random.default_rng(6)
    for name, moves in MOVES.items():
        blocked = rng.random((30, 35)) < 0.25
        blocked[3, 3] = blocked[25, 30] = False
        scene = Scene(Grid(blocked), (3, 3), (30, 25), name)
        field, plan = solve_field(scene), planner.open(scene, RNG).plan()
        cells = [(3, 3)]
        while cells[-1] != (30, 25) and plan:
            x, y = cells[-1]
            dx, dy = moves.offsets[field.step[y, x]]
            cells.append((x + dx, y + dy))
        assert plan.cells is None or [tuple(c) for c in plan.cells.tolist()] == cells


@each
def test_work_is_in_proportion_to_what_changed(planner: Planner) -> None:
    blocked = np.random.default_rng(7).random((120, 120)) < 0.1
    blocked[60, 2] = blocked[60, 117] = blocked[60, 4] = False
    session = planner.open(Scene(Grid(blocked), (2, 60), (117, 60)), RNG)
    first = session.plan()
    assert session.plan().expansions == 0
    assert first.cells is not None
    second = session.plan(Change(blocked=(tuple(first.cells[3].tolist()),)))  # type: ignore[arg-type]
    assert second.status is Status.FOUND
    assert second.expansions < first.expansions / 4
    third = session.plan(Change(robot=tuple(second.cells[8].tolist())))  # type: ignore[arg-type, index]
    assert third.expansions <= 2
    assert session.plan(Change(blocked=((2, 2),), freed=((1, 1),))).expansions < first.expansions / 4


@each
def test_enclosed_is_an_answer_with_the_sizes_of_both_regions(planner: Planner) -> None:
    session = planner.open(Scene(grid_of(["...#.", "..#..", ".####"]), (0, 0), (4, 0), "four-connected"), RNG)
    plan = session.plan()
    assert plan.status is Status.NO_PATH
    assert "start region 6 cells, goal region 3 cells" in plan.sentence
    again = session.plan()
    assert (again.status, again.sentence) == (plan.status, plan.sentence)
    assert session.plan(Change(freed=((3, 0),))).steps == (4, 0)
    hemmed = session.plan(Change(obstacles=frozenset({(3, 0)})))
    assert hemmed.status is Status.HEMMED_IN
    assert "moving obstacles close it" in hemmed.sentence
    assert session.plan().status is Status.FOUND
    assert session.plan(Change(blocked=((3, 0),))).sentence == plan.sentence


@each
def test_walls_obstacles_and_ends(planner: Planner) -> None:
    scene = Scene(grid_of(["....", ".##.", "...."]), (0, 0), (3, 0))
    one = planner.open(scene, RNG)
    assert one.plan(Change(obstacles=frozenset({(0, 0), (3, 0), (1, 1), (-1, 0), (9, 9)}))).steps == (3, 0)
    assert one.plan(Change(obstacles=frozenset({(1, 0)}))).steps == (7, 0)
    assert one.plan().steps == (3, 0)
    assert one.plan(Change(blocked=((2, 0),))).steps == (7, 0)
    assert one.plan(Change(robot=(0, 2))).cells.tolist()[0] == [0, 2]
    assert one.plan(Change(blocked=((0, 1),), robot=(0, 0))).status is Status.NO_PATH
    assert one.plan(Change(freed=((2, 0), (0, 1)))).steps == (3, 0)
    assert one.plan(Change(blocked=((1, 0),), freed=((1, 0),))).steps == (7, 0), "a cell in both is blocked"
    assert one.plan(Change(blocked=((0, 0),))).status is Status.START_OCCUPIED
    assert one.plan(Change(freed=((0, 0),), blocked=((3, 0),))).status is Status.GOAL_OCCUPIED
    assert one.plan(Change(freed=((3, 0), (1, 0)))).steps == (3, 0)
    assert not scene.grid.blocked[0, 1], "the scene itself is never touched"


@pytest.mark.nightly
@each
def test_a_spent_budget_leaves_the_session_usable(planner: Planner) -> None:
    for number in range(40):
        told = story(5, number)
        scene = Scene(Grid(told.blocked, terrain=told.terrain), told.start, told.goal, told.name)  # type: ignore[arg-type]
        whole, pieces = planner.open(scene, RNG), planner.open(scene, RNG)
        for edit in told.edits:
            change: Change | None = Change(edit.robot, edit.obstacles, edit.blocked, edit.freed, edit.terrain)
            wanted, spent = whole.plan(change), 0
            while True:
                plan = pieces.plan(change, Budget(7))
                assert plan.expansions <= 7
                spent += plan.expansions
                if plan.status is not Status.LIMIT or spent > 10 * wanted.expansions + 100:
                    break
                change = Change(obstacles=edit.obstacles)
            if wanted.status is Status.FOUND:
                assert _essence(plan) == _essence(wanted)
                assert spent == wanted.expansions
            else:
                # What is left of a piece may not do for the reason why.
                assert plan.status in (wanted.status, Status.LIMIT)


def _essence(plan: Plan) -> tuple[object, ...]:
    return plan.status, None if plan.cells is None else plan.cells.tolist(), plan.optimal_exact


@pytest.mark.commit(1)
@each
def test_a_bias_that_grows_too_great_is_dropped(planner: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_incremental_search, "_MOST_BIAS", 25)
    for number in range(0, 40, 2):
        plan_through(story(8, number), [planner])


@each
def test_mistakes_are_refused_and_change_nothing(planner: Planner) -> None:
    one = planner.open(Scene(grid_of(["...", "..."]), (0, 0), (2, 0)), RNG)
    for change in (
        Change(robot=(3, 0)),
        Change(blocked=((0, 1), (1, 0), (0, 2))),
        Change(freed=((0, -1),)),
        Change(terrain=(((1, 0), 5), ((3, 0), 5))),
    ):
        with pytest.raises(SceneError, match="CHANGE_OUTSIDE"):
            one.plan(change)
    with pytest.raises(SettingError, match="GRID_TERRAIN"):
        one.plan(Change(terrain=(((1, 0), 253),), blocked=((1, 0),)))
    assert one.plan().steps == (2, 0)


@each
def test_the_first_terrain_of_a_map_and_the_last(planner: Planner) -> None:
    one = planner.open(Scene(grid_of(["...", "..."]), (0, 0), (2, 0), "four-connected"), RNG)
    assert one.plan().cost == 2.0
    heavy = one.plan(Change(terrain=(((1, 0), 252),)))
    assert (heavy.cost, heavy.path.moves.scale, heavy.steps) == (4.0, 63, (4, 0))
    assert one.plan(Change(terrain=(((1, 1), 126),))).cost == 6.0
    plain = one.plan(Change(terrain=(((1, 0), 0), ((1, 1), 0))))
    assert (plain.cost, plain.path.moves.scale) == (2.0, 1)
