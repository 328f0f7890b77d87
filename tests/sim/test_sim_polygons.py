"""Moving obstacles that are polygons: what they are, how they turn, and drives among them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import FileError, LimitError, SceneError, SettingError
from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.trace import Outcome
from lampyris.model.traffic import ObstacleSpec, bound_radius
from lampyris.planning.graph.astar import AStar
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.referee import check_drive
from lampyris.referee.drive import measure
from lampyris.report.data.serialize import drive_record
from lampyris.report.film.drive_film import DriveRenderer
from lampyris.sim.continuous.drive import drive
from lampyris.sim.traffic.adversary import Adversary
from sizes import sized, some

LONG = ((0.55, 0.15), (-0.35, 0.15), (-0.35, -0.15), (0.55, -0.15))
KINDS: dict[str, ObstacleSpec] = {
    "walk": lampyris.RandomWalk(2, footprint=LONG),
    "patrol": lampyris.Patrol([(3, 3), (9, 3)], footprint=LONG),
    "crossing": lampyris.Crossing(2, footprint=LONG),
    "recorded": lampyris.Recorded([(5, 5), (6, 5)], footprint=LONG, yaw=[0.0, 1.5]),
}


# ---- what it is --------------------


@pytest.mark.parametrize("kind", KINDS)
def test_shape(kind: str) -> None:
    one = KINDS[kind]
    assert one.footprint == LONG
    assert one.radius == bound_radius(LONG) > math.hypot(0.55, 0.15)
    again = type(one).from_dict(json.loads(json.dumps(one.to_dict())))
    assert again == one
    assert hash(again) == hash(one)
    assert replace(one, footprint=LONG[::-1]) == replace(one, footprint=(LONG[3], *LONG[:3])) != one
    disc = replace(one, footprint=None, radius=one.radius, **({"yaw": ()} if kind == "recorded" else {}))
    assert disc != one
    assert disc.footprint is None


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"footprint": [(1, 1), (2, 1), (2, 2)]}, "TRAFFIC_FOOTPRINT"),
        ({"footprint": [(1, 1), (-1, -1), (1, -1), (-1, 1)]}, "TRAFFIC_FOOTPRINT"),
        ({"footprint": [(1, 0), (0, 1)]}, "TRAFFIC_FOOTPRINT"),
        ({"footprint": "box"}, "TRAFFIC_FOOTPRINT"),
        ({"footprint": [(math.nan, 0), (0, 1), (-1, -1)]}, "TRAFFIC_FOOTPRINT"),
        ({"yaw": [0.0]}, "OBSTACLE_YAW"),
        ({"footprint": LONG, "yaw": [0.0, 1.0]}, "OBSTACLE_YAW"),
        ({"footprint": LONG, "yaw": [math.inf]}, "OBSTACLE_YAW"),
        ({"footprint": LONG, "yaw": "north"}, "OBSTACLE_YAW"),
    ],
)
def test_bad_shapes_are_refused(fields: dict[str, Any], code: str) -> None:
    with pytest.raises(SettingError) as refused:
        lampyris.Recorded([(1, 1)], **fields)
    assert refused.value.code == code


def test_tracks_of_polygons_have_headings() -> None:
    track = Track([0.0, 2.0], [(0, 0), (1, 0)], 1.0, 1.0, LONG, [0.0, 1.0])
    assert track.heading(np.array([-1.0, 0.5, 9.0])).tolist() == [0.0, 0.25, 1.0]
    assert Track.from_dict(track.to_dict()) == track != replace(track, yaw=[0.0, 1.1])
    for outline, yaw in ((LONG, None), (None, [0.0, 1.0]), (LONG, [0.0]), (LONG, [0.0, math.nan])):
        with pytest.raises(SettingError, match="TRACK"):
            replace(track, outline=outline, yaw=yaw)


# ---- how it turns --------------------


def _hall(*traffic: ObstacleSpec, yaw: float = 0.0, **robot: Any) -> lampyris.Scene:
    grid = lampyris.Grid(np.zeros((24, 30), dtype=bool), resolution=0.25, origin=(0.0, 0.0, yaw))
    return lampyris.Scene(
        grid, (2, 12), (27, 12), robot=lampyris.Robot(**({"radius": 0.2} | robot)), traffic=traffic
    )


def test_heading_follows_the_direction_of_motion() -> None:
    track = [(10, 2), (11, 2), (11, 2), (12, 1), (12, 2), (12, 2)]
    scene = _hall(lampyris.Recorded(track, footprint=LONG))
    made = lampyris.drive(scene, "astar", obstacle_speed=0.5)
    one = made.tracks[0]
    tick = 0.25 / 0.5
    east, north_east, south = 0.0, math.pi / 4, -math.pi / 2
    # It has the direction of a step at its end, turns evenly during it, and keeps it while it stands.
    assert one.heading(tick * np.arange(6)) == pytest.approx(
        [east, east, east, north_east, south, south], abs=1e-12
    )
    assert one.heading(np.array([3.5 * tick]))[0] == pytest.approx((north_east + south) / 2)
    assert one.outline == made.obstacle_specs[0].outline == LONG
    assert check_drive(made) is None


def test_a_track_may_give_its_heading() -> None:
    yaw = [3.0, -3.0, -3.0]
    scene = _hall(lampyris.Recorded([(10, 2), (11, 2), (12, 2)], footprint=LONG, yaw=yaw), yaw=0.5)
    one = lampyris.drive(scene, "astar", obstacle_speed=0.5).tracks[0]
    got = one.heading(0.5 * np.arange(3))
    # In the map frame, and the shorter way round.
    assert np.cos(got - np.array(yaw) + 0.5) == pytest.approx([1.0, 1.0, 1.0])
    assert abs(got[1] - got[0]) == pytest.approx(2 * math.pi - 6.0)


@pytest.mark.nightly
def test_obstacles_that_walk_and_halt_turn_to_where_they_go() -> None:
    scene = _hall(
        lampyris.RandomWalk(10, footprint=LONG), lampyris.Patrol([(8, 12), (22, 12)], footprint=LONG)
    )
    for seed in range(2):
        made = lampyris.drive(scene, "astar", seed=seed, time_limit=25.0)
        halts = 0
        for one, spec in zip(made.tracks, made.obstacle_specs, strict=True):
            assert spec.outline == LONG
            step, yaw = np.diff(one.xy, axis=0), np.array(one.yaw)
            whole = np.abs(np.diff(one.t) - 0.25) < 1e-9
            moves = (step != 0.0).any(axis=1)
            ends = whole & moves & np.isclose(np.abs(step).max(axis=1), 1.0)
            along = np.arctan2(-step[ends, 1], step[ends, 0])
            assert np.cos(yaw[1:][ends] - along) == pytest.approx(np.ones(ends.sum()))
            assert (np.diff(yaw)[~moves] == 0.0).all()
            halts += int((moves & ~ends)[:-1].sum())
        assert check_drive(made) is None
    assert halts > 0


# ---- drives --------------------


def _room(rng: np.random.Generator, shape: dict[str, Any], kind: str) -> tuple[lampyris.Scene, str]:
    blocked = np.zeros((24, 30), dtype=bool)
    for y, x in rng.integers((0, 6), (24, 24), (3, 2)).tolist():
        blocked[max(y - 1, 0) : y + 1, x : x + 2] = True
    blocked[10:15] = False
    grid = lampyris.Grid(blocked, resolution=0.25)
    traffic = (lampyris.RandomWalk(5, **shape), lampyris.Crossing(1, **shape))
    ends: dict[str, Any] = {"start_pose": (0.6, 3.0, 0.0), "goal_pose": (6.8, 3.0, 0.0)}
    if kind == "disc":
        return lampyris.Scene(grid, **ends, robot=lampyris.Robot(radius=0.25), traffic=traffic), "astar"
    robot = lampyris.Robot(footprint=[(0.4, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.4, -0.2)])
    return lampyris.Scene(grid, **ends, robot=robot, traffic=traffic), "lattice"


def _drive(seed: int, shape: dict[str, Any], kind: str, **more: Any) -> Drive:
    scene, planner = _room(np.random.default_rng(seed), shape, kind)
    made = lampyris.drive(scene, planner, **{"seed": seed, "time_limit": 25.0, "obstacle_speed": 0.6, **more})
    assert check_drive(made) is None
    return made


@pytest.mark.commit(1)
@sized("cases", 2, 400)
@pytest.mark.parametrize("kind", ["disc", "footprint"])
def test_no_contact_while_it_moves(kind: str, cases: int) -> None:
    """By the law that promises it; and no fewer arrive than among the discs around the polygons."""
    arrived = {"polygon": 0, "disc": 0}
    made_any = 0
    for seed in range(cases):
        done: dict[str, Drive] = {}
        for name, shape in (("polygon", {"footprint": LONG}), ("disc", {"radius": bound_radius(LONG)})):
            try:
                made = done[name] = _drive(seed, shape, kind, on_hit="end")
            except SceneError:  # no room for the obstacles
                continue
            seen = measure(made)
            assert seen["collisions"] == 0
            assert made.outcome is not Outcome.COLLISION
            assert seen["gap"] >= 0.0
            arrived[name] += made.arrived
        assert len(done) != 1
        if done:
            made_any += 1
            # The law looks at the discs around them: it decides the same, as long as nothing is hit.
            if done["disc"].outcome is not Outcome.HIT:
                assert np.array_equal(done["polygon"].t, done["disc"].t)
                assert np.array_equal(done["polygon"].v, done["disc"].v)
    assert made_any >= cases // 2
    assert arrived["polygon"] >= arrived["disc"] > 0


@pytest.mark.nightly
@pytest.mark.commit(1)
@sized("cases", 2, 200)
@pytest.mark.parametrize("kind", ["disc", "footprint"])
def test_beside_discs_that_run_at_the_robot(kind: str, cases: int) -> None:
    met = 0
    for seed in range(cases):
        scene, planner = _room(np.random.default_rng(seed), {"footprint": LONG}, kind)
        chosen = AStar() if planner == "astar" else LatticePlanner()
        sources = [Adversary(1.0, count=2, wait=1.0)]
        made = drive(
            scene, chosen, seed=seed, sources=sources, time_limit=15.0, on_hit="go-on", obstacle_speed=0.6
        )
        assert check_drive(made) is None
        assert measure(made)["collisions"] == 0
        kinds = {
            spec.kind: (track.yaw is None)
            for spec, track in zip(made.obstacle_specs, made.tracks, strict=True)
        }
        assert kinds == {"random-walk": False, "crossing": False, "cutter": True}
        met += measure(made)["hits"]
    assert met > 0


@pytest.mark.nightly
@sized("cases", 8, 300)
def test_a_law_that_looks_at_nothing_hits_fewer_polygons_than_discs(cases: int) -> None:
    hit = {"polygon": 0, "disc": 0}
    for seed in range(cases):
        for name, shape in (("polygon", {"footprint": LONG}), ("disc", {"radius": bound_radius(LONG)})):
            hit[name] += _drive(seed, shape, "disc", law="optimum").outcome is Outcome.COLLISION
    assert 0 < hit["polygon"] < hit["disc"]


@sized("cases", 1, 20)
@pytest.mark.parametrize("controller", some(["dwa", "rpp"]))
def test_controllers_that_steer_keep_off_polygons(controller: str, cases: int) -> None:
    small = {"yaw_rates": 11, "directions": 5} if controller == "dwa" else {}
    for seed in range(cases):
        made = _drive(
            seed,
            {"footprint": LONG},
            "footprint",
            controller=controller,
            controller_settings=small,
            time_limit=8.0,
        )
        assert measure(made)["collisions"] == 0


@pytest.mark.parametrize("kind", ["disc", "footprint"])
def test_a_recorded_polygon_that_runs_into_the_standing_robot(kind: str) -> None:
    """It is told when its front reaches the robot, which is later than the disc around it does."""
    robot: dict[str, Any] = (
        {"radius": 0.2}
        if kind == "disc"
        else {"footprint": [(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)]}
    )
    planner = "astar" if kind == "disc" else "lattice"
    wide = ((0.1, 0.5), (-0.1, 0.5), (-0.1, -0.5), (0.1, -0.5))
    told = {}
    for name, shape in (("polygon", {"footprint": wide}), ("disc", {"radius": bound_radius(wide)})):
        scene = replace(
            _hall(lampyris.Recorded([(x, 12) for x in range(20, 1, -1)], **shape), **robot), start=(2, 12)
        )
        # It comes head-on, and the robot can only stand.
        made = lampyris.drive(scene, planner, obstacle_speed=1.0, on_hit="go-on", time_limit=8.0)
        assert check_drive(made) is None
        assert measure(made)["collisions"] == 0
        told[name] = next(m.t for m in made.moments if m.word == "hit")
        assert measure(made)["hits"] == 1
    # The discs are 0.51 m and 0.2 m wide, or 0.28 m of a corner; the polygon's front is 0.1 m ahead of its centre.
    assert 0.3 < told["polygon"] - told["disc"] < 0.6


# ---- what is written of it --------------------


def test_records_and_films_have_the_outline() -> None:
    made = _drive(0, {"footprint": LONG}, "disc")
    one = drive_record(made)["obstacle_specs"][0]
    assert one["outline"] == [list(vertex) for vertex in LONG]
    assert one["yaw"] == made.tracks[0].yaw.tolist()
    assert len(one["yaw"]) == len(one["t"])
    disc = replace(made, tracks=tuple(replace(t, outline=None, yaw=None) for t in made.tracks))
    pictures = [DriveRenderer(d, None, 1, 16.0).frame(0.5) for d in (made, disc)]
    assert (pictures[0] != pictures[1]).any()
    assert "outline" not in drive_record(_drive(0, {"radius": 0.2}, "disc"))["obstacle_specs"][0]


def test_simulations_take_the_disc_around_it() -> None:
    scene = _hall(lampyris.RandomWalk(4, footprint=LONG), lampyris.Patrol([(8, 4), (8, 20)], footprint=LONG))
    disc = _hall(
        lampyris.RandomWalk(4, radius=bound_radius(LONG)),
        lampyris.Patrol([(8, 4), (8, 20)], radius=bound_radius(LONG)),
    )
    one, other = lampyris.simulate(scene, "astar", seed=3), lampyris.simulate(disc, "astar", seed=3)
    assert np.array_equal(one.robot, other.robot)
    assert all(np.array_equal(a, b) for a, b in zip(one.tracks, other.tracks, strict=True))
    assert one.obstacle_specs[0].outline == LONG
    assert one.obstacle_specs[0].footprint == other.obstacle_specs[0].footprint
    assert len(one.obstacle_specs[0].footprint) > 20


def test_planned_times_keep_off_the_disc_around_it() -> None:
    track = [(14, y) for y in range(4, 22)]
    robot = {"footprint": ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))}
    plans = [
        lampyris.plan(_hall(one, **robot), "lattice-sipp")
        for one in (
            lampyris.Recorded(track, footprint=LONG),
            lampyris.Recorded(track, radius=bound_radius(LONG)),
        )
    ]
    assert plans[0].pose_path is not None
    assert plans[1].pose_path is not None
    assert np.array_equal(plans[0].pose_path.times, plans[1].pose_path.times)


# ---- scenario files --------------------

SCENARIO = """
version: 1
map: {rows: ["..........", "..........", "..........", "..........", ".........."], resolution: 0.5}
start: [0, 4]
goal: [9, 4]
robot: {radius: 0.2}
planner: astar
obstacles:
  - {kind: random-walk, count: 1, rectangle: [0.6, 0.3], starts: [[5, 0]]}
  - {kind: recorded, track: [[0, 0], [1, 0]], footprint: [[0.3, 0.1], [-0.3, 0.1], [-0.3, -0.1], [0.3, -0.1]], yaw: [0, 1]}
  - {kind: recorded, file: track.csv, rectangle: [0.4, 0.2]}
