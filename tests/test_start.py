"""What a start loads and compiles: everything that start-up time is made of, without a clock."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from sizes import some

HEAVY = [
    "numba",
    "llvmlite",
    "scipy",
    "matplotlib",
    "PIL",
    "joblib",
    "yaml",
    "jinja2",
    "starlette",
    "uvicorn",
    "asyncio",
    "multiprocessing",
    "concurrent.futures",
    "numpy.ma",
]
IDLE = [
    "sim.grid.loop",
    "sim.continuous.drive",
    "referee.drive",
    "referee.trace",
    "study",
    "app",
    "reproduce",
    "warming",
    "io.scenario.schema",
    "planning.through",
    "io.fleet_scenario.scenario",
    "io.maps.recipes.make",
    "io.scenario.read",
    "io.scenario.save",
    "io.tracks.timed_tracks",
    "model.drive",
    "model.trace",
    "model.settings.drive",
    "model.settings.steering",
    "motion.geometry.smoothing",
    "motion.timing.scheduled",
]

CLI = """
import sys
sys.argv = ["lampyris", *WORDS]
from lampyris.cli import main
try:
    main()
except SystemExit as done:
    assert not done.code, done.code
"""
PRETEND = """
import sys, types
from lampyris.kernels import _jit
compiled = []
def pretend(self):
    # As if it had been compiled, for what decides next is whether numba is there.
    sys.modules.setdefault("numba", types.ModuleType("numba"))
    if self._compiled is None:
        compiled.append(self.__name__)
        self._compiled = self.run_plain
    return self._compiled
