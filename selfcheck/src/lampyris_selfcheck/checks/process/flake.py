"""Does every test end the same way in any order? The test suite, shuffled, again and again, without a retry.

From a source checkout only: an installed package has no tests.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import lampyris
from lampyris.errors import UsageError
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.process.flake_order import ORDER, OUTCOMES
from lampyris_selfcheck.ledger import files_of, hash_of

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
SHOWN = 5
READ = ("tests", "tools", "examples", "benchmarks")
"""Folders of the checkout that tests are made of or read."""


@dataclass(frozen=True)
class SuiteRun:
    """One run of tests.

    Parameters
    ----------
    outcomes : how each test ended, in the order in which they did.
    said : of those that failed, the end of the report.
    problem : why the run proves nothing; empty: it ran to its end.
    """

    outcomes: Mapping[str, str]
    said: Mapping[str, str]
    problem: str = ""


def checkout() -> Path:
    """The folder of the source checkout that this package is part of.

    Raises
    ------
    UsageError : ``CHECKOUT``: it is not part of one.
    """
    root = Path(lampyris.__file__).resolve().parents[2]
    if not ((root / "pyproject.toml").is_file() and (root / "tests" / "selfcheck").is_dir()):
        raise UsageError(
            "CHECKOUT",
            f"there are no tests beside {Path(lampyris.__file__).parent}",
            allowed="a source checkout, with its development tools",
            todo="clone the project and run `make test` in it first",
        )
    if find_spec("pytest") is None:
        raise UsageError(
            "CHECKOUT",
            "the package pytest is not installed",
            allowed="a source checkout, with its development tools",
            todo="run `make test` in the checkout first: it installs them",
        )
    return root


def run_tests(root: Path, asked: tuple[str, ...], order: int, longest: float, workers: int = 1) -> SuiteRun:
    """Run tests in the order of a number, each once.

    Parameters
    ----------
    root : where pytest is started.
    asked : files and options.
    order : the number; it is Python's hash seed as well.
    longest : seconds before it is ended.
    workers : processes, if pytest-xdist is there.
    """
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:rerunfailures"]
    words += ["-p", "lampyris_selfcheck.checks.process.flake_order", *asked]
    if workers > 1 and find_spec("xdist") is not None:
        words += ["-n", str(workers)]
    with tempfile.TemporaryDirectory(prefix="lampyris-flake-") as folder:
        path = Path(folder) / "outcomes"
        path.touch()
        own = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
        own |= {ORDER: str(order), OUTCOMES: str(path), "PYTHONHASHSEED": str(order % 2**32)}
        try:
            child = subprocess.run(
                words, cwd=root, env=own, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                encoding="utf-8", errors="replace", timeout=longest, check=False,
            )  # fmt: skip
            # 0: all passed; 1: some failed, and which is written down.
            problem = "" if child.returncode in (0, 1) else f"exit {child.returncode}: {child.stdout[-400:]}"
        except subprocess.TimeoutExpired:
            problem = f"no end within {longest:.0f} s"
        rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    twice = [test for test, times in Counter(row["test"] for row in rows).items() if times > 1]
    if twice and not problem:
        problem = f"{twice[0]} ran more than once: something retries"
    outcomes = {row["test"]: row["outcome"] for row in rows}
    return SuiteRun(outcomes, {row["test"]: row["said"] for row in rows if row["said"]}, problem)


def wrong(first: SuiteRun, now: SuiteRun) -> str:
    """What is wrong with a run beside the first; nothing: an empty word."""
    if now.problem or first.problem:
        return now.problem or f"the first order: {first.problem}"
    if not now.outcomes:
        return "no test ran"
    ill = [
        f"{test} {word}: {now.said.get(test, '')}"
        for test, word in now.outcomes.items()
        if word not in ("passed", "skipped")
    ]
    both = {
        test: (first.outcomes.get(test, "not run"), now.outcomes.get(test, "not run"))
        for test in sorted({*first.outcomes, *now.outcomes})
    }
    other = [
        f"{test} {then} in the first order, {word} now" for test, (then, word) in both.items() if then != word
    ]
    return "; ".join([*other[:SHOWN], *ill[:SHOWN]])


@cache
def _first(kind: str, root: Path, seed: int, workers: int) -> SuiteRun:
    return run_tests(root, WHAT[kind], _order(seed, 0), LONGEST[kind], workers)


def _order(seed: int, number: int) -> int:
    return seed * 1_000_003 + number


def _run(ask: Ask, part: Part) -> Outcome:
    root = checkout()
    tally = Tally(part)
    for number in part.numbers:
        first = _first(part.kind, root, ask.seed, ask.workers)
        # Order 0 is the first, and beside itself it proves nothing.
        order = _order(ask.seed, number + 1)
        now = run_tests(root, WHAT[part.kind], order, LONGEST[part.kind], ask.workers)
        tally.case()
        for word in now.outcomes.values():
            tally.count(f"tests {word}")
        if fault := wrong(first, now):
            command = f"{ORDER}={order} python -m pytest -p lampyris_selfcheck.checks.process.flake_order"
            tally.fail(
                number,
                fault,
                order=order,
                command=f"{command} {' '.join(WHAT[part.kind])}",
                ran=list(now.outcomes),
            )
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
        "quick": Kind(
            "some quick test files in one more order: each test ends as it did in the first",
            commit=1,
            nightly=10,
            release=10,
            chunk=2,
        ),
        "suite": Kind(
            "the whole suite in one more order: each test ends as it did in the first",
            commit=0,
            nightly=2,
            release=100,
            chunk=1,
        ),
    },
    run=_run,
    alone=True,
    inputs=_inputs,
)
