"""Walls that come and go: exhaustively on small maps, and turned over.

At random over all planners: the check ``sim``, kind ``edits``.
"""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from edit_scenes import judged, record, seeded_scene
from sim_planners import Breadth, grid_of

from lampyris import referee
from lampyris.errors import SceneError
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.traffic import Patrol
from lampyris.planning import registry
from lampyris.sim.grid.loop import run
from lampyris_selfcheck.checks.traffic.sim_scenes import KINDS, with_edits
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor
from lampyris_selfcheck.reference.paths.search import distances
from sizes import some

# ---- exhaustively --------------------


def least(walls, here, goal):
    """Straight steps and diagonals of a cheapest path on a map of 3 x 3; None: there is none."""
    free = [[(x, y) not in walls for x in range(3)] for y in range(3)]
    counts = distances(free, "octile", goal).get(here) if free[goal[1]][goal[0]] else None
    return None if counts is None else counts[:2]


@pytest.mark.nightly
@pytest.mark.parametrize("name", some(["lpa-star", "astar"]))
def test_every_edit_of_a_small_room(name):
    """3 x 3, every set of cells at tick 1: the robot arrives exactly where it can, by a best way."""
    cells = [(x, y) for y in range(3) for x in range(3)]
    planner, ended = registry.make(name, {}), Counter()
    for bits in range(512):
        some = tuple(c for k, c in enumerate(cells) if bits >> k & 1)
        scene = Scene(grid_of("...", "...", "..."), (0, 0), (2, 2), edits=Edit(1, some))
        trace = run(scene, planner, patience=1)
        monitor = Monitor(trace)
        assert monitor.faults() == [], some
        assert referee.check_trace(trace) is None, some
        best = least(monitor.maps[1], (0, 0), (2, 2))
        assert trace.arrived == (best is not None), some
        if best is not None:
            assert trace.path.steps == best, some
        ended[trace.outcome] += 1
    assert min(ended.values()) > 30, ended


@pytest.mark.nightly
def test_every_pair_of_edits_of_a_lane():
    """4 x 2 with a body that patrols: every set walled at one tick and every set freed later."""
    cells = [(x, y) for y in range(2) for x in range(4)]
    planner, count = registry.make("astar", {}), 0
    for walls in itertools.product((False, True), repeat=6):
        some = tuple(c for c, w in zip(cells[1:7], walls, strict=True) if w)
        for kept in range(0, len(some) + 1, 2):
            edits = (Edit(1, some), Edit(3, cells[:1], some[kept:]))
            scene = Scene(
                grid_of("....", "...."), (0, 0), (3, 1), traffic=Patrol(((2, 0), (2, 1))), edits=edits
            )
            trace = run(scene, planner, patience=4)
            assert Monitor(trace).faults() == [], edits
            assert referee.check_trace(trace) is None, edits
            count += 1
    assert count > 120


# ---- turned over --------------------


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", ["astar", "ad-gso", "sipp", "dstar-lite"])
def test_an_edit_at_tick_0_is_the_edited_map(name):
    planner = registry.make(name, {})
    for seed in range(6):
        scene = seeded_scene(seed, "random-walk")
        rng = np.random.default_rng(seed)
        xs, ys = rng.integers(3, scene.grid.width - 3, 9), rng.integers(3, scene.grid.height - 3, 9)
        cells = list(dict.fromkeys(zip(xs.tolist(), ys.tolist(), strict=True)))
        edit = Edit(0, tuple(cells[:6]), tuple(cells[6:]))
        edited = Scenario(scene, edits=(edit,)).scene
        by_hand = replace(scene, grid=Grid(edited.grid.blocked))
        assert record(run(edited, planner, seed=seed)) == record(run(by_hand, planner, seed=seed))


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", ["astar", "dijkstra", "jps", "dstar-lite", "lpa-star"])
def test_a_wall_in_nobodys_way_changes_no_track(name):
    planner, checked = registry.make(name, {}), 0
    for seed in range(8):
        scene = replace(seeded_scene(seed, "random-walk"), traffic=())
        plain = run(scene, planner)
        if not plain.arrived:
            continue
        way = {(x + dx, y + dy) for x, y in plain.robot.tolist() for dx in (-1, 0, 1) for dy in (-1, 0, 1)}
        off = [(x, y) for y in range(scene.grid.height) for x in range(scene.grid.width) if (x, y) not in way]
        edited = judged(run(replace(scene, edits=Edit(2, tuple(off))), planner))
        assert (edited.robot == plain.robot).all()
        assert edited.replans == plain.replans
        assert edited.expansions == plain.expansions
        checked += bool(edited.edits)
    assert checked >= 4


def test_what_is_so_already_does_not_turn():
    for seed in range(6):
        scene = seeded_scene(seed, "all")
        ys, xs = np.nonzero(scene.grid.blocked)
        walls = tuple(zip(xs.tolist(), ys.tolist(), strict=True))
        ys, xs = np.nonzero(~scene.grid.blocked)
        free = tuple(zip(xs.tolist(), ys.tolist(), strict=True))
        try:
            plain = run(scene, Breadth(), seed=seed)
        except SceneError:
            continue
        edited = judged(run(replace(scene, edits=(Edit(1, walls, free),)), Breadth(), seed=seed))
        assert record(edited) == record(plain)


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", ["astar", "ad-gso", "sipp"])
def test_what_comes_later_is_not_known_before(name):
    """Painting at the shown tick leaves what was shown as it was."""
    planner = registry.make(name, {})
    for seed in range(8):
        scene = seeded_scene(seed, KINDS[seed % 6])
        later = with_edits(scene, np.random.default_rng(seed))
        try:
            plain, edited = (run(s, planner, seed=seed, patience=9) for s in (scene, later))
        except SceneError:
            continue
        n = min(later.edits[0].tick, plain.ticks + 1)
        assert (plain.robot[:n] == edited.robot[:n]).all()
        assert (plain.speed[:n] == edited.speed[:n]).all()
        assert all(plain.obstacles_at(t) == edited.obstacles_at(t) for t in range(n))


def test_one_wall_at_once_or_cell_by_cell_in_the_ticks_before_anyone_looks():
    """Nobody but the planner at its next asking can tell, as long as no way is touched."""
    grid = Grid(np.zeros((9, 30), bool))
    cells = tuple((20 + k, 7) for k in range(4))
    once = Scene(grid, (0, 1), (29, 1), edits=Edit(4, cells))
    split = replace(once, edits=tuple(Edit(1 + k, (c,)) for k, c in enumerate(cells)))
    a, b = (judged(run(s, registry.make("astar", {}))) for s in (once, split))
    assert (a.robot == b.robot).all()
    assert (a.speed == b.speed).all()
    assert sorted(c for e in a.edits for c in e.blocked) == sorted(c for e in b.edits for c in e.blocked)
