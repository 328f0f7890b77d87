"""A cell that is blocked and freed again by changes has the terrain that it had before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris.model.change import Change
from lampyris.model.edit import Edit, applied
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Planner
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import solve
from lampyris.planning.living_map import LivingMap
from lampyris.sim.grid.loop import Simulation
from sizes import sized

MAPS = 6


def small(name: str) -> Planner:
    known = registry.settings_of(registry.planner_class(name))
    return registry.make(name, {k: v for k, v in (("swarm", 5), ("iterations", 2)) if k in known})


PLANNERS = [*map(small, registry.names()), AdGso(obstacle_density_weight=1.0), AdGso(choice="exact")]


def labels(planner: Planner) -> str:
    return repr(planner)[:60]


def life(number: int) -> tuple[Scene, list[tuple[Change, Grid]]]:
    """A map with terrain, and changes that block and free its cells, each with the map as it is then."""
    rng = np.random.default_rng([9, number])
    height, width = (int(n) for n in rng.integers(6, 14, 2))
    blocked = rng.random((height, width)) < 0.15
    terrain = rng.integers(1, 253, (height, width)) * (rng.random((height, width)) < 0.6)
    start, goal = (0, 0), (width - 1, height - 1)
    blocked[0, 0] = blocked[-1, -1] = False
    grid = Grid(blocked, terrain=terrain)
    robot = Robot(radius=0.8 if number % 3 == 2 else 0.0)
    moves = list(MOVES.values())[number % 4]
    ground = np.where(blocked, 0, terrain)
    changes = []
    # Few cells turn again and again.
    pool = [(x, y) for x in range(width) for y in range(height) if (x, y) not in (start, goal)]
    pool = [pool[k] for k in rng.permutation(len(pool))[: len(pool) // 3].tolist()]
    for _ in range(8):
        cells = [pool[k] for k in rng.permutation(len(pool))[: len(pool) // 2].tolist()]
        closed = tuple(c for c in cells if not blocked[c[1], c[0]])
        opened = tuple(c for c in cells if blocked[c[1], c[0]])
        graded = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(int(rng.integers(3)))]
        values = {c: int(rng.choice([0, 7, 252])) for c in graded}
        for x, y in (*closed, *opened):
            blocked[y, x] = not blocked[y, x]
        for (x, y), value in values.items():
            if not blocked[y, x]:
                ground[y, x] = value
        change = Change(blocked=closed, freed=opened, terrain=tuple(values.items()))
        changes.append((change, Grid(blocked, terrain=ground)))
    return Scene(grid, start, goal, moves, robot), changes


@pytest.mark.commit(3)
@sized("cases", 2, MAPS)
@pytest.mark.parametrize("planner", PLANNERS, ids=labels)
def test_a_session_restores_terrain_as_a_session_opened_anew_has_it(planner: Planner, cases: int) -> None:
    for number in range(cases):
        scene, changes = life(number)
        session = planner.open(scene, np.random.default_rng(1))
        session.plan()
        for change, grid in changes:
            now = replace(scene, grid=grid)
            plan = session.plan(change)
            anew = planner.open(now, np.random.default_rng(1)).plan()
            assert plan.status == anew.status
            if plan.path is None or anew.path is None:
                continue
            free, moves = free_space(now), moves_for(now)
            best = int(solve(free, moves, now.goal, terrain=grid.terrain).exact[now.start[1], now.start[0]])
            if type(planner).traits.optimal:
                assert plan.path.exact == anew.path.exact == best
            if plan.waypoints is None and len(plan.path.cells) > 1:
                assert plan.path.exact == path_of(plan.path.cells, plan.path.moves, grid.terrain).exact
            assert plan.optimal_exact in (None, anew.optimal_exact)


def test_maps_kept_by_sessions_restore_terrain() -> None:
    for number in range(12):
        scene, changes = life(number)
        living, under_walls, now = LivingMap(scene), {}, scene
        for change, grid in changes:
            living.take(change)
            now = edited(now, change, under_walls)
            assert living.terrain is not None
            np.testing.assert_array_equal(living.terrain, grid.terrain)
            np.testing.assert_array_equal(now.grid.terrain, grid.terrain)


def test_terrain_set_to_zero_is_not_restored_from_before() -> None:
    """The last terrain of a map goes; a wall comes and goes where it was."""
    terrain = np.zeros((3, 5), dtype=np.uint8)
    terrain[1, 2] = 200
    scene = Scene(Grid(np.zeros((3, 5), dtype=bool), terrain=terrain), (0, 1), (4, 1))
    story = (
        Change(blocked=((2, 1),)), Change(freed=((2, 1),)), Change(terrain=(((2, 1), 0),)),
        Change(blocked=((2, 1),)), Change(freed=((2, 1),)),
    )  # fmt: skip
    living, under_walls, now = LivingMap(scene), {}, scene
    for change in story:
        living.take(change)
        now = edited(now, change, under_walls)
    assert not living.has_terrain
    assert now.grid.terrain is None


def test_a_field_that_is_repaired_has_the_terrain_again() -> None:
    for number in range(12):
        scene, _ = life(number)
        moves, terrain = MOVES[scene.moves.name].weighed(), scene.grid.terrain
        repairer = FieldRepairer(~scene.grid.blocked, moves, scene.goal, terrain=terrain)
        before = repairer.snapshot()
        free = [(int(x), int(y)) for y, x in np.argwhere(~scene.grid.blocked)]
        cells = [c for c in free if c != scene.goal][::3]
        repairer.repair(blocked=cells)
        after = repairer.repair(freed=cells)
        for what in ("exact", "step", "luciferin"):
            np.testing.assert_array_equal(getattr(after, what), getattr(before, what))


def test_a_simulation_has_the_terrain_again_that_edits_covered() -> None:
    terrain = np.full((7, 9), 100, dtype=np.uint8)
    edits = (Edit(1, blocked=((4, 3), (4, 4))), Edit(3, freed=((4, 3), (4, 4))))
    scene = Scene(Grid(np.zeros((7, 9), dtype=bool), terrain=terrain), (0, 3), (8, 3), edits=edits)
    run = Simulation(scene, registry.make("dstar-lite", {}), seed=0)
    while run.outcome is None and run.now < 4:
        run.tick()
    np.testing.assert_array_equal(run.walls.scene.grid.terrain, applied(scene.grid, edits).terrain)
