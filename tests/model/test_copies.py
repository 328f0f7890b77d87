"""Copies of nouns: read-only and equal. Pickled grids, fields, paths could be written to and were unequal."""

from __future__ import annotations

import copy
import dataclasses
import importlib
import pickle
import pkgutil
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris import model
from lampyris._core.values import Value
from lampyris.model.change import Change, ObstacleTrack
from lampyris.model.drive import PlannedTimes
from lampyris.model.lattice.motion_primitives import Motion, MotionPrimitives
from lampyris.model.plan import Jump, Plan
from lampyris.model.traffic import Recorded
from lampyris.referee import check_trace
from lampyris.referee.simulations.plain_traffic import plainly_legal

WAYS: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    "pickle of protocol 2": lambda one: pickle.loads(pickle.dumps(one, 2)),
}


@cache
def nouns() -> dict[type, Any]:
    """One of each class of the room, with every array that it may have."""
    rng = np.random.default_rng(2)
    blocked = rng.random((9, 11)) < 0.15
    blocked[0, 0] = blocked[8, 10] = False
    terrain = rng.integers(0, 100, (9, 11)).astype(np.uint8)
    grid = lampyris.Grid(blocked, unknown=blocked, terrain=terrain, resolution=0.5, name="a")
    zones = np.full((9, 11), np.inf)
    zones[3, 3] = 0.5
    walks = lampyris.RandomWalk(2)
    scene = lampyris.Scene(
        grid, (0, 0), (10, 8), traffic=walks, zones=zones, edits=lampyris.Edit(4, ((5, 5),))
    )
    still = dataclasses.replace(scene, edits=())
    plan = lampyris.plan(scene, "ad-gso")
    trace, driven = lampyris.simulate(scene, "astar"), lampyris.drive(still, "astar")
    field, speeds = lampyris.solve_field(scene), lampyris.speed_profile(still, plan)
    seen = ObstacleTrack(0, ((0, 0), (1, 0)))
    poses = lampyris.plan(still, "lattice").pose_path
    assert poses is not None
    primitives = lampyris.motion_primitives(lampyris.Robot(), 0.5)
    driven_poses = lampyris.drive(dataclasses.replace(still, traffic=()), "lattice").curves[0]
    adaptive = lampyris.plan(still, "pad")
    fleet = lampyris.random_fleet(grid, 3)
    found = [
        grid, grid.frame, scene, plan, plan.path, *plan.jumps[:1], field, trace, driven, speeds, driven.curves[0], driven_poses,
        driven.tracks[0], driven.obstacle_specs[0], scene.moves, scene.robot, walks, scene.edits[0], seen, poses,
        adaptive.rounds[0], lampyris.plan(still, "voronoi").map_model, lampyris.Chain((1.0, 2.0), [0.5, 0.4]),
        lampyris.plan_chain(lampyris.Grid(np.zeros((5, 5), dtype=bool)), lampyris.Chain((2.5, 2.5), [1.0]), [0.0], [1.0]),
        Change((0, 0), frozenset({(1, 1)}), obstacle_tracks=(seen,), pose=(0.0, 0.0, 0.0), time_s=1.5),
        lampyris.Patrol(((0, 0), (1, 1))),
        lampyris.Crossing(1), lampyris.Recorded(((0, 0), (1, 0))), lampyris.Gate((1, 1), "x", 0.5, False),
        lampyris.ObstacleStates(np.ones((2, 2)), np.ones(2), np.ones(2), np.ones((2, 2))),
        PlannedTimes(np.arange(2.0), np.arange(2.0), np.arange(2.0) + 0.5),
        fleet, fleet.robots[0], lampyris.plan_fleet(fleet), lampyris.Delays(0.1), lampyris.FleetTask([(1, 1)]),
        lampyris.simulate_fleet(fleet, planner="pibt"), lampyris.lifelong_fleet(fleet, 5),
        lampyris.segment_photo(np.array([[9, 250]], dtype=np.uint8), resolution=0.5),
        lampyris.Sensor(2.0), primitives, primitives.motions[0], *trace.events[:1], *driven.moments[:1],
    ]  # fmt: skip
    jump = next(one for one in found if isinstance(one, Jump))
    return {type(one): one for one in [*found, *jump.candidates[:1]]}


