"""Complete simulations a second: AD-GSO on maps of 50 x 50 cells among 20 random walkers."""

from __future__ import annotations

import contextlib
import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.plain_simulator import NeedsRepair, Simulator

import lampyris
from lampyris._core.system import processors
from lampyris.io.maps import library
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.sim.grid import loop
from lampyris.study.design.study import Study
from lampyris.study.design.study_file import load_study
from lampyris.study.execution.execution import Execution
from lampyris.study.execution.run import run as run_study
from lampyris.study.store.store import Store

TITLE = "Simulations and studies"
HOW = """Complete simulations a second: AD-GSO on three maps of 50 x 50 cells among 20 random walkers, by the
dissertation's rules and its speed law.

- runs: `lampyris.sim.grid.loop.run`, from a seed to a Trace; the field is solved at a map's first run.
- study: the same simulations as a study: jobs as bytes, evidence as bytes, the referee, the metrics, and a
  store on the disk that takes every row before it counts.
- public call: `lampyris.simulate`, which is such a run and the referee's check of every tick. **This is what a
  user of the package calls.**
- plain Python: `benchmarks/plain_simulator.py`, as one would write it without us; it shares no code with
  lampyris, and its field is there before.

Before anything is timed, robot, obstacles and speeds of runs, public call and plain Python are compared. In each round
all implementations are called one after the other. On one core times are of this thread's processor time; two processes are
compared with one process by the clock, everything compiled.

Runs and the public call place the obstacles and make a trace; the public call also has every tick refereed. The plain
simulator does none of this. The field is there beforehand in all of them. A second table has the public call as it
is by default (octile moves, physical law) with four planners. With replayed tracks the
obstacles of each world are drawn, and checked, once for all planners that meet them; a study of one planner
pays for all of that in every run."""

WALKERS, TICKS = 20, 1000
LEAST = {"study": 200.0}
"""Runs a second that are aimed at, of one core."""
BESIDE = {"runs": 10.0, "study": 1.0}
"""How many times as many as plain Python."""
PUBLIC_MAPS, PUBLIC_PLANNERS = ("env-1", "env-3"), ("ad-gso", "astar", "dstar-lite", "sipp")
TWO_CORES = 1.5
"""How many times as many two processes shall do."""

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


