"""What is drawn fits, and what changes elsewhere moves nobody who is not concerned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris.errors import SceneError
from lampyris.io.maps.library import load
from lampyris.kernels.simulation import draws
from lampyris.kernels.simulation.obstacle_rules import rank
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk, Recorded
from lampyris.planning.incremental.dstar_lite import DStarLite
from lampyris.sim.grid import loop
from lampyris.sim.traffic import obstacle_draws
from lampyris.sim.traffic.continuous_traffic import TrafficMotion
from lampyris.sim.traffic.mobility import MOBILITIES, drawn_traffic
from lampyris.sim.traffic.motion_sources import Roster
from lampyris.sim.traffic.traffic import open_traffic
from lampyris.sim.world.cell_index import CellIndex, robot_shape
from lampyris.sim.world.world import Occupancy


def starts(scene: Scene, seed: int) -> list[tuple[str, tuple[int, int]]]:
    """Kind and first cell of every obstacle."""
    space = CellIndex(scene.grid)
    world = Occupancy(space, robot_shape(scene, space), space.number(scene.start))
    crowd = open_traffic(scene, world, seed)
    return [(body.kind, space.cell(n)) for body, n in zip(crowd.obstacles, world.where, strict=True)]


@pytest.mark.commit(24)
@pytest.mark.parametrize("kind", MOBILITIES)
@pytest.mark.parametrize("number", range(24))
def test_what_is_drawn_is_accepted_on_any_map_at_any_radius(kind: str, number: int) -> None:
    """By the simulation in ticks and by the drive, beside recorded obstacles and drawn ones too."""
    rng = np.random.default_rng([7, number])
    height, width = (int(n) for n in rng.integers(5, 25, 2))
    blocked = rng.random((height, width)) < rng.choice([0.0, 0.1, 0.3])
    free = [(int(x), int(y)) for y, x in np.argwhere(~blocked)]
    start, goal, drawn, told = (free[int(k)] for k in rng.permutation(len(free))[:4])
    radius = float(rng.choice([0.0, 0.3, 0.7, 1.2]))
    moves = list(MOVES.values())[number % 4]
    before: tuple[ObstacleSpec, ...] = ()
    if number % 2:
        before = (RandomWalk(1, starts=(drawn,)), Recorded((told,)))
    robot = Robot(radius=float(rng.choice([0.0, 0.8])))
    scene = Scene(Grid(blocked), start, goal, moves, robot, before)
    count = int(rng.integers(1, 12))
    try:
        starts(scene, number)
        more = drawn_traffic(kind, count, scene.grid, number, radius=radius, fit=scene)
    except SceneError as full:
        if "obstacle specification" not in full.what and "patrols fit" not in full.what:
            assert before  # the ones that were there do not fit themselves
        return
    full_scene = replace(scene, traffic=(*before, *more))
    for open_ in (
        lambda: starts(full_scene, number),
        lambda: TrafficMotion(None, number).open(full_scene, Roster()),
    ):
        refused = ""
        try:
            open_()
        except SceneError as full:
            refused = full.what
        # How many walkers and crossing ones fit is said when they are put; a patrol is never refused.
        assert not refused or (kind != "patrol" and "fit on the map" in refused)


@pytest.mark.parametrize("radius", [0.0, 0.7])
def test_the_simulations_that_were_reported(radius: float) -> None:
    """``lampyris simulate rooms-20 --mobility patrol --obstacles 20 --seed 2``, with a radius of 0.7 too."""
    found = load("rooms-20")
    bare = Scene(found.grid, found.start, found.goal)
    for seed in range(2, 5):
        made = drawn_traffic("patrol", 20, found.grid, seed, radius=radius, fit=bare)
        assert len(starts(replace(bare, traffic=made), seed)) == 20


def test_patrols_take_all_the_room_there_is() -> None:
    """Two cells side by side in a map of walls are found, though chance alone would hardly find them."""
    blocked = np.ones((60, 60), dtype=bool)
    for x, y in ((5, 5), (6, 5), (40, 31), (40, 32)):
        blocked[y, x] = False
    made = drawn_traffic("patrol", 2, Grid(blocked), 0)
    ends = {frozenset(one.waypoints) for one in made if isinstance(one, Patrol)}
    assert ends == {frozenset({(5, 5), (6, 5)}), frozenset({(40, 31), (40, 32)})}
    with pytest.raises(SceneError, match="2 of 3 patrols fit"):
        drawn_traffic("patrol", 3, Grid(blocked), 0)


# ---- nobody moves who is not concerned ---------------------------------------------------------------------


FOUND = load("env-1")
BARE = Scene(FOUND.grid, FOUND.start, FOUND.goal)
CROWD = (RandomWalk(30), Crossing(8), RandomWalk(4, radius=0.9), Patrol(((20, 20), (24, 20))))


def painted(scene: Scene, seed: int) -> Scene:
    """The scene with one free cell painted, far from where all obstacles begin and from their routes."""
    space = CellIndex(scene.grid)
    world = Occupancy(space, robot_shape(scene, space), space.number(scene.start))
    crowd = open_traffic(scene, world, seed)
    used = {space.cell(c) for d in crowd.drivers for c in getattr(d, "route", ())}
    used |= {space.cell(n) for n in world.where} | {scene.start, scene.goal}
    free = np.argwhere(~scene.grid.blocked)[:, ::-1]
    far = [min(max(abs(x - u), abs(y - v)) for u, v in used) for x, y in free.tolist()]
    x, y = free[int(np.argmax(far))].tolist()
    blocked = scene.grid.blocked.copy()
    blocked[y, x] = True
    return replace(scene, grid=replace(scene.grid, blocked=blocked))


@pytest.mark.commit(1)
@pytest.mark.parametrize("seed", range(8))
def test_a_painted_cell_far_from_everybody_moves_nobody(seed: int) -> None:
    scene = replace(BARE, traffic=CROWD)
    assert starts(painted(scene, seed), seed) == starts(scene, seed)


@pytest.mark.parametrize("seed", range(8))
def test_a_painted_cell_under_a_walker_moves_that_walker_alone(seed: int) -> None:
    scene = replace(BARE, traffic=(RandomWalk(40),))
    before = starts(scene, seed)
    x, y = before[7][1]
    blocked = scene.grid.blocked.copy()
    blocked[y, x] = True
    after = starts(replace(scene, grid=replace(scene.grid, blocked=blocked)), seed)
    assert [k for k in range(40) if before[k] != after[k]] == [7]


@pytest.mark.parametrize("at", [0, 2, 4])
@pytest.mark.parametrize("seed", range(4))
def test_a_patrol_more_moves_nobody_wherever_it_stands_in_the_list(seed: int, at: int) -> None:
    scene = replace(BARE, traffic=CROWD)
    before = starts(scene, seed)
    taken = {cell for _, cell in before}
    free = [(int(x), int(y)) for y, x in np.argwhere(~BARE.grid.blocked) if (int(x), int(y)) not in taken]
    # Clear of the wide ones, too.
    a = next(c for c in free[::7] if all(max(abs(c[0] - u), abs(c[1] - v)) > 3 for u, v in taken))
    more = list(CROWD)
    more.insert(at, Patrol((a,)))
    after = starts(replace(BARE, traffic=tuple(more)), seed)
    assert sorted(after) == sorted([*before, ("patrol", a)])


@pytest.mark.parametrize("kind", ["random-walk", "crossing", "patrol"])
def test_one_obstacle_more_moves_none_of_the_others(kind: str) -> None:
    for seed in range(4):
        few, many = (
            starts(replace(BARE, traffic=drawn_traffic(kind, n, BARE.grid, seed, fit=BARE)), seed)
            for n in (14, 15)
        )
        assert many[:14] == few


def tracks(scene: Scene, seed: int) -> Trace:
    return loop.run(scene, DStarLite(), seed=seed, ticks=25)


def test_their_tracks_stay_the_same_too() -> None:
    """Far from the robot and from what is new, every walker goes where it went."""
    for seed in range(3):
        scene = replace(BARE, traffic=(RandomWalk(25),))
        one = tracks(scene, seed)
        for other in (
            tracks(painted(scene, seed), seed),
            tracks(replace(scene, traffic=(RandomWalk(26),)), seed),
            tracks(replace(scene, traffic=(Patrol(((1, 40), (8, 40))), RandomWalk(25))), seed),
        ):
            kept = [
                track for body, track in zip(other.obstacle_specs, other.tracks, strict=True) if body.yields
            ]
            kept = (
                kept[len(kept) - 25 :] if any(b.kind == "patrol" for b in other.obstacle_specs) else kept[:25]
            )
            length = min(one.ticks, other.ticks) + 1
            same = [np.array_equal(a[:length], b[:length]) for a, b in zip(one.tracks, kept, strict=True)]
            assert sum(same) >= 23


# ---- the draws themselves ----------------------------------------------------------------------------------


def test_draws_are_uniform_and_independent_of_each_other() -> None:
    own, count = np.arange(200, dtype=np.int64)[:, None], np.arange(500, dtype=np.int64)[None, :]
    for what in (draws.PLACE, draws.STEPS, draws.APPEAR, draws.ROUTE):
        u = obstacle_draws.uniforms(obstacle_draws.key_of(3, obstacle_draws.WALKERS, 0), what, own, count)
        assert u.shape == (200, 500)
        assert 0.0 <= u.min() < u.max() < 1.0
        assert len(np.unique(u)) == u.size
        hits = np.bincount((u.ravel() * 64).astype(np.int64), minlength=64)
        assert ((hits - u.size / 64) ** 2 / (u.size / 64)).sum() < 110.0  # chi square of 63: 0.02 % beyond
        assert abs(np.corrcoef(u[:-1].ravel(), u[1:].ravel())[0, 1]) < 0.015
        assert abs(np.corrcoef(u[:, :-1].ravel(), u[:, 1:].ravel())[0, 1]) < 0.015
    keys = {obstacle_draws.key_of(s, kind, n) for s in range(50) for kind in (1, 2, 3) for n in range(4)}
    assert len(keys) == 600


def test_the_first_of_some_cells_is_any_of_them_with_equal_chance() -> None:
    cells = np.array([3, 17, 18, 19, 400, 2501], dtype=np.int64)
    u = obstacle_draws.uniforms(1, obstacle_draws.PLACE, np.array([0]), np.arange(6000))
    hits = {int(c): 0 for c in cells}
    for one in u.tolist():
        hits[obstacle_draws.first_of(cells, one)] += 1
    assert min(hits.values()) > 850
    assert max(hits.values()) < 1150


def test_the_kernels_ranks_are_the_same() -> None:
    cells = np.array([0, 1, 7, 2047, 99_999_999], dtype=np.int64)
    for draw in (0.0, 0.3, 0.999999):
        wanted = obstacle_draws.ranks(cells, draw).tolist()
        assert [rank.plain(c, int(draw * 2147483648.0)) for c in cells.tolist()] == wanted
