"""The one file that imports numba (with :mod:`._machine`), and only when a kernel is worth compiling.

A kernel is written once, as a plain function over *flat* sequences. It runs in two forms with equal
results:

* **plain**: Python over lists, 0.1 to 6 microseconds a cell. Small work is over sooner this way than
  importing numba takes.
* **compiled**: the same source through ``numba.njit`` with its disk cache, for large or repeated work. What a run leaves
  on disk, later ones run without numba.

``NUMBA_DISABLE_JIT=1`` keeps the plain form always, and so does a platform where numba is not installed or cannot be
imported (Pyodide). Which form ran never changes a result: kernels use
integers and ``+ - * / sqrt`` on float64, in a stated order, without fastmath.

Which form runs
---------------
Each call is priced beforehand, in nanoseconds of its plain form: so many for each element of its longest
array, or of what ``of`` names, as ``each`` says. The sums decide, not the clock: the same calls in a fresh
process, with the same machine code kept, run in the same forms.

* As long as no machine code is loaded, all kernels together may spend :data:`PLAIN_NS` in plain form; where an earlier
  run kept machine code of a kernel that runs without numba (:mod:`.kept_code`), it is loaded after :data:`KEPT_NS`.
* Then each kernel may spend :data:`OWN_NS`: numba loads it from disk in about 5 ms, but where nothing was kept
  from an earlier run compiling it takes 0.1 to 2 s; or :data:`OWN_KEPT_NS`, where it is loaded without numba.

``tools/plain_or_compiled.py`` measures both sides of the first rule where machine code is kept, a whole ``lampyris plan``
in each form.

Rules for kernel source
-----------------------
* arguments are scalars and one-dimensional arrays; nothing is allocated inside; results are written into
  arguments named in ``out``;
* unsigned indices are made by :func:`u64` (signed or 32-bit index arithmetic costs a third of the speed;
  and numba turns ``uint64 + int64`` into a float, so no bare literal may meet an unsigned value: write
  ``u64(1)``);
* a kernel whose work grows with the map has ``halt`` for its last argument and asks :func:`stopped` before
  every :data:`._helpers.LOOK` cells or so (a millisecond at most), outside its innermost loop; if it says so,
  the kernel returns at once. Callers in Python leave the argument out: it is the word of
  :mod:`lampyris._core.cancellation`, and what comes of a kernel that stopped is an exception. What it wrote is then of
  no use, unless it says so.
* a kernel may call other kernels, of its own file or imported by name. numba's disk cache notices a changed
  file, not what it took from another; so what is kept on disk is named after all files of kernels, too.
"""

from __future__ import annotations

import math
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from pickle import UnpicklingError
from types import CodeType, FunctionType
from typing import Any

import numpy as np

from lampyris._core import cancellation
from lampyris.kernels import kept_code
from lampyris.kernels._helpers import clock as clock
from lampyris.kernels._helpers import fetch as fetch
from lampyris.kernels._helpers import highest as highest
from lampyris.kernels._helpers import lowest as lowest
from lampyris.kernels._helpers import stopped as stopped
from lampyris.kernels._helpers import u64 as u64
from lampyris.kernels.kept_code import KeptCode
from lampyris.kernels.loading import loading

PLAIN_NS = 300_000_000
"""Work in plain form, all kernels together, before numba is imported.

Importing it and loading the kernels of a plan took about 0.35 s when this was measured; it takes about 0.2 s since kept
machine code is read without preparing numba to compile. Compiling takes a second or more, once for a machine.
Whole AD-GSO plans cross at about 205,000
cells, 485 ms of work (160,000: 0.48 s plain, 0.61 compiled; 262,144: 0.73 and 0.58). The purse is smaller
because a kernel does not know what comes after it: with 450 ms the first kernel of a map of 512 x 512,
314 ms, would run in plain form, and numba be imported for the next one all the same. 316 x 316 is 239 ms.
Measured on a busy machine.
"""
OWN_NS = 20_000_000
"""Work in plain form of each kernel when numba is there."""
KEPT_NS = 60_000_000
"""Work in plain form, all kernels together, where machine code is kept that runs without numba: see :mod:`.kept_code`.

Loading LLVM takes about 0.02 s, each kernel about 2 ms.
"""
OWN_KEPT_NS = 4_000_000
"""Work in plain form of each such kernel when LLVM is there."""
VIEWED = 4096
"""Elements from which on an array that is only touched here and there is read in place, not made a list."""

