"""The front door: what Python users call, and what it promises."""

from __future__ import annotations

import ast
import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris.errors import InternalFault, SettingError, UsageError
from lampyris.model.path import path_of

PLANNERS = ("ad-gso", "astar", "dijkstra")


def scene_of(
    seed: int, share: float, moves: str = "octile", size: tuple[int, int] = (30, 40)
) -> lampyris.Scene:
    rng = np.random.default_rng(seed)
    blocked = rng.random(size) < share
    ys, xs = np.nonzero(~blocked)
    a, b = rng.integers(len(xs), size=2)
    return lampyris.Scene(
        lampyris.Grid(blocked),
        (int(xs[a]), int(ys[a])),
        (int(xs[b]), int(ys[b])),
        moves=moves,  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("moves", list(lampyris.MOVES))
def test_planners_agree_on_what_can_be_reached_and_what_is_best(moves: str) -> None:
    for seed in range(12):
        scene = scene_of(seed, 0.3, moves)
        plans = {name: lampyris.plan(scene, planner=name) for name in PLANNERS}
        exact = lampyris.plan(scene, planner="ad-gso", choice="exact")
        assert len({p.status for p in plans.values()} | {exact.status}) == 1
        if exact:
            assert plans["astar"].steps is not None
            best = plans["astar"].cost
            assert plans["dijkstra"].cost == exact.cost == best
            assert {p.optimal_cost for p in plans.values()} == {best}
            assert plans["ad-gso"].cost >= best
            assert exact.gap == plans["astar"].gap == 0.0
        else:
            assert exact.cells is None
            assert exact.cost == math.inf
            assert exact.gap is None


def test_sum_of_cost_to_go_is_the_same_by_suffix_and_by_field() -> None:
    scene = scene_of(4, 0.2)
    plan = lampyris.plan(scene, planner="astar")
    assert plan.cells is not None
    cost = lampyris.solve_field(scene).cost
    assert plan.sum_cost_to_go == pytest.approx(cost[plan.cells[:, 1], plan.cells[:, 0]].sum(), rel=1e-12)


def test_metamorphic_mirror_swap_pad_and_wall() -> None:
    for seed in range(8):
        scene = scene_of(seed, 0.25)
        base = lampyris.plan(scene, planner="astar")
        b, w, h = scene.grid.blocked, scene.grid.width, scene.grid.height
        (sx, sy), (gx, gy) = scene.start, scene.goal
        mirrored = lampyris.Scene(lampyris.Grid(b[:, ::-1]), (w - 1 - sx, sy), (w - 1 - gx, gy))
        turned = lampyris.Scene(
            lampyris.Grid(b[::-1, ::-1]), (w - 1 - sx, h - 1 - sy), (w - 1 - gx, h - 1 - gy)
        )
        swapped = lampyris.Scene(scene.grid, scene.goal, scene.start)
        padded = lampyris.Scene(
            lampyris.Grid(np.pad(b, 2, constant_values=True)), (sx + 2, sy + 2), (gx + 2, gy + 2)
        )
        for other in (mirrored, turned, swapped, padded):
            for name in ("astar", "dijkstra"):
                assert lampyris.plan(other, planner=name).cost == base.cost
            assert lampyris.plan(other, choice="exact").cost == base.cost
        if base and base.cells is not None and len(base.cells) > 2:
            walled = b.copy()
            x, y = base.cells[len(base.cells) // 2]
            walled[y, x] = True
            assert (
                lampyris.plan(dataclasses.replace(scene, grid=lampyris.Grid(walled)), planner="astar").cost
                >= base.cost
            )


def test_prefixes_of_optimal_paths_are_optimal() -> None:
    scene = scene_of(2, 0.2)
    plan = lampyris.plan(scene, planner="dijkstra")
    assert plan.cells is not None
    for k in range(0, len(plan.cells), 5):
        x, y = (int(v) for v in plan.cells[k])
        part = lampyris.plan(dataclasses.replace(scene, goal=(x, y)), planner="astar")
        assert part.path is not None
        assert part.path.exact == path_of(plan.cells[: k + 1], scene.moves).exact


def test_seeds_and_settings_are_checked() -> None:
    scene = scene_of(0, 0.1)
    for bad in (-1, 1.5, 2**63, "x", True):
        with pytest.raises(SettingError, match="SEED"):
            lampyris.plan(scene, seed=bad)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="did you mean astar"):
        lampyris.plan(scene, planner="a-star")
    with pytest.raises(SettingError, match="did you mean nt"):
        lampyris.plan(scene, ntt=3)
    with pytest.raises(SettingError, match="none: it has no settings"):
        lampyris.plan(scene, planner="astar", nt=3)


def test_a_lying_planner_does_not_get_through() -> None:
    class Liar:
        name = "liar"
        traits = lampyris.list_planners()["astar"].traits
        summary = source = ""

        def open(self, scene: lampyris.Scene, rng: np.random.Generator, *, record: bool = False) -> Liar:
            self.scene = scene
            return self

        def plan(self, change: object = None, budget: object = None) -> lampyris.Plan:
            ends = np.array([self.scene.start, self.scene.goal], dtype=np.int32)
            return lampyris.Plan(lampyris.Status.FOUND, "liar", path_of(ends, self.scene.moves))

    grid = lampyris.Grid(np.zeros((5, 5), bool))
    with pytest.raises(InternalFault):
        lampyris.plan(lampyris.Scene(grid, (0, 0), (4, 4)), planner=Liar())


def test_a_robot_with_a_radius_keeps_its_distance_and_does_not_cut_corners() -> None:
    blocked = np.zeros((7, 9), bool)
    blocked[3, :6] = True
    grid = lampyris.Grid(blocked, resolution=0.5)
    wide = lampyris.Robot(radius=0.5)
    scene = lampyris.Scene(grid, (0, 0), (0, 6), moves="dissertation", robot=wide)  # type: ignore[arg-type]
    for name in PLANNERS:
        plan = lampyris.plan(scene, planner=name)
        assert plan.cells is not None
        assert not {(5, 3), (6, 3), (5, 2), (5, 4)} & {(int(x), int(y)) for x, y in plan.cells}
    assert lampyris.plan(dataclasses.replace(scene, start=(0, 2))).status == "start-occupied"


def test_profile_of_a_plan_without_path_is_refused() -> None:
    blocked = np.zeros((3, 3), bool)
    blocked[:, 1] = True
    scene = lampyris.Scene(lampyris.Grid(blocked), (0, 0), (2, 0))
    with pytest.raises(SettingError, match="holds no path"):
        lampyris.speed_profile(scene, lampyris.plan(scene))


def test_simulate_takes_traffic_by_itself_or_from_the_scene() -> None:
    scene = scene_of(3, 0.1)
    walk = lampyris.RandomWalk(count=6)
    one = lampyris.simulate(scene, traffic=walk, seed=4)
    two = lampyris.simulate(dataclasses.replace(scene, traffic=(walk,)), seed=4)
    assert one.robot.tolist() == two.robot.tolist()
    assert len(one.obstacle_specs) == 6
    assert lampyris.simulate(scene, seed=4).obstacle_specs == ()


def test_a_robot_already_moving_may_ask_for_its_profile() -> None:
    grid = lampyris.Grid(np.zeros((3, 20), bool))
    scene = lampyris.Scene(grid, (0, 1), (19, 1))
    plan = lampyris.plan(scene)
    moving = lampyris.speed_profile(scene, plan, v0=0.5)
    assert moving.v[0] == 0.5
    assert moving.duration < lampyris.speed_profile(scene, plan).duration
    assert lampyris.speed_profile(scene, plan, "dissertation", v0=40.0).v[0] == 40.0
    with pytest.raises(SettingError, match=r"START_SPEED|PROFILE_INFEASIBLE"):
        lampyris.speed_profile(scene, plan, v0=5.0)


@pytest.mark.parametrize(
    "call",
    [
        lambda s: lampyris.Patrol(((0.7, 1), (2.9, 3))),
        lambda s: lampyris.Recorded(((0.7, 1),)),
        lambda s: lampyris.Patrol("ab"),
        lambda s: lampyris.RandomWalk(count=1, rate="x"),
        lambda s: lampyris.RandomWalk(count=1, rate=True),
        lambda s: lampyris.Grid(np.zeros((2, 2), bool), origin="abc"),
        lambda s: lampyris.Grid(np.zeros((2, 2), bool), origin=None),
        lambda s: dataclasses.replace(s, robot=None),
        lambda s: dataclasses.replace(s, traffic="abc"),
        lambda s: dataclasses.replace(s, robot=lampyris.Robot(radius=1e5)),
        lambda s: lampyris.Robot(v_max=1e300),
        lambda s: lampyris.Scene(np.zeros((3, 3), bool), (0, 0), (1, 1)),
        lambda s: lampyris.plan(None),
        lambda s: lampyris.plan(s, planner=None),
        lambda s: lampyris.plan(s, planner=int),
        lambda s: lampyris.plan(s, budget=5),
        lambda s: lampyris.simulate(s, traffic=5),
    ],
)
def test_wrong_arguments_are_typed_errors(call: Callable[[lampyris.Scene], object]) -> None:
    with pytest.raises(lampyris.LampyrisError):
        call(scene_of(0, 0.1))


def test_numpy_numbers_and_lists_of_traffic_are_taken() -> None:
    scene = scene_of(3, 0.1)
    walk = lampyris.RandomWalk(count=np.int64(2), radius=np.float32(0.25))
    assert len(lampyris.simulate(scene, traffic=[walk], seed=1).obstacle_specs) == 2


def test_a_blocked_end_is_the_answer_whatever_moves() -> None:
    scene = dataclasses.replace(scene_of(3, 0.1), robot=lampyris.Robot(radius=9))
    trace = lampyris.simulate(scene, traffic=lampyris.RandomWalk(count=1000))
    assert trace.outcome == "start-occupied"
    assert not trace.obstacle_specs


def test_every_public_name_has_a_type() -> None:
    """Names are loaded late: those that a type checker is not told of are ``object`` to whoever uses them."""
    source = Path(lampyris.__file__).read_text(encoding="utf-8")
    told = {
        name.asname
        for block in ast.parse(source).body
        if isinstance(block, ast.If)
        for line in block.body
        if isinstance(line, ast.ImportFrom)
        for name in line.names
        if name.name == name.asname
    }
    assert set(lampyris.__all__) - {"__version__"} == told
