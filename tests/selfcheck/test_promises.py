"""Every promise, as tests: with every commit the cases that seeded defects need, or the first of its smallest size.

Every night all of them run: ``lampyris selfcheck --size nightly``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from _pytest.mark.structures import ParameterSet

from lampyris_selfcheck import registry, runner
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.process import mutants

ASK = Ask()


NIGHT = {
    # What judges by time: tests/planning/test_deadlines.py counts the work between two looks at the clock.
    "deadline": (),
    # The suite runs once with every commit.
    "flake": (),
    # tests/study/test_study_store_system.py kills writers and fills disks.
    "kill": (),
    "oserrors": (),
    # Traces of the same monitor are judged with every commit.
    "monitor": ("drives",),
    # tests/sim/test_sim_steering.py drives with every controller, and has the referee judge each drive.
    "steered-drives": (),
    "pose-drives": ("late", "disc"),
    "store": ("bit", "noise", "page", "processes", "writers"),
    # Kinds that share a reader with another kind, or whose reader is a library.
    "fuzz": (
        "store",
        "store-repair",
        "yaml",
        "study-yaml",
        "study-json",
        "scenario-yaml",
        "ros-picture",
        "way-json",
        "zones-npy",
        "primitives-json",
        "use-beside",
        "use-robot",
    ),
    # tests/selfcheck/test_mutants.py judges small packages with the same engine.
    "mutants": (),
    # tests/cli/test_cli.py compares two processes, and plain with compiled kernels.
    "determinism": ("hash seed", "order", "plain kernels", "studies"),
    "grids": ("1xn", "2x4", "3x3"),
    "repair": ("3x3",),
    "faults": ("duplicates", "in-robot", "late", "missing", "nan"),
    "metamorphic": ("off the way", "pad blocked", "quicker", "reflect", "relabel", "wall more"),
    "random": ("large", "others"),
    # The tree's kernel takes seconds to compile; tests/planning/test_sampling.py has plans of it.
    "sampling": ("poses-star",),
    # The others' loop is that of ``gso`` to ``pso``.
    "swarm": ("igso", "lpso", "apso", "ipso", "pso-apf", "dstar-lpso", "dstar16-lpso"),
}
"""Kinds of checks that are for the night; without a name all of the check's."""
EVERY_COMMIT = ("planner", "repair", "profile", "sim", "parsers", "referee", "fleets")
"""Groups of seeded defects that the suite of every commit must detect; the others every night."""


def _by_night(name: str, kind: str) -> bool:
    return name in NIGHT and (kind in NIGHT[name] or not NIGHT[name])


def _cases() -> list[ParameterSet]:
    source = {"flake": [pytest.mark.source]}  # an installed package has no tests to shuffle
    return [
        pytest.param(
            name, kind, marks=[*source.get(name, []), *[pytest.mark.nightly] * _by_night(name, kind)]
        )
        for name in registry.NAMES
        for kind, one in registry.check(name).kinds_for(ASK).items()
        if one.commit
    ]


WHOLE = (("determinism", "as it is"),)
"""Kinds that run whole with every commit: each case is another kind of result, compared with what was kept."""

FEW = 5
"""Cases of a kind without a seeded defect that run with every commit, if there are so many."""


def needed(name: str, kind: str) -> list[runner.Range]:
    """Cases of a kind for every commit: those in which a seeded defect of the main job is detected.

    Of a kind without such a defect a tenth, and no fewer than five.
    """
    every = registry.check(name).kinds_for(ASK)[kind].commit
    if (name, kind) in WHOLE:
        return [runner.Range(kind, 0, every)]
    asked = {(one.first, one.cases) for group in EVERY_COMMIT for one in mutants.defects(group)
             if (one.check, one.kind) == (name, kind) and not one.equivalent}  # fmt: skip
    if not asked:
        return [runner.Range(kind, 0, min(every, max(FEW, every // 10)))]
    numbers = {k for first, cases in asked for k in range(first, first + cases)}
    firsts = [k for k in sorted(numbers) if k - 1 not in numbers]
    lasts = [k for k in sorted(numbers) if k + 1 not in numbers]
    return [runner.Range(kind, a, b - a + 1) for a, b in zip(firsts, lasts, strict=True)]


@pytest.mark.parametrize(("name", "kind"), _cases())
def test_the_promise_holds(name: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for which in needed(name, kind):
        result = runner.run(registry.check(name), ASK, which)
        told = [f"{f.kind} {f.number}: {f.what}" for f in result.outcome.failures[:5]]
        assert result.holds, "\n".join([*told, *result.lacks])


def test_the_cases_of_every_commit_are_those_that_defects_need() -> None:
    for group in EVERY_COMMIT:
        for one in mutants.defects(group):
            assert one.equivalent or any(
                r.first <= one.first and one.first + one.cases <= r.first + (r.cases or sys.maxsize)
                for r in needed(one.check, one.kind)
            ), one.id
    assert [(r.first, r.cases) for r in needed("reuse", "sessions")] == [(4, 1), (47, 1)]


def test_every_seeded_defect_of_the_main_job_is_detected_by_what_runs_with_every_commit() -> None:
    """That its cases are within the commit size of the check is said where the defects are tested."""
    assert set(EVERY_COMMIT) <= set(mutants.GROUPS)
    judges = {(one.check, one.kind) for group in EVERY_COMMIT for one in mutants.defects(group)}
    assert judges
    assert not [judge for judge in judges if _by_night(*judge)]


def test_what_is_for_the_night_is_there() -> None:
    """Or a kind that has another name runs with every commit, or none does."""
    for name, kinds in NIGHT.items():
        assert set(kinds) < set(registry.check(name).kinds_for(ASK)), name
