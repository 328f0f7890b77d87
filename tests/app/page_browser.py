"""For tests of the page: an app of their own, and which browser there is."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
SOON = 60_000
"""Milliseconds that a tab waits for what is to come: a step has taken ten seconds where CI runs."""


@contextmanager
def app(home: Path, map_: str | None = None, port: int = 0) -> Iterator[str]:
    """An app of its own, that keeps its uploads in a folder of its own; its address."""
    code = f"from lampyris.app.server.run import run_app; run_app({map_!r}, port={port}, browser=False)"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "XDG_DATA_HOME": str(home)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=env) as server:
        try:
            assert server.stdout is not None
            found = re.search(r"http://\S+", server.stdout.readline())
            assert found
            yield found[0]
        finally:
            server.kill()
            server.wait(20)
