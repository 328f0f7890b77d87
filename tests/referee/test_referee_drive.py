"""The referee on drives: lawful ones pass, every corruption is caught by the rule that names it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from drive_builders import (
    Turtle,
    drive_of,
    good_drive,
    stretches,
    with_tracks,
)

from lampyris.errors import InternalFault
from lampyris.model.curve import Curve
from lampyris.model.drive import Drive, Moment
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle
from lampyris.referee import certify, check_drive
from lampyris.referee.drive import measure
from lampyris_selfcheck.reference.motion.drive_monitor import watch
from sizes import sized


def judge(drive: Drive) -> str | None:
    verdict = check_drive(drive)
    return None if verdict is None else verdict.rule


def hand(spin: bool = False, size: int = 24) -> Drive:
    """Four cells forward, a quarter circle of two, four forward; with ``spin`` a turn on the spot instead."""
    pen = Turtle(5.0, 5.0, 1.0, 0.0, 1.0)
    pen.forward(4)
    if spin:
        pen.spin(1)
    else:
        pen.round(2, 1)
    pen.forward(4)
    curve = pen.curve()
    robot = Robot(radius=0.4)
    rows = stretches(curve, robot, np.random.default_rng(3))
    t = np.concatenate(([0.0], np.cumsum([row[0] for row in rows])))
    s, v, a = np.array([row[1:] for row in rows] + [(curve.length, 0.0, 0.0)]).T
    goal = (round(pen.x), round(pen.y))
    scene = Scene(Grid(np.zeros((size, size), bool)), (5, 5), goal, robot=robot)
    return drive_of(scene, (curve,), t, s, v, a, np.zeros(len(t), int))


def changed(array: Any, k: int, by: float) -> Any:
    out = np.array(array)
    out[k] += by
    return out


def with_robot(drive: Drive, **limits: float) -> Drive:
    return replace(drive, scene=replace(drive.scene, robot=replace(drive.scene.robot, **limits)))


def with_wall(drive: Drive, x: int, y: int) -> Drive:
    blocked = np.array(drive.scene.grid.blocked)
    blocked[y, x] = True
    return replace(drive, scene=replace(drive.scene, grid=replace(drive.scene.grid, blocked=blocked)))


def still(x: float, y: float, radius: float = 0.4, since: float = 0.0) -> Track:
    return Track(np.array([since]), np.array([[x, y]]), radius, 0.5)


def parked(drive: Drive, seconds: float = 6.0) -> Drive:
    """The same drive after a wait at the start, where somebody may come and touch the robot."""
    t = np.concatenate(([0.0], drive.t + seconds))
    s, v, a = (np.concatenate(([0.0], x)) for x in (drive.s, drive.v, drive.a))
    end = Moment(float(t[-1]), "arrive", drive.scene.goal)
    return replace(
        drive,
        t=t,
        s=s,
        v=v,
        a=a,
        leg=np.zeros(len(t), int),
        cause=("wait", *drive.cause),
        cause_index=np.full(len(t), -1),
        moments=(end,),
    )


def visitor(drive: Drive, back: bool = True) -> Track:
    """Comes from the left onto the robot that stands on the start, and leaves."""
    x, y = drive.scene.start
    xy = [(x - 1.5, y), (x - 0.5, y), (x - 1.5 if back else x - 0.5, y)]
    return Track(np.array([0.0, 2.0, 4.0]), np.array(xy), 0.4, 0.5)


# ---- lawful drives -----------------------------------------------------------------------------------


@pytest.mark.nightly
@sized("cases", 20, 60)
def test_lawful_drives_pass(cases: int) -> None:
    rng = np.random.default_rng(21)
    for k in range(cases):
        res = (1.0, 0.05, 2.5)[k % 3]
        drive = good_drive(rng, legs=1 + k % 3, obstacles=k % 5, resolution=res)
        assert check_drive(drive) is None, k
        assert certify(drive) is drive


def test_what_the_referee_measures_is_what_a_watcher_sees() -> None:
    rng = np.random.default_rng(22)
    for k in range(6):
        drive = good_drive(rng, legs=1 + k % 2, obstacles=3, pieces=4)
        drive = with_wall(drive, int(rng.integers(40)), int(rng.integers(40)))
        seen, told = watch(drive, 0.01), measure(drive)
        assert told["gap"] == pytest.approx(seen.gap, abs=0.01)
        assert told["gap"] <= seen.gap + 1e-6
        assert seen.top <= drive.scene.robot.v_max + 1e-9
        assert seen.longest_jump <= drive.scene.robot.v_max * 1.001
        assert told["collisions"] == told["hits"] == 0
        if math.isfinite(told["wall"]):
            wall = max(seen.wall, 0.0)  # the watcher tells depth within a wall, too
            assert told["wall"] <= wall + 1e-6
            assert told["wall"] >= wall - 0.05


def test_a_drive_of_no_length() -> None:
    scene = Scene(Grid(np.zeros((3, 3), bool)), (1, 1), (1, 1))
    curve = Curve(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), (1.0, 1.0), 1.0)
    one = np.zeros(1)
    drive = drive_of(scene, (curve,), one, one, one, one, np.zeros(1, int))
    assert judge(drive) is None
    assert judge(replace(drive, outcome=Outcome.NO_PATH, moments=())) is None
    assert judge(replace(drive, outcome=Outcome.TIMEOUT, moments=())) == "outcome"
    assert judge(replace(drive, outcome=Outcome.START_OCCUPIED, moments=())) == "outcome"
    blocked = replace(drive, outcome=Outcome.START_OCCUPIED, moments=(), curves=())
    assert judge(with_wall(blocked, 1, 1)) is None
    measure(with_wall(blocked, 1, 1))


# ---- seeded defects ----------------------------------------------------------------------------------

MIDDLE = 40


def _leg_change(drive: Drive, at_rest: bool, shift: float = 0.0) -> Drive:
    """The curve's pieces as two curves, changed between where they meet."""
    one = drive.curves[0]
    cut = 1 if not at_rest else int(one.stops[0])
    end = (float(one.xy[cut][0]), float(one.xy[cut][1]))
    head = replace(
        one,
        xy=one.xy[:cut],
        heading=one.heading[:cut],
        lengths=one.lengths[:cut],
        curvature=one.curvature[:cut],
        end=end,
        stops=[],
    )
    tail = replace(
        one,
        xy=one.xy[cut:] + shift,
        heading=one.heading[cut:],
        lengths=one.lengths[cut:],
        curvature=one.curvature[cut:],
        end=(one.end[0] + shift, one.end[1] + shift),
        stops=[],
    )
    border = float(one.lengths[:cut].sum())
    k = int(np.searchsorted(drive.s, border - 1e-9))
    t, s, v, a = (np.array(x) for x in (drive.t, drive.s, drive.v, drive.a))
    if not at_rest and s[k] > border + 1e-9:  # a node exactly on the border
        dt = (
            2
            * (border - s[k - 1])
            / (v[k - 1] + math.sqrt(v[k - 1] ** 2 + 2 * a[k - 1] * (border - s[k - 1])))
        )
        t, s = np.insert(t, k, t[k - 1] + dt), np.insert(s, k, border)
        v, a = np.insert(v, k, v[k - 1] + a[k - 1] * dt), np.insert(a, k, a[k - 1])
    s[k:] -= border
    leg = np.zeros(len(t), int)
    leg[k:] = 1
    return replace(
        drive,
        curves=(head, tail),
        t=t,
        s=s,
        v=v,
        a=a,
        leg=leg,
        cause=("limit",) * len(t),
        cause_index=np.full(len(t), -1),
    )


