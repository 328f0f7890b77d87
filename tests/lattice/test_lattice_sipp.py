"""SIPP on the lattice: earliest arrivals beside a search over sampled times, the referee, and what is refused."""

from __future__ import annotations

import heapq
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.model.change import Change
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.timed.timed_planner import LatticeSipp, LatticeSippSession
from lampyris.referee import check_plan
from sizes import sized

FOOTPRINT = ((1.1, 0.6), (-0.6, 0.6), (-0.6, -0.6), (1.1, -0.6))


def scene_of(
    walls: np.ndarray,
    tracks: list[list[tuple[int, int]]],
    start: Any,
    goal: Any,
    drive: str = "differential",
    **robot: Any,
) -> Scene:
    """A scene with walkers of 0.4 m; ends are x, y (cells, y down) and yaw."""
    grid = lampyris.Grid(walls, resolution=1.0)
    ends = [(*grid.to_metres((x, y)).tolist(), yaw) for x, y, yaw in (start, goal)]
    return Scene(
        grid,
        start_pose=ends[0],
        goal_pose=ends[1],
        robot=lampyris.Robot(
            footprint=FOOTPRINT, drive=drive, turn_radius=1.5 if drive == "ackermann" else 0.0, **robot
        ),
        traffic=tuple(lampyris.Recorded(tuple(track), radius=0.4) for track in tracks),
    )


def planned(scene: Scene, **settings: Any) -> Plan:
    return LatticeSipp(**settings).open(scene, np.random.default_rng(0)).plan()


def drawn(rng: np.random.Generator) -> Scene:
    """A small map with walls, two walkers and a robot."""
    walls = rng.random((8, 9)) < 0.06
    tracks = []
    for _ in range(2):
        x, y = int(rng.integers(9)), int(rng.integers(8))
        track = [(x, y)]
        for _ in range(int(rng.integers(3, 14))):
            x = min(max(x + int(rng.integers(-1, 2)), 0), 8)
            y = min(max(y + int(rng.integers(-1, 2)), 0), 7)
            track.append((x, y))
        tracks.append(track)
    poses = [
        (int(rng.integers(9)), int(rng.integers(8)), float(rng.integers(4)) * math.pi / 2) for _ in range(2)
    ]
    drive = ("differential", "ackermann", "omnidirectional")[int(rng.integers(3))]
    return scene_of(walls, tracks, poses[0], poses[1], drive)


def sampled_arrival(scene: Scene, session: LatticeSippSession, wider: float, dt: float = 0.5) -> float:
    """Ticks of the earliest arrival where departures are multiples of ``dt``; infinite: there is none.

    Contacts are those of the rectangle, widened, at sampled times; walls are those of the lattice's own sweeps.
    """
    lattice, lattice_map = session._lattice, session.lattice_map
    tracks = [one.track for one in scene.traffic]  # type: ignore[union-attr]

    def clear(x: float, y: float, yaw: float, t: float) -> bool:
        cos, sin = math.cos(yaw), math.sin(yaw)
        for track in tracks:
            k = min(int(t), len(track) - 1)
            (x0, y0), (x1, y1) = track[k], track[min(k + 1, len(track) - 1)]
            share = min(t - k, 1.0)
            dx, dy = x0 + share * (x1 - x0) - x, y - y0 - share * (y1 - y0)
            ahead, left = cos * dx + sin * dy, cos * dy - sin * dx
            away = math.hypot(max(-0.6 - ahead, ahead - 1.1, 0.0), max(abs(left) - 0.6, 0.0))
            if away < 0.5 + wider:
                return False
        return True

    starts, goals = session.starts(lattice_map), set(session.goals(lattice_map))
    still = max(len(track) for track in tracks) / dt  # from there on nothing changes: who comes first is best
    heap = [(0, one) for one in starts if clear(*one[0], lattice.angles[one[1]], 0.0)]
    seen = set(heap)
    while heap:
        n, state = heapq.heappop(heap)
        if state in goals:
            return n * dt
        (x, y), heading = state
        t = n * dt
        following = []
        if n < still and clear(x, y, lattice.angles[heading], t + dt):
            following.append((n + 1, state))
        for p in range(lattice.first[heading], lattice.first[heading + 1]):
            to = (x + int(lattice.cell[p, 0]), y + int(lattice.cell[p, 1]))
            lasts = float(lattice.cost[p]) / UNIT
            # Arrivals are put off to the next sample: the robot stands there meanwhile.
            one = (n + math.ceil(lasts / dt - 1e-9), (to, int(lattice.turned[p])))
            mark = (min(one[0], math.ceil(still)), one[1])
            if mark in seen or not lattice_map.grid.contains(to):
                continue
            index = lattice_map.index((x, y))
            swept = lattice_map.swept[lattice.sweep_first[p] : lattice.sweep_first[p + 1]]
            if lattice_map.walls[index + swept].any():
                continue
            poses = lattice.primitives[p].poses(0.25, 1.3)
            shares = np.linspace(0.0, 1.0, len(poses)).tolist()
            if all(
                clear(x + a, y - b, c, t + share * lasts)
                for (a, b, c), share in zip(poses.tolist(), shares, strict=True)
            ):
                following.append(one)
        for one in following:
            mark = (min(one[0], math.ceil(still)), one[1])
            if mark not in seen:
                seen.add(mark)
                heapq.heappush(heap, one)
    return math.inf


