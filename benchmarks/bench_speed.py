"""A speed profile of 1,000 nodes: compared with TOPP-RA on the same path, and all caps of our laws."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import toppra
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict, judge
from benchmarks.maps import random_map
from benchmarks.turns import take_turns
from toppra import algorithm, constraint

import lampyris
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.motion.geometry.curve import curve_of
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.physical import Approach, PhysicalLaw
from lampyris.motion.profile import feasible_profile
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.sim.continuous.drive import DriveSimulation

TITLE = "Speed profiles"
HOW = """Milliseconds of this thread's processor time, code compiled.

- passes: `lampyris.motion.profile.feasible_profile` on 1,000 nodes of a random smooth path: a top speed and a
  lateral limit as two caps, unequal acceleration and braking, the clock, the causes.
- toppra: TOPP-RA on the same nodes of the same path with the same limits. It is given the distance itself as
  its path and the caps as a speed limit at each node; "solved" is `compute_parameterization` alone, "whole"
  makes the constraints and the solver too, as every new path asks for. Its times and ours agree to 1e-4.
- jerk: the passes with a limit on jerk, which TOPP-RA does not have.
- laws: `motion.laws.profile` on a course of 1,000 nodes among the walls of a random map: the law as it
  stands; then among ten moving obstacles; then with zones, the same obstacles and the approach to the goal;
  then also each rule of the related work.
- driving: a whole drive of `lampyris.drive` on 50 x 50 cells among 10 and 20 walkers, planning and placing of the
  obstacles and the referee included, by its periods of 0.1 s; then its periods alone, by compiled code and by the loop in
  Python, whose drives are equal to the last bit.

lampyris and TOPP-RA are called alternately, once a round each; jerk and laws are measured each by itself, repeatedly.

