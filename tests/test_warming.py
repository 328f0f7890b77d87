"""``lampyris warm`` leaves out no kernel, and none of the argument types that work asks for."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris import api
from lampyris.errors import LampyrisError
from lampyris.fleets import plan_fleet, random_fleet
from lampyris.kernels import _jit
from lampyris.model.edit import Edit
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Patrol, RandomWalk
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.planning.base import Budget
from lampyris.planning.fleet.distance_tables import wide_tables
from lampyris.planning.fleet.registry import list_fleet_planners
from lampyris.warming import wanted, warm
from sizes import some


@pytest.fixture(scope="module")
def ready() -> set[Any]:
    """What is compiled."""
    return set(wanted())


def ours() -> set[_jit.Kernel]:
    """Kernels of the package; tests may have made others, of altered copies of its modules too."""
    there = {
        one
        for name, module in list(sys.modules.items())
        if name.startswith("lampyris.kernels.")
        for one in vars(module).values()
        if isinstance(one, _jit.Kernel)
    }
    return there & set(_jit.KERNELS)


def callees(k: _jit.Kernel) -> set[_jit.Kernel]:
    """The kernels that a kernel calls, and those that they call."""
    known = k.plain.__globals__
    called = {c for name in k.plain.__code__.co_names if isinstance(c := known.get(name), _jit.Kernel)}
    return called.union(*map(callees, called - {k}))


@pytest.mark.nightly
def test_no_kernel_is_left_out(ready: set[Any]) -> None:
    called = {k for k, _ in ready}
    inside = {callee for k in called for callee in callees(k)}
    assert len(called) > 50
    assert {k.__name__ for k in ours() - called - inside} == set()


def hall(terrain: bool, unknown: bool, seed: int) -> Grid:
    """A map unlike those that the jobs of `warm` run on."""
    rng = np.random.default_rng(seed)
    blocked = rng.random((26, 33)) < 0.2
    blocked[:3, :3] = blocked[-3:, -3:] = False
    ground = np.where(blocked, 0, rng.integers(0, 250, blocked.shape)).astype(np.uint8)
    hidden = (rng.random(blocked.shape) < 0.05) & ~blocked if unknown else None
    if hidden is not None:
        hidden[:3, :3] = hidden[-3:, -3:] = False
        blocked = blocked | hidden
    ground = np.where(blocked, 0, ground).astype(np.uint8)
    return Grid(blocked, hidden, 0.5, terrain=ground if terrain else None)


def simulations(moves: str, terrain: bool, seed: int) -> int:
    """Every planner: runs among moving obstacles, and walls; how many there were."""
    ran = 0
    edits = (Edit(3, blocked=((10, 10), (11, 10))), Edit(6, freed=((10, 10), (12, 12))))
    walkers = (RandomWalk(4), Patrol(((0, 2), (2, 0))))
    for name in registry.names():
        if registry.origin_of(name):
            continue
        few = {"iterations": 2} if "iterations" in registry.settings_of(registry.planner_class(name)) else {}
        for more in ({"traffic": walkers}, {"traffic": walkers, "edits": edits, "robot": Robot(0.1)}):
            scene = Scene(hall(terrain, False, seed), (0, 0), (32, 25), moves=MOVES[moves], **more)
            try:
                api.simulate(scene, name, ticks=10, **few)
            except LampyrisError:  # a planner that does not serve such moves or such ground
                continue
            ran += 1
    return ran


def speeds(seed: int) -> int:
    """Every law: profiles of a path and of a curve, and a drive; how many laws."""
    scene = Scene(
        hall(False, bool(seed % 2), seed), (0, 0), (32, 25), robot=Robot(0.1), traffic=(RandomWalk(3),)
    )
    path = api.plan(scene, "astar").path
    assert path is not None
    around = ObstacleStates(np.array([[8.0, 8.0]]), np.ones(1), np.ones(1), np.array([[0.1, 0.2]]))
    for law in laws.names():
        api.speed_profile(scene, path, law)
        with suppress(LampyrisError):
            api.speed_profile(scene, path, law, smooth="straight", obstacle_states=around)
        api.drive(scene, "ad-gso", law=law, time_limit=2.0)
    return len(laws.names())


def fleets_planned(seed: int) -> int:
    """Every planner of fleets, by both step sets, with tables of both kinds of numbers; how many plans."""
    fleet = random_fleet(hall(False, False, seed), 9, seed=seed)
    disc = Fleet(fleet.grid, [Agent((0, 0), (0, 1), Robot(radius=0.25))])
    planned = 0
    for name, row in list_fleet_planners().items():
        for moves in row.traits.moves:
            for one in (fleet, disc) if row.traits.sizes else (fleet,):
                for tables in (nullcontext(), wide_tables()):
                    with tables:
                        plan_fleet(one, name, moves=moves, budget=Budget(expansions=100))
                    planned += 1
    return planned


WORK = {
    "fleets": lambda: fleets_planned(10),
    "octile": lambda: simulations("octile", False, 1),
    "dissertation": lambda: simulations("dissertation", False, 2),
    "four-connected": lambda: simulations("four-connected", False, 3),
    "sixteen-connected": lambda: simulations("sixteen-connected", False, 4),
    "terrain, octile": lambda: simulations("octile", True, 5),
    "terrain, sixteen": lambda: simulations("sixteen-connected", True, 6),
    "speeds": lambda: speeds(7),
    "speeds past the unknown": lambda: speeds(8),
}


LONG = ("dissertation", "four-connected", "sixteen-connected", "terrain, octile", "speeds past the unknown")
"""For the night: of the step sets a commit has the one without and the one with terrain that ask for most."""


LEAST = {
    "fleets": 20, "octile": 30, "dissertation": 30, "four-connected": 20, "sixteen-connected": 20, "terrain, octile": 20,
    "terrain, sixteen": 10, "speeds": 5, "speeds past the unknown": 5,
}  # fmt: skip


def test_a_drive_asks_for_one_version_whether_obstacles_walk_at_random_or_not() -> None:
    """It is the kernel that takes longest to compile."""
    walls = np.zeros((12, 12), dtype=bool)
    with _jit.recorded() as asked:
        for traffic in ((), (RandomWalk(1),)):
            scene = Scene(Grid(walls), (0, 0), (11, 11), traffic=traffic)
            api.drive(scene, "astar", seed=1, time_limit=1.0)
    assert len([k for k, _ in asked if k.full_name == "lampyris.kernels.simulation.drive.advance"]) == 1


@pytest.mark.nightly
@pytest.mark.parametrize("what", some(sorted(WORK, key=LONG.__contains__), len(WORK) - len(LONG)))
def test_work_asks_for_nothing_else(what: str, ready: set[Any]) -> None:
    with _jit.recorded() as asked:
        done = WORK[what]()
    assert done >= LEAST[what]
    missing = {f"{k.plain.__module__}.{k.__name__}{types}" for k, types in asked.keys() - ready}
    assert missing == set()


@pytest.mark.nightly
def test_one_version_each_but_for_wide_costs(ready: set[Any]) -> None:
    """A second version may only differ in the width of numbers: of costs, as the step set needs, or of tables of distances."""
    versions: dict[_jit.Kernel, list[Any]] = {}
    for k, types in ready:
        versions.setdefault(k, []).append(types)
    for k, several in versions.items():
        assert len(several) <= 2, k.__name__
        for pair in zip(*several, strict=True):
            widths = {re.sub("int(16|32)", "int64", str(t)) for t in pair}
            assert len(widths) == 1, (k.__name__, pair)


@pytest.mark.nightly
@pytest.mark.parametrize("workers", [1, 2])
def test_asked_again_there_is_nothing_to_do(tmp_path: Path, workers: int) -> None:
    """Progress is told, and the folder and its bytes are right, whoever compiles."""
    code = """
