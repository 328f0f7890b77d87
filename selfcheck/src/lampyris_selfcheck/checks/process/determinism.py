"""One answer everywhere: the same cases hashed in other surroundings, and against hashes that were kept.

The corpus (:mod:`.determinism_cases`) is the same at every size and for every seed. Each kind of case here
is one setting, and one process that does all of it; a case is one of the corpus in that setting. What it gave
is compared with ``golden.json``, which was written once: so another machine, system, Python or NumPy is a
setting too, and the kind ``as it is`` tells there whether it holds. Here it can be run on one machine only;
Linux on arm64, macOS and Windows, other Pythons and NumPys are what its users and their builds run it on. A
Dask cluster beside this machine's own processes is tests/study/test_study_identity.py.

If results were meant to change: ``python -m lampyris_selfcheck.checks.process.determinism --renew``, and say why in the
commit.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lampyris._core.system import processors
from lampyris.study.execution.execution import Execution
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.process.determinism_cases import FIRST, LATER
from lampyris_selfcheck.checks.process.determinism_run import extensions
from lampyris_selfcheck.checks.studies import small_studies as studies
from lampyris_selfcheck.scratch import folder

GOLDEN = Path(__file__).with_name("golden.json")
CASES = FIRST + 3 * len(LATER)
"""Cases of the corpus."""
COMMIT = 60
"""How many of them, the first, a commit takes."""
EVERY = ("as it is", "hash seed", "order", "plain kernels")
"""Surroundings that a commit tries."""

PLAIN = {
    "PYTHONHASHSEED": "0", "TZ": "UTC", "LC_ALL": "C.UTF-8", "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1",
}  # fmt: skip
"""What every setting says of its surroundings, unless it is what it changes."""
SILENT = (
    "LANG",
    "LANGUAGE",
    "PYTHONUTF8",
    "NUMBA_DISABLE_JIT",
    "NPY_DISABLE_CPU_FEATURES",
    "OPENBLAS_CORETYPE",
)
TWO = {name: "2" for name in PLAIN if name.endswith("THREADS")}


@dataclass(frozen=True)
class Surroundings:
    """Surroundings of a process.

    Parameters
    ----------
    what : they in a line.
    env : what its environment says beside :data:`PLAIN`.
    sign : which sign of it must differ from that of ``as it is``; empty where none shows.
    shuffle : seed of another order of the cases.
    compiled : whether kernels run as machine code from the first call on.
    shows : what the process must say is in force, beside and in place of :data:`SHOWN`.
    """

    what: str
    env: Mapping[str, str] = field(default_factory=dict)
    sign: str = ""
    shuffle: int | None = None
    compiled: bool = False
    shows: Mapping[str, str] = field(default_factory=dict)


SHOWN = {
    "jit": "on", "first call": "counted", "numba threads": "1", "blas threads": "1", "zone": "00:00",
}  # fmt: skip
"""What a process says is in force where nothing is changed."""
SETTINGS = {
    "as it is": Surroundings("in a process of its own; the hashes are those that were kept"),
    "hash seed": Surroundings("words hash otherwise (PYTHONHASHSEED=1)", {"PYTHONHASHSEED": "1"}, "words"),
    "order": Surroundings(
        "cases in another order, words hash at random", {"PYTHONHASHSEED": "random"}, "words", shuffle=1
    ),
    "processor": Surroundings(
        "without what the processor has above the least that NumPy needs", {}, "exp", shows={"extensions": ""}
    ),
    "threads": Surroundings(
        "two threads for BLAS, OpenMP and numba, where all others have one",
        TWO,
        shows={"numba threads": "2", "blas threads": str(min(2, processors()))},
    ),
    "place": Surroundings(
        "Turkish if the system speaks it, else no words but ASCII; the time of Kathmandu",
        {"TZ": "<+0545>-5:45", "LC_ALL": "tr_TR.UTF-8", "PYTHONCOERCECLOCALE": "0"},
        shows={"zone": "05:45"},
    ),
    "plain kernels": Surroundings(
        "no kernel compiled (NUMBA_DISABLE_JIT=1)",
        {"NUMBA_DISABLE_JIT": "1"},
        shows={"jit": "off", "compiled": "0"},
    ),
    "compiled kernels": Surroundings(
        "every kernel compiled from its first call on", compiled=True, shows={"first call": "compiled"}
    ),
}

_FIRST = (("plan", 1, 4, None), ("simulate", 1, 2, None), ("drive", 1, 2, 1))
STUDIES: tuple[tuple[str, int, int, int | None], ...] = (
    *_FIRST,
    *((kind, 1, 0, None) for kind in studies.TEXTS),
    *(
        (kind, 4, workers, order)
        for kind in studies.TEXTS
        for workers in (1, 2, 4)
        for order in (None, workers)
    ),
    *((kind, 4, 0, None) for kind in studies.TEXTS),
    *((kind, 4, 8, order) for kind in studies.TEXTS for order in (None, 8)),
)
"""Which study, how many seeds, how many workers (0: in four sittings of one), and in which order."""
SITTINGS = 3


@dataclass(frozen=True)
class Golden:
    """Hashes that were kept.

    Parameters
    ----------
    made : on what they were made.
    cases : what each case of the corpus was, and its hash.
    studies : the hash of a study's file by kind and number of seeds.
    """

    made: str
    cases: tuple[tuple[str, str], ...]
    studies: Mapping[str, str]


@cache
def golden() -> Golden:
    """What ``golden.json`` says."""
    told = json.loads(GOLDEN.read_text(encoding="utf-8"))
    return Golden(told["made"], tuple((label, kept) for label, kept in told["cases"]), told["studies"])


def surroundings(setting: Surroundings) -> dict[str, str]:
    """The environment of a process in that setting."""
    env = {k: v for k, v in os.environ.items() if k not in SILENT and not k.startswith("LC_")} | PLAIN
    if setting is SETTINGS["processor"]:
        env["NPY_DISABLE_CPU_FEATURES"] = " ".join(extensions())
        if platform.machine().lower() in ("x86_64", "amd64"):
            env["OPENBLAS_CORETYPE"] = "Prescott"
    return {**env, **setting.env}


def _turkish(folder: str) -> dict[str, str]:
    """Where Linux finds the locale, made there since few systems have it; nothing, where none can be made."""
    words = ["localedef", "-i", "tr_TR", "-f", "UTF-8", str(Path(folder) / "tr_TR.UTF-8")]
    if sys.platform != "linux" or shutil.which(words[0]) is None:
        return {}
    made = subprocess.run(words, capture_output=True, check=False).returncode == 0
    return {"LOCPATH": folder} if made else {}


def hashed(setting: Surroundings, numbers: Iterable[int]) -> dict[str, Any]:
    """The cases in a process of that setting, as :func:`lampyris_selfcheck.checks.process.determinism_run.answer` tells.

    Raises
    ------
    subprocess.CalledProcessError : the process came to an end without an answer.
    """
    request = {"numbers": list(numbers), "shuffle": setting.shuffle, "compiled": setting.compiled}
    with tempfile.TemporaryDirectory(prefix="lampyris-place-") as folder:
        done = subprocess.run(
            [sys.executable, "-m", "lampyris_selfcheck.checks.process.determinism_run"],
            input=json.dumps(request), capture_output=True, text=True, encoding="utf-8", check=False,
            env=surroundings(setting) | (_turkish(folder) if setting is SETTINGS["place"] else {}),
        )  # fmt: skip
    if done.returncode:
        raise subprocess.CalledProcessError(done.returncode, done.args, done.stdout, done.stderr[-2000:])
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def run(ask: Ask, part: Part) -> Outcome:
    """The cases of one setting, or some studies."""
    return _studies(part) if part.kind == "studies" else _cases(part)


def _cases(part: Part) -> Outcome:
    tally = Tally(part)
    setting = SETTINGS[part.kind]
    told = hashed(setting, part.numbers)
    _signs(tally, part, setting, told["signs"])
    other: list[tuple[int, str, str]] = []
    for number, label, got in sorted(told["cases"]):
        tally.case(label.partition(" ")[0])
        if golden().cases[number] != (label, got):
            other.append((number, label, got))
    if not other:
        return tally.outcome()
    plain = other
    if part.kind != "as it is":
        plain = [(n, said, h) for n, said, h in hashed(SETTINGS["as it is"], [n for n, *_ in other])["cases"]]
    for (number, label, got), (_, as_label, as_it_is) in zip(other, sorted(plain), strict=True):
        kept_label, kept = golden().cases[number]
        if part.kind == "as it is":
            words = f"{label}: {got}; kept is {kept} ({kept_label}), made by {golden().made}"
            tally.fail(number, words, case=number, got=got, kept=kept)
        elif (label, got) == (as_label, as_it_is) and label != "fault":
            tally.count("not as kept, and not because of the setting")
        else:
            words = f"{label}: {got}; without the setting {as_it_is} ({as_label}), kept is {kept}"
            tally.fail(number, words, case=number, got=got, without=as_it_is, kept=kept)
    return tally.outcome()


def _signs(tally: Tally, part: Part, setting: Surroundings, signs: Mapping[str, str]) -> None:
    """Whether the setting is in force: the process says so, or something beside results shows it."""
    for name, asked in {**SHOWN, **setting.shows}.items():
        if signs[name] != asked and not _untold(name, signs):
            tally.fail(part.first, f"the setting is not in force: {name} {signs[name]!r}, not {asked!r}")
    if setting.compiled and signs["compiled"] == "0":
        tally.fail(part.first, "the setting is not in force: no kernel was compiled")
    if setting is SETTINGS["place"]:
        tally.count(f"locale {signs['locale']}")
    if setting is SETTINGS["processor"] and not extensions():
        tally.count("nothing of the processor can be switched off")
    elif setting.sign and signs[setting.sign] != plain_signs()[setting.sign]:
        tally.count(f"{setting.sign} is another")
    elif setting is SETTINGS["processor"]:
        tally.count("np.exp has the same bits")  # So it may be, on a processor that has little more.
    elif setting.sign:
        tally.fail(part.first, f"the setting is not in force: {setting.sign} {signs[setting.sign]!r}")


def _untold(name: str, signs: Mapping[str, str]) -> bool:
    """Whether this system cannot tell it, or has no such setting."""
    return (name == "blas threads" and not signs[name]) or (name == "zone" and sys.platform == "win32")


@cache
def plain_signs() -> dict[str, str]:
    """What ``as it is`` shows."""
    told: dict[str, str] = hashed(SETTINGS["as it is"], [])["signs"]
    return told


def _studies(part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        kind, seeds, workers, shuffle = STUDIES[number]
        how = f"{workers} workers" if workers else "sittings"
        tally.case(kind, how if shuffle is None else f"{how}, shuffled")
        try:
            got = _study(kind, seeds, workers, shuffle)
            kept = golden().studies[f"{kind} {seeds}"]
            if got != kept:
                at_once = _hash(studies.at_once(studies.study(kind, seeds)))
                words = f"{kind}, {seeds} seeds, {how}: {got}; at once {at_once}, kept is {kept}"
                tally.fail(number, words, got=got, at_once=at_once, kept=kept)
        except Exception as fault:
            tally.fail(number, f"{kind}, {how}: {type(fault).__name__}: {fault}")
    return tally.outcome()


def _study(kind: str, seeds: int, workers: int, shuffle: int | None) -> str:
    made = studies.study(kind, seeds)
    with folder() as place:
        path = place / "study.db"
        if workers:
            return _hash(studies.through_store(made, path, Execution(workers, shuffle=shuffle)))
        return _hash(studies.in_sittings(made, path, SITTINGS))


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


KINDS = {
    **{
        name: Kind(
            f"{one.what}: the same hashes", COMMIT if name in EVERY else 0, CASES, CASES, chunk=CASES, whole=CASES
        )
        for name, one in SETTINGS.items()
    },
    "studies": Kind(
        "small studies on 1, 2, 4 or 8 workers, in another order, or broken off and taken up: the same bytes",
        commit=len(studies.TEXTS), nightly=len(STUDIES), release=len(STUDIES),
        chunk=3, whole=len(STUDIES),
    ),
}  # fmt: skip

CHECK = Check(
    "determinism",
    ("G14",),
    "the same question has the same answer, to the last bit, in any surroundings: run here on one machine",
    KINDS,
    run,
    alone=True,
)


def renewed() -> dict[str, Any]:
    """What ``golden.json`` would hold if it were written here and now."""
    told = sorted(hashed(SETTINGS["as it is"], range(CASES))["cases"])
    faults = [f"{number}: {words}" for number, label, words in told if label == "fault"]
    if faults:
        raise RuntimeError("; ".join(faults))
    seeds = {seeds for _, seeds, *_ in STUDIES}
    by_kind = [(kind, some) for kind in studies.TEXTS for some in sorted(seeds)]
    python = f"Python {platform.python_version()}, NumPy {np.__version__}"
    return {
        "made": f"{python}, {platform.system()} {platform.machine()}",
        "cases": [[label, kept] for _, label, kept in told],
        "studies": {
            f"{kind} {some}": _hash(studies.at_once(studies.study(kind, some))) for kind, some in by_kind
        },
    }


def main(words: list[str] | None = None) -> int:
    """Write the hashes anew; tell which are others than before."""
    parser = argparse.ArgumentParser(
        prog="python -m lampyris_selfcheck.checks.process.determinism", description=main.__doc__
    )
    parser.add_argument("--renew", action="store_true", required=True)
    parser.parse_args(words)
    fresh = renewed()
    before = (
        json.loads(GOLDEN.read_text(encoding="utf-8")) if GOLDEN.exists() else {"cases": [], "studies": {}}
    )
    old = dict(enumerate(before["cases"])) | before["studies"]
    new = dict(enumerate(fresh["cases"])) | fresh["studies"]
    for name, kept in new.items():
        if old.get(name) != kept:
            sys.stdout.write(f"{name}: {old.get(name)} -> {kept}\n")
    lines = ",\n".join(json.dumps(one) for one in fresh["cases"])
    tail = json.dumps(fresh["studies"], indent=0)
    text = f'{{"made": {json.dumps(fresh["made"])},\n"cases": [\n{lines}\n],\n"studies": {tail}}}\n'
    GOLDEN.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
