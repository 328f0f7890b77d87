"""Shortcuts of the compiler: the same machine code, and nothing else in the process is affected."""

from __future__ import annotations

import gc
import re
import weakref
from collections.abc import Callable
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lampyris.kernels import _jit, _machine
from lampyris.kernels import _shortcuts as shortcuts
from lampyris.kernels._jit import kernel, u64

numba = pytest.importorskip("numba")


def small(cost: Any, limit: int) -> float:
    total = 0.0
    for k in range(len(cost)):
        if cost[k] < limit:
            total += cost[k] * 0.5
            cost[k] = min(cost[k], k + 1)
    return total


def instructions(made: Any) -> str:
    """The machine code of the only signature, without names that count what a process has compiled."""
    (text,) = made.inspect_asm().values()
    code = [line for line in text.splitlines() if re.match(r"\t[a-z]", line)]
    return re.sub(r"\w*_ZN\w*|\w*numba\w*|\w*small\w*|\.\w+", "name", "\n".join(code))


def compiled(plain: Callable[..., Any], **options: Any) -> Any:
    made = numba.njit(**_machine.LEAN, **options)(plain)
    cost = np.arange(6) * 3
    assert made(cost, 7) == 4.5
    assert cost.tolist() == [0, 2, 3, 9, 12, 15]
    return made


