"""Optimal reciprocal collision avoidance: what it promises, and contacts that are counted as they are."""

from __future__ import annotations

import numpy as np
import pytest
from drive_checks import least_gap

import lampyris
from lampyris.kernels.fleet_motion import orca as kernels


def open_fleet(ends: list[tuple[tuple[int, int], tuple[int, int]]], side: int = 15) -> lampyris.Fleet:
    grid = lampyris.Grid(np.zeros((side, side), dtype=bool))
    return lampyris.Fleet(grid, [lampyris.Agent(a, b) for a, b in ends])


def test_two_that_meet_head_on_pass_each_other() -> None:
    fleet = open_fleet([((2, 7), (12, 7)), ((12, 7), (2, 7))])
    trace = lampyris.simulate_fleet(fleet, policy="orca", robot=lampyris.Robot(radius=0.35))
    assert trace.status is lampyris.Status.FOUND
    assert (trace.contacts, trace.wall_contacts) == (0, 0)
    assert 1.0 <= least_gap(trace) < 1.2
    assert trace.arrivals.max() < 20


def test_no_speed_limit_is_exceeded_and_walls_are_never_touched() -> None:
    robots = [lampyris.Robot(radius=r, v_max=v) for r, v in ((0.2, 0.5), (0.35, 1.5), (0.3, 1.0))]
    grid = lampyris.load_grid("rooms-20")
    drawn = lampyris.random_fleet(grid, 9, seed=3)
    agents = [lampyris.Agent(one.start, one.goal, robots[k % 3]) for k, one in enumerate(drawn.robots)]
    trace = lampyris.simulate_fleet(lampyris.Fleet(grid, agents), policy="orca")
    assert trace.wall_contacts == 0
    top = np.array([one.v_max for one in trace.robots])[trace.robot]
    assert (trace.v <= top * (1 + 1e-9)).all()
    assert trace.arrived >= 7


def test_contacts_are_counted_as_a_slow_count_finds_them() -> None:
    grid = lampyris.load_grid("rooms-20")
    fleet = lampyris.random_fleet(grid, 14, seed=0)
    trace = lampyris.simulate_fleet(fleet, policy="orca", robot=lampyris.Robot(radius=0.35), drive_limit=60.0)
    from drive_checks import places

    xy = places(trace, np.arange(0.0, trace.duration_s + 0.01, 0.01))
    touching = 0
    for i in range(14):
        for j in range(i):
            gap = np.sqrt(((xy[:, i] - xy[:, j]) ** 2).sum(axis=1)).min()
            touching += gap < 0.7 * (1 - 1e-6)
    assert trace.contacts >= touching > 0
    assert trace.contacts <= touching + 2


def brute_force(lines: np.ndarray, top: float, wanted: np.ndarray) -> np.ndarray | None:
    """The permitted velocity nearest to the wanted one, from all points where the optimum can be."""
    found = [wanted * min(1.0, top / max(np.hypot(*wanted), 1e-300))]
    for px, py, dx, dy in lines:
        p, d = np.array((px, py)), np.array((dx, dy))
        found.append(p + d * (d @ (wanted - p)))
        root = (p @ d) ** 2 + top**2 - p @ p
        if root >= 0:
            found += [p + d * (-(p @ d) + sign * np.sqrt(root)) for sign in (-1, 1)]
        for qx, qy, ex, ey in lines:
            cross = dx * ey - dy * ex
            if abs(cross) > 1e-9:
                found.append(p + d * ((ex * (py - qy) - ey * (px - qx)) / cross))
    fits = [
        v for v in found
        if np.hypot(*v) <= top * (1 + 1e-9) and all(dx * (v[1] - py) - dy * (v[0] - px) >= -1e-9 for px, py, dx, dy in lines)
    ]  # fmt: skip
    return min(fits, key=lambda v: np.hypot(*(v - wanted))) if fits else None


def test_the_linear_program_finds_the_nearest_permitted_velocity() -> None:
    rng = np.random.default_rng(5)
    solved = 0
    for _ in range(400):
        count = int(rng.integers(1, 7))
        angle = rng.uniform(0, 2 * np.pi, count)
        lines = np.stack(
            (rng.normal(size=count), rng.normal(size=count), np.cos(angle), np.sin(angle)), axis=1
        )
        wanted = rng.normal(size=2)
        best = brute_force(lines, 1.5, wanted)
        found = np.zeros(2)
        done = kernels._nearest.run_plain(lines.ravel().copy(), count, 1.5, *wanted.tolist(), False, found)
        assert (done == count) == (best is not None)
        if best is not None:
            solved += 1
            assert found == pytest.approx(best, abs=1e-6)
    assert solved > 100
