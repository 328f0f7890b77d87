"""Machine code that an earlier run kept runs without numba, and only where it may."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from lampyris.kernels import _jit, kept_code, object_code
from lampyris.kernels.motion.speed_passes import clock
from lampyris.study.execution.pool import ENVIRONMENT

needs_linux = pytest.mark.skipif(not kept_code.usable(), reason="machine code is not kept here")

RUN = """
import json, sys
import numpy as np
from lampyris.kernels import _jit, kept_code
from lampyris.kernels.motion.speed_passes import clock
_jit.prefer_compiled()
told = []
for end in WORDS:
    t = np.zeros(4)
    clock(np.array([1.0, 2.0, 3.0]), t)
    told.append(t.tolist())
print(json.dumps([told[0], "numba" in sys.modules, type(clock._compiled).__name__]))
"""


def run(folder: Path, code: str = RUN, **more: str) -> Any:
    """What code prints in a process of its own, which keeps what it compiles in a folder."""
    env = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")} | {
        "NUMBA_CACHE_DIR": str(folder)
    }
    done = subprocess.run(
        [sys.executable, "-c", "WORDS = [1]\n" + code],
        capture_output=True, text=True, check=False, env=env | more, cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder where a process has kept the machine code of one kernel."""
    folder = tmp_path_factory.mktemp("kept")
    assert run(folder)[:2] == [[0, 1, 3, 6], True]
    return folder


def files(folder: Path) -> list[Path]:
    return sorted(folder.rglob(f"*{kept_code.SUFFIX}"))


def copied(made: Path, folder: Path) -> list[Path]:
    """The same files, without those of numba."""
    place = folder / "lampyris_kernels"
    place.mkdir()
    for file in files(made):
        (place / file.name).write_bytes(file.read_bytes())
    return files(folder)


def content(file: Path) -> tuple[dict[str, Any], bytes]:
    """What a file of machine code says, and its object code."""
    found = object_code.read(file)
    assert found is not None
    return found


VALUES = {
    "int": 5,
    "negative": -(2**63),
    "float": 2.5,
    "bool": True,
    "np.float64": np.float64(1),
    "np.int64": np.int64(3),
    "np.uint8": np.uint8(3),
    "np.bool": np.bool_(True),
    "array": np.zeros(3),
    "one": np.zeros(1, np.int32),
    "empty": np.zeros(0, np.uint8),
    "strided": np.zeros(6, np.int64)[::2],
    "boolean": np.zeros(3, bool),
    "square": np.zeros((3, 4)),
    "columns": np.zeros((3, 4), order="F"),
    "neither": np.zeros((6, 8))[::2, ::2],
    "unaligned": np.frombuffer(bytearray(17), np.uint8)[1:].view(np.float64),
    "small": np.zeros(3, np.int8),
    "float32": np.zeros(3, np.float32),
}
OTHERS: dict[str, Any] = {
    "large": 2**63,
    "other endian": np.zeros(3, ">f8"),
    "complex": np.zeros(3, complex),
    "none": None,
    "tuple": (1, 2),
    "half": np.zeros(3, np.float16),
    "a subclass": np.zeros((2, 2)).view(np.matrix),
}


@pytest.mark.parametrize("name", VALUES)
@pytest.mark.parametrize("writeable", [True, False])
def test_types_are_those_of_numba(name: str, writeable: bool) -> None:
    typeof: Any = numba.typeof

    value: Any = VALUES[name]
    if isinstance(value, np.ndarray):
        value = value.view()
        value.flags.writeable = writeable
    known = kept_code.types_of(kept_code.looks_of([value]))
    assert object_code.types_of_numba([typeof(value)]) == known


def test_looks_differ_where_types_of_numba_do() -> None:
    typeof: Any = numba.typeof

    for one in VALUES.values():
        for other in VALUES.values():
            alike = kept_code.looks_of([one]) == kept_code.looks_of([other])
            assert alike == (typeof(one) == typeof(other))


@pytest.mark.parametrize("name", OTHERS)
def test_other_values_are_left_to_numba(name: str) -> None:
    with pytest.raises(KeyError):
        kept_code.looks_of([OTHERS[name]])


@needs_linux
def test_the_second_process_runs_without_numba(made: Path) -> None:
    assert len(files(made)) == 1
    assert run(made) == [[0, 1, 3, 6], False, "KeptCode"]


@needs_linux
@pytest.mark.parametrize("how", ["cut short", "flipped", "garbage", "a word changed", "another format"])
def test_damaged_files_are_not_run(how: str, made: Path, tmp_path: Path) -> None:
    (file,) = copied(made, tmp_path)
    whole = file.read_bytes()
    line, _, code = whole.partition(b"\n")
    file.write_bytes(
        {
            "cut short": whole[:-100],
            "flipped": whole[:-50] + bytes([whole[-50] ^ 1]) + whole[-49:],
            "garbage": b"\0" * 300,
            "a word changed": line.replace(b"motion", b"notion") + b"\n" + code,
            "another format": b"[1]\n" + code,
        }[how]
    )
    assert object_code.read(file) is None


