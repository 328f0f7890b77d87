"""Feasible profiles at large: turned, scaled and split; causes, stops and the clock.

That they keep every limit and are the greatest that do: the check ``profile``.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.kernels.motion.speed_passes import clock
from lampyris.motion.cap_values import Cap
from lampyris.motion.profile import feasible_profile, stop_to_stop
from lampyris.referee import check_motion
from lampyris_selfcheck.checks.speed.profile_cases import ProfileCase, extreme, middling
from reference.kernel_forms import use


def test_braking_names_the_node_it_brakes_for() -> None:
    rng = np.random.default_rng(4)
    chains = 0
    for _ in range(400):
        case = middling(rng)
        made = case.made()
        for i, cause in enumerate(made.cause):
            k = int(made.cause_index[i])
            if cause != "braking":
                assert k == -1
                continue
            assert k > i
            assert made.cause[k] != "braking"
            assert all(c == "braking" for c in made.cause[i:k])
            assert made.v[i] ** 2 == pytest.approx(made.v[k] ** 2 + 2 * case.d * (case.s[k] - case.s[i]))
            chains += k > i + 1
    assert chains > 50


def test_what_a_cap_speaks_of_stays_with_its_nodes() -> None:
    s = np.arange(6.0)
    caps = [
        Cap("limit", np.full(6, 9.0)),
        Cap("moving obstacle", np.array([9.0, 9.0, 0.5, 9.0, 0.25, 9.0]), np.array([7, 7, 3, 7, 5, 7])),
        ("clearance", np.array([9.0, 9.0, 9.0, 0.3, 9.0, 9.0])),
    ]
    made = feasible_profile(s, caps, a_max=1.0, d_max=0.1)
    assert made.cause == ("start", "braking", "moving obstacle", "clearance", "moving obstacle", "goal")
    assert made.cause_index.tolist() == [-1, 2, 3, -1, 5, -1]


def test_hard_braking_names_what_it_brakes_for() -> None:
    s = np.arange(6.0)
    caps = [("limit", np.full(6, 9.0)), ("obstacle", np.array([9.0, 9.0, 0.5, 9.0, 9.0, 9.0]))]
    made = feasible_profile(s, caps, a_max=1.0, d_max=1.0, v0=3.0, on_infeasible="brake")
    assert made.cause == ("start", "braking", "braking", "braking", "braking", "goal")
    assert made.cause_index.tolist() == [-1, 5, 5, 5, 5, -1]
    made = feasible_profile(s, caps, a_max=1.0, d_max=1.0, v0=5.0, on_infeasible="brake")
    assert made.v[-1] == pytest.approx(math.sqrt(15.0))  # told, not hidden
    assert (made.cause[-1], made.cause_index.tolist()) == ("braking", [-1] * 6)


# ---- stops, blocked ways, edges at rest ----


def test_a_profile_with_a_stop_is_two_profiles() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        case = extreme(rng, n=int(rng.integers(3, 20)))
        k = int(rng.integers(1, len(case.s) - 1))
        stop = np.arange(len(case.s)) == k
        whole = case.made(stop=stop)
        assert (whole.v[k], whole.cause[k]) == (0.0, "turn")
        parts = []
        for piece in (slice(None, k + 1), slice(k, None)):
            caps = [(name, v[piece]) for name, v in case.caps]
            parts.append(feasible_profile(case.s[piece], caps, a_max=case.a, d_max=case.d))
        first, second = parts
        np.testing.assert_array_equal(whole.v, np.append(first.v, second.v[1:]))
        np.testing.assert_array_equal(whole.a, np.append(first.a[:-1], second.a))
        assert whole.cause == (*first.cause[:-1], "turn", *second.cause[1:])
        np.testing.assert_allclose(whole.t[k:], first.t[-1] + second.t, rtol=1e-15 * len(case.s))


def test_neighbouring_stops_are_driven_from_rest_to_rest() -> None:
    s = np.array([0.0, 1.0, 3.0, 3.5])
    caps = [("limit", np.full(4, 2.0)), ("clearance", np.array([9.0, 0.7, 0.5, 9.0]))]
    stop = np.array([False, True, True, False])
    made = feasible_profile(s, caps, a_max=1.0, d_max=0.5, stop=stop)
    assert made.v.tolist() == made.a.tolist() == [0.0] * 4
    assert made.cause == ("start", "turn", "turn", "goal")
    times = [stop_to_stop(length, 1.0, 0.5, cap)[1] for length, cap in ((1.0, 0.7), (2.0, 0.5), (0.5, 0.5))]
    np.testing.assert_allclose(made.t, [0.0, *np.cumsum(times)], rtol=1e-15)
    more = {"a_max": 1.0, "d_max": 0.5, "v_max": 2.0, "caps": caps}
    assert check_motion(s, made.v, made.a, made.t, **more) is None


@pytest.mark.parametrize(("k", "of"), [(1, -1), (3, 4)])
def test_a_cap_of_zero_on_the_way_is_refused_with_cause_and_place(k: int, of: int) -> None:
    s = np.arange(5.0) * 2
    cause_index = np.full(5, of)
    shut = Cap("moving obstacle", np.where(np.arange(5) == k, 0.0, np.inf), cause_index)
    with pytest.raises(SettingError) as raised:
        feasible_profile(s, [("limit", np.ones(5)), shut], a_max=1.0, d_max=1.0)
    told = str(raised.value)
    assert raised.value.code == "PROFILE_BLOCKED"
    assert f"node {k}, {2 * k} m from the start" in told
    assert ("moving obstacle 4" if of == 4 else "moving obstacle;") in told
    # Where the robot stands anyway it may be so: at both ends and where it turns.
    stop = np.arange(5) == k
    made = feasible_profile(s, [("limit", np.ones(5)), shut], a_max=1.0, d_max=1.0, stop=stop)
    assert made.cause[k] == "turn"
    ends = Cap("no data", np.where(np.arange(5) % 4 == 0, 0.0, np.inf))
    made = feasible_profile(s, [("limit", np.ones(5)), ends], a_max=1.0, d_max=1.0)
    assert (made.cause[0], made.cause[-1]) == ("start", "goal")
    with pytest.raises(SettingError, match=r"PROFILE_INFEASIBLE.*no data.*at most 0\.0 m/s"):
        feasible_profile(s, [("limit", np.ones(5)), ends], a_max=1.0, d_max=1.0, v0=0.1)


def test_two_nodes_with_a_cap_of_zero_at_one_of_them() -> None:
    s = np.array([0.0, 2.0])
    # v^2 below a straight line between 0 and 0.25 over 2 m: a ramp of 1/16 m/s2 at that end.
    for k, a, d in ((0, 1 / 16, 0.02), (1, 0.02, 1 / 16)):
        cap = np.where(np.arange(2) == k, 0.0, 0.5)
        made = feasible_profile(s, [("clearance", cap)], a_max=9.0 if k == 0 else a, d_max=9.0 if k else d)
        assert made.t[1] == pytest.approx(stop_to_stop(2.0, a, d, 0.5)[1])
    with pytest.raises(SettingError, match="PROFILE_BLOCKED"):
        feasible_profile(s, [("clearance", np.zeros(2))], a_max=9.0, d_max=9.0)


def test_the_start_may_be_a_stop_only_for_a_robot_at_rest() -> None:
    s, caps = np.arange(3.0), [("limit", np.ones(3))]
    stop = np.array([True, False, True])
    made = feasible_profile(s, caps, a_max=1.0, d_max=1.0, stop=stop)
    assert made.cause == ("start", "limit", "goal")
    with pytest.raises(SettingError, match=r"node 0 \(turn\).*at most 0\.0 m/s"):
        feasible_profile(s, caps, a_max=1.0, d_max=1.0, stop=stop, v0=0.5)


def test_caps_and_stops_must_be_one_a_node() -> None:
    s = np.arange(3.0)
    for bad in ({"caps": [("limit", np.ones(2))]}, {"stop": np.zeros(4, dtype=np.bool_)}):
        given = {"caps": [("limit", np.ones(3))]} | bad
        with pytest.raises(SettingError, match="PROFILE_LIMIT"):
            feasible_profile(s, given.pop("caps"), a_max=1.0, d_max=1.0, **given)


# ---- the same motion seen in other ways ----


def dyadic_case(rng: np.random.Generator) -> ProfileCase:
    """Distances in 1/1024 m, so that they are exact from either end."""
    case = middling(rng)
    s = np.concatenate(([0.0], np.cumsum(rng.integers(1, 5000, len(case.s) - 1) / 1024.0)))
    return case._replace(s=s)


def test_reversed_it_is_the_very_same_profile() -> None:
    rng = np.random.default_rng(6)
    for _ in range(300):
        case = dyadic_case(rng)
        there = case.made()
        turned = ProfileCase(
            case.s[-1] - case.s[::-1],
            [(name, v[::-1].copy()) for name, v in case.caps],
            case.d,
            case.a,
            case.stop[::-1].copy(),
        )
        back = turned.made()
        assert back.v[::-1].tolist() == there.v.tolist()
        assert (-back.a[-2::-1]).tolist() == there.a[:-1].tolist()
        assert back.t[-1] == pytest.approx(there.t[-1], rel=1e-14)


def test_other_units_give_the_same_bits() -> None:
    rng = np.random.default_rng(7)
    for _ in range(200):
        case = extreme(rng)
        metre, second = 2.0 ** int(rng.integers(-20, 20)), 2.0 ** int(rng.integers(-20, 20))
        speed, rate = metre / second, metre / second**2
        scaled = ProfileCase(
            case.s * metre, [(c, v * speed) for c, v in case.caps], case.a * rate, case.d * rate, case.stop
        )
        one, two = case.made(), scaled.made()
        assert (one.v * speed).tolist() == two.v.tolist()
        assert (one.a * rate).tolist() == two.a.tolist()
        if np.diff(one.v).any():  # stop_to_stop adds up a time of several parts
            np.testing.assert_allclose(one.t * second, two.t, rtol=1e-15)
        assert (one.cause, one.cause_index.tolist()) == (two.cause, two.cause_index.tolist())


def test_a_node_more_on_an_edge_changes_nothing_where_its_cap_is_between_and_helps_where_it_has_none() -> (
    None
):
    rng = np.random.default_rng(8)
    for _ in range(300):
        case = middling(rng)
        before = case.made()
        k, share = int(rng.integers(1, len(case.s))), float(rng.uniform(0.05, 0.95))
        s = np.insert(case.s, k, case.s[k - 1] + share * (case.s[k] - case.s[k - 1]))
        here = (s[k] - s[k - 1]) / (s[k + 1] - s[k - 1])
        stop = np.insert(case.stop, k, False)
        between = math.sqrt(before.v[k - 1] ** 2 * (1 - here) + before.v[k] ** 2 * here)
        for cap in (between, np.inf) if between else ():  # from rest to rest, an edge is driven better whole
            caps = [(name, np.insert(v, k, cap)) for name, v in case.caps]
            after = ProfileCase(s, caps, case.a, case.d, stop).made()
            np.testing.assert_allclose(np.delete(after.v, k), before.v, rtol=1e-12)
            if cap < np.inf:
                assert after.v[k] == pytest.approx(between, rel=1e-12)
                assert after.t[-1] == pytest.approx(before.t[-1], rel=1e-12)
            assert after.t[-1] <= before.t[-1] * (1 + 1e-12)


# ---- the clock and the kernel's two forms ----


def test_the_clock_is_the_true_sum_and_never_stalls() -> None:
    rng = np.random.default_rng(10)
    for _ in range(300):
        dt = 10.0 ** rng.uniform(-12, 12, int(rng.integers(1, 40)))
        t = np.empty(len(dt) + 1)
        clock(dt, t)
        want = [float(math.fsum(dt[:k])) for k in range(len(t))]
        stalled = np.concatenate(([0], np.cumsum(dt < 1e-15 * np.array(want[1:]))))
        assert (np.abs(t - want) <= 2.0**-52 * np.array(want) * (1 + 2 * stalled)).all()
        assert (np.diff(t) > 0).all()
    t = np.empty(4)
    clock(np.array([1.0, 2.0**53, 5.0]), t)
    assert t[-1] == 2.0**53 + 6.0  # neither of the two odd ones is lost
    t = np.empty(1002)
    clock(np.array([1e6, *[1e-12] * 1000]), t)
    assert (np.diff(t) > 0).all()
    assert t[-1] - 1e6 <= 1000 * 2 * math.ulp(1e6)


def test_both_forms_of_the_kernels_give_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    results = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        rng = np.random.default_rng(11)
        results[form] = []
        for _ in range(150):
            made = extreme(rng).made(v0=float(rng.uniform(0, 5)), on_infeasible="brake")
            results[form].append(
                (made.v.tobytes(), made.a.tobytes(), made.t.tobytes(), made.cause, made.cause_index.tobytes())
            )
    assert results["plain"] == results["compiled"]
