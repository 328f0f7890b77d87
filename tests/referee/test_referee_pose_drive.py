"""The referee on drives of robots with a heading: each rule is broken once, and found."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from lampyris.model.curve import PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import RandomWalk, Recorded
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.referee import check_drive
from lampyris.referee.geometry.lines_and_arcs import pieces_of
from lampyris.referee.geometry.moving_discs import gap_at, motion_of
from lampyris.sim.continuous.drive import drive

BOX = ((0.5, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.5, -0.2))


@cache
def sound(kind: str = "differential") -> Drive:
    """Through a door, round a corner, with a turn in place where the drive allows it."""
    walls = np.zeros((60, 80), dtype=np.bool_)
    walls[:, 40:43] = True
    walls[20:34, 40:43] = False
    robot = Robot(
        footprint=BOX, drive=kind, turn_radius=0.4 if kind == "ackermann" else 0.0, yaw_rate_max=0.6
    )
    grid = Grid(walls, resolution=0.05)
    goal = (3.0, 1.5, math.pi / 2)
    scene = Scene(grid, start_pose=(1.0, 1.5, 0.0), goal_pose=goal, robot=robot, traffic=RandomWalk(3))
    made = drive(scene, LatticePlanner(turn_cost=0.01), seed=3)
    assert check_drive(made) is None
    assert made.arrived
    return made


def curve(one: Drive, **fields: object) -> Drive:
    return replace(one, curves=(replace(one.curves[0], **fields), *one.curves[1:]))


def robot(one: Drive, **fields: object) -> Drive:
    return replace(
        one, scene=replace(one.scene, start=None, goal=None, robot=replace(one.scene.robot, **fields))
    )


def ends(one: Drive, **poses: tuple[float, float, float]) -> Drive:
    """Another pose for an end."""
    given = {f"{what}_pose": pose for what, pose in poses.items()} | dict.fromkeys(poses)
    return replace(one, scene=replace(one.scene, **given))


def in_place(one: Drive) -> PoseCurve:
    found = one.curves[0]
    assert isinstance(found, PoseCurve)
    assert found.in_place.any()
    return found


def wider(one: Drive) -> Drive:
    """Within the same circle, and wider than the door."""
    half = ((0.5, 0.2), (0.3, 0.44), (-0.3, 0.44))
    return robot(one, footprint=(*half, *((x, -y) for x, y in reversed(half))))


def turned(one: Drive, k: int, by: float) -> Drive:
    yaw = in_place(one).yaw.copy()
    yaw[k] += by
    return curve(one, yaw=yaw)


def onto(one: Drive) -> Drive:
    """An obstacle's track laid onto the robot, half way."""
    t = 0.5 * one.duration
    track = one.tracks[0]
    at = one.at(np.array([t]))[0]
    return replace(
        one,
        tracks=(
            replace(track, t=np.array([0.0, one.duration]), xy=np.repeat(at, 2, axis=0)),
            *one.tracks[1:],
        ),
    )


def longer_turn(one: Drive) -> Drive:
    """A turn in place that counts for less than what the farthest vertex moves."""
    found = in_place(one)
    turn = np.where(found.in_place, 2.0 * found.turn, found.turn)
    return curve(one, turn=turn)


FAULTS: dict[str, tuple[str, Callable[[Drive], Drive]]] = {
    "too wide for the door": ("wall", wider),
    "yaw that jumps": ("pose", lambda one: turned(one, 1, 0.1)),
    "to the side": ("pose", lambda one: turned(one, 0, 0.1)),
    "ackermann in place": ("pose", lambda one: robot(one, drive="ackermann")),
    "a sharper turn than it can": ("bend", lambda one: robot(one, turn_radius=30.0)),
    "turns too fast": ("yaw rate", lambda one: robot(one, yaw_rate_max=0.3)),
    "turns farther than it counts": ("pose", longer_turn),
    "no stops": ("curve", lambda one: curve(one, stops=np.zeros(0, dtype=np.int64))),
    "another goal": ("outcome", lambda one: ends(one, goal=(3.0, 1.2, 1.57))),
    "another yaw at the goal": ("outcome", lambda one: ends(one, goal=(3.0, 1.5, -1.57))),
    "another yaw at the start": ("start", lambda one: ends(one, start=(1.0, 1.5, 1.0))),
    "not arrived": ("outcome", lambda one: replace(one, outcome=Outcome.TIMEOUT, moments=())),
    "driven into": ("collision", onto),
}  # fmt: skip


@pytest.mark.commit(6)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_broken_rule_is_found(fault: str) -> None:
    rule, broken = FAULTS[fault]
    found = check_drive(broken(sound()))
    assert found is not None
    assert found.rule == rule, found


@pytest.mark.nightly
def test_a_straight_robot_that_turns_wider_than_its_radius_is_sound() -> None:
    for kind in ("ackermann", "omnidirectional"):
        assert check_drive(sound(kind)) is None


def test_an_obstacle_may_be_within_the_circle_but_not_on_the_footprint() -> None:
    """Beside a long robot that stands: nearer to its base than its radius, and no contact."""
    one = sound()
    pieces = pieces_of(one.curves, one.scene.grid.resolution)
    motion = motion_of(one.t, one.s, one.v, one.a, one.leg, pieces, np.array(BOX))
    end = np.array([one.duration])
    yaw = one.poses(end)[0, 2]
    right = np.array([math.sin(yaw), math.cos(yaw)])  # rows point down
    for away in (0.28, 0.21):
        place = one.at(end)[0] + right * away / 0.05
        track = replace(
            one.tracks[0], t=np.array([0.0, one.duration]), xy=np.repeat(place, 2, axis=0), radius=0.05
        )
        assert away < one.scene.robot.radius
        assert gap_at(motion, track, 0.0, 0.05, one.duration) == pytest.approx(away - 0.2 - 0.05, abs=1e-9)


def test_who_runs_into_a_standing_footprint_is_reported() -> None:
    grid = Grid(np.zeros((40, 60), dtype=np.bool_), resolution=0.05)
    ends = {"start_pose": (1.5, 1.5, 0.0), "goal_pose": (2.5, 1.5, 0.0)}
    track = Recorded(tuple((x, 9) for x in range(60)), 0.1)
    scene = Scene(grid, **ends, robot=Robot(footprint=BOX), traffic=track)
    made = drive(scene, LatticePlanner(), obstacle_speed=2.0, on_hit="go-on", seed=1)
    assert check_drive(made) is None
    assert [m.word for m in made.moments].count("hit") == 1
    silent = replace(made, moments=tuple(m for m in made.moments if m.word != "hit"))
    found = check_drive(silent)
    assert found is not None
    assert found.rule == "unreported contact"
    late = replace(
        made, moments=tuple(replace(m, t=m.t + 3.0) if m.word == "hit" else m for m in made.moments[:1])
    )
    assert check_drive(late) is not None
