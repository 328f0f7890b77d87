"""A plugin of pytest, by which :mod:`lampyris_selfcheck.checks.process.flake` runs tests in an order of its own.

``pytest -p lampyris_selfcheck.checks.process.flake_order`` with ``LAMPYRIS_ORDER``, a whole number, shuffles the files and
the tests within each (a fixture made once for a file is still made once), and writes what became of each test
to the file ``LAMPYRIS_OUTCOMES`` as JSON lines, in the order in which they ended.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

ORDER, OUTCOMES = "LAMPYRIS_ORDER", "LAMPYRIS_OUTCOMES"


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


class Recorder:
    """Writes down how each test ended: the worst of its setup, call and teardown.

    Parameters
    ----------
    path : the file, written as tests end.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._worst: dict[str, tuple[int, str, str]] = {}

    def pytest_runtest_logreport(self, report: Any) -> None:
        """A phase of a test is over."""
        word = f"x{report.outcome}" if hasattr(report, "wasxfail") else str(report.outcome)
        if word == "failed" and report.when != "call":
            word = "error"
        rank = ("passed", "skipped").index(word) if word in ("passed", "skipped") else 2
        said = "" if rank < 2 else str(report.longrepr)[-400:]
        before = self._worst.get(report.nodeid, (-1, "", ""))
        if rank > before[0]:
            self._worst[report.nodeid] = (rank, word, said)
        if report.when == "teardown":
            _, word, said = self._worst.pop(report.nodeid)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"test": report.nodeid, "outcome": word, "said": said}) + "\n")


def pytest_configure(config: Any) -> None:
    """Write outcomes down, in one process where there are many."""
    path = os.environ.get(OUTCOMES)
    if path and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Recorder(Path(path)), "lampyris-outcomes")