def _curve(drive: Drive, **parts: Any) -> Drive:
    return replace(drive, curves=(replace(drive.curves[0], **parts),))


def _collision(drive: Drive) -> Drive:
    """It ends where it met somebody, and says so."""
    met = drive.at(np.array([drive.t[MIDDLE]]))[0][0]
    track = still(met[0] + 0.79, met[1])
    n = MIDDLE + 1
    cut = replace(
        drive,
        t=drive.t[:n],
        s=drive.s[:n],
        v=drive.v[:n],
        a=np.append(drive.a[:MIDDLE], 0.0),
        leg=drive.leg[:n],
        cause=drive.cause[:n],
        cause_index=drive.cause_index[:n],
        outcome=Outcome.COLLISION,
        moments=(Moment(float(drive.t[MIDDLE]), "contact", (met[0], met[1]), obstacle=0),),
    )
    return with_tracks(cut, [track])


def _told(drive: Drive, t: float, body: int = 0) -> Drive:
    moments = sorted((*drive.moments, Moment(t, "contact", (5.0, 5.0), obstacle=body)), key=lambda m: m.t)
    return replace(drive, moments=tuple(moments))


DEFECTS: list[tuple[str, str, Callable[[Drive], Drive]]] = [
    ("jump", "distance", lambda d: replace(d, s=changed(d.s, MIDDLE, 1e-3))),
    ("beyond the curve", "distance", lambda d: replace(d, s=d.s + 1.0)),
    ("speed jump", "pace", lambda d: replace(d, v=changed(d.v, -1, 1e-6))),
    ("too fast", "speed", lambda d: with_robot(d, v_max=float(d.v.max()) * 0.999)),
    ("backwards", "distance", lambda d: replace(d, v=changed(d.v, 5, -2.0))),
    ("too hard acceleration", "acceleration", lambda d: with_robot(d, a_max=float(d.a.max()) * 0.99)),
    ("too hard braking", "braking", lambda d: with_robot(d, d_max=float(-d.a.min()) * 0.99)),
    ("accelerates after the end", "acceleration", lambda d: replace(d, a=changed(d.a, -1, 0.1))),
    ("too fast in the bend", "lateral", lambda d: with_robot(d, a_lat_max=0.2)),
    ("bend too sharp", "bend", lambda d: with_robot(d, turn_radius=2.1)),
    ("clock stands", "time", lambda d: replace(d, t=changed(d.t, 5, float(d.t[4] - d.t[5])))),
    ("clock begins late", "time", lambda d: replace(d, t=d.t + 1.0)),
    ("no such curve", "leg", lambda d: replace(d, leg=d.leg + 1)),
    ("curve goes back", "leg", lambda d: replace(d, curves=d.curves * 2, leg=changed(d.leg, 3, 1))),
    ("broken curve", "curve", lambda d: _curve(d, xy=changed(d.curves[0].xy, 2, 0.1))),
    ("ends beside its end", "curve", lambda d: _curve(d, end=(d.curves[0].end[0] + 0.1, d.curves[0].end[1]))),
    ("other resolution", "curve", lambda d: _curve(d, resolution=0.5)),
    ("starts elsewhere", "start", lambda d: replace(d, scene=replace(d.scene, start=(5, 6)))),
    ("changes curves while it moves", "leg change", lambda d: _leg_change(d, at_rest=False)),
    ("over a stop", "turn", lambda d: _curve(d, stops=[1])),
    ("through a wall", "wall", lambda d: with_wall(d, 8, 5)),
    ("too near to a wall", "wall", lambda d: with_wall(with_robot(d, radius=0.51), 8, 6)),
    ("arc too near to a wall", "wall", lambda d: with_wall(with_robot(d, radius=1.3), 9, 7)),
    ("in somebody's way", "collision", lambda d: with_tracks(d, [still(8, 5)])),
    ("grazes", "collision", lambda d: with_tracks(d, [still(8, 5.8 - 1e-7)])),
    ("grazes in the arc", "collision", lambda d: with_tracks(d, [still(9, 7, 1.6 + 1e-7)])),
    (
        "a body jumps",
        "obstacle speed",
        lambda d: with_tracks(d, [Track(np.array([0.0, 1.0]), np.array([[20.0, 20], [20, 21]]), 0.4, 0.5)]),
    ),
    (
        "a body's size",
        "obstacle size",
        lambda d: replace(
            with_tracks(d, [still(20, 20)]), obstacle_specs=(Obstacle("recorded", 0.5, False),)
        ),
    ),
    ("a track too many", "tracks", lambda d: replace(d, tracks=(still(20, 20),))),
    ("nobody tells of the hit", "unreported contact", lambda d: with_tracks(parked(d), [visitor(d)])),
    ("one that yields comes", "yield", lambda d: with_tracks(parked(d), [visitor(d)], yields=True)),
    (
        "told of a hit that was none",
        "reported contact",
        lambda d: _told(with_tracks(d, [still(20, 20)]), 1.0),
    ),
    ("told of a body that is not", "reported contact", lambda d: _told(d, 1.0, body=0)),
    ("told too early", "unreported contact", lambda d: with_tracks(_told(parked(d), 0.1), [visitor(d)])),
    ("wrong end", "outcome", lambda d: replace(d, scene=replace(d.scene, goal=(12, 12)))),
    ("arrived unsaid", "outcome", lambda d: replace(d, outcome=Outcome.TIMEOUT, moments=())),
    ("collision without one", "outcome", lambda d: replace(d, outcome=Outcome.COLLISION)),
    (
        "hit without one",
        "outcome",
        lambda d: replace(with_tracks(d, [still(20, 20)]), outcome=Outcome.HIT, moments=()),
    ),
    ("occupied goal", "outcome", lambda d: replace(d, outcome=Outcome.GOAL_OCCUPIED, moments=())),
    ("moment after the end", "moments", lambda d: replace(d, moments=(Moment(1e3, "wait", (5.0, 5.0)),))),
    (
        "moments out of order",
        "moments",
        lambda d: replace(d, moments=tuple(Moment(t, "wait", (5.0, 5.0)) for t in (2.0, 1.0))),
    ),
    (
        "a moment's body",
        "moments",
        lambda d: replace(d, moments=(Moment(1.0, "wait", (5.0, 5.0), obstacle=3),)),
    ),
    ("no period", "numbers", lambda d: replace(d, period=0.0)),
    ("replans", "numbers", lambda d: replace(d, replans=-1)),
]


