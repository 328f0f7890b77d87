"""Drives in continuous time: nobody is driven into, everybody arrives, and the story is the motion."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from sim_planners import Breadth, Scripted, fail, grid_of

from lampyris import api
from lampyris.errors import SceneError, SettingError, UsageError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import MAX_PASSED
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.motion.laws.registry import LAWS
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Budget
from lampyris.planning.graph.astar import AStar
from lampyris.planning.graph.theta_star import ThetaStar
from lampyris.referee import check_curve, check_drive
from lampyris.referee.drive import measure
from lampyris.sim.continuous.drive import DriveSimulation, drive
from lampyris.sim.continuous.leg import closed_cells, comfort, curve_from
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.traffic.adversary import Adversary
from sizes import sized, some

ROOM = grid_of(*["." * 16] * 16)
LANE = grid_of("." * 20)


def random_run(seed, law="physical", **settings):
    """A small random map with everything that moves; None where the obstacles do not fit."""
    rng = np.random.default_rng(seed)
    h, w = rng.integers(8, 20, 2)
    blocked = rng.random((h, w)) < rng.choice([0.0, 0.1, 0.2])
    resolution = float(rng.choice([0.1, 0.5, 1.0]))
    free = np.argwhere(~blocked)
    (sy, sx), (gy, gx), *others = free[rng.integers(len(free), size=5)].tolist()
    robot = Robot(
        radius=float(rng.choice([0, 0.2, 0.45, 0.6])) * resolution,
        v_max=float(rng.uniform(0.2, 2)),
        a_max=float(rng.uniform(0.2, 2)),
        d_max=float(rng.uniform(0.3, 2)),
        a_lat_max=float(rng.uniform(0.3, 2)),
        turn_radius=float(rng.choice([0, 0, 0.5])) * resolution,
    )
    rate = None if rng.random() < 0.5 else 0.5
    spec = [RandomWalk(int(rng.integers(0, 5)), rate=rate, radius=float(rng.choice([0, 0.4])) * resolution)]
    if rng.random() < 0.4:
        spec.append(Crossing(int(rng.integers(1, 3))))
    if rng.random() < 0.4:
        spec.append(Patrol(tuple((x, y) for y, x in others)))
    cutters = [Adversary(float(rng.uniform(0.2, 2)), count=int(rng.integers(0, 3)), wait=5.0)]
    moves = str(rng.choice(["octile", "dissertation"]))
    planner = (AStar(), ThetaStar(), AdGso())[int(rng.integers(3))]
    speed = float(rng.uniform(0.2, 1.5)) * robot.v_max
    scene = Scene(Grid(blocked, resolution=resolution), (sx, sy), (gx, gy), moves, robot, tuple(spec))
    try:
        return drive(
            scene,
            planner,
            law=law,
            seed=seed,
            sources=cutters,
            obstacle_speed=speed,
            time_limit=90.0,
            give_up=30.0,
            **settings,
        )
    except SceneError:
        return None


@pytest.mark.commit(10)
@pytest.mark.parametrize("seed", some(range(60), 30))
def test_ours_drives_into_nobody(seed):
    run = random_run(seed)
    if run is not None:
        assert check_drive(run) is None
        assert run.outcome is not Outcome.COLLISION


@pytest.mark.commit(1)
@pytest.mark.parametrize("law", [law for law in LAWS if law not in ("physical", "blind")])
def test_every_law_drives_as_it_is_told(law):
    """The referee sees every drive; only our laws promise not to collide."""
    ends = []
    for seed in range(100, 105):
        run = random_run(seed, law)
        if run is not None:
            assert check_drive(run) is None
            assert run.law == law
            ends.append(run.outcome)
    if law not in ("dissertation", "rpp", "constant", "optimum"):
        assert Outcome.COLLISION not in ends


@pytest.mark.parametrize("obstacle_info", some(["tracks", "velocities"]))
def test_more_knowledge_is_no_danger(obstacle_info):
    for seed in range(8):
        run = random_run(seed, obstacle_info=obstacle_info)
        if run is not None:
            assert check_drive(run) is None
            assert run.outcome is not Outcome.COLLISION


def test_known_noise_is_no_danger():
    for seed in range(8):
        run = random_run(seed, noise=0.05)
        if run is not None:
            assert check_drive(run) is None
            assert run.outcome is not Outcome.COLLISION


@sized("cases", 10, 40)
def test_who_minds_nobody_collides(cases):
    """The same runs with the time optimum: the adversary is one."""
    ends = [run.outcome for seed in range(cases) if (run := random_run(seed, "optimum")) is not None]
    assert ends.count(Outcome.COLLISION) >= 0.1 * cases


def test_an_empty_room_is_driven_in_nearly_the_best_time():
    robot = Robot(radius=0.2, v_max=1.3, a_max=0.4, d_max=0.9)
    run = drive(Scene(ROOM, (0, 0), (15, 9), robot=robot), AStar())
    assert run.outcome is Outcome.ARRIVED
    assert run.optimum <= run.duration <= run.optimum + 0.5
    assert run.duration == pytest.approx(measure(run)["duration"])
    assert (run.at(np.array([run.duration]))[0] == (15.0, 9.0)).all()
    assert run.v[-1] == 0.0
    assert [m.word for m in run.moments] == ["arrive"]
    assert set(run.cause) <= {"acceleration", "limit", "braking", "goal", "curvature"}


@pytest.mark.commit(1)
@pytest.mark.parametrize("seed", range(4))
def test_the_states_are_those_recorded(seed):
    """Step by step beside the whole story: places, speeds, obstacles."""
    spec = (RandomWalk(4), Crossing(2))
    scene = Scene(ROOM, (0, 0), (15, 15), robot=Robot(radius=0.3, v_max=1.2), traffic=spec)
    one = DriveSimulation(scene, AStar(), seed=seed, on_hit="go-on", sources=[Adversary(0.8)])
    states = []
    while one.outcome is None:
        one.step()
        places = [] if one.t == 0 else one.others.truth(one.t).xy.tolist()
        states.append((one.t, one.xy, one.state.v, places))
    run = one.drive()
    t = np.array([s[0] for s in states])
    xy, v = run.at(t)
    assert np.abs(xy - np.array([s[1] for s in states])).max() < 1e-9
    assert np.abs(v - np.array([s[2] for s in states])).max() < 1e-9
    for body, track in enumerate(run.tracks):
        assert np.abs(track.at(t) - np.array([s[3][body] for s in states])).max() < 1e-9
    assert check_drive(run) is None


def same(a, b):
    for f in fields(a):
        left, right = getattr(a, f.name), getattr(b, f.name)
        if isinstance(left, np.ndarray):
            assert left.tobytes() == right.tobytes(), f.name
        elif f.name in ("cause", "outcome", "detail", "moments", "replans", "error"):
            assert left == right, f.name
    for p, q in zip(a.tracks, b.tracks, strict=True):
        assert p.t.tobytes() == q.t.tobytes()
        assert p.xy.tobytes() == q.xy.tobytes()


@pytest.mark.commit(1)
@pytest.mark.parametrize("settings", [{}, {"tracking": "velocity", "delay": 0.2}, {"noise": 0.05}])
def test_the_same_seed_gives_the_same_bytes(settings):
    for seed in range(3):
        a, b = random_run(seed, **settings), random_run(seed, **settings)
        assert (a is None) == (b is None)
        if a is not None:
            same(a, b)


def test_limits_hold_at_every_instant():
    run = next(
        r for seed in range(9, 40) if (r := random_run(seed)) is not None and r.arrived and r.duration > 5
    )
    robot = run.scene.robot
    t = np.linspace(0, run.duration, 20_001)
    xy, v = run.at(t)
    dt = t[1] - t[0]
    assert v.max() <= robot.v_max * (1 + 1e-9)
    change = np.diff(v) / dt
    assert change.max() <= robot.a_max + 1e-6
    assert change.min() >= -robot.d_max - 1e-6
    moved = np.sqrt((np.diff(xy, axis=0) ** 2).sum(axis=1)) * run.scene.grid.resolution
    assert (moved <= np.maximum(v[:-1], v[1:]) * dt + 1e-9).all()


# ---- contacts --------------------


def test_a_hit_ends_the_drive_or_is_told():
    """An obstacle that does not yield comes along a lane and runs over the robot, which cannot give way."""
    track = Recorded(tuple((x, 0) for x in range(19, -1, -1)))
    scene = Scene(LANE, (0, 0), (10, 0), robot=Robot(radius=0.3), traffic=(track,))
    run = drive(scene, AStar())
    assert run.outcome is Outcome.HIT
    assert run.v[-1] == 0.0
    assert check_drive(run) is None
    run = drive(scene, AStar(), on_hit="go-on")
    assert [m.word for m in run.moments].count("hit") == 1
    assert check_drive(run) is None
    # It stays at its last cell, on the robot's start; the robot has gone nowhere and must not move.
    assert run.outcome in (Outcome.BLOCKED, Outcome.ARRIVED)


def test_a_blind_law_collides_at_the_instant_of_contact():
    wall = Recorded(((12, 0),))
    scene = Scene(LANE, (0, 0), (19, 0), robot=Robot(radius=0.3, v_max=2.0, a_max=2.0), traffic=(wall,))
    planner = Scripted((lambda s, c: Breadth().open(s, None).plan(None),))
    run = drive(scene, planner, law="optimum")
    assert run.outcome is Outcome.COLLISION
    assert run.at(np.array([run.duration]))[0][0, 0] == pytest.approx(12 - 0.8, abs=1e-6)
    assert run.moments[-1].word == "contact"
    assert check_drive(run) is None
    ours = drive(scene, planner, time_limit=40.0)
    assert ours.outcome in (Outcome.BLOCKED, Outcome.TIMEOUT)
    assert ours.at(np.array([ours.duration]))[0][0, 0] < 12 - 0.8
    assert check_drive(ours) is None


# ---- ways --------------------


@pytest.mark.nightly
@sized("cases", 100, 200)
def test_a_way_round_obstacles_keeps_off_walls(cases):
    """What stands beside the plan's own lines must be no leave to graze walls elsewhere."""
    judged = 0
    for seed in range(cases):
        rng = np.random.default_rng(seed)
        grid = Grid(rng.random((12, 12)) < 0.15)
        scene = Scene(grid, (0, 0), (11, 11), robot=Robot(radius=float(rng.choice([0.3, 0.5, 0.7]))))
        n = int(rng.integers(1, 6))
        told = ObstacleMessage(0.0, rng.uniform(0, 11, (n, 2)), np.full(n, 0.5), np.ones(n))
        shut = closed_cells(scene, told) - {(0, 0)}
        plan = AStar().open(scene, rng).plan(Change(robot=(0, 0), obstacles=shut))
        if plan:
            curve = curve_from(plan, scene, (0.0, 0.0), told, "arcs")
            assert check_curve(curve, grid, scene.robot, plan.path.cells.astype(float)) is None
            judged += 1
    assert judged >= 0.06 * cases


