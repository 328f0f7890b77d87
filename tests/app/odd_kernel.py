"""A compiled loop that only a cancellation ends, for tests of those who cancel."""

from __future__ import annotations

from typing import Any

from lampyris.kernels._jit import kernel, stopped


@kernel(out=("mark",), each=10**12)
def forever(mark: Any, halt: Any) -> int:
    """Say that it has begun, and go round until it is stopped. Its price has it compiled at once."""
    mark[0] = 1
    rounds = 0
    while not stopped(halt):
        rounds += 1
    return rounds
