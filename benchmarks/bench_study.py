"""Complete simulations a second: AD-GSO on maps of 50 x 50 cells among 20 random walkers, on one core.

    python -m benchmarks.bench_study [--quick] [--json FILE]

What is timed
-------------
* kernels: the kernel that runs of :class:`lampyris.sim.fast.FastRuns` spend their ticks in, call included.
* runs: the same runs whole, from a seed to a Trace; what the runs of a query share is made before.
* study: the same simulations as a study in this process: jobs as bytes, evidence as bytes, the referee, the
  metrics, and a store on the disk that takes every row before it counts.
* loop: :func:`lampyris.sim.loop.run`, which can be watched tick by tick, and solves its field each time.
* plain Python: :mod:`benchmarks.plain_simulator`, which shares no code with lampyris; its field is there
  before.

Before anything is timed, robot, obstacles and speeds of kernels, loop and plain Python are compared. Rounds
go through all contestants in turn, so that a busy neighbour hurts all alike. Times are of this thread's
processor time, of the study by the clock besides; the middle of the rounds counts.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.bench_field import machine
from benchmarks.plain_simulator import NeedsMending, Simulator

from lampyris.kernels import simulate
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planners.ad_gso import AdGso
from lampyris.sim import fast, loop
from lampyris.study.design import Study
from lampyris.study.file import load_study
from lampyris.study.run import run as run_study
from lampyris.study.store import Store

WALKERS, TICKS = 20, 1000
LEAST = {"kernels": 2000.0, "study": 200.0}
"""Runs a second that are aimed at."""

STUDY = """
version: 1
name: throughput
preset: dissertation
maps:
  - {{bundled: env-1, limit: {queries}}}
  - {{bundled: env-3, limit: {queries}}}
  - {{recipe: random, size: [50, 50], seed: 50, settings: {{density: 0.2}}, name: random 20 %,
     queries: {{random: {queries}, least: 30}}}}
planners: [ad-gso]
traffic: [{{kind: random-walk, tracks: {tracks}, count: 20}}]
ticks: 1000
seeds: {seeds}
"""


def study_of(folder: Path, tracks: str, queries: int, seeds: int) -> Study:
    """The study, from a file as anybody would write it."""
    path = folder / "throughput.yaml"
    path.write_text(STUDY.format(tracks=tracks, queries=queries, seeds=seeds))
    return load_study(path)


class KernelClock:
    """Seconds spent in the kernel of whole simulations, in place of which it stands."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._kernel = simulate.drive_ticks.compiled()

    def __call__(self, *args: Any) -> Any:
        began = time.thread_time()
        out = self._kernel(*args)
        self.seconds += time.thread_time() - began
        return out


class Query:
    """Everybody who can run one query of one map."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.planner = AdGso()
        self.fast = fast.FastRuns(scene, self.planner)
        self.plain = Simulator(scene.grid.blocked.tolist(), scene.start, scene.goal, WALKERS)

    def loop(self, seed: int) -> Any:
        """Tick by tick."""
        return loop.run(self.scene, self.planner, seed=seed, ticks=TICKS, law="dissertation")

    def differs(self, seed: int) -> str:
        """What three ways to run it do not agree on; empty: nothing."""
        known, made = self.loop(seed), self.fast.run(seed, TICKS)
        try:
            story = self.plain.run(seed, TICKS)
        except NeedsMending:
            return "" if made is None else "mending"
        if made is None:
            return "the kernel gave up"
        for name, a, b, c in (
            ("robot", known.robot, made.robot, story.robot),
            ("speeds", known.speed, made.speed, story.speeds),
            *(("tracks", *tracks) for tracks in zip(known.tracks, made.tracks, story.tracks, strict=True)),
            ("counts", *((t.replans, t.waits) for t in (known, made, story))),
        ):
            if not (np.array_equal(a, b) and np.array_equal(a, c)):
                return f"{name} of {self.scene.start} to {self.scene.goal}, seed {seed}"
        return ""


def queries_of(study: Study) -> Iterator[tuple[str, list[Query]]]:
    """Its queries by map."""
    for ground in study.grounds.values():
        found = [
            Query(Scene(ground.grid, w.start, w.goal, moves="dissertation", traffic=(RandomWalk(WALKERS),)))
            for w in study.worlds
            if w.ground.hash == ground.hash
        ]
        yield ground.name, found


def microseconds(call: Callable[[int], Any], seeds: range) -> float:
    """Of this thread's processor time, a call."""
    began = time.thread_time()
    for seed in seeds:
        call(seed)
    return 1e6 * (time.thread_time() - began) / len(seeds)


def plainly(query: Query) -> Callable[[int], Any]:
    """Runs of the plain simulator; one that would have to mend its field is over there."""

    def call(seed: int) -> None:
        with contextlib.suppress(NeedsMending):
            query.plain.run(seed, TICKS)

    return call


