"""The heuristic where paths may lead: equal to that of the whole map, and what it leaves out costs more than it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lattice_scenes import FOOTPRINTS, optimum, scene_of

from lampyris.model.change import Change
from lampyris.model.plan import Status
from lampyris.model.robot import DRIVES
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.guided import guided_search
from lampyris.planning.lattice.guided.focused_field import FocusedField, focused_field
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.map import LatticeMap, cost_to_any
from lampyris.referee import check_plan
from sizes import sized


def map_of(seed: int, side: int) -> LatticeMap:
    scene = scene_of(seed, "ackermann", FOOTPRINTS["square"], side=side)
    return LatticePlanner().open(scene, np.random.default_rng(0)).lattice_map


@sized("maps", 4, 200)
def test_it_is_the_whole_field_where_chains_cost_little_enough(maps: int) -> None:
    left_out = 0
    for seed in range(maps):
        lattice_map = map_of(seed, 40)
        rng = np.random.default_rng(seed)
        ys, xs = np.nonzero(lattice_map.room > 1.0)
        picked = [lattice_map.index((int(xs[k]), int(ys[k]))) for k in rng.integers(len(xs), size=3)]
        start, goals = picked[0], tuple(sorted(set(picked[1:])))
        whole = lattice_map.flooded(goals)
        octile = (
            cost_to_any(lattice_map._low, [lattice_map.cell(goals[0])]) * lattice_map.lattice.scale * UNIT
        )
        first = lattice_map.flooded(goals[:1]).reshape(-1, lattice_map.stride)
        inside = first[lattice_map.border : -lattice_map.border, lattice_map.border : -lattice_map.border]
        assert ((inside >= 0) == np.isfinite(octile)).all()
        off = octile[inside >= 0] - inside[inside >= 0]
        assert off.min() >= -1e-3  # never above, and a unit a step below at most
        assert off.max() <= inside.size
        one = [lattice_map.heuristic((lattice_map.cell(goal),)) for goal in goals]
        either = np.stack([np.where(field < 0, 1 << 60, field) for field in one]).min(axis=0)
        assert (whole == np.where(either == 1 << 60, -1, either)).all()
        for reach in (5.0, 20.0, 45.0):
            part = lattice_map.flooded(goals, start, reach)
            known = part >= 0
            assert (part[known] == whole[known]).all()
            y, x = np.divmod(np.arange(len(part)), lattice_map.stride)
            down, across = np.abs(y - start // lattice_map.stride), np.abs(x - start % lattice_map.stride)
            straight, diagonal = lattice_map.steps
            away = straight * np.maximum(down, across) + (diagonal - straight) * np.minimum(down, across)
            least = int(reach * straight) - away
            assert (whole[~known & (whole >= 0)] > least[~known & (whole >= 0)]).all()
            assert (whole[known] <= least[known]).all()
            left_out += int((~known & (whole >= 0)).sum())
        focused = focused_field(lattice_map, start, goals)
        assert focused is not None
        if focused.most is not None and focused.heuristic[start] >= 0:
            assert focused.heuristic[start] == whole[start]
            assert focused.most >= 1.5 * whole[start]
    assert left_out > 0


@pytest.mark.parametrize("drive", DRIVES)
@sized("maps", 2, 300)
def test_searches_in_it_keep_the_bound_and_no_path_agrees(
    drive: str, maps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against the exhaustive search, on maps of any size, with one goal pose and with a tolerance."""
    monkeypatch.setattr(guided_search, "MANY", 0)
    monkeypatch.setattr(guided_search, "CELLS", 0)
    monkeypatch.setattr(guided_search, "LEAST", 0.0)
    monkeypatch.setattr("lampyris.planning.lattice.guided.focused_field.MARGIN", 0.0)
    for seed in range(maps):
        scene = scene_of(seed, drive, list(FOOTPRINTS.values())[seed % 3], side=12 + seed % 9)
        for tolerance in (0.0, 1.5 * scene.grid.resolution):
            exact = LatticePlanner(weight=1.0, goal_tolerance=tolerance, goal_yaw_tolerance=tolerance)
            status, least = optimum(scene, exact)
            for weight in (1.0, 1.5):
                planner = replace(exact, weight=weight, shortcut=False)
                plan = planner.open(scene, np.random.default_rng(0)).plan()
                assert plan.status is status, (seed, weight)
                if plan.pose_path is None:
                    continue
                assert plan.status is Status.FOUND
                assert check_plan(plan, scene) is None
                assert plan.pose_path.lower_bound_m <= least * (1 + 1e-9), (seed, weight)
                assert least <= plan.pose_path.cost_m * (1 + 1e-9) <= weight * least * (1 + 2e-9)
                assert plan.pose_path.bound <= weight * (1 + 1e-6)


@pytest.mark.parametrize("drive", DRIVES)
@sized("maps", 3, 300)
def test_searches_in_it_between_joined_ends_keep_the_bound(
    drive: str, maps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against searches with weight 1 in the whole field, also where the robot goes on with the field at hand."""
    fields: list[FocusedField] = []
    field_for = guided_search.GuidedSearch.field_for

    def noted(self: guided_search.GuidedSearch, query: Query) -> FocusedField | None:
        focused = field_for(self, query)
        fields.extend([focused] if focused is not None and query.ends.goal is not None else [])
        return focused

    joined = 0
    for seed in range(maps):
        scene = scene_of(seed, drive, list(FOOTPRINTS.values())[seed % 3], side=26 + 4 * (seed % 5))
        assert scene.start_pose is not None
        x, y, yaw = scene.start_pose
        moved = replace(scene, start=None, start_pose=(x + 0.3 if x < 10 else x - 0.3, y, yaw))
        whole = [
            LatticePlanner(weight=1.0).open(one, np.random.default_rng(0)).plan() for one in (scene, moved)
        ]
        with monkeypatch.context() as patch:
            patch.setattr(guided_search, "MANY", 0)
            patch.setattr(guided_search, "CELLS", 0)
            patch.setattr("lampyris.planning.lattice.guided.focused_field.MARGIN", 0.0)
            patch.setattr(guided_search.GuidedSearch, "field_for", noted)
            for weight in (1.3, 2.0):
                session = LatticePlanner(weight=weight).open(scene, np.random.default_rng(0))
                for one, best, change in zip(
                    (scene, moved), whole, (None, Change(pose=moved.start_pose)), strict=True
                ):
                    plan = session.plan(change)
                    assert plan.status is best.status, (seed, weight)
                    if plan.pose_path is None or best.pose_path is None:
                        continue
                    assert check_plan(plan, one) is None
                    least = best.attributes.get("lattice_cost", best.pose_path.cost_m)
                    cost = plan.attributes.get("lattice_cost", plan.pose_path.cost_m)
                    assert plan.pose_path.lower_bound_m <= least * (1 + 1e-9), (seed, weight)
                    assert cost <= weight * least * (1 + 1e-6), (seed, weight)
                    joined += 1
    assert joined > 0
    assert any(one.most is not None and (one.heuristic < 0).any() for one in fields)
