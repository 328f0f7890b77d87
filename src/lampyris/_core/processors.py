"""How many processors this process may use."""

from __future__ import annotations

import os


def processors() -> int:
    """Those that the process is allowed to run on, 1 or more; where that cannot be asked, all there are."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1
