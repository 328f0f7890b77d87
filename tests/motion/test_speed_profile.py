"""The minimum of caps made feasible: limits at and between nodes, exact times, causes, monotony, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.motion.profile import Feasible, feasible_profile, lowest, stop_to_stop
from lampyris_selfcheck.reference.motion import speed_laws

Case = tuple[np.ndarray, list[tuple[str, np.ndarray]], dict[str, float]]  # type: ignore[type-arg]


def random_case(rng: np.random.Generator, n: int | None = None) -> Case:
    """Distances, caps and limits over many sizes; some caps bind nowhere, some everywhere."""
    n = int(rng.integers(2, 40)) if n is None else n
    scale = 10.0 ** rng.uniform(-4, 4)
    ds = scale * 10.0 ** rng.uniform(-2, 1, n - 1)
    s = np.concatenate(([0.0], np.cumsum(ds)))
    a, d = (float(x) for x in 10.0 ** rng.uniform(-2, 2, 2))
    # Top speeds about what the way allows, so that caps, accelerating and braking all get their turn.
    top = float(math.sqrt(2 * a * s[-1]) * 10.0 ** rng.uniform(-1, 0.5))
    caps = [
        ("limit", np.full(n, top)),
        ("clearance", top * rng.uniform(0.05, 3.0, n)),
        ("obstacle", np.where(rng.random(n) < 0.2, top * rng.uniform(0.05, 1.0, n), np.inf)),
    ]
    return s, caps, {"a_max": a, "d_max": d}


def bound(caps: list[tuple[str, Any]]) -> np.ndarray:  # type: ignore[type-arg]
    return np.min([c for _, c in caps], axis=0)


def assert_drivable(made: Feasible, s: Any, a_max: float, d_max: float, top: Any) -> None:
    """Caps at nodes, accelerations on edges, speeds within edges, and a clock that only goes forward."""
    ds = np.diff(s)
    assert (made.v[1:-1] > 0).all()
    assert (made.v <= top * (1 + 1e-12)).all()
    x = made.v**2
    assert (np.diff(x) <= 2 * a_max * ds + 1e-12 * x[1:]).all()
    assert (-np.diff(x) <= 2 * d_max * ds + 1e-12 * x[:-1]).all()
    for share in (0.1, 0.5, 0.9):
        within = np.sqrt(np.maximum(x[:-1] + 2 * made.a[:-1] * share * ds, 0.0))
        assert (within <= np.maximum(made.v[1:], made.v[:-1]) * (1 + 1e-12)).all()
    assert made.t[0] == 0.0
    assert (np.diff(made.t) > 0).all()
    assert made.a[-1] == 0.0


def test_equals_the_closed_form_and_keeps_every_limit() -> None:
    rng = np.random.default_rng(1)
    for _ in range(400):
        s, caps, limits = random_case(rng)
        made = feasible_profile(s, caps, **limits)
        assert made.v[0] == made.v[-1] == 0.0
        ends = bound(caps)
        ends[[0, -1]] = 0.0
        ds = np.diff(s)
        want = speed_laws.under_slopes(
            (ends**2).tolist(), (2 * limits["a_max"] * ds).tolist(), (2 * limits["d_max"] * ds).tolist()
        )
        np.testing.assert_allclose(made.v, np.sqrt(want), rtol=1e-11)
        if len(s) > 2:
            assert_drivable(made, s, limits["a_max"], limits["d_max"], bound(caps))


def test_causes_say_what_binds() -> None:
    rng = np.random.default_rng(2)
    seen = set()
    for _ in range(300):
        s, caps, limits = random_case(rng)
        made = feasible_profile(s, caps, **limits)
        assert (made.cause[0], made.cause[-1]) == ("start", "goal")
        named = dict(caps)
        x, ds = made.v**2, np.diff(s)
        for i in range(1, len(s) - 1):
            why = made.cause[i]
            seen.add(why)
            if why == "acceleration":
                assert x[i] == pytest.approx(x[i - 1] + 2 * limits["a_max"] * ds[i - 1], rel=1e-12)
                assert made.a[i - 1] == pytest.approx(limits["a_max"], rel=1e-9)
            elif why == "braking":
                assert x[i] == pytest.approx(x[i + 1] + 2 * limits["d_max"] * ds[i], rel=1e-12)
                assert made.a[i] == pytest.approx(-limits["d_max"], rel=1e-9)
            else:
                assert made.v[i] == named[why][i] == bound(caps)[i]
    assert seen == {"limit", "clearance", "obstacle", "acceleration", "braking"}


def test_ties_go_to_the_cap_named_first_and_acceleration_comes_after_limit_only() -> None:
    one = np.ones(3)
    assert lowest([("limit", one), ("clearance", one)]).words == ("limit",) * 3
    # 1 m/s is reached exactly after 1 m at 0.5 m/s2.
    s = np.array([0.0, 1.0, 9.0])
    made = feasible_profile(s, [("limit", one), ("clearance", one)], a_max=0.5, d_max=1.0)
    assert made.cause == ("start", "limit", "goal")
    made = feasible_profile(s, [("limit", 2 * one), ("clearance", one)], a_max=0.5, d_max=1.0)
    assert made.cause == ("start", "acceleration", "goal")
    # and is left exactly for 0 in 0.5 m at 1 m/s2: the cap stays the cause.
    s = np.array([0.0, 8.0, 8.5])
    made = feasible_profile(s, [("limit", 2 * one), ("clearance", one)], a_max=0.5, d_max=1.0)
    assert made.cause == ("start", "clearance", "goal")


def test_a_worked_example() -> None:
    s = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    made = feasible_profile(s, [("limit", np.full(5, 1.2))], a_max=0.5, d_max=0.5)
    assert made.v.tolist() == [0.0, 1.0, 1.2, 1.0, 0.0]
    np.testing.assert_allclose(made.a, [0.5, 0.22, -0.22, -0.5, 0.0], rtol=1e-14)
    np.testing.assert_allclose(made.t, [0, 2, 2 + 2 / 2.2, 2 + 4 / 2.2, 4 + 4 / 2.2], rtol=1e-15)
    assert made.cause == ("start", "acceleration", "limit", "braking", "goal")


def test_reversing_the_path_with_swapped_limits_reverses_the_profile() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        s, caps, limits = random_case(rng)
        there = feasible_profile(s, caps, **limits)
        back = feasible_profile(
            s[-1] - s[::-1],
            [(name, values[::-1]) for name, values in caps],
            a_max=limits["d_max"],
            d_max=limits["a_max"],
        )
        np.testing.assert_allclose(back.v[::-1], there.v, rtol=1e-9)
        assert back.t[-1] == pytest.approx(there.t[-1], rel=1e-9)


def test_raising_a_limit_never_lowers_a_speed_nor_lengthens_the_time() -> None:
    rng = np.random.default_rng(4)
    for _ in range(400):
        s, caps, limits = random_case(rng)
        before = feasible_profile(s, caps, **limits)
        more = dict(limits)
        which = rng.integers(3)
        if which < 2:
            more[("a_max", "d_max")[which]] *= rng.uniform(1, 3)
        else:
            k = rng.integers(len(caps))
            caps = [(c, v * (rng.uniform(1, 2, len(v)) if i == k else 1)) for i, (c, v) in enumerate(caps)]
        after = feasible_profile(s, caps, **more)
        assert (after.v >= before.v * (1 - 1e-15)).all()
        assert after.t[-1] <= before.t[-1] * (1 + 1e-14)


def test_another_cap_never_raises_a_speed_whatever_happens_to_the_start() -> None:
    rng = np.random.default_rng(5)
    for _ in range(300):
        s, caps, limits = random_case(rng)
        v0 = float(bound(caps)[0] * rng.uniform(0, 2))
        new = ("obstacle", bound(caps) * rng.uniform(0.01, 1.5, len(s)))
        before = feasible_profile(s, caps, **limits, v0=v0, on_infeasible="brake")
        after = feasible_profile(s, [*caps, new], **limits, v0=v0, on_infeasible="brake")
        assert (after.v <= before.v * (1 + 1e-15)).all()
        assert after.t[-1] >= before.t[-1] * (1 - 1e-14)


def test_one_node_stands_still() -> None:
    made = feasible_profile(np.array([3.0]), [("limit", np.ones(1))], a_max=1.0, d_max=1.0)
    assert [made.v.tolist(), made.a.tolist(), made.t.tolist()] == [[0.0]] * 3
    assert (made.cause, made.cause_index.tolist()) == (("start",), [-1])
    with pytest.raises(SettingError, match="PROFILE_INFEASIBLE"):
        feasible_profile(np.array([3.0]), [("limit", np.ones(1))], a_max=1.0, d_max=1.0, v0=0.5)


@pytest.mark.parametrize("cap", [0.3, 0.8164965809277259, 0.8164965809277261, 1.0, 5.0])
def test_two_nodes_are_driven_from_rest_to_rest(cap: float) -> None:
    caps = [("limit", np.array([5.0, 5.0])), ("clearance", np.array([cap, 6.0]))]
    made = feasible_profile(np.array([2.0, 3.0]), caps, a_max=0.5, d_max=1.0)
    assert (made.v.tolist(), made.a.tolist()) == ([0.0, 0.0], [0.0, 0.0])
    assert made.cause == ("start", "goal")
    peak, time = stop_to_stop(1.0, 0.5, 1.0, min(cap, 5.0))
    assert made.t.tolist() == [0.0, time]
    assert peak == pytest.approx(min(cap, math.sqrt(2 * 0.5 * 1.0 / 1.5)), rel=1e-15)
    assert time == pytest.approx(speed_laws.time_by_small_steps(1.0, 0.5, 1.0, cap), rel=2e-3)


def test_stop_to_stop_covers_the_distance_within_its_limits() -> None:
    rng = np.random.default_rng(6)
    for _ in range(500):
        ds, a, d, cap = (float(v) for v in 10.0 ** rng.uniform(-6, 6, 4))
        peak, time = stop_to_stop(ds, a, d, cap)
        assert peak <= cap
        ramps = peak * peak / (2 * a) + peak * peak / (2 * d)
        assert ramps <= ds * (1 + 1e-12)
        assert time == pytest.approx(peak / a + peak / d + max(0.0, ds - ramps) / peak, rel=1e-9)
        # Averaged over the way, no quicker than the peak; and at least half of it, as ramps average half.
        assert peak / 2 <= ds / time * (1 + 1e-12) <= peak * (1 + 2e-12)


def test_extreme_sizes_keep_the_limits() -> None:
    rng = np.random.default_rng(7)
    for _ in range(300):
        n = int(rng.integers(2, 6))
        s = np.concatenate(([0.0], np.cumsum(10.0 ** rng.uniform(-9, 6, n - 1))))
        if not (np.diff(s) > 0).all():
            continue
        a, d, top = (float(v) for v in 10.0 ** rng.uniform(-6, 6, 3))
        made = feasible_profile(s, [("limit", np.full(n, top))], a_max=a, d_max=d)
        assert made.v[-1] == 0.0
        if n > 2:
            assert_drivable(made, s, a, d, top)


def fastest_start(s: Any, caps: Any, d_max: float) -> float:
    ends = bound(caps)
    ends[-1] = 0.0
    return math.sqrt(min(float(c) ** 2 + 2 * d_max * float(x) for c, x in zip(ends, s - s[0], strict=True)))


def test_a_start_at_the_exact_limit_is_driven_and_beyond_it_refused_with_both_distances() -> None:
    rng = np.random.default_rng(8)
    for _ in range(300):
        s, caps, limits = random_case(rng)
        limit = fastest_start(s, caps, limits["d_max"])
        for v0 in (limit * rng.uniform(0, 1), limit, math.nextafter(limit, math.inf)):
            made = feasible_profile(s, caps, **limits, v0=v0)
            assert (made.v[0], made.v[-1], made.cause[0]) == (v0, 0.0, "start")
            assert (made.v <= bound(caps) * (1 + 1e-12)).all()
            if len(s) > 2:
                assert_drivable(made, s, limits["a_max"], limits["d_max"], bound(caps))
        with pytest.raises(SettingError) as raised:
            feasible_profile(s, caps, **limits, v0=limit * (1 + 1e-9))
        assert raised.value.code == "PROFILE_INFEASIBLE"


def test_the_refusal_names_needed_and_available_distance() -> None:
    caps = [("limit", np.full(4, 3.0)), ("obstacle", np.array([3.0, 3.0, 1.0, 3.0]))]
    with pytest.raises(SettingError) as raised:
        feasible_profile(np.array([0.0, 0.5, 1.0, 9.0]), caps, a_max=1.0, d_max=1.0, v0=2.0)
    told = str(raised.value)
    assert "1 m/s at node 2 (obstacle)" in told
    assert "needs 1.5 m and 1 m are there" in told
    assert f"at most {math.sqrt(3.0)!r} m/s" in told


def test_braking_hard_is_the_same_profile_where_the_start_is_feasible() -> None:
    rng = np.random.default_rng(9)
    for _ in range(200):
        s, caps, limits = random_case(rng)
        v0 = fastest_start(s, caps, limits["d_max"]) * rng.uniform(0, 1)
        plan = feasible_profile(s, caps, **limits, v0=v0)
        drive = feasible_profile(s, caps, **limits, v0=v0, on_infeasible="brake")
        assert (plan.v.tolist(), plan.t.tolist(), plan.cause) == (
            drive.v.tolist(),
            drive.t.tolist(),
            drive.cause,
        )


def test_braking_hard_exceeds_a_cap_only_while_it_brakes_fully() -> None:
    rng = np.random.default_rng(10)
    overrun = 0
    for _ in range(300):
        s, caps, limits = random_case(rng, n=int(rng.integers(3, 20)))
        v0 = fastest_start(s, caps, limits["d_max"]) * rng.uniform(1.01, 2)
        made = feasible_profile(s, caps, **limits, v0=v0, on_infeasible="brake")
        assert (made.v[0], made.cause[0]) == (v0, "start")
        ends = bound(caps)
        ends[-1] = 0.0
        free = np.sqrt(np.maximum(v0 * v0 - 2 * limits["d_max"] * (s - s[0]), 0.0))
        assert (made.v <= np.maximum(ends, free) * (1 + 1e-9)).all()
        assert (made.v >= free * (1 - 1e-9) - 1e-7 * v0).all()
        x = made.v**2
        assert (-np.diff(x) <= 2 * limits["d_max"] * np.diff(s) + 1e-12 * v0 * v0).all()
        for i in np.flatnonzero(made.v > ends * (1 + 1e-9)).tolist():
            assert made.cause[i] == ("braking" if i else "start")
        overrun += made.v[-1] > 0
    assert overrun > 10  # a way too short to stop on is told, not hidden


@pytest.mark.nightly
def test_a_tail_driven_on_from_its_own_speed_is_the_tail() -> None:
    rng = np.random.default_rng(11)
    for _ in range(100):
        s, caps, limits = random_case(rng)
        whole = feasible_profile(s, caps, **limits)
        for k in range(1, len(s) - 1):
            cut = [(name, values[k:]) for name, values in caps]
            tail = feasible_profile(s[k:], cut, **limits, v0=float(whole.v[k]))
            np.testing.assert_allclose(tail.v, whole.v[k:], rtol=1e-12)
            np.testing.assert_allclose(tail.t, whole.t[k:] - whole.t[k], rtol=1e-9, atol=1e-9 * whole.t[-1])


@pytest.mark.parametrize("v0", [-1.0, math.nan, math.inf, True, "1", None, 1e-200, 1e200])
def test_start_speed_must_be_a_speed(v0: Any) -> None:
    with pytest.raises(SettingError, match="START_SPEED"):
        feasible_profile(np.array([0.0, 1.0]), [("limit", np.ones(2))], a_max=1.0, d_max=1.0, v0=v0)


@pytest.mark.parametrize("s", [[], [0.0, 0.0], [0.0, 1.0, 0.5], [0.0, math.nan]])
def test_distances_must_rise(s: list[float]) -> None:
    with pytest.raises(SettingError, match="PROFILE_SPACING"):
        feasible_profile(np.array(s), [("limit", np.ones(len(s)))], a_max=1.0, d_max=1.0)


@pytest.mark.parametrize(
    ("a", "d", "cap"),
    [(0.0, 1.0, 1.0), (1.0, 1e-200, 1.0), (1e200, 1.0, 1.0), (1.0, 1.0, -1.0), (1.0, 1.0, math.nan)],
)
def test_limits_must_be_positive_and_within_reach_of_a_double(a: float, d: float, cap: float) -> None:
    with pytest.raises(SettingError, match="PROFILE_LIMIT"):
        feasible_profile(np.array([0.0, 1.0]), [("limit", np.full(2, cap))], a_max=a, d_max=d)
