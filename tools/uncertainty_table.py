"""Polynomial chaos of lampyris beside chaospy's and Monte Carlo: two Markdown tables.

    pip install chaospy==4.3.21          # not needed by lampyris; without it its rows are left out
    python tools/uncertainty_table.py    # about a minute of CPU time

Ishigami's function (7, 0.1), and the duration of a planned drive across env-3 with five uncertain limits of the robot.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

import lampyris
from lampyris.uncertainty import Normal, Uniform, expand
from lampyris.uncertainty.inputs import Input

ANGLES: dict[str, Input] = {name: Uniform(-math.pi, math.pi) for name in ("x1", "x2", "x3")}
VARY: dict[str, Input] = {
    "v_max": Uniform(0.8, 1.2),
    "a_max": Uniform(0.3, 0.7),
    "d_max": Uniform(0.6, 1.4),
    "a_lat_max": Uniform(0.6, 1.4),
    "radius": Normal(0.15, 0.02),
}
RUNS_MC = 4000
Row = tuple[str, int, float, float, Mapping[str, tuple[float, float]], float]


def ishigami(x: Mapping[str, float]) -> float:
    """Ishigami and Homma 1990."""
    return math.sin(x["x1"]) + 7.0 * math.sin(x["x2"]) ** 2 + 0.1 * x["x3"] ** 4 * math.sin(x["x1"])


def drive(x: Mapping[str, float]) -> float:
    """Seconds across env-3 with these limits."""
    scene = lampyris.Scene(GRID, (1, 1), (47, 47), robot=lampyris.Robot(**x))
    return lampyris.speed_profile(scene, lampyris.plan(scene, "astar", record=False)).duration


GRID = lampyris.load_grid("env-3")


def ours(
    function: Callable[[dict[str, float]], float], inputs: Mapping[str, Input], name: str, **how: Any
) -> Row:
    """A row of lampyris."""
    began = time.process_time()
    made = expand(function, inputs, **how)
    took = time.process_time() - began
    shares = {key: (one.first, one.total) for key, one in made.sobol.items()}
    return name, made.runs, made.mean, made.sd, shares, took


def chaospys(
    function: Callable[[dict[str, float]], float], inputs: Mapping[str, Input], most: int
) -> Iterator[Row]:
    """Rows of chaospy: the greatest orders that fit into so many runs."""
    try:
        import chaospy
    except ImportError:
        return
    kinds = [
        chaospy.Normal(one.mean, one.sd) if isinstance(one, Normal) else chaospy.Uniform(one.low, one.high)
        for one in inputs.values()
    ]
    joint = chaospy.J(*kinds)

    def run(points: Any) -> Any:
        return np.array(
            [function(dict(zip(inputs, column, strict=True))) for column in np.asarray(points).T.tolist()]
        )

    def row(name: str, began: float, count: int, expansion: Any) -> Row:
        first, total = (made(expansion, joint) for made in (chaospy.Sens_m, chaospy.Sens_t))
        shares = {key: (float(a), float(b)) for key, a, b in zip(inputs, first, total, strict=True)}
        mean, sd = float(chaospy.E(expansion, joint)), float(chaospy.Std(expansion, joint))
        return name, count, mean, sd, shares, time.process_time() - began

    rules = [
        (order, *chaospy.generate_quadrature(order, joint, rule="gaussian", sparse=True))
        for order in range(1, 6)
    ]
    order, nodes, weights = [one for one in rules if one[1].shape[1] <= most][-1]
    began = time.process_time()
    basis = chaospy.generate_expansion(order, joint)
    yield row(
        f"chaospy, sparse Gauss quadrature, order {order}", began, nodes.shape[1],
        chaospy.fit_quadrature(basis, nodes, weights, run(nodes)),
    )  # fmt: skip
    order = max(k for k in range(1, 12) if 2 * math.comb(k + len(inputs), k) <= most)
    began = time.process_time()
    basis = chaospy.generate_expansion(order, joint)
    nodes = joint.sample(most, rule="sobol")
    fitted = chaospy.fit_regression(basis, nodes, run(nodes))
    yield row(f"chaospy, regression at Sobol points, order {order}", began, most, fitted)


def show(rows: list[Row], shares: list[tuple[str, int]]) -> None:
    """Print a table."""
    words = [f"{name} {('by itself', 'with others')[k]}" for name, k in shares]
    print(f"| | runs | mean | standard deviation | variance | {' | '.join(words)} | CPU s |")
    print("|" + "---|" * (6 + len(words)))
    for name, runs, mean, sd, found, took in rows:
        each = " | ".join(f"{found[key][k]:.4f}" for key, k in shares)
        print(f"| {name} | {runs} | {mean:.4f} | {sd:.4f} | {sd * sd:.4f} | {each} | {took:.2f} |")


def table(
    function: Callable[[dict[str, float]], float], inputs: Mapping[str, Input], shares: list[tuple[str, int]]
) -> None:
    """Run everybody on one function."""
    function(dict(zip(inputs, (sum(one.range) / 2 for one in inputs.values()), strict=True)))  # compile
    best = ours(function, inputs, "lampyris, polynomial chaos")
    rows = [best, *chaospys(function, inputs, best[1])]
    show(rows, shares)
    began = time.process_time()
    rng = np.random.Generator(np.random.PCG64(1))
    draws = {name: one.standard(rng, RUNS_MC) for name, one in inputs.items()}
    values = np.array(
        [function({name: inputs[name].value(z[k]) for name, z in draws.items()}) for k in range(RUNS_MC)]
    )
    sd, took = float(values.std(ddof=1)), time.process_time() - began
    error = math.sqrt(
        max(float(np.mean((values - values.mean()) ** 4)) - sd**4, 0.0) / (4 * sd * sd * RUNS_MC)
    )
    print(
        f"\nMonte Carlo, {RUNS_MC} independent runs: mean {values.mean():.4f} (standard error {sd / RUNS_MC**0.5:.4f}), "
        f"standard deviation {sd:.4f} ({error:.4f}), {took:.1f} s\n",
        flush=True,
    )


if __name__ == "__main__":
    table(ishigami, ANGLES, [("x1", 0), ("x2", 0), ("x3", 1)])
    table(drive, VARY, [("v_max", 0), ("d_max", 0), ("a_lat_max", 0), ("radius", 0), ("v_max", 1)])
