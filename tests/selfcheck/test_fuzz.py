"""The fuzzing itself: each way of going wrong is found, cases are varied, what went wrong once stays right.

Cases that went wrong once are kept in ``tests/data/fuzz`` as ``TARGET--WHAT``.
"""

from __future__ import annotations

import base64
import os
import resource
import socket
import subprocess
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris._core import limits
from lampyris.errors import InternalFault, LampyrisError
from lampyris_selfcheck.check import Ask, Part
from lampyris_selfcheck.checks.files import fuzz, fuzz_run, fuzz_use
from lampyris_selfcheck.checks.files.fuzz import FuzzedReader, mutant
from lampyris_selfcheck.checks.files.fuzz_targets import TARGETS
from lampyris_selfcheck.reference.files.map_files import bmp, npy, png
from lampyris_selfcheck.reference.files.map_sizes import Uneven, size
from lampyris_selfcheck.reference.files.watching import Readings
from lampyris_selfcheck.scratch import folder
from sizes import some

KEPT = Path(__file__).parents[1] / "data" / "fuzz"
ASK = Ask()


@pytest.mark.nightly
@pytest.mark.parametrize("name", some(TARGETS, 4))
def test_cases_are_varied(name: str) -> None:
    with folder() as place:
        case = FuzzedReader(name, place)
        codes = Counter(case.read(mutant(ASK, name, number), number)[0] for number in range(200))
    read = codes.pop("", 0)
    assert read > 200 // 30, f"the mutations are too rough to tell anything: {codes}"
    assert codes.total() > 200 // 10, codes
    assert len(codes) >= (1 if name in ("way", "movers", "dob") else 2), codes


@pytest.mark.parametrize("name", TARGETS)
def test_good_files_are_read(tmp_path: Path, name: str) -> None:
    case = FuzzedReader(name, tmp_path)
    # Some are good for other options than those of number 1.
    refused = ("VALUES", "IMG_FORMAT", "IMG_DEPTH", "IMG_COLOUR", "IMG_ALPHA", "CSV_CELL", "NPY_VALUE")
    for data in TARGETS[name].mutants.seeds:
        code, _, _ = case.read(data, 1)
        assert not code or code in refused, (code, data)


LONG = ("study-json--ten-thousand-seeds-twice", "ros--a-thousand-open-brackets")
"""Cases that take seconds, for the night."""


ONCE = sorted(KEPT.glob("*--*"), key=lambda p: (p.name in LONG, p.name))


@pytest.mark.parametrize("path", some(ONCE, len(ONCE) - len(LONG)), ids=lambda p: p.name)
def test_what_went_wrong_once(tmp_path: Path, path: Path) -> None:
    case = FuzzedReader(path.name.split("--")[0], tmp_path)
    for number in range(35):  # with each choice of options
        case.read(path.read_bytes(), number)


def test_a_mutant_can_be_made_again() -> None:
    for name in TARGETS:
        made = [mutant(ASK, name, k) for k in range(20)]
        assert made[10:] == [mutant(ASK, name, k) for k in range(10, 20)]
        assert len(set(made)) > 15, name


@pytest.mark.nightly
@pytest.mark.parametrize("kind", some(fuzz_run.KINDS))
def test_enough_scenarios_are_run(kind: str) -> None:
    outcome = fuzz.run(ASK, Part(kind, 0, 250))
    assert outcome.counts["run"] > 10, outcome.counts


def _raises(path: Path) -> None:
    raise ValueError(f"no traceback may be seen {path}")


def _internal(path: Path) -> None:
    raise InternalFault("BUG", "never")


def _reads_elsewhere(path: Path) -> None:
    Path(__file__).read_bytes()


def _follows(path: Path) -> None:
    link = path.with_name("link")
    link.read_bytes()


def _writes(path: Path) -> None:
    path.with_name("made").write_bytes(b"")


def _removes(path: Path) -> None:
    os.remove(path)


def _connects(path: Path) -> None:
    socket.socket().close()


def _starts(path: Path) -> None:
    subprocess.run([sys.executable, "--version"], check=True, capture_output=True)


def _evaluates(path: Path) -> None:
    eval("1 + 1")


def _warns(path: Path) -> None:
    warnings.warn("look", stacklevel=1)


def _takes_long(path: Path) -> None:
    until = time.process_time() + fuzz.CPU_S
    while time.process_time() < until:
        pass


def _hangs(path: Path) -> None:
    while True:
        pass


def _takes_much(path: Path) -> None:
    bytearray(fuzz.MEMORY + 2**20)[:: 2**10]
    assert bytes(fuzz.MEMORY + 2**20).count(1) == 0