@pytest.mark.parametrize(("name", "rule", "spoil"), DEFECTS, ids=[d[0] for d in DEFECTS])
def test_defects_are_named(name: str, rule: str, spoil: Callable[[Drive], Drive]) -> None:
    drive = hand()
    assert check_drive(drive) is None
    spoilt = spoil(drive)
    verdict = check_drive(spoilt)
    assert verdict is not None
    assert verdict.rule == rule, verdict
    assert len(str(verdict)) < 300
    with pytest.raises(InternalFault, match=rule):
        certify(spoilt)


def test_near_misses_of_the_defects_pass() -> None:
    """The lawful neighbour of a defect: a wall that is just far enough, a contact that is told of."""
    d = hand()
    assert judge(with_wall(with_robot(d, radius=0.5), 8, 6)) is None
    assert judge(with_wall(with_robot(d, radius=2 - math.sqrt(0.5) - 1e-6), 9, 7)) is None
    assert judge(with_tracks(d, [still(8, 5.8)])) is None
    assert judge(with_tracks(d, [still(9, 7, 1.6)])) is None
    assert judge(with_tracks(d, [still(8, 5, since=1e3)])) is None
    assert judge(_told(with_tracks(parked(d), [visitor(d)]), 2.0)) is None
    assert judge(_told(with_tracks(parked(d), [visitor(d)]), 2.0, body=1)) == "unreported contact"
    assert judge(replace(with_robot(d, a_lat_max=0.2), law="rpp")) is None
    assert judge(replace(with_robot(d, a_lat_max=0.2), law="dissertation")) is None
    assert judge(with_wall(replace(d, outcome=Outcome.GOAL_OCCUPIED, moments=()), *d.scene.goal)) == "outcome"


