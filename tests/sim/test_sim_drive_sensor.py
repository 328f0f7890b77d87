"""A drive of a robot that does not know the map: it never relies on what it has not seen, and the referee knows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import lampyris
from lampyris import referee
from lampyris.errors import LampyrisError
from lampyris.model.trace import Outcome
from lampyris.planning import registry
from lampyris.planning.field.layers import free_cells
from lampyris.sim.continuous import drive as driving
from lampyris.sim.continuous.sight import CAUSE, MOST_SPACING, Sight

FAST = lampyris.Robot(radius=0.3, v_max=3.0, a_max=2.0, d_max=1.0)
LAWS = ("physical", "optimum", "blind", "constant")


def drawn(seed, most=18):
    """A scene, and settings of a drive with a sensor."""
    rng = np.random.default_rng((81, seed))
    walls = rng.random(tuple(rng.integers(5, most + 1, 2))) < rng.choice([0.1, 0.2, 0.3])
    robot = replace(FAST, radius=float(rng.choice([0.0, 0.3, 0.5])), v_max=float(rng.choice([1.0, 4.0])))
    free = np.argwhere(free_cells(lampyris.Grid(walls), robot.radius))
    if len(free) < 2:
        return drawn(seed + 10**6, most)
    (y, x), (v, u) = free[rng.choice(len(free), 2, replace=False)].tolist()
    settings = {
        "sensor_range": float(rng.choice([0.5, 1.5, 4.0])),
        "field_of_view": float(rng.choice([360.0, 120.0, 30.0])),
        "unseen_cost": float(rng.choice([1.0, 2.0])),
        "smooth": str(rng.choice(["straight", "arcs", "none"])),
        "period": float(rng.choice([0.1, 0.3])),
    }
    return lampyris.Scene(lampyris.Grid(walls), (x, y), (u, v), robot=robot), settings


def judged(seed, law, planner="dstar-lite"):
    """A drive that the referee has accepted, and whether there is a path."""
    scene, settings = drawn(seed)
    drive = driving.drive(scene, registry.make(planner, {}), law=law, **settings)
    fault = referee.check_drive(drive)
    assert fault is None, (seed, law, fault)
    return drive, bool(lampyris.plan(scene, "astar"))


def test_no_robot_relies_on_what_it_has_not_seen() -> None:
    drives = [judged(seed, LAWS[seed % 4]) for seed in range(4)]
    for seed, (drive, path) in enumerate(drives):
        assert drive.arrived == path, (seed, drive.outcome, drive.detail)
    assert sum(drive.replans for drive, _ in drives) > 3
    assert any(CAUSE in drive.cause for drive, _ in drives)


@pytest.mark.nightly
def test_hundreds_of_drives() -> None:
    drives = [
        judged(seed, LAWS[seed % 4], ("dstar-lite", "astar", "ad-gso")[seed % 3])
        for seed in range(1000, 1400)
    ]
    arrived = sum(drive.arrived for drive, _ in drives)
    print(
        f"400 drives, {arrived} arrived, {sum(path for _, path in drives)} can, {sum(d.replans for d, _ in drives)} replans"
    )
    assert all(path or not drive.arrived for drive, path in drives)
    assert arrived > 0.97 * sum(path for _, path in drives)


def corridor(sensor_range=2.0):
    """A fast drive along a hall that is longer than the sensor reaches."""
    scene = lampyris.Scene(lampyris.Grid(np.zeros((3, 40), dtype=bool)), (0, 1), (39, 1), robot=FAST)
    return scene, {"sensor_range": sensor_range, "law": "optimum"}


def test_a_short_view_makes_a_fast_robot_slow() -> None:
    scene, near = corridor(2.0)
    known, seen = (lampyris.drive(scene, "astar", **one) for one in ({"law": "optimum"}, near))
    assert seen.arrived
    assert CAUSE in seen.cause
    assert CAUSE not in known.cause
    # Within 2 cells and a little for bumpers it stands: v^2 / (2 d_max).
    assert known.v.max() == pytest.approx(3.0)
    assert math.sqrt(2 * 1.0) < seen.v.max() < math.sqrt(2 * 2.6)
    assert seen.sensor == lampyris.Sensor(2.0)


def test_the_referee_refuses_a_robot_that_drives_too_fast_for_what_it_sees(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene, _ = corridor()
    monkeypatch.setattr(Sight, "capped", lambda self, leg, ceiling, brake: leg)
    drive = driving.drive(scene, registry.make("astar", {}), law="optimum", sensor_range=2.0)
    fault = referee.check_drive(drive)
    assert fault is not None
    assert (fault.rule, "could not stand before" in fault.sentence) == ("unseen", True)


def test_the_referee_refuses_false_claims() -> None:
    scene, near = corridor(5.0)
    drive = lampyris.drive(scene, "astar", **near)
    assert drive.seen is not None

    def broken(**changed):
        fault = referee.check_drive(replace(drive, **changed))
        return None if fault is None else fault.rule

    early, late = drive.seen.copy(), drive.seen.copy()
    early[1, 30] = 0
    late[1, 30] += 20
    assert broken() is None
    assert broken(seen=early) == "sight"
    assert broken(seen=late) == "unseen"
    assert broken(seen=np.where(drive.seen > 5, -1, drive.seen)) == "unseen"
    assert broken(seen=None) == broken(sensor=None) == "seen"
    assert broken(sensor=lampyris.Sensor(3.5)) == "sight"


def test_a_goal_that_walls_enclose_is_found_out() -> None:
    walls = np.zeros((7, 12), dtype=bool)
    walls[2:5, 8:11] = True
    walls[3, 9] = False
    drive = lampyris.drive(
        lampyris.Scene(lampyris.Grid(walls), (0, 3), (9, 3)), "dstar-lite", sensor_range=3.0
    )
    assert drive.outcome is Outcome.STOPPED
    assert "By what the robot has seen there is no path." in drive.detail


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"planner": "lattice"}, "PLANNER"),
        ({"law": "dissertation"}, "LAW"),
        ({"tracking": "velocity"}, "SENSOR_TRACKING"),
        ({"spacing": 0.7}, "at most 0.5 of a cell"),
        ({"sensor_range": None, "unseen_cost": 2.0}, "together with sensor_range"),
    ],
)
def test_what_does_not_go_together_is_refused(more, message) -> None:
    scene = lampyris.Scene(lampyris.Grid(np.zeros((3, 9), dtype=bool)), (0, 1), (8, 1))
    with pytest.raises(LampyrisError, match=message):
        lampyris.drive(scene, more.pop("planner", "astar"), **{"sensor_range": 2.0, **more})


def test_nodes_may_be_half_a_cell_apart() -> None:
    scene = lampyris.Scene(lampyris.Grid(np.zeros((3, 9), dtype=bool)), (0, 1), (8, 1))
    assert lampyris.drive(scene, "astar", sensor_range=2.0, spacing=MOST_SPACING).arrived
