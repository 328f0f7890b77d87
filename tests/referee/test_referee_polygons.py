"""Polygon obstacles: the referee and the drive's own contacts against shapely, and drives with one thing wrong."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import shapely

import lampyris
from lampyris.errors import SettingError
from lampyris.model.drive import Drive
from lampyris.model.obstacles import Track
from lampyris.model.robot import DRIVES, Polygon, footprint_of
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle, bound_radius
from lampyris.referee import check_drive
from lampyris.referee.drive import _motion, measure
from lampyris.referee.geometry.moving_discs import first_contact, pairs_of
from lampyris.referee.geometry.moving_polygons import (
    first_polygon_contact,
    nearest_polygon,
    outline_distances,
    polygon_gap_at,
    polygon_pairs,
    standing_polygon_contacts,
)
from lampyris.report.data.gaps import gaps_between
from lampyris.sim.traffic.motion_sources import Roster
from lampyris.sim.traffic.obstacle_set import ObstacleSet
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.sim.world.trajectory import CurveLookup
from sizes import sized, some

BOX = ((0.5, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.5, -0.2))
RES = 0.1


@cache
def driven(kind: str) -> Drive:
    """A drive through an empty room: a robot with a heading of one kind of drive, or a disc."""
    grid = lampyris.Grid(np.zeros((50, 50), dtype=bool), resolution=RES)
    ends = {"start_pose": (1.0, 1.0, 0.0), "goal_pose": (3.5, 3.0, 2.5)}
    if kind == "disc":
        scene = lampyris.Scene(grid, **ends, robot=lampyris.Robot(radius=0.3))
        return lampyris.drive(scene, "astar")
    radius = 0.5 if kind == "ackermann" else 0.0
    robot = lampyris.Robot(footprint=BOX, drive=kind, turn_radius=radius)
    made = lampyris.drive(lampyris.Scene(grid, **ends, robot=robot), "lattice", shortcut=True)
    assert made.arrived
    return made


def some_polygon(rng: np.random.Generator) -> Polygon:
    """A random outline around the origin, star-shaped, seldom convex."""
    while True:
        n = int(rng.integers(3, 9))
        angle = np.sort(rng.uniform(0.0, 2 * math.pi, n))
        far = rng.uniform(0.05, 0.6, n)
        try:
            return footprint_of(np.column_stack((far * np.cos(angle), far * np.sin(angle))))
        except SettingError:
            continue


def some_track(rng: np.random.Generator, made: Drive, polygon: Polygon) -> Track:
    """A polygon that moves and turns near the robot, for a few seconds somewhere in a drive."""
    t = float(rng.uniform(0.0, 0.9 * made.duration)) + np.cumsum(rng.uniform(0.05, 0.6, 6))
    near = made.at(t)[0] + rng.normal(0.0, 0.9 / RES, 2) + rng.normal(0.0, 0.15 / RES, (6, 2))
    yaw = rng.uniform(-4.0, 4.0) + np.cumsum(rng.normal(0.0, 0.7, 6) * (rng.random(6) < 0.7))
    if rng.random() < 0.2:
        near[3] = near[2]
    return Track(t, near, bound_radius(polygon), 100.0, polygon, yaw)


def laid(outline: Any, xy: Any, yaw: Any) -> Any:
    """Shapes of an outline at poses; xy in metres, y down."""
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    ahead, left = np.array(outline).T
    x = xy[:, :1] + cos * ahead - sin * left
    y = xy[:, 1:] - sin * ahead - cos * left
    return shapely.polygons(np.stack((x, y), axis=2))


def shapes_at(made: Drive, track: Track, t: Any) -> tuple[Any, Any, float]:
    """Robot and obstacle at some times, and the robot's radius if it is a disc."""
    theirs = laid(track.outline, track.at(t) * RES, track.heading(t))
    xy = made.at(t)[0] * RES
    if made.scene.robot.footprint is None:
        return shapely.points(xy), theirs, made.scene.robot.radius
    return laid(BOX, xy, made.poses(t)[:, 2]), theirs, 0.0