edits:
  - {tick: 0, polygons: [[[1.6, 1.1], [2.4, 1.1], [2.4, 1.4], [1.6, 1.4]]], blocked: [[8, 0]]}
drive: {obstacle_speed: 0.5}
"""


def test_scenario_files(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(SCENARIO)
    (tmp_path / "track.csv").write_text("tick,x,y,yaw\n0,8,2,0.5\n3,8,1,-0.25\n")
    scenario = lampyris.load_scenario(tmp_path / "a.yaml")
    walk, given, read = scenario.scene.traffic
    assert walk.footprint == ((-0.3, -0.15), (0.3, -0.15), (0.3, 0.15), (-0.3, 0.15))
    assert given.yaw == (0.0, 1.0)
    assert read.track == ((8, 2), (8, 2), (8, 2), (8, 1))
    assert read.yaw == (0.5, 0.5, 0.5, -0.25)
    # Two cells of half a metre are covered by the polygon, whatever share of them.
    assert set(zip(*np.nonzero(scenario.scene.grid.blocked.T), strict=True)) == {
        (8, 0),
        (3, 2),
        (4, 2),
    }
    for name in ("b.yaml", "b.json"):
        lampyris.save_scenario(scenario, tmp_path / name)
        again = lampyris.load_scenario(tmp_path / name)
        assert again.scene.traffic == scenario.scene.traffic
        assert again.edits == scenario.edits
        assert np.array_equal(again.scene.grid.blocked, scenario.scene.grid.blocked)
    made = lampyris.run(scenario)
    assert isinstance(made, Drive)
    assert [one.outline is not None for one in made.obstacle_specs] == [True] * 3


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("rectangle: [0.6, 0.3]", "rectangle: [0.6, 0.3], radius: 0.2", "TRAFFIC_FOOTPRINT"),
        ("rectangle: [0.6, 0.3]", "rectangle: [0.6]", "TRAFFIC_FOOTPRINT"),
        ("rectangle: [0.6, 0.3]", "rectangle: [0.6, -1]", "TRAFFIC_FOOTPRINT"),
        ("[[0.3, 0.1], [-0.3, 0.1]", "[[0.3, 0.1], [0.3, 0.1]", "TRAFFIC_FOOTPRINT"),
        ("yaw: [0, 1]", "yaw: [0]", "OBSTACLE_YAW"),
        ("yaw: [0, 1]", "yaw: north", "TYPE"),
        ("[1.6, 1.1], [2.4, 1.1], [2.4, 1.4]", "[1.6, 1.1], [2.4, 1.4], [2.4, 1.1]", "POLYGON"),
        ("[[1.6, 1.1], [2.4, 1.1], [2.4, 1.4], [1.6, 1.4]]", "[[1.6, 1.1], [2.4, 1.1]]", "POLYGON"),
        ("0.5\n", "left\n", "TRACK"),
    ],
)
def test_bad_scenario_files_are_refused(tmp_path: Path, old: str, new: str, code: str) -> None:
    track = "tick,x,y,yaw\n0,8,2,0.5\n3,8,1,-0.25\n"
    assert old in SCENARIO + track
    (tmp_path / "a.yaml").write_text(SCENARIO.replace(old, new))
    (tmp_path / "track.csv").write_text(track.replace(old, new) if code == "TRACK" else track)
    with pytest.raises((FileError, SettingError)) as refused:
        lampyris.load_scenario(tmp_path / "a.yaml")
    assert refused.value.code == code
    assert ("track.csv:2" if code == "TRACK" else "a.yaml:") in refused.value.where


def test_polygons_may_not_cover_more_cells_than_memory_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    two = "[[1.6, 1.1], [2.4, 1.1], [2.4, 1.4], [1.6, 1.4]]"
    (tmp_path / "a.yaml").write_text(SCENARIO.replace(two, f"{two}, {two}"))
    (tmp_path / "track.csv").write_text("x,y\n8,2\n")
    for most in (3, 4, 5):
        monkeypatch.setattr("lampyris.io.scenario.build.MAX_COVERED", most)
        if most < 4:
            with pytest.raises(LimitError, match="covered cells"):
                lampyris.load_scenario(tmp_path / "a.yaml")
        else:
            lampyris.load_scenario(tmp_path / "a.yaml")