PATH = "path"
"""The work of a kernel that follows one path through a map: the map's width, not its cells."""

DAMAGE = (EOFError, UnpicklingError, ValueError, LookupError, AttributeError, ImportError, TypeError)
"""What reading damaged machine code may come to; whether it is, :meth:`Kernel.damaged` finds out."""

KERNELS: list[Kernel] = []
"""Every kernel of the modules that are imported."""

_spent = 0
_without_numba = ""
_keeping = True
_recordings: list[object] = []
"""What :func:`recorded` notes now."""
_ears: list[Callable[[bool], None]] = []
"""Called whenever machine code is made that was not kept from before."""


class NothingKept(RuntimeWarning):
    """Machine code could not be kept on disk: it works, but every process recompiles."""

    for_people = True


def on_compile(ear: Callable[[bool], None]) -> None:
    """Have something called with True when machine code is about to be made that no run before has left on
    disk, and with False when it is there.

    It takes a second or more for each kernel, once for a machine; a user who waits may want to know. Numba is
    not imported for this.
    """
    _ears.append(ear)


class NoMachineCode(RuntimeWarning):
    """numba is installed and cannot be imported: everything works, but in plain Python."""

    for_people = True


def jit_disabled() -> bool:
    """Whether every kernel runs in its plain form: see :func:`why_plain`."""
    return why_plain() != ""


