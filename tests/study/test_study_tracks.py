"""Replayed tracks: the simulator's own traffic without a robot, one set a world, anyone who plans."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from one_samples import grid_of, ground_of, law, planner, study_of

from lampyris.errors import SceneError, SettingError
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.model.traffic import Crossing, RandomWalk, Recorded
from lampyris.sim.traffic import recorded
from lampyris.sim.traffic.mobility import drawn_traffic
from lampyris.sim.traffic.recorded import check_tracks
from lampyris.sim.traffic.traffic import open_traffic
from lampyris.sim.world.cell_index import CellIndex, obstacle_shape, robot_shape
from lampyris.sim.world.world import Occupancy
from lampyris.study.design.study import StudyTraffic
from lampyris.study.execution import obstacle_tracks
from lampyris.study.execution import worker as one
from lampyris.study.execution.obstacle_tracks import Replay
from lampyris.study.execution.site import world_of
from lampyris.study.execution.worker import run_job

KINDS = ("random-walk", "patrol", "crossing", "mixed")


def scene_of(kind: str, count: int = 7, radius: float = 0.0, seed: int = 0, moves: Any = "octile") -> Scene:
    grid = grid_of(seed, 24, 0.12 if radius == 0 else 0.03)
    bare = Scene(grid, (0, 0), (grid.width - 1, grid.height - 1), moves=moves)
    return replace(bare, traffic=drawn_traffic(kind, count, grid, seed, radius=radius, fit=bare))


def drawn(scene: Scene, seed: int, ticks: int) -> Any:
    """The same by the simulator's own traffic, tick by tick; int (ticks + 1, bodies, 2)."""
    space = CellIndex(scene.grid)
    world = Occupancy(space, robot_shape(scene, space), space.number(scene.start))
    crowd_ = open_traffic(scene, world, seed)
    out = [[space.cell(n) for n in world.where]]
    for tick in range(1, ticks + 1):
        crowd_.advance(tick)
        out.append([space.cell(n) for n in world.where])
    return np.array(out)


