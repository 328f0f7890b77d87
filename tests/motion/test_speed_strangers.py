"""The speed modules under a stranger's hands: odd sizes, limits to the last bit, things in odd places.

Each test states what must hold and asks with random and with perverse input. It shares no code with what it
asks: sums are done again in long doubles, distances by looking at many points.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lampyris.errors import LampyrisError, SettingError
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws import registry as laws
from lampyris.motion.profile import feasible_profile
from lampyris.motion.safety.surroundings import reach_of, room
from sizes import sized

LONG = np.longdouble
NAN = float("nan")


# ---- the feasible profile ----------------------------------------------------------------------------


def odd_profile(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Nodes, caps, stops and limits: 1 to 12 nodes, spacing and limits over many orders of magnitude."""
    n = int(rng.choice([1, 2, 2, 3, 5, 12]))
    ds = 10.0 ** rng.uniform(-9, 6, size=n - 1) if rng.random() < 0.5 else rng.random(n - 1) + 0.1
    s = np.concatenate(([0.0], np.cumsum(ds)))
    cap = 10.0 ** rng.uniform(-6, 6, size=n) if rng.random() < 0.3 else rng.random(n) + 0.01
    a, d = 10.0 ** rng.uniform(-3, 3, 2) if rng.random() < 0.3 else (0.5, 1.0)
    stop = np.zeros(n, dtype=bool)
    if rng.random() < 0.3 and n > 2:
        stop[1:-1] = rng.random(n - 2) < 0.3
    return s, cap, stop, float(a), float(d)


def fastest_start(s: np.ndarray, cap: np.ndarray, stop: np.ndarray, d: float) -> float:
    """The greatest speed at the first node from which every bound ahead can be kept, in long doubles."""
    bound = np.array(cap, dtype=LONG) ** 2
    bound[stop] = bound[-1] = 0
    m = bound[-1]
    for k in range(len(s) - 2, -1, -1):
        m = min(bound[k], m + 2 * LONG(d) * (LONG(s[k + 1]) - LONG(s[k])))
    return float(np.sqrt(m))


@pytest.mark.nightly
def test_profiles_keep_every_limit_from_every_start_speed() -> None:
    rng = np.random.default_rng(501)
    refused = made = 0
    for _ in range(2500):
        s, cap, stop, a, d = odd_profile(rng)
        if (np.diff(s) <= 0).any():
            continue
        most = fastest_start(s, cap, stop, d)
        share = float(rng.choice((0.0, 0.5, 1.0, 1.0 + 1e-9)))
        v0 = most * share if most * share > 1e-100 else 0.0
        if share == 1.0 and rng.random() < 0.5:
            v0 = float(np.nextafter(v0, np.inf)) if v0 else 0.0
        if share > 1.0 and v0 > 0.0:
            with pytest.raises(SettingError) as refusal:
                feasible_profile(s, [("limit", cap)], a_max=a, d_max=d, v0=v0, stop=stop)
            assert refusal.value.code == "PROFILE_INFEASIBLE"
            refused += 1
            continue
        p = feasible_profile(s, [("limit", cap)], a_max=a, d_max=d, v0=v0, stop=stop)
        made += 1
        v, ds = LONG(p.v), LONG(np.diff(s))
        assert p.v[0] == v0
        assert p.v[-1] == 0.0 or len(s) == 1
        assert (p.v[stop] == 0).all()
        assert (v <= LONG(cap) * (1 + 1e-12)).all()
        x = v * v
        assert (x[1:] <= (x[:-1] + 2 * LONG(a) * ds) * (1 + 1e-12)).all()
        assert (x[:-1] <= (x[1:] + 2 * LONG(d) * ds) * (1 + 1e-12)).all()
        assert (np.diff(p.t) > 0).all()
        assert ((p.a <= a) & (-p.a <= d)).all()
        pace = v[1:] + v[:-1]
        drives = pace > 0
        least = (2 * ds / np.where(drives, pace, 1))[drives]
        assert (np.abs(np.diff(p.t)[drives] - least) <= 1e-9 * least + 4e-16 * len(s) * p.t[1:][drives]).all()
    assert refused > 300
    assert made > 1500


