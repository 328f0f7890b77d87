"""The referee on motions along a line: drivable ones pass, every corruption is caught by its rule."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lampyris.referee import check_motion
from lampyris.referee.motion import rest_to_rest

Numbers = dict[str, Any]


def motion(rng: np.random.Generator) -> Numbers:
    """A lawful motion, built from accelerations and durations, with limits that just allow it."""
    while True:
        n = int(rng.integers(4, 14))
        dt = 10.0 ** rng.uniform(-1, 1, n - 1)
        a = rng.uniform(-1, 1, n - 1)
        v = np.concatenate(([0.0], np.cumsum(a * dt)))
        v += 1.5 * abs(float(v.min())) * (np.arange(n) > 0) + 0.1 * (np.arange(n) > 0)
        v[-1] = 0.0
        a = np.diff(v) / dt
        if (v[1:-1] > 1e-3).all() and a.max() > 0 > a.min():
            break
    ds = 0.5 * (v[:-1] + v[1:]) * dt
    s = np.concatenate(([0.0], np.cumsum(ds)))
    ds = np.diff(s)
    a = np.append(np.diff(v**2) / (2 * ds), 0.0)
    t = np.concatenate(([0.0], np.cumsum(2 * ds / (v[:-1] + v[1:]))))
    return {
        "s": s,
        "v": v,
        "a": a,
        "t": t,
        "a_max": float(a.max()),
        "d_max": float(-a.min()),
        "v_max": float(v.max()),
        "caps": (("bend", v * 1.0),),
    }


def judge(made: Numbers, **more: Any) -> str | None:
    found = check_motion(**(made | more))
    assert "np." not in str(found)
    return None if found is None else found.rule


def with_speed(m: Numbers, k: int, speed: float) -> Numbers:
    """Another speed at node k, with the accelerations and times that belong to it."""
    v, ds = m["v"].copy(), np.diff(m["s"])
    v[k] = speed
    pace = np.where(v[:-1] + v[1:] > 0, v[:-1] + v[1:], 1.0)
    a = np.append(np.diff(v**2) / (2 * ds), 0.0)
    return m | {"v": v, "a": a, "t": np.concatenate(([0.0], np.cumsum(2 * ds / pace)))}


def test_lawful_motions_pass_and_each_limit_is_tight() -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        m = motion(rng)
        assert judge(m) is None
        for limit, rule in (("a_max", "acceleration"), ("d_max", "braking"), ("v_max", "speed")):
            assert judge(m | {limit: m[limit] * (1 - 1e-9)}) == rule
        assert (
            judge(m | {"caps": (("zone", np.full(len(m["s"]), np.inf)), ("bend", m["v"] * (1 - 1e-9)))})
            == "bend"
        )


def test_jerk_is_measured_between_middles_of_edges_and_against_rest() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        m = motion(rng)
        dt, a = np.diff(m["t"]), m["a"][:-1]
        inner = np.abs(np.diff(a)) / (0.5 * (dt[1:] + dt[:-1]))
        most = max(inner.max(), 2 * abs(a[0]) / dt[0], 2 * abs(a[-1]) / dt[-1])
        assert judge(m, jerk_max=most * (1 + 1e-9)) is None
        assert judge(m, jerk_max=most * (1 - 1e-6)) == "jerk"
    # Who drives already may have any acceleration at first.
    s, v = np.array([0.0, 1.0, 2.0]), np.array([math.sqrt(2.0), 1.0, 0.0])
    t = np.array([0.0, 2 / (v[0] + 1), 2 / (v[0] + 1) + 2])
    steady = {
        "s": s,
        "v": v,
        "a": np.array([-0.5, -0.5, 0.0]),
        "t": t,
        "a_max": 1.0,
        "d_max": 1.0,
        "v_max": 2.0,
    }
    assert judge(steady, v0=float(v[0]), jerk_max=0.5) is None  # 0.5 m/s2 taken off in the last second
    assert judge(steady, v0=float(v[0]), jerk_max=0.49) == "jerk"


Corruption = Callable[[Numbers, np.random.Generator], Numbers]


def _set(name: str, k: int, value: float) -> Corruption:
    def corrupt(m: Numbers, rng: np.random.Generator) -> Numbers:
        array = m[name].copy()
        array[k] = value
        return m | {name: array}

    return corrupt


def one_short(m: Numbers, rng: np.random.Generator) -> Numbers:
    return m | {"a": m["a"][:-1]}


def goes_back(m: Numbers, rng: np.random.Generator) -> Numbers:
    s = m["s"].copy()
    k = int(rng.integers(1, len(s)))
    s[k] = s[k - 1] - 1e-9
    return m | {"s": s}


def stands_on_the_move(m: Numbers, rng: np.random.Generator) -> Numbers:
    k = int(rng.integers(1, len(m["s"]) - 1))
    return m | {name: np.insert(m[name], k, m[name][k]) for name in "svat"} | {"caps": ()}


def backwards(m: Numbers, rng: np.random.Generator) -> Numbers:
    k = int(rng.integers(1, len(m["v"]) - 1))
    return with_speed(m, k, -float(m["v"][k]))


def rolls_on(m: Numbers, rng: np.random.Generator) -> Numbers:
    return with_speed(m, len(m["v"]) - 1, 1e-9)


def another_acceleration(m: Numbers, rng: np.random.Generator) -> Numbers:
    a = m["a"].copy()
    k = int(rng.integers(len(a) - 1))
    a[k] += 1e-9 * max(m["v"][k], m["v"][k + 1]) ** 2 / (m["s"][k + 1] - m["s"][k])
    return m | {"a": a}


def one_edge_late(m: Numbers, rng: np.random.Generator) -> Numbers:
    t = m["t"].copy()
    k = int(rng.integers(1, len(t)))
    t[k:] += 1e-9 * t[-1]
    return m | {"t": t}


def all_a_little_early(m: Numbers, rng: np.random.Generator) -> Numbers:
    return m | {"t": m["t"] * (1 - 1e-10)}


def clock_stalls(m: Numbers, rng: np.random.Generator) -> Numbers:
    t = m["t"].copy()
    k = int(rng.integers(1, len(t)))
    t[k] = t[k - 1]
    return m | {"t": t}


CORRUPTIONS: list[tuple[Corruption, str]] = [
    (one_short, "nodes"),
    (_set("v", 1, math.nan), "nodes"),
    (_set("t", 2, math.inf), "nodes"),
    (goes_back, "s"),
    (stands_on_the_move, "s"),
    (backwards, "speed"),
    (rolls_on, "goal"),
    (_set("a", -1, 1e-300), "a"),
    (another_acceleration, "a"),
    (one_edge_late, "time"),
    (all_a_little_early, "time"),
    (clock_stalls, "time"),
    (_set("t", 0, -1e-300), "time"),
]


@pytest.mark.parametrize(("corrupt", "rule"), CORRUPTIONS, ids=lambda c: getattr(c, "__name__", ""))
def test_every_corruption_is_caught_by_its_rule(corrupt: Corruption, rule: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(60):
        m = motion(rng)
        m |= {"a_max": 2 * m["a_max"], "d_max": 2 * m["d_max"]}
        assert judge(m) is None
        assert judge(corrupt(m, rng)) == rule


def test_a_short_edge_among_long_ones_takes_its_time_too() -> None:
    """A node told 2.5e-13 of the clock too late: of the short edge that is 5e-10."""
    s, v = np.array([0.0, 50.0, 50.0 + 0.1, 100.0]), np.array([0.0, 10.0, 10.0, 0.0])
    ds = np.diff(s)
    t = np.concatenate(([0.0], np.cumsum(2 * ds / (v[:-1] + v[1:]))))
    m = {"s": s, "v": v, "a": np.array([1.0, 0.0, -50.0 / ds[2], 0.0]), "t": t}
    m |= {"a_max": 1.0, "d_max": 1.1, "v_max": 10.0}
    assert judge(m) is None
    assert judge(m | {"t": t + np.array([0.0, 0.0, 5e-12, 5e-12])}) == "time"


def test_the_start_is_the_speed_the_robot_has() -> None:
    m = motion(np.random.default_rng(4)) | {"caps": ()}
    assert judge(m, v0=1e-3) == "start"
    assert judge(with_speed(m, 0, 1e-3), v0=1e-3, a_max=1e9, d_max=1e9) is None
    assert judge(with_speed(m, 0, 1e-3), v0=None, a_max=1e9, d_max=1e9) is None
    assert judge(with_speed(m, 0, 1e-3), v0=1.1e-3) == "start"


def test_a_wait_is_two_nodes_at_one_distance_at_rest() -> None:
    m = {
        "s": [0.0, 1.0, 2.0, 2.0, 3.0, 4.0],
        "v": [0.0, 1.0, 0.0, 0.0, 1.0, 0.0],
        "a": [0.5, -0.5, 0.0, 0.5, -0.5, 0.0],
        "t": [0.0, 2.0, 4.0, 7.25, 9.25, 11.25],
        "a_max": 0.5,
        "d_max": 0.5,
        "v_max": 1.0,
    }
    assert judge(m, jerk_max=0.5) is None
    assert judge(m, jerk_max=0.49) == "jerk"
    assert judge(m | {"a": [0.5, -0.5, 0.1, 0.5, -0.5, 0.0]}) == "s"
    assert judge(m | {"t": [0.0, 2.0, 4.0, 4.0, 6.0, 8.0]}) == "time"


def test_an_edge_from_rest_to_rest_takes_what_it_must() -> None:
    for cap, least in ((math.inf, 2 * math.sqrt(2.0)), (0.5, 3.0)):
        assert rest_to_rest(1.0, 0.5, 0.5, min(cap, 9.0)) == pytest.approx(least)
        m = {"s": [0.0, 1.0], "v": [0.0, 0.0], "a": [0.0, 0.0], "a_max": 0.5, "d_max": 0.5, "v_max": 9.0}
        m["caps"] = (("bend", np.array([cap, 9.0])),)
        assert judge(m | {"t": [0.0, least * (1 + 1e-12)]}) is None
        assert judge(m | {"t": [0.0, least * 3]}) is None
        assert judge(m | {"t": [0.0, least * (1 - 1e-9)]}) == "time"
        assert judge(m | {"t": [0.0, least * (1 + 1e-12)]}, jerk_max=0.1) == "time"
        assert judge(m | {"a": [0.1, 0.0], "t": [0.0, least]}) == "a"


def test_a_single_node_stands() -> None:
    one = {"s": [0.0], "v": [0.0], "a": [0.0], "t": [0.0], "a_max": 1.0, "d_max": 1.0, "v_max": 1.0}
    assert judge(one) is None
    assert judge(one, jerk_max=1.0) is None
    assert judge(one | {"v": [0.1]}) == "goal"
    assert judge(one, v0=0.5) == "start"
