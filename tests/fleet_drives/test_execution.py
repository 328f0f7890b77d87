"""Fleet plans that are driven in continuous time: motion by hand, order of visits, delays, faults, obstacles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drive_checks import crossing, least_gap, places, ring

import lampyris
from lampyris.errors import SettingError, UsageError
from sizes import sized


def line(length: int, robot: lampyris.Robot | None = None, **more: object) -> lampyris.FleetTrace:
    """One robot that drives straight over so many cells."""
    grid = lampyris.Grid(np.zeros((1, length + 1), dtype=bool))
    fleet = lampyris.Fleet(grid, [lampyris.Agent((0, 0), (length, 0))])
    return lampyris.simulate_fleet(fleet, robot=robot, **more)


def test_a_straight_drive_takes_the_time_of_a_trapezoid() -> None:
    trace = line(10)
    # 0 to 1 m/s in 2 s and 1 m, 1 m/s to 0 in 1 s and 0.5 m, 8.5 m at 1 m/s.
    assert trace.arrivals[0] == pytest.approx(2 + 8.5 + 1)
    assert trace.planned[0] == 10.0
    assert trace.lateness[0] == pytest.approx(1.5)
    slow = line(1)
    # A triangle: peak^2 / (2 * 0.5) + peak^2 / 2 = 1 m.
    peak = np.sqrt(2 / 3)
    assert slow.arrivals[0] == pytest.approx(2 * peak + peak)
    assert slow.t.tolist()[1] == pytest.approx(2 * peak)


def test_a_corner_costs_a_stop_and_a_turn() -> None:
    grid = lampyris.Grid([[False, False], [True, False]])
    fleet = lampyris.Fleet(grid, [lampyris.Agent((0, 0), (1, 1))])
    leg = 3 * np.sqrt(2 / 3)
    turning = lampyris.simulate_fleet(fleet, robot=lampyris.Robot(radius=0.3, yaw_rate_max=0.5))
    assert turning.arrivals[0] == pytest.approx(2 * leg + np.pi / 2 / 0.5)
    assert turning.wait_totals()["turning"] == pytest.approx(np.pi)
    sideways = lampyris.simulate_fleet(fleet, robot=lampyris.Robot(radius=0.3, drive="omnidirectional"))
    assert sideways.arrivals[0] == pytest.approx(2 * leg)


def test_who_is_second_waits_until_the_first_has_left_the_cell_whole() -> None:
    fleet, plan = crossing()
    robots = [
        replace(one, robot=lampyris.Robot(radius=0.3, v_max=v))
        for one, v in zip(fleet.robots, (0.2, 2.0), strict=True)
    ]
    trace = lampyris.simulate_fleet(lampyris.Fleet(fleet.grid, robots), plan)
    assert trace.contacts == 0
    times = np.arange(0.0, trace.duration_s, 0.01)
    xy = places(trace, times)
    centre = fleet.grid.to_metres((2, 2))
    reached = times[np.argmax(xy[:, 0, 0] >= centre[0] + 1 - 1e-6)]
    entered = times[np.argmax(xy[:, 1, 1] < centre[1] + 1 - 1e-6)]
    assert entered >= reached - 0.02
    assert trace.waits[1, 0] > 5.0
    assert trace.waits[0].sum() == 0.0


def test_a_ring_of_robots_moves_as_one_and_a_delay_holds_all_of_it() -> None:
    fleet, plan = ring()
    trace = lampyris.simulate_fleet(fleet, plan, robot=lampyris.Robot(radius=0.3535))
    assert (trace.status, trace.rotations, trace.contacts) == (lampyris.Status.FOUND, 1, 0)
    assert least_gap(trace) >= 1.0 - 1e-6
    late = lampyris.simulate_fleet(fleet, plan, delays=lampyris.Delays(1.0, 5.0), seed=3)
    assert np.ptp(late.arrivals) < 1e-9
    assert late.arrivals[0] > trace.arrivals[0]
    assert late.delayed == 4


def test_the_slowest_of_a_ring_sets_the_pace() -> None:
    fleet, plan = ring()
    agents = [
        replace(one, robot=lampyris.Robot(radius=0.3, v_max=0.1 if k == 2 else 1.0))
        for k, one in enumerate(fleet.robots)
    ]
    trace = lampyris.simulate_fleet(lampyris.Fleet(fleet.grid, agents), plan)
    assert np.ptp(trace.arrivals) < 1e-9
    assert trace.arrivals[0] == pytest.approx(10.0, abs=0.3)


@pytest.mark.source
@sized("count", 6, 300)
def test_random_drives_never_touch_and_all_arrive(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[2] / "tools"))
    import fleet_runs

    delayed = failed = 0
    for number in range(5000, 5000 + count):
        trace, faulty = fleet_runs.drive(number)
        if trace is None:
            continue
        delayed += trace.delayed
        failed += faulty
        assert (trace.contacts, trace.wall_contacts, trace.moving_contacts) == (0, 0, 0)
        if not faulty and not trace.obstacles:
            assert trace.status is lampyris.Status.FOUND
        if len(trace.robots) < 12 and number % 3 == 0:
            assert least_gap(trace, 0.05) >= 1.0 - 1e-6
    assert delayed > 10 * count


def test_delays_make_robots_late_and_nothing_else() -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 12, seed=2)
    plan = lampyris.plan_fleet(fleet)
    sharp, held = (
        lampyris.simulate_fleet(fleet, plan, delays=lampyris.Delays(p, 4.0), seed=1) for p in (0.0, 0.3)
    )
    assert sharp.delayed == 0
    assert held.delayed > 20
    assert held.arrivals.sum() > sharp.arrivals.sum() + 50
    assert held.wait_totals()["delay"] > 50
    for trace in (sharp, held):
        stood = trace.waits.sum(axis=1) + trace.driving
        assert np.allclose(stood, trace.arrivals)
    again = lampyris.simulate_fleet(fleet, plan, delays=lampyris.Delays(0.3, 4.0), seed=1)
    assert again == held
    assert lampyris.simulate_fleet(fleet, plan, delays=lampyris.Delays(0.3, 4.0), seed=2) != held


def test_others_drive_around_a_robot_that_has_stopped() -> None:
    grid = lampyris.Grid(np.zeros((3, 9), dtype=bool))
    fleet = lampyris.Fleet(grid, [lampyris.Agent((2, 1), (8, 1)), lampyris.Agent((0, 1), (7, 1))])
    trace = lampyris.simulate_fleet(fleet, faults=[(0, 3.0)])
    assert trace.status is lampyris.Status.FOUND
    assert trace.faults == ((0, 3.0),)
    assert len(trace.plans) == 2
    assert np.isnan(trace.arrivals[0])
    assert trace.arrivals[1] > 7
    rest = trace.at(1e9)[0]
    assert (trace.at(3.0)[0] != rest).any()
    # 1 m/s at most and 1 m/s2: it stands within half a metre.
    assert abs(rest - trace.at(3.0)[0]).max() <= 0.5 + 1e-9


def test_who_cannot_pass_waits_and_the_reason_is_told() -> None:
    grid = lampyris.Grid(np.zeros((1, 9), dtype=bool))
    fleet = lampyris.Fleet(grid, [lampyris.Agent((2, 0), (8, 0)), lampyris.Agent((0, 0), (7, 0))])
    trace = lampyris.simulate_fleet(fleet, faults=[(0, 2.0)])
    assert trace.status is lampyris.Status.NO_PATH
    assert not trace
    assert "robot 1" in trace.sentence
    assert trace.contacts == 0
    after = line(5, faults=[(0, 1000.0)])
    assert after.faults == ()


@pytest.mark.parametrize("info", ["speed", "track"])
def test_no_driving_robot_touches_an_obstacle(info: str) -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 8, seed=4)
    trace = lampyris.simulate_fleet(fleet, obstacles=6, obstacle_info=info, seed=5, drive_limit=400.0)
    assert len(trace.obstacles) == 6
    assert trace.moving_contacts == 0
    assert trace.wait_totals()["obstacle"] > 0


def test_an_obstacle_on_the_way_for_ever_ends_at_the_limit() -> None:
    stone = lampyris.Track([0.0], [(3, 0)], 0.3, 0.1)
    trace = line(6, tracks=[stone], drive_limit=30.0)
    assert trace.status is lampyris.Status.LIMIT
    assert trace.obstacle_contacts == 0
    assert trace.wait_totals()["obstacle"] > 15


def test_what_is_given_is_checked() -> None:
    fleet, plan = crossing()
    other = lampyris.Fleet(fleet.grid, fleet.robots[::-1])
    for code, more in (
        ("FLEET_PLAN", {"fleet": other}), ("FLEET_DRIVE", {"policy": "none"}), ("FAULTS", {"faults": [(2, 1.0)]}),
        ("FAULTS", {"faults": [(0, -1.0)]}), ("FAULTS", {"faults": [(0, 1.0), (0, 2.0)]}), ("TRACK", {"tracks": [3]}),
        ("FLEET_ROBOT", {"robot": lampyris.Robot(radius=0.4)}), ("FLEET_DRIVE", {"policy": "orca", "obstacles": 3}),
        ("FLEET_ROBOT", {"robot": lampyris.Robot(radius=0.1, drive="ackermann", turn_radius=1.0)}), ("SEED", {"seed": -1}),
    ):  # fmt: skip
        with pytest.raises(SettingError) as caught:
            lampyris.simulate_fleet(**{"fleet": fleet, "plan": plan, **more})
        assert caught.value.code == code, more
    with pytest.raises(UsageError) as clash:
        lampyris.simulate_fleet(fleet, plan, drive_settings={"policy": "order"}, policy="order")
    assert clash.value.code == "SETTING_CLASH"
    with pytest.raises(SettingError) as caught:
        lampyris.Delays(1.5)
    assert caught.value.code == "DELAYS"


def test_octile_plans_are_driven_without_contact_by_robots_that_follow_round_corners() -> None:
    """Of 0.3 cells, robots of a ring touched where one followed another at an angle of 45 degrees."""
    grid = lampyris.load_grid("rooms-20")
    for seed in range(6):
        fleet = lampyris.random_fleet(grid, 12, seed=seed)
        plan = lampyris.plan_fleet(fleet, moves="octile", seed=seed)
        trace = lampyris.simulate_fleet(
            fleet, plan, delays=lampyris.Delays(0.2), faults=[(0, 6.0)], seed=seed
        )
        assert trace.contacts == 0
        assert trace.robots[0].radius == pytest.approx(0.22)
        with pytest.raises(lampyris.SettingError, match="follow each other"):
            lampyris.simulate_fleet(fleet, plan, robot=lampyris.Robot(radius=0.3))