def why_plain() -> str:
    """Why every kernel runs in its plain form; empty: they are compiled where that pays."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return "NUMBA_DISABLE_JIT is set"
    return _without_numba or _not_installed()


@cache
def _not_installed() -> str:
    return "" if find_spec("numba") is not None else "numba is not installed"


def load_numba() -> bool:
    """Import numba now, if it can be; whether kernels can be compiled. Why not is said once, as a warning."""
    global _without_numba
    if jit_disabled():
        return False
    from lampyris.kernels import _machine as machine

    try:
        machine.load()
    except (ImportError, OSError) as error:  # OSError: of llvmlite, where its library cannot be loaded
        _without_numba = "numba cannot be imported"
        what = (
            f"numba cannot be imported, so everything runs in plain Python, far slower on large maps: {error}"
        )
        warnings.warn(NoMachineCode(what), stacklevel=2)
        return False
    return True


class Kernel:
    """A loop in two forms. Call it with NumPy arrays; it decides which form is quicker to have the answer.

    Parameters
    ----------
    plain : the function as written.
    out : names of the array arguments it writes into.
    inline : whether LLVM shall put it into its callers. For what is called at every step with many
        arrays: each of them is seven arguments.
    each : nanoseconds of the plain form for each element of its longest array, or of what ``of`` names.
        Measured on random maps of 316 x 316 cells; it need only be right to within a factor of two.
    load : factor on :data:`OWN_NS`: a kernel that calls many others takes so many times as long to load as most.
    of : for a kernel that touches a few elements of large arrays: the array argument whose length is the
        work, or :data:`PATH`.
    arrays : the same by operations on whole arrays, equal to the last bit, which takes the place of the plain
        form where a caller outside of kernels asks for it; None: there is none.
    thorough : whether to optimise each function by itself before those that call it: for kernels that are measured to be
        faster so. It takes a fifth more time to compile.
    """

    def __init__(
        self,
        plain: FunctionType,
        out: Sequence[str],
        *,
        inline: bool = False,
        each: int = 500,
        load: int = 1,
        of: str = "",
        arrays: Callable[..., Any] | None = None,
        thorough: bool = False,
    ) -> None:
        self.plain = plain
        self.inline = inline
        self.thorough = thorough
        self.arrays = arrays
        self.each = each
        self._load_factor = load
        self.__name__ = plain.__name__
        self.__doc__ = plain.__doc__
        names = plain.__code__.co_varnames[: plain.__code__.co_argcount]
        self.inner = plain.__name__.startswith("_")
        self._out = tuple(names.index(name) for name in out)
        self._of = None if of in ("", PATH) else names.index(of)
        self._sparse = of != ""
        self._arity = len(names)
        self._halts = names[-1:] == ("halt",)
        self._spent = 0
        self._expensive = False
        self._kept: bool | None = None
        self._edition = ""
        self._compiled: Callable[..., Any] | None = None
        self._called: Callable[..., Any] | None = None
        self._linked: Callable[..., Any] | None = None
        KERNELS.append(self)

    def __call__(self, *args: Any) -> Any:
        if not self._halts:
            return self._run(args)
        if len(args) < self._arity:
            args = self.complete(args)
        halt = args[-1]
        if halt[0]:
            cancellation.raise_cancelled()
        result = self._run(args)
        if halt[0]:
            cancellation.raise_cancelled()
        return result

    def complete(self, args: tuple[Any, ...]) -> tuple[Any, ...]:
        """The arguments, with the word that halts this thread's calls if it is wanted and left out."""
        return (*args, cancellation.word()) if self._halts and len(args) < self._arity else args

    def _run(self, args: tuple[Any, ...]) -> Any:
        if self._compiled is None and self._plain_is_quicker(args):
            return self.run_plain(*args)
        return self._in_machine_code(args)

    def _in_machine_code(self, args: tuple[Any, ...]) -> Any:
        if self.inner:
            raise TypeError(f"only kernels call the compiled form of {self.__name__}: its name begins with _")
        keeping = _keeping  # as it was: another thread may come upon the same and say so first
        try:
            return (self._compiled or self.compiled())(*args)
        except (OSError, *DAMAGE) as error:
            # A kernel reads and writes nothing: this is numba at what it keeps, and the kernel has not begun.
            if not keeping or (_keeping and not self._says_so(error)):
                raise
            return self.compiled()(*args)

    def _says_so(self, error: Exception) -> bool:
        """Keep nothing from here on if it was numba's disk; whether it was."""
        if isinstance(error, OSError):
            keep_nothing("compiled code cannot be kept on disk", str(error))
            return True
        damaged = self.damaged()
        if damaged:
            more = f" and {len(damaged) - 1} more" if damaged[1:] else ""
            what = f"compiled code kept in {damaged[0].parent} is damaged"
            keep_nothing(what, f"{damaged[0].name}{more}", "delete it, or run `lampyris warm`")
        return bool(damaged)

    @property
    def is_compiled(self) -> bool:
        """Whether a call runs in machine code that is there already, or has to run in it (:func:`compiled_only`,
        :func:`recorded`): for callers that have the same in NumPy, no slower than loading a kernel."""
        return bool(self._compiled is not None or _compiled_only.depth or _recordings)

    @property
    def is_loaded(self) -> bool:
        """Whether this process has its machine code, or has begun to load or compile it."""
        return self._compiled is not None

    def price(self, args: tuple[Any, ...]) -> int:
        """About how many nanoseconds the plain form takes."""
        if self._of is not None:
            return int(self.each * args[self._of].size)
        longest = max((a.size for a in args if isinstance(a, np.ndarray)), default=1)
        return int(self.each * (math.sqrt(longest) if self._sparse else longest))

    def pays(self, *args: Any) -> bool:
        """Whether a call would run in machine code: for callers that have the same in NumPy, quicker than the plain form."""
        if _recordings:
            return True
        if jit_disabled():
            return False
        if self._compiled is not None or _compiled_only.depth:
            return True
        return _loaded() and self._left(price := self.price(args)) < price

    def expect(self, calls: int, *args: Any) -> None:
        """Announce so many calls with arguments of this size: if all of them together take too long in plain form, the
        kernel is compiled for the first of them already."""
        price = calls * self.price(args)
        self._expensive = self._expensive or self._left(price) < price

    def _left(self, price: int = 0) -> int:
        """What may still be spent in plain form, before that price is paid."""
        if not _loaded():
            # Whether machine code is kept is asked only where it matters: it costs two milliseconds, once.
            left = KEPT_NS - _spent
            return left if price <= left or self._is_kept() else PLAIN_NS - _spent
        own = OWN_KEPT_NS if "numba" not in sys.modules and self._is_kept() else OWN_NS
        return self._load_factor * own - self._spent

    def _is_kept(self) -> bool:
        """Whether machine code that runs without numba was there when this was first asked."""
        if self._kept is None:
            self._kept = (
                self.is_ours
                and not jit_disabled()
                and kept_code.usable()
                and _cache_works(self)
                and kept_code.is_kept(self.full_name, self._edition_of_files())
            )
        return self._kept and _keeping

    def _plain_is_quicker(self, args: tuple[Any, ...]) -> bool:
        global _spent
        if jit_disabled():
            return True
        if _compiled_only.depth or self._expensive:
            return False
        price = self.price(args)
        if price > self._left(price):
            return False
        self._spent += price
        _spent += price
        return True

    def run_plain(self, *args: Any) -> Any:
        """Run the plain form: arrays become lists (four times quicker to index), results are copied back.

        Large arrays of which little is touched become views that hand out plain numbers, half as quick.
        """
        args = self.complete(args)
        if self.arrays is not None:
            return self.arrays(*args)
        given = [self._easy(a) if isinstance(a, np.ndarray) else a for a in args]
        if self._halts and isinstance(args[-1], np.ndarray):
            given[-1] = args[-1].data  # no copy: it changes meanwhile
        result = self.linked()(*given)
        for k in self._out:
            if isinstance(given[k], list):
                args[k][:] = given[k]
        return result

    def _easy(self, array: Any) -> Any:
        return memoryview(array) if self._sparse and array.size >= VIEWED else array.tolist()

    def linked(self) -> Callable[..., Any]:
        """The plain form with plain callees: the lists it passes on must never reach a compiled one."""
        if self._linked is None:
            self._linked = _variant(self, lambda callee: callee.linked(), {})
        return self._linked

    def compiled(self) -> Callable[..., Any]:
        """The compiled form; compiling happens at its first call and is kept on disk. Without numba the plain form.

        Where an earlier run kept machine code of it, that is run without importing numba; for arguments of types that none
        is kept for, numba takes over.
        """
        made = self._compiled
        if made is None and "numba" not in sys.modules and self._is_kept():
            made = self._compiled = KeptCode(self._load, self._taken_over)
        return made or self.dispatcher()

    def _load(self, types: tuple[str, ...]) -> Callable[..., Any] | None:
        from lampyris.kernels import object_code

        return object_code.load(self.full_name, self.edition(), types)

    def _taken_over(self, *args: Any) -> Any:
        """Called for arguments of types that no machine code is kept for."""
        return self.dispatcher()(*args)

    @property
    def full_name(self) -> str:
        """With its module."""
        return f"{self.plain.__module__}.{self.__name__}"

    @property
    def is_ours(self) -> bool:
        """Whether it is a kernel of this package, rather than of a caller."""
        return self.plain.__module__.startswith("lampyris.kernels.")

    def edition(self) -> str:
        """Of the sources that its machine code depends on, and of itself as this process has it.

        Files may change while a process runs, as when the package is upgraded. What the process compiles afterwards is still
        the earlier source, and must not run in processes that have read the new one.
        """
        if not self._edition:
            from lampyris.kernels import _machine as machine

            self._edition = self._edition_of_files() + machine.digest(_content(self, set()))
        return self._edition

    def _edition_of_files(self) -> str:
        """The first part of the edition, that of the sources, which takes no time for each kernel."""
        from lampyris.kernels import _machine as machine

        return machine.edition(Path(self.plain.__code__.co_filename).resolve().parent)

    def dispatcher(self) -> Callable[..., Any]:
        """Numba's compiled form, which knows every list of argument types. Imports numba; without it the plain form."""
        made = self._compiled
        if made is None or isinstance(made, KeptCode):
            if not load_numba():
                return self.run_plain
            with cancellation.uninterrupted(), loading():
                keeping = _keeping
                made = self._compiled = _compile(self)
                if keeping and not _keeping:
                    # Another thread had everything forgotten meanwhile; this would try to keep it.
                    made = self._compiled = _compile(self)
        return made

    def called(self) -> Callable[..., Any]:
        """The function that other compiled kernels call. It is compiled as a part of each caller, and not cached by itself.
        Imports numba."""
        if self._called is None:
            self._called = _compile(self, part=True)
        return self._called

    def forget(self) -> None:
        """Recompile when it is needed next."""
        self._compiled = self._called = None

    def prepare(self, types: tuple[Any, ...]) -> bool:
        """Have machine code for arguments of these numba types; return whether no earlier run had left it.

        Raises
        ------
        OSError : it cannot be kept.
        """
        dispatcher: Any = self.dispatcher()
        before = sum(dispatcher.stats.cache_misses.values())
        with cancellation.uninterrupted():
            dispatcher.compile(types)
        return bool(sum(dispatcher.stats.cache_misses.values()) > before)

    def cache_folder(self) -> str | None:
        """The folder its machine code is kept in; None if it is not kept. Imports numba."""
        dispatcher: Any = self.dispatcher()
        folder: str | None = dispatcher.stats.cache_path
        return folder

    def damaged(self) -> list[Path]:
        """What is kept beside its machine code and cannot be read. Imports numba."""
        from lampyris.kernels import _machine as machine

        folder = self.cache_folder()
        return [] if folder is None else machine.damaged(Path(folder))


