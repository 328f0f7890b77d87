"""The one file that imports numba, and only when a kernel is worth compiling.

A kernel is written once, as a plain function over *flat* sequences. It runs in two forms with equal
results:

* **plain**: Python over lists, about 400 ns a cell. Small work is over sooner this way than importing numba
  takes (0.25 s, and about 1 s to compile a kernel for the first time).
* **compiled**: the same source through ``numba.njit`` with its disk cache, for large or repeated work.

``NUMBA_DISABLE_JIT=1`` keeps the plain form always. Which form ran never changes a result: kernels use
integers and ``+ - * / sqrt`` on float64, in a stated order, without fastmath.

Rules for kernel source
-----------------------
* arguments are scalars and one-dimensional arrays; nothing is allocated inside; results are written into
  arguments named in ``out``;
* unsigned indices are made by :func:`u64` (signed or 32-bit index arithmetic costs a third of the speed;
  and numba turns ``uint64 + int64`` into a float, so no bare literal may meet an unsigned value: write
  ``u64(1)``);
* a kernel may call other kernels, of its own file or imported by name. numba's disk cache notices a changed
  file, not a changed callee elsewhere; so what is kept on disk is named after the other files, too.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

PLAIN_CELLS = 120_000
"""Largest work (elements of the longest array) that a kernel does in its plain form in a fresh process."""
PLAIN_TOTAL = 400_000
"""After so many elements in plain form, all kernels together, compiling pays."""

_LEAN: Mapping[str, Any] = {"_nrt": False}
"""Nothing is allocated, so nothing has to be counted. If it is, each call of a kernel by a kernel counts its
arrays up and down with locked instructions: a quarter of the time of whole simulations."""

_spent = 0
_ears: list[Callable[[bool], None]] = []
"""Called whenever machine code is made that was not kept from before."""


def on_compile(ear: Callable[[bool], None]) -> None:
    """Have something called with True when machine code is about to be made that no run before has left on
    disk, and with False when it is there.

    It takes a second or more for each kernel, once for a machine; whoever waits may want to know. Numba is
    not imported for this.
    """
    _ears.append(ear)


def u64(value: Any) -> Any:
    """Make an unsigned 64-bit index in the compiled form; the value itself in the plain form."""
    return value


def fetch(array: Any, index: Any) -> None:
    """Say that ``array[index]`` will be written to soon: fetch it meanwhile. Nothing in the plain form.

    A store to a line of memory that is far away holds up every store after it, and unlike a load that is
    made early, this never waits. The index may lie anywhere; it must be unsigned.
    """


def lowest(word: Any) -> Any:
    """Number of the lowest bit set in an unsigned 64-bit word that is not 0; one instruction compiled."""
    return (word & -word).bit_length() - 1


def highest(word: Any) -> Any:
    """Number of the highest bit set in an unsigned 64-bit word that is not 0."""
    return word.bit_length() - 1


def jit_disabled() -> bool:
    """Whether ``NUMBA_DISABLE_JIT`` asks for the plain form always."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


class Kernel:
    """A loop in two forms. Call it with NumPy arrays; it decides which form is quicker to have the answer.

    Parameters
    ----------
    plain : the function as written.
    out : names of the array arguments it writes into.
    inline : whether LLVM shall put it into its callers. For what is called at every step with many
        arrays: each of them is seven arguments.
    """

    def __init__(self, plain: FunctionType, out: Sequence[str], *, inline: bool = False) -> None:
        self.plain = plain
        self.inline = inline
        self.__name__ = plain.__name__
        self.__doc__ = plain.__doc__
        names = plain.__code__.co_varnames[: plain.__code__.co_argcount]
        self._out = tuple(names.index(name) for name in out)
        self._compiled: Callable[..., Any] | None = None
        self._linked: Callable[..., Any] | None = None

    def __call__(self, *args: Any) -> Any:
        if self._compiled is not None:
            return self._compiled(*args)
        if self._plain_is_quicker(args):
            return self.run_plain(*args)
        return self.compiled()(*args)

    def _plain_is_quicker(self, args: tuple[Any, ...]) -> bool:
        global _spent
        if jit_disabled():
            return True
        work = max((a.size for a in args if isinstance(a, np.ndarray)), default=1)
        if work > PLAIN_CELLS or _spent > PLAIN_TOTAL:
            return False
        _spent += work
        return True

    def run_plain(self, *args: Any) -> Any:
        """Run the plain form: arrays become lists (four times quicker to index), results are copied back."""
        given = [a.tolist() if isinstance(a, np.ndarray) else a for a in args]
        result = self.linked()(*given)
        for k in self._out:
            args[k][:] = given[k]
        return result

    def linked(self) -> Callable[..., Any]:
        """The plain form with plain callees: the lists it passes on must never reach a compiled one."""
        if self._linked is None:
            self._linked = _twin(self, lambda callee: callee.linked(), {})
        return self._linked

    def compiled(self) -> Callable[..., Any]:
        """The compiled form; compiling happens at its first call and is kept on disk."""
        if self._compiled is None:
            self._compiled = _compile(self)
        return self._compiled