@pytest.mark.nightly
def test_the_machine_code_is_the_same_with_and_without_shortcuts(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for what LLVM makes of functions that were not optimised twice: this once they are."""
    library = numba.core.codegen.CPUCodeLibrary
    plain = instructions(compiled(small))
    with shortcuts.shortcuts():
        closure = library._optimize_functions.__closure__ or ()
        for twice in [cell.cell_contents for cell in closure if callable(cell.cell_contents)]:
            monkeypatch.setattr(library, "_optimize_functions", twice)
        short = instructions(compiled(small))
    assert short == plain
    assert plain.count("\n") > 20


def test_implementations_of_others_are_not_taken() -> None:
    """Kernels that were compiled after a user's function with ``fastmath`` once had its ``max``."""

    def greater(a: float, b: float) -> float:
        return max(a, b)

    made = []
    for others in (False, True, False):
        with nullcontext() if others else shortcuts.shortcuts():
            made.append(
                numba.njit(fastmath=True)(greater) if others else numba.njit(**_machine.LEAN)(greater)
            )
            made[-1](1.0, 2.0)
    assert ["fcmp fast" in "".join(one.inspect_llvm().values()) for one in made] == [False, True, False]


@pytest.mark.nightly
def test_what_others_compile_is_compiled_as_always() -> None:
    """Code that falls back on objects needs what a kernel does without: the variables at the entry of each block."""
    with shortcuts.shortcuts():
        compiled(small)
    made = numba.jit(forceobj=True, looplift=False)(small)
    assert made([0, 3, 6, 9], 7) == 4.5


def test_a_resolution_is_remembered_within_shortcuts_alone() -> None:
    asked = []

    class Function:
        """numba's, of which each says what implements it for which types."""

        def __init__(self, name: str) -> None:
            self.name = name
            self._impl_keys: dict[Any, str] = {}

    def resolve(self: Function, context: str, args: Any, kws: Any) -> Any:
        asked.append((self.name, context, tuple(args), kws))
        if "none" in args:
            return None
        self._impl_keys[tuple(args)] = f"{self.name}({', '.join(args)})"
        return SimpleNamespace(args=tuple(args))

    resolved = shortcuts._remembered(resolve)

    def quick(of: Function, context: str, args: list[str], kws: Any) -> str | None:
        found = resolved(of, context, args, kws)
        return None if found is None else of._impl_keys[found.args]

    add, less = Function("add"), Function("sub")
    for _ in range(2):
        assert quick(add, "here", ["int64"], {}) == "add(int64)"
    assert len(asked) == 2
    shortcuts._install()
    with shortcuts.shortcuts():
        for _ in range(3):
            assert quick(add, "here", ["int64"], {}) == "add(int64)"
            assert quick(add, "here", ["int32"], {}) == "add(int32)"
            assert quick(less, "here", ["int32"], {}) == "sub(int32)"
            assert quick(add, "there", ["int32"], {}) == "add(int32)"
            add._impl_keys[("int64",)] = "another's"
        assert len(asked) == 6
        for _ in range(2):
            assert quick(add, "here", ["int64"], {"a": "int8"}) == "add(int64)"
            assert quick(add, "here", ["none"], {}) is None
        assert len(asked) == 10
    assert quick(add, "here", ["int64"], {}) == "add(int64)"
    assert len(asked) == 11


def test_the_work_after_a_pass_is_known_of_this_numba() -> None:
    """Where numba's own has changed, it runs as it is; then this is to be looked at."""
    from numba.core.postproc import PostProcessor
    from numba.core.types import Function

    shortcuts._install()
    assert Function.get_call_type.__module__ == shortcuts.__name__
    assert PostProcessor.run.__module__ == shortcuts.__name__


def test_sizes_are_asked_for_once_within_shortcuts_alone() -> None:
    asked: list[str] = []

    def measure(self: Any, kind: str) -> int:
        asked.append(kind)
        return len(kind)

    class Context:
        """numba's, of which each function that is compiled has a copy; all have one target."""

        def codegen(self) -> str:
            return "here"

    quick, copies = shortcuts._sizes(measure), [Context() for _ in range(3)]
    kept = [weakref.ref(copy) for copy in copies]
    for _ in range(2):
        assert quick(copies[0], "i64") == 3
    assert len(asked) == 2
    with shortcuts.shortcuts():
        while copies:
            assert quick(copies[-1], "i64") == 3
            assert quick(copies.pop(), "double") == 6
    assert asked == ["i64", "i64", "i64", "double"]
    gc.collect()
    assert [ref() for ref in kept] == [None] * 3


@kernel()
def _twice(values: Any, k: int) -> Any:
    return values[k] * 2


@kernel()
def _square(values: Any, k: int) -> Any:
    return values[k] * values[k]


@kernel(out=("found",))
def both(values: Any, found: Any) -> None:
    for k in range(len(values)):
        found[k] = _twice(values, k) - _square(values, k)


def _demand_known_finish() -> None:
    """Skip the test with the oldest versions of numba, which finish libraries otherwise."""
    finish = numba.core.codegen.CPUCodeLibrary.finalize
    if finish.__module__ != shortcuts.__name__ and "_reload_init" not in finish.__code__.co_names:
        pytest.skip("this numba finishes libraries by itself")


def test_what_a_kernel_calls_is_compiled_within_it_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numba knew two functions that a kernel calls by one object once, and took one for the other."""
    _demand_known_finish()
    monkeypatch.setattr(_jit, "_keeping", False)
    values, found = np.arange(7), np.zeros(7, dtype=np.int64)
    made: Any = both.compiled()
    made(values, found)
    assert found.tolist() == [2 * k - k * k for k in range(7)]
    for part in (_twice, _square):
        called: Any = part.called()
        assert called.stats.cache_path is None
        (result,) = called.overloads.values()
        assert result.library.name.endswith(shortcuts.PART)
        assert not result.library._compiled  # no machine code of its own
    # Functions that are called from Python are whole.
    assert compiled(small).overloads


def test_how_libraries_are_finished_is_known_of_this_numba() -> None:
    """Where numba's own has changed, what kernels call is compiled by itself as well; then this is to be looked at."""
    _demand_known_finish()
    from numba.core.codegen import CPUCodeLibrary
    from numba.core.cpu import CPUContext

    shortcuts._install()
    assert CPUCodeLibrary.finalize.__module__ == shortcuts.__name__
    assert CPUContext.get_executable.__module__ == shortcuts.__name__


def test_variables_are_listed_in_the_same_order() -> None:
    from numba.core import compiler, ir

    shortcuts._install()
    code = compiler.run_frontend(small)
    ways = []
    for others in (True, False):
        with nullcontext() if others else shortcuts.shortcuts():
            ways.append([[v.name for v in inst.list_vars()] for b in code.blocks.values() for inst in b.body])
    assert ways[0] == ways[1]
    assert sum(map(len, ways[0])) > 20
    assert ir.Inst._rec_list_vars.__module__ == shortcuts.__name__


def everything(real: Any, whole: Any, narrow: Any, bits: Any, out: Any) -> int:
    """What kernels are made of, over arrays of each kind."""
    n = len(whole)
    for k in range(n):
        i = u64(k)
        a = real[i] * 0.1 + whole[k - n] / 3.0
        b = int(real[i]) + int(narrow[i]) + narrow[-1]
        out[i] = a
        out[i] += max(whole[i], 7) + min(a, real[u64(0)], b)
        if bits[k - 1]:
            out[i] -= max(real[k], whole[i])
        whole[k - n] = narrow[i] - b
        narrow[i] = min(b & 127, 100)
        bits[i] = b & 1
    return int(narrow[u64(n - 1)])


@pytest.mark.parametrize(
    "kind",
    [
        np.int32,
        pytest.param(np.uint8, marks=pytest.mark.nightly),
        pytest.param(np.int64, marks=pytest.mark.nightly),
    ],
)
def test_results_of_compiled_code_are_those_of_the_plain_form(kind: Any) -> None:
    given = _jit.kernel(out=("whole", "narrow", "bits", "out"))(everything)
    assert len(set(_results(given, (given.compiled(), given.run_plain), kind))) == 1


@pytest.mark.nightly
@pytest.mark.parametrize("kind", [np.int32, np.uint8, np.int64])
def test_results_are_the_same_with_and_without_shortcuts(kind: Any) -> None:
    given = _jit.kernel(out=("whole", "narrow", "bits", "out"))(everything)
    variant = _jit._variant(given, lambda callee: callee.called(), {_jit.u64: np.uint64})
    assert len(set(_results(given, (given.compiled(), numba.njit(**_machine.LEAN)(variant)), kind))) == 1


def _results(given: Any, forms: tuple[Any, ...], kind: Any) -> list[tuple[Any, ...]]:
    """What each form returns, and the bytes that it leaves in its arrays."""
    rng = np.random.default_rng(3)
    room = (
        rng.normal(0, 50, 40),
        rng.integers(-99, 99, 40),
        rng.integers(0, 90, 40).astype(kind),
        rng.random(40) < 0.5,
        np.zeros(40),
    )
    found = []
    for form in forms:
        arrays = tuple(array.copy() for array in room)
        found.append((form(*arrays), *(array.tobytes() for array in arrays)))
    return found
