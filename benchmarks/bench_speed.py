"""A speed profile of 1,000 nodes: all caps of our law, and beside TOPP-RA on the same path, in one run.

    python -m benchmarks.bench_speed [--quick] [--json FILE]

What is timed
-------------
* passes: :func:`lampyris.motion.profile.feasible_profile` on 1,000 nodes of a random smooth path: a top speed
  and a lateral limit as two caps, unequal acceleration and braking, the clock, the causes.
* toppra: TOPP-RA on the same nodes of the same path with the same limits, by turns with the passes. It is
  given the distance itself as its path and the caps as a speed limit at each node; ``solve`` is
  ``compute_parameterization`` alone, ``whole`` makes the constraints and the solver too, as every new path
  asks for. Its times and ours must agree to 1e-4.
* jerk: the passes with a limit on jerk, which TOPP-RA does not have.
* law: ``motion.laws.profile`` on a course of 1,000 nodes among the walls of a random map: first the law as
  it stands, then with zones, ten moving obstacles and the approach to the goal, then with each rule of the
  related work besides. Compiled code is warm throughout.
"""

from __future__ import annotations

import argparse
import itertools
import json
import platform
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import toppra
from toppra import algorithm, constraint

from lampyris.kernels import _jit
from lampyris.model.grid import Grid
from lampyris.model.movers import Movers
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion import laws
from lampyris.motion.course import Course, course_of
from lampyris.motion.curve import curve_of
from lampyris.motion.physical import Approach, PhysicalLaw
from lampyris.motion.profile import feasible_profile

NODES = 1000
A_MAX, D_MAX, LATERAL, TOP = 0.5, 1.0, 0.4, 1.0