# ---- endings --------------------


@pytest.mark.parametrize(
    ("rows", "outcome"),
    [
        (("#.#.", "..#."), Outcome.START_OCCUPIED),
        (("..#.", "..##"), Outcome.GOAL_OCCUPIED),
        (("..#.", "..#."), Outcome.NO_PATH),
    ],
)
def test_what_never_can_be_driven(rows, outcome):
    run = drive(Scene(grid_of(*rows), (0, 0), (3, 1)), Breadth())
    assert run.outcome is outcome
    assert run.duration == 0.0
    assert run.curves == ()
    assert run.optimum is None
    assert check_drive(run) is None


def test_start_on_the_goal():
    run = drive(Scene(ROOM, (3, 3), (3, 3), traffic=(RandomWalk(3),)), AStar())
    assert run.outcome is Outcome.ARRIVED
    assert run.duration == 0.0
    assert check_drive(run) is None


def test_a_planner_that_finds_nothing_is_asked_again():
    spec = (RandomWalk(1),)
    planner = Scripted((fail(), lambda s, c: Breadth().open(s, None).plan(None)))
    run = drive(Scene(ROOM, (0, 0), (9, 9), traffic=spec), planner, patience=1.0, time_limit=5.0)
    assert run.outcome is Outcome.NO_PATH or run.replans >= 1
    stuck = Scripted((fail(), lambda s, c: Breadth().open(s, None).plan(None), fail()))
    run = drive(Scene(ROOM, (0, 0), (9, 9), traffic=spec), stuck, patience=1.0, give_up=4.0)
    assert run.outcome is Outcome.BLOCKED
    assert 4.0 <= run.duration <= 4.3
    assert run.replans == 4
    assert "Waited" in run.sentence