def test_collision_that_is_owned_up_to() -> None:
    drive = _collision(hand())
    assert judge(drive) is None
    assert measure(drive)["collisions"] == 1
    assert judge(replace(drive, outcome=Outcome.TIMEOUT)) == "collision"
    late = with_tracks(drive, [still(float(drive.tracks[0].xy[0, 0]) - 0.5, 5.0)])
    assert judge(late) == "collision"  # touched long before its end
    instant = with_tracks(drive, [still(float(drive.tracks[0].xy[0, 0]) + 0.01 + 5e-7, 5.0)])
    assert judge(instant) is None  # it ends in the very instant of the contact
    assert measure(instant)["collisions"] == 1
    far = with_tracks(drive, [still(20.0, 5.0)])
    assert judge(replace(far, moments=())) == "outcome"


def test_hit_at_the_end_is_an_outcome() -> None:
    d = parked(hand())
    short = replace(
        d,
        t=[0.0, 3.0],
        s=[0.0, 0.0],
        v=[0.0, 0.0],
        a=[0.0, 0.0],
        leg=[0, 0],
        cause=("wait", "wait"),
        cause_index=[-1, -1],
        outcome=Outcome.HIT,
        moments=(Moment(2.9, "hit", (5.0, 5.0), obstacle=0),),
    )
    assert judge(with_tracks(short, [visitor(d, back=False)])) is None
    away = Track(np.array([0.0, 0.5, 2.5]), np.array([[4.3, 5], [4.3, 5], [3.3, 5]]), 0.4, 0.5)
    assert (
        judge(replace(with_tracks(short, [away]), moments=(Moment(0.1, "hit", (5, 5), obstacle=0),)))
        == "outcome"
    )


def test_stops_and_leg_changes_at_rest_pass() -> None:
    d = hand(spin=True)
    assert judge(d) is None
    assert judge(_leg_change(d, at_rest=True)) is None
    assert judge(_leg_change(d, at_rest=True, shift=0.01)) == "leg change"
    assert judge(_curve(with_robot(d, turn_radius=0.1), stops=[])) == "curve"
    assert judge(_curve(d, stops=[7])) == "curve"


def test_outside() -> None:
    d = hand()
    small = replace(d.scene.grid, blocked=np.zeros((24, 11), bool))
    scene = replace(d.scene, grid=small, goal=(10, 11))
    assert judge(replace(d, scene=scene)) == "outside"