import sys
import json, numba, numpy as np, lampyris.warming as w
from lampyris.kernels.graph.bits import ahead, bit
types = numba.typeof(np.zeros(1, np.uint64)), numba.int64
w.wanted = lambda rare: ((ahead, types), (bit, types))
told = []
first = w.warm(lambda *now: told.append(now), int(sys.argv[1]))
second = w.warm()
print(json.dumps([first.made, second.made, first.size, [str(f) for f in first.folders], told[-1][:2]]))
"""
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_DISABLE_JIT"} | {
        "NUMBA_CACHE_DIR": str(tmp_path)
    }
    done = subprocess.run(
        [sys.executable, "-c", code, str(workers)], env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    made, again, size, folders, told = json.loads(done.stdout)
    assert (made, again, told) == (2, 0, [2, 2])
    assert all(Path(f).is_relative_to(tmp_path) for f in folders)
    kept = [*tmp_path.rglob("*.nb[ic]"), *tmp_path.rglob("*.code")]
    assert size == sum(f.stat().st_size for f in kept)


@pytest.mark.nightly
@pytest.mark.parametrize("how", some(["cut short", "half", "zeros", "flipped", "garbage"]))
def test_damaged_code_is_made_anew(how: str, tmp_path: Path) -> None:
    """The file of a kernel that another calls is damaged, too; what an older version left is deleted."""
    code = f"""
