"""An installed guest planner that cannot be imported: it is named, and the others are listed and work."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sizes import some

pytestmark = pytest.mark.nightly

MAIN = "import sys; from lampyris.cli import main; sys.exit(main())"
BROKEN = {
    "raises": "raise ImportError('libfancy is not there')",
    "exits": "raise SystemExit(7)",
    "not a planner": "class Guest:\n    pass",
    "nothing": "",
}


def home(folder: Path, code: str) -> dict[str, str]:
    """An environment in which a package registers a planner whose module holds this code."""
    (folder / "broken_guest.py").write_text(code + "\n")
    info = folder / "broken_guest-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken-guest\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text("[lampyris.planners]\nbroken = broken_guest:Guest\n")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}


def call(env: dict[str, str], code: str, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False, env=env,
        timeout=120,
    )  # fmt: skip


@pytest.mark.parametrize("kind", some(BROKEN))
def test_a_broken_guest_is_named_and_the_others_are_listed(tmp_path: Path, kind: str) -> None:
    env = home(tmp_path, BROKEN[kind])
    listed = call(env, MAIN, "planners", "--json")
    assert listed.returncode == 0, listed.stderr
    names = [row["name"] for row in json.loads(listed.stdout)["planners"]]
    assert {"ad-gso", "astar", "sipp"} <= set(names)
    assert "broken" not in names
    (note,) = listed.stderr.splitlines()
    assert note.startswith("note: error[PLANNER_BROKEN]: planner broken of the installed package ")
    assert "broken-guest 1.2: " in note
    asked = call(env, MAIN, "plan", "guide", "--planner", "broken")
    assert (asked.returncode, asked.stdout) == (3, "")
    assert asked.stderr.startswith("error[PLANNER_BROKEN]: planner broken of the installed package ")
    alone = call(env, MAIN, "planners", "broken")
    assert (alone.returncode, alone.stdout) == (3, "")


def test_a_broken_guest_harms_nobody_else(tmp_path: Path) -> None:
    env = home(tmp_path, BROKEN["raises"])
    assert call(env, MAIN, "plan", "guide", "--planner", "astar").returncode == 0
    assert call(env, MAIN, "planners", "sipp").stderr == ""
    misspelt = call(env, MAIN, "plan", "guide", "--planner", "astr")
    assert misspelt.returncode == 2
    assert "did you mean astar?" in misspelt.stderr
    code = (
        "import warnings, lampyris; from lampyris.app.engine.bootstrap import hello\n"
        "with warnings.catch_warnings(record=True) as caught:\n"
        "    warnings.simplefilter('always')\n"
        "    found = lampyris.list_planners(), [row['name'] for row in hello()['planners']]\n"
        "for names in found:\n"
        "    assert 'broken' not in names and 'astar' in names, names\n"
        "assert 'broken-guest 1.2' in str(caught[0].message)\n"
    )
    done = call(env, code)
    assert done.returncode == 0, done.stderr


def test_a_study_of_all_planners_names_the_broken_one_and_can_leave_it_out(tmp_path: Path) -> None:
    env = home(tmp_path, BROKEN["raises"])
    text = "version: 1\nname: s\nkind: plan\nmaps: [guide]\nplanners: {}\n"
    for planners, code in (("all", 3), ("{all: {except: [broken]}}", 0)):
        (tmp_path / "s.yaml").write_text(text.format(planners))
        done = call(env, MAIN, "study", "run", str(tmp_path / "s.yaml"), "--dry-run", "--store",
                    str(tmp_path / "s.study.db"))  # fmt: skip
        assert done.returncode == code, done.stderr
        assert ("broken-guest 1.2" in done.stderr) == bool(code)