def contact_of_drive(made: Drive, track: Track) -> float:
    """The first contact by the kernel that drives use, seconds; infinity: none."""
    lookup = PoseLookup if made.scene.robot.footprint is not None else CurveLookup
    route = lookup(made.curves[0])  # type: ignore[arg-type]
    obstacles = ObstacleSet.__new__(ObstacleSet)
    obstacles.scene, obstacles.roster = made.scene, Roster()
    assert track.outline is not None
    assert track.yaw is not None
    obstacles.roster.add(
        Obstacle("recorded", track.radius, False, outline=track.outline), 1.0, 1.0, 0.0, 0.0, 0.0
    )
    obstacles.radius = np.array([track.radius])
    t = np.append(track.t, made.duration + 1.0)
    state = np.column_stack((track.xy, track.yaw))
    state = np.vstack((state, state[-1:]))
    rate = np.diff(state, axis=0) / np.diff(t)[:, None]
    legs = np.column_stack(
        (0.0 * t[1:], t[:-1], t[1:], state[:-1, :2], rate[:, :2], state[:-1, 2], rate[:, 2])
    )
    none = np.zeros(len(legs), dtype=np.int64)
    best = math.inf
    for k in np.flatnonzero(np.diff(made.t) > 0.0).tolist():
        row = np.array([[made.t[k], made.s[k], made.v[k], made.a[k], made.t[k + 1]]])
        found = obstacles._outline_contact(route, row, legs, none, none)
        if found is not None:
            best = min(best, found[0])
    return best


@pytest.mark.commit(2)
@sized("cases", 3, 2000)
@pytest.mark.parametrize("kind", [*DRIVES, "disc"])
def test_contacts_are_those_that_shapely_sees(kind: str, cases: int) -> None:
    made, rng = driven(kind), np.random.default_rng(31)
    assert len(made.curves) == 1
    motion = _motion(made)
    radius = made.scene.robot.radius if kind == "disc" else 0.0
    met = clear = 0
    for _ in range(cases):
        polygon = some_polygon(rng)
        track = some_track(rng, made, polygon)
        if track.t[0] >= made.duration:
            continue
        pairs = polygon_pairs(motion, [track], RES)
        found = first_polygon_contact(motion, pairs, radius)
        t = np.unique(np.concatenate((np.linspace(track.t[0], made.duration, 400), track.t)))
        t = t[t <= made.duration]
        robot, obstacle, own = shapes_at(made, track, t)
        gap = np.maximum(shapely.distance(robot, obstacle) - own, 0.0)
        moves = made.at(t)[1] > 1e-9
        # What the referee, the reports and shapely measure is the same.
        mine = np.array([polygon_gap_at(motion, track, radius, RES, float(one)) for one in t[::40]])
        assert np.abs(mine - gap[::40]).max() < 1e-9
        assert np.abs(gaps_between(made, track, t) - gap).max() < 1e-9
        # No contact is missed, and none is made up.
        hit = (gap == 0.0) & moves
        if hit.any():
            assert found is not None
            assert found[0] <= t[int(hit.argmax())] + 1e-9
        if found is not None:
            r, o, own = shapes_at(made, track, np.array([found[0]]))
            assert float(shapely.distance(r, o)[0]) - own < 2e-8
            met += 1
        else:
            clear += 1
        near, when, _ = nearest_polygon(motion, pairs, radius)
        assert near <= gap[moves].min(initial=math.inf) + 1e-4
        if math.isfinite(near):
            r, o, own = shapes_at(made, track, np.array([when]))
            assert abs(max(float(shapely.distance(r, o)[0]) - own, 0.0) - near) < 1e-8
        # The drive itself reports a contact no later than the referee, and only within a micrometre.
        own_contact = contact_of_drive(made, track)
        if found is not None:
            assert own_contact <= found[0] + 1e-9
        if math.isfinite(own_contact):
            r, o, own = shapes_at(made, track, np.array([own_contact]))
            assert float(shapely.distance(r, o)[0]) - own < 1e-6
    assert min(met, clear) >= cases // 8