@pytest.mark.commit(8)
@pytest.mark.parametrize("moves", ["octile", "dissertation"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_tracks_are_those_of_the_simulators_traffic(kind: str, moves: str, seed: int) -> None:
    scene = scene_of(kind, seed=seed, moves=moves)
    replay = Replay(scene, seed)
    steps = [np.array(replay.upto(t)) for t in (0, 3, 60, 64, 65, 200)]
    told = drawn(scene, seed, 200)
    for some in steps:
        assert np.array_equal(some, told[: len(some)])
    assert np.abs(np.diff(told, axis=0)).max() == 1  # they do move


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("radius", [0.0, 0.6])
def test_nobody_ever_covers_start_or_goal_and_the_simulator_takes_the_tracks(
    kind: str, radius: float
) -> None:
    for seed in range(3):
        scene = scene_of(kind, 5, radius, seed)
        made = Replay(scene, seed).recorded(120)
        assert len(made) == 5
        assert {one_.radius for one_ in made} == {radius}
        for one_ in made:
            cells = np.array(one_.track)
            for end in (scene.start, scene.goal):
                apart = np.sqrt(((cells - end) ** 2).sum(axis=1)) * scene.grid.resolution
                assert apart.min() > radius
        space = CellIndex(scene.grid)
        shape = obstacle_shape(scene.grid, scene.moves, space, radius, None)
        cover = frozenset({space.number(scene.start), space.number(scene.goal)})
        lanes = check_tracks(space, [(k, t, shape) for k, t in enumerate(made)], cover)
        for x, y in (scene.start, scene.goal):
            assert not lanes[y, x]


@pytest.mark.nightly
def test_one_world_has_one_set_of_tracks_whoever_plans() -> None:
    """Of every planner and law the obstacles are at the same places at the same ticks, as far as it goes."""
    seen: dict[int, Any] = {}
    for kind in ("random-walk", "mixed"):
        for law_ in ("physical", "dissertation"):
            who = ("ad-gso", "astar", "dstar-lite", "sipp", planner("ad-gso", nt=3))
            study = study_of("simulate", who, StudyTraffic(kind, 6), law_of=law(law_), seeds=(0, 1))
            for job in study.jobs():
                one._forget()
                noun = run_job(job.plain, ground_of(study).grid).noun
                assert isinstance(noun, Trace)
                mine = np.stack(noun.tracks)
                longest = seen.setdefault(job.plain["seed"], mine)
                shared = min(longest.shape[1], mine.shape[1])
                assert shared > 10
                assert np.array_equal(longest[:, :shared], mine[:, :shared])
                if mine.shape[1] > longest.shape[1]:
                    seen[job.plain["seed"]] = mine
    assert len(seen) == 4


@pytest.mark.nightly
def test_a_run_that_outlasts_its_tracks_is_run_with_longer_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody stands still because nobody was drawn: with tracks to the last tick the result is the same."""
    grid = grid_of()
    study = study_of(
        "simulate", ("astar", "ad-gso"), StudyTraffic("crossing", 9), grid=grid, seeds=tuple(range(6))
    )
    asked: list[int] = []
    among = one.StudyWorld.among

    def noted(world: Any, ticks: int) -> Scene:
        asked.append(ticks)
        return among(world, ticks)

    monkeypatch.setattr(one.StudyWorld, "among", noted)
    longer = 0
    for job in study.jobs():
        asked.clear()
        made = run_job(job.plain, grid).noun
        world = world_of(job.plain, grid)
        assert isinstance(made, Trace)
        assert made.ticks <= asked[-1]
        longer += len(asked) > 1
        whole = one.loop.run(
            among(world, world.last_tick(None)), one.registry.make(job.plain["planner"]["name"]),
            seed=world.seed, ticks=world.last_tick(None),
        )  # fmt: skip
        assert np.array_equal(whole.robot, made.robot)
        assert whole.outcome == made.outcome
        assert all(map(np.array_equal, whole.tracks, made.tracks))
    monkeypatch.setattr(one.StudyWorld, "among", among)
    # A run that is long for certain: nobody arrives while the budget lets nobody plan.
    held = study_of(
        "simulate", ("astar",), StudyTraffic("crossing", 3), expansions=1, patience=200, grid=grid
    )
    (job,) = held.jobs()
    monkeypatch.setattr(one.StudyWorld, "among", noted)
    asked.clear()
    made = run_job(job.plain, grid).noun
    assert isinstance(made, Trace)
    assert len(asked) > 1
    last = np.stack(made.tracks)[:, -20:]
    assert np.abs(np.diff(last, axis=1)).max() == 1


def test_planners_that_see_traffic_see_it_to_the_last_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    study = study_of("simulate", ("sipp",), ticks=90)
    (job,) = study.jobs()
    asked: list[int] = []
    among = one.StudyWorld.among
    monkeypatch.setattr(one.StudyWorld, "among", lambda w, t: (asked.append(t), among(w, t))[1])
    run_job(job.plain, ground_of(study).grid)
    assert asked == [90]


def test_walkers_that_appear_later_cannot_be_replayed() -> None:
    scene = scene_of("random-walk")
    with pytest.raises(SettingError) as refused:
        Replay(replace(scene, traffic=(RandomWalk(3, 0.5),)), 0)
    assert refused.value.code == "TRAFFIC_RATE"
    with pytest.raises(SceneError):
        Replay(replace(scene, traffic=(RandomWalk(3000),)), 0)


def test_what_fits_no_kernel_is_drawn_one_by_one() -> None:
    scene = scene_of("mixed")
    assert not obstacle_tracks.alone(scene)
    assert obstacle_tracks.alone(replace(scene, traffic=(RandomWalk(3),)))
    for other in ((RandomWalk(3, None, 0.6),), (RandomWalk(3), RandomWalk(2)), (Crossing(2),), ()):
        assert not obstacle_tracks.alone(replace(scene, traffic=other))


@pytest.mark.nightly
def test_the_quick_look_at_tracks_never_lets_a_meeting_pass() -> None:
    """Random tracks of a small place: what is said to be far apart is so one by one, and often it is said."""
    grid = Grid(np.zeros((5, 6), dtype=np.bool_))
    scene = Scene(grid, (0, 0), (5, 4), moves="octile")
    space = CellIndex(grid)
    shape = obstacle_shape(scene.grid, scene.moves, space, 0.0, None)
    rng = np.random.default_rng(5)
    said = {True: 0, False: 0}
    for _ in range(1500):
        some = []
        for k in range(int(rng.integers(2, 4))):
            at = rng.integers(0, (6, 5))
            cells = [tuple(at.tolist())]
            for _ in range(int(rng.integers(1, 6))):
                at = np.clip(at + rng.integers(-1, 2, 2), 0, (5, 4))
                cells.append(tuple(at.tolist()))
            some.append((k, Recorded(tuple(cells)), shape))
        try:
            recorded._check_pairs(space, some)
            apart = True
        except SceneError:
            apart = False
        assert recorded._far_apart(some) == apart
        said[apart] += 1
    assert min(said.values()) > 200
