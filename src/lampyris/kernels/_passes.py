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

    places = (untyped_passes, typed_passes)
    found = [next((getattr(p, name) for p in places if hasattr(p, name)), None) for name in PASSES]
    if None in found:
        return compiler.Compiler

    class KernelCompiler(compiler.CompilerBase):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            manager = compiler.PassManager("nopython")
            for one in found:
                manager.add_pass(one, one.__name__)
            manager.finalize()
            return [manager]

    return KernelCompiler
