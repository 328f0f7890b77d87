"""A limit on jerk at the command line: laws and ways that do not hold it are told, not refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from bad_inputs.case import inside, run


@pytest.fixture(autouse=True)
def _here(tmp_path: Path) -> Iterator[None]:
    with inside(tmp_path):
        yield


def test_the_comparison_says_which_laws_break_it() -> None:
    done = run("speed", "env-3", "--smooth", "straight", "--jerk-max", "0.3", "--json", "--no-timing")
    assert done.exit == 0, done.err
    broken = {row["law"]: row["broken"] for row in json.loads(done.out)["laws"]}
    assert {law: "jerk" in words for law, words in broken.items()} == {
        "constant": False, "dissertation": True, "rpp": True, "physical": False, "optimum": False
    }  # fmt: skip


def test_a_way_through_tracks_does_not_hold_it_and_says_so() -> None:
    plan = json.loads(run("plan", "env-6", "--json").out)
    x, y = plan["cells"][len(plan["cells"]) // 2]
    Path("track.csv").write_text(
        "x,y\n" + f"{x},{y}\n" * 20 + f"{x},{y - 1}\n{x},{y - 2}\n", encoding="utf-8"
    )
    words = ("speed", "env-6", "--jerk-max", "0.2", "--track", "track.csv", "--json", "--no-timing")
    done = run(*words)
    assert done.exit == 0, done.err
    told = json.loads(done.out)
    row = next(row for row in told["laws"] if row["law"] == told["law"])
    assert row["broken"] == ["jerk"]
