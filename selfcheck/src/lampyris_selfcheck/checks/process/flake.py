"""Does every test pass in any order? The test suite by pytest, shuffled, again and again, without a retry.

From a source checkout only: an installed package has no tests. This module is the plugin of pytest as well:
``LAMPYRIS_ORDER=7 python -m pytest -p lampyris_selfcheck.checks.process.flake`` shuffles the files and the tests within
each (a fixture made once for a file is still made once).
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import lampyris
from lampyris.errors import UsageError
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.ledger import files_of, hash_of

ORDER = "LAMPYRIS_ORDER"
"""The variable that holds the number of an order."""
QUICK = (
    "tests/model",
    "tests/io/test_map_text_npy.py",
    "tests/motion/test_speed_dissertation.py",
    "tests/test_elementary.py",
)
"""What the commit's size runs: files that share library state and take seconds."""
WHAT: Mapping[str, tuple[str, ...]] = {"quick": QUICK, "suite": ("tests", "-m", "not nightly")}
LONGEST = {"quick": 600.0, "suite": 14_400.0}
"""Seconds a run may take before it counts as hung."""
READ = ("tests", "tools", "examples", "benchmarks")
"""Folders of the checkout that tests are made of or read."""


def shuffled(items: list[Any], order: int) -> list[Any]:
    """The tests of each file together, files and tests in an order drawn from a number."""
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(order)))
    files: dict[str, list[Any]] = {}
    for item in items:
        files.setdefault(item.nodeid.split("::")[0], []).append(item)
    names = list(files)
    drawn = [names[k] for k in rng.permutation(len(names)).tolist()]
    return [files[name][k] for name in drawn for k in rng.permutation(len(files[name])).tolist()]


def pytest_collection_modifyitems(items: list[Any]) -> None:
    """Put the tests into their order."""
    if order := os.environ.get(ORDER):
        items[:] = shuffled(items, int(order))


def checkout() -> Path:
    """The folder of the source checkout that this package is part of.

    Raises
    ------
    UsageError : ``CHECKOUT``: it is not part of one.
    """
    root = Path(lampyris.__file__).resolve().parents[2]
    problem = ""
    if not ((root / "pyproject.toml").is_file() and (root / "tests" / "selfcheck").is_dir()):
        problem = f"there are no tests beside {Path(lampyris.__file__).parent}"
    elif find_spec("pytest") is None:
        problem = "the package pytest is not installed"
    if problem:
        raise UsageError(
            "CHECKOUT",
            problem,
            allowed="a source checkout, with its development tools",
            todo="clone the project and run `make test` in it: it installs them",
        )
    return root


def problem_of(root: Path, tests: tuple[str, ...], order: int, longest: float, workers: int) -> str:
    """What failed when tests ran once in the order of a number, which is Python's hash seed too."""
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:rerunfailures"]
    words += ["-p", "lampyris_selfcheck.checks.process.flake", *tests]
    if workers > 1 and find_spec("xdist") is not None:
        words += ["-n", str(workers)]
    own = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    own |= {ORDER: str(order), "PYTHONHASHSEED": str(order % 2**32)}
    try:
        child = subprocess.run(
            words, cwd=root, env=own, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            encoding="utf-8", errors="replace", timeout=longest, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"no end within {longest:.0f} s"
    if not child.returncode:
        return ""
    failed = re.findall(r"^(?:FAILED|ERROR) .*", child.stdout, re.MULTILINE)
    return "; ".join(failed[:5]) or f"exit {child.returncode}: {child.stdout[-400:]}"


def _run(ask: Ask, part: Part) -> Outcome:
    root = checkout()
    tally = Tally(part)
    for number in part.numbers:
        order = ask.seed * 1_000_003 + number
        tally.case()
        if problem := problem_of(root, WHAT[part.kind], order, LONGEST[part.kind], ask.workers):
            command = f"{ORDER}={order} python -m pytest -p lampyris_selfcheck.checks.process.flake"
            tally.fail(number, problem, order=order, command=f"{command} {' '.join(WHAT[part.kind])}")
    return tally.outcome()


def _inputs(_: Ask) -> str:
    """Of the tests and what they read beside the package; without tests nothing can be asked."""
    root = checkout()
    files = [path for name in READ for path in files_of(root / name)]
    return hash_of([root / "pyproject.toml", *files], root)


CHECK = Check(
    name="flake",
    goals=("G28",),
    title="every test passes in any order, every time, and none is tried twice",
    kinds={
        "quick": Kind("some quick test files in one more order: each test passes", 1, 10, 10, chunk=2),
        "suite": Kind("the whole suite in one more order: each test passes", 0, 2, 100, chunk=1),
    },
    run=_run,
    alone=True,
    inputs=_inputs,
)