def kernel(*, out: Sequence[str] = (), inline: bool = False) -> Callable[[Callable[..., Any]], Kernel]:
    """Mark a function as a kernel that writes into the arguments named in ``out``; see :class:`Kernel`."""

    def mark(plain: Callable[..., Any]) -> Kernel:
        assert isinstance(plain, FunctionType)
        return Kernel(plain, out, inline=inline)

    return mark


def _compile(k: Kernel) -> Callable[..., Any]:
    import numba

    _listen()
    # The compiled form must see compiled callees, a real u64 and a real fetch.
    helpers = {u64: np.uint64, fetch: _prefetch(), lowest: _bit("cttz"), highest: _bit("ctlz")}
    twin = _twin(k, lambda callee: callee.compiled(), helpers)
    keep = _cache_works(k)
    elsewhere = {callee.plain.__code__.co_filename for callee in _callees(k)} - {k.plain.__code__.co_filename}
    if keep and elsewhere:
        content = b"".join(Path(name).read_bytes() for name in sorted(elsewhere))
        twin.__qualname__ += f"_{hashlib.sha256(content).hexdigest()[:16]}"
    return numba.njit(cache=keep, nogil=True, fastmath=False, forceinline=k.inline, **_LEAN)(twin)


@cache
def _listen() -> None:
    """Hear of numba's compilations; those that it finds on disk are none."""
    from numba.core import event

    class Ear(event.Listener):
        depth = 0

        def on_start(self, _: Any) -> None:
            self.depth += 1
            self.tell(True)

        def on_end(self, _: Any) -> None:
            self.depth -= 1
            if not self.depth:
                self.tell(False)

        def tell(self, on: bool) -> None:
            for ear in _ears:
                ear(on)

    event.register("numba:compile", Ear())


def _callees(k: Kernel) -> set[Kernel]:
    """The kernels that a kernel calls, and those that they call."""
    found: set[Kernel] = set()
    ahead = [k]
    while ahead:
        plain = ahead.pop().plain
        known = plain.__globals__
        fresh = {c for name in plain.__code__.co_names if isinstance(c := known.get(name), Kernel)} - found
        found |= fresh
        ahead += fresh
    return found


@cache
def _prefetch() -> Any:
    """The compiled form of :func:`fetch`: LLVM's prefetch, for writing, to the nearest cache."""
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
def _bit(instruction: str) -> Any:
    """The compiled form of :func:`lowest` (``cttz``) or :func:`highest` (``ctlz``); a signed number."""
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


def _twin(k: Kernel, form: Callable[[Kernel], Any], helpers: Mapping[Any, Any]) -> FunctionType:
    """The source over a copy of its module's globals, one form of each callee and helper in place of another.

    The module itself is left alone.
    """
    scope = dict(k.plain.__globals__)
    used = set(k.plain.__code__.co_names)
    for name in used & scope.keys():
        value = scope[name]
        if isinstance(value, Kernel):
            scope[name] = form(value)
        elif callable(value) and value in helpers:
            scope[name] = helpers[value]
    twin = FunctionType(k.plain.__code__, scope, k.plain.__name__, k.plain.__defaults__, k.plain.__closure__)
    twin.__module__ = k.plain.__module__
    twin.__qualname__ = k.plain.__qualname__
    return twin


def _cache_works(k: Kernel) -> bool:
    """Whether numba can keep compiled code on disk for this file.

    A frozen or zipped installation has no file to stamp; numba would raise at decoration instead of going
    on.
    """
    return os.path.exists(k.plain.__code__.co_filename)
