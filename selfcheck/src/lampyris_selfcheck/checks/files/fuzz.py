"""Mutated files for every parser: a valid object or a named error, at once, and nothing done but reading.

A case is a file made from good ones by seeded changes (:mod:`lampyris_selfcheck.reference.files.mutator`): it is
known by its parser, the seed and its number. What goes wrong is kept whole in the failure, in base 64.
"""

from __future__ import annotations

import base64
import time
import warnings
from functools import partial
from operator import itemgetter
from pathlib import Path

import lampyris
from lampyris._core.system import limited_memory
from lampyris.errors import LampyrisError
from lampyris.planning import registry
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.files import fuzz_run, fuzz_use
from lampyris_selfcheck.checks.files.fuzz_targets import TARGETS, Target
from lampyris_selfcheck.checks.files.fuzz_valid import NotValid, must, words
from lampyris_selfcheck.reference.files.watching import (
    Growth,
    Hangs,
    Readings,
    no_longer_than,
    old_left_alone,
    watched,
)
from lampyris_selfcheck.scratch import folder

BUNDLED = Path(lampyris.__file__).parent / "io" / "maps" / "data"
CPU_S = 1.0
"""CPU seconds that no file may take."""
HANGS_S, RUN_S = 10.0, 20.0
"""CPU seconds after which reading a file, and a short run of what it holds, is broken off."""
MEMORY = 256 * 2**20
"""Bytes that no file may take."""
NINE = ("png", "bmp", "pgm", "ros", "map", "scen", "scenario-json", "study-json", "store")
"""Parsers that everybody's files go through; the others share most of their code with one of these."""
COMMIT = {
    "pgm": 1_500, "png": 2_000, "bmp": 600, "map": 600, "scen": 600, "json": 400, "track": 400,
    **dict.fromkeys(("ros", "npy", "text", "way", "way-yaml", "zones", "dob"), 300),
}  # fmt: skip
"""Cases with every commit where seeded defects need so many; 100 elsewhere."""


