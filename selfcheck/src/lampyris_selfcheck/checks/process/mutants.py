"""Do the checks see mistakes? Defects that people make, put into a copy of the package one at a time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import lampyris
import lampyris_selfcheck
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.process.mutants_engine import Defect, MutantRun, MutationEngine, load

FOLDER = Path(lampyris_selfcheck.__file__).parent / "defects"
GROUPS = {
    "planner": "planning and the field: the search, its heuristic, legal steps, costs",
    "repair": "fields and searches that are kept while the map changes",
    "profile": "speed laws and profiles",
    "sim": "the simulator, its monitor and what it senses",
    "parsers": "readers of maps, scenarios and other files",
    "referee": "the referee itself: what it no longer sees",
    "metamorphic": "anything that two answers must have in common",
    "swarm": "swarm planners and their bounds",
    "fleets": "planners of fleets, robots of swarms and their referees",
    "plans": "sampling, models of the map, chains, photographs, uncertain settings, via points and unknown maps",
    "store": "the store of a study's results: reading, resuming and repair",
    "determinism": "draws, orders and sums, which must be the same everywhere",
}
"""Groups of defects, a file of them each."""
COMMIT = {
    "planner": 2, "repair": 1, "profile": 1, "sim": 1, "parsers": 1, "referee": 1,
    "metamorphic": 0, "swarm": 0, "fleets": 1, "plans": 1, "store": 0, "determinism": 0,
}  # fmt: skip
"""How many of each the size ``commit`` has: the first ones, which are quick; none of those that start
processes of their own.
"""
CHUNK = 8


@cache
def defects(group: str) -> tuple[Defect, ...]:
    """The defects of a group; a defect's number is its place in the file."""
    return load(FOLDER / f"{group}.toml")


@cache
def _engine() -> MutationEngine:
    return MutationEngine(Path(lampyris.__file__).parent)


def _kinds(_: Ask) -> dict[str, Kind]:
    kinds = {}
    for group, what in GROUPS.items():
        count = len(defects(group))
        few = min(count, COMMIT[group])
        text = f"a mistake in {what}: the check named with it fails"
        kinds[group] = Kind(text, commit=few, nightly=count, release=count, chunk=CHUNK, whole=count)
    return kinds


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    asked = [defects(part.kind)[number] for number in part.numbers]
    with ThreadPoolExecutor(max(1, min(ask.workers, len(asked)))) as pool:
        found = list(pool.map(_engine().judge, asked))
    for number, defect, (fate, seen) in zip(part.numbers, asked, found, strict=True):
        told(tally, number, defect, fate, seen)
    return tally.outcome()


def told(tally: Tally, number: int, defect: Defect, fate: str, seen: MutantRun) -> None:
    """Count what became of a defect; a failure where it is not what it must be."""
    tally.case(*(["the referee cannot see it"] if defect.blind else []))
    tally.measure("seconds of a defect", seen.seconds)
    due = "survived" if defect.equivalent else "killed"
    if fate == due:
        tally.count("equivalent" if defect.equivalent else f"killed by {defect.check}")
        return
    check, kind, first, cases = defect.judge
    tally.fail(
        number,
        f"{defect.id} ({defect.file}): {fate}, not {due}, by {check} {kind} {first}+{cases}; {seen.said}",
        id=defect.id,
        file=defect.file,
        find=defect.find,
        replace=defect.replace,
        why=defect.why,
        equivalent=defect.equivalent,
    )


CHECK = Check(
    name="mutants",
    goals=("G26",),
    title="mistakes put into the code by hand are seen by the checks, all but those no case can see",
    kinds=_kinds,
    run=_run,
    alone=True,
)
