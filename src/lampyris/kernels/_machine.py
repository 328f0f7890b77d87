"""What only machine code has: the compiled forms of the helpers in :mod:`._jit`, numba's events and files."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any


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


HERE = Path(__file__).resolve().parent


@cache
def edition(folder: Path = HERE) -> str:
    """What the files of kernels hold, in sixteen letters: it is in the name of what is kept of them.

    All of them in that folder, and here, not those that a kernel has callees in: it may have a constant from
    another, and how it is compiled stands here.
    """
    files = sorted({*HERE.glob("*.py"), *folder.glob("*.py")})
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:16]


@cache
def prefetch() -> Any:
    """The compiled form of :func:`._jit.fetch`: LLVM's prefetch, for writing, to the nearest cache."""
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
def bit(instruction: str) -> Any:
    """The compiled form of :func:`._jit.lowest` (``cttz``) or :func:`._jit.highest` (``ctlz``), signed."""
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
