"""Speed control against position control under late commands: the tables of docs/speed/tracking.md.

``python tools/tracking_table.py [--runs 10] [--write]``

Every cell is the mean over the runs. Without obstacles: the maximum distance between where the robot was
and where it was commanded to be, and seconds over those of perfect tracking. Among ten walkers: seconds over
those of the time optimum for the runs that arrived, how many did, and collisions. ``--write`` puts them into
the page.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from lampyris.io.maps.library import load
from lampyris.model.drive import Drive
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import RandomWalk
from lampyris.planning.graph.astar import AStar
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import drive

RATES = (20, 10, 5, 2, 1)
DELAYS = (0.0, 0.1, 0.25, 0.5)
ROBOT = Robot(radius=0.3, v_max=1.0, a_max=0.5, d_max=1.0)
PAGE = Path(__file__).resolve().parent.parent / "docs" / "speed" / "tracking.md"
BEGIN, END = "<!-- tables -->", "<!-- end of tables -->"


def judged(scene: Scene, seed: int, **settings: object) -> Drive:
    """A drive that the referee has seen."""
    made = drive(scene, AStar(), seed=seed, obstacle_speed=0.5, **settings)
    verdict = check_drive(made)
    if verdict is not None:
        raise SystemExit(f"seed {seed}, {settings}: {verdict}")
    return made


def table(title: str, cell) -> list[str]:
    """Rates down, both controls with their delays across."""
    head = [f"{kind}, {delay:g} s" for kind in ("speed", "place") for delay in DELAYS]
    rows = [
        f"**{title}**",
        "",
        "| commands a second | " + " | ".join(head) + " |",
        "|---" * (len(head) + 1) + "|",
    ]
    for rate in RATES:
        cells = [cell(kind, rate, delay) for kind in ("velocity", "position") for delay in DELAYS]
        rows.append(f"| {rate} | " + " | ".join(cells) + " |")
    return [*rows, ""]


def tables(runs: int) -> list[str]:
    """All tables."""
    scene = Scene(load("env-1").grid, (1, 1), (48, 48), robot=ROBOT)
    perfect = judged(scene, 0).duration
    walkers = Scene(scene.grid, (1, 1), (48, 48), robot=ROBOT, traffic=(RandomWalk(10),))
    alone, crowd = {}, {}
    for kind in ("velocity", "position"):
        for rate in RATES:
            for delay in DELAYS:
                how = {"tracking": kind, "command_period": 1.0 / rate, "delay": delay}
                alone[kind, rate, delay] = judged(scene, 0, **how)
                crowd[kind, rate, delay] = [judged(walkers, seed, **how) for seed in range(runs)]

    def ratio(*key: object) -> str:
        came = [d for d in crowd[key] if d.arrived]
        took = np.mean([d.duration / d.optimum for d in came]) if came else float("nan")
        return f"{took:.2f} ({len(came)})"

    def hit(*key: object) -> str:
        return str(sum(d.outcome is Outcome.COLLISION for d in crowd[key]))

    none = [judged(walkers, seed) for seed in range(runs)]
    mean = np.mean([d.duration / d.optimum for d in none if d.arrived])
    first = (
        f"Perfect tracking at 10 decisions a second: {perfect:.1f} s without obstacles; among ten walkers "
        f"{mean:.2f} times the time optimum, {sum(d.arrived for d in none)} of {runs} arrive."
    )
    return [
        first,
        "",
        *table("Maximum error along the way without obstacles, metres", lambda *k: f"{alone[k].error:.2f}"),
        *table("Times the duration of perfect tracking", lambda *k: f"{alone[k].duration / perfect:.2f}"),
        *table(f"Among ten walkers: times the optimum (how many of {runs} arrive)", ratio),
        *table(f"Collisions in {runs} runs", hit),
    ]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    lines = tables(given.runs)
    print("\n".join(lines))
    if given.write:
        text = PAGE.read_text(encoding="utf-8")
        head, rest = text.split(BEGIN)
        PAGE.write_text(f"{head}{BEGIN}\n\n" + "\n".join(lines) + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