def test_somebody_in_the_way_is_driven_round():
    """An obstacle comes to stand on the way; after the patience the robot plans round it."""
    ahead = Recorded(((8, 3), (8, 4), (8, 5), (8, 6), (8, 7), (8, 8)))
    scene = Scene(ROOM, (1, 8), (15, 8), robot=Robot(radius=0.3), traffic=(ahead,))
    run = drive(scene, AStar(), patience=2.0)
    assert run.outcome is Outcome.ARRIVED
    assert run.replans == 1
    assert len(run.curves) == 2
    assert {"wait", "replan", "arrive"} <= {m.word for m in run.moments}
    assert check_drive(run) is None


def test_the_time_limit():
    run = drive(Scene(ROOM, (0, 0), (15, 15)), AStar(), time_limit=3.0)
    assert run.outcome is Outcome.TIMEOUT
    assert run.duration == pytest.approx(3.0)
    assert check_drive(run) is None


def test_a_story_can_be_told_at_any_time():
    one = DriveSimulation(Scene(ROOM, (0, 0), (15, 15), traffic=(RandomWalk(3),)), AStar())
    for _ in range(20):
        one.step()
    run = one.drive()
    assert run.outcome is Outcome.TIMEOUT
    assert check_drive(run) is None


def test_appearing_obstacles_are_told_of():
    scene = Scene(ROOM, (0, 0), (15, 15), traffic=(RandomWalk(6, rate=0.4),))
    run = drive(scene, AStar(), seed=3)
    appeared = [m for m in run.moments if m.word == "appear"]
    assert [m.obstacle for m in appeared] == list(range(len(run.tracks)))
    assert check_drive(run) is None


