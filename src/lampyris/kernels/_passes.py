"""The passes of numba's compiler that kernels need: less than half of all.

Kernels have no closures, comprehensions, ``with``, ``raise``, ``literal_unroll`` or operations on whole arrays, and call no
function that numba would inline by itself. What looks for those is left out. So is what marks the end of each variable's
use, where numba counts references: kernels have none to count.
"""

from __future__ import annotations

from functools import cache
from typing import Any

PASSES = (
    "TranslateByteCode", "FixupArgs", "IRProcessing", "GenericRewrites", "ReconstructSSA", "NopythonTypeInference",
    "PreLowerStripPhis", "NativeLowering", "NoPythonBackend",
)  # fmt: skip
"""In the order in which numba runs them, by the names of their classes."""


@cache
def pipeline() -> Any:
    """A compiler of numba's that runs these passes alone; numba's own where this version has others. Imports numba."""
    from numba.core import compiler, typed_passes, untyped_passes
    from numba.core.compiler_machinery import PassManager

    known: dict[str, Any] = {**vars(untyped_passes), **vars(typed_passes)}
    if not all(name in known for name in PASSES):
        return compiler.Compiler

    class KernelCompiler(compiler.CompilerBase):
        def define_pipelines(self) -> list[Any]:
            manager = PassManager("nopython")
            for name in PASSES:
                manager.add_pass(known[name], name)
            manager.finalize()
            return [manager]

    return KernelCompiler
