"""Acceptance: seeded simulations on the bundled 50x50 maps, 5 to 60 moving obstacles of all four kinds.

Every trace is judged by the referee. ``pytest -m nightly -s tests/sim/test_sim_acceptance.py`` runs 2,000 and
prints arrival by density and kind, and why the others ended as they did.
"""

from __future__ import annotations

import re
import time
from collections import Counter, defaultdict

import numpy as np
import pytest
from sim_planners import Scripted, fail

from lampyris import referee
from lampyris.errors import SceneError
from lampyris.io.maps import library
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.planning import registry
from lampyris.sim.grid.loop import run

pytestmark = pytest.mark.nightly

MAPS = [f"env-{k}" for k in range(1, 7)]
DENSITIES = (5, 10, 20, 40, 60)
ROUNDS = ("random-walk", "crossing", "random-walk", "patrol", "random-walk", "recorded", "mixed")
"""One round is every map, query and density once: 150 simulations."""


def case(k):
    """Map, query, density, kind and seed of simulation k."""
    return MAPS[k % 6], k // 6 % 5, DENSITIES[k // 30 % 5], ROUNDS[k // 150 % len(ROUNDS)], k


def tracks(scene, count, ticks, repeats, seed):
    """Tracks that never meet: walkers watched for a while, then back the same way, again and again."""
    walkers = Scene(scene.grid, scene.start, scene.goal, scene.moves, traffic=RandomWalk(count))
    watched = run(walkers, Scripted((fail(),)), seed=seed, ticks=ticks, patience=ticks)
    for track in watched.tracks:
        there = [(x, y) for x, y in track.tolist()]
        yield Recorded(tuple((there + there[-2:0:-1]) * repeats))


def patrols(scene, count, taken, rng):
    """Patrols between cells that the start is joined with, each from a cell of its own."""
    from lampyris.planning.field.solve import solve

    joined = solve(~scene.grid.blocked, scene.moves, scene.start).exact > 0
    for x, y in taken | {scene.start, scene.goal}:
        joined[y, x] = False
    ys, xs = np.nonzero(joined)
    order = rng.permutation(len(xs))
    cells = [(int(xs[i]), int(ys[i])) for i in order[: 3 * count]]
    return [Patrol(tuple(cells[k::count])) for k in range(count)]


def traffic_of(scene, kind, count, seed):
    """Specifications of ``count`` obstacles of one kind, or a quarter of each."""
    rng = np.random.default_rng((seed, 99))
    if kind == "random-walk":
        # In every other round they appear one a tick, as the dissertation has it.
        return (RandomWalk(count, rate=1.0 if seed // 300 % 2 else None),)
    if kind == "crossing":
        return (Crossing(count),)
    if kind == "patrol":
        return tuple(patrols(scene, count, set(), rng))
    if kind == "recorded":
        return tuple(tracks(scene, count, 60, 6, seed))
    quarter = max(count // 4, 1)
    recorded = list(tracks(scene, quarter, 12, 20, seed))
    lanes = {cell for one in recorded for cell in one.track}
    rest = count - 3 * quarter
    return (
        *recorded,
        RandomWalk(rest),
        Crossing(quarter),
        *patrols(scene, quarter, lanes, rng),
    )


def simulate(k, planner):
    """Simulation k: (density, kind, trace). Traffic that does not fit together is drawn again."""
    name, query, density, kind, seed = case(k)
    document = library.load(name)
    asked = document.queries[query]
    scene = Scene(document.grid, asked.start, asked.goal)
    for again in range(40):
        traffic = traffic_of(scene, kind, density, seed + 10_000 * again)
        try:
            full = Scene(document.grid, asked.start, asked.goal, traffic=traffic)
            return density, kind, run(full, planner, seed=seed)
        except SceneError:
            # Only a mixture can be wrong: a patrol whose way crosses a lane that cannot be gone round.
            if kind != "mixed":
                raise
    raise AssertionError(f"simulation {k}: no traffic of that kind fits")


def accept(cases, say):
    planner = registry.make("ad-gso", {})
    arrived, ended, reasons = defaultdict(list), defaultdict(Counter), Counter()
    ticks = waits = replans = 0
    planning = total = judging = 0.0
    began = time.perf_counter()
    for k in cases:
        density, kind, trace = simulate(k, planner)
        mark = time.perf_counter()
        violation = referee.check_trace(trace)
        judging += time.perf_counter() - mark
        assert violation is None, (k, case(k), violation)
        assert trace.collisions == 0
        arrived[kind, density].append(trace.arrived)
        ended[kind][trace.outcome.value] += 1
        if not trace.arrived:
            assert trace.detail, case(k)
            reasons[trace.outcome.value, re.sub(r"\(\d+, \d+\)", "(x, y)", trace.sentence)] += 1
        ticks, waits, replans = ticks + trace.ticks, waits + trace.waits, replans + trace.replans
        planning += trace.timing["planning_s"]
        total += trace.timing["total_s"]
    spent = time.perf_counter() - began
    if say:
        kinds = list(dict.fromkeys(ROUNDS))
        print(f"\n{len(cases)} simulations, 0 violations by the referee; arrived, by kind and density:")
        print(f"{'':14}" + "".join(f"{d:>15}" for d in DENSITIES))
        for kind in kinds:
            row = [arrived[kind, d] for d in DENSITIES]
            print(f"{kind:14}" + "".join(f"{sum(a):>5}/{len(a):<3} {np.mean(a):5.1%}" for a in row if a))
        every = [[one for kind in kinds for one in arrived[kind, d]] for d in DENSITIES]
        print(f"{'all':14}" + "".join(f"{sum(a):>5}/{len(a):<3} {np.mean(a):5.1%}" for a in every if a))
        for kind in kinds:
            print(f"{kind:14}" + ", ".join(f"{w} {n}" for w, n in ended[kind].most_common()))
        for (word, sentence), n in reasons.most_common(12):
            print(f"{n:5} x {word}: {sentence}")
        print(
            f"ticks {ticks}, waits {waits}, replans {replans}; {spent:.0f} s: simulating {total:.0f} s, "
            f"{1e3 * total / len(cases):.0f} ms each (planning {planning:.0f} s), refereeing {judging:.0f} s"
        )
    return arrived


def test_a_sample_on_the_bundled_maps():
    arrived = accept(range(0, 2000, 91), say=False)
    every = [a for some in arrived.values() for a in some]
    assert len(every) == 22
    assert np.mean(every) >= 0.8


def test_two_thousand_simulations():
    arrived = accept(range(2000), say=True)
    assert np.mean(arrived["random-walk", 20]) >= 0.95