@sized("cases", 1, 150)
def test_arrivals_lie_between_those_of_a_thinner_and_a_wider_robot_at_sampled_times(cases: int) -> None:
    """The discs that cover the footprint reach over it by at most ``spare``; sampled departures are late by their step."""
    rng = np.random.default_rng(26)
    spare, met = 0.65, 0
    for _ in range(cases):
        scene = drawn(rng)
        session = LatticeSipp(weight=1.0).open(scene, rng)
        if not session.starts(session.lattice_map) or not session.goals(session.lattice_map):
            continue
        plan = session.plan()
        assert check_plan(plan, scene) is None
        thin = sampled_arrival(scene, session, 0.0)
        wide = sampled_arrival(scene, session, spare)
        if plan.pose_path is None:
            assert wide == math.inf
            continue
        assert plan.pose_path.times is not None
        arrival = float(plan.pose_path.times[-1, 0])
        assert thin <= arrival + 0.5 * (
            len(plan.cells) + 1
        )  # each of at most so many motions is late by half a tick
        assert arrival <= wide + 1e-9
        met += 1
    assert met >= max(1, cases // 3)


@pytest.mark.parametrize("drive", ["differential", "ackermann", "omnidirectional"])
def test_without_obstacles_it_is_the_least_cost_of_the_lattice(drive: str) -> None:
    walls = np.zeros((20, 30), dtype=bool)
    walls[:12, 14] = True
    scene = scene_of(walls, [], (4, 4, 0.0), (25, 5, 0.0), drive, v_max=2.0)
    timed = planned(scene, weight=1.0)
    plain = LatticePlanner(weight=1.0, shortcut=False).open(scene, np.random.default_rng(0)).plan()
    assert timed.pose_path is not None
    assert plain.pose_path is not None
    assert timed.pose_path.cost_m == pytest.approx(plain.pose_path.cost_m, rel=1e-6)
    assert timed.pose_path.bound == 1.0
    assert timed.pose_path.times is not None
    assert timed.pose_path.times[-1, 0] == pytest.approx(plain.pose_path.cost_m / 2.0, rel=1e-6)
    assert check_plan(timed, scene) is None


def corridor(weight: float = 1.0, length: int = 12) -> tuple[Scene, Plan]:
    """An obstacle comes through a door towards the robot, which must let it out first."""
    walls = np.zeros((17, 40), dtype=bool)
    walls[:, 20] = True
    walls[7:10, 20] = False
    track = [(max(34 - k, 6), 8) for k in range(28)] + [(6, min(8 + k, 15)) for k in range(length)]
    scene = scene_of(walls, [track], (12, 8, 0.0), (36, 8, 0.0))
    return scene, planned(scene, weight=weight)


def test_it_lets_an_obstacle_pass_and_waits_or_gives_way() -> None:
    scene, plan = corridor()
    assert plan.status is Status.FOUND, plan.detail
    assert check_plan(plan, scene) is None
    assert plan.pose_path is not None
    free = planned(replace(scene, traffic=()), weight=1.0)
    assert free.pose_path is not None
    assert plan.pose_path.cost_m > free.pose_path.cost_m + 0.5
    # The static path taken as it is would meet the obstacle.
    met = replace(plan, pose_path=free.pose_path)
    found = check_plan(met, scene)
    assert found is not None
    assert found.rule == "contact"


def test_it_waits_before_a_door_until_an_obstacle_has_left_it() -> None:
    walls = np.zeros((17, 40), dtype=bool)
    walls[:, 20] = True
    walls[7:10, 20] = False
    track = [(20, 8)] * 40 + [(20 + k, 8) for k in range(1, 4)] + [(23, 8 - k) for k in range(1, 8)]
    scene = scene_of(walls, [track], (14, 8, 0.0), (36, 14, 0.0))
    plan = planned(scene, weight=1.0, reverse=False)
    assert plan.status is Status.FOUND, plan.detail
    assert check_plan(plan, scene) is None
    assert plan.attributes["waits_s"] > 20.0
    assert plan.pose_path is not None
    assert plan.pose_path.times is not None
    early = plan.pose_path.times.copy()
    early[1:] -= 5.0
    early[0, 1] -= 5.0
    if early[0, 1] > 0.0:
        cost = plan.pose_path.cost_m - 5.0
        path = replace(
            plan.pose_path, times=early, cost_m=cost, lower_bound_m=min(cost, plan.pose_path.lower_bound_m)
        )
        found = check_plan(replace(plan, pose_path=path), scene)
        assert found is not None
        assert found.rule == "contact"


def test_a_long_wait_beside_an_obstacle_that_stands_is_judged_quickly() -> None:
    """The referee once halved the time of a wait down to a ten-thousandth of a cell that an obstacle might move."""
    scene = scene_of(np.zeros((12, 20), dtype=bool), [[(4, 7)]], (4, 5, 0.0), (15, 5, 0.0))
    plan = planned(scene)
    path = plan.pose_path
    assert path is not None
    assert path.times is not None
    late = path.times + 1e9
    late[0, 0] = 0.0
    cost = path.cost_m + 1e9
    waiting = replace(plan, pose_path=replace(path, times=late, cost_m=cost))
    assert check_plan(waiting, scene) is None


@pytest.mark.parametrize("weight", [1.2, 2.0])
def test_the_bound_holds(weight: float) -> None:
    scene, best = corridor()
    _, plan = corridor(weight)
    assert best.pose_path is not None
    assert plan.pose_path is not None
    assert plan.pose_path.bound <= weight * (1 + 1e-9)
    assert plan.pose_path.lower_bound_m <= best.pose_path.cost_m * (1 + 1e-9)
    assert check_plan(plan, scene) is None


def test_a_door_that_stays_closed_is_told_from_a_wall() -> None:
    walls = np.zeros((17, 40), dtype=bool)
    walls[:, 20] = True
    walls[7:10, 20] = False
    scene = scene_of(walls, [[(20, 8)]], (12, 8, 0.0), (36, 8, 0.0))
    assert planned(scene).status is Status.HEMMED_IN
    walls[:, 20] = True
    shut = scene_of(walls, [[(20, 8)]], (12, 8, 0.0), (36, 8, 0.0))
    assert planned(shut).status is Status.NO_PATH


def test_an_obstacle_on_the_start_is_named() -> None:
    scene = scene_of(np.zeros((12, 20), dtype=bool), [[(4, 5)]], (4, 5, 0.0), (15, 5, 0.0))
    plan = planned(scene)
    assert plan.status is Status.HEMMED_IN
    assert "at the start" in plan.detail


def test_a_slower_robot_takes_longer_in_proportion() -> None:
    scene = scene_of(np.zeros((12, 20), dtype=bool), [], (4, 5, 0.0), (15, 5, 0.0))
    fast, slow = planned(scene), planned(scene, speed_fraction=0.5)
    assert fast.pose_path is not None
    assert slow.pose_path is not None
    assert fast.pose_path.times is not None
    assert slow.pose_path.times is not None
    assert slow.pose_path.times[-1, 0] == pytest.approx(2 * fast.pose_path.times[-1, 0])
    assert check_plan(slow, scene) is None


def test_the_referee_refuses_times_that_are_too_short_or_do_not_add_up() -> None:
    scene, plan = corridor()
    path = plan.pose_path
    assert path is not None
    assert path.times is not None
    quick = check_plan(replace(plan, pose_path=replace(path, times=path.times * 0.9)), scene)
    assert quick is not None
    assert quick.rule == "times"
    late = path.times.copy()
    late[-1] += 5.0
    found = check_plan(replace(plan, pose_path=replace(path, times=late)), scene)
    assert found is not None
    assert found.rule == "cost"


def test_a_budget_and_unknown_obstacles_are_said() -> None:
    scene, _ = corridor()
    session = LatticeSipp().open(scene, np.random.default_rng(0))
    assert session.plan(budget=Budget(expansions=3)).status is Status.LIMIT
    unknown = replace(scene, traffic=(lampyris.RandomWalk(1),))
    assert any("not known" in note for note in planned(unknown).notes)


def test_times_count_from_when_it_is_asked_with_the_obstacles_of_then() -> None:
    """The same as in a scene whose tracks begin later, at whole ticks and between them."""
    scene, _ = corridor()
    track = scene.traffic[0].track  # type: ignore[union-attr]
    session = LatticeSipp(weight=1.0).open(scene, np.random.default_rng(0))
    later = session.plan(Change(time_s=7.0))
    fresh = planned(replace(scene, traffic=(lampyris.Recorded(track[7:], radius=0.4),)), weight=1.0)
    assert later.pose_path == fresh.pose_path
    assert later.pose_path != session.plan().pose_path
    between = session.plan(Change(time_s=6.5))
    assert between.pose_path is not None
    assert fresh.pose_path is not None
    assert between.pose_path.cost_m <= fresh.pose_path.cost_m + 0.5 + 1e-9, "it may wait for half a tick"


def test_the_same_answer_in_plain_and_compiled_form(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = np.zeros((10, 14), dtype=bool)
    track = [(10 - k, 5) for k in range(8)]
    scene = scene_of(walls, [track], (3, 5, 0.0), (11, 4, 0.0))
    first = planned(scene, weight=1.0)
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    from lampyris.kernels import _jit

    _jit.forget()
    second = planned(scene, weight=1.0)
    assert first.pose_path is not None
    assert second.pose_path is not None
    np.testing.assert_array_equal(first.pose_path.poses, second.pose_path.poses)
    np.testing.assert_array_equal(first.pose_path.times, second.pose_path.times)
    assert first.expansions == second.expansions
