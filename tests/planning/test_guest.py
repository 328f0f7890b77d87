"""A planner from another package: installed by pip, found by its entry point, held to the contract."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.nightly

GUEST = Path(__file__).parents[1] / "guest"
MAIN = "import sys; from lampyris.cli import main; sys.exit(main())"
CONTRACT = (
    "from lampyris.testing import check_planner\n"
    "from lampyris_guest import Guest\n"
    "check_planner(Guest(), cases=2)\n"
    "check_planner('guest', cases=1)\n"
)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment in which the guest package is installed, beside whatever else is."""
    source = tmp_path_factory.mktemp("guest") / "source"
    shutil.copytree(GUEST, source)
    target = tmp_path_factory.mktemp("installed")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    done = subprocess.run(
        [*pip, "--no-deps", "--no-index", "--no-build-isolation", "--target", str(target), str(source)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(target), os.environ.get("PYTHONPATH", "")])}


def told(home: dict[str, str], code: str, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False, env=home
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_guest_is_listed_and_plans_by_its_name(home: dict[str, str]) -> None:
    rows = json.loads(told(home, MAIN, "planners", "--json"))["planners"]
    (row,) = [r for r in rows if r["name"] == "guest"]
    assert row["settings"] == {"turns": 1}
    answer = json.loads(told(home, MAIN, "plan", "guide", "--planner", "guest", "--set", "turns=3", "--json"))
    assert (answer["status"], answer["planner"]) == ("found", "guest")


def test_a_guest_drives_among_obstacles(home: dict[str, str]) -> None:
    words = ("simulate", "env-6", "--planner", "guest", "--obstacles", "5", "--json")
    assert json.loads(told(home, MAIN, *words))["outcome"] == "arrived"


def test_a_guest_is_held_to_the_contract(home: dict[str, str]) -> None:
    told(home, CONTRACT)