_jit.Kernel.compiled = pretend
"""
COUNT = """
from lampyris.kernels import _jit
_jit.prefer_compiled()
made = []
_jit.on_compile(made.append)
"""


def run(code: str, *words: object, **env: str) -> subprocess.CompletedProcess[str]:
    """Python code in a process of its own; ``WORDS`` are the words of a command line."""
    given = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT")} | env
    full = f"WORDS = {[str(w) for w in words]!r}\n{textwrap.dedent(code)}"
    return subprocess.run(
        [sys.executable, "-c", full], capture_output=True, text=True, check=False, env=given
    )


def last(done: subprocess.CompletedProcess[str]) -> Any:
    """What the last line it printed says."""
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def square(folder: Path, size: int) -> list[str]:
    """The words for a plan on a map of so many cells squared, a tenth of it blocked."""
    blocked = np.random.default_rng(size).random((size, size)) < 0.1
    blocked[:3, :3] = blocked[-3:, -3:] = False
    np.save(folder / f"{size}.npy", blocked.astype(np.uint8))
    return ["plan", str(folder / f"{size}.npy"), "--start", "0,0", "--goal", f"{size - 1},{size - 1}"]


@pytest.mark.nightly
def test_a_small_plan_loads_what_a_plan_needs() -> None:
    asked = HEAVY + [f"lampyris.{m}" for m in IDLE]
    show = f"print(__import__('json').dumps([m for m in {asked!r} if m in sys.modules]))"
    assert last(run(CLI + show, "plan", "env-1")) == []
    assert last(run(CLI + show, "plan", "env-1", "--json")) == []
    assert last(run(CLI + show, "plan", "env-1", "--planner", "voronoi")) == []


def test_the_list_of_verbs_imports_no_verb() -> None:
    show = "print(__import__('json').dumps([m for m in sys.modules if m.startswith(('numpy', 'lampyris.'))]))"
    loaded = last(run(CLI + show, "--help"))
    assert "lampyris.cli.verb_group" in loaded
    unneeded = ("numpy", "lampyris.cli.verbs", "lampyris.cli.option_groups", "lampyris.model")
    assert [name for name in loaded if name.startswith(unneeded)] == []


def test_nothing_is_compiled_when_kernels_are_imported() -> None:
    code = """
    import importlib, pkgutil, sys, lampyris.kernels as kernels
    for module in pkgutil.walk_packages(kernels.__path__, "lampyris.kernels."):
        importlib.import_module(module.name)
    from lampyris.kernels._jit import KERNELS
    assert len(KERNELS) > 100
    assert all(k._compiled is None for k in KERNELS)
    assert "numba" not in sys.modules
    """
    assert run(code).returncode == 0


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("size", "planner", "want"),
    some(
        [
            (316, "ad-gso", []),
            (512, "astar", ["search"]),
            (50, "ad-gso", []),
            (316, "astar", []),
            (316, "jps", []),
            (512, "ad-gso", ["windows", "parents8", "glow"]),
        ],
        2,
    ),
)
def test_kernels_that_a_plan_compiles(size: int, planner: str, want: list[str], tmp_path: Path) -> None:
    """100,000 cells need no numba; of large maps the whole is compiled, and what follows one way is not."""
    code = PRETEND + CLI + "print(__import__('json').dumps(compiled))"
    words = [*square(tmp_path, size), "--json", "--planner", planner]
    assert last(run(code, *words, NUMBA_CACHE_DIR=str(tmp_path))) == want


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    ("size", "planner", "terrain", "plain"),
    some(
        [
            (316, "ad-gso", True, True),
            (316, "astar", True, False),
            (200, "dstar", False, True),
            (316, "dstar-lite", True, True),
            (316, "bidirectional-astar", False, True),
            (316, "theta-star", False, False),
            (316, "lpa-star", False, False),
            (200, "theta-star", True, True),
            (200, "sipp", True, True),
        ],
        3,
    ),
)
def test_plans_that_need_no_numba(
    size: int, planner: str, terrain: bool, plain: bool, tmp_path: Path
) -> None:
    """The corners of the table in docs/performance.md: no machine code is kept."""
    code = f"""
    import json, numpy as np
    from lampyris import api
    from lampyris.model.grid import Grid
    from lampyris.model.scene import Scene
    rng = np.random.default_rng({size})
    blocked = rng.random(({size}, {size})) < 0.1
    blocked[:3, :3] = blocked[-3:, -3:] = False
    ground = np.where(blocked, 0, rng.integers(0, 200, blocked.shape)).astype(np.uint8)
    scene = Scene(Grid(blocked, terrain=ground if {terrain} else None), (0, 0), ({size - 1}, {size - 1}))
    assert api.plan(scene, {planner!r}).path is not None
    print(json.dumps(not compiled))
    """
    assert last(run(PRETEND + textwrap.dedent(code), NUMBA_CACHE_DIR=str(tmp_path))) is plain


@pytest.mark.nightly
def test_the_second_process_compiles_nothing(tmp_path: Path) -> None:
    code = COUNT + CLI + "print(__import__('json').dumps(sum(made)))"
    words = ("plan", "guide", "--planner", "dijkstra", "--json")
    env = {"NUMBA_CACHE_DIR": str(tmp_path)}
    assert last(run(code, *words, **env)) > 0
    assert list(tmp_path.rglob("*.nbc"))
    assert last(run(code, *words, **env)) == 0


UNPREPARED = """
import json, sys
import numpy as np
from lampyris.kernels import _jit
from lampyris.kernels.motion.speed_passes import clock
_jit.prefer_compiled()
made = []
_jit.on_compile(made.append)
t = np.zeros(4)
clock(np.array([1.0, 2.0, 3.0]), t)
print(json.dumps([t.tolist(), sum(made), "numba.np.arraymath" in sys.modules, "scipy.linalg" in sys.modules]))
"""


@pytest.mark.nightly
def test_kept_machine_code_is_read_without_preparing_to_compile(tmp_path: Path) -> None:
    """Who compiles imports what numba can compile, without SciPy's linear algebra; who reads what was kept does not."""
    env = {"NUMBA_CACHE_DIR": str(tmp_path)}
    assert last(run(UNPREPARED, **env)) == [[0, 1, 3, 6], 1, True, False]
    assert last(run(UNPREPARED, **env)) == [[0, 1, 3, 6], 0, False, False]


THREADS = """
import json, os
from lampyris import cli
cli.main = lambda: None
cli.program()
print(json.dumps({name: os.environ[name] for name in cli.THREADS if name in os.environ}))
"""


