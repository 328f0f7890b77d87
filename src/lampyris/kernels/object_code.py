"""Files of machine code, and linking it with llvmlite alone: see :mod:`.kept_code`.

A file is one line of JSON, which says what its code is for and what it needs, and the object code (ELF) after it.
"""

from __future__ import annotations

import ctypes
import json
import os
import struct
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from importlib import machinery, util
from pathlib import Path
from typing import Any

from lampyris._core import cancellation
from lampyris.kernels import _machine
from lampyris.kernels.kept_code import SUFFIX, Version, array_type, folders, usable
from lampyris.kernels.loading import loading

FORMAT = 1
"""Of the files. Those of another format are not read."""
UNUSABLE = (ImportError, OSError, RuntimeError, AttributeError)
"""What other versions of llvmlite and numba may come to."""

_lock = threading.RLock()
_alive: list[object] = []
"""What machine code in use refers to: it stays to the end of the process."""


class _Method(ctypes.Structure):
    """``PyMethodDef`` of Python's C interface."""

    _fields_ = (
        ("name", ctypes.c_char_p), ("call", ctypes.c_void_p), ("flags", ctypes.c_int), ("doc", ctypes.c_char_p),
    )  # fmt: skip


_WITH_KEYWORDS = 0x1 | 0x2
"""Flags of a method that takes a tuple and a dictionary."""


def load(name: str, edition: str, types: Sequence[str]) -> Version | None:
    """The version of a kernel for some types of arguments; None: it is not kept, or cannot be used here.

    Parameters
    ----------
    name : of the kernel, with its module.
    edition : of its sources.
    types : see :func:`.kept_code.types_of`.
    """
    with _lock, cancellation.uninterrupted(), loading():
        try:
            wanted = file_name(name, edition, types, processor(_linker()))
        except UNUSABLE:
            return None
        for folder in folders():
            found = read(folder / wanted)
            if found is not None:
                return _link(*found)
    return None


def file_name(name: str, edition: str, types: Sequence[str], processor: str) -> str:
    """The name of the file of one version. Each kind of processor has its own: a cluster's computers may share a folder."""
    digest = blake2b(f"{_versions()} {processor} {' '.join(types)}".encode(), digest_size=10).hexdigest()
    return f"{name}-{edition}-{digest}{SUFFIX}"


@cache
def _versions() -> str:
    """Of what makes machine code, in one word.

    Files of numba and llvmlite are read for theirs: importing numba takes longer than all that is done here.
    """
    whole = blake2b(f"{FORMAT} {sys.implementation.cache_tag} {sys.abiflags}".encode(), digest_size=8)
    for name in ("numba", "llvmlite"):
        found = util.find_spec(name)
        if found is not None and found.origin is not None:
            with suppress(OSError):
                whole.update(Path(found.origin).with_name("_version.py").read_bytes())
    return whole.hexdigest()


def read(file: Path) -> tuple[dict[str, Any], bytes] | None:
    """What a file says, and its object code; None: there is none, or it is damaged."""
    try:
        line, _, code = file.read_bytes().partition(b"\n")
        said = json.loads(line)
        if said["digest"] == _digest(said, code):
            return said, code
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        pass
    return None


def _digest(said: dict[str, Any], code: bytes) -> str:
    """Of all that a file holds, itself excepted."""
    words = json.dumps({key: value for key, value in said.items() if key != "digest"})
    return blake2b(words.encode() + code, digest_size=16).hexdigest()


def _link(said: dict[str, Any], code: bytes) -> Version | None:
    """The function that object code holds; None: not on this processor, or it refers to something unknown."""
    try:
        llvm = _linker()
    except UNUSABLE:
        return None
    # LLVM ends the process over a symbol that it does not find.
    process = ctypes.CDLL(None)
    known = all(llvm.address_of_symbol(symbol) or hasattr(process, symbol) for symbol in said["needs"])
    if not known or said["processor"] != processor(llvm):
        return None
    # An engine for each: the same names in two files never meet.
    target = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(opt=3, jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    # Numba's machine code asks for the object that holds its constants. Kernels have none, so that any object will do.
    constants = object()
    place = engine.get_global_value_address(said["constants"])
    cell: Any = ctypes.py_object.from_address(place)
    cell.value = constants
    address = engine.get_function_address(said["function"])
    method = _Method(said["kernel"].encode(), address, _WITH_KEYWORDS, None)
    make = ctypes.pythonapi.PyCFunction_NewEx
    make.restype, make.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.py_object, ctypes.py_object)
    function: Version = make(ctypes.addressof(method), None, None)
    _alive.append((engine, constants, method))
    return function


@cache
def _linker() -> Any:
    """LLVM, ready to link.

    Raises
    ------
    ImportError, OSError, RuntimeError, AttributeError : it cannot be had, or is another version.
    """
    import llvmlite.binding as llvm  # type: ignore[import-untyped]

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for name, address in _c_functions_of_numba().items():
        llvm.add_symbol(f"numba_{name}", address)
    _machine.know_clock()
    return llvm


