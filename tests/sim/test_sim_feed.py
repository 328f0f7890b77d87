"""What the robot is told: what is trusted, what is not, and what follows from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sim_planners import grid_of

from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Patrol, RandomWalk
from lampyris.planning.graph.astar import AStar
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import drive
from lampyris.sim.sensor import FAULTS, FaultySensor, ObstacleMessage, PerfectSensor, SensorMonitor

FAR = (50.0, 50.0)


def told(stamp, *places, top=1.0):
    n = len(places)
    return ObstacleMessage(
        stamp, np.array(places, dtype=float).reshape(-1, 2), np.full(n, 0.5), np.full(n, top)
    )


def watch(**more):
    one = SensorMonitor(resolution=1.0, radius=0.3, **more)
    assert one.hear(1.0, [told(1.0, (0, 0), (5, 5))], FAR, True) == ""
    return one


def test_news_is_trusted():
    one = watch()
    assert one.hear(1.1, [told(1.1, (0.1, 0), (5, 5.1))], FAR, True) == ""
    assert one.last.stamp == 1.1
    assert one.hear(1.2, [told(1.2, (0.1, 0), (5, 5.1), (9, 9))], FAR, True) == ""  # one that appears


BOTH = told(1.1, (0, 0), (5, 5))


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (None, "no message"),
        (told(1.0, (0, 0), (5, 5)), "stamped 1 s again"),
        (told(0.5, (0, 0), (5, 5)), "stamped 0.5 s after 1 s"),
        (told(float("nan"), (0, 0), (5, 5)), "no number"),
        (told(9.0, (0, 0), (5, 5)), "in the future"),
        (told(1.1, (0, 0)), "1 of 2 obstacles are missing"),
        (told(1.1, (0, 0), (5, float("nan"))), "obstacle 1 has a place"),
        (told(1.1, (0, 0), (float("inf"), 5)), "obstacle 1 has a place"),
        (told(1.1, (0, 0), (5.2, 5)), "obstacle 1 jumps 0.2 m in 0.1 s"),
        (told(1.1, (0, 0), (5, 5), top=float("nan")), "obstacle 0 has a place"),
        (told(1.1, (0, 0), (5, 5), (50.2, 50)), "obstacle 2 is reported within"),
        (told(1.1, (0, 0), (1e300, 5)), "obstacle 1 has a place, size or speed that is no number, or beyond"),
        (told(1.1, (0, 0), (5, 5), top=-1.0), "obstacle 0 has a size or speed below 0"),
        (
            replace(told(1.1, (0, 0), (5, 5)), radius=np.array([0.5, -1.0])),
            "obstacle 1 has a size or speed below",
        ),
        (
            replace(told(1.1, (0, 0), (5, 5)), velocity=np.array([(0, 0), (np.inf, 0)])),
            "obstacle 1 has a place",
        ),
        (replace(told(1.1, (0, 0), (5, 5)), radius=np.array([0.5])), "2 places and another number"),
    ],
)
def test_what_is_not_trusted(message, why):
    one = watch()
    got = one.hear(1.1, [] if message is None else [message], FAR, True)
    assert why in got
    assert one.last.stamp == 1.0


def test_old_news_counts_up_to_an_age():
    one = watch(max_age=0.5)
    assert one.hear(1.6, [told(1.1, (0, 0), (5, 5))], FAR, True) == ""
    assert "0.51 s old" in one.hear(1.71, [told(1.2, (0, 0), (5, 5))], FAR, True)


def test_a_jump_is_believed_only_when_it_could_have_been_made():
    """Its stated top speed is 1 m/s: 2 m away it can be after 2 s, not before."""
    one = watch()
    for k in range(1, 20):
        now = 1.0 + 0.1 * k
        assert "jumps" in one.hear(now, [told(now, (0, 0), (7, 5))], FAR, True)
    assert one.hear(3.0, [told(3.0, (0, 0), (7, 5))], FAR, True) == ""


def test_a_standing_robot_may_be_run_into():
    one = watch()
    assert one.hear(1.1, [told(1.1, (0, 0), (5, 5))], (0.1, 0.0), False) == ""
    assert "within the robot" in one.hear(1.2, [told(1.2, (0, 0), (5, 5))], (0.1, 0.0), True)


def test_of_several_messages_the_newest_good_one_counts():
    one = watch()
    spoilt = told(1.2, (0, 0), (5, float("nan")))
    assert one.hear(1.2, [told(1.1, (0, 0), (5, 5)), spoilt], FAR, True) == ""
    assert one.last.stamp == 1.1


def test_noise_is_allowed_for():
    one = watch(noise=0.2)
    assert one.hear(1.1, [told(1.1, (0.3, 0), (5, 5.2))], FAR, True) == ""
    assert "jumps" in watch().hear(1.1, [told(1.1, (0.3, 0), (5, 5.2))], FAR, True)


def test_faults_leave_the_rest_alone():
    truth = told(2.0, (1, 1), (2, 2))
    for kind in FAULTS:
        feed = FaultySensor(kind, at=5.0, goal=(3, 3))
        assert feed.tell(2.0, truth, FAR) == [truth], kind
    assert PerfectSensor().tell(2.0, truth, FAR) == [truth]
    with pytest.raises(SettingError, match="did you mean stops"):
        FaultySensor("stop", at=1.0)
    with pytest.raises(SettingError, match="goal"):
        FaultySensor("goal-gone", at=1.0)


def test_late_messages_come_later():
    feed = FaultySensor("late", at=1.0, by=0.25)
    got = []
    for k in range(30):
        now = 0.1 * k
        got += [(round(now, 1), round(m.stamp, 1)) for m in feed.tell(now, told(now, (0, 0)), FAR)]
    assert [m for _, m in got] == sorted(m for _, m in got)
    assert all(now - m == pytest.approx(0.3) for now, m in got if now > 1.4)


ROOM = grid_of(*["." * 16] * 16)


def spoilt(kind, seed, lasts=np.inf):
    rng = np.random.default_rng(seed)
    robot = Robot(radius=0.2, v_max=1.5, a_max=float(rng.uniform(0.3, 2)), d_max=float(rng.uniform(0.5, 2)))
    spec = (RandomWalk(3), Patrol(((8, 3), (12, 3))))
    scene = Scene(ROOM, (0, 0), (15, 15), robot=robot, traffic=spec)
    feed = FaultySensor(
        kind, at=float(rng.uniform(1.0, 8.0)), lasts=lasts, obstacle=int(rng.integers(3)), goal=(15, 15)
    )
    return drive(scene, AStar(), seed=seed, sensor=feed, obstacle_speed=0.7), feed


@pytest.mark.commit(3)
@pytest.mark.parametrize("kind", [k for k in FAULTS if k != "goal-gone"])
def test_a_short_fault_is_survived(kind):
    for seed in range(3):
        run, _ = spoilt(kind, seed, lasts=0.5)
        assert check_drive(run) is None
        words = [m.sentence for m in run.moments if m.word == "fault"]
        assert words[1] == "The data can be trusted again."
        assert run.outcome in (Outcome.ARRIVED, Outcome.BLOCKED)


def test_no_data_from_the_beginning():
    scene = Scene(ROOM, (0, 0), (15, 15), traffic=(RandomWalk(2),))
    run = drive(scene, AStar(), sensor=FaultySensor("stops", at=0.0))
    assert run.outcome is Outcome.STOPPED
    assert run.sentence == "No message has arrived, from 0 s on."
    assert (run.v == 0.0).all()
    assert run.cause[0] == "no data"


def test_a_map_update_elsewhere_is_driven_round():
    run, _ = spoilt("goal-gone", 0)
    feed = FaultySensor("goal-gone", at=3.0, goal=(8, 8))
    run = drive(replace(run.scene, traffic=()), AStar(), sensor=feed)
    assert run.outcome is Outcome.ARRIVED
    assert run.replans == 1
    blocked = ROOM.blocked.copy()
    blocked[8, 8] = True
    after = np.linspace(0, run.curves[1].length, 500)
    gap = np.maximum(np.abs(run.curves[1].at(after)[0] - 8.0) - 0.5, 0.0)
    assert np.hypot(*gap.T).min() >= 0.2 - 1e-6


def test_a_feed_of_one_drive_tells_the_next_nothing_of_it():
    """A faulty feed kept the late messages of the drive before, and handed them to the next one."""
    scene = Scene(Grid(np.zeros((8, 12), bool)), (0, 0), (11, 7), traffic=RandomWalk(2))
    feed = FaultySensor("late", at=0.0, by=0.2)
    first, second = (drive(scene, AStar(), seed=3, sensor=feed, max_age=1.0) for _ in range(2))
    assert (first.outcome, first.t.tolist(), first.s.tolist()) == (
        second.outcome, second.t.tolist(), second.s.tolist()
    )  # fmt: skip
    assert feed == FaultySensor("late", at=0.0, by=0.2)
