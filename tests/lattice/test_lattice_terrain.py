"""Terrain on a state lattice: least costs against an exhaustive search, bounds, and the referee's own sum."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from lampyris.io.maps.inflation import inflate
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice import STEP, UNIT
from lampyris.planning.lattice.lattice_planner import LatticePlanner, lattice_for
from lampyris.planning.lattice.terrain import tracks_of
from lampyris.referee import check_plan
from lampyris_selfcheck.reference.paths.lattice import Motion, least_costs
from reference.kernel_forms import use
from sizes import sized

CAR = ((1.9, 0.6), (-0.5, 0.6), (-0.5, -0.6), (1.9, -0.6))


def scene_of(seed: int, drive: str) -> Scene:
    rng = np.random.default_rng([seed, DRIVES.index(drive)])
    walls = rng.random((10, 10)) < 0.04
    terrain = rng.integers(0, 253, walls.shape) * (rng.random(walls.shape) < 0.5)
    ends = [(*(rng.random(2) * 10).tolist(), float(rng.uniform(-3, 3))) for _ in range(2)]
    robot = Robot(drive=drive, footprint=CAR, turn_radius=2.0 if drive == "ackermann" else 0.0)
    return Scene(Grid(walls, terrain=terrain), start_pose=ends[0], goal_pose=ends[1], robot=robot)


def looked_up(table: list[list[list[list[int]]]], x: int, y: int, heading: int, place: int) -> int:
    return table[heading][place][y][x]


@pytest.mark.commit(1)
@sized("maps", 3, 300)
@pytest.mark.parametrize("drive", DRIVES)
def test_costs_on_terrain_are_least_and_bounds_hold(drive: str, maps: int) -> None:
    found = 0
    for seed in range(maps):
        scene, planner = scene_of(seed, drive), LatticePlanner(weight=1.0, cost_penalty=2.5)
        session = planner.open(scene, np.random.default_rng(0))
        plan = session.plan()
        lattice = lattice_for(scene, planner)
        tracks = tracks_of(lattice)
        weights, terrain = tracks.weights(2.5), scene.grid.terrain
        assert terrain is not None
        motions: dict[int, list[Motion]] = {k: [] for k in range(16)}
        for k, one in enumerate(lattice.primitives):
            swept = lattice.sweep[lattice.sweep_first[k] : lattice.sweep_first[k + 1]].tolist()
            dx, dy = lattice.cell[k].tolist()
            motions[one.start].append((dx, dy, one.end, int(lattice.cost[k]), tuple(map(tuple, swept))))

        wide = np.pad(terrain.astype(np.int64), 20)
        sums = []
        for k in range(len(lattice.primitives)):
            part = range(tracks.first[k], tracks.first[k + 1])
            moved = [np.roll(wide, tracks.cell[i, ::-1] * -1, axis=(0, 1)) * weights[i] for i in part]
            sums.append(np.sum(moved, axis=0)[20:-20, 20:-20].tolist())
        table = [sums[lattice.first[h] : lattice.first[h + 1]] for h in range(16)]

        starts = [(*cell, h) for cell, h in session.starts(session.lattice_map)]
        goals = [(*cell, h) for cell, h in session.goals(session.lattice_map)]
        best = least_costs(scene.grid.blocked.tolist(), motions, starts, partial(looked_up, table))
        costs = [best[goal] for goal in goals if goal in best]
        assert (plan.status is Status.FOUND) == bool(costs)
        if plan.pose_path is None:
            continue
        found += 1
        assert plan.pose_path.cost_m == pytest.approx(min(costs) / UNIT, rel=1e-12)
        assert plan.bound == 1.0
        assert check_plan(plan, scene) is None
        for weight in (1.5, 5.0):
            more_ = replace(planner, weight=weight, anytime=weight == 5.0)
            other = more_.open(scene, np.random.default_rng(0)).plan()
            assert other.pose_path is not None
            assert check_plan(other, scene) is None
            assert other.pose_path.lower_bound_m <= min(costs) / UNIT * (1 + 1e-9)
            assert other.pose_path.bound <= (1.0 if weight == 5.0 else weight) * (1 + 1e-6)
    assert found > 0


@pytest.mark.parametrize("drive", DRIVES)
def test_parts_of_motions_are_counted_in_the_cells_they_lie_in(drive: str) -> None:
    scene = scene_of(0, drive)
    lattice = lattice_for(scene, LatticePlanner())
    tracks = tracks_of(lattice)
    for k, one in enumerate(lattice.primitives):
        part = slice(tracks.first[k], tracks.first[k + 1])
        assert tracks.cost[part].sum() == pytest.approx(float(lattice.cost[k]), rel=1e-12)
        fine = one.poses(STEP / 50, 0.0)[:, :2] * (1, -1)
        middle = np.floor((fine[:-1] + fine[1:]) / 2 + 0.5).astype(int)
        share = np.sqrt((np.diff(fine, axis=0) ** 2).sum(axis=1))
        for cell, cost in zip(tracks.cell[part].tolist(), tracks.cost[part].tolist(), strict=True):
            inside = (middle == cell).all(axis=1)
            sampled = float(share[inside].sum() / share.sum()) if share.sum() else 1.0
            assert cost / float(lattice.cost[k]) == pytest.approx(sampled, abs=0.01)


def test_terrain_that_is_ignored_is_named_and_changes_are_followed() -> None:
    walls = np.zeros((21, 50), dtype=bool)
    walls[[0, 20]] = True
    robot = Robot(footprint=((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)))
    grid = inflate(Grid(walls, resolution=0.1), robot, 1.5, 3.0)
    scene = Scene(grid, (3, 4), (46, 4), robot=robot)
    plain = LatticePlanner(weight=1.0, cost_penalty=0.0).open(scene, np.random.default_rng(0)).plan()
    assert any("terrain is ignored" in note for note in plan_notes(plain))
    session = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0))
    plan = session.plan()
    assert not any("terrain" in note for note in plan_notes(plan))
    assert plan.pose_path is not None
    assert plain.pose_path is not None
    assert check_plan(plan, scene) is None
    assert plan.pose_path.length_m > plain.pose_path.length_m
    assert plan.pose_path.cost_m > plain.pose_path.cost_m
    flat = tuple(((x, y), 0) for y in range(1, 20) for x in range(50))
    now = session.plan(Change(terrain=flat))
    assert now.pose_path is not None
    assert now.pose_path.cost_m == plain.pose_path.cost_m


def plan_notes(plan: Plan) -> tuple[str, ...]:
    return plan.notes


def test_both_forms_of_the_search_weigh_terrain_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        plans = [
            LatticePlanner(weight=1.2).open(scene_of(seed, "ackermann"), np.random.default_rng(0)).plan()
            for seed in range(3)
        ]
        found[form] = [(plan.pose_path, plan.expansions) for plan in plans]
    assert found["plain"] == found["compiled"]


def test_the_referee_refuses_a_cost_that_leaves_terrain_out() -> None:
    scene = scene_of(1, "differential")
    plan = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0)).plan()
    path = plan.pose_path
    assert path is not None
    less = replace(plan, pose_path=replace(path, cost_m=path.cost_m * 0.99, lower_bound_m=0.0))
    verdict = check_plan(less, scene)
    assert verdict is not None
    assert verdict.rule == "cost"