class Query:
    """Everybody who can run one query of one map."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.planner = AdGso()
        self.plain = Simulator(scene.grid.blocked.tolist(), scene.start, scene.goal, WALKERS)

    def run(self, seed: int) -> Any:
        """From a seed to a Trace."""
        return loop.run(self.scene, self.planner, seed=seed, ticks=TICKS, law="dissertation")

    def public(self, seed: int) -> Any:
        """As a user of the package calls it."""
        return lampyris.simulate(self.scene, self.planner, seed=seed, ticks=TICKS, law="dissertation")

    def differs(self, seed: int) -> str:
        """What three ways to run it do not agree on; empty: nothing."""
        known, asked = self.run(seed), self.public(seed)
        if not np.array_equal(known.robot, asked.robot) or not np.array_equal(known.speed, asked.speed):
            return "the public call"
        try:
            story = self.plain.run(seed, TICKS)
        except NeedsRepair:
            return "" if any(event.word == "repair" for event in known.events) else "repairing"
        for name, a, b in (
            ("robot", known.robot, story.robot),
            ("speeds", known.speed, story.speeds),
            *(("tracks", *tracks) for tracks in zip(known.tracks, story.tracks, strict=True)),
            ("counts", (known.replans, known.waits), (story.replans, story.waits)),
        ):
            if not np.array_equal(a, b):
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
    """Runs of the plain simulator; one that would have to repair its field is over there."""

    def call(seed: int) -> None:
        with contextlib.suppress(NeedsRepair):
            query.plain.run(seed, TICKS)

    return call


def measure(queries: list[Query], rounds: int, seeds: int) -> dict[str, list[float]]:
    """Microseconds a run by contestant, one number a round."""
    times: dict[str, list[float]] = {who: [] for who in ("runs", "public call", "plain Python")}
    few = max(seeds // 10, 1)
    for k in range(rounds):
        first, mine = 1000 * k, dict.fromkeys(times, 0.0)
        for query in queries:
            mine["runs"] += microseconds(query.run, range(first, first + seeds))
            # These two are slower, and their runs alike: fewer of the same seeds will do.
            mine["public call"] += microseconds(query.public, range(first, first + few))
            mine["plain Python"] += microseconds(plainly(query), range(first, first + few))
        for name, total in mine.items():
            times[name].append(total / len(queries))
    return times


def bench(quick: bool) -> Section:
    """One core, then two, then through a study."""
    prefer_compiled()
    figures: list[Figure] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        one, wrong, compared = _one_core(folder, figures, quick)
        public = _public(figures, quick)
        two = _two_cores(folder, figures, quick)
        studies = _studies(folder, figures, quick)
    text = f"{len(wrong)} of {compared} runs differ between runs, public call and plain Python"
    verdicts = [Verdict(not wrong, "; ".join([text, *wrong[:5]])), *_verdicts(figures)]
    about = versions(["numpy", "numba"]) | {"processes at most": str(min(2, processors()))}
    return Section("study", TITLE, HOW, (one, public, two, studies), tuple(figures), tuple(verdicts), about)


def _one_core(folder: Path, figures: list[Figure], quick: bool) -> tuple[Table, list[str], int]:
    queries, seeds, rounds = (2, 20, 3) if quick else (5, 20, 7)
    rows, wrong, compared = [], [], 0
    spent: dict[str, list[list[float]]] = {}
    for name, found in queries_of(study_of(folder, "live", queries, 1)):
        for query in found:
            said = [query.differs(seed) for seed in range(1 if quick else 3)]
            compared += len(said)
            wrong += [f"{name}: {s}" for s in said if s]
        times = measure(found, rounds, seeds)
        for who, us in times.items():
            spent.setdefault(who, []).append(us)
        rates = (Spread.of(us).rate(1e6) for us in times.values())
        rows.append((name, *(f"{rate.middle:,.0f}" for rate in rates)))
    # Every map counts alike: of each round the mean time over the maps.
    mean = {
        who: Spread.of([statistics.fmean(us) for us in zip(*maps, strict=True)])
        for who, maps in spent.items()
    }
    rates = {who: us.rate(1e6) for who, us in mean.items()}
    figures += [_beside(who, rates[who], rates["plain Python"]) for who in rates if who != "plain Python"]
    rows.append(("all", *(f"{rate.middle:,.0f}" for rate in rates.values())))
    title = f"Runs a second on one core: {queries} queries a map, {seeds} seeds, {rounds} rounds"
    return Table(("map", *rates), tuple(rows), title), wrong, compared


def _beside(who: str, ours: Spread, theirs: Spread) -> Figure:
    return Figure(
        f"{who}, one core", "runs a second", ours, "plain Python", theirs, more_is_better=True,
        asked=BESIDE.get(who),
    )  # fmt: skip


def _public(figures: list[Figure], quick: bool) -> Table:
    """`lampyris.simulate` with its defaults, planner by planner, by turns with the rules in plain Python."""
    seeds, rounds = (2, 2) if quick else (10, 7)
    rows = []
    for name in PUBLIC_MAPS:
        ground = library.load(name)
        start, goal = ground.queries[0].start, ground.queries[0].goal
        traffic = RandomWalk(WALKERS)
        scene = Scene(ground.grid, start, goal, traffic=(traffic,))
        plain = Query(Scene(ground.grid, start, goal, moves="dissertation", traffic=(traffic,)))
        calls: dict[str, Callable[[int], Any]] = {
            planner: lambda seed, s=scene, p=planner: lampyris.simulate(s, p, seed=seed)
            for planner in PUBLIC_PLANNERS
        }
        calls["plain Python"] = plainly(plain)
        times: dict[str, list[float]] = {who: [] for who in calls}
        for k in range(rounds + 1):
            for who, call in calls.items():
                us = microseconds(call, range(1000 * k, 1000 * k + seeds))
                if k:  # the first round compiles what is not yet compiled
                    times[who].append(us)
        rates = {who: Spread.of(us).rate(1e6) for who, us in times.items()}
        figures += [
            _beside(f"public call, {planner}, {name}", rates[planner], rates["plain Python"])
            for planner in PUBLIC_PLANNERS
        ]
        rows.append(
            (name, *(f"{rate.middle:,.0f} ({rate.low:,.0f} to {rate.high:,.0f})" for rate in rates.values()))
        )
    title = f"The public call `lampyris.simulate`, runs a second on one core: {seeds} seeds, {rounds} rounds"
    return Table(("map", *PUBLIC_PLANNERS, "plain Python (ad-gso)"), tuple(rows), title)


@cache
def _queries(folder: Path) -> list[Query]:
    """What a process of :func:`_two_cores` runs: made once."""
    prefer_compiled()
    return [query for _, found in queries_of(study_of(folder, "live", 1, 1)) for query in found]


def _share(folder: Path, seeds: range) -> int:
    """One process's share: how many runs it made."""
    queries = _queries(folder)
    for query in queries:
        for seed in seeds:
            query.run(seed)
    return len(queries) * len(seeds)


