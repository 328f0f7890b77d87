"""Controllers that steer: how often a second MPPI decides, and DWA compared with one in plain Python."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict, judge
from benchmarks.plain_dwa import PlainDwa

from lampyris.kernels._jit import compiled_only
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.sim.steering.control import View
from lampyris.sim.steering.controller_choice import simulation_of
from lampyris.sim.steering.steered_drive import SteeredSimulation

TITLE = "Controllers that steer"
HOW = """One decision of a controller, of a differential robot of 0.7 x 0.4 m, two seconds into a drive on a map of 200 x 200
cells of 0.1 m with a wall every 4 m, in milliseconds of this thread's processor time: `mppi` with 56 steps of 0.05 s among 20
moving obstacles that are within 3 m, `dwa` with 9 x 21 commands of 20 steps of 0.1 s among 15. The rival of `dwa` is
`benchmarks/plain_dwa.py`: the same number of commands and steps among the same obstacles in plain Python and NumPy, written
for this comparison as courses teach it; it knows no walls, no path and no outline. What the braking rule takes is not
counted (`drive` does)."""

RATE = 300.0
"""Decisions a second of MPPI with 2,000 samples that are asked for."""
FASTER = 100.0
"""How many times faster than the plain DWA ours shall be."""
FOOTPRINT = ((0.5, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.5, -0.2))


def decision(controller: str, obstacles: int, **settings: object) -> tuple[SteeredSimulation, View]:
    """A drive two seconds after its start, and what its controller sees then."""
    walls = np.zeros((200, 200), dtype=bool)
    walls[::40, ::40] = True
    scene = Scene(
        Grid(walls, resolution=0.1), start_pose=(3.0, 10.0, 0.0), goal_pose=(17.0, 10.0, 0.0),
        robot=Robot(footprint=FOOTPRINT), traffic=(RandomWalk(obstacles),),
    )  # fmt: skip
    simulation = simulation_of(
        scene, LatticePlanner(weight=1.2), seed=1, controller=controller, obstacle_speed=0.3, obstacle_info="velocities",
        controller_settings=settings,
    )  # fmt: skip
    assert isinstance(simulation, SteeredSimulation)
    for _ in range(20):
        simulation.step()
    view = simulation.view(0.1)
    view.progress.update(view.pose)
    around = np.random.default_rng(0).uniform(-30.0, 30.0, (obstacles, 2))
    view.message = replace(view.message, xy=np.array([simulation.xy]) + around)
    return simulation, view


def spent(simulation: SteeredSimulation, view: View, rounds: int) -> list[float]:
    """Milliseconds of processor time of each of some decisions."""
    for _ in range(3):
        simulation.steerer.steer(view)
    out = []
    for _ in range(rounds):
        began = time.thread_time()
        simulation.steerer.steer(view)
        out.append(1e3 * (time.thread_time() - began))
    return out


def bench(quick: bool) -> Section:
    """The section."""
    rounds = 40 if quick else 200
    rows: list[tuple[str, ...]] = []
    figures = []
    rate = 0.0
    with compiled_only():
        for samples in (1000, 2000):
            times = spent(*decision("mppi", 20, samples=samples), rounds)
            one = Spread.of(times)
            figures.append(Figure(f"mppi, {samples:,} x 56 steps, 20 obstacles", "ms", one))
            rate = 1e3 / float(np.median(times))
            rows.append((f"mppi, {samples:,} samples", f"{float(np.median(times)):.2f}", f"{rate:.0f}"))
        simulation, view = decision("dwa", 15)
        times = spent(simulation, view, rounds)
        rows.append(
            ("dwa, 9 x 21 commands", f"{float(np.median(times)):.3f}", f"{1e3 / float(np.median(times)):.0f}")
        )
    plain, places = PlainDwa(), view.message.xy * np.array((0.1, -0.1))
    state, theirs = (view.pose.x, view.pose.y, view.pose.yaw, view.v), []
    for _ in range(5 if quick else 20):
        began = time.thread_time()
        plain.choose(state, (view.pose.x + 3.0, view.pose.y), places)
        theirs.append(1e3 * (time.thread_time() - began))
    rows.append(("the plain one", f"{float(np.median(theirs)):.1f}", f"{1e3 / float(np.median(theirs)):.0f}"))
    faster = Figure(
        "dwa, 9 x 21 x 20 steps, 15 obstacles", "ms", Spread.of(times), "plain Python and NumPy", Spread.of(theirs),
        asked=FASTER,
    )  # fmt: skip
    figures.append(faster)
    reached = Verdict(
        rate >= RATE,
        f"MPPI, 2,000 x 56 steps, 20 obstacles: at least {RATE:g} decisions a second: {rate:.0f}",
    )
    return Section(
        "steering", TITLE, HOW, (Table(("controller", "ms", "a second"), tuple(rows), "One decision"),), tuple(figures),
        (reached, judge("A decision of DWA", [faster])), versions(("numpy", "numba")),
    )  # fmt: skip
