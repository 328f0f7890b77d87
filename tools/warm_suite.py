"""Compile what the tests of every commit use: all kernels, but not for types that only the largest maps ask for.

Those are a tenth of the work of `lampyris warm`; tests/test_warming.py compiles them every night.
"""

from __future__ import annotations

import time

from lampyris._core.system import processors
from lampyris.warming import warm

if __name__ == "__main__":
    began = time.monotonic()
    done = warm(workers=processors(), rare=False)
    print(f"{done.made} of {done.versions} versions compiled in {time.monotonic() - began:.0f} s")
