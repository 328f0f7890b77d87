"""Random drives of a robot with a footprint, and of the disc around it: who arrives, who is touched.

    python tools/pose_drives.py 300

Each case of the check ``pose-drives`` is driven twice, among the same obstacles with the same seeds: along poses by the
footprint (``lattice``), and along cells as the disc around it (``astar``).
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from typing import Any

from lampyris.errors import SceneError
from lampyris.planning.graph.astar import AStar
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import drive
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.traffic.pose_drives import draw


def main(cases: int) -> None:
    """Print the table."""
    ends: dict[str, Counter[str]] = {"footprint": Counter(), "disc around it": Counter()}
    refused = 0
    for number in range(cases):
        for name, planner in (("footprint", None), ("disc around it", AStar())):
            case = draw(Ask().rng("pose-drives", "perfect", number))
            settings: dict[str, Any] = case.settings | {"law": "physical", "on_hit": "go-on"}
            # Nobody who ignores the robot: whether it gets there is the question.
            settings.pop("sources", None)
            try:
                made = drive(case.scene, planner or replace(case.planner, reverse=True), **settings)
            except SceneError:
                ends[name]["no room"] += 1
                continue
            refused += check_drive(made) is not None
            ends[name][made.outcome.value] += 1
    print(f"| {cases} drives | {' | '.join(ends)} |\n|---|---|---|")
    for word in dict.fromkeys(word for one in ends.values() for word in one):
        print(f"| {word} | {' | '.join(str(one[word]) for one in ends.values())} |")
    print(f"refused by the referee: {refused}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 300)
