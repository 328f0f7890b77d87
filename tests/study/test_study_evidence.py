"""Evidence of a wrong form is a typed error, and is never unpacked beyond what it says."""

from __future__ import annotations

import base64
import copy
import tracemalloc
import zlib
from typing import Any

import numpy as np
import pytest
from lies import LIVE, honest, judged
from one_samples import (
    study_of,
)  # fmt: skip

from lampyris.errors import FileError, LimitError
from lampyris.study.execution import evidence
from sizes import sized


def test_blocks_are_not_unpacked_beyond_what_they_say() -> None:
    form = {"a": ("<i4", 1)}
    good = evidence.pack_arrays({"a": np.arange(9)}, form)
    assert np.array_equal(evidence.unpack_arrays(good, form)["a"], np.arange(9))
    bomb = base64.b64encode(zlib.compress(bytes(50_000_000))).decode()
    more = base64.b64encode(base64.b64decode(good["block"]) + b"more").decode()
    tracemalloc.start()
    with pytest.raises(FileError):
        evidence.unpack_arrays({"shapes": [["a", [9]]], "block": bomb}, form)
    assert tracemalloc.get_traced_memory()[1] < 2_000_000
    tracemalloc.stop()
    for shapes, block in (
        ([["a", [9]]], bomb), ([["a", [8]]], good["block"]), ([["a", [10]]], good["block"]),
        ([["a", [-9]]], good["block"]), ([["a", [3, 3]]], good["block"]), ([["b", [9]]], good["block"]),
        ([["a", [9.0]]], good["block"]), ([["a", [True]]], good["block"]), ([["a", [9]]], "!"),
        ([["a", [9]]], more),
        ([["a", [9]]], base64.b64encode(b"x").decode()), ([["a", [9]]], good["block"][:-4]),
        ([["a", [9]], ["a", [9]]], good["block"]),
    ):  # fmt: skip
        with pytest.raises(FileError):
            evidence.unpack_arrays({"shapes": shapes, "block": block}, form)
    with pytest.raises(LimitError):
        evidence.unpack_arrays({"shapes": [["a", [2**40]]], "block": good["block"]}, form)


@sized("cases", 30, 250)
@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
def test_damaged_evidence_never_raises(kind: str, cases: int) -> None:
    """Values of every field swapped for others, deep down; rows that still stand say the same as before."""
    study = study_of(kind, ("astar",), LIVE)
    true = honest(study)
    before = dict(judged(study, true).metrics)
    rng = np.random.default_rng(3)
    values = [None, -1, 0, 10**30, 2.5, "x", "", [], {}, [[]], True, "found", [1, 2], float("inf")]

    def swap(told: Any) -> None:
        """One value somewhere in it."""
        keys = list(told) if isinstance(told, dict) else range(len(told))
        key = keys[int(rng.integers(len(keys)))]
        if isinstance(told[key], dict | list) and told[key] and rng.random() < 0.7:
            swap(told[key])
        else:
            told[key] = values[int(rng.integers(len(values)))]

    failed = 0
    for _ in range(cases):
        made = copy.deepcopy(true)
        swap(made["evidence"])
        row = judged(study, made)
        assert row.ending in ("done", "failed")
        failed += row.ending == "failed"
        if row.ending == "done":
            same = [name for name in before if row.metrics[name] == before[name]]
            assert len(same) >= len(before) - 2, made["evidence"]
    assert failed > 0.4 * cases
