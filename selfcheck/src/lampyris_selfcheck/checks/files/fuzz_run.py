"""Mutated scenarios that are read: each can be written, is the same when read again, and can be run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from lampyris.errors import LampyrisError
from lampyris.io.fleet_scenario.scenario import FleetScenario
from lampyris.io.scenario.scenario import Scenario
from lampyris.scenarios import completed, load_scenario, run, save_scenario
from lampyris_selfcheck.checks.files.fuzz_study import MAX_CELLS
from lampyris_selfcheck.checks.files.fuzz_targets import TARGETS
from lampyris_selfcheck.checks.files.fuzz_valid import must, words

KINDS = {"run-yaml": "scenario-yaml", "run-json": "scenario-json"}
"""Whose mutants are run, by kind."""
TICKS = 20


def prepare(kind: str, folder: Path) -> Path:
    """Write what lies beside the scenarios; where they go."""
    target = TARGETS[KINDS[kind]]
    for file, data in target.beside.items():
        (folder / file).write_bytes(data)
    return folder / target.file


def one(path: Path, data: bytes) -> str:
    """What came of a scenario: ``refused``, ``run``, or ``not run`` for a typed error of the run.

    Raises
    ------
    Exception : what should not have come.
    """
    path.write_bytes(data)
    try:
        scenario = load_scenario(path, max_cells=MAX_CELLS)
    except LampyrisError:
        return "refused"
    if isinstance(scenario, FleetScenario):
        return "a fleet"
    again = path.with_name(f"again{path.suffix}")
    save_scenario(scenario, again)
    read = load_scenario(again, max_cells=MAX_CELLS)
    must(read == completed(scenario), "another scenario after it was written")
    try:
        run(_shortened(scenario))  # with the referee
    except LampyrisError as problem:
        must(problem.exit_code in (3, 5), f"exit code {problem.exit_code}: {problem}")
        words(str(problem))
        return "not run"
    return "run"


def _shortened(scenario: Scenario) -> Scenario:
    """The same for a few ticks or seconds: a period may be a millionth of a second."""
    if scenario.simulated:
        scenario = replace(scenario, ticks=min(scenario.ticks or TICKS, TICKS))
    if scenario.drive is not None:
        scenario = replace(scenario, drive={**scenario.drive, "time_limit": 3.0, "period": 0.2})
    return scenario
