"""Stores to try things on, as the check has them, and another process to try them in."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

from lampyris.study.store.store import Store  # noqa: F401  for the words given to another process
from lampyris_selfcheck.checks.studies.stores import (  # noqa: F401  tests import them from here
    BESIDE,
    bytes_of,
    filled,
    left_open,
    put,
    row,
    rows,
    study,
)

HERE = Path(__file__).parent


def names(folder: Path) -> list[str]:
    """What is in a folder."""
    return sorted(os.listdir(folder))


def child(code: str, *words: object, check: bool = True) -> subprocess.CompletedProcess[str]:
    """Python code in another process, with this folder's helpers; its words are sys.argv[1:]."""
    text = f"import sys; sys.path.insert(0, {str(HERE)!r})\n{textwrap.dedent(code)}"
    done = subprocess.run([sys.executable, "-c", text, *map(str, words)], capture_output=True, text=True)
    assert not check or done.returncode == 0, done.stderr
    return done
