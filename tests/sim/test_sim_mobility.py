"""Crowds by a word: the same as the command line always made, and for studies such as fit their scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris import load_grid
from lampyris.cli.option_groups import TrafficOptions
from lampyris.cli.request import traffic_of
from lampyris.errors import LampyrisError, SceneError, SettingError
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk
from lampyris.sim.traffic.mobility import MOBILITIES, drawn_traffic, patrols
from lampyris.sim.traffic.traffic import open_traffic
from lampyris.sim.world.cell_index import CellIndex, robot_shape
from lampyris.sim.world.world import Occupancy

GRID = load_grid("env-1")
SCENE = Scene(GRID, (1, 1), (48, 48))


def test_every_kind_has_as_many_as_were_asked_for() -> None:
    for kind in MOBILITIES:
        for count in (0, 1, 2, 3, 7, 20):
            made = drawn_traffic(kind, count, GRID, 1, radius=0.25)
            each = [one.count if isinstance(one, RandomWalk | Crossing) else 1 for one in made]
            assert sum(each) == count
            assert {one.radius for one in made} <= {0.25}
    assert drawn_traffic("none", 9, GRID, 1) == ()
    mixed = drawn_traffic("mixed", 20, GRID, 1, rate=0.5)
    assert mixed[0] == Crossing(6)
    assert all(isinstance(one, Patrol) for one in mixed[1:7])
    assert mixed[7:] == (RandomWalk(8, 0.5),)


def test_a_crowd_is_decided_by_its_seed_and_is_what_the_command_line_makes() -> None:
    for kind in MOBILITIES:
        one = drawn_traffic(kind, 9, GRID, 4, fit=SCENE)
        assert one == drawn_traffic(kind, 9, GRID, 4, fit=SCENE)
        assert one == traffic_of(TrafficOptions(9, kind), SCENE, 4)
    assert drawn_traffic("patrol", 9, GRID, 4) != drawn_traffic("patrol", 9, GRID, 5)


def test_patrols_join_two_cells_of_one_region_a_dozen_apart() -> None:
    ends = [one.waypoints for one in patrols(40, GRID, 3) if isinstance(one, Patrol)]
    cells = [cell for pair in ends for cell in pair]
    assert len(set(cells)) == 80
    for (ax, ay), (bx, by) in ends:
        assert max(abs(ax - bx), abs(ay - by)) <= 12
        assert not GRID.blocked[ay, ax]
        assert not GRID.blocked[by, bx]


@pytest.mark.parametrize("radius", [0.0, 0.8])
@pytest.mark.parametrize("moves", ["octile", "dissertation"])
def test_patrols_that_fit_are_taken_by_the_simulation(radius: float, moves: str) -> None:
    """On a small map nearly every draw covers an end or another patrol; none of those is taken."""
    refused = 0
    for seed in range(12):
        blocked = np.random.default_rng(seed).random((12, 12)) < (0.1 if radius == 0 else 0.02)
        blocked[0, 0] = blocked[11, 11] = False
        scene = Scene(Grid(blocked), (0, 0), (11, 11), moves=moves)  # type: ignore[arg-type]
        count = 14 if radius == 0 else 4
        for fit in (scene, None):
            full = replace(
                scene, traffic=drawn_traffic("patrol", count, scene.grid, seed, radius=radius, fit=fit)
            )
            space = CellIndex(full.grid)
            world = Occupancy(space, robot_shape(full, space), space.number(full.start))
            try:
                assert len(open_traffic(full, world, seed).obstacles) == count
            except LampyrisError:
                assert fit is None
                refused += 1
    assert refused or radius


def test_what_cannot_be_is_refused() -> None:
    for code, kind, count, more in (
        ("MOBILITY", "swarm", 3, {}),
        ("TRAFFIC_COUNT", "patrol", -1, {}),
        ("LIMIT", "mixed", 10**6, {}),
        ("TRAFFIC_RATE", "random-walk", 3, {"rate": 2.0}),
        ("TRAFFIC_RADIUS", "crossing", 3, {"radius": -1.0}),
        ("OPTIONS", "patrol", 3, {"rate": 0.5}),
    ):
        with pytest.raises(LampyrisError) as refused:
            drawn_traffic(kind, count, GRID, 0, **more)  # type: ignore[arg-type]
        assert refused.value.code == code
    with pytest.raises(SceneError, match="4 of 5 patrols fit") as full:
        patrols(5, Grid(np.zeros((3, 3), dtype=np.bool_)), 0)
    assert full.value.code == "OBSTACLE_ROOM"
    with pytest.raises(SceneError, match="0 of 1 patrols fit"):
        patrols(1, Grid(np.ones((3, 3), dtype=np.bool_)), 0)
    with pytest.raises(SettingError) as wrong:
        drawn_traffic("patrl", 1, GRID, 0)
    assert "patrol" in str(wrong.value)


def test_all_kinds_may_be_polygons() -> None:
    outline = ((0.4, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.4, -0.1))
    made = drawn_traffic("mixed", 9, GRID, 1, footprint=outline)
    assert {type(one) for one in made} == {Crossing, Patrol, RandomWalk}
    assert len({(one.footprint, one.radius) for one in made}) == 1  # type: ignore[union-attr]
    assert made[0].radius > 0.4  # type: ignore[union-attr]
