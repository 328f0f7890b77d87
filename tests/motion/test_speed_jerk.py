"""A limit on jerk: judged by the referee, beside closed forms, a search of all speeds, and turned round."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.kernels.motion.banded_system import solve_banded
from lampyris.kernels.motion.jerk_barrier import ROWS, descend
from lampyris.motion.jerk import cube_root, jerks, rest_to_rest
from lampyris.motion.profile import Feasible, feasible_profile, stop_to_stop
from lampyris.referee import check_motion
from reference.kernel_forms import use
from sizes import some

Floats = Any


def seven_phases(length: float, cap: float, a: float, d: float, jerk: float) -> float:
    """Seconds from rest to rest in continuous time, unequal limits, by bisection of the top speed."""

    def ramp(v: float, rate: float) -> float:
        return v / rate + rate / jerk if v * jerk >= rate * rate else 2 * math.sqrt(v / jerk)

    def way(v: float) -> float:
        return v * (ramp(v, a) + ramp(v, d)) / 2

    low, high = 0.0, cap
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if way(middle) <= length else (low, middle)
    return ramp(low, a) + ramp(low, d) + (length - way(low)) / low


class Case:
    """Nodes, caps and limits at random; some already drive, some stop to turn."""

    def __init__(self, rng: np.random.Generator, finest: float = -2.0, most: int = 60) -> None:
        n = int(rng.integers(2, most))
        self.s = np.concatenate(([0.0], np.cumsum(10.0 ** rng.uniform(finest, rng.choice([0, 1]), n - 1))))
        self.a, self.d = (float(x) for x in 10.0 ** rng.uniform(-1, 1, 2))
        self.jerk = float(10.0 ** rng.uniform(-2, 2))
        top = float(10.0 ** rng.uniform(-1, 1))
        bend = np.where(rng.random(n) < 0.3, top * rng.uniform(0.05, 1, n), np.inf)
        self.caps = [("limit", np.full(n, top)), ("curvature", bend)]
        self.stop = rng.random(n) < rng.choice([0.0, 0.0, 0.1])
        self.stop[[0, -1]] = False
        least = np.minimum(top, bend)
        least[self.stop] = least[-1] = 0.0
        fastest = math.sqrt(float((least**2 + 2 * self.d * self.s).min()))
        self.v0 = float(fastest * rng.random() ** 0.2 * (rng.random() < 0.5))

    def made(self, **more: Any) -> Feasible:
        given = {"a_max": self.a, "d_max": self.d, "v0": self.v0, "stop": self.stop, "jerk_max": self.jerk}
        return feasible_profile(self.s, self.caps, **(given | more))

    def broken(self, made: Feasible, **more: Any) -> Any:
        given = {
            "a_max": self.a,
            "d_max": self.d,
            "v_max": float(self.caps[0][1][0]),
            "caps": self.caps,
            "v0": self.v0,
            "jerk_max": self.jerk,
        }
        return check_motion(self.s, made.v, made.a, made.t, **(given | more))


@pytest.mark.parametrize(
    ("finest", "count", "most"), some([(-2.0, 40, 60), (-9.0, 40, 25), (-2.0, 120, 60)], 2)
)
def test_random_profiles_keep_every_limit_and_are_nowhere_faster_than_without(
    finest: float, count: int, most: int
) -> None:
    rng = np.random.default_rng(1)
    seen = dict.fromkeys(("rest", "driving", "refused", "jerk binds", "as without"), 0)
    for _ in range(count):
        case = Case(rng, finest, most)
        free = case.made(jerk_max=None)
        try:
            made = case.made()
        except SettingError as refusal:
            code = refusal.code
            case.v0 = float(refusal.allowed.removeprefix("at most ").removesuffix(" m/s"))
            made, free = case.made(), case.made(jerk_max=None)  # what is printed is accepted
            seen["refused"] += code == "PROFILE_INFEASIBLE"
        broken = case.broken(made)
        assert broken is None, str(broken)
        assert (made.v <= free.v).all()
        assert made.t[-1] >= free.t[-1] * (1 - 1e-12)
        assert (made.v[-1], made.v[0]) == (0.0, case.v0)
        seen["driving" if case.v0 else "rest"] += 1
        seen["jerk binds"] += "jerk" in made.cause
        if float(jerks(np.diff(case.s), free.v).max()) <= case.jerk:
            seen["as without"] += 1
            assert made.v.tolist() == free.v.tolist()
            assert made.cause == free.cause
    assert min(seen.values()) >= 1, seen


def test_jerk_is_what_the_referee_measures() -> None:
    rng = np.random.default_rng(2)
    for _ in range(100):
        case = Case(rng)
        if len(case.s) < 3:
            continue
        free = case.made(jerk_max=None, stop=None, v0=0.0)
        most = float(jerks(np.diff(case.s), free.v).max())
        case.v0 = 0.0
        assert case.broken(free, jerk_max=most * (1 + 1e-9)) is None
        assert case.broken(free, jerk_max=most * (1 - 1e-6)).rule == "jerk"


@pytest.mark.parametrize(
    ("length", "cap", "a", "d", "jerk"),
    [(10, 1, 0.5, 1, 1), (10, 1, 0.5, 1, 0.2), (1, 2, 1, 1, 1), (1, 2, 2, 0.5, 5), (5, 0.3, 0.5, 1, 10)],
)
def test_on_a_straight_line_the_time_comes_to_the_seven_phases(
    length: float, cap: float, a: float, d: float, jerk: float
) -> None:
    want = seven_phases(length, cap, a, d, jerk)
    off = []
    for edges in (100, 400):
        s = np.linspace(0.0, length, edges + 1)
        limits = {"a_max": float(a), "d_max": float(d)}
        caps = [("limit", np.full(len(s), float(cap)))]
        off.append(feasible_profile(s, caps, **limits, jerk_max=float(jerk)).t[-1] / want - 1)
    assert abs(off[0]) < 0.03
    assert abs(off[1]) < 0.01


def test_no_speeds_of_a_short_path_are_faster() -> None:
    """Two inner nodes: every pair of speeds of a fine grid is tried."""
    rng = np.random.default_rng(3)
    for _ in range(25):
        s = np.concatenate(([0.0], np.cumsum(rng.uniform(0.2, 2.0, 3))))
        a, d, jerk = (float(x) for x in 10.0 ** rng.uniform(-0.5, 0.5, 3))
        caps = [("limit", np.full(4, 9.0)), ("curvature", np.array([9.0, *rng.uniform(0.3, 3.0, 2), 9.0]))]
        made = feasible_profile(s, caps, a_max=a, d_max=d, jerk_max=jerk)
        free = feasible_profile(s, caps, a_max=a, d_max=d)
        u, w = np.meshgrid(*(np.linspace(1e-3, 1.0, 400) * v for v in free.v[1:3]))
        v = np.stack((0 * u, u, w, 0 * u))
        ds = np.diff(s)[:, None, None]
        dt = 2 * ds / (v[1:] + v[:-1])
        acc = np.diff(v**2, axis=0) / (2 * ds)
        steps = np.abs(np.diff(acc, axis=0)) / (0.5 * (dt[1:] + dt[:-1]))
        ok = (steps <= jerk).all(axis=0) & (acc <= a).all(axis=0) & (acc >= -d).all(axis=0)
        ok &= (2 * np.abs(acc[0]) / dt[0] <= jerk) & (2 * np.abs(acc[2]) / dt[2] <= jerk)
        best = float(np.where(ok, dt.sum(axis=0), np.inf).min())
        assert made.t[-1] <= best * (1 + 1e-4)
        assert best <= made.t[-1] * 1.03


def test_more_jerk_never_takes_longer_and_turned_round_it_takes_as_long() -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        case = Case(rng, most=40)
        case.v0 = 0.0
        made = case.made()
        assert case.made(jerk_max=2 * case.jerk).t[-1] <= made.t[-1] * (1 + 2e-5)
        turned = feasible_profile(
            case.s[-1] - case.s[::-1],
            [(name, v[::-1]) for name, v in case.caps],
            a_max=case.d,
            d_max=case.a,
            stop=case.stop[::-1],
            jerk_max=case.jerk,
        )
        assert turned.t[-1] == pytest.approx(made.t[-1], rel=2e-5)


def test_causes_of_a_smooth_profile() -> None:
    s = np.linspace(0.0, 10.0, 201)
    made = feasible_profile(s, [("limit", np.ones(201))], a_max=0.5, d_max=1.0, jerk_max=1.0)
    runs = [(cause, len(list(nodes))) for cause, nodes in itertools.groupby(made.cause)]
    assert [cause for cause, _ in runs] == [
        "start", "jerk", "acceleration", "jerk", "limit", "jerk", "goal"
    ]  # fmt: skip
    assert dict(runs)["limit"] > 130
    ds = np.diff(s)
    for k in range(1, 200):
        if made.cause[k] == "acceleration":
            assert made.a[k - 1] == pytest.approx(0.5, rel=1e-3)
        if made.cause[k] == "limit":
            assert made.v[k] == pytest.approx(1.0, rel=1e-4)
    assert (jerks(ds, made.v) <= 1.0 + 1e-9).all()
    made = feasible_profile(s, [("limit", 2 * np.ones(201))], a_max=0.5, d_max=0.5, jerk_max=1.0)
    assert "braking" in made.cause
    for k in np.flatnonzero(np.array(made.cause) == "braking").tolist():
        assert made.cause[int(made.cause_index[k])] != "braking"
        assert made.a[k] == pytest.approx(-0.5, rel=1e-3)


def test_a_start_too_fast_for_the_jerk_is_refused_and_hard_braking_goes_on_without() -> None:
    s = np.linspace(0.0, 1.0, 51)
    caps = [("limit", np.full(51, 5.0))]
    limits = {"a_max": 1.0, "d_max": 1.0}
    with pytest.raises(SettingError) as raised:
        feasible_profile(s, caps, **limits, v0=1.41, jerk_max=2.0)
    told = raised.value
    assert told.code == "PROFILE_INFEASIBLE"
    assert "2 m/s3" in str(told)
    greatest = float(told.allowed.removeprefix("at most ").removesuffix(" m/s"))
    # Full braking at once, and the last of it taken back over d / jerk seconds.
    exact = math.sqrt(0.25**2 + 2 * (1 - 1 / 24))
    assert 0.97 * exact < greatest < 1.01 * exact
    made = feasible_profile(s, caps, **limits, v0=greatest, jerk_max=2.0)
    motion = {"v_max": 5.0, "v0": greatest, "jerk_max": 2.0, **limits}
    assert check_motion(s, made.v, made.a, made.t, **motion) is None
    for v0 in (1.41, 1.6):  # the second cannot stop in time even without
        hard = feasible_profile(s, caps, **limits, v0=v0, jerk_max=2.0, on_infeasible="brake")
        free = feasible_profile(s, caps, **limits, v0=v0, on_infeasible="brake")
        assert hard.v.tolist() == free.v.tolist()


def test_one_edge_from_rest_to_rest() -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        length, rate, jerk, cap = (float(x) for x in 10.0 ** rng.uniform(-2, 2, 4))
        time = rest_to_rest(length, rate, jerk, cap)
        assert time == pytest.approx(seven_phases(length, cap, rate, rate, jerk), rel=1e-9)
        assert time >= stop_to_stop(length, rate, rate, cap)[1] * (1 - 1e-12)
        assert rest_to_rest(length, rate, 1e12, cap) == pytest.approx(
            stop_to_stop(length, rate, rate, cap)[1], rel=1e-4
        )
    s = np.array([0.0, 2.0])
    made = feasible_profile(s, [("limit", np.ones(2))], a_max=1.0, d_max=0.5, jerk_max=0.5)
    assert made.t[1] == rest_to_rest(2.0, 0.5, 0.5, 1.0)
    limits = {"a_max": 1.0, "d_max": 0.5, "v_max": 1.0}
    assert check_motion(s, made.v, made.a, made.t, **limits, jerk_max=0.5) is None


def test_a_limit_that_is_none_is_refused() -> None:
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(SettingError, match="PROFILE_LIMIT"):
            feasible_profile(np.arange(3.0), [("limit", np.ones(3))], a_max=1.0, d_max=1.0, jerk_max=bad)


def test_cube_roots() -> None:
    rng = np.random.default_rng(6)
    assert cube_root(0.0) == 0.0
    for x in 10.0 ** rng.uniform(-300, 300, 500):
        assert cube_root(float(x)) ** 3 == pytest.approx(x, rel=1e-14)


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_systems_of_five_diagonals(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, form)
    rng = np.random.default_rng(7)
    for _ in range(60):
        n = int(rng.integers(1, 12))
        lower = np.tril(np.triu(rng.normal(size=(n, n)), -2)) + 2 * np.eye(n)
        matrix = lower @ lower.T
        first, second = np.zeros(n), np.zeros(n)
        first[1:], second[2:] = np.diag(matrix, -1), np.diag(matrix, -2)
        right = rng.normal(size=n)
        x = right.copy()
        assert solve_banded(np.diag(matrix).copy(), first.copy(), second.copy(), x) == 1
        np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-7, atol=1e-9)
        worse = np.diag(matrix) - 1.01 * np.linalg.eigvalsh(matrix)[-1]
        assert solve_banded(worse, first.copy(), second.copy(), right.copy()) == 0


def _floats(digits: str) -> np.ndarray:
    return np.array([float.fromhex(f"0x{word}") for word in digits.split()])


@pytest.mark.parametrize("left", [0.0, 1e6, -1e6])
@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_a_start_that_is_outside_the_limits_is_left_alone(left: float, form: str, monkeypatch: Any) -> None:
    """What scratch memory held before must not matter."""
    use(monkeypatch, form)
    # Outside the limit on jerk by a rounding error: nodes are 1e-9 m apart.
    before = _floats(
        "1.f7ef95ab951e4p-8 1.f7efa713538d0p-8 1.91e05c6c9be8ap-8 1.91e0773edde18p-8 1.0cd5668da971fp-6 "
        "1.0cd56d4240033p-6 1.0cd573f6d6947p-6 1.0cd57aab6d245p-6 0.0p+0"
    )
    ds = _floats(
        "1.12e0be826d695p-30 1.26ecb50313b63p+3 1.12e0be826d695p-30 1.d057210371d05p+1 1.12e0be826d695p-30 "
        "1.12e0be826d695p-30 1.12e0be826d695p-30 1.72c91fa3077efp+1"
    )
    top = _floats(
        "1.f7ef95ab951e4p-8 1.f7efccbdded7cp-8 1.769aeddad001dp-5 1.769af4bd19390p-5 1.f624230cba48ap-2 "
        "1.f62423070432bp-2 1.f62423e34d599p-2 1.f62424bf96807p-2 0.0p+0"
    )
    limits = _floats("1.9a506e51280a2p+2 1.546b1856bd234p-3 1.dedebeb377d29p+1")
    x, inner = before.copy(), len(before) - 2
    scratch = (x.copy(), np.empty(ROWS * len(x)), *np.empty((8, inner)), np.full(2, left))
    assert descend(x, ds, top, limits, False, 1.0, 0.0, 12, *scratch) == 0
    assert x.tolist() == before.tolist()
