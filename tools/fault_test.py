"""Fault test: whatever the sensor does, the robot comes to rest in time or says why it stopped.

``python tools/fault_test.py [--runs 50] [--seed 0] [--jobs 2]``

Each fault of the sensor is put in at a random moment of ``--runs`` drives among moving obstacles. The robot
must stand within ``(v + a_max p) / d_max + p`` seconds of it, with v its speed then and p its period (within
which it cannot know yet), or end with a typed reason. No exception is allowed. One line a claim, then the
table.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from drive_runs import (
    PLANNERS,
    RADIUS,
    ROBOT,
    TOP_SPEED,
    claim,
    draws,
    header,
    many,
    small_scene,
    table,
)
from lampyris.model.drive import Drive
from lampyris.model.traffic import RandomWalk
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import drive
from lampyris.sim.sensor import FAULTS, FaultySensor
from lampyris.sim.traffic.adversary import Adversary


@dataclass(frozen=True, slots=True)
class Row:
    """One run: how fast the robot was when the fault began, and how long until it stood (infinity: never).

    ``typed``: it ended without an arrival, standing, with a reason in words. ``broken``: an exception or what
    the referee refused.
    """

    kind: str
    number: int
    speed: float
    took: float
    allowed: float
    outcome: str
    typed: bool
    broken: str


def faulty(seed: int, kind: str, number: int, law: str = "physical") -> tuple[Drive, float]:
    """One drive and when its fault began."""
    scene = small_scene(seed, number)
    rng = draws(seed, number, 2)
    at = 1.0 + float(rng.random()) * 8.0
    sensor = FaultySensor(kind, at, goal=scene.goal)
    scene = replace(scene, traffic=(RandomWalk(3, radius=RADIUS),))
    source = Adversary(top_speed=TOP_SPEED, count=2, radius=RADIUS, wait=4.0)
    made = drive(
        scene,
        PLANNERS["astar"],
        law=law,
        seed=number,
        sources=(source,),
        obstacle_speed=TOP_SPEED,
        sensor=sensor,
    )
    return made, at


def stands_after(made: Drive, at: float) -> float:
    """Seconds from ``at`` until the robot first stands; infinity if it never does."""
    t, v, a = made.t, made.v, made.a
    for k in range(len(t)):
        end = t[k + 1] if k + 1 < len(t) else np.inf
        if end < at:
            continue
        begin = max(float(t[k]), at)
        if v[k] + a[k] * (begin - t[k]) <= 1e-9:
            return max(begin - at, 0.0)
    return float("inf")


def one(seed: int, law: str, job: tuple[str, int]) -> Row:
    """One run."""
    kind, number = job
    try:
        made, at = faulty(seed, kind, number, law)
    except Exception as error:
        return Row(
            kind, number, 0.0, float("inf"), 0.0, "exception", False, f"{type(error).__name__}: {error}"
        )
    verdict = check_drive(made)
    speed = float(made.at(np.array([at]))[1][0]) if at <= made.duration else 0.0
    took = stands_after(made, at) if at <= made.duration else 0.0
    allowed = (speed + ROBOT.a_max * made.period) / ROBOT.d_max + made.period
    typed = not made.arrived and float(made.v[-1]) == 0.0 and bool(made.sentence)
    broken = "" if verdict is None else str(verdict)
    return Row(kind, number, speed, took, allowed, made.outcome.value, typed, broken)


def good(row: Row) -> bool:
    """Whether it came to rest in time or said why it stopped."""
    return not row.broken and (row.took <= row.allowed + 1e-9 or row.typed)


def main(argv: list[str] | None = None) -> int:
    """Run all and print; 0 if every claim holds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=50, help="runs of each fault")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--law", default="physical")
    parser.add_argument("--jobs", type=int, default=1)
    told = parser.parse_args(argv)
    print(header(seed=told.seed, law=told.law, planner="astar", obstacles="3 random walkers, 2 cutters"))
    jobs = [(kind, k) for kind in FAULTS for k in range(told.runs)]
    rows = many(partial(one, told.seed, told.law), jobs, told.jobs, "faults")
    holds, lines = True, []
    for kind in FAULTS:
        mine = [r for r in rows if r.kind == kind]
        fine = sum(map(good, mine))
        holds &= fine == len(mine)
        print(
            claim(fine == len(mine), f"{kind}: {fine} of {len(mine)} stand in time or say why they stopped")
        )
        for r in [r for r in mine if not good(r)][:5]:
            print(f"  run {r.number}: {r.outcome}, {r.took:.3g} s of {r.allowed:.3g} s; {r.broken}")
        moved = [r for r in mine if r.speed > 0]
        slow = max((r.took - r.speed / ROBOT.d_max for r in moved), default=0.0)
        ends = sorted({r.outcome for r in mine})
        count = [f"{e} {sum(r.outcome == e for r in mine)}" for e in ends]
        in_time = sum(r.took <= r.allowed + 1e-9 for r in mine)
        fastest = max((r.speed for r in mine), default=0.0)
        lines.append([kind, len(mine), f"{fastest:.2f}", in_time, f"{slow:.3f}", ", ".join(count)])
    print()
    head = ("fault", "runs", "fastest, m/s", "stood in time", "worst time beyond v / d, s", "ends")
    print(table(head, lines))
    return 0 if holds else 1


if __name__ == "__main__":
    raise SystemExit(main())
