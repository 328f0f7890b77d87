"""Polynomial chaos of plain functions: Ishigami's, exact rules, Monte Carlo where nothing is smooth."""

from __future__ import annotations

import math
from operator import itemgetter
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.uncertainty import Normal, Uniform, expand
from lampyris.uncertainty.bases import (
    HERMITE_POINTS,
    PATTERSON_LEVELS,
    hermite,
    legendre,
    normal_rule,
    uniform_rule,
)
from lampyris.uncertainty.expansion import MOST_INPUTS, MOST_WORKERS
from lampyris.uncertainty.inputs import parse_input

ANGLE = Uniform(-math.pi, math.pi)


def ishigami(x: dict[str, float]) -> float:
    return math.sin(x["x1"]) + 7.0 * math.sin(x["x2"]) ** 2 + 0.1 * x["x3"] ** 4 * math.sin(x["x1"])


def test_ishigami_within_one_percent_in_250_runs() -> None:
    calls = []

    def counted(x: dict[str, float]) -> float:
        calls.append(x)
        return ishigami(x)

    made = expand(counted, dict.fromkeys(("x1", "x2", "x3"), ANGLE))
    assert made.method == "polynomial-chaos"
    assert made.runs == len(calls) <= 250
    assert made.mean == pytest.approx(3.5, rel=0.01)
    assert made.variance == pytest.approx(13.8446, rel=0.01)
    assert made.sobol["x1"].first == pytest.approx(0.3139, rel=0.01)
    assert made.sobol["x2"].first == pytest.approx(0.4424, rel=0.01)
    assert made.sobol["x3"].total == pytest.approx(0.2437, rel=0.01)
    assert made.sobol["x3"].first == pytest.approx(0.0, abs=1e-12)
    draws = np.random.default_rng(1).uniform(-math.pi, math.pi, (100_000, 3)).T
    values = np.sin(draws[0]) + 7 * np.sin(draws[1]) ** 2 + 0.1 * draws[2] ** 4 * np.sin(draws[0])
    for share, value in made.quantiles.items():
        assert value == pytest.approx(float(np.quantile(values, share)), abs=0.15)


def test_monte_carlo_of_ishigami_agrees_within_its_standard_errors() -> None:
    inputs = dict.fromkeys(("x1", "x2", "x3"), ANGLE)
    made = expand(ishigami, inputs, method="monte-carlo", monte_carlo_runs=20_000)
    assert made.runs == 20_000
    assert made.method == "monte-carlo"
    assert made.held_out_error is None
    assert made.mean_error is not None
    assert made.sd_error is not None
    assert abs(made.mean - 3.5) < 4 * made.mean_error < 0.5
    assert abs(made.sd - 13.8446**0.5) < 4 * made.sd_error < 0.5
    for name, first, total in (("x1", 0.3139, 0.5576), ("x2", 0.4424, 0.4424), ("x3", 0.0, 0.2437)):
        one = made.sobol[name]
        assert one.first_error is not None
        assert one.total_error is not None
        assert abs(one.first - first) < 4 * one.first_error < 0.2
        assert abs(one.total - total) < 4 * one.total_error < 0.2


@pytest.mark.parametrize("names", ["a", "ab", "abc"])
def test_monte_carlo_shares_of_a_sum_are_within_their_standard_errors(names: str) -> None:
    """In a sum of squares with weights 1, 2, 3 nothing works together; a single input carries all, exactly."""
    calls = []

    def weighted(x: dict[str, float]) -> float:
        calls.append(x)
        return sum((k + 1) * x[name] ** 2 for k, name in enumerate(names))

    made = expand(
        weighted, dict.fromkeys(names, Uniform(0.0, 1.0)), method="monte-carlo", monte_carlo_runs=800, seed=4
    )
    assert made.runs == len(calls) == 800
    whole = sum((k + 1) ** 2 for k in range(len(names)))
    for k, name in enumerate(names):
        one, share = made.sobol[name], (k + 1) ** 2 / whole
        assert one.first_error is not None
        assert one.total_error is not None
        assert abs(one.first - share) <= 4 * one.first_error + 1e-12
        assert one.total == pytest.approx(one.first, abs=1e-9)
        assert (one.total_error < 1e-9) == (names == "a")
        assert one.total_error < 0.1


def moment(degree: int) -> float:
    """E z^degree of the uniform distribution on [-1, 1]."""
    return 0.0 if degree % 2 else 1.0 / (degree + 1)


@pytest.mark.parametrize("level", range(PATTERSON_LEVELS))
def test_rules_of_uniform_inputs_are_nested_and_exact(level: int) -> None:
    rule = uniform_rule(level)
    exact = 1 if level == 0 else (3 * len(rule.points) + 1) // 2
    for degree in range(exact + 1):
        assert float((rule.weights * rule.points**degree).sum()) == pytest.approx(moment(degree), abs=1e-12)
    assert rule.degree == exact // 2
    if level:
        assert set(uniform_rule(level - 1).points.tolist()) <= set(rule.points.tolist())
        assert (rule.weights > 0).all()
    gram = legendre(rule.points, rule.degree) @ (legendre(rule.points, rule.degree) * rule.weights).T
    if exact % 2:  # the square of the highest one is integrated exactly, too
        assert np.abs(gram - np.eye(rule.degree + 1)).max() < 1e-9


@pytest.mark.parametrize("level", range(len(HERMITE_POINTS)))
def test_rules_of_normal_inputs_are_those_of_gauss(level: int) -> None:
    rule = normal_rule(level)
    points, weights = np.polynomial.hermite_e.hermegauss(len(rule.points))
    assert rule.points == pytest.approx(points, abs=1e-11)
    assert rule.weights == pytest.approx(weights / math.sqrt(2 * math.pi), abs=1e-12)
    gram = hermite(rule.points, rule.degree) @ (hermite(rule.points, rule.degree) * rule.weights).T
    assert np.abs(gram - np.eye(rule.degree + 1)).max() < 1e-10


