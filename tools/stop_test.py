"""Stop test: does the robot ever touch anybody while it moves, and does it still arrive?

``python tools/stop_test.py [--n 10000] [--seed 0] [--laws physical,rpp] [--jobs 2]``

First part: n runs on small maps, in each of which an obstacle of the stated top speed cuts in at a random
time and place; a hit of the standing robot ends the run. Second part: ten obstacles on the six bundled maps
of 50 x 50 cells, every stored query ``--rounds`` times with each kind of traffic; after a hit the robot goes
on. Every drive is judged by the referee. One line a claim, then the table.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from drive_runs import (
    LAWS,
    PLANNERS,
    TRAFFIC,
    Row,
    claim,
    crowded,
    cut_in,
    header,
    many,
    queries,
    row_of,
    table,
)

SHARE, RATIO = 0.95, 1.5
"""What must arrive, and in how many times the optimum: the robot's limits on its first way, nobody about."""

CLAIMED = ("walk",)
"""Obstacles among which the robot must arrive in time. The others may run into a robot that stands, and keep
it there for as long as they please: that is told, not claimed."""


def one_cut(seed: int, planner: str, job: tuple[int, str]) -> Row:
    """One run of the first part."""
    number, law = job
    return row_of(cut_in(seed, number, law, planner), "small", law, number)


def one_crowd(seed: int, planner: str, count: int, job: tuple[int, str, str]) -> Row:
    """One run of the second part."""
    number, law, traffic = job
    return row_of(crowded(seed, number, law, traffic, count, planner), traffic, law, number)


def in_time(rows: list[Row]) -> float:
    """Share that arrives within 1.5 times the optimum."""
    return sum(r.ratio <= RATIO for r in rows) / len(rows) if rows else 0.0


def line_of(name: str, law: str, rows: list[Row]) -> list[object]:
    """A row of the table."""
    n = max(len(rows), 1)
    arrived = [r.ratio for r in rows if r.outcome == "arrived"]
    ratios = [r for r in arrived if np.isfinite(r)]
    own = [r.own for r in rows if np.isfinite(r.own)]
    ends = Counter(r.outcome for r in rows if r.outcome != "arrived")
    return [
        name,
        law,
        len(rows),
        sum(r.collisions > 0 for r in rows),
        sum(r.hits > 0 for r in rows),
        f"{100 * len(arrived) / n:.1f} %",
        f"{100 * in_time(rows):.1f} %",
        f"{np.mean(ratios):.3f}" if ratios else "-",
        f"{np.quantile(ratios, 0.95):.3f}" if ratios else "-",
        f"{np.mean(own):.3f}" if own else "-",
        f"{np.mean([r.stood for r in rows]):.1f}" if rows else "-",
        f"{max((r.lateral for r in rows), default=0.0):.2f}",
        ", ".join(f"{k} {v}" for k, v in sorted(ends.items())) or "-",
        sum(bool(r.refused) for r in rows),
    ]


HEAD = (
    "obstacles",
    "law",
    "runs",
    "with a collision while moving",
    "with a hit while standing",
    "arrived",
    f"within {RATIO:g} of the optimum",
    "mean ratio",
    "95 % ratio",
    "mean ratio to the law alone",
    "stood, s",
    "lateral, m/s2",
    "other ends",
    "refused",
)


def groups(rows: list[Row]) -> list[tuple[str, str, list[Row]]]:
    """Rows by obstacles and law, in order of first appearance."""
    keys = list(dict.fromkeys((r.name, r.law) for r in rows))
    return [(*key, [r for r in rows if (r.name, r.law) == key]) for key in keys]


def tell_of_failures(rows: list[Row], law: str, most: int) -> None:
    """The first runs of a law that broke a promise, by number, so that they can be run again."""
    bad = [r for r in rows if r.law == law and (r.collisions or r.refused)]
    for r in bad[:most]:
        print(f"  {r.name} run {r.number}, {law}: {r.outcome}: {r.refused or r.detail}")
    late = [r for r in rows if r.law == law and r.ratio > RATIO and r.outcome != "hit"]
    for r in late[:most]:
        print(f"  late: {r.name} run {r.number}, {law}: {r.outcome}, ratio {r.ratio:.2f}: {r.detail}")


def main(argv: list[str] | None = None) -> int:
    """Run both parts and print; 0 if every claim holds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=10_000, help="runs of the first part, for each law")
    parser.add_argument("--rounds", type=int, default=12, help="runs of each query of the second part")
    parser.add_argument("--count", type=int, default=10, help="obstacles of the second part")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--laws", default=",".join(LAWS))
    parser.add_argument("--planner", choices=sorted(PLANNERS), default="astar")
    parser.add_argument("--traffic", default=",".join(TRAFFIC))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--tell", type=int, default=10, help="failures told of")
    told = parser.parse_args(argv)
    laws, kinds = told.laws.split(","), told.traffic.split(",") if told.traffic else []
    print(header(seed=told.seed, planner=told.planner, count=told.count))
    cuts = [(k, law) for law in laws for k in range(told.n)]
    first = many(partial(one_cut, told.seed, told.planner), cuts, told.jobs, "cut in")
    total = told.rounds * len(queries()) if kinds else 0
    crowds = [(k, law, kind) for kind in kinds for law in laws for k in range(total)]
    work = partial(one_crowd, told.seed, told.planner, told.count)
    second = many(work, crowds, told.jobs, "crowd")
    holds = True
    ours = [r for r in (*first, *second) if r.law == "physical"]
    if ours:
        hit = sum(r.collisions > 0 for r in ours if r.name == "small")
        runs = sum(r.name == "small" for r in ours)
        verdicts = [(hit == 0, f"collisions while the robot moves, physical: {hit} of {runs}; must be 0")]
        refused = sum(bool(r.refused) for r in ours)
        verdicts.append((refused == 0, f"drives the referee refuses, physical: {refused} of {len(ours)}"))
        for kind in kinds:
            mine = [r for r in ours if r.name == kind]
            crash = sum(r.collisions > 0 for r in mine)
            what = f"{told.count} obstacles ({kind}), physical: {crash} of {len(mine)} with a collision"
            verdicts.append((crash == 0, what))
            if kind not in CLAIMED:
                continue
            share = in_time(mine)
            what = f"{told.count} obstacles ({kind}), physical: {100 * share:.1f} % arrive within {RATIO:g}"
            verdicts.append((share >= SHARE, f"{what} times the optimum; must be {100 * SHARE:g} %"))
        for good, sentence in verdicts:
            holds &= good
            print(claim(good, sentence))
        tell_of_failures(ours, "physical", told.tell)
    print()
    print(table(HEAD, [line_of(*group) for group in groups([*first, *second])]))
    return 0 if holds else 1


if __name__ == "__main__":
    raise SystemExit(main())
