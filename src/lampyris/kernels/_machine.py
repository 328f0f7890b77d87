"""What only machine code has: the compiled forms of the helpers in :mod:`._jit`, and numba's events."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
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
