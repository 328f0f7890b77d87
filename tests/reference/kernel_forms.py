"""Run kernels in one form, whatever their size."""

from __future__ import annotations

from typing import Any

import pytest

from lampyris.kernels import _jit


def run_compiled(k: _jit.Kernel, *args: Any) -> Any:
    """Run a kernel in its compiled form, as :meth:`Kernel.run_plain` does in the plain one."""
    return k.compiled()(*k.complete(args))


def use(monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    """From here on every kernel runs in that form: ``plain`` or ``compiled``."""
    if form == "compiled" and _jit.jit_disabled():
        pytest.skip("NUMBA_DISABLE_JIT is set: there is no compiled form")

    def call(self: _jit.Kernel, *args: Any) -> Any:
        return self.run_plain(*args) if form == "plain" else run_compiled(self, *args)

    monkeypatch.setattr(_jit.Kernel, "__call__", call)