The limit of 1 ms is one of time, and so of this machine."""

ASKED = 20.0
"""How many times as quick as TOPP-RA."""
MOST_MS = 1.0
"""A profile of our law, as it stands and with all caps."""
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


def course_among_walls() -> tuple[SampledPath, Scene]:
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
    while len(sample_curve(curve, spacing)) > NODES:
        spacing *= 1.0005
    return sample_curve(curve, spacing), scene


def movers(rng: np.random.Generator) -> ObstacleStates:
    """Ten obstacles anywhere, of up to 1 m/s."""
    return ObstacleStates(
        rng.uniform(0, 199, (10, 2)), np.full(10, 0.2), rng.uniform(0.2, 1.0, 10), rng.normal(0, 0.3, (10, 2))
    )


def bench(quick: bool) -> Section:
    """Compared with TOPP-RA, then the laws."""
    prefer_compiled()
    figures: list[Figure] = []
    tables = (
        _beside_toppra(figures, 3 if quick else 10, 5 if quick else 20),
        _of_laws(figures, quick),
        _of_driving(figures, quick),
    )
    verdicts = [
        judge(
            f"a profile of {NODES} nodes compared with TOPP-RA, {what}",
            [f for f in figures if f.rival == name],
        )
        for what, name in (("solved", "toppra, solved"), ("made and solved", "toppra, whole"))
    ]
    ms = {f.task: f.ours.middle for f in figures if f.task in ("law physical", "law with all caps")}
    text = f"a profile of {NODES} nodes takes at most {MOST_MS:g} ms: "
    text += ", ".join(f"{task} {took:.2f}" for task, took in ms.items())
    verdicts.append(Verdict(max(ms.values()) <= MOST_MS, text))
    about = versions(["numpy", "numba", "toppra"])
    return Section("speed", TITLE, HOW, tables, tuple(figures), tuple(verdicts), about)


def _beside_toppra(figures: list[Figure], paths: int, rounds: int) -> Table:
    """Several paths, each with its own turns; of each contestant the middle of every path counts."""
    rng = np.random.default_rng(1)
    spent: dict[str, list[float]] = {}
    apart = 0.0
    for _ in range(paths):
        s, bend = smooth_path(rng)
        caps = [("limit", np.full(NODES, TOP)), ("curvature", bend)]
        ours = partial(feasible_profile, s, caps, a_max=A_MAX, d_max=D_MAX)
        made = partial(solver, s, np.minimum(TOP, bend))
        ready = made()

        def whole(made: Any = made) -> Any:
            return made().compute_parameterization(0.0, 0.0)

        calls = {
            "passes": ours,
            "toppra, solved": partial(ready.compute_parameterization, 0.0, 0.0),
            "toppra, whole": whole,
        }
        found = take_turns(calls, rounds=rounds, per=1e6)
        found |= take_turns({"jerk": partial(ours, jerk_max=1.0)}, rounds=3, per=1e6)
        for name, times in found.items():
            spent.setdefault(name, []).append(times.middle)
        v = whole()[1]
        arrival = float((2 * np.diff(s) / (v[:-1] + v[1:])).sum())
        apart = max(apart, abs(arrival / float(ours().t[-1]) - 1))
    assert apart < 1e-4, f"times are apart by {apart:.1e}"
    times = {name: Spread.of(ms) for name, ms in spent.items()}
    rows = [("passes", f"{times['passes'].middle:.3f}", ""), ("jerk", f"{times['jerk'].middle:.2f}", "")]
    for name in ("toppra, solved", "toppra, whole"):
        figure = Figure(f"profile of {NODES} nodes", "ms", times["passes"], name, times[name], asked=ASKED)
        figures.append(figure)
        rows.append((name, f"{times[name].middle:.2f}", f"{figure.ratio:.0f} x"))
    figures.append(Figure(f"profile of {NODES} nodes with a limit on jerk", "ms", times["jerk"]))
    title = f"{NODES} nodes, {paths} paths; times of arrival apart by at most {apart:.1e} of themselves"
    return Table(("", "ms", "passes are quicker by"), tuple(rows), title)


def _of_laws(figures: list[Figure], quick: bool) -> Table:
    """Whole profiles of the laws on one course."""
    course, scene = course_among_walls()
    bare = Scene(scene.grid, scene.start, scene.goal, robot=scene.robot)
    around = movers(np.random.default_rng(3))
    every = PhysicalLaw(approach=Approach())
    calls = {
        "physical": partial(laws.profile, course, bare, law="physical", obstacle_states=None),
        "moving obstacles": partial(laws.profile, course, bare, law="physical", obstacle_states=around),
        "with all caps": partial(laws.profile, course, scene, law=every, obstacle_states=around),
    }
    for name in ("uncertainty", "blind", "three-speed", "cloud"):
        calls[name] = partial(laws.profile, course, scene, law=name, obstacle_states=around)
    times = {}
    for name, call in calls.items():
        times |= take_turns({name: call}, rounds=3, per=1e6, often=5 if quick else 30)
    figures += [Figure(f"law {name}", "ms", spent) for name, spent in times.items()]
    rows = [(name, f"{t.middle:.3f} ({t.low:.3f} to {t.high:.3f})") for name, t in times.items()]
    return Table(("law", "ms"), tuple(rows), f"A course of {len(course)} nodes, ten moving obstacles")


def _of_driving(figures: list[Figure], quick: bool) -> Table:
    """A period of a whole drive: by the public call, and its periods alone, compiled and by the loop in Python."""
    free = random_map(50, 0.1)
    free[:2, :2] = free[-2:, -2:] = True
    rows = []
    for count in (10, 20):
        scene = Scene(
            Grid(~free), (0, 0), (49, 49), robot=Robot(a_max=A_MAX, d_max=D_MAX), traffic=(RandomWalk(count),)
        )
        made: list[DriveSimulation] = []

        def ready(scene: Scene = scene, made: list[DriveSimulation] = made) -> None:
            made[:] = [DriveSimulation(scene, AdGso(), seed=1)]

        def compiled(made: list[DriveSimulation] = made) -> Drive:
            return made[0].run()

        def loop(made: list[DriveSimulation] = made) -> None:
            while made[0].outcome is None:
                made[0].step()

        calls: dict[str, Callable[[], Any]] = {
            "whole call": partial(lampyris.drive, scene, "ad-gso", seed=1),
            "periods alone, compiled": compiled,
            "periods alone, the loop in Python": loop,
        }
        found = calls["whole call"]()
        periods = float(found.t[-1]) / found.period
        spent = take_turns(
            calls, rounds=3 if quick else 9, per=1e6 * periods, before=dict.fromkeys(list(calls)[1:], ready)
        )
        slow = spent["periods alone, the loop in Python"]
        for name, one in spent.items():
            figures.append(Figure(f"a period of a drive, 50 x 50 among {count}: {name}", "ms", one))
            told = f"{one.middle:.4f} ({one.low:.4f} to {one.high:.4f})"
            each = f"{found.period / one.middle * 1e3:,.0f}"
            rows.append((f"{count}", name, f"{periods:.0f}", told, each, f"{slow.middle / one.middle:.1f}"))
    heads = (
        "walkers",
        "what",
        "periods",
        "ms a period",
        "seconds driven a CPU second",
        "times the loop's periods",
    )
    return Table(heads, tuple(rows), "Drives on 50 x 50 among random walkers")
