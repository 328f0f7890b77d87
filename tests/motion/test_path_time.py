"""Ways through tracks: nobody is met, nothing is broken, nothing simpler is faster."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.errors import LampyrisError, LimitError, SettingError
from lampyris.model.curve import Curve
from lampyris.model.obstacles import Track
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.traffic import RandomWalk, Recorded
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.profile import feasible_profile
from lampyris.motion.timing import spacetime_lattice as lattices
from lampyris.motion.timing.obstacle_tracks import CappedPath, discs_of, tracks_from_recorded
from lampyris.motion.timing.path_time import through_tracks
from lampyris.motion.timing.reachability import Blocked, parts_of, walk
from lampyris_selfcheck.reference.motion.path_time import least_gap, steps_to_goal
from reference.kernel_forms import use
from sizes import sized

ROBOT = Robot(radius=0.25, v_max=1.0, a_max=0.5, d_max=1.0)


def straight(length: float, n: int, resolution: float = 1.0) -> SampledPath:
    s = np.linspace(0.0, length, n)
    xy = np.stack((s / resolution, np.zeros(n)), axis=-1)
    return SampledPath(s, xy, np.tile((1.0, 0.0), (n, 1)), np.zeros(n), np.zeros(n, dtype=bool), resolution)


def bent(rng: np.random.Generator, length: float, stops: int = 0) -> SampledPath:
    """A polyline that wanders about."""
    n = int(length * 10) + 2
    s = np.linspace(0.0, length, n)
    turn = np.cumsum(rng.normal(0.0, 0.05, n))[:-1]
    step = np.diff(s)[:, None] * np.stack((np.cos(turn), np.sin(turn)), axis=-1)
    xy = np.concatenate((np.zeros((1, 2)), np.cumsum(step, axis=0)))
    stop = np.zeros(n, dtype=bool)
    stop[rng.integers(5, n - 5, stops)] = True
    return SampledPath(s, xy, np.tile((1.0, 0.0), (n, 1)), np.zeros(n), stop, 1.0)


def crossing(rng: np.random.Generator, course: SampledPath, seconds: float, count: int) -> list[Track]:
    """Tracks that each cross the course somewhere at some time."""
    made = []
    for _ in range(count):
        at, when = course.xy[rng.integers(0, len(course))], rng.uniform(0.0, 1.2 * seconds)
        heading = rng.normal(size=2)
        u, before = rng.uniform(0.2, 1.5), rng.uniform(3.0, 15.0)
        d = heading / np.sqrt(heading @ heading) * u * before
        times = np.array([when - before, when + before])
        made.append(Track(times, np.stack((at - d, at + d)), float(rng.uniform(0.1, 0.5)), float(u)))
    return made


def plain(course: SampledPath, cap: np.ndarray, robot: Robot, v0: float = 0.0):  # type: ignore[type-arg,no-untyped-def]
    return feasible_profile(
        course.s, [("limit", cap)], a_max=robot.a_max, d_max=robot.d_max, v0=v0, stop=course.stop
    )


def check_motion(p: Profile, robot: Robot, course: SampledPath, ceiling: np.ndarray) -> None:  # type: ignore[type-arg]
    ds, dt = np.diff(p.s), np.diff(p.t)
    assert (ds >= 0.0).all()
    assert (dt > 0.0).all()
    assert np.abs(p.v[1:] ** 2 - p.v[:-1] ** 2 - 2.0 * p.a[:-1] * ds).max() < 1e-9
    assert np.abs(dt * (p.v[1:] + p.v[:-1]) / 2.0 - ds).max() < 1e-9
    assert p.a.max() <= robot.a_max * (1 + 1e-9)
    assert p.a.min() >= -robot.d_max * (1 + 1e-9)
    assert (p.v**2 <= np.interp(p.s, course.s, ceiling) + 1e-9).all()
    assert p.t[0] == 0.0
    assert p.s[-1] == pytest.approx(course.s[-1], abs=1e-9)
    assert p.v[-1] == 0.0
    still = (p.cause[k] == "wait" for k in range(len(p.s)) if p.s[k] == p.s[max(k - 1, 0)] and k)
    assert all(still)
    for k, word in enumerate(p.cause):
        assert word not in ("wait", "moving obstacle") or p.cause_index[k] >= 0
        assert word != "braking" or p.cause_index[k] > k
    assert np.isfinite(p.xy).all()


@pytest.mark.nightly
@sized("cases", 40, 60)
def test_random_ways_meet_nobody(cases: int) -> None:
    rng = np.random.default_rng(5)
    seen = {"same": 0, "way": 0, "PROFILE_BLOCKED": 0, "PROFILE_INFEASIBLE": 0}
    for _ in range(cases):
        course = bent(rng, float(rng.uniform(2.0, 12.0)), int(rng.integers(0, 3)))
        cap = np.clip(1.0 + np.cumsum(rng.normal(0.0, 0.03, len(course))), 0.25, 1.5)
        robot = Robot(
            radius=0.2,
            v_max=1.5,
            a_max=float(rng.choice((0.3, 0.5, 1.0))),
            d_max=float(rng.choice((0.5, 1.3))),
        )
        still = plain(course, cap, robot)
        v0 = 0.0 if rng.random() < 0.5 else float(still.v.max() * rng.random())
        tracks = crossing(rng, course, float(still.t[-1]), int(rng.integers(1, 6)))
        late = [Track(one.t + 20.0, one.xy, one.radius, one.top_speed) for one in tracks]
        try:
            p = through_tracks(course, cap, robot, late, v0=v0, t0=20.0)
        except SettingError as error:
            seen[error.code] += 1
            continue
        free = plain(course, cap, robot, v0)
        assert least_gap(p, course, late, robot.radius, t0=20.0, dense=20001) > -1e-7
        assert p.duration >= free.t[-1]
        if p.duration == free.t[-1]:
            seen["same"] += 1
            for name in "vat":
                assert np.array_equal(getattr(p, name), getattr(free, name))
            assert p.cause == free.cause
        else:
            seen["way"] += 1
            check_motion(p, robot, course, free.v**2)
            assert {"wait", "moving obstacle"} & set(p.cause)
    assert seen["same"] > cases / 6
    assert seen["way"] > cases / 6
    assert seen["PROFILE_BLOCKED"] > 0


@pytest.mark.nightly
def test_the_walk_is_the_shortest_there_is() -> None:
    """Beside a search over the same lattice, state by state, with distances of its own."""
    rng = np.random.default_rng(11)
    waited = blocked = 0
    for _ in range(14):
        course = bent(rng, float(rng.uniform(1.0, 1.6)))
        cap = np.clip(0.8 + np.cumsum(rng.normal(0.0, 0.05, len(course))), 0.4, 1.0)
        still = plain(course, cap, ROBOT)
        x = still.v**2
        start = lattices.start_of(0.0, float(course.s[-1]), 0.2, ROBOT.d_max, 4)
        assert start is not None
        lattice = lattices.lattice_of(
            course.s, x, course.s[-1:], ROBOT.d_max, lattices.rates(ROBOT), start, 16, 10**6
        )
        assert lattice is not None
        tracks = crossing(rng, course, 3.0, 3)
        way = CappedPath(course.s, course.xy[:, 0].copy(), course.xy[:, 1].copy(), cap, course.stop)
        discs = discs_of(tracks, 0.1, 0.0, 1.0)
        try:
            steps = len(walk(way, lattice, discs, 0.0, 20 * lattice.dt).place) - 1
        except Blocked:
            steps = -1
            blocked += 1
        other = steps_to_goal(
            course,
            x,
            tracks,
            0.1,
            dt=lattice.dt,
            unit=float(lattice.unit[0]),
            last=int(lattice.places[-1]),
            rise=lattice.rise,
            fall=lattice.fall,
            parts=parts_of(lattice, discs),
            most=20,
        )
        assert steps == other
        waited += steps > lattice.fewest
    assert waited > 2
    assert blocked > 0


@pytest.mark.nightly
def test_it_waits_slows_down_or_passes_first() -> None:
    course, cap = straight(10.0, 101), np.full(101, 1.0)

    def across(x: float, when: float, u: float = 1.0) -> Track:
        return Track(np.array([when - 8.0, when + 8.0]), np.array([(x, -8.0 * u), (x, 8.0 * u)]), 0.25, u)

    free = plain(course, cap, ROBOT)
    first = through_tracks(course, cap, ROBOT, [across(2.0, 9.0)])
    assert np.array_equal(first.t, free.t)
    late = through_tracks(course, cap, ROBOT, [across(5.0, 6.0)])
    assert "moving obstacle 0" in [late.why(k) for k in range(len(late.s))]
    assert "wait" not in late.cause
    # It comes through half a second after the obstacle's middle: both have to clear 0.5 m at 1 m/s.
    assert free.t[-1] + 0.3 < late.duration < free.t[-1] + 0.8
    # One that comes from behind and parks on the start: the robot must go, and wait on the way.
    chased = Track(np.array([0.0, 4.0]), np.array([(-4.0, 0.0), (0.0, 0.0)]), 0.25, 1.0)
    waiting = through_tracks(course, cap, ROBOT, [chased, across(3.0, 8.0, 0.1)])
    k = waiting.cause.index("wait")
    assert waiting.why(k) == "wait for obstacle 1"
    assert 0.4 < waiting.s[k] < 2.501
    # Somewhere to wait that is not the start, for so long that no speed can be held.
    gate = Track(np.array([0.0, 60.0, 61.0]), np.array([(5.0, 0.3), (5.0, 0.3), (5.0, 9.0)]), 0.25, 9.0)
    stood = through_tracks(course, cap, ROBOT, [chased, gate])
    k = stood.cause.index("wait")
    assert stood.why(k) == "wait for obstacle 1"
    assert stood.s[k] == stood.s[k + 1]
    assert stood.t[k + 1] - stood.t[k] > 5.0
    slowed = through_tracks(course, cap, ROBOT, [across(5.0, 4.9)], v0=1.0)
    assert "moving obstacle 0" in [slowed.why(k) for k in range(len(slowed.s))]
    assert "wait" not in slowed.cause


def test_it_follows_one_that_drives_ahead() -> None:
    """A slow one on the same line, which leaves it at the end: the robot keeps behind it."""
    course, cap = straight(8.0, 161), np.full(161, 1.0)
    ahead = Track(np.array([0.0, 20.0, 22.0]), np.array([(1.0, 0.0), (7.0, 0.0), (7.0, 3.0)]), 0.25, 1.5)
    p = through_tracks(course, cap, ROBOT, [ahead])
    assert least_gap(p, course, [ahead], ROBOT.radius, dense=20001) > -1e-7
    assert 20.0 < p.duration < 23.5


def blocked_or(error: SettingError) -> None:
    """Anything but a blocked way is a failure."""
    if error.code != "PROFILE_BLOCKED":
        raise error


def test_blocked_names_who() -> None:
    course, cap = straight(10.0, 101), np.full(101, 1.0)
    aside = Track(np.array([0.0]), np.array([(3.0, 5.0)]), 0.3, 0.0)
    parked = Track(np.array([0.0]), np.array([(6.0, 0.1)]), 0.3, 0.0)
    with pytest.raises(SettingError, match="obstacle 1") as blocked:
        through_tracks(course, cap, ROBOT, [aside, parked])
    assert blocked.value.code == "PROFILE_BLOCKED"
    assert blocked.value.where == "tracks[1]"
    upon = Track(np.array([0.0, 9.0]), np.array([(0.1, 0.0), (0.1, 9.0)]), 0.3, 1.0)
    with pytest.raises(SettingError, match="obstacle 0"):
        through_tracks(course, cap, ROBOT, [upon])
    # 0.55 m take the robot 1.5 s to stop in at least, and a wall of a disc is there after 0.2 s.
    sudden = Track(np.array([0.2]), np.array([(1.0, 0.0)]), 0.3, 0.0)
    with pytest.raises(SettingError, match="obstacle 0"):
        through_tracks(course, cap, ROBOT, [sudden], v0=0.9)
    late = Track(np.array([0.0, 30.0, 31.0]), np.array([(6.0, 0.1), (6.0, 0.1), (6.0, 9.0)]), 0.3, 9.0)
    assert through_tracks(course, cap, ROBOT, [late]).duration > 30.0
    with pytest.raises(SettingError, match="horizon"):
        through_tracks(course, cap, ROBOT, [late], horizon=25.0)


def test_touching_is_not_meeting() -> None:
    """Discs parked at the exact sum of the radii on either side leave the way free."""
    course, cap = straight(10.0, 101), np.full(101, 1.0)
    beside = [Track(np.array([0.0]), np.array([(5.0, y)]), 0.25, 0.0) for y in (-0.5, 0.5)]
    p = through_tracks(course, cap, ROBOT, beside)
    assert np.array_equal(p.t, plain(course, cap, ROBOT).t)
    crossing_one = Track(np.array([0.0, 20.0]), np.array([(8.0, -9.0), (8.0, 11.0)]), 0.25, 1.0)
    assert through_tracks(course, cap, ROBOT, [*beside, crossing_one]).duration > p.duration


@pytest.mark.parametrize("x", [3.003, 5.0, 6.1171, 7.77])
def test_a_graze_is_a_meeting(x: float) -> None:
    """A thousandth of a millimetre too near, for 2 mm of the way: samples in between would miss it."""
    course = straight(10.0, 101)
    beside = Track(np.array([0.0]), np.array([(x, 0.5 - 1e-6)]), 0.25, 0.0)
    with pytest.raises(SettingError, match="obstacle 0"):
        through_tracks(course, np.full(101, 1.0), ROBOT, [beside])


def test_more_obstacles_never_help_and_more_power_never_hurts() -> None:
    """Within what the lattice may lose: a step for an obstacle more, 6 % for other units."""
    rng = np.random.default_rng(3)
    for _ in range(12):
        course = bent(rng, float(rng.uniform(3.0, 8.0)))
        cap = np.full(len(course), 1.0)
        free = float(plain(course, cap, ROBOT).t[-1])
        tracks = crossing(rng, course, free, 4)
        spent = 0.0
        try:
            for count in range(5):
                p = through_tracks(course, cap, ROBOT, tracks[:count], step=0.125)
                assert p.duration >= max(spent - 0.125, free)
                spent = p.duration
            strong = Robot(radius=0.25, v_max=1.0, a_max=1.0, d_max=1.0)
            assert through_tracks(course, cap, strong, tracks, step=0.125).duration <= 1.06 * spent
        except SettingError as error:
            blocked_or(error)


@pytest.mark.nightly
def test_a_finer_lattice_gains_little() -> None:
    rng = np.random.default_rng(21)
    ratios = []
    while len(ratios) < 8:
        course = bent(rng, float(rng.uniform(3.0, 8.0)))
        cap = np.full(len(course), 1.0)
        tracks = crossing(rng, course, float(course.s[-1]) + 1.5, 3)
        try:
            p = through_tracks(course, cap, ROBOT, tracks)
            if {"wait", "moving obstacle"} & set(p.cause):
                ratios.append(p.duration / through_tracks(course, cap, ROBOT, tracks, step=0.0625).duration)
        except SettingError as error:
            blocked_or(error)
    assert np.median(ratios) < 1.02


def test_arcs_are_kept_clear_of() -> None:
    """The robot's way bends between the nodes; gaps are those of the arcs, not of the chords."""
    quarter = 0.5 * np.pi
    curve = Curve(
        np.array([(0.0, 0.0), (10.0, 0.0)]),
        np.array([(1.0, 0.0), (1.0, 0.0)]),
        np.array([1.0, 0.5 * quarter]),
        np.array([0.0, 2.0]),
        (15.0, 5.0),
        0.1,
    )
    course = sample_curve(curve, 0.2)
    cap = np.full(len(course), 0.7)
    for when in (2.0, 2.5, 3.0, 3.5):
        track = Track(
            np.array([0.0, when, 2 * when]), np.array([(30.0, 2.0), (13.0, 2.0), (30.0, 2.0)]), 0.1, 2.0
        )
        p = through_tracks(course, cap, ROBOT, [track], radius=0.1)
        assert least_gap(p, course, [track], 0.1, dense=20001) > 0.0


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_both_forms_say_the_same(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    course = bent(rng, 2.5, 1)
    cap = np.full(len(course), 0.6)
    tracks = crossing(rng, course, 6.0, 3)
    p = through_tracks(course, cap, ROBOT, tracks, radius=0.1)
    assert {"wait", "moving obstacle"} & set(p.cause)
    use(monkeypatch, form)
    q = through_tracks(course, cap, ROBOT, tracks, radius=0.1)
    for name in ("s", "v", "a", "t", "cause_index"):
        assert np.array_equal(getattr(p, name), getattr(q, name))
    assert p.cause == q.cause


def test_odd_ways() -> None:
    over = Track(np.array([0.0, 4.0]), np.array([(0.0, -2.0), (0.0, 2.0)]), 0.25, 1.0)
    one = straight(0.0, 1)
    assert through_tracks(one, np.ones(1), ROBOT, [over]).duration == 0.0
    edge = straight(3.0, 2)
    p = through_tracks(edge, np.ones(2), ROBOT, [Track(over.t, over.xy + np.array((2.0, 0.0)), 0.25, 1.0)])
    assert p.duration >= plain(edge, np.ones(2), ROBOT).t[-1]
    assert p.duration == through_tracks(edge, np.ones(2), ROBOT, []).duration or "wait" in p.cause
    long = straight(1e5, 1001)
    with pytest.raises(LimitError):
        through_tracks(long, np.ones(1001), ROBOT, [Track(np.array([0.0]), np.array([(9e4, 0.0)]), 0.3, 0.0)])
    for bad in (
        {"margin": -1.0},
        {"t0": float("nan")},
        {"horizon": float("inf")},
        {"v0": -1.0},
        {"step": -0.1},
    ):
        with pytest.raises(SettingError):
            through_tracks(
                straight(3.0, 31),
                np.ones(31),
                ROBOT,
                [Track(np.array([0.0]), np.array([(2.0, 0.0)]), 0.3, 0.0)],
                **bad,
            )  # type: ignore[arg-type]
    with pytest.raises(LampyrisError):
        through_tracks(straight(0.1, 11), np.ones(11), ROBOT, [], v0=1.0)


def test_recorded_tracks_move_from_cell_to_cell() -> None:
    walker = Recorded(((0, 0), (1, 1), (2, 2), (2, 2), (2, 2), (3, 2)))
    disc = Recorded(((5, 5),), radius=0.4)
    first, second = tracks_from_recorded([walker, RandomWalk(3), disc], 2.0, 0.5)
    assert first.t.tolist() == [0.0, 4.0, 8.0, 10.0]
    assert np.allclose(first.at(np.array([1.0, 3.0, 6.0, 9.0])), [(0.5, 0.5), (1.5, 1.5), (2, 2), (2.5, 2)])
    assert first.radius == 0.25
    assert first.top_speed == pytest.approx(np.sqrt(2.0) * 0.5 / 2.0)
    assert second.radius == 0.4
    with pytest.raises(SettingError):
        tracks_from_recorded([walker], -1.0, 0.5)
