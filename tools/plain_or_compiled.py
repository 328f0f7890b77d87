"""From how many cells on a plan in a fresh process is over sooner with compiled kernels.

    python tools/plain_or_compiled.py [--planner NAME] [--rounds N]

Each plan is a process of its own, once held to the plain form and once to the compiled one (machine code kept
on disk, so that it is loaded and not compiled), in turns. ``work`` is what
:data:`lampyris.kernels._jit.KEPT_NS` is held against.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

SIZES = (50, 75, 100, 150, 200, 316)
CODE = """
import json, sys
import numpy as np
from lampyris.kernels import _jit
size, form, planner = int(sys.argv[1]), sys.argv[2], sys.argv[3]
if form == "compiled":
    _jit.prefer_compiled()
else:
    _jit.PLAIN_NS = _jit.OWN_NS = _jit.KEPT_NS = _jit.OWN_KEPT_NS = 10**15
import lampyris
blocked = np.random.default_rng(size).random((size, size)) < 0.1
blocked[:3, :3] = blocked[-3:, -3:] = False
lampyris.plan(lampyris.Scene(lampyris.Grid(blocked), (0, 0), (size - 1, size - 1)), planner)
print(json.dumps(_jit._spent))
"""


def main() -> int:
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--planner", default="ad-gso")
    parser.add_argument("--rounds", type=int, default=7)
    given = parser.parse_args()
    drop = ("PYTHONDONTWRITEBYTECODE", "NUMBA_DISABLE_JIT")
    with tempfile.TemporaryDirectory() as folder:
        env = {k: v for k, v in os.environ.items() if k not in drop} | {
            "NUMBA_CACHE_DIR": folder,
            "PYTHONPYCACHEPREFIX": folder,
        }

        def run(size: int, form: str) -> tuple[float, int]:
            command = [sys.executable, "-c", CODE, str(size), form, given.planner]
            began = time.perf_counter()
            told = subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout
            return time.perf_counter() - began, json.loads(told)

        print(f"{'cells':>9} {'plain s':>8} {'compiled s':>10} {'work ms':>8}  quicker")
        for size in SIZES:
            run(size, "compiled")
            plain, compiled, work = [], [], 0
            for _ in range(given.rounds):
                took, work = run(size, "plain")
                plain.append(took)
                compiled.append(run(size, "compiled")[0])
            a, b = statistics.median(plain), statistics.median(compiled)
            print(
                f"{size * size:9,} {a:8.3f} {b:10.3f} {work / 1e6:8.0f}  {'plain' if a < b else 'compiled'}"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
