"""The command line's own ``main`` without a process of its own, which takes half a second of CPU time to start.

For what a fresh process does not change; start-up, signals, closed streams and settings that Python reads when
it starts (``PYTHONHASHSEED``) are tested in processes.
"""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from subprocess import CompletedProcess
from unittest import mock

from bad_inputs.case import inside, run


def call(*words: str | Path, cwd: Path | None = None, columns: int = 80) -> CompletedProcess[str]:
    """``lampyris WORDS`` in a folder: exit code, standard output and standard error, as of a process."""
    line = [str(word) for word in words]
    with mock.patch.dict(os.environ, COLUMNS=str(columns)), inside(cwd) if cwd else nullcontext():
        done = run(*line)
    return CompletedProcess(line, done.exit, done.out, done.err)
