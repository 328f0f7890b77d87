"""What only machine code has: the compiled forms of :mod:`._helpers`, numba's events and files."""

from __future__ import annotations

import gc
import hashlib
import operator
import os
import pickle
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any

from lampyris._core import cancellation
from lampyris.kernels.loading import loading


@cache
def listen(tell: Callable[[bool], None]) -> None:
    """Have ``tell`` called with True when numba begins to compile, and with False when it is done with all.

    What it finds on disk is no compilation. Once for a process.
    """
    from numba.core import event

    class Ear(event.Listener):
        depth = 0

        def on_start(self, _: Any) -> None:
            self.depth += 1
            tell(True)

        def on_end(self, _: Any) -> None:
            self.depth -= 1
            if not self.depth:
                tell(False)

    event.register("numba:compile", Ear())


MANY_OBJECTS = 10_000
"""New objects whose examination by the garbage collector takes a millisecond or more."""


@contextmanager
def uncollected() -> Iterator[None]:
    """No garbage collection meanwhile: importing numba makes half a million objects that stay, and examining
    them over and over is a quarter of the time that it takes.

    Afterwards they count as old, as if a collection had passed: the first one after it would take 40 to 90 ms. Where
    objects have been frozen (:func:`gc.freeze`) this is left out, as those would thaw; Python 3.12 freezes some itself
    as it starts. Few new objects are left to the next collection: Python counts frozen objects one by one, which takes
    longer than the load of a kernel.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            if gc.get_count()[0] > MANY_OBJECTS and gc.get_freeze_count() == 0:
                gc.freeze()
                gc.unfreeze()
            gc.enable()


def load() -> None:
    """Import numba now, rather than within a call that has a time limit; it takes a third of a second.

    Ctrl-C meanwhile is heard when it is over: what is left of numba after half an import works no more.
    """
    with cancellation.uninterrupted(), loading(), uncollected():
        before = set(sys.modules)
        try:
            import numba  # noqa: F401

            _without_masked_arrays()
        except BaseException:
            # Memory or the stack has run out. What is complete of it must go, too: a second import would take
            # it as it is, without its place in its package.
            for name in sorted(set(sys.modules) - before):
                if name.partition(".")[0] in ("numba", "llvmlite", "yaml"):
                    sys.modules.pop(name, None)
            raise


@cache
def _without_masked_arrays() -> None:
    """Have numba find the type of an array without importing those with masks, to see that it is none: 8 to 15 ms."""
    import numpy as np
    from numba.core import types
    from numba.core.typing import typeof
    from numba.np import numpy_support

    registered: Any = getattr(typeof, "typeof_impl", None)
    if registered is None:  # another version of numba
        return
    whole = registered.dispatch(np.ndarray)

    def typeof_array(val: Any, context: Any) -> Any:
        if type(val) is not np.ndarray or val.dtype.kind not in "biuf" or not val.dtype.isnative:
            return whole(val, context)
        kind, layout = numpy_support.from_dtype(val.dtype), numpy_support.map_layout(val)
        return types.Array(kind, val.ndim, layout, readonly=not val.flags.writeable)

    registered.register(np.ndarray, typeof_array)


def _without_linear_algebra() -> None:
    """Import the part of numba that looks for SciPy's linear algebra without importing that.

    No kernel uses it, and its import took 14 to 38 % of the first call that compiles in three runs. Other code of this process
    that has numba compile a product of matrices works as before: numba imports it where it is used.
    """
    name = "numba.np.arraymath"
    if name in sys.modules or "scipy.linalg" in sys.modules:
        return
    try:
        from numba.np import linalg
    except ImportError:  # another version of numba
        return
    sound = getattr(linalg, "ensure_blas", None)
    if sound is None or name in sys.modules:
        return

    def missing() -> None:
        raise ImportError("not looked for yet")

    linalg.ensure_blas = missing
    try:
        from numba.np import arraymath
    finally:
        linalg.ensure_blas = sound
    vars(arraymath).update(ensure_blas=sound, _HAVE_BLAS=find_spec("scipy") is not None)


def compiled(plain: FunctionType, *, cache: bool, forceinline: bool, inner: bool) -> Any:
    """The compiled form of a function: it is compiled, or loaded from disk, when it is first called with
    arguments of some types. No signal comes between: numba would keep half of what it was about to learn.

    What only kernels call (``inner``) needs no wrappers for calls from Python and C.

    Raises
    ------
    RuntimeError : no folder to keep it in can be written to.
    """
    import numba

    from lampyris.kernels._passes import pipeline

    lean = {**LEAN, "no_cpython_wrapper": inner, "pipeline_class": pipeline()}
    made: Any = numba.njit(cache=cache, nogil=True, fastmath=False, forceinline=forceinline, **lean)(plain)
    _load_alone(made._cache)
    compile_for, resolve = made._compile_for_args, made.get_call_template

    def undivided(*args: Any, **kwargs: Any) -> Any:
        with cancellation.uninterrupted(), loading(), uncollected():
            return compile_for(*args, **kwargs)

    # Numba's dispatcher, in C, calls this by name for arguments of types that it does not know yet, and runs
    # what comes of it after that.
    made._compile_for_args = undivided
    # Numba calls this for a call of a kernel by a kernel.
    made.get_call_template = lambda args, kws: resolve(tuple(_general(one) for one in args), kws)
    return made


def _load_alone(kept: Any) -> None:
    """Have a dispatcher read its machine code from disk without preparing numba to compile.

    Before it looks on disk numba imports all that it can compile and registers each function of it: 0.2 s, once for a
    process. Machine code that was kept is complete and asks for none of it. Where there is none, the compiler
    prepares itself.
    """
    read, guarded = (
        getattr(kept, "_load_overload", None),
        getattr(kept, "_guard_against_spurious_io_errors", None),
    )
    whole = kept.load_overload

    def load_overload(signature: Any, target: Any) -> Any:
        if read is None or guarded is None:  # it keeps nothing, or this is another version of numba
            _without_linear_algebra()
            return whole(signature, target)
        with guarded():
            found = read(signature, target)
        if found is None:
            _without_linear_algebra()
        return found

    kept.load_overload = load_overload


LEAN: Mapping[str, Any] = {"_nrt": False, "no_cfunc_wrapper": True}
"""Nothing is allocated, so nothing has to be counted. If it is, each call of a kernel by a kernel counts its
arrays up and down with locked instructions: a quarter of the time of whole simulations. C calls no kernel."""


def _general(kind: Any) -> Any:
    """The type that a kernel is compiled for when another calls it with an argument of this type.

    Numba would compile once more for each constant, and for each mixture of 32 and 64 bits; arithmetic has 64 in
    either case, and LLVM still sees the constants.
    """
    from numba.core import types

    kind = types.unliteral(kind)
    return types.int64 if kind == types.int32 else kind


HERE = Path(__file__).resolve().parent


@cache
def edition(folder: Path = HERE) -> str:
    """What the files of kernels hold, in sixteen letters: it is in the name of what is kept of them.

    All of them in that folder, and here, not those that a kernel has callees in: it may have a constant from
    another, and how it is compiled stands here.
    """
    if HERE in folder.parents:
        return edition()
    whole = hashlib.sha256()
    for file in sorted({*_sources(HERE), *_sources(folder)}):
        with open(file, "rb") as stream:
            whole.update(stream.read())
    return whole.hexdigest()[:16]


def digest(parts: Iterable[bytes]) -> str:
    """Eight letters that differ where the bytes do."""
    whole = hashlib.sha256()
    for part in parts:
        whole.update(part)
    return whole.hexdigest()[:8]


def _sources(folder: Path | str) -> Iterator[str]:
    # Every process that runs machine code asks; what is kept beside them may be thousands of files.
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        if name.endswith(".py"):
            yield path
        elif "." not in name and name != "__pycache__" and os.path.isdir(path):
            yield from _sources(path)


@cache
def prefetch() -> Any:
    """The compiled form of :func:`._helpers.fetch`: LLVM's prefetch, for writing, to the nearest cache."""
    from llvmlite import ir  # type: ignore[import-untyped]
    from numba.core import types
    from numba.extending import intrinsic

    def fetch(typing: Any, array: Any, index: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
            data = context.make_array(signature.args[0])(context, builder, args[0]).data
            kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
            prefetch = builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
            place = builder.bitcast(builder.gep(data, [args[1]]), byte)
            builder.call(prefetch, [place, word(1), word(3), word(1)])
            return context.get_dummy_value()

        return types.void(array, index), generate

    return intrinsic(fetch)


@cache
def stopped() -> Any:
    """The compiled form of :func:`._helpers.stopped`: an atomic load.

    LLVM neither keeps its value nor moves it out of a loop; to the processor it is a load like any other.
    """
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic

    def stopped(typing: Any, halt: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            data = context.make_array(signature.args[0])(context, builder, args[0]).data
            word = builder.load_atomic(data, "monotonic", 8)
            return builder.icmp_signed("!=", word, ir.Constant(ir.IntType(64), 0))

        return types.boolean(halt), generate

    return intrinsic(stopped)


@cache
def bit(instruction: str) -> Any:
    """The compiled form of ``lowest`` (``cttz``) or ``highest`` (``ctlz``) of :mod:`._helpers`, signed."""
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic

    def count(typing: Any, word: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            # The second argument says that the word is never 0, which spares a test on older processors.
            zeros = getattr(builder, instruction)(args[0], ir.Constant(ir.IntType(1), 1))
            return zeros if instruction == "cttz" else builder.sub(ir.Constant(ir.IntType(64), 63), zeros)

        return types.int64(types.uint64), generate

    return intrinsic(count)


@cache
def whole() -> Any:
    """The compiled form of ``int``, as numba has it; numba compiles a function for each type of argument."""
    from numba.core import types
    from numba.extending import intrinsic

    def integer(typing: Any, value: Any) -> Any:
        kind = types.unliteral(value)
        made = kind if isinstance(kind, types.Integer) else types.intp

        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return context.cast(builder, args[0], signature.args[0], signature.return_type)

        return made(kind), generate

    return intrinsic(integer)


@cache
def extreme(better: Callable[[Any, Any], bool]) -> Any:
    """The compiled form of ``min`` (``operator.lt``) or ``max`` (``operator.gt``) of several numbers, likewise."""
    from numba.core import cgutils, types
    from numba.extending import intrinsic

    def extreme(typing: Any, *values: Any) -> Any:
        kinds = tuple(map(types.unliteral, values))

        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            from numba.cpython.builtins import do_minmax

            each = cgutils.unpack_tuple(builder, args[0])
            return do_minmax(context, builder, list(kinds), each, better)

        return typing.unify_types(*kinds)(types.StarArgTuple(kinds)), generate

    return intrinsic(extreme)


def use_builtins(function: FunctionType) -> None:
    """Put these in the place of Python's own in a function's globals, which are its alone."""
    for name, make in (
        ("int", whole),
        ("min", partial(extreme, operator.lt)),
        ("max", partial(extreme, operator.gt)),
    ):
        if name in function.__code__.co_names:
            function.__globals__.setdefault(name, make())


@cache
def know_clock() -> None:
    """Tell LLVM where the system's clock is.

    Kept machine code refers to it by its name; its address is another in each process.
    """
    import ctypes

    from llvmlite import binding

    counter = getattr(ctypes, "windll", None)
    system: Any = (
        ctypes.CDLL(None).clock_gettime if counter is None else counter.kernel32.QueryPerformanceCounter
    )
    binding.add_symbol(CLOCK, ctypes.cast(system, ctypes.c_void_p).value)


CLOCK = "lampyris_clock"
"""The name of the system's clock in machine code."""


@cache
def clock() -> Any:
    """The compiled form of :func:`._helpers.clock`: a call of the system's own clock, 20 to 40 ns."""
    import ctypes

    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.extending import intrinsic

    know_clock()
    counter = getattr(ctypes, "windll", None)

    def clock(typing: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            word, wide = ir.IntType(32), ir.IntType(64)
            room = cgutils.alloca_once(builder, ir.ArrayType(wide, 2))
            place = builder.bitcast(room, wide.as_pointer())
            if counter is None:
                kind = ir.FunctionType(word, [word, wide.as_pointer()])
                given = [word(time.CLOCK_MONOTONIC), place]
            else:
                kind = ir.FunctionType(word, [wide.as_pointer()])
                given = [place]
            function = cgutils.get_or_insert_function(builder.module, kind, CLOCK)
            builder.call(function, given)
            first = builder.load(place)
            if counter is not None:
                return first
            rest = builder.load(builder.gep(place, [wide(1)]))
            return builder.add(builder.mul(first, wide(10**9)), rest)

        return types.int64(), generate

    return intrinsic(clock)


def damaged(folder: Path) -> list[Path]:
    """The files of a folder of numba's that cannot be read as numba reads them.

    An index (.nbi) is numba's version and, if that is the present one, a table; the rest (.nbc) is in one
    piece. Damage within the machine code itself is not noticed, by numba neither.
    """
    import numba

    found = []
    for file in sorted(folder.glob("*.nb[ic]")):
        try:
            with file.open("rb") as stream:
                first = pickle.load(stream)
                if file.suffix == ".nbi" and first == numba.__version__:
                    _, table = pickle.load(stream)
                    dict(table)
        except FileNotFoundError:
            continue  # another process deletes them, too
        except Exception:  # whatever a broken pickle may come to
            found.append(file)
    return found
