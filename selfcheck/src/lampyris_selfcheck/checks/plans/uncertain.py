"""Uncertain settings: distributions of outcomes beside closed forms."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.uncertainty.expansion import expand
from lampyris.uncertainty.inputs import Normal, Uniform
from lampyris.uncertainty.propagate import propagate_uncertainty
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally, each
from lampyris_selfcheck.reference.motion import chaos

NEAR = 1e-6
"""Share by which an expansion of a polynomial may be off: its inputs are cut off at 6 standard deviations."""


def _expansion(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("uncertain", "expansion", number)
    n = 1 + number % 3
    inputs: list[chaos.Input] = []
    for _ in range(n):
        middle, wide = float(rng.uniform(-2, 2)), float(rng.uniform(0.2, 1.5))
        inputs.append(
            ("uniform", middle - wide, middle + wide) if rng.random() < 0.6 else ("normal", middle, wide)
        )
    powers = [one for one in product(range(4), repeat=n) if 0 < sum(one) <= 3]
    chosen = [powers[int(k)] for k in rng.choice(len(powers), min(4, len(powers)), replace=False)]
    poly = {(0,) * n: float(rng.uniform(-3, 3)), **{one: float(rng.uniform(-2, 2)) for one in chosen}}
    names = "abc"[:n]
    given = {
        name: Uniform(a, b) if kind == "uniform" else Normal(a, b)
        for name, (kind, a, b) in zip(names, inputs, strict=True)
    }
    made = expand(
        lambda x: chaos.value(poly, [x[name] for name in names]), given, tolerance=1e-9, seed=number
    )
    mean, variance, sobol = chaos.indices(poly, inputs)
    scale = math.sqrt(variance)
    tally.count(made.method)
    faults = []
    if made.method != "polynomial-chaos":
        faults.append(f"{made.method}: {made.note}")
    if abs(made.mean - mean) > NEAR * scale or abs(made.sd - scale) > NEAR * scale:
        faults.append(f"mean {made.mean}, sd {made.sd}; they are {mean}, {scale}")
    for name, (first, total) in zip(names, sobol, strict=True):
        one = made.sobol[name]
        if abs(one.first - first) > NEAR or abs(one.total - total) > NEAR:
            faults.append(f"{name}: {one.first}, {one.total}; they are {first}, {total}")
    shares = list(made.quantiles.values())
    if shares != sorted(shares):
        faults.append(f"quantiles {made.quantiles}")
    if faults:
        tally.fail(number, "; ".join(faults), inputs=inputs, poly=[[*k, c] for k, c in poly.items()])


def _steps(ask: Ask, number: int, tally: Tally) -> None:
    """A step has no expansion; Monte Carlo is within six standard errors of its closed form."""
    rng = ask.rng("uncertain", "steps", number)
    share, rise, slope = float(rng.uniform(0.2, 0.8)), float(rng.uniform(1, 5)), float(rng.uniform(0, 0.5))
    given = {"a": Uniform(0.0, 1.0), "b": Uniform(-1.0, 1.0)}
    made = expand(
        lambda x: (rise if x["a"] < share else 0.0) + slope * x["b"],
        given, seed=number, runs=60, monte_carlo_runs=400,
    )  # fmt: skip
    of_step = rise * rise * share * (1 - share)
    variance = of_step + slope * slope / 3
    tally.count(made.method)
    fault = ""
    if made.method != "monte-carlo" or "not smooth" not in made.note:
        fault = f"{made.method}, note {made.note!r}"
    elif made.mean_error is None or made.sd_error is None:
        fault = "states no standard errors"
    elif abs(made.mean - rise * share) > 6 * made.mean_error or not 0 < made.mean_error < 0.2 * math.sqrt(
        variance
    ):
        fault = f"mean {made.mean} +- {made.mean_error}, it is {rise * share}"
    elif abs(made.sd - math.sqrt(variance)) > 6 * made.sd_error + 0.02 * math.sqrt(variance):
        fault = f"sd {made.sd} +- {made.sd_error}, it is {math.sqrt(variance)}"
    else:
        exact = {"a": of_step / variance, "b": slope * slope / 3 / variance}
        for name, one in made.sobol.items():
            for got, error in ((one.first, one.first_error), (one.total, one.total_error)):
                if error is None or abs(got - exact[name]) > 6 * error + 0.02:
                    fault = f"{name}: {got} +- {error}, it is {exact[name]}"
    if fault:
        tally.fail(number, fault, share=share, rise=rise, slope=slope)


def _drives(ask: Ask, number: int, tally: Tally) -> None:
    """A straight corridor with metres for cells, whose first and last one suffice to speed up and to brake.

    The square of the speed is linear between two cells, so these two take 2 / v each: the time is (L + 2) / v.
    """
    rng = ask.rng("uncertain", "drives", number)
    cells = int(rng.integers(20, 40))
    low, a, d = float(rng.uniform(0.6, 0.9)), float(rng.uniform(1.2, 1.5)), float(rng.uniform(1.2, 1.5))
    high = low * float(rng.uniform(1.1, 1.5))
    scene = Scene(
        Grid(np.zeros((1, cells), dtype=np.bool_)), (0, 0), (cells - 1, 0), robot=Robot(a_max=a, d_max=d)
    )
    of = ("duration", "energy", "length")[number % 3]
    length = float(cells - 1)
    made = propagate_uncertainty(
        scene, {"v_max": (low, high)}, of=of, planner="astar", tolerance=1e-6, seed=number, method="polynomial-chaos",
        held_out=2,
    )  # fmt: skip

    def integral(v: float) -> tuple[float, float]:
        """Of the outcome and of its square over v_max."""
        if of == "length":
            return length * v, length * length * v
        if of == "energy":
            rolling = 0.015 * 9.80665 * length
            return v**3 / 6 + rolling * v, v**5 / 20 + rolling * v**3 / 3 + rolling * rolling * v
        return (length + 2) * math.log(v), -(length + 2) * (length + 2) / v

    mean, square = ((q - p) / (high - low) for p, q in zip(integral(low), integral(high), strict=True))
    sd = math.sqrt(max(square - mean * mean, 0.0))
    tally.count(of)
    if abs(made.mean - mean) > 1e-5 * mean or abs(made.sd - sd) > 1e-3 * sd + 1e-6 * mean:
        tally.fail(
            number,
            f"{of}: {made.mean} +- {made.sd}, it is {mean} +- {sd}",
            v=[low, high],
            a=a,
            d=d,
            cells=cells,
        )


JUDGES = {"expansion": _expansion, "steps": _steps, "drives": _drives}


def _run(ask: Ask, part: Part) -> Outcome:
    judge = JUDGES[part.kind]
    return each(part, lambda number, tally: judge(ask, number, tally))


KINDS = {
    "expansion": Kind(
        "polynomials of up to three inputs: mean, spread and Sobol indices by moments", 20, 3_000, 30_000, 100
    ),
    "steps": Kind(
        "outcomes with a step: refused for Monte Carlo, which is right within its errors",
        10,
        2_000,
        20_000,
        100,
    ),
    "drives": Kind(
        "drives along a corridor: time, energy and length by their integrals", 12, 1_000, 10_000, 50
    ),
}
CHECK = Check(
    "uncertain",
    ("G38",),
    "distributions of outcomes under uncertain settings are those of closed forms",
    KINDS,
    _run,
)