@sized("cases", 10, 3000)
def test_contacts_with_a_standing_robot_are_those_that_shapely_sees(cases: int) -> None:
    made, rng = driven("differential"), np.random.default_rng(5)
    x, y = made.at(np.array([0.0]))[0][0]
    still = replace(
        made,
        t=[0.0, 9.0],
        s=[0, 0],
        v=[0, 0],
        a=[0, 0],
        leg=[0, 0],
        cause=("wait",) * 2,
        cause_index=[-1] * 2,
    )
    motion, apart, met = _motion(still), 0.1, 0
    for _ in range(cases):
        polygon = some_polygon(rng)
        t = np.append(0.0, np.cumsum(rng.uniform(0.2, 2.0, 5)))
        at, yaw = rng.normal((x, y), 1.0 / RES, (6, 2)), np.cumsum(rng.normal(0.0, 1.0, 6))
        track = Track(t, at, bound_radius(polygon), 100.0, polygon, yaw)
        found = standing_polygon_contacts(motion, polygon_pairs(motion, [track], RES), 0.0, apart)
        times = np.linspace(0.0, 9.0, 700)
        robot, obstacle, _ = shapes_at(still, track, times)
        on = shapely.distance(robot, obstacle) == 0.0
        inside = np.zeros(len(times), dtype=bool)
        for one in found:
            inside |= (times >= one.begin - 1e-9) & (times <= one.end + 1e-9)
            met += 1
        assert not (on & ~inside).any()
        for before, after in itertools.pairwise(found):
            assert after.begin > before.end + apart
        edge = np.array([t for one in found for t in (one.begin, one.end)])
        if len(edge):
            robot, obstacle, _ = shapes_at(still, track, edge)
            # Its ends are late or early by a sixteenth of `apart` at most, in which nothing moves farther than this.
            quick = np.hypot(*(np.diff(at, axis=0) * RES / np.diff(t)[:, None]).T).max()
            quick += np.abs(np.diff(yaw) / np.diff(t)).max() * bound_radius(polygon)
            assert shapely.distance(robot, obstacle).max() < quick * apart / 16
    assert met >= cases // 4