def measure(queries: list[Query], rounds: int, seeds: int) -> dict[str, list[float]]:
    """Microseconds a run by contestant, one number a round."""
    times: dict[str, list[float]] = {"kernels": [], "runs": [], "loop": [], "plain Python": []}
    few = max(seeds // 10, 1)
    for k in range(rounds):
        first, mine = 1000 * k, dict.fromkeys(times, 0.0)
        for query in queries:
            # The loop and plain Python are slow, and their runs alike: fewer of the same seeds will do.
            mine["loop"] += microseconds(query.loop, range(first, first + few))
            mine["plain Python"] += microseconds(plainly(query), range(first, first + few))
            mine["runs"] += microseconds(lambda s, q=query: q.fast.run(s, TICKS), range(first, first + seeds))
            clock = KernelClock()
            plain, simulate.drive_ticks = simulate.drive_ticks, clock  # type: ignore[assignment]
            try:
                microseconds(lambda s, q=query: q.fast.run(s, TICKS), range(first, first + seeds))
            finally:
                simulate.drive_ticks = plain
            mine["kernels"] += 1e6 * clock.seconds / seeds
        for name, total in mine.items():
            times[name].append(total / len(queries))
    return times


def through_the_study(folder: Path, tracks: str, queries: int, seeds: int, rounds: int) -> dict[str, Any]:
    """Runs a second of the study, its rows in a store; the first round warms up."""
    study = study_of(folder, tracks, queries, seeds)
    by_cpu, by_clock = [], []
    for k in range(rounds + 1):
        with Store.create(folder / f"{tracks}-{k}.sqlite", study) as store:
            cpu, wall = time.thread_time(), time.perf_counter()
            finished = run_study(study, store.add)
            cpu, wall = time.thread_time() - cpu, time.perf_counter() - wall
            assert len(store) == finished.ran == len(study)
            assert not finished.failed
        if k:
            by_cpu.append(len(study) / cpu)
            by_clock.append(len(study) / wall)
    cpu, wall = statistics.median(by_cpu), statistics.median(by_clock)
    print(f"study, {tracks} tracks: {cpu:,.0f} runs a second of processor time, {wall:,.0f} by the clock")
    return {"tracks": tracks, "runs": len(study), "per_cpu_s": by_cpu, "per_s": by_clock}


def run(folder: Path, quick: bool) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Every map, then the study; prints a line for each as it is done."""
    queries, seeds, rounds = (2, 20, 3) if quick else (5, 50, 7)
    rows, wrong, compared = [], [], 0
    print(f"microseconds a run (runs a second), {queries} queries a map, {WALKERS} random walkers")
    print(f"{'map':<14}" + "".join(f"{n:<20}" for n in ("kernels", "runs", "loop", "plain Python")))
    for name, found in queries_of(study_of(folder, "live", queries, 1)):
        for query in found:
            said = [query.differs(seed) for seed in range(1 if quick else 3)]
            compared += len(said)
            wrong += [f"{name}: {s}" for s in said if s]
        times = measure(found, rounds, seeds)
        rows.append({"map": name, "us": times})
        middle = {who: statistics.median(t) for who, t in times.items()}
        print(
            f"{name:<14}" + "".join(f"{f'{t:,.0f} ({1e6 / t:,.0f})':<20}" for t in middle.values()),
            flush=True,
        )
    print(f"equal: {compared - len(wrong)} of {compared} runs" + "".join(f"; {w}" for w in wrong[:5]))
    studies = [
        through_the_study(folder, "live", queries, 10 if quick else 40, rounds),
        through_the_study(folder, "replayed", queries, 2 if quick else 4, 1 if quick else 3),
    ]
    return rows, studies


def verdicts(rows: list[dict[str, Any]], studies: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The acceptance claims, one line each."""
    middle = {who: statistics.fmean(statistics.median(r["us"][who]) for r in rows) for who in rows[0]["us"]}
    speed = {who: 1e6 / us for who, us in middle.items()}
    speed["study"] = statistics.median(studies[0]["per_cpu_s"])
    out = [
        {
            "claim": who,
            "holds": speed[who] >= least,
            "text": f"{who}: {speed[who]:,.0f} runs a second; {least:,.0f} aimed at",
        }
        for who, least in LEAST.items()
    ]
    for who in ("kernels", "runs", "study"):
        ratio = speed[who] / speed["plain Python"]
        text = (
            f"{who}: {ratio:.3g} times as many runs a second as plain Python ({speed['plain Python']:,.0f})"
        )
        out.append({"claim": f"{who} beside plain Python", "holds": ratio > 1.0, "text": text})
    return out


def main() -> int:
    """Run, print, judge. The exit code is 0 whatever the verdicts: a benchmark informs, it does not gate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer queries, seeds and rounds")
    parser.add_argument("--json", metavar="FILE", help="write everything there")
    args = parser.parse_args()
    about = machine()
    print(", ".join(f"{k} {v}" for k, v in about.items()))
    with tempfile.TemporaryDirectory() as folder:
        rows, studies = run(Path(folder), args.quick)
    judged = verdicts(rows, studies)
    for v in judged:
        print(("HOLDS  " if v["holds"] else "SHORT  ") + v["text"])
    if args.json:
        report = {"machine": about, "rows": rows, "studies": studies, "verdicts": judged}
        Path(args.json).write_text(json.dumps(report, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