class FuzzedReader:
    """Reads one file after another in a folder of its own, and says of each what came.

    Parameters
    ----------
    name : of the target.
    folder : an empty folder.

    Attributes
    ----------
    readings : of files that took too long.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.target: Target = TARGETS[name]
        self.folder = folder
        self._path = folder / self.target.file
        for file, data in self.target.beside.items():
            (folder / file).write_bytes(data)
        self._plain = [str(folder / file) for file in (self.target.file, *self.target.beside)]
        self.readings = Readings()
        self._warm()
        self._growth = Growth()

    def read(self, data: bytes, number: int) -> tuple[str, float, int]:
        """The code of the error, or nothing if it was read; CPU seconds and bytes of memory it took.

        Raises
        ------
        Exception : what should not have come.
        """
        code, took, grown = self.readings.least(
            lambda: self._reading(data, number), lambda reading: reading[1], CPU_S
        )
        must(took < CPU_S, f"{took:.2f} s of CPU time, not below {CPU_S:g}")
        return code, took, grown

    def _reading(self, data: bytes, number: int) -> tuple[str, float, int]:
        """The same of one reading, watched all the while; all but its time must hold each time."""
        self._path.write_bytes(data)
        found, problem = None, None
        with warnings.catch_warnings(record=True) as warned, no_longer_than(HANGS_S):
            warnings.simplefilter("always")
            with watched(self.folder, BUNDLED, plain=self._plain, may_write=self.target.writes) as seen:
                began = time.process_time()
                try:
                    found = self.target.call(self._path, number)
                except LampyrisError as raised:
                    problem = raised
                took = time.process_time() - began
            did = list(seen)
        grown = self._growth.step()
        must(grown < MEMORY, f"{grown / 2**20:.0f} MiB of memory, not below {MEMORY >> 20}")
        must(not did, f"it does more than read: {did[:3]}")
        must(not warned, f"it warns: {[str(w.message) for w in warned[:3]]}")
        if problem is not None:
            _refusal(problem)
            return problem.code, took, grown
        self.target.check(found)
        if self.target.against is not None:
            self.target.against(found, data)
        return "", took, grown

    def _warm(self) -> None:
        """Read good files and none at all, so that what is imported on the way, is."""
        for name in (*registry.names(), *registry.pose_names()):
            registry.origin_of(name)
        for number, data in enumerate((*self.target.mutants.seeds, b"", b"\0") * 2):
            self._path.write_bytes(data)
            try:
                self.target.call(self._path, number)
            except Exception:  # it is met again, and reported, where it is a case's
                continue


def _refusal(problem: LampyrisError) -> None:
    must(problem.exit_code in (3, 5), f"exit code {problem.exit_code}: {problem}")
    must(str(problem).startswith(f"error[{problem.code}]: "), str(problem))
    for text in (str(problem), *getattr(problem, "__notes__", ())):
        words(text)


def mutant(ask: Ask, name: str, number: int) -> bytes:
    """The bytes of one case."""
    return TARGETS[name].mutants.mutant(ask.rng("fuzz", name, number))


def run(ask: Ask, part: Part) -> Outcome:
    """Read the mutants of a part."""
    if part.kind in fuzz_run.KINDS:
        return _run_scenarios(ask, part)
    if part.kind in fuzz_use.KINDS:
        return _use(ask, part)
    tally = Tally(part)
    slowest, most = 0.0, 0
    with old_left_alone(), folder() as place:
        case = FuzzedReader(part.kind, place)
        for number in part.numbers:
            data = mutant(ask, part.kind, number)
            try:
                code, took, grown = case.read(data, number)
            except (Exception, Hangs) as problem:
                tally.case("wrong")
                tally.fail(number, _told(problem, place), **_kept(part.kind, data))
                continue
            tally.case("refused" if code else "read")
            slowest, most = max(slowest, took), max(most, grown)
    if case.readings.again:
        tally.count("read again", case.readings.again)
    tally.measure("slowest file of a part, ms", 1e3 * slowest)
    tally.measure("most memory of a file, MiB", most / 2**20)
    return tally.outcome()


def _run_scenarios(ask: Ask, part: Part) -> Outcome:
    """Read, write and run the mutants of a part."""
    tally = Tally(part)
    target = fuzz_run.KINDS[part.kind]
    with folder() as place:
        path = fuzz_run.prepare(part.kind, place)
        for number in part.numbers:
            rng = ask.rng("fuzz", part.kind, number)
            data = TARGETS[target].mutants.mutant(rng)
            try:
                with no_longer_than(RUN_S):
                    word = fuzz_run.one(path, data)
                tally.case(word)
            except (Exception, Hangs) as problem:
                tally.case("wrong")
                tally.fail(number, _told(problem, place), **_kept(target, data))
    return tally.outcome()


def _use(ask: Ask, part: Part) -> Outcome:
    """Read and use the mutants of a part, each within its time and memory."""
    tally = Tally(part)
    slowest, most = 0.0, 0
    with old_left_alone(), folder() as place, limited_memory(fuzz_use.SPACE), fuzz_use.limits_of_use():
        user, growth, readings = fuzz_use.User(place), Growth(), Readings()

        def once(number: int) -> tuple[str, float]:
            rng = ask.rng("fuzz", part.kind, number)
            name, data = user.input_of(part.kind, rng)
            began = time.process_time()
            with warnings.catch_warnings(), no_longer_than(fuzz_use.BREAK_S):
                warnings.simplefilter("error")
                word = user.use(part.kind, name, data, rng)
            return word, time.process_time() - began

        for number in part.numbers:
            try:
                word, took = readings.least(partial(once, number), itemgetter(1), fuzz_use.CPU_S)
                grown = growth.step()
                must(took < fuzz_use.CPU_S, f"{took:.1f} s of CPU time, not below {fuzz_use.CPU_S:g}")
                must(
                    grown < fuzz_use.MEMORY,
                    f"{grown / 2**20:.0f} MiB of memory, not below {fuzz_use.MEMORY >> 20}",
                )
            except (Exception, Hangs) as problem:
                growth.step()
                tally.case("wrong")
                name, data = user.input_of(part.kind, ask.rng("fuzz", part.kind, number))
                kept = base64.b64encode(data).decode()
                tally.fail(number, _told(problem, place), target=part.kind, file=name, base64=kept)
                continue
            tally.case(word)
            slowest, most = max(slowest, took), max(most, grown)
    tally.measure("slowest use of a part, ms", 1e3 * slowest)
    tally.measure("most memory of a use, MiB", most / 2**20)
    return tally.outcome()


def _told(problem: BaseException, folder: Path) -> str:
    """What went wrong, the same in whichever folder it did."""
    kind = "" if isinstance(problem, NotValid | Hangs) else f"{type(problem).__name__}: "
    return f"{kind}{problem}".replace(str(folder), "FOLDER")[:2000]


def _kept(name: str, data: bytes) -> dict[str, str]:
    return {"target": name, "file": TARGETS[name].file, "base64": base64.b64encode(data).decode()}


def _kind(name: str) -> Kind:
    what = f"a mutated {TARGETS[name].file} ({name}): a valid object or a typed error, nothing else done"
    commit = COMMIT.get(name, 100)
    if name in NINE:
        return Kind(what, commit, nightly=100_000, release=1_000_000, chunk=1000)
    return Kind(what, commit, nightly=20_000, release=100_000, chunk=500)


def _run_kind(name: str) -> Kind:
    what = f"a mutant of {fuzz_run.KINDS[name]}: if it is read it can be written, read again and run"
    return Kind(what, commit=40, nightly=10_000, release=100_000, chunk=250)


def _use_kind(name: str) -> Kind:
    what = f"{fuzz_use.KINDS[name]}: an answer or a typed error in 10 s of CPU time and 1 GiB"
    return Kind(what, commit=20, nightly=2_000, release=20_000, chunk=50, least={"used": 0.2})


CHECK = Check(
    "fuzz",
    ("G22",),
    "a mutated file gives every parser a valid object or a typed error, in a second and 256 MiB, and no more",
    {name: _kind(name) for name in TARGETS}
    | {name: _run_kind(name) for name in fuzz_run.KINDS}
    | {name: _use_kind(name) for name in fuzz_use.KINDS},
    run,
)