import json, numba, numpy as np, lampyris.warming as w
from pathlib import Path
from lampyris.kernels import _jit, kept_code
from lampyris.kernels.graph.bits import ahead, bit
from test_start import DAMAGES
types = numba.typeof(np.zeros(1, np.uint64)), numba.int64
w.wanted = lambda rare: ((ahead, types), (bit, types))
w.warm()
for file in Path({str(tmp_path)!r}).rglob("*.nb[ic]"):
    file.write_bytes(DAMAGES[{how!r}](file.read_bytes()))
old = Path(bit.cache_folder()) / "bits.bit_0123456789abcdef-9.py311.nbi"
other = kept_code.folders()[0] / "lampyris.kernels.graph.bits.bit-0123456789abcdef-9.code"
for one in (old, other):
    one.touch()
_jit.forget()
again = w.warm()
_jit.forget()
print(json.dumps([again.made, w.warm().made, old.exists() or other.exists(), w._machine.damaged(old.parent)]))
"""
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_DISABLE_JIT"} | {
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([*sys.path, str(Path(__file__).parent)]),
    }
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [2, 0, False, []]


def test_without_a_compiler_there_is_nothing_to_warm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    with pytest.raises(LampyrisError, match="NUMBA_DISABLE_JIT") as refused:
        warm()
    assert refused.value.exit_code == 2


def test_where_nothing_can_be_kept_warm_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    monkeypatch.setattr("lampyris.warming.wanted", lambda rare: ((next(iter(ours())), ()),))
    monkeypatch.setattr(_jit.Kernel, "prepare", lambda self, types: False)
    monkeypatch.setattr(_jit.Kernel, "cache_folder", lambda self: None)
    with pytest.raises(LampyrisError, match="cannot be kept") as refused:
        warm()
    assert refused.value.exit_code == 3


@pytest.mark.nightly
def test_after_warm_nothing_is_compiled(tmp_path: Path) -> None:
    """The real thing: all is compiled, and then every kind of work in another process compiles nothing."""
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_DISABLE_JIT"}
    env |= {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    first = "from lampyris.cli import main; import sys; sys.argv = ['lampyris', 'warm', '--json']; main()"
    done = subprocess.run([sys.executable, "-c", first], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["made"] > 60
    then = """
import json
from lampyris.kernels import _jit
_jit.prefer_compiled()
made = []
_jit.on_compile(made.append)
import test_warming
for work in test_warming.WORK.values():
    work()
print(json.dumps(sum(made)))
"""
    env["PYTHONPATH"] += os.pathsep + str(Path(__file__).parent)
    done = subprocess.run([sys.executable, "-c", then], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == 0
