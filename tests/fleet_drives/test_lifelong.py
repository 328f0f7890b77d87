"""Lifelong fleets: tasks in order, throughput, windows, faults, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris.errors import FileError, SettingError, UsageError
from lampyris.model.fleet.lifelong import MAX_WINDOW
from lampyris.model.settings.simulation import MAX_TICKS
from sizes import sized


def open_grid(width: int, height: int) -> lampyris.Grid:
    return lampyris.Grid(np.zeros((height, width), dtype=bool))


def test_one_robot_does_its_tasks_in_their_order() -> None:
    fleet = lampyris.Fleet(open_grid(9, 1), [lampyris.Agent((0, 0), (0, 0))])
    tasks = [
        lampyris.FleetTask([(3, 0), (1, 0)], 2),
        lampyris.FleetTask([(8, 0)], 0),
        lampyris.FleetTask([(0, 0)], 100),
    ]
    trace = lampyris.lifelong_fleet(fleet, 40, tasks=tasks)
    assert [task.release for task in trace.tasks] == [0, 2, 100]
    assert trace.done.tolist() == [8, 15, -1]
    assert trace.stop_ticks == ((8,), (13, 15), ())
    assert trace.assigned.tolist() == [0, 8, -1]
    assert trace.service_times.tolist() == [8, 13]
    assert trace.throughput == 2 / 40
    assert trace.utilisation == pytest.approx(15 / 40)


def test_tasks_of_an_agent_are_its_own() -> None:
    grid = open_grid(6, 6)
    agents = [
        lampyris.Agent((0, 0), (5, 0), tasks=[(5, 5), (0, 5)]),
        lampyris.Agent((1, 1), (1, 1), tasks=[(2, 2)]),
    ]
    trace = lampyris.lifelong_fleet(lampyris.Fleet(grid, agents), 40, tasks=())
    assert [(task.robot, task.stops) for task in trace.tasks] == [
        (0, ((5, 0),)), (0, ((5, 5),)), (0, ((0, 5),)), (1, ((2, 2),)),
    ]  # fmt: skip
    assert trace.done.tolist() == [5, 10, 15, 2]
    assert trace.robot.tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize("planner", ["pibt", "lacam"])
def test_random_tasks_keep_robots_busy_and_are_the_same_again(planner: str) -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 15, seed=2)
    one, other = (lampyris.lifelong_fleet(fleet, 60, planner=planner, seed=3) for _ in range(2))
    assert one == other
    assert one.completed > 20
    assert one.utilisation > 0.85
    assert len(one.xy) == 61
    assert one.throughput == pytest.approx(one.completed / 60)


@sized("count", 3, 60)
def test_random_fleets_with_faults_pass_the_referee(count: int) -> None:
    done = 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        blocked = rng.random((10, 12)) < 0.15
        blocked[5, 5:8] = False
        fleet = lampyris.random_fleet(lampyris.Grid(blocked), 8, seed=seed)
        faults = [(int(k), int(rng.integers(0, 40))) for k in rng.permutation(8)[:2]]
        planner = ["pibt", "lacam"][seed % 2]
        trace = lampyris.lifelong_fleet(
            fleet, 60, planner=planner, faults=faults, window=1 + seed % 4, seed=seed
        )
        done += trace.completed
        for robot, tick in faults:
            assert (trace.xy[tick:, robot] == trace.xy[tick, robot]).all()
    assert done > 10 * count


def test_several_robots_may_want_one_cell() -> None:
    fleet = lampyris.Fleet(open_grid(5, 5), [lampyris.Agent((0, 0), (0, 0)), lampyris.Agent((4, 4), (4, 4))])
    tasks = [lampyris.FleetTask([(2, 2)], 0), lampyris.FleetTask([(2, 2)], 0)]
    for planner in ("pibt", "lacam"):
        trace = lampyris.lifelong_fleet(fleet, 30, tasks=tasks, planner=planner)
        assert (trace.done >= 0).any()


def test_a_table_of_tasks(tmp_path: Path) -> None:
    grid = open_grid(6, 3)
    file = tmp_path / "tasks.csv"
    file.write_text("release,pickup_x,pickup_y,delivery_x,delivery_y\n0,1,1,5,2\n7,0,0,2,2\n")
    assert lampyris.load_tasks(file, grid) == (
        lampyris.FleetTask([(1, 1), (5, 2)], 0),
        lampyris.FleetTask([(0, 0), (2, 2)], 7),
    )
    file.write_text("release,x,y\n3,4,1\n")
    assert lampyris.load_tasks(file, grid) == (lampyris.FleetTask([(4, 1)], 3),)
    for text, line in (
        ("release,x,y\n3,4,9\n", ":2"),
        ("release,x,y\n0,0,0\n3.5,1,1\n", ":3"),
        ("release,x,y\n", ""),
        ("x,y\n1,1\n", ""),
    ):
        file.write_text(text)
        with pytest.raises(FileError) as caught:
            lampyris.load_tasks(file, grid)
        assert caught.value.code == "TASKS"
        assert line in caught.value.where


def test_what_is_given_is_checked() -> None:
    fleet = lampyris.Fleet(open_grid(5, 5), [lampyris.Agent((0, 0), (3, 3))])
    for code, more in (
        ("TICKS", {"ticks": 0}), ("TICKS", {"ticks": MAX_TICKS + 1}), ("WINDOW", {"window": 0}),
        ("WINDOW", {"window": MAX_WINDOW + 1}), ("FAULTS", {"faults": [(1, 3)]}), ("SEED", {"seed": -1}),
        ("TASK", {"tasks": [lampyris.FleetTask([(9, 9)])]}), ("TASK", {"tasks": [lampyris.FleetTask([(1, 1)], robot=4)]}),
        ("TASK", {"tasks": 3}),
    ):  # fmt: skip
        with pytest.raises(SettingError) as caught:
            lampyris.lifelong_fleet(**{"fleet": fleet, "ticks": 5, **more})
        assert caught.value.code == code, more
    with pytest.raises(UsageError) as wrong:
        lampyris.lifelong_fleet(fleet, 5, planner="cbs")
    assert wrong.value.code == "PLANNER"
    for bad in ({"stops": []}, {"stops": [(1, 2)], "release": -1}, {"stops": [(1, 2)], "release": 10**9 + 1}):
        with pytest.raises(SettingError):
            lampyris.FleetTask(**bad)
    assert lampyris.lifelong_fleet(fleet, 5, window=MAX_WINDOW).ticks == 5