def classes() -> Iterator[type]:
    for found in pkgutil.iter_modules(model.__path__, f"{model.__name__}."):
        module = importlib.import_module(found.name)
        for kind in vars(module).values():
            if isinstance(kind, type) and kind.__module__ == found.name and dataclasses.is_dataclass(kind):
                yield kind


KINDS = [
    *classes(), lampyris.Fleet, lampyris.Agent, lampyris.FleetPlan, lampyris.Delays, lampyris.FleetTask, lampyris.FleetTrace,
    lampyris.LifelongTrace, lampyris.Sensor, MotionPrimitives, Motion,
    lampyris.SegmentedPhoto, lampyris.Chain, lampyris.ChainPlan,
]  # fmt: skip


def arrays_in(value: Any) -> Iterator[np.ndarray]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for one in value:
            yield from arrays_in(one)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for f in dataclasses.fields(value):
            yield from arrays_in(getattr(value, f.name))


def test_there_is_one_of_each_class() -> None:
    missing = [kind.__name__ for kind in KINDS if kind not in nouns()]
    assert not missing, f"no copy of {missing} is looked at"
    assert set(nouns()) == set(KINDS)
    assert len(KINDS) > 20


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_copy_is_equal_and_read_only(kind: type, way: str) -> None:
    original = nouns()[kind]
    made = WAYS[way](original)
    assert type(made) is kind
    assert made == original
    assert original == made
    assert hash(made) == hash(original)
    theirs, ours = list(arrays_in(made)), list(arrays_in(original))
    assert [a.tolist() for a in theirs] == [a.tolist() for a in ours]
    assert not [a for a in theirs if a.flags.writeable]
    for a in theirs[:1]:
        with pytest.raises(ValueError, match="read-only"):
            a[...] = 0


@pytest.mark.parametrize("kind", [k for k in KINDS if issubclass(k, Value)], ids=lambda kind: kind.__name__)
def test_any_other_content_is_unequal(kind: type) -> None:
    original = nouns()[kind]
    for f in dataclasses.fields(kind):
        other = copy.copy(original)
        value = getattr(original, f.name)
        changed: Any = "of another type"
        if isinstance(value, np.ndarray) and value.size:
            changed = value.copy()
            changed.flat[0] = not changed.flat[0]
        object.__setattr__(other, f.name, changed)
        assert (other == original) is not f.compare, f.name
    assert original != object()


def test_two_plans_of_one_scene_are_equal_whatever_time_they_took() -> None:
    scene = nouns()[lampyris.Scene]
    one, two = (lampyris.plan(scene, "ad-gso", record=False) for _ in range(2))
    assert one == two
    assert len({one, two}) == 1
    assert one != nouns()[Plan]


def test_copies_plan_as_their_original() -> None:
    scene = nouns()[lampyris.Scene]
    want = lampyris.plan(scene, "astar").cells
    assert want is not None
    for way in WAYS.values():
        got = lampyris.plan(way(scene), "astar").cells
        assert got is not None
        assert got.tolist() == want.tolist()


def test_truth_values_that_are_stored_as_other_bytes_are_walls_to_all() -> None:
    """Kernels and the referee read bytes: its quick look at traces is for bytes that are 1, and saw no wall in a 2."""
    raw = np.zeros((3, 5), dtype=np.uint8)
    raw[1, 1], raw[1, 3] = 2, 255
    aside = (Recorded(((0, 0),) * 9),)
    free = lampyris.Scene(lampyris.Grid(np.zeros((3, 5), dtype=bool)), (0, 1), (4, 1), traffic=aside)
    trace = lampyris.simulate(free, "astar")
    assert check_trace(trace) is None
    assert plainly_legal(trace) is not None
    for blocked in (raw.view(np.bool_), np.asfortranarray(raw).view(np.bool_), raw[:, ::-1].view(np.bool_)):
        grid = lampyris.Grid(blocked, unknown=blocked)
        assert grid.unknown is not None
        for cells in (grid.blocked, grid.unknown):
            assert cells.view(np.uint8).tolist() == [[0] * 5, [0, 1, 0, 1, 0], [0] * 5]
        through = dataclasses.replace(trace, scene=dataclasses.replace(free, grid=grid))
        assert plainly_legal(through) is None
        broken = check_trace(through)
        assert broken is not None
        assert broken.rule == "wall"