def kernel(
    *,
    out: Sequence[str] = (),
    inline: bool = False,
    each: int = 500,
    load: int = 1,
    of: str = "",
    arrays: Callable[..., Any] | None = None,
    thorough: bool = False,
) -> Callable[[Callable[..., Any]], Kernel]:
    """Mark a function as a kernel that writes into the arguments named in ``out``; see :class:`Kernel`."""

    def mark(plain: Callable[..., Any]) -> Kernel:
        assert isinstance(plain, FunctionType)
        return Kernel(
            plain, out, inline=inline, each=each, load=load, of=of, arrays=arrays, thorough=thorough
        )

    return mark


def prefer_compiled() -> None:
    """From here on compile every kernel at its first call, for timings of compiled code."""
    global PLAIN_NS, OWN_NS, KEPT_NS, OWN_KEPT_NS
    PLAIN_NS = OWN_NS = KEPT_NS = OWN_KEPT_NS = -1


class _CompiledOnly(threading.local):
    depth = 0


_compiled_only = _CompiledOnly()


@contextmanager
def compiled_only() -> Iterator[None]:
    """Run every kernel of this thread in its compiled form, for times that are compared with one another.

    Otherwise the first of those compared would run in plain form, up to a hundred times slower, until what
    may be spent on it is. Loading and compiling are reported apart: see :mod:`.loading`.
    """
    _compiled_only.depth += 1
    try:
        yield
    finally:
        _compiled_only.depth -= 1