def test_a_polynomial_of_both_kinds_of_inputs_is_exact() -> None:
    made = expand(
        lambda x: x["a"] ** 3 + x["b"] * x["a"] + 5.0, {"a": Normal(1.0, 0.5), "b": Uniform(0.0, 2.0)}
    )
    # With a = 1 + s, E a^3 = 1 + 3 sd^2; b = 1 + t, Var t = 1/3.
    assert made.mean == pytest.approx(1 + 3 * 0.25 + 1 + 5, rel=1e-12)
    sd, t = 0.5, 1 / 3
    alone = (3 + 1) ** 2 * sd**2 + 2 * 3 * 4 * sd**4 + 9 * 2 * sd**4 + 15 * sd**6
    assert made.variance == pytest.approx(alone + t + t * sd**2, rel=1e-9)
    assert made.sobol["b"].first == pytest.approx(t / made.variance, rel=1e-9)
    assert made.sobol["b"].total == pytest.approx((t + t * sd**2) / made.variance, rel=1e-9)


def test_an_outcome_that_nothing_changes_has_no_spread() -> None:
    made = expand(lambda x: 82.0 + 1e-14 * x["a"], {"a": Uniform(0.0, 1.0), "b": Uniform(0.0, 1.0)})
    assert (made.sd, made.sobol["a"].total, made.held_out_error) == (0.0, 0.0, 0.0)


def test_steps_are_not_smooth_and_go_to_monte_carlo() -> None:
    def steps(x: dict[str, float]) -> float:
        return float(math.floor(3 * x["a"]) + 2 * math.floor(5 * x["b"] * x["a"]))

    inputs = {"a": Uniform(0.0, 1.0), "b": Uniform(0.0, 1.0)}
    made = expand(steps, inputs, runs=120, tolerance=0.003, monte_carlo_runs=400, seed=3)
    assert made.method == "monte-carlo"
    assert made.note.startswith("not smooth")
    assert made.held_out_error is not None
    assert made.held_out_error > 0.003
    assert made.mean_error is not None
    assert made.runs <= 120 + 400
    again = expand(steps, inputs, runs=120, tolerance=0.003, method="polynomial-chaos", seed=3)
    assert again.method == "polynomial-chaos"
    assert again.held_out_error == made.held_out_error
    assert made.note == f"{again.note}; Monte Carlo instead"


def test_the_same_seed_gives_the_same_result() -> None:
    inputs = {"a": Uniform(0.0, 1.0), "b": Normal(0.0, 1.0)}

    def function(x: dict[str, float]) -> float:
        return math.exp(x["a"] * x["b"])

    one, two, other = (expand(function, inputs, seed=seed) for seed in (1, 1, 2))
    assert one == two
    assert one != other


@pytest.mark.parametrize(
    "given",
    [
        {"inputs": {}},
        {"inputs": {"a": 3.0}},
        {"tolerance": 0.0},
        {"runs": 36},
        {"method": "best"},
        {"monte_carlo_runs": 3},
        {"held_out": 1},
        {"seed": -1},
    ],
)
def test_wrong_arguments_are_refused(given: dict[str, Any]) -> None:
    arguments: dict[str, Any] = {"inputs": {"a": Uniform(0.0, 1.0)}, **given}
    with pytest.raises(SettingError):
        expand(lambda x: x["a"], **arguments)


@pytest.mark.parametrize("count", [MOST_INPUTS - 1, MOST_INPUTS, MOST_INPUTS + 1])
def test_at_most_so_many_inputs(count: int) -> None:
    inputs = {f"x{k}": Uniform(0.0, 1.0) for k in range(count)}
    if count > MOST_INPUTS:
        with pytest.raises(SettingError, match="1 to 12"):
            expand(lambda x: sum(x.values()), inputs)
        return
    made = expand(lambda x: sum(x.values()), inputs, runs=400)
    assert made.mean == pytest.approx(count / 2)
    assert made.variance == pytest.approx(count / 12)


def test_an_outcome_that_is_no_number_is_refused_with_its_inputs() -> None:
    with pytest.raises(SettingError, match=r"nan.* at a=0\.5"):
        expand(lambda x: math.nan if x["a"] == 0.5 else x["a"], {"a": Uniform(0.0, 1.0)})


def test_ranges_are_read_and_wrong_ones_refused() -> None:
    assert parse_input("0.8:1.2", "v_max") == Uniform(0.8, 1.2)
    assert parse_input("normal(0.15, 0.02)", "radius") == Normal(0.15, 0.02)
    for wrong in ("1.2:0.8", "1", "1:2:3", "normal(1)", "normal(1,0)", "uniform(1,2)", "a:b", "nan:1", ""):
        with pytest.raises(SettingError, match=r"vary\.x"):
            parse_input(wrong, "x")


@pytest.mark.parametrize("method", ["polynomial-chaos", "monte-carlo"])
def test_the_result_does_not_depend_on_the_workers(method: str) -> None:
    given = {"a": Uniform(-1.0, 3.0), "b": Normal(1.0, 0.5)}
    one, two = (expand(itemgetter("b"), given, method=method, monte_carlo_runs=60, workers=n) for n in (1, 2))
    assert one == two
    assert one.sample.tobytes() == two.sample.tobytes()
    for workers in (0, MOST_WORKERS + 1):
        with pytest.raises(SettingError, match="WORKERS"):
            expand(itemgetter("b"), given, workers=workers)