# ---- the front door --------------------


def test_the_front_door():
    run = api.drive(Scene(ROOM, (0, 0), (15, 15)), "astar", traffic=RandomWalk(3), seed=1, patience=3.0)
    assert run.outcome is Outcome.ARRIVED
    assert len(run.tracks) == 3
    assert {"total_s", "planning_s", "referee_s"} <= set(run.timing)
    with pytest.raises(SettingError, match="SETTING"):
        api.drive(Scene(ROOM, (0, 0), (15, 15)), "astar", foo=1)
    with pytest.raises(UsageError, match="did you mean physical"):
        api.drive(Scene(ROOM, (0, 0), (15, 15)), "astar", law="phisical")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("period", 0.0),
        ("period", float("nan")),
        ("delay", -1.0),
        ("obstacle_info", "everything"),
        ("tracking", "perfekt"),
        ("on_hit", None),
        ("patience", True),
        ("time_limit", "long"),
        ("smooth", "clothoids"),
    ],
)
def test_settings_that_are_none(name, value):
    with pytest.raises(SettingError, match=f"DRIVE_SETTING.*{name}"):
        drive(Scene(ROOM, (0, 0), (1, 0)), AStar(), **{name: value})


def test_a_setting_that_a_drive_does_not_have():
    with pytest.raises(SettingError, match="did you mean patience"):
        drive(Scene(ROOM, (0, 0), (1, 0)), AStar(), pacience=1.0)
    with pytest.raises(SettingError, match="SEED"):
        drive(Scene(ROOM, (0, 0), (1, 0)), AStar(), seed=-1)