def _two_cores(folder: Path, figures: list[Figure], quick: bool) -> Table:
    """The same runs by one process and by two, by the clock."""
    seeds, rounds = (20, 3) if quick else (100, 5)
    crew = min(2, processors())
    folders = [folder / f"process {k}" for k in range(crew)]
    for place in folders:
        place.mkdir()
    rates: dict[int, list[float]] = {1: [], crew: []}
    with ProcessPoolExecutor(crew, mp_context=multiprocessing.get_context("spawn")) as pool:
        # Each process meets each folder and compiles, or loads, its kernels.
        for _ in range(2):
            list(pool.map(_share, folders, [range(2)] * crew))
        for k in range(rounds + 1):
            for many in sorted(rates):
                shares = [range(1000 * k, 1000 * k + seeds)] * many
                began = time.perf_counter()
                runs = sum(pool.map(_share, folders[:many], shares))
                if k:
                    rates[many].append(runs / (time.perf_counter() - began))
    spreads = {many: Spread.of(found) for many, found in rates.items()}
    rows = [(f"{many}", f"{s.middle:,.0f} ({s.low:,.0f} to {s.high:,.0f})") for many, s in spreads.items()]
    if crew > 1:
        figures.append(
            Figure(
                "runs, two processes",
                "runs a second",
                spreads[crew],
                "one process",
                spreads[1],
                more_is_better=True,
                asked=TWO_CORES,
            )
        )
    return Table(("processes", "runs a second, by the clock"), tuple(rows), "Runs on one core and on two")


def _studies(folder: Path, figures: list[Figure], quick: bool) -> Table:
    """Through the study: rows refereed, measured and stored."""
    plain = next(f.theirs for f in figures if f.rival == "plain Python")
    assert plain is not None
    rows, crew = [], min(2, processors())
    for tracks in ("live", "replayed"):
        queries, seeds, rounds = (2, 10, 3) if quick else (5, 20, 3)
        if tracks == "replayed":
            seeds, rounds = (2, 1) if quick else (4, 2)
        by_cpu, by_clock = through_the_study(study_of(folder, tracks, queries, seeds), rounds, 1)
        figures.append(_beside("study" if tracks == "live" else f"study, {tracks} tracks", by_cpu, plain))
        rows.append((tracks, "1", f"{by_cpu.middle:,.0f}", f"{by_clock.middle:,.0f}"))
        if tracks == "live" and crew > 1 and not quick:
            # Enough jobs that starting the processes, which a study pays for once, is not all there is.
            many = study_of(folder, tracks, queries, seeds * 4)
            alone, both = (through_the_study(many, 2, workers)[1] for workers in (1, crew))
            rows += [
                (f"live, {len(many):,} runs", "1", "", f"{alone.middle:,.0f}"),
                (f"live, {len(many):,} runs", "2", "", f"{both.middle:,.0f}"),
            ]
            figures.append(
                Figure(
                    "study, two processes",
                    "runs a second",
                    both,
                    "one process",
                    alone,
                    more_is_better=True,
                    note="starting the processes and loading their kernels included",
                )
            )
    heads = ("tracks", "processes", "rows a second of processor time", "by the clock")
    return Table(heads, tuple(rows), "Through a study with its store")


def through_the_study(study: Study, rounds: int, workers: int) -> tuple[Spread, Spread]:
    """Rows a second of this thread's processor time, and by the clock; the first round warms up."""
    by_cpu, by_clock = [], []
    for k in range(rounds + (workers == 1)):
        with tempfile.TemporaryDirectory() as name, Store.create(Path(name) / "rows.sqlite", study) as store:
            cpu, wall = time.thread_time(), time.perf_counter()
            finished = run_study(study, store.add, where=Execution(workers=workers))
            cpu, wall = time.thread_time() - cpu, time.perf_counter() - wall
            assert len(store) == finished.ran == len(study)
            assert not finished.failed
        if k or workers > 1:
            by_cpu.append(len(study) / cpu)
            by_clock.append(len(study) / wall)
    return Spread.of(by_cpu), Spread.of(by_clock)


def _verdicts(figures: list[Figure]) -> list[Verdict]:
    out = []
    for f in figures:
        who = f.task.removesuffix(", one core")
        if who in LEAST:
            text = f"{who}: {f.ours.middle:,.0f} runs a second on one core; {LEAST[who]:,.0f} aimed at"
            out.append(Verdict(f.ours.middle >= LEAST[who], text))
        if f.asked is not None and f.theirs is not None:
            text = f"{f.task}: {f.ratio:.3g} times as many as {f.rival} ({f.theirs.middle:,.0f}); "
            out.append(Verdict(bool(f.holds), f"{text}{f.asked:g} asked"))
    return out
