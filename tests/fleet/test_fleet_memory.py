"""Memory of large fleets: what a whole process takes, and the answer beyond the limit."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from sizes import some

RSS = """
import resource, sys
import numpy as np
import lampyris
blocked = np.random.default_rng(1).random((256, 256)) < 0.2
fleet = lampyris.random_fleet(lampyris.Grid(blocked), 10_000)
plan = lampyris.plan_fleet(fleet, sys.argv[1], budget=lampyris.Budget(expansions=int(sys.argv[2])))
assert len(plan.paths) == 10_000
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.nightly
@pytest.mark.parametrize(("planner", "iterations"), [("pibt", 200), ("lacam", 200)])
def test_memory_of_10_000_robots(planner: str, iterations: int) -> None:
    """On a map of 256 x 256 cells, interpreter and compiled code included: under 2 GB."""
    words = [sys.executable, "-c", RSS, planner, str(iterations)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert int(done.stdout) * 1024 < 2e9


@pytest.mark.parametrize("planner", some(["lacam", "pibt", "cbs"]))
def test_beyond_the_limit_the_command_exits_with_5_and_says_why(planner: str) -> None:
    """Before the tables are made: the limit is far below what any process takes."""
    words = ["fleet", "warehouse-200", "--robots", "200", "--planner", planner]
    done = subprocess.run(
        [sys.executable, "-m", "lampyris", *words], capture_output=True, text=True, check=False,
        env={**os.environ, "LAMPYRIS_MAX_MEMORY": "3"},
    )  # fmt: skip
    assert done.returncode == 5
    assert "distance table of 200 robots on" in done.stderr
    assert "LAMPYRIS_MAX_MEMORY" in done.stderr
    assert "take fewer robots or a smaller map" in done.stderr
