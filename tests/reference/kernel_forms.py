"""Run kernels in one form, whatever their size."""

from __future__ import annotations

from typing import Any

import pytest

from lampyris.kernels import _jit


def use(monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    """From here on every kernel runs in that form: ``plain`` or ``compiled``."""
    if form == "compiled" and _jit.jit_disabled():
        pytest.skip("NUMBA_DISABLE_JIT is set: there is no compiled form")

    def call(self: _jit.Kernel, *args: Any) -> Any:
        return self.run_plain(*args) if form == "plain" else self.compiled()(*self.complete(args))

    monkeypatch.setattr(_jit.Kernel, "__call__", call)