@needs_linux
@pytest.mark.parametrize("how", ["processor", "needs"])
def test_code_that_does_not_fit_is_not_run(how: str, made: Path, tmp_path: Path) -> None:
    """Of another processor, or with a symbol that is not known here: LLVM would end the process over it."""
    (file,) = copied(made, tmp_path)
    said, code = content(file)
    said[how] = "z80" if how == "processor" else [*said["needs"], "lampyris_no_such_symbol"]
    assert object_code._link(said, code) is None


@needs_linux
def test_all_that_code_refers_to_is_listed(made: Path) -> None:
    (file,) = files(made)
    said, code = content(file)
    needs = set(object_code.undefined(code))
    assert needs == set(said["needs"])
    assert {"numba_adapt_ndarray", "PyArg_UnpackTuple"} <= needs
    # What is listed is all: with these alone it is linked and runs.
    version = object_code._link(said, code)
    assert version is not None
    t = np.zeros(4)
    version(np.array([1.0, 2.0, 3.0]), t)
    assert t.tolist() == [0, 1, 3, 6]


def test_what_is_no_object_code_is_refused() -> None:
    with pytest.raises(ValueError, match="ELF"):
        list(object_code.undefined(b"MZ" + b"\0" * 100))


@needs_linux
def test_other_types_are_left_to_numba(made: Path, tmp_path: Path) -> None:
    shutil.copytree(made, tmp_path / "all")
    code = RUN.replace(
        "np.array([1.0, 2.0, 3.0])", "np.array([1.0, 2.0, 3.0, 9.0])[:3][::-1][::-1] if end else 0"
    )
    later = code.replace("print(", "clock(np.ones(6)[::2], t); print(")
    assert run(tmp_path / "all", later) == [[0, 1, 3, 6], True, "CPUDispatcher"]


@needs_linux
@pytest.mark.nightly
@pytest.mark.parametrize("name", ["NUMBA_OPT", "NUMBA_CPU_NAME", "NUMBA_BOUNDSCHECK", "NUMBA_ENABLE_AVX"])
def test_where_numba_is_configured_it_is_asked(name: str, made: Path) -> None:
    value = {"NUMBA_OPT": "1", "NUMBA_CPU_NAME": "generic"}.get(name, "0")
    assert run(made, **{name: value})[:2] == [[0, 1, 3, 6], True]


@needs_linux
def test_numba_is_imported_after_kept_code_and_works(made: Path) -> None:
    """Its library of C functions is loaded twice then; errors in compiled code and its random numbers use it."""
    code = (
        RUN
        + """
import numba
@numba.njit
def divide(a, b):
    return a // b
try:
    divide(1, 0)
except ZeroDivisionError as error:
    told.append(str(error))
@numba.njit
def draw(seed):
    np.random.seed(seed)
    return np.random.random()
import random
t = np.zeros(4)
clock(np.array([1.0, 2.0, 3.0]), t)
print(json.dumps([told[1:], divide(7, 2), draw(1) == np.random.RandomState(1).random_sample(), t.tolist()]))
"""
    )
    assert run(made, code) == [["integer division by zero"], 3, True, [0, 1, 3, 6]]


FAILING = """
import numba
@numba.njit(cache=True, nogil=True, _nrt=False)
def divide(values, k):
    return values[0] // k
"""


@needs_linux
def test_errors_of_machine_code_are_those_of_numba(tmp_path: Path) -> None:
    """No kernel raises any."""
    (tmp_path / "failing.py").write_text(FAILING)
    keep = """
import json, sys
import numpy as np
sys.path.insert(0, ".")
import failing
from lampyris.kernels import object_code
failing.divide(np.ones(3, np.int64), 2)
object_code.keep("failing.divide", "e", failing.divide, *failing.divide.overloads)
print(json.dumps(sys.getrefcount(None) > 0))
"""
    use = """
import json, sys
import numpy as np
from lampyris.kernels import object_code
divide = object_code.load("failing.divide", "e", ("i8[1C]", "i8"))
told = [divide(np.array([7, 8]), 2), "numba" in sys.modules]
for wrong in (lambda: divide(np.array([7, 8]), 0), lambda: divide(np.array([7, 8]))):
    try:
        wrong()
    except (ZeroDivisionError, TypeError) as error:
        told.append(type(error).__name__)
print(json.dumps(told))
"""
    assert run(tmp_path, keep) is True
    assert run(tmp_path, use) == [3, False, "ZeroDivisionError", "TypeError"]


