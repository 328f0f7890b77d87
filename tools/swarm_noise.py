"""Robots that look for sources by GSO and by their own gradient, with more and more noise; and the time of a step.

    python tools/swarm_noise.py noise --seeds 20 --map env-6
    python tools/swarm_noise.py seeds --seeds 100 --map env-6
    python tools/swarm_noise.py time --robots 1000 --map env-6

``noise`` prints, for each noise and method, how often all three peaks of J1 hold robots at the end (95 % interval by Wilson), the
share of robots at sources and their distance to the nearest source (means over seeds, 95 % intervals by Student's t). Both
methods start at the same places. ``seeds`` says for how many seeds every source holds three robots; each run is judged by the
referee. ``time`` prints the CPU time of an iteration and of its small steps, the referee left out.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np
from scipy import stats

import lampyris
from lampyris import swarms
from lampyris.kernels import _jit
from lampyris.model.settings.swarm import METHODS, SwarmSettings
from lampyris.sim.swarm.placing import draw_starts
from lampyris.sim.swarm.simulation import RobotSwarm
from lampyris.study.analysis.compare import wilson

NOISES = (0.0, 0.02, 0.05, 0.1, 0.2, 0.5)


def noise(grid: lampyris.Grid, robots: int, seeds: int, iterations: int) -> None:
    """Print the table of noise."""
    print(f"{grid.name}, {robots} robots, {iterations} iterations, {seeds} seeds")
    print("noise  method    all held              robots held (share)    distance to the nearest source, m")
    for deviation in NOISES:
        for method in METHODS:
            found = np.array(
                [
                    _ended(grid, robots, seed, iterations, noise=deviation, method=method)
                    for seed in range(seeds)
                ]
            )
            held = int(found[:, 0].sum())
            low, high = wilson(held, seeds)
            words = f"{deviation:<6g} {method:<9s} {held:3d}/{seeds} [{low:.2f}, {high:.2f}]"
            for column, digits in ((1, 3), (2, 2)):
                values = found[:, column]
                half = stats.t.ppf(0.975, seeds - 1) * values.std(ddof=1) / math.sqrt(seeds)
                mean = values.mean()
                words += f"   {mean:.{digits}f} [{mean - half:.{digits}f}, {mean + half:.{digits}f}]"
            print(words, flush=True)


def _ended(
    grid: lampyris.Grid, robots: int, seed: int, iterations: int, **settings: object
) -> tuple[bool, float, float]:
    """Whether all sources are held, the share of robots that are, and the mean distance to the nearest source."""
    chosen = SwarmSettings.of({**settings, "iterations": iterations}).on(grid)
    assert chosen.radius is not None
    rng = np.random.Generator(np.random.PCG64(seed))
    source = swarms.three_peaks(grid)
    places = draw_starts(grid, robots, chosen.radius, 1e-5 * chosen.radius, rng)
    swarm = RobotSwarm(grid, (source,), chosen, places, seed)
    for _ in range(iterations):
        swarm.advance()
    peaks = np.array(source.places(0.0))
    held = swarms.count_held(swarm.xy[np.newaxis], peaks[np.newaxis], chosen)[0]
    gap = swarm.xy[:, np.newaxis] - peaks
    nearest = np.sqrt((gap * gap).sum(axis=2)).min(axis=1)
    return bool((held >= chosen.capture_robots).all()), held.sum() / robots, float(nearest.mean())


def seeds_held(grid: lampyris.Grid, robots: int, seeds: int, iterations: int) -> None:
    """Print for how many seeds every peak is held by at least three robots, and how near the third is."""
    held, fewest, farthest, late = 0, robots, 0.0, 0
    for seed in range(seeds):
        run = lampyris.swarm_robots(grid, robots=robots, seed=seed, iterations=iterations)
        held += bool(run)
        fewest = min(fewest, int(run.held[-1].min()))
        gap = run.xy[-1][:, np.newaxis] - run.source_xy[-1][np.newaxis]
        farthest = max(farthest, float(np.sort(np.sqrt((gap * gap).sum(axis=2)), axis=0)[2].max()))
        since = run.held_from
        late = max(late, *(iterations if one is None else one for one in since))
        if not run:
            print(f"seed {seed}: held {run.held[-1].tolist()}")
    settings = SwarmSettings().on(grid)
    print(
        f"{grid.name}, {robots} robots of radius {settings.radius:g} m, {iterations} iterations: 3 or more at every peak within "
        f"{settings.capture_radius:g} m in {held} of {seeds} seeds, from iteration {late} at the latest; fewest robots at a peak "
        f"{fewest}; third nearest robot within {farthest:.2f} m; 0 contacts, as the referee measured at every moment"
    )


def step_time(grid: lampyris.Grid, robots: int, seeds: int, iterations: int) -> None:
    """Print CPU time of an iteration and of a small step, the least of some runs, and the mean over the iterations of it."""
    _jit.prefer_compiled()
    settings = SwarmSettings(iterations=iterations).on(grid)
    assert settings.radius is not None
    taken = []
    for seed in range(seeds + 1):
        places = draw_starts(
            grid, robots, settings.radius, 1e-5 * settings.radius, np.random.default_rng(seed)
        )
        swarm = RobotSwarm(grid, (swarms.three_peaks(grid),), settings, places, seed)
        began = time.process_time()
        for _ in range(iterations):
            swarm.advance()
        taken.append(1000 * (time.process_time() - began) / iterations)
    least = min(taken[1:])
    print(
        f"{grid.name}, {robots} robots, {iterations} iterations: {least:.2f} ms of CPU time an iteration, "
        f"{least / settings.steps:.3f} ms a small step ({settings.steps} an iteration; sensing, broadcast and choice included)"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=("noise", "seeds", "time"))
    parser.add_argument("--map", default="env-6")
    parser.add_argument("--robots", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--iterations", type=int, default=300)
    given = parser.parse_args()
    job = {"noise": noise, "seeds": seeds_held, "time": step_time}[given.what]
    job(lampyris.load_grid(given.map), given.robots, given.seeds, given.iterations)