def test_a_higher_limit_is_never_slower_and_a_node_more_changes_nothing() -> None:
    rng = np.random.default_rng(502)
    for _ in range(400):
        s, cap, stop, a, d = odd_profile(rng)
        if len(s) < 3 or (np.diff(s) <= 0).any():
            continue
        base = feasible_profile(s, [("limit", cap)], a_max=a, d_max=d, stop=stop)
        raised = [
            (cap * (1 + rng.random(len(cap)) * (rng.random(len(cap)) < 0.3)), a, d),
            (cap, a * 1.5, d),
            (cap, a, d * 1.5),
        ]
        for more, a1, d1 in raised:
            quick = feasible_profile(s, [("limit", more)], a_max=a1, d_max=d1, stop=stop)
            assert (quick.v >= base.v).all()
            assert quick.t[-1] <= base.t[-1] * (1 + 1e-12)
        back = feasible_profile(
            (s[-1] - s)[::-1].copy(), [("limit", cap[::-1].copy())], a_max=d, d_max=a, stop=stop[::-1].copy()
        )
        scale = 1e-6 * base.v.max() if np.diff(s).min() > 1e-3 * s[-1] else np.inf
        assert (np.abs(back.v[::-1] - base.v) <= scale).all()


ODD_PROFILES: dict[str, dict[str, Any]] = {
    "nan distance": {"s": [0.0, NAN, 2.0]},
    "endless": {"s": [0.0, 1.0, math.inf]},
    "equal": {"s": [0.0, 1.0, 1.0]},
    "falling": {"s": [0.0, 2.0, 1.0]},
    "nan cap": {"cap": [1.0, NAN, 1.0]},
    "negative cap": {"cap": [1.0, -1.0, 1.0]},
    "cap of 0 on the way": {"cap": [1.0, 0.0, 1.0]},
    "denormal cap": {"cap": [1.0, 5e-324, 1.0]},
    "caps too few": {"cap": [1.0, 1.0]},
    "nan start": {"v0": NAN},
    "negative start": {"v0": -0.1},
    "endless start": {"v0": math.inf},
    "true start": {"v0": True},
    "nan acceleration": {"a_max": NAN},
    "no braking": {"d_max": 0.0},
    "endless braking": {"d_max": math.inf},
    "stops too few": {"stop": np.zeros(2, dtype=bool)},
    "too fast": {"v0": 3.0},
    "no node": {"s": [], "cap": []},
}


@pytest.mark.parametrize("name", ODD_PROFILES)
def test_odd_profiles_are_refused_in_words(name: str) -> None:
    odd = {"s": [0.0, 1.0, 2.0], "cap": [1.0, 1.0, 1.0], "a_max": 0.5, "d_max": 1.0, **ODD_PROFILES[name]}
    s, cap = np.array(odd.pop("s")), np.array(odd.pop("cap"))
    with pytest.raises(SettingError) as refusal:
        feasible_profile(s, [("limit", cap)], **odd)
    assert refusal.value.code.startswith(("PROFILE_", "START_SPEED"))


# ---- surfaces ----------------------------------------------------------------------------------------


def by_eye(xy: np.ndarray, blocked: np.ndarray) -> np.ndarray:
    """Distance of points to the nearest blocked square, cells, one square after the other."""
    out = np.full(len(xy), np.inf)
    for y, x in np.argwhere(blocked).tolist():
        dx, dy = np.maximum(np.abs(xy[:, 0] - x) - 0.5, 0), np.maximum(np.abs(xy[:, 1] - y) - 0.5, 0)
        np.minimum(out, np.hypot(dx, dy), out=out)
    return out


def test_wall_distance_anywhere() -> None:
    rng = np.random.default_rng(503)
    for k in range(60):
        height, width = (int(v) for v in rng.integers(1, 80, 2))
        blocked = rng.random((height, width)) < float(rng.choice((0.0, 0.002, 0.1, 0.9, 1.0)))
        res = float(rng.choice((0.05, 1.0, 3.0)))
        grid = Grid(blocked, resolution=res)
        xy = rng.uniform(-30, 110, (40, 2))
        xy[::4] = np.rint(xy[::4])
        xy[1::4] = np.rint(xy[1::4]) + 0.5  # on the borders of cells
        want = by_eye(xy, blocked) * res
        reach = float(rng.choice((0.0, 0.3, 5.0, 40.0, math.inf)))
        got = wall_distance(xy, grid, reach)
        sure = np.abs(want - reach) > 1e-9 * (1 + want) if math.isfinite(reach) else np.isfinite(want)
        assert np.allclose(got[sure & (want <= reach)], want[sure & (want <= reach)], rtol=1e-12, atol=1e-12)
        assert np.isinf(got[sure & (want > reach)]).all(), k


