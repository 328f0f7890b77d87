"""Compiled ticks: the same run as tick by tick, whole, stopped at any tick, and looked at in between."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sim_compared import by_tick, differ

from lampyris import Crossing, Patrol, RandomWalk, Recorded, Scene
from lampyris.kernels._jit import Kernel
from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.motion.laws.physical import RULES, PhysicalLaw
from lampyris.planning import registry
from lampyris.sim.grid import loop
from lampyris.sim.grid.compiled_ticks import APPEAR_NS, supported
from lampyris.sim.grid.steps_since import since
from lampyris.sim.grid.tick_speed import TickSpeed
from lampyris.sim.world.cell_index import shared
from reference.kernel_forms import use

WALLS = np.zeros((14, 16), dtype=bool)
WALLS[4, 2:9] = WALLS[9, 6:14] = True
TRACK = Recorded(tuple((1 + min(t, 13), 12) for t in range(20)))
TRAFFIC: dict[str, tuple[Any, ...]] = {
    "walkers": (RandomWalk(12),),
    "who appear": (RandomWalk(8, 0.4), RandomWalk(3)),
    "all kinds": (TRACK, Crossing(3), Patrol(((2, 2), (9, 2))), RandomWalk(6)),
}


def scene_of(traffic: str, **more: Any) -> Scene:
    """From one corner of a small map to the other."""
    return Scene(Grid(WALLS), (0, 0), (15, 13), traffic=TRAFFIC[traffic], **more)


@pytest.fixture(autouse=True)
def _plain(monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, "plain")


@pytest.mark.parametrize("planner", ["ad-gso", "astar", "sipp"])
@pytest.mark.parametrize("traffic", TRAFFIC)
def test_the_run_is_the_one_of_the_loop(planner: str, traffic: str) -> None:
    law = {"walkers": "physical", "who appear": "rpp", "all kinds": "dissertation"}[traffic]
    settings: dict[str, Any] = {"seed": 3, "law": law, "patience": 6, "ticks": 60}
    edits = (Edit(5, ((4, 8), (5, 8)), ((5, 4),)),) if traffic == "who appear" else ()
    scene, who = scene_of(traffic, edits=edits), registry.make(planner, {})
    known = by_tick(loop.Simulation(scene, who, **settings))
    assert differ(known, loop.run(scene, who, **settings)) == []
    pieces, rng = loop.Simulation(scene, who, **settings), np.random.default_rng(1)
    while pieces.outcome is None:
        pieces.advance(int(rng.integers(1, 9))) if rng.random() < 0.7 else pieces.tick()
    assert differ(known, pieces.trace()) == []


@pytest.mark.parametrize("planner", ["ad-gso", "sipp"])
def test_what_is_seen_at_a_stop_is_what_the_loop_would_show(planner: str) -> None:
    scene, who = scene_of("walkers"), registry.make(planner, {})
    one, two = loop.Simulation(scene, who, seed=4), loop.Simulation(scene, who, seed=4)
    while one.outcome is None:
        for _ in range(3):
            one.tick()
        two.advance(3)
        assert (one.now, one.outcome) == (two.now, two.outcome)
        if one.outcome is None:
            assert one.world.where == two.world.where
            assert one.world.taken == two.world.taken
            assert one.world.left == two.world.left
            assert one.world.step == two.world.step
            assert one.state.cells == two.state.cells
            assert one.state.tracks == two.state.tracks
            assert one.tick_speed.v == two.tick_speed.v
            assert one.tick_speed.caps() == two.tick_speed.caps()
            assert one.plan == two.plan
            assert one.state.following == two.state.following
            assert np.array_equal(since(one, 2).robot, since(two, 2).robot)


def test_obstacles_are_not_watched_while_walls_leave_no_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """SIPP's kernel went on to note since when each stood, and then held those of seeds 57 and 59 for standing longer."""
    use(monkeypatch, "compiled")
    wall = tuple((4, y) for y in range(9))
    edits, who = (Edit(1, wall), Edit(7, (), wall)), registry.make("sipp", {})
    scene = Scene(Grid(np.zeros((9, 10), dtype=bool)), (0, 4), (9, 4), traffic=(RandomWalk(14),), edits=edits)
    for seed in (57, 59):
        known = by_tick(loop.Simulation(scene, who, seed=seed))
        assert differ(known, loop.run(scene, who, seed=seed)) == []