@pytest.mark.parametrize("late", [False, True])
def test_how_far_obstacles_may_come_between_two_decisions(late):
    """Each cell is a step that is decided: a robot of 65,536 m/s cost 20 s of CPU (a fuzzed scenario)."""
    period = {"tracking": "velocity", "command_period": 0.25} if late else {"period": 0.25}
    robot, traffic = Robot(v_max=1.0, radius=0.2), (Crossing(1),)
    scene = Scene(ROOM, (0, 0), (3, 2), robot=robot, traffic=traffic)
    most = MAX_PASSED * ROOM.resolution / 0.25
    run = drive(scene, AStar(), obstacle_speed=most, time_limit=1.0, **period)
    assert len(run.tracks[0].t) > MAX_PASSED
    told = r"obstacle_speed: at 401.0 m/s obstacles pass more than 100 cells.*most 400.0 m/s"
    with pytest.raises(SettingError, match=told) as refused:
        drive(scene, AStar(), obstacle_speed=most + 1.0, **period)
    assert str(refused.value).endswith("a shorter command_period" if late else "a shorter period")
    quick = replace(scene, robot=replace(robot, v_max=float(np.nextafter(most, np.inf))))
    with pytest.raises(SettingError, match=r"OBSTACLE_SPEED.*v_max: at 400.00000000000006 m/s"):
        drive(quick, AStar(), **period)
    nobody = replace(scene, traffic=(), robot=replace(robot, v_max=1e6))
    assert drive(nobody, AStar(), **period).outcome is Outcome.ARRIVED


def test_a_robot_among_the_quickest_obstacles_asks_again():
    """What they may reach is looked for within the map: a hundred million cells around one took 258 s."""
    scene = Scene(ROOM, (0, 0), (3, 2), robot=Robot(v_max=1.0, radius=0.2), traffic=(RandomWalk(1),))
    quickest = MAX_PASSED * ROOM.resolution / 0.1
    run = drive(scene, AStar(), obstacle_speed=quickest, on_hit="go-on", time_limit=12.0)
    assert run.replans >= 1
    told = ObstacleMessage(0.0, np.array([[1.0, 1.0]]), np.zeros(1), np.array([1e9]))
    shut = closed_cells(scene, told, comfort(scene, told, (0.0, 0.0), 0.1))
    assert shut == {(x, y) for x in range(ROOM.width) for y in range(ROOM.height)}


@pytest.mark.nightly
@pytest.mark.parametrize("block", range(20))
def test_ours_drives_into_nobody_a_thousand_times(block):
    for seed in range(1000 + 50 * block, 1050 + 50 * block):
        run = random_run(seed)
        if run is not None:
            assert check_drive(run) is None
            assert run.outcome is not Outcome.COLLISION


@pytest.mark.parametrize("run", [api.drive, api.simulate])
def test_a_robot_on_its_goal_has_arrived_whatever_the_planner_says(run):
    """A planner stopped by its time limit made the referee refuse the run (found by random option draws)."""
    ended = run(Scene(ROOM, (5, 5), (5, 5)), AStar(), budget=Budget(seconds=1e-9))  # refereed
    assert ended.outcome is Outcome.ARRIVED
