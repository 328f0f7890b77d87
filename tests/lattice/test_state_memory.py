"""Memory of searches is handed on from session to session, and changes no answer."""

from __future__ import annotations

import gc

import numpy as np
from lattice_scenes import FOOTPRINTS, scene_of

from lampyris.planning.lattice import state_memory
from lampyris.planning.lattice.lattice_planner import LatticePlanner, LatticeSession


def opened(seed: int) -> LatticeSession:
    scene = scene_of(seed, "differential", FOOTPRINTS["square"])
    return LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0))


def test_sessions_one_after_the_other_share_it_and_answer_as_new_ones() -> None:
    fresh = []
    for seed in range(4):
        state_memory._unused.clear()
        fresh.append(opened(seed).plan())
        gc.collect()
    runs = []
    for seed in range(4):
        session = opened(seed)
        assert session.plan() == fresh[seed]
        assert session._search is not None
        runs.append(session._search._memory.run)
        del session
        gc.collect()
    assert runs == sorted(runs)
    assert runs[-1] > runs[0]


def test_sessions_at_a_time_do_not_share_it() -> None:
    one, other = opened(1), opened(1)
    assert one.plan() == other.plan()
    assert one._search is not None
    assert other._search is not None
    assert one._search._memory is not other._search._memory
    assert one.plan() == other.plan()


def test_large_memory_is_not_kept() -> None:
    class Owner:
        pass

    state_memory._unused.clear()
    owner = Owner()
    state_memory.memory_for(owner, state_memory.KEPT_BYTES // 11 + 1)
    del owner
    gc.collect()
    assert not state_memory._unused
