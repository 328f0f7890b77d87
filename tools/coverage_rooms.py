"""Run the suite with branch coverage and say, room by room, what share of its branches was taken.

Exit code 1 if a room of the goal (G29) has taken fewer of its branches, or a test fails; the share of lines
is printed beside it. Kernels run as machine code on large work, which coverage does not see: their figure is
that of the plain form alone and has no goal. Of the processes that tests start, only the one that asks a Dask
cluster is counted, since the room's own code runs nowhere else: schedulers and workers are killed before they
could write, others are watched for time and memory.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
GOAL = 95.0
# They judge by time, and tracing makes Python five times slower (15 ms late became 81). `make test` has
# them.
TIMED = [
    f"tests/selfcheck/test_promises.py::test_the_promise_holds[deadline-{kind}]"
    for kind in ("limit", "cancel")
]
# Names a file of settings to the tests whose processes are to be counted (tests/study/test_study_dask.py).
CHILDREN = "LAMPYRIS_COVERAGE_OF_CHILDREN"
ROOMS = ("io", "model", "motion", "planning", "referee", "sim", "study")


def main() -> int:
    """Run, count, print; a line that begins with MEASURED is for tools/promises.py."""
    with tempfile.TemporaryDirectory() as folder:
        report, data, children = (Path(folder) / name for name in ("coverage.json", "data", "children.ini"))
        children.write_text(
            "[run]\nbranch = true\nparallel = true\nsource_pkgs = lampyris\n", encoding="utf-8"
        )
        # The processes inherit COVERAGE_FILE; pytest-cov combines data.*, theirs too.
        env = os.environ | {"COVERAGE_FILE": str(data), CHILDREN: str(children)}
        words = ["-m", "pytest", "-q", "-n", "auto", "--dist", "worksteal", "-m", "not nightly"]
        words += [*(f"--deselect={test}" for test in TIMED), "--cov=lampyris", "--cov-branch"]
        done = subprocess.run(
            [sys.executable, *words, f"--cov-report=json:{report}"], cwd=ROOT, env=env, check=False
        )
        if not report.exists():
            return 1
        files = json.loads(report.read_text(encoding="utf-8"))["files"]
    taken = by_room(files)
    for room, told in sorted(taken.items()):
        print(
            f"{room:20} {told.branches:6.2f} % of branches{_mark(room, told)}, {told.lines:6.2f} % of lines"
        )
    figure = measured(taken, failed=done.returncode != 0)
    print(f"{'all rooms of G29':20} {figure['percent']:6.2f} % of branches")
    print(f"MEASURED {json.dumps(figure)}")
    return int(figure["failures"] > 0)


@dataclass
class Taken:
    """Branches and lines of a room: how many were taken, and how many there are."""

    taken: int = 0
    there: int = 0
    lines_taken: int = 0
    lines_there: int = 0

    @property
    def branches(self) -> float:
        """Percent of the branches."""
        return _percent(self.taken, self.there)

    @property
    def lines(self) -> float:
        """Percent of the lines."""
        return _percent(self.lines_taken, self.lines_there)


def _percent(part: int, whole: int) -> float:
    return 100 * part / whole if whole else 100.0


def by_room(files: dict[str, Any]) -> dict[str, Taken]:
    """Coverage's ``files``, added up room by room."""
    taken: dict[str, Taken] = defaultdict(Taken)
    for name, file in files.items():
        room, told = taken[Path(name).relative_to("src/lampyris").parts[0]], file["summary"]
        room.taken += told["covered_branches"]
        room.there += told["num_branches"]
        room.lines_taken += told["covered_lines"]
        room.lines_there += told["num_statements"]
    return taken


def measured(taken: dict[str, Taken], *, failed: bool) -> dict[str, Any]:
    """What tools/promises.py keeps: rooms below the goal are failures, and so is a suite that failed."""
    mine = [taken[room] for room in ROOMS]
    part, whole = sum(room.taken for room in mine), sum(room.there for room in mine)
    short = sum(not room.there or room.branches < GOAL for room in mine)  # a room that is not there is short
    return {"cases": whole, "failures": short + failed, "percent": round(_percent(part, whole), 2)}


def _mark(room: str, told: Taken) -> str:
    return f" BELOW {GOAL:.0f} %" if room in ROOMS and told.branches < GOAL else ""


if __name__ == "__main__":
    sys.exit(main())
