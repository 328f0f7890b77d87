"""A robot that learns its map: what it sees, that it never steps into a wall, and that its planner is always right."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sim_planners import grid_of
from unknown_worlds import drawn_world, judged, watched_run

import lampyris
from lampyris import referee
from lampyris.errors import SettingError
from lampyris.model.settings.sensor import MOST_UNSEEN
from lampyris.model.trace import Outcome
from lampyris.planning import registry
from lampyris.sim.grid import loop
from lampyris.sim.world.seen_map import SeenMap
from sizes import sized

WATCHED = (("dstar-lite", {}), ("ad-gso", {"choice": "exact"}), ("astar", {}))
ROOM = grid_of("........", ".######.", "........", "......#.")


def seen_from(grid, cell, sensor, heading=(0, 0)):
    """What a robot sees that stands on a cell, as a picture."""
    scene = lampyris.Scene(grid, cell, cell)
    view = SeenMap(scene, sensor)
    if heading != (0, 0):
        view.seen[:] = -1
        view.look(cell, heading, 0)
    rows = view.seen.reshape(grid.blocked.shape) >= 0
    return ["".join("." if one else "?" for one in row) for row in rows]


def test_a_wall_hides_what_is_behind_and_shows_its_near_side() -> None:
    assert seen_from(ROOM, (0, 2), lampyris.Sensor(20.0)) == [".???????", ".......?", "........", ".......?"]


def test_the_range_is_measured_between_centres() -> None:
    open_map = lampyris.Grid(np.zeros((1, 9), dtype=bool), resolution=0.1)
    assert seen_from(open_map, (0, 0), lampyris.Sensor(0.3)) == ["....?????"]
    assert seen_from(open_map, (0, 0), lampyris.Sensor(0.2999)) == ["...??????"]


def test_no_sight_passes_between_two_walls_that_touch_at_a_corner() -> None:
    pinhole = grid_of("..#..", "..#..", "##...", ".....", ".....")
    assert seen_from(pinhole, (1, 1), lampyris.Sensor(9.0))[3:] == ["?????", "?????"]


def test_sight_between_free_cells_is_mutual() -> None:
    rng = np.random.default_rng(5)
    grid = lampyris.Grid(rng.random((9, 11)) < 0.3)
    free = [(int(x), int(y)) for y, x in np.argwhere(~grid.blocked)]
    seen = {cell: seen_from(grid, cell, lampyris.Sensor(6.0)) for cell in free}
    pairs = [(a, b) for a in free for b in free if a < b]
    assert all((seen[a][b[1]][b[0]] == ".") == (seen[b][a[1]][a[0]] == ".") for a, b in pairs)
    assert 0 < sum(seen[a][b[1]][b[0]] == "." for a, b in pairs) < len(pairs)


def test_the_field_of_view_lies_around_the_last_move_and_the_bumpers_all_around() -> None:
    open_map = lampyris.Grid(np.zeros((5, 7), dtype=bool))
    assert seen_from(open_map, (2, 2), lampyris.Sensor(9.0, math.pi / 2), (1, 0)) == [
        "????...", "?......", "?......", "?......", "????...",
    ]  # fmt: skip


def test_a_robot_that_sees_nothing_beyond_its_bumpers_still_never_hits_a_wall() -> None:
    trace = judged(
        lampyris.Scene(ROOM, (3, 0), (3, 2)), registry.make("astar", {}), sensor=lampyris.Sensor(0.001, 0.01)
    )
    assert trace.arrived
    assert trace.replans > 0


def test_the_planner_is_given_no_wall_that_has_not_been_seen() -> None:
    given = []

    class Curious:
        name, traits, summary, source = "curious", registry.make("astar", {}).traits, "", ""

        def open(self, scene, rng, *, record=False):
            given.append(scene.grid.blocked.copy())
            self.inner = registry.make("astar", {}).open(scene, rng)
            return self

        def plan(self, change=None, budget=None):
            news = given[-1].copy()
            for x, y in change.blocked:
                news[y, x] = True
            given.append(news)
            return self.inner.plan(change, budget)

    scene, sensor = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38)), lampyris.Sensor(5.0)
    trace = judged(scene, Curious(), sensor=sensor)
    assert trace.arrived
    known = scene.grid.blocked & (trace.seen >= 0)
    assert not (given[-1] & ~known).any()
    assert given[0].sum() < given[-1].sum() < scene.grid.blocked.sum()
    first = scene.grid.blocked & (trace.seen == 0)
    assert (given[0] == first).all()


@pytest.mark.parametrize("name", ["dstar-lite", "visibility-graph", "voronoi", "quadtree"])
@sized("worlds", 5, 60)
def test_worlds_that_look_the_same_are_driven_in_the_same_way(name: str, worlds: int) -> None:
    """Cells that one drive never saw are drawn anew: until a second drive sees a difference, it is the first one."""
    rng = np.random.default_rng([28, worlds])
    alike = 0
    for seed in range(worlds):
        walls = rng.random(rng.integers(8, 20, 2)) < 0.25
        free = np.argwhere(~walls)
        start, goal = (tuple(free[int(rng.integers(len(free)))][::-1].tolist()) for _ in range(2))
        sensor = lampyris.Sensor(float(rng.choice([1.0, 3.0])), float(rng.choice([1.5, 2 * math.pi])))
        one = lampyris.simulate(
            lampyris.Scene(lampyris.Grid(walls), start, goal), name, sensor=sensor, seed=seed
        )
        assert one.seen is not None
        other = np.where(one.seen < 0, rng.random(walls.shape) < 0.4, walls)
        other[goal[1], goal[0]] = False
        scene = lampyris.Scene(lampyris.Grid(other), start, goal)
        two = lampyris.simulate(scene, name, sensor=sensor, seed=seed)
        assert two.seen is not None
        never = len(one.robot) + len(two.robot)
        a, b = (np.where(seen < 0, never, seen) for seen in (one.seen, two.seen))
        ticks = int(np.minimum(a, b)[(a != b) | (walls != other)].min(initial=never))
        assert np.array_equal(one.robot[: ticks + 1], two.robot[: ticks + 1])
        alike += ticks == never and bool((walls != other).any())
    assert alike > 0.2 * worlds


def test_a_closed_goal_is_found_out_without_waiting() -> None:
    grid = grid_of("......", "...###", "...#.#", "...###")
    trace = judged(
        lampyris.Scene(grid, (0, 0), (4, 2)), registry.make("dstar-lite", {}), sensor=lampyris.Sensor(2.0)
    )
    assert trace.outcome is Outcome.NO_PATH
    assert trace.waits == 1
    wall = judged(
        lampyris.Scene(grid, (0, 0), (5, 2)), registry.make("dstar-lite", {}), sensor=lampyris.Sensor(2.0)
    )
    assert wall.outcome in (Outcome.GOAL_OCCUPIED, Outcome.NO_PATH)


def test_among_moving_obstacles_nothing_is_met_but_what_may_be() -> None:
    for seed in range(6):
        scene, sensor = drawn_world(seed, 16)
        scene = replace(scene, traffic=(lampyris.RandomWalk(3, rate=0.5),))
        judged(scene, registry.make("dstar-lite", {}), sensor=sensor, seed=seed, patience=5, ticks=200)


@pytest.mark.parametrize(("name", "settings"), WATCHED)
def test_every_replan_costs_what_dijkstra_says_on_the_known_map(name: str, settings: dict[str, str]) -> None:
    runs = [watched_run(seed, name, settings) for seed in range(25)]
    assert [wrong for _, _, wrong in runs if wrong] == []
    assert sum(calls for _, calls, _ in runs) > 40
    assert sum(trace.arrived for trace, _, _ in runs) > 10


@pytest.mark.parametrize(("name", "settings"), WATCHED)
def test_unseen_cells_that_cost_more_cost_what_dijkstra_says(name: str, settings: dict[str, str]) -> None:
    runs = [watched_run(seed, name, settings, most=14, unseen=True) for seed in range(12)]
    assert [wrong for _, _, wrong in runs if wrong] == []
    assert sum(calls for _, calls, _ in runs) > 60
    assert sum(trace.arrived for trace, _, _ in runs) > 6


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "settings"), WATCHED[:2])
def test_thousands_of_worlds_whose_unseen_cells_cost_more(name: str, settings: dict[str, str]) -> None:
    asked = arrived = 0
    for seed in range(20_000, 22_000):
        trace, calls, wrong = watched_run(seed, name, settings, plain=seed % 10 == 0, most=28, unseen=True)
        assert not wrong, (seed, wrong)
        asked, arrived = asked + calls, arrived + trace.arrived
    print(f"{name}: 2,000 worlds, {arrived} arrived, {asked} plans, 0 collisions, 0 wrong costs")
    assert asked > 10_000


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "settings"), WATCHED[:2])
def test_ten_thousand_worlds(name: str, settings: dict[str, str]) -> None:
    asked = arrived = 0
    for seed in range(1000, 11_000):
        trace, calls, wrong = watched_run(seed, name, settings, plain=seed % 10 == 0, most=28)
        assert not wrong, (seed, wrong)
        asked, arrived = asked + calls, arrived + trace.arrived
    print(f"{name}: 10,000 worlds, {arrived} arrived, {asked} plans, 0 collisions, 0 wrong costs")
    assert asked > 20_000


def broken(trace, **changed):
    fault = referee.check_trace(replace(trace, **changed))
    return None if fault is None else fault.rule


def test_the_referee_refuses_what_the_sensor_cannot_have_seen() -> None:
    scene = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38))
    for view in (2 * math.pi, 1.2):
        trace = judged(scene, registry.make("dstar-lite", {}), sensor=lampyris.Sensor(6.0, view))
        assert broken(trace) is None
        # Each claimed a little too early, too far, or never.
        far = np.argwhere(trace.seen < 0)
        for y, x in far[:: len(far) // 12]:
            seen = trace.seen.copy()
            seen[y, x] = trace.ticks // 2
            assert broken(trace, seen=seen) == "sight"
        assert broken(trace, sensor=lampyris.Sensor(4.0, view)) == "sight"
        x, y = trace.robot[trace.ticks // 2]
        blind = trace.seen.copy()
        blind[y, x] = -1
        assert broken(trace, seen=blind) == "unseen"
        blind[y, x] = trace.ticks
        assert broken(trace, seen=blind) == "unseen"
    assert broken(trace, sensor=lampyris.Sensor(6.0, 0.6)) == "sight"
    assert broken(trace, sensor=None) == "seen"
    assert broken(trace, seen=trace.seen + trace.ticks) == "seen"


def test_a_hidden_cell_behind_a_wall_is_out_of_sight() -> None:
    trace = judged(
        lampyris.Scene(ROOM, (3, 2), (7, 2)), registry.make("astar", {}), sensor=lampyris.Sensor(9.0)
    )
    seen = trace.seen.copy()
    assert seen[0, 3] == -1
    seen[0, 3] = 0
    assert broken(trace, seen=seen) == "sight"


def test_the_map_as_it_was_known() -> None:
    trace = judged(
        lampyris.Scene(ROOM, (3, 2), (7, 2)), registry.make("astar", {}), sensor=lampyris.Sensor(2.0)
    )
    first, last = trace.known_at(0), trace.known_at(trace.ticks)
    assert first.unknown is not None
    assert last.unknown is not None
    assert last.unknown.sum() < first.unknown.sum()
    walls = last.blocked & ~last.unknown
    assert walls.any()
    assert not (walls & ~ROOM.blocked).any()


def test_seen_cells_are_preferred_where_unseen_ones_cost_more() -> None:
    grid = grid_of("........", ".######.", "........")
    scene = lampyris.Scene(grid, (1, 0), (7, 2), moves="four-connected")
    view = SeenMap(scene, lampyris.Sensor(3.0, unseen_cost=2.0))
    terrain = view.given.grid.terrain
    assert terrain is not None
    assert [terrain[0, x] for x in range(8)] == [0, 0, 0, 0, 0, 63, 63, 63]
    assert view.scene.grid.terrain is None
    view.look((2, 0), (1, 0), 1)
    assert view.ground == (((5, 0), 0),)
    assert view.given.grid.terrain[0, 5] == 0
    trace = judged(scene, registry.make("dstar-lite", {}), sensor=lampyris.Sensor(3.0, unseen_cost=5.0))
    assert trace.arrived
    assert trace.cost == 8.0  # terrain of the map alone counts for what was driven


def test_a_sensor_and_edits_are_refused_together() -> None:
    scene = lampyris.Scene(ROOM, (0, 0), (7, 2), edits=(lampyris.Edit(3, blocked=((2, 2),)),))
    with pytest.raises(SettingError, match="SENSOR_EDITS"):
        lampyris.simulate(scene, "astar", sensor=lampyris.Sensor(2.0))


def test_a_sensor_that_cannot_be() -> None:
    with pytest.raises(SettingError, match="RANGE_M"):
        lampyris.Sensor()
    with pytest.raises(SettingError, match="RANGE_M"):
        lampyris.Sensor(0.0)
    with pytest.raises(SettingError, match="FIELD_OF_VIEW"):
        lampyris.Sensor(1.0, 7.0)
    with pytest.raises(SettingError, match="UNSEEN_COST"):
        lampyris.Sensor(1.0, unseen_cost=0.9)
    with pytest.raises(SettingError, match="UNSEEN_COST"):
        lampyris.Sensor(1.0, unseen_cost=MOST_UNSEEN + 0.1)
    assert lampyris.Sensor(1.0, unseen_cost=MOST_UNSEEN).unseen_cost == 5.0
    with pytest.raises(SettingError, match=r"TYPE.*sensor"):
        lampyris.simulate(lampyris.Scene(ROOM, (0, 0), (7, 2)), "astar", sensor=3.0)


def test_with_a_range_beyond_the_map_the_start_sees_what_a_known_map_would_show() -> None:
    grid = lampyris.Grid(np.zeros((6, 6), dtype=bool))
    scene = lampyris.Scene(grid, (0, 0), (5, 3))
    trace = judged(scene, registry.make("dstar-lite", {}), sensor=lampyris.Sensor(1e6))
    assert (trace.seen == 0).all()
    assert trace.path == loop.run(scene, registry.make("dstar-lite", {})).path