@needs_linux
def test_arguments_are_given_back(made: Path) -> None:
    """A call keeps no reference to what it is given."""
    (file,) = files(made)
    version = object_code._link(*content(file))
    assert version is not None
    distances, t = np.array([1.0, 2.0, 3.0]), np.zeros(4)
    before = sys.getrefcount(distances), sys.getrefcount(t)
    for _ in range(1000):
        version(distances, t)
    assert (sys.getrefcount(distances), sys.getrefcount(t)) == before


@needs_linux
def test_what_numba_has_kept_is_kept_once_more(made: Path, tmp_path: Path) -> None:
    """A file that is missing or damaged comes back the next time that numba loads its own."""
    shutil.copytree(made, tmp_path / "all")
    (file,) = files(tmp_path / "all")
    whole = file.read_bytes()
    for change in (file.unlink, partial(file.write_bytes, whole[:100])):
        change()
        assert run(tmp_path / "all")[:2] == [[0, 1, 3, 6], True]
        assert object_code.read(file) == object_code.read(files(made)[0])
        assert run(tmp_path / "all") == [[0, 1, 3, 6], False, "KeptCode"]


def test_callers_kernels_are_not_kept() -> None:
    """Only those of the package: the name of a file says what it is of."""

    @_jit.kernel()
    def own(a: Any) -> Any:
        return a

    assert not own.is_ours
    assert clock.is_ours


@needs_linux
@pytest.mark.parametrize("name", kept_code.NEUTRAL[1:])
def test_variables_that_change_no_machine_code(name: str, made: Path) -> None:
    """Workers of studies are started with a number of threads."""
    value = {"NUMBA_NUM_THREADS": "1"}.get(name, "workqueue")
    assert run(made, **{name: value}) == [[0, 1, 3, 6], False, "KeptCode"]


def test_workers_of_studies_run_kept_code() -> None:
    names = {name for name in ENVIRONMENT if name.startswith("NUMBA_")}
    assert names <= set(kept_code.NEUTRAL)


@needs_linux
def test_each_kind_of_processor_has_its_own_file(made: Path) -> None:
    (file,) = files(made)
    said, _ = content(file)
    name, edition, _ = file.name.split("-")
    here, there = (object_code.file_name(name, edition, said["types"], p) for p in (said["processor"], "z80"))
    assert file.name == here != there


def test_no_machine_code_in_the_working_directory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever can write there would decide what runs."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "here")
    assert all(folder.is_absolute() for folder in kept_code.folders())
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr("os.path.expanduser", lambda path: path)  # as where the user is unknown
    assert all(folder.is_absolute() for folder in kept_code.folders())


def test_dimensions_are_never_taken_for_another_type() -> None:
    looks = {kept_code.looks_of([np.zeros((1,) * n, kind)]) for n in (0, 1, 16, 32) for kind in "?bhilBHILfd"}
    assert len(looks) == 44
    (deep,) = kept_code.types_of(kept_code.looks_of([np.zeros((1,) * 32)]))
    assert deep == "f8[32C]"


def test_a_zipped_installation_keeps_nothing(tmp_path: Path) -> None:
    """It has no folder whose sources could be read for their edition."""
    archive = tmp_path / "package.zip"
    archive.touch()

    def own(a: Any) -> Any:
        return a

    own.__module__ = "lampyris.kernels.own"
    own.__code__ = own.__code__.replace(co_filename=str(archive / "lampyris" / "kernels" / "own.py"))
    assert not _jit.Kernel(own, ())._is_kept()


def made_of(text: str) -> str:
    """The edition of a kernel of this source, which stands in no file."""
    scope: dict[str, Any] = {"kernel": _jit.kernel, "clock": clock}
    exec(compile(text, __file__, "exec"), scope)
    return str(scope["f"].edition())


def test_what_was_read_before_the_files_changed_has_another_edition() -> None:
    """A process compiles the source that it has read, whatever the file says by then."""
    sources = (
        "K = 2\n@kernel()\ndef f(a): return a + K",
        "K = 3\n@kernel()\ndef f(a): return a + K",
        "K = 2\n@kernel()\ndef f(a): return a - K",
        "K = 2\n@kernel()\ndef f(a): return a + 2",
        "@kernel()\ndef g(a): return a + 1\n@kernel()\ndef f(a): return g(a)",
        "@kernel()\ndef g(a): return a + 2\n@kernel()\ndef f(a): return g(a)",
    )
    editions = [made_of(text) for text in sources]
    assert len(set(editions)) == len(sources)
    assert editions == [made_of(text) for text in sources]
    assert len({edition[:16] for edition in editions}) == 1
