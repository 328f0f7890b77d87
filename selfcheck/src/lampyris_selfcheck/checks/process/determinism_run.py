"""The corpus in a process of its own: asked by JSON on standard input, answered by JSON on standard output.

The environment is the setting: :mod:`.determinism` starts this once for each.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import locale
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.kernels import _jit
from lampyris_selfcheck.checks.process import determinism_cases as corpus
from lampyris_selfcheck.checks.process.canonical import digest

WORDS = ("arrived", "blocked", "cell", "drive", "edge", "field", "goal", "heap", "jump", "kernel", "lane")
"""Their order in a set is the hash seed's."""
_THREADS = tuple(
    f"{before}openblas_get_num_threads{after}" for before in ("scipy_", "") for after in ("64_", "")
)
"""What OpenBLAS calls it in NumPy's wheels, SciPy's, and Linux's."""


def answer(request: Mapping[str, Any]) -> dict[str, Any]:
    """The hashes of some cases.

    Parameters
    ----------
    request : ``numbers`` of cases; ``shuffle``: seed of their order, or None for as they are told;
        ``compiled``: whether kernels shall run as machine code from the first call on.

    Returns
    -------
    dict
        ``cases``: number, what it was, its hash or the words of an exception. ``signs``: what the setting
        shows in, beside results: equal signs in two settings mean that one of them was not set.
    """
    spoken = _locale()
    if request["compiled"]:
        _jit.prefer_compiled()
    numbers = list(request["numbers"])
    if request["shuffle"] is not None:
        np.random.Generator(np.random.PCG64(request["shuffle"])).shuffle(numbers)
    cases = [[number, *_case(number)] for number in numbers]
    signs = {
        "words": ",".join(set(WORDS)),
        "exp": digest(np.exp(np.linspace(-3.0, 3.0, 10_001))),
        "zone": time.strftime("%H:%M", time.localtime(0)),
        "locale": spoken,
        "compiled": str(sum(kernel._compiled is not None for kernel in _jit.KERNELS)),
        **_in_force(),
    }
    return {"cases": cases, "signs": signs}


def _case(number: int) -> tuple[str, str]:
    try:
        return corpus.case(number)
    except Exception as fault:
        return "fault", f"{type(fault).__name__}: {fault}"


def _in_force() -> dict[str, str]:
    """What the libraries say of themselves, whatever the environment says."""
    numba: Any = importlib.import_module("numba")
    at_once = _jit.PLAIN_NS < 0 and _jit.OWN_NS < 0
    return {
        "jit": "off" if _jit.jit_disabled() and numba.config.DISABLE_JIT else "on",
        "first call": "compiled" if at_once else "counted",
        "numba threads": str(numba.config.NUMBA_NUM_THREADS),
        "blas threads": _blas_threads(),
        "extensions": " ".join(extensions()),
    }


def extensions() -> tuple[str, ...]:
    """What this processor has that NumPy was built to use and can do without, by NumPy's own names, as far as
    it is not switched off."""
    for name in ("numpy._core._multiarray_umath", "numpy.core._multiarray_umath"):
        try:
            room: Any = importlib.import_module(name)
        except ImportError:
            continue
        return tuple(one for one in room.__cpu_dispatch__ if room.__cpu_features__.get(one))
    return ()


def _blas_threads() -> str:
    """How many threads NumPy's OpenBLAS has; empty for another BLAS, or a system that does not tell."""
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    for path in sorted({line.split()[-1] for line in lines if "openblas" in line}):
        room = ctypes.CDLL(path)
        for name in _THREADS:
            if hasattr(room, name):
                return str(getattr(room, name)())
    return ""


def _locale() -> str:
    """That of the environment, now in force; where the system does not have it, which it is."""
    try:
        return f"{locale.setlocale(locale.LC_ALL, '')} {locale.getpreferredencoding(False)}"
    except locale.Error:
        return f"not there, {locale.getpreferredencoding(False)}"


def main() -> None:
    """Answer one request."""
    sys.stdout.write(json.dumps(answer(json.load(sys.stdin))))


if __name__ == "__main__":
    main()