@pytest.mark.parametrize("given", [{}, {"OMP_NUM_THREADS": "3"}, {"OPENBLAS_NUM_THREADS": "2"}])
def test_openblas_starts_no_threads_unless_it_is_told(
    given: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    assert last(run(THREADS, **given)) == (given or {"OPENBLAS_NUM_THREADS": "1"})


def test_the_load_of_a_kernel_counts_no_frozen_objects() -> None:
    """Python goes through all of them for their number: 20 to 80 ms a kernel in a process with a million of them."""
    code = """
    import gc
    from unittest import mock
    from lampyris.kernels._machine import uncollected
    gc.collect()
    with mock.patch.object(gc, "get_freeze_count", side_effect=AssertionError("counted")):
        with uncollected():
            few = [[] for _ in range(1000)]
    """
    done = run(code)
    assert done.returncode == 0, done.stderr


def test_what_an_import_leaves_counts_as_old() -> None:
    """Otherwise a garbage collection would follow; what somebody froze stays frozen."""
    code = """
    import gc
    born = gc.get_freeze_count()  # Python 3.12 begins with some: they must not thaw
    from lampyris.kernels._machine import uncollected
    with uncollected():
        assert not gc.isenabled()
        kept = [[] for _ in range(20_000)]
    assert gc.isenabled()
    old = {id(one) for one in gc.get_objects(generation=2)}
    assert gc.get_freeze_count() == born
    assert born or all(id(one) in old for one in kept)
    gc.freeze()
    frozen = gc.get_freeze_count()
    with uncollected():
        more = [[] for _ in range(20_000)]
    assert gc.isenabled() and gc.get_freeze_count() == frozen > 1000
    gc.disable()
    with uncollected():
        pass
    assert not gc.isenabled()
    """
    done = run(code)
    assert done.returncode == 0, done.stderr


SMALL = """
import json, sys, warnings, numpy as np
warnings.simplefilter("always")
from lampyris.kernels import _jit
from lampyris.kernels.motion.speed_passes import clock, sweep
_jit.prefer_compiled()
t = np.zeros(4)
clock(np.array([1.0, 2.0, 3.0]), t)
again = np.zeros(3)
clock(np.array([1.0, 2.0]), again)
assert (t.tolist(), again.tolist()) == ([0, 1, 3, 6], [0, 1, 3])
print(json.dumps(clock.cache_folder()))
"""


@pytest.fixture
def sealed(tmp_path: Path) -> Path:
    """A copy of the kernels beside which nobody can write: a file is where a folder would be."""
    home = Path(lampyris.__file__).parent
    for part in ("__init__.py", "_core", "kernels"):
        copy = shutil.copytree if (home / part).is_dir() else shutil.copy
        (tmp_path / "lampyris").mkdir(exist_ok=True)
        copy(home / part, tmp_path / "lampyris" / part)
    kernels = tmp_path / "lampyris" / "kernels"
    for folder in {kernels, *(file.parent for file in kernels.rglob("*.py"))}:
        shutil.rmtree(folder / "__pycache__", ignore_errors=True)
        (folder / "__pycache__").touch()
    return tmp_path


@pytest.mark.nightly
def test_a_read_only_installation_keeps_code_in_the_users_folder(sealed: Path) -> None:
    mine = sealed / "mine"
    done = run(SMALL, PYTHONPATH=str(sealed), XDG_CACHE_HOME=str(mine), HOME=str(mine))
    assert Path(last(done)).is_relative_to(mine)
    assert list(mine.rglob("*.nbc"))
    assert not done.stderr


@pytest.mark.nightly
def test_what_is_kept_belongs_to_all_files_of_kernels(sealed: Path) -> None:
    """A constant of one is compiled into another, and how it is done stands in a third."""
    count = COUNT + SMALL + "print(json.dumps(sum(made)))"
    env = {"PYTHONPATH": str(sealed), "NUMBA_CACHE_DIR": str(sealed / "kept")}
    assert last(run(count, **env)) > 0
    assert last(run(count, **env)) == 0
    for name in ("_machine.py", "field/weighted_wavefront.py"):
        with (sealed / "lampyris" / "kernels" / name).open("a") as file:
            file.write("SPARE = 1\n")
        assert last(run(count, **env)) > 0


@pytest.mark.nightly
def test_where_nothing_can_be_kept_it_works_and_says_so_once(sealed: Path) -> None:
    nowhere = {"XDG_CACHE_HOME": os.devnull, "HOME": os.devnull, "NUMBA_CACHE_DIR": os.devnull + "/x"}
    done = run(SMALL, PYTHONPATH=str(sealed), **nowhere)
    assert last(done) is None
    assert done.stderr.count("NothingKept: compiled code cannot be kept on disk") == 1, done.stderr
    assert "NUMBA_CACHE_DIR" in done.stderr


FULL_DISK = """
import warnings
from numba.core import caching
from lampyris.kernels import _jit
warnings.simplefilter("always")
def save(self, *args):
    raise OSError(28, "No space left on device")
caching.IndexDataCacheFile.save = save
"""


@pytest.mark.nightly
def test_a_full_disk_does_not_stop_a_kernel(tmp_path: Path) -> None:
    done = run(FULL_DISK + SMALL, NUMBA_CACHE_DIR=str(tmp_path))
    assert last(done) is None
    assert done.stderr.count("NothingKept") == 1, done.stderr
    assert "No space left on device; set NUMBA_CACHE_DIR to a folder" in done.stderr


@pytest.mark.nightly
def test_a_full_disk_does_not_stop_several_threads(tmp_path: Path) -> None:
    """Both are at the same kernel: the second comes upon it when the first has said so already."""
    code = """
    import json, numpy as np
    from lampyris.planning.field.many import solve_many
    from lampyris.model.moves import MOVES
    _jit.prefer_compiled()
    free = np.ones((5, 6), dtype=np.bool_)
    free.setflags(write=False)
    many = solve_many(free, MOVES["four-connected"], [(0, 0), (1, 1), (2, 2)], workers=2)
    print(json.dumps([int(field.exact.max()) for field in many]))
    """
    done = run(FULL_DISK + textwrap.dedent(code), NUMBA_CACHE_DIR=str(tmp_path))
    assert last(done) == [9, 7, 5]
    assert done.stderr.count("NothingKept") == 1, done.stderr


DAMAGES = {
    "cut short": lambda content: content[:20],
    "half": lambda content: content[: len(content) // 2],
    "zeros": lambda content: bytes(len(content)),
    "flipped": lambda content: bytes(b ^ 16 for b in content),
    "garbage": lambda content: np.random.default_rng(len(content)).bytes(len(content)),
}


@pytest.mark.nightly
@pytest.mark.parametrize("how", some(DAMAGES))
def test_damaged_machine_code_does_not_stop_a_kernel(how: str, tmp_path: Path) -> None:
    """It is said where it lies, and what to do."""
    assert last(run(SMALL, NUMBA_CACHE_DIR=str(tmp_path)))
    kept = list(tmp_path.rglob("*.nb[ic]"))
    for file in [*kept, *tmp_path.rglob("*.code")]:
        file.write_bytes(DAMAGES[how](file.read_bytes()))
    done = run(SMALL, NUMBA_CACHE_DIR=str(tmp_path))
    assert last(done) is None
    assert done.stderr.count("NothingKept") == 1, done.stderr
    assert f"kept in {kept[0].parent} is damaged" in done.stderr
    assert any(file.name in done.stderr for file in kept)
    assert "delete it, or run `lampyris warm`" in done.stderr
    assert "NUMBA_CACHE_DIR" not in done.stderr


def test_an_error_that_is_not_the_disks_is_raised(tmp_path: Path) -> None:
    """Nothing is damaged: the arguments are wrong."""
    code = """
    from lampyris.kernels import _jit
    from lampyris.kernels.motion.speed_passes import clock
    _jit.prefer_compiled()
    try:
        clock(1.0)
    except TypeError:
        print(_jit._keeping and "true")
    """
    done = run(code, NUMBA_CACHE_DIR=str(tmp_path))
    assert last(done) is True
    assert "NothingKept" not in done.stderr


@pytest.mark.nightly
def test_the_command_line_says_it_as_a_note(tmp_path: Path) -> None:
    warn = """
    import warnings
    from lampyris.kernels import _jit
    from lampyris.planning import registry
    make = registry.make
    def loud(*args, **more):
        warnings.warn(_jit.NothingKept("nothing is kept"), stacklevel=2)
        return make(*args, **more)
    registry.make = loud
    """
    done = run(textwrap.dedent(warn) + CLI, "plan", "guide")
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines() == ["note: nothing is kept"]