def smooth_path(rng: np.random.Generator) -> tuple[Any, Any]:
    """Distances of 1,000 nodes on a spline, and the least of both caps there."""
    points = np.cumsum(rng.normal((1.5, 0.0), 0.7, (8, 2)), axis=0)
    spline = toppra.SplineInterpolator(np.linspace(0.0, 1.0, 8), points)
    fine = np.linspace(0.0, 1.0, 20 * NODES)
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(spline(fine), axis=0).T))))
    s = np.linspace(0.0, length[-1], NODES)
    u = np.interp(s, length, fine)
    (dx, dy), (ddx, ddy) = spline(u, 1).T, spline(u, 2).T
    curvature = np.abs(dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3
    return s, np.sqrt(LATERAL / np.maximum(curvature, 1e-12))


def solver(s: Any, cap: Any) -> Any:
    """TOPP-RA, made for the path."""
    line = toppra.SimplePath(s[[0, -1]], s[[0, -1], None], np.ones((2, 1)))
    at = dict(zip(s.tolist(), cap.tolist(), strict=True))
    limits = [
        constraint.JointVelocityConstraintVarying(lambda x: np.array([[-at[float(x)], at[float(x)]]])),
        constraint.JointAccelerationConstraint(np.array([[-D_MAX, A_MAX]])),
    ]
    return algorithm.TOPPRA(limits, line, gridpoints=s, solver_wrapper="seidel")


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Milliseconds, and what came out."""
    began = time.perf_counter()
    out = call()
    return 1e3 * (time.perf_counter() - began), out


def beside_toppra(paths: int, rounds: int) -> dict[str, float]:
    """Middle milliseconds of each, over several paths, by turns."""
    rng = np.random.default_rng(1)
    times: dict[str, list[float]] = {"passes": [], "jerk": [], "solve": [], "whole": []}
    apart = 0.0
    for _ in range(paths):
        s, bend = smooth_path(rng)
        ours = partial(
            feasible_profile,
            s,
            [("limit", np.full(NODES, TOP)), ("curvature", bend)],
            a_max=A_MAX,
            d_max=D_MAX,
        )
        theirs = partial(solver, s, np.minimum(TOP, bend))
        for _ in range(rounds):
            ms, made = timed(ours)
            times["passes"].append(ms)
            making, ready = timed(theirs)
            solving, found = timed(partial(ready.compute_parameterization, 0.0, 0.0))
            times["solve"].append(solving)
            times["whole"].append(making + solving)
        times["jerk"].append(timed(partial(ours, jerk_max=1.0))[0])
        v = found[1]
        arrival = float((2 * np.diff(s) / (v[:-1] + v[1:])).sum())
        apart = max(apart, abs(arrival / float(made.t[-1]) - 1))
    assert apart < 1e-4, f"times are apart by {apart:.1e}"
    return {name: statistics.median(ms) for name, ms in times.items()} | {"apart": apart}


def course_among_walls() -> tuple[Course, Scene]:
    """1,000 nodes along a smoothed zigzag on a random map of 200 x 200 cells of 0.1 m."""
    rng = np.random.default_rng(2)
    blocked = rng.random((200, 200)) < 0.1
    points = np.array([[10, 10], [60, 40], [90, 120], [140, 90], [180, 180]], dtype=np.float64)
    for a, b in itertools.pairwise(points):
        for x, y in a + np.linspace(0, 1, 400)[:, None] * (b - a):
            blocked[round(y) - 3 : round(y) + 4, round(x) - 3 : round(x) + 4] = False
    zones = np.full(blocked.shape, np.inf)
    zones[100:140, 60:120] = 0.6
    grid = Grid(blocked, resolution=0.1)
    scene = Scene(grid, (10, 10), (180, 180), robot=Robot(radius=0.2), zones=zones)
    curve = curve_of(points, grid, scene.robot)
    spacing = float(curve.lengths.sum()) / NODES
    while len(course_of(curve, spacing)) > NODES:
        spacing *= 1.0005
    return course_of(curve, spacing), scene


def movers(rng: np.random.Generator) -> Movers:
    """Ten obstacles anywhere, of up to 1 m/s."""
    return Movers(
        rng.uniform(0, 199, (10, 2)), np.full(10, 0.2), rng.uniform(0.2, 1.0, 10), rng.normal(0, 0.3, (10, 2))
    )


def of_laws(rounds: int) -> dict[str, float]:
    """Middle milliseconds of whole profiles of the laws on one course."""
    course, scene = course_among_walls()
    bare = Scene(scene.grid, scene.start, scene.goal, robot=scene.robot)
    around = movers(np.random.default_rng(3))
    every = PhysicalLaw(approach=Approach())
    cases: dict[str, tuple[Any, Scene, Movers | None]] = {
        "physical": ("physical", bare, None),
        "all caps": (every, scene, around),
    }
    cases |= {name: (name, scene, around) for name in ("uncertainty", "blind", "three-speed", "cloud")}
    out: dict[str, float] = {"nodes": float(len(course))}
    for name, (law, where, moving) in cases.items():

        def once(law: Any = law, where: Scene = where, moving: Any = moving) -> Any:
            return laws.profile(course, where, law=law, movers=moving)

        for _ in range(3):
            once()
        out[name] = statistics.median(timed(once)[0] for _ in range(rounds))
    return out


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--json", type=Path, help="write the figures there")
    given = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}")
    _jit.PLAIN_CELLS = -1  # every kernel is compiled at its first call
    beside_toppra(1, 2)
    beside = beside_toppra(3 if given.quick else 10, 5 if given.quick else 20)
    ours = beside["passes"]
    print(f"{NODES} nodes, ms: passes {ours:.3f}, with a limit on jerk {beside['jerk']:.1f}")
    for name in ("solve", "whole"):
        print(f"toppra, {name}: {beside[name]:.2f} ms, {beside[name] / ours:.0f} times ours (asked: 20)")
    print(f"times of arrival apart by at most {beside['apart']:.1e} of themselves")
    told = of_laws(20 if given.quick else 100)
    print(f"a course of {told['nodes']:.0f} nodes, 10 moving obstacles, ms:")
    for name, ms in told.items():
        if name != "nodes":
            verdict = "" if name not in ("physical", "all caps") else " (asked: under 1)"
            print(f"  {name:12s} {ms:7.3f}{verdict}")
    if given.json:
        given.json.write_text(json.dumps({"toppra": beside, "laws": told}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