WRONG: dict[Callable[[Path], None], str] = {
    _raises: "ValueError: no traceback may be seen FOLDER/m.map",
    _internal: "exit code 6",
    _reads_elsewhere: "does more than read: ['opens ",
    _follows: "does more than read: ['opens ",
    _writes: "does more than read: ['writes ",
    _removes: "os.remove",
    _connects: "socket.__new__",
    _starts: "subprocess.Popen",
    _evaluates: "does more than read: [",
    _warns: "it warns: ['look']",
    _takes_long: "s of CPU time",
    _hangs: "s of CPU time",
    _takes_much: "MiB of memory",
}


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("wrong", "said"), some(WRONG.items(), len(WRONG) - 3), ids=lambda v: getattr(v, "__name__", "")
)
def test_each_wrong_is_found(
    wrong: Callable[[Path], None], said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A parser that does wrong with one file of ten is found, and with no other."""

    def call(path: Path, number: int) -> Any:
        if number == 7:
            wrong(path)
        return TARGETS["map"].call(path, number)

    monkeypatch.setattr(fuzz, "HANGS_S", 1.5)
    monkeypatch.setattr(Readings, "PAUSES_S", (0.0, 0.0))

    class Linked(FuzzedReader):
        def _warm(self) -> None:
            os.symlink("/etc/passwd", self.folder / "link")

    monkeypatch.setattr(fuzz, "FuzzedReader", Linked)
    monkeypatch.setattr(fuzz, "TARGETS", {**TARGETS, "map": replace(TARGETS["map"], call=call)})
    outcome = fuzz.run(ASK, Part("map", 0, 10))
    assert (outcome.cases, outcome.failed) == (10, 1)
    failure = outcome.failures[0]
    assert failure.number == 7
    assert said in failure.what
    assert base64.b64decode(failure.data["base64"]) == mutant(ASK, "map", 7)


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("slow", [1, 2, 3, 4])
def test_the_least_of_some_readings_is_a_files_time(slow: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Others that use the machine make a reading longer, never shorter."""
    readings, now = [0], [0.0]

    def call(path: Path, number: int) -> Any:
        if number == 3:
            readings[0] += 1
            now[0] += 1.5 if readings[0] <= slow else 0.25
        return TARGETS["map"].call(path, number)

    class Cold(FuzzedReader):
        def _warm(self) -> None:
            pass

    monkeypatch.setattr(fuzz, "FuzzedReader", Cold)
    monkeypatch.setattr(Readings, "PAUSES_S", (0.0, 0.0, 0.0))
    monkeypatch.setattr(fuzz.time, "process_time", lambda: now[0])
    monkeypatch.setattr(fuzz, "TARGETS", {**TARGETS, "map": replace(TARGETS["map"], call=call)})
    outcome = fuzz.run(ASK, Part("map", 0, 5))
    assert readings[0] == min(slow, 3) + 1
    assert outcome.counts["read again"] == min(slow, 3)
    assert [f.what for f in outcome.failures] == (["1.50 s of CPU time, not below 1"] if slow == 4 else [])


@pytest.mark.nightly
def test_a_result_that_is_not_valid_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that says of unknown cells that they are free."""

    def call(path: Path, number: int) -> Any:
        found = TARGETS["text"].call(path, number)
        if found.grid.unknown is not None:
            object.__setattr__(found.grid, "blocked", found.grid.blocked & ~found.grid.unknown)
        return found

    monkeypatch.setattr(fuzz, "TARGETS", {**TARGETS, "text": replace(TARGETS["text"], call=call)})
    outcome = fuzz.run(ASK, Part("text", 0, 200))
    assert {f.what for f in outcome.failures} <= {"an unknown cell is not blocked", "blocked may be written"}
    assert outcome.failed


@pytest.mark.nightly
@pytest.mark.parametrize(
    "name", some(["png", "map", "bmp", "pgm", "ros", "npy", "csv", "text", "ros-picture"], 2)
)
def test_a_map_of_another_size_than_its_file_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that leaves the last row out, of a map that has more than one."""

    def call(path: Path, number: int) -> Any:
        found = TARGETS[name].call(path, number)
        rows = found.grid.blocked[:-1]
        return replace(found, grid=replace(found.grid, blocked=rows, unknown=None, terrain=None))

    def short(found: Any) -> None:
        assert found.grid.blocked.size

    target = replace(TARGETS[name], call=call, check=short)
    monkeypatch.setattr(fuzz, "TARGETS", {**TARGETS, name: target})
    outcome = fuzz.run(ASK, Part(name, 0, 100))
    assert any(" in the file, " in failure.what for failure in outcome.failures), outcome.failures


@pytest.mark.parametrize(
    ("form", "data"),
    [
        ("movingai", b"type octile\nheight 0\nwidth 4\nmap\n"),
        ("movingai", b"type octile\nheight 2\nwidth 2\nmap\n..\n"),
        ("text", b"..\n...\n"),
        ("csv", b"0,1\n0\n"),
        ("pgm", b"P5 2 2 255\n\0\0\0"),
        ("pgm", b"P1 2 2\n0 1 1\n"),
        ("numpy", npy("{'descr': '|b1', 'fortran_order': False, 'shape': (1, 2), }", b"\0\1", version=4)),
        ("numpy", npy("{'descr': '|b1', 'fortran_order': False, 'shape': (1, 2), }", b"\0")),
        ("png", png(0, 2, 8, 0, b"\0\0")),
        ("png", png(2, 2, 8, 0, b"\0\0\0\0\0")),
        ("bmp", bmp(2, 2, 24, bytes(15))),
        ("bmp", bmp(4, 1, 8, bytes([3, 1, 1, 0]), palette=bytes(8), used=2, packing=1)),
        ("bmp", bmp(4, 1, 8, bytes([5, 1, 0, 1]), palette=bytes(8), used=2, packing=1)),
    ],
)
def test_a_file_that_is_not_what_it_says_is_no_good_one(form: str, data: bytes) -> None:
    with pytest.raises(Uneven):
        size(data, form)


def test_a_scenario_that_cannot_be_run_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(scenario: Any) -> Any:
        raise LampyrisError("BUG", "what") if scenario.seed == 3 else ZeroDivisionError("x")

    monkeypatch.setattr(fuzz_run, "run", broken)
    outcome = fuzz.run(ASK, Part("run-json", 0, 100))
    assert outcome.failed
    assert {f.what for f in outcome.failures} == {"ZeroDivisionError: x"}


@pytest.mark.nightly
@pytest.mark.parametrize("kind", some(fuzz_use.KINDS))
def test_enough_inputs_are_used(kind: str) -> None:
    outcome = fuzz.run(ASK, Part(kind, 0, 60))
    assert not outcome.failed, outcome.failures
    assert outcome.counts["used"] > 6, outcome.counts
    assert outcome.counts["refused"] > 6, outcome.counts


def _use_of_maps(monkeypatch: pytest.MonkeyPatch, verb: Callable[..., None]) -> Any:
    """What comes of 20 mutated maps, if each that is read is used so."""
    monkeypatch.setattr(fuzz_use, "_any_verb", verb)
    monkeypatch.setattr(Readings, "PAUSES_S", ())
    return fuzz.run(ASK, Part("use-map", 0, 20))


@pytest.mark.nightly
def test_a_use_that_raises_what_it_should_not_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def raises(*_: object) -> None:
        raise OverflowError("too large")

    outcome = _use_of_maps(monkeypatch, raises)
    assert outcome.failed == outcome.counts["wrong"] > 2
    assert outcome.failures[0].what == "OverflowError: too large"
    assert base64.b64decode(outcome.failures[0].data["base64"])


@pytest.mark.nightly
def test_a_use_that_warns_or_faults_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def warns(*_: object) -> None:
        warnings.warn("overflow in square", RuntimeWarning, stacklevel=2)

    def faults(*_: object) -> None:
        raise InternalFault("FAULT", "refused")

    for wrong in (warns, faults):
        assert _use_of_maps(monkeypatch, wrong).failed > 2


@pytest.mark.nightly
def test_a_use_that_takes_too_much_time_or_memory_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def slow(*_: object) -> None:
        began = time.process_time()
        while time.process_time() < began + 0.02:
            pass

    monkeypatch.setattr(fuzz_use, "CPU_S", 0.015)
    outcome = _use_of_maps(monkeypatch, slow)
    assert outcome.failed > 2
    assert "of CPU time, not below" in outcome.failures[0].what
    monkeypatch.undo()
    monkeypatch.setattr(fuzz_use, "MEMORY", 2**25)
    outcome = _use_of_maps(monkeypatch, lambda *_: bytes(range(256)) * 2**18)
    assert outcome.failed > 2
    assert "MiB of memory, not below" in outcome.failures[0].what


@pytest.mark.nightly
def test_what_takes_all_address_space_ends_in_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    before = resource.getrlimit(resource.RLIMIT_AS)
    outcome = _use_of_maps(monkeypatch, lambda *_: np.empty(2**33))
    assert outcome.failed > 2
    assert outcome.failures[0].what.startswith(("MemoryError", "_ArrayMemoryError"))
    assert resource.getrlimit(resource.RLIMIT_AS) == before


@pytest.mark.source
def test_limits_of_use_are_those_that_are_documented(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAMPYRIS_MAX_TICKS", "7")
    with fuzz_use.limits_of_use():
        told = {f"LAMPYRIS_MAX_{name}={most}" for name, most in fuzz_use.LIMITS.items()}
        assert {limit.code: limit.allowed for limit in limits.LIMITS if limit.code in fuzz_use.LIMITS} == (
            dict(fuzz_use.LIMITS)
        )
    page = (Path(__file__).parents[2] / "docs/performance.md").read_text(encoding="utf-8")
    assert all(word in page for word in told)
    assert limits.TICKS.allowed == 7