@contextmanager
def recorded() -> Iterator[dict[tuple[Kernel, tuple[Any, ...]], None]]:
    """Run every kernel in its plain form, and note with which types of arguments it is called."""
    from lampyris.kernels import _machine as machine

    machine.load()
    from numba import typeof

    found: dict[tuple[Kernel, tuple[Any, ...]], None] = {}
    alike: set[tuple[Any, ...]] = set()
    as_it_was = Kernel.__call__

    def noting(self: Kernel, *args: Any) -> Any:
        args = self.complete(args)
        # numba takes longer to name the types of a call than most of the calls take.
        looks = (self, *map(_look, args))
        if looks not in alike:
            alike.add(looks)
            found[self, tuple(typeof(a) for a in args)] = None
        return self.run_plain(*args)

    Kernel.__call__ = noting  # type: ignore[method-assign]
    _recordings.append(found)
    try:
        yield found
    finally:
        _recordings.pop()
        Kernel.__call__ = as_it_was  # type: ignore[method-assign]


def _look(value: Any) -> Any:
    """What numba's type of a value depends on."""
    if isinstance(value, np.ndarray):
        flags = value.flags
        return value.dtype, value.ndim, flags.writeable, flags.c_contiguous, flags.f_contiguous, flags.aligned
    return (int, value < 2**63) if type(value) is int else type(value)


def keep_nothing(what: str, why: str, todo: str = "") -> None:
    """Go on without keeping machine code on disk, and say so, once."""
    global _keeping
    if not _keeping:
        return
    _keeping = False
    forget()
    todo = todo or "set NUMBA_CACHE_DIR to a folder that can be written to"
    warnings.warn(NothingKept(f"{what}, so each run recompiles: {why}; {todo}"), stacklevel=3)


def _loaded() -> bool:
    """Whether machine code runs in this process already: made by numba, or kept."""
    return "numba" in sys.modules or kept_code.is_loaded()


