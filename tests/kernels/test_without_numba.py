"""Where numba is not installed, or cannot be imported, everything runs in plain Python, with the same results."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lampyris.kernels import _jit
from reference.kernel_forms import use

WORK = """
import hashlib
import numpy as np
import lampyris

rng = np.random.default_rng(0)
walls = rng.random((60, 60)) < 0.15
walls[0, 0] = walls[-1, -1] = False
scene = lampyris.Scene(lampyris.Grid(walls), (0, 0), (59, 59), traffic=lampyris.RandomWalk(2))
found = hashlib.sha256()
for name in PLANNERS:
    plan = lampyris.plan(scene, name, seed=3)
    found.update(plan.path.cells.astype(np.int32).tobytes())
    found.update(repr((plan.cost, plan.expansions)).encode())
if "pso" in PLANNERS:
    drive = lampyris.drive(scene, "astar", seed=1, time_limit=20.0)
    for column in (drive.t, drive.s, drive.v, drive.a):
        found.update(column.tobytes())
print(found.hexdigest())
"""
ABSENT = "import sys\nsys.modules['numba'] = None\n"
BROKEN = """
import sys
class Broken:
    def find_spec(name, path, target=None):
        if name == "numba.core":
            raise ImportError("libllvmlite.so: cannot open shared object file")
sys.meta_path.insert(0, Broken)
"""
COMPILED = "from lampyris.kernels._jit import prefer_compiled\nprefer_compiled()\n"


def said(before: str, planners: tuple[str, ...], **more: str) -> tuple[str, str]:
    """What the work prints and warns of."""
    code = f"{before}\nPLANNERS = {planners!r}\n{WORK}\nassert bool({before == COMPILED}) == ('llvmlite.binding' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{code}"],
        capture_output=True, text=True, check=False, env=os.environ | more,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


def test_results_without_numba_are_those_of_compiled_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of these planners are compiled by other tests, too."""
    use(monkeypatch, "compiled")
    planners = ("ad-gso", "astar", "dstar-lite")
    printed: list[str] = []
    exec(WORK, {"PLANNERS": planners, "print": printed.append})
    assert said(ABSENT, planners) == (f"{printed[0]}\n", "")


@pytest.mark.nightly
@pytest.mark.parametrize(
    "planners",
    [
        ("theta-star", "jps", "sipp", "lpa-star", "bidirectional-astar"),
        ("pso", "gso", "rrt-connect", "visibility-graph", "quadtree", "voronoi"),
    ],
)
def test_more_planners_without_numba(planners: tuple[str, ...]) -> None:
    if _jit.jit_disabled():
        pytest.skip("NUMBA_DISABLE_JIT is set: there is no compiled form")
    plain, warned = said(ABSENT, planners)
    assert (plain, warned) == (said(COMPILED, planners)[0], "")


@pytest.mark.nightly
def test_a_numba_that_cannot_be_imported_is_warned_of_once(tmp_path: Path) -> None:
    planners = ("astar", "theta-star")
    plain, warned = said(f"{BROKEN}\n{COMPILED}", planners, NUMBA_CACHE_DIR=str(tmp_path))
    assert plain == said(ABSENT, planners)[0]
    assert warned.count("NoMachineCode") == 1
    assert "numba cannot be imported, so everything runs in plain Python" in warned


@pytest.mark.parametrize("fault", [ImportError("no numba.core"), OSError("libllvmlite.so cannot be loaded")])
def test_without_a_numba_that_can_be_loaded_it_is_plain(
    fault: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    """llvmlite raises an OSError where its library is damaged, or must not be executed."""

    def broken() -> None:
        raise fault

    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    monkeypatch.setattr(_jit, "_without_numba", "")
    monkeypatch.setattr("lampyris.kernels._machine.load", broken)
    with pytest.warns(_jit.NoMachineCode, match=str(fault)):
        assert not _jit.load_numba()
    assert _jit.why_plain() == "numba cannot be imported"


@pytest.mark.nightly
def test_warming_says_why_nothing_is_compiled() -> None:
    code = (
        f"{ABSENT}\nfrom lampyris.errors import UsageError\nfrom lampyris.warming import warm\n"
        "try:\n    warm()\nexcept UsageError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    said = "error[JIT]: numba is not installed, so that kernels are never compiled; pip install numba\n"
    assert done.stdout == said, done.stderr
