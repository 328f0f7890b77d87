"""Machine code of kernels that an earlier run kept, run without numba.

Numba compiles a kernel, and keeps what it made in a form that only numba reads; importing numba takes about 0.25 s of
processor time. The machine code itself needs LLVM's linker (llvmlite, 0.02 to 0.05 s) and numba's small library of C
functions. So each version of a kernel, one for each list of argument types, is kept a second time, in a form that
:mod:`.object_code` reads. Later processes run it without importing numba.

It is used where everything that it depends on is the same: the sources of the kernels (:func:`._machine.edition`), the
versions of Python, numba and llvmlite, the processor and its features. A digest finds damage, and every symbol that the code
refers to must be known. Otherwise numba loads or compiles the kernel. That is also so

* on other systems than Linux on 64 bits, where this was not tried;
* where a variable of the environment or a file configures numba (:data:`NEUTRAL` excepted).

A call looks at the types of its arguments first, 0.1 to 0.2 us for each; then the machine code runs.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from lampyris._core.system import links_elf

SUFFIX = ".code"
"""Of the names of files of machine code."""
HERE = Path(__file__).resolve().parent
NEUTRAL = ("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER")
"""Variables of the environment that do not change the machine code of kernels: the folder it is kept in, and threads for
parallel loops, which no kernel has. Workers of studies are started with the second one."""

_C_ORDER, _F_ORDER, _WRITEABLE = 0x1, 0x2, 0x400
"""Bits of the flags of an array, as NumPy's C interface numbers them."""
_FLAGS = _C_ORDER | _F_ORDER | _WRITEABLE
_DIMENSIONS, _KIND = 12, 20
"""Of the numbers that describe arrays, the first bits of these; NumPy's arrays have up to 64 dimensions."""
_DTYPES = {np.dtype(name): k << _KIND for k, name in enumerate(("?", *"bhilBHIL", "f4", "f8"), 1)}
_NAMES = {number: kind.str[1:] for kind, number in _DTYPES.items()}
_SCALARS: dict[type, str] = {kind.type: kind.str[1:] for kind in _DTYPES} | {float: "f8", bool: "b1"}

Looks = tuple[int | str, ...]
"""The types of the arguments of a call, one by one: what the version of a kernel depends on."""
Version = Callable[..., Any]
"""Machine code for one list of argument types."""


class KeptCode:
    """All versions of one kernel that are kept. It is called as the kernel is.

    Parameters
    ----------
    load : finds the version for types of arguments, as :func:`types_of` names them; None: there is none.
    otherwise : called in its place for arguments of types that no version is kept for.
    """

    def __init__(self, load: Callable[[tuple[str, ...]], Version | None], otherwise: Version) -> None:
        self._load, self._otherwise = load, otherwise
        self._versions: dict[Looks, Version] = {}

    def __call__(self, *args: Any) -> Any:
        try:
            looks = looks_of(args)
        except KeyError:
            return self._otherwise(*args)
        return (self._versions.get(looks) or self._find(looks))(*args)

    def _find(self, looks: Looks) -> Version:
        found = self._load(types_of(looks))
        if found is None:
            return self._otherwise
        self._versions[looks] = found
        return found


def looks_of(args: Sequence[Any]) -> Looks:
    """The types of the arguments of a call, quickly.

    Raises
    ------
    KeyError : one of them is of a type that no machine code is kept for.
    """
    looks: list[int | str] = []
    for value in args:
        kind = type(value)
        if kind is np.ndarray:
            looks.append(_DTYPES[value.dtype] | value.ndim << _DIMENSIONS | (value.flags.num & _FLAGS))
        elif kind is int:
            if not -(2**63) <= value < 2**63:
                raise KeyError(kind)
            looks.append("i8")
        else:
            looks.append(_SCALARS[kind])
    return tuple(looks)


def types_of(looks: Looks) -> tuple[str, ...]:
    """The same in words, for the names of files."""
    return tuple(one if isinstance(one, str) else _described(one) for one in looks)


def _described(one: int) -> str:
    order = "C" if one & _C_ORDER else "F" if one & _F_ORDER else "A"
    dimensions = (one & (1 << _KIND) - 1) >> _DIMENSIONS
    return array_type(_NAMES[one >> _KIND << _KIND], dimensions, order, one & _WRITEABLE != 0)


def array_type(kind: str, dimensions: int, order: str, writeable: bool) -> str:
    """The type of an array in words. As to numba, it is the same whether elements are aligned."""
    return f"{kind}[{dimensions}{order}{'' if writeable else ' readonly'}]"


@cache
def usable() -> bool:
    """Whether machine code can be kept for, and run in, a process without numba."""
    if not links_elf() or sys.implementation.name != "cpython" or os.path.exists(".numba_config.yaml"):
        return False
    if any(name.startswith("NUMBA_") and name not in NEUTRAL for name in os.environ):
        return False
    return all(find_spec(name) is not None for name in ("numba", "llvmlite"))


def folders() -> tuple[Path, ...]:
    """Where machine code is looked for; it is kept in the first of them that can be written to.

    Where the user's cache folder is not an absolute path (``HOME`` is not set and the user is unknown), it is left out: it
    would be a folder of the working directory.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return (Path(given) / "lampyris_kernels",)
    own = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    users = (Path(own) / "lampyris" / "kernels",) if os.path.isabs(own) else ()
    return (HERE / "__pycache__", *users)


def is_kept(name: str, edition: str) -> bool:
    """Whether some version of a kernel was kept when this process first asked for one.

    Parameters
    ----------
    name : of the kernel, with its module.
    edition : of its sources, or the beginning of it.
    """
    start = f"{name}-{edition}"
    return any(file.startswith(start) for folder in folders() for file in _files(folder))


@cache
def _files(folder: Path) -> tuple[str, ...]:
    with suppress(OSError):
        return tuple(name for name in sorted(os.listdir(folder)) if name.endswith(SUFFIX))
    return ()


def is_loaded() -> bool:
    """Whether this process runs kept machine code already."""
    return "lampyris.kernels.object_code" in sys.modules and "llvmlite" in sys.modules
