"""Run the suite with branch coverage and say, room by room, what share of its branches and lines was taken.

Exit code 1 if a room of the goal (G29) has less than its share, or a test fails. Kernels run as machine code
on large work, which coverage does not see: their figure is that of the plain form alone and has no goal.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GOAL = 95.0
ROOMS = ("field", "maps", "model", "motion", "planners", "referee", "sim", "study", "swarm")


def main() -> int:
    """Run, count, print; a line that begins with MEASURED is for tools/promises.py."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "coverage.json"
        words = ["-m", "pytest", "-q", "-n", "auto", "-m", "not nightly", "--cov=lampyris", "--cov-branch"]
        done = subprocess.run([sys.executable, *words, f"--cov-report=json:{report}"], cwd=ROOT, check=False)
        if not report.exists():
            return 1
        files = json.loads(report.read_text(encoding="utf-8"))["files"]
    taken: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for name, file in files.items():
        room = Path(name).relative_to("src/lampyris").parts[0]
        told = file["summary"]
        taken[room][0] += told["covered_lines"] + told["covered_branches"]
        taken[room][1] += told["num_statements"] + told["num_branches"]
    short = 0
    for room, (part, whole) in sorted(taken.items()):
        share = 100 * part / whole if whole else 100.0
        below = room in ROOMS and share < GOAL
        short += below
        print(f"{room:20} {share:6.2f} %{'  BELOW 95 %' if below else ''}")
    part, whole = (sum(taken[room][k] for room in ROOMS) for k in (0, 1))
    percent = 100 * part / whole
    print(f"{'all rooms of G29':20} {percent:6.2f} %")
    figure = {"cases": whole, "failures": short, "percent": round(percent, 2)}
    print(f"MEASURED {json.dumps(figure)}")
    return int(bool(short) or done.returncode != 0)


if __name__ == "__main__":
    sys.exit(main())
