"""The heap that knows where each cell is, and kernels that call kernels of another file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lampyris.kernels._jit import jit_disabled
from lampyris.kernels.heap import put, take


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_against_a_sorted_list(form: str) -> None:
    if form == "compiled" and jit_disabled():
        pytest.skip("NUMBA_DISABLE_JIT is set: there is no compiled form")
    add, drop = (k.run_plain if form == "plain" else k.compiled() for k in (put, take))
    rng = np.random.default_rng(5)
    n = 40
    heap, place = np.zeros(n + 1, np.int32), np.zeros(n, np.int32)
    first, second = (rng.integers(0, 6, n) for _ in range(2))
    inside: set[int] = set()
    for _ in range(1500):
        cell = int(rng.integers(n))
        if cell in inside and rng.random() < 0.4:
            drop(heap, place, first, second, cell)
            inside.remove(cell)
        else:
            first[cell], second[cell] = rng.integers(0, 6, 2)
            add(heap, place, first, second, cell)
            inside.add(cell)
        assert heap[0] == len(inside)
        assert {int(c) for c in heap[1 : heap[0] + 1]} == inside
        assert all(heap[place[c]] == c for c in inside)
        assert not place[sorted(set(range(n)) - inside)].any()
        keys = [(first[c], second[c]) for c in heap[1 : heap[0] + 1]]
        assert all(keys[i] >= keys[(i - 1) // 2] for i in range(1, len(keys)))


@pytest.mark.nightly
def test_a_changed_callee_in_another_file_is_compiled_anew(tmp_path: Path) -> None:
    """numba's disk cache looks at the caller's file alone; ours must not be fooled by that."""
    if jit_disabled():
        pytest.skip("NUMBA_DISABLE_JIT is set: nothing is compiled")
    head = "from lampyris.kernels._jit import kernel\n"
    caller = head + "from callee import inner\n@kernel()\ndef outer(a):\n    return inner(a)\n"
    (tmp_path / "caller.py").write_text(caller)

    def answer(factor: int) -> str:
        callee = f"{head}@kernel()\ndef inner(a):\n    return {factor} * a[0]\n"
        (tmp_path / "callee.py").write_text(callee)
        code = "import caller, numpy; print(caller.outer.compiled()(numpy.ones(1, numpy.int64)))"
        done = subprocess.run(
            [sys.executable, "-B", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    assert answer(2) == "2"
    assert answer(3) == "3"