def bent_curve(rng: np.random.Generator, res: float) -> Curve:
    """Lines and arcs that join, of any radius and angle, from about the middle of a map of 30 cells."""
    xy, heading, lengths, curvature = [], [], [], []
    at, angle = np.array((15.0, 15.0)), rng.random() * 7
    for _ in range(int(rng.integers(1, 6))):
        length = float(rng.random() * 4 + 0.01) * res
        bend = float(rng.choice((0.0, 1.0)) * rng.normal()) / res
        xy.append(at)
        heading.append((math.cos(angle), math.sin(angle)))
        lengths.append(length)
        curvature.append(bend)
        piece = Curve([xy[-1]], [heading[-1]], [length], [bend], (0.0, 0.0), res)
        at = piece.at(np.array([length * (1 - 1e-15)]))[0][0]
        angle += bend * length
    return Curve(np.array(xy), np.array(heading), np.array(lengths), np.array(curvature), (at[0], at[1]), res)


@pytest.mark.nightly
@sized("cases", 40, 120)
def test_room_is_never_more_than_there_is(cases: int) -> None:
    """Between nodes too, on lines and arcs, however far apart the nodes are."""
    rng = np.random.default_rng(504)
    told = 0.0
    for k in range(cases):
        res = (1.0, 0.1)[k % 2]
        curve = bent_curve(rng, res)
        blocked = rng.random((30, 30)) < 0.03
        grid = Grid(blocked, resolution=res)
        course = sample_curve(curve, float(rng.choice((0.1, 0.5, 3.0))) * res)
        reach = reach_of(course, 4.0 * res)
        least = room(course, wall_distance(course.xy, grid, reach), reach)
        for i in range(len(course) - 1):
            s = np.linspace(course.s[i], course.s[i + 1], 60)
            there = by_eye(curve.at(s)[0], blocked).min() * res
            for node in (i, i + 1):
                if least[node] < math.inf:
                    assert least[node] <= there + 1e-9 * res, (k, i)
                else:
                    assert there > 4.0 * res * (1 - 1e-9)
            told += math.isfinite(there)
    assert told > 2.5 * cases


# ---- laws --------------------------------------------------------------------------------------------


def _line(n: int, length: float, res: float = 1.0) -> SampledPath:
    s = np.linspace(0.0, length, n) if n > 1 else np.zeros(1)
    xy = np.stack((2.0 + s / res, np.full(n, 2.0)), axis=1)
    heading = np.tile((1.0, 0.0), (n, 1))
    return SampledPath(s, xy, heading, np.zeros(n), np.zeros(n, dtype=bool), res)


@pytest.mark.parametrize("law", laws.names())
@pytest.mark.parametrize(("nodes", "length"), [(1, 0.0), (2, 1e-9), (2, 5.0), (3, 1e-6), (50, 5.0)])
def test_every_law_on_courses_of_few_nodes(law: str, nodes: int, length: float) -> None:
    scene = Scene(Grid(np.zeros((5, 12), bool)), (2, 2), (7, 2), robot=Robot(radius=0.4))
    p = laws.profile(_line(nodes, length), scene, law=law)
    assert len(p.v) == nodes
    assert (p.v >= 0).all()
    assert (p.v <= scene.robot.v_max * (1 + 1e-9)).all()
    assert p.v[-1] == 0.0
    assert (np.diff(p.t) > 0).all()


@pytest.mark.parametrize("law", laws.names())
def test_every_law_refuses_nonsense_in_words(law: str) -> None:
    scene = Scene(Grid(np.zeros((5, 12), bool)), (2, 2), (7, 2))
    for v0 in (NAN, -1.0, math.inf):
        with pytest.raises(LampyrisError):
            laws.profile(_line(5, 3.0), scene, law=law, v0=v0)
