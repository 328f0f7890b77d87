"""Fields with sealed cells, repaired from one to the next: each is the one solved from scratch."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning import field_cache
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import solve
from lampyris.planning.field_cache import FieldCache
from lampyris.planning.living_map import LivingMap
from lampyris_selfcheck.reference.paths.edit_stories import story


@pytest.mark.nightly
def test_every_field_asked_for_is_the_one_solved_from_scratch() -> None:
    asked = spent = 0
    for number in range(40):
        told = story(31, number)
        scene = Scene(Grid(told.blocked, terrain=told.terrain), told.start, told.goal, told.name)  # type: ignore[arg-type]
        living, under_walls = LivingMap(scene), {}
        grounds = FieldCache(living, moves_for(scene), told.goal, rho=0.4, gamma=0.6)
        rng = np.random.default_rng(number)
        height, width = told.blocked.shape
        for edit in told.edits:
            change = Change(blocked=edit.blocked, freed=edit.freed, terrain=edit.terrain)
            altered = living.take(change)
            weighed = moves_for(scene).scale
            scene = edited(scene, change, under_walls)
            if moves_for(scene).scale != weighed:
                break
            grounds.altered(altered)
            for _ in range(5):
                count = int(rng.integers(0, 4))
                sealed = frozenset(
                    (int(rng.integers(width)), int(rng.integers(height))) for _ in range(count)
                )
                free = free_space(scene).copy()
                for x, y in sealed:
                    free[y, x] = False
                before = grounds.spent
                got = grounds.sealed(sealed)
                wanted = solve(free, moves_for(scene), told.goal, terrain=scene.grid.terrain)
                np.testing.assert_array_equal(got.frame.inside(got.cost), wanted.exact)
                np.testing.assert_array_equal(got.frame.inside(got.step), wanted.step)
                np.testing.assert_array_equal(got.frame.inside(got.luciferin), wanted.luciferin)
                np.testing.assert_array_equal(got.frame.inside(got.free), wanted.free)
                if scene.grid.terrain is not None:
                    np.testing.assert_array_equal(got.frame.inside(got.terrain), scene.grid.terrain)
                asked += wanted.expansions
                spent += grounds.spent - before
        assert len(grounds._kept) <= field_cache.KEPT + 1
    assert 0 < spent < asked


def test_a_field_once_asked_for_is_kept() -> None:
    living = LivingMap(Scene(Grid(np.zeros((40, 40), np.bool_)), (0, 0), (20, 20)))
    grounds = FieldCache(living, MOVES["octile"], (20, 20), rho=0.4, gamma=0.6)
    sets = [frozenset[tuple[int, int]](), *(frozenset({(k, 3), (k, 4)}) for k in range(3))]
    for sealed in sets:
        grounds.sealed(sealed)
    assert 1600 < grounds.spent < 2 * 1600, "one field was solved, three were repaired"
    before = grounds.spent
    for sealed in sets * 2:
        grounds.sealed(sealed)
    assert grounds.spent == before
    bare = grounds.sealed(sets[0])
    grounds.sealed(frozenset({(9, 9)}))
    assert grounds.spent > before
    assert (bare.frame.inside(bare.cost) == solve(living.free, MOVES["octile"], (20, 20)).exact).all()


def test_a_copy_goes_its_own_way() -> None:
    free = np.ones((12, 12), np.bool_)
    one = FieldRepairer(free, MOVES["sixteen-connected"], (5, 5))
    one.repair(blocked=[(4, 4)])
    two = one.copy()
    one.repair(blocked=[(6, 6)])
    two.repair(freed=[(4, 4)])
    assert (two.field.exact == solve(free, MOVES["sixteen-connected"], (5, 5)).exact).all()
    free[4, 4] = free[6, 6] = False
    assert (one.field.exact == solve(free, MOVES["sixteen-connected"], (5, 5)).exact).all()
    assert two.field.revision == 2


def test_ad_gso_pays_for_a_wall_what_it_changes() -> None:
    """A wall found ahead of the robot on a map of ten thousand cells: no field is solved for it."""
    blocked = np.random.default_rng(2).random((100, 100)) < 0.15
    blocked[50, 3] = blocked[50, 96] = False
    session = AdGso().open(Scene(Grid(blocked), (3, 50), (96, 50)), np.random.default_rng(0))
    plan = first = session.plan()
    assert first.expansions > 7000
    for _ in range(3):
        assert plan.cells is not None
        robot, wall = (tuple(plan.cells[k].tolist()) for k in (1, 5))
        plan = session.plan(Change(robot=robot, blocked=(wall,)))
        assert plan.status == first.status
        assert plan.expansions < first.expansions / 2
