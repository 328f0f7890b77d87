"""Walls that come and go, by hand; and what takes a part of the rule out is caught."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from edit_scenes import LANE, judged, seeded_scene
from sim_planners import Breadth, Scripted, drive, fail, grid_of, row

import lampyris
from lampyris import referee
from lampyris.errors import SceneError, SettingError
from lampyris.model.edit import Edit, applied
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.planning import registry
from lampyris.sim.grid.editing import Walls
from lampyris.sim.grid.loop import run
from lampyris.sim.world.cell_index import Shape
from lampyris_selfcheck.checks.traffic.sim_scenes import with_edits
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor


def story(trace):
    return [(e.tick, e.word, e.cell) for e in trace.events]


# ---- by hand --------------------


def test_a_wall_across_the_way_is_driven_around():
    scene = Scene(LANE, (0, 1), (5, 1), edits=Edit(2, ((3, 0), (3, 1))))
    trace = judged(run(scene, registry.make("astar", {})))
    assert trace.arrived
    assert trace.robot.tolist() == [[0, 1], [1, 1], [2, 2], [3, 2], [4, 2], [5, 1]]
    assert story(trace) == [(2, "wall", (3, 0)), (2, "replan", (1, 1)), (5, "arrive", (5, 1))]
    assert trace.events[0].sentence == "2 cells turned into walls."
    assert trace.events[1].sentence == "Walls now block the path; replanned."
    assert (trace.replans, trace.waits) == (1, 0)
    assert trace.edits == scene.edits


def test_who_stands_there_and_the_goal_stay_free():
    patrol = Patrol(((4, 2),))
    scene = Scene(LANE, (0, 1), (5, 1), traffic=patrol, edits=Edit(2, ((1, 1), (4, 2), (5, 1), (0, 0))))
    trace = judged(run(scene, Scripted((drive(row(1, 0, 5)),))))
    assert trace.edits == (Edit(2, ((0, 0),)),)
    told = "1 cell turned into a wall. 3 cells stayed free: occupied, or the goal."
    assert trace.events[0].sentence == told
    only = replace(scene, edits=Edit(2, ((1, 1), (5, 1))))
    trace = judged(run(only, Scripted((drive(row(1, 0, 5)),))))
    assert trace.edits == ()
    assert trace.events[0].sentence.startswith("0 cells turned into walls. 2 cells stayed free")
    assert story(trace)[0] == (2, "wall", (1, 1))


def test_a_held_cell_is_not_tried_again():
    scene = Scene(LANE, (0, 1), (5, 1), edits=Edit(1, ((0, 1),)))
    trace = judged(run(scene, Breadth()))
    assert trace.arrived
    assert trace.edits == ()


def test_the_footprint_counts_not_the_own_cell():
    open_ = Grid(np.zeros((9, 14), bool))
    scene = Scene(open_, (2, 4), (11, 4), robot=Robot(radius=1.0), edits=Edit(1, ((3, 4), (3, 3), (4, 4))))
    trace = judged(run(scene, registry.make("astar", {})))
    assert trace.edits == (Edit(1, ((4, 4),)),)
    assert trace.arrived


def test_a_way_that_a_wall_only_narrows_is_asked_about():
    """The cells of the way stay free; a robot with a size does not fit any more."""
    open_ = Grid(np.zeros((11, 16), bool))
    way = [(x, 5) for x in range(2, 14)]
    scripted = Scripted((drive(way),))
    scene = Scene(open_, (2, 5), (13, 5), robot=Robot(radius=1.2), edits=Edit(1, ((8, 4),)))
    trace = run(scene, scripted, patience=1)
    assert (1, "replan", (2, 5)) in story(trace)
    assert scripted.told[1].blocked == ((8, 4),)


def test_a_corner_is_cut_off_by_a_wall_beside_the_way():
    way = [(0, 0), (1, 1), (2, 2)]
    for moves, asked in (("octile", True), ("dissertation", False)):
        scene = Scene(grid_of("...", "...", "..."), (0, 0), (2, 2), moves, edits=Edit(1, ((1, 2),)))
        trace = run(scene, Scripted((drive(way),)), ticks=3)
        assert ("replan" in [w for _, w, _ in story(trace)]) == asked, moves


def test_a_wall_elsewhere_is_told_at_the_next_asking_only():
    track = ((3, 1), (3, 1), (3, 1), (3, 1), (3, 0))
    scripted = Scripted((drive(row(1, 0, 5)),))
    scene = Scene(
        LANE, (0, 1), (5, 1), traffic=Recorded(track), edits=(Edit(1, ((0, 2),)), Edit(2, ((1, 2),)))
    )
    trace = judged(run(scene, scripted))
    assert trace.arrived
    first, then, *rest = scripted.told
    assert (first.blocked, first.freed) == ((), ())
    assert then.blocked == ((0, 2), (1, 2))
    assert then.tick >= 2
    assert all(c.blocked == () for c in rest)


def test_what_turns_free_is_told_at_once_with_its_ground():
    terrain = np.zeros((3, 6), np.uint8)
    terrain[0, 2] = 100
    scene = Scene(
        Grid(LANE.blocked, terrain=terrain), (0, 1), (5, 1),
        edits=(Edit(1, ((2, 0), (3, 0))), Edit(3, (), ((2, 0), (3, 0), (4, 0)))),
    )  # fmt: skip
    scripted = Scripted((drive(row(1, 0, 5)),))
    trace = run(scene, scripted)
    assert [c.tick for c in scripted.told] == [0, 2]
    last = scripted.told[-1]
    # What turned and turned back before the planner was asked is as it was.
    assert (last.blocked, last.freed) == ((), ((2, 0), (3, 0)))
    assert dict(last.terrain) == {(2, 0): 100, (3, 0): 0}
    assert [e.sentence for e in trace.events if e.word != "wall"][:2] == [
        "2 cells turned free.",
        "Walls are gone; replanned.",
    ]


def test_no_planner_is_shown_what_is_still_to_come():
    shown = []

    class Curious(Scripted):
        def open(self, scene, rng, *, record=False):
            shown.append(scene)
            return super().open(scene, rng, record=record)

    scene = Scene(LANE, (0, 1), (5, 1), traffic=Patrol(((5, 2),)), edits=Edit(9, ((0, 0),)))
    trace = run(scene, Curious((fail(), fail(), drive(row(1, 0, 5)))))
    assert trace.scene is scene
    assert [s.edits for s in shown] == [(), ()]
    assert all(s.grid is scene.grid and s.traffic == scene.traffic for s in shown)


def test_terrain_comes_back_with_the_cell_and_costs_what_it_did():
    terrain = np.full((3, 7), 126, np.uint8)
    grid = Grid(np.zeros((3, 7), bool), terrain=terrain)
    shut = tuple((3, y) for y in range(3))
    scene = Scene(grid, (0, 1), (6, 1), edits=(Edit(1, shut), Edit(4, (), shut)))
    for name in ("astar", "ad-gso", "dstar-lite", "lpa-star", "sipp"):
        trace = judged(run(scene, registry.make(name, {})))
        assert trace.arrived, name
        assert trace.cost == pytest.approx(6 * 3.0), name


def test_a_closed_way_that_will_open_is_waited_for():
    grid = grid_of("..#..", "..#..")
    opens = Scene(grid, (0, 0), (4, 0), edits=Edit(5, (), ((2, 0),)))
    trace = judged(run(opens, registry.make("astar", {})))
    assert trace.arrived
    assert trace.waits == 4
    shuts = replace(opens, edits=Edit(5, ((0, 1),)))
    assert judged(run(shuts, registry.make("astar", {}))).outcome is Outcome.NO_PATH
    late = replace(opens, edits=Edit(20, (), ((2, 0),)))
    blocked = judged(run(late, registry.make("astar", {}), patience=6))
    assert blocked.outcome is Outcome.BLOCKED
    assert "separate" in blocked.sentence


def test_a_way_that_closes_for_good_ends_in_patience():
    scene = Scene(LANE, (0, 1), (5, 1), edits=Edit(2, ((3, 0), (3, 1), (3, 2))))
    for name in ("astar", "ad-gso", "sipp", "dstar-lite", "gso"):
        trace = judged(run(scene, registry.make(name, {}), patience=4))
        assert trace.outcome is Outcome.BLOCKED, name
        assert trace.waits == 5, name


def test_walkers_patrols_and_crossings_keep_off_new_walls_and_turn_round():
    grid = Grid(np.zeros((7, 20), bool))
    wall = tuple((10, y) for y in range(7))
    patrol = Scene(
        grid, (0, 0), (0, 6), traffic=Patrol(((5, 3), (15, 3))), edits=(Edit(3, wall), Edit(40, (), wall))
    )
    standing = Scripted((fail(),))
    trace = judged(run(patrol, standing, ticks=70, patience=100))
    xs = trace.tracks[0][:, 0].tolist()
    assert xs[:12] == [5, 6, 7, 8, 9, 8, 7, 6, 5, 6, 7, 8]
    assert max(xs[3:40]) == 9
    assert max(xs[40:]) == 15
    many = replace(patrol, traffic=(Crossing(3), RandomWalk(12), RandomWalk(3, rate=0.2)))
    trace = judged(run(many, standing, seed=1, ticks=70, patience=100))
    for track, since in zip(trace.tracks, trace.appears, strict=True):
        sides = {int(np.sign(x - 10)) for x in track[max(5 - since, 0) : max(39 - since, 0), 0].tolist()}
        assert sides <= {-1} or sides <= {1}


def test_a_lane_must_not_be_walled():
    for radius, cell, fits in ((0.0, (4, 2), True), (0.0, (4, 1), False), (0.8, (4, 2), False)):
        grid = Grid(np.zeros((8, 9), bool))
        scene = Scene(
            grid, (0, 7), (8, 7), traffic=(RandomWalk(1), Recorded(((4, 1), (5, 1)), radius)),
            edits=Edit(9, (cell,)),
        )  # fmt: skip
        if fits:
            judged(run(scene, Breadth()))
            continue
        with pytest.raises(SceneError) as caught:
            run(scene, Breadth())
        assert caught.value.code == "EDIT_TRACK"
        assert "obstacle 1" in caught.value.what
        assert "tick 9" in caught.value.what


def test_drives_refuse_edits():
    scene = Scene(LANE, (0, 1), (5, 1), "dissertation", traffic=RandomWalk(1), edits=Edit(9, ((4, 2),)))
    with pytest.raises(SettingError) as caught:
        lampyris.drive(scene)
    assert caught.value.code == "EDITS"
    assert lampyris.drive(replace(scene, edits=()))


@pytest.mark.parametrize(("law", "resolution"), [("physical", 0.1), ("dissertation", 1.0)])
def test_speeds_know_the_new_walls(law, resolution):
    grid = Grid(np.zeros((9, 30), bool), resolution=resolution)
    beside = tuple((x, y) for x in range(14, 30) for y in (3, 5))
    scene = Scene(grid, (0, 4), (29, 4), edits=Edit(2, beside))
    always = Scene(applied(grid, scene.edits), (0, 4), (29, 4))
    free, close, known = (
        run(s, registry.make("astar", {}), law=law) for s in (replace(scene, edits=()), scene, always)
    )
    assert (free.robot == judged(close).robot).all()
    assert close.speed[20] < free.speed[20]
    assert (close.speed[2:] == known.speed[2:]).all()
    assert close.cause[2:] == known.cause[2:]


# ---- broken on purpose --------------------


def test_a_loop_that_ignores_edits_is_caught(monkeypatch):
    scene = Scene(LANE, (0, 1), (5, 1), edits=Edit(2, ((3, 0), (3, 1))))
    lawful = run(scene, registry.make("astar", {}))
    monkeypatch.setattr(Walls, "turn", lambda self, tick, way: None)
    trace = run(scene, registry.make("astar", {}))
    assert referee.check_trace(trace).rule == "edits"
    assert Monitor(trace).faults()
    # Even one that tells what it did not do.
    lying = replace(trace, edits=lawful.edits, events=lawful.events[:1])
    assert referee.check_trace(lying).rule == "wall"


def careless(self, tick, way):
    """Walls come over anybody."""
    world = self._world
    taken, own, world.taken, world.robot_cover = world.taken, world.robot_cover, {}, frozenset()
    try:
        return _TURN(self, tick, way)
    finally:
        world.taken, world.robot_cover = taken, own


def shapeless(self, done):
    """Nobody's steps follow the map."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Shape, "renew", lambda self, free: None)
        _BUILD(self, done)


_TURN, _BUILD = Walls.turn, Walls._build


@pytest.mark.parametrize(("part", "broken"), [("turn", careless), ("_build", shapeless)])
def test_a_rule_taken_out_is_caught(monkeypatch, part, broken):
    monkeypatch.setattr(Walls, part, broken)
    planner, caught, seen = registry.make("astar", {}), 0, 0
    for seed in range(12):
        scene = with_edits(seeded_scene(seed, "random-walk"), np.random.default_rng((seed, 77)))
        trace = run(scene, planner, seed=seed, patience=12, ticks=60)
        caught += referee.check_trace(trace) is not None
        seen += bool(Monitor(trace).faults())
    assert (caught, seen) >= (6, 6)


def test_a_planner_that_is_not_told_waits_before_the_wall(monkeypatch):
    monkeypatch.setattr(Walls, "as_reported", lambda self, change: change)
    scene = Scene(LANE, (0, 1), (5, 1), edits=Edit(2, ((3, 0), (3, 1))))
    assert run(scene, registry.make("astar", {}), patience=3).outcome is Outcome.BLOCKED
