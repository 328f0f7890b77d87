"""Sums over walks of straight legs: by the kernel what NumPy finds step by step."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from lampyris.kernels import _jit, kept_code
from lampyris.kernels.swarm.line_walks import walk_sums
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.swarm.fitness_terms import Weights, score
from lampyris.planning.swarm.search_space import SearchSpace
from lampyris.planning.swarm.walks import LineWalks


@pytest.mark.parametrize("terrain", [False, True], ids=["plain", "terrain"])
@pytest.mark.parametrize("moves", ["octile", "dissertation", "four-connected"])
def test_the_kernel_adds_up_what_numpy_does(
    moves: str, terrain: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(len(moves))
    blocked = rng.random((30, 40)) < 0.2
    blocked[0, 0] = blocked[-1, -1] = False
    price = np.where(blocked, 0, rng.integers(0, 200, blocked.shape)).astype(np.uint8)
    scene = Scene(Grid(blocked, terrain=price if terrain else None), (0, 0), (39, 29), moves=moves)
    ground = SearchSpace(scene, moves_for(scene), free_space(scene), frozenset())
    # Eight walks of five legs; nodes may be equal, so that a leg has no step.
    nodes = np.stack((rng.integers(0, 40, (8, 6)), rng.integers(0, 30, (8, 6))), axis=2)
    nodes[:, 0], nodes[:, -1] = (0, 0), (39, 29)
    nodes[:, 2] = nodes[:, 1]
    walks, weights = LineWalks(ground, nodes.astype(np.int64)), Weights()
    with monkeypatch.context() as numpy_only:
        numpy_only.setattr(_jit.Kernel, "pays", lambda kernel, *args: False)
        want = score(ground, walks, weights)
    calls: list[_jit.Kernel] = []

    def noted(kernel: _jit.Kernel, *_: object) -> bool:
        calls.append(kernel)
        return True

    monkeypatch.setattr(_jit.Kernel, "pays", noted)
    found = score(ground, walks, weights)
    assert calls == [walk_sums]
    assert np.array_equal(found.exact, want.exact)
    assert np.array_equal(found.legal, want.legal)
    assert found.fitness.tobytes() == want.fitness.tobytes()
    sums = walks.sums(near=False)
    assert sums is not None
    assert (sums[:, 3] == 0).all()


def test_the_kernel_is_asked_where_it_runs_in_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    ground, nodes = np.zeros(4, dtype=np.int64), np.zeros(200, dtype=np.int64)
    args = (*[ground] * 9, nodes, nodes, nodes, 1, nodes)
    monkeypatch.setattr(walk_sums, "_compiled", None)
    monkeypatch.setattr(walk_sums, "_spent", 0)
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert not walk_sums.pays(*args)
    monkeypatch.delenv("NUMBA_DISABLE_JIT")
    monkeypatch.setitem(sys.modules, "numba", sys)
    assert walk_sums.pays(*args)  # 200 legs are more than may be spent on its plain form
    monkeypatch.delitem(sys.modules, "numba")
    monkeypatch.setattr(kept_code, "is_loaded", lambda: False)
    assert not walk_sums.pays(*args)
    with _jit.compiled_only():
        assert walk_sums.pays(*args)