@sized("cases", 2000, 200_000)
def test_distances_are_those_of_shapely(cases: int) -> None:
    rng = np.random.default_rng(8)
    one = rng.uniform(-1.0, 1.0, (cases, 3, 2))
    other = one[:, [0, 2, 1]] * rng.uniform(0.1, 1.5, (cases, 1, 1)) + rng.normal(0.0, 1.0, (cases, 1, 2))
    other[: cases // 10] = one[: cases // 10] + np.array((0.0, 2.0))
    want = shapely.distance(shapely.polygons(one), shapely.polygons(other))
    assert np.abs(outline_distances(one, other) - want).max() < 1e-12
    assert 0.1 < (want == 0.0).mean() < 0.9


# ---- drives with one thing wrong --------------------


@cache
def among(kind: str) -> Drive:
    """A drive among polygons that is in order."""
    grid = lampyris.Grid(np.zeros((30, 40), dtype=bool), resolution=0.25)
    box = [(0.6, 0.2), (-0.4, 0.2), (-0.4, -0.2), (0.6, -0.2)]
    robot = lampyris.Robot(footprint=BOX) if kind == "footprint" else lampyris.Robot(radius=0.3)
    passing = lampyris.Recorded([(20, y) for y in range(3, 25)], footprint=box)
    traffic = (
        lampyris.RandomWalk(4, footprint=box),
        lampyris.Patrol([(36, 3), (28, 3)], footprint=box),
        passing,
    )
    scene = lampyris.Scene(
        grid, start_pose=(1.0, 3.0, 0.0), goal_pose=(8.5, 4.0, 0.0), robot=robot, traffic=traffic
    )
    made = lampyris.drive(scene, "lattice" if kind == "footprint" else "astar", seed=2, obstacle_speed=0.7)
    assert made.arrived, made.detail
    return made


def track(made: Drive, k: int, **fields: Any) -> Drive:
    tracks = list(made.tracks)
    tracks[k] = replace(tracks[k], **fields)
    return replace(made, tracks=tuple(tracks))


def passing(made: Drive) -> int:
    return [one.kind for one in made.obstacle_specs].index("recorded")


def onto_the_robot(made: Drive) -> Drive:
    """The recorded obstacle is where the robot is in the middle of its drive, for a moment."""
    k, t = passing(made), 0.5 * made.duration
    at = made.at(np.array([t]))[0]
    one = made.tracks[k]
    xy = one.xy + (at - one.at(np.array([t])))
    return track(made, k, xy=xy, top_speed=100.0)


def with_spec(made: Drive, k: int, spec: Any, **fields: Any) -> Drive:
    """The scene has a recorded obstacle in place of its own, and track ``k`` is of it."""
    specs = list(made.obstacle_specs)
    specs[k] = replace(specs[k], outline=spec.footprint, radius=spec.radius)
    traffic = tuple(spec if isinstance(one, lampyris.Recorded) else one for one in made.scene.traffic)
    made = replace(made, obstacle_specs=tuple(specs), scene=replace(made.scene, traffic=traffic))
    return track(made, k, outline=spec.footprint, radius=spec.radius, **fields)


def turned_onto_the_robot(made: Drive) -> Drive:
    """An obstacle stands so near that its front, and nothing else, sweeps over the robot when it turns once."""
    k, tick = passing(made), 0.25 / 0.7
    n = round(0.5 * made.duration / tick)
    xy, _ = made.at(np.array([n * tick]))
    outline = ((0.6, 0.02), (-0.02, 0.02), (-0.02, -0.02), (0.6, -0.02))
    quarters = [-math.pi, -0.5 * math.pi, 0.0, 0.5 * math.pi, math.pi]
    yaw = [-math.pi] * (n - 3) + quarters
    spec = lampyris.Recorded([(20, 20)] * len(yaw), footprint=outline, yaw=yaw)
    times = [*(np.arange(len(yaw)) * tick).tolist(), made.duration]
    at = np.repeat(xy + np.array((0.0, 0.62 / 0.25)), len(times), axis=0)
    return with_spec(made, k, spec, t=times, xy=at, yaw=[*yaw, math.pi])


def small_square(made: Drive) -> Drive:
    """Track and obstacle are 2 cm wide; the scene's are not."""
    tiny = ((0.01, 0.01), (-0.01, 0.01), (-0.01, -0.01), (0.01, -0.01))
    specs = list(made.obstacle_specs)
    specs[0] = replace(specs[0], outline=tiny)
    return track(replace(made, obstacle_specs=tuple(specs)), 0, outline=tiny)


def disc_for_polygon(made: Drive) -> Drive:
    specs = list(made.obstacle_specs)
    specs[0] = replace(specs[0], outline=None)
    return track(replace(made, obstacle_specs=tuple(specs)), 0, outline=None, yaw=None)


def patrol_that_never_turns(made: Drive) -> Drive:
    k = [one.kind for one in made.obstacle_specs].index("patrol")
    assert np.ptp(made.tracks[k].yaw) > 3.0
    return track(made, k, yaw=np.zeros(len(made.tracks[k].t)))


def recorded_off_its_motion(made: Drive) -> Drive:
    k = passing(made)
    return track(made, k, yaw=np.array(made.tracks[k].yaw) + 1.0)


def recorded_off_its_yaw(made: Drive) -> Drive:
    """The obstacle has the heading of its motion, which is 1 rad off the one that is given."""
    k = passing(made)
    spec = made.scene.traffic[-1]
    assert isinstance(spec, lampyris.Recorded)
    yaw = [float(made.tracks[k].yaw[0]) + 1.0] * len(spec.track)
    return with_spec(made, k, replace(spec, yaw=tuple(yaw)))


def other_outline(made: Drive) -> Drive:
    small = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
    return track(made, 0, outline=small)


def no_outline(made: Drive) -> Drive:
    return track(made, 0, outline=None, yaw=None)


def small_disc(made: Drive) -> Drive:
    specs = tuple(replace(one, radius=0.1) for one in made.obstacle_specs)
    return track(replace(made, obstacle_specs=specs), 0, radius=0.5)


def turned_away(made: Drive) -> Drive:
    """An obstacle that goes straight on turns away meanwhile."""
    for n, one in enumerate(made.tracks):
        if made.obstacle_specs[n].kind != "recorded":
            straight = (np.diff(one.xy, axis=0) != 0.0).any(axis=1) & (np.abs(np.diff(one.yaw)) < 1e-9)
            for k in np.flatnonzero(straight).tolist():
                yaw = np.array(one.yaw)
                yaw[k + 1 :] += 0.3
                return track(made, n, yaw=yaw)
    raise AssertionError("none goes straight on")


def turned_while_standing(made: Drive) -> Drive:
    one = made.tracks[0]
    k = int(np.flatnonzero((np.diff(one.xy, axis=0) == 0.0).all(axis=1))[0])
    yaw = np.array(one.yaw)
    yaw[k + 1 :] += 0.3
    return track(made, 0, yaw=yaw)


def made_up_collision(made: Drive) -> Drive:
    return replace(made, outcome=Outcome.COLLISION)


WRONG: dict[Callable[[Drive], Drive], str] = {
    onto_the_robot: "collision", turned_onto_the_robot: "collision", other_outline: "obstacle shape",
    no_outline: "obstacle shape", small_square: "obstacle shape", disc_for_polygon: "obstacle shape",
    small_disc: "obstacle size", turned_away: "obstacle heading", turned_while_standing: "obstacle heading",
    patrol_that_never_turns: "obstacle heading", recorded_off_its_motion: "obstacle heading",
    recorded_off_its_yaw: "obstacle heading", made_up_collision: "outcome",
}  # fmt: skip


@pytest.mark.parametrize("kind", ["footprint", "disc"])
@pytest.mark.parametrize("change", WRONG, ids=lambda one: one.__name__)
def test_what_is_wrong_is_found(change: Callable[[Drive], Drive], kind: str) -> None:
    made = among(kind)
    assert check_drive(made) is None
    found = check_drive(change(made))
    assert found is not None
    assert WRONG[change] in found.rule, found
    if WRONG[change] == "collision":
        assert measure(change(made))["collisions"] == 1
        assert measure(change(made))["gap"] == 0.0


@pytest.mark.parametrize("yaw", some([0.4, 0.0]))
def test_a_recorded_yaw_passes(yaw: float) -> None:
    """Headings that are given with a track on a map that is turned by ``yaw``, and a drive in which obstacles halt."""
    grid = lampyris.Grid(np.zeros((20, 24), dtype=bool), resolution=0.25, origin=(1.0, -2.0, yaw))
    box = [(0.3, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.3, -0.1)]
    cells = [(12, y) for y in range(2, 18)]
    traffic = (
        lampyris.Recorded(cells, footprint=box, yaw=[0.5 * k for k in range(len(cells))]),
        lampyris.Patrol([(6, 4), (6, 15)], footprint=box),
        lampyris.RandomWalk(3, footprint=box),
    )
    scene = lampyris.Scene(
        grid, start=(2, 10), goal=(21, 10), robot=lampyris.Robot(radius=0.2), traffic=traffic
    )
    for seed in range(3):
        made = lampyris.drive(scene, "astar", seed=seed, obstacle_speed=0.5)
        assert check_drive(made) is None
        k = passing(made)
        turned = track(made, k, yaw=np.array(made.tracks[k].yaw) + 1.0)
        found = check_drive(turned)
        assert found is not None
        assert found.rule == "obstacle heading"


def test_a_contact_with_the_disc_alone_is_none() -> None:
    """A polygon that passes close by: the discs around both overlap, the outlines do not."""
    made = among("footprint")
    t = 0.5 * made.duration
    (x, y), yaw = made.at(np.array([t]))[0][0], float(made.poses(np.array([t]))[0, 2])
    thin = ((0.6, 0.02), (-0.6, 0.02), (-0.6, -0.02), (0.6, -0.02))
    # Beside the robot, along it, for a moment; then away from it.
    side = np.array([math.sin(yaw), math.cos(yaw)]) / 0.25
    xy = np.array([(x, y) + 0.3 * side, (x, y) + 0.3 * side, (x, y) + 3.0 * side])
    fields = {"t": [t, t + 1e-3, t + 0.1], "xy": xy, "radius": bound_radius(thin), "top_speed": 100.0}
    motion = _motion(made)
    polygon = Track(**fields, outline=thin, yaw=[yaw] * 3)
    assert 0.05 < polygon_gap_at(motion, polygon, 0.0, 0.25, t) < 0.15
    assert first_polygon_contact(motion, polygon_pairs(motion, [polygon], 0.25), 0.0) is None
    assert first_contact(motion, pairs_of(motion, [Track(**fields)], 0.0, 0.25)) is not None
