"""Random drives of controllers that steer, beside exact tracking and the disc: who arrives, and who is touched while moving.

    python tools/steered_drives.py 100 rpp mppi --safety-filter braking

The cases are those of the check ``pose-drives``, with each drive type in turn; every drive is judged by the referee. The
disc around the robot is driven along cells (``astar``), among the same obstacles.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from dataclasses import replace
from typing import Any

from lampyris.errors import SceneError
from lampyris.model.robot import DRIVES
from lampyris.planning.graph.astar import AStar
from lampyris.referee import check_drive
from lampyris.referee.drive import measure
from lampyris.sim.steering.controller_choice import drive
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.traffic.steered_drives import draw

DISC = "disc"


def main(cases: int, first: int, controllers: list[str], safety_filter: str, details: bool) -> None:
    """Print a table for each drive type."""
    ends = {(one, kind): Counter[str]() for one in (*controllers, DISC) for kind in DRIVES}
    faults: Counter[tuple[str, str]] = Counter()
    contacts: Counter[tuple[str, str]] = Counter()
    seconds: Counter[str] = Counter()
    for number in range(first, first + cases):
        kind = DRIVES[number % len(DRIVES)]
        for one in (*controllers, DISC):
            case = draw(Ask().rng("steered-drives", "perfect", number), kind)
            settings: dict[str, Any] = case.settings | {"law": "physical", "on_hit": "go-on"}
            # Nobody who ignores the robot: whether it gets there is the question.
            settings.pop("sources", None)
            planner: Any = AStar() if one == DISC else replace(case.planner, reverse=True)
            if one != DISC:
                settings |= {"controller": one, "safety_filter": safety_filter}
            began = time.process_time()
            try:
                made = drive(case.scene, planner, **settings)
            except SceneError:
                ends[one, kind]["no room"] += 1
                continue
            seconds[one] += time.process_time() - began
            fault = check_drive(made)
            if fault is not None:
                faults[one, kind] += 1
                print(f"case {number}, {one}, {kind}: refused: {fault}", file=sys.stderr)
            touched = measure(made)["collisions"]
            contacts[one, kind] += touched > 0
            ends[one, kind][made.outcome.value] += 1
            if details and not made.arrived:
                print(number, one, kind, made.outcome.value, made.detail, made.replans, file=sys.stderr)
    for kind in DRIVES:
        print(f"| {kind} | {' | '.join((*controllers, DISC))} |\n|---|{'---|' * (len(controllers) + 1)}")
        words = dict.fromkeys(w for one in (*controllers, DISC) for w in ends[one, kind])
        for word in words:
            print(f"| {word} | {' | '.join(str(ends[one, kind][word]) for one in (*controllers, DISC))} |")
        print(
            f"| contacts while moving | {' | '.join(str(contacts[one, kind]) for one in (*controllers, DISC))} |"
        )
        print(
            f"| refused by the referee | {' | '.join(str(faults[one, kind]) for one in (*controllers, DISC))} |\n"
        )
    print("processor seconds: " + ", ".join(f"{one} {seconds[one]:.0f}" for one in (*controllers, DISC)))


if __name__ == "__main__":
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("cases", type=int)
    words.add_argument("controllers", nargs="+")
    words.add_argument("--first", type=int, default=0)
    words.add_argument("--safety-filter", default="braking")
    words.add_argument("--details", action="store_true")
    given = words.parse_args()
    main(given.cases, given.first, given.controllers, given.safety_filter, given.details)
