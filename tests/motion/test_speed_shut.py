"""Ways that cannot be driven at all, no caps at all, and words that are none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SettingError, UsageError
from lampyris.motion.profile import feasible_profile, stop_to_stop


@pytest.mark.parametrize(
    ("cap", "stops", "node"),
    [
        ([1.0, 0.0, 0.0], [1], 2),
        ([0.0, 0.0, 1.0], [1], 1),
        ([1.0, 1.0, 0.0, 0.0, 1.0], [2, 3], 3),
        ([0.0, 0.0], [], 1),
    ],
)
def test_an_edge_where_nothing_may_move_at_either_node_is_refused(
    cap: list[float], stops: list[int], node: int
) -> None:
    n = len(cap)
    stop = np.isin(np.arange(n), stops)
    given = {"a_max": 1.0, "d_max": 1.0, "stop": stop}
    for more in ({}, {"v0": 0.1}, {"v0": 0.1, "on_infeasible": "brake"}, {"jerk_max": 1.0}):
        with pytest.raises(
            SettingError, match=rf"PROFILE_BLOCKED.*at node {node}, .*0 m/s for the cause limit"
        ):
            feasible_profile(np.arange(float(n)), [("limit", np.array(cap))], **given, **more)
    above = np.where(np.arange(n) == node, 0.5, cap)
    made = feasible_profile(np.arange(float(n)), [("limit", above)], **given)
    assert np.isfinite(made.t).all()
    assert (np.diff(made.t) > 0.0).all()


def test_without_caps_acceleration_and_braking_are_the_only_limits() -> None:
    s = np.array([0.0, 2.0, 3.0])
    made = feasible_profile(s, [], a_max=1.0, d_max=2.0)
    np.testing.assert_allclose(made.v, [0.0, 2.0, 0.0], rtol=1e-15)
    assert made.cause == ("start", "acceleration", "goal")
    made = feasible_profile(s[:2], (), a_max=0.5, d_max=1.0)
    assert made.t[1] == pytest.approx(stop_to_stop(2.0, 0.5, 1.0, math.inf)[1])
    assert feasible_profile(s[:1], [], a_max=1.0, d_max=1.0).v.tolist() == [0.0]


@pytest.mark.parametrize("word", ["Brake", "", None, True, "clip"])
def test_what_to_do_with_an_infeasible_start_is_one_of_two_words(word: Any) -> None:
    s, caps = np.arange(3.0), [("limit", np.ones(3))]
    with pytest.raises(UsageError, match=r"ON_INFEASIBLE.*raise or brake"):
        feasible_profile(s, caps, a_max=1.0, d_max=1.0, on_infeasible=word)