@pytest.mark.parametrize("planner", ["ad-gso", "astar", "sipp"])
def test_maps_too_large_to_be_kept_are_compiled(planner: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, "compiled")
    blocked = np.random.default_rng(7).random((170, 200)) < 0.1
    blocked[80, 90] = blocked[93, 112] = False
    scene = Scene(Grid(blocked), (90, 80), (112, 93), traffic=(RandomWalk(700), RandomWalk(30, 0.5)))
    assert not shared(scene)
    who, settings = registry.make(planner, {}), {"seed": 3, "ticks": 30}
    one = loop.Simulation(scene, who, **settings)
    assert supported(one)
    assert differ(by_tick(one), loop.run(scene, who, **settings)) == []


def test_a_route_longer_than_there_is_room_for_is_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, "compiled")
    blocked = np.zeros((182, 182), dtype=bool)
    blocked[1::4, :-1] = blocked[3::4, 1:] = True
    scene = Scene(Grid(blocked), (0, 0), (0, 100), traffic=(RandomWalk(400),))
    who, settings = registry.make("sipp", {}), {"seed": 1, "ticks": 12}
    known = by_tick(loop.Simulation(scene, who, **settings))
    assert differ(known, loop.run(scene, who, **settings)) == []
    assert len(loop.Simulation(scene, who, **settings).state.following.route) > 8 * (184 + 184)


def test_looking_through_a_large_map_is_priced(monkeypatch: pytest.MonkeyPatch) -> None:
    """For each obstacle that appears all cells are looked through: 80 ticks took 4 s in plain Python, 0.04 s compiled."""
    use(monkeypatch, "compiled")
    expected: list[int] = []

    def expect(kernel: Kernel, calls: int, *given: object) -> None:
        expected.append(calls * kernel.price(given))

    monkeypatch.setattr(Kernel, "expect", expect)
    cells = np.zeros((200, 210), dtype=bool)
    for traffic, least in ((RandomWalk(9), 0), (RandomWalk(9, 1.0), 9 * cells.size * APPEAR_NS)):
        for planner in ("astar", "sipp", "ad-gso"):
            expected.clear()
            scene = Scene(Grid(cells), (3, 3), (60, 40), traffic=(traffic,))
            loop.run(scene, registry.make(planner, {}), seed=1, ticks=20)
            assert max(expected, default=0) >= least
            assert bool(expected) == bool(least)


def test_what_the_kernel_does_not_know_is_left_to_the_loop() -> None:
    who = registry.make("astar", {})
    assert supported(loop.Simulation(scene_of("all kinds"), who))
    sized = Scene(Grid(WALLS), (1, 1), (14, 12), robot=Robot(radius=0.8), traffic=(RandomWalk(2),))
    far = Scene(Grid(WALLS), (0, 0), (15, 13), moves="sixteen-connected", traffic=(RandomWalk(2),))
    for scene in (sized, far):
        assert not supported(loop.Simulation(scene, who))
        assert differ(by_tick(loop.Simulation(scene, who)), loop.run(scene, who)) == []


def test_the_kernel_drives_by_no_rule_that_it_does_not_know() -> None:
    """Whatever rule is added to the table of rules: a list of names here once left the new one out without a word."""
    scene = scene_of("walkers")
    assert TickSpeed(scene, PhysicalLaw()).for_kernel() is not None
    for name, kind in RULES.items():
        known = TickSpeed(scene, PhysicalLaw(**{name: kind()})).for_kernel() is not None
        assert known == (name == "moving"), name