def _c_functions_of_numba() -> dict[str, int]:
    """Addresses of the C functions that machine code made by numba calls. Numba is not imported.

    Raises
    ------
    ImportError : numba has no such library.
    """
    library = sys.modules.get("numba._helperlib")
    if library is None:
        package = util.find_spec("numba")
        places = list(package.submodule_search_locations or ()) if package else []
        found = machinery.PathFinder.find_spec("numba._helperlib", places)
        if found is None or found.loader is None:
            raise ImportError("numba has no _helperlib")
        library = util.module_from_spec(found)
        found.loader.exec_module(library)
        _alive.append(library)
    functions: dict[str, int] = library.c_helpers
    return functions


@cache
def processor(llvm: Any) -> str:
    """The name of this processor, and what it can do.

    Raises
    ------
    RuntimeError : LLVM does not know it.
    """
    return f"{llvm.get_process_triple()} {llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"


def keep(name: str, edition: str, dispatcher: Any, given: Sequence[Any]) -> None:
    """Keep what numba has made for one list of types, unless it is kept already or needs numba to run.

    Parameters
    ----------
    name, edition : see :func:`load`.
    dispatcher : numba's, which has it.
    given : numba's types.
    """
    if not usable():
        return
    types = types_of_numba(given)
    if types is None:
        return
    from llvmlite import binding

    try:
        here = processor(binding)
    except UNUSABLE:
        return
    wanted = file_name(name, edition, types, here)
    if any(read(folder / wanted) is not None for folder in folders()):
        return
    try:
        made = dispatcher.overloads[tuple(given)]
        if made.objectmode or made.lifted or made.environment.consts:
            return
        code = _object_code(dispatcher, made, tuple(given))
        said: dict[str, Any] = {
            "kernel": name,
            "types": list(types),
            "processor": here,
            "function": made.fndesc.llvm_cpython_wrapper_name,
            "constants": made.fndesc.env_name,
            "needs": sorted(undefined(code)),
        }
    except (
        AttributeError,
        LookupError,
        TypeError,
        RuntimeError,
        ValueError,
        struct.error,
    ):  # another version of numba
        return
    said["digest"] = _digest(said, code)
    _write(wanted, json.dumps(said).encode() + b"\n" + code)


def _object_code(dispatcher: Any, made: Any, given: tuple[Any, ...]) -> bytes:
    """What numba has made, or has read from a file of its own and given to LLVM."""
    try:
        return bytes(made.library._get_compiled_object())
    except RuntimeError:
        kept = dispatcher._cache
        library, *_ = kept._cache_file.load(kept._index_key(given, made.library.codegen))
        _, _, (code, _) = library
        return bytes(code)


def _write(name: str, content: bytes) -> None:
    """Write a file, whole or not at all, to the first folder that takes it."""
    for folder in folders():
        part = folder / f"{name}.{os.getpid()}-{threading.get_ident()}.part"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            part.write_bytes(content)
            part.replace(folder / name)
            return
        except OSError:
            with suppress(OSError):
                part.unlink()


def types_of_numba(args: Sequence[Any]) -> tuple[str, ...] | None:
    """Types of numba's in the words of :func:`.kept_code.types_of`; None: one of them has none."""
    from numba.core import types
    from numba.np.numpy_support import as_dtype

    named = []
    for one in args:
        if type(one) is types.Array and one.aligned:
            kind = as_dtype(one.dtype).str[1:]
            named.append(array_type(kind, one.ndim, one.layout, one.mutable))
        elif isinstance(one, (types.Integer, types.Float, types.Boolean)):
            named.append(as_dtype(one).str[1:])
        else:
            return None
    return tuple(named)


def undefined(code: bytes) -> Iterator[str]:
    """The symbols that object code refers to and does not hold: those of an ELF file of 64 bits, little-endian.

    Raises
    ------
    ValueError, struct.error : it is another kind of file, or damaged.
    """
    if code[:6] != b"\x7fELF\x02\x01":
        raise ValueError("not an ELF file of 64 bits")
    (table,) = struct.unpack_from("<Q", code, 0x28)
    size, many = struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", code, table + k * size) for k in range(many)]
    for _, kind, _, _, place, length, link, _, _, each in sections:
        if kind != SYMBOLS:
            continue
        names = sections[link][4]
        for at in range(place + each, place + length, each):
            name, _, _, section = struct.unpack_from("<IBBH", code, at)
            if section == UNDEFINED:
                start = names + name
                yield code[start : code.index(b"\0", start)].decode()


SYMBOLS, UNDEFINED = 2, 0
"""In ELF files: a section with a table of symbols; the section of symbols that are elsewhere."""