def forget() -> None:
    """Recompile every kernel, or read it from disk, when it is needed next."""
    for k in KERNELS:
        k.forget()


def _tell(on: bool) -> None:
    for ear in _ears:
        ear(on)


@loading()
def _compile(k: Kernel, *, part: bool = False) -> Callable[..., Any]:
    from lampyris.kernels import _machine as machine
    from lampyris.kernels._shortcuts import PART

    machine.load()
    machine.listen(_tell)
    # The compiled form must see compiled callees, a real u64 and a real fetch.
    helpers = {
        u64: np.uint64,
        fetch: machine.prefetch(),
        stopped: machine.stopped(),
        lowest: machine.bit("cttz"),
        highest: machine.bit("ctlz"),
        clock: machine.clock(),
    }
    variant = _variant(k, lambda callee: callee.called(), helpers)
    machine.use_builtins(variant)
    keep = not part and _keeping and _cache_works(k)
    if part:
        variant.__qualname__ += PART
    if keep:
        variant.__qualname__ += f"_{k.edition()}"
    try:
        made = machine.compiled(variant, cache=keep, forceinline=k.inline, inner=part or k.inner)
        _time_loading(made, k if keep else None, thorough=k.thorough)
        return made
    except RuntimeError as error:
        # What numba says when neither NUMBA_CACHE_DIR, nor the folder of the source, nor the user's own
        # folder for caches can be written to.
        if not keep or "no locator" not in str(error):
            raise
        keep_nothing("compiled code cannot be kept on disk", "no folder for it can be written to")
        return _compile(k)


def _time_loading(dispatcher: Any, kept: Kernel | None = None, *, thorough: bool = False) -> None:
    """Have the clocks of :mod:`.loading` stand still while it compiles, or reads what is kept on disk: at its
    first call with arguments of new types, before it runs. Machine code of ``kept`` is kept for processes without numba, too."""
    from lampyris.kernels._shortcuts import shortcuts

    compile_ = dispatcher.compile

    def timed(types: Any) -> Any:
        with loading(), shortcuts(thorough=thorough):
            made = compile_(types)
            if kept is not None and kept.is_ours and not kept.inner:
                from lampyris.kernels import object_code

                object_code.keep(kept.full_name, kept.edition(), dispatcher, tuple(types))
            return made

    dispatcher.compile = timed


def _content(k: Kernel, seen: set[Kernel]) -> Iterator[bytes]:
    """What a kernel does, in bytes that are the same in each process: its byte code, constants and callees."""
    seen.add(k)
    yield from _of_code(k.plain.__code__)
    scope = k.plain.__globals__
    for name in k.plain.__code__.co_names:
        value = scope.get(name)
        if isinstance(value, Kernel):
            if value not in seen:
                yield from _content(value, seen)
        elif isinstance(value, (int, float, str, tuple, np.generic)):
            yield f"{name} {value!r}\n".encode()


def _of_code(code: CodeType) -> Iterator[bytes]:
    yield code.co_code
    yield f"{code.co_names} {code.co_varnames}\n".encode()
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield from _of_code(value)
        else:
            words = sorted(map(repr, value)) if isinstance(value, frozenset) else value
            yield f"{words!r}\n".encode()


def _variant(k: Kernel, form: Callable[[Kernel], Any], helpers: Mapping[Any, Any]) -> FunctionType:
    """The source over a copy of its module's globals, one form of each callee and helper in place of another.

    The module itself is left alone.
    """
    scope = dict(k.plain.__globals__)
    used = set(k.plain.__code__.co_names)
    for name in sorted(used & scope.keys()):
        value = scope[name]
        if isinstance(value, Kernel):
            scope[name] = form(value)
        elif callable(value) and value in helpers:
            scope[name] = helpers[value]
    variant = FunctionType(
        k.plain.__code__, scope, k.plain.__name__, k.plain.__defaults__, k.plain.__closure__
    )
    variant.__module__ = k.plain.__module__
    variant.__qualname__ = k.plain.__qualname__
    return variant


def _cache_works(k: Kernel) -> bool:
    """Whether numba can keep compiled code on disk for this file.

    A frozen or zipped installation has no file to stamp; numba would raise at decoration instead of going
    on.
    """
    return os.path.exists(k.plain.__code__.co_filename)
